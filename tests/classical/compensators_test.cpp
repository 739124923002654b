#include <flyball/classical/compensators.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "classical/transfer_cases.hpp"

namespace flyball::classical::compensators_test {
namespace {

using Complex = std::complex<double>;
using Eigen::VectorXcd;
using flyball::test::transfer;

constexpr double pi = std::numbers::pi;

// Ogata's example: 4/(s(s + 2)) with a velocity constant of 20 and a margin of 50°: K = 10, and
// with the crossover at 9 rad/s the only lead there is; his is 10 (0.227 s + 1)/(0.054 s + 1),
// whose crossover is 8.9.
TEST(Compensators, OgatasLead) {
  const TransferFunction P = transfer({4.0}, {1.0, 2.0, 0.0});
  EXPECT_NEAR(gain_for_error_constant(P, 20.0).value(), 10.0, 1e-12);
  const auto found =
      lead_compensator(P, CrossoverGoal{.crossover = 8.9, .phase_margin = 50.6, .gain = 10.0})
          .value();
  EXPECT_NEAR(found.compensator.dc_gain(), 10.0, 1e-9);
  EXPECT_NEAR(-1.0 / found.compensator.zeros()->real()(0), 0.227, 0.003);
  EXPECT_NEAR(-1.0 / found.compensator.poles()->real()(0), 0.054, 0.001);
  EXPECT_NEAR(*found.margins.phase_margin, 50.6, 1e-9);
  EXPECT_NEAR(found.margins.gain_crossings.front().frequency, 8.9, 1e-9);
}

// Ogata's example 6-6: 10/(s(s + 1)) with ζ = 0.5, ω = 3 by the bisector: pole at -4.6458, and the
// zero at -9/4.6458 = -1.9373, for the product of both is ω² (he has -1.9432 and a gain of 1.2287
// from rounded angles).
TEST(Compensators, OgatasDominantPoles) {
  const TransferFunction P = transfer({10.0}, {1.0, 1.0, 0.0});
  const auto found =
      lead_compensator(P, PoleGoal{.natural_frequency = 3.0, .damping_ratio = 0.5}).value();
  EXPECT_NEAR(found.compensator.zeros()->real()(0), -1.9373, 1e-4);
  EXPECT_NEAR(found.compensator.poles()->real()(0), -4.6458, 1e-4);
  EXPECT_NEAR(found.compensator.response(1e9).real(), 1.22915, 1e-4);
  double nearest = 1.0;
  for (const Complex& pole : found.poles) {
    nearest = std::min(nearest, std::abs(pole - Complex(-1.5, 1.5 * std::sqrt(3.0))));
  }
  EXPECT_LE(nearest, 1e-12);
}

TransferFunction random_plant(Random& random, bool discrete) {
  const auto n = static_cast<Eigen::Index>(2 + random.bits() % 3);
  VectorXcd poles(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    poles(k) = k == 0 && random.uniform() < 0.4 ? 0.0 : -std::pow(10.0, random.uniform(-1.0, 1.0));
  }
  const double T = 0.02;
  if (discrete) {
    for (Complex& pole : poles) {
      pole = std::exp(pole * T);
    }
  }
  return TransferFunction::from_zeros(VectorXcd(0), poles,
                                      std::pow(10.0, random.uniform(-1.0, 1.0)),
                                      discrete ? std::optional(Time(T)) : std::nullopt,
                                      Time(discrete ? T * static_cast<double>(random.bits() % 2)
                                           : random.uniform() < 0.5 ? 0.0
                                                                    : random.uniform(0.0, 0.1)))
      .value();
}

// Whatever is answered has the crossover and the margin, the gain at rest, and a stable loop; what
// is refused for its phase is answered with the margin that the error tells.
TEST(Compensators, MeetTheirGoals) {
  Random random(91);
  int answers[3] = {0, 0, 0};
  int refused = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const bool discrete = trial % 2 == 1;
    const TransferFunction P = random_plant(random, discrete);
    CrossoverGoal goal{.crossover = std::pow(10.0, random.uniform(-1.0, 1.2)),
                       .phase_margin = random.uniform(20.0, 75.0)};
    const auto expect = [&](const Compensation& found, const CrossoverGoal& wanted) {
      const Complex L = P.response(wanted.crossover) * found.compensator.response(wanted.crossover);
      EXPECT_NEAR(std::abs(L), 1.0, 1e-9) << trial;
      EXPECT_NEAR(std::remainder((std::arg(L) + pi) * 180.0 / pi - wanted.phase_margin, 360.0), 0.0,
                  1e-8)
          << trial;
      EXPECT_TRUE(found.margins.stable);
      if (wanted.gain) {
        // A slow pole of a discrete one is what is left of its coefficients' sum.
        const auto& den = found.compensator.den();
        const double lost = discrete ? den.cwiseAbs().sum() / std::abs(den.sum()) : 0.0;
        EXPECT_NEAR(found.compensator.dc_gain() / *wanted.gain, 1.0, 1e-9 + 1e-14 * lost);
      }
      for (const Complex& pole : found.poles) {
        EXPECT_LT(discrete ? std::abs(pole) - 1.0 : pole.real(), 0.0);
      }
    };
    const auto known = [](const Error& error) {
      return error.is(CompensatorError::phase_not_reached) ||
             error.is(CompensatorError::gain_not_reached) ||
             error.is(CompensatorError::unstable_loop);
    };
    goal.stages = 1 + trial % 3 / 2;
    const auto lead = lead_compensator(P, goal);
    double open_gain = 1.0;
    if (lead) {
      ++answers[0];
      expect(*lead, goal);
      open_gain = lead->compensator.dc_gain();
      // With that gain given the same times are found.
      CrossoverGoal given = goal;
      given.gain = open_gain;
      const auto again = lead_compensator(P, given);
      ASSERT_TRUE(again) << to_string(again.error());
      EXPECT_NEAR(
          again->compensator.response(3.0 * goal.crossover / (discrete ? 10.0 : 1.0)).real() /
              lead->compensator.response(3.0 * goal.crossover / (discrete ? 10.0 : 1.0)).real(),
          1.0, 1e-6);
    } else {
      EXPECT_TRUE(known(lead.error())) << to_string(lead.error());
      for (const Evidence& evidence : lead.error().evidence()) {
        if (evidence.name == "best phase margin" && evidence.values[0] > 1.0) {
          CrossoverGoal nearer = goal;
          nearer.phase_margin = evidence.values[0] - 1.0;
          const auto again = lead_compensator(P, nearer);
          ++refused;
          if (again) {
            expect(*again, nearer);
          } else {
            EXPECT_TRUE(again.error().is(CompensatorError::unstable_loop))
                << to_string(again.error());
          }
        }
      }
    }
    goal.stages = 1;
    goal.gain = 10.0 * std::abs(open_gain);
    const auto both = lead_lag_compensator(P, goal);
    if (both) {
      ++answers[1];
      expect(*both, goal);
    } else {
      EXPECT_TRUE(known(both.error())) << to_string(both.error());
    }
    goal.gain = 20.0 / std::abs(P.response(goal.crossover));
    const auto lag = lag_compensator(P, goal);
    if (lag) {
      ++answers[2];
      expect(*lag, goal);
    } else {
      EXPECT_TRUE(known(lag.error())) << to_string(lag.error());
    }
  }
  EXPECT_GE(answers[0], 40);
  EXPECT_GE(answers[1], 40);
  EXPECT_GE(answers[2], 20);
  EXPECT_GE(refused, 5);
}

// One far from the frequency, the depth there, half the power at the width's ends.
TEST(Compensators, Notch) {
  for (const auto period : {std::optional<Time>(), std::optional(Time(0.01))}) {
    const TransferFunction N = notch_compensator(20.0, 0.05, 0.4, period).value();
    EXPECT_NEAR(std::abs(N.response(20.0)), 0.05, 1e-12);
    EXPECT_NEAR(std::abs(N.response(1e-3)), 1.0, 1e-6);
    EXPECT_TRUE(N.is_stable().value());
  }
  const TransferFunction deep = notch_compensator(20.0, 0.0, 0.4).value();
  const double low = 20.0 * (std::sqrt(1.04) - 0.2);
  const double high = 20.0 * (std::sqrt(1.04) + 0.2);
  EXPECT_NEAR(std::norm(deep.response(low)), 0.5, 1e-12);
  EXPECT_NEAR(std::norm(deep.response(high)), 0.5, 1e-12);
  EXPECT_TRUE(
      notch_compensator(400.0, 0.1, 0.4, Time(0.01)).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(notch_compensator(20.0, 0.1, 0.0).error().is(ArgumentError::not_positive));
}

TEST(Compensators, Errors) {
  const TransferFunction P = transfer({1.0}, {1.0, 3.0, 3.0, 1.0, 0.0});
  const auto far = lead_compensator(P, CrossoverGoal{.crossover = 2.0, .phase_margin = 60.0});
  ASSERT_FALSE(far);
  EXPECT_TRUE(far.error().is(CompensatorError::phase_not_reached)) << to_string(far.error());
  const TransferFunction Q = transfer({1.0}, {1.0, 1.0, 0.0});
  const auto lag = lag_compensator(Q, CrossoverGoal{.crossover = 0.3, .phase_margin = 60.0});
  EXPECT_TRUE(lag.error().is(ArgumentError::empty));
  EXPECT_EQ(to_string(lag_compensator(
                          Q, CrossoverGoal{.crossover = 3.0, .phase_margin = 60.0, .gain = 1.0})
                          .error()),
            "lag_compensator: the phase that it is to turn is 41.5651 deg; it must be between -90 "
            "and 0 deg; a lower crossover, less margin, or a lead-lag compensator (phase = "
            "41.5651)");
  EXPECT_TRUE(lead_compensator(Q, CrossoverGoal{.crossover = -1.0})
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(lead_compensator(Q, PoleGoal{.natural_frequency = 3.0, .damping_ratio = 1.0})
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      lead_compensator(Q, CrossoverGoal{.crossover = 3.0, .phase_margin = 60.0, .gain = 1e9})
          .error()
          .is(CompensatorError::gain_not_reached));
  EXPECT_TRUE(gain_for_error_constant(transfer({1.0, 0.0}, {1.0, 1.0}), 2.0)
                  .error()
                  .is(TransferError::at_a_pole));
  EXPECT_NEAR(gain_for_error_constant(transfer({2.0}, {1.0, 4.0}), 10.0).value(), 20.0, 1e-12);
}

}  // namespace
}  // namespace flyball::classical::compensators_test
