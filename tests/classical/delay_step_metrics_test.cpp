// Step metrics of systems with dead time anywhere.
#include <cmath>

#include <gtest/gtest.h>

#include <flyball/classical/step_metrics.hpp>
#include <flyball/core/random.hpp>

#include "classical/transfer_cases.hpp"

namespace flyball::classical::delay_step_metrics_test {
namespace {

using flyball::test::transfer;

void expect_same(const StepMetrics& a, const StepMetrics& b, double scale, const char* what) {
  EXPECT_NEAR(a.final_value, b.final_value, 1e-10 * std::abs(b.final_value)) << what;
  const auto near = [&](const std::optional<double>& x, const std::optional<double>& y,
                        double tolerance) {
    ASSERT_EQ(x.has_value(), y.has_value()) << what;
    if (x) {
      EXPECT_NEAR(*x, *y, tolerance) << what;
    }
  };
  near(a.rise_time, b.rise_time, 1e-7 * scale);
  near(a.settling_time, b.settling_time, 1e-7 * scale);
  // An overshoot below 1e-8 is none where the motion is right to 1e-11.
  near(a.overshoot, b.overshoot, 1.1e-8);
  near(a.undershoot, b.undershoot, 1e-9);
  near(a.peak, b.peak, 1.1e-8 * std::abs(b.final_value));
}

// Dead time at the input only: those of the transfer function, found another way.
TEST(DelayStepMetrics, AreThoseOfTheTransferFunction) {
  Random random(41);
  for (int i = 0; i < 200; ++i) {
    const double zeta = random.uniform(0.15, 1.5);
    const double w = std::pow(10.0, random.uniform(-2.0, 2.0));
    const double zero = random.uniform(-0.5, 0.8) / w;  // either side
    const double gain = random.uniform(-3.0, 3.0);
    const double delay = i % 3 == 0 ? 0.0 : random.uniform(0.0, 3.0) / w;
    const auto G =
        transfer({gain * zero * w * w, gain * w * w}, {1.0, 2.0 * zeta * w, w * w}, delay);
    const auto late = DelaySystem::create(G).value();
    const auto expected = step_metrics(G).value();
    const auto found = step_metrics(late, 0, 0).value();
    expect_same(found, expected, expected.settling_time.value_or(1.0), "second order");
  }
}

// y' = k (1 - y(t - τ)): k t until τ, then k t - k² (t - τ)²/2 until 2 τ. For 1 <= k τ < π/2 the
// top is at τ + 1/k, k τ + 1/2 high.
TEST(DelayStepMetrics, IntegratorInALoopWithDeadTime) {
  for (const double product : {1.0, 1.2, 1.4}) {
    for (const double tau : {0.01, 3.0}) {
      const double k = product / tau;
      const auto loop =
          feedback(DelaySystem::create(transfer({k}, {1.0, 0.0}, tau)).value()).value();
      const StepMetrics m = step_metrics(loop, 0, 0).value();
      EXPECT_NEAR(m.final_value, 1.0, 1e-12);
      // The loop's output is late by τ itself.
      EXPECT_NEAR(*m.rise_time, 0.8 / k, 1e-9 / k);
      EXPECT_NEAR(*m.overshoot, product - 0.5, 1e-9);
      EXPECT_NEAR(*m.peak_time, 2.0 * tau + 1.0 / k, 1e-6 * tau);
      EXPECT_EQ(*m.undershoot, 0.0);
    }
  }
  // k τ > π/2 has no final value.
  const auto unstable = feedback(DelaySystem::create(transfer({1.6}, {1.0, 0.0}, 1.0)).value());
  const StepMetrics m = step_metrics(*unstable, 0, 0).value();
  EXPECT_TRUE(std::isnan(m.final_value));
  EXPECT_FALSE(m.settling_time);
}

// y = u/2 + y(t - 1)/2 of a loop of jumps: 1 - 2⁻ⁿ, within 2 % from the sixth on.
TEST(DelayStepMetrics, JumpsCount) {
  const auto half = DelaySystem::create(transfer({0.5}, {1.0}, 1.0)).value();
  const auto one = DelaySystem::gain(Eigen::MatrixXd::Constant(1, 1, 0.5)).value();
  const auto loop = series(one, feedback(DelaySystem::gain(Eigen::MatrixXd::Ones(1, 1)).value(),
                                         half, FeedbackSign::positive)
                                    .value())
                        .value();
  const StepMetrics m = step_metrics(loop, 0, 0).value();
  EXPECT_NEAR(m.final_value, 1.0, 1e-12);
  EXPECT_NEAR(*m.settling_time, 5.0, 1e-9);  // 1 - 2⁻⁶ = 0.984
  EXPECT_NEAR(*m.rise_time, 3.0, 1e-9);      // 0.5 at once, 0.9375 at 3
  EXPECT_EQ(*m.overshoot, 0.0);
}

TEST(DelayStepMetrics, EachChannelIsItsOwn) {
  const auto fast = DelaySystem::create(transfer({1.0}, {0.1, 1.0}, 0.3)).value();
  const auto slow = DelaySystem::create(transfer({-4.0}, {2.0, 1.0})).value();
  const auto both = append(fast, slow).value();
  EXPECT_NEAR(*step_metrics(both, 0, 0)->rise_time, 0.1 * std::log(9.0), 1e-9);
  EXPECT_NEAR(*step_metrics(both, 1, 1)->rise_time, 2.0 * std::log(9.0), 1e-8);
  EXPECT_EQ(step_metrics(both, 1, 1)->final_value, -4.0);
  EXPECT_EQ(step_metrics(both, 0, 1)->final_value, 0.0);
  EXPECT_FALSE(step_metrics(both, 0, 1)->rise_time);
  EXPECT_TRUE(step_metrics(both, 2, 0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(step_metrics(both, 0, -1).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(step_metrics(both, 0, 0, 1.0).error().is(ArgumentError::out_of_range));
}

TEST(DelayStepMetrics, ADelayThatIsNextToNoneIsRefused) {
  const auto late = DelaySystem::create(transfer({1.0}, {1.0}, 1.0)).value();
  const auto soon = DelaySystem::create(transfer({2.0}, {1.0}, 5e-324)).value();
  const auto error = step_metrics(parallel(late, soon).value(), 0, 0).error();
  EXPECT_TRUE(error.is(ArgumentError::out_of_range));
  EXPECT_EQ(to_string(error).substr(0, 55),
            "response: the shortest delay is 5e-324 s; it must be at");
  const auto near = DelaySystem::create(transfer({2.0}, {1.0}, 1e-3)).value();
  EXPECT_EQ(step_metrics(parallel(late, near).value(), 0, 0)->final_value, 3.0);
}

TEST(DelayStepMetrics, ASlowPartBesideAShortDelay) {
  const auto fast = DelaySystem::create(transfer({1.0}, {1.0, 1.0})).value();
  const auto slow = DelaySystem::create(transfer({1.0}, {1.0, 1e-3}, 0.1)).value();
  const auto metrics = step_metrics(parallel(fast, slow).value(), 0, 0).value();
  // 1 + 1000 (1 - e^{-(t - 0.1) / 1000}) reaches a share p of 1001; 1 - e^{-t} is over by then.
  const auto reaches = [](double p) { return 0.1 - 1e3 * std::log1p(-(1001.0 * p - 1.0) / 1e3); };
  EXPECT_NEAR(*metrics.rise_time, reaches(0.9) - reaches(0.1), 1e-6);
  EXPECT_NEAR(*metrics.settling_time, reaches(0.98), 1e-6);
}

// (1 - e^{-Ts})/s G(s) is G behind a hold: of an impulse it makes a pulse, and a step becomes a
// ramp of T seconds. The pole at zero is none of it.
TEST(DelayStepMetrics, BehindAHold) {
  const double T = 0.2;
  const auto hold = series(parallel(DelaySystem::create(transfer({1.0}, {1.0})).value(),
                                    DelaySystem::create(transfer({-1.0}, {1.0}, T)).value())
                               .value(),
                           DelaySystem::create(transfer({1.0}, {1.0, 0.0})).value())
                        .value();
  const auto ramp = step_metrics(hold, 0, 0).value();
  EXPECT_NEAR(ramp.final_value, T, 1e-13);
  EXPECT_NEAR(*ramp.rise_time, 0.8 * T, 1e-9);
  EXPECT_NEAR(*ramp.settling_time, 0.98 * T, 1e-9);
  // y = t - 1 + e^{-t} until T, T - (e^{T} - 1) e^{-t} after it.
  const auto lag = series(hold, DelaySystem::create(transfer({1.0}, {1.0, 1.0})).value()).value();
  const auto held = step_metrics(lag, 0, 0).value();
  EXPECT_NEAR(held.final_value, T, 1e-13);
  EXPECT_NEAR(*held.settling_time, std::log(std::expm1(T) / (0.02 * T)), 1e-9);
  // In a loop: y' = -y + v, v the mean of r - y over the last T; it ends at T/(1 + T).
  const auto loop = step_metrics(feedback(lag).value(), 0, 0).value();
  EXPECT_NEAR(loop.final_value, T / (1.0 + T), 1e-13);
  EXPECT_TRUE(loop.settling_time);
  // A second hold: a pole of order two.
  const auto twice = step_metrics(series(hold, lag).value(), 0, 0).value();
  EXPECT_NEAR(twice.final_value, T * T, 1e-12);
  // One that is not emptied stays an integrator.
  const auto rest = series(parallel(DelaySystem::create(transfer({1.0}, {1.0})).value(),
                                    DelaySystem::create(transfer({-0.999}, {1.0}, T)).value())
                               .value(),
                           DelaySystem::create(transfer({1.0}, {1.0, 0.0})).value())
                        .value();
  EXPECT_FALSE(step_metrics(rest, 0, 0)->rise_time);
}

TEST(DelayStepMetrics, OfADiscreteLoopItsSamples) {
  const auto G = TransferFunction::create(Eigen::Vector2d(0.1, 0.08),
                                          Eigen::Vector3d(1.0, -1.5, 0.6), Time(0.02), Time(0.06))
                     .value();
  expect_same(step_metrics(DelaySystem::create(G).value(), 0, 0).value(), step_metrics(G).value(),
              1.0, "discrete");
}

}  // namespace
}  // namespace flyball::classical::delay_step_metrics_test
