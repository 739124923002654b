#include <flyball/control/feedforward.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/systems/discretize.hpp>

#include "support/allocation_count.hpp"

namespace flyball::feedforward_test {
namespace {

using namespace flyball::literals;
using mechanisms::FeedforwardGains;
using mechanisms::MechanismKind;

// The book's models; B⁺ as in the reference data (NumPy 1.24.2, numpy.linalg.pinv).
TEST(LinearPlantInversion, PseudoinversesOfTheBook) {
  const Eigen::Vector2d elevator(0.00020770689038283711, 0.07317953761826645);
  const Eigen::MatrixXd inverse = pseudoinverse(elevator).value().X;
  EXPECT_NEAR(inverse(0, 0), 0.038785382876832385, 1e-9 * 0.0388);
  EXPECT_NEAR(inverse(0, 1), 13.664912030806828, 1e-9 * 13.66);
  EXPECT_NEAR(pseudoinverse(Eigen::MatrixXd::Constant(1, 1, 0.6155494833981923)).value().X(0, 0),
              1.6245647620064867, 1e-9 * 1.62);
  Eigen::Matrix2d drive;
  drive << 0.00888344982357952, 0.0012213627658478623, 0.0012213627658478625, 0.008883449823579522;
  const Eigen::MatrixXd inverse_drive = pseudoinverse(drive).value().X;
  EXPECT_NEAR(inverse_drive(0, 0), 114.7377444822541, 1e-9 * 114.7);
  EXPECT_NEAR(inverse_drive(0, 1), -15.774998647037332, 1e-9 * 114.7);
}

// A reference that the plant can follow is followed exactly: r_{k+1} = A r_k + B u gives u back.
TEST(LinearPlantInversion, FollowsWhatThePlantCanDo) {
  const auto elevator = mechanisms::elevator({.kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.6}).value();
  const auto plant = discretize(elevator, 20_ms).value();
  const auto inversion = linear_plant_inversion(plant).value();
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Vector2d r(random.normal(), random.normal());
    const Eigen::Matrix<double, 1, 1> u(random.normal());
    const Eigen::Vector2d r_next = plant.A * r + plant.B * u;
    EXPECT_NEAR(inversion.calculate(r, r_next)(0), u(0), 1e-11);
  }
}

// Section 7.8.3: with B⁺(r_{k+1} - A r_k) beside the feedback, two starts still come together by
// A - BK a step, as without it: the poles are the same. Where the plant has as many inputs as
// states, B B⁺ = I and the error itself goes by A - BK.
TEST(LinearPlantInversion, DoesNotMoveThePoles) {
  Random random(783);
  const auto any = [&](Eigen::Index rows, Eigen::Index columns) {
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); }).eval();
  };
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Index n = 1 + trial % 3;
    const Eigen::Index m = 1 + trial % n;
    const DiscreteSystem<> plant{any(n, n), any(n, m), any(1, n), any(1, m), 20_ms};
    const Eigen::MatrixXd K = any(m, n);
    const auto inversion = linear_plant_inversion(plant).value();
    const Eigen::VectorXd r = any(n, 1);
    const Eigen::VectorXd r_next = any(n, 1);
    const auto next = [&](const Eigen::VectorXd& x, bool with_feedforward) {
      Eigen::VectorXd u = K * (r - x);
      if (with_feedforward) {
        u += inversion.calculate(r, r_next);
      }
      return Eigen::VectorXd(plant.A * x + plant.B * u);
    };
    const Eigen::VectorXd x = any(n, 1);
    const Eigen::VectorXd other = any(n, 1);
    const Eigen::MatrixXd loop = plant.A - plant.B * K;
    for (const bool with : {false, true}) {
      EXPECT_LT((next(x, with) - next(other, with) - loop * (x - other)).norm(),
                1e-11 * (1.0 + inversion.B_pinv().norm()));
    }
    EXPECT_GT((next(x, true) - next(x, false)).norm(), 1e-6);
    if (m == n) {
      EXPECT_LT((next(x, true) - r_next - loop * (x - r)).norm(),
                1e-11 * (1.0 + inversion.B_pinv().squaredNorm()));
    }
  }
}

TEST(LinearPlantInversion, FixedIsDynamicAndAllocatesNothing) {
  const auto elevator = mechanisms::elevator({.kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.6}).value();
  const auto plant = discretize(elevator, 20_ms).value();
  const auto fixed = linear_plant_inversion(plant).value();
  const auto dynamic =
      linear_plant_inversion(DiscreteSystem<>{plant.A, plant.B, plant.C, plant.D, plant.period})
          .value();
  const Eigen::Vector2d r(0.3, 0.1);
  const Eigen::Vector2d r_next(0.31, 0.12);
  EXPECT_DOUBLE_EQ(fixed.calculate(r, r_next)(0), dynamic.calculate(r, r_next)(0));
  if (test::counts_allocations()) {
    const test::AllocationCounter counter;
    EXPECT_TRUE(std::isfinite(fixed.calculate(r, r_next)(0)));
    EXPECT_EQ(counter.count(), 0u);
  }
}

TEST(LinearPlantInversion, Errors) {
  DiscreteSystem<> plant;
  EXPECT_TRUE(linear_plant_inversion(plant).error().is(ArgumentError::not_positive));
}

constexpr FeedforwardGains gains{.kS = 0.2, .kV = 1.5, .kA = 0.25, .kG = 0.7, .angle_offset = 0.1};

TEST(SimpleFeedforward, Terms) {
  const auto arm = SimpleFeedforward::create(MechanismKind::arm, gains, 20_ms).value();
  EXPECT_DOUBLE_EQ(arm.gravity(0.5), 0.7 * std::cos(0.6));
  EXPECT_DOUBLE_EQ(arm.friction(-3.0), -0.2);
  EXPECT_DOUBLE_EQ(arm.friction(0.0), 0.0);
  EXPECT_DOUBLE_EQ(arm.calculate(0.5, -2.0, 4.0), -0.2 - 3.0 + 1.0 + 0.7 * std::cos(0.6));
  const auto elevator = SimpleFeedforward::create(MechanismKind::elevator, gains, 20_ms).value();
  EXPECT_DOUBLE_EQ(elevator.gravity(123.0), 0.7);
  EXPECT_DOUBLE_EQ(elevator.disturbance(0.0, 1.0), 0.9);
  const auto flywheel = SimpleFeedforward::create(MechanismKind::flywheel, gains, 20_ms).value();
  EXPECT_DOUBLE_EQ(flywheel.gravity(1.0), 0.0);
}

// Held for a period, the exact voltage takes the velocity model kA dv/dt = V - kV v - kS exactly
// from one velocity to the next: v_{k+1} = e^{-kV T/kA} v + (1 - e^{-kV T/kA}) (V - kS)/kV.
TEST(SimpleFeedforward, DiscreteFormIsExact) {
  for (const double T : {1e-6, 5e-3, 0.02, 1.0}) {
    const auto flywheel =
        SimpleFeedforward::create(MechanismKind::flywheel, gains, Time(T)).value();
    const double v = 2.0;
    const double v_next = 2.3;
    const double voltage = flywheel.calculate_discrete(0.0, v, v_next);
    const double decay = std::exp(-gains.kV * T / gains.kA);
    const double reached =
        decay * v - std::expm1(-gains.kV * T / gains.kA) * (voltage - gains.kS) / gains.kV;
    EXPECT_NEAR(reached, v_next, 1e-9);
  }
  // For a short period it is the continuous form with a = (v_next - v)/T.
  const double T = 1e-5;
  const auto flywheel = SimpleFeedforward::create(MechanismKind::flywheel, gains, Time(T)).value();
  EXPECT_NEAR(flywheel.calculate_discrete(0.0, 2.0, 2.0 + 3.0 * T),
              flywheel.calculate(0.0, 2.0, 3.0), 1e-4);
}

// At the start of a motion friction is already in its way; without kA the velocity follows at once.
TEST(SimpleFeedforward, StartAndNoInertia) {
  const auto flywheel = SimpleFeedforward::create(MechanismKind::flywheel, gains, 20_ms).value();
  EXPECT_GT(flywheel.calculate_discrete(0.0, 0.0, 1e-9), 0.2);
  EXPECT_LT(flywheel.calculate_discrete(0.0, 0.0, -1e-9), -0.2);
  EXPECT_EQ(flywheel.calculate_discrete(0.0, 0.0, 0.0), 0.0);
  const FeedforwardGains quick{.kS = 0.2, .kV = 1.5};
  const auto servo = SimpleFeedforward::create(MechanismKind::elevator, quick, 20_ms).value();
  EXPECT_DOUBLE_EQ(servo.calculate_discrete(0.0, 1.0, 2.0), 0.2 + 3.0);
}

TEST(SimpleFeedforward, Errors) {
  const auto create = [](FeedforwardGains g, double T) {
    return SimpleFeedforward::create(MechanismKind::arm, g, Time(T));
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(create({.kV = 0.0}, 0.02).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(create({.kS = -0.1, .kV = 1.0}, 0.02).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(create({.kV = 1.0, .kA = -0.1}, 0.02).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(create({.kV = 1.0, .kG = nan}, 0.02).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(create({.kV = 1.0}, 0.0).error().is(ArgumentError::not_positive));
}

}  // namespace
}  // namespace flyball::feedforward_test
