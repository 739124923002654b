#include <flyball/planning/splines/spline.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

namespace flyball::spline_test {
namespace {

using Eigen::Vector2d;

SplineEnd random_end(Random& random) {
  const auto vector = [&] { return Vector2d(random.normal(), random.normal()); };
  return {vector(), vector(), vector()};
}

TEST(Spline, HermiteSegmentsMeetTheirEnds) {
  Random random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const SplineEnd a = random_end(random);
    const SplineEnd b = random_end(random);
    const SplineSegment quintic = quintic_hermite(a, b);
    const SplineSegment cubic = cubic_hermite(a, b);
    for (const auto& [t, end] : {std::pair{0.0, a}, std::pair{1.0, b}}) {
      const SplineEnd q = quintic.at(t);
      EXPECT_LE((q.position - end.position).norm(), 1e-13);
      EXPECT_LE((q.derivative - end.derivative).norm(), 1e-12);
      EXPECT_LE((q.second - end.second).norm(), 1e-12);
      const SplineEnd c = cubic.at(t);
      EXPECT_LE((c.position - end.position).norm(), 1e-13);
      EXPECT_LE((c.derivative - end.derivative).norm(), 1e-13);
    }
  }
}

// p = (t, t²): at t the heading is atan 2t and the curvature 2/(1 + 4t²)^(3/2).
TEST(Spline, HeadingAndCurvatureOfAParabola) {
  SplineSegment::Coefficients c = SplineSegment::Coefficients::Zero();
  c(0, 1) = 1.0;
  c(1, 2) = 1.0;
  const SplineSegment parabola(c);
  for (const double t : {0.0, 0.3, 1.0}) {
    const PathPoint point = parabola.point(t);
    EXPECT_NEAR(point.pose.y(), t * t, 1e-16);
    EXPECT_NEAR(point.pose.angle(), std::atan(2.0 * t), 1e-15);
    EXPECT_NEAR(point.curvature, 2.0 / std::pow(1.0 + 4.0 * t * t, 1.5), 1e-15);
  }
}

// Through poses: each is met, and neither heading nor curvature jumps where segments of very
// different length meet.
TEST(Spline, QuinticThroughPosesBendsContinuously) {
  Random random(2);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<Pose2d> waypoints;
    Vector2d place = Vector2d::Zero();
    for (int i = 0; i < 6; ++i) {
      waypoints.emplace_back(place, Rotation2d(random.uniform(-1.0, 1.0)));
      place += std::pow(10.0, random.uniform(-1.0, 1.0)) * Vector2d(1.0, random.uniform(-0.5, 0.5));
    }
    const Spline spline = quintic_spline(waypoints).value();
    ASSERT_EQ(spline.size(), 5U);
    EXPECT_NEAR(spline.front().point(0.0).curvature, 0.0, 1e-12);
    EXPECT_NEAR(spline.back().point(1.0).curvature, 0.0, 1e-8);
    for (std::size_t i = 0; i < spline.size(); ++i) {
      EXPECT_LE(spline[i].point(0.0).pose.minus(waypoints[i]).norm(), 1e-12);
      EXPECT_LE(spline[i].point(1.0).pose.minus(waypoints[i + 1]).norm(), 1e-11);
      if (i > 0) {
        const double before = spline[i - 1].point(1.0).curvature;
        const double after = spline[i].point(0.0).curvature;
        EXPECT_NEAR(before, after, 1e-10 * (1.0 + std::abs(before)));
      }
    }
  }
}

TEST(Spline, CubicHasContinuousSecondDerivatives) {
  Random random(3);
  std::vector<Vector2d> interior;
  for (int i = 0; i < 8; ++i) {
    interior.emplace_back(1.0 + i, random.normal());
  }
  const Pose2d start(0.0, 0.0, 0.5);
  const Pose2d end(9.0, 1.0, -0.5);
  const Spline spline = cubic_spline(start, interior, end).value();
  ASSERT_EQ(spline.size(), 9U);
  for (std::size_t i = 0; i < interior.size(); ++i) {
    const SplineEnd before = spline[i].at(1.0);
    const SplineEnd after = spline[i + 1].at(0.0);
    EXPECT_LE((before.position - interior[i]).norm(), 1e-14);
    EXPECT_LE((before.derivative - after.derivative).norm(), 1e-13);
    EXPECT_LE((before.second - after.second).norm(), 1e-12);
  }
  EXPECT_NEAR(spline.front().point(0.0).pose.angle(), 0.5, 1e-15);
  EXPECT_NEAR(spline.back().point(1.0).pose.angle(), -0.5, 1e-14);
  EXPECT_EQ(cubic_spline(start, {}, end).value().size(), 1U);
}

// Each twist between neighbours is within the spacing, and would not be with twice the interval
// everywhere: no point is there for nothing.
TEST(Spline, SamplesAreAsFarApartAsAllowed) {
  const std::vector<Pose2d> waypoints{{0.0, 0.0, 0.0}, {3.0, 2.0, 1.5}, {2.0, 5.0, 3.0}};
  const Spline spline = quintic_spline(waypoints).value();
  const PathSpacing spacing{};
  const auto path = sample_path(spline, spacing).value();
  EXPECT_LE(path.front().pose.minus(waypoints.front()).norm(), 1e-14);
  EXPECT_LE(path.back().pose.minus(waypoints.back()).norm(), 1e-12);
  bool has_knot = false;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Eigen::Vector3d twist = path[i].pose.minus(path[i - 1].pose);
    EXPECT_LE(std::abs(twist(0)), spacing.along);
    EXPECT_LE(std::abs(twist(1)), spacing.across);
    EXPECT_LE(std::abs(twist(2)), spacing.turn);
    has_knot = has_knot || path[i].pose.minus(waypoints[1]).norm() < 1e-12;
  }
  EXPECT_TRUE(has_knot);
  const auto finer = sample_path(spline, {.along = 0.0127, .across = 0.00127, .turn = 0.0872});
  EXPECT_GT(finer->size(), path.size());
}

// A half circle of radius 1 in so many points that chords add up to π.
TEST(Spline, ArcLengthOfAClosedForm) {
  SplineSegment::Coefficients c = SplineSegment::Coefficients::Zero();
  // (t, t²) from 0 to 1 has the length (2√5 + asinh 2)/4.
  c(0, 1) = 1.0;
  c(1, 2) = 1.0;
  const auto path =
      sample_path({SplineSegment(c)}, {.along = 0.001, .across = 1.0, .turn = 1.0}).value();
  double length = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    length += (path[i].pose.translation() - path[i - 1].pose.translation()).norm();
  }
  EXPECT_NEAR(length, (2.0 * std::sqrt(5.0) + std::asinh(2.0)) / 4.0, 1e-7);
}

TEST(Spline, Refusals) {
  const std::vector<Pose2d> one{{0.0, 0.0, 0.0}};
  EXPECT_EQ(to_string(quintic_spline(one).error()),
            "quintic_spline: waypoints is 1 of them; it must be two or more");
  const std::vector<Pose2d> twice{{0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}};
  EXPECT_EQ(to_string(quintic_spline(twice).error()),
            "quintic_spline: waypoint 2 is where the one before it is; it must be somewhere else");
  const std::vector<Pose2d> nan{{0.0, 0.0, 0.0}, {NAN, 0.0, 1.0}};
  EXPECT_TRUE(quintic_spline(nan).error().is(ArgumentError::not_finite));
  EXPECT_FALSE(cubic_spline(one[0], {}, one[0]));
  EXPECT_TRUE(sample_path({}).error().is(ArgumentError::empty));
  const Spline straight = quintic_spline(std::vector<Pose2d>{{0, 0, 0}, {1, 0, 0}}).value();
  EXPECT_TRUE(sample_path(straight, {.along = 0.0}).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(sample_path(straight, {.along = 1e-9}).error().is(ArgumentError::out_of_range));

  // There and back along a line: a cusp at (0.5, 0), t = 1/2.
  SplineSegment::Coefficients c = SplineSegment::Coefficients::Zero();
  c(0, 1) = 2.0;
  c(0, 2) = -2.0;
  const auto cusp = sample_path({SplineSegment(c)});
  ASSERT_FALSE(cusp);
  EXPECT_TRUE(cusp.error().is(ArgumentError::out_of_range));
  EXPECT_NEAR(cusp.error().evidence().front().values.front(), 0.5, 1e-6);
}

}  // namespace
}  // namespace flyball::spline_test
