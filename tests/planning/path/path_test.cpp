#include <flyball/planning/path/path.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/planning/path/build_path.hpp>

#include "support/allocation_count.hpp"

namespace flyball::path_test {
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

// Each derivative is what the one before it changes by: central differences, O(h²).
TEST(Path, DerivativesAreDerivatives) {
  Random random(1);
  const Path path = bezier_path(random_points(random, 3, 8)).value();
  const double h = 1e-5;
  for (double s = 0.1; s < 0.95; s += 0.1) {
    const PathState before = path.at(s - h);
    const PathState at = path.at(s);
    const PathState after = path.at(s + h);
    EXPECT_LT((after.position - before.position - 2.0 * h * at.first).norm(), 1e-11);
    EXPECT_LT((after.first - before.first - 2.0 * h * at.second).norm(), 1e-10);
    EXPECT_LT((after.second - before.second - 2.0 * h * at.third).norm(), 1e-8);
    EXPECT_LT((path.position(s) - at.position).norm(), 1e-14);
  }
}

// A circle of radius 2: |dq/dl| = 1, |d²q/dl²| = 1/2, |d³q/dl³| = 1/4, length 2 · 3 rad.
TEST(Path, OfACircleByItsLength) {
  const Path path = arc_path({1.0, -1.0}, 2.0, 0.4, 3.0).value();
  EXPECT_NEAR(path_length(path), 6.0, 1e-14);
  for (double s = 0.0; s <= 3.0; s += 0.07) {
    const PathState by = by_arc_length(path.at(s));
    EXPECT_NEAR((by.position - Vector2d(1.0, -1.0)).norm(), 2.0, 1e-14);
    EXPECT_NEAR(by.first.norm(), 1.0, 1e-14);
    EXPECT_NEAR(by.second.norm(), 0.5, 1e-12);
    EXPECT_NEAR(by.third.norm(), 0.25, 1e-10);
    EXPECT_NEAR(by.first.dot(by.third), -0.25, 1e-10);
    EXPECT_NEAR(planar_curvature(path.at(s)), 0.5, 1e-12);
    EXPECT_NEAR(curvature(path.at(s)), 0.5, 1e-12);
    EXPECT_NEAR(std::remainder(travel_heading(path.at(s)) - s - 0.4 - 0.5 * std::numbers::pi,
                               2.0 * std::numbers::pi),
                0.0, 1e-13);
  }
}

// The derivatives by length do not depend on the parameter: q(s²+s) is the same curve as q(s).
TEST(Path, LengthKnowsNoParameter) {
  MatrixXd line(2, 3);  // q(t) = (t, t²)
  line << 0.0, 1.0, 0.0, 0.0, 0.0, 1.0;
  const Path plain = Path::join({{line, 1.0}}).value();
  MatrixXd twice(2, 5);  // t -> (t + t²)/2: the same parabola over t in [0, 1]
  twice << 0.0, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0, 0.25, 0.5, 0.25;
  const Path other = Path::join({{twice, 3.0}}).value();
  for (double t = 0.05; t < 1.0; t += 0.1) {
    const PathState a = by_arc_length(plain.at(0.5 * (t + t * t)));
    const PathState b = by_arc_length(other.at(3.0 * t));
    EXPECT_LT((a.first - b.first).norm(), 1e-13);
    EXPECT_LT((a.second - b.second).norm(), 1e-12);
    EXPECT_LT((a.third - b.third).norm(), 1e-11);
  }
  // asinh(2)/4 + √5/2 of the parabola
  const double length = 0.25 * std::asinh(2.0) + 0.5 * std::sqrt(5.0);
  EXPECT_NEAR(path_length(plain), length, 1e-14);
  EXPECT_NEAR(path_length(other), length, 1e-14);
}

// (t³, t²)'s cusp at 0: ∫ t √(9 t² + 4) dt from -1 to 1 is 2 (13√13 - 8)/27.
TEST(Path, LengthThroughACusp) {
  MatrixXd c(2, 4);  // t = 2 τ - 1
  c << -1.0, 6.0, -12.0, 8.0, 1.0, -4.0, 4.0, 0.0;
  const Path path = Path::join({{c, 1.0}}).value();
  EXPECT_NEAR(path_length(path), 2.0 * (13.0 * std::sqrt(13.0) - 8.0) / 27.0, 1e-13);
}

TEST(Path, LengthAndParameterAreInverse) {
  Random random(2);
  for (int k = 0; k < 20; ++k) {
    const Path path = natural_cubic_path(random_points(random, 2, 6)).value();
    const ArcLength map(path);
    EXPECT_NEAR(map.total(), path_length(path), 1e-13 * map.total());
    for (double share = 0.0; share <= 1.0; share += 0.0625) {
      const double s = map.parameter(share * map.total());
      EXPECT_NEAR(map.length(s), share * map.total(), 1e-12 * map.total());
      EXPECT_NEAR(path_length(path, 0.0, s), map.length(s), 1e-12 * map.total());
    }
    EXPECT_EQ(map.parameter(-1.0), 0.0);
    EXPECT_EQ(map.parameter(1e9), path.parameter_end());
    EXPECT_NEAR(path_length(path, 0.7, 0.2), -path_length(path, 0.2, 0.7), 1e-15);
  }
}

// Between two parameters each point of the curve is near the chord; a tenth of them would not do.
TEST(Path, ChordsAreNear) {
  Random random(3);
  const Path path = natural_cubic_path(random_points(random, 2, 6)).value();
  for (const double tolerance : {1e-2, 1e-4}) {
    const std::vector<double> at = chord_parameters(path, tolerance).value();
    double farthest = 0.0;
    for (std::size_t i = 0; i + 1 < at.size(); ++i) {
      ASSERT_LT(at[i], at[i + 1]);
      const Vector2d a = path.position(at[i]);
      const Vector2d chord = Vector2d(path.position(at[i + 1])) - a;
      for (int k = 1; k < 50; ++k) {
        const Vector2d to = Vector2d(path.position(at[i] + (at[i + 1] - at[i]) * k / 50.0)) - a;
        const double along = std::clamp(to.dot(chord) / chord.squaredNorm(), 0.0, 1.0);
        farthest = std::max(farthest, (to - along * chord).norm());
      }
    }
    EXPECT_LE(farthest, tolerance);
    EXPECT_GE(farthest, 0.2 * tolerance);
    for (const double s : path.breaks()) {
      EXPECT_NE(std::find(at.begin(), at.end(), s), at.end());
    }
  }
  EXPECT_EQ(chord_parameters(line_path(Vector2d(0.0, 0.0), Vector2d(3.0, 1.0)).value(), 1e-6)
                .value()
                .size(),
            2U);
}

TEST(Path, NeedsNoHeapToBeRead) {
  Random random(4);
  const Path path = bezier_path(random_points(random, 16, 6)).value();
  double sum = 0.0;
  const test::AllocationCounter allocations;
  for (double s = -0.1; s < 1.2; s += 0.01) {
    sum += path.at(s).third(0) + path.position(s)(15);
  }
  sum += path_length(path, 0.1, 0.9);
  EXPECT_EQ(allocations.count(), 0U);
  EXPECT_TRUE(std::isfinite(sum));
  EXPECT_EQ(path.piece_at(std::numeric_limits<double>::quiet_NaN()), 0U);
  EXPECT_EQ(path.at(-3.0).position, path.at(0.0).position);
}

TEST(Path, RefusesWhatIsNone) {
  const MatrixXd line = (MatrixXd(2, 2) << 0.0, 1.0, 0.0, 1.0).finished();
  const auto code = [](std::vector<PathPiece> pieces) {
    return Path::join(std::move(pieces)).error();
  };
  EXPECT_TRUE(code({}).is(ArgumentError::empty));
  EXPECT_TRUE(code({{MatrixXd::Zero(2, 3), 1.0}}).is(ArgumentError::out_of_range));
  EXPECT_TRUE(code({{line, 0.0}}).is(ArgumentError::not_positive));
  EXPECT_TRUE(code({{line, std::nan("")}}).is(ArgumentError::not_finite));
  EXPECT_TRUE(code({{line * std::nan(""), 1.0}}).is(ArgumentError::not_finite));
  EXPECT_TRUE(code({{MatrixXd::Ones(17, 2), 1.0}}).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(code({{MatrixXd::Ones(2, 22), 1.0}}).is(ArgumentError::out_of_range));
  EXPECT_TRUE(code({{line, 1.0}, {MatrixXd::Ones(3, 2), 1.0}}).is(ArgumentError::wrong_shape));
  EXPECT_EQ(to_string(code({{line, 1.0}, {line, 1.0}})),
            "Path::join: piece 2 is 1 away from the end of the one before it; it must be one that "
            "begins there; move its first point, or join them by a line");
}

}  // namespace
}  // namespace flyball::path_test
