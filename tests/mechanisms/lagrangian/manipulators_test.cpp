#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/control/computed_torque.hpp>
#include <flyball/core/random.hpp>
#include <flyball/math/integration/adaptive.hpp>
#include <flyball/math/integration/fixed_step.hpp>
#include <flyball/mechanisms/acrobot.hpp>
#include <flyball/mechanisms/cart_pole.hpp>
#include <flyball/mechanisms/double_jointed_arm.hpp>
#include <flyball/mechanisms/lagrangian/planar_linkage.hpp>
#include <flyball/mechanisms/pendulum.hpp>
#include <flyball/systems/linearize.hpp>
#include <flyball/systems/model_step.hpp>

#include "support/allocation_count.hpp"

namespace flyball::mechanisms::manipulators_test {
namespace {

using namespace flyball::literals;
using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector4d;
using Input = Eigen::Vector<double, 1>;

constexpr double pi = std::numbers::pi;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

DoubleJointedArmParameters arm_parameters() {
  const JointParameters upper{.motor = neo(2),
                              .gearing = 140.0,
                              .length = 46_in,
                              .mass = 9.34_lb,
                              .center_of_mass = 22_in,
                              .moment_of_inertia = MomentOfInertia(0.3)};
  const JointParameters fore{.motor = neo(1),
                             .gearing = 90.0,
                             .length = 42_in,
                             .mass = 9.77_lb,
                             .center_of_mass = 28_in,
                             .moment_of_inertia = MomentOfInertia(0.2)};
  return {.first = upper, .second = fore, .gravity = 9.81};
}

/// The same arm, of which only the places of its links are said.
LagrangianModel<PlanarLinkage<PlanarChain<2>>> chain_of(const AcrobotLink& first,
                                                        const AcrobotLink& second, double zero,
                                                        double g) {
  const auto link = [](const AcrobotLink& l) {
    return PlanarLink{l.length.si(), l.mass.si(), l.center_of_mass.si(), l.moment_of_inertia.si()};
  };
  return planar_model(PlanarChain<2>{{link(first), link(second)}, zero}, g).value();
}

TEST(DoubleJointedArm, IsItsEnergies) {
  const DoubleJointedArmParameters made = arm_parameters();
  const auto part = [](const JointParameters& j) {
    return AcrobotLink{j.length, j.mass, j.center_of_mass, j.moment_of_inertia};
  };
  const auto tool = chain_of(part(made.first), part(made.second), 0.0, 9.81);
  const auto arm = double_jointed_arm(made).value();
  Random random(132);
  for (int trial = 0; trial < 100; ++trial) {
    const Vector2d q(random.uniform(-pi, pi), random.uniform(-pi, pi));
    const Vector2d v(random.normal(0.0, 3.0), random.normal(0.0, 3.0));
    const Vector2d a(random.normal(0.0, 3.0), random.normal(0.0, 3.0));
    const double scale = 1.0 + v.squaredNorm();
    EXPECT_LT((tool.mass_matrix(q) - arm.mass_matrix(q)).norm(), 1e-13 * 20.0);
    EXPECT_LT((tool.coriolis_matrix(q, v) - arm.coriolis_matrix(q, v)).norm(), 1e-12 * scale);
    EXPECT_LT((tool.gravity_vector(q) - arm.gravity_vector(q)).norm(), 1e-12 * 50.0);
    EXPECT_LT((tool.forces(q, v, a) - arm.torques(q, v, a)).norm(), 1e-12 * scale * 50.0);
    // The voltages of a motion make that motion.
    Vector4d x;
    x << q, v;
    const Vector4d dxdt = arm.derivative(x, arm.voltages(q, v, a));
    EXPECT_LT((dxdt.tail<2>() - a).norm(), 1e-11 * scale);
    EXPECT_EQ(dxdt.head<2>(), v);
  }
}

// Through the gearing (12.1, 12.2): 12 V at rest give G K_t/R 12 N m; a joint at its free speed
// gets nothing.
TEST(DoubleJointedArm, MotorsAndGearing) {
  const auto arm = double_jointed_arm(arm_parameters()).value();
  const DcMotor shoulder = neo(2);
  EXPECT_NEAR(arm.first.gain, 140.0 * shoulder.Kt / shoulder.R, 1e-12 * arm.first.gain);
  const double free = shoulder.Kv * 12.0 / 140.0;
  EXPECT_NEAR(arm.first.gain * 12.0 - arm.first.damping * free, 0.0, 1e-10);
  const AnyModel model = arm;
  EXPECT_EQ(label(model.names().inputs[1]), "elbow voltage (V)");
  EXPECT_EQ(model.outputs(), 2);
  // Horizontal and straight, at rest: τ_g = -G is gravity's turn of both links about the shoulder.
  const Vector2d G = arm.gravity_vector(Vector2d(0.0, 0.0));
  const double m1 = 9.34 * 0.45359237, m2 = 9.77 * 0.45359237;
  EXPECT_NEAR(G(1), m2 * 9.81 * 28.0 * 0.0254, 1e-12 * 50.0);
  EXPECT_NEAR(G(0), 9.81 * (m1 * 22.0 + m2 * (46.0 + 28.0)) * 0.0254, 1e-11);
}

// Computed torque: the error is that of two damped oscillators, whatever the arm does meanwhile.
// From 0.2 rad at rest with K_p = 36, K_d = 12 it is 0.2 (1 + 6 t) e^(-6 t).
TEST(DoubleJointedArm, ComputedTorqueLinearises) {
  const auto arm = double_jointed_arm(arm_parameters()).value();
  using Control = ComputedTorque<DoubleJointedArm>;
  Control control(arm, Vector2d(36.0, 36.0), Vector2d(12.0, 12.0), Vector2d(1e3, 1e3));
  control.set_angle(0);
  control.set_angle(1);
  control.set_angle(7);
  const auto reference = [](double t) {
    return std::array{Vector2d(0.5 * t, std::sin(t)), Vector2d(0.5, std::cos(t)),
                      Vector2d(0.0, -std::sin(t))};
  };
  const auto closed = [&](double t, const Vector4d& x) -> Vector4d {
    const auto [r, r_dot, r_ddot] = reference(t);
    return arm.derivative(x, control.calculate(x.head<2>(), x.tail<2>(), r, r_dot, r_ddot));
  };
  const auto [r0, v0, unused] = reference(0.0);
  Vector4d x0;
  x0 << r0 - Vector2d(0.2, 0.2 - 2.0 * pi), v0;
  const auto run =
      integrate(closed, 0.0, x0, 1.0, {.relative_tolerance = 1e-10, .absolute_tolerance = 1e-12})
          .value();
  for (const double t : {0.1, 0.3, 1.0}) {
    const double left = 0.2 * (1.0 + 6.0 * t) * std::exp(-6.0 * t);
    const auto [r, r_dot, r_ddot] = reference(t);
    EXPECT_NEAR(r(0) - run.at(t)(0), left, 1e-5);
    EXPECT_NEAR(r(1) + 2.0 * pi - run.at(t)(1), left, 1e-5);
  }
}

TEST(DoubleJointedArm, ComputedTorqueIsBounded) {
  const auto arm = double_jointed_arm(arm_parameters()).value();
  const ComputedTorque<DoubleJointedArm> control(arm, Vector2d(36.0, 36.0), Vector2d(12.0, 12.0),
                                                 Vector2d(12.0, nan));
  const Vector2d zero = Vector2d::Zero();
  const test::AllocationCounter allocations;
  const Vector2d u = control.calculate(zero, zero, Vector2d(100.0, 0.0), zero, zero);
  if (test::counts_allocations()) {
    EXPECT_EQ(allocations.count(), 0u);
  }
  EXPECT_EQ(u(0), 12.0);
  for (const double bad : {nan, std::numeric_limits<double>::infinity(), 1e300}) {
    EXPECT_TRUE(control.calculate(Vector2d(bad, bad), zero, zero, zero, zero).allFinite());
    EXPECT_TRUE(control.calculate(zero, Vector2d(bad, bad), zero, zero, zero).allFinite());
  }
  // Any Lagrangian model with a force for each coordinate will do.
  const auto chain = chain_of(uniform_rod(1_m, 1_kg), uniform_rod(1_m, 1_kg), 0.0, 9.81);
  const ComputedTorque tool(chain, Vector2d(36.0, 36.0), Vector2d(12.0, 12.0), Vector2d(1e3, 1e3));
  const Vector2d q(0.3, 0.4);
  EXPECT_LT((tool.calculate(q, zero, q, zero, zero) - chain.gravity_vector(q)).norm(), 1e-12);
}

TEST(DoubleJointedArm, Errors) {
  const auto refused = [](auto&& change) {
    DoubleJointedArmParameters p = arm_parameters();
    change(p);
    return double_jointed_arm(p).error();
  };
  for (const double bad : {nan, 0.0, -1.0}) {
    EXPECT_EQ(refused([&](auto& p) { p.first.length = Length(bad); }).subject(), "first.length");
    EXPECT_EQ(refused([&](auto& p) { p.second.mass = Mass(bad); }).subject(), "second.mass");
    EXPECT_EQ(refused([&](auto& p) { p.second.gearing = bad; }).subject(), "second.gearing");
    EXPECT_EQ(refused([&](auto& p) { p.first.motor.R = bad; }).subject(), "first.motor");
  }
  EXPECT_TRUE(refused([](auto& p) { p.gravity = -1.0; }).is(ArgumentError::out_of_range));
  EXPECT_TRUE(refused([](auto& p) {
                p.second.center_of_mass = 0_m;
                p.second.moment_of_inertia = MomentOfInertia(0.0);
              }).is(ArgumentError::not_positive));
  EXPECT_TRUE(refused([](auto& p) {
                p.first.center_of_mass = 0_m;
                p.first.moment_of_inertia = MomentOfInertia(0.0);
                p.second.moment_of_inertia = MomentOfInertia(0.0);
              }).is(ArgumentError::not_positive));
}

Acrobot two_rods() {
  return acrobot({.first = uniform_rod(1_m, 1_kg), .second = uniform_rod(1_m, 1_kg)}).value();
}

TEST(Acrobot, IsItsEnergies) {
  const auto rods = two_rods();
  const auto tool =
      chain_of(uniform_rod(1_m, 1_kg), uniform_rod(1_m, 1_kg), -pi / 2.0, standard_gravity);
  EXPECT_NEAR(rods.links.a, 1.0 / 3.0 + 1.0, 1e-15);
  EXPECT_NEAR(rods.links.b, 1.0 / 3.0, 1e-15);
  EXPECT_EQ(rods.links.d, 0.5);
  Random random(3);
  for (int trial = 0; trial < 100; ++trial) {
    Vector4d x;
    for (double& entry : x) {
      entry = random.normal(0.0, 3.0);
    }
    const Input u(random.normal(0.0, 5.0));
    const Vector4d expected = tool.derivative(x, Vector2d(0.0, u(0)));
    EXPECT_LT((rods.derivative(x, u) - expected).norm(), 1e-12 * (1.0 + expected.norm()));
    EXPECT_NEAR(rods.energy(x), tool.energy(x), 1e-12 * (1.0 + std::abs(tool.energy(x))));
    const auto closed = linearize(rods, x, u).value();
    const auto of_tool = linearize(tool, x, Vector2d(0.0, u(0))).value();
    EXPECT_LT((closed.A - of_tool.A).norm(), 1e-11 * (1.0 + closed.A.norm()));
  }
  EXPECT_NEAR(rods.energy(Vector4d(pi, 0.0, 0.0, 0.0)), rods.energy_upright(), 1e-13);
  EXPECT_LT(rods.derivative(Vector4d(pi, 0.0, 0.0, 0.0), Input(0.0)).norm(), 1e-14);
  EXPECT_TRUE(acrobot({}).error().is(ArgumentError::not_positive));
  EXPECT_EQ(label(AnyModel(rods).names().inputs[0]), "torque (N m)");
}

// 12.5: m l θ̈ = -m g sin θ along the path, τ = d(m l² ω)/dt about the pivot, and from the energy
// θ̇² = 2 g/l (cos θ - cos θ₀), whose time derivative over 2 θ̇ is θ̈.
TEST(Pendulum, ThreeDerivationsAgree) {
  const double m = 2.0, l = 0.5, g = 9.81;
  const Pendulum model{m, l, 0.0, g};
  Random random(125);
  for (int trial = 0; trial < 100; ++trial) {
    const double start = random.uniform(0.3, pi);
    const double theta = random.uniform(-0.99, 0.99) * start;
    // Forces: the second time derivative of the place l (sin θ, -cos θ), along the tangent.
    const double omega = (trial % 2 == 0 ? 1.0 : -1.0) *
                         std::sqrt(2.0 * g / l * (std::cos(theta) - std::cos(start)));
    const double by_model = model.derivative(Vector2d(theta, omega), Input(0.0))(1);
    const double tangential = -m * g * std::sin(theta);
    EXPECT_NEAR(by_model, tangential / m / l, 1e-13 * g / l);
    // Torques: r x F over the moment of inertia m l².
    const Vector2d r(l * std::sin(theta), -l * std::cos(theta));
    const Vector2d F(0.0, -m * g);
    EXPECT_NEAR(by_model, (r.x() * F.y() - r.y() * F.x()) / (m * l * l), 1e-13 * g / l);
    // Energy: the first integral of motion, differentiated exactly: θ̈ = ½ d(θ̇²)/dθ.
    using D = Dual<1>;
    const D square = 2.0 * g / l * (cos(D::variable(theta, 0)) - std::cos(start));
    EXPECT_NEAR(by_model, 0.5 * square.gradient(0), 1e-13 * g / l);
    EXPECT_NEAR(square.value, omega * omega, 1e-12 * g / l);
  }
}

/// Largest change of the energy over a run of 10⁵ steps, of the scale.
template <class M, class State, class Energy>
double drift(const M& model, const State& x0, double duration, double scale, const Energy& energy) {
  const auto run = integrate(with_input(model, Input(0.0)), 0.0, x0, duration,
                             {.method = IntegrationMethod::dormand_prince,
                              .relative_tolerance = 1e-13,
                              .absolute_tolerance = 1e-13,
                              .max_steps = 1'000'000})
                       .value();
  EXPECT_GE(run.statistics().steps, 100'000);
  EXPECT_LE(run.statistics().steps, 200'000);
  double worst = 0.0;
  const Eigen::MatrixXd states = run.states();
  for (Eigen::Index k = 0; k < states.cols(); ++k) {
    worst = std::max(worst, std::abs(energy(State(states.col(k))) - energy(x0)));
  }
  return worst / scale;
}

// With an accuracy of 1e-13 a step, of the potential energy's range.
TEST(UndampedPendulums, KeepTheirEnergy) {
  const Pendulum bob{2.0, 0.5, 0.0, 9.81};
  EXPECT_LT(drift(bob, Vector2d(3.0, 0.0), 300.0, 2.0 * 9.81,
                  [](const Vector2d& x) { return 0.25 * x(1) * x(1) - 9.81 * std::cos(x(0)); }),
            1e-8);
  const auto rods = two_rods();
  EXPECT_LT(drift(rods, Vector4d(2.0, 1.0, 0.0, 0.0), 150.0, 2.0 * rods.energy_upright(),
                  [&](const Vector4d& x) { return rods.energy(x); }),
            1e-8);
  const auto cart =
      cart_pole({.cart_mass = 5_kg, .pole_mass = 0.5_kg, .pole_length = 50_cm}).value();
  EXPECT_LT(drift(cart, Vector4d(0.0, 2.5, 0.0, 0.0), 300.0, 0.5 * standard_gravity,
                  [](const Vector4d& x) {
                    const double c = std::cos(x(1));
                    return 2.75 * x(2) * x(2) + 0.25 * x(2) * x(3) * c + 0.0625 * x(3) * x(3) -
                           0.25 * standard_gravity * c;
                  }),
            1e-8);
}

}  // namespace
}  // namespace flyball::mechanisms::manipulators_test
