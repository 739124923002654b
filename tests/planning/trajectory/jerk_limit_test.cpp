#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/planning/path/build_path.hpp>
#include <flyball/planning/path/edit_path.hpp>
#include <flyball/planning/profiles/s_curve_profile.hpp>
#include <flyball/planning/trajectory/path_trajectory.hpp>

namespace flyball::jerk_limit_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;
using Limits = std::vector<PathConstraint>;

/// The largest use of each kind of limit, 100 times finer than the intervals.
struct Uses {
  double velocity = 0.0;
  double acceleration = 0.0;
  double jerk = 0.0;
  double jump = 0.0;  ///< Of an acceleration over its limit and that of the jerk, beyond rounding.
};

Uses uses(const PathTrajectory& motion, const CoordinateLimits& limits) {
  Uses most;
  const std::vector<double> times = motion.times();
  PathVector before = PathVector::Zero(limits.velocity.size());
  double since = 0.0;
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    for (int k = 0; k <= 100; ++k) {
      const double t = times[i] + (times[i + 1] - times[i]) * k / 100.0;
      const PathSample at = motion.sample(t);
      const auto use = [](const PathVector& of, const VectorXd& limit) {
        return (of.array().abs() / limit.array()).maxCoeff();
      };
      most.velocity = std::max(most.velocity, use(at.velocity, limits.velocity));
      most.acceleration = std::max(most.acceleration, use(at.acceleration, limits.acceleration));
      most.jerk = std::max(most.jerk, use(motion.jerk(t), limits.jerk));
      // The acceleration itself grows no faster than the jerk lets it, over joints, too.
      const VectorXd allowed = limits.jerk * (t - since) + 1e-9 * limits.acceleration;
      most.jump = std::max(most.jump, use(at.acceleration - before, allowed));
      before = at.acceleration;
      since = t;
    }
  }
  return most;
}

void expect_kept(const PathTrajectory& motion, const CoordinateLimits& limits) {
  const Uses most = uses(motion, limits);
  EXPECT_LE(most.velocity, 1.0 + 1e-9);
  EXPECT_LE(most.acceleration, 1.0 + 1e-9);
  EXPECT_LE(most.jerk, 1.0 + 1e-9);
  EXPECT_LE(most.jump, 1.0 + 1e-9);
  EXPECT_LT(motion.sample(0.0).acceleration.norm(), 1e-9);
  EXPECT_LT(motion.sample(1e9).acceleration.norm(), 1e-6);
}

CoordinateLimits all_of(int coordinates, double velocity, double acceleration, double jerk) {
  return {VectorXd::Constant(coordinates, velocity), VectorXd::Constant(coordinates, acceleration),
          VectorXd::Constant(coordinates, jerk)};
}

// Along a line it is the S-curve of the coordinate that is slowest: all seven phases, without a
// cruise, without constant acceleration, with an acceleration that never binds.
TEST(JerkLimit, OfALineIsTheSCurve) {
  struct Case {
    double length, velocity, acceleration, jerk;
  };
  for (const Case& c :
       {Case{4.0, 1.0, 2.0, 8.0}, Case{0.6, 1.0, 2.0, 8.0}, Case{0.02, 1.0, 2.0, 8.0},
        Case{4.0, 1.0, 20.0, 8.0}, Case{4.0, 1.0, 2.0, 1e3}}) {
    const Path path = line_path(Vector2d(0.0, 0.0), Vector2d(c.length, 0.5 * c.length)).value();
    const SCurveProfile exact(
        {.velocity = c.velocity, .acceleration = c.acceleration, .jerk = c.jerk}, {},
        {.position = c.length});
    const CoordinateLimits limits = all_of(2, c.velocity, c.acceleration, c.jerk);
    const PathTrajectory usual = time_optimal(path, Limits{limits}).value();
    expect_kept(usual, limits);
    EXPECT_GE(usual.total_time(), exact.total_time() * (1.0 - 1e-9)) << c.length;
    EXPECT_LE(usual.total_time(), exact.total_time() * (1.0 + 3e-3)) << c.length;
    const PathTrajectory fine = time_optimal(path, Limits{limits}, {.tolerance = 1e-4}).value();
    EXPECT_GE(fine.total_time(), exact.total_time() * (1.0 - 1e-9)) << c.length;
    EXPECT_LE(fine.total_time(), exact.total_time() * (1.0 + 1e-4)) << c.length;
  }
}

CoordinateLimits random_limits(Random& random, int coordinates) {
  CoordinateLimits limits{VectorXd(coordinates), VectorXd(coordinates), VectorXd(coordinates)};
  for (int j = 0; j < coordinates; ++j) {
    limits.velocity(j) = random.uniform(0.5, 1.5);
    limits.acceleration(j) = random.uniform(1.0, 3.0);
    limits.jerk(j) = random.uniform(2.0, 40.0);
  }
  return limits;
}

Path random_path(Random& random, int coordinates, int count) {
  MatrixXd points(coordinates, count);
  for (double& value : points.reshaped()) {
    value = random.uniform(-1.0, 1.0);
  }
  return natural_cubic_path(points, KnotSpacing::uniform).value();
}

// Limits hold everywhere; the motion is slower than without limits of jerks, near to what a finer
// tolerance finds, and takes as long from the end to the beginning.
TEST(JerkLimit, HoldsAlongCurves) {
  Random random(11);
  for (int k = 0; k < 3; ++k) {
    const int coordinates = k % 2 == 0 ? 2 : 5;
    const Path path = random_path(random, coordinates, 4);
    const CoordinateLimits limits = random_limits(random, coordinates);
    CoordinateLimits free = limits;
    free.jerk = VectorXd();
    const PathTrajectory motion = time_optimal(path, Limits{limits}).value();
    expect_kept(motion, limits);
    const double without =
        time_optimal(path, Limits{free}, {.tolerance = 1e-4}).value().total_time();
    EXPECT_GT(motion.total_time(), without) << k;
    const double finer =
        time_optimal(path, Limits{limits}, {.tolerance = 3e-4}).value().total_time();
    EXPECT_NEAR(motion.total_time(), finer, 1.5e-3 * finer) << k;
    const double back = time_optimal(reversed(path), Limits{limits}).value().total_time();
    EXPECT_NEAR(back, finer, 1.5e-3 * finer) << k;
    // With v, a, j times 2, 4, 8 the same motion takes half as long.
    CoordinateLimits faster = limits;
    faster.velocity *= 2.0;
    faster.acceleration *= 4.0;
    faster.jerk *= 8.0;
    const double half = time_optimal(path, Limits{faster}).value().total_time();
    EXPECT_NEAR(2.0 * half, motion.total_time(), 1e-6 * motion.total_time()) << k;
  }
}

// A jerk that is hardly limited does not cost time.
TEST(JerkLimit, ThatIsWideIsNone) {
  Random random(12);
  const Path path = random_path(random, 2, 5);
  CoordinateLimits limits = random_limits(random, 2);
  limits.jerk = VectorXd::Constant(2, 1e4);
  const PathTrajectory motion = time_optimal(path, Limits{limits}).value();
  expect_kept(motion, limits);
  limits.jerk = VectorXd();
  const double without =
      time_optimal(path, Limits{limits}, {.tolerance = 1e-5}).value().total_time();
  EXPECT_GE(motion.total_time(), without * (1.0 - 1e-5));
  EXPECT_LE(motion.total_time(), without * (1.0 + 4e-3));
}

// Round an arc v² <= a_c r, so that it is the S-curve up to that velocity.
TEST(JerkLimit, AlongAnArc) {
  const double r = 1.5;
  const Path path = arc_path({0.0, 0.0}, r, 0.3, 2.0).value();
  const TravelLimits limits{.velocity = 5.0, .acceleration = 1.0, .centripetal = 0.6, .jerk = 4.0};
  const SCurveProfile exact({.velocity = std::sqrt(0.6 * r), .acceleration = 1.0, .jerk = 4.0}, {},
                            {.position = 2.0 * r});
  const PathTrajectory motion = time_optimal(path, Limits{limits}).value();
  EXPECT_GE(motion.total_time(), exact.total_time() * (1.0 - 1e-9));
  EXPECT_LE(motion.total_time(), exact.total_time() * (1.0 + 2e-3));
  bool named = false;
  for (const BindingLimit& limit : motion.binding()) {
    named = named || limit.limit == "jerk";
    EXPECT_LE(limit.use, 1.0 + 1e-9);
  }
  EXPECT_TRUE(named);
}

// |d²v/dt²| of the samples, through a zone of its own limit.
TEST(JerkLimit, AlongTheWayInZones) {
  Random random(13);
  for (int k = 0; k < 2; ++k) {
    const Path path = random_path(random, 2, 5);
    const TravelLimits travel{
        .velocity = 1.5, .acceleration = 2.0, .centripetal = 1.0, .jerk = 10.0};
    const StretchLimits slow{1.2, 2.1, {.velocity = 1.0, .jerk = 5.0}, "zone"};
    const PathTrajectory motion = time_optimal(path, Limits{travel, slow}).value();
    const std::vector<double> times = motion.times();
    for (std::size_t i = 0; i + 1 < times.size(); ++i) {
      for (int m = 1; m < 100; ++m) {
        const double t = times[i] + (times[i + 1] - times[i]) * m / 100.0;
        const PathSample at = motion.sample(t);
        // d²|v|/dt² = (a·a + v·j)/|v| - (v·a)²/|v|³
        const double v = at.velocity.norm();
        const double along = at.velocity.dot(at.acceleration) / v;
        const double jerk =
            (at.acceleration.squaredNorm() + at.velocity.dot(motion.jerk(t)) - along * along) / v;
        const bool inside = at.parameter > 1.2 && at.parameter < 2.1;
        ASSERT_LE(std::abs(jerk), (inside ? 5.0 : 10.0) * (1.0 + 1e-9) + 1e-9) << at.parameter;
        ASSERT_LE(std::abs(along), 2.0 * (1.0 + 1e-9));
        ASSERT_LE(v, (inside ? 1.0 : 1.5) * (1.0 + 1e-9));
      }
    }
  }
}

// Ends that are passed: the S-curve between states without acceleration.
TEST(JerkLimit, VelocitiesAtTheEnds) {
  const Path path = line_path(Vector2d(0.0, 0.0), Vector2d(3.0, 0.0)).value();
  const TravelLimits limits{.velocity = 1.5, .acceleration = 2.0, .jerk = 6.0};
  const SCurveProfile exact({.velocity = 1.5, .acceleration = 2.0, .jerk = 6.0}, {.velocity = 0.5},
                            {.position = 3.0, .velocity = 1.0});
  const PathTrajectory motion =
      time_optimal(path, Limits{limits}, {.start_velocity = 0.5, .end_velocity = 1.0}).value();
  EXPECT_NEAR(motion.sample(0.0).velocity(0), 0.5, 1e-9);
  EXPECT_NEAR(motion.sample(1e9).velocity(0), 1.0, 1e-6);
  EXPECT_NEAR(motion.sample(0.0).acceleration(0), 0.0, 1e-9);
  EXPECT_NEAR(motion.sample(1e9).acceleration(0), 0.0, 1e-6);
  EXPECT_GE(motion.total_time(), exact.total_time() * (1.0 - 1e-9));
  EXPECT_LE(motion.total_time(), exact.total_time() * (1.0 + 2e-3));
  // From 1.4 m/s to rest takes 0.96 m, more than there are.
  const Path brief = line_path(Vector2d(0.0, 0.0), Vector2d(0.6, 0.0)).value();
  const auto none = time_optimal(brief, Limits{limits}, {.start_velocity = 1.4});
  ASSERT_FALSE(none);
  EXPECT_NE(to_string(none.error()).find("jerk"), std::string::npos) << to_string(none.error());
}

// From a line into a bend the acceleration across jumps: a stop for limits of the coordinates'
// jerks, none for that along the way.
TEST(JerkLimit, WhereTheCurvatureJumps) {
  const Path line = line_path(Vector2d(-2.0, -1.0), Vector2d(0.0, -1.0)).value();
  const Path bend = arc_path({0.0, 0.0}, 1.0, -0.5 * std::numbers::pi, 1.5).value();
  const Path path = joined(std::vector<Path>{line, bend}).value();
  const double joint = path.breaks()[1];
  const auto slowest_near = [&](const PathTrajectory& motion) {
    double least = 1e300;
    for (double t = 0.0; t < motion.total_time(); t += 1e-3) {
      const PathSample at = motion.sample(t);
      if (std::abs(at.parameter - joint) < 0.02 * joint) {
        least = std::min(least, at.velocity.norm());
      }
    }
    return least;
  };
  const CoordinateLimits limits = all_of(2, 2.0, 2.0, 10.0);
  const PathTrajectory stops = time_optimal(path, Limits{limits}).value();
  expect_kept(stops, limits);
  EXPECT_LT(slowest_near(stops), 0.05);
  const PathTrajectory goes =
      time_optimal(path,
                   Limits{TravelLimits{
                       .velocity = 2.0, .acceleration = 2.0, .centripetal = 2.0, .jerk = 10.0}})
          .value();
  EXPECT_GT(slowest_near(goes), 0.5);
}

// The acceleration as a vector: along a line it is the S-curve, along a bend |d³p/dt³| keeps to its
// limit, which that along the way alone does not; into a bend from a line it stops.
TEST(JerkLimit, OfTheWholeAcceleration) {
  const Path line = line_path(Vector2d(0.0, 0.0), Vector2d(3.0, 0.0)).value();
  const TravelLimits limits{.velocity = 1.5, .total_acceleration = 2.0, .total_jerk = 6.0};
  const SCurveProfile exact({.velocity = 1.5, .acceleration = 2.0, .jerk = 6.0}, {}, {3.0});
  const double straight = time_optimal(line, Limits{limits}).value().total_time();
  EXPECT_GE(straight, exact.total_time() * (1.0 - 1e-9));
  EXPECT_LE(straight, exact.total_time() * (1.0 + 2e-3));

  const auto most = [](const PathTrajectory& motion) {
    double largest = 0.0;
    const std::vector<double> times = motion.times();
    for (std::size_t i = 0; i + 1 < times.size(); ++i) {
      for (int m = 1; m < 100; ++m) {
        const double t = times[i] + (times[i + 1] - times[i]) * m / 100.0;
        largest = std::max(largest, motion.jerk(t).head<2>().norm());
      }
    }
    return largest;
  };
  Random random(15);
  const PathTrajectory curve = time_optimal(random_path(random, 2, 4), Limits{limits}).value();
  EXPECT_LE(most(curve), 6.0 * (1.0 + 1e-9));
  EXPECT_GT(most(curve), 6.0 * 0.96);

  const Path bend = arc_path({3.0, 1.0}, 1.0, -0.5 * std::numbers::pi, 1.5).value();
  const Path both = joined(std::vector<Path>{line, bend}).value();
  const PathTrajectory whole = time_optimal(bend, Limits{limits}).value();
  EXPECT_LE(most(whole), 6.0 * (1.0 + 1e-9));
  EXPECT_NEAR(time_optimal(both, Limits{limits}).value().total_time(),
              straight + whole.total_time(), 5e-3);
  TravelLimits along = limits;
  along.jerk = std::exchange(along.total_jerk, TravelLimits::none);
  const PathTrajectory faster = time_optimal(bend, Limits{along}).value();
  EXPECT_GT(most(faster), 6.0 * 1.4);
  EXPECT_LT(faster.total_time(), whole.total_time());
}

TEST(JerkLimit, RefusesWhatIsNoLimit) {
  const Path path = line_path(Vector2d(0.0, 0.0), Vector2d(4.0, 1.0)).value();
  const auto error = [&](const PathConstraint& constraint) {
    return time_optimal(path, Limits{constraint}).error();
  };
  EXPECT_EQ(to_string(error(TravelLimits{.velocity = 1.0, .jerk = 0.0})),
            "time_optimal: jerk limit is 0 m/s³; it must be positive, or infinite for no limit");
  EXPECT_TRUE(
      error(TravelLimits{.velocity = 1.0, .jerk = std::nan("")}).is(ArgumentError::not_finite));
  CoordinateLimits limits = all_of(2, 1.0, 1.0, 1.0);
  limits.jerk = VectorXd::Ones(3);
  EXPECT_TRUE(error(limits).is(ArgumentError::wrong_shape));
  limits.jerk = Vector2d(1.0, -1.0);
  EXPECT_TRUE(error(limits).is(ArgumentError::not_positive));
}

}  // namespace
}  // namespace flyball::jerk_limit_test
