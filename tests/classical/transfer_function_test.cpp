#include <flyball/classical/transfer_function.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/classical/delay_system.hpp>
#include <flyball/classical/zero_pole_gain.hpp>
#include <flyball/core/random.hpp>

#include "classical/transfer_cases.hpp"
#include "support/oracle.hpp"

namespace flyball::classical::transfer_function_test {
namespace {

using Complex = std::complex<double>;
using Eigen::VectorXd;
using flyball::test::transfer;
using flyball::test::vector_of;

/// The largest distance of a reference root from the nearest found one, relative.
double distance(const Eigen::VectorXcd& found, const nlohmann::json& expected) {
  double worst = 0.0;
  for (const auto& e : expected) {
    const Complex root(e[0].get<double>(), e[1].get<double>());
    double nearest = HUGE_VAL;
    for (const Complex& f : found) {
      nearest = std::min(nearest, std::abs(f - root) / std::max(std::abs(root), 1e-300));
    }
    worst = std::max(worst, root == 0.0 ? found.cwiseAbs().minCoeff() : nearest);
  }
  return worst;
}

TEST(TransferFunction, Gold) {
  int seen = 0;
  for (const auto& c : flyball::test::cases_of("transfer_functions.json")) {
    ++seen;
    const std::string name = c["name"];
    const TransferFunction G = flyball::test::transfer_of(c);
    const auto zeros = G.zeros().value();
    const auto poles = G.poles().value();
    ASSERT_EQ(static_cast<std::size_t>(zeros.size()), c["zeros"].size()) << name;
    ASSERT_EQ(static_cast<std::size_t>(poles.size()), c["poles"].size()) << name;
    EXPECT_LE(distance(zeros, c["zeros"]), 1e-10) << name;
    EXPECT_LE(distance(poles, c["poles"]), 1e-9) << name;
    EXPECT_EQ(G.is_stable().value(), c["stable"].get<bool>()) << name;
    if (c["dcgain"].is_number()) {
      EXPECT_NEAR(G.dc_gain() / c["dcgain"].get<double>(), 1.0, 1e-14) << name;
    } else {
      EXPECT_TRUE(std::isinf(G.dc_gain())) << name;
    }
    for (const auto& row : c["freqresp"]) {
      const Complex expected(row[1].get<double>(), row[2].get<double>());
      EXPECT_LE(std::abs(G.response(row[0].get<double>()) - expected), 1e-12 * std::abs(expected))
          << name << " at " << row[0];
    }
    const TransferFunction closed = unity_feedback(G).value();
    EXPECT_LE(distance(closed.poles().value(), c["unity_feedback"]["poles"]), 1e-9) << name;
  }
  EXPECT_EQ(seen, 13);
}

TEST(TransferFunction, BlockDiagrams) {
  for (const auto& c : flyball::test::cases_of("interconnection.json")) {
    const TransferFunction G = flyball::test::transfer_of(c["G"]);
    const TransferFunction H = flyball::test::transfer_of(c["H"]);
    for (const double w : {0.01, 0.3, 1.0, 20.0, 1000.0}) {
      const Complex g = G.response(w);
      const Complex h = H.response(w);
      const auto expect = [&](const Expected<TransferFunction>& made, Complex value) {
        EXPECT_LE(std::abs(made.value().response(w) - value), 1e-11 * std::abs(value)) << w;
      };
      expect(series(G, H), g * h);
      expect(parallel(G, H), g + h);
      expect(feedback(G, H), g / (1.0 + g * h));
      expect(feedback(G, H, false), g / (1.0 - g * h));
      expect(unity_feedback(G), g / (1.0 + g));
    }
  }
}

TEST(TransferFunction, Pade) {
  for (const auto& c : flyball::test::cases_of("pade.json")) {
    const TransferFunction P = pade(Time(c["T"].get<double>()), c["n"].get<int>()).value();
    const VectorXd num = vector_of(c["num"]);
    const VectorXd den = vector_of(c["den"]);
    const double scale = P.den()(P.den().size() - 1) / den(den.size() - 1);
    EXPECT_LE((P.num() / scale - num).cwiseQuotient(num).cwiseAbs().maxCoeff(), 1e-14);
    EXPECT_LE((P.den() / scale - den).cwiseQuotient(den).cwiseAbs().maxCoeff(), 1e-14);
  }
  // Of order n it is e^{-sT} up to the power 2n of s.
  for (int n = 1; n <= 20; ++n) {
    const double error = std::abs(pade(Time(1.0), n).value().response(0.5) - std::polar(1.0, -0.5));
    EXPECT_LE(error, std::max(4e-15, std::pow(0.5, 2 * n + 1))) << n;
  }
  EXPECT_EQ(pade(Time(0.0), 5).value().order(), 0);
  EXPECT_TRUE(pade(Time(1.0), 21).error().is(ArgumentError::out_of_range));
}

// Zeros, poles and gain back: G evaluated is the product of its factors.
TEST(TransferFunction, FromZerosToZeros) {
  Random random(5);
  for (int i = 0; i < 300; ++i) {
    const auto pairs = static_cast<Eigen::Index>(1 + random.bits() % 6);
    Eigen::VectorXcd poles(2 * pairs);
    Eigen::VectorXcd zeros(2 * (pairs / 2));
    for (Eigen::VectorXcd* roots : {&poles, &zeros}) {
      for (Eigen::Index k = 0; k + 1 < roots->size(); k += 2) {
        const double size = std::pow(10.0, 4.0 * random.uniform() - 2.0);
        (*roots)(k) = std::polar(size, 1.6 + 1.5 * random.uniform());
        (*roots)(k + 1) = std::conj((*roots)(k));
      }
    }
    const double gain = random.normal();
    const auto G = TransferFunction::from_zeros(zeros, poles, gain).value();
    for (const double w : {0.01, 0.5, 3.0, 70.0}) {
      Complex expected = gain;
      for (const Complex& z : zeros) {
        expected *= Complex(0.0, w) - z;
      }
      for (const Complex& p : poles) {
        expected /= Complex(0.0, w) - p;
      }
      EXPECT_LE(std::abs(G.response(w) - expected), 1e-10 * std::abs(expected));
      EXPECT_LE(std::abs(G.at(Complex(0.0, w)).value() - expected), 1e-10 * std::abs(expected));
      const auto s = G.to_state_space();
      EXPECT_LE(
          std::abs(flyball::test::response(s.A, s.B, s.C, s.D, Complex(0.0, w))(0, 0) - expected),
          1e-8 * std::abs(expected));
    }
    for (const Complex& p : poles) {
      EXPECT_LE((G.poles().value().array() - p).abs().minCoeff(), 1e-8 * std::abs(p));
    }
  }
}

// What vanishes above and below at s = 0, or z = 1, cancels.
TEST(TransferFunction, DcGainOfWhatCancels) {
  EXPECT_EQ(transfer({3.0, 0.0}, {1.0, 2.0, 0.0}).dc_gain(), 1.5);
  EXPECT_EQ(transfer({3.0, 0.0, 0.0}, {1.0, 2.0, 0.0}).dc_gain(), 0.0);
  EXPECT_EQ(transfer({-3.0, 0.0}, {1.0, 2.0, 0.0, 0.0}).dc_gain(), -HUGE_VAL);
  const auto sampled = [](const VectorXd& num, const VectorXd& den) {
    return TransferFunction::create(num, den, Time(0.1)).value().dc_gain();
  };
  // (z - 1)/((z - 1)(z - 1/2)), and without the zero.
  EXPECT_DOUBLE_EQ(sampled(Eigen::Vector2d(1.0, -1.0), Eigen::Vector3d(1.0, -1.5, 0.5)), 2.0);
  EXPECT_EQ(sampled(VectorXd::Ones(1), Eigen::Vector3d(1.0, -1.5, 0.5)), HUGE_VAL);
  EXPECT_EQ(sampled(Eigen::Vector2d(1.0, -1.0), Eigen::Vector2d(1.0, -0.5)), 0.0);
}

// (z - 1)(z - 0.9) and (s² + 3)(s + 0.7): multiplied out in doubles the poles are beside the border
// by rounding, on either side of it.
TEST(TransferFunction, APoleOnTheBorderStaysThere) {
  for (const double a : {0.9, 0.7, 0.3, 0.123, -0.4, 0.99}) {
    const Eigen::Vector3d den(1.0, -1.0 - a, a);
    const auto G = TransferFunction::create(VectorXd::Ones(1), den, Time(0.02)).value();
    EXPECT_FALSE(G.is_stable().value()) << a;
    EXPECT_TRUE((G.poles().value().array() == 1.0).any()) << a;
    const auto H = transfer({1.0}, {1.0, a + 0.5, 3.0, 3.0 * (a + 0.5)});
    EXPECT_FALSE(H.is_stable().value()) << a;
  }
  // What the coefficients do tell.
  EXPECT_TRUE(
      TransferFunction::create(VectorXd::Ones(1), Eigen::Vector2d(1.0, -1.0 + 1e-12), Time(1.0))
          .value()
          .is_stable()
          .value());
  EXPECT_TRUE(transfer({1.0}, {1.0, 1e-12, 1.0}).is_stable().value());
}

TEST(TransferFunction, DeadTimeIsExact) {
  const auto G = transfer({2.0}, {1.0, 1.0}, 0.3);
  EXPECT_LE(std::abs(G.response(5.0) - 2.0 / Complex(1.0, 5.0) * std::polar(1.0, -1.5)), 1e-15);
  EXPECT_EQ(series(G, G).value().delay(), 0.6);
  EXPECT_TRUE(feedback(G, G).error().is(TransferError::delay_in_loop));
  EXPECT_TRUE(parallel(G, transfer({1.0}, {1.0, 1.0})).error().is(TransferError::delay_in_loop));
  const auto z =
      TransferFunction::create(VectorXd::Ones(1), Eigen::Vector2d(1.0, -0.5), Time(0.1), Time(0.2))
          .value();
  EXPECT_LE(std::abs(z.response(3.0) - std::polar(1.0, -0.6) / (std::polar(1.0, 0.3) - 0.5)),
            1e-15);
}

TEST(TransferFunction, Refusals) {
  const VectorXd one = VectorXd::Ones(1);
  const auto made = [](const VectorXd& num, const VectorXd& den) {
    return TransferFunction::create(num, den);
  };
  EXPECT_TRUE(made(one, VectorXd::Zero(3)).error().is(TransferError::zero_denominator));
  EXPECT_TRUE(made(VectorXd(0), one).error().is(ArgumentError::empty));
  EXPECT_TRUE(made(Eigen::Vector2d(1.0, 0.0), one).error().is(TransferError::improper));
  EXPECT_TRUE(made(Eigen::Vector2d(0.0, 2.0), one).has_value());
  EXPECT_TRUE(made(one, Eigen::Vector2d(1.0, NAN)).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(
      TransferFunction::create(one, one, Time(0.0)).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(TransferFunction::create(one, one, std::nullopt, Time(-1.0)).has_value() == false);
  EXPECT_TRUE(TransferFunction::create(one, one, Time(0.1), Time(0.15))
                  .error()
                  .is(ArgumentError::out_of_range));
  const auto G = transfer({1.0}, {1.0, 1.0});
  const auto D = TransferFunction::create(one, Eigen::Vector2d(1.0, -0.5), Time(0.1)).value();
  EXPECT_TRUE(series(G, D).error().is(TransferError::period_mismatch));
  EXPECT_TRUE(unity_feedback(transfer({-1.0}, {1.0})).error().is(TransferError::algebraic_loop));
  EXPECT_TRUE(G.at(-1.0).error().is(TransferError::at_a_pole));
  Eigen::VectorXcd lonely(1);
  lonely << Complex(-1.0, 2.0);
  EXPECT_TRUE(TransferFunction::from_zeros(Eigen::VectorXcd(0), lonely, 1.0)
                  .error()
                  .is(ArgumentError::malformed));
}

// A delay between nothing and one period, of periods that cannot be counted, and next to whole
// ones.
TEST(TransferFunction, DelayOfADiscreteOneIsWholePeriods) {
  const VectorXd one = VectorXd::Ones(1);
  const VectorXd den = Eigen::Vector2d(1.0, -0.5);
  const Eigen::VectorXcd poles = Eigen::VectorXcd::Constant(1, 0.5);
  for (const auto& [delay, period] : {std::pair{5e-324, 100.0},
                                      {1e-320, 0.02},
                                      {1e-12, 1.0},
                                      {0.5, 1.0},
                                      {1.0 + 1e-6, 1.0},
                                      {1e300, 1e-300},
                                      {1e308, 0.01},
                                      {2e9, 1.0}}) {
    const auto refused = [](const auto& made) {
      return !made && made.error().is(ArgumentError::out_of_range);
    };
    EXPECT_TRUE(refused(TransferFunction::create(one, den, Time(period), Time(delay)))) << delay;
    EXPECT_TRUE(
        refused(ZeroPoleGain::create(Eigen::VectorXcd(0), poles, 1.0, Time(period), Time(delay))))
        << delay;
    const auto rational =
        DelaySystem::create(TransferFunction::create(one, den, Time(period)).value()).value();
    EXPECT_TRUE(refused(rational.with_input_delays(VectorXd::Constant(1, delay)))) << delay;
    EXPECT_TRUE(refused(rational.with_output_delays(VectorXd::Constant(1, delay)))) << delay;
  }
  const auto near = TransferFunction::create(one, den, Time(0.1), Time(0.3 + 1e-12)).value();
  const auto states = DelaySystem::create(near).value().to_discrete().value();
  EXPECT_EQ(states.A.rows(), 4);
  for (const double w : {0.1, 3.0, 30.0}) {
    const Complex z = std::polar(1.0, 0.1 * w);
    const Complex expected = 1.0 / ((z - 0.5) * z * z * z);
    EXPECT_LE(std::abs(flyball::test::response(states.A, states.B, states.C, states.D, z)(0, 0) -
                       expected),
              1e-14 * std::abs(expected));
  }
  EXPECT_EQ(to_string(TransferFunction::create(one, den, Time(1.0), Time(1.5)).error()),
            "transfer function: delay is 1.5 periods; it must be whole periods, for a discrete "
            "transfer function");
  EXPECT_EQ(to_string(TransferFunction::create(one, den, Time(1.0), Time(2e9)).error()),
            "transfer function: delay is 2000000000 periods; it must be at most 1000000000 "
            "periods");
}

}  // namespace
}  // namespace flyball::classical::transfer_function_test
