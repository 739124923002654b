#include <flyball/classical/nyquist.hpp>

#include <cmath>
#include <cstdlib>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/classical/loop_margins.hpp>
#include <flyball/core/random.hpp>

#include "classical/transfer_cases.hpp"

namespace flyball::classical::nyquist_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXd;
using flyball::test::transfer;

NyquistData nyquist_of(const TransferFunction& L) {
  return nyquist(frequency_response(L).value()).value();
}

// K/(s + 1)³ is unstable above K = 8: two poles cross.
TEST(Nyquist, CountsEncirclements) {
  EXPECT_EQ(nyquist_of(transfer({7.9}, {1.0, 3.0, 3.0, 1.0})).encirclements, 0);
  const NyquistData twice = nyquist_of(transfer({8.1}, {1.0, 3.0, 3.0, 1.0}));
  EXPECT_EQ(twice.encirclements, 2);
  EXPECT_EQ(twice.closed_loop_unstable, 2);
  // K = 8 passes through -1.
  const NyquistData border = nyquist_of(transfer({8.0}, {1.0, 3.0, 3.0, 1.0}));
  EXPECT_FALSE(border.encirclements.has_value());
  EXPECT_LE(border.distance, 1e-12);
  EXPECT_NEAR(border.distance_frequency, std::sqrt(3.0), 1e-6);
  // 2/(s - 1): once against the clock, and stable.
  const NyquistData unstable = nyquist_of(transfer({2.0}, {1.0, -1.0}));
  EXPECT_EQ(unstable.encirclements, -1);
  EXPECT_EQ(unstable.open_loop_unstable, 1);
  EXPECT_EQ(unstable.closed_loop_unstable, 0);
  // A gain of -2 is around -1 nowhere: its loop is static and has no poles.
  EXPECT_EQ(nyquist_of(transfer({-2.0}, {1.0})).encirclements, 0);
}

// Integrators and undamped modes are passed to the right.
TEST(Nyquist, Indents) {
  const NyquistData one = nyquist_of(transfer({1.0}, {1.0, 1.0, 0.0}));
  EXPECT_EQ(one.closed_loop_unstable, 0);
  ASSERT_EQ(one.indentations.size(), 1U);
  EXPECT_EQ(one.indentations[0].multiplicity, 1);
  // The arc is a quarter of a circle at infinity from the real axis down.
  const Index last = one.indentations[0].last;
  EXPECT_EQ(one.indentations[0].first, 0);
  EXPECT_GE(one.value(0).real(), 100.0);
  EXPECT_NEAR(one.value(0).imag() / one.value(0).real(), 0.0, 1e-9);
  EXPECT_NEAR(std::arg(one.value(last)), -0.5 * std::numbers::pi, 0.1);
  // (s + 1)/s² is stable, 1/s² on the border, (1 - s)/s² and 1/(s² (s + 1)) are not.
  EXPECT_EQ(nyquist_of(transfer({1.0, 1.0}, {1.0, 0.0, 0.0})).closed_loop_unstable, 0);
  EXPECT_FALSE(nyquist_of(transfer({1.0}, {1.0, 0.0, 0.0})).encirclements.has_value());
  EXPECT_EQ(nyquist_of(transfer({-1.0, 1.0}, {1.0, 0.0, 0.0})).closed_loop_unstable, 2);
  EXPECT_EQ(nyquist_of(transfer({1.0}, {1.0, 1.0, 0.0, 0.0})).closed_loop_unstable, 2);
  // An undamped mode of its own: s/(s² + 4) damps it, -s/(s² + 4) drives it.
  const NyquistData damped = nyquist_of(transfer({1.0, 0.0}, {1.0, 0.0, 4.0}));
  EXPECT_EQ(damped.closed_loop_unstable, 0);
  ASSERT_EQ(damped.indentations.size(), 1U);
  EXPECT_EQ(damped.indentations[0].frequency, 2.0);
  EXPECT_EQ(nyquist_of(transfer({-1.0, 0.0}, {1.0, 0.0, 4.0})).closed_loop_unstable, 2);
}

TransferFunction random_loop(Random& random, bool discrete, bool on_axis) {
  const auto roots = [&](Index count, bool axis) {
    Eigen::VectorXcd all(count);
    for (Index k = 0; k < count;) {
      const bool pair = k + 1 < count && random.uniform() < 0.6;
      const double size =
          discrete ? 1.3 * random.uniform() : std::pow(10.0, 4.0 * random.uniform() - 2.0);
      const double sign = random.uniform() < 0.8 ? -1.0 : 1.0;
      Complex r = pair ? std::polar(size, std::numbers::pi * random.uniform())
                       : Complex(discrete ? 2.0 * random.uniform() - 1.0 : size, 0.0);
      if (!discrete) {
        r.real(sign * std::abs(r.real()));
      }
      if (axis && random.uniform() < 0.3) {
        r = discrete ? Complex(1.0) : Complex(0.0);
        if (pair) {
          r = discrete ? std::polar(1.0, 0.1 + 2.9 * random.uniform()) : Complex(0.0, size);
        }
      }
      all(k) = r;
      if (pair) {
        all(k + 1) = std::conj(r);
      }
      k += pair ? 2 : 1;
    }
    return all;
  };
  const auto n = static_cast<Index>(1 + random.bits() % 8);
  const auto m = static_cast<Index>(random.bits() % static_cast<std::uint64_t>(n + 1));
  return TransferFunction::from_zeros(roots(m, false), roots(n, on_axis),
                                      random.normal() * std::pow(10.0, 2.0 * random.uniform()),
                                      discrete ? std::optional(Time(0.1)) : std::nullopt)
      .value();
}

// The count is that of the closed loop's poles less the open loop's, which are found on another
// way.
TEST(Nyquist, CountIsThatOfTheClosedLoopsPoles) {
  Random random(31);
  const char* many = std::getenv("FLYBALL_TEST_RUNS");
  const int runs = many != nullptr ? std::atoi(many) : 600;
  int encircled = 0;
  for (int i = 0; i < runs; ++i) {
    const bool discrete = i % 3 == 2;
    const TransferFunction L = random_loop(random, discrete, i % 2 == 0);
    const auto closed = unity_feedback(L);
    if (!closed) {
      continue;
    }
    int unstable = 0;
    double nearest = 1.0;
    const Eigen::VectorXcd poles = closed->poles().value();
    for (const Complex pole : poles) {
      const double beyond = discrete ? std::abs(pole) - 1.0 : pole.real() / std::abs(pole);
      unstable += beyond > 0.0 ? 1 : 0;
      nearest = std::min(nearest, std::abs(beyond));
    }
    const NyquistData data = nyquist_of(L);
    if (!data.encirclements) {
      EXPECT_LE(nearest, 1e-9) << i;
      continue;
    }
    EXPECT_EQ(*data.closed_loop_unstable, unstable) << i;
    encircled += *data.encirclements != 0 ? 1 : 0;
  }
  EXPECT_GE(encircled, runs / 4);
}

// Dead time: as many as `loop_margins` finds by the crossings of the axis as the delay grows.
TEST(Nyquist, DeadTime) {
  Random random(32);
  int unstable = 0;
  for (int i = 0; i < 200; ++i) {
    const TransferFunction rational = random_loop(random, false, false);
    if (rational.relative_degree() == 0) {
      continue;
    }
    const double T = std::pow(10.0, 2.0 * random.uniform() - 1.5);
    const auto L =
        TransferFunction::create(rational.num(), rational.den(), std::nullopt, Time(T)).value();
    const auto margins = loop_margins(L).value();
    const NyquistData data = nyquist_of(L);
    ASSERT_TRUE(data.closed_loop_unstable.has_value());
    EXPECT_EQ(*data.closed_loop_unstable, margins.unstable_poles) << i;
    unstable += margins.unstable_poles > 2 ? 1 : 0;
  }
  EXPECT_GE(unstable, 10);
  // A gain of one at infinity with a delay behind it: unstable poles without end.
  EXPECT_FALSE(nyquist_of(transfer({2.0, 1.0}, {1.0, 1.0}, 0.1)).closed_loop_unstable.has_value());
  EXPECT_EQ(nyquist_of(transfer({0.5, 1.0}, {1.0, 1.0}, 0.1)).closed_loop_unstable, 0);
}

// A state space loop is counted as its transfer function is.
TEST(Nyquist, OfStates) {
  Random random(33);
  for (int i = 0; i < 100; ++i) {
    const TransferFunction L = random_loop(random, i % 2 == 0, i % 3 == 0);
    const auto s = L.to_state_space();
    const auto response =
        i % 2 == 0 ? frequency_response(DiscreteSystem<>{s.A, s.B, s.C, s.D, Time(0.1)}).value()
                   : frequency_response(s).value();
    EXPECT_EQ(nyquist(response).value().encirclements, nyquist_of(L).encirclements) << i;
  }
}

TEST(Nyquist, Refuses) {
  const ContinuousSystem<> two{Eigen::MatrixXd::Identity(2, 2), Eigen::MatrixXd::Identity(2, 2),
                               Eigen::MatrixXd::Identity(2, 2), Eigen::MatrixXd::Zero(2, 2)};
  EXPECT_EQ(to_string(nyquist(frequency_response(two).value()).error()),
            "nyquist: the loop is 2 x 2; it must be of one input and one output; close all loops "
            "but one, or take one entry");
}

}  // namespace
}  // namespace flyball::classical::nyquist_test
