#include <flyball/systems/transmission_zeros.hpp>

#include <cmath>
#include <complex>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "support/oracle.hpp"
#include "systems/random_systems.hpp"

namespace flyball::transmission_zeros_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using test::random_matrix;

/// The smallest singular value of [sI - A, -B; C, D] that is zero at a zero, beside the largest.
double rank_defect(const ContinuousSystem<>& s, Complex at, Index normal_rank) {
  const Index n = s.A.rows();
  MatrixXcd P(n + s.C.rows(), n + s.B.cols());
  P << -s.A.cast<Complex>(), -s.B.cast<Complex>(), s.C.cast<Complex>(), s.D.cast<Complex>();
  P.topLeftCorner(n, n).diagonal().array() += at;
  const Eigen::VectorXd values = test::singular_values(P);
  return values(n + normal_rank - 1) / values(0);
}

// The definition, over systems of all shapes, with D of any rank: the pencil loses rank at each
// zero, and nowhere near.
TEST(TransmissionZeros, RankFalls) {
  Random random(41);
  int seen = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const auto n = static_cast<Index>(1 + random.bits() % 7);
    const auto m = static_cast<Index>(1 + random.bits() % 3);
    const auto p = static_cast<Index>(1 + random.bits() % 3);
    ContinuousSystem<> s = test::random_system(random, n, m, p);
    const auto rank = static_cast<Index>(random.bits() % (std::min(m, p) + 1));
    s.D = random_matrix(random, p, rank) * random_matrix(random, rank, m);
    const TransmissionZeros found = transmission_zeros(s).value();
    ASSERT_EQ(found.normal_rank, std::min({m, p, n + rank})) << trial;
    // Square: n zeros less twice … of a generic system n - (m - rank D), none of another.
    if (m == p && n + rank >= m) {
      EXPECT_EQ(found.zeros.size(), n - (m - rank)) << trial;
    } else if (m != p) {
      EXPECT_EQ(found.zeros.size(), 0) << trial;
    }
    for (const Complex& zero : found.zeros) {
      ++seen;
      EXPECT_LE(rank_defect(s, zero, found.normal_rank), 1e-12) << trial;
    }
  }
  EXPECT_GE(seen, 2000);
}

// Zeros that were put there: (s - z) in every channel of an output keeps them, whatever the units.
TEST(TransmissionZeros, KnownOnes) {
  // (s + 3)/((s + 1)(s + 2)) and 1/(s + 2) of one input: no s makes both zero.
  const ContinuousSystem<> tall{MatrixXd{{-1.0, 0.0}, {0.0, -2.0}}, MatrixXd{{1.0}, {1.0}},
                                MatrixXd{{2.0, -1.0}, {0.0, 1.0}}, MatrixXd::Zero(2, 1)};
  const auto none = transmission_zeros(tall).value();
  EXPECT_EQ(none.zeros.size(), 0);
  EXPECT_EQ(none.normal_rank, 1);
  const ContinuousSystem<> first{tall.A, tall.B, tall.C.topRows(1), MatrixXd::Zero(1, 1)};
  const auto one = transmission_zeros(first).value();
  ASSERT_EQ(one.zeros.size(), 1);
  EXPECT_LE(std::abs(one.zeros(0) + 3.0), 1e-14);
  // A mode that no input moves is an invariant zero.
  ContinuousSystem<> unmoved = first;
  unmoved.B(1, 0) = 0.0;
  EXPECT_LE(std::abs(transmission_zeros(unmoved).value().zeros(0) + 2.0), 1e-14);
  // 1/(s + 1) [1 1; 1 1]: of rank one everywhere.
  const ContinuousSystem<> degenerate{MatrixXd{{-1.0}}, MatrixXd{{1.0, 1.0}},
                                      MatrixXd{{1.0}, {1.0}}, MatrixXd::Zero(2, 2)};
  const auto rank_one = transmission_zeros(degenerate).value();
  EXPECT_EQ(rank_one.normal_rank, 1);
  EXPECT_EQ(rank_one.zeros.size(), 0);
  // Nothing passes: the zeros are the poles.
  const ContinuousSystem<> nothing{MatrixXd{{-1.0}}, MatrixXd{{0.0}}, MatrixXd{{1.0}},
                                   MatrixXd::Zero(1, 1)};
  const auto zero = transmission_zeros(nothing).value();
  EXPECT_EQ(zero.normal_rank, 0);
  EXPECT_LE(zero.zeros.size(), 1);
  EXPECT_EQ(transmission_zeros(ContinuousSystem<>{MatrixXd(0, 0), MatrixXd(0, 1), MatrixXd(1, 0),
                                                  MatrixXd::Ones(1, 1)})
                .value()
                .normal_rank,
            1);
}

// The quadruple tank's plant of Johansson (IEEE Trans. Control Systems Technology 8 (2000)) with
// its right half-plane zero: det G = 0 where (1 + sT₃)(1 + sT₄) = (1 - γ₁)(1 - γ₂)/(γ₁γ₂).
TEST(TransmissionZeros, QuadrupleTank) {
  const double t1 = 63.0;
  const double t2 = 91.0;
  const double t3 = 39.0;
  const double t4 = 56.0;
  const double g1 = 0.43;
  const double g2 = 0.34;
  const ContinuousSystem<> tanks{
      MatrixXd{
          {-1 / t1, 0, 1 / t3, 0}, {0, -1 / t2, 0, 1 / t4}, {0, 0, -1 / t3, 0}, {0, 0, 0, -1 / t4}},
      MatrixXd{{g1, 0}, {0, g2}, {0, 1 - g2}, {1 - g1, 0}}, MatrixXd{{1, 0, 0, 0}, {0, 1, 0, 0}},
      MatrixXd::Zero(2, 2)};
  const auto found = transmission_zeros(tanks).value();
  ASSERT_EQ(found.zeros.size(), 2);
  const double product = (1.0 - g1) * (1.0 - g2) / (g1 * g2);
  for (const Complex& z : found.zeros) {
    EXPECT_LE(std::abs((1.0 + z * t3) * (1.0 + z * t4) - product), 1e-12 * product);
  }
  EXPECT_GT(found.zeros.real().maxCoeff(), 0.0);
  // In other units of states, inputs and outputs they are the same.
  ContinuousSystem<> scaled = test::rescaled(tanks, Eigen::Vector4d(1e6, 1e-5, 1.0, 1e3));
  scaled.B.col(1) *= 1e7;
  scaled.C.row(0) *= 1e-6;
  const auto again = transmission_zeros(scaled).value();
  ASSERT_EQ(again.zeros.size(), 2);
  for (const Complex& z : again.zeros) {
    EXPECT_LE(std::abs((1.0 + z * t3) * (1.0 + z * t4) - product), 1e-9 * product);
  }
}

TEST(TransmissionZeros, Errors) {
  Random random(1);
  ContinuousSystem<> s = test::random_system(random, 3, 1, 1);
  EXPECT_TRUE(transmission_zeros(s, -1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(transmission_zeros(s, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(transmission_zeros(DiscreteSystem<>{s.A, s.B, s.C, s.D, Time(0.0)})
                  .error()
                  .is(ArgumentError::not_positive));
  s.A(0, 0) = NAN;
  EXPECT_TRUE(transmission_zeros(s).error().is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::transmission_zeros_test
