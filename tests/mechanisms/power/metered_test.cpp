#include <flyball/mechanisms/power/metered.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/math/integration/adaptive.hpp>
#include <flyball/mechanisms/lift/elevator_arm.hpp>
#include <flyball/systems/linearize.hpp>
#include <flyball/systems/model_step.hpp>

#include "support/allocation_count.hpp"

namespace flyball::mechanisms::metered_test {
namespace {

using namespace flyball::literals;
using Input = Eigen::Vector<double, 1>;
using Eigen::Vector2d;

const Winding warm{.heat_capacity = 80.0, .thermal_resistance = 0.9, .ambient = 20.0};

/// An elevator whose drum is too heavy to turn, so that its motors stall.
CascadeElevator stalled() {
  return cascade_elevator({.shaft = {.motor = cim(2),
                                     .gearing = 1.0,
                                     .moment_of_inertia = MomentOfInertia(1e12)},
                           .drum_radius = Length(1.0),
                           .carriage = 1_kg})
      .value();
}

// At a constant current the heat grows with the resistance: C dT/dt = I² R (1 + α(T - T_a))/n -
// (T - T_a)/R_th is linear, T - T_a = P/λ (1 - e^{-λt/C}), P = I² R/n, λ = 1/R_th - α P.
TEST(Metered, WarmsUpAtAHeldCurrent) {
  const DcMotor motor = cim(2);
  const auto behind = powered(stalled(), {.stator = 60.0}, Battery{}).value();
  const auto model = metered(behind, {MotorWindings{warm, 2}}).value();
  const auto path = integrate(with_input(model, Input(12.0)), 0.0, model.start(Vector2d(0.0, 0.0)),
                              30.0, {.relative_tolerance = 1e-11, .absolute_tolerance = 1e-11})
                        .value();
  const double P = 60.0 * 60.0 * motor.R / 2.0;
  const double lambda = 1.0 / 0.9 - 0.00393 * P;
  const double rise = P / lambda * (1.0 - std::exp(-lambda * 30.0 / 80.0));
  EXPECT_NEAR(path.final_state()(model.temperature_at(0)), 20.0 + rise, 1e-7);
  EXPECT_GT(rise, 15.0);
  // All of it went into the windings, those of both motors: C ΔT and what left them.
  const double energy = path.final_state()(model.energy_at());
  double lost = 0.0;
  for (int k = 0; k < 30000; ++k) {
    lost += (path.at(1e-3 * (k + 0.5))(model.temperature_at(0)) - 20.0) / 0.9 * 1e-3;
  }
  EXPECT_NEAR(energy, 2.0 * (80.0 * rise + lost), 1e-5 * energy);
}

// Warm windings carry less at a held voltage, I = V/R(T), and the model moves by that current.
TEST(Metered, WarmWindingsPushLess) {
  const ElevatorArm arm = elevator_arm({.elevator = {.shaft = {.motor = neo(2), .gearing = 8.0},
                                                     .drum_radius = Length(0.02),
                                                     .carriage = 6_kg},
                                        .joint = {.motor = neo(), .gearing = 60.0},
                                        .moment_of_inertia = MomentOfInertia(0.9),
                                        .mass = 4_kg,
                                        .center_of_mass = Length(0.4)})
                              .value();
  const auto behind = powered(arm, {.supply = 50.0}, {.resistance = 0.02}).value();
  const auto model = metered(behind, {MotorWindings{warm, 2}, MotorWindings{warm, 1}}).value();
  auto x = model.start(Eigen::Vector4d(0.3, 0.2, 0.4, -0.5));
  const Vector2d u(8.0, -3.0);
  const auto cold = model.derivative(x, u);
  // Cold, it is the powered model.
  EXPECT_LE((cold.head<4>() - behind.derivative(Eigen::Vector4d(x.head<4>()), u)).norm(), 1e-12);
  x(model.temperature_at(0)) = x(model.temperature_at(1)) = 120.0;
  const auto flow = model.flow(x, u);
  const double by = 1.0 + 0.00393 * 100.0;
  const double emf = behind.model().motor_speed(Eigen::Vector4d(x.head<4>()), 0) / neo().Kv;
  EXPECT_NEAR(flow.current[0], (flow.voltage[0] - emf) / (neo(2).R * by), 1e-10);
  const auto hot = model.derivative(x, u);
  EXPECT_LT(hot(2), cold(2));
  // Its motion is the model's under the voltages of cold windings with those currents.
  const double emf_arm = behind.model().motor_speed(Eigen::Vector4d(x.head<4>()), 1) / neo().Kv;
  const Vector2d same(emf + flow.current[0] * neo(2).R, emf_arm + flow.current[1] * neo().R);
  EXPECT_LE((hot.head<4>() - arm.derivative(Eigen::Vector4d(x.head<4>()), same)).norm(), 1e-10);
  EXPECT_NEAR(hot(model.energy_at()),
              flow.voltage[0] * flow.current[0] + flow.voltage[1] * flow.current[1], 1e-10);
  EXPECT_NEAR(flow.rail * (flow.supply[0] + flow.supply[1]), hot(model.energy_at()), 1e-9);
  // Exact derivatives, by temperatures too.
  const auto exact =
      jacobians([&](const auto& at, const auto& in) { return model.derivative(at, in); }, x, u);
  for (int i = 0; i < 7; ++i) {
    auto up = x;
    auto down = x;
    up(i) += 1e-4;
    down(i) -= 1e-4;
    const auto slope = ((model.derivative(up, u) - model.derivative(down, u)) / 2e-4).eval();
    EXPECT_LE((exact.by_x.col(i) - slope).norm(), 1e-5 * (1.0 + slope.norm())) << i;
  }
  const AnyModel any = model;
  EXPECT_EQ(label(any.names().states[5]), "winding temperature 2 (°C)");
  EXPECT_EQ(label(any.names().states[6]), "energy (J)");
  const test::AllocationCounter counter;
  for (int k = 0; k < 20; ++k) {
    x = rk4(model, x, u, 1e-3);
  }
  if (test::counts_allocations()) {
    EXPECT_EQ(counter.count(), 0U);
  }
  EXPECT_TRUE(x.allFinite());
}

// Windings of which nothing is known stay as they are.
TEST(Metered, UnknownWindingsStayCold) {
  const auto behind = powered(stalled(), {}, Battery{}).value();
  const auto model = metered(behind, {MotorWindings{}}).value();
  const auto x = model.start(Vector2d(0.0, 0.0));
  EXPECT_EQ(model.derivative(x, Input(12.0))(model.temperature_at(0)), 0.0);
  EXPECT_FALSE(Winding{}.is_known());
  EXPECT_EQ(warm.warmth(-1e6), 0.1);
}

TEST(Metered, Refusals) {
  const auto behind = powered(stalled(), {}, Battery{}).value();
  const auto subject = [&](const MotorWindings& bad) {
    return std::string(metered(behind, {bad}).error().subject());
  };
  EXPECT_EQ(to_string(metered(behind, {MotorWindings{{.heat_capacity = 0.0}, 1}}).error()),
            "metered: heat_capacity of motor 1 is 0; it must be greater than zero; leave it out "
            "where it is not known");
  EXPECT_EQ(subject({{.thermal_resistance = NAN}, 1}), "thermal_resistance of motor 1");
  EXPECT_EQ(subject({{.ambient = NAN}, 1}), "ambient of motor 1");
  EXPECT_EQ(subject({{.copper = -1.0}, 1}), "copper of motor 1");
  EXPECT_EQ(subject({warm, 0}), "count of motor 1");
}

}  // namespace
}  // namespace flyball::mechanisms::metered_test
