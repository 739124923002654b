#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>

#include <flyball/core/argument.hpp>

#include "core/diagnose.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "identification/drive_preparation.hpp"
#include "identification/statistics.hpp"

namespace flyball::identification {

namespace {

constexpr std::string_view in_drive_preparation = "identify";
constexpr double against = -0.3;  ///< Correlation below which two signals have opposite signs.

struct NamedSide {
  std::string_view name;
  DriveSide DriveRun::* side;
};
constexpr std::array sides{NamedSide{"left", &DriveRun::left},
                           NamedSide{"right", &DriveRun::right}};

Expected<void> check_columns(const DriveRun& run, std::size_t index) {
  const std::size_t rows = run.time.size();
  const auto fits = [rows](const std::vector<double>& column) {
    return column.empty() || column.size() == rows;
  };
  for (const NamedSide& of : sides) {
    const DriveSide& side = run.*of.side;
    const bool sized = side.voltage.size() == rows && fits(side.position) && fits(side.velocity) &&
                       fits(run.heading) && fits(run.heading_rate);
    const bool moves = rows == 0 || !side.position.empty() || !side.velocity.empty();
    if (!sized || !moves) {
      return refusal(ArgumentError::wrong_shape, in_drive_preparation,
                     detail::format("run {} ({}), {} side", index, to_string(run.kind), of.name))
          .got(detail::format("{} times, {} voltages, {} positions, {} velocities, {} headings",
                              rows, side.voltage.size(), side.position.size(), side.velocity.size(),
                              run.heading.size()))
          .expected("columns of one length, position or velocity among them");
    }
  }
  return {};
}

void negate_drive(std::vector<double>& values) {
  for (double& value : values) {
    value = -value;
  }
}

/// Sums for a correlation.
struct Products {
  double xy = 0.0;
  double xx = 0.0;
  double yy = 0.0;

  void add(double x, double y) {
    xy += x * y;
    xx += x * x;
    yy += y * y;
  }
  Products& operator+=(const Products& other) {
    xy += other.xy;
    xx += other.xx;
    yy += other.yy;
    return *this;
  }
  [[nodiscard]] double correlation() const {
    return xx > 0.0 && yy > 0.0 ? xy / std::sqrt(xx) / std::sqrt(yy) : 0.0;
  }
};

/// Calls `tell(row, speed)` each tenth of a second with the speed over it, by the position where
/// there is one.
template <class Tell>
void each_speed(const std::vector<double>& time, const DriveSide& side, Tell tell) {
  constexpr double window = 0.1;  // s
  std::size_t from = 0;
  for (std::size_t to = 1; to < time.size(); ++to) {
    const double span = time[to] - time[from];
    if (span < window) {
      continue;
    }
    tell(to, side.position.empty() ? 0.5 * (side.velocity[to] + side.velocity[from])
                                   : (side.position[to] - side.position[from]) / span);
    from = to;
  }
}

/// The voltage against the speed of a side in one run.
Products drive_products(const DriveRun& run, const DriveSide& side) {
  Products products;
  each_speed(run.time, side,
             [&](std::size_t row, double speed) { products.add(side.voltage[row], speed); });
  return products;
}

double top_speed(const DriveRecording& recording, DriveSide DriveRun::* side) {
  std::vector<double> speeds;
  for (const DriveRun& run : recording.runs) {
    each_speed(run.time, run.*side,
               [&](std::size_t, double speed) { speeds.push_back(std::abs(speed)); });
  }
  return quantile(std::move(speeds), 0.98);
}

Expected<void> check_motion(const DriveRecording& recording) {
  const std::array speeds{top_speed(recording, &DriveRun::left),
                          top_speed(recording, &DriveRun::right)};
  double volts = 0.0;
  for (const DriveRun& run : recording.runs) {
    for (const NamedSide& of : sides) {
      for (const double value : (run.*of.side).voltage) {
        volts = std::max(volts, std::abs(value));
      }
    }
  }
  constexpr double standstill = 2e-3;  // m/s; a wheel's rad/s
  const double fastest = std::max(speeds[0], speeds[1]);
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (speeds[i] < std::max(standstill, 0.01 * fastest)) {
      const bool both = fastest < standstill;
      return refusal(
                 IdentificationError::no_motion, in_drive_preparation,
                 both ? std::string("neither side") : detail::format("the {} side", sides[i].name))
          .got(both ? detail::format("moving under up to {:.3g} V", volts)
                    : detail::format("at rest while the other one reaches {:.3g} {}/s", fastest,
                                     recording.unit))
          .hint(volts < 0.1 ? "no voltage was applied either: the log was started but no test ran"
                            : "check that its encoder counts, that it is plugged in, and that the "
                              "wheels are on the ground")
          .with("largest voltage (V)", volts);
    }
  }
  return {};
}

void mend_velocities(DriveRecording& recording, std::vector<Diagnostic>& diagnostics) {
  for (const NamedSide& of : sides) {
    Products products;
    for (const DriveRun& run : recording.runs) {
      const DriveSide& side = run.*of.side;
      if (!side.position.empty() && !side.velocity.empty()) {
        each_speed(run.time, side,
                   [&](std::size_t row, double speed) { products.add(side.velocity[row], speed); });
      }
    }
    if (products.correlation() < against) {
      for (DriveRun& run : recording.runs) {
        negate_drive((run.*of.side).velocity);
      }
      warn(diagnostics, "sign_mismatch",
           "the {} side's position and velocity have opposite signs; the velocity was negated",
           of.name);
    }
  }
}

/// Loggers that record the size of the voltage alone: it gets the motion's sign.
void sign_voltages(DriveRecording& recording, std::vector<Diagnostic>& diagnostics) {
  for (const NamedSide& of : sides) {
    double lowest = 0.0;
    double highest = 0.0;
    bool with = false;
    std::vector<std::size_t> backward;
    for (std::size_t i = 0; i < recording.runs.size(); ++i) {
      const DriveSide& side = recording.runs[i].*of.side;
      for (const double value : side.voltage) {
        lowest = std::min(lowest, value);
        highest = std::max(highest, value);
      }
      const double correlation = drive_products(recording.runs[i], side).correlation();
      with = with || correlation > -against;
      if (correlation < against) {
        backward.push_back(i);
      }
    }
    if (lowest < -0.05 * std::max(0.1, highest) || !with || backward.empty()) {
      continue;
    }
    for (const std::size_t i : backward) {
      negate_drive((recording.runs[i].*of.side).voltage);
    }
    warn(diagnostics, "sign_mismatch",
         "the {} side's voltage carries no sign: it is positive in all tests, but the side runs "
         "backwards in {} of them; the voltage was negated there",
         of.name, backward.size());
  }
}

/// What the encoders say of the voltages, in straight and in turning tests.
struct SideSigns {
  std::array<Products, 2> straight;
  std::array<Products, 2> turning;
};

SideSigns side_signs(const DriveRecording& recording) {
  SideSigns signs;
  for (const DriveRun& run : recording.runs) {
    double same = 0.0;
    for (std::size_t i = 0; i < run.time.size(); ++i) {
      same += run.left.voltage[i] * run.right.voltage[i];
    }
    std::array<Products, 2>& of_test = same >= 0.0 ? signs.straight : signs.turning;
    for (std::size_t i = 0; i < sides.size(); ++i) {
      of_test[i] += drive_products(run, run.*sides[i].side);
    }
  }
  return signs;
}

void swap_encoders(DriveRecording& recording) {
  for (DriveRun& run : recording.runs) {
    std::swap(run.left.position, run.right.position);
    std::swap(run.left.velocity, run.right.velocity);
  }
}

void mend_sides(DriveRecording& recording, std::vector<Diagnostic>& diagnostics) {
  SideSigns signs = side_signs(recording);
  const bool straight = signs.straight[0].xx + signs.straight[1].xx > 0.0;
  const std::array<Products, 2>& told = straight ? signs.straight : signs.turning;
  const bool left = told[0].correlation() < against;
  const bool right = told[1].correlation() < against;
  if (!straight && left && right) {
    swap_encoders(recording);
    warn(diagnostics, "swapped_sides",
         "both encoders count against their voltages while the robot turns: the left and the right "
         "one are swapped, or both are inverted (a straight test tells which). They were swapped");
    return;
  }
  const std::array reversed{left, right};
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (reversed[i]) {
      for (DriveRun& run : recording.runs) {
        negate_drive((run.*sides[i].side).position);
        negate_drive((run.*sides[i].side).velocity);
      }
      warn(diagnostics, "inverted_encoder",
           "the {} side's encoder counts against its voltage (correlation {:.2f}): it is inverted. "
           "Its position and velocity were negated; invert the encoder or the motor in the robot's "
           "code before using the gains",
           sides[i].name, told[i].correlation());
    }
  }
  if (straight && signs.turning[0].xx > 0.0) {
    signs = side_signs(recording);
    if (signs.turning[0].correlation() < against && signs.turning[1].correlation() < against) {
      swap_encoders(recording);
      warn(diagnostics, "swapped_sides",
           "straight on, both encoders follow their voltages, but in rotations they count against "
           "them: the left and the right encoder (or voltage) are swapped. The encoders were "
           "swapped; mend the robot's code");
    }
  }
}

std::vector<std::size_t> changes(const std::vector<double>& values) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (values[i] != values[i - 1]) {
      rows.push_back(i);
    }
  }
  return rows;
}

/// (right + sign · left)/2 of a column, at the left one's new values.
std::vector<double> joined(const std::vector<double>& time, const std::vector<double>& left,
                           const std::vector<double>& right, double sign) {
  std::vector<double> values(std::min(left.size(), right.size()));
  const std::vector<std::size_t> fresh_left = changes(left);
  const std::vector<std::size_t> fresh_right = changes(right);
  std::vector<std::size_t> common;
  std::set_intersection(fresh_left.begin(), fresh_left.end(), fresh_right.begin(),
                        fresh_right.end(), std::back_inserter(common));
  const bool together = 20 * common.size() >= 19 * std::min(fresh_left.size(), fresh_right.size());
  if (together || values.empty()) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = 0.5 * (right[i] + sign * left[i]);
    }
    return values;
  }
  std::vector<double> times{time.front()};
  std::vector<double> shown{right.front()};
  for (const std::size_t row : fresh_right) {
    times.push_back(time[row]);
    shown.push_back(right[row]);
  }
  double value = 0.5 * (right.front() + sign * left.front());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i > 0 && left[i] != left[i - 1]) {
      value = 0.5 * (interpolate(times, shown, time[i]) + sign * left[i]);
    }
    values[i] = value;
  }
  return values;
}

/// The test's kind with the direction of its voltage.
TestKind kind_of(TestKind said, const std::vector<double>& voltage) {
  double sum = 0.0;
  for (const double value : voltage) {
    sum += value;
  }
  if (is_quasistatic(said)) {
    return sum >= 0.0 ? TestKind::quasistatic_forward : TestKind::quasistatic_reverse;
  }
  return sum >= 0.0 ? TestKind::dynamic_forward : TestKind::dynamic_reverse;
}

}  // namespace

std::string_view to_string(DriveTest test) {
  switch (test) {
    case DriveTest::straight:
      return "straight";
    case DriveTest::turning:
      return "turning";
    case DriveTest::mixed:
      return "curve";
  }
  return "";
}

DriveTest drive_test(const DriveRun& run) {
  double together = 0.0;
  double apart = 0.0;
  for (std::size_t i = 0; i < run.time.size(); ++i) {
    together += std::abs(run.right.voltage[i] + run.left.voltage[i]);
    apart += std::abs(run.right.voltage[i] - run.left.voltage[i]);
  }
  constexpr double share = 0.15;  // of the other mode, that tells nothing yet
  return apart <= share * together   ? DriveTest::straight
         : together <= share * apart ? DriveTest::turning
                                     : DriveTest::mixed;
}

Expected<void> mend_drive(DriveRecording& recording, std::vector<Diagnostic>& diagnostics) {
  std::size_t rows = 0;
  for (std::size_t i = 0; i < recording.runs.size(); ++i) {
    FLYBALL_CHECK(check_columns(recording.runs[i], i));
    rows += recording.runs[i].time.size();
  }
  if (rows < 2) {
    return refusal(IdentificationError::no_data, in_drive_preparation)
        .hint("record the four tests again");
  }
  FLYBALL_CHECK(check_motion(recording));
  mend_velocities(recording, diagnostics);
  sign_voltages(recording, diagnostics);
  mend_sides(recording, diagnostics);
  return {};
}

TestRun mode_run(const DriveRun& run, double sign) {
  TestRun mode;
  mode.time = run.time;
  for (std::size_t i = 0; i < run.time.size(); ++i) {
    mode.voltage.push_back(0.5 * (run.right.voltage[i] + sign * run.left.voltage[i]));
  }
  mode.kind = kind_of(run.kind, mode.voltage);
  mode.position = joined(run.time, run.left.position, run.right.position, sign);
  mode.velocity = joined(run.time, run.left.velocity, run.right.velocity, sign);
  return mode;
}

}  // namespace flyball::identification
