#include <gtest/gtest.h>

#include "geometry/groups.hpp"

namespace flyball::groups_test {
namespace {

constexpr double pi = std::numbers::pi;

// book_reference.json, thm_10.2.1_pose_exp, made in 40 digits.
TEST(SE2, PoseExponentialOfTheBook) {
  struct Row {
    double theta;
    Eigen::Vector3d twist;
    Eigen::Vector3d delta;
  };
  const Row rows[] = {
      {0.0, {1.0, 0.0, pi / 2}, {0.6366197723675814, 0.6366197723675813, pi / 2}},
      {0.5, {0.3, 0.1, 0.2}, {0.19081803564728994, 0.25150663622557046, 0.2}},
      {-1.0, {0.05, 0.0, 1e-12}, {0.027015115293428024, -0.04207354924038132, 1e-12}},
      {0.0, {5.0, 0.0, 0.0}, {5.0, 0.0, 0.0}},
      {pi / 2, {3.9269908169872414, 0.0, pi / 2}, {-2.5, 2.5, pi / 2}},
  };
  for (const Row& row : rows) {
    const Pose2d start(10.0, -20.0, row.theta);
    const Pose2d end = start.plus(row.twist);
    EXPECT_NEAR(end.x() - 10.0, row.delta(0), 1e-14);
    EXPECT_NEAR(end.y() + 20.0, row.delta(1), 1e-14);
    EXPECT_NEAR(end.rotation().between(start.rotation()).angle(), -row.delta(2), 1e-15);
  }
}

// A quarter of a circle of radius 1 to the left ends at (1, 1), facing left.
TEST(SE2, QuarterCircle) {
  const Pose2d end = Pose2d::exp({pi / 2, 0.0, pi / 2});
  EXPECT_NEAR(end.x(), 1.0, 1e-15);
  EXPECT_NEAR(end.y(), 1.0, 1e-15);
  EXPECT_NEAR(end.angle(), pi / 2, 1e-15);
}

TEST(SO2, AnglesAreWrapped) {
  for (const double angle : {-30.0, -4.0, -3.0, 0.0, 1e-300, 3.0, 3.5, 100.0}) {
    const double wrapped = Rotation2d(angle).angle();
    EXPECT_NEAR(wrapped, std::remainder(angle, 2 * pi), 1e-14) << angle;
    EXPECT_LE(std::abs(wrapped), pi);
  }
  EXPECT_NEAR(Rotation2d(3.0).minus(Rotation2d(-3.0))(0), 6.0 - 2 * pi, 1e-15);
  EXPECT_NEAR(Rotation2d::from_direction(-3.0, -3.0).angle(), -0.75 * pi, 1e-15);
  EXPECT_EQ(Rotation2d::from_direction(0.0, 0.0).angle(), 0.0);
}

// A third of a turn about (1, 1, 1) takes x to y, y to z, z to x.
TEST(SO3, AboutTheDiagonal) {
  const Rotation3d R = Rotation3d::exp(Eigen::Vector3d::Ones() * (2 * pi / 3 / std::sqrt(3.0)));
  EXPECT_LE((R * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-15);
  EXPECT_LE((R * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitZ()).norm(), 1e-15);
  EXPECT_LE((R.quaternion() - Eigen::Vector4d::Constant(0.5)).norm(), 1e-15);
}

TEST(SO3, OfQuaternionsOfAnyLength) {
  Random random(1);
  for (const double length : {1e-320, 1e-300, 1e-160, 1.0, 1e160, 1e308}) {
    const Rotation3d R = test::random_element<Rotation3d>(random);
    const Eigen::Vector4d q = R.quaternion() * length;
    const Rotation3d back = rotation_from_quaternion(q(0), q(1), q(2), q(3)).value();
    EXPECT_NEAR(back.quaternion().norm(), 1.0, 1e-15);
    EXPECT_LE(test::distance(back, R), length < 1e-300 ? 1e-3 : 1e-15) << length;
    const Rotation3d other = rotation_from_quaternion(-q(0), -q(1), -q(2), -q(3)).value();
    EXPECT_LE(test::distance(back, other), 1e-15);
  }
  EXPECT_EQ(to_string(rotation_from_quaternion(0.0, 0.0, 0.0, 0.0).error()),
            "rotation_from_quaternion: (w, x, y, z) is zero; it must be a quaternion of some "
            "length; (1, 0, 0, 0) does not turn");
  EXPECT_TRUE(rotation_from_quaternion(1.0, NAN, 0.0, 0.0).error().is(ArgumentError::not_finite));
}

TEST(SO3, OfMatrices) {
  Random random(2);
  for (int trial = 0; trial < 200; ++trial) {
    // Half turns too, where w vanishes and each of x, y, z may be largest.
    const double angle = trial % 2 == 0 ? pi : random.uniform(0.0, pi);
    const Rotation3d R = Rotation3d::exp(test::random_tangent<Rotation3d>(random, 0.0, angle));
    EXPECT_LE(test::distance(rotation_from_matrix(R.matrix()).value(), R), 4e-15);
    // What is stretched by up to 6e-7 has the nearest rotation of it, to the square of that.
    const Eigen::Matrix3d S =
        Eigen::Matrix3d::NullaryExpr([&] { return random.uniform(-1.0, 1.0); });
    const Eigen::Matrix3d stretched =
        R.matrix() * (Eigen::Matrix3d::Identity() + 1e-7 * (S + S.transpose()));
    EXPECT_LE(test::distance(rotation_from_matrix(stretched).value(), R), 4e-13);
  }
  EXPECT_EQ(to_string(rotation_from_matrix(-Eigen::Matrix3d::Identity()).error()),
            "rotation_from_matrix: R is a reflection; it must be a rotation: RᵀR = I to 1e-6 and "
            "det R = 1");
  EXPECT_EQ(to_string(rotation_from_matrix(2.0 * Eigen::Matrix3d::Identity()).error()),
            "rotation_from_matrix: R is off by 3 in RᵀR - I; it must be a rotation: RᵀR = I to "
            "1e-6 and det R = 1");
  EXPECT_FALSE(rotation_from_matrix(Eigen::Matrix3d::Constant(NAN)));
}

// In the plane x-y the poses of space are those of the plane.
TEST(SE3, ContainsThePlane) {
  Random random(3);
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::Vector3d tau = test::random_tangent<Pose2d>(random);
    const Pose2d plane = Pose2d::exp(tau);
    Pose3d::Tangent twist;
    twist << tau(0), tau(1), 0.0, 0.0, 0.0, tau(2);
    const Pose3d space = Pose3d::exp(twist);
    EXPECT_LE((space.translation() - Eigen::Vector3d(plane.x(), plane.y(), 0.0)).norm(), 1e-14);
    EXPECT_LE((space.log() - twist).norm(), 1e-13);
    const Eigen::Matrix3d J = Pose2d::left_jacobian(tau);
    const auto K = Pose3d::left_jacobian(twist);
    for (const auto& [i, k] : {std::pair{0, 0}, {1, 1}, {2, 5}}) {
      for (const auto& [j, l] : {std::pair{0, 0}, {1, 1}, {2, 5}}) {
        EXPECT_NEAR(J(i, j), K(k, l), 1e-14);
      }
    }
  }
}

TEST(Bundle, PartsAndOffsets) {
  using State = Bundle<Pose2d, Eigen::Vector2d, Rotation3d>;
  static_assert(State::tangent_size == 8);
  static_assert(State::offset<0> == 0 && State::offset<1> == 3 && State::offset<2> == 5);
  State x(Pose2d(1.0, 2.0, 3.0), Eigen::Vector2d(4.0, 5.0), Rotation3d());
  EXPECT_EQ(x.get<0>().y(), 2.0);
  x.get<1>()(0) = 6.0;
  const State y = x.plus(State::Tangent::Unit(3));
  EXPECT_EQ(y.get<1>(), Eigen::Vector2d(7.0, 5.0));
  EXPECT_EQ(y.minus(x), State::Tangent::Unit(3));
}

// Non-finite input gives non-finite output, and returns.
TEST(Groups, NotANumberStaysOne) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(Pose2d::exp({nan, 0.0, 0.0}).translation().allFinite());
  EXPECT_FALSE(std::isfinite(Pose2d::exp({0.0, 0.0, nan}).angle()));
  EXPECT_FALSE(Rotation3d::exp({nan, 0.0, 0.0}).log().allFinite());
  EXPECT_FALSE(Pose3d::exp(Pose3d::Tangent::Constant(nan)).log().allFinite());
}

}  // namespace
}  // namespace flyball::groups_test
