#include <flyball/control/response_metrics.hpp>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/core/argument.hpp>

namespace flyball::response_metrics_test {
namespace {

struct Samples {
  std::vector<double> times, values;
};

template <class F>
Samples sampled(double end, int count, const F& f) {
  Samples samples;
  for (int k = 0; k <= count; ++k) {
    samples.times.push_back(end * k / count);
    samples.values.push_back(f(samples.times.back()));
  }
  return samples;
}

/// The step response of ω²/(s² + 2ζωs + ω²), ζ < 1.
double second_order(double zeta, double omega, double t) {
  const double damped = omega * std::sqrt(1.0 - zeta * zeta);
  return 1.0 - std::exp(-zeta * omega * t) *
                   (std::cos(damped * t) + zeta * omega / damped * std::sin(damped * t));
}

// Closed forms: overshoot e^{-πζ/√(1-ζ²)} at π/ω_d; the reference is first reached at
// (π - acos ζ)/ω_d.
TEST(ResponseMetrics, Underdamped) {
  const double zeta = 0.3;
  const double omega = 4.0;
  const double damped = omega * std::sqrt(1.0 - zeta * zeta);
  const auto samples =
      sampled(12.0, 120000, [&](double t) { return second_order(zeta, omega, t); });
  const auto metrics = response_metrics(samples.times, samples.values, 1.0).value();
  const double overshoot = std::exp(-std::numbers::pi * zeta / std::sqrt(1.0 - zeta * zeta));
  EXPECT_NEAR(metrics.overshoot, overshoot, 1e-7);
  EXPECT_NEAR(metrics.peak, 1.0 + overshoot, 1e-7);
  EXPECT_NEAR(metrics.peak_time, std::numbers::pi / damped, 1e-3);
  EXPECT_NEAR(metrics.rise_time.value(), (std::numbers::pi - std::acos(zeta)) / damped, 1e-7);
  EXPECT_EQ(metrics.type, ResponseType::underdamped);
  EXPECT_NEAR(metrics.steady_state_error, 0.0, 1e-5);
  // Successive extrema shrink by the same factor: the first below 2 % is the fourth, so the band is
  // entered for good before it and left after the third.
  EXPECT_EQ(metrics.crossings, 3);
  EXPECT_GT(metrics.settling_time.value(), 3.0 * std::numbers::pi / damped);
  EXPECT_LT(metrics.settling_time.value(), 4.0 * std::numbers::pi / damped);
  EXPECT_NEAR(std::abs(second_order(zeta, omega, *metrics.settling_time) - 1.0), 0.02, 1e-6);
}

// 1 - e^{-t}: 10 to 90 % takes ln 9, 2 % is reached at ln 50, the reference never.
TEST(ResponseMetrics, FirstOrder) {
  const auto samples = sampled(10.0, 100000, [](double t) { return 1.0 - std::exp(-t); });
  const auto metrics = response_metrics(samples.times, samples.values, 1.0).value();
  EXPECT_NEAR(metrics.rise_time_10_90.value(), std::log(9.0), 1e-8);
  EXPECT_NEAR(metrics.settling_time.value(), std::log(50.0), 1e-8);
  EXPECT_FALSE(metrics.rise_time.has_value());
  EXPECT_EQ(metrics.overshoot, 0.0);
  EXPECT_EQ(metrics.type, ResponseType::overdamped);
  EXPECT_EQ(metrics.crossings, 0);
  EXPECT_NEAR(metrics.steady_state_error, std::exp(-10.0), 1e-15);
}

// Downwards and from elsewhere it is the same response.
TEST(ResponseMetrics, AnyStep) {
  const auto up = sampled(8.0, 4000, [](double t) { return second_order(0.2, 3.0, t); });
  auto down = up;
  for (double& value : down.values) {
    value = 5.0 - 3.0 * value;
  }
  const auto a = response_metrics(up.times, up.values, 1.0).value();
  const auto b = response_metrics(down.times, down.values, 2.0).value();
  EXPECT_NEAR(a.overshoot, b.overshoot, 1e-12);
  EXPECT_NEAR(a.settling_time.value(), b.settling_time.value(), 1e-9);
  EXPECT_NEAR(a.rise_time.value(), b.rise_time.value(), 1e-9);
  EXPECT_EQ(a.crossings, b.crossings);
  EXPECT_NEAR(b.peak, 5.0 - 3.0 * a.peak, 1e-12);
}

TEST(ResponseMetrics, UndershootAndNeverSettled) {
  const std::vector<double> times{0.0, 1.0, 2.0, 3.0};
  const auto metrics =
      response_metrics(times, std::vector<double>{0.0, -0.25, 0.5, 0.6}, 1.0).value();
  EXPECT_DOUBLE_EQ(metrics.undershoot, 0.25);
  EXPECT_FALSE(metrics.settling_time.has_value());
  EXPECT_FALSE(metrics.rise_time.has_value());
  EXPECT_DOUBLE_EQ(metrics.steady_state_error, 0.4);
  const auto critical =
      response_metrics(times, std::vector<double>{0.0, 0.5, 1.0, 1.001}, 1.0).value();
  EXPECT_EQ(critical.type, ResponseType::critically_damped);
  EXPECT_DOUBLE_EQ(critical.rise_time.value(), 2.0);
}

TEST(ResponseMetrics, Errors) {
  const std::vector<double> times{0.0, 1.0};
  const std::vector<double> values{0.0, 1.0};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(response_metrics(times, std::vector<double>{1.0}, 1.0)
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(response_metrics(std::vector<double>{0.0}, std::vector<double>{0.0}, 1.0)
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(response_metrics(std::vector<double>{0.0, 0.0}, values, 1.0)
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(response_metrics(times, std::vector<double>{0.0, nan}, 1.0)
                  .error()
                  .is(ArgumentError::not_finite));
  EXPECT_TRUE(response_metrics(times, values, 0.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(response_metrics(times, values, nan).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(response_metrics(times, values, 1.0, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(response_metrics(times, values, 1.0, 0.0).error().is(ArgumentError::not_positive));
}

}  // namespace
}  // namespace flyball::response_metrics_test
