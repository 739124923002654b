#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/spectra/excitation.hpp>
#include <flyball/math/spectra/fft.hpp>
#include <flyball/math/spectra/welch.hpp>

namespace flyball::spectra_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr double pi = std::numbers::pi;

VectorXd noise(Index n, std::uint64_t seed, double deviation = 1.0) {
  Random random(seed);
  VectorXd x(n);
  for (double& value : x) {
    value = random.normal(0.0, deviation);
  }
  return x;
}

/// y_k = a y_{k-1} + b u_{k-1}: G = b z⁻¹/(1 - a z⁻¹).
VectorXd lag(const VectorXd& u, double a, double b) {
  VectorXd y = VectorXd::Zero(u.size());
  for (Index k = 1; k < u.size(); ++k) {
    y(k) = a * y(k - 1) + b * u(k - 1);
  }
  return y;
}
Complex lag_response(double angle, double a, double b) {
  const Complex z = std::polar(1.0, -angle);
  return b * z / (1.0 - a * z);
}

// Sums of the windows and of their squares: a₀ n, (a₀² + Σ aₖ²/2) n.
TEST(Window, SumsAndShape) {
  EXPECT_NEAR(window_samples(Window::hann, 8).value()(2), 0.5, 1e-15);
  EXPECT_NEAR(window_samples(Window::hann, 8).value()(0), 0.0, 1e-16);
  EXPECT_NEAR(window_samples(Window::hann, 64)->squaredNorm(), 64 * 0.375, 1e-12);
  EXPECT_NEAR(window_samples(Window::hamming, 50)->sum(), 27.0, 1e-12);
  EXPECT_NEAR(window_samples(Window::blackman, 30)->sum(), 12.6, 1e-12);
  EXPECT_NEAR(window_samples(Window::blackman_harris, 30).value()(15), 1.0, 1e-12);
  EXPECT_NEAR(window_samples(Window::flat_top, 40).value()(20), 1.0, 1e-8);
  EXPECT_EQ(window_samples(Window::rectangular, 3).value(), VectorXd::Ones(3));
  EXPECT_TRUE(window_samples(Window::hann, 0).error().is(ArgumentError::out_of_range));
  EXPECT_EQ(to_string(Window::flat_top), "flat-top");
}

// White noise of variance σ² has the density 2σ²T/Hz up to 1/(2T); its integral is σ².
TEST(Welch, WhiteNoise) {
  const Time T(0.01);
  const PowerSpectrum power = welch(noise(200'000, 1, 3.0), T, {.length = 256}).value();
  EXPECT_NEAR(power.density.segment(2, 125).mean(), 2.0 * 9.0 * 0.01, 0.002);
  const double width = (power.frequency(1) - power.frequency(0)) / (2.0 * pi);
  EXPECT_NEAR(power.density.sum() * width, 9.0, 0.1);
  EXPECT_NEAR(power.frequency(128), pi / 0.01, 1e-9);
  // Half overlapping Hann stretches are worth 1/(1 + 2/36) of their number.
  EXPECT_NEAR(power.averages, 1561.0 / (1.0 + 1.0 / 18.0), 1.0);
}

// A sine of amplitude A between two bins, through the flat top: A²/2 of power.
TEST(Welch, SinePower) {
  const Index n = 4096;
  VectorXd x(n);
  for (Index k = 0; k < n; ++k) {
    x(k) = 2.0 * std::sin(2.0 * pi * (100.37 / 1024.0) * static_cast<double>(k));
  }
  const PowerSpectrum power =
      welch(x, Time(1.0), {.length = 1024, .window = Window::flat_top}).value();
  EXPECT_NEAR(power.density.sum() / 1024.0, 2.0, 1e-3);
}

TEST(FrequencyResponse, OfALag) {
  const Time T(0.02);
  const VectorXd u = noise(100'000, 2);
  const VectorXd y = lag(u, 0.7, 0.6) + noise(100'000, 3, 0.3);
  const auto estimate = estimate_frequency_response(u, y, T, {.length = 200}).value();
  int inside = 0;
  const Index bins = estimate.frequency.size();
  for (Index f = 1; f + 1 < bins; ++f) {
    const double angle = estimate.frequency(f) * T.si();
    const Complex truth = lag_response(angle, 0.7, 0.6);
    const Complex found = estimate.response[static_cast<std::size_t>(f)](0, 0);
    const double radius = estimate.radius[static_cast<std::size_t>(f)](0, 0);
    inside += std::abs(found - truth) <= radius ? 1 : 0;
    EXPECT_LT(std::abs(found - truth), 0.08);
    const double power = std::norm(truth);
    EXPECT_NEAR(estimate.coherence(f, 0), power / (power + 0.09), 0.06);
  }
  EXPECT_GE(inside, 0.88 * static_cast<double>(bins - 2));

  // Noise in u pulls h1 towards zero and leaves h2 alone.
  const VectorXd seen = u + noise(100'000, 4, 1.0);
  const VectorXd clean = lag(u, 0.7, 0.6);
  const auto h1 = estimate_frequency_response(seen, clean, T, {.length = 200}).value();
  const auto h2 =
      estimate_frequency_response(seen, clean, T, {.length = 200}, ResponseEstimator::h2).value();
  const double angle = h1.frequency(10) * T.si();
  EXPECT_NEAR(std::abs(h1.response[10](0, 0) / lag_response(angle, 0.7, 0.6)), 0.5, 0.06);
  EXPECT_NEAR(std::abs(h2.response[10](0, 0) / lag_response(angle, 0.7, 0.6)), 1.0, 0.06);
}

// Two inputs at once: each entry is found, and the radii hold.
TEST(FrequencyResponse, TwoInputs) {
  MatrixXd u(60'000, 2);
  u << noise(60'000, 5), noise(60'000, 6);
  MatrixXd y(60'000, 2);
  y << lag(u.col(0), 0.5, 1.0) + lag(u.col(1), 0.9, 0.1) + noise(60'000, 7, 0.2),
      lag(u.col(1), -0.4, 2.0) + noise(60'000, 8, 0.2);
  const auto estimate = estimate_frequency_response(u, y, Time(1.0), {.length = 128}).value();
  int inside = 0;
  int all = 0;
  for (std::size_t f = 1; f < 64; ++f) {
    const double angle = estimate.frequency(static_cast<Index>(f));
    Eigen::Matrix2cd truth;
    truth << lag_response(angle, 0.5, 1.0), lag_response(angle, 0.9, 0.1), 0.0,
        lag_response(angle, -0.4, 2.0);
    inside += static_cast<int>(
        ((estimate.response[f] - truth).cwiseAbs().array() <= estimate.radius[f].array()).count());
    all += 4;
  }
  EXPECT_GE(inside, 0.88 * all);
}

// A periodic excitation, cut into its periods, is exact without noise, and silent where it has no
// power.
TEST(FrequencyResponse, OfAMultisineIsExact) {
  const Index n = 500;
  const Multisine one = multisine(n, {1, 200, 2}).value();
  const VectorXd u = one.u.replicate(8, 1);
  const VectorXd y = lag(u, 0.7, 0.6);
  const WelchOptions options{
      .length = n, .overlap = 0.0, .window = Window::rectangular, .remove_mean = false};
  const auto estimate =
      estimate_frequency_response(u.tail(6 * n), y.tail(6 * n), Time(0.1), options).value();
  for (Index k = 1; k <= 199; k += 2) {
    const Complex found = estimate.response[static_cast<std::size_t>(k)](0, 0);
    EXPECT_LT(std::abs(found - lag_response(2.0 * pi * static_cast<double>(k) / 500.0, 0.7, 0.6)),
              1e-12);
    EXPECT_NEAR(estimate.coherence(k, 0), 1.0, 1e-12);
    EXPECT_TRUE(std::isnan(estimate.response[static_cast<std::size_t>(k) + 1](0, 0).real()));
    EXPECT_EQ(estimate.coherence(k + 1, 0), 0.0);
  }
}

TEST(FrequencyResponse, OfSines) {
  const Time T(0.05);
  const VectorXd frequencies = Eigen::Vector4d(0.5, 2.0, 7.0, 30.0);
  const SteppedSine signal = stepped_sine(frequencies, T, 12, 3.0).value();
  const VectorXd y = lag(signal.u, 0.8, 0.5) + noise(signal.u.size(), 4, 0.01);
  for (const SteppedSine::Step& step : signal.steps) {
    const Index skip = step.samples / 3;
    const auto found =
        sine_response(signal.u.segment(step.first + skip, step.samples - skip),
                      y.segment(step.first + skip, step.samples - skip).array() + 5.0,
                      step.frequency, T)
            .value();
    const Complex truth = lag_response(step.frequency * T.si(), 0.8, 0.5);
    EXPECT_LE(std::abs(found.response - truth), 1.5 * found.radius);
    EXPECT_LT(found.radius, 0.02);
    EXPECT_GT(found.coherence, 0.99);
  }
  EXPECT_TRUE(sine_response(signal.u, y, 1e-4, T).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(sine_response(signal.u, y, 62.0, T).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      sine_response(VectorXd::Zero(y.size()), y, 1.0, T).error().is(ArgumentError::malformed));
}

TEST(FrequencyResponse, Refusals) {
  const VectorXd u = VectorXd::Ones(10);
  EXPECT_TRUE(estimate_frequency_response(u, VectorXd::Ones(9), Time(1.0))
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      estimate_frequency_response(u, MatrixXd::Ones(10, 2), Time(1.0), {}, ResponseEstimator::h2)
          .error()
          .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(welch(u, Time(0.0)).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(welch(u, Time(1.0), {.overlap = 1.0}).error().is(ArgumentError::out_of_range));
  EXPECT_EQ(to_string(welch(u, Time(1.0), {.length = 11}).error()),
            "cross_spectra: the length of a stretch is 11; it must be from 1 to the 10 samples");
  // An input without power.
  const auto none = estimate_frequency_response(VectorXd::Zero(100), noise(100, 1), Time(1.0));
  EXPECT_TRUE(std::isnan(none->response[3](0, 0).real()));
  EXPECT_EQ(none->radius[3](0, 0), std::numeric_limits<double>::infinity());
}

// A chirp's phase is the integral of its frequency: count its turns.
TEST(Excitation, Chirp) {
  const Time T(1e-3);
  for (const ChirpShape shape : {ChirpShape::linear, ChirpShape::logarithmic}) {
    const VectorXd u = chirp(10'000, T, 2.0 * pi, 20.0 * pi, 1.0, shape).value();
    int crossings = 0;
    for (Index k = 1; k < u.size(); ++k) {
      crossings += u(k - 1) < 0.0 && u(k) >= 0.0 ? 1 : 0;
    }
    const double turns =
        shape == ChirpShape::linear ? 0.5 * (1.0 + 10.0) * 10.0 : 9.0 * 10.0 / std::log(10.0);
    EXPECT_NEAR(crossings, turns, 1.5);
    EXPECT_LE(u.cwiseAbs().maxCoeff(), 1.0);
  }
  EXPECT_TRUE(chirp(100, T, 1.0, 4000.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(chirp(1, T, 1.0, 40.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(chirp(100, T, 0.0, 40.0).error().is(ArgumentError::not_positive));
}

// Only the harmonics, all of one size; the crest factor below that of a lone sine's 1.414 by much
// of what a random phase would have (about 3).
TEST(Excitation, Multisine) {
  for (const Index last : {1, 3, 10, 60, 200}) {
    const Multisine signal = multisine(1024, {1, last, 1}, 5.0, 7).value();
    EXPECT_NEAR(signal.u.cwiseAbs().maxCoeff(), 5.0, 1e-12);
    EXPECT_LT(signal.crest_factor, 1.75);
    EXPECT_NEAR(crest_factor(signal.u).value(), signal.crest_factor, 1e-12);
    const VectorXcd bins = real_fft(signal.u).value();
    const double size = std::abs(bins(1));
    for (Index k = 0; k < bins.size(); ++k) {
      EXPECT_NEAR(std::abs(bins(k)), k >= 1 && k <= last ? size : 0.0, 1e-11 * size);
    }
  }
  // Phases found on a coarser grid, or in fewer rounds, are about as good.
  for (const auto& [samples, last, worst] :
       {std::tuple{Index{1} << 21U, Index{200}, 1.75}, {Index{1} << 20U, Index{400'000}, 2.2}}) {
    const Multisine signal = multisine(samples, {1, last, 1}).value();
    EXPECT_LT(signal.crest_factor, worst) << last;
    EXPECT_NEAR(crest_factor(signal.u).value(), signal.crest_factor, 1e-9);
  }
  EXPECT_GT(multisine(64, {1, 3, 1}, 5e-324)->u.cwiseAbs().maxCoeff(), 0.0);
  EXPECT_EQ(multisine(64, {1, 20, 1}, 1.0, 3)->u, multisine(64, {1, 20, 1}, 1.0, 3)->u);
  EXPECT_TRUE(multisine(64, {1, 32, 1}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(multisine(64, {0, 3, 1}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(multisine(64, {1, 3, 1}, -1.0).error().is(ArgumentError::not_positive));
}

// A maximum-length sequence has the autocorrelation -1/N everywhere but at zero.
TEST(Excitation, Prbs) {
  for (int bits = 2; bits <= 13; ++bits) {
    const VectorXd u = prbs(bits, 1, 1.0, 5).value();
    const Index n = u.size();
    ASSERT_EQ(n, (Index{1} << bits) - 1);
    EXPECT_EQ(std::abs(u.sum()), 1.0);
    const VectorXcd bins = real_fft(u).value();
    for (Index k = 1; k < bins.size(); ++k) {
      EXPECT_NEAR(std::norm(bins(k)), static_cast<double>(n + 1), 1e-8 * static_cast<double>(n));
    }
  }
  for (int bits = 14; bits <= 21; ++bits) {
    const VectorXd u = prbs(bits).value();
    EXPECT_EQ(std::abs(u.sum()), 1.0) << bits;
  }
  const VectorXd held = prbs(3, 4, 2.5).value();
  EXPECT_EQ(held.size(), 28);
  EXPECT_EQ(held.head(4), VectorXd::Constant(4, held(0)));
  EXPECT_EQ(std::abs(held(9)), 2.5);
  EXPECT_TRUE(prbs(1).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(prbs(24, 1000).error().is(ArgumentError::out_of_range));
}

TEST(Excitation, Refusals) {
  EXPECT_TRUE(crest_factor(VectorXd()).error().is(ArgumentError::empty));
  EXPECT_TRUE(crest_factor(VectorXd::Zero(3)).error().is(ArgumentError::malformed));
  EXPECT_TRUE(stepped_sine(VectorXd(), Time(0.1), 3).error().is(ArgumentError::empty));
  EXPECT_TRUE(
      stepped_sine(VectorXd::Ones(1), Time(0.1), 1).error().is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::spectra_test
