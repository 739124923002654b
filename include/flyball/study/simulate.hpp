#pragma once

#include <flyball/control/lyapunov/region_of_attraction.hpp>
#include <flyball/core/answer.hpp>
#include <flyball/study/design_model.hpp>
#include <flyball/study/project.hpp>

namespace flyball::study {

/// What a signal did.
struct SignalSummary {
  double min = 0.0;
  double max = 0.0;
  double final = 0.0;
  std::optional<double> settling_time{};  ///< s, of a state in a loop: within 2 % for good.
};

/// How an input was used.
struct InputSummary : SignalSummary {
  double saturated_fraction = 0.0;  ///< Share of the rows that asked for the limit or more.
  double energy = 0.0;              ///< ∫ u² dt, unit² s.
};

/// A signal and the columns of the record that show it; a name may be empty.
struct ShownSignal {
  Coordinate signal{};
  std::string truth{};      ///< The column of what it is.
  std::string estimate{};   ///< Or what was asked for, of an input.
  std::string reference{};  ///< Or what was measured, of an output.
};

/// A simulated model or mechanism.
struct Simulation {
  std::string name{};  ///< "pendulum", "elevator"
  std::string path{};
  bool closed_loop = false;
  double period = 0.0;    ///< s, of the loop; 0 of an open one.
  double duration = 0.0;  ///< s
  unsigned long long seed = 1;
  TimeSeries series{};
  std::vector<ShownSignal> states{}, inputs{}, outputs{};
  std::vector<SignalSummary> state_summary{}, output_summary{};
  std::vector<InputSummary> input_summary{};
  std::vector<double> limits{};             ///< Of each input, infinite for none.
  std::optional<PlantDescription> plant{};  ///< Of a mechanism.
  std::vector<Diagnostic> diagnostics{};
};

/// A model without its controller, integrated to the job's accuracy.
/// @errors As `check_model`, naming state and time; IntegrationError.
[[nodiscard]] Expected<Simulation> simulate_open_loop(const ModelJob& job);

/// A model with its regulator, sampled each period.
/// @errors As `check_model`, naming state and time; ArgumentError.
[[nodiscard]] ExpectedAll<Simulation> simulate_closed_loop(const ModelJob& job,
                                                           const ModelRegulator& regulator);

/// What a project's [simulation] asks for: of a model an open loop or, with closed_loop, that of
/// its regulator; of a mechanism the designed loop on its motion or, with an input, an open loop at
/// that voltage.
/// @errors As the functions above, `regulate` and `design`; Project::plant_error.
[[nodiscard]] ExpectedAll<Simulation> simulate(const Project& project);

/// What was simulated, where it ended, extremes, settling and use of the inputs; states, outputs
/// and inputs over time. Schema "flyball.simulate/1".
[[nodiscard]] Answer answer_of(const Simulation& result);

/// From where a regulator is proven to hold its point.
struct ModelRegion {
  SaturatedLoop loop;  ///< The inputs acting at all times.
  CertifiedRegion certified{};
  SampledRegion sampled{};  ///< Over the plane below.
  Eigen::Index first = 0;   ///< The states that are shown.
  Eigen::Index second = 1;
};

/// A model brought to its point from afar.
struct SwingUpRunResult {
  expression::Tape law;  ///< From [x; u*] to the energy and what the input does to it.
  std::vector<double> parameters{};
  double energy = 0.0;             ///< At the point,
  double scale = 0.0;              ///< and half of its range over the angles.
  Eigen::VectorXd start{};         ///< n
  std::optional<double> taken{};   ///< s, when the regulator took over for good.
  std::optional<double> stands{};  ///< s, from when V is below a hundredth of the level.
  Simulation simulation{};
};

/// A designed loop about a point, tried on the model itself from a small deviation.
struct ModelDesign {
  ModelJob job;
  ModelRegulator regulator;
  Simulation simulation;
  std::optional<ModelRegion> region{};
  std::optional<SwingUpRunResult> swing_up{};
};

/// @errors As `regulate` and `simulate_closed_loop`.
[[nodiscard]] ExpectedAll<ModelDesign> design_model(const ModelJob& job);

/// The point, the linear model, gains, poles, margins, and the loop on the model itself. Schema
/// "flyball.design_model/2".
[[nodiscard]] Answer answer_of(const ModelDesign& result);

}  // namespace flyball::study
