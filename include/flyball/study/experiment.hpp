#pragma once

#include <optional>
#include <string>
#include <vector>

#include <flyball/core/answer.hpp>
#include <flyball/study/design.hpp>
#include <flyball/study/identify.hpp>

namespace flyball::study {

/// What tests of a mechanism may do.
struct ExperimentLimits {
  std::optional<double> travel_low{};   ///< unit, elevators and arms; needed without a log.
  std::optional<double> travel_high{};  ///< unit.
  double voltage = 10.0;                ///< V
  double duration = 60.0;               ///< s, of all tests together, without the ways back.
};

/// What the log of the tests will show.
struct SensorDescription {
  double row_period = 5e-3;                ///< s
  double refresh = 20e-3;                  ///< s, rows in between repeat the value.
  double delay = 0.0;                      ///< s, age of a value.
  double resolution = 0.0;                 ///< unit, smallest step of the position.
  double velocity_window = 20e-3;          ///< s, moving average in the velocity.
  std::optional<double> velocity_noise{};  ///< unit/s; 0.5 % of top speed if absent.
};

/// Plan the tests that tell the gains of a mechanism best.
struct ExperimentJob {
  PlantDescription plant;  ///< As far as it is known.
  ExperimentLimits limits;
  SensorDescription sensor;
  unsigned long long seed = 1;
  std::optional<identification::FeedforwardFit> log{};  ///< What is known, without its runs.
};

/// One test to run.
struct PlannedTest {
  identification::TestKind kind{};
  double ramp_rate = 0.0;  ///< V/s; 0: a step.
  double voltage = 0.0;    ///< V, of the step, or at the end of the ramp; signed.
  double duration = 0.0;   ///< s
  double travel = 0.0;     ///< unit
  double top_speed = 0.0;  ///< unit/s
};

/// What a gain will be known to.
struct GainForecast {
  std::string name{};
  std::string unit{};
  double value = 0.0;  ///< That was assumed.
  bool determined = false;
  double half_width = 0.0;  ///< Of the 95 % interval.
  double wanted = 0.0;      ///< Half width that a good log has.
};

/// Four tests, and what a log of `repeats` times all of them tells.
struct Experiment {
  std::vector<PlannedTest> tests{};
  int repeats = 1;
  double duration = 0.0;  ///< s, with all repeats.
  std::vector<GainForecast> gains{};
  double score = 0.0;  ///< Largest half width over what is wanted; infinity: no gains at all.
};

/// The experiment that was found, beside the one that teams run without looking.
struct ExperimentResult {
  ExperimentJob job;
  Experiment best;
  Experiment usual;  ///< The same limits with 1 V/s and 7 V, or the most that may be.
  std::vector<Diagnostic> diagnostics{};
};

/// Looks for the ramp rate and the step voltage whose simulated log gives the narrowest intervals:
/// the four tests are simulated with the mechanism's sensors within the limits and fitted as
/// `identify` would; wanted are half widths of 10 % (kS), 0.9 % (kV), 5 % (kA) and 2.5 % (kG), and
/// the worst gain decides.
/// @errors ArgumentError::out_of_range for limits within which the mechanism cannot be tested;
/// not_positive, not_finite.
/// Cost: about 40 fits of simulated logs, some seconds.
/// Source: Ljung, "System Identification" (2nd ed.), section 13.3 (informative experiments).
[[nodiscard]] Expected<ExperimentResult> plan_experiment(const ExperimentJob& given);

/// The job that a log calls for: its gains, sensors and range of positions.
[[nodiscard]] ExperimentJob experiment_after(const IdentifyResult& result,
                                             const ExperimentLimits& limits);

/// A table of tests to run, and of what they will tell. Schema "flyball.experiment/1".
[[nodiscard]] Answer answer_of(const ExperimentResult& result);
[[nodiscard]] std::string to_json(const ExperimentResult& result);

}  // namespace flyball::study
