#include <flyball/planning/path/build_path.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

namespace flyball::build_path_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;

MatrixXd random_points(Random& random, int coordinates, int count) {
  MatrixXd points(coordinates, count);
  for (double& value : points.reshaped()) {
    value = random.uniform(-2.0, 2.0);
  }
  return points;
}

/// The largest jump of a derivative at the breaks: 1, 2 or 3.
double jump(const Path& path, int order) {
  const auto pick = [&](const PathState& state) {
    return order == 1 ? state.first : order == 2 ? state.second : state.third;
  };
  double most = 0.0;
  for (std::size_t i = 0; i + 1 < path.pieces().size(); ++i) {
    most = std::max(most, (pick(path.at(i, 1.0)) - pick(path.at(i + 1, 0.0))).norm());
  }
  return most;
}

TEST(BuildPath, NaturalCubicsMeetTheirWaypointsSmoothly) {
  Random random(1);
  for (const KnotSpacing spacing :
       {KnotSpacing::uniform, KnotSpacing::centripetal, KnotSpacing::chord}) {
    for (int n = 2; n <= 12; ++n) {
      const MatrixXd points = random_points(random, 3, n);
      const Path path = natural_cubic_path(points, spacing).value();
      ASSERT_EQ(path.pieces().size(), static_cast<std::size_t>(n - 1));
      for (int i = 0; i < n; ++i) {
        EXPECT_LT(
            (path.at(path.breaks()[static_cast<std::size_t>(i)]).position - points.col(i)).norm(),
            1e-13);
      }
      EXPECT_LT(jump(path, 1), 1e-12);
      EXPECT_LT(jump(path, 2), 1e-11);
      EXPECT_LT(path.at(0.0).second.norm(), 1e-11);
      EXPECT_LT(path.at(path.parameter_end()).second.norm(), 1e-11);
    }
  }
}

// scipy.interpolate.CubicSpline([0, 1, 2, 3], [0, 2, -1, 1], bc_type='natural'), then with
// bc_type=((1, 1.0), (1, -2.0)), at 1.5: the value and its derivative.
TEST(BuildPath, CubicsAsScipyHasThem) {
  const MatrixXd points = (MatrixXd(1, 4) << 0.0, 2.0, -1.0, 1.0).finished();
  const PathState natural = natural_cubic_path(points, KnotSpacing::uniform).value().at(1.5);
  EXPECT_NEAR(natural.position(0), 0.4999999999999999, 1e-14);
  EXPECT_NEAR(natural.first(0), -3.833333333333334, 1e-14);
  const PathState clamped = clamped_cubic_path(points, MatrixXd::Constant(1, 1, 1.0),
                                               MatrixXd::Constant(1, 1, -2.0), KnotSpacing::uniform)
                                .value()
                                .at(1.5);
  EXPECT_NEAR(clamped.position(0), 0.375, 1e-14);
  EXPECT_NEAR(clamped.first(0), -4.25, 1e-14);
}

// Waypoints that coincide are one; on one line and nearly so the spline is nearly the line.
TEST(BuildPath, WaypointsThatCoincideOrLineUp) {
  MatrixXd twice(2, 5);
  twice << 0.0, 1.0, 1.0, 1.0, 2.0, 0.0, 1.0, 1.0, 1.0, 0.0;
  for (const KnotSpacing spacing :
       {KnotSpacing::uniform, KnotSpacing::centripetal, KnotSpacing::chord}) {
    const Path path = natural_cubic_path(twice, spacing).value();
    EXPECT_EQ(path.pieces().size(), 2U);
    EXPECT_NEAR(path.position(path.breaks()[1])(1), 1.0, 1e-14);
  }
  for (const double bump : {0.0, 1e-15, 1e-12, 1e-9, 1e-6}) {
    MatrixXd line(2, 5);
    line << 0.0, 1.0, 1.0 + bump, 2.5, 4.0, 0.0, bump, 0.0, -bump, 0.0;
    const Path path = natural_cubic_path(line).value();
    for (double s = 0.0; s < path.parameter_end(); s += 0.01) {
      const PathState state = path.at(s);
      EXPECT_TRUE(state.second.allFinite());
      EXPECT_LT(std::abs(state.position(1)), 1e-3);
    }
    EXPECT_NEAR(path_length(path), 4.0, 1e-2);
  }
}

// Each coordinate has units of its own: a place that is nothing beside another coordinate's is one,
// and what rounding leaves at the end of a far piece does not move the pieces after it.
TEST(BuildPath, NoCoordinateHidesTheOthers) {
  const MatrixXd hidden{{-1e154, 1.5, -1.25, 1.75}, {0.5, 0.25, 1.0, -2.0}};
  const Path uniform = natural_cubic_path(hidden, KnotSpacing::uniform).value();
  ASSERT_EQ(uniform.pieces().size(), 3u);
  EXPECT_NEAR(uniform.position(3.0)(1), -2.0, 1e-15);
  EXPECT_NEAR(uniform.position(2.0)(1), 1.0, 1e-15);
  // By their distances the last knots cannot be told from the first.
  const auto chord = natural_cubic_path(hidden, KnotSpacing::chord);
  ASSERT_FALSE(chord);
  EXPECT_TRUE(chord.error().is(ArgumentError::out_of_range));
  EXPECT_NE(to_string(chord.error()).find("waypoint 3 is "), std::string::npos)
      << to_string(chord.error());

  const MatrixXd far{{-1e20, 0.0, 0.0}, {-1.25, 1e8, -1e-20}};
  const Path back = natural_cubic_path(far, KnotSpacing::centripetal).value();
  const MatrixXd& last = back.pieces().back().coefficients;
  EXPECT_LE(std::abs(last.row(0).sum()), 1e-12 * last.row(0).cwiseAbs().sum());
}

TEST(BuildPath, HermitePolynomialsMeetTheirEnds) {
  Random random(2);
  const MatrixXd p = random_points(random, 2, 4);
  const MatrixXd v = random_points(random, 2, 4);
  const MatrixXd a = random_points(random, 2, 4);
  const Path cubic = cubic_hermite_path(p, v).value();
  const Path quintic = quintic_hermite_path(p, v, a).value();
  for (int i = 0; i < 4; ++i) {
    EXPECT_LT((cubic.at(i).first - v.col(i)).norm(), 1e-13);
    EXPECT_LT((quintic.at(i).position - p.col(i)).norm(), 1e-13);
    EXPECT_LT((quintic.at(i).first - v.col(i)).norm(), 1e-13);
    EXPECT_LT((quintic.at(i).second - a.col(i)).norm(), 1e-12);
  }
  EXPECT_LT(jump(quintic, 2), 1e-11);
}

// Bernstein's polynomials themselves: q(s) = Σ C(d, j) sʲ (1 - s)^{d-j} b_j.
TEST(BuildPath, BezierCurvesOfAllDegrees) {
  Random random(3);
  for (int d = 1; d <= 20; ++d) {
    const MatrixXd b = random_points(random, 2, d + 1);
    const Path path = bezier_path(b).value();
    for (const double s : {0.0, 0.2, 0.5, 0.9, 1.0}) {
      Vector2d q = Vector2d::Zero();
      for (int j = 0; j <= d; ++j) {
        q += std::exp(std::lgamma(d + 1) - std::lgamma(j + 1) - std::lgamma(d - j + 1)) *
             std::pow(s, j) * std::pow(1.0 - s, d - j) * b.col(j);
      }
      // Powers of s lose 3^d of what they are added from.
      EXPECT_LT((path.position(s) - q).norm(), 1e-15 * std::pow(3.0, d) + 1e-13);
    }
  }
  const Path joined = bezier_path(random_points(random, 2, 7), 3).value();
  EXPECT_EQ(joined.pieces().size(), 2U);
}

// Within the hull, from the first to the last control point, degree - 1 derivatives continuous;
// of four points and degree 3 it is the Bézier curve.
TEST(BuildPath, BSplines) {
  Random random(4);
  for (int d = 1; d <= 5; ++d) {
    const MatrixXd b = random_points(random, 2, 9);
    const Path path = b_spline_path(b, d).value();
    EXPECT_EQ(path.pieces().size(), static_cast<std::size_t>(9 - d));
    EXPECT_LT((path.position(0.0) - b.col(0)).norm(), 1e-14);
    EXPECT_LT((path.position(path.parameter_end()) - b.col(8)).norm(), 1e-12);
    if (d >= 2) {
      EXPECT_LT(jump(path, 1), 1e-11);
    }
    if (d >= 3) {
      EXPECT_LT(jump(path, 2), 1e-10);
    }
    if (d >= 4) {
      EXPECT_LT(jump(path, 3), 1e-9);
    }
  }
  const MatrixXd four = random_points(random, 2, 4);
  const Path spline = b_spline_path(four, 3).value();
  const Path bezier = bezier_path(four).value();
  EXPECT_LT((spline.position(0.3) - bezier.position(0.3)).norm(), 1e-14);
  // scipy.interpolate.BSpline([0,0,0,0,1,2,2,2,2], [0, 1, -1, 3, 2], 3)(0.7), (1.4)
  const MatrixXd five = (MatrixXd(1, 5) << 0.0, 1.0, -1.0, 3.0, 2.0).finished();
  const Path golden = b_spline_path(five, 3).value();
  EXPECT_NEAR(golden.position(0.7)(0), 0.3605, 1e-14);
  EXPECT_NEAR(golden.position(1.4)(0), 1.5319999999999998, 1e-14);
}

TEST(BuildPath, ArcsAreCirclesToRounding) {
  const Path path = arc_path({0.5, 2.0}, 3.0, -2.0, -11.0).value();
  for (double s = 0.0; s <= 11.0; s += 0.01) {
    const Vector2d expected =
        Vector2d(0.5, 2.0) + 3.0 * Vector2d(std::cos(-2.0 - s), std::sin(-2.0 - s));
    EXPECT_LT((path.position(s) - expected).norm(), 2e-14);
  }
  // From a pose to a point: it begins in the pose's heading, ends there, bends all the same.
  for (const Vector2d& end : {Vector2d(3.0, 1.0), Vector2d(-1.0, 2.0), Vector2d(0.5, -4.0)}) {
    const Pose2d start(0.5, -0.3, 0.7);
    const Path arc = arc_path(start, end).value();
    EXPECT_LT((arc.position(0.0) - start.translation()).norm(), 1e-13);
    EXPECT_LT((arc.position(arc.parameter_end()) - end).norm(), 1e-13);
    EXPECT_NEAR(travel_heading(arc.at(0.0)), 0.7, 1e-13);
    EXPECT_NEAR(planar_curvature(arc.at(0.0)), planar_curvature(arc.at(arc.parameter_end())),
                1e-11);
  }
  EXPECT_NEAR(path_length(arc_path(Pose2d(1.0, 1.0, 0.0), {4.0, 1.0}).value()), 3.0, 1e-14);
}

TEST(BuildPath, RefusesBadPoints) {
  const MatrixXd one = MatrixXd::Ones(2, 1);
  const MatrixXd same = MatrixXd::Ones(2, 4);
  EXPECT_TRUE(natural_cubic_path(one).error().is(ArgumentError::empty));
  EXPECT_EQ(to_string(natural_cubic_path(same).error()),
            "natural_cubic_path: waypoints is 4, all in one place; it must be two or more places; "
            "give the path somewhere to go");
  EXPECT_TRUE(natural_cubic_path(same * std::nan("")).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(natural_cubic_path(MatrixXd(0, 3)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(cubic_hermite_path(same, one).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(bezier_path(MatrixXd::Random(2, 22)).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(bezier_path(MatrixXd::Random(2, 6), 3).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(b_spline_path(MatrixXd::Random(2, 3), 3).error().is(ArgumentError::empty));
  EXPECT_TRUE(b_spline_path(MatrixXd::Random(2, 3), 0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(arc_path({0.0, 0.0}, 0.0, 0.0, 1.0).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(arc_path({0.0, 0.0}, 1.0, 0.0, 0.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(arc_path(Pose2d(), {-1.0, 0.0}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(line_path(one, one).error().is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::build_path_test
