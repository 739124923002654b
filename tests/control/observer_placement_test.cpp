#include <flyball/control/observer_placement.hpp>

#include <algorithm>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/control/lqr.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/estimation/observer.hpp>
#include <flyball/systems/discretize.hpp>

#include "support/oracle.hpp"
#include "support/random_systems.hpp"

namespace flyball::observer_placement_test {
namespace {

using namespace flyball::literals;
using Complex = std::complex<double>;

ContinuousSystem<2, 1, 1> motor() {
  return {.A = Eigen::Matrix2d{{0.0, 1.0}, {0.0, -4.0}},
          .B = Eigen::Vector2d(0.0, 2.0),
          .C = Eigen::RowVector2d(1.0, 0.0),
          .D = Eigen::Matrix<double, 1, 1>(0.0)};
}

/// The largest distance between two sets of poles, matched greedily.
double distance(const Eigen::VectorXcd& a, const Eigen::VectorXcd& b) {
  std::vector<Complex> left(b.begin(), b.end());
  double worst = 0.0;
  for (const Complex pole : a) {
    const auto nearest = std::min_element(left.begin(), left.end(), [&](Complex x, Complex y) {
      return std::abs(x - pole) < std::abs(y - pole);
    });
    worst = std::max(worst, std::abs(*nearest - pole));
    left.erase(nearest);
  }
  return worst;
}

// s² + (l₁ + 4) s + 4 l₁ + l₂ = (s + 10)(s + 20): l₁ = 26, l₂ = 96.
TEST(PlaceObserver, Continuous) {
  const auto observer =
      place_observer(motor(), Eigen::Vector2cd(Complex(-10.0), Complex(-20.0))).value();
  EXPECT_NEAR(observer.L(0), 26.0, 1e-12);
  EXPECT_NEAR(observer.L(1), 96.0, 1e-11);
  EXPECT_FALSE(observer.K);
  const ContinuousSystem<> plant{motor().A, motor().B, motor().C, motor().D};
  const auto system = observer_system(plant, observer.L).value();
  EXPECT_LT(distance(poles(system).value(), observer.poles), 1e-11);
}

// (Aᵀ - CᵀLᵀ) of any plant, and A K = L (Theorem 9.2.2).
TEST(PlaceObserver, DiscreteInBothForms) {
  const auto plant = discretize(motor(), 20_ms).value();
  const auto observer =
      place_observer(plant, Eigen::Vector2cd(Complex(0.5, 0.2), Complex(0.5, -0.2))).value();
  ASSERT_TRUE(observer.K);
  EXPECT_NEAR((plant.A * *observer.K - observer.L).norm(), 0.0, 1e-13 * observer.L.norm());
  const Eigen::MatrixXd closed = plant.A - observer.L * plant.C;
  EXPECT_LT(distance(test::eigenvalues(closed), observer.poles), 1e-12);
  // Both forms see the same error dynamics: x_hat of one step is that of `Observer` predicted.
  LuenbergerObserver<2, 1, 1> one(plant, observer.L);
  Observer<2, 1, 1> two(plant, *observer.K);
  Eigen::Vector2d x(1.0, -3.0);
  for (int k = 0; k < 40; ++k) {
    const Eigen::Matrix<double, 1, 1> u(0.1 * k - 1.0);
    const Eigen::Matrix<double, 1, 1> y = plant.C * x;
    two.update(y, u);
    two.predict(u);
    EXPECT_TRUE(one.step(u, y));
    ASSERT_NEAR((one.x_hat() - two.x_hat()).norm(), 0.0, 1e-12);
    x = plant.A * x + plant.B * u;
  }
  EXPECT_NEAR((one.x_hat() - x).norm(), 0.0, 1e-9);
}

// A delay of one sample has no inverse: there is L, and no K.
TEST(PlaceObserver, APlantWithADelayHasOnlyTheOneStepForm) {
  const DiscreteSystem<> plant{Eigen::Matrix2d{{0.9, 0.0}, {1.0, 0.0}}, Eigen::Vector2d(1.0, 0.0),
                               Eigen::RowVector2d(0.0, 1.0), Eigen::MatrixXd::Zero(1, 1), 20_ms};
  const auto observer = place_observer(plant, Eigen::Vector2cd(Complex(0.1), Complex(0.2))).value();
  EXPECT_FALSE(observer.K);
  EXPECT_LT(distance(test::eigenvalues(plant.A - observer.L * plant.C), observer.poles), 1e-12);
}

TEST(PlaceObserver, WhatNoOutputShowsIsNamed) {
  auto plant = motor();
  plant.C << 0.0, 1.0;  // the velocity tells nothing of the position
  const auto refused = place_observer(plant, Eigen::Vector2cd(Complex(-10.0), Complex(-20.0)));
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(PolePlacementError::not_observable));
  EXPECT_EQ(refused.error().where(), "place_observer");
  const auto kept = place_observer(plant, Eigen::Vector2cd(Complex(0.0), Complex(-20.0))).value();
  EXPECT_EQ(kept.unobservable.size(), 1u);
  EXPECT_TRUE(place_observer(plant, Eigen::Vector2cd(Complex(0.0, 1.0), Complex(-20.0)))
                  .error()
                  .is(PolePlacementError::not_conjugate));
  plant.C(0) = std::nan("");
  EXPECT_TRUE(place_observer(plant, Eigen::Vector2cd(Complex(0.0), Complex(-20.0)))
                  .error()
                  .is(ArgumentError::not_finite));
}

// Section 9.2.2: the poles of plant and observer together under u = -K x_hat are those of A - BK
// and of A - LC, whatever K and L are. The joint matrix is taken from the objects that run: a unit
// vector of [x; x_hat] goes through one period.
TEST(SeparationPrinciple, OfTheJointLoop) {
  test::RandomSystems systems(41, test::Plane::z, 4);
  for (int trial = 0; trial < 60; ++trial) {
    const auto s =
        systems.next(trial % 2 == 0 ? test::SystemClass::stable : test::SystemClass::unstable);
    const Eigen::Index n = s.A.rows();
    const DiscreteSystem<> plant{s.A, s.B, s.C, s.D, 20_ms};
    const auto regulator = lqr(plant, Eigen::MatrixXd(Eigen::MatrixXd::Identity(n, n)),
                               Eigen::MatrixXd(Eigen::MatrixXd::Identity(s.B.cols(), s.B.cols())));
    const auto filter =
        kalman_gain(plant, Eigen::MatrixXd(Eigen::MatrixXd::Identity(n, n)),
                    Eigen::MatrixXd(Eigen::MatrixXd::Identity(s.C.rows(), s.C.rows())));
    if (!regulator || !filter) {
      continue;
    }
    LuenbergerObserver<> observer(plant, filter->L);
    Eigen::MatrixXd joint(2 * n, 2 * n);
    for (Eigen::Index i = 0; i < 2 * n; ++i) {
      const Eigen::VectorXd unit = Eigen::VectorXd::Unit(2 * n, i);
      const Eigen::VectorXd x = unit.head(n);
      observer.reset(unit.tail(n));
      const Eigen::VectorXd u = -regulator->K * observer.x_hat();
      ASSERT_TRUE(observer.step(u, plant.C * x + plant.D * u));
      joint.col(i) << plant.A * x + plant.B * u, observer.x_hat();
    }
    Eigen::VectorXcd apart(2 * n);
    apart << regulator->poles, filter->poles;
    // A pole that is repeated in both is known to the root of the rounding.
    EXPECT_LT(distance(test::eigenvalues(joint), apart), 1e-6 * std::max(1.0, joint.norm()))
        << trial;
    EXPECT_LT(test::eigenvalues(joint).cwiseAbs().maxCoeff(), 1.0);
  }
}

}  // namespace
}  // namespace flyball::observer_placement_test
