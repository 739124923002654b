#include <flyball/classical/transfer_matrix.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/classical/delay_poles.hpp>
#include <flyball/core/random.hpp>
#include <flyball/systems/system_error.hpp>
#include <flyball/systems/transmission_zeros.hpp>

#include "classical/transfer_cases.hpp"
#include "support/oracle.hpp"
#include "support/random_systems.hpp"

namespace flyball::classical::transfer_matrix_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using flyball::test::random_matrix;
using flyball::test::transfer;

/// How far each of some roots is from the nearest of others, and their own sensitivity to rounding
/// of a matrix of that size.
double farthest(const VectorXcd& found, const VectorXcd& expected) {
  double worst = 0.0;
  for (const Complex& root : expected) {
    worst = std::max(worst, (found.array() - root).abs().minCoeff() / (1.0 + std::abs(root)));
  }
  return worst;
}

// G = C(sI - A)⁻¹B + D against the channels' roots, on 10 000 random systems of all shapes.
TEST(TransferMatrix, OfStateSpace) {
  Random random(61);
  double worst = 0.0;
  for (int trial = 0; trial < 10000; ++trial) {
    const auto n = static_cast<Index>(random.bits() % 6);
    const auto m = static_cast<Index>(1 + random.bits() % 2);
    const auto p = static_cast<Index>(1 + random.bits() % 2);
    ContinuousSystem<> s{random_matrix(random, n, n), random_matrix(random, n, m),
                         random_matrix(random, p, n), random_matrix(random, p, m)};
    if (random.bits() % 2 == 0) {
      s.D.setZero();
    }
    const auto G = TransferMatrix::of(s).value();
    const double w = std::exp(2.0 * random.normal());
    const MatrixXcd expected = flyball::test::response(s.A, s.B, s.C, s.D, Complex(0.0, w));
    const MatrixXcd resolvent =
        flyball::test::response(s.A, MatrixXd::Identity(n, n), MatrixXd::Identity(n, n),
                                MatrixXd::Zero(n, n), Complex(0.0, w));
    const double size =
        s.C.norm() * s.B.norm() * resolvent.norm() * (1.0 + resolvent.norm() * s.A.norm()) +
        s.D.norm() + 1e-300;
    worst = std::max(worst, (G.response(w) - expected).norm() / size);
  }
  EXPECT_LE(worst, 1e-11);
}

// Poles and zeros of order 20 come through transfer function and back to their own condition: what
// changes of A by rounding move them by.
TEST(TransferMatrix, OrderTwentyThereAndBack) {
  Random random(20);
  for (int trial = 0; trial < 40; ++trial) {
    const Index n = 20;
    ContinuousSystem<> s{random_matrix(random, n, n), random_matrix(random, n, 1),
                         random_matrix(random, 1, n), MatrixXd::Zero(1, 1)};
    const VectorXcd poles_before = flyball::test::eigenvalues(s.A);
    const VectorXcd zeros_before = transmission_zeros(s).value().zeros;
    const auto G = channel_of(s).value();
    ASSERT_EQ(G.poles().size(), 20);
    ASSERT_EQ(G.zeros().size(), 19);
    const auto back = G.to_state_space().value();
    const VectorXcd poles_after = rightmost_poles(DelaySystem::create(back).value()).value().poles;
    const VectorXcd zeros_after = transmission_zeros(back).value().zeros;
    // The same data in its last digits.
    ContinuousSystem<> moved = s;
    double condition_poles = 0.0;
    double condition_zeros = 0.0;
    for (int draw = 0; draw < 3; ++draw) {
      moved.A = s.A + 1e-12 * s.A.cwiseProduct(random_matrix(random, n, n));
      condition_poles =
          std::max(condition_poles, farthest(flyball::test::eigenvalues(moved.A), poles_before));
      condition_zeros = std::max(condition_zeros,
                                 farthest(transmission_zeros(moved).value().zeros, zeros_before));
    }
    EXPECT_LE(farthest(poles_after, poles_before), 0.1 * condition_poles + 1e-13) << trial;
    EXPECT_LE(farthest(G.zeros(), zeros_before), 0.3 * condition_zeros + 1e-12) << trial;
    EXPECT_EQ(zeros_after.size(), 19) << trial;
  }
}

// What zero entries cut off is no pole of a channel; what only cancels stays until it is asked for.
TEST(TransferMatrix, ChannelsOfADiagonalSystem) {
  const ContinuousSystem<> s{MatrixXd{{-1.0, 0.0}, {0.0, -2.0}}, MatrixXd::Identity(2, 2),
                             MatrixXd::Identity(2, 2), MatrixXd::Zero(2, 2)};
  const auto G = TransferMatrix::of(s).value();
  EXPECT_EQ(G(0, 0).poles(), VectorXcd::Constant(1, -1.0));
  EXPECT_TRUE(G(0, 1).is_zero());
  EXPECT_EQ(channel_of(s, 0, 0, false).value().poles().size(), 2);
  EXPECT_LE((G.dc_gain() - MatrixXd{{1.0, 0.0}, {0.0, 0.5}}).norm(), 1e-15);
  // The same turned by 45 degrees: nothing is zero, (s + 2) over itself stays.
  const double c = std::sqrt(0.5);
  const MatrixXd T{{c, -c}, {c, c}};
  const auto turned =
      TransferMatrix::of(ContinuousSystem<>{T * s.A * T.transpose(), T, T.transpose(), s.D})
          .value();
  EXPECT_EQ(turned(0, 0).poles().size(), 2);
  EXPECT_EQ(turned.without_cancellations(1e-10).value()(0, 0).poles().size(), 1);
}

// 1/(s + 1) in all four channels is of one state; Rosenbrock's G of two.
TEST(TransferMatrix, MinimalRealization) {
  const auto lag = transfer({1.0}, {1.0, 1.0});
  const auto same = TransferMatrix::create({{lag, lag}, {lag, lag}}).value();
  EXPECT_EQ(same.to_continuous().value().A.rows(), 1);
  const auto G = TransferMatrix::create(
                     {{lag, transfer({2.0}, {1.0, 3.0})}, {lag, transfer({1.0}, {1.0, 1.0})}})
                     .value();
  const auto s = G.to_continuous().value();
  EXPECT_EQ(s.A.rows(), 3);
  const auto zeros = transmission_zeros(s).value();
  ASSERT_EQ(zeros.zeros.size(), 1);
  EXPECT_LE(std::abs(zeros.zeros(0) - 1.0), 1e-12);  // 1/(s+1) = 2/(s+3) at s = 1
  for (const double w : {0.0, 1.0, 10.0}) {
    EXPECT_LE((flyball::test::response(s.A, s.B, s.C, s.D, Complex(0.0, w)) - G.response(w)).norm(),
              1e-13);
  }
}

// Wood and Berry's column: dead times of every channel, in a loop exact.
TEST(TransferMatrix, DeadTimesOfChannels) {
  const auto column =
      TransferMatrix::create(
          {{transfer({12.8}, {16.7, 1.0}, 1.0), transfer({-18.9}, {21.0, 1.0}, 3.0)},
           {transfer({6.6}, {10.9, 1.0}, 7.0), transfer({-19.4}, {14.4, 1.0}, 3.0)}})
          .value();
  EXPECT_TRUE(column.has_delay());
  const auto s = column.to_delay_system().value();
  EXPECT_EQ(s.states(), 4);
  const auto loop = feedback(s, DelaySystem::gain(0.01 * MatrixXd::Identity(2, 2)).value()).value();
  for (const double w : {0.0, 0.1, 2.0}) {
    const MatrixXcd G = column.response(w);
    EXPECT_LE((s.response(w) - G).norm(), 1e-13 * G.norm());
    const MatrixXcd y = loop.response(w);
    EXPECT_LE((y + 0.01 * G * y - G).norm(), 1e-13 * G.norm());
  }
  EXPECT_TRUE(column.to_continuous().error().is(TransferError::delay_in_loop));
}

TEST(TransferMatrix, Discrete) {
  Random random(2);
  const DiscreteSystem<> s{0.3 * random_matrix(random, 3, 3), random_matrix(random, 3, 2),
                           random_matrix(random, 2, 3), random_matrix(random, 2, 2), Time(0.1)};
  const auto G = TransferMatrix::of(s).value();
  const auto back = G.to_discrete(1e-9).value();
  for (const double w : {0.0, 3.0, 20.0}) {
    const MatrixXcd expected =
        flyball::test::response(s.A, s.B, s.C, s.D, std::polar(1.0, 0.1 * w));
    EXPECT_LE((G.response(w) - expected).norm(), 1e-12 * expected.norm());
    EXPECT_LE((flyball::test::response(back.A, back.B, back.C, back.D, std::polar(1.0, 0.1 * w)) -
               expected)
                  .norm(),
              1e-11 * expected.norm());
  }
}

TEST(TransferMatrix, Errors) {
  const auto G = transfer({1.0}, {1.0, 1.0});
  const auto sampled =
      TransferFunction::create(VectorXd::Ones(1), VectorXd{{1.0, 0.5}}, Time(0.1)).value();
  EXPECT_TRUE(TransferMatrix::create(std::vector<std::vector<TransferFunction>>{})
                  .error()
                  .is(ArgumentError::empty));
  EXPECT_TRUE(TransferMatrix::create({{G, G}, {G}}).error().is(ArgumentError::wrong_shape));
  EXPECT_EQ(to_string(TransferMatrix::create({{G, sampled}}).error()),
            "transfer matrix: the sample period of entry (0, 1) is 0.1 s; it must be continuous, "
            "the first's; discretize or resample one of them");
  const auto improper = ZeroPoleGain::create(VectorXcd::Zero(1), VectorXcd(0), 1.0).value();
  EXPECT_TRUE(TransferMatrix::create({{improper}})
                  .value()
                  .to_delay_system()
                  .error()
                  .is(TransferError::improper));
  EXPECT_TRUE(TransferMatrix::create({{sampled}})
                  .value()
                  .to_continuous()
                  .error()
                  .is(TransferError::period_mismatch));
  const ContinuousSystem<> s{MatrixXd::Ones(1, 1), MatrixXd::Ones(1, 1), MatrixXd::Ones(1, 1),
                             MatrixXd::Zero(1, 1)};
  EXPECT_TRUE(channel_of(s, 1, 0).error().is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::classical::transfer_matrix_test
