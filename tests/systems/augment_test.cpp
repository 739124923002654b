#include <flyball/systems/augment.hpp>

#include <cmath>

#include <gtest/gtest.h>

namespace flyball::augment_test {
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

ContinuousSystem<> dynamic_cart() {
  const auto plant = cart();
  return {plant.A, plant.B, plant.C, plant.D};
}

// 6.7.1's blocks, with D in what is integrated.
TEST(Augment, Integral) {
  const auto augmented = augment_integral(dynamic_cart()).value();
  Eigen::Matrix3d A;
  A << 0.0, 1.0, 0.0, 0.0, -3.0, 0.0, -1.0, 0.0, 0.0;
  EXPECT_EQ(augmented.A, Eigen::MatrixXd(A));
  EXPECT_EQ(augmented.B, Eigen::MatrixXd(Eigen::Vector3d(0.0, 2.0, -0.5)));
  EXPECT_EQ(augmented.C, Eigen::MatrixXd(Eigen::RowVector3d(1.0, 0.0, 0.0)));
  const auto reference = augment_integral_reference(dynamic_cart()).value();
  EXPECT_EQ(reference.B.rightCols(1), Eigen::MatrixXd(Eigen::Vector3d(0.0, 0.0, 1.0)));
  EXPECT_EQ(reference.D, Eigen::MatrixXd(Eigen::RowVector2d(0.5, 0.0)));
  EXPECT_EQ(
      augment_gain(Eigen::RowVector2d(1.0, 2.0), Eigen::MatrixXd::Constant(1, 1, 3.0)).value(),
      Eigen::MatrixXd(Eigen::RowVector3d(1.0, 2.0, 3.0)));
}

// augment_input_error is the bias that acts as the input does.
TEST(Augment, Bias) {
  const auto plant = dynamic_cart();
  const auto bias = augment_bias(plant, plant.B, Eigen::MatrixXd::Zero(1, 1)).value();
  const auto error = augment_input_error(plant).value();
  EXPECT_EQ(bias.A, error.A);
  EXPECT_EQ(bias.B, error.B);
  EXPECT_EQ(bias.C, error.C);
  const DiscreteSystem<> sampled{plant.A, plant.B, plant.C, plant.D, Time(0.1)};
  const auto offset =
      augment_bias(sampled, Eigen::MatrixXd::Zero(2, 1), Eigen::MatrixXd::Ones(1, 1)).value();
  EXPECT_EQ(offset.A(2, 2), 1.0);
  EXPECT_EQ(offset.C(0, 2), 1.0);
  EXPECT_EQ(offset.period.si(), 0.1);
}

TEST(Augment, Output) {
  const auto plant = dynamic_cart();
  const Eigen::MatrixXd K = Eigen::RowVector2d(4.0, 5.0);
  const auto shown = augment_output(plant, -K, Eigen::MatrixXd::Zero(1, 1)).value();
  EXPECT_EQ(shown.C.row(0), Eigen::MatrixXd(plant.C));
  EXPECT_EQ(shown.C.row(1), Eigen::MatrixXd(-K));
  EXPECT_EQ(shown.D, Eigen::MatrixXd(Eigen::Vector2d(0.5, 0.0)));
  const DiscreteSystem<> sampled{plant.A, plant.B, plant.C, plant.D, Time(0.1)};
  EXPECT_EQ(augment_output(sampled, -K, Eigen::MatrixXd::Zero(1, 1))->C, shown.C);
}

TEST(Augment, Errors) {
  const auto plant = dynamic_cart();
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  EXPECT_TRUE(augment_bias(plant, one, one).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(augment_bias(plant, plant.B, plant.B).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(augment_bias(plant, NAN * plant.B, one).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(augment_output(plant, one, one).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(augment_output(plant, plant.C, plant.C).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(augment_gain(one, plant.B).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(augment_integral({}).error().is(ArgumentError::empty));
  EXPECT_TRUE(augment_integral_reference({}).error().is(ArgumentError::empty));
}

}  // namespace
}  // namespace flyball::augment_test
