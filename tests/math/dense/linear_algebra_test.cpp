#include <flyball/math/dense/linear_algebra.hpp>

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

namespace flyball::linear_algebra_test {
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

// Table 5.2 is Table 5.1: the sign of xᵀMx over directions is what the eigenvalues say. Of a matrix
// V diag(λ) Vᵀ the columns of V reach the extremes λ, any x stays between them.
TEST(Definiteness, SignsOfTheQuadraticForm) {
  Random random(9);
  for (int trial = 0; trial < 500; ++trial) {
    const Index n = 2 + trial % 4;
    const Eigen::HouseholderQR<MatrixXd> qr(random_matrix(random, n, n));
    const MatrixXd V = qr.householderQ();
    const double shift = trial % 3 - 1.0;  // all negative, either sign, all positive
    const Eigen::VectorXd lambda = Eigen::VectorXd::NullaryExpr(n, [&] {
      const double size = random.uniform(0.1, 1.0);
      return shift == 0.0 ? size : shift * size;
    });
    Eigen::VectorXd signed_lambda = lambda;
    if (shift == 0.0) {
      signed_lambda(0) = -lambda(0);
    }
    const MatrixXd M = V * signed_lambda.asDiagonal() * V.transpose();
    double least = 1.0;
    double most = -1.0;
    for (int direction = 0; direction < 20; ++direction) {
      const Eigen::VectorXd x =
          direction < n ? Eigen::VectorXd(V.col(direction)) : random_matrix(random, n, 1).col(0);
      const double form = x.dot(M * x) / x.squaredNorm();
      least = std::min(least, form);
      most = std::max(most, form);
    }
    const auto found = test_definiteness(0.5 * (M + M.transpose())).value();
    EXPECT_NEAR(least, found.eigenvalues(0), 1e-14);
    EXPECT_NEAR(most, found.eigenvalues(n - 1), 1e-14);
    EXPECT_EQ(found.definiteness, least > 0.0  ? Definiteness::positive_definite
                                  : most < 0.0 ? Definiteness::negative_definite
                                               : Definiteness::indefinite);
  }
}

// The operators of 5.4 to 5.9 in Eigen's words, and the laws that later chapters use.
TEST(LinearAlgebra, TheBooksOperators) {
  Random random(59);
  for (int trial = 0; trial < 100; ++trial) {
    const MatrixXd A = random_matrix(random, 4, 3);
    const MatrixXd B = random_matrix(random, 3, 4);
    const MatrixXd M = random_matrix(random, 3, 3);
    const MatrixXd N = random_matrix(random, 3, 3);
    EXPECT_LT(((A * B).transpose() - B.transpose() * A.transpose()).norm(), 1e-14);
    EXPECT_NEAR((A * B).trace(), (B * A).trace(), 1e-13);
    EXPECT_NEAR((M * N).determinant(), M.determinant() * N.determinant(), 1e-13);
    EXPECT_LT((M * M.partialPivLu().solve(N) - N).norm(), 1e-11);
    // B⁺ = (BᵀB)⁻¹Bᵀ where the columns are independent.
    const MatrixXd normal = (A.transpose() * A).ldlt().solve(A.transpose());
    EXPECT_LT((pseudoinverse(A).value().X - normal).norm(), 1e-11 * normal.squaredNorm());
    // The trace is the sum of the eigenvalues, the determinant their product (5.8).
    const Eigen::VectorXcd eigenvalues = M.eigenvalues();
    EXPECT_LT(std::abs(eigenvalues.sum() - M.trace()), 1e-13);
    EXPECT_LT(std::abs(eigenvalues.prod() - M.determinant()), 1e-13);
    // The null space of a wide matrix is what its pseudoinverse leaves (5.6, 5.7).
    const MatrixXd null = MatrixXd::Identity(4, 4) - pseudoinverse(B).value().X * B;
    EXPECT_LT((B * null).norm(), 1e-13);
    EXPECT_NEAR(null.trace(), 1.0, 1e-13);
  }
  MatrixXd diagonal(3, 3);
  diagonal << 1, 0, 0, 0, 0.25, 0, 0, 0, 0.0625;
  const Eigen::Vector3d x(1.0, 2.0, 4.0);
  EXPECT_EQ(MatrixXd(x.array().square().inverse().matrix().asDiagonal()), diagonal);
  // diag(A, B) of 5.9.2.
  MatrixXd A(2, 2);
  A << 1, 2, 3, 4;
  MatrixXd B(3, 3);
  B << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  MatrixXd whole(5, 5);
  whole << 1, 2, 0, 0, 0, 3, 4, 0, 0, 0, 0, 0, 1, 2, 3, 0, 0, 4, 5, 6, 0, 0, 7, 8, 9;
  EXPECT_EQ(block_diagonal({A, B}), whole);
}

// Snippets 6.1 and 6.2: one matrix of four blocks, in a row of commas and slice by slice.
TEST(LinearAlgebra, TheBooksBlocks) {
  const Eigen::Matrix2d A{{1, 2}, {3, 4}};
  const Eigen::Vector2d B(5, 6);
  const Eigen::RowVector2d C(7, 8);
  const Eigen::Matrix<double, 1, 1> D(9);
  MatrixXd packed(3, 3);
  packed << A, B, C, D;
  MatrixXd sliced(3, 3);
  sliced.topLeftCorner(2, 2) = A;
  sliced.topRightCorner(2, 1) = B;
  sliced.bottomLeftCorner(1, 2) = C;
  sliced.bottomRightCorner(1, 1) = D;
  EXPECT_EQ(packed, (MatrixXd(3, 3) << 1, 2, 5, 3, 4, 6, 7, 8, 9).finished());
  EXPECT_EQ(sliced, packed);
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
}  // namespace flyball::linear_algebra_test
