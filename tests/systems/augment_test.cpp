#include <flyball/systems/augment.hpp>

#include <cmath>

#include <gtest/gtest.h>

namespace flyball {
namespace {

ContinuousSystem<2, 1, 1> cart() {
  ContinuousSystem<2, 1, 1> plant;
  plant.A << 0.0, 1.0, 0.0, -3.0;
  plant.B << 0.0, 2.0;
  plant.C << 1.0, 0.0;
  plant.D << 0.5;
  return plant;
}

// A_aug = [A B; 0 0], B_aug = [B; 0], C_aug = [C 0].
TEST(AugmentInputError, IsTheBooksBlocks) {
  const auto augmented = augment_input_error(cart()).value();
  static_assert(std::is_same_v<decltype(augmented), const ContinuousSystem<3, 1, 1>>);
  Eigen::Matrix3d A;
  A << 0.0, 1.0, 0.0, 0.0, -3.0, 2.0, 0.0, 0.0, 0.0;
  EXPECT_EQ(augmented.A, A);
  EXPECT_EQ(augmented.B, Eigen::Vector3d(0.0, 2.0, 0.0));
  EXPECT_EQ(augmented.C, Eigen::RowVector3d(1.0, 0.0, 0.0));
  EXPECT_EQ(augmented.D(0, 0), 0.5);
}

TEST(AugmentInputError, FixedIsDynamic) {
  const auto plant = cart();
  const auto fixed = augment_input_error(plant).value();
  const auto dynamic =
      augment_input_error(ContinuousSystem<>{plant.A, plant.B, plant.C, plant.D}).value();
  EXPECT_EQ(dynamic.A, Eigen::MatrixXd(fixed.A));
  EXPECT_EQ(dynamic.B, Eigen::MatrixXd(fixed.B));
  EXPECT_EQ(dynamic.C, Eigen::MatrixXd(fixed.C));
}

// K_aug = [K I]
TEST(AugmentInputError, Gain) {
  const Eigen::RowVector2d K(3.0, 4.0);
  const Eigen::RowVector3d augmented = augment_gain_input_error<1, 2>(K);
  EXPECT_EQ(augmented, Eigen::RowVector3d(3.0, 4.0, 1.0));
}

TEST(AugmentInputError, Errors) {
  auto plant = cart();
  plant.A(0, 0) = std::nan("");
  EXPECT_TRUE(augment_input_error(plant).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(augment_input_error(ContinuousSystem<>{}).error().is(ArgumentError::empty));
}

}  // namespace
}  // namespace flyball
