#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/integration/adaptive.hpp>
#include <flyball/mechanisms/lagrangian/lagrangian_model.hpp>
#include <flyball/mechanisms/lift/cascade_elevator.hpp>
#include <flyball/mechanisms/lift/elevator_arm.hpp>
#include <flyball/mechanisms/power/powered.hpp>
#include <flyball/systems/linearize.hpp>
#include <flyball/systems/model_step.hpp>

#include "support/allocation_count.hpp"
#include "support/oracle.hpp"

namespace flyball::mechanisms::lift_test {
namespace {

using namespace flyball::literals;
using Eigen::Vector2d;
using Eigen::Vector4d;
using Input = Eigen::Vector<double, 1>;

constexpr double g = standard_gravity;

static_assert(ParametricModel<CascadeElevator> && MotorizedModel<CascadeElevator>);
static_assert(ParametricModel<ElevatorArm> && MotorizedModel<ElevatorArm>);

CascadeElevatorParameters lift() {
  return {.shaft = {.motor = neo(2),
                    .gearing = 8.0,
                    .moment_of_inertia = MomentOfInertia(0.01),
                    .friction = 0.6,
                    .damping = 0.02},
          .drum_radius = Length(0.02),
          .carriage = 6_kg,
          .stages = {Mass(4.0), Mass(3.0)},
          .counterbalance = {.force = Force(90.0), .stiffness = 20.0, .stage = 0}};
}

// One stage and no spring is Theorem 6.9.1, gains and all.
TEST(CascadeElevator, OneStageIsTheBooks) {
  const CascadeElevatorParameters plain{
      .shaft = {.motor = neo(2), .gearing = 10.0}, .drum_radius = Length(0.0254), .carriage = 8_kg};
  const Elevator made = cascade_elevator(plain)->elevator().value();
  const Elevator book =
      elevator({.motor = neo(2), .gearing = 10.0, .mass = 8_kg, .drum_radius = Length(0.0254)})
          .value();
  EXPECT_TRUE(made.A.isApprox(book.A, 1e-14));
  EXPECT_TRUE(made.B.isApprox(book.B, 1e-14));
  EXPECT_NEAR(made.gains.kG, book.gains.kG, 1e-14);
  EXPECT_EQ(made.gains.kS, 0.0);
  EXPECT_EQ(made.nominal_voltage, book.nominal_voltage);
}

// By hand: n = 3, M = 6 + 4/9 + 3·4/9 + 0.01/0.06² = 10.5555…, W = g(6 + 4/3 + 3·2/3) = g·9.3333…,
// the spring on the first stage, a third of the way: F = 30 N, κ = 20/9 N/m.
TEST(CascadeElevator, StagesMoveTheirShareOfTheWay) {
  const CascadeElevator model = cascade_elevator(lift()).value();
  EXPECT_NEAR(model.parameters()(0), 6.0 + 4.0 / 9.0 + 12.0 / 9.0 + 0.01 / 0.0036, 1e-13);
  EXPECT_NEAR(model.parameters()(1), g * (6.0 + 4.0 / 3.0 + 2.0), 1e-13);
  EXPECT_NEAR(model.parameters()(2), 30.0, 1e-14);
  EXPECT_NEAR(model.parameters()(3), 20.0 / 9.0, 1e-15);
  EXPECT_NEAR(model.rise(), 0.06, 1e-16);
  EXPECT_NEAR(model.balanced_position(), (30.0 - g * (6.0 + 4.0 / 3.0 + 2.0)) * 9.0 / 20.0, 1e-11);
  // The voltage that holds it does, at any height.
  for (const double h : {0.0, 0.7, 1.6}) {
    EXPECT_NEAR(model.derivative(Vector2d(h, 0.0), Input(model.holding_voltage(h)))(1), 0.0, 1e-13);
  }
  // A spring on the carriage itself.
  CascadeElevatorParameters direct = lift();
  direct.counterbalance.stage = Counterbalance::carriage;
  EXPECT_EQ(cascade_elevator(direct)->parameters()(2), 90.0);
  EXPECT_EQ(cascade_elevator(direct)->parameters()(3), 20.0);
}

// The energy of all that moves, part by part, changes by what the drum puts in.
TEST(CascadeElevator, BalancesItsEnergy) {
  Random random(12);
  const CascadeElevator model = cascade_elevator(lift()).value();
  const auto energy = [](const auto& x) {
    const auto v = x(1);
    const auto h = x(0);
    const auto drum = v / 0.06;
    const auto first = h / 3.0;
    // The spring gives up what it lifts by: ∫ (90 - 20 s) ds over the first stage's way.
    return 0.5 * (6.0 * v * v + 4.0 * v * v / 9.0 + 3.0 * v * v * 4.0 / 9.0) +
           0.5 * 0.01 * drum * drum + g * (6.0 * h + 4.0 * h / 3.0 + 3.0 * h * 2.0 / 3.0) -
           (90.0 * first - 10.0 * first * first);
  };
  for (int trial = 0; trial < 100; ++trial) {
    const Vector2d x(random.uniform(0.0, 1.5), random.uniform(-2.0, 2.0));
    const Input u(random.uniform(-12.0, 12.0));
    const auto slope = gradient(energy, x);
    const Vector2d rate = model.derivative(x, u);
    const double drum = x(1) / 0.06;
    EXPECT_NEAR(slope.dot(rate), model.shaft(0).torque(drum, u(0)) * drum,
                1e-12 * slope.cwiseAbs().dot(rate.cwiseAbs()));
  }
}

// A constant force leaves the book's model with its gains; a spring that weakens does not, and says
// what to do; its linearisation has the spring.
TEST(CascadeElevator, ForDesign) {
  CascadeElevatorParameters constant = lift();
  constant.counterbalance.stiffness = 0.0;
  const CascadeElevator model = cascade_elevator(constant).value();
  const Elevator made = model.elevator().value();
  for (const double v : {-1.5, 2.0}) {
    const Vector2d x(0.4, v);
    const Input u(7.0);
    // Far from rest tanh is the sign.
    EXPECT_NEAR(made.derivative(x, u)(1), model.derivative(x, u)(1), 1e-12 * 100.0);
  }
  EXPECT_NEAR(made.gains.kG, model.holding_voltage(0.3), 1e-14);
  EXPECT_EQ(
      to_string(cascade_elevator(lift())->elevator().error()),
      "CascadeElevator::elevator: the counterbalance is a spring of 2.222 N/m at the carriage; it "
      "must be a constant force, whose elevator is the same at every height; linearize(model, x, "
      "u) "
      "gives the system about a height");
  const auto system = linearize(cascade_elevator(lift()).value(), Vector2d(0.5, 1.0), Input(3.0));
  EXPECT_NEAR(system->A(1, 0), -(20.0 / 9.0) / (6.0 + 16.0 / 9.0 + 0.01 / 0.0036), 1e-13);
}

/// The energies of the arm on the elevator, as they are.
struct Energies {
  double M, W, F, kappa, m, l, J;
  static constexpr int coordinates() { return 2; }
  template <class Q, class V>
  auto kinetic_energy(const Q& q, const V& v) const {
    using std::cos, std::sin;
    // The centre of mass at (l cos θ, h + l sin θ); J - m l² about it.
    const auto vx = -l * sin(q(1)) * v(1);
    const auto vy = v(0) + l * cos(q(1)) * v(1);
    return 0.5 * M * v(0) * v(0) + 0.5 * m * (vx * vx + vy * vy) +
           0.5 * (J - m * l * l) * v(1) * v(1);
  }
  template <class Q>
  auto potential_energy(const Q& q) const {
    using std::sin;
    return W * q(0) - F * q(0) + 0.5 * kappa * q(0) * q(0) + m * g * (q(0) + l * sin(q(1)));
  }
};

ElevatorArmParameters arm_on_lift() {
  return {.elevator = lift(),
          .joint = {.motor = neo(),
                    .gearing = 60.0,
                    .moment_of_inertia = MomentOfInertia(0.05),
                    .friction = 0.8,
                    .damping = 0.05},
          .moment_of_inertia = MomentOfInertia(0.9),
          .mass = 4_kg,
          .center_of_mass = Length(0.4)};
}

// Lagrange's equations of the energies by automatic differentiation, to 1e-12; the motors' forces
// as inputs.
TEST(ElevatorArm, IsLagrangesEquations) {
  Random random(124);
  const ElevatorArm model = elevator_arm(arm_on_lift()).value();
  const auto& p = model.parameters();
  const auto lagrange =
      lagrangian_model(Energies{p(0), p(1), p(2), p(3), p(4), p(5), p(6)}).value();
  for (int trial = 0; trial < 200; ++trial) {
    const Vector4d x(random.uniform(0.0, 1.5), random.uniform(-3.0, 3.0), random.uniform(-2.0, 2.0),
                     random.uniform(-6.0, 6.0));
    const Vector2d u(random.uniform(-12.0, 12.0), random.uniform(-12.0, 12.0));
    const Vector2d forces(model.shaft(0).torque(x(2) / 0.06, u(0)) / 0.06,
                          model.shaft(1).torque(x(3), u(1)));
    const Vector4d expected = lagrange.derivative(x, forces);
    EXPECT_LE((model.derivative(x, u) - expected).norm(), 1e-12 * (1.0 + expected.norm()));
  }
  for (const double theta : {-1.0, 0.3, 1.4}) {
    const Vector2d hold = model.holding_voltages(0.6, theta);
    EXPECT_LE(model.derivative(Vector4d(0.6, theta, 0.0, 0.0), hold).norm(), 1e-12);
  }
}

// Against the same laws integrated on their own, in the height and angle of the arm's centre with
// the accelerations solved from Newton's laws of both bodies and the joint's force: at 1e-10.
TEST(ElevatorArm, AgainstNewtonsLawsOfBothBodies) {
  const ElevatorArm model = elevator_arm(arm_on_lift()).value();
  const auto& p = model.parameters();
  const auto volts = [](double t) {
    return Vector2d(6.0 + 4.0 * std::sin(3.0 * t), 3.0 * std::cos(2.0 * t));
  };
  const auto newton = [&](double t, const Vector4d& z) {
    // Unknowns: d²h, d²θ, the joint's force on the arm (horizontal, vertical).
    const double s = std::sin(z(1));
    const double c = std::cos(z(1));
    const double m = 4.0;
    const double l = 0.4;
    const double own = 0.9 - m * l * l;  // about the arm's centre
    const double push = model.shaft(0).torque(z(2) / 0.06, volts(t)(0)) / 0.06;
    const double torque = model.shaft(1).torque(z(3), volts(t)(1));
    Eigen::Matrix4d A;
    Vector4d b;
    A.row(0) << p(0), 0.0, 0.0, 1.0;  // the carriage carries the joint's force
    b(0) = push - p(1) + p(2) - p(3) * z(0);
    A.row(1) << 0.0, m * l * s, 1.0, 0.0;  // the arm's centre, horizontally
    b(1) = -m * l * c * z(3) * z(3);
    A.row(2) << m, m * l * c, 0.0, -1.0;  // and vertically
    b(2) = m * l * s * z(3) * z(3) - m * g;
    A.row(3) << 0.0, own + 0.05, -l * s, l * c;  // moments about its centre
    b(3) = torque;
    const Vector4d solved = test::solve(Eigen::MatrixXd(A), Eigen::MatrixXd(b));
    return Vector4d(z(2), z(3), solved(0), solved(1));
  };
  const IntegrationOptions tight{.relative_tolerance = 1e-10, .absolute_tolerance = 1e-12};
  const Vector4d start(0.2, -0.5, 0.0, 0.0);
  const auto reference = integrate(newton, 0.0, start, 1.5, tight).value();
  const auto path =
      integrate(
          [&](double t, const Vector4d& x) { return Vector4d(model.derivative(x, volts(t))); }, 0.0,
          start, 1.5, tight)
          .value();
  EXPECT_LE((path.final_state() - reference.final_state()).norm(),
            1e-8 * reference.final_state().norm());
  EXPECT_GT((reference.final_state() - start).norm(), 0.5);
}

TEST(ElevatorArm, IsAModelWithoutAllocations) {
  const ElevatorArm model = elevator_arm(arm_on_lift()).value();
  const AnyModel any = model;
  EXPECT_EQ(label(any.names().states[1]), "angle (rad)");
  EXPECT_TRUE(any.names().outputs[1].is_angle);
  EXPECT_EQ(any.description().parameters[6].name, "moment_of_inertia");
  EXPECT_DOUBLE_EQ(any.description().parameters[6].value, 0.95);
  const auto behind = powered(model, {.stator = 90.0}, {.resistance = 0.02}).value();
  Vector4d x(0.0, 0.0, 0.0, 0.0);
  const test::AllocationCounter counter;
  for (int k = 0; k < 100; ++k) {
    x = rk4(behind, x, Vector2d(12.0, 6.0), 1e-3);
  }
  if (test::counts_allocations()) {
    EXPECT_EQ(counter.count(), 0U);
  }
  EXPECT_GT(x(0), 0.0);
}

TEST(CascadeElevator, Refusals) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CascadeElevatorParameters bad = lift();
  bad.counterbalance.stage = 2;
  EXPECT_EQ(to_string(cascade_elevator(bad).error()),
            "cascade_elevator: the counterbalance's stage is 2; it must be below 2, the number of "
            "stages, or left out for the carriage");
  bad = lift();
  bad.stages[1] = Mass(-1.0);
  EXPECT_EQ(cascade_elevator(bad).error().subject(), "the mass of stage 2");
  bad = lift();
  bad.drum_radius = Length(0.0);
  EXPECT_EQ(cascade_elevator(bad).error().subject(), "drum_radius");
  bad = lift();
  bad.carriage = Mass(nan);
  EXPECT_TRUE(cascade_elevator(bad).error().is(ArgumentError::not_finite));
  bad = lift();
  bad.counterbalance.stiffness = -1.0;
  EXPECT_FALSE(cascade_elevator(bad));
  bad = lift();
  bad.shaft.gearing = 0.0;
  EXPECT_EQ(cascade_elevator(bad).error().subject(), "the gearing of shaft");
  ElevatorArmParameters arm = arm_on_lift();
  arm.moment_of_inertia = MomentOfInertia(0.5);
  EXPECT_EQ(to_string(elevator_arm(arm).error()),
            "elevator_arm: moment_of_inertia is 0.5 kg m^2; it must be at least mass times "
            "center_of_mass squared, 0.64 kg m^2: it is taken about the joint");
  arm = arm_on_lift();
  arm.mass = Mass(-1.0);
  EXPECT_FALSE(elevator_arm(arm));
  arm = arm_on_lift();
  arm.elevator.carriage = Mass(0.0);
  EXPECT_EQ(elevator_arm(arm).error().subject(), "carriage");
}

}  // namespace
}  // namespace flyball::mechanisms::lift_test
