#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/equations/matrix_equation.hpp>
#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/systems/analysis.hpp>
#include <flyball/systems/conversion.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/gramian.hpp>
#include <flyball/systems/input_delay.hpp>
#include <flyball/systems/norms.hpp>
#include <flyball/systems/realization.hpp>
#include <flyball/systems/response.hpp>
#include <flyball/systems/sampled_cost.hpp>
#include <flyball/systems/transmission_zeros.hpp>

// Nothing that is said of a system depends on the units of its states, inputs, outputs or time.
namespace flyball::other_units_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Eigen::VectorXi;

MatrixXd random_matrix(Random& random, Index rows, Index columns) {
  return MatrixXd::NullaryExpr(rows, columns, [&] { return random.uniform(-2.0, 2.0); });
}

MatrixXd whole_matrix(Random& random, Index rows, Index columns) {
  return MatrixXd::NullaryExpr(rows, columns,
                               [&] { return std::round(random.uniform(-3.0, 3.0)); });
}

/// M_ij 2^(row_i - column_j + all): no such change rounds while it stays within doubles.
MatrixXd powers(const MatrixXd& M, const VectorXi& row, const VectorXi& column, int all) {
  return MatrixXd::NullaryExpr(M.rows(), M.cols(), [&](Index i, Index j) {
    return std::ldexp(M(i, j), row(i) - column(j) + all);
  });
}

/// The same by factors that are no powers of two.
MatrixXd factors(const MatrixXd& M, const VectorXd& row, const VectorXd& column, double all) {
  return MatrixXd::NullaryExpr(
      M.rows(), M.cols(), [&](Index i, Index j) { return M(i, j) * all * (row(i) / column(j)); });
}

VectorXi exponents(Random& random, Index count, double most) {
  return VectorXi::NullaryExpr(
      count, [&] { return static_cast<int>(std::round(random.uniform(-most, most))); });
}

void expect_close(const MatrixXd& made, const MatrixXd& wanted, double tolerance) {
  EXPECT_LE((made - wanted).cwiseAbs().maxCoeff(), tolerance * wanted.cwiseAbs().maxCoeff())
      << made << "\n\n"
      << wanted;
}

// Time in units of up to 1e±100 s and each state in units of up to 1e±100 of its own.
TEST(OtherUnits, StabilityIsTheSame) {
  Random random(11);
  for (int trial = 0; trial < 300; ++trial) {
    const Index n = 1 + trial % 4;
    MatrixXd A = whole_matrix(random, n, n);
    if (trial % 3 == 0) {
      A.bottomLeftCorner(n / 2, n - n / 2).setZero();
    }
    const Stability known = analyze_modes(A, TimeDomain::continuous).value().stability;
    const auto unit = [&] { return std::pow(10.0, random.uniform(-100.0, 100.0)); };
    const VectorXd d = VectorXd::NullaryExpr(n, unit);
    const MatrixXd fine = factors(A, d, d, unit());
    if (fine.allFinite() && ((A.array() == 0.0) == (fine.array() == 0.0)).all()) {
      EXPECT_EQ(analyze_modes(fine, TimeDomain::continuous).value().stability, known) << A << "\n\n"
                                                                                      << fine;
    }
    const VectorXi e = exponents(random, n, 330.0);
    const MatrixXd exact = powers(A, e, e, exponents(random, 1, 330.0)(0));
    if (((A.array() == 0.0) == (exact.array() == 0.0)).all()) {
      EXPECT_EQ(analyze_modes(exact, TimeDomain::continuous).value().stability, known)
          << A << "\n\n"
          << exact;
    }
  }
  // -1.5 ± 0.866i, in units 1e160 apart.
  const MatrixXd A{{-1.0, 1e160}, {-1e-160, -2.0}};
  EXPECT_EQ(analyze_modes(A, TimeDomain::continuous).value().stability, Stability::stable);
  EXPECT_EQ(analyze_modes(MatrixXd{{-1.0, 1e300}, {-1e-300, -2.0}}, TimeDomain::continuous)
                .value()
                .stability,
            Stability::stable);
  // Two integrators in a chain grow, however small the unit of the second makes what joins them.
  EXPECT_EQ(
      analyze_modes(MatrixXd{{0.0, 1e-250}, {0.0, 0.0}}, TimeDomain::continuous).value().stability,
      Stability::unstable);
}

// (A, B) by their definition: x = D x', so A_d = D A_d' D⁻¹ and B_d = D B_d'.
TEST(OtherUnits, HeldInput) {
  Random random(12);
  for (int trial = 0; trial < 200; ++trial) {
    const Index n = 1 + trial % 4;
    const Index m = 1 + trial % 2;
    const MatrixXd A = random_matrix(random, n, n);
    const MatrixXd B = random_matrix(random, n, m);
    const auto known = discretize_zoh(A, B, Time(0.5)).value();
    const VectorXi e = exponents(random, n, trial < 100 ? 300.0 : 430.0);
    const VectorXi inputs = exponents(random, m, 300.0);
    const int time = trial < 100 ? exponents(random, 1, 300.0)(0) : 0;
    const auto found = discretize_zoh(powers(A, e, e, time), powers(B, e, inputs, time),
                                      Time(std::ldexp(0.5, -time)));
    ASSERT_TRUE(found) << to_string(found.error());
    expect_close(powers(found->A, -e, -e, 0), known.A, 1e-12);
    expect_close(powers(found->B, -e, -inputs, 0), known.B, 1e-12);
  }
  const MatrixXd A{{-1.0, 1e120}, {1e-120, -2.0}};
  const auto held = discretize_zoh(A, MatrixXd{{0.0}, {1.0}}, Time(1.0)).value();
  // mpmath, exp of [-1 1; 1 -2] and its integral.
  EXPECT_NEAR(held.A(0, 0), 0.5140366616408393, 1e-14);
  EXPECT_NEAR(held.A(1, 0), 0.2726089376625291e-120, 1e-134);
  EXPECT_NEAR(held.A(1, 1), 0.2414277239783103, 1e-14);
  EXPECT_NEAR(held.B(0, 0), 0.21335440069663164e120, 1e106);
  EXPECT_NEAR(held.B(1, 0), 0.4859633383591607, 1e-14);
}

// Six steps of one and six of 1e-300 in a ring: units in which all are equal lie 1e900 apart, and
// the products of three of those equals have no double. What the input reaches first is 1/k!.
TEST(OtherUnits, WhatIsSmallTakesNoUnits) {
  constexpr int n = 12;
  MatrixXd ring = MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    ring((i + 1) % n, i) = i < n / 2 ? 1.0 : 1e-300;
  }
  const auto held = discretize_zoh(ring, MatrixXd::Identity(n, 1), Time(1.0)).value();
  const auto cost = sampled_cost(ring, MatrixXd::Identity(n, 1), MatrixXd::Identity(n, n),
                                 MatrixXd::Identity(1, 1), Time(1.0))
                        .value();
  double factorial = 1.0;
  for (int k = 0; k <= n / 2; ++k) {
    factorial *= k + 1;
    EXPECT_NEAR(held.B(k, 0), 1.0 / factorial, 1e-16) << k;
  }
  // ∫ (1 + t²/2!² + ... ) of the second state's column over the steps that it drives.
  double expected = 0.0;
  double k_factorial = 1.0;
  for (int k = 0; k <= n / 2 - 1; ++k) {
    k_factorial *= std::max(k, 1);
    expected += 1.0 / (k_factorial * k_factorial * (2 * k + 1));
  }
  EXPECT_NEAR(cost.Q(1, 1), expected, 1e-14);
}

// The logarithm of [.5 0; 1e4 .25] is (ln .5 - ln .25)/(.5 - .25) 1e4 below the diagonal.
TEST(OtherUnits, CouplingsOfASampledSystem) {
  const auto found = convert_to_continuous(
      DiscreteSystem<>{MatrixXd{{0.5, 1e-100}, {1e4, 0.25}}, MatrixXd::Ones(2, 1),
                       MatrixXd::Ones(1, 2), MatrixXd::Zero(1, 1), Time(1.0)},
      ConversionMethod::zoh);
  ASSERT_TRUE(found) << to_string(found.error());
  EXPECT_NEAR(found->A(1, 0) / 27725.887222397812, 1.0, 1e-13);
  EXPECT_NEAR(found->A(0, 1) / 2.7725887222397812e-100, 1.0, 1e-13);
}

// Parts that do not know of each other are judged each beside itself.
TEST(OtherUnits, SlowPartsBesideFastOnes) {
  MatrixXd A = MatrixXd::Zero(4, 4);
  A.topLeftCorner(2, 2) << -1000.0, 1e6, -1e6, -1000.0;
  A.bottomRightCorner(2, 2) << -1e-9, 1.0, -1.0, -1e-9;
  EXPECT_EQ(analyze_modes(A, TimeDomain::continuous).value().stability, Stability::stable);
  A.topLeftCorner(2, 2) << -1.0, 1000.0, -1000.0, -1.0;
  A.bottomRightCorner(2, 2) << -1e-12, 1.0, -1.0, -1e-12;
  EXPECT_EQ(analyze_modes(A, TimeDomain::continuous).value().stability, Stability::stable);
}

// Weak feedback beside an input that moves nothing: ∫ e^{-2t} dt and ∫ (t e^{-t})² + e^{-2t} dt.
TEST(OtherUnits, CostOfAnInputThatMovesNothing) {
  const MatrixXd A{{-1.0, 1.0}, {1e-79, -1.0}};
  const MatrixXd I = MatrixXd::Identity(2, 2);
  const auto cost = sampled_cost(A, MatrixXd{{0.0, 0.0}, {0.0, 1.0}}, I, I, Time(1.0));
  ASSERT_TRUE(cost) << to_string(cost.error());
  EXPECT_NEAR(cost->Q(0, 0), 0.5 * (1.0 - std::exp(-2.0)), 1e-15);
  EXPECT_NEAR(cost->Q(1, 1), 0.5 * (1.0 - std::exp(-2.0)) + 0.25 * (1.0 - 5.0 * std::exp(-2.0)),
              1e-15);
  EXPECT_NEAR(cost->R(0, 0), 1.0, 1e-15);
}

// ∫ of a chain of n integrators' first state squared, tⁿ⁻¹/(n - 1)!, that feeds back weakly.
TEST(OtherUnits, WeakFeedbackLeavesTheCost) {
  for (const int n : {4, 12, 20}) {
    for (const double feedback : {1e-20, 1e-60}) {
      MatrixXd A = MatrixXd::Zero(n, n);
      A.diagonal(-1).setConstant(8.0);
      A(0, n - 1) = feedback;
      MatrixXd Q = MatrixXd::Zero(n, n);
      Q(n - 1, n - 1) = 1.0;
      const auto cost =
          sampled_cost(A, MatrixXd::Zero(n, 1), Q, MatrixXd::Identity(1, 1), Time(1.0));
      ASSERT_TRUE(cost) << to_string(cost.error());
      const double step = std::pow(8.0, n - 1) / std::tgamma(n);
      EXPECT_NEAR(cost->Q(0, 0) / (step * step / (2 * n - 1)), 1.0, 1e-11) << n << " " << feedback;
    }
  }
}

TEST(OtherUnits, HeldInputThatOverflowsSaysSo) {
  const MatrixXd one = MatrixXd::Constant(1, 1, 1e300);
  const auto gone = discretize_zoh(-one, one, Time(1e300));
  ASSERT_FALSE(gone);
  EXPECT_TRUE(gone.error().is(MatrixExponentialError::overflow)) << to_string(gone.error());
  const auto ramp = discretize_zoh(MatrixXd::Zero(1, 1), one, Time(1e300));
  ASSERT_FALSE(ramp);
  EXPECT_TRUE(ramp.error().is(MatrixExponentialError::overflow)) << to_string(ramp.error());
}

// Ramps between samples, by the same change of units.
TEST(OtherUnits, FirstOrderHold) {
  Random random(13);
  for (int trial = 0; trial < 60; ++trial) {
    const Index n = 1 + trial % 4;
    const ContinuousSystem<> G{random_matrix(random, n, n), random_matrix(random, n, 1),
                               random_matrix(random, 1, n), random_matrix(random, 1, 1)};
    const auto known = convert_to_discrete(G, Time(0.5), ConversionMethod::foh).value();
    const VectorXi e = exponents(random, n, 300.0);
    const VectorXi none = VectorXi::Zero(1);
    const auto found =
        convert_to_discrete(ContinuousSystem<>{powers(G.A, e, e, 0), powers(G.B, e, none, 0),
                                               powers(G.C, none, e, 0), G.D},
                            Time(0.5), ConversionMethod::foh);
    ASSERT_TRUE(found) << to_string(found.error());
    expect_close(powers(found->A, -e, -e, 0), known.A, 1e-12);
    expect_close(powers(found->B, -e, none, 0), known.B, 1e-12);
    expect_close(found->D, known.D, 1e-12);
  }
}

TEST(OtherUnits, SampledCost) {
  Random random(14);
  for (int trial = 0; trial < 60; ++trial) {
    const Index n = 1 + trial % 3;
    const MatrixXd A = random_matrix(random, n, n);
    const MatrixXd B = random_matrix(random, n, 1);
    const MatrixXd F = random_matrix(random, n, n);
    const MatrixXd Q = F.transpose() * F;
    const MatrixXd R{{0.7}};
    const auto known = sampled_cost(A, B, Q, R, Time(0.5)).value();
    const VectorXi e = exponents(random, n, 220.0);
    const VectorXi u = exponents(random, 1, 220.0);
    const auto found = sampled_cost(powers(A, e, e, 0), powers(B, e, u, 0), powers(Q, -e, e, 0),
                                    powers(R, -u, u, 0), Time(0.5));
    ASSERT_TRUE(found) << to_string(found.error());
    expect_close(powers(found->Q, e, -e, 0), known.Q, 1e-11);
    expect_close(powers(found->R, u, -u, 0), known.R, 1e-11);
    expect_close(powers(found->N, e, -u, 0), known.N, 1e-11);
  }
}

TEST(OtherUnits, DelayedInputAndStepResponse) {
  const MatrixXd A{{-1.0, 1e130}, {1e-130, -2.0}};
  const MatrixXd plain{{-1.0, 1.0}, {1.0, -2.0}};
  const MatrixXd B{{0.0}, {1.0}};
  const auto known = discretize_delayed_input(plain, B, Time(1.0), Time(0.5)).value();
  const auto found = discretize_delayed_input(A, B, Time(1.0), Time(0.5)).value();
  EXPECT_NEAR(found.B_1(0, 0), known.B_1(0, 0) * 1e130, 1e117);
  EXPECT_NEAR(found.B_1(1, 0), known.B_1(1, 0), 1e-14);
  const MatrixXd D = MatrixXd::Zero(1, 1);
  const auto step = step_response(ContinuousSystem<>{A, B, MatrixXd{{1e-130, 0.0}}, D}, 0,
                                  ResponseTimes{Time(1.0), 3})
                        .value();
  const auto wanted = step_response(ContinuousSystem<>{plain, B, MatrixXd{{1.0, 0.0}}, D}, 0,
                                    ResponseTimes{Time(1.0), 3})
                          .value();
  expect_close(step.y, wanted.y, 1e-13);
}

// ‖c b/(s + a)‖₂ = |c b|/√(2a), its peak |c b|/a at ω = 0.
TEST(OtherUnits, NormsOfFirstOrder) {
  const auto system = [](double a, double b, double c) {
    return ContinuousSystem<>{MatrixXd{{-a}}, MatrixXd{{b}}, MatrixXd{{c}}, MatrixXd::Zero(1, 1)};
  };
  const auto near = [](double made, double wanted) {
    EXPECT_NEAR(made / wanted, 1.0, 1e-12) << made << " of " << wanted;
  };
  near(h2_norm(system(2e-60, 3e-180, 1e-40)).value(), 1.5e-190);
  near(h2_norm(system(1.5e60, 1e165, 1e74)).value(), 1e209 / std::sqrt(3.0));
  near(h_infinity_norm(system(2e-40, 8e-21, 1e-200)).value().norm, 4e-181);
  near(h_infinity_norm(system(1e100, 1e140, 1e140)).value().norm, 1e180);
  near(h_infinity_norm(system(1e100, 1e140, 1e140)).value().upper_bound, 1e180 * (1.0 + 1e-10));
}

TEST(OtherUnits, Norms) {
  Random random(15);
  for (int trial = 0; trial < 120; ++trial) {
    const Index n = 1 + trial % 4;
    MatrixXd A = 0.4 * random_matrix(random, n, n);
    A.diagonal().array() -= 2.0;
    const MatrixXd B = random_matrix(random, n, 1);
    const MatrixXd C = random_matrix(random, 1, n);
    const MatrixXd D = MatrixXd::Zero(1, 1);
    const double h2 = h2_norm(ContinuousSystem<>{A, B, C, D}).value();
    const auto peak = h_infinity_norm(ContinuousSystem<>{A, B, C, D}).value();
    const VectorXi e = exponents(random, n, 300.0);
    const int time = 2 * exponents(random, 1, 100.0)(0);
    const VectorXi input = exponents(random, 1, 150.0);
    const VectorXi output = exponents(random, 1, 150.0);
    const ContinuousSystem<> other{powers(A, e, e, time), powers(B, e, -input, time),
                                   powers(C, output, e, 0), D};
    const int gain = input(0) + output(0);
    const auto h2_there = h2_norm(other);
    const auto peak_there = h_infinity_norm(other);
    ASSERT_TRUE(h2_there) << to_string(h2_there.error());
    ASSERT_TRUE(peak_there) << to_string(peak_there.error());
    EXPECT_NEAR(std::ldexp(*h2_there, -gain - time / 2), h2, 1e-11 * h2);
    EXPECT_NEAR(std::ldexp(peak_there->norm, -gain), peak.norm, 1e-9 * peak.norm);
  }
}

TEST(OtherUnits, Gramians) {
  Random random(16);
  for (int trial = 0; trial < 90; ++trial) {
    const Index n = 1 + trial % 4;
    MatrixXd A = 0.15 * random_matrix(random, n, n);
    const bool continuous = trial % 2 == 0;
    const TimeDomain domain = continuous ? TimeDomain::continuous : TimeDomain::discrete;
    if (continuous) {
      A.diagonal().array() -= 2.0;
    }
    const MatrixXd B = random_matrix(random, n, 1 + trial % 2);
    const Gramian known = controllability_gramian(A, B, domain).value();
    const VectorXi e = exponents(random, n, 220.0);
    const VectorXi inputs = VectorXi::Constant(B.cols(), exponents(random, 1, 150.0)(0));
    const int time = continuous ? exponents(random, 1, 150.0)(0) : 0;
    const auto found =
        controllability_gramian(powers(A, e, e, time), powers(B, e, -inputs, 0), domain);
    ASSERT_TRUE(found) << to_string(found.error());
    expect_close(powers(found->W, -e, e, time - 2 * inputs(0)), known.W, 1e-12);
  }
}

TEST(OtherUnits, Zeros) {
  Random random(17);
  for (int trial = 0; trial < 60; ++trial) {
    const Index n = 2 + trial % 3;
    const MatrixXd A = random_matrix(random, n, n);
    const MatrixXd B = random_matrix(random, n, 1);
    const MatrixXd C = random_matrix(random, 1, n);
    const MatrixXd D = trial % 2 == 0 ? MatrixXd::Zero(1, 1) : random_matrix(random, 1, 1);
    const auto known = transmission_zeros(ContinuousSystem<>{A, B, C, D}).value();
    const VectorXi e = exponents(random, n, 200.0);
    const VectorXi input = exponents(random, 1, 150.0);
    const VectorXi output = exponents(random, 1, 150.0);
    const int time = trial % 4 < 2 ? 0 : exponents(random, 1, 200.0)(0);
    const auto found = transmission_zeros(
        ContinuousSystem<>{powers(A, e, e, time), powers(B, e, -input, time),
                           powers(C, output, e, 0), powers(D, output, -input, 0)});
    ASSERT_TRUE(found) << to_string(found.error());
    EXPECT_EQ(found->normal_rank, known.normal_rank);
    ASSERT_EQ(found->zeros.size(), known.zeros.size());
    for (const auto& zero : known.zeros) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const auto& other : found->zeros) {
        const std::complex<double> there(std::ldexp(other.real(), -time),
                                         std::ldexp(other.imag(), -time));
        nearest = std::min(nearest, std::abs(there - zero));
      }
      EXPECT_LE(nearest, 1e-9 * std::max(1.0, std::abs(zero)));
    }
  }
  // 1/(s² + 3s + 1) has none.
  const auto none =
      transmission_zeros(ContinuousSystem<>{MatrixXd{{-1.0, 1e150}, {1e-150, -2.0}},
                                            MatrixXd{{0.0}, {1.0}}, MatrixXd{{1e-150, 0.0}},
                                            MatrixXd::Zero(1, 1)})
          .value();
  EXPECT_EQ(none.zeros.size(), 0);
  EXPECT_EQ(none.normal_rank, 1);
}

// ∫ e^{-2t} dt BBᵀ, of inputs whose rows are 1e300 apart: B's rows decide, not its columns.
TEST(OtherUnits, GramianOfFarInputs) {
  const MatrixXd B{{-5e-324, 2.0, -1e-20, 0.5},
                   {0.42, 0.565, 1.37, -1.46},
                   {1e-155, -1.58e-290, 1e-290, 1e-300}};
  const Gramian found =
      controllability_gramian(-MatrixXd::Identity(3, 3), B, TimeDomain::continuous).value();
  for (Index i = 0; i < 3; ++i) {
    for (Index j = 0; j < 3; ++j) {
      const double wanted = 0.5 * B.row(i).dot(B.row(j));
      EXPECT_NEAR(found.W(i, j), wanted, 1e-14 * std::abs(wanted) + 1e-322) << i << j;
    }
  }
  const auto beyond = observability_gramian(
      -MatrixXd::Identity(2, 2), MatrixXd{{1.0, 1e300}, {2.0, -1.5}}, TimeDomain::continuous);
  ASSERT_FALSE(beyond);
  EXPECT_TRUE(beyond.error().is(MatrixEquationError::overflow)) << to_string(beyond.error());
}

// 1/((s + 1)(s + 2)) with x1 in units of 1e-16: [0 1; -2 -3] and its numerator.
TEST(OtherUnits, CompanionForm) {
  const auto form = controllable_canonical_form(
      ContinuousSystem<>{MatrixXd{{-1.0, 1e-16}, {0.0, -2.0}}, MatrixXd{{0.0}, {1e8}},
                         MatrixXd{{1e8, 0.0}}, MatrixXd::Zero(1, 1)});
  ASSERT_TRUE(form) << to_string(form.error());
  expect_close(form->A, MatrixXd{{0.0, 1.0}, {-2.0, -3.0}}, 1e-14);
  expect_close(form->C, MatrixXd{{1.0, 0.0}}, 1e-14);
}

// Weights in units 2^500 apart of states that hardly move each other: what one adds to the other's
// cost is a product of numbers that no unit of the plant's brings together.
TEST(OtherUnits, SampledCostOfFarWeights) {
  const MatrixXd A{{-1.7963063319811878, 0.0}, {-0.47357939640179164, 0.7}};
  const MatrixXd B{{-0.44822982018299806}, {0.7555614299066744}};
  const MatrixXd Q{{1.0, 0.1}, {0.1, 1.0}};
  const MatrixXd R = MatrixXd::Ones(1, 1);
  const auto known = sampled_cost(A, B, Q, R, Time(0.7)).value();
  const Eigen::Vector2d d(std::ldexp(1.0, 287), std::ldexp(1.0, -240));
  const double u = std::ldexp(1.0, -90);
  const auto far = sampled_cost(d.asDiagonal() * A * d.cwiseInverse().asDiagonal(),
                                MatrixXd(d.asDiagonal() * B / u),
                                d.cwiseInverse().asDiagonal() * Q * d.cwiseInverse().asDiagonal(),
                                R / (u * u), Time(0.7))
                       .value();
  EXPECT_LE((MatrixXd(d.asDiagonal() * far.Q * d.asDiagonal()) - known.Q)
                .cwiseQuotient(known.Q)
                .cwiseAbs()
                .maxCoeff(),
            1e-14);
  EXPECT_LE(
      (MatrixXd(d.asDiagonal() * far.N * u) - known.N).cwiseQuotient(known.N).cwiseAbs().maxCoeff(),
      1e-14);
  EXPECT_NEAR(far.R(0, 0) * u * u, known.R(0, 0), 1e-14 * known.R(0, 0));
}

}  // namespace
}  // namespace flyball::other_units_test
