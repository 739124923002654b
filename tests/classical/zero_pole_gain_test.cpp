#include <flyball/classical/zero_pole_gain.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/classical/delay_poles.hpp>
#include <flyball/core/random.hpp>
#include <flyball/systems/interconnection.hpp>
#include <flyball/systems/system_error.hpp>

#include "classical/transfer_cases.hpp"

namespace flyball::classical::zero_pole_gain_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using flyball::test::transfer;

VectorXcd roots(std::initializer_list<Complex> values) {
  return Eigen::Map<const VectorXcd>(values.begin(), static_cast<Index>(values.size()));
}

ZeroPoleGain zpk(std::initializer_list<Complex> zeros, std::initializer_list<Complex> poles,
                 double gain) {
  return ZeroPoleGain::create(roots(zeros), roots(poles), gain).value();
}

VectorXcd random_roots(Random& random, Index count, double decades) {
  VectorXcd r(count);
  for (Index i = 0; i < count;) {
    const double size = std::pow(10.0, decades * (random.uniform() - 0.5));
    if (i + 1 < count && random.bits() % 2 == 0) {
      r(i) = std::polar(size, 3.0 * random.uniform() + 0.05);
      r(i + 1) = std::conj(r(i));
      i += 2;
    } else {
      r(i++) = random.bits() % 4 == 0 ? size : -size;
    }
  }
  return r;
}

// Twenty poles over six decades, which coefficients would lose: the sections' poles are those that
// were given. Over two decades their response is, too.
TEST(ZeroPoleGain, SectionsKeepEveryFactor) {
  Random random(12);
  double worst = 0.0;
  double worst_pole = 0.0;
  for (int trial = 0; trial < 500; ++trial) {
    const double decades = trial % 2 == 0 ? 6.0 : 2.0;
    const auto n = static_cast<Index>(1 + random.bits() % 20);
    const auto G = ZeroPoleGain::create(
                       random_roots(random, static_cast<Index>(random.bits() % (n + 1)), decades),
                       random_roots(random, n, decades), random.normal())
                       .value();
    const ContinuousSystem<> s = G.to_state_space().value();
    ASSERT_EQ(s.A.rows(), n);
    const VectorXcd found = rightmost_poles(DelaySystem::create(s).value()).value().poles;
    for (const Complex& pole : found) {
      worst_pole = std::max(
          worst_pole, ((G.poles().array() - pole).abs() / G.poles().array().abs()).minCoeff());
    }
    for (int i = 0; i < 3; ++i) {
      const double w = std::pow(10.0, decades * (random.uniform() - 0.5));
      Complex expected = G.gain();
      for (const Complex& z : G.zeros()) {
        expected *= Complex(0.0, w) - z;
      }
      for (const Complex& p : G.poles()) {
        expected /= Complex(0.0, w) - p;
      }
      EXPECT_LE(std::abs(G.response(w) - expected), 1e-14 * std::abs(expected));
      EXPECT_LE(std::abs(G.at({0.0, w}).value() - expected), 1e-14 * std::abs(expected));
      const Complex got = transfer_at(s, {0.0, w}).value()(0, 0);
      if (trial % 2 == 1) {
        worst = std::max(worst, std::abs(got - expected) / std::abs(expected));
      }
    }
  }
  EXPECT_LE(worst_pole, 1e-12);
  EXPECT_LE(worst, 1e-8);
}

// (A.1), (A.4) by factors: the roots of products are the roots themselves.
TEST(ZeroPoleGain, ProductsAndQuotientsKeepTheRoots) {
  Random random(5);
  for (int trial = 0; trial < 300; ++trial) {
    const auto make = [&] {
      const auto n = static_cast<Index>(1 + random.bits() % 5);
      return ZeroPoleGain::create(random_roots(random, n - 1, 2.0), random_roots(random, n, 2.0),
                                  random.normal())
          .value();
    };
    const ZeroPoleGain G = make();
    const ZeroPoleGain H = make();
    const auto both = product(G, H).value();
    EXPECT_EQ(both.zeros().head(G.zeros().size()), G.zeros());
    EXPECT_EQ(both.poles().tail(H.poles().size()), H.poles());
    const auto ratio = quotient(G, H).value();
    const auto loop = feedback(G, H).value();
    const auto positive = feedback(G, H, false).value();
    for (const double w : {0.1, 1.3, 20.0}) {
      const Complex g = G.response(w);
      const Complex h = H.response(w);
      EXPECT_LE(std::abs(both.response(w) - g * h), 1e-14 * std::abs(g * h));
      EXPECT_LE(std::abs(ratio.response(w) - g / h), 1e-14 * std::abs(g / h));
      const double size = 1.0 + std::abs(g * h);
      EXPECT_LE(std::abs(loop.response(w) * (1.0 + g * h) - g),
                1e-9 * (std::abs(g) + std::abs(loop.response(w)) * size));
      EXPECT_LE(std::abs(positive.response(w) * (1.0 - g * h) - g),
                1e-9 * (std::abs(g) + std::abs(positive.response(w)) * size));
    }
  }
  EXPECT_FALSE(quotient(zpk({}, {}, 1.0), zpk({}, {-1.0}, 2.0)).value().is_proper());
}

TEST(ZeroPoleGain, OfTransferFunctionsAndBack) {
  const auto G = transfer({2.0, 6.0}, {1.0, 2.0, 5.0}, 0.3);
  const auto factors = ZeroPoleGain::create(G).value();
  EXPECT_EQ(factors.gain(), 2.0);
  EXPECT_LE(std::abs(factors.zeros()(0) + 3.0), 1e-15);
  EXPECT_NEAR(factors.dc_gain(), 1.2, 1e-15);
  EXPECT_EQ(factors.delay(), 0.3);
  EXPECT_LE(std::abs(factors.response(0.8) - G.response(0.8)), 1e-15);
  const auto back = factors.to_transfer_function().value();
  EXPECT_LE((back.den() - G.den()).norm(), 1e-15);
  EXPECT_LE((back.num() - G.num()).norm(), 1e-15);
}

TEST(ZeroPoleGain, GainAtRest) {
  EXPECT_EQ(zpk({0.0}, {-1.0}, 2.0).dc_gain(), 0.0);
  EXPECT_EQ(zpk({-2.0}, {0.0, -1.0}, -2.0).dc_gain(), -INFINITY);
  EXPECT_EQ(zpk({0.0}, {0.0, -4.0}, 2.0).dc_gain(), 0.5);
  const auto discrete = ZeroPoleGain::create(roots({0.5}), roots({0.75}), 3.0, Time(0.1)).value();
  EXPECT_EQ(discrete.dc_gain(), 6.0);
  EXPECT_TRUE(discrete.is_stable());
  EXPECT_TRUE(discrete.is_minimum_phase());
  EXPECT_FALSE(zpk({1.0}, {-1.0}, 1.0).is_minimum_phase());
  EXPECT_FALSE(zpk({-1.0}, {0.0}, 1.0).is_stable());
}

// Nothing is cancelled unless asked, and what is cancelled is told.
TEST(ZeroPoleGain, Cancellation) {
  const auto G = zpk({-1.0000001, {-2.0, 3.0}, {-2.0, -3.0}, -7.0},
                     {-1.0, {-2.0, 3.0000001}, {-2.0, -3.0000001}, -5.0, -5.0}, 3.0);
  EXPECT_TRUE(without_cancellations(G, 0.0).value().cancelled.empty());
  const auto left = without_cancellations(G, 1e-6).value();
  ASSERT_EQ(left.cancelled.size(), 3U);
  EXPECT_FALSE(left.hides_instability);
  EXPECT_EQ(left.cancelled[0].pole, Complex(-2.0, 3.0000001));  // the nearest
  EXPECT_EQ(left.cancelled[1].pole, Complex(-2.0, -3.0000001));
  EXPECT_NEAR(left.cancelled[2].distance, 1e-7, 1e-12);
  EXPECT_EQ(left.transfer.zeros(), roots({-7.0}));
  EXPECT_EQ(left.transfer.poles(), roots({-5.0, -5.0}));
  // One of a double pole.
  const auto once = without_cancellations(zpk({-5.0}, {-5.0, -5.0}, 1.0)).value();
  EXPECT_EQ(once.transfer.poles(), roots({-5.0}));

  const auto unstable = without_cancellations(zpk({1.0}, {1.0, -1.0}, 1.0)).value();
  EXPECT_TRUE(unstable.hides_instability);
  EXPECT_TRUE(unstable.cancelled[0].unstable);
  EXPECT_TRUE(unstable.cancelled[0].nonminimum_phase);
  const auto integrator = without_cancellations(zpk({0.0}, {0.0, -1.0}, 1.0)).value();
  EXPECT_TRUE(integrator.hides_instability);
  EXPECT_FALSE(integrator.cancelled[0].nonminimum_phase);
}

TEST(ZeroPoleGain, Errors) {
  EXPECT_EQ(to_string(ZeroPoleGain::create(roots({}), roots({{-1.0, 2.0}}), 1.0).error()),
            "zero-pole-gain: poles is without the conjugate of -1 + 2j; it must be in pairs of "
            "conjugates: the coefficients are real");
  EXPECT_TRUE(
      ZeroPoleGain::create(roots({NAN}), roots({}), 1.0).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(
      ZeroPoleGain::create(roots({}), roots({}), NAN).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(ZeroPoleGain::create(roots({}), roots({}), 1.0, Time(0.0))
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(ZeroPoleGain::create(roots({}), roots({}), 1.0, Time(0.1), Time(0.25))
                  .error()
                  .is(ArgumentError::out_of_range));
  const auto improper = zpk({-1.0}, {}, 1.0);
  EXPECT_TRUE(improper.to_transfer_function().error().is(TransferError::improper));
  EXPECT_TRUE(improper.to_state_space().error().is(TransferError::improper));
  EXPECT_TRUE(zpk({}, {-1.0}, 1.0).at(-1.0).error().is(TransferError::at_a_pole));
  const auto one = zpk({}, {}, 1.0);
  EXPECT_TRUE(quotient(one, zpk({}, {}, 0.0)).error().is(TransferError::zero_denominator));
  const auto late =
      ZeroPoleGain::create(roots({}), roots({}), 1.0, std::nullopt, Time(1.0)).value();
  EXPECT_TRUE(quotient(one, late).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(feedback(one, late).error().is(TransferError::delay_in_loop));
  const auto sampled = ZeroPoleGain::create(roots({}), roots({}), 1.0, Time(0.1)).value();
  EXPECT_TRUE(product(one, sampled).error().is(TransferError::period_mismatch));
  EXPECT_TRUE(feedback(one, zpk({}, {}, -1.0)).error().is(TransferError::algebraic_loop));
  EXPECT_TRUE(without_cancellations(one, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(without_cancellations(one, -1.0).error().is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::classical::zero_pole_gain_test
