// The follower of what moves in any direction as a header.
#include <flyball/export/holonomic_follower.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "export/text.hpp"

namespace flyball::exports {

namespace {

std::string constants_text(const HolonomicProgram& of, std::string_view origin) {
  std::string text = fmt::format(
      R"(// The holonomic follower with the loops of its wheels{}, of a {} drive.
// Made by `flyball design` from {}.
// Call calculate() every {} ms. SI units: m, s, rad counter-clockwise, V; x ahead, y left.
// Wheels: front left, front right, back left, back right.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace follower {{

)",
      of.swerve ? " and modules" : "", of.swerve ? "swerve" : "mecanum", comment_text(origin),
      literal(1e3 * of.period, constant_digits));
  text += constant_line("period", of.period, "s");
  text += constant_line("k_x", of.gains(0), "1/s");
  text += constant_line("k_y", of.gains(1), "1/s");
  text += constant_line("k_heading", of.gains(2), "1/s");
  text += constant_line("max_velocity", of.max_velocity, "m/s");
  text += constant_line("voltage_limit", of.voltage_limit, "V");
  text += "// A wheel's speed: v[k+1] = A v[k] + B u[k].\n";
  text += constant_line("A", of.A, "");
  text += constant_line("B", of.B, "m/s/V");
  text += constant_line("K", of.K, "V/(m/s)");
  text += constant_line("kS", of.kS, "V");
  if (!of.swerve) {
    text += "// The wheels' speeds of (vx, vy, omega).\n";
    text += fmt::format("inline constexpr double M[4][3] = {};\n", rows_of(of.M));
    return text;
  }
  text += constant_line("max_wheel_velocity", of.max_wheel_velocity, "m/s");
  Eigen::Matrix<double, 4, 2> places;
  for (Eigen::Index i = 0; i < 4; ++i) {
    places.row(i) = of.modules[static_cast<std::size_t>(i)].transpose();
  }
  text +=
      fmt::format("inline constexpr double modules[4][2] = {};  // m, x and y\n", rows_of(places));
  text += constant_line("steer_K", of.steer(0), "V/rad");
  text += constant_line("steer_D", of.steer(1), "V/(rad/s)");
  text += constant_line("creep", of.creep, "m/s, below which a module's direction stays");
  return text;
}

constexpr const char* holonomic_types = R"(
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
  double vx = 0.0;
  double vy = 0.0;
  double omega = 0.0;
};

namespace detail {

inline constexpr double largest = 1e100;  // what is beyond it counts as no number
inline constexpr double pi = 3.14159265358979323846;

inline bool known(double value) noexcept { return std::abs(value) <= largest; }
inline bool known(const Pose& pose) noexcept {
  return known(pose.x) && known(pose.y) && known(std::cos(pose.heading));
}
inline bool known(const Speeds& speeds) noexcept {
  return known(speeds.vx) && known(speeds.vy) && known(speeds.omega);
}

// The speeds that are wanted, in the robot's frame, now and a period later.
struct Asked {
  Speeds now;
  Speeds next;
  Status status = Status::tracking;
};
inline Asked follow(const Pose& pose, const Pose& reference, const Speeds& r,
                    const Speeds& r_next) noexcept {
  if (!known(reference) || !known(r) || !known(r_next)) {
    return {{}, {}, Status::no_reference};
  }
  const bool placed = known(pose);
  const Pose& at = placed ? pose : reference;
  // u = u_r + K (r - x), in the field, and in the robot's frame
  const double x = r.vx + k_x * (reference.x - at.x);
  const double y = r.vy + k_y * (reference.y - at.y);
  const double c = std::cos(at.heading);
  const double s = std::sin(at.heading);
  Speeds now{c * x + s * y, c * y - s * x,
             r.omega + k_heading * std::remainder(reference.heading - at.heading, 2.0 * pi)};
  Status status = placed ? Status::tracking : Status::no_pose;
  const double v = std::hypot(now.vx, now.vy);
  if (v > max_velocity) {
    const double factor =
        max_velocity / v * (1.0 - 4.0 * std::numeric_limits<double>::epsilon());
    now.vx *= factor;
    now.vy *= factor;
    status = std::min(status, Status::saturated);
  }
  // What the reference gains until the next period, the command does, too.
  const double gain_x = r_next.vx - r.vx;
  const double gain_y = r_next.vy - r.vy;
  return {now,
          {now.vx + (c * gain_x + s * gain_y), now.vy + (c * gain_y - s * gain_x),
           now.omega + (r_next.omega - r.omega)},
          status};
}

inline double limited(double u, Status& status) noexcept {
  if (!(std::abs(u) <= voltage_limit)) {
    status = std::min(status, Status::saturated);
  }
  return u > voltage_limit ? voltage_limit : u < -voltage_limit ? -voltage_limit
         : u == u          ? u
                           : 0.0;
}

// What makes a wheel as fast as v, and as next a period later.
inline double wheel(double measured, double v, double next, Status& status) noexcept {
  double u = (next - A * v) / B + (next > 0.0 ? kS : next < 0.0 ? -kS : 0.0);
  if (known(measured)) {
    u += K * (v - measured);
  } else {
    status = std::min(status, Status::no_pose);
  }
  return limited(u, status);
}

}  // namespace detail
)";

constexpr const char* mecanum = R"(
struct Wheels {
  double speed[4] = {};  // m/s, of the wheels' surface
};
struct Command {
  double drive[4] = {};  // V
  Speeds speeds;         // that are wanted, in the robot's frame
  Status status = Status::tracking;
};

// One period. measured: the wheels' speeds; r, r_next: the reference's velocity in the field, now
// and a period later, which may be r again.
inline Command calculate(const Pose& pose, const Wheels& measured, const Pose& reference,
                         const Speeds& r, const Speeds& r_next) noexcept {
  const detail::Asked asked = detail::follow(pose, reference, r, r_next);
  Command command;
  command.speeds = asked.now;
  command.status = asked.status;
  if (asked.status == Status::no_reference) {
    return command;
  }
  for (int i = 0; i < 4; ++i) {
    const auto of = [&](const Speeds& u) {
      return M[i][0] * u.vx + M[i][1] * u.vy + M[i][2] * u.omega;
    };
    command.drive[i] =
        detail::wheel(measured.speed[i], of(asked.now), of(asked.next), command.status);
  }
  return command;
}

}  // namespace follower
)";

constexpr const char* swerve = R"(
struct Modules {
  double speed[4] = {};  // m/s, of the wheels' surface
  double angle[4] = {};  // of their directions in the robot
  double rate[4] = {};   // rad/s, by which these turn
};
struct Command {
  double drive[4] = {};  // V
  double steer[4] = {};  // V
  Speeds speeds;         // that are wanted, in the robot's frame
  Status status = Status::tracking;
};

// One period. measured: the modules; r, r_next: the reference's velocity in the field, now and a
// period later, which may be r again.
inline Command calculate(const Pose& pose, const Modules& measured, const Pose& reference,
                         const Speeds& r, const Speeds& r_next) noexcept {
  const detail::Asked asked = detail::follow(pose, reference, r, r_next);
  Command command;
  command.speeds = asked.now;
  command.status = asked.status;
  if (asked.status == Status::no_reference) {
    return command;
  }
  double now[4][2] = {};
  double next[4][2] = {};
  double speed[4] = {};
  double most = 0.0;
  for (int i = 0; i < 4; ++i) {
    const auto of = [&](const Speeds& u, double* there) {
      there[0] = u.vx - u.omega * modules[i][1];
      there[1] = u.vy + u.omega * modules[i][0];
    };
    of(asked.now, now[i]);
    of(asked.next, next[i]);
    speed[i] = std::hypot(now[i][0], now[i][1]);
    most = std::max(most, speed[i]);
  }
  // One factor for all keeps the direction of the motion.
  double scale = 1.0;
  if (most > max_wheel_velocity) {
    scale = max_wheel_velocity / most;
    command.status = std::min(command.status, Status::saturated);
  }
  for (int i = 0; i < 4; ++i) {
    const double angle = measured.angle[i];
    if (!detail::known(std::cos(angle))) {  // where it would push is not known
      command.status = std::min(command.status, Status::no_pose);
      continue;
    }
    const double later = std::hypot(next[i][0], next[i][1]);
    const double to = speed[i] >= creep ? std::atan2(now[i][1], now[i][0])
                      : later >= creep  ? std::atan2(next[i][1], next[i][0])
                                        : angle;
    double turn = std::remainder(to - angle, 2.0 * detail::pi);
    double sign = 1.0;
    if (std::abs(turn) > 0.5 * detail::pi) {  // the other way round is nearer
      turn = std::remainder(turn + detail::pi, 2.0 * detail::pi);
      sign = -1.0;
    }
    // It pushes only as far as it points where it should.
    const double ahead = sign * scale * std::max(0.0, std::cos(turn));
    command.drive[i] =
        detail::wheel(measured.speed[i], ahead * speed[i], ahead * later, command.status);
    Status steering = command.status;  // which may be at its limit
    const double rate = detail::known(measured.rate[i]) ? measured.rate[i] : 0.0;
    command.steer[i] = detail::limited(steer_K * turn - steer_D * rate, steering);
  }
  return command;
}

}  // namespace follower
)";

}  // namespace

std::string holonomic_follower_header(const HolonomicProgram& program, std::string_view origin) {
  return constants_text(program, origin) + holonomic_types + (program.swerve ? swerve : mecanum);
}

}  // namespace flyball::exports
