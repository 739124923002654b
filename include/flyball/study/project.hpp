#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/errors.hpp>
#include <flyball/study/drive_section.hpp>
#include <flyball/study/experiment.hpp>
#include <flyball/study/model_job.hpp>
#include <flyball/study/optimize_section.hpp>
#include <flyball/study/size_section.hpp>
#include <flyball/study/tune.hpp>

namespace flyball::study {

/// What is wrong with a project file; each error carries file, line and column in `where`.
enum class ProjectError {
  syntax,       ///< Not TOML.
  unknown_key,  ///< A key that means nothing; the nearest valid one is the hint.
  missing_key,  ///< A key without which the mechanism is not defined.
  wrong_type,   ///< A number where a text with a unit is needed, or the like.
  wrong_value,  ///< A value that cannot be.
  more_errors,  ///< Further errors, which are not told one by one.
};
[[nodiscard]] ErrorInfo error_info(ProjectError code);

/// [mechanism.motor]: the datasheet of a motor that the table does not know, for one motor.
struct CustomMotor {
  Voltage nominal_voltage{12.0};
  Torque stall_torque{};
  Current stall_current{};
  Current free_current{};
  AngularVelocity free_speed{};
};

/// [mechanism]: what it is, and what it is made of. Which parts a kind needs is a row of
/// src/study/mechanism_parts.cpp.
struct MechanismParts {
  std::optional<mechanisms::MechanismKind> type{};
  std::string motor{};                        ///< A name of the motor table,
  std::optional<CustomMotor> custom_motor{};  ///< or [mechanism.motor].
  std::optional<int> motor_count{};           ///< In one gearbox; one if absent.
  std::optional<double> gearing{};            ///< Motor turns per output turn.
  std::optional<Mass> mass{};
  std::optional<Length> drum_radius{};
  std::optional<Length> wheel_radius{};
  std::optional<MomentOfInertia> moment_of_inertia{};
  std::optional<Length> center_of_mass{};
  std::vector<std::string> stages{};      ///< Masses of an elevator's stages, the drum's first.
  std::optional<Force> counterbalance{};  ///< Constant, on an elevator's carriage, upward.
};

/// [gains]: feedforward gains that stand in place of those of the parts.
struct KnownGains {
  std::optional<double> kS{}, kV{}, kA{}, kG{};  ///< V, V·s/unit, V·s²/unit, V.
  std::optional<double> kA_upper_bound{};        ///< V·s²/unit, of a kA that is not known.
  std::optional<Angle> angle_offset{};
};

/// A value of the command line, which stands in place of the file's.
struct Override {
  std::string option;  ///< "--max-voltage"
  std::string text;    ///< "10 V"; a list's values are separated by commas.
};

/// A TOML project file: what it says, and the design job that it describes. A file that only sets
/// controller options can accompany a log; then `plant_error` tells what it would need to stand
/// alone.
struct Project {
  std::string path{};
  MechanismParts parts{};
  KnownGains gains{};
  recording::LogSelection log{};
  FormulaSection model{};  ///< In place of a mechanism.
  PointSection point{};
  SimulationSection simulation{};
  ExperimentLimits experiment{};
  FitSection fit{};
  EstimateSection estimate{};
  SwingUpSection swing_up{};
  SizeSection size{};
  DriveSection drive{};
  DisturbanceSection disturbance{};
  OptimizeSection optimize{};
  DesignJob job;  ///< Its plant comes from the parts and the gains.
  /// Why the file does not define a mechanism, if it does not: all that is missing.
  std::optional<Errors> plant_error{};
  std::optional<ModelJob> model_job{};          ///< What a file with [model] describes.
  ModelRun mechanism_run{.closed_loop = true};  ///< What [simulation] says of a mechanism.
};

/// Reads a project file. @param overrides  They are checked like the file's own values.
/// @errors ProjectError, FileError, ArgumentError (units, motors); all that is wrong with the file
///         and the overrides, in their order: the first, and the others beside it.
[[nodiscard]] ExpectedAll<Project> read_project(const std::string& path,
                                                std::span<const Override> overrides = {});

/// Parses its text. @param name  The file's name for messages.
[[nodiscard]] ExpectedAll<Project> parse_project(std::string_view text, const std::string& name,
                                                 std::span<const Override> overrides = {});

/// The project that describes a job: its plant as known gains.
[[nodiscard]] Project project_of(const DesignJob& job);

/// A comment beside a key; on a line of its own if the key has no value.
struct KeyComment {
  std::string key;  ///< "gains.kV"
  std::string text;
};
/// The project as the text of a file that reads back as it is.
/// @param heading  Lines to begin with, commented out. @param sections  Those to write; all if none
///                 is named.
[[nodiscard]] std::string write_project(const Project& project, std::string_view heading = {},
                                        std::span<const std::string_view> sections = {},
                                        std::span<const KeyComment> comments = {});

/// The gains of a fit as a project file, intervals as comments; without gains (a refused fit)
/// empty.
[[nodiscard]] std::string gains_toml(const IdentifyResult& result);
/// The gains with everything that the design was made with; `flyball design` repeats it.
/// @param fit  For the intervals; may be null.
[[nodiscard]] std::string gains_toml(const DesignResult& result,
                                     const identification::FeedforwardFit* fit);

// The jobs of a command line.

/// @errors as `read_project`, and Project::plant_error.
[[nodiscard]] ExpectedAll<DesignJob> design_job(const std::string& project,
                                                std::span<const Override> overrides = {});
/// A file that stands beside a log, which may say the rest. @errors as `read_project`.
[[nodiscard]] ExpectedAll<Project> read_project_beside_log(
    const std::string& path, std::span<const Override> overrides = {});
/// @param project  May be empty: no file. @errors as `read_project`.
[[nodiscard]] ExpectedAll<IdentifyJob> identify_job(const std::string& log,
                                                    const std::string& project,
                                                    std::span<const Override> overrides = {});
/// The same.
[[nodiscard]] ExpectedAll<TuneJob> tune_job(const std::string& log, const std::string& project,
                                            std::span<const Override> overrides = {});

/// @param file  A log, or a project file (its name ends in .toml) of a mechanism that has none yet.
/// @errors as `identify` and `design_job`.
[[nodiscard]] ExpectedAll<ExperimentJob> experiment_job(const std::string& file,
                                                        std::span<const Override> overrides = {});

/// The jobs whose fields a person may set.
enum class JobKind {
  identify,
  design,
  tune,
  analyze,
  simulate,
  experiment,
  estimate,
  size,
  drive,
  optimize
};

/// A field of a job, for whoever asks a person for it: a command line, a form, a binding.
struct FieldInfo {
  std::string section;  ///< "controller"
  std::string key;      ///< "max_voltage"
  std::string option;   ///< "--max-voltage"
  std::string value;    ///< What it takes, for a help text: "VOLTAGE"; empty of a flag.
  std::string help;     ///< "Limit of the voltage"
  std::string example;  ///< As an option takes it: "12V".
  std::string absent;   ///< What holds without it: "12 V", "needed by elevator, arm".
};
/// Every field of a job that has an option, in the order of the file.
[[nodiscard]] std::vector<FieldInfo> fields_of(JobKind job);

/// The project file's tables for docs/project-file.md.
[[nodiscard]] std::string project_markdown();
/// The project file's JSON Schema (draft 2020-12), which editors of TOML take too.
[[nodiscard]] std::string project_schema();

}  // namespace flyball::study
