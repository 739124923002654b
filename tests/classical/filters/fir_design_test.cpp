#include <flyball/classical/filters/fir_design.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <flyball/classical/filters/sample_rate.hpp>
#include <flyball/classical/filters/simple_filters.hpp>
#include <flyball/core/random.hpp>

#include "classical/filters/filter_cases.hpp"

namespace flyball::classical::fir_design_test {
namespace {

using namespace flyball::literals;
using Eigen::VectorXd;
using std::numbers::pi;
using test::Complex;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

void expect_taps(const Expected<VectorXd>& found, std::initializer_list<double> wanted,
                 double tolerance = 1e-15) {
  ASSERT_TRUE(found) << to_string(found.error());
  ASSERT_EQ(found->size(), static_cast<Eigen::Index>(wanted.size()));
  Eigen::Index i = 0;
  for (const double tap : wanted) {
    EXPECT_NEAR((*found)(i), tap, tolerance * (1.0 + std::abs(tap))) << i;
    ++i;
  }
}

// SciPy 1.10.1: firwin(7, 0.3), firwin(7, 0.3, pass_zero=False, window='hann'),
// firwin(8, [0.2, 0.5], pass_zero=False), firwin(9, [0.2, 0.5], window=('kaiser', 4)).
TEST(FirDesign, AgreesWithSciPy) {
  expect_taps(design_fir({.taps = 7, .frequency = 0.3 * pi}, 1_s),
              {0.0032966132696683596, 0.058973232008108396, 0.2492098913464448, 0.37704052675155686,
               0.24920989134644486, 0.05897323200810847, 0.0032966132696683596});
  expect_taps(design_fir({.band = FilterBand::high_pass, .taps = 7, .frequency = 0.3 * pi}, 1_s,
                         Window::hann),
              {0.0, -0.0374446297427112, -0.19111382735448063, 0.692661604776461,
               -0.1911138273544807, -0.037444629742711254, 0.0});
  expect_taps(
      design_fir({.band = FilterBand::band_pass,
                  .taps = 8,
                  .frequency = 0.2 * pi,
                  .upper_frequency = 0.5 * pi},
                 1_s),
      {-0.020690669142650567, -0.10322697703339166, -0.02605689273758631, 0.45371191318309106,
       0.45371191318309106, -0.02605689273758631, -0.10322697703339166, -0.020690669142650567});
  expect_taps(design_fir({.band = FilterBand::band_stop,
                          .taps = 9,
                          .frequency = 0.2 * pi,
                          .upper_frequency = 0.5 * pi},
                         1_s, 4.0),
              {0.005175346648255744, 0.08433548919805174, 0.11989725292153314, -0.14708231374524272,
               0.8753484499548042, -0.14708231374524272, 0.11989725292153314, 0.08433548919805174,
               0.005175346648255744});
  // get_window(('kaiser', 8), 6, fftbins=False); kaiserord(65, 0.1)
  expect_taps(kaiser_window(6, 8.0),
              {0.002338830512733327, 0.22677684133642736, 0.8598020817729666, 0.8598020817729666,
               0.22677684133642736, 0.002338830512733327});
  const auto choice = kaiser_choice(65.0, 0.1 * pi, 1_s).value();
  EXPECT_EQ(choice.taps, 81);
  EXPECT_NEAR(choice.beta, 6.20426, 1e-14);
}

// What Kaiser's formula promises holds: the stop band is below the attenuation.
TEST(FirDesign, KaiserKeepsItsPromise) {
  for (const double attenuation : {25.0, 40.0, 60.0, 90.0, 120.0}) {
    const double width = 0.08 * pi;
    const auto choice = kaiser_choice(attenuation, width, 1_s).value();
    const auto taps =
        design_fir({.taps = choice.taps, .frequency = 0.3 * pi}, 1_s, choice.beta).value();
    for (double angle = 0.0; angle <= pi; angle += 0.003) {
      const double gain = std::abs(fir_response(taps, angle));
      if (angle > 0.3 * pi + 0.5 * width) {
        EXPECT_LT(20.0 * std::log10(gain), -attenuation + 1.0) << attenuation << " " << angle;
      } else if (angle < 0.3 * pi - 0.5 * width) {
        EXPECT_NEAR(gain, 1.0, 1.2 * std::pow(10.0, -attenuation / 20.0));
      }
    }
  }
}

// (f_k - f_{k-1})/T, (3f_k - 4f_{k-1} + f_{k-2})/2T, (f_k - 2f_{k-1} + f_{k-2})/T², and the central
// (-f₂ + 8f₁ - 8f₋₁ + f₋₂)/12T.
TEST(FiniteDifference, TextbookStencils) {
  expect_taps(backward_difference(1, 2, 500_ms), {2.0, -2.0});
  expect_taps(backward_difference(1, 3, 500_ms), {3.0, -4.0, 1.0});
  expect_taps(backward_difference(2, 3, 500_ms), {4.0, -8.0, 4.0});
  expect_taps(backward_difference(0, 3, 500_ms), {1.0, 0.0, 0.0});
  expect_taps(finite_difference(Eigen::VectorXd::LinSpaced(5, -2.0, 2.0), 1, 1_s),
              {1.0 / 12.0, -8.0 / 12.0, 0.0, 8.0 / 12.0, -1.0 / 12.0});
}

// Exact for every polynomial of a degree below the number of samples, at uneven places, too.
TEST(FiniteDifference, ExactForPolynomials) {
  Random random(5);
  for (int i = 0; i < 500; ++i) {
    const int n = 2 + static_cast<int>(random.bits() % 7);
    VectorXd offsets(n);
    for (int k = 0; k < n; ++k) {
      offsets(k) = 1.3 * (k - n / 2) + random.uniform(-0.5, 0.5);
    }
    const int derivative = static_cast<int>(random.bits() % static_cast<std::uint64_t>(n));
    const double T = random.uniform(0.5, 2.0);
    const auto taps = finite_difference(offsets, derivative, Time(T)).value();
    for (int degree = 0; degree < n; ++degree) {
      // d^m/dt^m t^degree at 0: degree! where m = degree.
      double sum = 0.0;
      double scale = 0.0;
      for (int k = 0; k < n; ++k) {
        const double term = taps(k) * std::pow(offsets(k) * T, degree);
        sum += term;
        scale += std::abs(term);
      }
      EXPECT_NEAR(sum, degree == derivative ? std::tgamma(degree + 1.0) : 0.0, 1e-12 * scale);
    }
  }
}

// SciPy 1.10.1: savgol_coeffs(7, 3, deriv=1, delta=0.1), savgol_coeffs(7, 2, pos=6, use='dot')
// backwards. Of degree 10 through 25 samples the normal equations in fractions; SciPy keeps six
// digits there.
TEST(SavitzkyGolay, AgreesWithSciPy) {
  expect_taps(savitzky_golay({.taps = 7, .degree = 3, .derivative = 1, .at = 3.0}, 100_ms),
              {-0.87301587301587247, 2.6587301587301586, 2.3015873015873027, 0.0,
               -2.3015873015873027, -2.6587301587301599, 0.87301587301587336},
              2e-15);
  expect_taps(savitzky_golay({.taps = 7, .degree = 2}, 1_s),
              {0.7619047619047608, 0.3571428571428565, 0.07142857142857141, -0.09523809523809527,
               -0.14285714285714274, -0.07142857142857124, 0.11904761904761929},
              2e-15);
  const auto tenth =
      savitzky_golay({.taps = 25, .degree = 10, .derivative = 2, .at = 12.0}, 500_ms).value();
  EXPECT_NEAR(tenth(0), 0.026893805580568652, 1e-14);
  EXPECT_NEAR(tenth(3), 0.06950166370987573, 1e-14);
}

// x_k = sin 0.3k + k²/100: savgol_filter(x, 5, 2), and with deriv=1, delta=0.1, cubic.
TEST(SavitzkyGolay, SmoothsRecords) {
  VectorXd x(12);
  for (int k = 0; k < 12; ++k) {
    x(k) = std::sin(0.3 * k) + 0.01 * k * k;
  }
  expect_taps(smooth(x, {.taps = 5, .degree = 2}, 1_s),
              {-0.00442179572768005, 0.31449252557904545, 0.6042562910079938, 0.8727911598919473,
               1.0914016258114738, 1.2468127584452824, 1.33318157612598, 1.3526189819905523,
               1.315001203289937, 1.2370875774225836, 1.1508611334387857, 1.047432460302499},
              2e-15);
  const auto slope = smooth(x, {.taps = 5, .degree = 3, .derivative = 1}, 100_ms).value();
  EXPECT_NEAR(slope(0), 3.022613366039875, 2e-14);
  EXPECT_NEAR(slope(6), 0.5185757881455242, 2e-14);
  EXPECT_NEAR(slope(11), -0.7782236737604616, 2e-14);
}

// Reproduces a polynomial of its degree exactly, at any place, with any derivative, to degree 20.
TEST(SavitzkyGolay, ExactForPolynomialsOfItsDegree) {
  Random random(6);
  for (int i = 0; i < 300; ++i) {
    const int degree = static_cast<int>(random.bits() % 21);
    const int taps = degree + 1 + static_cast<int>(random.bits() % 60);
    const int derivative =
        static_cast<int>(random.bits() % static_cast<std::uint64_t>(std::min(degree, 2) + 1));
    const double at = random.uniform(0.0, taps - 1.0);
    const auto b =
        savitzky_golay({.taps = taps, .degree = degree, .derivative = derivative, .at = at}, 1_s)
            .value();
    // p(t) = cos(m arccos(t/h)), Chebyshev's of the degree, which stays within ±1 on the samples.
    const double middle = 0.5 * (taps - 1.0);
    const double half = std::max(middle, 0.5);
    const auto value = [&](double back) {
      const double t = std::clamp((middle - back) / half, -1.0, 1.0);
      return std::cos(degree * std::acos(t));
    };
    double sum = 0.0;
    for (int k = 0; k < taps; ++k) {
      sum += b(k) * value(k);
    }
    if (derivative == 0) {
      EXPECT_NEAR(sum, value(at), 1e-12 * b.lpNorm<1>());
    } else {
      // The derivative of order one by U_{m-1}; of order two by the differential equation.
      const double t = (middle - at) / half;
      const double angle = std::acos(t);
      const double sine = std::sin(angle);
      const double first = degree * std::sin(degree * angle) / sine;
      const double second = (t * first - degree * degree * value(at)) / (sine * sine);
      const double wanted = derivative == 1 ? first / half : second / (half * half);
      if (sine > 0.1) {
        EXPECT_NEAR(sum, wanted, 1e-12 * b.lpNorm<1>());
      }
    }
  }
}

// SciPy 1.10.1: iirnotch(0.5/π, 5), iirpeak(0.5/π, 5), with T = 0.01 and 50 rad/s.
TEST(SimpleFilters, NotchAndPeak) {
  const auto notch = notch_filter(50.0, 10.0, 10_ms).value();
  const Biquad& c = notch.sections.front();
  EXPECT_NEAR(c.b0, 0.9523431231575024, 1e-15);
  EXPECT_NEAR(c.b1, -1.671519435638479, 2e-15);
  EXPECT_NEAR(c.b2, 0.9523431231575024, 1e-15);
  EXPECT_NEAR(c.a1, -1.671519435638479, 2e-15);
  EXPECT_NEAR(c.a2, 0.9046862463150047, 1e-15);
  EXPECT_NEAR(std::abs(notch.response(50.0)), 0.0, 1e-15);
  EXPECT_NEAR(std::abs(notch.response(0.0)), 1.0, 1e-14);
  EXPECT_NEAR(std::abs(notch.response(100.0 * pi)), 1.0, 1e-14);
  const auto peak = peak_filter(50.0, 10.0, 10_ms).value();
  const Biquad& p = peak.sections.front();
  EXPECT_NEAR(p.b0, 0.04765687684249742, 1e-15);
  EXPECT_NEAR(p.b1, 0.0, 1e-17);
  EXPECT_NEAR(p.b2, -0.04765687684249742, 1e-15);
  EXPECT_NEAR(std::abs(peak.response(50.0)), 1.0, 1e-14);
  // Together they are everything, for wide ones with real poles, too.
  for (const double width : {1.0, 30.0, 120.0, 250.0}) {
    const auto without = notch_filter(50.0, width, 10_ms).value();
    const auto alone = peak_filter(50.0, width, 10_ms).value();
    for (double w = 1.0; w < 300.0; w += 7.0) {
      EXPECT_NEAR(std::abs(section_response(without.sections, w * 0.01) +
                           section_response(alone.sections, w * 0.01) - 1.0),
                  0.0, 1e-12);
      EXPECT_NEAR(std::abs(without.response(w) + alone.response(w) - 1.0), 0.0, 1e-12);
    }
  }
}

// y_k = a y_{k-1} + (1 - a) x_k with a = e^{-T/τ}: (1 - a), (1 - a) a … of an impulse, in sum 1.
TEST(SimpleFilters, SinglePoles) {
  const auto average = exponential_average(Time(0.1), 20_ms).value();
  const double a = std::exp(-0.2);
  VectorXd impulse = VectorXd::Zero(5);
  impulse(0) = 1.0;
  const auto y = filter_signal(average.sections, impulse, FilterStart::rest).value();
  for (int k = 0; k < 5; ++k) {
    EXPECT_NEAR(y(k), (1.0 - a) * std::pow(a, k), 1e-16);
  }
  EXPECT_NEAR(std::abs(average.response(0.0)), 1.0, 1e-15);
  const auto high = single_pole_high_pass(Time(0.1), 20_ms).value();
  EXPECT_NEAR(std::abs(high.response(0.0)), 0.0, 1e-16);
  EXPECT_NEAR(std::abs(high.response(50.0 * pi)), 2.0 * a / (1.0 + a), 1e-15);
  const auto edge = filter_signal(high.sections, VectorXd::Ones(3), FilterStart::rest).value();
  EXPECT_NEAR(edge(2), a * a * a, 1e-16);
  const auto mean = moving_average(4).value();
  EXPECT_EQ(mean, VectorXd::Constant(4, 0.25));
}

// 7.1.3: of 1.5 Hz sampled at 2 Hz 0.5 Hz comes; a band of 0.4 Hz must be protected from 1.6 Hz on.
TEST(SampleRate, AdvisesWhatSamplingNeeds) {
  const double hertz = 2.0 * pi;
  const auto analog =
      advise_anti_aliasing(500_ms, {.band = 0.4 * hertz, .attenuation = 40.0, .ripple = 1.0})
          .value();
  EXPECT_NEAR(analog.nyquist_frequency, hertz, 1e-14);
  EXPECT_NEAR(analog.first_alias, 1.6 * hertz, 1e-14);
  // log₁₀((10⁴ - 1)/(10^0.1 - 1))/(2 log₁₀ 4) = 3.8092
  EXPECT_NEAR(analog.exact_order, 3.80924, 1e-5);
  EXPECT_EQ(analog.design.order, 4);
  EXPECT_NEAR(analog.loss, 1.0, 1e-12);
  EXPECT_GE(analog.attenuation, 40.0);
  EXPECT_NEAR(analog.sampling_phase_lag, 0.2 * pi, 1e-15);
  // The phase's slope, added up from rest, is the phase.
  const auto filter = design_analog_filter(analog.design).value();
  double lag = 0.0;
  constexpr int steps = 2000;
  for (int k = 0; k < steps; ++k) {
    lag += filter.group_delay((k + 0.5) / steps * 0.4 * hertz) * 0.4 * hertz / steps;
  }
  EXPECT_NEAR(analog.phase_lag, lag, 1e-6);
  EXPECT_NEAR(analog.delay, filter.group_delay(0.0), 1e-15);

  const auto digital =
      advise_anti_aliasing(
          20_ms,
          {.band = 40.0, .attenuation = 60.0, .ripple = 0.1, .family = FilterFamily::elliptic},
          1_ms)
          .value();
  const auto made = design_filter(digital.design, 1_ms).value();
  double turned = 0.0;
  for (int k = 0; k < steps; ++k) {
    turned += made.group_delay((k + 0.5) / steps * 40.0) * 40.0 / steps;
  }
  EXPECT_NEAR(digital.phase_lag, turned, 1e-5);
  EXPECT_LE(digital.loss, 0.1 + 1e-9);
  EXPECT_GE(digital.attenuation, 60.0 - 1e-9);
  EXPECT_GT(digital.fir_taps, 0);
  EXPECT_NEAR(digital.fir_delay, 0.5e-3 * static_cast<double>(digital.fir_taps - 1), 1e-15);
  // 50 Hz to 40 Hz: what the samples hold folds to 15 Hz and above; a band of 10 Hz needs nothing.
  const auto none = advise_anti_aliasing(25_ms, {.band = 10.0 * hertz}, 20_ms).value();
  EXPECT_EQ(none.design.order, 0);
}

// decimate(x, 4, zero_phase) of SciPy differs at the ends alone; in between a slow sine stays what
// it is to the filter's 0.1 dB, and a fast one vanishes.
TEST(SampleRate, Decimates) {
  VectorXd slow(1000);
  VectorXd fast(1000);
  for (int k = 0; k < 1000; ++k) {
    slow(k) = std::sin(0.1 * k);
    fast(k) = std::sin(2.0 * k);
  }
  const auto y = decimate(slow, 4).value();
  const auto z = decimate(fast, 4).value();
  ASSERT_EQ(y.size(), 250);
  for (int k = 100; k < 150; ++k) {
    EXPECT_NEAR(y(k), slow(4 * k), 0.012);
    EXPECT_NEAR(z(k), 0.0, 1e-6);
  }
  EXPECT_EQ(decimate(slow, 1).value(), slow);
}

// SciPy 1.10.1: resample_poly(x, 3, 2), and resample_poly(x, 2, 5, padtype='line'), which lets the
// filter have the line, too: here a straight line stays one.
TEST(SampleRate, ResamplesAsSciPy) {
  VectorXd x(20);
  for (int k = 0; k < 20; ++k) {
    x(k) = std::sin(0.3 * k) + (k % 3 == 0 ? 0.5 : 0.0);
  }
  const auto y = resample(x, 3, 2).value();
  ASSERT_EQ(y.size(), 30);
  EXPECT_NEAR(y(0), 0.5003030867768886, 2e-15);
  EXPECT_NEAR(y(1), 0.4250959979976231, 2e-15);
  EXPECT_NEAR(y(5), 1.262230139773925, 2e-15);
  EXPECT_NEAR(y(29), -0.44270657565491417, 2e-15);
  const auto line = resample(x, 2, 5, true).value();
  ASSERT_EQ(line.size(), 8);
  EXPECT_NEAR(line(0), 0.4114995421170037, 1e-4);
  EXPECT_NEAR(line(3), 0.936092256286042, 1e-4);
  EXPECT_NEAR(line(7), -0.633239919511422, 1e-4);
  EXPECT_EQ(resample(x, 7, 7).value(), x);
  const auto straight = resample(VectorXd::LinSpaced(9, 1.0, 5.0), 4, 1, true).value();
  for (int k = 0; k <= 32; ++k) {
    EXPECT_NEAR(straight(k), 1.0 + 0.125 * k, 1e-15);
  }
}

TEST(FirDesign, Refuses) {
  EXPECT_EQ(
      to_string(
          design_fir({.band = FilterBand::high_pass, .taps = 8, .frequency = 1.0}, 1_s).error()),
      "design_fir: taps is 8; it must be odd: with an even number half the sample rate cannot "
      "pass");
  EXPECT_TRUE(design_fir({.frequency = 4.0}, 1_s).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      design_fir({.taps = 0, .frequency = 1.0}, 1_s).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(design_fir({.frequency = nan}, 1_s).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(design_fir({.frequency = 1.0}, 1_s, -1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(kaiser_choice(5.0, 1.0, 1_s).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(moving_average(0).error().is(ArgumentError::out_of_range));
  VectorXd twice(3);
  twice << 0.0, -1.0, -1.0;
  EXPECT_TRUE(finite_difference(twice, 1, 1_s).error().is(ArgumentError::malformed));
  EXPECT_TRUE(backward_difference(3, 3, 1_s).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(backward_difference(0, 0, 1_s).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      savitzky_golay({.taps = 3, .degree = 3}, 1_s).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(savitzky_golay({.taps = 5, .degree = 2, .derivative = 3}, 1_s)
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(savitzky_golay({.at = nan}, 1_s).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(smooth(VectorXd::Zero(3), {.taps = 5}, 1_s).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(smooth(VectorXd::Zero(9), {.taps = 4}, 1_s).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(notch_filter(400.0, 1.0, 10_ms).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(peak_filter(4.0, 0.0, 10_ms).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(exponential_average(Time(0.0), 10_ms).error().is(ArgumentError::not_positive));
  EXPECT_EQ(to_string(advise_anti_aliasing(20_ms, {.band = 200.0}).error()),
            "advise_anti_aliasing: band is 200 rad/s; it must be below half the new sample rate, "
            "which is 157.08 rad/s; sample faster, or ask for less");
  EXPECT_TRUE(
      advise_anti_aliasing(20_ms, {.band = 20.0}, 20_ms).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(decimate(VectorXd::Zero(9), 0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(resample(VectorXd::Zero(9), 0, 1).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(resample(VectorXd(), 1, 2).error().is(ArgumentError::empty));
}

}  // namespace
}  // namespace flyball::classical::fir_design_test
