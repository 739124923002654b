#include <flyball/classical/delay_response.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "classical/transfer_cases.hpp"
#include "support/random_systems.hpp"

namespace flyball::classical::delay_response_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using flyball::test::random_matrix;
using flyball::test::transfer;

DelaySystem system_of(const TransferFunction& G) {
  return DelaySystem::create(G).value();
}

ResponseTimes every(double step, Index samples) {
  return {Time(step), samples};
}

double worst_error(const DelayResponse& response, auto&& expected) {
  double worst = 0.0;
  for (Index k = 0; k < response.time.size(); ++k) {
    worst = std::max(worst, std::abs(response.y(k, 0) - expected(response.time(k))));
  }
  return worst;
}

// e^{-0.7s} 2/((s + 1)(s + 2)): that without dead time, later; the samples' step of 0.13 s does not
// divide it.
TEST(DelayResponse, DeadTimeAtTheInputShifts) {
  const auto G = system_of(transfer({2.0}, {1.0, 3.0, 2.0}, 0.7));
  const auto exact = [](double t) {
    return t < 0.7 ? 0.0 : 1.0 - 2.0 * std::exp(-(t - 0.7)) + std::exp(-2.0 * (t - 0.7));
  };
  EXPECT_LE(worst_error(step_response(G, 0, every(0.13, 100)).value(), exact), 1e-13);
  const auto late = system_of(transfer({2.0}, {1.0, 3.0, 2.0}))
                        .with_output_delays(VectorXd::Constant(1, 0.7))
                        .value();
  EXPECT_LE(worst_error(step_response(late, 0, every(0.13, 100)).value(), exact), 1e-12);
  EXPECT_LE(worst_error(impulse_response(G, 0, every(0.1, 60)).value(),
                        [](double t) {
                          return t < 0.7 - 1e-9 ? 0.0
                                                : 2.0 * std::exp(-(t - 0.7)) -
                                                      2.0 * std::exp(-2.0 * (t - 0.7));
                        }),
            1e-12);
}

// k e^{-τs}/s under unity feedback, y' = k (1 - y(t - τ)): y = Σ (-1)ⁿ⁺¹ kⁿ (t - nτ)ⁿ/n! over nτ <
// t.
TEST(DelayResponse, IntegratorInALoopWithDeadTime) {
  const double k = 0.9;
  const double tau = 0.6;
  const auto loop = feedback(system_of(transfer({k}, {1.0, 0.0}, tau))).value();
  const auto exact = [&](double t) {
    double sum = 0.0;
    double factorial = 1.0;
    for (int n = 1; n * tau <= t; ++n) {
      factorial *= n;
      sum -= std::pow(-k * (t - n * tau), n) / factorial;
    }
    return sum;
  };
  EXPECT_LE(worst_error(step_response(loop, 0, every(0.05, 200)).value(), exact), 1e-11);
  // The impulse response is its slope.
  const auto slope = [&](double t) {
    double sum = 0.0;
    double factorial = 1.0;
    for (int n = 1; n * tau <= t + 1e-9; ++n) {
      sum += k * std::pow(-k * (t - n * tau), n - 1) / factorial;
      factorial *= n;
    }
    return sum;
  };
  EXPECT_LE(worst_error(impulse_response(loop, 0, every(0.05, 200)).value(), slope), 1e-11);
}

// y' = u - a y(t - τ₁) - b y(t - τ₂) with τ₂ = √2 τ₁: jumps of all orders at kτ₁ + lτ₂.
// y = Σₙ (-1)ⁿ Σₖ C(n, k) aᵏ bⁿ⁻ᵏ (t - kτ₁ - (n - k)τ₂)₊ⁿ⁺¹/(n + 1)!
TEST(DelayResponse, DelaysOfAnyRatio) {
  const double a = 0.8;
  const double b = 0.5;
  const double t1 = 0.5;
  const double t2 = std::sqrt(2.0) * t1;
  const auto one = system_of(transfer({a}, {1.0}, t1));
  const auto other = system_of(transfer({b}, {1.0}, t2));
  const auto loop =
      feedback(system_of(transfer({1.0}, {1.0, 0.0})), parallel(one, other).value()).value();
  const auto exact = [&](double t) {
    double sum = 0.0;
    double factorial = 1.0;
    for (int n = 0; n <= 20; ++n) {
      factorial *= n + 1;
      double choose = 1.0;
      for (int k = 0; k <= n; ++k) {
        const double left = t - k * t1 - (n - k) * t2;
        if (left > 0.0) {
          sum += (n % 2 == 0 ? 1.0 : -1.0) * choose * std::pow(a, k) * std::pow(b, n - k) *
                 std::pow(left, n + 1) / factorial;
        }
        choose *= static_cast<double>(n - k) / (k + 1);
      }
    }
    return sum;
  };
  EXPECT_LE(worst_error(step_response(loop, 0, every(0.07, 80)).value(), exact), 1e-11);
}

// y = u - y(t - 2)/2: jumps that never end, 1, 1/2, 3/4, …; a sample at a jump is what follows it.
TEST(DelayResponse, JumpsGoRoundAStaticLoop) {
  const auto loop = feedback(DelaySystem::gain(MatrixXd::Identity(1, 1)).value(),
                             system_of(transfer({0.5}, {1.0}, 2.0)))
                        .value();
  EXPECT_LE(worst_error(step_response(loop, 0, every(0.5, 100)).value(),
                        [](double t) {
                          const double turns = std::floor(t / 2.0 + 1e-9) + 1.0;
                          return (1.0 - std::pow(-0.5, turns)) / 1.5;
                        }),
            1e-14);
  const auto impulses = impulse_response(loop, 0, every(0.5, 21)).value();
  EXPECT_TRUE(impulses.y.isZero(0.0));
  ASSERT_EQ(impulses.impulses.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(impulses.impulses[i].time, 2.0 * static_cast<double>(i));
    EXPECT_EQ(impulses.impulses[i].strength(0), std::pow(-0.5, static_cast<double>(i)));
  }
}

// A first-order lag with dead time, on samples of an input held and drawn through; the lag's
// response to a ramp from t₀ is t - t₀ - 1 + e^{-(t - t₀)}, that to a step 1 - e^{-(t - t₀)}.
TEST(DelayResponse, SampledInputs) {
  const auto G = system_of(transfer({1.0}, {1.0, 1.0}, 0.25));
  Random random(4);
  const MatrixXd u = random_matrix(random, 40, 1);
  const double step = 0.1;
  const auto after = [](double t, auto&& shape) { return t > 1e-9 ? shape(t) : 0.0; };
  const auto ramp = [](double t) { return t + std::expm1(-t); };
  const auto rise = [](double t) { return -std::expm1(-t); };
  const auto exact = [&](InputShape shape, double t) {
    double sum = shape == InputShape::linear ? u(0, 0) * after(t - 0.25, rise) : 0.0;
    double slope = 0.0;
    for (Index k = 0; k < 40; ++k) {
      const double then = t - 0.25 - step * static_cast<double>(k);
      if (shape == InputShape::held) {
        sum += (u(k, 0) - (k > 0 ? u(k - 1, 0) : 0.0)) * after(then, rise);
      } else if (k + 1 < 40) {
        const double next = (u(k + 1, 0) - u(k, 0)) / step;
        sum += (next - slope) * after(then, ramp);
        slope = next;
      }
    }
    return sum;
  };
  for (const InputShape shape : {InputShape::held, InputShape::linear}) {
    const auto response = forced_response(G, u, VectorXd::Zero(1), Time(step), shape).value();
    EXPECT_LE(worst_error(response, [&](double t) { return exact(shape, t); }), 1e-12);
  }
}

// Time constants from 1e-6 to 1 in a loop with dead time settle to the gain at rest, by G(0).
TEST(DelayResponse, StiffLoopsSettle) {
  const auto G = system_of(transfer({3e6}, {1.0, 1e6 + 1.0, 1e6}, 0.2));
  const auto loop = feedback(G, FeedbackSign::negative).value();
  const auto response = step_response(loop, 0, every(0.5, 200)).value();
  EXPECT_NEAR(response.y(199, 0), 0.75, 1e-10);
  const auto chosen = step_response(loop).value();
  EXPECT_EQ(chosen.time.size(), 601);
  EXPECT_NEAR(chosen.y(600, 0), 0.75, 0.02);
}

// Systems of several inputs and outputs against the Padé approximation of order 6, whose error for
// inputs without jumps is 1e-5 and below; and from an initial state.
TEST(DelayResponse, ManyInputsAndOutputs) {
  Random random(77);
  for (int trial = 0; trial < 6; ++trial) {
    ContinuousSystem<> plant{0.5 * random_matrix(random, 3, 3), random_matrix(random, 3, 2),
                             random_matrix(random, 2, 3), MatrixXd::Zero(2, 2)};
    plant.A -= 2.0 * MatrixXd::Identity(3, 3);
    const auto late = DelaySystem::create(plant)
                          .value()
                          .with_input_delays(VectorXd{{0.3 * random.uniform() + 0.1, 0.2}})
                          .value()
                          .with_output_delays(VectorXd{{0.1, 0.3 * random.uniform() + 0.1}})
                          .value();
    const auto gain = DelaySystem::gain(0.3 * random_matrix(random, 2, 2)).value();
    const auto loop = feedback(late, gain).value();
    MatrixXd u(100, 2);
    for (Index k = 0; k < 100; ++k) {
      const double t = 0.05 * static_cast<double>(k);
      u.row(k) << t * t * t * t * t * std::exp(-3.0 * t), 0.0;
    }
    const auto rational = DelaySystem::create(loop.pade(6).value()).value();
    const auto exact =
        forced_response(loop, u, VectorXd::Zero(3), Time(0.05), InputShape::linear).value();
    const auto approximate = forced_response(rational, u, VectorXd::Zero(rational.states()),
                                             Time(0.05), InputShape::linear)
                                 .value();
    EXPECT_LE((exact.y - approximate.y).norm(), 1e-5 * exact.y.norm());
    const VectorXd x0 = random_matrix(random, 3, 1);
    const auto free = initial_response(loop, x0, every(0.02, 200)).value();
    EXPECT_EQ(free.x.row(0).transpose(), x0);
    // Before anything returns it is e^{At} x₀, whose slope at the start is A x₀.
    EXPECT_LE((free.x.row(1).transpose() - x0 - 0.02 * plant.A * x0).norm(), 2e-2 * x0.norm());
  }
}

// The recursion with the delays as states.
TEST(DelayResponse, DiscreteSystems) {
  Random random(2);
  const Time period(0.1);
  const DiscreteSystem<> plant{0.3 * random_matrix(random, 2, 2), random_matrix(random, 2, 1),
                               random_matrix(random, 1, 2), random_matrix(random, 1, 1), period};
  const auto loop =
      feedback(
          DelaySystem::create(plant).value().with_input_delays(VectorXd::Constant(1, 0.3)).value(),
          DelaySystem::gain(MatrixXd::Constant(1, 1, 0.2), period).value())
          .value();
  const DiscreteSystem<> states = loop.to_discrete().value();
  const MatrixXd u = random_matrix(random, 50, 1);
  const auto got = forced_response(loop, u, VectorXd::Zero(2), period).value();
  const auto expected =
      flyball::forced_response(states, u, VectorXd::Zero(states.A.rows())).value();
  EXPECT_LE((got.y - expected.y).norm(), 1e-14 * expected.y.norm());
  const auto impulse = impulse_response(loop, 0, every(0.1, 30)).value();
  EXPECT_LE((impulse.y - flyball::impulse_response(states, 0, every(0.1, 30)).value().y).norm(),
            1e-14);
  EXPECT_EQ(step_response(loop).value().time(1), 0.1);
}

TEST(DelayResponse, Errors) {
  const auto G = system_of(transfer({1.0}, {1.0, 1.0}, 0.1));
  const MatrixXd u = MatrixXd::Ones(10, 1);
  const VectorXd x0 = VectorXd::Zero(1);
  EXPECT_TRUE(forced_response(G, u, x0, Time(0.0)).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(forced_response(G, MatrixXd::Ones(10, 2), x0, Time(0.1))
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      forced_response(G, u, VectorXd::Zero(2), Time(0.1)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      forced_response(G, MatrixXd(NAN * u), x0, Time(0.1)).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(step_response(G, 1).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(step_response(G, 0, every(1.0, 0)).error().is(ArgumentError::out_of_range));
  EXPECT_EQ(to_string(step_response(G, 0, every(1e6, 1001)).error()),
            "response: the shortest delay is 0.1 s; it must be at least a billionth of the time, "
            "1001000000 s; ask for a shorter time, or leave the delay out");
  const auto late = step_response(G, 0, every(1e4, 1001));
  ASSERT_TRUE(late) << to_string(late.error());
  EXPECT_NEAR(late->y(1000, 0), 1.0, 1e-12);
  EXPECT_EQ(to_string(step_response(G, 0, every(1e-303, 601)).error()),
            "response: the time between two samples is 1e-303 s; it must be at least 1e-280 s");
  const auto unstable = system_of(transfer({1.0}, {1.0, -1.0}, 0.1));
  EXPECT_TRUE(step_response(unstable, 0, every(10.0, 100)).error().is(ArgumentError::not_finite));
  const auto sampled = DelaySystem::gain(MatrixXd::Ones(1, 1), Time(0.1)).value();
  EXPECT_TRUE(step_response(sampled, 0, every(0.2, 10)).error().is(ArgumentError::out_of_range));
}

}  // namespace
// y' = 1 - y(t - τ) with delays far shorter than the motion: the sum of the test above, in long
// double, of which terms up to 10² leave 1e-16.
TEST(DelayResponse, StepsMayBeLongerThanADelay) {
  for (const double tau : {1e-3, 0.01, 0.03, 0.3}) {
    const auto loop = feedback(system_of(transfer({1.0}, {1.0, 0.0}, tau))).value();
    const auto exact = [&](double t) {
      long double sum = 0.0L;
      for (int n = 1; n <= 80 && n * tau <= t; ++n) {
        sum -= std::pow(static_cast<long double>(n * tau - t), n) /
               std::tgamma(static_cast<long double>(n + 1));
      }
      return static_cast<double>(sum);
    };
    EXPECT_LE(worst_error(step_response(loop, 0, every(0.05, 121)).value(), exact), 1e-11) << tau;
  }
}

// A slow part and a soon one: 20 000 seconds of a delay of 0.1 s.
TEST(DelayResponse, ASlowPartIsFollowedToItsEnd) {
  const auto both =
      parallel(system_of(transfer({1.0}, {1.0, 1.0})), system_of(transfer({1.0}, {1.0, 1e-3}, 0.1)))
          .value();
  const auto y = step_response(both, 0, every(100.0, 201)).value();
  for (Index i = 1; i < y.time.size(); ++i) {
    const double t = y.time(i);
    EXPECT_NEAR(y.y(i, 0), 1.0 - std::exp(-t) - 1e3 * std::expm1(-1e-3 * (t - 0.1)), 1e-8) << t;
  }
}

}  // namespace flyball::classical::delay_response_test
