#include <flyball/classical/describing_function.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/classical/discretization_error.hpp>

#include "classical/transfer_cases.hpp"

namespace flyball::classical::describing_function_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXd;
using flyball::test::transfer;

constexpr double pi = std::numbers::pi;

/// The nonlinearity itself, with the memory that hysteresis and backlash have.
class Element {
 public:
  explicit Element(const Nonlinearity& n) : n_(n) {}
  double operator()(double x) {
    switch (n_.kind) {
      case NonlinearityKind::saturation:
        return n_.slope * std::clamp(x, -n_.width, n_.width);
      case NonlinearityKind::dead_zone:
        return n_.slope * (x - std::clamp(x, -n_.width, n_.width));
      case NonlinearityKind::relay:
        return x > 0.0 ? n_.height : -n_.height;
      case NonlinearityKind::hysteresis:
        memory_ = x > n_.width ? 1.0 : x < -n_.width ? -1.0 : memory_;
        return n_.height * memory_;
      case NonlinearityKind::backlash:
        break;
    }
    memory_ = std::clamp(memory_, x - n_.width, x + n_.width);
    return n_.slope * memory_;
  }

 private:
  Nonlinearity n_;
  double memory_ = 0.0;
};

const Nonlinearity all_kinds[] = {{NonlinearityKind::saturation, 0.7, 2.0, 1.0},
                                  {NonlinearityKind::dead_zone, 0.7, 2.0, 1.0},
                                  {NonlinearityKind::relay, 1.0, 1.0, 3.0},
                                  {NonlinearityKind::hysteresis, 0.7, 1.0, 3.0},
                                  {NonlinearityKind::backlash, 0.7, 2.0, 1.0}};

// The closed forms are the first Fourier coefficient of what the element makes of a sine.
TEST(DescribingFunction, IsTheFirstHarmonic) {
  constexpr int samples = 200'000;
  for (const Nonlinearity& n : all_kinds) {
    for (const double a : {0.75, 1.0, 1.6, 5.0}) {
      Element element(n);
      Complex sum = 0.0;
      for (int k = -samples; k < samples; ++k) {  // the first turn sets the memory
        const double t = 2.0 * pi * (k + 0.5) / samples;
        const double y = element(a * std::sin(t));
        sum += k >= 0 ? y * Complex(std::sin(t), std::cos(t)) : 0.0;
      }
      const Complex expected = 2.0 / (a * samples) * sum;
      const auto N = describing_function(n, a).value();
      ASSERT_TRUE(N.has_value());
      EXPECT_LE(std::abs(*N - expected), 1e-4) << to_string(n.kind) << " " << a;
    }
  }
  // Below their widths: as without it, nothing, and no answer at all.
  EXPECT_EQ(describing_function(all_kinds[0], 0.5).value(), Complex(2.0));
  EXPECT_EQ(describing_function(all_kinds[1], 0.5).value(), Complex(0.0));
  EXPECT_FALSE(describing_function(all_kinds[3], 0.5).value().has_value());
  EXPECT_FALSE(describing_function(all_kinds[4], 0.5).value().has_value());
}

// 1/(s (s + 1)²) lags by 180° at 1 rad/s, where it is 1/2: a relay of height M oscillates with
// 4M/(πa)/2 = 1, a = 2M/π.
TEST(LimitCycles, OfARelay) {
  const auto L = frequency_response(transfer({1.0}, {1.0, 2.0, 1.0, 0.0})).value();
  const auto cycles = limit_cycles(L, {.kind = NonlinearityKind::relay, .height = 3.0}).value();
  ASSERT_EQ(cycles.size(), 1U);
  EXPECT_NEAR(cycles[0].frequency, 1.0, 1e-9);
  EXPECT_NEAR(cycles[0].amplitude, 6.0 / pi, 1e-9);
  EXPECT_TRUE(cycles[0].stable);
  // A saturation needs a gain of more than two; then it has one as well, a dead zone an unstable
  // one.
  EXPECT_TRUE(
      limit_cycles(L, {.kind = NonlinearityKind::saturation, .slope = 1.9}).value().empty());
  const auto saturated =
      limit_cycles(L, {.kind = NonlinearityKind::saturation, .slope = 4.0}).value();
  ASSERT_EQ(saturated.size(), 1U);
  EXPECT_TRUE(saturated[0].stable);
  EXPECT_NEAR(describing_function({.kind = NonlinearityKind::saturation, .slope = 4.0},
                                  saturated[0].amplitude)
                  .value()
                  ->real(),
              2.0, 1e-9);
  const auto dead = limit_cycles(L, {.kind = NonlinearityKind::dead_zone, .slope = 4.0}).value();
  ASSERT_EQ(dead.size(), 1U);
  EXPECT_FALSE(dead[0].stable);
}

/// The loop of an element and num/den, from a small push; amplitude and frequency of the last
/// turns.
std::pair<double, double> simulated(const TransferFunction& L, const Nonlinearity& n,
                                    double predicted) {
  const auto s = L.to_state_space();
  Element element(n);
  VectorXd x = VectorXd::Zero(s.A.rows());
  x(x.size() - 1) = 1.3 * predicted / s.C.cwiseAbs().maxCoeff();
  const double h = 2e-4;
  double amplitude = 0.0;
  double last_crossing = 0.0;
  double period_sum = 0.0;
  int turns = 0;
  double before = 0.0;
  for (int k = 0; k < 600'000; ++k) {
    const double e = -(s.C * x)(0);
    const double u = element(e);
    const VectorXd k1 = s.A * x + s.B * u;
    const VectorXd k2 = s.A * (x + 0.5 * h * k1) + s.B * u;
    x += h * k2;
    if (k > 400'000) {
      amplitude = std::max(amplitude, std::abs(e));
      if (before < 0.0 && e >= 0.0) {
        if (last_crossing > 0.0) {
          period_sum += k * h - last_crossing;
          ++turns;
        }
        last_crossing = k * h;
      }
    }
    before = e;
  }
  return {amplitude, 2.0 * pi * turns / period_sum};
}

// The prediction against the loop in time: the low pass of third order leaves a few percent.
TEST(LimitCycles, AreThoseOfTheSimulation) {
  const TransferFunction L = transfer({4.0}, {1.0, 2.0, 1.0, 0.0});
  const auto response = frequency_response(L).value();
  for (const Nonlinearity& n :
       {Nonlinearity{.kind = NonlinearityKind::saturation, .width = 0.5, .slope = 1.5},
        Nonlinearity{.kind = NonlinearityKind::relay, .height = 0.5},
        Nonlinearity{.kind = NonlinearityKind::hysteresis, .width = 0.2, .height = 0.5}}) {
    const auto cycles = limit_cycles(response, n).value();
    ASSERT_EQ(cycles.size(), 1U) << to_string(n.kind);
    EXPECT_TRUE(cycles[0].stable);
    const auto [amplitude, frequency] = simulated(L, n, cycles[0].amplitude);
    EXPECT_NEAR(amplitude / cycles[0].amplitude, 1.0, 0.06) << to_string(n.kind);
    EXPECT_NEAR(frequency / cycles[0].frequency, 1.0, 0.05) << to_string(n.kind);
  }
  // Backlash in a positioning loop: the outer of the two cycles is the one that is seen.
  const Nonlinearity gap{.kind = NonlinearityKind::backlash, .width = 0.3};
  const TransferFunction servo = transfer({1.2}, {1.0, 1.0, 0.0});
  const auto cycles = limit_cycles(frequency_response(servo).value(), gap).value();
  for (const LimitCycle& cycle : cycles) {
    const Complex N = **describing_function(gap, cycle.amplitude);
    EXPECT_LE(std::abs(1.0 + N * servo.response(cycle.frequency)), 1e-8);
  }
  const auto outer = std::find_if(cycles.begin(), cycles.end(),
                                  [](const LimitCycle& cycle) { return cycle.stable; });
  if (outer != cycles.end()) {
    const auto [amplitude, frequency] = simulated(servo, gap, outer->amplitude);
    EXPECT_NEAR(amplitude / outer->amplitude, 1.0, 0.15);
    EXPECT_NEAR(frequency / outer->frequency, 1.0, 0.15);
  }
}

TEST(LimitCycles, Refuses) {
  const auto L = frequency_response(transfer({1.0}, {1.0, 1.0})).value();
  EXPECT_TRUE(limit_cycles(L, {.kind = NonlinearityKind::relay, .height = 0.0})
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(describing_function({.width = -1.0}, 1.0).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(describing_function({}, 0.0).error().is(ArgumentError::not_positive));
  EXPECT_EQ(parse_nonlinearity("backlash").value(), NonlinearityKind::backlash);
  EXPECT_EQ(to_string(parse_nonlinearity("realy").error()),
            "describing function: nonlinearity is \"realy\"; it must be one of saturation, "
            "dead-zone, relay, hysteresis, backlash; did you mean \"relay\"?");
}

// A lag of 0.1 s at 100 Hz: hold loses half a period of phase and nothing of the gain at low
// frequencies, the bilinear rule a hundredth of either, Euler's rules a twentieth.
TEST(CompareDiscretizations, OfALag) {
  const auto lag = transfer({10.0}, {1.0, 10.0}).to_state_space();
  const auto w = VectorXd::LinSpaced(50, 0.5, 25.0);
  const auto all = compare_discretizations(lag, Time(0.01), w).value();
  ASSERT_EQ(all.methods.size(), 6U);
  double before = 0.0;
  for (const DiscretizedResponse& made : all.methods) {
    EXPECT_GE(made.largest_error, before);
    before = made.largest_error;
    EXPECT_TRUE(made.stable);
    if (made.method == ConversionMethod::zoh) {
      EXPECT_NEAR(made.phase_error(49), -0.5 * 0.01 * 25.0 * 180.0 / pi, 0.2);
    }
    if (made.method == ConversionMethod::tustin) {
      // s = (2/T) j tan(ωT/2)
      const Complex s(0.0, 200.0 * std::tan(0.125));
      EXPECT_LE(std::abs(made.response(49) - 10.0 / (s + 10.0)), 1e-12);
      EXPECT_LE(made.largest_error, 0.01);
    }
  }
  EXPECT_EQ(all.methods.front().method == ConversionMethod::foh ||
                all.methods.front().method == ConversionMethod::tustin,
            true);
  // Forward Euler loses a pole beyond 2/T.
  const auto fast =
      compare_discretizations(transfer({300.0}, {1.0, 300.0}).to_state_space(), Time(0.01)).value();
  EXPECT_EQ(fast.frequency.size(), 200);
  for (const DiscretizedResponse& made : fast.methods) {
    EXPECT_EQ(made.stable, made.method != ConversionMethod::forward_euler);
  }
  EXPECT_TRUE(compare_discretizations(lag, Time(0.0)).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(compare_discretizations(lag, Time(0.01), VectorXd::Constant(1, 400.0))
                  .error()
                  .is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::classical::describing_function_test
