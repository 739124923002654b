#include <flyball/systems/analysis.hpp>

#include <cmath>
#include <complex>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/math/equations/matrix_equation.hpp>
#include <flyball/systems/controllability.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/norms.hpp>

#include "support/oracle.hpp"
#include "systems/random_systems.hpp"

namespace flyball::analysis_test {
namespace {

using Eigen::MatrixXd;

MatrixXd scalar(double value) {
  return MatrixXd::Constant(1, 1, value);
}

// s² + 2·0.25·4 s + 16: ω_n = 4, ζ = 0.25, τ = 1/(ζω_n) = 1.
TEST(Analysis, SecondOrder) {
  Eigen::Matrix2d A;
  A << 0.0, 1.0, -16.0, -2.0;
  const auto analysis = analyze_modes(A, TimeDomain::continuous).value();
  ASSERT_EQ(analysis.modes.size(), 2U);
  for (const Mode& mode : analysis.modes) {
    EXPECT_NEAR(mode.natural_frequency, 4.0, 1e-14);
    EXPECT_NEAR(mode.damping_ratio, 0.25, 1e-15);
    EXPECT_NEAR(mode.time_constant, 1.0, 1e-14);
    EXPECT_EQ(mode.stability, Stability::stable);
  }
  EXPECT_EQ(analysis.stability, Stability::stable);
  EXPECT_NEAR(analysis.slowest_time_constant, 1.0, 1e-14);
  EXPECT_EQ(describe(analysis),
            "stable\n-1 +/- 3.873i: decays with the time constant 1 s, oscillating at 4 rad/s with "
            "the damping ratio 0.25\n");
  // Its samples speak of the same mode.
  const auto sampled = discretize_zoh(A, Eigen::Vector2d(0, 1), Time(0.05)).value();
  const auto discrete = analyze_modes(sampled.A, TimeDomain::discrete, Time(0.05)).value();
  EXPECT_NEAR(discrete.modes[0].natural_frequency, 4.0, 1e-12);
  EXPECT_NEAR(discrete.modes[0].damping_ratio, 0.25, 1e-13);
  EXPECT_NEAR(discrete.modes[0].time_constant, 1.0, 1e-13);
}

TEST(Analysis, BoundaryOfStability) {
  const auto verdict = [](const MatrixXd& A, TimeDomain domain) {
    return analyze_modes(A, domain, Time(0.1)).value().stability;
  };
  Eigen::Matrix2d oscillator;
  oscillator << 0.0, 3.0, -3.0, 0.0;
  Eigen::Matrix2d chain;
  chain << 0.0, 1.0, 0.0, 0.0;
  const auto I = Eigen::Matrix2d::Identity();
  EXPECT_EQ(verdict(oscillator, TimeDomain::continuous), Stability::marginal);
  EXPECT_EQ(verdict(MatrixXd::Zero(2, 2), TimeDomain::continuous), Stability::marginal);
  EXPECT_EQ(verdict(chain, TimeDomain::continuous), Stability::unstable);
  EXPECT_EQ(verdict(chain, TimeDomain::discrete), Stability::stable);
  EXPECT_EQ(verdict(I, TimeDomain::discrete), Stability::marginal);
  EXPECT_EQ(verdict(I + chain, TimeDomain::discrete), Stability::unstable);
  EXPECT_EQ(verdict(-0.5 * I, TimeDomain::continuous), Stability::stable);
  EXPECT_EQ(verdict(scalar(-1e-20), TimeDomain::continuous), Stability::stable);
  EXPECT_EQ(verdict(scalar(1e-20), TimeDomain::continuous), Stability::unstable);
  // Seen from turned axes, rounding has moved the poles: the verdict stays.
  Random random(3);
  for (int trial = 0; trial < 1000; ++trial) {
    const MatrixXd Q = test::random_rotation(random, 3);
    MatrixXd A = MatrixXd::Zero(3, 3);
    A.topLeftCorner(2, 2) = oscillator;
    A(2, 2) = -1.0;
    EXPECT_EQ(verdict(Q * A * Q.transpose(), TimeDomain::continuous), Stability::marginal);
    A.topLeftCorner(2, 2) = chain;
    EXPECT_EQ(verdict(Q * A * Q.transpose(), TimeDomain::continuous), Stability::unstable);
    A.topLeftCorner(2, 2) << std::cos(1.0), std::sin(1.0), -std::sin(1.0), std::cos(1.0);
    A(2, 2) = 0.3;
    EXPECT_EQ(verdict(Q * A * Q.transpose(), TimeDomain::discrete), Stability::marginal);
  }
}

TEST(Analysis, DeadbeatPolesDecayAtOnce) {
  const auto analysis = analyze_modes(scalar(0.0), TimeDomain::discrete, Time(0.1)).value();
  EXPECT_EQ(analysis.modes[0].s.real(), -INFINITY);
  EXPECT_EQ(analysis.modes[0].time_constant, 0.0);
  EXPECT_EQ(analysis.modes[0].damping_ratio, 1.0);
}

// x = -A⁻¹Bu; an integrator rests anywhere, if nothing drives it.
TEST(Analysis, Equilibrium) {
  Random random(4);
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::Index n = 1 + trial % 5;
    const auto plain = test::random_stable_system(random, n, 2, 1);
    const auto plant = test::rescaled(plain, test::random_scales(random, n, 8.0));
    const Eigen::VectorXd u = test::random_matrix(random, 2, 1);
    const auto rest = equilibrium(plant, u).value();
    EXPECT_TRUE(rest.unique);
    const Eigen::VectorXd y = plain.D * u - plain.C * test::solve(plain.A, plain.B * u);
    EXPECT_NEAR(rest.y(0), y(0), 1e-9 * (1.0 + y.norm()));
    const DiscreteSystem<> discrete{0.5 * plain.A, plain.B, plain.C, plain.D, Time(0.1)};
    const Eigen::VectorXd x = equilibrium(discrete, u).value().x;
    EXPECT_LT((discrete.A * x + discrete.B * u - x).norm(), 1e-11 * (1.0 + x.norm()));
  }
  ContinuousSystem<> integrator{MatrixXd::Zero(2, 2), MatrixXd::Identity(2, 2).col(1),
                                MatrixXd::Identity(2, 2), MatrixXd::Zero(2, 1)};
  integrator.A(0, 1) = 1.0;
  const auto driven = equilibrium(integrator, Eigen::VectorXd::Ones(1));
  ASSERT_FALSE(driven.has_value());
  EXPECT_TRUE(driven.error().is(SystemError::no_equilibrium));
  const auto resting = equilibrium(integrator, Eigen::VectorXd::Zero(1)).value();
  EXPECT_FALSE(resting.unique);
  EXPECT_EQ(resting.x.norm(), 0.0);
  EXPECT_TRUE(
      equilibrium(integrator, Eigen::VectorXd::Zero(2)).error().is(ArgumentError::wrong_shape));
}

// dx/dt = -a x: P = 1/(2a), V = x²/(2a) falls by e^{-2at}. x₊ = a x: P = 1/(1 - a²).
TEST(Analysis, LyapunovCertificateInClosedForm) {
  const auto continuous = lyapunov_certificate(scalar(-3.0), TimeDomain::continuous).value();
  EXPECT_NEAR(continuous.P(0, 0), 1.0 / 6.0, 1e-16);
  EXPECT_TRUE(continuous.positive_definite);
  EXPECT_NEAR(continuous.decay_rate, 6.0, 1e-14);
  const auto discrete = lyapunov_certificate(scalar(0.5), TimeDomain::discrete).value();
  EXPECT_NEAR(discrete.P(0, 0), 1.0 / 0.75, 1e-15);
  EXPECT_NEAR(discrete.decay_rate, 0.75, 1e-15);
  EXPECT_FALSE(lyapunov_certificate(scalar(2.0), TimeDomain::continuous)->positive_definite);
  EXPECT_EQ(lyapunov_certificate(scalar(2.0), TimeDomain::continuous)->decay_rate, 0.0);
}

// P > 0 exactly where A is stable; as many negative eigenvalues as unstable poles (Ostrowski and
// Schneider); V falls along trajectories.
TEST(Analysis, LyapunovCertificateDecides) {
  Random random(6);
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::Index n = 1 + trial % 6;
    const TimeDomain domain = trial % 2 == 0 ? TimeDomain::continuous : TimeDomain::discrete;
    MatrixXd A = test::random_matrix(random, n, n);
    if (domain == TimeDomain::discrete) {
      A *= 0.7 / std::sqrt(static_cast<double>(n)) * random.uniform(0.5, 2.0);
    } else {
      A.diagonal().array() -= random.uniform(0.0, 3.0);
    }
    const auto modes = analyze_modes(A, domain).value();
    const auto certificate = lyapunov_certificate(A, domain);
    ASSERT_TRUE(certificate.has_value());
    EXPECT_EQ(certificate->positive_definite, modes.stability == Stability::stable);
    const auto unstable =
        std::count_if(modes.modes.begin(), modes.modes.end(),
                      [](const Mode& mode) { return mode.stability == Stability::unstable; });
    EXPECT_EQ((certificate->eigenvalues.array() < 0.0).count(), unstable);
    const MatrixXd& P = certificate->P;
    const MatrixXd change = domain == TimeDomain::continuous ? MatrixXd(A.transpose() * P + P * A)
                                                             : MatrixXd(A.transpose() * P * A - P);
    EXPECT_LT((change + MatrixXd::Identity(n, n)).norm(),
              1e-10 * (1.0 + P.norm()) * (1.0 + A.norm()));
    if (certificate->positive_definite && domain == TimeDomain::continuous) {
      const Eigen::VectorXd x = test::random_matrix(random, n, 1);
      EXPECT_LE(-x.squaredNorm(), -certificate->decay_rate * x.dot(P * x) * (1.0 - 1e-9));
    }
  }
}

/// The poles of A, the slowest first.
std::vector<double> real_poles(const MatrixXd& A) {
  std::vector<double> poles;
  const auto analysis = analyze_modes(A, TimeDomain::continuous).value();
  for (const Mode& mode : analysis.modes) {
    EXPECT_EQ(mode.stability, Stability::stable);
    poles.push_back(mode.pole.real());
  }
  return poles;
}

// Blocks with the poles -1, -2 and -f, -2f, f = 1e50: apart, one driving the other, and both; the
// last moves the slow ones by 1/f.
TEST(Analysis, PartsFarApart) {
  const double f = 1e50;
  Eigen::Matrix2d block;
  block << 0.0, 1.0, -2.0, -3.0;
  Eigen::Matrix2d across;
  across << 0.3, -1.0, 2.0, 0.7;
  for (const auto& [up, down] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}, {1.0, 1.0}}) {
    MatrixXd A(4, 4);
    A << block, up * across, down * across, f * block;
    const auto poles = real_poles(A);
    EXPECT_NEAR(poles[0], -1.0, 1e-14) << up << down;
    EXPECT_NEAR(poles[1], -2.0, 1e-14) << up << down;
    EXPECT_NEAR(poles[2] / f, -1.0, 1e-14) << up << down;
    EXPECT_NEAR(poles[3] / f, -2.0, 1e-14) << up << down;
  }
  // The states in turn, and between them a coupling that moves the slow pole: -3 + 1.
  MatrixXd A(2, 2);
  A << -3.0, 1e25, 1e25, -1e50;
  const auto poles = real_poles(A);
  EXPECT_NEAR(poles[0], -2.0, 1e-14);
  EXPECT_NEAR(poles[1] / f, -1.0, 1e-14);
}

TEST(Analysis, Errors) {
  EXPECT_TRUE(
      analyze_modes(scalar(NAN), TimeDomain::continuous).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(analyze_modes(MatrixXd(), TimeDomain::continuous).error().is(ArgumentError::empty));
  EXPECT_TRUE(analyze_modes(scalar(0.5), TimeDomain::discrete, Time(0.0))
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(lyapunov_certificate(scalar(-1.0), scalar(0.0), TimeDomain::continuous)
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(lyapunov_certificate(scalar(-1.0), MatrixXd::Identity(2, 2), TimeDomain::continuous)
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(lyapunov_certificate(scalar(0.0), TimeDomain::continuous)
                  .error()
                  .is(MatrixEquationError::no_unique_solution));
  EXPECT_TRUE(lyapunov_certificate(scalar(-1.0), TimeDomain::discrete)
                  .error()
                  .is(MatrixEquationError::no_unique_solution));
}

/// Masses in a row between springs, one end fixed; a force on the first, the place of the last.
ContinuousSystem<> masses(Eigen::Index m) {
  constexpr double stiffness = 100.0;
  constexpr double damping = 0.1;
  ContinuousSystem<> s{MatrixXd::Zero(2 * m, 2 * m), MatrixXd::Zero(2 * m, 1),
                       MatrixXd::Zero(1, 2 * m), MatrixXd::Zero(1, 1)};
  s.A.topRightCorner(m, m).setIdentity();
  for (Eigen::Index k = 0; k < m; ++k) {
    for (const auto& [column, by] :
         {std::pair{Eigen::Index{0}, stiffness}, std::pair{m, damping}}) {
      s.A(m + k, column + k) -= k + 1 < m ? 2.0 * by : by;
      if (k > 0) {
        s.A(m + k, column + k - 1) = by;
      }
      if (k + 1 < m) {
        s.A(m + k, column + k + 1) = by;
      }
    }
  }
  s.B(m, 0) = 1.0;
  s.C(0, m - 1) = 1.0;
  return s;
}

// Between an input and an output tens of states apart, units in which both are large rose from each
// state to the next by a little, to 2^60, and nothing was left of the gains between.
TEST(LongChains, GainsAndModesAreThoseOfThePlant) {
  for (const Eigen::Index m : {10, 24, 32}) {
    SCOPED_TRACE(m);
    const ContinuousSystem<> s = masses(m);
    const Eigen::VectorXcd poles = s.A.eigenvalues();
    const auto gain = [&](double omega) {
      Eigen::MatrixXcd M = -s.A.cast<std::complex<double>>();
      M.diagonal().array() += std::complex<double>(0.0, omega);
      return std::abs((s.C.cast<std::complex<double>>() *
                       M.partialPivLu().solve(s.B.cast<std::complex<double>>()))(0, 0));
    };
    double largest = gain(0.0);
    for (const auto& pole : poles) {
      largest = std::max(largest, gain(std::abs(pole.imag())));
    }
    const auto norm = h_infinity_norm(s);
    ASSERT_TRUE(norm) << to_string(norm.error());
    EXPECT_GE(norm->norm, largest * (1.0 - 1e-9));
    EXPECT_NEAR(norm->norm / gain(norm->frequency), 1.0, 1e-7);
    const auto reach = analyze_controllability(s.A, s.B, TimeDomain::continuous).value();
    const auto sight = analyze_observability(s.A, s.C, TimeDomain::continuous).value();
    for (const auto* modes : {&reach.modes, &sight.modes}) {
      for (const ModeReach& mode : *modes) {
        EXPECT_LE((poles.array() - mode.eigenvalue).abs().minCoeff(), 1e-8);
        EXPECT_EQ(mode.stability, Stability::stable);
      }
    }
  }
}

}  // namespace
}  // namespace flyball::analysis_test
