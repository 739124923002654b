#include <array>
#include <cmath>
#include <numbers>

#include <flyball/core/argument.hpp>
#include <flyball/mechanisms/kinematics/swerve_kinematics.hpp>
#include <flyball/mechanisms/kinematics/wheel_kinematics.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "planning/trajectory/motion_limit.hpp"

namespace flyball::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Of a force's circle a polygon of twice as many sides.
constexpr int grip_directions = 12;

/// What is linear in u and x.
template <class Value>
struct Linear {
  Value u;
  Value x;
};

/// A shaft in plain numbers, and its rows.
class Shafts {
 public:
  static Expected<Shafts> make(const DriveLimits& limits, std::string_view where) {
    FLYBALL_TRY(const mechanisms::detail::Shaft shaft,
                mechanisms::detail::checked_shaft(limits.shaft, where, "shaft", true));
    FLYBALL_CHECK(mechanisms::detail::check_body(limits.body, where));
    FLYBALL_CHECK(check_positive(limits.wheel_radius.si(), where, "wheel radius", "m"));
    FLYBALL_CHECK(check_limit(limits.voltage, where, "voltage limit", "V"));
    FLYBALL_CHECK(check_limit(limits.current, where, "current limit", "A"));
    FLYBALL_CHECK(check_limit(limits.wheel_speed, where, "wheel speed limit", "m/s"));
    FLYBALL_CHECK(check_limit(limits.grip, where, "grip"));
    Shafts made;
    made.shaft_ = shaft;
    made.limits_ = limits;
    made.radius_ = limits.wheel_radius.si();
    constexpr double step = std::numbers::pi / grip_directions;
    for (std::size_t i = 0; i < grip_directions; ++i) {
      const double angle = step * (static_cast<double>(i) + 0.5);
      made.grip_[i] = Vector2d(std::cos(angle), std::sin(angle)) / std::cos(0.5 * step);
    }
    const double per_current = shaft.gearing * shaft.Kt;
    const double friction = shaft.friction / per_current;
    if (friction >= limits.current || friction * shaft.R >= limits.voltage) {
      return refusal(ArgumentError::out_of_range, where, "shaft: friction")
          .got(format("{:.4g} N m, which takes {:.4g} A and {:.4g} V to overcome", shaft.friction,
                      friction, friction * shaft.R))
          .expected("less than the current and the voltage limit give")
          .hint("raise the limits, or gear the motors down");
    }
    return made;
  }
  void name(MotionLimit& limit, const std::string& wheel) const {
    if (std::isfinite(limits_.voltage)) {
      limit.row_names.push_back(wheel + ": voltage");
      limit.cap_names.push_back(wheel + ": free speed");
    }
    if (std::isfinite(limits_.current)) {
      limit.row_names.push_back(wheel + ": current");
    }
    if (std::isfinite(limits_.wheel_speed)) {
      limit.cap_names.push_back(wheel + ": wheel speed");
    }
  }
  /// @param w  The wheel's speed along the ground a unit of ds/dt, and its acceleration's part of
  /// x.
  /// @param F  What it pushes the robot with, N.
  void rows(double w, double w_bend, const Linear<double>& F, MotionRow*& rows,
            double*& caps) const noexcept {
    const double per_current = 1.0 / (shaft_.gearing * shaft_.Kt);
    const double sign = w > 0.0 ? 1.0 : w < 0.0 ? -1.0 : 0.0;
    // I = (r F + J dΩ/dt + damping Ω + friction)/(G K_t)
    const MotionRow current{per_current * (radius_ * F.u + shaft_.inertia * w / radius_),
                            per_current * (radius_ * F.x + shaft_.inertia * w_bend / radius_),
                            per_current * shaft_.damping * w / radius_,
                            per_current * shaft_.friction * sign};
    if (std::isfinite(limits_.voltage)) {
      const double inverse = 1.0 / limits_.voltage;
      const double R = shaft_.R * inverse;
      const MotionRow voltage{R * current.a, R * current.b,
                              R * current.k + inverse * shaft_.gearing * w / (radius_ * shaft_.Kv),
                              R * current.c};
      const double free = voltage.k / (1.0 - std::abs(voltage.c));
      *rows++ = voltage;
      *caps++ = free * free;
    }
    if (std::isfinite(limits_.current)) {
      const double inverse = 1.0 / limits_.current;
      *rows++ = {inverse * current.a, inverse * current.b, inverse * current.k,
                 inverse * current.c};
    }
    if (std::isfinite(limits_.wheel_speed)) {
      const double e = w / limits_.wheel_speed;
      *caps++ = e * e;
    }
  }
  void name_grip(MotionLimit& limit, const std::string& of) const {
    if (std::isfinite(limits_.grip)) {
      limit.row_names.insert(limit.row_names.end(), grip_directions, of + ": grip");
    }
  }
  /// |F| <= grip · load as the polygon within that circle.
  void grip(const Linear<Vector2d>& F, double load, MotionRow*& rows) const noexcept {
    if (!std::isfinite(limits_.grip)) {
      return;
    }
    const double inverse = 1.0 / (limits_.grip * load);
    for (const Vector2d& direction : grip_) {
      *rows++ = {inverse * direction.dot(F.u), inverse * direction.dot(F.x), 0.0, 0.0};
    }
  }
  [[nodiscard]] double weight() const noexcept {
    return limits_.body.mass.si() * mechanisms::standard_gravity;
  }
  /// (F, M) about the robot's origin that moves it so.
  [[nodiscard]] Linear<Vector3d> wrench(const PlanarMotion& motion) const noexcept {
    const double m = limits_.body.mass.si();
    const Vector2d& c = limits_.body.center_of_mass;
    const double J = limits_.body.moment_of_inertia.si();
    const double omega = motion.twist(2);
    const auto of = [&](const Vector2d& a, double alpha, double omega_square) {
      const Vector2d F = m * (a + alpha * Vector2d(-c(1), c(0)) - omega_square * c);
      return Vector3d(F(0), F(1), J * alpha + c(0) * F(1) - c(1) * F(0));
    };
    return {of(motion.first, omega, 0.0), of(motion.second, motion.bend(2), omega * omega)};
  }

 private:
  mechanisms::detail::Shaft shaft_{};
  DriveLimits limits_{};
  std::array<Vector2d, grip_directions> grip_{};
  double radius_ = 1.0;
};

class OfDifferential final : public MotionLimit {
 public:
  OfDifferential(const Shafts& shafts, double trackwidth, bool backwards)
      : shafts_(shafts), half_(0.5 * trackwidth), backwards_(backwards) {
    shafts_.name(*this, "left side");
    shafts_.name(*this, "right side");
    shafts_.name_grip(*this, "wheels");
  }
  void evaluate(const PathState& state, double /*s*/, MotionRow* rows,
                double* caps) const noexcept override {
    const PlanarMotion motion = facing_motion(state, backwards_);
    const Linear<Vector3d> W = shafts_.wrench(motion);
    for (const double side : {-half_, half_}) {  // F_x/2 ∓ M/(2 r_b)
      const Linear<double> F{0.5 * W.u(0) + 0.5 * W.u(2) / side,
                             0.5 * W.x(0) + 0.5 * W.x(2) / side};
      shafts_.rows(motion.twist(0) + side * motion.twist(2), motion.bend(0) + side * motion.bend(2),
                   F, rows, caps);
    }
    shafts_.grip({W.u.head<2>(), W.x.head<2>()}, shafts_.weight(), rows);
  }

 private:
  Shafts shafts_;
  double half_;
  bool backwards_;
};

class OfSwerve final : public MotionLimit {
 public:
  /// @param push  2 N x 3: the forces of least squares of a wrench.
  OfSwerve(const Shafts& shafts, const std::vector<Vector2d>& positions, MatrixXd push,
           std::vector<double> shares)
      : shafts_(shafts), positions_(positions), push_(std::move(push)), shares_(std::move(shares)) {
    for (std::size_t i = 0; i < positions_.size(); ++i) {
      shafts_.name(*this, format("module {}", i + 1));
      shafts_.name_grip(*this, format("module {}", i + 1));
    }
  }
  void evaluate(const PathState& state, double /*s*/, MotionRow* rows,
                double* caps) const noexcept override {
    const PlanarMotion motion = holonomic_motion(state);
    const Linear<Vector3d> W = shafts_.wrench(motion);
    const auto at = [](const Vector3d& twist, const Vector2d& r) {
      return Vector2d(twist(0) - twist(2) * r(1), twist(1) + twist(2) * r(0));
    };
    for (std::size_t i = 0; i < positions_.size(); ++i) {
      const Vector2d v = at(motion.twist, positions_[i]);
      const Vector2d bend = at(motion.bend, positions_[i]);
      const double w = v.norm();
      // Where it stands still it points where it is about to go.
      Vector2d direction = w > 1e-10 * bend.norm() ? v : bend;
      const double length = direction.norm();
      direction = length > 0.0 ? Vector2d(direction / length) : Vector2d(1.0, 0.0);
      const auto block = push_.middleRows<2>(2 * static_cast<Index>(i));
      const Linear<Vector2d> F{block * W.u, block * W.x};
      shafts_.rows(w, direction.dot(bend), {direction.dot(F.u), direction.dot(F.x)}, rows, caps);
      shafts_.grip(F, shares_[i] * shafts_.weight(), rows);
    }
  }

 private:
  Shafts shafts_;
  std::vector<Vector2d> positions_;
  MatrixXd push_;
  std::vector<double> shares_;
};

class OfMecanum final : public MotionLimit {
 public:
  OfMecanum(const Shafts& shafts, const mechanisms::MecanumKinematics& kinematics)
      : shafts_(shafts), kinematics_(kinematics) {
    for (const char* wheel :
         {"front left wheel", "front right wheel", "back left wheel", "back right wheel"}) {
      shafts_.name(*this, wheel);
    }
    shafts_.name_grip(*this, "wheels");
  }
  void evaluate(const PathState& state, double /*s*/, MotionRow* rows,
                double* caps) const noexcept override {
    const PlanarMotion motion = holonomic_motion(state);
    const Linear<Vector3d> W = shafts_.wrench(motion);
    // Wᵀ ξ = Fᵀ M ξ, so that F = (M⁺)ᵀ W
    const auto push = kinematics_.to_chassis().transpose();
    const Linear<Eigen::Vector4d> F{push * W.u, push * W.x};
    const Eigen::Vector4d w = kinematics_.to_wheels() * motion.twist;
    const Eigen::Vector4d bend = kinematics_.to_wheels() * motion.bend;
    for (Index i = 0; i < 4; ++i) {
      shafts_.rows(w(i), bend(i), {F.u(i), F.x(i)}, rows, caps);
    }
    shafts_.grip({W.u.head<2>(), W.x.head<2>()}, shafts_.weight(), rows);
  }

 private:
  Shafts shafts_;
  mechanisms::MecanumKinematics kinematics_;
};

}  // namespace

Expected<std::unique_ptr<MotionLimit>> drive_limit(const DifferentialDriveLimits& limits,
                                                   std::string_view where) {
  FLYBALL_TRY(const Shafts shafts, Shafts::make(limits.drive, where));
  FLYBALL_CHECK(check_positive(limits.trackwidth.si(), where, "trackwidth", "m"));
  return std::make_unique<OfDifferential>(shafts, limits.trackwidth.si(), limits.backwards);
}

Expected<std::unique_ptr<MotionLimit>> drive_limit(const SwerveDriveLimits& limits,
                                                   std::string_view where) {
  FLYBALL_TRY(const Shafts shafts, Shafts::make(limits.drive, where));
  const std::vector<Vector2d>& at = limits.positions;
  if (at.size() < 2) {
    return refusal(ArgumentError::empty, where, "modules")
        .got(format("{} of them", at.size()))
        .expected("the positions of two or more");
  }
  FLYBALL_CHECK(mechanisms::detail::check_module_positions(at, where));
  FLYBALL_TRY(std::vector<double> shares,
              mechanisms::detail::load_shares(at, limits.drive.body.center_of_mass, where));
  MatrixXd M(2 * static_cast<Index>(at.size()), 3);
  for (std::size_t i = 0; i < at.size(); ++i) {
    M.middleRows<2>(2 * static_cast<Index>(i)) << 1.0, 0.0, -at[i](1), 0.0, 1.0, at[i](0);
  }
  return std::make_unique<OfSwerve>(
      shafts, at, MatrixXd(mechanisms::detail::wheel_pseudo_inverse(M).transpose()),
      std::move(shares));
}

Expected<std::unique_ptr<MotionLimit>> drive_limit(const MecanumDriveLimits& limits,
                                                   std::string_view where) {
  FLYBALL_TRY(const Shafts shafts, Shafts::make(limits.drive, where));
  if (limits.positions.size() != 4) {
    return refusal(ArgumentError::wrong_shape, where, "mecanum wheels")
        .got(format("{} positions", limits.positions.size()))
        .expected("four: front left, front right, back left, back right");
  }
  FLYBALL_TRY(const mechanisms::MecanumKinematics kinematics,
              mechanisms::mecanum_kinematics({limits.positions[0], limits.positions[1],
                                              limits.positions[2], limits.positions[3]}));
  return std::make_unique<OfMecanum>(shafts, kinematics);
}

}  // namespace flyball::detail
