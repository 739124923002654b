#include <flyball/classical/response_margins.hpp>

#include <cmath>
#include <cstdlib>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/classical/mimo_margins.hpp>
#include <flyball/core/random.hpp>
#include <flyball/systems/interconnection.hpp>

#include "classical/transfer_cases.hpp"

namespace flyball::classical::response_margins_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using flyball::test::transfer;

constexpr double pi = std::numbers::pi;

TransferFunction random_loop(Random& random, bool discrete) {
  const auto roots = [&](Index count) {
    Eigen::VectorXcd all(count);
    for (Index k = 0; k < count;) {
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
  const auto n = static_cast<Index>(1 + random.bits() % 8);
  const auto m = static_cast<Index>(random.bits() % static_cast<std::uint64_t>(n));
  return TransferFunction::from_zeros(roots(m), roots(n),
                                      random.normal() * std::pow(10.0, 2.0 * random.uniform()),
                                      discrete ? std::optional(Time(0.1)) : std::nullopt)
      .value();
}

void expect_same(const LoopMargins& a, const LoopMargins& b, int i) {
  EXPECT_EQ(a.stable, b.stable) << i;
  EXPECT_EQ(a.unstable_poles, b.unstable_poles) << i;
  ASSERT_EQ(a.gain_crossings.size(), b.gain_crossings.size()) << i;
  for (std::size_t k = 0; k < a.gain_crossings.size(); ++k) {
    EXPECT_NEAR(a.gain_crossings[k].frequency / b.gain_crossings[k].frequency, 1.0, 1e-10) << i;
    EXPECT_NEAR(a.gain_crossings[k].phase_margin, b.gain_crossings[k].phase_margin, 1e-7) << i;
  }
  ASSERT_EQ(a.phase_crossings.size(), b.phase_crossings.size()) << i;
  for (std::size_t k = 0; k < a.phase_crossings.size(); ++k) {
    EXPECT_NEAR(a.phase_crossings[k].frequency, b.phase_crossings[k].frequency,
                1e-8 * b.phase_crossings[k].frequency)
        << i;
    EXPECT_NEAR(a.phase_crossings[k].gain_margin / b.phase_crossings[k].gain_margin, 1.0, 1e-7)
        << i;
  }
  EXPECT_NEAR(a.sensitivity.value / b.sensitivity.value, 1.0, 1e-6) << i;
  EXPECT_NEAR(a.complementary.value / b.complementary.value, 1.0, 1e-6) << i;
  EXPECT_NEAR(a.disk_margin, b.disk_margin, 1e-6 * b.disk_margin) << i;
  if (std::isfinite(b.delay_margin)) {
    EXPECT_NEAR(a.delay_margin, b.delay_margin, 1e-9 * (1.0 + b.delay_margin)) << i;
  } else {
    EXPECT_EQ(a.delay_margin, b.delay_margin) << i;
  }
}

// By bounds on the curve what the roots of polynomials in 31 digits are: two ways that share
// nothing but the definition.
TEST(ResponseMargins, AreThoseOfThePolynomials) {
  Random random(41);
  const char* many = std::getenv("FLYBALL_TEST_RUNS");
  const int runs = many != nullptr ? std::atoi(many) : 600;
  int crossings = 0;
  for (int i = 0; i < runs; ++i) {
    const TransferFunction L = random_loop(random, i % 3 == 2);
    const auto by_bounds = loop_margins(frequency_response(L).value()).value();
    expect_same(by_bounds, loop_margins(L).value(), i);
    for (const GainCrossing& crossing : by_bounds.gain_crossings) {
      EXPECT_NEAR(std::abs(L.response(crossing.frequency)), 1.0, 1e-10);
    }
    for (const PhaseCrossing& crossing : by_bounds.phase_crossings) {
      const Complex value = L.response(crossing.frequency);
      EXPECT_LE(std::abs(value.imag()), 1e-9 * std::abs(value));
      ++crossings;
    }
    if (::testing::Test::HasFailure()) {
      break;
    }
  }
  EXPECT_GE(crossings, runs / 4);
}

TEST(ResponseMargins, WithDeadTime) {
  Random random(42);
  for (int i = 0; i < 60; ++i) {
    const TransferFunction rational = random_loop(random, false);
    const double T = std::pow(10.0, 1.5 * random.uniform() - 1.5);
    const auto L =
        TransferFunction::create(rational.num(), rational.den(), std::nullopt, Time(T)).value();
    const auto a = loop_margins(frequency_response(L).value()).value();
    const auto b = loop_margins(L).value();
    EXPECT_EQ(a.stable, b.stable) << i;
    EXPECT_EQ(a.unstable_poles, b.unstable_poles) << i;
    ASSERT_EQ(a.gain_crossings.size(), b.gain_crossings.size()) << i;
    for (std::size_t k = 0; k < a.gain_crossings.size(); ++k) {
      EXPECT_NEAR(a.gain_crossings[k].phase_margin, b.gain_crossings[k].phase_margin, 1e-6) << i;
    }
    EXPECT_EQ(a.phase_crossings.size(), b.phase_crossings.size()) << i;
    EXPECT_GE(a.sensitivity.value, b.sensitivity.value * (1.0 - 1e-5)) << i;
  }
}

// Two hundred lags: more than polynomials can carry. 1/(1 + s/k)^200... each a twentieth of a turn.
TEST(ResponseMargins, OfManyStates) {
  const Index n = 120;
  ContinuousSystem<> chain{-10.0 * MatrixXd::Identity(n, n), MatrixXd::Zero(n, 1),
                           MatrixXd::Zero(1, n), MatrixXd::Zero(1, 1)};
  chain.A.diagonal(-1).setConstant(10.0);
  chain.B(0, 0) = 10.0;
  chain.C(0, n - 1) = 1.2;
  // |L| = 1.2 (1 + w²/100)^{-60} = 1, arg L = -120 atan(w/10).
  const LoopMargins margins = loop_margins(frequency_response(chain).value()).value();
  const double w = 10.0 * std::sqrt(std::pow(1.2, 1.0 / 60.0) - 1.0);
  ASSERT_EQ(margins.gain_crossings.size(), 1U);
  EXPECT_NEAR(margins.gain_crossings[0].frequency, w, 1e-9 * w);
  EXPECT_NEAR(margins.phase_crossings[0].frequency, 10.0 * std::tan(pi / 120.0), 1e-9);
  EXPECT_NEAR(margins.phase_crossings[1].frequency, 10.0 * std::tan(3.0 * pi / 120.0), 1e-9);
  EXPECT_FALSE(margins.stable);
}

// 10/(s (s + 1)): 17.96° at 3.084 rad/s, of which a sampling at 10 Hz takes 8.84°.
TEST(ResponseMargins, OfASampleDelay) {
  const auto report = sample_delay_report(transfer({10.0}, {1.0, 1.0, 0.0}), Time(0.1)).value();
  const double w = *report.crossover;
  EXPECT_NEAR(w, std::sqrt(0.5 * (std::sqrt(401.0) - 1.0)), 1e-12);
  EXPECT_NEAR(*report.phase_loss, 0.05 * w * 180.0 / pi, 1e-12);
  EXPECT_NEAR(*report.without.phase_margin - *report.with.phase_margin, *report.phase_loss, 1e-9);
  EXPECT_TRUE(report.with.stable);
  EXPECT_FALSE(
      sample_delay_report(transfer({10.0}, {1.0, 1.0, 0.0}), Time(1.0)).value().with.stable);
  const auto sampled =
      TransferFunction::create(VectorXd::Ones(1), Eigen::Vector2d(1.0, 0.5), Time(0.1)).value();
  EXPECT_TRUE(sample_delay_report(sampled, Time(0.1)).error().is(TransferError::period_mismatch));
}

// The spinning satellite (Doyle; Seiler et al. 2020): each loop alone looks perfect, L = 1/s with
// infinite margins, both at once bear little: S - T has the norm of a = 10's cross-coupling.
TEST(MimoMargins, SpinningSatellite) {
  const double a = 10.0;
  ContinuousSystem<> plant;
  plant.A.resize(2, 2);
  plant.A << 0.0, a, -a, 0.0;
  plant.B = MatrixXd::Identity(2, 2);
  plant.C.resize(2, 2);
  plant.C << 1.0, a, -a, 1.0;
  plant.D = MatrixXd::Zero(2, 2);
  const MimoMargins margins = mimo_margins(plant).value();
  EXPECT_TRUE(margins.stable);
  ASSERT_EQ(margins.loop_at_a_time.size(), 2U);
  for (const LoopMargins& alone : margins.loop_at_a_time) {
    EXPECT_TRUE(alone.phase_crossings.empty());
    EXPECT_NEAR(*alone.phase_margin, 90.0, 1e-9);
    EXPECT_NEAR(alone.disk_margin, 2.0, 1e-6);
  }
  // T = 1/(s + 1) [1 a; -a 1], whose σ at rest is √(1 + a²).
  EXPECT_NEAR(margins.complementary.value, std::sqrt(1.0 + a * a), 1e-8);
  EXPECT_LT(margins.full_disk_margin, 0.11);
  EXPECT_GT(margins.full_disk_margin, 0.09);
  EXPECT_GE(margins.disk_margin, margins.full_disk_margin);
}

// Loops beside each other bear what the one that bears least does; coordinates of another size,
// y = S y', leave that as it is, and the full margin alone is smaller there. Of five channels, of
// which three are alike, the search has a plateau.
TEST(MimoMargins, OfManyChannelsInOtherCoordinates) {
  constexpr int channels = 5;
  ContinuousSystem<> plant;
  plant.A = MatrixXd::Zero(2 * channels, 2 * channels);
  plant.B = MatrixXd::Zero(2 * channels, channels);
  plant.C = MatrixXd::Zero(channels, 2 * channels);
  plant.D = MatrixXd::Zero(channels, channels);
  double least = 2.0;
  for (int k = 0; k < channels; ++k) {
    const double gain = k < 3 ? 1.0 : 1.0 + 0.3 * k;
    const auto one =
        TransferFunction::create(VectorXd::Constant(1, gain), Eigen::Vector3d(1.0, 1.0, 0.0))
            .value();
    least = std::min(least, loop_margins(one)->disk_margin);
    const auto s = one.to_state_space();
    plant.A.block(2 * k, 2 * k, 2, 2) = s.A;
    plant.B.block(2 * k, k, 2, 1) = s.B;
    plant.C.block(k, 2 * k, 1, 2) = s.C;
  }
  const auto plain = mimo_margins(plant).value();
  EXPECT_NEAR(plain.disk_margin, least, 1e-5 * least);
  VectorXd size(channels);
  size << 1.0, 30.0, 0.1, 2.0, 1e-3;
  // A small coupling from each channel to the next, so that the coordinates matter.
  for (int k = 0; k + 1 < channels; ++k) {
    plant.C(k, 2 * (k + 1)) = 0.02;
  }
  const auto coupled = mimo_margins(plant).value();
  plant.C = size.asDiagonal() * plant.C;
  plant.B = plant.B * size.cwiseInverse().asDiagonal();
  const auto other = mimo_margins(plant).value();
  EXPECT_NEAR(other.disk_margin, coupled.disk_margin, 1e-3 * coupled.disk_margin);
  EXPECT_LT(other.full_disk_margin, 0.9 * other.disk_margin);
}

// Of one channel all of them are those of `loop_margins`, and the four functions those of the sum.
TEST(MimoMargins, OfOneChannel) {
  Random random(43);
  for (int i = 0; i < 40; ++i) {
    const TransferFunction L = random_loop(random, i % 2 == 1);
    const auto s = L.to_state_space();
    const auto expected = loop_margins(L).value();
    const auto got = i % 2 == 1 ? mimo_margins(DiscreteSystem<>{s.A, s.B, s.C, s.D, Time(0.1)})
                                : mimo_margins(s);
    ASSERT_TRUE(got.has_value()) << to_string(got.error());
    EXPECT_EQ(got->stable, expected.stable) << i;
    EXPECT_NEAR(got->disk_margin, expected.disk_margin, 1e-6 * (1e-3 + expected.disk_margin)) << i;
    EXPECT_NEAR(got->sensitivity.value / expected.sensitivity.value, 1.0, 1e-6) << i;
  }
  const ContinuousSystem<> wide{-MatrixXd::Identity(1, 1), MatrixXd::Ones(1, 2),
                                MatrixXd::Ones(1, 1), MatrixXd::Zero(1, 2)};
  EXPECT_TRUE(mimo_margins(wide).error().is(ArgumentError::wrong_shape));
}

// P = 1/(s + 1), C = 1: S = (s + 1)/(s + 2), T = PS = 1/(s + 2), CS = S.
TEST(GangOfFour, OfALag) {
  const auto P = transfer({1.0}, {1.0, 1.0}).to_state_space();
  const ContinuousSystem<> C{MatrixXd(0, 0), MatrixXd(0, 1), MatrixXd(1, 0), MatrixXd::Ones(1, 1)};
  const GangOfFour gang = gang_of_four(P, C).value();
  EXPECT_TRUE(gang.stable);
  EXPECT_NEAR(gang.sensitivity.value, 1.0, 1e-9);
  EXPECT_NEAR(gang.complementary.value, 0.5, 1e-9);
  EXPECT_NEAR(gang.disturbance_sensitivity.value, 0.5, 1e-9);
  EXPECT_NEAR(gang.noise_sensitivity.value, 1.0, 1e-9);
  // An unstable plant that the gain does not catch: still a gain over the frequencies.
  const auto bad = transfer({1.0}, {1.0, -3.0}).to_state_space();
  const GangOfFour lost = gang_of_four(bad, C).value();
  EXPECT_FALSE(lost.stable);
  EXPECT_NEAR(lost.sensitivity.value, 1.5, 1e-9);
}

TEST(LInfinity, OfUnstableSystems) {
  // 1/(s - 1) and its mirror image 1/(s + 1) have one gain.
  const auto G = transfer({1.0, 3.0}, {1.0, -0.2, 4.0}).to_state_space();
  const auto mirrored = transfer({1.0, 3.0}, {1.0, 0.2, 4.0}).to_state_space();
  const auto a = l_infinity_norm(G).value();
  const auto b = h_infinity_norm(mirrored).value();
  EXPECT_NEAR(a.norm / b.norm, 1.0, 1e-9);
  EXPECT_NEAR(a.frequency / b.frequency, 1.0, 1e-6);
  const auto undamped = l_infinity_norm(transfer({1.0}, {1.0, 0.0, 4.0}).to_state_space());
  EXPECT_TRUE(undamped.error().is(SystemError::not_stable));
}

}  // namespace
}  // namespace flyball::classical::response_margins_test
