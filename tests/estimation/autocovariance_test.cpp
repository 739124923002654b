#include <flyball/estimation/autocovariance.hpp>

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/kalman_gain.hpp>

#include "linear_case.hpp"
#include "support/oracle.hpp"

namespace flyball::autocovariance_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const MatrixXd none;

/// x⁺ = A x + G w, y = C x + v.
struct System {
  MatrixXd A, C, G, Q, R;
};

/// A cart whose force and bias are noisy, its position and speed measured.
System cart() {
  System s;
  s.A.resize(3, 3);
  s.A << 1.0, 0.1, 0.0, 0.0, 0.9, 0.1, 0.0, 0.0, 0.95;
  s.C.resize(2, 3);
  s.C << 1.0, 0.0, 0.0, 0.0, 1.0, 0.0;
  s.G.resize(3, 2);
  s.G << 0.0, 0.0, 1.0, 0.0, 0.0, 1.0;
  s.Q = Eigen::Vector2d(0.04, 0.01).asDiagonal();
  s.R = Eigen::Vector2d(0.25, 0.5).asDiagonal();
  return s;
}

/// The same pushed at the position and the speed, where the outputs tell the noises' correlation.
System pushed_cart() {
  System s = cart();
  s.G << 1.0, 0.0, 0.0, 1.0, 0.0, 0.0;
  return s;
}

MatrixXd a_gain(const System& s, double q) {
  return kalman_gain(s.A, s.C, MatrixXd(q * MatrixXd::Identity(s.A.rows(), s.A.rows())),
                     MatrixXd(MatrixXd::Identity(s.C.rows(), s.C.rows())))
      .value()
      .L;
}

/// The autocovariances of a predictor's innovations, by summing the effects of the noises step by
/// step: ε = Σ Āⁱ (G w - L v).
std::vector<MatrixXd> exact(const System& s, const MatrixXd& L, Index lags) {
  const MatrixXd decays = s.A - L * s.C;
  const MatrixXd each = s.G * s.Q * s.G.transpose() + L * s.R * L.transpose();
  MatrixXd P = MatrixXd::Zero(s.A.rows(), s.A.rows());
  for (int k = 0; k < 4000; ++k) {
    P = (decays * P * decays.transpose() + each).eval();
  }
  std::vector<MatrixXd> all{s.C * P * s.C.transpose() + s.R};
  MatrixXd power = MatrixXd::Identity(s.A.rows(), s.A.rows());
  for (Index j = 1; j <= lags; ++j) {
    all.push_back(s.C * decays * power * P * s.C.transpose() - s.C * power * L * s.R);
    power = (decays * power).eval();
  }
  return all;
}

MatrixXd recorded(const System& s, Index count, Random& random, const MatrixXd& added = {}) {
  const MatrixXd root_q = MatrixXd(s.Q.diagonal().cwiseSqrt().asDiagonal());
  const MatrixXd root_r = test::cholesky_factor(s.R);
  VectorXd x = VectorXd::Zero(s.A.rows());
  MatrixXd y(s.C.rows(), count);
  for (Index k = 0; k < count; ++k) {
    y.col(k) = s.C * x + root_r * test::normal(random, s.C.rows(), 1);
    x = (s.A * x + s.G * (root_q * test::normal(random, s.G.cols(), 1))).eval();
    if (added.size() != 0) {
      x += added.col(k);
    }
  }
  return y;
}

// The exact autocovariances of a filter that is far from optimal give the noises back, in whatever
// units the outputs are.
TEST(Autocovariance, ExactOnesGiveTheNoisesBack) {
  System s = cart();
  for (const bool full : {false, true}) {
    if (full) {
      s = pushed_cart();
      s.Q << 0.04, 0.01, 0.01, 0.01;
      s.R << 0.25, -0.1, -0.1, 0.5;
    }
    for (const double unit : {1.0, 1000.0}) {
      System scaled = s;
      scaled.C.row(1) *= unit;
      scaled.R.row(1) *= unit;
      scaled.R.col(1) *= unit;
      const MatrixXd L = a_gain(s, 3.0) * Eigen::Vector2d(1.0, 1.0 / unit).asDiagonal();
      const auto fit =
          fit_autocovariances(scaled.A, scaled.C, scaled.G, L, exact(scaled, L, 20), 1000,
                              {.diagonal_process = !full, .diagonal_measurement = !full});
      ASSERT_TRUE(fit) << to_string(fit.error());
      EXPECT_LT((fit->Q - scaled.Q).norm(), 1e-9 * scaled.Q.norm());
      EXPECT_LT((fit->R - scaled.R).cwiseQuotient(scaled.R.cwiseAbs().cwiseMax(1e-3)).norm(), 1e-8);
      EXPECT_FALSE(fit->at_boundary);
      EXPECT_LT(fit->misfit, 1e-6);
    }
  }
}

// Of 60 records each noise is within two standard errors in about 95 %, and without bias.
TEST(Autocovariance, StandardErrorsAreTrue) {
  const System s = cart();
  Random random(121);
  constexpr int records = 60;
  int within = 0;
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (int run = 0; run < records; ++run) {
    const auto fit =
        fit_noise_by_autocovariances(s.A, s.C, s.G, recorded(s, 4000, random), none, none);
    ASSERT_TRUE(fit) << to_string(fit.error());
    EXPECT_NEAR(fit->misfit, 1.0, 0.5);
    const Eigen::Vector4d off((fit->Q(0, 0) - s.Q(0, 0)) / fit->Q_std(0, 0),
                              (fit->Q(1, 1) - s.Q(1, 1)) / fit->Q_std(1, 1),
                              (fit->R(0, 0) - s.R(0, 0)) / fit->R_std(0, 0),
                              (fit->R(1, 1) - s.R(1, 1)) / fit->R_std(1, 1));
    within += static_cast<int>((off.cwiseAbs().array() < 2.0).count());
    sum += off;
    EXPECT_EQ(fit->Q_std(0, 1), 0.0);
  }
  EXPECT_GE(within, static_cast<int>(0.88 * 4 * records));
  EXPECT_LT(sum.cwiseAbs().maxCoeff() / records, 0.6);
}

// Known inputs are taken out, and a gain of one's own begins.
TEST(Autocovariance, KnowsTheInputs) {
  const System s = cart();
  Random random(122);
  MatrixXd added = MatrixXd::Zero(3, 20000);
  for (Index k = 0; k < added.cols(); ++k) {
    added(1, k) = std::sin(0.01 * static_cast<double>(k));
  }
  const MatrixXd y = recorded(s, added.cols(), random, added);
  const auto fit = fit_noise_by_autocovariances(s.A, s.C, s.G, y, added, a_gain(s, 1.0));
  ASSERT_TRUE(fit) << to_string(fit.error());
  EXPECT_LT((fit->Q - s.Q).cwiseAbs().maxCoeff(), 4.0 * fit->Q_std.maxCoeff());
  EXPECT_LT((fit->R - s.R).cwiseAbs().maxCoeff(), 4.0 * fit->R_std.maxCoeff());
  const auto blind = fit_noise_by_autocovariances(s.A, s.C, s.G, y, none, a_gain(s, 1.0));
  ASSERT_TRUE(blind);
  EXPECT_GT((blind->Q - s.Q).norm(), 0.2 * s.Q.norm());
}

// A noise that is not there: half of the unconstrained estimates are negative, none of these; the
// answer is the constrained least squares' (no projected step moves it), and the others' follow.
TEST(Autocovariance, NoisesStaySemidefinite) {
  Random random(123);
  int bound = 0;
  for (int run = 0; run < 20; ++run) {
    for (const bool diagonal : {true, false}) {
      System s = diagonal ? cart() : pushed_cart();
      s.Q(1, 1) = 0.0;
      const MatrixXd y = recorded(s, 2000, random);
      const auto fit = fit_noise_by_autocovariances(
          s.A, s.C, s.G, y, none, none,
          {.diagonal_process = diagonal, .diagonal_measurement = diagonal});
      ASSERT_TRUE(fit) << to_string(fit.error());
      const auto least = [](const MatrixXd& M) {
        return test::symmetric_eigenvalues(M).minCoeff();
      };
      EXPECT_GE(least(fit->Q), -1e-15);
      EXPECT_GE(least(fit->R), -1e-15);
      EXPECT_TRUE(fit->converged);
      EXPECT_LE(fit->optimality, 1e-12);
      EXPECT_EQ(fit->at_boundary, fit->iterations > 0);
      bound += diagonal && fit->at_boundary ? 1 : 0;
      EXPECT_LT(fit->Q(1, 1), 5.0 * fit->Q_std(1, 1));
    }
  }
  EXPECT_GE(bound, 4);
  EXPECT_LE(bound, 16);
}

TEST(Autocovariance, WhatDoesNotTellIsRefused) {
  const System s = cart();
  const MatrixXd L = a_gain(s, 1.0);
  Random random(124);
  const MatrixXd y = recorded(s, 500, random);
  const auto refused = [](const auto& result, auto code, const std::string& words) {
    ASSERT_FALSE(result);
    EXPECT_TRUE(result.error().is(code)) << to_string(result.error());
    EXPECT_NE(to_string(result.error()).find(words), std::string::npos)
        << to_string(result.error());
  };
  System unstable = s;
  unstable.A(0, 0) = 1.5;
  refused(fit_autocovariances(unstable.A, s.C, s.G, MatrixXd(MatrixXd::Zero(3, 2)), exact(s, L, 5),
                              100),
          AutocovarianceError::unstable, "1.5");
  refused(fit_noise_by_autocovariances(s.A, s.C, s.G, MatrixXd(y.leftCols(40)), none, L),
          AutocovarianceError::too_few, "40 samples");
  // Two noises that do the same, and more unknown entries than an output tells of.
  MatrixXd twice(3, 2);
  twice << 0.0, 0.0, 1.0, 2.0, 0.0, 0.0;
  refused(fit_noise_by_autocovariances(s.A, s.C, twice, y, none, L),
          AutocovarianceError::not_determined, "Q(");
  // A force and its bias, both into the speed: 2 coefficients of a spectrum for 3 entries of Q.
  refused(fit_noise_by_autocovariances(s.A, s.C, s.G, y, none, L, {.diagonal_process = false}),
          AutocovarianceError::not_determined, "Q(");
  const MatrixXd one = s.C.topRows(1);
  refused(
      fit_noise_by_autocovariances(s.A, one, MatrixXd(MatrixXd::Identity(3, 3)),
                                   MatrixXd(y.topRows(1)), none, none, {.diagonal_process = false}),
      AutocovarianceError::not_determined, "1 outputs");
  refused(fit_autocovariances(s.A, s.C, s.G, L, {}, 100), ArgumentError::empty, "covariances");
  refused(fit_autocovariances(s.A, s.C, s.G, L, {MatrixXd(MatrixXd::Zero(2, 2))}, 100),
          ArgumentError::not_positive, "innovations");
  refused(fit_autocovariances(s.A, s.C, s.G, MatrixXd(L.transpose()), exact(s, L, 5), 100),
          ArgumentError::wrong_shape, "L");
  refused(innovations_of(s.A, s.C, L, MatrixXd(y.topRows(1)), none), ArgumentError::wrong_shape,
          "y");
  MatrixXd bad = y;
  bad(1, 7) = std::nan("");
  refused(fit_noise_by_autocovariances(s.A, s.C, s.G, bad, none, L), ArgumentError::not_finite,
          "y");
}

}  // namespace
}  // namespace flyball::autocovariance_test
