#include <flyball/mechanisms/friction.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/math/derivatives/differentiation.hpp>
#include <flyball/math/integration/adaptive.hpp>
#include <flyball/mechanisms/gravity.hpp>
#include <flyball/mechanisms/motor.hpp>

namespace flyball::mechanisms::friction_test {
namespace {

TEST(Friction, AgainstTheMotionAndNoneAtRest) {
  EXPECT_EQ(friction_voltage(0.3, 2.0), 0.3);
  EXPECT_EQ(friction_voltage(0.3, -1e-300), -0.3);
  EXPECT_EQ(friction_voltage(0.3, 0.0), 0.0);
  // kS sgn(v) by kS is sgn(v), by v is 0.
  const Dual<2> level = Dual<2>::variable(0.3, 0);
  const Dual<2> velocity = Dual<2>::variable(-2.0, 1);
  EXPECT_EQ(friction_voltage(level, velocity).value, -0.3);
  EXPECT_EQ(friction_voltage(level, velocity).gradient, Eigen::Vector2d(-1.0, 0.0));
  EXPECT_EQ(friction_voltage(0.3, velocity).gradient, Eigen::Vector2d(0.0, 0.0));
}

TEST(Friction, HoldsUpToItsBreakaway) {
  const Friction friction{.sliding = 0.2, .breakaway = 1.5};
  EXPECT_EQ(friction.direction(0.0, 0.3), 0);
  EXPECT_EQ(friction.direction(0.0, -0.3), 0);
  EXPECT_EQ(friction.direction(0.0, 0.31), 1);
  EXPECT_EQ(friction.direction(0.0, -0.31), -1);
  // What moves goes on, whichever way it is pushed.
  EXPECT_EQ(friction.direction(0.1, -5.0), 1);
  EXPECT_EQ(friction.direction(-0.1, 0.0), -1);
}

// With kV = 2, kA = 0.5, kS = 1 from v = 3 under -4 V: until it stops v_end = (-4 - 1)/2 = -2.5 and
// λ = 4, so after ln(1 + 3/2.5)/4 s; then v_end = (-4 + 1)/2 = -1.5 for good.
TEST(FrictionMotion, PiecesOfAReversal) {
  const FrictionMotion motion(2.0, 0.5, Friction{1.0});
  const auto first = motion.piece(3.0, -4.0, 10.0);
  EXPECT_EQ(first.direction, 1);
  EXPECT_EQ(first.v_end, -2.5);
  EXPECT_NEAR(first.duration, std::log(2.2) / 4.0, 1e-16);
  EXPECT_TRUE(first.stops);
  const auto second = motion.piece(0.0, -4.0, 10.0);
  EXPECT_EQ(second.direction, -1);
  EXPECT_EQ(second.v_end, -1.5);
  EXPECT_EQ(second.duration, 10.0);
  EXPECT_FALSE(second.stops);
  EXPECT_EQ(motion.piece(0.0, 0.9, 1.0).direction, 0);
  EXPECT_FALSE(motion.piece(3.0, -4.0, 0.5 * first.duration).stops);
}

// The whole against the adaptive integrator of kA dv/dt = drive - kV v - kS sgn(v).
TEST(FrictionMotion, AgreesWithTheDifferentialEquation) {
  const FrictionMotion motion(2.0, 0.5, Friction{1.0});
  const auto f = [](double, const Eigen::Vector2d& x) {
    return Eigen::Vector2d{x(1), (-4.0 - 2.0 * x(1) - friction_voltage(1.0, x(1))) / 0.5};
  };
  const auto still = [](double, const auto& x) { return x(1); };
  const IntegrationOptions options{.relative_tolerance = 1e-12, .absolute_tolerance = 1e-13};
  const auto braking = integrate(f, 0.0, Eigen::Vector2d(0.5, 3.0), 0.8, options,
                                 Event{still, EventDirection::falling, true})
                           .value();
  // From the stop it moves on backwards, which -1e-12 m/s begins.
  const auto rest = integrate(f, braking.final_time(),
                              Eigen::Vector2d(braking.final_state()(0), -1e-12), 0.8, options)
                        .value();
  const MechanismState end = motion.step({0.5, 3.0}, -4.0, 0.8);
  EXPECT_NEAR(end.position, rest.final_state()(0), 1e-10);
  EXPECT_NEAR(end.velocity, rest.final_state()(1), 1e-10);
}

TEST(Gravity, FormsAndSlopes) {
  EXPECT_EQ(gravity_voltage(MechanismKind::flywheel, 0.7, 1.0, 0.0), 0.0);
  EXPECT_EQ(gravity_voltage(MechanismKind::elevator, 0.7, 1.0, 0.0), 0.7);
  EXPECT_DOUBLE_EQ(gravity_voltage(MechanismKind::arm, 0.7, 1.0, 0.2), 0.7 * std::cos(1.2));
  // kG cos(θ + θ₀) by kG and by θ.
  const auto held = gravity_voltage(MechanismKind::arm, Dual<2>::variable(0.7, 0),
                                    Dual<2>::variable(1.0, 1), 0.2);
  EXPECT_DOUBLE_EQ(held.gradient(0), std::cos(1.2));
  EXPECT_DOUBLE_EQ(held.gradient(1), -0.7 * std::sin(1.2));
}

// τ = K_t (V/R - ω/(K_v R)) by ω is -K_t/(K_v R).
TEST(Motor, TorqueOverAGenericScalar) {
  const DcMotor drive = neo(2);
  const Dual<1> torque = drive.torque(Dual<1>::variable(100.0, 0), 6.0);
  EXPECT_DOUBLE_EQ(torque.value, drive.torque(100.0, 6.0));
  EXPECT_DOUBLE_EQ(torque.gradient(0), -drive.Kt / (drive.Kv * drive.R));
}

}  // namespace
}  // namespace flyball::mechanisms::friction_test
