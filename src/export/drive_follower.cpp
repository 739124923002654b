// The followers of differential drives as headers.
#include <flyball/export/drive_follower.hpp>

#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "export/text.hpp"

namespace flyball::exports {

namespace {

/// What all of them begin with.
std::string beginning(std::string_view law, std::string_view origin, double period,
                      double trackwidth, double voltage_limit, const DriveInversion& inversion) {
  std::string text = fmt::format(
      R"(// {}
// Made by `flyball design` from {}.
// Call calculate() every {} ms. SI units: m, s, rad counter-clockwise, V.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace follower {{

)",
      law, comment_text(origin), literal(1e3 * period, constant_digits));
  text += constant_line("period", period, "s");
  text += constant_line("trackwidth", trackwidth, "m");
  text += constant_line("voltage_limit", voltage_limit, "V");
  text += "// The sides' velocities, left and right: v[k+1] = A v[k] + B u[k].\n";
  text += fmt::format("inline constexpr double A[2][2] = {};\n", rows_of(inversion.A()));
  text += fmt::format("inline constexpr double B_inverse[2][2] = {};\n",
                      rows_of(inversion.B_inverse()));
  text += fmt::format("inline constexpr double kS[2] = {{{}, {}}};  // V\n",
                      literal(inversion.kS()(0)), literal(inversion.kS()(1)));
  return text;
}

constexpr const char* shared = R"(
// How an answer came about, the gravest reason first.
enum class Status {
  no_reference,  // The reference is not of finite numbers: 0 V.
  no_pose,       // What was measured is not of finite numbers: no feedback of it.
  saturated,     // The law asks for more than the limits; the answer is within them.
  tracking,
};

struct Pose {
  double x = 0.0;
  double y = 0.0;
  double heading = 0.0;
};
struct Speeds {
  double v = 0.0;      // ahead
  double omega = 0.0;
};
struct Sides {
  double left = 0.0;
  double right = 0.0;
};
struct Command {
  Sides voltage;
  Speeds speeds;  // that are wanted
  Status status = Status::tracking;
};

namespace detail {

inline constexpr double largest = 1e100;  // what is beyond it counts as no number

inline bool known(double value) noexcept { return std::abs(value) <= largest; }
inline bool known(const Pose& pose) noexcept {
  return known(pose.x) && known(pose.y) && known(std::cos(pose.heading));
}
inline bool known(const Sides& sides) noexcept { return known(sides.left) && known(sides.right); }
inline double cut(double value) noexcept {
  return value > largest ? largest : value < -largest ? -largest : value == value ? value : 0.0;
}
inline double known_or_zero(double value) noexcept { return known(value) ? value : 0.0; }

// From a pose to the reference, in the robot's frame.
struct Error {
  double x;
  double y;
  double heading;
};
inline Error error_of(const Pose& pose, const Pose& r) noexcept {
  const double c = std::cos(pose.heading);
  const double s = std::sin(pose.heading);
  const double c_r = std::cos(r.heading);
  const double s_r = std::sin(r.heading);
  const double dx = r.x - pose.x;
  const double dy = r.y - pose.y;
  return {c * dx + s * dy, c * dy - s * dx, std::atan2(s_r * c - c_r * s, c_r * c + s_r * s)};
}

// By one factor within the limit: the way the robot turns stays.
inline Sides within_voltage(const Sides& u, bool& saturated) noexcept {
  const Sides wanted{cut(u.left), cut(u.right)};
  const double most = std::max(std::abs(wanted.left), std::abs(wanted.right));
  if (!(most > voltage_limit)) {
    return wanted;
  }
  saturated = true;
  return {wanted.left / most * voltage_limit, wanted.right / most * voltage_limit};
}

inline double friction(double level, double velocity) noexcept {
  return velocity > 0.0 ? level : velocity < 0.0 ? -level : 0.0;
}

// What takes the sides from r to r_next in a period.
inline Sides feedforward(const Sides& r, const Sides& r_next) noexcept {
  const double left = r_next.left - (A[0][0] * r.left + A[0][1] * r.right);
  const double right = r_next.right - (A[1][0] * r.left + A[1][1] * r.right);
  return {known_or_zero(B_inverse[0][0] * left + B_inverse[0][1] * right +
                        friction(kS[0], r_next.left)),
          known_or_zero(B_inverse[1][0] * left + B_inverse[1][1] * right +
                        friction(kS[1], r_next.right))};
}

}  // namespace detail

inline Sides sides_of(const Speeds& speeds) noexcept {
  const double turning = 0.5 * trackwidth * speeds.omega;
  return {speeds.v - turning, speeds.v + turning};
}
)";

constexpr const char* no_farther = R"(
namespace detail {

// A position that is farther off pulls as one at this distance does.
inline Error no_farther(const Error& e) noexcept {
  const double away = std::hypot(e.x, e.y);
  if (!(away > farthest_error)) {
    return e;
  }
  return {e.x / away * farthest_error, e.y / away * farthest_error, e.heading};
}

}  // namespace detail
)";

/// Constants of what is within limits of speed.
std::string limits_text(const SpeedLimits& limits) {
  return constant_line("max_velocity", limits.velocity, "m/s") +
         constant_line("max_angular_velocity", limits.angular_velocity, "rad/s") +
         constant_line("max_wheel_velocity", limits.wheel_velocity, "m/s") +
         constant_line("limited_trackwidth", limits.trackwidth, "m, of the wheels' limit");
}

std::string tracker_text(const DriveVelocityTracker& tracker) {
  return "// Of the sides' velocities, V/(m/s).\n" +
         fmt::format("inline constexpr double K_sides[2][2] = {};\n",
                     rows_of(Eigen::MatrixXd(tracker.K())));
}

constexpr const char* on_arc = R"(
struct Asked {
  Speeds speeds;
  Status status = Status::tracking;
};

namespace detail {

// Scaled by one factor until they keep the limits: the robot stays on its arc.
inline Speeds on_arc(double v, double omega, bool& saturated) noexcept {
  v = cut(v);
  omega = cut(omega);
  double factor = 1.0;
  const auto keep = [&factor](double value, double limit) {
    if (value > limit) {
      factor = std::min(factor, limit / value);
    }
  };
  keep(std::abs(v), max_velocity);
  keep(std::abs(omega), max_angular_velocity);
  keep(std::abs(v) + 0.5 * limited_trackwidth * std::abs(omega), max_wheel_velocity);
  if (factor >= 1.0) {
    return {v, omega};
  }
  saturated = true;
  factor *= 1.0 - 4.0 * std::numeric_limits<double>::epsilon();
  return {factor * v, factor * omega};
}

}  // namespace detail
)";

constexpr const char* cascade_begin = R"(
// The speeds that lead to the reference. r: its own speeds.
inline Asked follow(const Pose& pose, const Pose& reference, const Speeds& r) noexcept {
  if (!detail::known(reference) || !detail::known(r.v) || !detail::known(r.omega)) {
    return {{}, Status::no_reference};
  }
  bool saturated = false;
  if (!detail::known(pose)) {
    return {detail::on_arc(r.v, r.omega, saturated), Status::no_pose};
  }
)";

constexpr const char* cascade_end = R"(  const Speeds speeds = detail::on_arc(v, omega, saturated);
  return {speeds, saturated ? Status::saturated : Status::tracking};
}

// The voltages that make the sides as fast as r, and as r_next a period later.
inline Command track(const Sides& measured, const Sides& r, const Sides& r_next) noexcept {
  if (!detail::known(r) || !detail::known(r_next)) {
    return {{}, {}, Status::no_reference};
  }
  Sides u = detail::feedforward(r, r_next);
  const bool moving = detail::known(measured);
  if (moving) {
    const double left = r.left - measured.left;
    const double right = r.right - measured.right;
    u.left += K_sides[0][0] * left + K_sides[0][1] * right;
    u.right += K_sides[1][0] * left + K_sides[1][1] * right;
  }
  bool saturated = false;
  const Sides voltage = detail::within_voltage(u, saturated);
  return {voltage,
          {},
          !moving     ? Status::no_pose
          : saturated ? Status::saturated
                      : Status::tracking};
}

// One period. measured: the sides' velocities; r, r_next: the reference's speeds, now and a period
// later, which may be r again.
inline Command calculate(const Pose& pose, const Sides& measured, const Pose& reference,
                         const Speeds& r, const Speeds& r_next) noexcept {
  const Asked asked = follow(pose, reference, r);
  const Sides now = sides_of(asked.speeds);
  const Sides here = sides_of(r);
  const Sides there = sides_of(r_next);
  Command command = track(measured, now,
                          {now.left + (there.left - here.left),
                           now.right + (there.right - here.right)});
  command.speeds = asked.speeds;
  command.status = std::min(command.status, asked.status);
  return command;
}

}  // namespace follower
)";

}  // namespace

std::string drive_follower_header(const RamseteFollower& follower,
                                  const DriveVelocityTracker& tracker, double trackwidth,
                                  std::string_view origin) {
  const RamseteSettings& of = follower.settings();
  std::string text =
      beginning("Ramsete with a tracker of the sides' velocities, of a differential drive.", origin,
                tracker.settings().period.si(), trackwidth, tracker.settings().voltage_limit,
                tracker.inversion());
  text += tracker_text(tracker);
  text += constant_line("b", of.b, "rad²/m²");
  text += constant_line("zeta", of.zeta, "1/rad");
  text += limits_text(of.limits);
  text += shared;
  text += on_arc;
  text += cascade_begin;
  text += R"(  const detail::Error e = detail::error_of(pose, reference);
  const double sine = std::sin(e.heading);
  const double sinc =
      std::abs(e.heading) > 1e-4 ? sine / e.heading : 1.0 - e.heading * e.heading / 6.0;
  const double k = 2.0 * zeta * std::sqrt(r.omega * r.omega + b * r.v * r.v);
  const double v = r.v * std::cos(e.heading) + k * e.x;
  const double omega = r.omega + k * e.heading + b * r.v * sinc * e.y;
)";
  return text + cascade_end;
}

std::string drive_follower_header(const LtvUnicycleFollower& follower,
                                  const DriveVelocityTracker& tracker, double trackwidth,
                                  std::string_view origin) {
  const LtvUnicycleSettings& of = follower.settings();
  const bool fades = of.low_speed.cross_track == LowSpeed::CrossTrack::fades;
  std::string text = beginning(
      "The time-varying unicycle regulator with a tracker of the sides' velocities, of a "
      "differential\n// drive.",
      origin, tracker.settings().period.si(), trackwidth, tracker.settings().voltage_limit,
      tracker.inversion());
  text += tracker_text(tracker);
  const double T = of.period.si();
  const double across = of.angular_velocity_tolerance / of.y_tolerance;
  const double heading = of.angular_velocity_tolerance / of.heading_tolerance;
  const double root = std::sqrt(4.0 + heading * T * (heading * T));
  text += "// K(v) = [k_x, 0, 0; 0, k_y(v), k_heading(v)], the discrete LQR's in closed form.\n";
  text += constant_line("follower_period", T, "s");
  text += constant_line("k_x", follower.K(0.0)(0, 0), "1/s");
  text += constant_line("across", across, "rad/(s m), of the tolerances");
  text += constant_line("turn", heading, "1/s, of the tolerances");
  text += constant_line("root", root, "√(4 + turn² T²)");
  text += constant_line("root_less", heading * T * (heading * T) / (2.0 + root), "less 2");
  text += constant_line(
      "low_velocity", of.low_speed.velocity,
      fades ? "m/s: below it the cross-track gain fades" : "m/s: below it the gain stays");
  text += constant_line("farthest_error", of.farthest_error, "m");
  text += limits_text(of.limits);
  text += shared;
  text += on_arc;
  text += no_farther;
  text += cascade_begin;
  text += fmt::format(
      R"(  const detail::Error e = detail::no_farther(detail::error_of(pose, reference));
  const double speed = std::max(std::abs(r.v), low_velocity);
  const double g = across * speed * follower_period * follower_period;
  const double n = 0.5 * g + root;
  const double n_less = 0.5 * g + root_less;
  const double h = 2.0 / (n + std::sqrt(n_less * (n + 2.0)));
  const double k_y = across * h;
  const double k_heading = std::sqrt(turn * turn * h * h + 2.0 * speed * k_y);
  const double share = {}r.v < 0.0 ? -1.0 : 1.0{};
  const double v = r.v + k_x * e.x;
  const double omega = r.omega + share * k_y * e.y + k_heading * e.heading;
)",
      fades ? "std::abs(r.v) >= low_velocity ? (" : "", fades ? ") : r.v / low_velocity" : "");
  return text + cascade_end;
}

std::string drive_follower_header(const LtvDriveFollower& follower, std::string_view origin) {
  const LtvDriveSettings& of = follower.settings();
  const bool fades = of.low_speed.cross_track == LowSpeed::CrossTrack::fades;
  std::string text = beginning(
      "The time-varying regulator of a differential drive, its gain scheduled over the velocity.",
      origin, of.period.si(), follower.trackwidth(), of.voltage_limit, follower.inversion());
  text += constant_line(
      "low_velocity", of.low_speed.velocity,
      fades ? "m/s: below it the cross-track gain fades" : "m/s: below it the gain stays");
  text += constant_line("largest_velocity", of.largest_velocity, "m/s: above it the gain stays");
  text += constant_line("farthest_error", of.farthest_error, "m");
  text += fmt::format("inline constexpr int intervals = {};\n", LtvDriveFollower::intervals);
  text +=
      "// K of [x, y, heading, left, right] at low + (largest - low) (i/intervals)²; at -v with\n"
      "// the gain of y negated.\n"
      "inline constexpr double K[intervals + 1][2][5] = {\n";
  for (const auto& K : follower.schedule()) {
    text += fmt::format("    {},\n", rows_of(K));
  }
  text += "};\n";
  text += shared;
  text += no_farther;
  text += fmt::format(R"(
// One period. measured: the sides' velocities; r, r_next: the reference's speeds, now and a period
// later, which may be r again.
inline Command calculate(const Pose& pose, const Sides& measured, const Pose& reference,
                         const Speeds& r, const Speeds& r_next) noexcept {{
  const Sides sides = sides_of(r);
  if (!detail::known(reference) || !detail::known(sides)) {{
    return {{{{}}, {{}}, Status::no_reference}};
  }}
  const Sides u_ff = detail::feedforward(sides, sides_of(r_next));
  const bool moving = detail::known(measured);
  const bool placed = detail::known(pose);
  double e[5] = {{}};  // what is not measured counts as what it should be
  if (placed) {{
    const detail::Error off = detail::no_farther(detail::error_of(pose, reference));
    e[0] = off.x;
    e[1] = off.y;
    e[2] = off.heading;
  }}
  if (moving) {{
    e[3] = sides.left - measured.left;
    e[4] = sides.right - measured.right;
  }}
  const double v = detail::cut(moving ? 0.5 * (measured.left + measured.right)
                                      : 0.5 * (sides.left + sides.right));
  const double speed = std::min(std::max(std::abs(v), low_velocity), largest_velocity);
  const double place =
      std::sqrt(std::max(0.0, (speed - low_velocity) / (largest_velocity - low_velocity))) *
      intervals;
  const int before = std::min(static_cast<int>(place), intervals - 1);
  const double between = std::min(1.0, place - before);
  const double share = {}v < 0.0 ? -1.0 : 1.0{};
  double u[2] = {{}};
  for (int i = 0; i < 2; ++i) {{
    for (int j = 0; j < 5; ++j) {{
      const double gain = (1.0 - between) * K[before][i][j] + between * K[before + 1][i][j];
      u[i] += (j == 1 ? share * gain : gain) * e[j];
    }}
  }}
  bool saturated = false;
  const Sides voltage = detail::within_voltage({{u[0] + u_ff.left, u[1] + u_ff.right}}, saturated);
  return {{voltage,
          r,
          !placed || !moving ? Status::no_pose
          : saturated        ? Status::saturated
                             : Status::tracking}};
}}

}}  // namespace follower
)",
                      fades ? "std::abs(v) >= low_velocity ? (" : "",
                      fades ? ") : v / low_velocity" : "");
  return text;
}

}  // namespace flyball::exports
