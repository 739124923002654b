#include <flyball/math/spectra/fft.hpp>

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "support/allocation_count.hpp"

namespace flyball::fft_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;

VectorXcd noise(Index n, std::uint64_t seed) {
  Random random(seed);
  VectorXcd x(n);
  for (Complex& value : x) {
    value = {random.normal(), random.normal()};
  }
  return x;
}

/// The definition, with sums and twiddle factors of 64 bits: three digits more than doubles have.
VectorXcd direct(const VectorXcd& x) {
  const Index n = x.size();
  std::vector<long double> cosine;
  std::vector<long double> sine;
  for (Index k = 0; k < n; ++k) {
    const long double angle = 2.0L * std::numbers::pi_v<long double> * static_cast<long double>(k) /
                              static_cast<long double>(n);
    cosine.push_back(std::cos(angle));
    sine.push_back(std::sin(angle));
  }
  VectorXcd X(n);
  for (Index k = 0; k < n; ++k) {
    long double re = 0.0L;
    long double im = 0.0L;
    for (Index j = 0; j < n; ++j) {
      const auto at = static_cast<std::size_t>((j * k) % n);
      re += x(j).real() * cosine[at] + x(j).imag() * sine[at];
      im += x(j).imag() * cosine[at] - x(j).real() * sine[at];
    }
    X(k) = {static_cast<double>(re), static_cast<double>(im)};
  }
  return X;
}

// Every length to 130, and some of each way: powers, mixed, primes small and large.
TEST(Fft, IsTheDefinition) {
  std::vector<Index> lengths{256, 360, 343, 499, 512, 961, 997, 1000, 1022};
  for (Index n = 1; n <= 130; ++n) {
    lengths.push_back(n);
  }
  for (const Index n : lengths) {
    const VectorXcd x = noise(n, static_cast<std::uint64_t>(n));
    const VectorXcd expected = direct(x);
    const VectorXcd X = fft(x).value();
    EXPECT_LT((X - expected).norm(), 1e-15 * expected.norm()) << n;
    EXPECT_LT((inverse_fft(X).value() - x).norm(), 1.5e-15 * x.norm()) << n;
    const VectorXd real = x.real();
    const VectorXcd half = real_fft(real).value();
    ASSERT_EQ(half.size(), n / 2 + 1);
    const VectorXcd whole = direct(real.cast<Complex>());
    EXPECT_LT((half - whole.head(n / 2 + 1)).norm(), 1e-15 * whole.norm()) << n;
    EXPECT_LT((inverse_real_fft(half, n).value() - real).norm(), 1.5e-15 * real.norm()) << n;
  }
}

// A line of frequency k is n at k and rounding elsewhere, for a million points, too.
TEST(Fft, LongLengths) {
  for (const Index n : {Index{1} << 20, Index{1'000'000}, Index{999'983}}) {
    VectorXcd x(n);
    const Index line = 12'345;
    for (Index j = 0; j < n; ++j) {
      const double angle =
          2.0 * std::numbers::pi * static_cast<double>((j * line) % n) / static_cast<double>(n);
      x(j) = std::polar(1.0, angle);
    }
    VectorXcd X = fft(x).value();
    EXPECT_NEAR(std::abs(X(line) - static_cast<double>(n)), 0.0, 1e-8);
    X(line) = 0.0;
    EXPECT_LT(X.norm(), 3e-15 * static_cast<double>(n)) << n;
    // Parseval.
    const VectorXcd random = noise(n, 3);
    EXPECT_NEAR(fft(random)->squaredNorm() / (static_cast<double>(n) * random.squaredNorm()), 1.0,
                1e-13);
  }
}

TEST(Fft, DoesNotAllocate) {
  for (const Index n : {64, 97, 300}) {
    Fft plan = Fft::create(n).value();
    RealFft real = RealFft::create(n).value();
    VectorXcd x = noise(n, 1);
    VectorXd r = x.real();
    VectorXcd bins(real.bins());
    const test::AllocationCounter allocations;
    plan.forward(x.data(), x.data());
    plan.inverse(x.data(), x.data());
    real.forward(r.data(), bins.data());
    real.inverse(bins.data(), r.data());
    if (test::counts_allocations()) {
      EXPECT_EQ(allocations.count(), 0u);
    }
    EXPECT_LT((x - noise(n, 1)).norm(), 1e-13);
  }
}

TEST(Fft, Refusals) {
  EXPECT_TRUE(Fft::create(0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(fft(VectorXcd()).error().is(ArgumentError::empty));
  EXPECT_TRUE(inverse_real_fft(VectorXcd::Zero(3), 7).error().is(ArgumentError::wrong_shape));
}

}  // namespace
}  // namespace flyball::fft_test
