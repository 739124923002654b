#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/planning/path/build_path.hpp>
#include <flyball/planning/path/edit_path.hpp>
#include <flyball/planning/trajectory/path_trajectory.hpp>

#include "planning/trajectory/plain_reachability.hpp"
#include "support/allocation_count.hpp"

namespace flyball::time_optimal_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;
using Limits = std::vector<PathConstraint>;

MatrixXd random_points(Random& random, int coordinates, int count) {
  MatrixXd points(coordinates, count);
  for (double& value : points.reshaped()) {
    value = random.uniform(-1.0, 1.0);
  }
  return points;
}

CoordinateLimits random_limits(Random& random, int coordinates) {
  CoordinateLimits limits{VectorXd(coordinates), VectorXd(coordinates)};
  for (int j = 0; j < coordinates; ++j) {
    limits.velocity(j) = random.uniform(0.5, 1.5);
    limits.acceleration(j) = random.uniform(1.0, 3.0);
  }
  return limits;
}

/// What every timed path is: it begins and ends where the path does, its velocity is what its
/// position changes by and continuous, and times ascend.
void expect_motion(const PathTrajectory& trajectory) {
  const Path& path = trajectory.path();
  const double total = trajectory.total_time();
  ASSERT_TRUE(std::isfinite(total));
  EXPECT_LT((trajectory.sample(0.0).position - path.position(0.0)).norm(), 1e-12);
  EXPECT_LT((trajectory.sample(total).position - path.position(path.parameter_end())).norm(), 1e-9);
  const double h = 1e-6 * total;
  double before = -1.0;
  for (int k = 1; k < 200; ++k) {
    const double t = total * k / 200.0;
    const PathSample at = trajectory.sample(t);
    const PathSample after = trajectory.sample(t + h);
    EXPECT_GT(at.parameter, before);
    before = at.parameter;
    const double scale = 1.0 + at.acceleration.norm();
    EXPECT_LT((after.position - at.position - 0.5 * h * (at.velocity + after.velocity)).norm(),
              1e-8 * h * scale + 1e-12);
    EXPECT_LT((after.velocity - at.velocity).norm(), 50.0 * h * scale);
    EXPECT_LT((at.position - path.position(at.parameter)).norm(), 1e-12);
  }
}

/// The largest of |velocity|/limit and |acceleration|/limit, 100 times finer than the intervals.
double largest_use(const PathTrajectory& trajectory, const CoordinateLimits& limits) {
  double most = 0.0;
  const std::size_t count = 100 * trajectory.intervals();
  for (std::size_t k = 0; k <= count; ++k) {
    const PathSample at = trajectory.sample(trajectory.total_time() * static_cast<double>(k) /
                                            static_cast<double>(count));
    most = std::max({most, (at.velocity.array().abs() / limits.velocity.array()).maxCoeff(),
                     (at.acceleration.array().abs() / limits.acceleration.array()).maxCoeff()});
  }
  return most;
}

// A line of 4 m, v = 2 and a = 1: 2 s up and 2 s down; of 8 m: 2 s in between.
TEST(TimeOptimal, StraightLines) {
  for (const auto& [length, time] : {std::pair{4.0, 4.0}, {1.0, 2.0}, {8.0, 6.0}}) {
    const Path path = line_path(Vector2d(0.0, 0.0), Vector2d(length, 0.0)).value();
    const Limits limits{TravelLimits{.velocity = 2.0, .acceleration = 1.0}};
    const PathTrajectory trajectory = time_optimal(path, limits, {.tolerance = 1e-5}).value();
    EXPECT_LE(trajectory.total_time(), time * (1.0 + 1e-5));
    EXPECT_GE(trajectory.total_time(), time * (1.0 - 1e-12));
    expect_motion(trajectory);
  }
}

// Round a circle: v²/r <= a_c, so that v = √(a_c r) and all of it takes 2 π √(r/a_c).
TEST(TimeOptimal, RoundACircleAtItsCentripetalLimit) {
  const Path path = arc_path({0.0, 0.0}, 2.0, 0.0, 2.0 * std::numbers::pi).value();
  const Limits limits{TravelLimits{.velocity = 10.0, .acceleration = 50.0, .centripetal = 3.0}};
  const double v = std::sqrt(6.0);
  const PathTrajectory trajectory =
      time_optimal(path, limits, {.start_velocity = v, .end_velocity = v}).value();
  EXPECT_NEAR(trajectory.total_time(), 2.0 * std::numbers::pi * std::sqrt(2.0 / 3.0), 1e-6);
  const auto binding = trajectory.binding();
  ASSERT_EQ(binding.size(), 1U);
  EXPECT_EQ(binding[0].limit, "centripetal acceleration");
  EXPECT_NEAR(binding[0].use, 1.0, 1e-6);
  EXPECT_NEAR(binding[0].end, trajectory.total_time(), 1e-12);
}

// Limits hold between the points of the grid, and no grid of another method gives a time that is
// shorter by more than it breaks them.
TEST(TimeOptimal, KeepsToTheLimitsAndIsNearTheFastest) {
  Random random(1);
  test::PlainReachability plain;
  double gap = 0.0;
  constexpr int paths = 40;
  for (int k = 0; k < paths; ++k) {
    const int coordinates = k % 2 == 0 ? 2 : 7;
    const Path path =
        natural_cubic_path(random_points(random, coordinates, 10), KnotSpacing::uniform).value();
    const CoordinateLimits limits = random_limits(random, coordinates);
    const PathTrajectory trajectory = time_optimal(path, Limits{limits}).value();
    expect_motion(trajectory);
    EXPECT_LE(largest_use(trajectory, limits), 1.0 + 1e-9) << k;
    // O(1/n) from above: twice the fine grid's time less the coarse one's.
    const double coarse = plain(path, limits.velocity, limits.acceleration, 4000);
    const double fine = plain(path, limits.velocity, limits.acceleration, 8000);
    const double fastest = 2.0 * fine - coarse;
    EXPECT_GE(trajectory.total_time(), fastest * (1.0 - 3e-4)) << k;
    EXPECT_LE(trajectory.total_time(), fastest * 1.006) << k;
    gap += (trajectory.total_time() / fastest - 1.0) / paths;
  }
  EXPECT_LE(gap, 2e-3);
}

TEST(TimeOptimal, TighterTolerancesAreFaster) {
  Random random(2);
  const Path path = natural_cubic_path(random_points(random, 2, 10)).value();
  const CoordinateLimits limits = random_limits(random, 2);
  double before = std::numeric_limits<double>::infinity();
  for (const double tolerance : {1e-1, 1e-2, 1e-4}) {
    const double time =
        time_optimal(path, Limits{limits}, {.tolerance = tolerance}).value().total_time();
    EXPECT_LT(time, before);
    before = time;
  }
}

// The general way (polynomials through points) and the exact one of cubics agree.
TEST(TimeOptimal, BothWaysOfLimitsAgree) {
  Random random(3);
  for (int k = 0; k < 5; ++k) {
    const Path path = natural_cubic_path(random_points(random, 3, 6)).value();
    const CoordinateLimits limits = random_limits(random, 3);
    const double exact = time_optimal(path, Limits{limits}).value().total_time();
    const PathTrajectory general = time_optimal(path, Limits{limits, CoordinateLimits{}}).value();
    EXPECT_NEAR(general.total_time(), exact, 2e-3 * exact);
    EXPECT_LE(largest_use(general, limits), 1.0 + 1e-9);
  }
}

TEST(TimeOptimal, QuinticsAndBezierCurvesKeepToTheirLimits) {
  Random random(4);
  for (int k = 0; k < 6; ++k) {
    const MatrixXd p = random_points(random, 2, 4);
    const Path path = k % 2 == 0 ? quintic_hermite_path(p, 2.0 * random_points(random, 2, 4),
                                                        MatrixXd::Zero(2, 4))
                                       .value()
                                 : bezier_path(random_points(random, 2, 7)).value();
    const CoordinateLimits limits = random_limits(random, 2);
    const PathTrajectory trajectory = time_optimal(path, Limits{limits}).value();
    expect_motion(trajectory);
    EXPECT_LE(largest_use(trajectory, limits), 1.0 + 1e-9) << k;
  }
}

// Of the plane: |dp/dt| and its rate, v² κ, by the samples alone.
TEST(TimeOptimal, TravelLimitsHold) {
  Random random(5);
  for (int k = 0; k < 5; ++k) {
    const Path path = natural_cubic_path(random_points(random, 2, 6)).value();
    const TravelLimits limits{.velocity = 1.2, .acceleration = 2.0, .centripetal = 1.5};
    const PathTrajectory trajectory = time_optimal(path, Limits{limits}).value();
    const std::size_t count = 100 * trajectory.intervals();
    for (std::size_t i = 1; i < count; ++i) {
      const PathSample at = trajectory.sample(trajectory.total_time() * static_cast<double>(i) /
                                              static_cast<double>(count));
      const double v = at.velocity.norm();
      const double along = at.velocity.dot(at.acceleration) / v;
      const double across =
          (at.velocity(0) * at.acceleration(1) - at.velocity(1) * at.acceleration(0)) / v;
      ASSERT_LE(v, limits.velocity * (1.0 + 1e-9));
      ASSERT_LE(std::abs(along), limits.acceleration * (1.0 + 1e-9));
      ASSERT_LE(std::abs(across), limits.centripetal * (1.0 + 1e-9));
    }
  }
}

// Inside the region it is slow, and fast before and after it.
TEST(TimeOptimal, RegionsSlowDown) {
  const Path path = line_path(Vector2d(0.0, 0.0), Vector2d(10.0, 0.0)).value();
  const TravelLimits travel{.velocity = 3.0, .acceleration = 4.0};
  const std::vector<RegionLimit> regions{
      {EllipseRegion{{5.0, 0.0}, 1.0, 2.0, 0.0}, 0.5, "goal"},
      {RectangleRegion{{4.0, -1.0}, {6.0, 1.0}}, 0.5, ""},
      {PolygonRegion{{{4.0, -1.0}, {6.0, -1.0}, {6.0, 1.0}, {4.0, 1.0}}}, 0.5, ""}};
  for (const RegionLimit& region : regions) {
    const PathTrajectory trajectory = time_optimal(path, Limits{travel, region}).value();
    double fastest = 0.0;
    for (double t = 0.0; t < trajectory.total_time(); t += 1e-3) {
      const PathSample at = trajectory.sample(t);
      if (at.position(0) > 4.0 && at.position(0) < 6.0) {
        ASSERT_LE(at.velocity.norm(), 0.5 * (1.0 + 1e-9));
      }
      fastest = std::max(fastest, at.velocity.norm());
    }
    EXPECT_NEAR(fastest, 3.0, 1e-3);
    bool names_it = false;
    for (const BindingLimit& limit : trajectory.binding()) {
      names_it = names_it || limit.limit == (region.name.empty() ? "region 1" : "goal") +
                                                std::string(": velocity");
    }
    EXPECT_TRUE(names_it);
  }
}

DriveLimits small_drive() {
  const mechanisms::DriveShaft shaft{
      .motor = mechanisms::motor("NEO", 1).value(), .gearing = 6.75, .friction = 0.3};
  return {.body = {.mass = Mass(50.0), .moment_of_inertia = MomentOfInertia(5.0)},
          .shaft = shaft,
          .wheel_radius = Length(0.05),
          .voltage = 10.0,
          .current = 60.0};
}

// The sides' voltages and currents, from the samples by the robot's equations written out.
TEST(TimeOptimal, ADifferentialDrivesMotorsKeepToTheirLimits) {
  Random random(6);
  DriveLimits drive = small_drive();
  drive.shaft.motor = mechanisms::motor("NEO", 2).value();
  const mechanisms::DcMotor& motor = drive.shaft.motor;
  const double r = 0.05;
  const double half = 0.3;
  for (int k = 0; k < 3; ++k) {
    MatrixXd points = 3.0 * random_points(random, 2, 4);
    points.row(0) += Eigen::RowVectorXd::LinSpaced(4, 0.0, 12.0);
    const Path path = natural_cubic_path(points).value();
    const PathTrajectory trajectory =
        time_optimal(path, Limits{DifferentialDriveLimits{drive, Length(2.0 * half)}}).value();
    const std::size_t count = 100 * trajectory.intervals();
    double most = 0.0;
    for (std::size_t i = 1; i < count; ++i) {
      const PathSample at = trajectory.sample(trajectory.total_time() * static_cast<double>(i) /
                                              static_cast<double>(count));
      const PathState by = by_arc_length(path.at(at.parameter));
      const double v = at.velocity.norm();
      const double a = at.velocity.dot(at.acceleration) / v;
      const double kappa = planar_curvature(by);
      const double kappa_rate = by.first(0) * by.third(1) - by.first(1) * by.third(0);
      const double alpha = kappa * a + kappa_rate * v * v;
      for (const double side : {-half, half}) {
        const double w = v * (1.0 + side * kappa);
        const double F = 0.5 * 50.0 * a + 0.5 * 5.0 * alpha / side;
        const double torque = r * F + 0.3 * (w > 0.0 ? 1.0 : -1.0);
        const double current = torque / (6.75 * motor.Kt);
        const double voltage = motor.R * current + 6.75 * w / (r * motor.Kv);
        most = std::max({most, std::abs(voltage) / 10.0, std::abs(current) / 60.0});
      }
    }
    EXPECT_LE(most, 1.0 + 1e-9) << k;
    EXPECT_GE(most, 0.99) << k;
    EXPECT_GE(trajectory.binding().size(), 2U);
  }
}

// A swerve and a mecanum drive on a line behave as one motor that pushes a quarter of the robot.
TEST(TimeOptimal, HolonomicDrivesOnALineAreOneMotor) {
  DriveLimits drive = small_drive();
  drive.current = DriveLimits::none;
  const std::vector<Vector2d> corners{{0.3, 0.3}, {0.3, -0.3}, {-0.3, 0.3}, {-0.3, -0.3}};
  const Path path =
      line_path(Eigen::Vector3d(0.0, 0.0, 0.4), Eigen::Vector3d(3.0, 0.0, 0.4)).value();
  const Path ahead =
      line_path(Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(3.0, 0.0, 0.0)).value();
  const double swerve =
      time_optimal(path, Limits{SwerveDriveLimits{drive, corners}}, {.tolerance = 1e-4})
          .value()
          .total_time();
  const double mecanum =
      time_optimal(ahead, Limits{MecanumDriveLimits{drive, corners}}, {.tolerance = 1e-4})
          .value()
          .total_time();
  EXPECT_NEAR(swerve, mecanum, 2e-4 * swerve);
  // Bang-bang by small steps of m/4 dv/dt = (G K_t/r) (±V - G v/(r K_v))/R ∓ friction/r: the way up
  // to a speed and the way down from it together are the line.
  const mechanisms::DcMotor& motor = drive.shaft.motor;
  const double r = 0.05;
  const auto acceleration = [&](double v, double voltage) {
    return (6.75 * motor.Kt * (voltage - 6.75 * v / (r * motor.Kv)) / motor.R - 0.3) / (r * 12.5);
  };
  double v = 0.0;
  double up = 0.0;
  double down = 0.0;
  double time = 0.0;
  constexpr double dv = 1e-5;
  while (up + down < 3.0) {
    const double middle = v + 0.5 * dv;
    const double rise = acceleration(middle, 10.0);
    const double fall = -acceleration(middle, -10.0);
    ASSERT_GT(rise, 0.0);
    up += middle * dv / rise;
    down += middle * dv / fall;
    time += dv / rise + dv / fall;
    v += dv;
  }
  EXPECT_GE(swerve, time * (1.0 - 1e-5));  // dv: some 1e-6
  EXPECT_LE(swerve, time * (1.0 + 2e-4));
}

// Nothing limits an acceleration: the velocity is at its limit from the first moment to the last,
// round a corner, too.
TEST(TimeOptimal, AVelocityLimitAloneIsUsedUp) {
  const Path there = line_path(Vector2d(0.0, 0.0), Vector2d(2.0, 0.0)).value();
  const Path up = line_path(Vector2d(2.0, 0.0), Vector2d(2.0, 1.0)).value();
  const Path corner = joined(std::vector<Path>{there, up}).value();
  for (const PathConstraint& limit : {PathConstraint(TravelLimits{.velocity = 2.0}),
                                      PathConstraint(CoordinateLimits{Vector2d(2.0, 2.0), {}})}) {
    EXPECT_NEAR(time_optimal(there, Limits{limit}).value().total_time(), 1.0, 1e-9);
    const PathTrajectory both = time_optimal(corner, Limits{limit}).value();
    EXPECT_NEAR(both.total_time(), 1.5, 1e-9);
    EXPECT_NEAR(both.sample(0.0).velocity(0), 2.0, 1e-9);
    EXPECT_NEAR(both.sample(1.2).velocity(1), 2.0, 1e-9);
  }
}

// d/v + v/a: as near on 10 km as on 10 m.
TEST(TimeOptimal, LongLinesAreAsFastAsShortOnes) {
  for (const double length : {10.0, 100.0, 1e3, 1e4}) {
    const Path path = line_path(Vector2d(0.0, 0.0), Vector2d(length, 0.0)).value();
    const Limits limits{TravelLimits{.velocity = 2.0, .acceleration = 1.0}};
    const double fastest = length / 2.0 + 2.0;
    const double time = time_optimal(path, limits).value().total_time();
    EXPECT_GE(time, fastest * (1.0 - 1e-12)) << length;
    EXPECT_LE(time, fastest * (1.0 + TimingOptions{}.tolerance)) << length;
  }
}

// Between two parameters, and at one alone.
TEST(TimeOptimal, StretchesSlowDown) {
  const Path path = line_path(Vector2d(0.0, 0.0), Vector2d(10.0, 0.0)).value();
  const double end = path.parameter_end();
  const TravelLimits travel{.velocity = 3.0, .acceleration = 4.0};
  const StretchLimits slow{0.4 * end, 0.6 * end, {.velocity = 0.5, .acceleration = 1.0}, "slow"};
  const PathTrajectory trajectory = time_optimal(path, Limits{travel, slow}).value();
  const std::size_t count = 100 * trajectory.intervals();
  bool inside = false;
  for (std::size_t i = 0; i <= count; ++i) {
    const PathSample at = trajectory.sample(trajectory.total_time() * static_cast<double>(i) /
                                            static_cast<double>(count));
    if (at.position(0) > 4.0 && at.position(0) < 6.0) {
      inside = true;
      ASSERT_LE(at.velocity.norm(), 0.5 * (1.0 + 1e-9));
      ASSERT_LE(at.acceleration.norm(), 1.0 + 1e-9);
    }
    ASSERT_LE(at.acceleration.norm(), 4.0 * (1.0 + 1e-9));
  }
  EXPECT_TRUE(inside);
  // Up to 3 m/s and down to 0.5, 2 m at that, and the same back.
  const double way = 4.0 - 9.0 / 8.0 - (9.0 - 0.25) / 8.0;
  const double fastest = 2.0 * (0.75 + 0.625 + way / 3.0) + 4.0;
  EXPECT_NEAR(trajectory.total_time(), fastest, 3e-3 * fastest);
  bool names_it = false;
  for (const BindingLimit& limit : trajectory.binding()) {
    names_it = names_it || limit.limit == "slow: velocity";
  }
  EXPECT_TRUE(names_it);

  const StretchLimits gate{0.3 * end, 0.3 * end, {.velocity = 1.0}, ""};
  const PathTrajectory through = time_optimal(path, Limits{travel, gate}).value();
  double there = 0.0;
  for (const double t : through.times()) {
    const PathSample at = through.sample(t);
    if (std::abs(at.position(0) - 3.0) < 1e-9) {
      there = at.velocity(0);
    }
  }
  EXPECT_NEAR(there, 1.0, 1e-3);
  EXPECT_LE(there, 1.0 + 1e-9);

  const auto error = [&](const StretchLimits& stretch) {
    return time_optimal(path, Limits{travel, stretch}).error();
  };
  EXPECT_TRUE(error({1.0, 0.5, {.velocity = 1.0}, ""}).is(ArgumentError::out_of_range));
  EXPECT_TRUE(error({std::nan(""), 0.5, {.velocity = 1.0}, ""}).is(ArgumentError::not_finite));
  EXPECT_TRUE(error({0.0, 0.5, {.velocity = 0.0}, ""}).is(ArgumentError::not_positive));
}

// |d²p/dt²| by the samples alone; all of it along a line.
TEST(TimeOptimal, AlongAndAcrossShareTheTotalAcceleration) {
  Random random(11);
  const TravelLimits limits{.velocity = 2.0, .total_acceleration = 2.0};
  for (int k = 0; k < 4; ++k) {
    const Path path = natural_cubic_path(random_points(random, 2, 6)).value();
    const PathTrajectory trajectory = time_optimal(path, Limits{limits}).value();
    const std::size_t count = 100 * trajectory.intervals();
    double most = 0.0;
    for (std::size_t i = 0; i <= count; ++i) {
      const PathSample at = trajectory.sample(trajectory.total_time() * static_cast<double>(i) /
                                              static_cast<double>(count));
      most = std::max(most, at.acceleration.norm());
    }
    EXPECT_LE(most, 2.0 * (1.0 + 1e-9)) << k;
    EXPECT_GE(most, 1.97) << k;
  }
  const Path line = line_path(Vector2d(1.0, 1.0), Vector2d(3.0, 2.0)).value();
  const double length = std::sqrt(5.0);
  EXPECT_NEAR(time_optimal(line, Limits{limits}, {.tolerance = 1e-5}).value().total_time(),
              length / 2.0 + 1.0, 1e-4);
}

// From a line to an arc a differential drive's wheels would have to jump: it stops there, and
// limits that do not know of turning drive through.
TEST(TimeOptimal, ADifferentialDriveStopsWhereTheCurvatureJumps) {
  const Path line = line_path(Vector2d(-3.0, -1.0), Vector2d(0.0, -1.0)).value();
  const Path arc = arc_path({0.0, 0.0}, 1.0, -0.5 * std::numbers::pi, std::numbers::pi).value();
  const Path path = joined(std::vector<Path>{line, arc}).value();
  const auto slowest = [&](const Limits& limits) {
    const PathTrajectory trajectory = time_optimal(path, limits).value();
    double least = 1e9;
    for (const double t : trajectory.times()) {
      const PathSample at = trajectory.sample(t);
      if (std::abs(at.position(0)) < 1e-9 && at.position(1) < 0.0) {
        least = std::min(least, at.velocity.norm());
      }
    }
    return least;
  };
  EXPECT_EQ(slowest(Limits{DifferentialDriveLimits{small_drive(), Length(0.6)}}), 0.0);
  EXPECT_EQ(slowest(Limits{
                TravelLimits{.velocity = 1.0, .acceleration = 1.0, .angular_acceleration = 1.0}}),
            0.0);
  EXPECT_GT(slowest(Limits{TravelLimits{.velocity = 1.0, .acceleration = 1.0}}), 0.9);
}

// A corner and a cusp are driven to a stop; a path goes on through a smooth joint.
TEST(TimeOptimal, StopsAtCornersAndCusps) {
  const Path there = line_path(Vector2d(0.0, 0.0), Vector2d(2.0, 0.0)).value();
  const Path up = line_path(Vector2d(2.0, 0.0), Vector2d(2.0, 2.0)).value();
  const Path on = line_path(Vector2d(2.0, 0.0), Vector2d(5.0, 0.0)).value();
  const Limits limits{TravelLimits{.velocity = 10.0, .acceleration = 2.0}};
  const auto time = [&](const Path& first, const Path& second) {
    return time_optimal(joined(std::vector<Path>{first, second}).value(), limits,
                        {.tolerance = 1e-5})
        .value()
        .total_time();
  };
  // 2 √(d/a) from rest to rest
  EXPECT_NEAR(time(there, up), 4.0, 1e-3);
  EXPECT_NEAR(time(there, reversed(there)), 4.0, 1e-3);
  EXPECT_NEAR(time(there, on), 2.0 * std::sqrt(2.5), 1e-3);
}

TEST(TimeOptimal, VelocitiesAtTheEnds) {
  const Path path = line_path(Vector2d(0.0, 0.0), Vector2d(4.0, 0.0)).value();
  const Limits limits{TravelLimits{.velocity = 2.0, .acceleration = 1.0}};
  const PathTrajectory trajectory =
      time_optimal(path, limits, {.start_velocity = 1.0, .end_velocity = 0.5}).value();
  EXPECT_NEAR(trajectory.sample(0.0).velocity(0), 1.0, 1e-12);
  EXPECT_NEAR(trajectory.sample(1e9).velocity(0), 0.5, 1e-9);
  EXPECT_EQ(to_string(time_optimal(path, limits, {.start_velocity = 3.0}).error()),
            "time_optimal: start velocity is 3; it must be at most 2 under the limits; lower it, "
            "or raise the limits");
  const Path brief = line_path(Vector2d(0.0, 0.0), Vector2d(0.5, 0.0)).value();
  EXPECT_NE(to_string(time_optimal(brief, limits, {.start_velocity = 1.5}).error())
                .find("start velocity is 1.5; it must be at most 1"),
            std::string::npos);
  EXPECT_NE(to_string(time_optimal(brief, limits, {.end_velocity = 1.5}).error())
                .find("end velocity is 1.5; it must be at most "),
            std::string::npos);
}

TEST(TimeOptimal, WaypointsThatCoincideOrLineUp) {
  for (const double bump : {0.0, 1e-12, 1e-9, 1e-6}) {
    MatrixXd line(2, 6);
    line << 0.0, 1.0, 1.0, 1.0 + bump, 2.5, 4.0, 0.0, bump, bump, 0.0, -bump, 0.0;
    const Path path = natural_cubic_path(line).value();
    const CoordinateLimits limits{Vector2d(1.0, 1.0), Vector2d(2.0, 2.0)};
    const PathTrajectory trajectory = time_optimal(path, Limits{limits}).value();
    EXPECT_LE(largest_use(trajectory, limits), 1.0 + 1e-9) << bump;
    // 4 m at 1 m/s and half a second for the ends; what turns aside by 90° on 1e-12 m all but
    // stops.
    EXPECT_GE(trajectory.total_time(), 4.5 - 1e-9) << bump;
    EXPECT_LE(trajectory.total_time(), bump > 0.0 ? 5.1 : 4.51) << bump;
  }
}

TEST(TimeOptimal, RefusesWhatIsNoLimit) {
  const Path path = line_path(Vector2d(0.0, 0.0), Vector2d(4.0, 1.0)).value();
  const auto error = [&](const PathConstraint& constraint) {
    return time_optimal(path, Limits{constraint}).error();
  };
  EXPECT_TRUE(time_optimal(path, Limits{}).error().is(ArgumentError::empty));
  EXPECT_EQ(to_string(error(TravelLimits{.velocity = 0.0})),
            "time_optimal: velocity limit is 0 m/s; it must be positive, or infinite for no limit");
  EXPECT_TRUE(error(TravelLimits{.velocity = -1.0}).is(ArgumentError::not_positive));
  EXPECT_TRUE(error(TravelLimits{.total_acceleration = 5e-324}).is(ArgumentError::out_of_range));
  EXPECT_TRUE(error(TravelLimits{.acceleration = std::nan("")}).is(ArgumentError::not_finite));
  EXPECT_TRUE(error(CoordinateLimits{Eigen::Vector3d::Ones(), {}}).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(error(CoordinateLimits{Vector2d(1.0, 0.0), {}}).is(ArgumentError::not_positive));
  EXPECT_TRUE(error(TravelLimits{.centripetal = 1.0}).is(ArgumentError::out_of_range));
  EXPECT_NE(to_string(error(TravelLimits{.centripetal = 1.0})).find("limit the velocity"),
            std::string::npos);
  EXPECT_TRUE(error(RegionLimit{PolygonRegion{}, 1.0, ""}).is(ArgumentError::empty));
  EXPECT_TRUE(error(RegionLimit{EllipseRegion{}, 1.0, ""}).is(ArgumentError::not_positive));
  EXPECT_TRUE(error(RegionLimit{RectangleRegion{}, 1.0, ""}).is(ArgumentError::out_of_range));
  DriveLimits stuck = small_drive();
  stuck.shaft.friction = 1e3;
  EXPECT_NE(to_string(error(SwerveDriveLimits{stuck, {{0.3, 0.0}, {-0.3, 0.0}}})).find("friction"),
            std::string::npos);
  EXPECT_TRUE(error(MecanumDriveLimits{small_drive(), {}}).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      error(DifferentialDriveLimits{small_drive(), Length(0.0)}).is(ArgumentError::not_positive));
  const Path arm = line_path(VectorXd::Zero(5), VectorXd::Ones(5)).value();
  EXPECT_TRUE(time_optimal(arm, Limits{TravelLimits{.velocity = 1.0}})
                  .error()
                  .is(ArgumentError::wrong_shape));
  // s = s0 + v t + ½ a t² asks for the square of the time.
  const Path endless = line_path(Vector2d(0.0, 0.0), Vector2d(1e152, 1.0)).value();
  EXPECT_NE(to_string(time_optimal(endless, Limits{TravelLimits{.velocity = 0.5}}).error())
                .find("one of 2e+152 s"),
            std::string::npos);
}

TEST(TimeOptimal, SamplesNeedNoHeap) {
  Random random(8);
  const Path path = natural_cubic_path(random_points(random, 7, 10)).value();
  const PathTrajectory trajectory = time_optimal(path, Limits{random_limits(random, 7)}).value();
  const test::AllocationCounter allocations;
  double sum = 0.0;
  for (double t = -1.0; t < trajectory.total_time() + 1.0; t += 0.01) {
    sum += trajectory.sample(t).position.sum();
  }
  sum += trajectory.sample(std::nan("")).position.sum();
  EXPECT_EQ(allocations.count(), 0U);
  EXPECT_TRUE(std::isfinite(sum));
}

// As followers take it: poses on the path, velocities along it.
TEST(TimeOptimal, AsATrajectoryOfThePlane) {
  Random random(9);
  const Path path = natural_cubic_path(random_points(random, 2, 5)).value();
  const PathTrajectory timed =
      time_optimal(path, Limits{TravelLimits{.velocity = 1.0, .acceleration = 2.0}}).value();
  const Trajectory trajectory = planar_trajectory(timed).value();
  EXPECT_NEAR(trajectory.total_time(), timed.total_time(), 1e-12);
  for (double t = 0.0; t < timed.total_time(); t += 0.037) {
    const PathSample at = timed.sample(t);
    const TrajectoryPoint point = trajectory.sample(t);
    EXPECT_LT((point.pose.translation() - at.position).norm(), 2e-3);
    EXPECT_NEAR(point.velocity, at.velocity.norm(), 2e-2);
  }
  const Path turning =
      with_headings(path, std::vector<PathHeading>{{0.0, 1.0}, {1.0, -1.0}}).value();
  const PathTrajectory holonomic =
      time_optimal(turning, Limits{TravelLimits{.velocity = 1.0,
                                                .acceleration = 2.0,
                                                .angular_velocity = 2.0,
                                                .angular_acceleration = 8.0}})
          .value();
  EXPECT_NEAR(planar_trajectory(holonomic).value().points().front().pose.angle(), 1.0, 1e-12);
  EXPECT_TRUE(planar_trajectory(timed, 0.0).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(planar_trajectory(timed, 1e-9).error().is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::time_optimal_test
