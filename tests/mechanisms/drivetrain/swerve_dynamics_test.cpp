#include <flyball/mechanisms/drivetrain/swerve_dynamics.hpp>

#include <cmath>
#include <complex>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/integration/adaptive.hpp>
#include <flyball/mechanisms/power/powered.hpp>
#include <flyball/systems/linearize.hpp>
#include <flyball/systems/model_step.hpp>

#include "support/allocation_count.hpp"

namespace flyball::mechanisms::swerve_dynamics_test {
namespace {

using namespace flyball::literals;
using Complex = std::complex<double>;
using Swerve = SwerveDynamics<4>;
using State = Eigen::Vector<double, 18>;
using Volts = Eigen::Vector<double, 8>;
using Eigen::Vector2d;

constexpr double g = standard_gravity;

SwerveDynamicsParameters<4> parts() {
  return {
      .body = {.mass = 50_kg, .moment_of_inertia = 4_kg_m2, .center_of_mass = Vector2d(0.04, 0.02)},
      .positions = {Vector2d(0.28, 0.26), {0.28, -0.26}, {-0.28, 0.26}, {-0.28, -0.26}},
      .wheel_radius = Length(0.05),
      .drive = {.motor = kraken_x60(),
                .gearing = 6.75,
                .moment_of_inertia = MomentOfInertia(0.006),
                .friction = 0.2,
                .damping = 0.002},
      .steer = {.motor = falcon_500(),
                .gearing = 150.0 / 7.0,
                .moment_of_inertia = MomentOfInertia(0.03),
                .friction = 0.5},
      .patch_radius = Length(0.01)};
}

State random_state(Random& random) {
  State x;
  for (auto& entry : x) {
    entry = random.uniform(-3.0, 3.0);
  }
  for (int i = 0; i < 4; ++i) {
    x(Swerve::wheel_speed_at(i)) *= 20.0;
  }
  return x;
}

Volts random_volts(Random& random) {
  Volts u;
  for (auto& entry : u) {
    entry = random.uniform(-12.0, 12.0);
  }
  return u;
}

// The energy of the robot, its modules' turning and its wheels changes by what the shafts put in
// and what the contacts' sliding and turning take out.
TEST(SwerveDynamics, BalancesItsEnergy) {
  Random random(11);
  auto made = parts();
  made.patch_radius = Length(0.0);
  const Swerve drive = swerve_dynamics(made).value();
  const Swerve scrubbing = swerve_dynamics(parts()).value();
  const auto energy = [](const auto& x) {
    const auto vx = x(3) - x(5) * 0.02;
    const auto vy = x(4) + x(5) * 0.04;
    auto sum = 0.5 * 50.0 * (vx * vx + vy * vy) + 0.5 * 4.0 * x(5) * x(5);
    for (int i = 0; i < 4; ++i) {
      const auto turn = x(5) + x(Swerve::steer_rate_at(i));
      sum += 0.5 * 0.03 * turn * turn +
             0.5 * 0.006 * x(Swerve::wheel_speed_at(i)) * x(Swerve::wheel_speed_at(i));
    }
    return sum;
  };
  for (int trial = 0; trial < 200; ++trial) {
    const State x = random_state(random);
    const Volts u = random_volts(random);
    const auto slope = gradient(energy, x);
    const State rate = drive.derivative(x, u);
    double power = 0.0;
    for (int i = 0; i < 4; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const double delta = x(Swerve::angle_at(i));
      const double Omega = x(Swerve::wheel_speed_at(i));
      const double rate_of_steer = x(Swerve::steer_rate_at(i));
      const Vector2d& r = made.positions[k];
      const Vector2d sliding(x(3) - x(5) * r(1) - 0.05 * Omega * std::cos(delta),
                             x(4) + x(5) * r(0) - 0.05 * Omega * std::sin(delta));
      const double share = 0.25 + 0.25 * 0.04 / r(0) + 0.25 * 0.02 / r(1);
      power += made.tire.force(sliding, 0.05 * Omega, share * 50.0 * g).dot(sliding);
      power += drive.shaft(0).torque(Omega, u(i)) * Omega;
      power += drive.shaft(4).torque(rate_of_steer, u(4 + i)) * rate_of_steer;
    }
    EXPECT_NEAR(slope.dot(rate), power, 1e-12 * slope.cwiseAbs().dot(rate.cwiseAbs()));
    // Turning contacts take more.
    EXPECT_LE(slope.dot(State(scrubbing.derivative(x, u))), slope.dot(rate));
  }
}

// In the field, in complex numbers, integrated on its own at 1e-10.
TEST(SwerveDynamics, AgainstNewtonInTheField) {
  const auto made = parts();
  const Swerve drive = swerve_dynamics(made).value();
  const Complex c(0.04, 0.02);
  const Tire tire;
  const DcMotor driving = kraken_x60();
  const DcMotor steering = falcon_500();
  const auto volts = [](double t, int i) {
    return i < 4 ? 5.0 + 3.0 * std::sin(2.0 * t + i) : 1.5 * std::cos(3.0 * t + i);
  };
  const auto held = [&](double N, double rolling, Complex sliding) {
    const Complex slip = sliding / std::hypot(rolling, tire.rest_speed);
    const double B = tire.stiffness / (tire.friction * tire.shape);
    const double size = std::abs(slip);
    return size > 0.0
               ? -tire.friction * N * std::sin(tire.shape * std::atan(B * size)) / size * slip
               : Complex(0.0);
  };
  // [centre (2), θ, its velocity (2), ω; angle of the module in the field, its rate, Ω]
  const auto field = [&](double t, const State& z) {
    const Complex V(z(3), z(4));
    const double w = z(5);
    const Complex turn = std::polar(1.0, z(2));
    Complex F_all = 0.0;
    double M_all = 0.0;
    State rate;
    for (int i = 0; i < 4; ++i) {
      const Vector2d& at = made.positions[static_cast<std::size_t>(i)];
      const double N = (0.25 + 0.25 * 0.04 / at(0) + 0.25 * 0.02 / at(1)) * 50.0 * g;
      const Complex r = turn * (Complex(at(0), at(1)) - c);
      const Complex along = std::polar(1.0, z(6 + 3 * i));
      const double spin = z(7 + 3 * i);
      const double Omega = z(8 + 3 * i);
      const Complex F = held(N, 0.05 * Omega, V + Complex(0.0, w) * r - 0.05 * Omega * along);
      const double scrub = 0.01 * held(N, 0.05 * Omega, 0.01 * spin).real();
      const double relative = spin - w;
      const double steer = 150.0 / 7.0 * steering.Kt *
                               (volts(t, 4 + i) - 150.0 / 7.0 * relative / steering.Kv) /
                               steering.R -
                           0.5 * std::tanh(relative / 0.5);
      const double push =
          6.75 * driving.Kt * (volts(t, i) - 6.75 * Omega / driving.Kv) / driving.R -
          0.2 * std::tanh(Omega / 0.5) - 0.002 * Omega;
      F_all += F;
      M_all += (std::conj(r) * F).imag() - steer;
      rate.segment<3>(6 + 3 * i) << spin, (steer + scrub) / 0.03,
          (push - 0.05 * (F * std::conj(along)).real()) / 0.006;
    }
    rate.head<6>() << z(3), z(4), w, F_all.real() / 50.0, F_all.imag() / 50.0, M_all / 4.0;
    return rate;
  };
  const IntegrationOptions tight{.relative_tolerance = 1e-10, .absolute_tolerance = 1e-12};
  State z0 = State::Zero();
  z0.head<2>() << c.real(), c.imag();
  const auto reference = integrate(field, 0.0, z0, 1.0, tight).value();
  const auto path = integrate(
                        [&](double t, const State& x) {
                          Volts u;
                          for (int i = 0; i < 8; ++i) {
                            u(i) = volts(t, i);
                          }
                          return State(drive.derivative(x, u));
                        },
                        0.0, State(State::Zero()), 1.0, tight)
                        .value();
  const Eigen::VectorXd& z = reference.final_state();
  State expected = z;
  const Complex turn = std::polar(1.0, z(2));
  const Complex origin = Complex(z(0), z(1)) - turn * c;
  const Complex v = (Complex(z(3), z(4)) - Complex(0.0, z(5)) * turn * c) * std::conj(turn);
  expected.head<2>() << origin.real(), origin.imag();
  expected.segment<2>(3) << v.real(), v.imag();
  for (int i = 0; i < 4; ++i) {
    expected(6 + 3 * i) -= z(2);
    expected(7 + 3 * i) -= z(5);
  }
  EXPECT_LE((path.final_state() - expected).norm(), 1e-8 * expected.norm());
}

// On ice nothing from outside turns it: J ω + Σ J_s (ω + dδ/dt) stays while the modules are
// steered.
TEST(SwerveDynamics, KeepsItsAngularMomentumOnIce) {
  auto made = parts();
  made.tire.friction = made.tire.stiffness = 1e-12;
  const Swerve drive = swerve_dynamics(made).value();
  Volts u = Volts::Zero();
  u.tail<4>() << 3.0, 5.0, -1.0, 2.0;
  const auto path = integrate(with_input(drive, u), 0.0, State(State::Zero()), 0.5,
                              {.relative_tolerance = 1e-11, .absolute_tolerance = 1e-12})
                        .value();
  const Eigen::VectorXd& x = path.final_state();
  double momentum = 4.0 * x(5);
  for (int i = 0; i < 4; ++i) {
    momentum += 0.03 * (x(5) + x(Swerve::steer_rate_at(i)));
  }
  EXPECT_LT(x(5), -0.05);
  EXPECT_NEAR(momentum, 0.0, 1e-9);
}

// Straight ahead at full voltage: the wheels spin until the robot has come to their speed, the
// robot never gains more than μ g; limits on the stator's currents keep the wheels from spinning.
TEST(SwerveDynamics, CurrentLimitsKeepItsGrip) {
  const Swerve drive = swerve_dynamics(parts()).value();
  const Battery battery{.open_circuit_voltage = 12.5, .resistance = 0.02};
  const auto loose = powered(drive, {}, battery).value();
  const auto gentle = powered(drive, {.stator = 60.0, .supply = 40.0}, battery).value();
  Volts u = Volts::Zero();
  u.head<4>().setConstant(12.0);
  const State rest = State::Zero();
  const auto slipped = integrate(with_input(loose, u), 0.0, rest, 0.2).value();
  const auto held = integrate(with_input(gentle, u), 0.0, rest, 0.2).value();
  const auto slip = [](const Eigen::VectorXd& x) { return 0.05 * x(8) - x(3); };
  EXPECT_LT(slipped.final_state()(3), 1.1 * g * 0.2);
  EXPECT_GT(slip(slipped.at(0.02)), 0.5);
  EXPECT_LT(slip(held.at(0.02)), 0.1);
  EXPECT_LT(slip(held.final_state()), 0.35);
  EXPECT_GT(held.final_state()(3), 0.5);
  const auto flow = gentle.flow(State(held.final_state()), u);
  const auto free = loose.flow(rest, u);
  EXPECT_LT(free.rail, 9.0);
  for (std::size_t k = 0; k < 8; ++k) {
    EXPECT_LE(std::abs(flow.current[k]), 60.0 + 1e-9);
    EXPECT_LE(flow.supply[k], 40.0 + 1e-9);
  }
  // Derivatives through limits and sag are those of differences.
  State x = held.final_state();
  x.segment<3>(3) += Eigen::Vector3d(0.1, 0.2, 0.3);
  const auto exact =
      jacobians([&](const auto& at, const auto& in) { return loose.derivative(at, in); }, x, u);
  const auto numeric =
      numerical_linearize([&](const auto& at, const auto& in,
                              auto out) { out = loose.derivative(State(at), Volts(in)); },
                          x, u);
  ASSERT_TRUE(numeric);
  EXPECT_LE((exact.by_x - numeric->A).norm(), 1e-5 * exact.by_x.norm());
  EXPECT_LE((exact.by_u - numeric->B).norm(), 1e-5 * exact.by_u.norm());
}

TEST(SwerveDynamics, IsAModelWithoutAllocations) {
  const auto drive = swerve_dynamics(parts()).value();
  const AnyModel model = drive;
  EXPECT_EQ(label(model.names().states[9]), "module angle 2 (rad)");
  EXPECT_TRUE(model.names().states[9].is_angle);
  EXPECT_EQ(label(model.names().inputs[4]), "steer voltage 1 (V)");
  const auto behind = powered(drive, {.stator = 80.0}, Battery{.resistance = 0.02}).value();
  State x = State::Zero();
  Volts u = Volts::Constant(6.0);
  const test::AllocationCounter counter;
  for (int k = 0; k < 100; ++k) {
    x = rk4(behind, x, u, 1e-4);
  }
  if (test::counts_allocations()) {
    EXPECT_EQ(counter.count(), 0U);
  }
  EXPECT_TRUE(x.allFinite());
}

TEST(SwerveDynamics, RefusesImpossibleRobots) {
  auto made = parts();
  made.positions[2] = made.positions[0];
  EXPECT_EQ(to_string(swerve_dynamics(made).error()),
            "swerve_dynamics: positions is (0.28 m, 0.26 m) of modules 1 and 3 both; it must be "
            "modules in different places; give each module its own place in the robot's frame, x "
            "forward and y left");
  made = parts();
  made.body.center_of_mass = Vector2d(0.5, 0.0);
  EXPECT_EQ(swerve_dynamics(made).error().subject(), "center_of_mass");
  made = parts();
  made.steer.moment_of_inertia = MomentOfInertia(0.0);
  EXPECT_EQ(swerve_dynamics(made).error().subject(), "moment_of_inertia of steer");
  made = parts();
  made.drive.friction = -1.0;
  EXPECT_EQ(swerve_dynamics(made).error().subject(), "friction of drive");
  made = parts();
  made.wheel_radius = Length(NAN);
  EXPECT_TRUE(swerve_dynamics(made).error().is(ArgumentError::not_finite));
  made = parts();
  made.patch_radius = Length(-0.01);
  EXPECT_TRUE(swerve_dynamics(made).error().is(ArgumentError::out_of_range));
  const Swerve drive = swerve_dynamics(parts()).value();
  EXPECT_FALSE(powered(drive, {.stator = -1.0}, Battery{}));
  EXPECT_FALSE(powered(drive, {.supply = NAN}, Battery{}));
  EXPECT_FALSE(powered(drive, {}, Battery{.open_circuit_voltage = 0.0}));
}

}  // namespace
}  // namespace flyball::mechanisms::swerve_dynamics_test
