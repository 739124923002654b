#include <flyball/math/dense/linear_algebra.hpp>

#include <cmath>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

namespace flyball {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd random_matrix(Random& random, Index rows, Index columns) {
  return MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

// A column's is its transpose over its squared length; zero's is zero.
TEST(Pseudoinverse, ClosedForms) {
  const auto column = pseudoinverse(Eigen::Vector2d(3.0, 4.0)).value();
  EXPECT_LT((column.X - Eigen::RowVector2d(0.12, 0.16)).norm(), 1e-16);
  EXPECT_EQ(column.rank, 1);
  EXPECT_NEAR(column.singular_values(0), 5.0, 1e-15);
  const auto zero = pseudoinverse(MatrixXd::Zero(2, 3)).value();
  EXPECT_EQ(zero.X, MatrixXd::Zero(3, 2));
  EXPECT_EQ(zero.rank, 0);
}

// Penrose's four conditions, at full and lower rank.
TEST(Pseudoinverse, Penrose) {
  Random random(7);
  for (int trial = 0; trial < 1000; ++trial) {
    const Index m = 1 + trial % 5;
    const Index n = 1 + trial % 4;
    const Index r = 1 + trial % std::min(m, n);
    const MatrixXd A = random_matrix(random, m, r) * random_matrix(random, r, n);
    const auto result = pseudoinverse(A).value();
    ASSERT_EQ(result.rank, r);
    const MatrixXd& X = result.X;
    const double tolerance = 1e-11 * (1.0 + A.norm() * X.norm()) * (1.0 + X.norm());
    EXPECT_LT((A * X * A - A).norm(), tolerance);
    EXPECT_LT((X * A * X - X).norm(), tolerance * (1.0 + X.norm()));
    EXPECT_LT((A * X - (A * X).transpose()).norm(), tolerance);
    EXPECT_LT((X * A - (X * A).transpose()).norm(), tolerance);
  }
}

// [1 1; 1 1 + δ]⁻¹ = [1 + δ, -1; -1, 1]/δ, exact for δ = 2⁻³⁰; with its columns and rows in other
// units, and at the ends of the doubles' range.
TEST(Pseudoinverse, KeepsDigitsInAnyUnits) {
  const double d = std::ldexp(1.0, -30);
  MatrixXd A(2, 2);
  A << 1.0, 1.0, 1.0, 1.0 + d;
  MatrixXd inverse(2, 2);
  inverse << (1.0 + d) / d, -1.0 / d, -1.0 / d, 1.0 / d;
  for (const int power : {0, 8, 900, -900}) {
    const double f = std::ldexp(1.0, power);
    const MatrixXd X = pseudoinverse(A * f).value().X;
    EXPECT_LT((X * f - inverse).cwiseAbs().maxCoeff(), 1e-15 / d) << power;
  }
  // Of four equations in two unknowns, of which one is in units of 1e8: AᵀA X = Aᵀ row by row.
  MatrixXd tall(4, 2);
  tall << 1.0, 1e8, 2.0, -1e8, 0.0, 3e8, 1.0, 0.0;
  const MatrixXd unscaled = tall * Eigen::Vector2d(1.0, 1e-8).asDiagonal();
  const MatrixXd expected = Eigen::Vector2d(1.0, 1e-8).asDiagonal() *
                            (unscaled.transpose() * unscaled).inverse() * unscaled.transpose();
  const MatrixXd X = pseudoinverse(tall).value().X;
  for (Index i = 0; i < 2; ++i) {
    EXPECT_LT((X.row(i) - expected.row(i)).norm(), 1e-14 * expected.row(i).norm());
  }
  const MatrixXd large = Eigen::Vector2d(2.0, 1.6e308);
  EXPECT_NEAR(pseudoinverse(large).value().X(0, 1) * 1.6e308, 1.0, 1e-15);
  EXPECT_TRUE(
      pseudoinverse(MatrixXd::Constant(1, 1, 1e-310)).error().is(ArgumentError::out_of_range));
}

TEST(Definiteness, Kinds) {
  const auto kind = [](double a, double b) {
    MatrixXd S(2, 2);
    // Eigenvalues a, b along (1, 1) and (1, -1).
    S << a + b, a - b, a - b, a + b;
    return test_definiteness(0.5 * S).value().definiteness;
  };
  EXPECT_EQ(kind(1.0, 2.0), Definiteness::positive_definite);
  EXPECT_EQ(kind(1.0, 0.0), Definiteness::positive_semidefinite);
  EXPECT_EQ(kind(-1.0, -2.0), Definiteness::negative_definite);
  EXPECT_EQ(kind(-1.0, 0.0), Definiteness::negative_semidefinite);
  EXPECT_EQ(kind(-1.0, 2.0), Definiteness::indefinite);
  EXPECT_EQ(kind(0.0, 0.0), Definiteness::zero);
  EXPECT_EQ(to_string(Definiteness::positive_semidefinite), "positive semidefinite");
}

// G Gᵀ is semidefinite, definite with a shift, and Cholesky agrees whatever the units.
TEST(Definiteness, Products) {
  Random random(8);
  for (int trial = 0; trial < 1000; ++trial) {
    const Index n = 2 + trial % 5;
    const MatrixXd G = random_matrix(random, n, n - 1);
    const MatrixXd S = G * G.transpose();
    EXPECT_EQ(test_definiteness(0.5 * (S + S.transpose())).value().definiteness,
              Definiteness::positive_semidefinite);
    const MatrixXd P = 0.5 * (S + S.transpose()) + 0.1 * MatrixXd::Identity(n, n);
    EXPECT_EQ(test_definiteness(P).value().definiteness, Definiteness::positive_definite);
    const Eigen::VectorXd d =
        Eigen::VectorXd::NullaryExpr(n, [&] { return std::pow(10.0, random.uniform(-8, 8)); });
    MatrixXd scaled = d.asDiagonal() * P * d.asDiagonal();
    scaled = (0.5 * (scaled + scaled.transpose())).eval();
    EXPECT_TRUE(is_positive_definite(scaled).value());
    EXPECT_FALSE(is_positive_definite(P - (P.norm() + 1.0) * MatrixXd::Identity(n, n)).value());
  }
}

TEST(BlockDiagonal, Places) {
  const MatrixXd whole =
      block_diagonal({MatrixXd::Ones(1, 2), MatrixXd(0, 1), MatrixXd::Constant(2, 1, 3.0)});
  MatrixXd expected(3, 4);
  expected << 1, 1, 0, 0, 0, 0, 0, 3, 0, 0, 0, 3;
  EXPECT_EQ(whole, expected);
  EXPECT_EQ(block_diagonal({}).size(), 0);
}

TEST(LinearAlgebra, Errors) {
  const MatrixXd I = MatrixXd::Identity(2, 2);
  EXPECT_TRUE(pseudoinverse(MatrixXd()).error().is(ArgumentError::empty));
  EXPECT_TRUE(pseudoinverse(NAN * I).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(pseudoinverse(I, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(pseudoinverse(I, -1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(test_definiteness(MatrixXd::Ones(1, 2)).error().is(ArgumentError::wrong_shape));
  MatrixXd skew = I;
  skew(0, 1) = 1.0;
  EXPECT_TRUE(test_definiteness(skew).error().is(ArgumentError::not_symmetric));
  EXPECT_TRUE(is_positive_definite(skew).error().is(ArgumentError::not_symmetric));
  EXPECT_TRUE(is_positive_definite(MatrixXd()).error().is(ArgumentError::empty));
}

}  // namespace
}  // namespace flyball
