#include <flyball/control/pid.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/control/lqr.hpp>
#include <flyball/core/argument.hpp>
#include <flyball/core/random.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/systems/discretize.hpp>

#include "support/allocation_count.hpp"

namespace flyball::pid_test {
namespace {

using namespace flyball::literals;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

Pid make(const PidSettings& settings) {
  return Pid::create(settings).value();
}

// Definition 2.1.1: u = Kp e.
TEST(Pid, Proportional) {
  Pid controller = make({.gains = {.kp = 3.0}});
  EXPECT_DOUBLE_EQ(controller.calculate(0.5, 2.0), 4.5);
  EXPECT_DOUBLE_EQ(controller.error(), 1.5);
}

// Definition 2.2.1 as section 2.2 samples it: Kd ((r_k - r_{k-1})/T - (y_k - y_{k-1})/T).
TEST(Pid, DerivativeIsTheVelocityError) {
  Pid controller = make({.gains = {.kp = 2.0, .kd = 0.5}, .period = 0.1});
  EXPECT_DOUBLE_EQ(controller.calculate(0.0, 1.0), 2.0);
  // e = 1.2 - 0.3; (0.2 - 0.3)/0.1 = -1.
  EXPECT_NEAR(controller.calculate(0.3, 1.2), 2.0 * 0.9 - 0.5, 1e-14);
}

// Definition 2.3.1: the integral of e = 2 over five periods of 0.1 s is 1.
TEST(Pid, Integral) {
  Pid controller = make({.gains = {.kp = 1.0, .ki = 3.0}, .period = 0.1});
  double u = 0.0;
  for (int k = 0; k < 5; ++k) {
    u = controller.calculate(-2.0, 0.0);
  }
  EXPECT_NEAR(u, 2.0 + 3.0 * 1.0, 1e-14);
  EXPECT_NEAR(controller.integral(), 3.0, 1e-14);
}

// On the measurement a step of the reference gives no kick; a moving measurement is damped alike.
TEST(Pid, DerivativeOnMeasurement) {
  Pid controller =
      make({.gains = {.kp = 1.0, .kd = 0.5}, .period = 0.1, .derivative_on_measurement = true});
  EXPECT_DOUBLE_EQ(controller.calculate(0.0, 0.0), 0.0);
  EXPECT_DOUBLE_EQ(controller.calculate(0.0, 10.0), 10.0);
  EXPECT_NEAR(controller.calculate(1.0, 10.0), 9.0 - 0.5 * 10.0, 1e-13);
  Pid kicking = make({.gains = {.kp = 1.0, .kd = 0.5}, .period = 0.1});
  EXPECT_DOUBLE_EQ(kicking.calculate(0.0, 0.0), 0.0);
  EXPECT_NEAR(kicking.calculate(0.0, 10.0), 10.0 + 0.5 * 100.0, 1e-13);
}

// The filter's answer to a ramp of slope 1, backward Euler: d_k = 1 - (τ/(τ + T))^k.
TEST(Pid, DerivativeFilter) {
  const double T = 0.02;
  const double tau = 0.1;
  Pid controller = make({.gains = {.kd = 1.0}, .period = T, .derivative_time_constant = tau});
  for (int k = 0; k <= 20; ++k) {
    const double u = controller.calculate(0.0, k * T);
    ASSERT_NEAR(u, 1.0 - std::pow(tau / (tau + T), k), 1e-12) << k;
  }
}

TEST(Pid, OutputLimits) {
  Pid controller = make({.gains = {.kp = 10.0}, .output_min = -4.0, .output_max = 12.0});
  EXPECT_EQ(controller.calculate(0.0, 100.0), 12.0);
  EXPECT_TRUE(controller.saturated());
  EXPECT_EQ(controller.calculate(0.0, -100.0), -4.0);
  EXPECT_EQ(controller.calculate(0.0, 0.5, 1.0), 6.0);
  EXPECT_FALSE(controller.saturated());
}

/// How far x₊ = x + T u overshoots a step of 10 with |u| <= 1.
double overshoot(AntiWindup anti_windup) {
  PidSettings settings{.gains = {.kp = 2.0, .ki = 1.0}, .period = 0.01};
  settings.output_min = -1.0;
  settings.output_max = 1.0;
  settings.anti_windup = anti_windup;
  Pid controller = make(settings);
  double x = 0.0;
  double peak = 0.0;
  for (int k = 0; k < 6000; ++k) {
    x += 0.01 * controller.calculate(x, 10.0);
    peak = std::max(peak, x);
  }
  return peak - 10.0;
}

// Section 2.6's windup, and what each remedy leaves of it.
TEST(Pid, AntiWindup) {
  EXPECT_GT(overshoot(AntiWindup::none), 5.0);
  EXPECT_LT(overshoot(AntiWindup::clamping), 0.6);
  EXPECT_LT(overshoot(AntiWindup::back_calculation), 0.6);
}

// Back-calculation by hand: e = 1, kp = ki = 1, T = 0.1, T_t = 0.5, |u| <= 0.5.
// I = 0.1, u_unlimited = 1.1, u = 0.5; I ← 0.1 + 0.1/0.5 (0.5 - 1.1) = -0.02.
TEST(Pid, BackCalculationByHand) {
  PidSettings settings{.gains = {.kp = 1.0, .ki = 1.0}, .period = 0.1};
  settings.output_min = -0.5;
  settings.output_max = 0.5;
  settings.anti_windup = AntiWindup::back_calculation;
  settings.tracking_time = 0.5;
  Pid controller = make(settings);
  EXPECT_EQ(controller.calculate(0.0, 1.0), 0.5);
  EXPECT_NEAR(controller.integral(), -0.02, 1e-15);
}

TEST(Pid, IntegralLimitsAndZone) {
  PidSettings settings{.gains = {.ki = 1.0}, .period = 1.0};
  settings.integral_min = -2.0;
  settings.integral_max = 3.0;
  settings.integral_zone = 5.0;
  Pid controller = make(settings);
  for (int k = 0; k < 10; ++k) {
    EXPECT_LE(controller.calculate(0.0, 1.0), 3.0);
  }
  EXPECT_EQ(controller.integral(), 3.0);
  EXPECT_EQ(controller.calculate(0.0, 6.0), 0.0);
  EXPECT_EQ(controller.calculate(0.0, 5.0), 3.0);
  EXPECT_EQ(controller.calculate(0.0, -5.0), -2.0);
}

// From 3 rad to -3 rad it is 0.283 rad forwards; and passing the seam is no jump of the derivative.
TEST(Pid, ContinuousInput) {
  const double turn = 2.0 * std::numbers::pi;
  Pid controller = make({.gains = {.kp = 1.0}, .turn = turn});
  EXPECT_NEAR(controller.calculate(3.0, -3.0), turn - 6.0, 1e-14);
  for (const bool on_measurement : {false, true}) {
    Pid damping = make({.gains = {.kd = 1.0},
                        .period = 0.1,
                        .derivative_on_measurement = on_measurement,
                        .turn = turn});
    EXPECT_EQ(damping.calculate(3.1, 0.0), 0.0);
    EXPECT_NEAR(damping.calculate(-3.1, 0.0), -(turn - 6.2) / 0.1, 1e-12);
  }
}

// The output before and after a change of gains is the same for the same error.
TEST(Pid, BumplessGainChange) {
  Pid controller = make({.gains = {.kp = 2.0, .ki = 1.0, .kd = 0.1}, .period = 0.01});
  controller.calculate(0.0, 1.0);
  controller.calculate(0.01, 1.0);
  const double before = controller.calculate(0.02, 1.0);
  EXPECT_TRUE(controller.set_gains({.kp = 5.0, .ki = 0.3, .kd = 0.4}));
  const double after = controller.calculate(0.03, 1.0);
  // One more period: kp falls by 5·0.01, the integral grows by 0.3·0.01·0.97.
  EXPECT_NEAR(after, before - 5.0 * 0.01 + 0.3 * 0.01 * 0.97, 1e-12);
  EXPECT_FALSE(controller.set_gains({.kp = nan}));
  EXPECT_EQ(controller.gains().kp, 5.0);
  EXPECT_TRUE(controller.set_gains({.kp = 1.0}));
  EXPECT_EQ(controller.integral(), 0.0);
  EXPECT_NEAR(controller.calculate(0.0, 1.0), 1.0, 1e-14);
}

TEST(Pid, Reset) {
  Pid controller = make({.gains = {.kp = 1.0, .ki = 1.0, .kd = 1.0}, .period = 0.1});
  controller.calculate(0.0, 1.0);
  controller.calculate(0.5, 1.0);
  controller.reset();
  Pid fresh = make({.gains = {.kp = 1.0, .ki = 1.0, .kd = 1.0}, .period = 0.1});
  EXPECT_EQ(controller.calculate(0.2, 1.0), fresh.calculate(0.2, 1.0));
  controller.reset(7.0);
  EXPECT_NEAR(controller.calculate(1.0, 1.0), 7.0, 1e-14);
  controller.reset(nan);
  EXPECT_EQ(controller.integral(), 0.0);
}

// Without a measurement: no proportional, no derivative, the integral holds; no kick afterwards.
TEST(Pid, NoMeasurement) {
  Pid controller = make({.gains = {.kp = 1.0, .ki = 1.0, .kd = 1.0}, .period = 0.1});
  controller.calculate(0.0, 1.0);
  const double held = controller.integral();
  for (const double lost : {nan, infinity, -infinity}) {
    EXPECT_EQ(controller.calculate(lost, 1.0), held);
    EXPECT_EQ(controller.calculate(0.0, lost, 0.5), held + 0.5);
  }
  EXPECT_NEAR(controller.calculate(0.7, 1.0), 0.3 + held + 0.03, 1e-14);
  EXPECT_NEAR(controller.calculate(0.7, 1.0, nan), 0.3 + held + 0.06, 1e-14);
}

// Finite and within the limits for any input at all.
TEST(Pid, IsFiniteWhateverComes) {
  Random random(1);
  const std::array<double, 9> values{0.0,    1.0, -1.0,     1e308,    -1e308,
                                     5e-324, nan, infinity, -infinity};
  for (const AntiWindup anti_windup :
       {AntiWindup::none, AntiWindup::clamping, AntiWindup::back_calculation}) {
    for (const double limit : {12.0, infinity}) {
      PidSettings settings{.gains = {.kp = 1e3, .ki = 1e5, .kd = -1e5}, .period = 1e-3};
      settings.output_min = -limit;
      settings.output_max = limit;
      settings.anti_windup = anti_windup;
      settings.derivative_time_constant = 0.01;
      Pid controller = make(settings);
      for (int k = 0; k < 5000; ++k) {
        const auto pick = [&] { return values[random.bits() % values.size()]; };
        const double u = controller.calculate(pick(), pick(), pick());
        ASSERT_TRUE(std::isfinite(u));
        ASSERT_LE(std::abs(u), limit);
        ASSERT_TRUE(std::isfinite(controller.integral()));
      }
    }
  }
}

TEST(Pid, AllocatesNothing) {
  static_assert(noexcept(std::declval<Pid&>().calculate(0.0, 0.0)));
  static_assert(noexcept(std::declval<Pid&>().set_gains({})));
  static_assert(noexcept(std::declval<Pid&>().reset()));
  if (test::counts_allocations()) {
    Pid controller = make({.gains = {.kp = 1.0, .ki = 1.0, .kd = 1.0}});
    const test::AllocationCounter counter;
    double sum = 0.0;
    for (int k = 0; k < 100; ++k) {
      sum += controller.calculate(0.01 * k, 1.0);
      controller.set_gains({.kp = 2.0, .ki = 1.0});
    }
    EXPECT_TRUE(std::isfinite(sum));
    EXPECT_EQ(counter.count(), 0u);
  }
}

// Figure 2.7: PI on the flywheel of Figure 2.5, Q = 200 rad/s, R = 12 V, Ki = 0.2, the integral
// within 12 V; samples of the book's own script.
TEST(Pid, IsTheBooksFlywheel) {
  const auto flywheel = mechanisms::flywheel({.motor = mechanisms::vex_775pro(),
                                              .gearing = 2.0 / 3.0,
                                              .moment_of_inertia = MomentOfInertia(0.00032)})
                            .value();
  const auto plant = discretize(flywheel, 5_ms).value();
  PidSettings settings{
      .gains = {.kp = lqr(plant, bryson({200}), bryson({12})).value().K(0), .ki = 0.2},
      .period = 0.005};
  settings.output_min = settings.integral_min = -12.0;
  settings.output_max = settings.integral_max = 12.0;
  settings.anti_windup = AntiWindup::none;
  Pid controller = make(settings);
  std::vector<double> speeds;
  double x = 0.0;
  for (int k = 0; k < 2040; ++k) {
    speeds.push_back(x);
    const double r = k >= 20 && k < 1020 ? 942.4777960769379 : 0.0;
    x = plant.A(0, 0) * x + plant.B(0, 0) * controller.calculate(x, r);
  }
  EXPECT_NEAR(speeds[255], 1008.3343280163555, 1e-9 * 942.0);
  EXPECT_NEAR(speeds[510], 942.1343065759827, 1e-9 * 942.0);
  EXPECT_NEAR(speeds[765], 942.4750877905371, 1e-9 * 942.0);
  EXPECT_NEAR(speeds[1020], 942.477842565534, 1e-9 * 942.0);
  EXPECT_NEAR(speeds[1274], -20.829591302455935, 1e-9 * 942.0);
  EXPECT_NEAR(speeds[2039], -8.685703787238312e-06, 1e-9 * 942.0);
}

// Figure 2.5: without an integral the loop rests where 0 = (A - 1 - B Kp) ω + B Kp r.
TEST(Pid, ProportionalLeavesAnError) {
  const double a = 0.9975024630976951;
  const double b = 0.6155494833981923;
  const double r = 942.4777960769379;
  const double kp = 0.055;
  Pid controller = make({.gains = {.kp = kp}});
  double x = 0.0;
  for (int k = 0; k < 4000; ++k) {
    x = a * x + b * controller.calculate(x, r);
  }
  EXPECT_NEAR(x, b * kp * r / (1.0 - a + b * kp), 1e-9 * r);
}

TEST(Pid, Errors) {
  const auto refused = [](const PidSettings& settings) { return Pid::create(settings).error(); };
  EXPECT_TRUE(refused({.period = 0.0}).is(ArgumentError::not_positive));
  EXPECT_TRUE(refused({.gains = {.kp = nan}}).is(ArgumentError::not_finite));
  EXPECT_TRUE(refused({.gains = {.ki = infinity}}).is(ArgumentError::not_finite));
  EXPECT_TRUE(refused({.gains = {.kd = nan}}).is(ArgumentError::not_finite));
  EXPECT_TRUE(refused({.derivative_time_constant = -1.0}).is(ArgumentError::out_of_range));
  EXPECT_TRUE(refused({.tracking_time = -1.0}).is(ArgumentError::out_of_range));
  EXPECT_TRUE(refused({.integral_zone = 0.0}).is(ArgumentError::not_positive));
  EXPECT_TRUE(refused({.integral_zone = nan}).is(ArgumentError::not_positive));
  EXPECT_TRUE(refused({.turn = -1.0}).is(ArgumentError::out_of_range));
  const Error limits = refused({.output_min = 1.0, .output_max = 1.0});
  EXPECT_EQ(to_string(limits), "Pid: output_min is 1; it must be below output_max, which is 1");
  EXPECT_TRUE(refused({.integral_min = nan}).is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::pid_test
