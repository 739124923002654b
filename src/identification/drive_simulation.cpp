#include <algorithm>
#include <cmath>
#include <cstddef>

#include "identification/drive_preparation.hpp"
#include "identification/statistics.hpp"

namespace flyball::identification {

namespace {

constexpr double longest_step = 1e-3;  // s
constexpr double smoothing = 0.07;     // s, over which a velocity is derived from positions

/// What the sides' modes and frictions are in one run.
struct RunModel {
  mechanisms::DriveGains gains;
  double delay = 0.0;  ///< s, of the velocity, half the averaging included.
  double width = 0.0;  ///< s, of the averaging.
};

RunModel model_of(const DriveFit& fit, DriveTest test) {
  // Without the other mode the sides are taken to be independent, as where both modes are equal.
  const FeedforwardFit& linear = fit.linear ? *fit.linear : *fit.angular;
  const FeedforwardFit& angular = fit.angular ? *fit.angular : *fit.linear;
  const bool turning = test == DriveTest::turning;
  const FeedforwardFit& own = turning ? angular : linear;
  // The sides differ by what straight tests show; turning adds the same to both.
  const double mean = own.kS.value;
  const double half =
      fit.kS_left && fit.kS_right ? 0.5 * (fit.kS_right->value - fit.kS_left->value) : 0.0;
  RunModel model;
  model.gains = {.kS_left = std::max(0.0, mean - half),
                 .kS_right = std::max(0.0, mean + half),
                 .kV_linear = linear.kV.value,
                 .kA_linear = linear.kA.value,
                 .kV_angular = angular.kV.value,
                 .kA_angular = angular.kA.value};
  model.delay = own.velocity_delay > 0.0 ? own.velocity_delay : own.position_delay;
  model.width = own.averaging_width;
  return model;
}

/// The velocity column, or the position's derivative.
std::vector<double> shown_velocity(const DriveRun& run, const DriveSide& side) {
  if (!side.velocity.empty()) {
    return side.velocity;
  }
  std::vector<double> velocity(run.time.size(), 0.0);
  for (std::size_t i = 0; i < velocity.size(); ++i) {
    const double early = std::max(run.time[i] - 0.5 * smoothing, run.time.front());
    const double late = std::min(run.time[i] + 0.5 * smoothing, run.time.back());
    if (late > early) {
      velocity[i] = (interpolate(run.time, side.position, late) -
                     interpolate(run.time, side.position, early)) /
                    (late - early);
    }
  }
  return velocity;
}

/// The voltage that moves a side: without what friction takes, which at rest takes what it can.
double moving_voltage(double voltage, double kS, double velocity) {
  const double sign = velocity != 0.0 ? velocity : voltage;
  return velocity == 0.0 && std::abs(voltage) <= kS ? 0.0 : voltage - std::copysign(kS, sign);
}

/// Both sides' ways, at rest or in motion from the window's start.
struct Ways {
  std::vector<double> time, left, right;
};

Ways simulate(const RunModel& model, const DriveRun& run, std::size_t first, std::size_t last,
              double left, double right) {
  const mechanisms::DriveGains& gains = model.gains;
  const double straight_rate = gains.kV_linear / gains.kA_linear;
  const double turning_rate = gains.kV_angular / gains.kA_angular;
  Ways ways;
  double left_way = 0.0;
  double right_way = 0.0;
  const auto keep = [&](double time) {
    ways.time.push_back(time);
    ways.left.push_back(left_way);
    ways.right.push_back(right_way);
  };
  keep(run.time[first]);
  for (std::size_t row = first; row + 1 < last; ++row) {
    const double span = run.time[row + 1] - run.time[row];
    const auto steps = static_cast<int>(std::ceil(span / longest_step));
    const double step = span / std::max(1, steps);
    for (int i = 0; i < steps; ++i) {
      const double u_left = moving_voltage(run.left.voltage[row], gains.kS_left, left);
      const double u_right = moving_voltage(run.right.voltage[row], gains.kS_right, right);
      // Each mode exactly over the step: w(t) = w_end + (w - w_end) e^{-λt}.
      const auto advanced = [step](double w, double w_end, double rate) {
        return w_end + (w - w_end) * std::exp(-rate * step);
      };
      const double v =
          advanced(0.5 * (right + left), 0.5 * (u_right + u_left) / gains.kV_linear, straight_rate);
      const double w =
          advanced(0.5 * (right - left), 0.5 * (u_right - u_left) / gains.kV_angular, turning_rate);
      const auto stopped = [](double before, double after, double voltage, double kS) {
        return before * after < 0.0 && std::abs(voltage) <= kS ? 0.0 : after;
      };
      const double next_left = stopped(left, v - w, run.left.voltage[row], gains.kS_left);
      const double next_right = stopped(right, v + w, run.right.voltage[row], gains.kS_right);
      left_way += 0.5 * step * (left + next_left);
      right_way += 0.5 * step * (right + next_right);
      left = next_left;
      right = next_right;
    }
    keep(run.time[row + 1]);
  }
  return ways;
}

/// The start of a run in motion: its speed over the first tenth of a second.
double start_speed(const std::vector<double>& time, const std::vector<double>& velocity,
                   std::size_t first, std::size_t last) {
  std::vector<double> values;
  for (std::size_t i = first; i < last && time[i] <= time[first] + 0.1; ++i) {
    values.push_back(velocity[i]);
  }
  return median(std::move(values));
}

}  // namespace

std::vector<FittedDriveRun> simulate_drive(const DriveReport& report, const DriveFit& fit,
                                           const std::vector<const FittedRun*>& used) {
  std::vector<FittedDriveRun> runs(report.recording.runs.size());
  for (std::size_t index = 0; index < runs.size(); ++index) {
    const DriveRun& run = report.recording.runs[index];
    const FittedRun* window = used[index];
    FittedDriveRun& fitted = runs[index];
    const std::vector<double> left = shown_velocity(run, run.left);
    const std::vector<double> right = shown_velocity(run, run.right);
    std::size_t first = 0;
    std::size_t last = run.time.size();
    fitted.used = window != nullptr && window->used && window->time.size() > 1;
    if (fitted.used) {
      first = lower_index(run.time, window->time.front());
      last = lower_index(run.time, window->time.back()) + 1;
      last = std::min(last, run.time.size());
    }
    const auto slice = [&](const std::vector<double>& values) {
      return values.empty()
                 ? values
                 : std::vector<double>(values.begin() + static_cast<std::ptrdiff_t>(first),
                                       values.begin() + static_cast<std::ptrdiff_t>(last));
    };
    fitted.time = slice(run.time);
    fitted.left_velocity = slice(left);
    fitted.right_velocity = slice(right);
    fitted.heading = slice(run.heading);
    if (!fitted.used) {
      continue;
    }
    const RunModel model = model_of(fit, report.tests[index]);
    const bool rests =
        !is_quasistatic(run.kind) &&
        std::abs(window->velocity_hat.front()) < 0.02 * std::abs(window->velocity_hat.back());
    const Ways ways =
        simulate(model, run, first, last, rests ? 0.0 : start_speed(run.time, left, first, last),
                 rests ? 0.0 : start_speed(run.time, right, first, last));
    const double half = 0.5 * std::max(model.width, 2e-3);
    const auto shown = [&](const std::vector<double>& way, double time) {
      const double early = std::max(ways.time.front(), time - model.delay - half);
      const double late =
          std::min(ways.time.back(), std::max(early + half, time - model.delay + half));
      return late > early
                 ? (interpolate(ways.time, way, late) - interpolate(ways.time, way, early)) /
                       (late - early)
                 : 0.0;
    };
    for (const double time : fitted.time) {
      fitted.left_velocity_hat.push_back(shown(ways.left, time));
      fitted.right_velocity_hat.push_back(shown(ways.right, time));
    }
    if (fit.trackwidth && fit.trackwidth->determined && !fitted.heading.empty()) {
      std::vector<double> offsets;
      for (std::size_t i = 0; i < fitted.time.size(); ++i) {
        fitted.heading_hat.push_back((ways.right[i] - ways.left[i]) / fit.trackwidth->value);
        offsets.push_back(fitted.heading[i] - fitted.heading_hat[i]);
      }
      const double offset = median(std::move(offsets));
      for (double& heading : fitted.heading_hat) {
        heading += offset;
      }
    }
  }
  return runs;
}

}  // namespace flyball::identification
