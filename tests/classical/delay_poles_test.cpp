#include <flyball/classical/delay_poles.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/classical/delay_response.hpp>
#include <flyball/classical/loop_margins.hpp>
#include <flyball/core/random.hpp>

#include "classical/transfer_cases.hpp"
#include "support/random_systems.hpp"

namespace flyball::classical {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::random_matrix;
using test::transfer;

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

// A thousand radians of dead time at frequencies that matter are told as such.
TEST(DelayPoles, Errors) {
  const auto long_delay = closed(transfer({2.0}, {1e-3, 1.0}, 10.0));
  EXPECT_TRUE(rightmost_poles(long_delay).error().is(SystemError::no_convergence));
}

}  // namespace
}  // namespace flyball::classical
