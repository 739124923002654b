#include <flyball/classical/delay_margins.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/classical/delay_poles.hpp>
#include <flyball/classical/response_margins.hpp>
#include <flyball/classical/transfer_expression.hpp>
#include <flyball/core/random.hpp>
#include <flyball/systems/system_error.hpp>

#include "classical/transfer_cases.hpp"

namespace flyball::classical::delay_margins_test {
namespace {

using Complex = std::complex<double>;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using flyball::test::transfer;

DelaySystem late(const std::string& text) {
  const std::string texts[] = {text};
  return std::get<DelaySystem>(parse_transfer_system(texts).value());
}

TransferFunction random_loop(Random& random) {
  const auto pairs = static_cast<Eigen::Index>(1 + random.bits() % 3);
  Eigen::VectorXcd poles(2 * pairs);
  Eigen::VectorXcd zeros(2 * (pairs - 1));
  for (Eigen::VectorXcd* roots : {&poles, &zeros}) {
    for (Eigen::Index k = 0; k + 1 < roots->size(); k += 2) {
      const double size = std::pow(10.0, random.uniform() - 0.5);
      (*roots)(k) = std::polar(size, 1.65 + 1.3 * random.uniform());
      (*roots)(k + 1) = std::conj((*roots)(k));
    }
  }
  const double gain = std::pow(10.0, random.uniform());
  return TransferFunction::from_zeros(zeros, poles, gain, std::nullopt,
                                      Time(0.05 + random.uniform()))
      .value();
}

// Behind one dead time it is what the polynomials in 31 digits say.
TEST(DelayMargins, OfOneDeadTimeAreThoseOfTheTransferFunction) {
  Random random(41);
  int crossings = 0;
  for (int i = 0; i < 12; ++i) {
    const TransferFunction L = random_loop(random);
    const LoopMargins expected = loop_margins(L).value();
    const LoopMargins found = loop_margins(DelaySystem::create(L).value()).value();
    EXPECT_EQ(found.stable, expected.stable) << i;
    EXPECT_EQ(found.unstable_poles, expected.unstable_poles) << i;
    ASSERT_EQ(found.gain_crossings.size(), expected.gain_crossings.size()) << i;
    for (std::size_t k = 0; k < found.gain_crossings.size(); ++k, ++crossings) {
      const GainCrossing& at = expected.gain_crossings[k];
      EXPECT_NEAR(found.gain_crossings[k].frequency / at.frequency, 1.0, 1e-9) << i;
      EXPECT_NEAR(found.gain_crossings[k].phase_margin, at.phase_margin, 1e-7) << i;
    }
    // The range ends at ten times the fastest of what each knows.
    const std::size_t common =
        std::min(found.phase_crossings.size(), expected.phase_crossings.size());
    ASSERT_GT(common, 0U) << i;
    for (std::size_t k = 0; k < common; ++k) {
      const PhaseCrossing& at = expected.phase_crossings[k];
      EXPECT_NEAR(found.phase_crossings[k].frequency / at.frequency, 1.0, 1e-9) << i;
      EXPECT_NEAR(found.phase_crossings[k].gain_margin / at.gain_margin, 1.0, 1e-8) << i;
    }
    if (std::isinf(expected.delay_margin)) {
      EXPECT_TRUE(std::isinf(found.delay_margin)) << i;
    } else {
      EXPECT_NEAR(found.delay_margin, expected.delay_margin, 1e-8 * (1.0 + expected.delay_margin))
          << i;
    }
    EXPECT_NEAR(found.disk_margin, expected.disk_margin, 2e-5 * expected.disk_margin) << i;
    EXPECT_NEAR(found.sensitivity.value, expected.sensitivity.value,
                2e-5 * expected.sensitivity.value)
        << i;
    EXPECT_NEAR(found.complementary.value, expected.complementary.value,
                2e-5 * expected.complementary.value)
        << i;
  }
  EXPECT_GT(crossings, 6);
}

// L = k (e^{-s} + e^{-3s})/s = 2k cos(ω) e^{-2jω}/(jω): real and negative where 2ω = π/2 + 2πi with
// cos ω > 0, that is at π/4, L = -8k cos(π/4)/π, and zero at π/2.
TEST(DelayMargins, TwoDeadTimesInClosedForm) {
  const double pi = std::numbers::pi;
  const double critical = pi / (8.0 * std::cos(pi / 4.0));
  const DelaySystem below = late("0.5*(exp(-s) + exp(-3s))/s");
  const LoopMargins margins = loop_margins(below).value();
  ASSERT_FALSE(margins.phase_crossings.empty());
  EXPECT_NEAR(margins.phase_crossings[0].frequency, pi / 4.0, 1e-12);
  EXPECT_NEAR(margins.phase_crossings[0].gain_margin, critical / 0.5, 1e-12);
  EXPECT_TRUE(margins.stable);
  EXPECT_NEAR(*margins.gain_margin, critical / 0.5, 1e-12);
  EXPECT_FALSE(loop_margins(late("0.56*(exp(-s) + exp(-3s))/s")).value().stable);
  EXPECT_TRUE(loop_margins(late("0.55*(exp(-s) + exp(-3s))/s")).value().stable);
  // |L| = 1 where cos ω = ω.
  const double w = 0.7390851332151607;
  ASSERT_EQ(margins.gain_crossings.size(), 1U);
  EXPECT_NEAR(margins.gain_crossings[0].frequency, w, 1e-12);
  EXPECT_NEAR(margins.gain_crossings[0].phase_margin, 90.0 - 2.0 * w * 180.0 / pi, 1e-10);
  EXPECT_NEAR(margins.delay_margin, (pi / 2.0 - 2.0 * w) / w, 1e-11);
  const NyquistData curve = nyquist(below).value();
  EXPECT_EQ(curve.encirclements, 0);
  EXPECT_EQ(curve.indentations.size(), 1U);
  EXPECT_EQ(nyquist(late("0.6*(exp(-s) + exp(-3s))/s")).value().encirclements, 2);
}

/// A loop with dead times within L, and its response.
struct Nested {
  DelaySystem loop;
  std::string text;
};
Nested nested(Random& random) {
  const auto number = [&](double low, double high) {
    return std::to_string(low + (high - low) * random.uniform());
  };
  const std::string inner =
      number(0.2, 1.5) + "/(s+" + number(0.3, 2.0) + ")*exp(-" + number(0.1, 1.0) + "*s)";
  const std::string text = "4*feedback(" + inner + ", " + number(-0.3, 0.3) + ")*(1 + " +
                           number(-0.8, 0.8) + "*exp(-" + number(0.1, 2.0) + "*s))*(s+" +
                           number(0.2, 3.0) + ")/(s+" + number(0.1, 4.0) + ")";
  return {late(text), text};
}

// Against a fine grid: no crossing is missed, each is one, no peak is above.
TEST(DelayMargins, NoneIsMissedOfLoopsWithinLoops) {
  Random random(7);
  int crossings = 0;
  for (int i = 0; i < 8; ++i) {
    const Nested n = nested(random);
    const LoopMargins margins = loop_margins(n.loop).value();
    const auto L = [&](double w) { return n.loop.response(w)(0, 0); };
    int changes = 0;
    double peak = 0.0;
    double spread = 0.0;
    Complex before = L(1e-4);
    for (int k = 1; k <= 8000; ++k) {
      const double w = 1e-4 + 20.0 * k / 8000.0;
      const Complex here = L(w);
      changes += (std::abs(before) > 1.0) != (std::abs(here) > 1.0) ? 1 : 0;
      peak = std::max(peak, 1.0 / std::abs(1.0 + here));
      spread = std::max(spread, std::abs((1.0 - here) / (1.0 + here)));
      before = here;
    }
    EXPECT_EQ(static_cast<int>(margins.gain_crossings.size()), changes) << n.text;
    crossings += changes;
    for (const GainCrossing& at : margins.gain_crossings) {
      EXPECT_NEAR(std::abs(L(at.frequency)), 1.0, 1e-10) << n.text;
    }
    for (const PhaseCrossing& at : margins.phase_crossings) {
      EXPECT_NEAR(std::arg(-L(at.frequency)), 0.0, 1e-10) << n.text;
      EXPECT_NEAR(at.gain_margin * std::abs(L(at.frequency)), 1.0, 1e-12) << n.text;
    }
    EXPECT_GE(margins.sensitivity.value, peak * (1.0 - 1e-9)) << n.text;
    if (std::isfinite(margins.sensitivity.frequency)) {
      EXPECT_NEAR(margins.sensitivity.value * std::abs(1.0 + L(margins.sensitivity.frequency)), 1.0,
                  1e-10)
          << n.text;
    }
    if (margins.stable) {
      EXPECT_LE(margins.disk_margin, 2.0 / spread * (1.0 + 1e-9)) << n.text;
      if (std::isfinite(margins.delay_margin) && margins.delay_margin > 0.0) {
        // So much more dead time is borne, and not a bit more.
        for (const double factor : {0.99, 1.01}) {
          const auto more =
              n.loop.with_input_delays(VectorXd::Constant(1, factor * margins.delay_margin));
          EXPECT_EQ(is_stable(feedback(more.value()).value()).value(), factor < 1.0) << n.text;
        }
      }
    }
  }
  EXPECT_GT(crossings, 5);
}

// Two loops that do not touch each other: each channel is its own, the disk the smaller of both.
TEST(DelayMargins, OfSeveralChannels) {
  const TransferFunction first = transfer({2.0}, {1.0, 1.0}, 0.3);
  const TransferFunction second = transfer({1.0}, {1.0, 0.0}, 0.5);
  const DelaySystem both =
      append(DelaySystem::create(first).value(), DelaySystem::create(second).value()).value();
  const MimoMargins margins = mimo_margins(both).value();
  const LoopMargins a = loop_margins(first).value();
  const LoopMargins b = loop_margins(second).value();
  EXPECT_TRUE(margins.stable);
  ASSERT_EQ(margins.loop_at_a_time.size(), 2U);
  EXPECT_NEAR(margins.loop_at_a_time[0].delay_margin, a.delay_margin, 1e-9);
  EXPECT_NEAR(margins.loop_at_a_time[1].delay_margin, b.delay_margin, 1e-9);
  const double smaller = std::min(a.disk_margin, b.disk_margin);
  EXPECT_NEAR(margins.full_disk_margin, smaller, 2e-5);
  EXPECT_NEAR(margins.disk_margin, smaller, 1e-4);
  EXPECT_NEAR(margins.sensitivity.value, std::max(a.sensitivity.value, b.sensitivity.value), 2e-5);
}

// Without dead time it is the margins of the state space, coupled channels too.
TEST(DelayMargins, OfSeveralChannelsWithoutDeadTime) {
  const ContinuousSystem<> plant{(MatrixXd(2, 2) << -1.0, 0.3, 0.2, -2.0).finished(),
                                 (MatrixXd(2, 2) << 1.0, 0.5, -0.4, 2.0).finished(),
                                 MatrixXd::Identity(2, 2), MatrixXd::Zero(2, 2)};
  const MimoMargins expected = mimo_margins(plant).value();
  const MimoMargins found = mimo_margins(DelaySystem::create(plant).value()).value();
  EXPECT_NEAR(found.disk_margin, expected.disk_margin, 1e-9);
  // A delay that is next to none changes next to nothing.
  const MimoMargins near =
      mimo_margins(
          DelaySystem::create(plant).value().with_input_delays(VectorXd::Constant(2, 1e-4)).value())
          .value();
  EXPECT_NEAR(near.disk_margin, expected.disk_margin, 1e-2);
  EXPECT_NEAR(near.sensitivity.value, expected.sensitivity.value, 1e-2);
}

TEST(DelayMargins, Errors) {
  const DelaySystem two = DelaySystem::gain(MatrixXd::Ones(2, 1)).value();
  EXPECT_TRUE(loop_margins(two).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(mimo_margins(two).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(nyquist(two).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(bandwidth(two).error().is(ArgumentError::wrong_shape));
  const DelaySystem minus_one = DelaySystem::gain(-MatrixXd::Identity(1, 1)).value();
  EXPECT_TRUE(loop_margins(parallel(minus_one, late("exp(-s)/(s+1) + exp(-2s)")).value())
                  .error()
                  .is(SystemError::algebraic_loop));
  const auto sampled =
      DelaySystem::create(TransferFunction::create(VectorXd::Ones(1), Eigen::Vector2d(1.0, -0.5),
                                                   Time(0.1), Time(0.2))
                              .value())
          .value();
  EXPECT_TRUE(peak_gain(sampled).error().is(TransferError::period_mismatch));
  // Of a gain near one for ever crossings do not end, however fast the fastest pole is.
  const auto endless = loop_margins(late("exp(-1.5s) + 0.2*exp(-s) + 1e8/(s+1e8)*exp(-0.001s)"));
  ASSERT_FALSE(endless.has_value());
  EXPECT_TRUE(endless.error().is(SystemError::no_convergence));
  // With a gain above one at infinite frequency the least delay destabilizes.
  const LoopMargins neutral = loop_margins(late("(s+1)/(s+2)*0.6 + 0.6*exp(-s)")).value();
  EXPECT_EQ(neutral.delay_margin, 0.0);
}

TEST(DelayMargins, Bandwidth) {
  // |G| = |1 + e^{-s}|/2 = |cos(ω/2)| falls by 3 dB where cos(ω/2) = factor.
  const double factor = 0.7079457843841379;
  EXPECT_NEAR(bandwidth(late("0.5*(1 + exp(-s))")).value().value(), 2.0 * std::acos(factor), 1e-9);
  EXPECT_FALSE(bandwidth(late("0.5*(1 + exp(-s))/s")).value().has_value());
}

}  // namespace
}  // namespace flyball::classical::delay_margins_test
