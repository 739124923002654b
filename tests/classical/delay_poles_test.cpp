#include <flyball/classical/delay_poles.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/classical/delay_margins.hpp>
#include <flyball/classical/delay_response.hpp>
#include <flyball/classical/loop_margins.hpp>
#include <flyball/classical/response_margins.hpp>
#include <flyball/classical/step_metrics.hpp>
#include <flyball/core/random.hpp>

#include "classical/delay_pole_count.hpp"
#include "classical/transfer_cases.hpp"
#include "support/random_systems.hpp"

namespace flyball::classical::delay_poles_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using flyball::test::random_matrix;
using flyball::test::transfer;

DelaySystem system_of(const TransferFunction& G) {
  return DelaySystem::create(G).value();
}
DelaySystem closed(const TransferFunction& L) {
  return feedback(system_of(L)).value();
}

// s + k e^{-τs} = 0: s = W(-kτ)/τ; W₀(-1) and W₁(-1) from mpmath.lambertw.
TEST(DelayPoles, LambertsFunction) {
  const auto found = rightmost_poles(closed(transfer({0.5}, {1.0, 0.0}, 2.0))).value();
  ASSERT_GE(found.poles.size(), 2);
  EXPECT_LE(std::abs(found.poles(0) - 0.5 * Complex(-0.31813150520476413, 1.3372357014306895)),
            1e-15);
  EXPECT_EQ(found.poles(1), std::conj(found.poles(0)));
  if (found.poles.size() > 2) {
    EXPECT_LE(std::abs(found.poles(2) - 0.5 * Complex(-2.0622777295982839, 7.588631178472513)),
              1e-14);
  }
  EXPECT_TRUE(found.stable);
  EXPECT_EQ(found.high_frequency_abscissa, -std::numeric_limits<double>::infinity());
  // Stable up to kτ = π/2.
  constexpr double half_pi = 1.5707963267948966;
  EXPECT_TRUE(is_stable(closed(transfer({half_pi - 1e-6}, {1.0, 0.0}, 1.0))).value());
  EXPECT_FALSE(is_stable(closed(transfer({half_pi + 1e-6}, {1.0, 0.0}, 1.0))).value());
  EXPECT_EQ(rightmost_poles(closed(transfer({half_pi + 1e-6}, {1.0, 0.0}, 1.0))).value().unstable,
            2);
  // Two pairs from kτ = 5π/2 on.
  EXPECT_EQ(rightmost_poles(closed(transfer({8.0}, {1.0, 0.0}, 1.0))).value().unstable, 4);
}

// The numbers of unstable poles of loops of one delay by their crossings (Walton and Marshall).
TEST(DelayPoles, AgreesWithCrossingsOfTheAxis) {
  Random random(31);
  int unstable = 0;
  int compared = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const auto n = static_cast<Index>(1 + random.bits() % 4);
    VectorXd num(n);
    VectorXd den(n + 1);
    for (Index i = 0; i <= n; ++i) {
      den(i) = i == 0 ? 1.0 : 2.0 * random.normal();
      if (i < n) {
        num(i) = 2.0 * random.normal();
      }
    }
    const double delay = 3.0 * random.uniform() + 0.01;
    const auto L = TransferFunction::create(num, den, std::nullopt, Time(delay)).value();
    const auto margins = loop_margins(L);
    ASSERT_TRUE(margins);
    const auto found = rightmost_poles(closed(L));
    ASSERT_TRUE(found) << trial << ' ' << to_string(found.error());
    EXPECT_EQ(found->unstable, margins->unstable_poles) << trial;
    unstable += margins->stable ? 0 : 1;
    ++compared;
    // Each is one: 1 + L(s) = 0.
    for (const Complex& s : found->poles) {
      const auto value = L.at(s);
      if (value && std::abs(*value) < 1e6) {
        EXPECT_LE(std::abs(1.0 + *value), 1e-8 * (1.0 + std::abs(s) * delay)) << trial;
      }
    }
  }
  EXPECT_GE(unstable, 300);
  EXPECT_GE(compared - unstable, 100);
}

// Jumps that go round a loop without a state, and a loop with one beside them.
TEST(DelayPoles, NeutralLoops) {
  // 1 + e^{-2s}/2 = 0: Re s = -ln 2/2, at every odd multiple of π/2.
  const auto halving = rightmost_poles(closed(transfer({0.5}, {1.0}, 2.0))).value();
  EXPECT_TRUE(halving.stable);
  EXPECT_NEAR(halving.high_frequency_abscissa, -0.5 * std::log(2.0), 1e-12);
  EXPECT_NEAR(halving.poles(0).real(), -0.5 * std::log(2.0), 1e-12);
  const auto doubling = rightmost_poles(closed(transfer({2.0}, {1.0}, 2.0))).value();
  EXPECT_FALSE(doubling.stable);
  EXPECT_EQ(doubling.unstable, std::numeric_limits<int>::max());
  // (s + 1) + 0.6 (s + 3) e^{-s}: judged like by its crossings.
  for (const double gain : {0.2, 0.6, 0.9}) {
    const auto L = transfer({gain, 3.0 * gain}, {1.0, 1.0}, 1.0);
    EXPECT_EQ(rightmost_poles(closed(L)).value().unstable, loop_margins(L).value().unstable_poles)
        << gain;
  }
}

// A chain of poles that tends to the axis, from the left, on it or from the right, is no stability:
// all ways of asking agree, and where the chain stays left of it, too.
TEST(DelayPoles, DirectPathsBehindDeadTimeByAllWays) {
  const auto endless = std::numeric_limits<int>::max();
  struct Case {
    VectorXd num;
    VectorXd den;
    int unstable;
  };
  const auto v = [](double a, double b) { return VectorXd(Eigen::Vector2d(a, b)); };
  for (const Case& c :
       {Case{v(1.0, 1.0), v(1.0, 2.0), endless}, Case{v(1.0, 1.0), v(1.0, 0.5), endless},
        Case{v(1.0, 1.0), v(1.0, 1.0), endless}, Case{v(2.0, 1.0), v(1.0, 1.0), endless},
        Case{v(-1.0, 1.0), v(1.0, 0.0), endless}, Case{v(0.99, 0.99), v(1.0, 0.5), 2},
        Case{v(0.9, 0.9), v(1.0, 2.0), 0}, Case{v(-0.9, 0.9), v(1.0, 2.0), 0}}) {
    const auto L = TransferFunction::create(c.num, c.den, std::nullopt, Time(1.0)).value();
    const auto margins = loop_margins(L).value();
    const auto found = rightmost_poles(closed(L)).value();
    EXPECT_EQ(margins.unstable_poles, c.unstable);
    EXPECT_EQ(found.unstable, c.unstable);
    EXPECT_EQ(found.stable, c.unstable == 0);
    EXPECT_EQ(margins.stable, c.unstable == 0);
    // |L| = 1 at every frequency has no list of crossings.
    const bool all_pass = c.num == c.den;
    const auto by_system = loop_margins(system_of(L));
    const auto by_factors = loop_margins(frequency_response(L).value());
    ASSERT_TRUE(all_pass || (by_system && by_factors));
    EXPECT_TRUE(all_pass || by_system->unstable_poles == c.unstable);
    EXPECT_TRUE(all_pass || by_factors->stable == (c.unstable == 0));
    const auto curve = nyquist(frequency_response(L).value()).value();
    EXPECT_EQ(curve.closed_loop_unstable.value_or(endless), c.unstable);
    const auto metrics = step_metrics(closed(L), 0, 0).value();
    EXPECT_EQ(metrics.settling_time.has_value(), c.unstable == 0);
    // |L| comes as near to |L(∞)| as one likes, with every phase.
    const double last = std::abs(c.num(0) / c.den(0));
    if (last == 1.0) {
      EXPECT_TRUE(std::isinf(margins.sensitivity.value));
      EXPECT_EQ(margins.gain_margin, 1.0);
    } else {
      EXPECT_GE(margins.sensitivity.value, 1.0 / std::abs(1.0 - last) * (1.0 - 1e-12));
    }
  }
}

// Long delays: hundreds of poles on the right, of which the rightmost are listed, and all counted.
TEST(DelayPoles, HundredsOnTheRight) {
  for (const auto& [gain, delay] :
       {std::pair{100.0, 10.0}, {1000.0, 1.0}, {200.0, 1.0}, {60.0, 40.0}}) {
    const auto L = transfer({gain}, {1.0, 1.0}, delay);
    const auto found = rightmost_poles(closed(L)).value();
    EXPECT_EQ(found.unstable, loop_margins(L).value().unstable_poles) << gain;
    ASSERT_GE(found.poles.size(), 20);
    for (const Complex& s : found.poles) {
      EXPECT_LE(std::abs(1.0 + L.at(s).value()), 1e-9);
    }
    // s = W(gain e^τ τ e^{jπ})/τ - 1, of which the first is the rightmost.
    const Complex w = (found.poles(0) + 1.0) * delay;
    EXPECT_LE(std::abs(w * std::exp(w) + gain * delay * std::exp(delay)),
              1e-9 * gain * delay * std::exp(delay));
  }
}

// y' = -a y(t - τ₁) - b y(t - τ₂): its poles satisfy s + a e^{-τ₁s} + b e^{-τ₂s} = 0, and motions
// grow or decay with the rightmost.
TEST(DelayPoles, TwoDelays) {
  Random random(6);
  int unstable = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const double a = 2.0 * random.uniform();
    const double b = 2.0 * random.uniform();
    const double t1 = 0.2 + random.uniform();
    const double t2 = 0.2 + random.uniform();
    const auto loop =
        feedback(system_of(transfer({1.0}, {1.0, 0.0})),
                 parallel(system_of(transfer({a}, {1.0}, t1)), system_of(transfer({b}, {1.0}, t2)))
                     .value())
            .value();
    const auto found = rightmost_poles(loop).value();
    for (const Complex& s : found.poles) {
      EXPECT_LE(std::abs(s + a * std::exp(-t1 * s) + b * std::exp(-t2 * s)),
                1e-12 * (1.0 + std::abs(s)) * std::exp(std::max(0.0, -2.0 * s.real())));
    }
    const double abscissa = found.poles(0).real();
    if (std::abs(abscissa) > 0.1) {
      const auto motion =
          initial_response(loop, VectorXd::Ones(1), ResponseTimes{Time(0.25), 161}).value();
      const double early = motion.y.col(0).segment(40, 40).cwiseAbs().maxCoeff();
      const double late = motion.y.col(0).segment(120, 40).cwiseAbs().maxCoeff();
      EXPECT_NEAR(std::log(late / early) / 20.0, abscissa, 0.15 * std::abs(abscissa) + 0.05);
    }
    unstable += found.stable ? 0 : 1;
  }
  EXPECT_GE(unstable, 10);
  EXPECT_LE(unstable, 50);
}

TEST(DelayPoles, WithoutALoopTheyAreThoseOfA) {
  const auto found = rightmost_poles(system_of(transfer({1.0}, {1.0, 3.0, 2.0}, 0.4))).value();
  ASSERT_EQ(found.poles.size(), 2);
  EXPECT_NEAR(found.poles(0).real(), -1.0, 1e-14);
  EXPECT_NEAR(found.poles(1).real(), -2.0, 1e-14);
  EXPECT_TRUE(found.stable);
  EXPECT_FALSE(is_stable(system_of(transfer({1.0}, {1.0, 0.0}, 0.4))).value());
  EXPECT_TRUE(is_stable(DelaySystem::gain(MatrixXd::Ones(1, 1)).value()).value());
}

TEST(DelayPoles, DiscreteSystems) {
  // z³(z - 0.9) + 0.2.
  const auto L = TransferFunction::create(VectorXd::Constant(1, 0.2), VectorXd{{1.0, -0.9}},
                                          Time(0.1), Time(0.3))
                     .value();
  const auto found = rightmost_poles(closed(L)).value();
  ASSERT_EQ(found.poles.size(), 4);
  for (const Complex& z : found.poles) {
    EXPECT_LE(std::abs(z * z * z * (z - 0.9) + 0.2), 1e-14);
  }
  EXPECT_EQ(found.stable, loop_margins(L).value().stable);
}

// s + 1 + 2e^{-3s} = 0 has a pair with a positive real part. All counts of a system share their
// work: what is not left is not told, whatever the line.
TEST(DelayPoles, CountsShareTheirWork) {
  const auto L = closed(transfer({2.0}, {1.0, 1.0}, 3.0));
  const detail::Characteristic f(L.form());
  detail::PoleCountWork work(f);
  const long whole = work.left;
  EXPECT_EQ(detail::count_right_of(f, 0.0, 2.0, work), 2);
  const long taken = whole - work.left;
  EXPECT_GT(taken, 10);
  EXPECT_LT(taken, whole / 10);
  EXPECT_EQ(detail::count_right_of(f, 0.0, 2.0, work), 2);
  EXPECT_EQ(whole - work.left, 2 * taken);
  work.left = taken / 2;
  EXPECT_FALSE(detail::count_right_of(f, 0.0, 2.0, work));
  EXPECT_FALSE(detail::count_right_of(f, 0.0, 2.0, work));
}

// det M turns as it does, whatever the units of the signals in the loop: entries of 1e±6.
TEST(DelayPoles, CountsInAnyUnits) {
  const DelaySystem G = system_of(transfer({2.0}, {1.0, 1.0}, 3.0));
  for (const double size : {1e-6, 1e-3, 1.0, 1e6}) {
    const auto unit = [](double value) {
      return DelaySystem::gain(MatrixXd::Constant(1, 1, value)).value();
    };
    const auto scaled = series(unit(size), G);
    ASSERT_TRUE(scaled.has_value()) << to_string(scaled.error());
    const auto closed = feedback(*scaled, unit(1.0 / size));
    ASSERT_TRUE(closed.has_value()) << to_string(closed.error());
    const DelaySystem& loop = *closed;
    const auto found = rightmost_poles(loop);
    ASSERT_TRUE(found.has_value()) << to_string(found.error());
    EXPECT_EQ(found->unstable, 2) << size;
  }
}

// A thousand radians of dead time at frequencies that matter are told as such.
TEST(DelayPoles, Errors) {
  const auto long_delay = closed(transfer({2.0}, {1e-3, 1.0}, 10.0));
  EXPECT_TRUE(rightmost_poles(long_delay).error().is(SystemError::no_convergence));
}

}  // namespace
}  // namespace flyball::classical::delay_poles_test
