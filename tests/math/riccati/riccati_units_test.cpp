#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/riccati/riccati.hpp>

#include "support/laws.hpp"
#include "support/oracle.hpp"
#include "support/random_systems.hpp"

namespace flyball::riccati_units_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using test::LongMatrix;
using test::scalar;
using test::wide;

Eigen::VectorXi powers(Random& random, Index count, int most) {
  return Eigen::VectorXi::NullaryExpr(
      count, [&] { return static_cast<int>(std::lround(random.uniform(-most, most))); });
}

/// M_ij 2^(row_i + column_j + all).
MatrixXd in_units(const MatrixXd& M, const Eigen::VectorXi& row, const Eigen::VectorXi& column,
                  int all = 0) {
  MatrixXd scaled = M;
  for (Index j = 0; j < M.cols(); ++j) {
    for (Index i = 0; i < M.rows(); ++i) {
      scaled(i, j) = std::ldexp(M(i, j), row(i) + column(j) + all);
    }
  }
  return scaled;
}

// x = a² x b² ... with q = 0: X = R(A² - 1)/B², K = (A² - 1)/(A B), for weights of any size.
TEST(RiccatiUnits, WeightsOfAnySize) {
  for (const double r : {1e-310, 1e-300, 1e-200, 1e-155, 1e-30, 1e30, 1e155, 1e200, 1e300}) {
    const auto s = dare(scalar(2), scalar(1), scalar(0), scalar(r));
    ASSERT_TRUE(s.has_value()) << r << to_string(s.error());
    EXPECT_NEAR(s->X(0, 0) / r, 3.0, r < 1e-305 ? 1e-12 : 1e-14) << r;
    EXPECT_NEAR(s->K(0, 0), 1.5, 1e-14) << r;
  }
  const MatrixXd A = (MatrixXd(2, 2) << 2, 1, 0, 1).finished();
  const MatrixXd B = (MatrixXd(2, 1) << 0, 1).finished();
  const MatrixXd I = MatrixXd::Identity(2, 2);
  for (const double w : {1e-300, 1e-100, 1.0, 1e150, 1e300}) {
    const auto d = dare(A, B, w * I, scalar(w)).value();
    const auto c = care(A, B, w * I, scalar(w)).value();
    EXPECT_LE((d.K - (MatrixXd(1, 2) << 2.6404768030109373, 2.2400793355181503).finished()).norm(),
              1e-14)
        << w;
    EXPECT_LE((c.K - (MatrixXd(1, 2) << 13.928203230275509, 6.464101615137754).finished()).norm(),
              1e-13)
        << w;
  }
  // X has no double, K has: it is told, not answered with an infinite X.
  const auto beyond = dare(scalar(2), scalar(1e-10), scalar(0), scalar(1e300));
  ASSERT_FALSE(beyond.has_value());
  EXPECT_TRUE(beyond.error().is(RiccatiError::overflow)) << to_string(beyond.error());
}

// Time, states, inputs and cost in other units: the same X, K and poles in them.
TEST(RiccatiUnits, DoNotMatter) {
  Random random(41);
  for (int trial = 0; trial < 400; ++trial) {
    const Index n = 1 + trial % 5;
    const Index m = 1 + trial % 2;
    const MatrixXd A = test::random_matrix(random, n, n);
    const MatrixXd B = test::random_matrix(random, n, m);
    const MatrixXd Q = MatrixXd::Identity(n, n);
    const MatrixXd R = MatrixXd::Identity(m, m);
    const Eigen::VectorXi x = powers(random, n, 60);
    const Eigen::VectorXi u = powers(random, m, 100);
    const int weight = powers(random, 1, 300)(0);
    const int rate = powers(random, 1, 200)(0);
    for (const bool continuous : {false, true}) {
      const int t = continuous ? rate : 0;
      const auto solve = [&](const MatrixXd& a, const MatrixXd& b, const MatrixXd& q,
                             const MatrixXd& r) {
        return continuous ? care(a, b, q, r) : dare(a, b, q, r);
      };
      const auto plain = solve(A, B, Q, R).value();
      const auto other = solve(in_units(A, x, -x, t), in_units(B, x, u),
                               in_units(Q, -x, -x, weight + t), in_units(R, u, u, weight - t));
      ASSERT_TRUE(other.has_value()) << trial << to_string(other.error());
      const double close = 1e-13 * std::max(1.0, plain.condition);
      EXPECT_LE((in_units(other->X, x, x, -weight) - plain.X).norm(), close * plain.X.norm())
          << trial;
      EXPECT_LE((in_units(other->K, u, x, -t) - plain.K).norm(), close * plain.K.norm()) << trial;
      EXPECT_LE(other->residual, 1e-13);
    }
  }
}

// Whatever finite entries: an answer stabilises, and X and K satisfy the closed loop's equation.
TEST(RiccatiUnits, AnyFiniteEntries) {
  constexpr double palette[] = {0.0,    0.0,   1.0,     -1.0,    2.2e-16, 5e-324, 1e-310, 1e20,
                                -1e-20, 1e154, -1e-154, 1.7e308, 3.0,     -2.0,   0.5};
  Random random(43);
  const auto any = [&](Index rows, Index columns) {
    return MatrixXd(MatrixXd::NullaryExpr(rows, columns, [&] {
      return palette[static_cast<std::size_t>(random.uniform() * std::size(palette))];
    }));
  };
  const auto symmetric = [&](Index size) {
    const MatrixXd half = any(size, size);
    return MatrixXd(half.triangularView<Eigen::Lower>().toDenseMatrix() +
                    half.triangularView<Eigen::StrictlyLower>().toDenseMatrix().transpose());
  };
  int answers = 0;
  for (int trial = 0; trial < 1500; ++trial) {
    const Index n = 1 + trial % 3;
    const Index m = 1 + trial % 2;
    const MatrixXd A = any(n, n);
    const MatrixXd B = any(n, m);
    const MatrixXd Q = symmetric(n);
    const MatrixXd R = symmetric(m);
    for (const bool continuous : {false, true}) {
      const auto s = continuous ? care(A, B, Q, R) : dare(A, B, Q, R);
      if (!s) {
        continue;
      }
      ++answers;
      ASSERT_TRUE(s->X.allFinite() && s->K.allFinite() && s->poles.allFinite()) << trial;
      EXPECT_LE(s->residual, 1e-9);
      const LongMatrix K = wide(s->K);
      const LongMatrix X = wide(s->X);
      const LongMatrix S = wide(A) - wide(B) * K;
      const LongMatrix cost = wide(Q) + K.transpose() * wide(R) * K;
      const LongMatrix XS = X * S;
      const LongMatrix left = continuous ? LongMatrix(XS + XS.transpose() + cost)
                                         : LongMatrix(S.transpose() * XS - X + cost);
      const LongMatrix size = X.cwiseAbs() * S.cwiseAbs();
      const LongMatrix terms =
          (continuous ? LongMatrix(size + size.transpose())
                      : LongMatrix(S.cwiseAbs().transpose() * size + X.cwiseAbs())) +
          wide(Q).cwiseAbs() + K.cwiseAbs().transpose() * wide(R).cwiseAbs() * K.cwiseAbs();
      EXPECT_LE(left.cwiseAbs().maxCoeff(), 1e-10L * terms.maxCoeff())
          << trial << (continuous ? " continuous\n" : " discrete\n") << A << "\n\n"
          << B << "\n\n"
          << Q << "\n\n"
          << R << "\n\n"
          << s->X << "\n\n"
          << s->K;
    }
  }
  EXPECT_GT(answers, 100);
}

// An entry whose square is no double leaves what the same equation without it has.
TEST(RiccatiUnits, AnEntryOfNoWeightChangesNothing) {
  const Eigen::Matrix2d A{{0.0, 1.0}, {0.0, -1.0}};
  const Eigen::Vector2d B(-1.3934326171875, 0.0);
  const Eigen::Matrix2d Q = Eigen::Matrix2d::Identity();
  const Eigen::Matrix<double, 1, 1> R(1.19183349609375);
  const auto without = care(A, B, Q, R).value();
  EXPECT_NEAR(without.K(0, 1), -0.402391187621348, 1e-14);
  for (const double entry : {-1e-20, -1e-154, 1e-154, -1e-160, 1e-300, -5e-324}) {
    Eigen::Matrix2d with = A;
    with(1, 0) = entry;
    const auto solution = care(with, B, Q, R).value();
    EXPECT_LE((solution.K - without.K).norm(), 1e-13) << entry;
    EXPECT_LE((solution.X - without.X).norm(), 1e-13) << entry;
    EXPECT_LE(solution.condition, 100.0) << entry;
  }
}

TEST(RiccatiUnits, PolesWhoseSquaresAreNoDoubles) {
  for (const double pole : {-1e-150, -1e-200, 3e-300, 1e-310}) {
    const Eigen::Matrix2d A = Eigen::Vector2d(0.0, pole).asDiagonal();
    const auto solution = dare(A, Eigen::Vector2d(2.2e-16, 0.0),
                               Eigen::Vector2d(0.64, 0.0).asDiagonal().toDenseMatrix(),
                               Eigen::Matrix<double, 1, 1>(0.5))
                              .value();
    const Eigen::Vector2d poles = solution.poles.real();
    EXPECT_LE(poles.cwiseAbs().minCoeff(), 1e-13 * std::abs(pole)) << pole;
    EXPECT_NEAR(poles.sum() / pole, 1.0, 1e-12) << pole;
  }
}

// What is small beside other entries has its value: X where weights and plants are far apart. The
// closed forms of X = a²X - n²/r and 2aX = n²/r; what the inputs add is below the last digit.
TEST(RiccatiUnits, SmallAnswersAreNotLost) {
  const double a = 0.76641845703125;
  const auto weights = dare(scalar(a), Eigen::RowVector3d(-1e20, -0.47, 1e155), scalar(0),
                            1e300 * MatrixXd::Identity(3, 3), Eigen::RowVector3d(-3.0, 0.0, 0.0));
  ASSERT_TRUE(weights.has_value()) << to_string(weights.error());
  EXPECT_NEAR(weights->X(0, 0) / (-9e-300 / (1.0 - a * a)), 1.0, 1e-13);
  EXPECT_NEAR(weights->K(0, 0) / -3e-300, 1.0, 1e-13);

  // 2 X₀₀ = -n²/r, 1.03125 X₀₁ = X₀₀ and 0.03125 X₁₁ = X₀₁.
  const MatrixXd A = (MatrixXd(2, 2) << -1.0, 1.0, 0.0, -0.03125).finished();
  const auto cross = care(A, Eigen::Vector2d(0.0, -0.5), MatrixXd::Zero(2, 2), scalar(1e300),
                          Eigen::Vector2d(-0.5, 0.0));
  ASSERT_TRUE(cross.has_value()) << to_string(cross.error());
  EXPECT_NEAR(cross->X(0, 0) / -1.25e-301, 1.0, 1e-13);
  EXPECT_NEAR(cross->X(0, 1) / (-1.25e-301 / 1.03125), 1.0, 1e-13);
  EXPECT_NEAR(cross->X(1, 1) / (-1.25e-301 / 1.03125 / 0.03125), 1.0, 1e-13);

  // A plant of -1.7e308 has X = q/3.4e308 and K = (b X + n)/r.
  const auto fast = care(-1.7e308 * MatrixXd::Identity(2, 2), Eigen::Vector2d(1e8, 1.0),
                         Eigen::Vector2d(0.75, 2.0).asDiagonal().toDenseMatrix(), scalar(1e-155),
                         Eigen::Vector2d(-1e-300, 0.0));
  ASSERT_TRUE(fast.has_value()) << to_string(fast.error());
  EXPECT_NEAR(fast->X(0, 0) / (0.75 / 1.7e308 / 2.0), 1.0, 1e-12);
  EXPECT_NEAR(fast->X(1, 1) / (1.0 / 1.7e308), 1.0, 1e-12);
  EXPECT_NEAR(fast->K(0, 0) / -7.794117647058824e-146, 1.0, 1e-12);

  // K = aXb/(r + b²X) for an input whose square weight is the least of the doubles.
  const auto least = dare(scalar(-0.625), Eigen::RowVector2d(1.5, 1e25), scalar(1e-308),
                          10.0 * MatrixXd::Identity(2, 2));
  ASSERT_TRUE(least.has_value()) << to_string(least.error());
  const double X = 1e-308 / (1.0 - 0.625 * 0.625);
  EXPECT_NEAR(least->X(0, 0) / X, 1.0, 1e-13);
  EXPECT_NEAR(least->K(1, 0) / (-0.625 * X * 1e24), 1.0, 1e-13);
}

// The poles are those of A - BK with the K that is answered, however small.
TEST(RiccatiUnits, PolesOfWhatIsAnswered) {
  const auto slow = dare(scalar(-1e-300), Eigen::RowVector2d(-0.54, -5e-324), scalar(4.84e-32),
                         0.25 * MatrixXd::Identity(2, 2))
                        .value();
  EXPECT_EQ(slow.poles(0), -1e-300);

  const auto cheap = dare(scalar(2.3e-308), Eigen::RowVector2d(1.0, 1.0), scalar(1.0),
                          Eigen::Vector2d(1e-154, 1e300).asDiagonal().toDenseMatrix())
                         .value();
  EXPECT_EQ(cheap.K(0, 0), 2.3e-308);
  EXPECT_EQ(cheap.poles(0), 0.0);

  const auto driven = dare(MatrixXd::Zero(2, 2), Eigen::Vector2d(0.5, 0.0), MatrixXd::Zero(2, 2),
                           scalar(1e300), Eigen::Vector2d(-0.75, 1.5))
                          .value();
  const Eigen::Vector2d poles = driven.poles.real();
  EXPECT_EQ(poles.cwiseAbs().minCoeff(), 0.0);
  EXPECT_NEAR(poles.sum() / 3.75e-301, 1.0, 1e-14);

  const MatrixXd A = 2.3e-308 * MatrixXd::Identity(4, 4);
  const auto subnormal =
      dare(A, Eigen::Vector4d(2.0, 1.75, 1e-20, -3.0),
           Eigen::Vector4d(1e20, 1.0, 1e-8, 2.0).asDiagonal().toDenseMatrix(), scalar(1.0))
          .value();
  EXPECT_EQ((subnormal.poles.real().array() == 2.3e-308).count(), 3);
}

// States whose units, √X_ii, are far apart: each pole p is an eigenvalue of A - BK for errors of
// rounding in the units that were given, σ_min(A - BK - p) <= ε-ish of its norm.
TEST(RiccatiUnits, PolesInTheGivenUnits) {
  const auto expect_poles = [](const MatrixXd& A, const MatrixXd& B, const RiccatiSolution& s) {
    const MatrixXd S = (wide(A) - wide(B) * wide(s.K)).cast<double>();
    const double size = (A.cwiseAbs() + B.cwiseAbs() * s.K.cwiseAbs()).maxCoeff();
    for (const std::complex<double>& pole : s.poles) {
      Eigen::MatrixXcd shifted = S.cast<std::complex<double>>();
      shifted.diagonal().array() -= pole;
      const Eigen::VectorXd values = test::singular_values(shifted);
      EXPECT_LE(values(values.size() - 1), 1e-13 * size) << pole;
    }
  };
  const Eigen::Vector4d column(-1.5, 5.3453125, 4.09296875, 1.68359375);
  MatrixXd A = column * Eigen::RowVector4d(0.0, 1.0, -1.0 / 3.0, 1.0);
  MatrixXd B = Eigen::Vector4d(-1.0, -0.000509765625, 11.140625, -8.0e-9);
  MatrixXd Q = MatrixXd::Zero(4, 4);
  Q.bottomRightCorner(3, 3) = Eigen::Vector3d(0.3, 8.2, 7.6).asDiagonal();
  expect_poles(A, B, dare(A, B, Q, scalar(0.73), Eigen::Vector4d(0.34, 0.0, 0.0, 0.0)).value());

  // Seven equal poles, coupled by 1e-8.
  A = -0.523681640625 * MatrixXd::Identity(7, 7);
  A.diagonal(1).setConstant(1e-8);
  B = (MatrixXd(7, 1) << 1.9, 2.0, -1.3, 1e-8, 0.17, -1.87, -0.91).finished();
  Q = MatrixXd::Zero(7, 7);
  Q(0, 0) = 0.25;
  const MatrixXd N = (MatrixXd(7, 1) << 0.36, -0.7, 1e-20, 2.0, -1.3, -0.28, -0.5).finished();
  expect_poles(A, B, care(A, B, Q, scalar(2.0), N).value());
}

// A chain whose link back is a gain: in the units of the solution 1 and -0.37 are 2^1000 apart, and
// the pair of poles is theirs.
TEST(RiccatiUnits, PolesOfStatesFarApart) {
  MatrixXd A = -5e-324 * MatrixXd::Identity(8, 8);
  A.diagonal(1).setOnes();
  MatrixXd B = MatrixXd::Zero(8, 4);
  B(0, 0) = -1e154;
  B(1, 1) = 1e20;
  B(3, 3) = -1.08062744140625;
  MatrixXd N = MatrixXd::Zero(8, 4);
  N(0, 1) = N(1, 2) = N(2, 3) = 1.0;
  N.row(7) << -1.745849609375, -1.75091552734375, -1e-154, 0.5;
  MatrixXd Q(8, 8);
  const double steps[] = {-1.152587890625,   1.0,
                          1.82421875,        -5e-324,
                          -0.95111083984375, -1.43072509765625,
                          -1.1966552734375,  -0.08001708984375};
  for (Index i = 0; i < 8; ++i) {
    Q.block(i, i, 8 - i, 8 - i).setConstant(steps[i]);
  }
  const auto s = dare(A, B, Q, MatrixXd::Identity(4, 4), N).value();
  // Of [0 1; -B K], the chain's states two and three: x² + k₃ x + k₂.
  const double k2 = -1.08062744140625 * s.K(3, 2);
  const double k3 = -1.08062744140625 * s.K(3, 3);
  const std::complex<double> pole(-0.5 * k3, std::sqrt(k2 - 0.25 * k3 * k3));
  EXPECT_LE((s.poles.array() - pole).abs().minCoeff(), 1e-15);
  EXPECT_LE((s.poles.array() - std::conj(pole)).abs().minCoeff(), 1e-15);
}

// What the doubles cannot hold is refused: X's small entries have no double, and are not nothing.
TEST(RiccatiUnits, WhatIsLostIsRefused) {
  const MatrixXd A = (MatrixXd(2, 2) << -0.25, -1e-16, 1e155, 1.0).finished();
  const MatrixXd B = (MatrixXd(2, 2) << 0.0, 5e-324, 1.5, 1.0).finished();
  const auto lost = care(A, B, MatrixXd(1e-155 * MatrixXd::Identity(2, 2)),
                         Eigen::Vector2d(1e-308, 0.25).asDiagonal().toDenseMatrix());
  ASSERT_FALSE(lost.has_value());
  EXPECT_EQ(lost.error().kind(), ErrorKind::no_answer) << to_string(lost.error());
  const MatrixXd fast = (MatrixXd(2, 2) << 1e20, 2.0, -3.0, 99999999.0).finished();
  const auto cancels = care(fast, Eigen::Vector2d(-1.66748046875, 0.0),
                            Eigen::Vector2d(0.0, 0.5540771484375).asDiagonal().toDenseMatrix(),
                            scalar(0.8377685546875), Eigen::Vector2d(-1.12225341796875, 0.0));
  ASSERT_FALSE(cancels.has_value());
  EXPECT_EQ(cancels.error().kind(), ErrorKind::no_answer) << to_string(cancels.error());
}

}  // namespace
}  // namespace flyball::riccati_units_test
