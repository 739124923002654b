#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <flyball/mechanisms/drivetrain/swerve_dynamics.hpp>
#include <flyball/mechanisms/drivetrain/wheeled_drive.hpp>
#include <flyball/mechanisms/power/powered.hpp>

#include "core/try.hpp"
#include "study/drive_plant.hpp"

namespace flyball::study {

namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::VectorXd;
using mechanisms::ChassisSpeeds;

/// A wheel: where it is, the axis along which the floor holds it, and what of a shaft's speed goes
/// along that.
struct Rolling {
  Vector2d position;
  Vector2d axis;
  double share = 1.0;  ///< d·a
  int shaft = 0;
};

template <class Model>
class PlantOf final : public DrivePlant {
 public:
  static constexpr int n = Model::states();
  static constexpr int m = Model::inputs();
  static constexpr bool swerves = requires { Model::modules; };

  PlantOf(mechanisms::Powered<Model> powered, double radius, std::vector<Rolling> wheels)
      : powered_(std::move(powered)), radius_(radius), wheels_(std::move(wheels)) {}

  [[nodiscard]] Index states() const override { return n; }

  void derivative(const Eigen::Ref<const VectorXd>& x, const VectorXd& u,
                  const DriveInfluence& influence, Eigen::Ref<VectorXd> rate) const override {
    const Eigen::Vector<double, n> at = x;
    const Eigen::Vector<double, m> volts = u;
    auto p = powered_.model().parameters();
    p(2) *= influence.grip;
    rate = powered_.derivative(at, volts, p);
    const double c = std::cos(at(2));
    const double s = std::sin(at(2));
    rate(3) += (c * influence.force(0) + s * influence.force(1)) / p(0);
    rate(4) += (c * influence.force(1) - s * influence.force(0)) / p(0);
  }

  [[nodiscard]] DriveFlow flow(const VectorXd& x, const VectorXd& u) const override {
    const Eigen::Vector<double, n> at = x;
    const Eigen::Vector<double, m> volts = u;
    const auto flows = powered_.flow(at, volts);
    DriveFlow found{VectorXd(m), VectorXd(m), flows.rail, flows.battery_current};
    for (int k = 0; k < m; ++k) {
      found.voltage(k) = flows.voltage[static_cast<std::size_t>(k)];
      found.current(k) = flows.current[static_cast<std::size_t>(k)];
    }
    return found;
  }

  [[nodiscard]] VectorXd wheel_speeds(const VectorXd& x) const override {
    const int shafts = swerves ? m / 2 : m;
    VectorXd speeds(shafts);
    for (int k = 0; k < shafts; ++k) {
      speeds(k) = radius_ * x(speed_at(k));
    }
    return speeds;
  }
  [[nodiscard]] VectorXd module_angles(const VectorXd& x) const override {
    return of_modules(x, 6);
  }
  [[nodiscard]] VectorXd module_rates(const VectorXd& x) const override { return of_modules(x, 7); }

  [[nodiscard]] double slip(const VectorXd& x) const override {
    double fastest = 0.0;
    for (std::size_t i = 0; i < wheels_.size(); ++i) {
      const Rolling& wheel = wheels_[i];
      Vector2d axis = wheel.axis;
      if constexpr (swerves) {
        const double angle = x(Model::angle_at(static_cast<int>(i)));
        axis = {std::cos(angle), std::sin(angle)};
      }
      fastest = std::max(fastest, std::abs(moves(x, wheel).dot(axis) -
                                           wheel.share * radius_ * x(speed_at(wheel.shaft))));
    }
    return fastest;
  }

  [[nodiscard]] VectorXd state_of(const Pose2d& pose, const ChassisSpeeds& speeds,
                                  const std::array<double, 4>& angles) const override {
    VectorXd x = VectorXd::Zero(n);
    x.head<3>() << pose.x(), pose.y(), pose.angle();
    x.segment<3>(3) = speeds.vector();
    for (std::size_t i = 0; i < wheels_.size(); ++i) {
      const Rolling& wheel = wheels_[i];
      Vector2d axis = wheel.axis;
      if constexpr (swerves) {
        x(Model::angle_at(static_cast<int>(i))) = angles[i];
        axis = {std::cos(angles[i]), std::sin(angles[i])};
      }
      x(speed_at(wheel.shaft)) = moves(x, wheel).dot(axis) / (wheel.share * radius_);
    }
    static_cast<void>(angles);
    return x;
  }

 private:
  [[nodiscard]] static Index speed_at(int shaft) {
    if constexpr (swerves) {
      return Model::wheel_speed_at(shaft);
    } else {
      return 6 + shaft;
    }
  }
  [[nodiscard]] static VectorXd of_modules(const VectorXd& x, Index first) {
    VectorXd values;
    if constexpr (swerves) {
      values = VectorXd(Model::modules);
      for (Index i = 0; i < values.size(); ++i) {
        values(i) = x(first + 3 * i);
      }
    } else {
      static_cast<void>(x);
      static_cast<void>(first);
    }
    return values;
  }
  /// v + ω × r, m/s in the robot's frame.
  [[nodiscard]] static Vector2d moves(const VectorXd& x, const Rolling& wheel) {
    return {x(3) - x(5) * wheel.position(1), x(4) + x(5) * wheel.position(0)};
  }

  mechanisms::Powered<Model> powered_;
  double radius_;
  std::vector<Rolling> wheels_;
};

using MadePlant = Expected<std::unique_ptr<DrivePlant>>;

template <class Model>
MadePlant powered(Model model, std::vector<Rolling> wheels, const DriveRobot& robot,
                  const mechanisms::Battery& battery) {
  std::array<mechanisms::CurrentLimits, static_cast<std::size_t>(Model::inputs())> limits;
  limits.fill({.stator = robot.stator_limit, .supply = robot.supply_limit});
  if constexpr (requires { Model::modules; }) {  // those limits are of the motors that drive
    constexpr double steering = 40.0;            // A
    for (std::size_t k = Model::modules; k < limits.size(); ++k) {
      limits[k] = {.stator = steering};
    }
  }
  FLYBALL_TRY(auto made, mechanisms::powered_each(std::move(model), limits, battery));
  return std::unique_ptr<DrivePlant>(
      std::make_unique<PlantOf<Model>>(std::move(made), robot.wheel_radius, std::move(wheels)));
}

mechanisms::RobotBody body_of(const DriveRobot& robot) {
  return {.mass = Mass(robot.mass), .moment_of_inertia = MomentOfInertia(robot.moment_of_inertia)};
}

mechanisms::DriveShaft shaft_of(const DriveRobot& robot) {
  return {.motor = robot.motor,
          .gearing = robot.gearing,
          .moment_of_inertia = MomentOfInertia(robot.wheel_inertia),
          .friction = robot.gearing * robot.motor.Kt * robot.motor.free_current};
}

template <std::size_t W>
MadePlant differential(const DriveRobot& robot, const mechanisms::Battery& battery) {
  const mechanisms::SlippingDifferentialParameters parameters{
      .body = body_of(robot),
      .side = shaft_of(robot),
      .wheel_radius = Length(robot.wheel_radius),
      .trackwidth = Length(robot.trackwidth),
      .wheelbase = Length(robot.wheelbase),
      .tire = {.friction = robot.grip}};
  FLYBALL_TRY(auto model, mechanisms::slipping_differential_drive<W>(parameters));
  const double half = 0.5 * robot.trackwidth;
  return powered(std::move(model),
                 {{{0.0, half}, {1.0, 0.0}, 1.0, 0}, {{0.0, -half}, {1.0, 0.0}, 1.0, 1}}, robot,
                 battery);
}

MadePlant mecanum(const DriveRobot& robot, const mechanisms::Battery& battery) {
  FLYBALL_TRY(auto model,
              mechanisms::slipping_mecanum_drive({.body = body_of(robot),
                                                  .wheel = shaft_of(robot),
                                                  .wheel_radius = Length(robot.wheel_radius),
                                                  .positions = robot.modules,
                                                  .tire = {.friction = robot.grip}}));
  // Rollers that form an X: a at -45° of front left and back right, at 45° of the others, from the
  // forward direction; d·a = 1/√2.
  const double h = std::numbers::sqrt2 / 2.0;
  std::vector<Rolling> wheels;
  for (int i = 0; i < 4; ++i) {
    const double side = i == 0 || i == 3 ? -h : h;
    wheels.push_back({robot.modules[static_cast<std::size_t>(i)], {h, side}, h, i});
  }
  return powered(std::move(model), std::move(wheels), robot, battery);
}

MadePlant swerve(const DriveRobot& robot, const mechanisms::Battery& battery) {
  mechanisms::SwerveDynamicsParameters<4> parameters{.body = body_of(robot)};
  parameters.positions = robot.modules;
  parameters.wheel_radius = Length(robot.wheel_radius);
  parameters.drive = shaft_of(robot);
  parameters.steer = {
      .motor = robot.steer_motor,
      .gearing = robot.steer_gearing,
      .moment_of_inertia = MomentOfInertia(robot.steer_inertia),
      .friction = robot.steer_gearing * robot.steer_motor.Kt * robot.steer_motor.free_current};
  parameters.tire.friction = robot.grip;
  FLYBALL_TRY(auto model, mechanisms::swerve_dynamics<4>(parameters));
  std::vector<Rolling> wheels;
  for (int i = 0; i < 4; ++i) {
    wheels.push_back({robot.modules[static_cast<std::size_t>(i)], {1.0, 0.0}, 1.0, i});
  }
  return powered(std::move(model), std::move(wheels), robot, battery);
}

}  // namespace

Expected<std::unique_ptr<DrivePlant>> make_drive_plant(const DriveRobot& robot,
                                                       const mechanisms::Battery& battery) {
  switch (robot.kind) {
    case DriveKind::swerve:
      return swerve(robot, battery);
    case DriveKind::mecanum:
      return mecanum(robot, battery);
    case DriveKind::differential:
      break;
  }
  return robot.wheelbase > 0.0 ? differential<4>(robot, battery) : differential<2>(robot, battery);
}

}  // namespace flyball::study
