#include <flyball/control/continuous_lqr.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/control/finite_horizon_lqr.hpp>
#include <flyball/control/integral_control.hpp>
#include <flyball/core/random.hpp>
#include <flyball/math/riccati/riccati.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

#include "support/oracle.hpp"

namespace flyball::continuous_lqr_test {
namespace {

using namespace flyball::literals;

Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

// Double integrator with Q = I, R = 1: S = [√3 1; 1 √3], K = [1 √3].
TEST(ContinuousLqr, DoubleIntegrator) {
  Eigen::Matrix2d A;
  A << 0.0, 1.0, 0.0, 0.0;
  const Eigen::Vector2d B(0.0, 1.0);
  const auto design =
      continuous_lqr(A, B, Eigen::Matrix2d::Identity(), Eigen::MatrixXd::Ones(1, 1)).value();
  EXPECT_NEAR(design.K(0, 0), 1.0, 1e-13);
  EXPECT_NEAR(design.K(0, 1), std::sqrt(3.0), 1e-13);
  EXPECT_NEAR(design.S(0, 0), std::sqrt(3.0), 1e-13);
  EXPECT_LT(design.poles.real().maxCoeff(), 0.0);
}

// The closed loop's poles are the stable half of the Hamiltonian's spectrum, which is symmetric to
// the imaginary axis.
TEST(ContinuousLqr, PolesAreTheHamiltoniansStableHalf) {
  Random random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    const Eigen::Index n = 1 + trial % 5;
    const Eigen::Index m = 1 + trial % 2;
    const Eigen::MatrixXd A = random_matrix(random, n, n);
    const Eigen::MatrixXd B = random_matrix(random, n, m);
    const Eigen::MatrixXd G = random_matrix(random, n + m, n + m);
    const Eigen::MatrixXd W = G * G.transpose() + 0.1 * Eigen::MatrixXd::Identity(n + m, n + m);
    const Eigen::MatrixXd Q = W.topLeftCorner(n, n);
    const Eigen::MatrixXd R = W.bottomRightCorner(m, m);
    const Eigen::MatrixXd N = W.topRightCorner(n, m);
    const auto design = continuous_lqr(A, B, Q, R, N);
    ASSERT_TRUE(design.has_value()) << to_string(design.error());
    const Eigen::MatrixXd R_inverse = test::inverse(R);
    const Eigen::MatrixXd A_shifted = A - B * R_inverse * N.transpose();
    Eigen::MatrixXd H(2 * n, 2 * n);
    H << A_shifted, -B * R_inverse * B.transpose(), -(Q - N * R_inverse * N.transpose()),
        -A_shifted.transpose();
    const Eigen::VectorXcd all = test::eigenvalues(H);
    for (const auto& pole : design->poles) {
      ASSERT_LT(pole.real(), 0.0);
      ASSERT_LT((all.array() - pole).abs().minCoeff(), 1e-5 * (1.0 + std::abs(pole)));
      ASSERT_LT((all.array() + std::conj(pole)).abs().minCoeff(), 1e-5 * (1.0 + std::abs(pole)));
    }
  }
}

// Section 7.7.2: the discrete gains approach the continuous ones as the period goes to zero.
TEST(ContinuousLqr, IsTheLimitOfTheDiscreteOne) {
  const auto elevator = mechanisms::elevator({.kS = 0.0, .kV = 4.0, .kA = 0.3, .kG = 0.0}).value();
  const auto design = continuous_lqr(elevator, bryson({0.02, 0.4}), bryson({12.0})).value();
  static_assert(decltype(design.K)::ColsAtCompileTime == 2);
  double before = 1e300;
  for (const double T : {1e-3, 1e-4, 1e-5}) {
    const auto plant = discretize(elevator, Time(T)).value();
    const double distance =
        (lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value().K - design.K).norm();
    EXPECT_LT(distance, 0.15 * before);
    before = distance;
  }
}

// A long finite horizon starts with the infinite one's gain.
TEST(ContinuousLqr, IsTheLimitOfTheFiniteHorizon) {
  Random random(2);
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::Index n = 1 + trial % 4;
    const Eigen::MatrixXd A = random_matrix(random, n, n);
    const Eigen::MatrixXd B = random_matrix(random, n, 2);
    const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(n, n);
    const Eigen::MatrixXd R = Eigen::MatrixXd::Identity(2, 2);
    const auto infinite = continuous_lqr(A, B, I, R).value();
    const auto finite = continuous_finite_horizon_lqr(A, B, {I, R, {}}, 0.0 * I, 200_s, 3).value();
    ASSERT_LT((finite.S[0] - infinite.S).norm(), 1e-8 * infinite.S.norm());
  }
}

TEST(ContinuousLqi, TracksUnderADisturbance) {
  const auto elevator = mechanisms::elevator({.kS = 0.0, .kV = 4.0, .kA = 0.3, .kG = 0.0}).value();
  const ContinuousSystem<> plant{elevator.A, elevator.B, elevator.C, elevator.D};
  const auto design = continuous_lqi(plant, bryson({0.02, 0.4, 0.01}), bryson({12.0})).value();
  EXPECT_LT(design.poles.real().maxCoeff(), 0.0);
  Eigen::Matrix3d closed;
  closed << plant.A - plant.B * design.K, -plant.B * design.K_I, -plant.C, 0.0;
  EXPECT_LT(test::eigenvalues(closed).real().maxCoeff(), 0.0);
  EXPECT_TRUE(continuous_lqi(ContinuousSystem<>{Eigen::MatrixXd(0, 0), {}, {}, {}},
                             Eigen::MatrixXd::Identity(2, 2), Eigen::MatrixXd::Ones(1, 1))
                  .error()
                  .is(ArgumentError::empty));
}

TEST(ContinuousLqr, Errors) {
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(2, 2);
  const Eigen::MatrixXd B = Eigen::Vector2d(0.0, 1.0);
  const Eigen::MatrixXd r = Eigen::MatrixXd::Ones(1, 1);
  EXPECT_EQ(to_string(continuous_lqr(I, B, I, I).error()),
            "continuous_lqr: R is 2x2; it must be inputs x inputs (1x1)");
  EXPECT_EQ(continuous_lqr(I, B, bryson({0.0, 1.0}), r).error().where(), "bryson");
  EXPECT_TRUE(continuous_lqr(I, B, I, r, Eigen::RowVector2d(0.0, 0.0))
                  .error()
                  .is(ArgumentError::wrong_shape));
  const auto unreachable =
      continuous_lqr(Eigen::Matrix2d(Eigen::Vector2d(1.0, -1.0).asDiagonal()), B, I, r);
  EXPECT_TRUE(unreachable.error().is(RiccatiError::not_stabilizable));
  EXPECT_EQ(unreachable.error().where(), "continuous_lqr");
  // An input of 1e±200 reaches what one of 1 does: whatever fails, that is not the reason.
  const Eigen::MatrixXd chain{{0.0, 1.0}, {0.0, 0.0}};
  for (const double size : {1e-200, 1e-160, 1e160, 1e200}) {
    const auto far = continuous_lqr(chain, size * B, I, r);
    EXPECT_FALSE(!far && far.error().is(RiccatiError::not_stabilizable)) << size;
    const auto sampled = lqr(chain, size * B, I, r);
    EXPECT_FALSE(!sampled && sampled.error().is(RiccatiError::not_stabilizable)) << size;
  }
}

// The plant's zero is at s = 0: the evidence is that of continuous time.
TEST(ContinuousLqr, IntegralsOfWhatCannotBeHeld) {
  const ContinuousSystem<> plant{-Eigen::MatrixXd::Identity(1, 1), Eigen::MatrixXd::Ones(1, 1),
                                 Eigen::MatrixXd::Ones(1, 1), -Eigen::MatrixXd::Ones(1, 1)};
  const auto design =
      continuous_lqi(plant, Eigen::MatrixXd::Identity(2, 2), Eigen::MatrixXd::Identity(1, 1));
  ASSERT_FALSE(design.has_value());
  EXPECT_TRUE(design.error().is(IntegralControlError::not_trackable));
  EXPECT_NE(to_string(design.error()).find("[A, B; C, D]"), std::string::npos);
}

}  // namespace
}  // namespace flyball::continuous_lqr_test
