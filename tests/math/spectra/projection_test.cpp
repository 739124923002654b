#include <flyball/math/spectra/projection.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

namespace flyball::projection_test {
namespace {

using namespace flyball::literals;
using Complex = std::complex<double>;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// Figure E.9: v = 2i + 1.5j along i + j and i - j: 1.75√2 and 0.25√2.
TEST(Coordinates, OfTheBook) {
  const auto found =
      coordinates(Eigen::Matrix2d{{1.0, 1.0}, {1.0, -1.0}}, Eigen::Vector2d(2.0, 1.5)).value();
  EXPECT_EQ(found.along(0), 3.5 / std::sqrt(2.0));
  EXPECT_EQ(found.along(1), 0.5 / std::sqrt(2.0));
  EXPECT_NEAR(found.along(0), 1.75 * std::sqrt(2.0), 5e-16);
  EXPECT_TRUE(found.orthogonal);
  EXPECT_NEAR(found.rest, 0.0, 1e-15);
}

// Σ along w/|w| is v again, whichever the basis; of fewer vectors what is left stands at right
// angles to them.
TEST(Coordinates, GiveTheVectorBack) {
  Random random(1);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Index n = 1 + static_cast<Eigen::Index>(random.bits() % 6);
    const Eigen::Index m =
        1 + static_cast<Eigen::Index>(random.bits() % static_cast<std::uint64_t>(n));
    Eigen::MatrixXd W(n, m);
    VectorXd v(n);
    for (double& entry : W.reshaped()) {
      entry = random.normal();
    }
    for (double& entry : v) {
      entry = random.normal();
    }
    const auto found = coordinates(W, v).value();
    VectorXd rest = v;
    for (Eigen::Index k = 0; k < m; ++k) {
      rest -= found.along(k) * W.col(k).normalized();
    }
    EXPECT_NEAR(rest.norm(), found.rest, 1e-10);
    EXPECT_NEAR((W.transpose() * rest).norm(), 0.0, 1e-9);
    if (m == n) {
      EXPECT_NEAR(found.rest, 0.0, 1e-10);
    }
  }
}

// ∫₀^L e^{-at} e^{-st} dt = (1 - e^{-(s + a)L})/(s + a), of fine samples; ∫ of a ramp and of a held
// pulse exactly.
TEST(Laplace, TransformsSamples) {
  constexpr double T = 1e-3;
  constexpr int n = 4001;
  VectorXd x(n);
  for (int k = 0; k < n; ++k) {
    x(k) = std::exp(-2.0 * k * T);
  }
  VectorXcd s(4);
  s << 0.0, Complex(1.0, 3.0), Complex(-1.0, -20.0), Complex(0.0, 1e-9);
  const auto X = laplace_transform(x, Time(T), s).value();
  for (int i = 0; i < 4; ++i) {
    const Complex rate = s(i) + 2.0;
    const Complex wanted = (1.0 - std::exp(-rate * ((n - 1) * T))) / rate;
    // Straight lines are off by T²/12 of the second derivative.
    EXPECT_NEAR(std::abs(X(i) - wanted), 0.0, 4.0 * T * T / 12.0 * std::abs(wanted) * 3.0);
  }
  // t on [0, 2]: (1 - (1 + 2s) e^{-2s})/s², exactly, at a few samples.
  const VectorXd ramp = VectorXd::LinSpaced(5, 0.0, 2.0);
  VectorXcd points(5);
  points << 1.0, Complex(0.3, 7.0), Complex(-4.0, 1.0), Complex(0.9, 0.0), Complex(0.0, 1.01);
  const auto R = laplace_transform(ramp, 500_ms, points).value();
  for (int i = 0; i < 5; ++i) {
    const Complex p = points(i);
    const Complex wanted = (1.0 - (1.0 + 2.0 * p) * std::exp(-2.0 * p)) / (p * p);
    EXPECT_NEAR(std::abs(R(i) - wanted), 0.0, 1e-14 * (1.0 + std::abs(wanted)));
  }
  const auto held =
      laplace_transform(VectorXd::Constant(4, 3.0), 500_ms, points, Interpolation::hold).value();
  for (int i = 0; i < 5; ++i) {
    const Complex wanted = 3.0 * (1.0 - std::exp(-2.0 * points(i))) / points(i);
    EXPECT_NEAR(std::abs(held(i) - wanted), 0.0, 1e-14 * (1.0 + std::abs(wanted)));
  }
}

// The chord's transform is the sum of its tones', Σ ω/(s² + ω²), as Figure E.14 has it: right of
// the axis, where a record of 0.6 s is all of it. Straight lines between samples are off by
// (ωT)²/12.
TEST(Laplace, OfAChordIsTheSumOfItsTones) {
  constexpr double T = 1e-5;
  constexpr double tones[] = {349.23, 440.0, 261.63};
  VectorXd x = VectorXd::Zero(60001);
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    for (const double f : tones) {
      x(k) += std::sin(2.0 * pi * f * static_cast<double>(k) * T);
    }
  }
  VectorXcd s(3);
  s << Complex(50.0, 2.0 * pi * 349.23), Complex(80.0, 2.0 * pi * 300.0), Complex(60.0, 3000.0);
  const auto X = laplace_transform(x, Time(T), s).value();
  for (int i = 0; i < 3; ++i) {
    Complex sum = 0.0;
    for (const double f : tones) {
      const double w = 2.0 * pi * f;
      sum += w / (s(i) * s(i) + w * w);
    }
    EXPECT_NEAR(std::abs(X(i) - sum), 0.0, 1e-4 * std::abs(sum));
  }
}

// The chord of Figure E.11 (F4, A4, C4): a record of a whole number of their periods has lines of
// one, with the phase of a sine, -90°; the flat top reads them of any record.
TEST(AmplitudeSpectrum, HasTheTonesOfAChord) {
  constexpr double tones[] = {349.23, 440.0, 261.63};
  const auto chord = [&](Eigen::Index n, double T) {
    VectorXd x = VectorXd::Constant(n, 0.25);
    for (Eigen::Index k = 0; k < n; ++k) {
      for (const double f : tones) {
        x(k) += std::sin(2.0 * pi * f * static_cast<double>(k) * T);
      }
    }
    return x;
  };
  const auto whole = amplitude_spectrum(chord(100000, 1e-3), 1_ms).value();
  for (const double f : tones) {
    const auto bin = static_cast<Eigen::Index>(std::lround(f * 100.0));
    EXPECT_NEAR(whole.frequency(bin), 2.0 * pi * f, 1e-9);
    EXPECT_NEAR(std::abs(whole.amplitude(bin) - Complex(0.0, -1.0)), 0.0, 1e-8);
  }
  EXPECT_NEAR(whole.amplitude(0).real(), 0.25, 1e-12);
  EXPECT_NEAR(whole.bandwidth, 2.0 * pi / 100.0, 1e-12);

  const auto some = amplitude_spectrum(chord(777, 1e-3), 1_ms, Window::flat_top).value();
  for (const double f : tones) {
    const auto bin = static_cast<Eigen::Index>(std::lround(f * 0.777));
    EXPECT_NEAR(std::abs(some.amplitude(bin)), 1.0, 2e-3);
  }
}

// From a twentieth of a second, in which no tone has whole periods, the chord exactly.
TEST(FitTones, FindsTheChord) {
  VectorXd w(3);
  w << 2.0 * pi * 349.23, 2.0 * pi * 440.0, 2.0 * pi * 261.63;
  const Complex wanted[] = {{1.0, 0.5}, {0.0, -1.0}, {-0.3, 0.2}};
  VectorXd x = VectorXd::Constant(500, -0.7);
  for (int k = 0; k < 500; ++k) {
    for (int i = 0; i < 3; ++i) {
      x(k) += (wanted[i] * std::polar(1.0, w(i) * k * 1e-4)).real();
    }
  }
  const auto found = fit_tones(x, 100_us, w).value();
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::abs(found.amplitude(i) - wanted[i]), 0.0, 1e-12);
  }
  EXPECT_NEAR(found.mean, -0.7, 1e-13);
  EXPECT_NEAR(found.rest, 0.0, 1e-13);
}

TEST(Projections, Refuse) {
  EXPECT_EQ(to_string(coordinates(Eigen::Matrix2d::Ones(), Eigen::Vector2d::Ones()).error()),
            "coordinates: basis is dependent, or with a zero vector; it must be of independent "
            "vectors");
  EXPECT_TRUE(coordinates(Eigen::Matrix2d::Identity(), Eigen::Vector3d::Ones())
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(coordinates(Eigen::MatrixXd(), VectorXd()).error().is(ArgumentError::empty));
  EXPECT_TRUE(
      laplace_transform(VectorXd(), 1_s, VectorXcd::Zero(1)).error().is(ArgumentError::empty));
  EXPECT_TRUE(laplace_transform(VectorXd::Ones(1000), 1_s, VectorXcd::Constant(1, -1.0))
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      amplitude_spectrum(VectorXd::Constant(3, nan), 1_s).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(
      amplitude_spectrum(VectorXd::Ones(3), Time(0.0)).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(fit_tones(VectorXd::Ones(9), 1_s, VectorXd::Constant(1, 4.0))
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(fit_tones(VectorXd::Ones(9), 1_s, VectorXd::Constant(2, 1.0))
                  .error()
                  .is(ArgumentError::malformed));
  EXPECT_TRUE(fit_tones(VectorXd::Ones(2), 1_s, VectorXd::Constant(1, 1.0))
                  .error()
                  .is(ArgumentError::malformed));
}

}  // namespace
}  // namespace flyball::projection_test
