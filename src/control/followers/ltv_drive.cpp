#include <flyball/control/followers/ltv_drive.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/control/lqr.hpp>
#include <flyball/core/signal.hpp>
#include <flyball/math/riccati/riccati.hpp>
#include <flyball/systems/discretize.hpp>

#include "control/weights.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

Expected<ContinuousSystem<5, 2, 5>> drive_error_dynamics(const mechanisms::DifferentialDrive& drive,
                                                         Length trackwidth, double v) {
  constexpr std::string_view where = "drive_error_dynamics";
  FLYBALL_CHECK(Checks(where)
                    .positive(trackwidth.si(), "trackwidth", "m")
                    .finite(drive.A, "drive.A")
                    .finite(drive.B, "drive.B")
                    .finite(v, "v"));
  ContinuousSystem<5, 2, 5> system;
  system.A.setZero();
  system.A.row(0).tail<2>().setConstant(0.5);
  system.A(1, 2) = v;
  system.A(2, 3) = -1.0 / trackwidth.si();
  system.A(2, 4) = 1.0 / trackwidth.si();
  system.A.bottomRightCorner<2, 2>() = drive.A;  // (8.14)
  system.B.setZero();
  system.B.bottomRows<2>() = drive.B;  // (8.15)
  system.C.setIdentity();
  system.D.setZero();
  return system;
}

Expected<LtvDriveFollower> LtvDriveFollower::create(const mechanisms::DifferentialDrive& drive,
                                                    Length trackwidth,
                                                    const LtvDriveSettings& settings) {
  constexpr std::string_view where = "LtvDriveFollower";
  FLYBALL_CHECK(detail::check_tolerance(settings.x_tolerance, where, "x_tolerance", "m"));
  FLYBALL_CHECK(detail::check_tolerance(settings.y_tolerance, where, "y_tolerance", "m"));
  FLYBALL_CHECK(
      detail::check_tolerance(settings.heading_tolerance, where, "heading_tolerance", "rad"));
  FLYBALL_CHECK(
      detail::check_tolerance(settings.velocity_tolerance, where, "velocity_tolerance", "m/s"));
  FLYBALL_CHECK(Checks(where)
                    .positive(settings.voltage_tolerance, "voltage_tolerance", "V")
                    .positive(settings.voltage_limit, "voltage_limit", "V")
                    .positive(settings.period.si(), "period", "s")
                    .not_negative(settings.largest_velocity, "largest_velocity", "m/s")
                    .also([&] { return detail::check_low_speed(settings.low_speed, where); })
                    .also([&] { return detail::check_farthest(settings.farthest_error, where); }));
  FLYBALL_TRY_IN(where, const DriveInversion inversion,
                 DriveInversion::create(drive, settings.period));
  LtvDriveFollower follower(settings, trackwidth.si(), inversion);

  // y integrates v θ and moves nothing, so e^{AT} and its integral are affine in v.
  const auto sampled = [&](double v) {
    return drive_error_dynamics(drive, trackwidth, v).and_then([&](const auto& system) {
      return discretize_zoh(system.A, system.B, settings.period);
    });
  };
  FLYBALL_TRY_IN(where, const DiscretizedMatrices at_rest, sampled(0.0));
  FLYBALL_TRY_IN(where, const DiscretizedMatrices at_one, sampled(1.0));
  follower.A_0_ = at_rest.A;
  follower.A_v_.setZero();
  follower.A_v_.row(1) = at_one.A.row(1) - at_rest.A.row(1);
  follower.B_0_ = at_rest.B;
  follower.B_v_.setZero();
  follower.B_v_.row(1) = at_one.B.row(1) - at_rest.B.row(1);
  FLYBALL_TRY(follower.Q_,
              bryson({settings.x_tolerance, settings.y_tolerance, settings.heading_tolerance,
                      settings.velocity_tolerance, settings.velocity_tolerance}));
  FLYBALL_TRY(follower.R_, bryson({settings.voltage_tolerance, settings.voltage_tolerance}));

  const double least = settings.low_speed.velocity;
  double& largest = follower.settings_.largest_velocity;
  if (largest == 0.0) {
    // 0 = A v + B V
    const Eigen::Matrix2d& A = drive.A;
    const Eigen::Vector2d b = -settings.voltage_limit * drive.B.rowwise().sum();
    const double determinant = A(0, 0) * A(1, 1) - A(0, 1) * A(1, 0);
    const double free =
        0.5 * (A(1, 1) * b(0) - A(0, 1) * b(1) + A(0, 0) * b(1) - A(1, 0) * b(0)) / determinant;
    largest = is_signal(free) ? std::max(1.5 * std::abs(free), 2.0 * least) : 2.0 * least;
  }
  if (!(largest > least)) {
    return refusal(ArgumentError::out_of_range, where, "largest_velocity")
        .got(detail::format("{:.4g} m/s", largest))
        .expected(detail::format("above low_speed.velocity, {:.4g} m/s", least));
  }
  // Where all of the gains need sixty digits it would take seconds.
  detail::CarefulWork work{3e8};
  const auto design = [&](double speed) {
    return detail::solve_lqr(follower.A(speed), follower.B(speed), follower.Q_, follower.R_,
                             nullptr, TimeDomain::discrete, &work);
  };
  const auto speed_at = [&](double i) {
    const double share = i / intervals;
    return least + (largest - least) * share * share;
  };
  for (int i = 0; i <= intervals; ++i) {
    auto at_speed = design(speed_at(i));
    if (!at_speed) {
      return tl::unexpected(Error(std::move(at_speed).error())
                                .in(std::string(where))
                                .with("velocity, m/s", speed_at(i)));
    }
    follower.schedule_[static_cast<std::size_t>(i)] = at_speed->K;
  }
  for (int i = 0; i < intervals; ++i) {
    const double halfway = speed_at(i + 0.5);
    FLYBALL_TRY_IN(where, const LqrDesign<> exact, design(halfway));
    follower.schedule_error_ = std::max(
        follower.schedule_error_, (follower.scheduled(halfway) - exact.K).norm() / exact.K.norm());
  }
  return follower;
}

std::array<double, LtvDriveFollower::intervals + 1> LtvDriveFollower::schedule_velocities()
    const noexcept {
  std::array<double, intervals + 1> all{};
  const double least = settings_.low_speed.velocity;
  for (std::size_t i = 0; i <= intervals; ++i) {
    const double share = static_cast<double>(i) / intervals;
    all[i] = least + (settings_.largest_velocity - least) * share * share;
  }
  return all;
}

LtvDriveFollower::Gain LtvDriveFollower::scheduled(double speed) const noexcept {
  const double least = settings_.low_speed.velocity;
  const double share = (speed - least) / (settings_.largest_velocity - least);
  const double place = std::sqrt(std::max(0.0, share)) * intervals;
  const int before = std::min(static_cast<int>(place), intervals - 1);
  const double between = std::min(1.0, place - before);
  const auto i = static_cast<std::size_t>(before);
  return (1.0 - between) * schedule_[i] + between * schedule_[i + 1];
}

LtvDriveFollower::Gain LtvDriveFollower::solved(double speed) const noexcept {
  const auto solution = dare<5, 2>(A(speed), B(speed), Q_, R_);
  return solution ? solution->K : scheduled(speed);
}

LtvDriveFollower::Gain LtvDriveFollower::K(double v) const noexcept {
  v = detail::cut(v);
  const double least = settings_.low_speed.velocity;
  const double speed = std::clamp(std::abs(v), least, settings_.largest_velocity);
  Gain gain = speed > least && settings_.source == GainSource::each_period ? solved(speed)
                                                                           : scheduled(speed);
  const bool fades = settings_.low_speed.cross_track == LowSpeed::CrossTrack::fades;
  const double share = std::abs(v) >= least || !fades ? (v < 0.0 ? -1.0 : 1.0) : v / least;
  gain.col(1) *= share;
  return gain;
}

DriveCommand LtvDriveFollower::calculate(const DriveState& x, const DriveState& r,
                                         const DriveState& r_next) const noexcept {
  return calculate(x, r, inversion_.calculate({r.left, r.right}, {r_next.left, r_next.right}));
}

DriveCommand LtvDriveFollower::calculate(const DriveState& x, const DriveState& r,
                                         const Eigen::Vector2d& u_ff) const noexcept {
  if (!detail::known(r.pose) || !is_signal(r.left) || !is_signal(r.right)) {
    return {Eigen::Vector2d::Zero(), FollowerStatus::no_reference};
  }
  const bool moving = is_signal(x.left) && is_signal(x.right);
  const bool placed = detail::known(x.pose);
  // What is not measured counts as what it should be.
  Eigen::Vector<double, 5> e = Eigen::Vector<double, 5>::Zero();
  if (placed) {
    e.head<3>() = no_farther(tracking_error(x.pose, r.pose), settings_.farthest_error);
  }
  if (moving) {
    e.tail<2>() << r.left - x.left, r.right - x.right;
  }
  const double v = moving ? 0.5 * (x.left + x.right) : 0.5 * (r.left + r.right);
  // u = K(v) [R(θ)ᵀ, 0; 0, I] (r - x) + u_ff                                          (8.16)
  const Eigen::Vector2d u =
      K(v) * e + Eigen::Vector2d(detail::signal_or_zero(u_ff(0)), detail::signal_or_zero(u_ff(1)));
  bool saturated = false;
  const Eigen::Vector2d voltage = within_voltage(u, settings_.voltage_limit, saturated);
  return {voltage, !placed || !moving ? FollowerStatus::no_pose
                   : saturated        ? FollowerStatus::saturated
                                      : FollowerStatus::tracking};
}

}  // namespace flyball
