#include <flyball/control/implicit_model_following.hpp>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "control/appendix_b_plant.hpp"

namespace flyball::implicit_model_following_test {
namespace {

using namespace flyball::literals;

using test::appendix_b_plant;

Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

Eigen::MatrixXd scalar(double value) {
  return Eigen::MatrixXd::Constant(1, 1, value);
}

// Reference data for Theorem B.3.1 (SciPy 1.10.1).
TEST(ImplicitModel, IsTheBooksExample) {
  Eigen::Matrix2d A_ref;
  A_ref << 1.0, 0.1, 0.0, 0.8;
  const Eigen::Matrix2d Q = Eigen::Vector2d(1.0, 2.0).asDiagonal();
  const auto model = implicit_model_following(appendix_b_plant().A, appendix_b_plant().B,
                                              Eigen::Matrix2d::Identity(), A_ref,
                                              appendix_b_plant().B, Q, scalar(0.5))
                         .value();
  EXPECT_NEAR(model.cost.Q(1, 1), 0.045, 1e-15);
  EXPECT_NEAR(model.cost.R(0, 0), 0.520025, 1e-15);
  EXPECT_NEAR(model.cost.N(1, 0), 0.03, 1e-15);
  EXPECT_NEAR(model.K(0, 0), 0.0, 1e-12);
  EXPECT_NEAR(model.K(0, 1), 0.1256101785074124, 1e-10);
  EXPECT_NEAR(model.K_u(0, 0), 1.0, 1e-14);
}

// With an input a state and nothing to pay for it, A - BK is A_ref and B K_u is B_ref.
TEST(ImplicitModel, IsExactWhereItCanBe) {
  Random random(2);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Index n = 1 + trial % 4;
    const Eigen::MatrixXd A = random_matrix(random, n, n);
    const Eigen::MatrixXd B = random_matrix(random, n, n) + 4.0 * Eigen::MatrixXd::Identity(n, n);
    Eigen::MatrixXd A_ref = random_matrix(random, n, n);
    A_ref *= 0.8 / A_ref.norm();
    const Eigen::MatrixXd B_ref = random_matrix(random, n, 2);
    const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(n, n);
    const auto model = implicit_model_following(A, B, I, A_ref, B_ref, I, 1e-12 * I);
    ASSERT_TRUE(model.has_value()) << to_string(model.error());
    ASSERT_LT((A - B * model->K - A_ref).norm(), 1e-8);
    ASSERT_LT(model->mismatch, 1e-8);
    ASSERT_LT((B * model->K_u - B_ref).norm(), 1e-11 * B_ref.norm() * B.norm());
  }
}

TEST(ImplicitModel, Errors) {
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(2, 2);
  const Eigen::MatrixXd B = Eigen::Vector2d(0.0, 1.0);
  EXPECT_TRUE(implicit_model_cost(I, B, I, Eigen::MatrixXd::Ones(1, 1), I, scalar(1.0))
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      implicit_model_following(I, B, I, 0.5 * I, Eigen::MatrixXd::Ones(3, 1), I, scalar(1.0))
          .error()
          .is(ArgumentError::wrong_shape));
  const auto Q = implicit_model_cost(I, B, I, I, scalar(1.0), scalar(1.0));
  EXPECT_EQ(to_string(Q.error()),
            "implicit_model_cost: Q is 1x1; it must be outputs x outputs (2x2)");
  auto slower = appendix_b_plant();
  slower.period = 0.2_s;
  EXPECT_TRUE(implicit_model_following(appendix_b_plant(), slower, I, scalar(1.0))
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      implicit_model_following(appendix_b_plant(), appendix_b_plant(), I, scalar(1.0)).has_value());
}

}  // namespace
}  // namespace flyball::implicit_model_following_test
