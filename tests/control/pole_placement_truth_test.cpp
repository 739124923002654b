#include <cmath>

#include <gtest/gtest.h>

#include <flyball/control/pole_placement.hpp>
#include <flyball/core/random.hpp>

namespace flyball::pole_placement_truth_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using LongComplex = std::complex<long double>;

/// x⁽ⁿ⁾ = u: A - B K is the companion matrix of sⁿ + k_n sⁿ⁻¹ + … + k_1.
struct Chain {
  explicit Chain(Index n) : A(MatrixXd::Zero(n, n)), B(MatrixXd::Zero(n, 1)) {
    A.diagonal(1).setOnes();
    B(n - 1, 0) = 1.0;
  }
  MatrixXd A, B;
};

/// The largest relative difference of a coefficient of ∏(s - p) from that which K has.
double coefficients_off(const Eigen::VectorXcd& poles, const MatrixXd& K) {
  std::vector<LongComplex> product{1.0L};
  for (const Complex& p : poles) {
    product.push_back(0.0L);
    for (std::size_t i = product.size() - 1; i > 0; --i) {
      product[i] -= LongComplex(p.real(), p.imag()) * product[i - 1];
    }
  }
  double largest = 0.0;
  const Index n = K.cols();
  for (Index i = 0; i < n; ++i) {
    const LongComplex wanted(K(0, n - 1 - i), 0.0L);
    largest = std::max(
        largest, static_cast<double>(std::abs(product[static_cast<std::size_t>(i + 1)] - wanted) /
                                     std::abs(wanted)));
  }
  return largest;
}

// n poles at one place: K's rounding moves them by its n-th root. The answer says where they are,
// and is none where one is a tenth off.
TEST(PlaceTruth, OneInputAndOnePlace) {
  int refused = 0;
  for (Index n = 1; n <= 24; ++n) {
    const Chain chain(n);
    const auto placed = place(chain.A, chain.B, Eigen::VectorXcd::Constant(n, -100.0));
    if (!placed) {
      ++refused;
      EXPECT_TRUE(placed.error().is(PolePlacementError::not_reached)) << n;
      EXPECT_GT(placed.error().evidence().front().values.front(), 0.1) << n;
      continue;
    }
    EXPECT_LE(placed->pole_error, 0.1) << n;
    EXPECT_GE(placed->pole_error, (placed->poles.array() + 100.0).abs().maxCoeff() / 100.0) << n;
    EXPECT_LT(coefficients_off(placed->poles, placed->K), 1e-13) << n;
  }
  EXPECT_GE(refused, 5);
  EXPECT_LE(refused, 15);
  // Twenty at -100 with the nearest doubles are between 49 % and 30 % off.
  const Chain twenty(20);
  const auto far = place(twenty.A, twenty.B, Eigen::VectorXcd::Constant(20, -100.0));
  ASSERT_FALSE(far.has_value());
  EXPECT_TRUE(far.error().is(PolePlacementError::not_reached));
}

// Poles from 1e-6 to 1e6 and one input: where each is, is told to its own size.
TEST(PlaceTruth, WidelySpreadPoles) {
  const MatrixXd A{{-0.272, -1.483, -0.489, 0.201, 0.022, 0.579},
                   {0.806, -0.118, -0.11, -0.987, 1.033, -0.264},
                   {-1.083, -1.114, -0.415, 1.555, 0.773, -1.694},
                   {-0.124, 0.264, 0.627, 0.344, -0.641, 0.412},
                   {-0.554, -2.241, -0.709, -0.686, 0.954, 1.056},
                   {-1.045, 0.174, 0.09, -1.436, -2.053, -0.093}};
  const MatrixXd B{{0.136}, {-0.595}, {-2.711}, {-0.029}, {-0.579}, {-0.889}};
  const Eigen::VectorXcd poles{{Complex(-1e6, 1e6), Complex(-1e6, -1e6), Complex(-1e-6, 1e-6),
                                Complex(-1e-6, -1e-6), -1.0, -2.0}};
  const auto placed = place(A, B, poles).value();
  // mpmath 1.3, eig of A - BK at 60 digits with the K that this gives; rounding K moved the slow
  // pair by 8.5e-5.
  const Eigen::VectorXcd reached{{Complex(-999999.9999386865, 1000000.0000613137),
                                  Complex(-999999.9999386865, -1000000.0000613137),
                                  Complex(-1.000000000639288e-06, 9.998791810790173e-07),
                                  Complex(-1.000000000639288e-06, -9.998791810790173e-07),
                                  -0.9999999999999978, -2.0000000000000004}};
  for (Index i = 0; i < 6; ++i) {
    EXPECT_LT(std::abs(placed.poles(i) - reached(i)), 1e-8 * std::abs(reached(i))) << i;
  }
  EXPECT_NEAR(placed.pole_error, 8.54e-5, 1e-7);
  // Over chains, by the coefficients.
  Random random(41);
  for (int trial = 0; trial < 200; ++trial) {
    const Index n = 2 + trial % 7;
    const Chain chain(n);
    Eigen::VectorXcd wanted(n);
    for (Index i = 0; i < n; ++i) {
      wanted(i) = -std::pow(10.0, random.uniform(-4.0, 4.0));
    }
    const auto spread = place(chain.A, chain.B, wanted);
    ASSERT_TRUE(spread.has_value()) << trial << to_string(spread.error());
    // What the poles imply of K is as good as they are said to be.
    EXPECT_LT(coefficients_off(spread->poles, spread->K),
              static_cast<double>(n) * (spread->pole_error + 1e-15))
        << trial;
  }
}

// A real mode that no input moves cannot take one of a pair, however near that is.
TEST(PlaceTruth, PairsStayWhole) {
  const MatrixXd A = MatrixXd::Zero(3, 3);
  const MatrixXd B{{0.0, 0.0}, {0.0, 1.0}, {1.0, 0.0}};
  const auto refused = place(A, B, {-1.0, Complex(0.0, 1e-9), Complex(0.0, -1e-9)});
  ASSERT_FALSE(refused.has_value());
  EXPECT_TRUE(refused.error().is(PolePlacementError::not_controllable));
  EXPECT_EQ(refused.error().evidence().front().values, (std::vector<double>{0.0, 0.0}));
  const auto far = place(
      A, B, {-4.40490402158918e+100, Complex(-1.9e-252, 1.4e-129), Complex(-1.9e-252, -1.4e-129)});
  EXPECT_TRUE(!far || far->pole_error <= 0.1);
  // A real pole there is the one that stays.
  const auto kept = place(A, B, {Complex(0.0, 1e-9), Complex(0.0, -1e-9), 0.0}).value();
  EXPECT_EQ(kept.uncontrollable.size(), 1u);
  EXPECT_LT(kept.pole_error, 1e-12);
}

// In any unit of time and of the inputs: the same poles, and of one input the same gain.
TEST(PlaceTruth, UnitsChangeNothing) {
  Random random(42);
  const auto entry = [&] { return random.normal(); };
  for (int trial = 0; trial < 120; ++trial) {
    const Index n = 2 + trial % 4;
    const Index m = 1 + trial % 2;
    const MatrixXd A = MatrixXd::NullaryExpr(n, n, entry);
    const MatrixXd B = MatrixXd::NullaryExpr(n, m, entry);
    Eigen::VectorXcd poles(n);
    for (Index i = 0; i < n; ++i) {
      poles(i) = -1.0 - static_cast<double>(i);
    }
    const auto plain = place(A, B, poles).value();
    const double time = std::ldexp(1.0, static_cast<int>(random.uniform(-400.0, 400.0)));
    const double input = std::ldexp(1.0, static_cast<int>(random.uniform(-300.0, 300.0)));
    const auto scaled = place(time * A, time * input * B, time * poles);
    ASSERT_TRUE(scaled.has_value()) << trial << to_string(scaled.error());
    if (m == 1) {  // Else the states' units choose among the gains.
      EXPECT_LT((input * scaled->K - plain.K).norm(), 1e-10 * plain.K.norm()) << trial;
    }
    EXPECT_LT((scaled->poles / time - poles).norm(), 1e-9 * poles.norm()) << trial;
    EXPECT_LT(scaled->pole_error, 1e-9) << trial;
  }
}

// Any finite entries and poles: a gain that is told truly, or a refusal.
TEST(PlaceTruth, IsTotal) {
  const double palette[] = {0.0,     1.0,    -1.0,    2.220446049250313e-16,
                            5e-324,  1e-320, -2.0,    1e20,
                            -1e20,   1e154,  -1e-154, 1e-9,
                            1.7e308, 1e-300};
  Random random(43);
  int placed_ones = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const auto any = [&] { return palette[static_cast<std::size_t>(random.uniform() * 13.999)]; };
    const auto entry = [&] { return random.uniform() < 0.5 ? 0.0 : any(); };
    const Index n = 1 + trial % 5;
    const Index m = 1 + trial % 3;
    const MatrixXd A = MatrixXd::NullaryExpr(n, n, entry);
    const MatrixXd B = MatrixXd::NullaryExpr(n, m, entry);
    Eigen::VectorXcd poles(n);
    for (Index i = 0; i < n; ++i) {
      poles(i) = any();
      if (i + 1 < n && random.uniform() < 0.5) {
        poles(i).imag(std::abs(any()));
        poles(i + 1) = std::conj(poles(i));
        ++i;
      }
    }
    const auto placed = place(A, B, poles);
    if (!placed) {
      EXPECT_FALSE(to_string(placed.error()).empty());
      continue;
    }
    ++placed_ones;
    EXPECT_TRUE(placed->K.allFinite()) << trial;
    EXPECT_TRUE(placed->poles.allFinite()) << trial;
    EXPECT_LE(placed->pole_error, 0.1) << trial;
  }
  EXPECT_GT(placed_ones, 300);
}

// An entry that is nothing beside the others is not what the states' units are made for.
TEST(PlaceTruth, AnEntryOfNoWeightChangesNothing) {
  for (const double entry : {0.0, 1e-20, 1e-100, 1e-155, -1e-300, 5e-324}) {
    const Eigen::Matrix2d A{{0.0, 0.0}, {1.5, 0.0}};
    const Eigen::Matrix2d B{{0.0, 1.0}, {0.9, entry}};
    const auto placed = place(A, B, {0.18, 0.05}).value();
    const Eigen::Matrix2d S = A - B * placed.K;
    EXPECT_NEAR(S.trace(), 0.23, 1e-13) << entry;
    EXPECT_NEAR(S.determinant(), 0.009, 1e-13) << entry;
  }
}

}  // namespace
}  // namespace flyball::pole_placement_truth_test
