#include <flyball/mechanisms/kinematics/swerve_limiter.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "support/allocation_count.hpp"

namespace flyball::mechanisms::swerve_limiter_test {
namespace {

using namespace flyball::literals;
using Eigen::Vector2d;

constexpr double pi = std::numbers::pi;
constexpr double period = 0.02;
const std::array<Vector2d, 4> square{
    Vector2d(0.3, 0.25), {0.3, -0.25}, {-0.3, 0.25}, {-0.3, -0.25}};
const SwerveLimits limits{.max_speed = Velocity(4.5),
                          .steer_rate = AngularVelocity(12.0),
                          .acceleration = Acceleration(6.0),
                          .angular_acceleration = AngularAcceleration(20.0)};

SwerveForces forces() {
  return {.body = {.mass = 50_kg, .moment_of_inertia = 5_kg_m2},
          .motor = kraken_x60(),
          .gearing = 6.75,
          .wheel_radius = Length(0.05),
          .stator_limit = 60.0,
          .supply_limit = 40.0,
          .friction = 1.0};
}

SwerveLimiter<4> limiter() {
  return swerve_limiter(swerve_kinematics(square).value(), limits, Time(period)).value();
}

double turn_between(const Rotation2d& from, const Rotation2d& to) {
  return (to * from.inverse()).angle();
}

ChassisSpeeds random_speeds(Random& random) {
  switch (static_cast<int>(random.uniform(0.0, 6.0))) {
    case 0:
      return {};
    case 1:
      return {0.0, 0.0, random.uniform(-10.0, 10.0)};
    case 2:  // about a module
      return ChassisSpeeds{0.0, 0.0, random.uniform(-5.0, 5.0)}.at(-square[1]);
    default:
      return {random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0), random.uniform(-10.0, 10.0)};
  }
}

// What every period's setpoint must be, under commands that jump.
template <std::size_t N>
void expect_reachable(SwerveLimiter<N> limiter, const SwerveKinematics<N>& kinematics,
                      Random& random) {
  std::array<SwerveModule, N> start;
  for (auto& module : start) {
    module.angle = Rotation2d(random.uniform(-pi, pi));
  }
  limiter.reset(start);
  ChassisSpeeds wanted;
  int free = 0;
  for (int k = 0; k < 2000; ++k) {
    if (k % 25 == 0) {
      wanted = random_speeds(random);
    }
    const SwerveSetpoint<N> before = limiter.last();
    const SwerveSetpoint<N> now =
        limiter.update(wanted, k % 50 < 25 ? HeldFrame::robot : HeldFrame::field);
    double most_turn = 0.0;
    for (std::size_t i = 0; i < N; ++i) {
      const double turn = turn_between(before.modules[i].angle, now.modules[i].angle);
      most_turn = std::max(most_turn, std::abs(turn));
      ASSERT_LE(std::abs(turn), 12.0 * period * (1.0 + 1e-6)) << "period " << k << " module " << i;
      ASSERT_NEAR(now.rates[i].steer_rate * period, turn, 1e-7);
      ASSERT_LE(std::abs(now.modules[i].speed), 4.5 * (1.0 + 1e-12));
      ASSERT_NEAR(now.rates[i].acceleration * period,
                  now.modules[i].speed - before.modules[i].speed, 1e-13);
    }
    // They agree to one motion, but for modules that stand (less than 1 mm/s).
    const Eigen::Vector3d agreed = kinematics.chassis(now.modules).vector();
    ASSERT_LE((agreed - now.speeds.vector()).norm(), 5e-3) << "period " << k;
    ASSERT_GE(now.progress, 0.0);
    ASSERT_LE(now.progress, 1.0);
    ASSERT_LE(std::abs(now.speeds.omega - before.speeds.omega), 20.0 * period * (1.0 + 1e-12));
    // Where steering does not hold it on its arc, the acceleration over the field is within 6 m/s²,
    // as far as (1 - s) ω_0 × v_0 + s ω_1 × v_1 is what the way between has.
    const double change =
        std::hypot(now.speeds.vx - before.speeds.vx, now.speeds.vy - before.speeds.vy) / period;
    const auto centripetal = [](const ChassisSpeeds& speeds) {
      return std::abs(speeds.omega) * std::hypot(speeds.vx, speeds.vy);
    };
    const double arc = std::max(centripetal(now.speeds), centripetal(before.speeds));
    if (most_turn < 12.0 * period * 0.999 && arc < 5.9) {
      ++free;
      ASSERT_LE(change, 6.0 + arc + 1e-9) << "period " << k;
    }
  }
  ASSERT_GT(free, 500);
}

TEST(SwerveLimiter, SetpointsAreReachable) {
  Random random(900);
  const auto kinematics = swerve_kinematics(square).value();
  expect_reachable(limiter(), kinematics, random);
  const std::array<Vector2d, 3> triangle{Vector2d(0.3, 0.0), {-0.2, 0.3}, {-0.2, -0.3}};
  const auto three = swerve_kinematics(triangle).value();
  expect_reachable(swerve_limiter(three, limits, Time(period)).value(), three, random);
}

// Whatever is wanted and held is reached, and stays.
TEST(SwerveLimiter, ReachesWhatIsHeld) {
  Random random(901);
  const auto kinematics = swerve_kinematics(square).value();
  for (int trial = 0; trial < 300; ++trial) {
    SwerveLimiter<4> one = limiter();
    std::array<SwerveModule, 4> start;
    for (auto& module : start) {
      module.angle = Rotation2d(random.uniform(-pi, pi));
    }
    one.reset(start);
    ChassisSpeeds wanted;
    for (int command = 0; command < 3; ++command) {
      wanted = random_speeds(random);
      int periods = 0;
      while (one.update(wanted).progress < 1.0) {
        ASSERT_LT(++periods, 150) << "trial " << trial << " command " << command;
      }
      const auto motion = saturated(kinematics, wanted, HeldFrame::robot, period, 4.5);
      const auto& reached = one.last().speeds;
      const double centripetal =
          std::abs(motion.twist.omega) * std::hypot(motion.twist.vx, motion.twist.vy);
      const double by = centripetal > 6.0 ? std::sqrt(6.0 / centripetal) : 1.0;
      EXPECT_LE((reached.vector() - by * motion.twist.vector()).norm(), 1e-12);
      EXPECT_EQ(one.last().scale, motion.scale);
    }
  }
}

// The same of random robots with forces, from modules that contradict each other: a sample of what
// was tried 330 000 times.
template <std::size_t N>
void expect_arrivals(Random& random) {
  std::array<Vector2d, N> places;
  for (std::size_t i = 0; i < N; ++i) {
    const double at = 2.0 * pi * static_cast<double>(i) / static_cast<double>(N);
    const double far = random.uniform(0.2, 0.5);
    places[i] = {far * std::cos(at), far * std::sin(at)};
  }
  SwerveForces made = forces();
  made.body.center_of_mass = {random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1)};
  made.gearing = random.uniform(4.0, 6.0);
  made.stator_limit = random.uniform(20.0, 150.0);
  made.supply_limit = random.uniform(10.0, 80.0);
  made.friction = random.uniform(0.3, 1.5);
  SwerveLimits rates = limits;
  rates.steer_rate = AngularVelocity(random.uniform(5.0, 30.0));
  auto one = swerve_limiter(swerve_kinematics(places).value(), rates, made, Time(period)).value();
  std::array<SwerveModule, N> start;
  for (auto& module : start) {
    module = {random.uniform(-1.0, 1.0), Rotation2d(random.uniform(-pi, pi))};
  }
  one.reset(start);
  for (int command = 0; command < 5; ++command) {
    const ChassisSpeeds wanted = random_speeds(random);
    int periods = 0;
    double most_turn = 0.0;
    do {
      const auto before = one.last().modules;
      one.update(wanted);
      for (std::size_t i = 0; i < N; ++i) {
        most_turn = std::max(most_turn,
                             std::abs(turn_between(before[i].angle, one.last().modules[i].angle)));
      }
      ASSERT_LT(++periods, 600);
    } while (one.last().progress < 1.0);
    ASSERT_LE(most_turn, rates.steer_rate.si() * period * (1.0 + 1e-6));
  }
}

TEST(SwerveLimiter, RandomRobotsArrive) {
  Random random(902);
  for (int trial = 0; trial < 60; ++trial) {
    expect_arrivals<3>(random);
    expect_arrivals<4>(random);
    expect_arrivals<8>(random);
  }
}

// Speeding up and slowing down along one direction keeps it, at the acceleration that is allowed.
TEST(SwerveLimiter, KeepsTheDirection) {
  SwerveLimiter<4> one = limiter();
  std::array<SwerveModule, 4> start;
  for (auto& module : start) {
    module.angle = Rotation2d(std::atan2(1.0, 2.0));
  }
  one.reset(start);
  const auto straight = [&](const ChassisSpeeds& wanted, int periods) {
    for (int k = 0; k < periods; ++k) {
      const double before = one.last().speeds.vx;
      const auto& now = one.update(wanted);
      EXPECT_NEAR(now.speeds.vy, 0.5 * now.speeds.vx, 1e-13);
      EXPECT_NEAR(std::abs(now.speeds.vx - before) * std::hypot(1.0, 0.5), 6.0 * period, 1e-12);
      EXPECT_NEAR(std::abs(now.rates[2].acceleration), 6.0, 1e-9);
    }
  };
  straight({4.0, 2.0, 0.0}, 10);
  straight({}, 5);
  straight({-4.0, -2.0, 0.0}, 10);  // back through standstill, without a turn
  EXPECT_LT(one.last().modules[0].speed, 0.0);
  EXPECT_NEAR(one.last().modules[0].angle.angle(), std::atan2(1.0, 2.0), 1e-12);
}

// Modules that point elsewhere turn first: a robot at rest waits for them, a quarter turn at
// 12 rad/s takes 7 periods.
TEST(SwerveLimiter, WaitsForItsModules) {
  SwerveLimiter<4> one = limiter();
  int waited = 0;
  while (one.update({0.0, 3.0, 0.0}).speeds.vy == 0.0) {
    ++waited;
    EXPECT_EQ(one.last().speeds.vector(), Eigen::Vector3d::Zero());
    ASSERT_LT(waited, 20);
  }
  EXPECT_EQ(waited, 6);  // and moves in the period in which they come to point there
  EXPECT_NEAR(one.last().speeds.vy, 6.0 * period, 1e-3);
}

// A velocity of the field while the robot turns is held, period after period, at no acceleration.
TEST(SwerveLimiter, HoldsALineWhileItTurns) {
  const auto kinematics = swerve_kinematics(square).value();
  SwerveLimiter<4> one = limiter();
  Pose2d pose;
  const ChassisSpeeds in_field{2.5, 0.0, 4.0};
  double y_when_reached = 0.0;
  double x_when_reached = 0.0;
  int held = 0;
  for (int k = 0; k < 250; ++k) {
    const auto& now = one.update(in_field.to_robot(pose.rotation()), HeldFrame::field);
    pose = pose * Pose2d::exp(period * kinematics.chassis(now.modules).vector());
    if (now.progress == 1.0 && ++held == 1) {
      x_when_reached = pose.x();
      y_when_reached = pose.y();
    }
    ASSERT_TRUE(held == 0 || now.progress == 1.0) << k;
  }
  EXPECT_GT(held, 200);
  EXPECT_NEAR(pose.y(), y_when_reached, 1e-11);
  EXPECT_NEAR(pose.x() - x_when_reached, 2.5 * period * (held - 1), 1e-11);
}

// A stator limit of 60 A gives each wheel G K_t 60/r = 157 N; four of them 12.5 m/s² of 50 kg,
// more than the grip μ g = 9.8 m/s². At half the current the motors decide: 30 A, 6.28 m/s².
TEST(SwerveLimiter, CurrentsAndGripLimitTheForces) {
  const auto kinematics = swerve_kinematics(square).value();
  SwerveLimits fast = limits;
  fast.acceleration = Acceleration(std::numeric_limits<double>::infinity());
  fast.angular_acceleration = AngularAcceleration(std::numeric_limits<double>::infinity());
  const auto first = [&](const SwerveForces& made, const ChassisSpeeds& wanted) {
    auto one = swerve_limiter(kinematics, fast, made, Time(period)).value();
    return one.update(wanted).speeds.vx / period;
  };
  SwerveForces made = forces();
  made.supply_limit = std::numeric_limits<double>::infinity();
  EXPECT_NEAR(first(made, {4.5, 0.0, 0.0}), standard_gravity, 1e-9);
  made.stator_limit = 30.0;
  const double by_current = 4.0 * 6.75 * made.motor.Kt * 30.0 / (0.05 * 50.0);
  EXPECT_NEAR(first(made, {4.5, 0.0, 0.0}), by_current, 1e-9);
  // Supply: 10 A of 12 V at stall are V²/R = 120 W, I = V/R.
  made.supply_limit = 10.0;
  made.stator_limit = 1000.0;
  const double current = std::sqrt(120.0 * made.motor.R) / made.motor.R;
  made.friction = 2.0;
  EXPECT_NEAR(first(made, {4.5, 0.0, 0.0}),
              std::min(by_current * current / 30.0, 2.0 * standard_gravity), 1e-3);
  // The faster, the less the supply limit and the rail leave; braking is not held back by them.
  auto one = swerve_limiter(kinematics, fast, forces(), Time(period)).value();
  double last = 1e9;
  int periods = 0;
  while (one.update({4.5, 0.0, 0.0}).progress < 1.0) {
    const double gained = one.last().rates[0].acceleration;
    EXPECT_LE(gained, last + 1e-9);
    last = gained;
    ASSERT_LT(++periods, 200);
  }
  const double top = one.last().speeds.vx;
  EXPECT_LT(last, 6.0);
  one.update({});
  EXPECT_NEAR((top - one.last().speeds.vx) / period, standard_gravity, 1e-9);
  // Tight corners at full speed are more than the tires hold: |ω| |v| within μ g.
  auto cornering = swerve_limiter(kinematics, fast, forces(), Time(period)).value();
  for (int k = 0; k < 300; ++k) {
    const auto& speeds = cornering.update({3.0, 0.0, 5.0}).speeds;
    ASSERT_LE(std::abs(speeds.omega * speeds.vx), 0.8 * standard_gravity * (1.0 + 1e-12));
  }
  EXPECT_EQ(cornering.last().progress, 1.0);
  EXPECT_NEAR(cornering.last().speeds.omega / cornering.last().speeds.vx, 5.0 / 3.0, 1e-12);
}

// From where the modules were measured: what they did not reach is taken up there.
TEST(SwerveLimiter, GoesOnFromWhatWasReached) {
  SwerveLimiter<4> one = limiter();
  std::array<SwerveModule, 4> reached;
  for (std::size_t i = 0; i < 4; ++i) {
    reached[i] = {1.0, Rotation2d(i == 3 ? 1.0 : 0.0)};  // one hangs back
  }
  const auto& now = one.update({2.0, 0.0, 0.0}, HeldFrame::robot, reached);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_LE(std::abs(turn_between(reached[i].angle, now.modules[i].angle)), 0.24 * (1.0 + 1e-9));
  }
  for (int k = 0; k < 60; ++k) {
    one.update({2.0, 0.0, 0.0}, HeldFrame::robot, now.modules);
  }
  EXPECT_NEAR(one.last().speeds.vx, 2.0, 1e-12);
}

TEST(SwerveLimiter, IsFiniteAndAllocatesNothing) {
  SwerveLimiter<4> one = limiter();
  const double odd[] = {std::numeric_limits<double>::quiet_NaN(),
                        std::numeric_limits<double>::infinity(), 1e300, 0.0, 3.0};
  const test::AllocationCounter counter;
  for (const double vx : odd) {
    for (const double omega : odd) {
      const auto& now = one.update({vx, 1.0, omega}, HeldFrame::field);
      EXPECT_TRUE(now.speeds.vector().allFinite());
      for (const auto& module : now.modules) {
        EXPECT_LE(std::abs(module.speed), 4.5 * (1.0 + 1e-12));
      }
      one.update({vx, 1.0, omega}, HeldFrame::robot,
                 {SwerveModule{vx, Rotation2d(omega)}, {omega, Rotation2d(vx)}, {}, {}});
      EXPECT_TRUE(one.last().speeds.vector().allFinite());
    }
  }
  if (test::counts_allocations()) {
    EXPECT_EQ(counter.count(), 0U);
  }
}

TEST(SwerveLimiter, Errors) {
  const auto kinematics = swerve_kinematics(square).value();
  const auto refused = [&](const SwerveLimits& bad, Time dt) {
    return std::string(swerve_limiter(kinematics, bad, dt).error().subject());
  };
  SwerveLimits bad = limits;
  bad.steer_rate = AngularVelocity(0.0);
  EXPECT_EQ(to_string(swerve_limiter(kinematics, bad, Time(period)).error()),
            "swerve_limiter: steer_rate is 0 rad/s; it must be greater than zero");
  bad = limits;
  bad.max_speed = Velocity(NAN);
  EXPECT_EQ(refused(bad, Time(period)), "max_speed");
  bad = limits;
  bad.acceleration = Acceleration(-1.0);
  EXPECT_EQ(refused(bad, Time(period)), "acceleration");
  bad = limits;
  bad.angular_acceleration = AngularAcceleration(NAN);
  EXPECT_EQ(refused(bad, Time(period)), "angular_acceleration");
  EXPECT_EQ(refused(limits, Time(0.0)), "period");
  SwerveForces made = forces();
  made.stator_limit = 0.0;
  EXPECT_EQ(swerve_limiter(kinematics, limits, made, Time(period)).error().subject(),
            "stator_limit");
  made = forces();
  made.body.mass = Mass(0.0);
  EXPECT_EQ(swerve_limiter(kinematics, limits, made, Time(period)).error().subject(), "mass");
  made = forces();
  made.gearing = 8.5;
  EXPECT_EQ(
      to_string(swerve_limiter(kinematics, limits, made, Time(period)).error()),
      "swerve_limiter: max_speed is 4.5 m/s; it must be at most 3.642 m/s, 0.98 of what the "
      "motors reach on 12 V without load; take a lower speed, less gearing or a larger wheel");
  made = forces();
  made.gearing = 0.0;
  EXPECT_EQ(swerve_limiter(kinematics, limits, made, Time(period)).error().subject(), "gearing");
}

}  // namespace
}  // namespace flyball::mechanisms::swerve_limiter_test
