#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <flyball/mechanisms/arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/mechanisms/swerve_drive.hpp>
#include <flyball/mechanisms/turret.hpp>

#include "mechanisms/expect_model.hpp"

namespace flyball::mechanisms::models_test {
namespace {

using namespace flyball::literals;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

// R = 0.2 Ω, K_t = 0.05 N m/A, K_v = 20 rad/s/V (see motor_test.cpp).
DcMotor round_motor() {
  return motor("round", {.nominal_voltage = 24_V,
                         .stall_torque = Torque(6.0),
                         .stall_current = 120_A,
                         .free_current = 10_A,
                         .free_speed = AngularVelocity(440.0)})
      .value();
}

void expect_near_relative(double found, double expected, double relative) {
  EXPECT_NEAR(found, expected, relative * std::abs(expected));
}

// a = -G² K_t/(K_v R J) = -100·0.05/(20·0.2·0.5) = -2.5, b = G K_t/(R J) = 10·0.05/(0.2·0.5) = 5.
TEST(Flywheel, Theorem6101) {
  const Flywheel model =
      flywheel({.motor = round_motor(), .gearing = 10.0, .moment_of_inertia = 0.5_kg_m2}).value();
  test::expect_first_order(model, -2.5, 5.0);
  EXPECT_EQ(model.kind, MechanismKind::flywheel);
  EXPECT_EQ(model.nominal_voltage, 24.0);
  // K_v' = G/K_v = 0.5 V s/rad, K_a' = R J/(G K_t) = 0.2 V s²/rad.
  EXPECT_DOUBLE_EQ(model.gains.kV, 0.5);
  EXPECT_DOUBLE_EQ(model.gains.kA, 0.2);
  EXPECT_EQ(model.gains.kS, 0.0);
  EXPECT_EQ(model.gains.kG, 0.0);
  EXPECT_EQ(model.disturbance(1.0, 100.0), 0.0);
}

// C = -G/(K_v R) = -10/(20·0.2) = -2.5 A s/rad, D = 1/0.2 = 5 A/V: the current of the motor at the
// speed G ω, which the state's dynamics do not depend on.
TEST(Flywheel, Theorem6102) {
  const FlywheelParameters parameters{
      .motor = round_motor(), .gearing = 10.0, .moment_of_inertia = 0.5_kg_m2};
  const auto model = flywheel_without_encoder(parameters).value();
  EXPECT_EQ(model.A, flywheel(parameters)->A);
  EXPECT_EQ(model.B, flywheel(parameters)->B);
  EXPECT_DOUBLE_EQ(model.C(0), -2.5);
  EXPECT_DOUBLE_EQ(model.D(0), 5.0);
  const double current = model.C(0) * 3.0 + model.D(0) * 8.0;
  EXPECT_DOUBLE_EQ(current, parameters.motor.current(10.0 * 3.0, 8.0));
  EXPECT_TRUE(
      flywheel_without_encoder({.motor = round_motor()}).error().is(ArgumentError::not_positive));
}

// The flywheel's numbers, of a position too: no gravity, whatever the angle.
TEST(Turret, IsAnArmWithoutGravity) {
  const TurretParameters parameters{
      .motor = round_motor(), .gearing = 10.0, .moment_of_inertia = 0.5_kg_m2};
  for (const auto& [model, kind] :
       {std::pair(turret(parameters).value(), MechanismKind::turret),
        {swerve_steer(parameters).value(), MechanismKind::swerve_steer}}) {
    test::expect_second_order(model, -2.5, 5.0);
    EXPECT_EQ(model.kind, kind);
    EXPECT_EQ(model.nominal_voltage, 24.0);
    EXPECT_EQ(model.gains.kG, 0.0);
    EXPECT_EQ(model.disturbance(0.3, 0.0), 0.0);
    EXPECT_EQ(model.description().states.size(), 2U);
  }
  EXPECT_EQ(roller({.motor = round_motor(), .gearing = 10.0, .moment_of_inertia = 0.5_kg_m2})
                .value()
                .kind,
            MechanismKind::roller);
  EXPECT_EQ(turret({.motor = round_motor(), .gearing = 10.0}).error().subject(),
            "moment_of_inertia");
}

// The elevator's numbers below, of its velocity: -62.5 and 6.25, kV = G/(K_v r) = 10 V s/m.
TEST(SwerveDrive, IsAnElevatorsVelocityWithoutGravity) {
  const SwerveDrive model =
      swerve_drive({.motor = round_motor(), .gearing = 10.0, .mass = 8_kg, .wheel_radius = 5_cm})
          .value();
  test::expect_first_order(model, -62.5, 6.25);
  EXPECT_EQ(model.kind, MechanismKind::swerve_drive);
  EXPECT_DOUBLE_EQ(model.gains.kV, 10.0);
  EXPECT_EQ(model.gains.kG, 0.0);
  EXPECT_EQ(model.description().states.at(0).unit, "m/s");
  EXPECT_EQ(swerve_drive({.motor = round_motor(), .gearing = 10.0, .mass = 8_kg}).error().subject(),
            "wheel_radius");
}

// -G² K_t/(R r² m K_v) = -100·0.05/(0.2·0.0025·8·20) = -62.5, G K_t/(R r m) = 0.5/(0.2·0.05·8) =
// 6.25; held by R r m g/(G K_t) = 0.2·0.05·8·g/0.5 = 0.16 g volts.
TEST(Elevator, Theorem691) {
  const Elevator model =
      elevator({.motor = round_motor(), .gearing = 10.0, .mass = 8_kg, .drum_radius = 5_cm})
          .value();
  test::expect_second_order(model, -62.5, 6.25);
  EXPECT_EQ(model.kind, MechanismKind::elevator);
  EXPECT_EQ(model.nominal_voltage, 24.0);
  EXPECT_DOUBLE_EQ(model.gains.kG, 0.16 * 9.80665);
  // Gravity accelerates by -g wherever and however fast it is (6.9.3), and kG volts cancel it.
  for (const double velocity : {-2.0, 0.0, 2.0}) {
    EXPECT_NEAR(model.disturbance(0.7, velocity), -9.80665, 1e-14);
  }
  EXPECT_NEAR(model.B(1, 0) * model.gains.kG, 9.80665, 1e-14);
}

// -G² K_t/(K_v R J) = -100·0.05/(20·0.2·0.25) = -5, G K_t/(R J) = 0.5/(0.2·0.25) = 10;
// held level by R m g l/(G K_t) = 0.2·3·0.4·g/0.5 = 0.48 g volts.
TEST(Arm, Theorem6111) {
  const Arm model = arm({.motor = round_motor(),
                         .gearing = 10.0,
                         .moment_of_inertia = 0.25_kg_m2,
                         .mass = 3_kg,
                         .center_of_mass = 40_cm})
                        .value();
  test::expect_second_order(model, -5.0, 10.0);
  EXPECT_EQ(model.kind, MechanismKind::arm);
  EXPECT_DOUBLE_EQ(model.gains.kG, 0.48 * 9.80665);
  // -m g l cos θ/J (6.11.3): in full when level, half at 60 degrees, none when it stands up.
  const double level = -3.0 * 9.80665 * 0.4 / 0.25;
  EXPECT_NEAR(model.disturbance(0.0, 0.0), level, 1e-13);
  EXPECT_NEAR(model.disturbance(std::numbers::pi / 3.0, 0.0), 0.5 * level, 1e-13);
  EXPECT_NEAR(model.disturbance(std::numbers::pi / 2.0, 0.0), 0.0, 1e-13);
  EXPECT_NEAR(model.disturbance(std::numbers::pi, 0.0), -level, 1e-13);
}

TEST(Arm, ACounterbalancedArmHasNoGravity) {
  const Arm model =
      arm({.motor = round_motor(), .gearing = 10.0, .moment_of_inertia = 0.25_kg_m2}).value();
  EXPECT_EQ(model.gains.kG, 0.0);
  EXPECT_EQ(model.disturbance(0.3, 0.0), 0.0);
}

// The matrices of the book's figures, printed in full by its scripts (frccontrol b0a237a, Python
// 3.11): elevator of two CIMs, flywheel of a 775pro, arm of a CIM.
TEST(Models, NumbersOfTheBooksScripts) {
  const Elevator lift = elevator({.motor = cim(2),
                                  .gearing = 42.0 / 12.0 * 40.0 / 14.0,
                                  .mass = Mass(6.803886),
                                  .drum_radius = Length(0.02762679089)})
                            .value();
  expect_near_relative(lift.A(1, 1), -164.20904979369794, 1e-14);
  expect_near_relative(lift.B(1, 0), 21.457377744727182, 1e-14);

  const Flywheel wheel = flywheel({.motor = vex_775pro(),
                                   .gearing = 12.0 / 18.0,
                                   .moment_of_inertia = MomentOfInertia(0.00032)})
                             .value();
  expect_near_relative(wheel.A(0, 0), -0.5001321900589898, 1e-14);
  expect_near_relative(wheel.B(0, 0), 123.26388888888889, 1e-14);

  const double m = 2.2675;
  const double l = 1.2192;
  const Arm limb = arm({.motor = cim(),
                        .gearing = 0.5,
                        .moment_of_inertia = MomentOfInertia(m * l * l / 3.0),
                        .mass = Mass(m),
                        .center_of_mass = Length(l / 2.0)})
                       .value();
  expect_near_relative(limb.A(1, 1), -0.000948744041441224, 1e-14);
  expect_near_relative(limb.B(1, 0), 0.08974870179312819, 1e-14);
}

double between(double low, double high) {
  return low + (high - low) * 1e-6 * *rc::gen::inRange(0, 1000001);
}

DcMotor any_motor() {
  const auto index = *rc::gen::inRange<std::size_t>(0, motor_table().size());
  return motor(motor_table()[index].name, *rc::gen::inRange(1, 9)).value();
}

// Newton's law on the motor's own equation, which knows nothing of the theorems' fractions:
// J dω/dt = G τ(G ω, V) for a flywheel and an arm, m dv/dt = G τ(G v/r, V)/r for an elevator.
TEST(Models, AreNewtonsLawOnTheMotor) {
  {
    const bool holds = rc::check([] {
      const DcMotor drive = any_motor();
      const double G = between(0.2, 300.0);
      const double J = between(1e-4, 10.0);
      const double m = between(0.1, 100.0);
      const double r = between(0.005, 0.3);
      const double V = between(-12.0, 12.0);
      const double speed = between(-20.0, 20.0);

      const Flywheel wheel =
          flywheel({.motor = drive, .gearing = G, .moment_of_inertia = MomentOfInertia(J)}).value();
      const Arm limb =
          arm({.motor = drive, .gearing = G, .moment_of_inertia = MomentOfInertia(J)}).value();
      const double angular = G * drive.torque(G * speed, V) / J;
      // Torque is the difference of two terms; rounding is relative to the larger.
      const double angular_scale = std::abs(wheel.A(0, 0) * speed) + std::abs(wheel.B(0, 0) * V);
      RC_ASSERT(std::abs(wheel.A(0, 0) * speed + wheel.B(0, 0) * V - angular) <=
                1e-13 * angular_scale);
      RC_ASSERT(std::abs(limb.A(1, 1) * speed + limb.B(1, 0) * V - angular) <=
                1e-13 * angular_scale);

      const Elevator lift =
          elevator({.motor = drive, .gearing = G, .mass = Mass(m), .drum_radius = Length(r)})
              .value();
      const double linear = G * drive.torque(G * speed / r, V) / r / m;
      const double linear_scale = std::abs(lift.A(1, 1) * speed) + std::abs(lift.B(1, 0) * V);
      RC_ASSERT(std::abs(lift.A(1, 1) * speed + lift.B(1, 0) * V - linear) <= 1e-13 * linear_scale);
    });
    EXPECT_TRUE(holds);
  }
}

// What holds a mechanism still makes the motor's torque balance gravity: G K_t kG/R = m g r
// (elevator), m g l (arm, level).
TEST(Models, GravityIsHeldByItsVoltage) {
  {
    const bool holds = rc::check([] {
      const DcMotor drive = any_motor();
      const double G = between(0.2, 300.0);
      const double m = between(0.1, 100.0);
      const double l = between(0.005, 1.5);
      const Elevator lift =
          elevator({.motor = drive, .gearing = G, .mass = Mass(m), .drum_radius = Length(l)})
              .value();
      const double torque = m * 9.80665 * l;
      RC_ASSERT(std::abs(G * drive.torque(0.0, lift.gains.kG) - torque) <= 1e-13 * torque);
      const Arm limb = arm({.motor = drive,
                            .gearing = G,
                            .moment_of_inertia = MomentOfInertia(m * l * l),
                            .mass = Mass(m),
                            .center_of_mass = Length(l)})
                           .value();
      RC_ASSERT(std::abs(G * drive.torque(0.0, limb.gains.kG) - torque) <= 1e-13 * torque);
    });
    EXPECT_TRUE(holds);
  }
}

// Two motors carry twice the mass in the same way, but for the gravity.
TEST(Models, TwoMotorsCarryTwiceTheMass) {
  const Elevator one =
      elevator({.motor = neo(1), .gearing = 10.0, .mass = 4_kg, .drum_radius = 2_cm}).value();
  const Elevator two =
      elevator({.motor = neo(2), .gearing = 10.0, .mass = 8_kg, .drum_radius = 2_cm}).value();
  expect_near_relative(two.A(1, 1), one.A(1, 1), 1e-14);
  expect_near_relative(two.B(1, 0), one.B(1, 0), 1e-14);
  expect_near_relative(two.gains.kG, one.gains.kG, 1e-14);
}

ArgumentError code_for(double bad) {
  return std::isfinite(bad) ? ArgumentError::not_positive : ArgumentError::not_finite;
}

template <class Result>
bool refused(const Result& result, ArgumentError code, std::string_view subject) {
  return !result && result.error().is(code) && result.error().subject() == subject &&
         result.error().kind() == ErrorKind::misuse;
}

TEST(Models, RefuseParametersThatAreNotPositive) {
  const FlywheelParameters wheel{
      .motor = neo(), .gearing = 2.0, .moment_of_inertia = MomentOfInertia(0.01)};
  const ElevatorParameters lift{
      .motor = neo(), .gearing = 2.0, .mass = 3_kg, .drum_radius = Length(0.02)};
  const ArmParameters limb{.motor = neo(),
                           .gearing = 2.0,
                           .moment_of_inertia = MomentOfInertia(0.4),
                           .mass = 1_kg,
                           .center_of_mass = Length(0.4)};
  for (const double bad : {0.0, -1.0, nan, infinity}) {
    auto w = wheel;
    w.moment_of_inertia = MomentOfInertia(bad);
    EXPECT_TRUE(refused(flywheel(w), code_for(bad), "moment_of_inertia")) << bad;
    auto e = lift;
    e.mass = Mass(bad);
    EXPECT_TRUE(refused(elevator(e), code_for(bad), "mass")) << bad;
    e = lift;
    e.drum_radius = Length(bad);
    EXPECT_TRUE(refused(elevator(e), code_for(bad), "drum_radius")) << bad;
    auto a = limb;
    a.moment_of_inertia = MomentOfInertia(bad);
    EXPECT_TRUE(refused(arm(a), code_for(bad), "moment_of_inertia")) << bad;
  }
  for (const double bad : {-1.0, nan, infinity}) {
    const ArgumentError code =
        std::isfinite(bad) ? ArgumentError::out_of_range : ArgumentError::not_finite;
    auto a = limb;
    a.mass = Mass(bad);
    EXPECT_TRUE(refused(arm(a), code, "mass")) << bad;
    a = limb;
    a.center_of_mass = Length(bad);
    EXPECT_TRUE(refused(arm(a), code, "center_of_mass")) << bad;
  }
}

TEST(Models, RefuseAGearingThatIsNotPositiveAndSayWhatGearingIs) {
  for (const double bad : {0.0, -3.0, nan, infinity}) {
    const auto wheel =
        flywheel({.motor = neo(), .gearing = bad, .moment_of_inertia = MomentOfInertia(0.01)});
    const auto lift =
        elevator({.motor = neo(), .gearing = bad, .mass = 3_kg, .drum_radius = Length(0.02)});
    const auto limb =
        arm({.motor = neo(), .gearing = bad, .moment_of_inertia = MomentOfInertia(0.4)});
    EXPECT_TRUE(refused(wheel, code_for(bad), "gearing")) << bad;
    EXPECT_TRUE(refused(lift, code_for(bad), "gearing")) << bad;
    EXPECT_TRUE(refused(limb, code_for(bad), "gearing")) << bad;
    EXPECT_NE(to_string(lift.error()).find("motor turns per output turn"), std::string::npos);
  }
}

TEST(Models, RefuseAMotorThatIsNone) {
  const auto with = [](const DcMotor& drive) {
    return flywheel({.motor = drive, .gearing = 1.0, .moment_of_inertia = MomentOfInertia(0.01)});
  };
  EXPECT_TRUE(refused(with(neo(0)), ArgumentError::out_of_range, "motor count"));
  EXPECT_TRUE(refused(with(neo(-2)), ArgumentError::out_of_range, "motor count"));
  EXPECT_TRUE(refused(with(DcMotor{}), ArgumentError::not_positive, "motor.R"));
  DcMotor drive = neo();
  drive.Kt = -1.0;
  EXPECT_TRUE(refused(with(drive), ArgumentError::not_positive, "motor.Kt"));
  drive = neo();
  drive.Kv = nan;
  EXPECT_TRUE(refused(with(drive), ArgumentError::not_finite, "motor.Kv"));
}

// J = 1e-320 is positive, but 1/kA is not a number any more.
TEST(Models, RefuseParametersWhoseModelOverflows) {
  EXPECT_TRUE(refused(
      flywheel({.motor = neo(), .gearing = 1e10, .moment_of_inertia = MomentOfInertia(1e-320)}),
      ArgumentError::not_positive, "kA"));
  EXPECT_FALSE(
      elevator({.motor = neo(), .gearing = 1.0, .mass = Mass(1e-310), .drum_radius = Length(0.1)}));
  EXPECT_FALSE(arm({.motor = neo(),
                    .gearing = 1.0,
                    .moment_of_inertia = MomentOfInertia(1.0),
                    .mass = Mass(1e300),
                    .center_of_mass = Length(1e300)}));
}

}  // namespace
}  // namespace flyball::mechanisms::models_test
