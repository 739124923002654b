#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <flyball/math/probability/distributions.hpp>
#include <flyball/math/regression/least_squares.hpp>

#include "core/constants.hpp"
#include "core/diagnose.hpp"
#include "core/format.hpp"
#include "identification/drive_preparation.hpp"
#include "identification/estimates.hpp"
#include "identification/statistics.hpp"

namespace flyball::identification {

namespace {

constexpr double least_turn = 0.5;  // rad, of a run that tells something
constexpr std::size_t most_rows = 2000;

/// What a gyro's heading is compared with.
struct Turn {
  std::vector<double> time;
  std::vector<double> difference;  ///< m, of the sides' ways, right less left.
  std::vector<double> way;         ///< m, of their mean.
  std::vector<double> heading;     ///< rad
};

/// A wheel's way: its position, or its velocity's integral.
std::vector<double> way_of(const DriveRun& run, const DriveSide& side) {
  if (!side.position.empty()) {
    return side.position;
  }
  std::vector<double> way(run.time.size(), 0.0);
  for (std::size_t i = 1; i < way.size(); ++i) {
    way[i] = way[i - 1] +
             0.5 * (side.velocity[i] + side.velocity[i - 1]) * (run.time[i] - run.time[i - 1]);
  }
  return way;
}

Turn turn_of(const DriveRun& run) {
  Turn turn{run.time, way_of(run, run.right), {}, run.heading};
  const std::vector<double> left = way_of(run, run.left);
  for (std::size_t i = 0; i < left.size(); ++i) {
    turn.way.push_back(0.5 * (left[i] + turn.difference[i]));
    turn.difference[i] -= left[i];
  }
  return turn;
}

double range(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return values.empty() ? 0.0 : *high - *low;
}

/// A heading that jumps by a turn goes on.
void unwrap(std::vector<double>& heading, double turn) {
  double offset = 0.0;
  double before = heading.empty() ? 0.0 : heading.front();
  for (double& value : heading) {
    const double step = value - before;
    before = value;
    offset -= std::abs(step) > 0.8 * turn ? std::copysign(turn, step) : 0.0;
    value += offset;
  }
}

/// The slope of the difference over the heading in one run, with the run's own start.
double slope_of(const Turn& turn) {
  const auto n = static_cast<double>(turn.time.size());
  double mean_x = 0.0;
  double mean_y = 0.0;
  for (std::size_t i = 0; i < turn.time.size(); ++i) {
    mean_x += turn.heading[i] / n;
    mean_y += turn.difference[i] / n;
  }
  double xx = 0.0;
  double xy = 0.0;
  for (std::size_t i = 0; i < turn.time.size(); ++i) {
    xx += (turn.heading[i] - mean_x) * (turn.heading[i] - mean_x);
    xy += (turn.heading[i] - mean_x) * (turn.difference[i] - mean_y);
  }
  return xx > 0.0 ? xy / xx : 0.0;
}

/// D = W (θ − δ dθ/dt) + ε L + start, of all runs together; δ is the gyro's lead, ε the wheels'
/// difference in size, which only straight tests tell.
std::optional<std::pair<double, double>> regress(const std::vector<Turn>& turns, bool straight) {
  std::size_t total = 0;
  for (const Turn& turn : turns) {
    total += turn.time.size();
  }
  const std::size_t step = total / most_rows + 1;
  const auto columns = static_cast<Eigen::Index>(2 + (straight ? 1 : 0) + turns.size());
  Eigen::MatrixXd X =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(total / step + turns.size() + 1), columns);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(X.rows());
  Eigen::Index row = 0;
  double period = 0.0;
  for (std::size_t run = 0; run < turns.size(); ++run) {
    const Turn& turn = turns[run];
    period =
        std::max(period, (turn.time.back() - turn.time.front()) /
                             static_cast<double>(std::max<std::size_t>(1, turn.time.size() - 1)));
    for (std::size_t i = 0; i < turn.time.size() && row < X.rows(); i += step, ++row) {
      constexpr double half = 0.05;  // s, of the rate's window
      const double early = std::max(turn.time[i] - half, turn.time.front());
      const double late = std::min(turn.time[i] + half, turn.time.back());
      X(row, 0) = turn.heading[i];
      X(row, 1) = late > early ? (interpolate(turn.time, turn.heading, late) -
                                  interpolate(turn.time, turn.heading, early)) /
                                     (late - early)
                               : 0.0;
      if (straight) {
        X(row, 2) = turn.way[i];
      }
      X(row, columns - 1 - static_cast<Eigen::Index>(run)) = 1.0;
      y(row) = turn.difference[i];
    }
  }
  constexpr double memory = 0.6;  // s, over which residuals are correlated
  LeastSquaresOptions options{.errors = ErrorModel::hac};
  const double spacing = std::max(1e-4, period * static_cast<double>(step));
  options.lags = std::clamp(static_cast<int>(memory / spacing), 1, 60);
  const auto found = least_squares(X.topRows(row), y.head(row), options);
  if (!found || !found->determined[0]) {
    return std::nullopt;
  }
  return std::pair{found->coefficients[0], found->standard_errors[0]};
}

/// The gyro's rate against the derivative of its heading.
void check_rate(const std::vector<DriveRun>& runs, std::vector<Diagnostic>& diagnostics) {
  std::vector<double> ratios;
  for (const DriveRun& run : runs) {
    const std::size_t n = run.time.size();
    if (run.heading_rate.size() != n || run.heading.size() != n) {
      continue;
    }
    std::size_t from = 0;
    for (std::size_t to = 1; to < n; ++to) {
      const double span = run.time[to] - run.time[from];
      if (span < 0.1) {
        continue;
      }
      const double rate = (run.heading[to] - run.heading[from]) / span;
      if (std::abs(rate) > 0.3) {
        ratios.push_back(run.heading_rate[(from + to) / 2] / rate);
      }
      from = to;
    }
  }
  if (ratios.size() < 10) {
    return;
  }
  const double ratio = median(std::move(ratios));
  if (std::abs(ratio - 1.0) > 0.1) {
    const double size = std::abs(ratio);
    const char* cause = std::abs(size * 180.0 / pi - 1.0) < 0.1
                            ? ", as of radians that were taken for degrees"
                        : std::abs(size * pi / 180.0 - 1.0) < 0.1   ? ", as of degrees"
                        : ratio < 0.0 && std::abs(size - 1.0) < 0.1 ? ", of the opposite sense"
                                                                    : "";
    warn(diagnostics, "gyro_rate",
         "the gyro's rate is {:.3g} times the derivative of its heading{}; the heading is used, "
         "the rate is not",
         ratio, cause);
  }
}

/// Headings from the rate where there are none.
void integrate_rate(DriveRecording& recording, std::vector<Diagnostic>& diagnostics) {
  bool integrated = false;
  for (DriveRun& run : recording.runs) {
    const bool still = run.heading.empty() || range(run.heading) == 0.0;
    if (still && run.heading_rate.size() == run.time.size() && range(run.heading_rate) > 0.0) {
      run.heading.assign(run.time.size(), 0.0);
      for (std::size_t i = 1; i < run.time.size(); ++i) {
        run.heading[i] = run.heading[i - 1] + 0.5 *
                                                  (run.heading_rate[i] + run.heading_rate[i - 1]) *
                                                  (run.time[i] - run.time[i - 1]);
      }
      integrated = true;
    }
  }
  if (integrated) {
    note(diagnostics, "assumed", "the log has no heading: it was integrated from the gyro's rate");
  }
}

void scale_headings(DriveRecording& recording, double factor) {
  for (DriveRun& run : recording.runs) {
    for (double& heading : run.heading) {
      heading *= factor;
    }
  }
}

}  // namespace

std::optional<GainEstimate> find_trackwidth(DriveRecording& recording,
                                            const std::vector<DriveTest>& tests,
                                            std::vector<Diagnostic>& diagnostics) {
  integrate_rate(recording, diagnostics);
  bool turned = false;
  for (const DriveRun& run : recording.runs) {
    turned = turned || range(run.heading) > 0.0;
  }
  if (!turned) {
    const bool column = !recording.runs.empty() && !recording.runs.front().heading.empty();
    warn(diagnostics, "no_gyro",
         "{}: the trackwidth and gains per radian are not known. Record the gyro's heading with "
         "the tests",
         column ? "the gyro's heading never changes" : "the log has no heading of a gyro");
    return std::nullopt;
  }
  if (recording.unit != "m") {
    warn(diagnostics, "unit_unknown",
         "the wheels' size is not known, so there is no trackwidth in metres: say the metres of a "
         "wheel's rotation with --scale (2π r)");
    return std::nullopt;
  }
  const bool rotations = std::find(tests.begin(), tests.end(), DriveTest::turning) != tests.end();
  double widest = 0.0;
  std::vector<Turn> turns;
  std::vector<double> slopes;
  const auto collect = [&] {
    turns.clear();
    slopes.clear();
    widest = 0.0;
    for (std::size_t i = 0; i < recording.runs.size(); ++i) {
      DriveRun& run = recording.runs[i];
      if ((rotations && tests[i] != DriveTest::turning) || run.time.size() < 20 ||
          run.heading.size() != run.time.size()) {
        continue;
      }
      Turn turn = turn_of(run);
      const double angle = range(turn.heading);
      widest = std::max(widest, angle);
      if (range(turn.difference) > 0.0 && angle > 0.0) {
        slopes.push_back(slope_of(turn));
        turns.push_back(std::move(turn));
      }
    }
  };
  // Degrees before anything else: a turn, and what is a small one, depend on it.
  collect();
  const double raw = turns.empty() ? 0.0 : median(slopes);
  const bool degrees = rotations && std::abs(raw) < 0.04 && std::abs(raw) * 180.0 / pi < 2.5;
  for (DriveRun& run : recording.runs) {
    unwrap(run.heading, degrees ? 360.0 : 2.0 * pi);
  }
  if (degrees) {
    scale_headings(recording, pi / 180.0);
    warn(diagnostics, "unit_mistaken",
         "the heading must be in degrees, not in radians: the trackwidth would be {:.2g} m. It was "
         "converted",
         std::abs(raw));
  }
  check_rate(recording.runs, diagnostics);
  collect();
  double travel = 0.0;
  for (const Turn& turn : turns) {
    travel += range(turn.heading);
  }
  GainEstimate width;
  const auto undetermined = [&](std::string reason) {
    width.determined = false;
    width.reason = std::move(reason);
    width.upper_bound = std::numeric_limits<double>::infinity();
    note(diagnostics, "trackwidth_not_determined",
         "the trackwidth is not determined: {}; record rotation tests with the gyro (the sides "
         "driven against each other)",
         width.reason);
    return width;
  };
  if (turns.empty() || widest < least_turn) {
    return undetermined(detail::format("the robot turned by {:.2g} rad at most", widest));
  }
  const auto pooled = regress(turns, !rotations);
  if (!pooled) {
    return undetermined("heading and wheels do not tell it from the wheels' sizes");
  }
  // Wheels slip differently from run to run, more than the noise within one tells.
  double spread = 0.0;
  if (slopes.size() > 1) {
    const auto n = static_cast<double>(slopes.size());
    double mean = 0.0;
    for (const double slope : slopes) {
      mean += slope / n;
    }
    for (const double slope : slopes) {
      spread += (slope - mean) * (slope - mean);
    }
    spread = student_quantile(0.975, n - 1.0) / normal_quantile(0.975) *
             std::sqrt(spread / (n - 1.0) / n);
  }
  const double value = pooled->first;
  width = symmetric_estimate(std::abs(value), std::max(pooled->second, spread));
  const double half = 0.5 * (width.interval[1] - width.interval[0]);
  if (half > 0.2 * width.value) {
    return undetermined(detail::format("its interval is ±{:.0f} % after {:.2g} rad of turning",
                                       100.0 * half / width.value, travel));
  }
  if (value < 0.0) {
    scale_headings(recording, -1.0);
    for (DriveRun& run : recording.runs) {
      for (double& rate : run.heading_rate) {
        rate = -rate;
      }
    }
    warn(diagnostics, "gyro_clockwise",
         "the heading falls where the right side goes farther than the left one: the gyro counts "
         "clockwise (as a NavX does), or left and right are swapped. The heading was negated; "
         "negate it in the robot's code if the robot turns left at a positive right voltage");
  }
  if (width.value < 0.15 || width.value > 1.5) {
    warn(diagnostics, "unusual_trackwidth",
         "a trackwidth of {:.3g} m is no usual robot's: the unit of the positions is probably "
         "another (say it with --unit, or with --scale the metres of a recorded unit)",
         width.value);
  }
  return width;
}

}  // namespace flyball::identification
