#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/math/integration/quadrature.hpp>

// Table E.1 the other way around: each transform, inverted by a contour integral, is its signal
// again.
namespace flyball::book::laplace_pairs_test {
namespace {

using Complex = std::complex<double>;

/// f(t) = 1/2πj ∫ F(s) e^{st} ds along Talbot's contour s = r θ(cot θ + j) with r = 2M/5t.
/// Source: Abate and Valkó, International Journal for Numerical Methods in Engineering 60 (2004).
template <class Transform>
double inverse(Transform&& F, double t) {
  constexpr int M = 24;
  const double r = 2.0 * M / (5.0 * t);
  double sum = 0.5 * std::exp(r * t) * F(Complex(r)).real();
  for (int k = 1; k < M; ++k) {
    const double angle = k * std::numbers::pi / M;
    const double cotangent = std::cos(angle) / std::sin(angle);
    const Complex s = r * angle * Complex(cotangent, 1.0);
    const double slope = angle + (angle * cotangent - 1.0) * cotangent;
    sum += (std::exp(t * s) * F(s) * Complex(1.0, slope)).real();
  }
  return sum * r / M;
}

TEST(LaplacePairs, TransformBackToTheirSignals) {
  const auto f = [](double t) { return t * t * std::exp(-t); };
  const auto g = [](double t) { return std::exp(-0.5 * t) * std::sin(2.0 * t); };
  const auto F = [](Complex s) { return 2.0 / ((s + 1.0) * (s + 1.0) * (s + 1.0)); };
  const auto G = [](Complex s) { return 2.0 / ((s + 0.5) * (s + 0.5) + 4.0); };
  for (const double t : {0.2, 0.5, 1.0, 2.0, 3.5}) {
    const auto expect = [&](auto&& transform, double signal) {
      EXPECT_NEAR(inverse(transform, t), signal, 1e-8) << t;
    };
    expect([&](Complex s) { return 3.0 * F(s) - 2.0 * G(s); }, 3.0 * f(t) - 2.0 * g(t));
    expect([&](Complex s) { return F(s) * G(s); },
           quadrature([&](double tau) { return f(tau) * g(t - tau); }, 0.0, t).value().value);
    expect([&](Complex s) { return s * F(s); }, (2.0 * t - t * t) * std::exp(-t));
    expect([&](Complex s) { return s * s * F(s); }, (2.0 - 4.0 * t + t * t) * std::exp(-t));
    expect([](Complex s) { return 1.0 / s; }, 1.0);
    expect([](Complex s) { return 1.0 / (s * s); }, t);
    expect([](Complex s) { return 1.0 / (s + 2.0); }, std::exp(-2.0 * t));
  }
}

}  // namespace
}  // namespace flyball::book::laplace_pairs_test
