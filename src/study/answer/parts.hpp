#pragma once

#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <flyball/io/json_writer.hpp>
#include <flyball/study/answer.hpp>

/// Pieces that the answers are put together from.
namespace flyball::study {

/// Puts `more` at the end of a list.
template <class T>
void append(std::vector<T>& list, std::vector<T> more) {
  list.insert(list.end(), std::make_move_iterator(more.begin()),
              std::make_move_iterator(more.end()));
}

/// The runs to show: as prepared, or as recorded where the log was refused before.
[[nodiscard]] std::vector<identification::PreparedRun> shown_runs(const IdentifyResult& result);
/// Of them those that are pictured: all, or of very many the first and those whose simulation is
/// furthest from what was measured.
inline constexpr std::size_t most_pictured = 24;
[[nodiscard]] std::vector<identification::PreparedRun> pictured_runs(const IdentifyResult& result);
/// The fit of a run, or null.
[[nodiscard]] const identification::FittedRun* fitted_run(const IdentifyResult& result,
                                                          std::size_t source);
/// "elevator", …, "drivetrain".
[[nodiscard]] std::string kind_of(const IdentifyResult& result);

/// A row of the table of gains: value, interval, unit, one-step estimate, meaning.
[[nodiscard]] std::vector<Value> gain_row(const std::string& name,
                                          const identification::GainEstimate& gain,
                                          const std::string& unit, double one_step,
                                          bool has_one_step, const std::string& meaning);
/// A gain as a member of an answer's JSON.
void write_gain(JsonWriter& json, std::string_view name, const identification::GainEstimate& gain,
                const std::string& unit);
/// The member "terms", if a fit has any beyond its gains.
void write_terms(JsonWriter& json, const identification::FeedforwardFit& fit);
/// A row for each of them.
void term_rows(Table& table, const std::string& mode, const identification::FeedforwardFit& fit);
/// The members that tell how a fit went.
void write_quality(JsonWriter& json, const identification::FeedforwardFit& fit);

// Of a drivetrain (`result.drive`), in place of those of a mechanism.
[[nodiscard]] Section drive_data(const IdentifyResult& result);
[[nodiscard]] Section drive_gains(const IdentifyResult& result);
[[nodiscard]] Verdict drive_verdict(const IdentifyResult& result);
[[nodiscard]] std::vector<Figure> drive_figures(const IdentifyResult& result);
[[nodiscard]] std::vector<AnswerFile> drive_files(const IdentifyResult& result);
void write_drive(JsonWriter& json, const IdentifyResult& result);
/// The members of a drivetrain's "gains".
void write_drive_gains(JsonWriter& json, const identification::DriveFit& fit);

[[nodiscard]] Section data_section(const IdentifyResult& result);
/// Gains and the quality of the fit; for a refused fit, its reason.
[[nodiscard]] Section gains_section(const IdentifyResult& result);
/// What is proven, in a sentence: of all sets, or the first of which it is not.
[[nodiscard]] std::string proof_line(const DesignResult& result);
/// Whether every mechanism of every set is proven stable.
[[nodiscard]] bool all_proven(const DesignResult& result);
/// A row a set, with the worst member that was found.
[[nodiscard]] std::vector<Block> proof_blocks(const DesignResult& result);
void write_proofs(JsonWriter& json, const DesignResult& result);
/// What speaks against the loop in its proofs.
void add_proofs(Verdict& verdict, const DesignResult& result);
/// Plant, controller, robustness, motion, constants.
[[nodiscard]] std::vector<Section> design_sections(const DesignResult& result);

[[nodiscard]] Verdict verdict_of(const IdentifyResult& result);
[[nodiscard]] Verdict verdict_of(const DesignResult& result);
/// What the data say is connected or counted the wrong way: to be mended before the gains are used.
void add_wiring(Verdict& verdict, const std::vector<Diagnostic>& diagnostics);
/// "2 warnings about the data, listed below", if there are any.
void add_warnings(Verdict& verdict, const std::vector<Diagnostic>& diagnostics,
                  std::string_view about);

[[nodiscard]] Document document_of(const ModelAnalysis& result);

/// One picture of the intervals of all gains that are determined; none if none is.
/// @param fits  Each with what stands before its gains' names.
[[nodiscard]] std::vector<Figure> interval_figures(
    const std::vector<std::pair<std::string, const identification::FeedforwardFit*>>& fits);
/// Bode plot and Nyquist curve of the opened loop, and its small step.
[[nodiscard]] std::vector<Figure> loop_figures(const DesignResult& result);
/// "What to do next", in plain words. @param design  Null: none was made of the gains.
/// @param refused  Whether one was asked for.
[[nodiscard]] Section next_steps(const IdentifyResult& result, const DesignResult* design,
                                 bool refused = false);
[[nodiscard]] Section next_steps(const DesignResult& result);

/// Each run, measured against simulated; as recorded where nothing was simulated.
[[nodiscard]] std::vector<Figure> figures_of(const IdentifyResult& result);
/// Pole map, Bode plot, Nyquist curve, small step, closed-loop response, estimate against truth.
[[nodiscard]] std::vector<Figure> figures_of(const DesignResult& result);
/// The mechanism in that closed loop, moving.
[[nodiscard]] std::vector<Animation> animations_of(const DesignResult& result);
/// Pole map and step responses.
[[nodiscard]] std::vector<Figure> figures_of(const ModelAnalysis& result);

/// The same as CSV: the runs; the response and the robustness grid; the step responses.
[[nodiscard]] std::vector<AnswerFile> data_files(const IdentifyResult& result);
/// data/signals.wpilog: measured, simulated and residual signals on the log's own clock.
[[nodiscard]] std::vector<AnswerFile> signal_log(const IdentifyResult& result);
[[nodiscard]] std::vector<AnswerFile> data_files(const DesignResult& result);
[[nodiscard]] std::vector<AnswerFile> data_files(const ModelAnalysis& result);
/// gains.toml, the generated header, constants to paste, data. A header that cannot be made is a
/// sentence in the last section.
/// @param fit  For the gains' intervals; may be null.
void add_design_files(Answer& answer, const DesignResult& result,
                      const identification::FeedforwardFit* fit);

/// The member "gains" of a fit.
void write_gains(JsonWriter& json, const identification::FeedforwardFit& fit);
/// The members of a fit: mechanism, unit, gains, terms, quality.
void write_fit(JsonWriter& json, const identification::FeedforwardFit& fit);
/// The object of "flyball.identify/1".
void write_identification(JsonWriter& json, const IdentifyResult& result);
/// The members of "flyball.design/2", without the schema.
void write_design(JsonWriter& json, const DesignResult& result);

/// Its kind, motors, gearing, drum and gains.
[[nodiscard]] Facts plant_facts(const PlantDescription& plant);
/// "Elevator “lift” from log.json". @param subject  May be empty, as `path`.
[[nodiscard]] std::string title_of(const std::string& kind, const std::string& subject,
                                   const std::string& path);
/// What was measured: "velocity" for a flywheel, else "position".
[[nodiscard]] std::string measured_name(mechanisms::MechanismKind kind);
/// The unit of the controlled quantity: "rad/s" for a flywheel, else the unit itself.
[[nodiscard]] std::string controlled_unit(const PlantDescription& plant);

}  // namespace flyball::study
