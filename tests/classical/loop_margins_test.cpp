#include <flyball/classical/loop_margins.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "classical/transfer_cases.hpp"

namespace flyball::classical::loop_margins_test {
namespace {

using Complex = std::complex<double>;
using Eigen::VectorXd;
using flyball::test::transfer;

constexpr double pi = std::numbers::pi;

TEST(LoopMargins, Gold) {
  for (const auto& c : flyball::test::cases_of("transfer_functions.json")) {
    const std::string name = c["name"];
    const TransferFunction L = flyball::test::transfer_of(c);
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

/// Closed-loop poles in the right half-plane, with the delay by a Padé approximation that is exact
/// to rounding where |L| matters; -1 where one is too near to the axis to tell.
int unstable_by_pade(const TransferFunction& L, double delay) {
  const TransferFunction rational = TransferFunction::create(L.num(), L.den()).value();
  const auto closed =
      unity_feedback(series(rational, pade(Time(delay), 14).value()).value()).value();
  const Eigen::VectorXcd poles = closed.poles().value();
  int count = 0;
  for (const Complex& pole : poles) {
    if (std::abs(pole.real()) < 1e-4 * std::abs(pole)) {
      return -1;
    }
    count += pole.real() > 0.0 ? 1 : 0;
  }
  return count;
}

// A delay destabilises where |L| falls through one and gives stability back where it rises: the
// count is that of the loop with a rational delay, and the delay margin is where it first changes.
TEST(LoopMargins, StabilityWithDeadTimeIsCounted) {
  Random random(29);
  int compared = 0;
  int regained = 0;
  int turned_the_long_way = 0;
  for (int i = 0; i < 600; ++i) {
    const TransferFunction L = random_loop(random, false);
    const LoopMargins now = loop_margins(L).value();
    if (L.relative_degree() < 1 || now.gain_crossings.empty()) {
      continue;
    }
    const double fastest = now.gain_crossings.back().frequency;
    int before = now.unstable_poles;
    for (const double share : {0.1, 0.7, 2.0, 4.0}) {
      const double delay = share / fastest;
      const int expected = unstable_by_pade(L, delay);
      if (expected < 0) {
        continue;
      }
      const auto late =
          TransferFunction::create(L.num(), L.den(), std::nullopt, Time(delay)).value();
      EXPECT_EQ(loop_margins(late).value().unstable_poles, expected) << i << " " << share;
      regained += expected < before ? 1 : 0;
      before = expected;
      ++compared;
    }
    if (!now.stable) {
      EXPECT_EQ(now.delay_margin, 0.0);
      continue;
    }
    for (const GainCrossing& crossing : now.gain_crossings) {
      turned_the_long_way += crossing.phase_margin < 0.0 ? 1 : 0;
    }
    const auto unstable_at = [&](double delay) {
      return loop_margins(
                 TransferFunction::create(L.num(), L.den(), std::nullopt, Time(delay)).value())
          .value()
          .unstable_poles;
    };
    EXPECT_EQ(unstable_at(0.999 * now.delay_margin), 0) << i;
    EXPECT_GT(unstable_at(1.001 * now.delay_margin), 0) << i;
  }
  EXPECT_GE(compared, 300);
  EXPECT_GE(regained, 5);
  EXPECT_GE(turned_the_long_way, 5);
}

// Another unit of time, and num and den times one number, change frequencies and delays by the unit
// and nothing else; another unit of the output changes no bandwidth.
TEST(LoopMargins, UnitsChangeNothing) {
  for (const double delay : {0.0, 0.4}) {
    const auto margins_in = [&](double second, double factor) {
      // (2 s + 3)/(s³ + s² + 2 s) with s = second s'.
      const double f = factor;
      return loop_margins(transfer({2.0 * f * second, 3.0 * f},
                                   {f * second * second * second, f * second * second,
                                    2.0 * f * second, 0.0},
                                   delay * second))
          .value();
    };
    const LoopMargins one = margins_in(1.0, 1.0);
    for (const double second : {1e-60, 1e-9, 1e3, 1e60}) {
      for (const double factor : {1e-100, 1.0, 1e100}) {
        const LoopMargins m = margins_in(second, factor);
        ASSERT_EQ(m.gain_crossings.size(), one.gain_crossings.size()) << second << " " << factor;
        ASSERT_EQ(m.phase_crossings.size(), one.phase_crossings.size()) << second << " " << factor;
        EXPECT_EQ(m.stable, one.stable);
        EXPECT_NEAR(*m.phase_margin, *one.phase_margin, 1e-9);
        EXPECT_NEAR(m.delay_margin / second, one.delay_margin, 1e-9);
        EXPECT_NEAR(m.disk_margin, one.disk_margin, 1e-8);
        EXPECT_NEAR(m.sensitivity.value, one.sensitivity.value, 1e-8);
        EXPECT_NEAR(m.gain_crossings[0].frequency * second, one.gain_crossings[0].frequency, 1e-11);
      }
    }
  }
  for (const double gain : {1e-200, 1e-100, 1e150, 1e300}) {
    EXPECT_NEAR(bandwidth(transfer({gain}, {1.0, 1.0})).value().value_or(0.0), 0.9976283451109835,
                1e-14)
        << gain;
  }
}

// 1 + L(∞) = 0: a pole at infinity is no stable one.
TEST(LoopMargins, ALoopThatActsInstantly) {
  EXPECT_FALSE(loop_margins(transfer({-1.0, 1.0}, {1.0, 2.0})).value().stable);
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

// 1 + L = (s² + 2ζs + 1)/(s + 1)²: |S| = 1/ζ at 1 rad/s, a peak that is ζ wide. What is left of ζ
// in the numerator's 2ζ - 2 is known exactly.
TEST(LoopMargins, ANarrowPeakIsFound) {
  for (const double damping : {1e-2, 1e-5, 1e-8, 1e-11}) {
    const double num = 2.0 * damping - 2.0;
    const double kept = 0.5 * (num + 2.0);
    const LoopMargins m = loop_margins(transfer({num, 0.0}, {1.0, 2.0, 1.0})).value();
    EXPECT_TRUE(m.stable) << damping;
    EXPECT_NEAR(m.sensitivity.value * kept, 1.0, 1e-6) << damping;
    EXPECT_NEAR(m.sensitivity.frequency, 1.0, 1e-6) << damping;
  }
}

// |1 + L|² is |D + N|²/|D|² in which the highest terms are equal: what rounding left of them was a
// root near infinity, beside which the true peak was lost. No point of the curve is above the peak.
TEST(LoopMargins, NoPointIsAboveThePeak) {
  const TransferFunction continuous =
      transfer({9.659805037516815, 1.9332859322781475},
               {1.0, 0.75805784536454368, 0.3377335147432704, 0.088164947527266641,
                0.016968091124931608, 0.0022587682955374925, 0.00022813618693196908,
                1.3234389454421982e-05, 3.8573198475469116e-07});
  const TransferFunction discrete =
      TransferFunction::create(
          Eigen::Vector3d(-22.241364951097655, 12.600756874317035, -1.7874876631839218),
          Eigen::VectorXd{{1.0, 1.1061474934571429, -1.8830750423228972, -2.2096582299047083,
                           0.78428666210568621, 1.1141025066724861, -0.049097591898913759,
                           -0.17585668954517586}},
          Time(0.1))
          .value();
  for (const auto& [L, fastest] : {std::pair(&continuous, 100.0), std::pair(&discrete, 31.4)}) {
    const Peak peak = loop_margins(*L)->sensitivity;
    double largest = 0.0;
    for (double w = 1e-3; w < fastest; w *= 1.0005) {
      largest = std::max(largest, 1.0 / std::abs(1.0 + L->response(w)));
    }
    EXPECT_GE(peak.value, largest * (1.0 - 1e-12));
    EXPECT_LE(peak.value, largest * (1.0 + 1e-5));
    EXPECT_NEAR(1.0 / std::abs(1.0 + L->response(peak.frequency)), peak.value, 1e-9 * peak.value);
    const Peak other = loop_margins(*L)->complementary;
    const std::complex<double> there = L->response(other.frequency);
    EXPECT_NEAR(std::abs(there / (1.0 + there)), other.value, 1e-9 * other.value);
  }
}

// A resonance far above the dead time and the crossings, where |L| is 0.9 and turns many times: no
// crossing tells of it. The peaks are those of a grid of a thousandth of its width.
TEST(LoopMargins, AResonanceBehindDeadTimeIsSeen) {
  const auto L = transfer({180.0, 0.0}, {1.0, 200.0, 1e8}, 0.01);
  const LoopMargins m = loop_margins(L).value();
  EXPECT_TRUE(m.gain_crossings.empty());
  double sensitivity = 0.0;
  double complementary = 0.0;
  double spread = 0.0;
  for (double w = 9000.0; w < 11000.0; w += 0.1) {
    const std::complex<double> value = L.response(w);
    sensitivity = std::max(sensitivity, 1.0 / std::abs(1.0 + value));
    complementary = std::max(complementary, std::abs(value / (1.0 + value)));
    spread = std::max(spread, std::abs((1.0 - value) / (1.0 + value)));
  }
  EXPECT_GT(sensitivity, 1.9);
  EXPECT_NEAR(m.sensitivity.value, sensitivity, 1e-6);
  EXPECT_NEAR(m.complementary.value, complementary, 1e-6);
  EXPECT_NEAR(m.disk_margin, 2.0 / spread, 1e-6);
}

// Where the phase has turned beyond its digits nothing is told, at once; a delay that is as long
// where the gain is never 1 harms nothing but the peaks, which it does not bound.
TEST(LoopMargins, DeadTimeBeyondTheDigits) {
  const auto refused = loop_margins(transfer({1.0}, {1.0, 1.0, 0.0}, 1e300));
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(ArgumentError::out_of_range));
  EXPECT_NE(to_string(refused.error()).find("the delay"), std::string::npos);
  const auto quiet = loop_margins(transfer({0.5}, {1.0, 1.0}, 1e300));
  ASSERT_TRUE(quiet) << to_string(quiet.error());
  EXPECT_TRUE(quiet->stable);
  EXPECT_EQ(quiet->delay_margin, std::numeric_limits<double>::infinity());
}

// A zero at 1e19 rad/s behind a second of dead time crosses the axis 1e19 times; those that matter
// are there, the first thousand, and nothing takes long. Without it they are the same.
TEST(LoopMargins, AFarZeroHidesNoCrossing) {
  const LoopMargins far = loop_margins(transfer({1e-19, 2.0}, {1.0, 2.0, 1.0}, 1.0)).value();
  const LoopMargins without = loop_margins(transfer({2.0}, {1.0, 2.0, 1.0}, 1.0)).value();
  EXPECT_EQ(far.phase_crossings.size(), 1000U);
  ASSERT_GE(without.phase_crossings.size(), 1U);
  for (std::size_t k = 0; k < without.phase_crossings.size(); ++k) {
    EXPECT_NEAR(far.phase_crossings[k].frequency / without.phase_crossings[k].frequency, 1.0, 1e-9);
  }
  EXPECT_EQ(far.stable, without.stable);
  EXPECT_NEAR(*far.gain_margin / *without.gain_margin, 1.0, 1e-9);
  // Nor does a slow pole beside fast ones: 2e-6/(s + 1e-6) is 2 at rest and 1 at 1.7e-6 rad/s.
  const LoopMargins slow = loop_margins(transfer({2e-6}, {1e-9, 1.0 + 1e-15, 1e-6}, 1e-3)).value();
  EXPECT_TRUE(slow.stable);
  ASSERT_GE(slow.phase_crossings.size(), 1U);
  // -90° of the pole and ωT = 90°: at π/2 / 1 ms, and hardly less for the pole at 1e9.
  EXPECT_NEAR(slow.phase_crossings[0].frequency, 1570.7, 0.2);
}

// 1 + L is real at s = 0 and at infinity: an unstable lag needs a gain, a lag with a direct path
// bears one.
TEST(LoopMargins, WhereTheBorderBeginsAndEnds) {
  const LoopMargins lag = loop_margins(transfer({2.0}, {1.0, -1.0})).value();
  ASSERT_EQ(lag.phase_crossings.size(), 1U);
  EXPECT_EQ(lag.phase_crossings[0].frequency, 0.0);
  EXPECT_EQ(*lag.gain_margin, 0.5);  // s - 1 + 2k
  const LoopMargins direct = loop_margins(transfer({-0.5, -0.05}, {1.0, 1.0})).value();
  ASSERT_EQ(direct.phase_crossings.size(), 2U);  // (1 - k/2) s + 1 - k/20
  EXPECT_DOUBLE_EQ(direct.phase_crossings[0].gain_margin, 20.0);
  EXPECT_TRUE(std::isinf(direct.phase_crossings[1].frequency));
  EXPECT_EQ(*direct.gain_margin, 2.0);
  const auto sampled =
      TransferFunction::create(VectorXd::Ones(1), Eigen::Vector2d(1.0, -1.2), Time(1.0));
  const LoopMargins of_z = loop_margins(sampled.value()).value();
  ASSERT_EQ(of_z.phase_crossings.size(), 2U);  // z - 1.2 + k
  EXPECT_NEAR(of_z.phase_crossings[0].gain_margin, 0.2, 1e-14);
  EXPECT_NEAR(of_z.phase_crossings[1].gain_margin, 2.2, 1e-14);
  EXPECT_FALSE(loop_margins(transfer({-1.0}, {1.0})).value().stable);
}

// Behind a delay T the poles far away are at e^{sT} = -L(∞): on the right from |L(∞)| = 1 on.
TEST(LoopMargins, ADirectPathBehindDeadTime) {
  for (const auto& [L, stable] : {std::pair{transfer({2.0}, {1.0}, 0.1), false},
                                  {transfer({1.0}, {1.0}, 0.1), false},
                                  {transfer({0.999}, {1.0}, 0.1), true},
                                  {transfer({2.0, 0.0}, {1.0, 1.0}, 0.01), false},
                                  {transfer({0.5, 1.0}, {1.0, 1.0}, 1.0), true}}) {
    const LoopMargins m = loop_margins(L).value();
    EXPECT_EQ(m.stable, stable) << L.num().transpose();
    EXPECT_EQ(m.delay_margin > 0.0, stable) << L.num().transpose();
  }
  // Without a delay such a loop bears none.
  EXPECT_EQ(loop_margins(transfer({2.0, 0.0}, {1.0, 1.0})).value().delay_margin, 0.0);
  EXPECT_EQ(loop_margins(transfer({5.0}, {1.0})).value().delay_margin, 0.0);
}

// s^2 + 1 + e^{-sT} has two poles on the axis without T, which leave it to the right: two, not
// four.
TEST(LoopMargins, PolesThatLeaveTheBorder) {
  EXPECT_EQ(loop_margins(transfer({1.0}, {1.0, 0.0, 1.0}, 0.1)).value().unstable_poles, 2);
  EXPECT_EQ(loop_margins(transfer({1.0}, {1.0, 0.0, 0.0}, 1.0)).value().unstable_poles, 2);
  // What L = -1/(s² + 1) and a delay move to the left: s² + 1 - e^{-sT} at s² = 0 stays.
  EXPECT_EQ(loop_margins(transfer({-1.0}, {1.0, 1.0}, 1.0)).value().unstable_poles, 1);
  // (s + 1)(s + 2)(s + 3) + 60 = (s + 6)(s² + 11): neither side by rounding.
  EXPECT_EQ(loop_margins(transfer({60.0}, {1.0, 6.0, 11.0, 6.0})).value().unstable_poles, 2);
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
}  // namespace flyball::classical::loop_margins_test
