#include <flyball/control/pid_design.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

namespace flyball::pid_design_test {
namespace {

using classical::TransferFunction;
using Complex = std::complex<double>;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();

TransferFunction plant(std::initializer_list<double> num, std::initializer_list<double> den,
                       double delay = 0.0, double period = 0.0) {
  const auto list = [](std::initializer_list<double> values) {
    return VectorXd(
        Eigen::Map<const VectorXd>(values.begin(), static_cast<Eigen::Index>(values.size())));
  };
  return TransferFunction::create(list(num), list(den),
                                  period > 0.0 ? std::optional(Time(period)) : std::nullopt,
                                  Time(delay))
      .value();
}

/// gain Π(T s + 1)/Π(τ s + 1) e^{-θs}; a lag of zero is an integrator.
TransferFunction lags(double gain, std::initializer_list<double> leads,
                      std::initializer_list<double> lag, double delay = 0.0) {
  TransferFunction G = plant({gain}, {1.0}, delay);
  VectorXd num = VectorXd::Constant(1, gain);
  VectorXd den = VectorXd::Ones(1);
  const auto times = [](const VectorXd& p, double a, double b) {
    VectorXd q = VectorXd::Zero(p.size() + 1);
    q.head(p.size()) += a * p;
    q.tail(p.size()) += b * p;
    return q;
  };
  for (const double T : leads) {
    num = times(num, T, 1.0);
  }
  for (const double T : lag) {
    den = T == 0.0 ? times(den, 1.0, 0.0) : times(den, T, 1.0);
  }
  return TransferFunction::create(num, den, std::nullopt, Time(delay)).value();
}

// What the transfer function says is what the controller does: the response to random errors.
TEST(PidDesign, TheSampledControllerIsTheRunningOne) {
  Random random(5);
  for (const double tau : {0.0, 0.03}) {
    for (const PidGains& gains :
         {PidGains{2.0, 0.0, 0.0}, {2.0, 3.0, 0.0}, {2.0, 0.0, 0.4}, {2.0, 3.0, 0.4}}) {
      const double T = 0.02;
      PidSettings settings;
      settings.gains = gains;
      settings.period = T;
      settings.derivative_time_constant = tau;
      Pid pid = Pid::create(settings).value();
      (void)pid.calculate(0.0, 0.0);  // A sample before, so that the derivative begins at once.
      const TransferFunction C = pid_transfer(gains, tau, Time(T)).value();
      const auto s = C.to_state_space();
      VectorXd x = VectorXd::Zero(s.A.rows());
      for (int k = 0; k < 50; ++k) {
        const double e = random.normal();
        const double u = s.C.row(0).dot(x) + s.D(0, 0) * e;
        EXPECT_NEAR(pid.calculate(0.0, e), u, 1e-9 * (1.0 + std::abs(u)));
        x = (s.A * x + s.B * e).eval();
      }
    }
  }
}

// Skogestad (2003), table 4: models of his examples by the half rule.
TEST(PidDesign, HalfRuleOfSkogestadsExamples) {
  const auto expect = [](const TransferFunction& G, int order, LagModel expected) {
    const LagModel model = half_rule(G, order).value();
    EXPECT_NEAR(model.gain, expected.gain, 1e-6);
    EXPECT_NEAR(model.delay, expected.delay, 1e-6);
    if (std::isinf(expected.time_constant)) {
      EXPECT_TRUE(std::isinf(model.time_constant));
    } else {
      EXPECT_NEAR(model.time_constant, expected.time_constant, 1e-6);
    }
    EXPECT_NEAR(model.second_time_constant, expected.second_time_constant, 1e-6);
  };
  const TransferFunction E1 = lags(1.0, {}, {1.0, 0.2});
  expect(E1, 1, {1.0, 1.1, 0.0, 0.1});
  expect(E1, 2, {1.0, 1.0, 0.2, 0.0});
  const TransferFunction E2 = lags(1.0, {-0.3, 0.08}, {2.0, 1.0, 0.4, 0.2, 0.05, 0.05, 0.05});
  expect(E2, 1, {1.0, 2.5, 0.0, 1.47});
  expect(E2, 2, {1.0, 2.0, 1.2, 0.77});
  const TransferFunction E3 = lags(2.0, {15.0}, {20.0, 1.0, 0.1, 0.1});
  expect(E3, 1, {1.5, 1.05, 0.0, 0.15});
  expect(E3, 2, {1.5, 1.0, 0.15, 0.05});
  const TransferFunction E4 = lags(1.0, {}, {1.0, 1.0, 1.0, 1.0});
  expect(E4, 1, {1.0, 1.5, 0.0, 2.5});
  expect(E4, 2, {1.0, 1.0, 1.5, 1.5});
  const TransferFunction E6 = lags(1.0, {0.17, 0.17}, {0.0, 1.0, 1.0, 0.028});
  expect(E6, 1, {1.0, infinity, 0.0, 1.688});
  expect(E6, 2, {1.0, infinity, 1.33, 0.358});
  EXPECT_TRUE(half_rule(plant({1.0}, {1.0, 0.2, 1.0}), 1).error().is(PidDesignError::no_rule));
  EXPECT_TRUE(half_rule(plant({1.0}, {1.0, -1.0}), 1).error().is(PidDesignError::no_rule));
  EXPECT_TRUE(half_rule(E1, 3).error().is(ArgumentError::out_of_range));
}

// Gains of table 1: E4's PI has K_c = 1.5/(2·2.5) = 0.3 and T_i = 1.5, its PID in series K_c =
// 1/(2·1.5), T_i = 1, T_d = 1.5; a discrete plant's delay includes half a period of its hold.
TEST(PidDesign, Simc) {
  const TransferFunction E4 = lags(1.0, {}, {1.0, 1.0, 1.0, 1.0});
  const PidLoop pi_loop = tune_simc(E4, PidForm::pi).value();
  EXPECT_NEAR(pi_loop.gains.kp, 0.3, 1e-6);
  EXPECT_NEAR(pi_loop.gains.ki, 0.2, 1e-6);
  EXPECT_TRUE(pi_loop.margins.stable);
  EXPECT_NEAR(pi_loop.load->integral, 5.0, 1e-6);
  const PidLoop pid_loop = tune_simc(E4, PidForm::pid).value();
  EXPECT_NEAR(pid_loop.gains.kp, 2.5 / 3.0, 1e-6);
  EXPECT_NEAR(pid_loop.gains.ki, 1.0 / 3.0, 1e-6);
  EXPECT_NEAR(pid_loop.gains.kd, 0.5, 1e-6);
  // An integrator with delay: K_c = 1/(2θ), T_i = 8θ, whose M_s is 1.70 (table 3).
  const PidLoop integrating = tune_simc(plant({1.0}, {1.0, 0.0}, 1.0), PidForm::pi).value();
  EXPECT_NEAR(integrating.gains.kp, 0.5, 1e-12);
  EXPECT_NEAR(integrating.gains.ki, 0.0625, 1e-12);
  EXPECT_NEAR(integrating.margins.sensitivity.value, 1.70, 0.01);
  // First order with delay and T_i = τ: L = e^{-θs}/(2θs), M_s = 1.59.
  const PidLoop lag = tune_simc(lags(2.0, {}, {3.0}, 1.0), PidForm::pi).value();
  EXPECT_NEAR(lag.margins.sensitivity.value, 1.59, 0.01);
  EXPECT_NEAR(*lag.margins.phase_margin, 180.0 / pi * (pi / 2 - 0.5), 1e-6);
  // 1/(s + 1) held for 0.1 s: one lag, and 0.05 s of delay.
  const double p = std::exp(-0.1);
  const LagModel held = half_rule(plant({1.0 - p}, {1.0, -p}, 0.0, 0.1), 1).value();
  EXPECT_NEAR(held.time_constant, 1.0, 1e-6);
  EXPECT_NEAR(held.delay, 0.05, 1e-3);
  EXPECT_TRUE(tune_simc(E4, PidForm::p).error().is(PidDesignError::no_rule));
  EXPECT_TRUE(tune_simc(lags(1.0, {}, {1.0}), PidForm::pi).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(
      tune_simc(lags(1.0, {}, {0.0, 0.0}), PidForm::pi, 1.0).error().is(PidDesignError::no_rule));
  // A double integrator: all three times in terms of τ_c; L has its zeros at -1/(4τ_c).
  EXPECT_TRUE(tune_simc(lags(1.0, {}, {0.0, 0.0}), PidForm::pid, 1.0)->margins.stable);
}

// y' = u(t - 1) under u = r - y: t - 1 up to 2, then 1 + (t - 2) - (t - 2)²/2 up to its peak of 1.5
// at 3; a load of one through P alone ends at 1/kp.
TEST(PidDesign, DeadTimeByTheMethodOfSteps) {
  const PidLoop loop = assess_pid(plant({1.0}, {1.0, 0.0}, 1.0), {1.0, 0.0, 0.0}, 0.0).value();
  ASSERT_TRUE(loop.margins.stable);
  EXPECT_NEAR(*loop.reference.rise_time, 0.8, 1e-9);
  EXPECT_NEAR(*loop.reference.overshoot, 0.5, 1e-9);
  EXPECT_NEAR(*loop.reference.peak_time, 3.0, 1e-6);
  EXPECT_NEAR(loop.load->final_value, 1.0, 1e-12);
  EXPECT_NEAR(loop.load->peak, 1.5, 1e-9);
  // ∫e is what a loop with an integral needs: 1/ki, whatever the plant and its delay.
  for (const double delay : {0.0, 0.01, 0.7}) {
    for (const auto& P : {lags(2.0, {}, {3.0, 0.5}, delay), lags(1.0, {-0.2}, {0.0, 1.0}, delay)}) {
      const PidGains gains{0.3, 0.05, 0.1};
      const PidLoop judged = assess_pid(P, gains, 0.02).value();
      ASSERT_TRUE(judged.margins.stable && judged.load);
      EXPECT_NEAR(judged.load->integral * gains.ki, 1.0, 2e-4);
      EXPECT_GE(judged.load->absolute_integral, judged.load->integral * (1.0 - 1e-9));
    }
  }
  // Of so small a delay the response is that without.
  const PidGains gains{2.0, 1.5, 0.0};
  const auto small = assess_pid(lags(1.0, {}, {1.0, 0.3}, 1e-3), gains, 0.0).value();
  const auto none = assess_pid(lags(1.0, {}, {1.0, 0.3}), gains, 0.0).value();
  ASSERT_TRUE(small.load && none.load);
  EXPECT_NEAR(*small.reference.overshoot, *none.reference.overshoot, 2e-3);
  EXPECT_NEAR(small.load->peak, none.load->peak, 1e-3);
  EXPECT_NEAR(small.margins.complementary.value, none.margins.complementary.value, 3e-3);
}

TransferFunction random_plant(Random& random, int kind) {
  const auto n = static_cast<Eigen::Index>(1 + random.bits() % 4);
  VectorXcd poles(n);
  for (Eigen::Index k = 0; k < n;) {
    const double size = std::pow(10.0, random.uniform(-1.0, 1.0));
    if (k + 1 < n && random.uniform() < 0.4) {
      poles(k) = std::polar(size, random.uniform(0.55, 0.95) * pi);
      poles(k + 1) = std::conj(poles(k));
      k += 2;
    } else {
      poles(k++) = -size;
    }
  }
  const bool zero = n > 1 && random.uniform() < 0.4;
  VectorXcd zeros(zero ? 1 : 0);
  if (zero) {
    zeros(0) = random.uniform() < 0.3 ? 5.0 : -2.0;
  }
  const double gain =
      (random.uniform() < 0.3 ? -1.0 : 1.0) * std::pow(10.0, random.uniform(-1.0, 1.0));
  if (kind == 2) {
    // Sampled: the images, with some periods of delay.
    const double T = 0.05;
    for (Complex& pole : poles) {
      pole = std::exp(pole * T);
    }
    return TransferFunction::from_zeros(VectorXcd(0), poles, gain * 1e-2, Time(T),
                                        Time(T * static_cast<double>(random.bits() % 3)))
        .value();
  }
  return TransferFunction::from_zeros(zeros, poles, gain, std::nullopt,
                                      Time(kind == 1 ? random.uniform(0.02, 0.5) : 0.0))
      .value();
}

// Crossover and phase margin are those that were asked for; what cannot be is refused with what
// can, and that is answered when asked for.
TEST(PidDesign, TwoSliders) {
  Random random(31);
  int answered = 0;
  int refused = 0;
  int unstable = 0;
  for (int trial = 0; trial < 30; ++trial) {
    const TransferFunction P = random_plant(random, trial % 3);
    LoopShapeGoal goal;
    goal.crossover = std::pow(10.0, random.uniform(-1.0, 1.0));
    goal.phase_margin = random.uniform(30.0, 75.0);
    for (const PidForm form : {PidForm::pi, PidForm::pd, PidForm::pid}) {
      const auto expect = [&](const PidLoop& loop, double margin) {
        const Complex L = P.response(goal.crossover) * loop.controller.response(goal.crossover);
        EXPECT_NEAR(std::abs(L), 1.0, 1e-9);
        EXPECT_NEAR(std::remainder((std::arg(L) + pi) * 180.0 / pi - margin, 360.0), 0.0, 1e-7);
        EXPECT_TRUE(loop.margins.stable);
        // The coefficients of a discrete loop hide some digits of slow poles.
        const double fine = P.period() ? 1e-6 : 1e-9;
        bool crossed = false;
        for (const auto& crossing : loop.margins.gain_crossings) {
          crossed = crossed || (std::abs(crossing.frequency / goal.crossover - 1.0) < fine &&
                                std::abs(crossing.phase_margin - margin) < 1e3 * fine);
        }
        EXPECT_TRUE(crossed) << trial;
      };
      const auto loop = tune_by_loop_shape(P, form, goal);
      if (loop) {
        ++answered;
        expect(*loop, goal.phase_margin);
      } else if (loop.error().is(PidDesignError::phase_not_reached)) {
        ++refused;
        LoopShapeGoal nearer = goal;
        nearer.phase_margin = loop.error().evidence().front().values.front();
        if (nearer.phase_margin > 1.0 && nearer.phase_margin < 179.0) {
          nearer.phase_margin += nearer.phase_margin < goal.phase_margin ? -1e-4 : 1e-4;
          const auto again = tune_by_loop_shape(P, form, nearer);
          if (again) {
            expect(*again, nearer.phase_margin);
          } else {
            EXPECT_TRUE(again.error().is(PidDesignError::unstable_loop))
                << to_string(again.error());
          }
        }
      } else {
        EXPECT_TRUE(loop.error().is(PidDesignError::unstable_loop)) << to_string(loop.error());
        ++unstable;
      }
    }
  }
  EXPECT_GE(answered, 25);
  EXPECT_GE(refused, 10);
  EXPECT_GE(unstable, 1);
}

TEST(PidDesign, TwoSlidersOfUnstableAndIntegratingPlants) {
  LoopShapeGoal goal{.crossover = 3.0, .phase_margin = 50.0};
  const auto unstable = tune_by_loop_shape(plant({1.0}, {1.0, -1.0}), PidForm::pi, goal).value();
  EXPECT_TRUE(unstable.margins.stable);
  EXPECT_GT(unstable.gains.kp, 1.0);
  const auto arm = tune_by_loop_shape(plant({2.0}, {1.0, 0.0, 0.0}), PidForm::pid, goal).value();
  EXPECT_NEAR(*arm.margins.phase_margin, 50.0, 1e-6);
  EXPECT_EQ(arm.reference.final_value, 1.0);
  // P on a double integrator has no margin; the error tells it.
  const auto refused = tune_by_loop_shape(plant({2.0}, {1.0, 0.0, 0.0}), PidForm::p, goal);
  ASSERT_FALSE(refused);
  EXPECT_EQ(to_string(refused.error()),
            "tune_by_loop_shape: the phase margin is 0 deg with P at this crossover; it must be at "
            "least 50 deg; a lower crossover, or PD or PID (phase margin = 0)");
  const auto lag = tune_by_loop_shape(lags(2.0, {}, {1.0}, 0.1), PidForm::p, goal).value();
  EXPECT_NEAR(std::abs(lag.gains.kp), std::hypot(1.0, 3.0) / 2.0, 1e-12);
  goal.crossover = 40.0;
  EXPECT_TRUE(tune_by_loop_shape(plant({1.0}, {1.0, -0.9}, 0.0, 0.1), PidForm::pi, goal)
                  .error()
                  .is(ArgumentError::out_of_range));
}

// The gains with the largest |ki|: M_s is kept to rounding, and no other gains nearby or far keep
// it with more.
TEST(PidDesign, MostIntegralGainForARobustness) {
  Random random(41);
  int answered = 0;
  for (int trial = 0; trial < 24; ++trial) {
    const TransferFunction P = random_plant(random, trial % 3);
    RobustnessGoal goal;
    goal.sensitivity = random.uniform(1.2, 2.0);
    const auto loop = tune_by_robustness(P, PidForm::pi, goal);
    if (!loop) {
      EXPECT_TRUE(loop.error().is(PidDesignError::unlimited)) << trial << to_string(loop.error());
      continue;
    }
    ++answered;
    EXPECT_TRUE(loop->margins.stable);
    EXPECT_LE(loop->margins.sensitivity.value, goal.sensitivity * (1.0 + 1e-9)) << trial;
    EXPECT_GE(loop->margins.sensitivity.value, goal.sensitivity * (1.0 - 1e-6)) << trial;
    for (int other = 0; other < 60; ++other) {
      const double near = other < 40 ? 0.2 : 2.0;
      const PidGains gains{
          loop->gains.kp * std::exp(near * random.normal()) * (other % 7 == 6 ? -1.0 : 1.0),
          loop->gains.ki * (1.0 + 2e-3 + 0.3 * near * random.uniform()), 0.0};
      const auto L = series(pid_transfer(gains, 0.0, P.period()).value(), P).value();
      const auto margins = classical::loop_margins(L).value();
      EXPECT_FALSE(margins.stable && margins.sensitivity.value <= goal.sensitivity)
          << trial << " kp " << gains.kp << " ki " << gains.ki << " instead of " << loop->gains.kp
          << " " << loop->gains.ki;
    }
  }
  EXPECT_GE(answered, 12);
}

TEST(PidDesign, RobustPidOfManyLags) {
  // 1/(s + 1)⁴ with M_s = M_t = 1.4: PID has more integral gain than PI, each without overshoot
  // worth the name.
  const TransferFunction P = lags(1.0, {}, {1.0, 1.0, 1.0, 1.0});
  const RobustnessGoal goal{.sensitivity = 1.4, .complementary = 1.4};
  const PidLoop two = tune_by_robustness(P, PidForm::pi, goal).value();
  const PidLoop three = tune_by_robustness(P, PidForm::pid, goal).value();
  EXPECT_GT(three.gains.ki, 1.5 * two.gains.ki);
  EXPECT_LE(three.margins.sensitivity.value, 1.4 * (1.0 + 1e-9));
  EXPECT_LE(three.margins.complementary.value, 1.4 * (1.0 + 1e-9));
  EXPECT_LE(three.load->absolute_integral, two.load->absolute_integral);
  // The load's integral is not much less than its absolute one: nothing oscillates.
  EXPECT_LE(three.load->absolute_integral, 1.15 * three.load->integral);
  // An unstable plant, an integrating one with delay, and one of negative gain.
  EXPECT_TRUE(tune_by_robustness(plant({1.0}, {1.0, -1.0}, 0.1), PidForm::pi, {.sensitivity = 2.0})
                  ->margins.stable);
  EXPECT_TRUE(tune_by_robustness(plant({1.0}, {1.0, 0.0}, 1.0), PidForm::pid)->margins.stable);
  EXPECT_LT(tune_by_robustness(lags(-1.0, {}, {1.0}, 0.5), PidForm::pi)->gains.ki, 0.0);
  EXPECT_TRUE(
      tune_by_robustness(lags(1.0, {}, {1.0}), PidForm::pi).error().is(PidDesignError::unlimited));
  EXPECT_TRUE(tune_by_robustness(plant({1.0}, {1.0, -1.0}, 0.9), PidForm::pi, {.sensitivity = 1.1})
                  .error()
                  .is(PidDesignError::nothing_robust));
  EXPECT_TRUE(tune_by_robustness(P, PidForm::pd).error().is(PidDesignError::no_rule));
  EXPECT_TRUE(tune_by_robustness(P, PidForm::pi, {.sensitivity = 0.9})
                  .error()
                  .is(ArgumentError::out_of_range));
}

// The pair stays where it was placed, dead time and filter or not.
TEST(PidDesign, DominantPolesAreWhereTheyWerePlaced) {
  Random random(11);
  int placed = 0;
  for (int i = 0; i < 60; ++i) {
    const bool discrete = i % 3 == 2;
    const double period = discrete ? 0.05 : 0.0;
    const double pole = 0.3 + random.uniform();
    const double z = std::exp(-0.05 * pole);
    const TransferFunction P =
        discrete ? plant({0.0013, 0.0012}, {1.0, -1.0 - z, z}, i % 2 == 0 ? 0.1 : 0.0, period)
                 : lags(1.5, {}, {1.0 / pole, 0.3, 0.2}, i % 2 == 0 ? 0.15 : 0.0);
    const PidForm form = discrete ? PidForm::pd : i % 4 < 2 ? PidForm::pi : PidForm::pid;
    const DominantPoles goal{.natural_frequency = 0.4 + 0.5 * random.uniform(),
                             .damping_ratio = 0.5 + 0.4 * random.uniform()};
    const auto loop = tune_by_poles(P, form, goal);
    if (!loop) {
      // Or derivatives so large that their filter runs away from them.
      EXPECT_TRUE(loop.error().is(PidDesignError::not_dominant) ||
                  loop.error().is(PidDesignError::unstable_loop) ||
                  loop.error().is(PidDesignError::no_rule))
          << to_string(loop.error());
      continue;
    }
    ++placed;
    const double w = goal.natural_frequency;
    const double zeta = goal.damping_ratio;
    std::vector<Complex> points{w * Complex(-zeta, std::sqrt(1.0 - zeta * zeta))};
    if (form == PidForm::pid) {
      points.emplace_back(-w);
      EXPECT_NEAR(loop->derivative_time_constant, std::abs(loop->gains.kd / loop->gains.kp) / 10.0,
                  1e-12);
    }
    const auto L = series(loop->controller, P).value();
    for (const Complex& s : points) {
      EXPECT_LE(std::abs(1.0 + L.at(discrete ? std::exp(s * period) : s).value()), 1e-9) << i;
    }
    EXPECT_TRUE(loop->margins.stable);
  }
  EXPECT_GT(placed, 20);
  const TransferFunction P = lags(1.0, {}, {1.0, 1.0});
  const auto refused = [&](PidForm form, const DominantPoles& goal) {
    return tune_by_poles(P, form, goal).error();
  };
  EXPECT_TRUE(refused(PidForm::p, {.natural_frequency = 1.0}).is(PidDesignError::no_rule));
  EXPECT_TRUE(refused(PidForm::pi, {.natural_frequency = 0.0}).is(ArgumentError::not_positive));
  EXPECT_TRUE(refused(PidForm::pi, {.natural_frequency = 1.0, .damping_ratio = 1.0})
                  .is(ArgumentError::out_of_range));
  // PI on two lags of 1 s does not move the poles' sum: the third is at -2 + 2ζω.
  EXPECT_TRUE(refused(PidForm::pi, {.natural_frequency = 1.2, .damping_ratio = 0.7})
                  .is(PidDesignError::not_dominant));
}

}  // namespace
}  // namespace flyball::pid_design_test
