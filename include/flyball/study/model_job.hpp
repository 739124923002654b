#pragma once

#include <optional>
#include <string>
#include <vector>

#include <flyball/core/quantity.hpp>
#include <flyball/estimation/outlier_guard.hpp>
#include <flyball/identification/prediction_error.hpp>
#include <flyball/math/expression/formula.hpp>
#include <flyball/math/expression/tape.hpp>
#include <flyball/systems/any_model.hpp>

/// Models by formula in a project file: what its sections say, and what they mean.
namespace flyball::study {

/// A key of a table whose keys a person chooses, and its value as it is written: a unit, a
/// quantity, a formula.
struct NamedText {
  std::string name{};
  std::string text{};
  friend bool operator==(const NamedText&, const NamedText&) = default;
};
/// In the order of the file.
using NamedTexts = std::vector<NamedText>;

/// [model]: the names with their units, the parameters with their values, the formulas; in the
/// order of the file.
struct FormulaSection {
  std::string name{};
  NamedTexts states{}, inputs{}, parameters{}, definitions{}, derivative{}, outputs{};
  std::vector<std::string> angles{};  ///< Empty: what is in rad.
};

/// [point]: where a model is linearised and held.
struct PointSection {
  NamedTexts at{};  ///< Of states and inputs; zero where nothing is said.
  bool find_equilibrium = false;
};

/// What [controller] says for a model, by the names of its states and inputs.
struct NamedControl {
  NamedTexts tolerance{}, limit{}, reference{};
};

/// [simulation].
struct SimulationSection {
  std::optional<double> duration{};  ///< s
  std::optional<double> step{};      ///< s, between the rows of the record.
  std::optional<double> accuracy{};  ///< Relative, of an open loop.
  std::optional<bool> closed_loop{};
  NamedTexts initial{}, input{}, noise{}, resolution{};
};

/// [fit]: what `flyball identify LOG PROJECT.toml` does with a model.
struct FitSection {
  NamedTexts free{};                   ///< Parameters that are looked for, with their range.
  NamedTexts channels{};               ///< The log's channel of an input or an output.
  NamedTexts validation_channels{};    ///< The same of the part that is kept aside.
  std::optional<double> period{};      ///< s, between rows of a table without time.
  std::optional<double> from{}, to{};  ///< s, of the log's time.
  std::optional<double> validation_from{}, validation_to{};  ///< s
  NamedTexts initial{};                                      ///< States at the first sample.
  std::vector<std::string> free_initial{};                   ///< Those of them that are looked for.
  bool same_initial = false;  ///< Whether the validation begins as the fit does.
  std::string hold{}, loss{};
  std::optional<int> starts{};
  unsigned long long seed = 1;  ///< Of the places where they are.
  bool profile = false;
};

/// The same, checked, in SI.
struct ModelFit {
  std::vector<identification::FreeParameter> free{};
  std::vector<std::string> channels{};             ///< Of the inputs, then of the outputs.
  std::vector<std::string> validation_channels{};  ///< The same; empty: none.
  std::vector<identification::InitialState> initial{};
  identification::PredictionErrorOptions options{};
};

/// [estimate]: what `flyball estimate LOG PROJECT.toml` does with a model; channels and times are
/// those of [fit].
struct EstimateSection {
  std::string filter{}, outliers{};
  std::optional<bool> smoother{};
  bool tune = false;
  NamedTexts process_noise{}, measurement_noise{}, initial{}, initial_std{};
  NamedTexts lower_limit{}, upper_limit{};
};

/// The same, checked, in SI.
struct ModelEstimate {
  bool is_unscented = false;
  bool smoother = true;
  bool tune = false;
  Eigen::VectorXd process_noise{};      ///< n, the random walk's standard deviation after 1 s.
  Eigen::VectorXd measurement_noise{};  ///< p, standard deviation of a sample; NaN: not said.
  Eigen::VectorXd initial{};            ///< n
  Eigen::VectorXd initial_std{};        ///< n
  std::optional<OutlierTreatment> outliers{};
  Eigen::VectorXd lower{};  ///< n, where a state is at least; -∞ where nothing is known,
  Eigen::VectorXd upper{};  ///< and at most, ∞.
};

/// [swing_up]: how a model comes to an unstable point from afar.
struct SwingUpSection {
  std::string energy{};               ///< A formula of the states.
  NamedTexts hold{};                  ///< Feedback of states meanwhile, input/state.
  NamedTexts reach{};                 ///< How far a state may be from the point.
  std::optional<double> sharpness{};  ///< Full input while more than one over it is missing.
};

/// The same, checked, in SI.
struct ModelSwingUp {
  bool has_energy = false;  ///< The equations' last output is the energy.
  Eigen::VectorXd hold{};   ///< n, input/state.
  Eigen::VectorXd reach{};  ///< n, infinite for as far as it goes.
  double sharpness = 10.0;
};

/// The inputs of an open loop, over time.
class InputSignals {
 public:
  InputSignals() = default;
  /// @param tape  One input, the time in seconds; an output for each input of the model.
  InputSignals(expression::Tape tape, std::vector<double> parameters);

  /// u at a time, s. Allocates.
  [[nodiscard]] Eigen::VectorXd operator()(double t) const;

 private:
  expression::Tape tape_;
  std::vector<double> prepared_;
};

/// A run of a model: what is simulated, in SI.
struct ModelRun {
  double duration = 10.0;  ///< s
  bool duration_is_given = false;
  std::optional<double> step{};
  double accuracy = 1e-8;
  bool closed_loop = false;
  Eigen::VectorXd initial{};  ///< n, where it starts; NaN: the point.
  InputSignals input{};
  std::vector<double> noise{};       ///< Standard deviation of a reading of each output.
  std::vector<double> resolution{};  ///< Smallest step of a reading of each output.
  unsigned long long seed = 1;
};

/// A model, and what a project file wants of it; every list has the model's sizes.
struct ModelJob {
  std::string path{};
  AnyModel model;
  bool outputs_are_states = false;  ///< No [model.outputs].
  Eigen::VectorXd x{}, u{};         ///< The point as written.
  bool find_equilibrium = false;
  double period = 0.020;  ///< s, of the loop.
  double delay = 0.0;     ///< s, from sensing to acting.
  /// Bryson's; nothing where none is given, for all or none of the states, and of the inputs.
  std::vector<double> state_tolerance{}, input_tolerance{};
  Eigen::VectorXd limit{};      ///< m, largest size of each input's deviation from zero; infinite.
  Eigen::VectorXd reference{};  ///< n, where the loop goes; NaN: the point.
  ModelRun run{};
  ModelFit fit{};
  ModelEstimate estimate{};
  /// dx/dt and, where [swing_up] says it, the energy.
  expression::CompiledFormulas equations{};
  ModelSwingUp swing_up{};
};

}  // namespace flyball::study
