#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "math/equations/sylvester_kernel.hpp"
#include "math/riccati/riccati_kernel.hpp"
#include "support/random_systems.hpp"

namespace flyball {
namespace {

using Eigen::MatrixXd;
using test::random_matrix;

// What a kernel does not vouch for is solved the robust way, so that of a broken one only the time
// tells: ordinary problems of every size must be answered without it, and right.

TEST(ShortWay, RiccatiEquations) {
  Random random(31);
  for (const int n : {1, 2, 3, 4, 5, 8, 10, 11, 24, 30}) {
    for (const bool continuous : {false, true}) {
      const int m = 1 + n / 3;
      SCOPED_TRACE(testing::Message() << n << (continuous ? " continuous" : " discrete"));
      const MatrixXd A = random_matrix(random, n, n) / std::sqrt(n);
      const MatrixXd B = random_matrix(random, n, m);
      const MatrixXd Q = MatrixXd::Identity(n, n);
      const MatrixXd R = MatrixXd::Identity(m, m);
      MatrixXd X(n, n);
      MatrixXd K(m, n);
      Eigen::VectorXcd poles(n);
      detail::RiccatiAnswer answer{X.data(), K.data(), poles.data()};
      ASSERT_TRUE(detail::solve_riccati_quickly(
          {n, m, A.data(), B.data(), Q.data(), R.data(), nullptr, continuous}, answer));
      const MatrixXd S = A - B * K;
      const MatrixXd cost = Q + K.transpose() * K;
      const MatrixXd left = continuous ? MatrixXd(S.transpose() * X + X * S + cost)
                                       : MatrixXd(S.transpose() * X * S + cost - X);
      EXPECT_LT(left.norm(), 1e-12 * X.norm());
      const MatrixXd gain =
          continuous ? MatrixXd(B.transpose() * X)
                     : MatrixXd((R + B.transpose() * X * B).inverse() * B.transpose() * X * A);
      EXPECT_LT((K - gain).norm(), 1e-12 * (1.0 + gain.norm()));
    }
  }
}

TEST(ShortWay, SylvesterAndLyapunovEquations) {
  Random random(32);
  for (const int n : {1, 2, 3, 4, 5, 8, 13, 16, 17, 30}) {
    for (const int m : {n, 1, 6}) {
      for (const bool continuous : {false, true}) {
        SCOPED_TRACE(testing::Message() << n << " x " << m << (continuous ? " continuous" : ""));
        // Eigenvalues of A within 0.5 of -2, those of B within 0.5 of 0: nothing cancels.
        const auto within = [&](int size) -> MatrixXd {
          const MatrixXd some = random_matrix(random, size, size);
          return 0.5 / some.norm() * some;
        };
        const MatrixXd A = within(n) - 2.0 * MatrixXd::Identity(n, n);
        const MatrixXd B = within(m);
        const MatrixXd F = random_matrix(random, n, m);
        MatrixXd X(n, m);
        detail::SylvesterAnswer answer{X.data()};
        ASSERT_TRUE(detail::solve_sylvester_quickly(
            {n, m, continuous, false, A.data(), B.data(), F.data()}, answer));
        const MatrixXd left = continuous ? MatrixXd(A * X + X * B) : MatrixXd(A * X * B - X);
        EXPECT_LT((left - F).norm(), 1e-14 * n * (F.norm() + X.norm()));
        if (m != n) {
          continue;
        }
        const MatrixXd Q = F + F.transpose();
        ASSERT_TRUE(detail::solve_sylvester_quickly(
            {n, n, continuous, true, A.data(), nullptr, Q.data()}, answer));
        const MatrixXd At = A.transpose();
        const MatrixXd defect = continuous ? MatrixXd(A * X + X * At) : MatrixXd(A * X * At - X);
        EXPECT_LT((defect - Q).norm(), 1e-14 * n * (Q.norm() + 5.0 * X.norm()));
        EXPECT_EQ(X, X.transpose());
      }
    }
  }
}

// Poles of a sampled heat equation are rounding beside the slow ones, which ends no iteration by
// itself.
TEST(ShortWay, HeatThatHasGone) {
  constexpr int n = 100;
  const double pi = std::acos(-1.0);
  MatrixXd A(n, n);  // Σ v vᵀ e^{-λT} of the rod's modes
  MatrixXd V(n, n);
  Eigen::VectorXd decay(n);
  for (int k = 0; k < n; ++k) {
    const double s = std::sin(0.5 * pi * (k + 1) / (n + 1));
    decay(k) = std::exp(-0.4 * 1.02 * (n + 1) * s * s);
    for (int i = 0; i < n; ++i) {
      V(i, k) = std::sqrt(2.0 / (n + 1)) * std::sin(pi * (k + 1) * (i + 1) / (n + 1));
    }
  }
  A = V * decay.asDiagonal() * V.transpose();
  const MatrixXd B = A.col(0);
  MatrixXd Q = MatrixXd::Zero(n, n);
  Q.diagonal().tail(n / 4).setOnes();
  const MatrixXd R = MatrixXd::Identity(1, 1);
  MatrixXd X(n, n);
  MatrixXd K(1, n);
  Eigen::VectorXcd poles(n);
  detail::RiccatiAnswer answer{X.data(), K.data(), poles.data()};
  EXPECT_TRUE(detail::solve_riccati_quickly(
      {n, 1, A.data(), B.data(), Q.data(), R.data(), nullptr, false}, answer));
}

}  // namespace
}  // namespace flyball
