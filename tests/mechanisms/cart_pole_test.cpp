#include <flyball/mechanisms/cart_pole.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/integration/adaptive.hpp>
#include <flyball/mechanisms/arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/mechanisms/pendulum.hpp>
#include <flyball/systems/linearize.hpp>
#include <flyball/systems/model_step.hpp>

namespace flyball::mechanisms::cart_pole_test {
namespace {

using namespace flyball::literals;
using Eigen::Vector2d;
using Eigen::Vector4d;
using Input = Eigen::Vector<double, 1>;

constexpr double pi = std::numbers::pi;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

static_assert(ParametricModel<Pendulum> && ParametricModel<CartPole> && ParametricModel<Arm>);

Pendulum swing() {
  return pendulum({.mass = 2_kg, .length = 50_cm, .damping = 0.1, .gravity = 9.81}).value();
}
CartPole cart() {
  return cart_pole({.cart_mass = 5_kg, .pole_mass = 0.5_kg, .pole_length = 50_cm}).value();
}

// (8.4): A = [0 1; -g/l cos θ, -c/(m l²)], B = [0; 1/(m l²)] with m l² = 0.5 kg m².
TEST(Pendulum, LinearisesAsTheBook) {
  for (const auto& [angle, slope] : {std::pair{0.0, -19.62}, {pi, 19.62}, {pi / 3.0, -9.81}}) {
    const auto system = linearize(swing(), Vector2d(angle, 0.0), Input(0.0)).value();
    EXPECT_TRUE(system.A.isApprox(Eigen::Matrix2d{{0.0, 1.0}, {slope, -0.2}}, 1e-14));
    EXPECT_TRUE(system.B.isApprox(Vector2d(0.0, 2.0), 1e-15));
    EXPECT_EQ(system.C, Eigen::RowVector2d(1.0, 0.0));
  }
}

// m g l sin θ holds it; without damping the energy m l² ω²/2 - m g l cos θ stays.
TEST(Pendulum, EquilibriumAndEnergy) {
  Pendulum free = swing();
  const Input hold(2.0 * 9.81 * 0.5 * std::sin(0.6));
  EXPECT_TRUE(free.derivative(Vector2d(0.6, 0.0), hold).isZero(1e-15));
  free.damping = 0.0;
  const auto energy = [](const auto& x) { return 0.25 * x(1) * x(1) - 9.81 * std::cos(x(0)); };
  const auto path = integrate(with_input(free, Input(0.0)), 0.0, Vector2d(3.0, 0.0), 5.0,
                              {.relative_tolerance = 1e-12, .absolute_tolerance = 1e-12})
                        .value();
  EXPECT_NEAR(energy(path.final_state()), energy(Vector2d(3.0, 0.0)), 1e-9);
}

// About upright, with φ = θ - π: (m_c + m_p) p̈ - m_p l φ̈ = F and l φ̈ - p̈ - g φ = 0 give
// p̈ = (F + m_p g φ)/m_c, φ̈ = (F + (m_c + m_p) g φ)/(m_c l).
TEST(CartPole, LinearisesUpright) {
  const double g = standard_gravity;
  const auto system = linearize(cart(), Vector4d(0.3, pi, 0.0, 0.0), Input(0.0)).value();
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
  A.topRightCorner<2, 2>().setIdentity();
  A(2, 1) = 0.5 * g / 5.0;
  A(3, 1) = 5.5 * g / (5.0 * 0.5);
  EXPECT_LT((system.A - A).norm(), 1e-13);
  EXPECT_LT((system.B - Vector4d(0.0, 0.0, 0.2, 0.4)).norm(), 1e-15);
  EXPECT_EQ(system.C, (Eigen::Matrix<double, 2, 4>::Identity()));
}

// Both equations of Lagrange hold wherever it is, and the rate of the energy is the power of F.
TEST(CartPole, SatisfiesLagrangesEquations) {
  Random random(133);
  const auto model = cart();
  const auto& [m_c, m_p, l, g] = model;
  for (int trial = 0; trial < 100; ++trial) {
    const Vector4d x(random.normal(), random.uniform(-pi, pi), random.normal(0.0, 3.0),
                     random.normal(0.0, 8.0));
    const Input F(random.normal(0.0, 20.0));
    const Vector4d dxdt = model.derivative(x, F);
    const double s = std::sin(x(1));
    const double c = std::cos(x(1));
    const double scale = 1.0 + std::abs(F(0)) + x(3) * x(3);
    EXPECT_EQ(dxdt.head<2>(), x.tail<2>());
    EXPECT_NEAR((m_c + m_p) * dxdt(2) + m_p * l * (dxdt(3) * c - x(3) * x(3) * s), F(0),
                1e-14 * scale);
    EXPECT_NEAR(l * dxdt(3) + dxdt(2) * c + g * s, 0.0, 1e-14 * scale);
    const auto energy = [&](const auto& at) {
      using std::cos;
      using std::sin;
      const auto vx = at(2) + l * at(3) * cos(at(1));
      const auto vy = l * at(3) * sin(at(1));
      return 0.5 * m_c * at(2) * at(2) + 0.5 * m_p * (vx * vx + vy * vy) - m_p * g * l * cos(at(1));
    };
    EXPECT_NEAR(gradient(energy, x).dot(dxdt), F(0) * x(2), 1e-12 * scale * (1.0 + x.norm()));
  }
}

TEST(CartPole, IsDescribed) {
  const AnyModel model = cart();
  EXPECT_EQ(label(model.names().states[1]), "angle (rad)");
  EXPECT_TRUE(model.names().states[1].is_angle);
  EXPECT_FALSE(model.names().states[0].is_angle);
  EXPECT_EQ(label(model.names().inputs[0]), "force (N)");
  EXPECT_EQ(model.with_parameter("pole_length", 1.0).value().parameters(),
            Eigen::VectorXd(Vector4d(5.0, 0.5, 1.0, standard_gravity)));
}

TEST(CartPole, Errors) {
  const auto refused = [](CartPoleParameters p) { return cart_pole(p).error(); };
  const CartPoleParameters good{.cart_mass = 1_kg, .pole_mass = 1_kg, .pole_length = 1_m};
  EXPECT_TRUE(refused({}).is(ArgumentError::not_positive));
  for (const double bad : {nan, 0.0, -1.0}) {
    CartPoleParameters changed = good;
    changed.pole_length = Length(bad);
    EXPECT_EQ(refused(changed).subject(), "pole_length");
    changed = good;
    changed.pole_mass = Mass(bad);
    EXPECT_EQ(refused(changed).subject(), "pole_mass");
  }
  CartPoleParameters up = good;
  up.gravity = -9.81;
  EXPECT_TRUE(refused(up).is(ArgumentError::out_of_range));
  EXPECT_TRUE(pendulum({.mass = 1_kg}).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(pendulum({.mass = 1_kg, .length = 1_m, .damping = -1.0})
                  .error()
                  .is(ArgumentError::out_of_range));
}

// A mechanism's derivative is its linear model with gravity and friction.
TEST(MechanismModel, IsTheLinearModelAndItsDisturbance) {
  const FeedforwardGains gains{.kS = 0.3, .kV = 1.5, .kA = 0.25, .kG = 0.6, .angle_offset = 0.2};
  const auto check = [](const auto& model, const auto& x, double v) {
    for (const double volts : {-3.0, 0.0, 5.0}) {
      const Input u(volts);
      auto expected = (model.A * x + model.B * u).eval();
      expected(expected.size() - 1) += model.disturbance(x(0), v);
      EXPECT_TRUE(model.derivative(x, u).isApprox(expected, 1e-14));
    }
    // Away from rest its slopes are the theorem's, and gravity's.
    const auto system = linearize(model, x, Input(1.0)).value();
    auto A = model.A;
    if (model.kind == MechanismKind::arm) {
      A(1, 0) = 0.6 * std::sin(x(0) + 0.2) / 0.25;
    }
    EXPECT_TRUE(system.A.isApprox(A, 1e-14));
    EXPECT_TRUE(system.B.isApprox(model.B, 1e-14));
    EXPECT_EQ(system.C, model.C);
  };
  for (const double v : {-2.0, 0.7}) {
    check(flywheel(gains).value(), Input(v), v);
    check(elevator(gains).value(), Vector2d(0.4, v), v);
    check(arm(gains).value(), Vector2d(0.4, v), v);
  }
}

TEST(MechanismModel, GainsAreItsParameters) {
  const AnyModel model = arm({.kS = 0.3, .kV = 1.5, .kA = 0.25, .kG = 0.6}).value();
  const ModelDescription names = model.description();
  EXPECT_EQ(names.name, "arm");
  EXPECT_EQ(label(names.states[1]), "velocity (rad/s)");
  EXPECT_EQ(label(names.outputs[0]), "position (rad)");
  EXPECT_EQ(names.parameters[3].name, "kG");
  // dv/dt = (u - kS - kV v - kG cos θ)/kA at θ = 0, v = 2: by the gains -4, -8, ..., -4, 0.
  Eigen::MatrixXd F(2, 5);
  Eigen::MatrixXd H(1, 5);
  model.parameter_jacobians(Vector2d(0.0, 2.0), Input(6.0), F, H);
  const double acceleration = (6.0 - 0.3 - 3.0 - 0.6) / 0.25;
  Eigen::RowVectorXd expected(5);
  expected << -4.0, -8.0, -acceleration / 0.25, -4.0, 0.0;
  EXPECT_TRUE(F.row(1).isApprox(expected, 1e-14));
  EXPECT_TRUE(F.row(0).isZero());
  const AnyModel wheel = flywheel(FeedforwardGains{.kV = 1.0, .kA = 1.0}).value();
  EXPECT_EQ(label(wheel.names().states[0]), "velocity (rad/s)");
  EXPECT_EQ(wheel.outputs(), 1);
}

}  // namespace
}  // namespace flyball::mechanisms::cart_pole_test
