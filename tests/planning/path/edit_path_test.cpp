#include <flyball/planning/path/edit_path.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/planning/path/build_path.hpp>

namespace flyball::edit_path_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;

Path random_path(Random& random, int count) {
  MatrixXd points(2, count);
  for (double& value : points.reshaped()) {
    value = random.uniform(-2.0, 2.0);
  }
  return natural_cubic_path(points).value();
}

TEST(EditPath, ReversedTwiceItIsItself) {
  Random random(1);
  const Path path = random_path(random, 5);
  const Path back = reversed(path);
  const Path again = reversed(back);
  const double end = path.parameter_end();
  for (double s = 0.0; s <= end; s += 0.05 * end) {
    EXPECT_LT((back.position(end - s) - path.position(s)).norm(), 1e-13);
    EXPECT_LT((back.at(end - s).first + path.at(s).first).norm(), 1e-12);
    EXPECT_LT((again.position(s) - path.position(s)).norm(), 1e-13);
  }
}

TEST(EditPath, PartsJoinToTheWhole) {
  Random random(2);
  const Path path = random_path(random, 5);
  const double end = path.parameter_end();
  const double middle = 0.37 * end;
  const Path whole = joined(std::vector<Path>{part_of(path, 0.0, middle).value(),
                                              part_of(path, middle, end).value()})
                         .value();
  EXPECT_NEAR(whole.parameter_end(), end, 1e-12);
  for (double s = 0.0; s <= end; s += 0.03 * end) {
    EXPECT_LT((whole.position(s) - path.position(s)).norm(), 1e-12);
    EXPECT_LT((whole.at(s).first - path.at(s).first).norm(), 1e-10);
  }
  EXPECT_TRUE(part_of(path, 1.0, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(part_of(path, -1.0, 1.0).error().is(ArgumentError::out_of_range));
}

// |q'| goes on where the direction does, whatever the parameters were.
TEST(EditPath, JoinedParametersAreStretched) {
  const Path first = line_path(Vector2d(0.0, 0.0), Vector2d(2.0, 0.0)).value();
  const Path second = line_path(Vector2d(2.0, 0.0), Vector2d(3.0, 0.0)).value();
  const Path both = joined(std::vector<Path>{first, second}).value();
  EXPECT_NEAR(both.parameter_end(), 1.5, 1e-15);
  EXPECT_NEAR(both.at(1.2).first.norm(), 2.0, 1e-14);
  EXPECT_TRUE(path_stops(both).empty());
  EXPECT_TRUE(joined(std::vector<Path>{second, second}).error().is(ArgumentError::out_of_range));
}

TEST(EditPath, TransformsAreOfSe2) {
  Random random(3);
  const Path path = random_path(random, 4);
  const Pose2d pose(1.0, -2.0, 0.8);
  const Path moved = transformed(path, pose).value();
  const Path back = relative_to(moved, pose).value();
  for (double s = 0.0; s < path.parameter_end(); s += 0.1) {
    EXPECT_LT((Vector2d(moved.position(s)) - pose * Vector2d(path.position(s))).norm(), 1e-13);
    EXPECT_LT((back.position(s) - path.position(s)).norm(), 1e-13);
  }
  EXPECT_NEAR(path_length(moved), path_length(path), 1e-12);
}

// At x = 8: (x, y) goes to (16 - x, y), a heading θ to π - θ, and curvature changes its sign.
TEST(EditPath, Mirrored) {
  Random random(4);
  const Path path =
      with_headings(random_path(random, 4), std::vector<PathHeading>{{0.0, 0.3}}).value();
  const Path other = mirrored(path, {8.0, 0.0}, 0.5 * std::numbers::pi).value();
  for (double s = 0.0; s < path.parameter_end(); s += 0.1) {
    const PathVector q = path.position(s);
    const PathVector m = other.position(s);
    EXPECT_NEAR(m(0), 16.0 - q(0), 1e-13);
    EXPECT_NEAR(m(1), q(1), 1e-13);
    EXPECT_NEAR(m(2), std::numbers::pi - q(2), 1e-13);
    EXPECT_NEAR(planar_curvature(other.at(s)), -planar_curvature(path.at(s)),
                1e-9 * (1.0 + std::abs(planar_curvature(path.at(s)))));
  }
}

// The shorter way, monotone between headings, at rest where it turns back.
TEST(EditPath, HeadingsAreMetWithoutOvershoot) {
  const Path line = line_path(Vector2d(0.0, 0.0), Vector2d(1.0, 0.0)).value();
  const std::vector<PathHeading> headings{{0.1, 3.0}, {0.4, -3.0}, {0.6, -2.0}, {0.9, 3.1}};
  const Path path = with_headings(line, headings).value();
  double before = 0.0;
  for (const PathHeading& heading : headings) {
    EXPECT_NEAR(std::remainder(path.position(heading.parameter)(2) - heading.heading,
                               2.0 * std::numbers::pi),
                0.0, 1e-13);
  }
  EXPECT_EQ(path.position(0.0)(2), 3.0);
  for (double s = 0.0; s < 0.6; s += 0.01) {
    EXPECT_GE(path.position(s)(2), before - 1e-12);
    before = path.position(s)(2);
  }
  EXPECT_NEAR(path.position(0.4)(2), 2.0 * std::numbers::pi - 3.0, 1e-13);
  EXPECT_NEAR(path.at(0.6).first(2), 0.0, 1e-12);
  EXPECT_TRUE(with_headings(line, std::vector<PathHeading>{{0.5, 0.0}, {0.5, 1.0}})
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(with_headings(line, {}).error().is(ArgumentError::empty));
}

TEST(EditPath, CornersAndCusps) {
  const Path there = line_path(Vector2d(0.0, 0.0), Vector2d(1.0, 0.0)).value();
  const Path up = line_path(Vector2d(1.0, 0.0), Vector2d(1.0, 1.0)).value();
  const auto corner = path_stops(joined(std::vector<Path>{there, up}).value());
  ASSERT_EQ(corner.size(), 1U);
  EXPECT_EQ(corner[0].kind, PathBreak::corner);
  const auto back = path_stops(joined(std::vector<Path>{there, reversed(there)}).value());
  ASSERT_EQ(back.size(), 1U);
  EXPECT_EQ(back[0].kind, PathBreak::cusp);
  EXPECT_NEAR(back[0].parameter, 1.0, 1e-15);
  MatrixXd c(2, 4);  // (t³, t²), t = 2 τ - 1
  c << -1.0, 6.0, -12.0, 8.0, 1.0, -4.0, 4.0, 0.0;
  const auto inside = path_stops(Path::join({{c, 1.0}}).value());
  ASSERT_EQ(inside.size(), 1U);
  EXPECT_EQ(inside[0].kind, PathBreak::cusp);
  EXPECT_NEAR(inside[0].parameter, 0.5, 1e-8);
  Random random(5);
  EXPECT_TRUE(path_stops(random_path(random, 6)).empty());
}

}  // namespace
}  // namespace flyball::edit_path_test
