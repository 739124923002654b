#include <flyball/classical/partial_fractions.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/systems/response.hpp>

#include "classical/transfer_cases.hpp"

namespace flyball::classical::partial_fractions_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using flyball::test::transfer;

/// |Σ terms| must not be small beside the terms where rounding of them is not to count.
double size_of(const PartialFractions& fractions, Complex s) {
  double size = 0.0;
  Complex power = 1.0;
  for (Index i = fractions.polynomial.size(); i-- > 0;) {
    size += std::abs(fractions.polynomial(i) * power);
    power *= s;
  }
  for (const PartialFraction& fraction : fractions.fractions) {
    power = 1.0;
    for (const Complex& residue : fraction.residues) {
      power /= s - fraction.pole;
      size += std::abs(residue * power);
    }
  }
  return size;
}

Complex value(const VectorXd& p, Complex s) {
  Complex sum = 0.0;
  for (const double c : p) {
    sum = sum * s + c;
  }
  return sum;
}

// num/den of random degrees, improper ones too, is the sum of its fractions.
TEST(PartialFractions, AddUpOfCoefficients) {
  Random random(101);
  double worst = 0.0;
  int improper = 0;
  for (int trial = 0; trial < 6000; ++trial) {
    const auto n = static_cast<Index>(1 + random.bits() % 6);
    const auto m = static_cast<Index>(random.bits() % (n + 3));
    VectorXd den(n + 1);
    VectorXd num(m + 1);
    for (double& c : den) {
      c = random.normal();
    }
    for (double& c : num) {
      c = random.normal();
    }
    const auto found = partial_fractions(num, den).value();
    improper += m >= n ? 1 : 0;
    EXPECT_EQ(found.polynomial.size(), std::max<Index>(0, m - n + 1));
    for (const Complex& s : {Complex(0.3, 1.7), Complex(-0.4, 0.6), Complex(2.0, 0.0)}) {
      const Complex d = value(den, s);
      VectorXd terms = den.cwiseAbs();
      const double near_a_pole = value(terms, std::abs(s)).real() / std::abs(d);
      const double error = std::abs(found.at(s) - value(num, s) / d);
      worst = std::max(worst, error / (size_of(found, s) * near_a_pole));
    }
  }
  EXPECT_LE(worst, 1e-11);
  EXPECT_GE(improper, 1000);
}

// Of roots that are given, repeated ones too.
TEST(PartialFractions, AddUpOfRoots) {
  Random random(7);
  double worst = 0.0;
  int repeated = 0;
  for (int trial = 0; trial < 6000; ++trial) {
    const auto make = [&](Index most) {
      std::vector<Complex> roots;
      while (static_cast<Index>(roots.size()) + 1 < most) {
        const Complex r = random.bits() % 2 == 0
                              ? Complex(-std::exp(random.normal()), 0.0)
                              : std::polar(std::exp(0.5 * random.normal()), 1.2 + random.uniform());
        const int times = random.bits() % 4 == 0 ? 2 + static_cast<int>(random.bits() % 2) : 1;
        for (int k = 0; k < times; ++k) {
          roots.push_back(r);
          if (r.imag() != 0.0) {
            roots.push_back(std::conj(r));
          }
        }
        repeated += times > 1 ? 1 : 0;
      }
      return VectorXcd(Eigen::Map<const VectorXcd>(roots.data(), static_cast<Index>(roots.size())));
    };
    const auto G =
        ZeroPoleGain::create(make(static_cast<Index>(random.bits() % 6)),
                             make(static_cast<Index>(2 + random.bits() % 7)), random.normal())
            .value();
    const auto found = partial_fractions(G).value();
    for (const Complex& s : {Complex(0.9, 1.1), Complex(3.0, -0.2)}) {
      const Complex expected = G.at(s).value();
      worst = std::max(worst, std::abs(found.at(s) - expected) / size_of(found, s));
    }
  }
  EXPECT_LE(worst, 1e-10);
  EXPECT_GE(repeated, 1000);
}

// 1/((s + 1)³(s + 2)): -1/(s + 2) + 1/(s + 1) - 1/(s + 1)² + 1/(s + 1)³; the coefficients know that
// the pole is triple.
TEST(PartialFractions, RepeatedPolesOfCoefficients) {
  const auto found =
      partial_fractions(VectorXd{{1.0}}, VectorXd{{1.0, 5.0, 9.0, 7.0, 2.0}}).value();
  ASSERT_EQ(found.fractions.size(), 2U);
  const PartialFraction& triple = found.fractions[0];
  EXPECT_NEAR(triple.pole.real(), -1.0, 1e-14);
  ASSERT_EQ(triple.residues.size(), 3);
  EXPECT_LE((triple.residues - VectorXcd{{1.0, -1.0, 1.0}}).norm(), 1e-12);
  EXPECT_LE(std::abs(found.fractions[1].residues(0) + 1.0), 1e-12);
  // A double pair: 1/(s² + 2s + 5)².
  const auto pair =
      partial_fractions(VectorXd{{1.0}}, VectorXd{{1.0, 4.0, 14.0, 20.0, 25.0}}).value();
  ASSERT_EQ(pair.fractions.size(), 2U);
  EXPECT_EQ(pair.fractions[0].residues.size(), 2);
  EXPECT_LE(std::abs(pair.fractions[0].pole - Complex(-1.0, 2.0)), 1e-14);
  EXPECT_LE(std::abs(pair.fractions[0].residues(1) + 1.0 / 16.0), 1e-14);
  EXPECT_LE(std::abs(pair.fractions[0].residues(0) - Complex(0.0, -1.0 / 32.0)), 1e-14);
  // Poles that the coefficients do tell apart stay apart.
  EXPECT_EQ(
      partial_fractions(VectorXd{{1.0}}, VectorXd{{1.0, 2.001, 1.001}}).value().fractions.size(),
      2U);
}

// s³/(s + 2) = s² - 2s + 4 - 8/(s + 2).
TEST(PartialFractions, ImproperOnes) {
  const auto found =
      partial_fractions(VectorXd{{1.0, 0.0, 0.0, 0.0}}, VectorXd{{1.0, 2.0}}).value();
  EXPECT_EQ(found.polynomial, (VectorXd{{1.0, -2.0, 4.0}}));
  EXPECT_EQ(found.fractions[0].residues(0), -8.0);
  const auto roots =
      ZeroPoleGain::create(VectorXcd::Zero(3), VectorXcd::Constant(1, -2.0), 1.0).value();
  EXPECT_EQ(partial_fractions(roots).value().polynomial, found.polynomial);
}

// Table E.1, backwards.
TEST(InverseLaplace, TableE1) {
  const auto text = [](std::initializer_list<double> num, std::initializer_list<double> den,
                       double delay = 0.0) {
    return inverse_laplace(transfer(num, den, delay)).value().text();
  };
  EXPECT_EQ(text({1}, {1}), "δ(t)");
  EXPECT_EQ(text({1}, {1, 0}), "1");
  EXPECT_EQ(text({1}, {1, 0, 0}), "t");
  EXPECT_EQ(text({6}, {1, 0, 0, 0, 0}), "t^3");
  EXPECT_EQ(text({1}, {1, 3}), "e^(-3 t)");
  EXPECT_EQ(text({2}, {1, 0, 4}), "sin(2 t)");
  EXPECT_EQ(text({1, 0}, {1, 0, 4}), "cos(2 t)");
  EXPECT_EQ(text({2}, {1, 2, 5}), "e^(-t) sin(2 t)");
  EXPECT_EQ(text({1, 1}, {1, 2, 5}), "e^(-t) cos(2 t)");
  EXPECT_EQ(text({1}, {1, 2, 1}), "t e^(-t)");
  EXPECT_EQ(text({-2, -1}, {1, 1}), "-2 δ(t) + e^(-t)");
  EXPECT_EQ(text({3}, {1, 1}, 0.5), "3 e^(-(t - 0.5)) from t = 0.5 on");
  EXPECT_EQ(text({0}, {1, 1}), "0");
  EXPECT_EQ(inverse_laplace(ZeroPoleGain::create(VectorXcd::Zero(1), VectorXcd(0), 2.0).value())
                .value()
                .text(),
            "2 δ'(t)");
}

// The impulse response C e^{At}B of random systems, and their step responses.
TEST(InverseLaplace, AgreesWithTheExponential) {
  Random random(55);
  double worst = 0.0;
  for (int trial = 0; trial < 300; ++trial) {
    const auto n = static_cast<Index>(1 + random.bits() % 5);
    VectorXd num(n);
    VectorXd den(n + 1);
    for (double& c : num) {
      c = random.normal();
    }
    for (double& c : den) {
      c = 0.5 + random.uniform();
    }
    const auto G = TransferFunction::create(num, den).value();
    const ContinuousSystem<> s = G.to_state_space();
    const ResponseTimes times{Time(0.1), 40};
    const auto impulse = impulse_response(s, 0, times).value();
    const auto step = step_response(s, 0, times).value();
    const auto g = inverse_laplace(G).value();
    const auto h = step_in_closed_form(G).value();
    for (Index k = 0; k < 40; ++k) {
      const double t = impulse.time(k);
      worst =
          std::max(worst, std::abs(g.value(t) - impulse.y(k, 0)) / impulse.y.cwiseAbs().maxCoeff());
      worst = std::max(worst, std::abs(h.value(t) - step.y(k, 0)) / step.y.cwiseAbs().maxCoeff());
    }
  }
  EXPECT_LE(worst, 1e-9);
  const auto late = inverse_laplace(transfer({1.0}, {1.0, 1.0}, 2.0)).value();
  EXPECT_EQ(late.value(1.9), 0.0);
  EXPECT_NEAR(late.value(3.0), std::exp(-1.0), 1e-15);
}

TEST(PartialFractions, Errors) {
  const VectorXd one = VectorXd::Ones(1);
  EXPECT_TRUE(partial_fractions(VectorXd(0), one).error().is(ArgumentError::empty));
  EXPECT_TRUE(
      partial_fractions(one, VectorXd::Zero(2)).error().is(TransferError::zero_denominator));
  EXPECT_TRUE(
      partial_fractions(VectorXd::Constant(1, NAN), one).error().is(ArgumentError::not_finite));
  const auto sampled = TransferFunction::create(one, VectorXd{{1.0, 0.5}}, Time(0.1)).value();
  EXPECT_TRUE(inverse_laplace(sampled).error().is(TransferError::period_mismatch));
  EXPECT_TRUE(step_in_closed_form(sampled).error().is(TransferError::period_mismatch));
  EXPECT_TRUE(partial_fractions(VectorXd::Zero(1), VectorXd{{1.0, 0.5}}).value().fractions.empty());
}

}  // namespace
}  // namespace flyball::classical::partial_fractions_test
