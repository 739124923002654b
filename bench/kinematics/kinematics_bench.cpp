// Swerve kinematics: times of inverse and desaturation beside the matrix (11.14) with hypot and
// atan2, as it is usually written, in one run; and how far a robot whose modules have motors,
// inertia and tires that slip drifts from the exact way in five seconds at full speed.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include <timing.hpp>

#include <flyball/geometry/se2.hpp>
#include <flyball/mechanisms/drivetrain/swerve_dynamics.hpp>
#include <flyball/mechanisms/kinematics/saturation.hpp>
#include <flyball/mechanisms/kinematics/swerve_limiter.hpp>
#include <flyball/mechanisms/power/powered.hpp>
#include <flyball/systems/model_step.hpp>

using namespace flyball;
using namespace flyball::mechanisms;
using Eigen::Vector2d;

namespace {

const std::array<Vector2d, 4> places{
    Vector2d(0.28, 0.26), {0.28, -0.26}, {-0.28, 0.26}, {-0.28, -0.26}};
constexpr double period = 0.02;
constexpr double max_speed = 4.4;

/// Inverse kinematics and desaturation by the 8 x 3 matrix.
struct Peer {
  Eigen::Matrix<double, 8, 3> M;
  Peer() {
    for (int i = 0; i < 4; ++i) {
      const Vector2d& r = places[static_cast<std::size_t>(i)];
      M.middleRows<2>(2 * i) << 1, 0, -r(1), 0, 1, r(0);
    }
  }
  void operator()(const Eigen::Vector3d& speeds, std::array<double, 4>& speed,
                  std::array<double, 4>& angle) const {
    const Eigen::Vector<double, 8> v = M * speeds;
    double fastest = 0.0;
    for (int i = 0; i < 4; ++i) {
      const auto k = static_cast<std::size_t>(i);
      speed[k] = std::hypot(v(2 * i), v(2 * i + 1));
      angle[k] = std::atan2(v(2 * i + 1), v(2 * i));
      fastest = std::max(fastest, speed[k]);
    }
    if (fastest > max_speed) {
      for (double& one : speed) {
        one *= max_speed / fastest;
      }
    }
  }
};

volatile double sink = 0.0;

template <class Work>
double best(Work&& work) {
  double least = 1e9;
  for (int run = 0; run < 15; ++run) {
    least = std::min(least, 1000.0 * bench::microseconds(20000, work));
  }
  return least;
}

void times() {
  const auto kinematics = swerve_kinematics(places).value();
  const Peer peer;
  double phase = 0.0;
  const auto next = [&] {
    phase += 0.37;
    phase = phase > 6.0 ? phase - 6.0 : phase;
    return ChassisSpeeds{4.0 + phase, phase - 3.0, 2.0 * phase - 6.0};
  };
  std::array<double, 4> speed{};
  std::array<double, 4> angle{};
  const double by_matrix = best([&] {
    peer(next().vector(), speed, angle);
    sink = speed[0] + angle[3];
  });
  SwerveKinematics<4>::Modules modules;
  const double plain = best([&] {
    const auto slowed = desaturated(kinematics.modules(next(), modules), max_speed);
    sink = slowed.modules[0].speed + slowed.modules[3].angle.sin();
  });
  const double joint = best([&] {
    const auto motion = saturated(kinematics, next(), HeldFrame::field, period, max_speed);
    modules = kinematics.modules(motion.twist, modules);
    sink = modules[0].speed + modules[3].angle.sin();
  });
  auto limiter =
      swerve_limiter(kinematics,
                     {.max_speed = Velocity(max_speed),
                      .steer_rate = AngularVelocity(20.0),
                      .acceleration = Acceleration(8.0)},
                     {.body = {.mass = Mass(50.0), .moment_of_inertia = MomentOfInertia(4.0)},
                      .motor = kraken_x60(),
                      .gearing = 6.75,
                      .wheel_radius = Length(0.05),
                      .stator_limit = 80.0},
                     Time(period))
          .value();
  const double limited = best([&] { sink = limiter.update(next()).speeds.vx; });
  std::printf("four modules, one call, ns (least of 15 runs)\n");
  std::printf("  matrix, hypot, atan2, desaturation            %6.1f   1.00\n", by_matrix);
  std::printf("  modules + desaturated                         %6.1f   %4.2f\n", plain,
              plain / by_matrix);
  std::printf("  saturated (field) + modules                   %6.1f   %4.2f\n", joint,
              joint / by_matrix);
  std::printf("  SwerveLimiter::update with forces             %6.1f   %4.2f\n", limited,
              limited / by_matrix);
}

using Dynamics = SwerveDynamics<4>;
using Drive = Powered<Dynamics>;
using State = Eigen::Vector<double, Dynamics::states()>;
using Volts = Eigen::Vector<double, Dynamics::inputs()>;

Drive robot() {
  SwerveDynamicsParameters<4> made{
      .body = {.mass = Mass(50.0), .moment_of_inertia = MomentOfInertia(4.0)},
      .positions = places,
      .wheel_radius = Length(0.05),
      .drive = {.motor = kraken_x60(),
                .gearing = 6.75,
                .moment_of_inertia = MomentOfInertia(0.006),
                .friction = 0.2},
      .steer = {.motor = falcon_500(),
                .gearing = 150.0 / 7.0,
                .moment_of_inertia = MomentOfInertia(0.03),
                .friction = 0.5},
      .patch_radius = Length(0.01)};
  return powered(swerve_dynamics(made).value(), {.stator = 80.0, .supply = 60.0},
                 {.open_circuit_voltage = 12.6, .resistance = 0.015})
      .value();
}

/// A module's controllers, each millisecond: the steering by position and rate, the wheel by a
/// feedforward and a proportional gain.
Volts module_loops(const State& x, const std::array<SwerveModule, 4>& modules,
                   const std::array<SwerveModuleRates, 4>& rates, double radius) {
  Volts u;
  for (int i = 0; i < 4; ++i) {
    const auto& module = modules[static_cast<std::size_t>(i)];
    const auto& rate = rates[static_cast<std::size_t>(i)];
    const double away = (module.angle * Rotation2d(x(Dynamics::angle_at(i))).inverse()).angle();
    u(4 + i) = 60.0 * away + 1.5 * (rate.steer_rate - x(Dynamics::steer_rate_at(i))) +
               0.4 * rate.steer_rate;
    const double Omega = module.speed / radius;
    u(i) = 6.75 / kraken_x60().Kv * Omega + 0.15 * (Omega - x(Dynamics::wheel_speed_at(i)));
  }
  return u;
}

struct Drift {
  double distance = 0.0;  ///< m, of the pose from the nearest of the exact way's.
  double angle = 0.0;     ///< rad, of its heading from that one's.
  double scale = 1.0;
};

/// Five seconds of one motion, from rest. @param exact  The pose at a "time" along the way.
template <class Command, class Exact>
Drift drive(bool jointly, const Command& command, const Exact& exact) {
  const Drive model = robot();
  const auto kinematics = swerve_kinematics(places).value();
  auto limiter =
      swerve_limiter(kinematics,
                     {.max_speed = Velocity(max_speed),
                      .steer_rate = AngularVelocity(20.0),
                      .acceleration = Acceleration(6.0)},
                     {.body = {.mass = Mass(50.0), .moment_of_inertia = MomentOfInertia(4.0)},
                      .motor = kraken_x60(),
                      .gearing = 6.75,
                      .wheel_radius = Length(0.05),
                      .stator_limit = 80.0,
                      .supply_limit = 60.0,
                      .friction = 1.0},
                     Time(period))
          .value();
  State x = State::Zero();
  std::array<SwerveModule, 4> modules{};
  std::array<SwerveModuleRates, 4> rates{};
  double time = 0.0;
  double scale = 1.0;
  Drift result;
  for (int k = 0; k < 250; ++k) {
    const auto [speeds, frame] = command(x);
    if (jointly) {
      const auto& setpoint = limiter.update(speeds, frame);
      modules = setpoint.modules;
      rates = setpoint.rates;
      scale = setpoint.scale;
    } else {
      const auto slowed =
          desaturated(kinematics.modules(held_twist(speeds, frame, period), modules), max_speed);
      for (std::size_t i = 0; i < 4; ++i) {
        modules[i] = shortest_turn(slowed.modules[i],
                                   Rotation2d(x(Dynamics::angle_at(static_cast<int>(i)))));
        modules[i] =
            cosine_scaled(modules[i], Rotation2d(x(Dynamics::angle_at(static_cast<int>(i)))));
      }
      rates = {};
      scale = slowed.scale;
    }
    for (int inner = 0; inner < 20; ++inner) {
      const Volts u = module_loops(x, modules, rates, 0.05);
      for (int step = 0; step < 10; ++step) {
        x = rk4(model, x, u, 1e-4);
      }
    }
    time += scale * period;
  }
  // The place on the exact way that is nearest.
  result.distance = 1e9;
  for (double t = 0.5 * time; t < 1.2 * time; t += 1e-4) {
    const Pose2d there = exact(t);
    const double away = (there.translation() - x.head<2>()).norm();
    if (away < result.distance) {
      result.distance = away;
      result.angle = (Rotation2d(x(2)) * there.rotation().inverse()).angle();
    }
  }
  result.scale = scale;
  return result;
}

void drifts() {
  std::printf("\ndrift of five seconds at full speed from rest, modules with dynamics\n");
  std::printf("  %-34s %10s %10s %7s\n", "", "m", "deg", "scale");
  const auto tell = [](const char* name, const Drift& drift) {
    std::printf("  %-34s %10.4f %10.3f %7.3f\n", name, drift.distance,
                drift.angle * 57.29577951308232, drift.scale);
  };
  for (const double omega : {1.0, 4.0, 8.0}) {
    const ChassisSpeeds twist{5.0, 1.0, omega};
    std::printf("  5 m/s, 1 m/s, %.0f rad/s\n", omega);
    const auto arc = [&](double t) { return Pose2d::exp(t * twist.vector()); };
    const auto line = [&](double t) { return Pose2d(twist.vx * t, twist.vy * t, omega * t); };
    const auto along_arc = [&](const State&) { return std::pair{twist, HeldFrame::robot}; };
    const auto along_line = [&](const State& x) {
      return std::pair{twist.to_robot(Rotation2d(x(2))), HeldFrame::field};
    };
    tell("arc, discretise then desaturate", drive(false, along_arc, arc));
    tell("arc, jointly and limited", drive(true, along_arc, arc));
    tell("line, discretise then desaturate", drive(false, along_line, line));
    tell("line, jointly and limited", drive(true, along_line, line));
  }
}

}  // namespace

int main() {
  times();
  drifts();
}
