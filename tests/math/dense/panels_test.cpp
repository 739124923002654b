#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "math/dense/panels.hpp"

namespace flyball::detail::panels_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd normal(Random& random, Index rows, Index columns) {
  MatrixXd M(rows, columns);
  for (Index i = 0; i < M.size(); ++i) {
    M(i) = random.normal();
  }
  return M;
}

// Every remainder of rows and columns beside whole tiles, inside larger matrices.
TEST(Panels, ProductsAndFactors) {
  Random random(1);
  for (Index n = 1; n <= 30; ++n) {
    const Index rows = 1 + (7 * n) % 29;
    const MatrixXd A = normal(random, rows, n);
    const MatrixXd B = normal(random, n, n);
    MatrixXd around = normal(random, rows + 2, n + 3);
    const MatrixXd before = around;
    add_product(2.0, A, B, around.block(1, 2, rows, n));
    MatrixXd expected = before;
    expected.block(1, 2, rows, n) += 2.0 * A * B;
    EXPECT_LT((around - expected).norm(), 1e-13 * expected.norm()) << n;
    add_product_transposed(-1.0, A, B, around.block(1, 2, rows, n));
    expected.block(1, 2, rows, n) -= A * B.transpose();
    EXPECT_LT((around - expected).norm(), 1e-13 * expected.norm()) << n;

    const MatrixXd S = B * B.transpose() + MatrixXd::Identity(n, n);
    MatrixXd L = S;
    ASSERT_TRUE(cholesky_in_place(L));
    const MatrixXd lower = L.triangularView<Eigen::Lower>();
    EXPECT_LT((lower * lower.transpose() - S).norm(), 1e-13 * S.norm()) << n;
    MatrixXd X = A;
    divide_by_transposed_triangle(X, L);
    EXPECT_LT((X * lower.transpose() - A).norm(), 1e-12 * A.norm()) << n;
    X = A;
    divide_by_triangle(X, L);
    EXPECT_LT((X * lower - A).norm(), 1e-12 * A.norm()) << n;
  }
  MatrixXd indefinite = -MatrixXd::Identity(3, 3);
  EXPECT_FALSE(cholesky_in_place(indefinite));
}

// S V = V Λ with orthonormal V: random, of low rank, with equal values, diagonal, zero.
TEST(Panels, LeadingModes) {
  Random random(2);
  for (int trial = 0; trial < 60; ++trial) {
    const Index n = 1 + trial % 30;
    MatrixXd S = normal(random, n, n);
    S = MatrixXd(S + S.transpose());
    if (trial % 5 == 1) {
      const MatrixXd half = normal(random, n, 2);
      S = half * half.transpose();
    } else if (trial % 5 == 2) {
      S.setIdentity();
      S(0, 0) = 3.0;
    } else if (trial % 5 == 3) {
      S = MatrixXd(S.diagonal().asDiagonal());
    } else if (trial == 4) {
      S.setZero();
    }
    const Index count = std::min<Index>(n, 5);
    const LeadingModes modes = leading_modes_of(S, count);
    const MatrixXd& V = modes.vectors;
    const double size = S.norm() + 1e-300;
    EXPECT_LT((S * V - V * modes.values.head(count).asDiagonal()).norm(), 1e-12 * size) << trial;
    EXPECT_LT((V.transpose() * V - MatrixXd::Identity(count, count)).norm(), 1e-11) << trial;
    EXPECT_NEAR(modes.values.sum(), S.trace(), 1e-12 * size * static_cast<double>(n)) << trial;
    EXPECT_NEAR(modes.values.norm(), S.norm(), 1e-12 * size * static_cast<double>(n)) << trial;
    for (Index i = 1; i < n; ++i) {
      EXPECT_LE(modes.values(i), modes.values(i - 1)) << trial;
    }
  }
}

}  // namespace
}  // namespace flyball::detail::panels_test
