#include <flyball/classical/step_metrics.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include "classical/transfer_cases.hpp"

namespace flyball::classical::step_metrics_test {
namespace {

using flyball::test::transfer;

void expect_step(const nlohmann::json& expected, const TransferFunction& G,
                 const std::string& name) {
  if (!expected.contains("yfinal")) {
    return;
  }
  const StepMetrics m = step_metrics(G).value();
  EXPECT_NEAR(m.final_value / expected["yfinal"].get<double>(), 1.0, 1e-13) << name;
  const auto near = [&](const char* field, const std::optional<double>& value, double tolerance) {
    if (!expected.contains(field)) {
      return;
    }
    const bool there = expected[field].is_number();
    EXPECT_EQ(value.has_value(), there) << name << " " << field;
    if (value && there) {
      const double e = expected[field].get<double>();
      EXPECT_NEAR(*value, e, tolerance * std::max(std::abs(e), e == 0.0 ? 1e-3 : 0.0))
          << name << " " << field;
    }
  };
  const auto percent = [](const std::optional<double>& share) {
    return share ? std::optional(100.0 * *share) : std::nullopt;
  };
  near("rise_10_90", m.rise_time, 1e-6);
  near("settling_2pct", m.settling_time, 1e-6);
  near("settling_2pct_first_sample_inside", m.settling_time, 1e-9);
  near("overshoot_pct", percent(m.overshoot), 1e-6);
  // The reference is the least of its samples: never below the true one.
  if (expected.contains("undershoot_pct")) {
    const double e = expected["undershoot_pct"].get<double>();
    EXPECT_GE(100.0 * *m.undershoot, e * (1.0 - 1e-12)) << name;
    EXPECT_LE(100.0 * *m.undershoot, e * (1.0 + 1e-3)) << name;
  }
  near("peak_time", m.peak_time, 1e-6);
}

TEST(StepMetrics, Gold) {
  for (const auto& c : flyball::test::cases_of("transfer_functions.json")) {
    const std::string name = c["name"];
    const TransferFunction G = flyball::test::transfer_of(c);
    expect_step(c["step"], G, name);
    if (c["unity_feedback"]["stable"].get<bool>()) {
      expect_step(c["unity_feedback"]["step"], unity_feedback(G).value(), name + " closed");
    }
  }
}

// In closed form: 1 - e^{-t}, of any unit of time, gain and sign, and late.
TEST(StepMetrics, FirstOrder) {
  for (const double tau : {1e-6, 1.0, 1e5}) {
    for (const double gain : {1.0, -3.0, 1e6}) {
      for (const double delay : {0.0, 0.5 * tau}) {
        const StepMetrics m = step_metrics(transfer({gain}, {tau, 1.0}, delay)).value();
        EXPECT_NEAR(*m.rise_time / (tau * std::log(9.0)), 1.0, 1e-12);
        EXPECT_NEAR(*m.settling_time / (tau * std::log(50.0) + delay), 1.0, 1e-12);
        EXPECT_EQ(*m.overshoot, 0.0);
        EXPECT_FALSE(m.peak_time.has_value());
        EXPECT_EQ(m.final_value, gain);
      }
    }
  }
}

// Second order: overshoot e^{-πζ/√(1 - ζ²)} at π/(ω√(1 - ζ²)), down to weak damping.
TEST(StepMetrics, SecondOrder) {
  for (const double zeta : {0.001, 0.05, 0.3, 0.7, 0.9}) {
    const double root = std::sqrt(1.0 - zeta * zeta);
    const StepMetrics m = step_metrics(transfer({9.0}, {1.0, 6.0 * zeta, 9.0})).value();
    EXPECT_NEAR(*m.overshoot / std::exp(-M_PI * zeta / root), 1.0, 1e-9) << zeta;
    EXPECT_NEAR(*m.peak_time * 3.0 * root / M_PI, 1.0, 1e-9) << zeta;
  }
}

// (1 - s)/((s + 1)(s + 2)) goes down to -1/6 of 1/2 at ln 3/2.
TEST(StepMetrics, Undershoot) {
  const StepMetrics m = step_metrics(transfer({-1.0, 1.0}, {1.0, 3.0, 2.0})).value();
  EXPECT_NEAR(*m.undershoot, 1.0 / 3.0, 1e-14);
  EXPECT_EQ(*m.overshoot, 0.0);
}

// A damping of 1e-6: it overshoots as it does, and when it settles half a million points do not
// show.
TEST(StepMetrics, RingsForALongTime) {
  const StepMetrics m = step_metrics(transfer({1.0}, {1.0, 2e-6, 1.0})).value();
  EXPECT_NEAR(*m.overshoot, std::exp(-M_PI * 1e-6), 1e-9);
  EXPECT_FALSE(m.settling_time.has_value());
}

// Poles eight decades apart: the slow one is what is seen.
TEST(StepMetrics, StiffSystems) {
  const auto fast = transfer({1.0}, {1e-8, 1.0});
  const StepMetrics m = step_metrics(series(fast, transfer({1.0}, {1.0, 1.0})).value()).value();
  EXPECT_NEAR(*m.rise_time / std::log(9.0), 1.0, 1e-9);
}

// Fast poles keep the steps short long after the slow pair has settled.
TEST(StepMetrics, ASlowPairBesideFastPoles) {
  const StepMetrics m =
      step_metrics(transfer({-0.20581874, 1.17337759, -2.2173414, 1.56306478, -0.35251851},
                            {1.0, 19.18047385, 106.36256923, 200.91118363, 108.54222583, 4.44965519,
                             1.68270509}))
          .value();
  ASSERT_TRUE(m.settling_time);
  EXPECT_NEAR(*m.settling_time / 654.548535291785, 1.0, 1e-6);  // by its partial fractions
}

TEST(StepMetrics, WhatDoesNotSettle) {
  for (const auto& G : {transfer({1.0}, {1.0, 0.0}), transfer({1.0}, {1.0, -1.0}),
                        transfer({1.0}, {1.0, 0.0, 1.0})}) {
    const StepMetrics m = step_metrics(G).value();
    EXPECT_FALSE(std::isfinite(m.final_value));
    EXPECT_FALSE(m.rise_time || m.settling_time || m.overshoot || m.peak);
  }
  const StepMetrics gain = step_metrics(transfer({-2.0}, {1.0})).value();
  EXPECT_EQ(gain.final_value, -2.0);
  EXPECT_EQ(*gain.rise_time, 0.0);
  EXPECT_EQ(*gain.settling_time, 0.0);
  const StepMetrics washout = step_metrics(transfer({1.0, 0.0}, {1.0, 1.0})).value();
  EXPECT_EQ(washout.final_value, 0.0);
  EXPECT_FALSE(washout.overshoot.has_value());
  EXPECT_NEAR(washout.peak.value(), 1.0, 1e-14);  // e^{-t}
  EXPECT_EQ(washout.peak_time, 0.0);
  EXPECT_TRUE(
      step_metrics(transfer({1.0}, {1.0, 1.0}), 0.0).error().is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::classical::step_metrics_test
