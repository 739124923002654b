#include <flyball/core/random.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace flyball::random_test {
namespace {

// Made with an independent implementation in Python's unbounded integers:
//   M = 2**64 - 1; rot = lambda x, k: ((x << k) | (x >> (64 - k))) & M
//   def splitmix(s):
//       s = (s + 0x9e3779b97f4a7c15) & M; z = ((s ^ (s >> 30)) * 0xbf58476d1ce4e5b9) & M
//       z = ((z ^ (z >> 27)) * 0x94d049bb133111eb) & M; return s, z ^ (z >> 31)
//   def xoshiro(seed, n):
//       s, out = [], []
//       for _ in range(4): seed, w = splitmix(seed); s.append(w)
//       for _ in range(n):
//           out.append((rot((s[0] + s[3]) & M, 23) + s[0]) & M); t = (s[1] << 17) & M
//           s[2] ^= s[0]; s[3] ^= s[1]; s[1] ^= s[2]; s[0] ^= s[3]; s[2] ^= t; s[3] = rot(s[3], 45)
//       return [hex(w) for w in out]
//   for seed in (0, 42, M): print(xoshiro(seed, 4))
struct KnownAnswer {
  std::uint64_t seed;
  std::array<std::uint64_t, 4> bits;
};
constexpr std::array known_answers{
    KnownAnswer{0,
                {0x53175d61490b23dfULL, 0x61da6f3dc380d507ULL, 0x5c0fdf91ec9a7bfcULL,
                 0x02eebf8c3bbe5e1aULL}},
    KnownAnswer{42,
                {0xd0764d4f4476689fULL, 0x519e4174576f3791ULL, 0xfbe07cfb0c24ed8cULL,
                 0xb37d9f600cd835b8ULL}},
    KnownAnswer{std::numeric_limits<std::uint64_t>::max(),
                {0x56ccf8ce948e27b2ULL, 0xe68588432e5a5b90ULL, 0xe3e9b5a48119ca8bULL,
                 0x460f19495532ae73ULL}},
};

TEST(Random, GivesTheSequenceOfItsSeed) {
  for (const KnownAnswer& known : known_answers) {
    Random random(known.seed);
    for (const std::uint64_t bits : known.bits) {
      EXPECT_EQ(random.bits(), bits) << "seed " << known.seed;
    }
  }
}

// 0xd0764d4f4476689f >> 11 is 7334608696282829, times 2⁻⁵³ is 0.81430514512290986.
TEST(Random, UniformIsTheUpperBitsAsAFraction) {
  Random random(42);
  EXPECT_EQ(random.uniform(), 0.81430514512290986);
  Random scaled(42);
  EXPECT_EQ(scaled.uniform(-2.0, 3.0), -2.0 + 5.0 * 0.81430514512290986);
}

struct Moments {
  double mean = 0.0;
  double variance = 0.0;
  double skewness = 0.0;
  double kurtosis = 0.0;
};

Moments moments(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  Moments m;
  for (const double v : values) {
    m.mean += v / n;
  }
  for (const double v : values) {
    const double d = v - m.mean;
    m.variance += d * d / n;
    m.skewness += d * d * d / n;
    m.kurtosis += d * d * d * d / n;
  }
  m.skewness /= std::pow(m.variance, 1.5);
  m.kurtosis /= m.variance * m.variance;
  return m;
}

// Limits are four standard errors for n = 200 000 draws.
constexpr int draws = 200'000;
const double root_n = std::sqrt(static_cast<double>(draws));

// Mean 1/2, variance 1/12, skewness 0, kurtosis 9/5; all in [0, 1).
TEST(Random, UniformHasTheMomentsOfTheUniformDistribution) {
  Random random(1);
  std::vector<double> values(draws);
  for (double& v : values) {
    v = random.uniform();
    ASSERT_GE(v, 0.0);
    ASSERT_LT(v, 1.0);
  }
  const Moments m = moments(values);
  EXPECT_NEAR(m.mean, 0.5, 4.0 * std::sqrt(1.0 / 12.0) / root_n);
  EXPECT_NEAR(m.variance, 1.0 / 12.0, 4.0 * std::sqrt(1.0 / 180.0) / root_n);
  EXPECT_NEAR(m.skewness, 0.0, 4.0 * std::sqrt(6.0) / root_n);
  EXPECT_NEAR(m.kurtosis, 1.8, 4.0 * std::sqrt(24.0) / root_n);
}

// Mean 0, variance 1 (standard error √(2/n)), skewness 0 (√(6/n)), kurtosis 3 (√(24/n)).
TEST(Random, NormalHasTheMomentsOfTheNormalDistribution) {
  Random random(2);
  std::vector<double> values(draws);
  for (double& v : values) {
    v = random.normal();
    ASSERT_TRUE(std::isfinite(v));
  }
  const Moments m = moments(values);
  EXPECT_NEAR(m.mean, 0.0, 4.0 / root_n);
  EXPECT_NEAR(m.variance, 1.0, 4.0 * std::sqrt(2.0) / root_n);
  EXPECT_NEAR(m.skewness, 0.0, 4.0 * std::sqrt(6.0) / root_n);
  EXPECT_NEAR(m.kurtosis, 3.0, 4.0 * std::sqrt(24.0) / root_n);

  // The two numbers that one round of the polar method gives do not depend on each other.
  double correlation = 0.0;
  for (std::size_t i = 0; i + 1 < values.size(); i += 2) {
    correlation += values[i] * values[i + 1] / (draws / 2.0);
  }
  EXPECT_NEAR(correlation, 0.0, 4.0 * std::sqrt(2.0) / root_n);
}

// P(|z| < 1) = 0.6826894921, P(|z| < 2) = 0.9544997361, P(|z| < 3) = 0.9973002039.
TEST(Random, NormalHasTheTailsOfTheNormalDistribution) {
  Random random(3);
  std::array<int, 3> within{};
  for (int i = 0; i < draws; ++i) {
    const double z = std::abs(random.normal());
    for (std::size_t k = 0; k < within.size(); ++k) {
      within[k] += z < static_cast<double>(k + 1) ? 1 : 0;
    }
  }
  constexpr std::array expected{0.6826894921, 0.9544997361, 0.9973002039};
  for (std::size_t k = 0; k < within.size(); ++k) {
    const double p = expected[k];
    EXPECT_NEAR(within[k] / static_cast<double>(draws), p, 4.0 * std::sqrt(p * (1.0 - p)) / root_n);
  }
}

TEST(Random, NormalIsScaledAndShifted) {
  Random standard(4);
  Random scaled(4);
  for (int i = 0; i < 10; ++i) {
    EXPECT_DOUBLE_EQ(scaled.normal(5.0, 0.25), 5.0 + 0.25 * standard.normal());
  }
}

TEST(Random, ASplitDoesNotDependOnWhatTheOtherDraws) {
  Random a(7);
  Random b(7);
  Random child_of_a = a.split();
  Random child_of_b = b.split();
  for (int i = 0; i < 100; ++i) {
    (void)a.bits();
  }
  EXPECT_EQ(child_of_a.bits(), child_of_b.bits());
  // A normal that is kept for the next call stays with the one that made it.
  Random c(7);
  (void)c.normal();
  Random child_of_c = c.split();
  Random twin = child_of_c;
  EXPECT_EQ(child_of_c.normal(), twin.normal());
}

TEST(Random, ASplitIsUncorrelatedWithItsParent) {
  Random parent(8);
  Random child = parent.split();
  double correlation = 0.0;
  for (int i = 0; i < draws; ++i) {
    correlation += parent.normal() * child.normal() / draws;
  }
  EXPECT_NEAR(correlation, 0.0, 4.0 / root_n);
}

}  // namespace
}  // namespace flyball::random_test
