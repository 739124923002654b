#include <flyball/control/robust/structured_singular_value.hpp>

#include <cmath>
#include <complex>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/systems/norms.hpp>

#include "control/robust/structured_bound.hpp"
#include "math/dense/dense.hpp"

namespace flyball::structured_singular_value_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Blocks = std::vector<UncertaintyBlock>;

constexpr Complex j(0.0, 1.0);

UncertaintyBlock real(Index k = 1) {
  return {UncertaintyKind::real, k, k};
}
UncertaintyBlock complex(Index k = 1) {
  return {UncertaintyKind::complex, k, k};
}
UncertaintyBlock full(Index rows, Index columns) {
  return {UncertaintyKind::full, rows, columns};
}

MatrixXcd random_matrix(Random& random, Index rows, Index columns, bool is_real = false) {
  MatrixXcd M(rows, columns);
  for (Complex& entry : M.reshaped()) {
    entry = {random.normal(), is_real ? 0.0 : random.normal()};
  }
  return M;
}

StructuredSingularValue mu_of(const MatrixXcd& M, const Blocks& blocks) {
  return structured_singular_value(M, blocks).value();
}

/// What must hold of every answer: the bounds are in order, the scalings prove the upper one, Δ is
/// of its size and makes I - M Δ singular.
void expect_sound(const MatrixXcd& M, const StructuredSingularValue& mu) {
  EXPECT_LE(mu.lower, mu.upper);
  EXPECT_TRUE(detail::proves(M, mu.scaling, mu.upper * (1.0 + 1e-9), 0.0));
  if (mu.lower > 0.0) {
    EXPECT_LE(detail::singular_values_of_complex(mu.delta)(0), (1.0 + 1e-9) / mu.lower);
    const MatrixXcd left = MatrixXcd::Identity(M.rows(), M.rows()) - M.lazyProduct(mu.delta);
    EXPECT_LT(detail::singular_values_of_complex(left)(M.rows() - 1), 1e-9);
    EXPECT_LT(mu.residual, 1e-10);
  }
}

void expect_mu(const MatrixXcd& M, const Blocks& blocks, double exact, double tolerance = 1e-6) {
  const auto mu = mu_of(M, blocks);
  expect_sound(M, mu);
  EXPECT_NEAR(mu.lower, exact, tolerance * exact);
  EXPECT_NEAR(mu.upper, exact, tolerance * exact);
}

// Of one full block µ is the largest singular value, of δ I the spectral radius; of a diagonal M
// with numbers it is the largest magnitude, and with real numbers that of the real entries.
TEST(StructuredSingularValue, IsWhatItIsKnownToBe) {
  Random random(3);
  for (int k = 0; k < 20; ++k) {
    const MatrixXcd M = random_matrix(random, 3, 2);
    expect_mu(M, {full(2, 3)}, detail::singular_values_of_complex(M)(0));
    const MatrixXcd S = random_matrix(random, 4, 4);
    expect_mu(S, {complex(4)}, detail::eigenvalues_of_complex(S).cwiseAbs().maxCoeff(), 1e-5);
  }
  const MatrixXcd M = Eigen::Vector4cd(3.0, 5.0 * j, -4.0, 1.0 + 2.0 * j).asDiagonal();
  expect_mu(M, {complex(), complex(), complex(), complex()}, 5.0);
  expect_mu(M, {real(), real(), real(), complex()}, 4.0);
  expect_mu(M, {full(2, 2), full(2, 2)}, 5.0);
}

// M = x yᴴ: det(I - M Δ) = 1 - Σ ȳ_i δ_i x_i, so that µ = Σ |x_i y_i| with complex numbers, and
// Σ ‖x_i‖‖y_i‖ with full blocks; with real ones and real x, y it is Σ |x_i y_i| too.
TEST(StructuredSingularValue, OfRankOneIsASum) {
  Random random(4);
  for (int k = 0; k < 20; ++k) {
    const MatrixXcd x = random_matrix(random, 5, 1);
    const MatrixXcd y = random_matrix(random, 5, 1);
    const MatrixXcd M = x.lazyProduct(y.adjoint());
    expect_mu(M, Blocks(5, complex()), x.cwiseProduct(y).cwiseAbs().sum());
    expect_mu(M, {full(2, 2), full(3, 3)},
              x.topRows(2).norm() * y.topRows(2).norm() +
                  x.bottomRows(3).norm() * y.bottomRows(3).norm());
    const MatrixXcd R = x.real().cast<Complex>();
    const MatrixXcd S = y.real().cast<Complex>();
    expect_mu(R.lazyProduct(S.transpose()), Blocks(5, real()), R.cwiseProduct(S).cwiseAbs().sum(),
              1e-5);
  }
}

// det(I - M δ) = 1 + δ² has no real root: no real δ is large enough, ±j is for a complex one. With
// [0 1; 1 0] it is 1 - δ₁δ₂, whose smallest real roots are ±(1, 1).
TEST(StructuredSingularValue, RealNumbersAreNotComplexOnes) {
  const MatrixXcd turn{{0.0, 1.0}, {-1.0, 0.0}};
  const auto none = mu_of(turn, {real(2)});
  EXPECT_EQ(none.lower, 0.0);
  EXPECT_EQ(none.upper, 0.0);
  EXPECT_TRUE(none.delta.isZero(0.0));
  expect_mu(turn, {complex(2)}, 1.0);
  const MatrixXcd swap{{0.0, 1.0}, {1.0, 0.0}};
  expect_mu(swap, {real(), real()}, 1.0);
  expect_mu(swap, {real(2)}, 1.0);
  // δ e^{jφ} = 1 for no real δ.
  EXPECT_EQ(mu_of(MatrixXcd::Constant(1, 1, j), {real()}).upper, 0.0);
  expect_mu(MatrixXcd::Constant(1, 1, j), {complex()}, 1.0);
}

// Numbers of a real M with real blocks alone: det(I - M Δ) is linear in each δ, so that the first
// zero on a growing box is at a corner; all of them are looked at.
TEST(StructuredSingularValue, RealCornersAreExhausted) {
  Random random(5);
  for (int k = 0; k < 10; ++k) {
    const MatrixXcd M = random_matrix(random, 4, 4, true);
    double exact = 0.0;
    for (unsigned signs = 0; signs < 16; ++signs) {
      MatrixXd V = MatrixXd::Zero(4, 4);
      for (Index i = 0; i < 4; ++i) {
        V(i, i) = ((signs >> i) & 1u) != 0u ? -1.0 : 1.0;
      }
      for (const Complex& value : detail::eigenvalues_of(V * M.real())) {
        exact = std::abs(value.imag()) < 1e-12 ? std::max(exact, value.real()) : exact;
      }
    }
    const auto mu = mu_of(M, Blocks(4, real()));
    expect_sound(M, mu);
    EXPECT_NEAR(mu.lower, exact, 1e-9 * exact);
  }
}

// Up to three complex numbers or full blocks the bound is µ itself (Packard and Doyle, 2 S + F <=
// 3); in general it has the spectral radius below and the largest singular value above it, does
// not change with a scaling that commutes with Δ, and grows with M.
TEST(StructuredSingularValue, ObeysItsLaws) {
  Random random(6);
  const std::vector<Blocks> all{{complex(), complex(), complex()},
                                {full(2, 1), complex(), full(1, 2)},
                                {complex(2), full(2, 2)},
                                {real(), real(), full(2, 2)},
                                {real(2), complex(2)},
                                {real(), complex(), real(), complex()},
                                Blocks(6, complex())};
  for (const Blocks& blocks : all) {
    Index m = 0;
    Index p = 0;
    bool is_exact = true;
    for (const UncertaintyBlock& block : blocks) {
      m += block.rows;
      p += block.columns;
      is_exact = is_exact && block.kind != UncertaintyKind::real;
    }
    is_exact = is_exact && blocks.size() <= 3 && blocks.front().rows == 1;
    for (int k = 0; k < 8; ++k) {
      const MatrixXcd M = random_matrix(random, p, m, k % 2 == 0);
      const auto mu = mu_of(M, blocks);
      expect_sound(M, mu);
      EXPECT_LE(mu.upper, detail::singular_values_of_complex(M)(0) * (1.0 + 1e-6));
      EXPECT_GE(mu.lower, (is_exact ? 0.999999 : 0.45) * mu.upper);
      // D M D⁻¹ of the first block's scale.
      MatrixXcd scaled = M;
      scaled.topRows(blocks.front().columns) *= 1e3;
      scaled.leftCols(blocks.front().rows) *= 1e-3;
      EXPECT_NEAR(mu_of(scaled, blocks).upper, mu.upper, 1e-3 * mu.upper);
      EXPECT_NEAR(mu_of(3.0 * M, blocks).upper, 3.0 * mu.upper, 1e-3 * mu.upper);
    }
  }
}

// The example of SLICOT's AB13MD (its documentation, 5.0): a bound of 41.74753408 with two real
// numbers, a full block and two complex numbers.
TEST(StructuredSingularValue, AgreesWithSlicot) {
  MatrixXcd M(6, 6);
  M.row(0) << -1.0 + 6.0 * j, 2.0 - 3.0 * j, 3.0 + 8.0 * j, 3.0 + 8.0 * j, -5.0 - 9.0 * j,
      -6.0 + 2.0 * j;
  M.row(1) << 4.0 + 2.0 * j, -2.0 + 5.0 * j, -6.0 - 7.0 * j, -4.0 + 11.0 * j, 8.0 - 7.0 * j,
      12.0 - j;
  M.row(2) << 5.0 - 4.0 * j, -4.0 - 8.0 * j, 1.0 - 3.0 * j, -6.0 + 14.0 * j, 2.0 - 5.0 * j,
      4.0 + 16.0 * j;
  M.bottomRows(3) = M.topRows(3).eval();
  const auto mu = mu_of(M, {real(), real(), full(2, 2), complex(), complex()});
  expect_sound(M, mu);
  EXPECT_NEAR(mu.upper, 41.74753408, 1e-4 * 41.7);
}

TEST(StructuredSingularValue, SurvivesBadScales) {
  // A chain of no loop: nothing makes it singular.
  const MatrixXcd chain{{0.0, 1e8, 1e-8}, {0.0, 0.0, 1e12}, {0.0, 0.0, 0.0}};
  const auto mu = mu_of(chain, Blocks(3, complex()));
  EXPECT_LT(mu.upper, 1e-6);
  EXPECT_LE(mu.lower, mu.upper);
  // The same µ in units that differ by 1e16.
  MatrixXcd units{{1.0, 2e-8, 3e8}, {4e8, 5.0, 6e16}, {7e-8, 8e-16, 9.0}};
  MatrixXcd plain{{1.0, 2.0, 3.0}, {4.0, 5.0, 6.0}, {7.0, 8.0, 9.0}};
  const double exact = mu_of(plain, Blocks(3, complex())).upper;
  const auto same = mu_of(units, Blocks(3, complex()));
  EXPECT_NEAR(same.upper, exact, 1e-6 * exact);
  EXPECT_NEAR(same.lower, exact, 1e-6 * exact);
  EXPECT_LT(same.residual, 1e-12);
  for (const double size : {1e-300, 1e300}) {
    EXPECT_NEAR(mu_of(size * plain, Blocks(3, complex())).upper / size, exact, 1e-6 * exact);
  }
  EXPECT_EQ(mu_of(MatrixXcd::Zero(2, 2), {complex(2)}).upper, 0.0);
  // Eigenvectors of subnormal entries: a number of size one is one of 1, not of 1 + 1e-9.
  MatrixXcd M{{-1.5626220703125, 1.0, 0.0, 0.0}, {0.0, -1.5626220703125, 1.0, 0.0}};
  M += Complex(0.0, 1.0) * MatrixXcd{{-1.3128662109375, -3e21, -5.308227539062501e-124, -1e-272},
                                     {-1e-321, 0.65850830078125, 1e-298, -1e-273}};
  const auto tiny = mu_of(M, {full(3, 1), complex()});
  EXPECT_NEAR(std::abs(tiny.delta(3, 1)) * tiny.lower, 1.0, 1e-13);
}

TEST(StructuredSingularValue, RefusesWhatIsNoQuestion) {
  const MatrixXcd M = MatrixXcd::Identity(3, 3);
  const auto error = [](const MatrixXcd& of, const Blocks& blocks) {
    return to_string(structured_singular_value(of, blocks).error());
  };
  EXPECT_EQ(
      error(M, {complex(2)}),
      "structured_singular_value: the structure is of 2 inputs and 2 outputs; it must be of 3 "
      "and 3, M's");
  EXPECT_NE(error(M, {}).find("blocks"), std::string::npos);
  EXPECT_NE(error(M, {real(-1), real(4)}).find("block 1 of 2"), std::string::npos);
  EXPECT_NE(error(M, {real(std::numeric_limits<Index>::max())}).find("block 1 of 1"),
            std::string::npos);
  EXPECT_NE(error(MatrixXcd::Constant(1, 1, Complex(0.0, std::nan(""))), {real()})
                .find("M's imaginary part"),
            std::string::npos);
  EXPECT_NE(error(MatrixXcd(0, 0), {real()}).find("of one entry at least"), std::string::npos);
  EXPECT_NE(error(MatrixXcd::Identity(30, 30), {complex(30)}).find("at most 24"),
            std::string::npos);
  EXPECT_EQ(parse_uncertainty_block("full 2x3").value().columns, 3);
  EXPECT_EQ(parse_uncertainty_block("real 3").value().columns, 3);
  for (const char* text :
       {"", "real -1", "full", "full 2", "complex 1x1", "reel", "real 99999999999999999999"}) {
    EXPECT_FALSE(parse_uncertainty_block(text)) << text;
  }
}

// --- over frequency ---

MatrixXcd response(const ContinuousSystem<>& s, double w) {
  MatrixXcd X = -s.A.cast<Complex>();
  X.diagonal().array() += j * w;
  return s.D.cast<Complex>() +
         s.C.cast<Complex>().lazyProduct(detail::solve_complex(X, s.B.cast<Complex>()));
}

ContinuousSystem<> random_system(Random& random, Index n, Index m, Index p, double damping) {
  ContinuousSystem<> s{MatrixXd(n, n), MatrixXd(n, m), MatrixXd(p, n), MatrixXd(p, m)};
  for (MatrixXd* part : {&s.A, &s.B, &s.C, &s.D}) {
    for (double& entry : part->reshaped()) {
      entry = random.normal();
    }
  }
  s.D *= 0.3;
  s.A.diagonal().array() -= detail::eigenvalues_of(s.A).real().maxCoeff() + damping;
  return s;
}

// Of one full block it is the H∞ norm, and the worst Δ brings a pole onto the axis.
TEST(StructuredPeak, OfAFullBlockIsTheNorm) {
  Random random(7);
  for (int k = 0; k < 5; ++k) {
    const auto s = random_system(random, 2 + k, 2, 2, 0.1);
    const auto peak = structured_peak(s, {full(2, 2)}).value();
    const double norm = h_infinity_norm(s).value().norm;
    EXPECT_NEAR(peak.lower, norm, 1e-4 * norm);
    EXPECT_GE(peak.upper, norm);
    EXPECT_LE(peak.upper, norm * 1.001);
  }
}

// x'' + 0.2 (1 + 0.5 δ₂) x' + (1 + 0.5 δ₁) x = 0 is stable for all real |δ| < 2: at δ₁ = -2 a pole
// is at zero, at δ₂ = -2 a pair is on the axis; µ = 1/2. Complex numbers bear far less.
TEST(StructuredPeak, FindsRealParametersBetweenGridPoints) {
  const ContinuousSystem<> s{MatrixXd{{0.0, 1.0}, {-1.0, -0.2}}, MatrixXd{{0.0, 0.0}, {-0.5, -0.1}},
                             MatrixXd::Identity(2, 2), MatrixXd::Zero(2, 2)};
  const auto peak = structured_peak(s, {real(), real()}).value();
  EXPECT_NEAR(peak.lower, 0.5, 1e-6);
  EXPECT_GE(peak.upper, 0.5);
  EXPECT_LT(peak.upper, 0.501);
  EXPECT_TRUE(peak.delta.imag().isZero(0.0));
  const auto poles = detail::eigenvalues_of(s.A + s.B * peak.delta.real() * s.C);
  EXPECT_NEAR(poles.real().maxCoeff(), 0.0, 1e-8);
  EXPECT_GT(structured_peak(s, {complex(), complex()}).value().lower, 2.0);
}

// Stretches cover every frequency, and between the points at which scalings were found they prove
// the bound too: looked at in a hundred places of each.
TEST(StructuredPeak, HoldsBetweenItsFrequencies) {
  Random random(8);
  const std::vector<Blocks> all{{complex(), complex()},
                                {real(), real(), complex()},
                                {real(2), full(1, 2)},
                                {real(), complex(2)}};
  for (const Blocks& blocks : all) {
    Index m = 0;
    Index p = 0;
    for (const UncertaintyBlock& block : blocks) {
      m += block.rows;
      p += block.columns;
    }
    for (int k = 0; k < 3; ++k) {
      const auto s = random_system(random, 3 + 2 * k, m, p, 0.05);
      const auto peak = structured_peak(s, blocks).value();
      ASSERT_FALSE(peak.stretches.empty());
      EXPECT_EQ(peak.stretches.front().low, 0.0);
      EXPECT_EQ(peak.stretches.back().high, std::numeric_limits<double>::infinity());
      double reached = 0.0;
      for (const ScaledStretch& stretch : peak.stretches) {
        EXPECT_LE(stretch.low, reached);
        reached = stretch.high;
        for (int i = 0; i <= 100; ++i) {
          const double share = i / 100.0;
          const double w = std::isinf(stretch.high)
                               ? std::max(stretch.low, 1e-3) * std::pow(1e8, share)
                               : stretch.low + share * (stretch.high - stretch.low);
          EXPECT_TRUE(
              detail::proves(response(s, w), stretch.scaling, peak.upper * (1.0 + 1e-7), 0.0))
              << w;
        }
      }
      EXPECT_LE(peak.lower, peak.upper);
      EXPECT_GT(peak.lower, 0.5 * peak.upper);
      if (std::isfinite(peak.frequency)) {
        const MatrixXcd left =
            MatrixXcd::Identity(p, p) - response(s, peak.frequency).lazyProduct(peak.delta);
        EXPECT_LT(detail::singular_values_of_complex(left)(p - 1), 1e-8);
      }
    }
  }
}

// 1/(s + 1) sampled: of one number µ is the gain at z = 1; and no state at all is a matrix.
TEST(StructuredPeak, OfSampledAndStaticSystems) {
  const DiscreteSystem<> s{MatrixXd::Constant(1, 1, 0.5), MatrixXd::Ones(1, 1),
                           MatrixXd::Ones(1, 1), MatrixXd::Zero(1, 1), Time(0.1)};
  const auto peak = structured_peak(s, {complex()}).value();
  EXPECT_NEAR(peak.lower, 2.0, 1e-6);
  EXPECT_NEAR(peak.upper, 2.0, 1e-3);
  EXPECT_NEAR(peak.stretches.back().high, 31.41592653589793, 1e-9);
  const ContinuousSystem<> gain{MatrixXd(0, 0), MatrixXd(0, 2), MatrixXd(2, 0),
                                MatrixXd{{0.0, 2.0}, {2.0, 0.0}}};
  EXPECT_NEAR(structured_peak(gain, {complex(), complex()}).value().upper, 2.0, 1e-6);
}

// Robust performance of 1/(s + 1) with an output that is wrong by up to 20 % and feedback 9: T =
// 9/(s + 10), S = 1 - T. |0.5 S/(1 + 0.2 T δ)| < 1 for all |δ| <= 1 asks |0.5 S| + |0.2 T| < 1.
TEST(StructuredPeak, OfRobustPerformanceIsTheSumOfTwo) {
  // M = [-0.2 T; 0.5 S] [1, 1], of rank one: µ is the sum of the two.
  const ContinuousSystem<> s{MatrixXd::Constant(1, 1, -10.0), MatrixXd{{1.0, 1.0}},
                             MatrixXd{{0.2 * -9.0}, {0.5 * -9.0}},
                             MatrixXd{{0.0, 0.0}, {0.5, 0.5}}};
  const auto peak = structured_peak(s, {complex(), full(1, 1)}).value();
  double exact = 0.0;
  for (int k = 0; k <= 4000; ++k) {
    const double w = 1e-2 * std::pow(1e6, k / 4000.0);
    const Complex T = 9.0 / (j * w + 10.0);
    exact = std::max(exact, std::abs(0.2 * T) + 0.5 * std::abs(1.0 - T));
  }
  EXPECT_GE(peak.upper, exact * (1.0 - 1e-9));
  EXPECT_NEAR(peak.lower, exact, 1e-3 * exact);
}

TEST(StructuredPeak, RefusesAnUnstableSystem) {
  ContinuousSystem<> s{MatrixXd::Constant(1, 1, 0.0), MatrixXd::Ones(1, 1), MatrixXd::Ones(1, 1),
                       MatrixXd::Zero(1, 1)};
  EXPECT_NE(to_string(structured_peak(s, {complex()}).error()).find("structured_peak: "),
            std::string::npos);
  s.A(0, 0) = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(structured_peak(s, {complex()}));
}

// A cycle through entries whose products with their scaling, one side alone, are no doubles.
TEST(StructuredSingularValue, OfACycleAtTheEdgeOfTheDoubles) {
  Eigen::MatrixXcd M = Eigen::MatrixXcd::Zero(3, 3);
  M(0, 2) = -1e-154;
  M(1, 0) = 2.3e-308;
  M(2, 1) = 2.3e-308;
  const double exact = std::cbrt(1e-154) * std::pow(std::cbrt(2.3e-308), 2);
  const auto mu = structured_singular_value(M, {{UncertaintyKind::complex, 3, 3}}).value();
  EXPECT_NEAR(mu.lower / exact, 1.0, 1e-13);
  EXPECT_GE(mu.upper / exact, 1.0 - 1e-14);
  EXPECT_LE(mu.upper / exact, 1.0 + 1e-6);
}

// Of a tiny M the proof's G has its digits, since D and G have one factor that is free.
TEST(StructuredSingularValue, ScalingsOfATinyMatrix) {
  Eigen::MatrixXcd M = Eigen::MatrixXcd::Zero(2, 2);
  M(0, 1) = 5e-300;
  M(0, 0) = {0.0, 5e-300};
  const auto mu = structured_singular_value(M, {{UncertaintyKind::real, 2, 2}}).value();
  const double unit = std::ldexp(1.0, 990);
  const Eigen::MatrixXcd m = M * unit;
  const double size = 1.0 / mu.scaling.D_in.cwiseAbs().maxCoeff();
  const Eigen::MatrixXcd D_in = mu.scaling.D_in * size;
  const Eigen::MatrixXcd D_out = mu.scaling.D_out * size;
  const Eigen::MatrixXcd GM = (mu.scaling.G * (size * unit)) * m;
  const double beta = mu.upper * unit;
  const std::complex<double> j(0.0, 1.0);
  const Eigen::MatrixXcd form =
      beta * beta * D_in - m.adjoint() * D_out * m - j * (GM - GM.adjoint());
  const Eigen::VectorXd values =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd>(form).eigenvalues();
  EXPECT_GE(values(0), -1e-14 * values(1));
}

}  // namespace
// Of one number µ is the largest real eigenvalue, here beside larger complex ones, which led the
// search to a δ below the normal doubles.
TEST(StructuredSingularValue, OfOneNumberTheLargestRealEigenvalue) {
  Eigen::MatrixXd M(4, 4);
  M << 1.0, 0.7581787109375, 0.5, 0.0, 0.133056640625, 1.24072265625, -0.15924072265625,
      0.80999755859375, 0.70379638671875, 1.65179443359375, 1.3021240234375, 0.0, -3.0, 0.5,
      1.30120849609375, -0.69744873046875;
  const auto mu =
      structured_singular_value(M.cast<std::complex<double>>(), {{UncertaintyKind::real, 4, 4}})
          .value();
  EXPECT_NEAR(mu.lower, 0.79057173708565731, 1e-13);
  EXPECT_NEAR(mu.upper, mu.lower, 1e-6);
  EXPECT_LE(mu.residual, 1e-14);
}

}  // namespace flyball::structured_singular_value_test
