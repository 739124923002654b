#include <flyball/identification/drive_fit.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <flyball/math/regression/least_squares.hpp>

#include "core/diagnose.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "identification/drive_preparation.hpp"
#include "identification/estimates.hpp"
#include "identification/statistics.hpp"

namespace flyball::identification {

namespace {

using mechanisms::MechanismKind;

/// One mode, of the runs that tell it.
struct Part {
  std::string name;                 ///< "straight tests"
  std::vector<std::size_t> runs{};  ///< Of the drive's recording.
  FitReport report{{}, {}, tl::unexpected(Error(IdentificationError::no_data))};

  [[nodiscard]] const FeedforwardFit* fit() const { return report.fit ? &*report.fit : nullptr; }
};

template <class MakeRun>
Part fit_part(const DriveReport& report, std::string name, const FitOptions& options,
              const std::vector<std::size_t>& runs, MakeRun make_run) {
  Part part{.name = std::move(name), .runs = runs};
  // A mode has neither gravity nor a travel, as a flywheel.
  Recording recording{.mechanism = MechanismKind::flywheel, .unit = report.recording.unit};
  for (const std::size_t run : runs) {
    recording.runs.push_back(make_run(report.recording.runs[run]));
  }
  if (!runs.empty()) {
    part.report = identify_feedforward(recording, options);
  }
  return part;
}

void tell_part(const Part& part, std::vector<Diagnostic>& diagnostics) {
  for (Diagnostic found : part.report.diagnostics) {
    // A log of one kind of test is not short of the other.
    found.message = part.name + ": " + found.message;
    diagnostics.push_back(std::move(found));
  }
  if (!part.report.fit && !part.runs.empty()) {
    warn(diagnostics, "mode_not_identified", "{}: {}", part.name,
         to_string(part.report.fit.error()));
  }
}

std::vector<std::size_t> runs_of(const DriveReport& report, DriveTest test, bool curves) {
  std::vector<std::size_t> runs;
  for (std::size_t i = 0; i < report.tests.size(); ++i) {
    if (report.tests[i] == test || (curves && report.tests[i] == DriveTest::mixed)) {
      runs.push_back(i);
    }
  }
  return runs;
}

/// A mode's way: its position, or its velocity's integral.
std::vector<double> way_of(const TestRun& run) {
  if (!run.position.empty()) {
    return run.position;
  }
  std::vector<double> way(run.time.size(), 0.0);
  for (std::size_t i = 1; i < way.size(); ++i) {
    way[i] = way[i - 1] +
             0.5 * (run.velocity[i] + run.velocity[i - 1]) * (run.time[i] - run.time[i - 1]);
  }
  return way;
}

/// The volts that the right side takes above the left one's, halved: friction, and with the speed.
struct SideDifference {
  double friction = 0.0;        ///< V
  double friction_error = 0.0;  ///< Standard.
  double speed = 0.0;           ///< V/(unit/s)
  double speed_error = 0.0;
};

/// What unlike sides make in a test of one mode is a voltage in the other one,
/// (kS_right − kS_left)/2 sgn + (kV_right − kV_left)/2 v = u − kV w − kA dw/dt
/// of the other mode, over windows of 0.2 s.
/// @param sign  Of the mode that the runs excite: 1 straight on, −1 turning.
std::optional<SideDifference> compare_sides(const DriveReport& report, const Part& own, double sign,
                                            const FeedforwardFit& other) {
  constexpr double window = 0.2;  // s
  std::vector<double> speeds;
  std::vector<double> volts;
  for (const FittedRun& fitted : own.fit()->runs) {
    if (!fitted.used) {
      continue;
    }
    const DriveRun& run = report.recording.runs[own.runs[fitted.source]];
    const TestRun excited = mode_run(run, sign);
    const TestRun across = mode_run(run, -sign);
    const std::vector<double> way = way_of(excited);
    const std::vector<double> across_way = way_of(across);
    const double delay = own.fit()->position_delay;
    std::vector<double> times;
    for (double t = fitted.time.front(); t <= fitted.time.back(); t += window) {
      times.push_back(t);
    }
    const auto rate = [&](const std::vector<double>& of, std::size_t k) {
      return (interpolate(run.time, of, times[k + 1] + delay) -
              interpolate(run.time, of, times[k] + delay)) /
             window;
    };
    for (std::size_t k = 1; k + 2 < times.size(); ++k) {
      const double v = rate(way, k);
      const double acceleration =
          (rate(across_way, k + 1) - rate(across_way, k - 1)) / (2 * window);
      double u = 0.0;
      const std::size_t begin = lower_index(run.time, times[k]);
      const std::size_t end = std::max(begin + 1, lower_index(run.time, times[k + 1]));
      for (std::size_t row = begin; row < end; ++row) {
        u += across.voltage[row] / static_cast<double>(end - begin);
      }
      speeds.push_back(std::abs(v));
      volts.push_back(std::copysign(1.0, v) *
                      (u - other.kV.value * rate(across_way, k) - other.kA.value * acceleration));
    }
  }
  const auto n = static_cast<Eigen::Index>(speeds.size());
  if (n < 10) {
    return std::nullopt;
  }
  Eigen::MatrixXd X = Eigen::MatrixXd::Ones(n, 2);
  X.col(1) = Eigen::Map<const Eigen::VectorXd>(speeds.data(), n);
  const Eigen::VectorXd y = Eigen::Map<const Eigen::VectorXd>(volts.data(), n);
  LeastSquaresOptions options{.errors = ErrorModel::hac};
  options.lags = 3;
  const auto found = least_squares(X, y, options);
  if (!found || found->rank < 2) {
    return std::nullopt;
  }
  return SideDifference{found->coefficients[0], found->standard_errors[0], found->coefficients[1],
                        found->standard_errors[1]};
}

/// kS of each side: that of the mode, less and more half their difference.
void split_friction(const SideDifference& difference, const FeedforwardFit& own, DriveFit& fit,
                    std::vector<Diagnostic>& diagnostics) {
  const double error = std::hypot(own.kS.standard_error, difference.friction_error);
  const auto side = [&](double sign) {
    GainEstimate kS = symmetric_estimate(own.kS.value + sign * difference.friction, error);
    kS.interval[0] = std::max(0.0, kS.interval[0]);
    if (kS.interval[0] <= 0.0) {
      kS.determined = false;
      kS.upper_bound = std::max(kS.interval[1], 1e-3);
      kS.reason = "static friction cannot be told from zero";
    }
    return kS;
  };
  fit.kS_left = side(-1.0);
  fit.kS_right = side(1.0);
  const double ratio = 2.0 * difference.speed / own.kV.value;
  if (std::abs(ratio) > std::max(0.05, 7.0 * difference.speed_error / own.kV.value)) {
    warn(
        diagnostics, "sides_differ",
        "the {} side needs {:.2g} % more volts than the other one for the same speed: the robot "
        "will not drive straight. Look for a dragging wheel or brake, a motor that is unplugged or "
        "another gearing; the model takes the sides to be alike",
        ratio > 0.0 ? "right" : "left", 100.0 * std::abs(ratio));
  }
}

void report_modes(const DriveFit& fit, std::vector<Diagnostic>& diagnostics) {
  constexpr double nominal = 12.0;  // V
  if (fit.unit == "m" && fit.linear) {
    const double speed = nominal / fit.linear->kV.value;
    if (speed < 0.5 || speed > 10.0) {
      warn(diagnostics, "unusual_speed",
           "the gains make {:.3g} m/s at 12 V, which few drivetrains reach (0.5 to 10); the unit "
           "of the positions is probably another (say it with --unit, or with --scale the metres "
           "of a recorded unit)",
           speed);
    }
  }
  if (!fit.linear) {
    warn(diagnostics, "mode_not_excited",
         "no test drives straight on: kV and kA of the linear motion are not known. Record the "
         "four tests straight on too, and give that log beside this one with --also");
  }
  if (!fit.angular) {
    warn(diagnostics, "mode_not_excited",
         "no test turns the robot: kV and kA of the angular motion are not known. Record the four "
         "tests with the sides against each other too, and give that log beside this one with "
         "--also");
  }
  if (fit.linear && fit.angular) {
    const double ratio = fit.angular->kV.value / fit.linear->kV.value;
    if (ratio < 0.8 || ratio > 2.0) {
      warn(diagnostics, "modes_disagree",
           "a wheel needs {:.3g} times the volts to turn the robot as to drive it straight on at "
           "the same speed (1 without slip, somewhat more with wheels that scrub): the two kinds "
           "of tests are probably of another unit, gearing or floor",
           ratio);
    }
  }
}

Expected<DriveFit> fit_drive(DriveReport& report, const FitOptions& options) {
  std::vector<Diagnostic>& diagnostics = report.diagnostics;
  FLYBALL_CHECK(mend_drive(report.recording, diagnostics));
  for (const DriveRun& run : report.recording.runs) {
    report.tests.push_back(drive_test(run));
  }
  DriveFit fit;
  fit.unit = report.recording.unit;
  fit.trackwidth = find_trackwidth(report.recording, report.tests, diagnostics);

  const Part linear =
      fit_part(report, "straight tests", options, runs_of(report, DriveTest::straight, true),
               [](const DriveRun& run) { return mode_run(run, 1.0); });
  const Part angular =
      fit_part(report, "rotation tests", options, runs_of(report, DriveTest::turning, true),
               [](const DriveRun& run) { return mode_run(run, -1.0); });
  tell_part(linear, diagnostics);
  tell_part(angular, diagnostics);
  if (!linear.fit() && !angular.fit()) {
    return tl::unexpected((linear.runs.empty() ? angular : linear).report.fit.error());
  }
  fit.linear = linear.fit() != nullptr ? std::optional(*linear.fit()) : std::nullopt;
  fit.angular = angular.fit() != nullptr ? std::optional(*angular.fit()) : std::nullopt;

  // In straight tests where there are any: turning scrubs the wheels.
  const Part& own = fit.linear ? linear : angular;
  const FeedforwardFit& other = fit.linear && fit.angular ? *fit.angular : *own.fit();
  if (const auto sides = compare_sides(report, own, fit.linear ? 1.0 : -1.0, other)) {
    split_friction(*sides, *own.fit(), fit, diagnostics);
  }
  report_modes(fit, diagnostics);

  std::vector<const FittedRun*> used(report.recording.runs.size(), nullptr);
  for (const Part* part : {&angular, &linear}) {
    if (part->fit() != nullptr) {
      for (const FittedRun& run : part->fit()->runs) {
        used[part->runs[run.source]] = &run;
      }
    }
  }
  report.runs = simulate_drive(report, fit, used);
  return fit;
}

}  // namespace

std::optional<mechanisms::DriveGains> DriveFit::gains() const {
  if (!linear || !angular || !linear->kA.determined || !angular->kA.determined) {
    return std::nullopt;
  }
  return mechanisms::DriveGains{.kS_left = kS_left ? kS_left->value : linear->kS.value,
                                .kS_right = kS_right ? kS_right->value : linear->kS.value,
                                .kV_linear = linear->kV.value,
                                .kA_linear = linear->kA.value,
                                .kV_angular = angular->kV.value,
                                .kA_angular = angular->kA.value};
}

GainEstimate per_radian(const GainEstimate& gain, const GainEstimate& trackwidth) {
  const double half = 0.5 * trackwidth.value;
  GainEstimate turned = gain;
  turned.value *= half;
  turned.upper_bound *= half;
  const double relative = trackwidth.standard_error / trackwidth.value;
  turned.standard_error = std::hypot(half * gain.standard_error, turned.value * relative);
  // Each arm of the interval grows by the width's own, as errors that have nothing to do with each
  // other do.
  const double of_width =
      turned.value * 0.5 * (trackwidth.interval[1] - trackwidth.interval[0]) / trackwidth.value;
  turned.interval = {turned.value - std::hypot(half * (gain.value - gain.interval[0]), of_width),
                     turned.value + std::hypot(half * (gain.interval[1] - gain.value), of_width)};
  return turned;
}

DriveReport identify_drive(const DriveRecording& recording, const FitOptions& options) {
  DriveReport report{.recording = recording,
                     .fit = tl::unexpected(Error(IdentificationError::no_data))};
  report.fit = fit_drive(report, options);
  return report;
}

}  // namespace flyball::identification
