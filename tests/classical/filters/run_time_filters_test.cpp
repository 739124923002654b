#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>

#include <gtest/gtest.h>

#include <flyball/classical/filters/biquad_cascade.hpp>
#include <flyball/classical/filters/debouncer.hpp>
#include <flyball/classical/filters/fir_design.hpp>
#include <flyball/classical/filters/fir_filter.hpp>
#include <flyball/classical/filters/median_filter.hpp>
#include <flyball/classical/filters/simple_filters.hpp>
#include <flyball/classical/filters/slew_rate_limiter.hpp>
#include <flyball/core/random.hpp>

#include "classical/filters/filter_cases.hpp"
#include "support/allocation_count.hpp"

namespace flyball::classical::run_time_filters_test {
namespace {

using namespace flyball::literals;
using std::numbers::pi;
using test::Complex;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

DigitalFilter elliptic(int order = 6) {
  return design_filter({.family = FilterFamily::elliptic,
                        .order = order,
                        .frequency = 40.0,
                        .ripple = 0.5,
                        .attenuation = 60.0},
                       10_ms)
      .value();
}

// After the transient a sine comes out as |H| of it, turned by ∠H: for every family and band, and
// for filters of finite response.
TEST(BiquadCascade, AnswersASineWithTheTransferFunction) {
  Random random(3);
  for (int i = 0; i < 60; ++i) {
    const double low = random.uniform(20.0, 120.0);
    const IirDesign design{.family = static_cast<FilterFamily>(i % 5),
                           .band = test::bands[random.bits() % 4],
                           .order = 1 + static_cast<int>(random.bits() % 8),
                           .frequency = low,
                           .upper_frequency = low * random.uniform(1.3, 2.0),
                           .ripple = random.uniform(0.1, 2.0),
                           .attenuation = random.uniform(20.0, 80.0)};
    const auto filter = design_filter(design, 10_ms).value();
    auto cascade = BiquadCascade<8>::create(filter.sections).value();
    const double w = random.uniform(0.1, 0.95) * pi / 0.01;
    const Complex H = filter.response(w);
    const auto turned = [&](int k) { return std::polar(1.0, w * 0.01 * k); };
    // Transients of the slowest pole are below 1e-10 by then.
    const int settled =
        static_cast<int>(std::log(1e-13) / std::log(filter.poles.cwiseAbs().maxCoeff())) + 50;
    for (int k = 0; k < settled + 20; ++k) {
      const double y = cascade.calculate(turned(k).real());
      if (k >= settled) {
        EXPECT_NEAR(y, (H * turned(k)).real(), 1e-8) << to_string(design.family) << design.order;
      }
    }
  }
}

TEST(BiquadCascade, StartsSteadyWhereItIsTold) {
  auto cascade = BiquadCascade<3>::create(elliptic().sections).value();
  cascade.reset(7.0);
  // The gain at rest of an even order is at the ripple's depth.
  const double steady = 7.0 * std::pow(10.0, -0.5 / 20.0);
  EXPECT_NEAR(cascade.output(), steady, 1e-14);
  for (int k = 0; k < 500; ++k) {
    EXPECT_NEAR(cascade.calculate(7.0), steady, 1e-12);
  }
  cascade.reset();
  EXPECT_EQ(cascade.calculate(0.0), 0.0);
}

// The run-time object, `filter_signal` and SciPy's sosfilt(iirfilter(3, 0.2, output='sos'), x) with
// x_k = sin 0.3k, plus a half each third sample.
TEST(BiquadCascade, AgreesWithSciPy) {
  const auto filter = design_filter({.order = 3, .frequency = 0.2 * pi}, 1_s).value();
  constexpr double expected[] = {0.009049466503757217, 0.04842443997537743, 0.1279381165151336,
                                 0.24939218773825989,  0.4236247904470568,  0.6347277998597092,
                                 0.8400600123445424,   1.0121967152785303,  1.121473113366247,
                                 1.1371106406004803};
  constexpr double steady[] = {0.4999999999999998,  0.49629913391897285, 0.4835536822561872,
                               0.48201618394791085, 0.5369335100665233,  0.657868969012842};
  Eigen::VectorXd x(20);
  for (int k = 0; k < 20; ++k) {
    x(k) = std::sin(0.3 * k) + (k % 3 == 0 ? 0.5 : 0.0);
  }
  auto cascade = BiquadCascade<4>::create(filter.sections).value();
  const auto y = filter_signal(filter.sections, x, FilterStart::rest).value();
  for (int k = 0; k < 10; ++k) {
    EXPECT_NEAR(cascade.calculate(x(k)), expected[k], 1e-15);
    EXPECT_NEAR(y(k), expected[k], 1e-15);
  }
  const auto started = filter_signal(filter.sections, x).value();
  cascade.reset(x(0));
  for (int k = 0; k < 6; ++k) {
    EXPECT_NEAR(started(k), steady[k], 2e-15);
    EXPECT_NEAR(cascade.calculate(x(k)), steady[k], 2e-15);
  }
}

// SciPy 1.10.1: sosfiltfilt of orders 3 and 4, the latter of the signal three times.
TEST(ZeroPhase, AgreesWithSciPyAndIsNotLate) {
  Eigen::VectorXd x(20);
  for (int k = 0; k < 20; ++k) {
    x(k) = std::sin(0.3 * k) + (k % 3 == 0 ? 0.5 : 0.0);
  }
  constexpr double expected[] = {0.49539218296407406, 0.6515003459414919, 0.805002534435041,
                                 0.9460301947524581};
  const auto third = design_filter({.order = 3, .frequency = 0.2 * pi}, 1_s).value();
  const auto y = filter_zero_phase(third.sections, x).value();
  for (int k = 0; k < 4; ++k) {
    EXPECT_NEAR(y(k), expected[k], 1e-14);
  }
  EXPECT_NEAR(y(19), -0.5361361366354107, 1e-14);
  Eigen::VectorXd longer(60);
  longer << x, x, x;
  const auto fourth = design_filter({.order = 4, .frequency = 0.2 * pi}, 1_s).value();
  const auto z = filter_zero_phase(fourth.sections, longer).value();
  EXPECT_NEAR(z(0), 0.5034217873660909, 1e-14);
  EXPECT_NEAR(z(7), 1.012503617353292, 1e-14);
  EXPECT_NEAR(z(30), 0.3075102899013588, 1e-14);
  EXPECT_NEAR(z(59), -0.5424226274422482, 1e-14);

  // A slow sine keeps its phase, times |H|².
  Eigen::VectorXd sine(2000);
  for (int k = 0; k < 2000; ++k) {
    sine(k) = std::sin(0.3 * k);
  }
  const auto smooth = filter_zero_phase(third.sections, sine).value();
  const double gain = std::norm(third.response(0.3));
  for (int k = 500; k < 1500; ++k) {
    EXPECT_NEAR(smooth(k), gain * sine(k), 1e-12);
  }
  // A constant goes through.
  const auto constant = filter_zero_phase(third.sections, Eigen::VectorXd::Constant(50, 3.0));
  EXPECT_LT((*constant - Eigen::VectorXd::Constant(50, 3.0)).cwiseAbs().maxCoeff(), 1e-13);
}

// y_k = 0.5 x_k + 0.25 x_{k-1} - x_{k-2}, by hand.
TEST(FirFilter, WeighsTheLastSamples) {
  auto filter = FirFilter<5>::create(std::array{0.5, 0.25, -1.0}).value();
  EXPECT_EQ(filter.calculate(4.0), 2.0);
  EXPECT_EQ(filter.calculate(8.0), 5.0);
  EXPECT_EQ(filter.calculate(0.0), -2.0);
  EXPECT_EQ(filter.calculate(2.0), -7.0);
  filter.reset(4.0);
  EXPECT_EQ(filter.output(), -1.0);
  EXPECT_EQ(filter.calculate(4.0), -1.0);
}

TEST(FirFilter, HasTheResponseOfItsTaps) {
  const auto taps = design_fir({.taps = 31, .frequency = 60.0}, 10_ms).value();
  auto filter = FirFilter<31>::create(taps).value();
  const double angle = 0.4;
  const Complex H = fir_response(taps, angle);
  for (int k = 0; k < 100; ++k) {
    const double y = filter.calculate(std::cos(angle * k));
    if (k >= 31) {
      EXPECT_NEAR(y, (H * std::polar(1.0, angle * k)).real(), 1e-13);
    }
  }
}

// Against sorting the window anew, with repeated values.
TEST(MedianFilter, IsTheMedian) {
  Random random(9);
  for (int window = 1; window <= 12; ++window) {
    auto filter = MedianFilter<12>::create(window).value();
    std::deque<double> last;
    for (int k = 0; k < 500; ++k) {
      const double x = std::round(random.uniform(-5.0, 5.0));
      last.push_back(x);
      if (static_cast<int>(last.size()) > window) {
        last.pop_front();
      }
      std::vector<double> sorted(last.begin(), last.end());
      std::ranges::sort(sorted);
      const std::size_t n = sorted.size();
      const double median = n % 2 == 1 ? sorted[n / 2] : 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]);
      ASSERT_EQ(filter.calculate(x), median) << window << " " << k;
    }
    filter.reset();
    EXPECT_EQ(filter.calculate(3.0), 3.0);
  }
}

TEST(MedianFilter, ForgetsWildSamples) {
  auto filter = MedianFilter<5>::create().value();
  for (const double x : {1.0, 1.0, 1e9, 1.0, -1e9}) {
    EXPECT_EQ(filter.calculate(x), 1.0);
  }
  EXPECT_EQ(filter.calculate(nan), 1.0);
}

TEST(SlewRateLimiter, FollowsNoFaster) {
  auto limiter = SlewRateLimiter::create({.rising = 2.0, .falling = 4.0}, 0.25, 1.0).value();
  EXPECT_EQ(limiter.output(), 1.0);
  EXPECT_EQ(limiter.calculate(3.0), 1.5);
  EXPECT_EQ(limiter.calculate(3.0), 2.0);
  EXPECT_EQ(limiter.calculate(2.1), 2.1);
  EXPECT_EQ(limiter.calculate(-10.0), 1.1);
  EXPECT_EQ(limiter.calculate(nan), 1.1);
  limiter.reset(5.0);
  EXPECT_EQ(limiter.calculate(5.0), 5.0);
  auto free = SlewRateLimiter::create({}, 0.02).value();
  EXPECT_EQ(free.calculate(1e99), 1e99);
  EXPECT_EQ(free.calculate(-1e99), -1e99);
}

// 0.06 s of 0.02 s: the third sample in a row counts.
TEST(Debouncer, WaitsForWhatItIsTold) {
  const auto run = [](DebounceEdge edge, std::initializer_list<int> x) {
    auto debouncer = Debouncer::create(0.06, 0.02, edge).value();
    std::vector<int> y;
    for (const int value : x) {
      y.push_back(debouncer.calculate(value != 0) ? 1 : 0);
    }
    return y;
  };
  using Samples = std::vector<int>;
  EXPECT_EQ(run(DebounceEdge::rising, {1, 1, 0, 1, 1, 1, 1, 0, 1, 1, 1}),
            (Samples{0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 1}));
  EXPECT_EQ(run(DebounceEdge::falling, {0, 0, 1, 0, 0, 0, 0, 1, 0}),
            (Samples{1, 1, 1, 1, 1, 0, 0, 1, 1}));
  EXPECT_EQ(run(DebounceEdge::both, {1, 1, 1, 0, 1, 0, 0, 0, 0}),
            (Samples{0, 0, 1, 1, 1, 1, 1, 0, 0}));
  auto at_once = Debouncer::create(0.0, 0.02).value();
  EXPECT_TRUE(at_once.calculate(true));
  at_once.reset(false);
  EXPECT_FALSE(at_once.output());
}

/// One period of an object.
using Step = std::function<double(double)>;

std::vector<std::function<Step()>> subjects() {
  return {
      [] {
        return Step([f = BiquadCascade<6>::create(elliptic().sections).value()](double x) mutable {
          return f.calculate(x);
        });
      },
      [] {
        const auto taps = backward_difference(2, 5, 10_ms).value();
        return Step(
            [f = FirFilter<5>::create(taps).value()](double x) mutable { return f.calculate(x); });
      },
      [] {
        return Step(
            [f = MedianFilter<7>::create(6).value()](double x) mutable { return f.calculate(x); });
      },
      [] {
        return Step([f = SlewRateLimiter::create({200.0, 300.0}, 0.01).value()](double x) mutable {
          return f.calculate(x);
        });
      },
  };
}

// Whatever comes, the output is finite; and when the numbers are ordinary again it goes back to
// the answers of its twin that never saw them.
TEST(RunTimeFilters, ForgetWhatIsNotASample) {
  constexpr std::array worst{0.0,      5e-324, -1e-310, 1e154,    -1e154,    1.7e308,
                             -1.7e308, 1e300,  1e9,     infinity, -infinity, nan};
  for (const auto& make : subjects()) {
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
      Random random(seed);
      Step twin = make();
      Step tried = make();
      for (int k = 0; k < 3000; ++k) {
        const double ordinary = std::sin(0.05 * k);
        const bool bad = k >= 20 && k < 24;
        const double x = bad ? worst[random.bits() % worst.size()] : ordinary;
        const double expected = twin(ordinary);
        const double got = tried(x);
        ASSERT_TRUE(std::isfinite(got)) << k;
        if (k == 2999) {
          EXPECT_NEAR(got, expected, 1e-6);
        }
      }
    }
  }
}

// A drop-out holds the input: nothing moves at rest.
TEST(RunTimeFilters, HoldThroughADropOut) {
  auto cascade = BiquadCascade<3>::create(elliptic().sections).value();
  cascade.reset(2.0);
  const double before = cascade.output();
  EXPECT_NEAR(cascade.calculate(nan), before, 1e-14);
  EXPECT_NEAR(cascade.calculate(infinity), before, 1e-14);
  auto fir = FirFilter<3>::create(moving_average(3).value()).value();
  fir.reset(2.0);
  EXPECT_NEAR(fir.calculate(nan), 2.0, 1e-15);
}

TEST(RunTimeFilters, AllocateNothing) {
  if (!flyball::test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  auto cascade = BiquadCascade<3>::create(elliptic().sections).value();
  auto fir = FirFilter<9>::create(moving_average(9).value()).value();
  auto median = MedianFilter<9>::create().value();
  auto limiter = SlewRateLimiter::create({1.0, 1.0}, 0.01).value();
  auto debouncer = Debouncer::create(0.1, 0.01).value();
  const auto before = flyball::test::allocation_count();
  double sum = 0.0;
  for (int k = 0; k < 1000; ++k) {
    const double x = std::sin(0.1 * k);
    sum += cascade.calculate(x) + fir.calculate(x) + median.calculate(x) + limiter.calculate(x);
    sum += debouncer.calculate(x > 0.0) ? 1.0 : 0.0;
  }
  cascade.reset(1.0);
  median.reset();
  EXPECT_EQ(flyball::test::allocation_count(), before);
  EXPECT_TRUE(std::isfinite(sum));
}

TEST(RunTimeFilters, Refuse) {
  EXPECT_EQ(to_string(BiquadCascade<2>::create(elliptic().sections).error()),
            "BiquadCascade: sections is 3; it must be at most 2, for which it has room");
  EXPECT_TRUE(BiquadCascade<2>::create({}).error().is(ArgumentError::empty));
  EXPECT_TRUE(BiquadCascade<2>::create(std::array{Biquad{.a1 = -2.0, .a2 = 1.0}})
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(BiquadCascade<2>::create(std::array{Biquad{.b0 = nan}})
                  .error()
                  .is(ArgumentError::not_finite));
  EXPECT_TRUE(
      FirFilter<2>::create(std::array{1.0, 2.0, 3.0}).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(FirFilter<2>::create(std::span<const double>()).error().is(ArgumentError::empty));
  EXPECT_TRUE(FirFilter<2>::create(std::array{infinity}).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(MedianFilter<4>::create(5).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(MedianFilter<4>::create(0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      SlewRateLimiter::create({.rising = -1.0}, 0.1).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(SlewRateLimiter::create({}, 0.0).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(Debouncer::create(-0.1, 0.1).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(Debouncer::create(nan, 0.1).error().is(ArgumentError::not_finite));
  const std::array sections{Biquad{}};
  EXPECT_TRUE(filter_signal(sections, Eigen::VectorXd()).error().is(ArgumentError::empty));
  EXPECT_TRUE(
      filter_signal(sections, Eigen::MatrixXd::Zero(3, 2)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(filter_zero_phase(sections, Eigen::VectorXd::Zero(1))
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(filter_zero_phase(sections, Eigen::VectorXd::Constant(3, nan))
                  .error()
                  .is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::classical::run_time_filters_test
