#include <flyball/classical/delay_system.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "classical/transfer_cases.hpp"
#include "support/oracle.hpp"
#include "support/random_systems.hpp"

namespace flyball::classical::delay_system_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using flyball::test::random_matrix;
using flyball::test::transfer;

VectorXd random_delays(Random& random, Index count) {
  VectorXd delays(count);
  for (double& delay : delays) {
    delay = random.bits() % 4 == 0 ? 0.0 : 2.0 * random.uniform();
  }
  return delays;
}

/// A random system with dead time at both ends and its response by hand.
struct Sample {
  DelaySystem system;
  ContinuousSystem<> rational;
  VectorXd in;
  VectorXd out;

  [[nodiscard]] MatrixXcd response(double w) const {
    const auto late = [&](const VectorXd& delays) {
      Eigen::VectorXcd factors(delays.size());
      for (Index i = 0; i < delays.size(); ++i) {
        factors(i) = std::polar(1.0, -w * delays(i));
      }
      return factors;
    };
    const MatrixXcd G =
        flyball::test::response(rational.A, rational.B, rational.C, rational.D, Complex(0.0, w));
    return late(out).asDiagonal() * G * late(in).asDiagonal();
  }
};

Sample random_sample(Random& random, Index inputs, Index outputs) {
  const auto n = static_cast<Index>(random.bits() % 5);
  const ContinuousSystem<> s{random_matrix(random, n, n), random_matrix(random, n, inputs),
                             random_matrix(random, outputs, n),
                             random_matrix(random, outputs, inputs)};
  const VectorXd in = random_delays(random, inputs);
  const VectorXd out = random_delays(random, outputs);
  const auto late =
      DelaySystem::create(s).value().with_input_delays(in).value().with_output_delays(out).value();
  return {late, s, in, out};
}

double relative(const MatrixXcd& got, const MatrixXcd& expected) {
  return (got - expected).norm() / expected.norm();
}

// The block-diagram algebra of appendix A for matrices, delays exact: nothing but the responses is
// compared.
TEST(DelaySystem, AlgebraOfBlockDiagrams) {
  Random random(11);
  double worst = 0.0;
  int loops = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const auto m = static_cast<Index>(1 + random.bits() % 2);
    const auto p = static_cast<Index>(1 + random.bits() % 2);
    const Sample G = random_sample(random, m, p);
    const Sample H = random_sample(random, p, m);
    const Sample K = random_sample(random, m, p);
    const auto forward = series(G.system, H.system).value();
    const auto sum = parallel(G.system, K.system).value();
    const auto both = append(G.system, H.system).value();
    const auto loop = feedback(G.system, H.system);
    const auto positive = feedback(G.system, H.system, FeedbackSign::positive);
    for (const double w : {0.0, 0.03, 0.7, 5.0, 300.0}) {
      const MatrixXcd g = G.response(w);
      const MatrixXcd h = H.response(w);
      const MatrixXcd one = MatrixXcd::Identity(p, p);
      worst = std::max(worst, relative(G.system.response(w), g) * 1e-2);
      worst = std::max(worst, relative(forward.response(w), h * g) * 1e-2);
      worst = std::max(worst, relative(sum.response(w), g + K.response(w)) * 1e-2);
      worst = std::max(worst, relative(both.response(w).topLeftCorner(p, m), g) * 1e-2);
      worst = std::max(worst, relative(both.response(w).bottomRightCorner(m, p), h) * 1e-2);
      // y = G (u - H y), without dividing by what may be small.
      for (const auto& [closed, sign] : {std::pair{&loop, 1.0}, {&positive, -1.0}}) {
        if (!*closed) {
          EXPECT_TRUE(closed->error().is(SystemError::algebraic_loop));
          continue;
        }
        ++loops;
        const MatrixXcd y = (*closed)->response(w);
        const MatrixXcd left = (one + sign * g * h) * y - g;
        worst = std::max(worst, left.norm() / (g.norm() + (1.0 + (g * h).norm()) * y.norm()));
      }
    }
  }
  EXPECT_LE(worst, 1e-12);
  EXPECT_GE(loops, 29000);
}

// From coefficients by roots: to the last digits of ‖G‖.
TEST(DelaySystem, OfTransferFunctions) {
  int seen = 0;
  for (const auto& c : flyball::test::cases_of("transfer_functions.json")) {
    const TransferFunction G = flyball::test::transfer_of(c);
    const DelaySystem system = DelaySystem::create(G).value();
    EXPECT_EQ(system.states(), G.order());
    for (const auto& row : c["freqresp"]) {
      ++seen;
      const Complex expected(row[1].get<double>(), row[2].get<double>());
      EXPECT_LE(std::abs(system.response(row[0].get<double>())(0, 0) - expected),
                1e-12 * std::abs(expected))
          << c["name"] << " at " << row[0];
    }
  }
  EXPECT_GE(seen, 300);
  const auto late = transfer({2.0}, {1.0, 3.0, 2.0}, 0.7);
  const DelaySystem system = DelaySystem::create(late).value();
  EXPECT_EQ(system.delays(), VectorXd::Constant(1, 0.7));
  for (const double w : {0.0, 1.0, 40.0}) {
    EXPECT_LE(std::abs(system.response(w)(0, 0) - late.response(w)),
              1e-15 * std::abs(late.response(0.0)));
  }
  EXPECT_LE(std::abs(system.at({0.5, 0.2}).value()(0, 0) - late.at({0.5, 0.2}).value()), 1e-15);
}

// Numbers of mpmath with 50 digits.
TEST(DelaySystem, Gold) {
  int seen = 0;
  for (const auto& c : flyball::test::cases_of("interconnection.json")) {
    const auto system = [&](const char* name) {
      return DelaySystem::create(flyball::test::transfer_of(c[name])).value();
    };
    const DelaySystem G = system("G");
    const DelaySystem H = system("H");
    const std::pair<const char*, DelaySystem> made[] = {
        {"jw_series", series(G, H).value()},
        {"jw_parallel", parallel(G, H).value()},
        {"jw_feedback_neg", feedback(G, H).value()},
        {"jw_feedback_pos", feedback(G, H, FeedbackSign::positive).value()}};
    for (const auto& [name, connected] : made) {
      for (std::size_t i = 0; i < c["w"].size(); ++i) {
        ++seen;
        const Complex expected(c[name][i][0].get<double>(), c[name][i][1].get<double>());
        EXPECT_LE(std::abs(connected.response(c["w"][i].get<double>())(0, 0) - expected),
                  1e-12 * std::abs(expected))
            << c["name"] << ' ' << name << " at " << c["w"][i];
      }
    }
  }
  EXPECT_GE(seen, 60);
}

// A loop of dead time alone, y = u - k y(t - τ): 1/(1 + k e^{-jωτ}); without the dead time u/(1 +
// k).
TEST(DelaySystem, StaticLoopWithDeadTime) {
  const auto late = transfer({0.5}, {1.0}, 2.0);
  const auto one = DelaySystem::gain(MatrixXd::Identity(1, 1)).value();
  const auto loop = feedback(one, DelaySystem::create(late).value()).value();
  EXPECT_EQ(loop.states(), 0);
  EXPECT_TRUE(loop.has_delay_in_loop());
  for (const double w : {0.0, 0.4, 10.0}) {
    EXPECT_LE(std::abs(loop.response(w)(0, 0) - 1.0 / (1.0 + 0.5 * std::polar(1.0, -2.0 * w))),
              1e-15);
  }
  const auto now = feedback(one, DelaySystem::create(transfer({0.5}, {1.0})).value()).value();
  EXPECT_FALSE(now.has_delay());
  EXPECT_DOUBLE_EQ(now.dc_gain()(0, 0), 1.0 / 1.5);
  // The delay of a loop may be closed afterwards.
  DelayForm form = loop.form();
  form.delays.setZero();
  EXPECT_DOUBLE_EQ(DelaySystem::create(form).value().dc_gain()(0, 0), 1.0 / 1.5);
  form.D22(0, 0) = 1.0;
  EXPECT_TRUE(DelaySystem::create(form).error().is(SystemError::algebraic_loop));
}

TEST(DelaySystem, DelaysInLoopsAndOutsideOfThem) {
  const auto G = DelaySystem::create(transfer({1.0}, {1.0, 1.0}, 0.3)).value();
  EXPECT_TRUE(G.has_delay());
  EXPECT_FALSE(G.has_delay_in_loop());
  EXPECT_FALSE(series(G, G).value().has_delay_in_loop());
  EXPECT_TRUE(feedback(G).value().has_delay_in_loop());
  // A loop without dead time in front of one.
  const auto rational = feedback(DelaySystem::create(transfer({1.0}, {1.0, 1.0})).value()).value();
  EXPECT_FALSE(series(G, rational).value().has_delay_in_loop());
}

// Dead time of a discrete system as states: the same at every point of the circle.
TEST(DelaySystem, DiscreteDelaysAreStates) {
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const Time period(0.02);
    const DiscreteSystem<> plant{0.4 * random_matrix(random, 3, 3), random_matrix(random, 3, 2),
                                 random_matrix(random, 2, 3), random_matrix(random, 2, 2), period};
    const auto whole = [&] {
      return VectorXd{{0.02 * static_cast<double>(random.bits() % 5),
                       0.02 * static_cast<double>(random.bits() % 5)}};
    };
    const auto late = DelaySystem::create(plant)
                          .value()
                          .with_input_delays(whole())
                          .value()
                          .with_output_delays(whole())
                          .value();
    const auto gain = DelaySystem::gain(0.1 * random_matrix(random, 2, 2), period).value();
    const auto loop = feedback(late, gain).value();
    const DiscreteSystem<> states = loop.to_discrete().value();
    for (const double w : {0.0, 3.0, 60.0, 157.0}) {
      const MatrixXcd expected = flyball::test::response(states.A, states.B, states.C, states.D,
                                                         std::polar(1.0, 0.02 * w));
      EXPECT_LE(relative(loop.response(w), expected), 1e-11);
      EXPECT_LE(relative(loop.at(std::polar(1.1, 0.02 * w)).value(),
                         flyball::test::response(states.A, states.B, states.C, states.D,
                                                 std::polar(1.1, 0.02 * w))),
                1e-11);
    }
  }
}

// e^{-jωτ} up to ωτ = 3 is its approximation of order ten to 1e-12, in a loop too.
TEST(DelaySystem, Pade) {
  const auto G = DelaySystem::create(transfer({1.0, 2.0}, {1.0, 2.0, 4.0}, 0.5)).value();
  const auto loop = feedback(G).value();
  const ContinuousSystem<> rational = loop.pade(10).value();
  EXPECT_EQ(rational.A.rows(), 12);
  for (const double w : {0.0, 0.5, 2.0, 6.0}) {
    const MatrixXcd expected = loop.response(w);
    EXPECT_LE(relative(flyball::test::response(rational.A, rational.B, rational.C, rational.D,
                                               Complex(0.0, w)),
                       expected),
              1e-12)
        << w;
  }
  // Of order 0 the delay is left out.
  EXPECT_EQ(loop.pade(0).value().A.rows(), 2);
  EXPECT_TRUE(loop.pade(21).error().is(ArgumentError::out_of_range));
}

TEST(DelaySystem, Channels) {
  Random random(8);
  const Sample s = random_sample(random, 2, 2);
  const auto part = s.system.channels({1}, {0}).value();
  EXPECT_LE(std::abs(part.response(0.7)(0, 0) - s.response(0.7)(1, 0)), 1e-14);
  EXPECT_TRUE(s.system.channels({2}, {0}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(s.system.channels({}, {0}).error().is(ArgumentError::empty));
}

TEST(DelaySystem, Errors) {
  const auto G = DelaySystem::create(transfer({1.0}, {1.0, 1.0}, 0.3)).value();
  const auto two = DelaySystem::gain(MatrixXd::Identity(2, 2)).value();
  const auto sampled = DelaySystem::gain(MatrixXd::Identity(1, 1), Time(0.1)).value();
  EXPECT_EQ(to_string(series(G, two).error()),
            "series: the number of the second's inputs is 2; it must be 1, the first's outputs");
  EXPECT_TRUE(parallel(G, two).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(feedback(G, two).error().is(ArgumentError::wrong_shape));
  EXPECT_EQ(to_string(series(G, sampled).error()),
            "series: the second's sample period is 0.1 s; it must be continuous, the first's; "
            "discretize or resample one of them");
  EXPECT_TRUE(append(sampled, G).error().is(TransferError::period_mismatch));
  const auto minus_one = DelaySystem::gain(-MatrixXd::Identity(1, 1)).value();
  const auto one = DelaySystem::gain(MatrixXd::Identity(1, 1)).value();
  EXPECT_TRUE(feedback(one, minus_one).error().is(SystemError::algebraic_loop));
  EXPECT_TRUE(feedback(minus_one).error().is(SystemError::algebraic_loop));
  // Units of the signals make no loop algebraic.
  const auto huge = DelaySystem::gain(MatrixXd::Constant(1, 1, 1e20)).value();
  const auto tiny = DelaySystem::gain(MatrixXd::Constant(1, 1, 1e-20)).value();
  EXPECT_NEAR(feedback(huge, tiny).value().dc_gain()(0, 0), 5e19, 1e5);

  EXPECT_TRUE(G.to_continuous().error().is(TransferError::delay_in_loop));
  EXPECT_TRUE(G.to_discrete().error().is(TransferError::period_mismatch));
  EXPECT_TRUE(sampled.to_continuous().error().is(TransferError::period_mismatch));
  EXPECT_TRUE(sampled.with_input_delays(VectorXd::Constant(1, 0.15))
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(sampled.with_input_delays(VectorXd::Constant(1, 300.0))
                  .value()
                  .to_discrete()
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      G.with_output_delays(VectorXd::Constant(1, -1.0)).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(G.with_output_delays(VectorXd::Zero(2)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(G.at({NAN, 0.0}).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(G.at({-1.0, 0.0}).error().is(TransferError::at_a_pole));
  DelayForm form = G.form();
  form.B2(0, 0) = NAN;
  EXPECT_TRUE(DelaySystem::create(form).error().is(ArgumentError::not_finite));
  form = G.form();
  form.C2.resize(2, 1);
  EXPECT_TRUE(DelaySystem::create(form).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(DelaySystem::create(DelayForm{}).error().is(ArgumentError::empty));
  EXPECT_TRUE(rewired(G, Wiring{MatrixXd::Zero(2, 1), MatrixXd::Zero(1, 1), MatrixXd::Zero(1, 1),
                                MatrixXd::Zero(1, 1)})
                  .error()
                  .is(ArgumentError::wrong_shape));
}

}  // namespace
}  // namespace flyball::classical::delay_system_test
