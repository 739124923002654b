#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/math/riccati/riccati.hpp>

#include "math/equations/sylvester_kernel.hpp"
#include "math/extended/double_double.hpp"
#include "math/riccati/riccati_kernel.hpp"
#include "support/oracle.hpp"
#include "support/random_systems.hpp"

namespace flyball::short_way_test {
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
      const MatrixXd gain = continuous ? MatrixXd(B.transpose() * X)
                                       : MatrixXd(test::solve(MatrixXd(R + B.transpose() * X * B),
                                                              MatrixXd(B.transpose() * X * A)));
      EXPECT_LT((K - gain).norm(), 1e-12 * (1.0 + gain.norm()));
    }
  }
}

// States in units far apart, of so many that only the short way answers in time.
TEST(ShortWay, ManyStatesInUnitsFarApart) {
  Random random(33);
  const int n = 60;
  const int m = 4;
  for (const bool continuous : {false, true}) {
    const MatrixXd A = random_matrix(random, n, n) / std::sqrt(n);
    const MatrixXd B = random_matrix(random, n, m);
    const MatrixXd Q = MatrixXd::Identity(n, n);
    const MatrixXd R = MatrixXd::Identity(m, m);
    Eigen::VectorXd d(n);
    for (int i = 0; i < n; ++i) {
      d(i) = std::ldexp(1.0, (7 * i) % 31 - 15);
    }
    const MatrixXd D = d.asDiagonal();
    const MatrixXd inverse = d.cwiseInverse().asDiagonal();
    const auto solve = [&](const MatrixXd& a, const MatrixXd& b, const MatrixXd& q) {
      return continuous ? care(a, b, q, R) : dare(a, b, q, R);
    };
    const auto plain = solve(A, B, Q);
    const auto far = solve(D * A * inverse, D * B, inverse * Q * inverse);
    ASSERT_TRUE(plain.has_value());
    ASSERT_TRUE(far.has_value());
    EXPECT_LT((D * far->X * D - plain->X).norm(), 1e-12 * plain->X.norm());
    EXPECT_LT((far->K * D - plain->K).norm(), 1e-12 * plain->K.norm());
  }
}

// A = -I - 10¹⁰ L, L the Laplacian of a chain: AᵀX, of terms of 10¹⁰ ξ, cancels to ξ, and in
// doubles F is mostly rounding. With e the vector of ones, B = e, Q = e eᵀ and R = 1 it is X = ξ e
// eᵀ, n²ξ² + 2 ξ - 1 = 0.
TEST(ShortWay, TermsThatCancelInDoubles) {
  const int n = 40;
  MatrixXd A = MatrixXd::Zero(n, n);
  for (int i = 0; i + 1 < n; ++i) {
    A(i, i + 1) = A(i + 1, i) = 1e10;
    A(i, i) -= 1e10;
    A(i + 1, i + 1) -= 1e10;
  }
  A.diagonal().array() -= 1.0;
  const MatrixXd B = MatrixXd::Ones(n, 1);
  const MatrixXd Q = MatrixXd::Ones(n, n);
  const MatrixXd R = MatrixXd::Ones(1, 1);
  MatrixXd X(n, n);
  MatrixXd K(1, n);
  Eigen::VectorXcd poles(n);
  detail::RiccatiAnswer answer{X.data(), K.data(), poles.data()};
  ASSERT_TRUE(detail::solve_riccati_quickly(
      {n, 1, A.data(), B.data(), Q.data(), R.data(), nullptr, true}, answer));
  EXPECT_GT(answer.residual, detail::largest_residual);
  const double xi = (std::sqrt(1.0 + n * n) - 1.0) / (n * n);
  EXPECT_LT((X.array() - xi).abs().maxCoeff(), 1e-13 * xi);
  const auto solved = care(A, B, Q, R);
  ASSERT_TRUE(solved.has_value());
  EXPECT_EQ(solved->X, X);
  EXPECT_LT(solved->residual, 1e-15);
}

// The residual by whole products is that by sums of two doubles, in units far apart, too.
TEST(ShortWay, RiccatiResidual) {
  Random random(34);
  for (const int n : {9, 24}) {
    const int m = 8;
    for (const bool continuous : {false, true}) {
      const MatrixXd A = random_matrix(random, n, n);
      const MatrixXd B = random_matrix(random, n, m);
      const MatrixXd N = random_matrix(random, n, m);
      const MatrixXd K = random_matrix(random, m, n);
      const auto symmetric = [&](int size) -> MatrixXd {
        const MatrixXd M = random_matrix(random, size, size);
        return M + M.transpose();
      };
      MatrixXd X = symmetric(n);
      X.row(2) *= 1e9;
      X.col(2) *= 1e9;
      X(2, 2) = std::abs(X(2, 2));
      const MatrixXd R = symmetric(m);
      // Zᵀ([A B]ᵀX[A B] + W)Z - X, or of the continuous equation, with Z = [I; -K].
      const auto exact = [&](const MatrixXd& Q) -> MatrixXd {
        using Matrix = detail::DoubleDoubleMatrix;
        const Matrix k(K);
        const Matrix S = detail::add_product(Matrix(A), -1.0, Matrix(B), k);
        const Matrix XS = detail::product(Matrix(X), S);
        const Matrix NK = detail::product(Matrix(N), k);
        Matrix left = detail::add_product(Matrix(Q), 1.0, Matrix(K.transpose()),
                                          detail::product(Matrix(R), k));
        left = detail::sum(detail::sum(left, -1.0, NK), -1.0, NK.transpose());
        left = continuous ? detail::sum(detail::sum(left, 1.0, XS), 1.0, XS.transpose())
                          : detail::sum(detail::add_product(left, 1.0, S.transpose(), XS), -1.0,
                                        Matrix(X));
        return left.rounded();
      };
      // So that the terms cancel to their last digits.
      MatrixXd Q = symmetric(n);
      const MatrixXd rest = exact(Q);
      Q -= 0.5 * (rest + rest.transpose());
      const MatrixXd expected = exact(Q);
      MatrixXd F(n, n);
      ASSERT_TRUE(detail::riccati_residual(
          {n, m, A.data(), B.data(), Q.data(), R.data(), N.data(), continuous}, X.data(), K.data(),
          F.data()));
      EXPECT_LT(expected.norm(), 1e-12 * rest.norm());
      EXPECT_LT((F - expected).norm(), 1e-9 * expected.norm());
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
}  // namespace flyball::short_way_test
