#include <flyball/classical/loop_margins.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "classical/transfer_cases.hpp"

namespace flyball::classical {
namespace {

using Complex = std::complex<double>;
using Eigen::VectorXd;
using test::transfer;

constexpr double pi = std::numbers::pi;

TEST(LoopMargins, Gold) {
  for (const auto& c : test::cases_of("transfer_functions.json")) {
    const std::string name = c["name"];
    const TransferFunction L = test::transfer_of(c);
    const LoopMargins m = loop_margins(L).value();
    ASSERT_EQ(m.gain_crossings.size(), c["gain_crossovers"].size()) << name;
    for (std::size_t i = 0; i < m.gain_crossings.size(); ++i) {
      const auto& e = c["gain_crossovers"][i];
      EXPECT_NEAR(m.gain_crossings[i].frequency / e["w"].get<double>(), 1.0, 1e-12) << name;
      EXPECT_NEAR(m.gain_crossings[i].phase_margin, e["pm_deg"].get<double>(),
                  1e-9 * std::abs(e["pm_deg"].get<double>()))
          << name;
    }
    auto phase = c["phase_crossovers"];
    for (const auto& e : c["endpoint_phase_crossovers"]) {
      phase.push_back(e);
    }
    ASSERT_EQ(m.phase_crossings.size(), phase.size()) << name;
    for (std::size_t i = 0; i < m.phase_crossings.size(); ++i) {
      EXPECT_NEAR(m.phase_crossings[i].frequency / phase[i]["w"].get<double>(), 1.0, 1e-12) << name;
      EXPECT_NEAR(m.phase_crossings[i].gain_margin / phase[i]["gm"].get<double>(), 1.0, 1e-9)
          << name;
    }
    EXPECT_EQ(m.stable, c["unity_feedback"]["stable"].get<bool>()) << name;
    if (c["Ms"].is_object()) {
      // The reference is a grid's where the peak is at an end.
      const double Ms = c["Ms"]["Ms"].get<double>();
      EXPECT_GE(m.sensitivity.value, Ms * (1.0 - 1e-12)) << name;
      EXPECT_LE(m.sensitivity.value, Ms * (1.0 + 1e-4)) << name;
    }
    const auto width = bandwidth(L).value();
    EXPECT_EQ(width.has_value(), c["bandwidth"].is_number()) << name;
    if (width && c["bandwidth"].is_number()) {
      EXPECT_NEAR(*width / c["bandwidth"].get<double>(), 1.0, 1e-12) << name;
    }
  }
}

/// A random loop whose crossings are counted on a fine grid.
TransferFunction random_loop(Random& random, bool discrete) {
  const auto n = static_cast<Eigen::Index>(1 + random.bits() % 8);
  const auto roots = [&](Eigen::Index count) {
    Eigen::VectorXcd all(count);
    for (Eigen::Index k = 0; k < count;) {
      const bool pair = k + 1 < count && random.uniform() < 0.6;
      const double size =
          discrete ? 1.2 * random.uniform() : std::pow(10.0, 3.0 * random.uniform() - 1.5);
      const double sign = random.uniform() < 0.85 ? -1.0 : 1.0;
      all(k) = pair ? std::polar(size, pi * random.uniform()) : Complex(size, 0.0);
      if (!discrete) {
        all(k).real(sign * std::abs(all(k).real()));
      }
      if (pair) {
        all(k + 1) = std::conj(all(k));
      }
      k += pair ? 2 : 1;
    }
    return all;
  };
  const auto m = static_cast<Eigen::Index>(random.bits() % static_cast<std::uint64_t>(n));
  return TransferFunction::from_zeros(roots(m), roots(n),
                                      random.normal() * std::pow(10.0, 2.0 * random.uniform()),
                                      discrete ? std::optional(Time(0.1)) : std::nullopt)
      .value();
}

// Each margin is a crossing, and the grid shows none that is not there.
TEST(LoopMargins, EveryCrossingIsFound) {
  Random random(17);
  int crossings = 0;
  for (int i = 0; i < 1500; ++i) {
    const bool discrete = i % 3 == 2;
    const TransferFunction L = random_loop(random, discrete);
    const LoopMargins m = loop_margins(L).value();
    for (const GainCrossing& g : m.gain_crossings) {
      EXPECT_NEAR(std::abs(L.response(g.frequency)), 1.0, 1e-10);
    }
    for (const PhaseCrossing& p : m.phase_crossings) {
      const Complex value = L.response(p.frequency);
      EXPECT_LE(std::abs(value + std::abs(value)), 1e-9 * std::abs(value));
      EXPECT_NEAR(p.gain_margin * std::abs(value), 1.0, 1e-10);
    }
    const double end = discrete ? pi / 0.1 : 1e4;
    double before = 0.0;
    std::size_t counted = 0;
    for (int k = 0; k <= 4000; ++k) {
      const double w =
          discrete ? end * (k + 0.5) / 4001.0 : 1e-4 * std::pow(end / 1e-4, k / 4000.0);
      const double above = std::log(std::abs(L.response(w)));
      if (k > 0 && (above > 0.0) != (before > 0.0)) {
        ++counted;
      }
      before = above;
    }
    EXPECT_GE(m.gain_crossings.size(), counted) << i;
    crossings += static_cast<int>(counted);
    // Stability is the closed loop's poles, and the Nyquist curve encircles -1 as often.
    const auto closed = unity_feedback(L);
    if (closed) {
      EXPECT_EQ(m.stable, closed->is_stable().value());
    }
  }
  EXPECT_GE(crossings, 800);
}

// e^{-Ts}/(s + 1) under feedback K: the delay margin of K/(s + 1) is (π - atan w)/w, w = √(K² - 1).
TEST(LoopMargins, DeadTime) {
  for (const double K : {1.5, 3.0, 10.0}) {
    const double w = std::sqrt(K * K - 1.0);
    const double critical = (pi - std::atan(w)) / w;
    EXPECT_NEAR(loop_margins(transfer({K}, {1.0, 1.0})).value().delay_margin / critical, 1.0,
                1e-13);
    for (const double share : {0.3, 0.99, 1.01, 3.7}) {
      const double T = share * critical;
      const LoopMargins m = loop_margins(transfer({K}, {1.0, 1.0}, T)).value();
      EXPECT_EQ(m.stable, share < 1.0) << K << " " << share;
      if (m.stable) {
        EXPECT_NEAR(m.delay_margin, critical - T, 1e-12);
        EXPECT_GT(*m.gain_margin, 1.0);
      }
      for (const PhaseCrossing& p : m.phase_crossings) {
        // atan w + wT is an odd multiple of π.
        const double turns = (std::atan(p.frequency) + p.frequency * T) / pi;
        EXPECT_NEAR(std::abs(std::remainder(turns, 2.0)), 1.0, 1e-9);
        EXPECT_NEAR(p.gain_margin, std::hypot(1.0, p.frequency) / K, 1e-9 * p.gain_margin);
      }
      // Each turn of the phase up to the last place that is looked at.
      const double last = 10.0 * std::max(1.0, 1.0 / T);
      const auto expected = static_cast<std::size_t>(
          std::floor((std::atan(last) + last * T - pi) / (2.0 * pi) + 1.0));
      EXPECT_EQ(m.phase_crossings.size(), expected);
      // Roots of s + 1 + K e^{-Ts} in the right half-plane: a pair for each passage of the axis.
      const double passed = (T * w - (pi - std::atan(w))) / (2.0 * pi);
      EXPECT_EQ(m.unstable_poles,
                passed < 0.0 ? 0 : 2 * static_cast<int>(std::floor(passed) + 1.0));
    }
  }
}

TEST(LoopMargins, PeakAndDisk) {
  // 1/(s² + 2ζs + 1) peaks at 1/(2ζ√(1 - ζ²)).
  for (const double zeta : {0.01, 0.1, 0.5}) {
    const Peak peak = peak_gain(transfer({1.0}, {1.0, 2.0 * zeta, 1.0})).value();
    EXPECT_NEAR(peak.value * 2.0 * zeta * std::sqrt(1.0 - zeta * zeta), 1.0, 1e-13);
    EXPECT_NEAR(peak.frequency, std::sqrt(1.0 - 2.0 * zeta * zeta), 1e-12);
  }
  EXPECT_TRUE(std::isinf(peak_gain(transfer({1.0}, {1.0, 0.0, 1.0})).value().value));
  EXPECT_TRUE(std::isinf(peak_gain(transfer({1.0}, {1.0, 0.0})).value().value));
  // An integrator's S - T = (s - 1)/(s + 1) is all-pass.
  EXPECT_NEAR(loop_margins(transfer({1.0}, {1.0, 0.0})).value().disk_margin, 2.0, 1e-14);
  // With a delay the grid's peak is the rational approximation's.
  const LoopMargins exact = loop_margins(transfer({2.0}, {1.0, 1.0, 0.0}, 0.2)).value();
  const LoopMargins near =
      loop_margins(series(transfer({2.0}, {1.0, 1.0, 0.0}), pade(Time(0.2), 8).value()).value())
          .value();
  EXPECT_NEAR(exact.sensitivity.value, near.sensitivity.value, 1e-8);
  EXPECT_NEAR(exact.disk_margin, near.disk_margin, 1e-8);
  EXPECT_NEAR(*exact.gain_margin, *near.gain_margin, 1e-9);
  EXPECT_NEAR(*exact.phase_margin, *near.phase_margin, 1e-9);
  EXPECT_NEAR(exact.delay_margin, near.delay_margin, 1e-10);
}

TEST(LoopMargins, NothingToCross) {
  const LoopMargins none = loop_margins(transfer({0.0}, {1.0, 1.0})).value();
  EXPECT_TRUE(none.stable);
  EXPECT_TRUE(none.gain_crossings.empty() && none.phase_crossings.empty());
  EXPECT_TRUE(std::isinf(none.delay_margin));
  EXPECT_EQ(none.sensitivity.value, 1.0);
  EXPECT_FALSE(bandwidth(transfer({1.0}, {1.0, 0.0})).value().has_value());
  EXPECT_FALSE(bandwidth(transfer({1.0, 0.0}, {1.0, 1.0})).value().has_value());
}

}  // namespace
}  // namespace flyball::classical
