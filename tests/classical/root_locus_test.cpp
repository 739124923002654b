#include <flyball/classical/root_locus.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "classical/transfer_cases.hpp"

namespace flyball::classical::root_locus_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using flyball::test::transfer;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// k(s+4)/(s(s+1)(s+2)(s+6)) and the like have their numbers in textbooks; these are small enough
/// to work out.
TEST(RootLocus, TwoPolesMeet) {
  // s² + 2s + k: -1 ± √(1 - k).
  const auto locus = root_locus(transfer({1}, {1, 2, 0})).value();
  ASSERT_EQ(locus.branch_points.size(), 1U);
  EXPECT_NEAR(std::abs(locus.branch_points[0].point + 1.0), 0.0, 1e-15);
  EXPECT_NEAR(locus.branch_points[0].gain, 1.0, 1e-15);
  EXPECT_EQ(locus.branch_points[0].branches, 2);
  EXPECT_DOUBLE_EQ(locus.asymptotes.center, -1.0);
  EXPECT_EQ(locus.asymptotes.angles, (std::vector<double>{-90.0, 90.0}));
  ASSERT_EQ(locus.stable_gains.size(), 1U);
  EXPECT_EQ(locus.stable_gains[0].low, 0.0);
  EXPECT_EQ(locus.stable_gains[0].high, infinity);
  bool met = false;
  for (Index i = 0; i < locus.gains.size(); ++i) {
    const double k = locus.gains(i);
    met = met || locus.branches(i, 0) == locus.branches(i, 1);
    const Complex root = std::sqrt(Complex(1.0 - k));
    const double off = std::min(std::abs(locus.branches(i, 0) + 1.0 - root),
                                std::abs(locus.branches(i, 0) + 1.0 + root));
    // A root moves by the rounding of 1 + kL over its slope.
    EXPECT_LE(off, 2e-15 * (1.0 + std::abs(root) + 1.0 / std::max(std::abs(root), 1e-8)))
        << "k = " << k;
  }
  EXPECT_TRUE(met);
}

TEST(RootLocus, ThirdOrder) {
  // s(s+1)(s+2) + k: breakaway at -1 + 1/√3 with k = 2/(3√3), the axis at ω = √2 with k = 6.
  const auto locus = root_locus(transfer({1}, {1, 3, 2, 0})).value();
  ASSERT_EQ(locus.branch_points.size(), 1U);
  EXPECT_NEAR(locus.branch_points[0].point.real(), -1.0 + 1.0 / std::sqrt(3.0), 1e-15);
  EXPECT_NEAR(locus.branch_points[0].gain, 2.0 / (3.0 * std::sqrt(3.0)), 1e-15);
  ASSERT_EQ(locus.crossings.size(), 1U);
  EXPECT_NEAR(locus.crossings[0].frequency, std::sqrt(2.0), 1e-15);
  EXPECT_NEAR(locus.crossings[0].gain, 6.0, 1e-14);
  ASSERT_EQ(locus.stable_gains.size(), 1U);
  EXPECT_NEAR(locus.stable_gains[0].high, 6.0, 1e-14);
  EXPECT_EQ(locus.asymptotes.angles, (std::vector<double>{-60.0, 60.0, 180.0}));
  // Negative gains: breakaway at -1 - 1/√3, unstable at once through s = 0.
  const auto negative = root_locus(transfer({1}, {1, 3, 2, 0}), {.negative = true}).value();
  ASSERT_EQ(negative.branch_points.size(), 1U);
  EXPECT_NEAR(negative.branch_points[0].point.real(), -1.0 - 1.0 / std::sqrt(3.0), 1e-15);
  EXPECT_NEAR(negative.branch_points[0].gain, -2.0 / (3.0 * std::sqrt(3.0)), 1e-15);
  EXPECT_TRUE(negative.stable_gains.empty());
  EXPECT_LE(negative.gains.maxCoeff(), 0.0);
}

TEST(RootLocus, DepartureAndArrival) {
  // 1/(s(s² + 2s + 2)): from -1 + j by 180 - 135 - 90 = -45 degrees.
  const auto locus = root_locus(transfer({1}, {1, 2, 2, 0})).value();
  bool seen = false;
  for (const LocusAngles& departure : locus.departures) {
    if (departure.root.imag() > 0.5) {
      seen = true;
      ASSERT_EQ(departure.angles.size(), 1U);
      EXPECT_NEAR(departure.angles[0], -45.0, 1e-12);
    }
  }
  EXPECT_TRUE(seen);
  // (s² + 1)/s²: at j by arg(-1/((2j)(j)⁻²)) = arg(-1/(-2j)) = arg(-j/2)... = -90; the branches run
  // along the axis from 0, so they stand below the zero.
  const auto zeros = root_locus(transfer({1, 0, 1}, {1, 0, 0})).value();
  for (const LocusAngles& arrival : zeros.arrivals) {
    EXPECT_NEAR(arrival.angles.at(0), arrival.root.imag() > 0.0 ? -90.0 : 90.0, 1e-12);
  }
  EXPECT_TRUE(zeros.stable_gains.empty());
}

TEST(RootLocus, PolesAtOnePlace) {
  // (s + 1)⁵ + k: rays from -1 at 36, 108 and 180 degrees, though its coefficients make five poles.
  const auto locus = root_locus(transfer({1}, {1, 5, 10, 10, 5, 1})).value();
  ASSERT_EQ(locus.departures.size(), 1U);
  ASSERT_EQ(locus.departures[0].angles.size(), 5U);
  EXPECT_NEAR(locus.departures[0].angles[4], 180.0, 1e-12);
  EXPECT_NEAR(locus.departures[0].angles[3], 108.0, 1e-12);
  for (Index i = 1; i < locus.gains.size(); ++i) {
    const double radius = std::pow(locus.gains(i), 0.2);
    for (Index b = 0; b < 5; ++b) {
      EXPECT_NEAR(std::abs(locus.branches(i, b) + 1.0) / radius, 1.0, 5e-13);
    }
  }
  // The axis at ω = tan 36° with k = sec⁵ 36°.
  ASSERT_EQ(locus.crossings.size(), 1U);
  EXPECT_NEAR(locus.crossings[0].frequency, std::tan(std::acos(-1.0) / 5.0), 1e-14);
  EXPECT_NEAR(locus.crossings[0].gain, std::pow(1.0 / std::cos(std::acos(-1.0) / 5.0), 5.0), 1e-13);
}

TEST(RootLocus, ThreeMeetAtOnePoint) {
  // L = 1/((s + 1)³ - 1): (s + 1)³ = 1 - k, three branches meet at -1 for k = 1.
  const auto locus = root_locus(transfer({1}, {1, 3, 3, 0})).value();
  ASSERT_EQ(locus.branch_points.size(), 1U);
  EXPECT_EQ(locus.branch_points[0].branches, 3);
  EXPECT_NEAR(std::abs(locus.branch_points[0].point + 1.0), 0.0, 1e-8);
  EXPECT_NEAR(locus.branch_points[0].gain, 1.0, 1e-15);
}

TEST(RootLocus, ThroughInfinity) {
  // 1 + k(1 - s)/(s + 2) = 0: s = -(2 + k)/(1 - k), through infinity at k = 1.
  const auto locus = root_locus(transfer({-1, 1}, {1, 2})).value();
  bool infinite = false;
  for (Index i = 0; i < locus.gains.size(); ++i) {
    const double k = locus.gains(i);
    if (std::isnan(locus.branches(i, 0).real())) {
      infinite = true;
      EXPECT_DOUBLE_EQ(k, 1.0);
      continue;
    }
    const double s = -(2.0 + k) / (1.0 - k);
    EXPECT_NEAR(locus.branches(i, 0).real() / s, 1.0, 4e-15 / std::abs(1.0 - k) + 1e-14);
  }
  EXPECT_TRUE(infinite);
  ASSERT_EQ(locus.stable_gains.size(), 1U);
  EXPECT_DOUBLE_EQ(locus.stable_gains[0].high, 1.0);
}

TEST(RootLocus, ThroughInfinityBesideAnother) {
  // Zeros at ±3e4: near k = 1/0.12 both branches are far out before one is at infinity.
  const auto locus = root_locus(transfer({-0.12, -0.9, 1e8}, {1, -0.5, -1.2}));
  ASSERT_TRUE(locus) << to_string(locus.error());
  EXPECT_EQ(locus->branches.cols(), 2);
}

TEST(RootLocus, ConditionallyStable) {
  // s³ + k(s + 0.5)²... : by Routh s³ + k s² + k s + k/4: stable for k > 1/4.
  const auto locus = root_locus(transfer({1, 1, 0.25}, {1, 0, 0, 0})).value();
  ASSERT_EQ(locus.stable_gains.size(), 1U);
  EXPECT_NEAR(locus.stable_gains[0].low, 0.25, 1e-14);
  EXPECT_EQ(locus.stable_gains[0].high, infinity);
}

TEST(RootLocus, Discrete) {
  // z - 1 + k: stable for 0 < k < 2, through -1.
  const auto L = TransferFunction::create(flyball::test::vector_of({1.0}),
                                          flyball::test::vector_of({1.0, -1.0}), Time(0.1))
                     .value();
  const auto locus = root_locus(L).value();
  ASSERT_EQ(locus.crossings.size(), 1U);
  EXPECT_NEAR(locus.crossings[0].gain, 2.0, 1e-15);
  EXPECT_NEAR(locus.crossings[0].frequency, std::acos(-1.0) / 0.1, 1e-12);
  ASSERT_EQ(locus.stable_gains.size(), 1U);
  EXPECT_NEAR(locus.stable_gains[0].high, 2.0, 1e-15);
  // A sample late: z² - z + k has its roots on the circle for k = 1, at 60 degrees.
  const auto late =
      TransferFunction::create(flyball::test::vector_of({1.0}),
                               flyball::test::vector_of({1.0, -1.0}), Time(0.1), Time(0.1))
          .value();
  const auto with_delay = root_locus(late).value();
  EXPECT_EQ(with_delay.poles.size(), 2);
  ASSERT_GE(with_delay.crossings.size(), 1U);
  EXPECT_NEAR(with_delay.crossings[0].gain, 1.0, 1e-14);
  EXPECT_NEAR(with_delay.crossings[0].frequency, std::acos(0.5) / 0.1, 1e-12);
}

/// Random loops with real and complex poles and zeros of sizes over two decades.
TransferFunction random_loop(Random& random, int order, bool discrete) {
  const auto roots = [&](int count) {
    VectorXcd all(count);
    for (int i = 0; i < count;) {
      const double size =
          discrete ? random.uniform(0.05, 1.1) : std::pow(10.0, random.uniform(-1.0, 1.0));
      if (count - i >= 2 && random.uniform() < 0.5) {
        const Complex root = std::polar(size, random.uniform(0.1, 3.1));
        all(i) = root;
        all(i + 1) = std::conj(root);
        i += 2;
      } else {
        all(i++) = random.uniform() < 0.8 ? -size : size;
      }
    }
    return all;
  };
  const int zeros = static_cast<int>(random.uniform(0.0, order + 0.999));
  const double gain = random.uniform() < 0.8 ? 1.0 : -1.0;
  return TransferFunction::from_zeros(roots(zeros), roots(order), gain,
                                      discrete ? std::optional(Time(0.1)) : std::nullopt)
      .value();
}

/// Every point is on the locus, the branches are whole, mirrored, and begin and end where they
/// must.
void check_laws(const TransferFunction& L, const RootLocus& locus, double sign) {
  const Index n = locus.poles.size();
  ASSERT_EQ(locus.branches.cols(), n);
  const double far = std::max(1.0, locus.branches.row(1).cwiseAbs().maxCoeff());
  for (Index i = 0; i < locus.gains.size(); ++i) {
    const double k = locus.gains(i);
    EXPECT_GE(sign * k, 0.0);
    if (i > 0) {
      EXPECT_GT(std::abs(k), std::abs(locus.gains(i - 1)));
    }
    Complex sum = 0.0;
    for (Index b = 0; b < n; ++b) {
      const Complex s = locus.branches(i, b);
      if (std::isnan(s.real())) {
        continue;
      }
      sum += s.imag();
      // |D + kN| against the rounding of its own terms.
      Complex value = 0.0;
      double size = 0.0;
      const VectorXd num = L.num();
      for (Index c = 0; c < L.den().size(); ++c) {
        const Index shift = L.den().size() - num.size();
        const double coefficient = L.den()(c) + (c >= shift ? k * num(c - shift) : 0.0);
        const double terms =
            std::abs(L.den()(c)) + (c >= shift ? std::abs(k * num(c - shift)) : 0.0);
        value = value * s + coefficient;
        size = size * std::abs(s) + terms;
      }
      EXPECT_LE(std::abs(value), 3e-13 * size) << "k = " << k << ", s = " << s;
    }
    EXPECT_LE(std::abs(sum), 1e-12 * far * static_cast<double>(n));
  }
}

/// ds/d ln k by the polynomials.
Complex slope_of(const TransferFunction& L, double k, Complex s) {
  const auto value_and_slope = [&](const VectorXd& p) {
    std::pair<Complex, Complex> v{0.0, 0.0};
    for (const double c : p) {
      v.second = v.second * s + v.first;
      v.first = v.first * s + c;
    }
    return v;
  };
  const auto num = value_and_slope(L.num());
  const auto den = value_and_slope(L.den());
  return -k * num.first / (den.second + k * num.second);
}

/// No branch jumps to another: of all that are there after a step, its own is the one to which its
/// slopes at both ends lead.
int check_continuity(const TransferFunction& L, const RootLocus& locus) {
  int compared = 0;
  for (Index i = 2; i < locus.gains.size(); ++i) {
    const double h = std::log(locus.gains(i) / locus.gains(i - 1));
    if (h < 2e-7) {
      continue;  // where branches meet
    }
    for (Index b = 0; b < locus.branches.cols(); ++b) {
      const Complex before = locus.branches(i - 1, b);
      const Complex now = locus.branches(i, b);
      if (std::isnan(now.real()) || std::isnan(before.real())) {
        continue;
      }
      const auto missed = [&](Complex s) {
        return std::abs(
            before - s +
            0.5 * h * (slope_of(L, locus.gains(i - 1), before) + slope_of(L, locus.gains(i), s)));
      };
      const double own = missed(now);
      for (Index other = 0; other < locus.branches.cols(); ++other) {
        const Complex s = locus.branches(i, other);
        if (other != b && !std::isnan(s.real())) {
          EXPECT_LE(own, missed(s) + 1e-9 * std::abs(now)) << "at k = " << locus.gains(i);
          ++compared;
        }
      }
    }
  }
  return compared;
}

TEST(RootLocus, LawsOfRandomLoops) {
  Random random(3);
  int seen = 0;
  int compared = 0;
  double longest = 0.0;
  for (int i = 0; i < 400; ++i) {
    const int order = 1 + static_cast<int>(random.uniform(0.0, 7.999));
    const bool discrete = random.uniform() < 0.3;
    const TransferFunction L = random_loop(random, order, discrete);
    for (const bool negative : {false, true}) {
      const auto locus = root_locus(L, {.negative = negative});
      ASSERT_TRUE(locus) << to_string(locus.error()) << "\n"
                         << L.num().transpose() << "\n"
                         << L.den().transpose();
      check_laws(L, *locus, negative ? -1.0 : 1.0);
      compared += check_continuity(L, *locus);
      longest = std::max(longest, static_cast<double>(locus->gains.size()));
      ++seen;
      if (HasFailure()) {
        FAIL() << L.num().transpose() << "\n"
               << L.den().transpose() << "\n"
               << negative << discrete;
      }
    }
  }
  EXPECT_EQ(seen, 800);
  EXPECT_GT(compared, 200'000);
  EXPECT_LE(longest, 4000.0);
}

TEST(RootLocus, StableGainsOfRandomLoops) {
  Random random(4);
  int inside = 0;
  int outside = 0;
  for (int i = 0; i < 300; ++i) {
    const int order = 1 + static_cast<int>(random.uniform(0.0, 6.999));
    const bool discrete = random.uniform() < 0.3;
    const TransferFunction L = random_loop(random, order, discrete);
    const auto locus = root_locus(L).value();
    for (int k = 0; k < 10; ++k) {
      const double gain = std::pow(10.0, random.uniform(-4.0, 4.0));
      const bool said = std::any_of(
          locus.stable_gains.begin(), locus.stable_gains.end(),
          [&](const GainRange& range) { return gain > range.low && gain < range.high; });
      const bool near = std::any_of(
          locus.crossings.begin(), locus.crossings.end(),
          [&](const BorderCrossing& at) { return std::abs(at.gain / gain - 1.0) < 1e-6; });
      VectorXd den = L.den();
      den.tail(L.num().size()) += gain * L.num();
      const auto closed = TransferFunction::create(VectorXd::Ones(1), den, L.period());
      if (near || !closed || closed->order() < L.order()) {
        continue;
      }
      EXPECT_EQ(closed->is_stable().value(), said) << "k = " << gain << "\n"
                                                   << L.num().transpose() << "\n"
                                                   << L.den().transpose();
      ++(said ? inside : outside);
    }
  }
  EXPECT_GT(inside, 200);
  EXPECT_GT(outside, 200);
}

TEST(RootLocus, OfStateSpace) {
  Random random(8);
  for (int i = 0; i < 200; ++i) {
    const int order = 1 + static_cast<int>(random.uniform(0.0, 5.999));
    const TransferFunction L = random_loop(random, order, false);
    const auto by_transfer = root_locus(L).value();
    const auto by_states = root_locus(L.to_state_space()).value();
    ASSERT_EQ(by_states.zeros.size(), by_transfer.zeros.size());
    ASSERT_EQ(by_states.crossings.size(), by_transfer.crossings.size());
    for (std::size_t k = 0; k < by_states.crossings.size(); ++k) {
      EXPECT_NEAR(by_states.crossings[k].gain / by_transfer.crossings[k].gain, 1.0, 1e-6);
    }
    ASSERT_EQ(by_states.branch_points.size(), by_transfer.branch_points.size());
    for (std::size_t k = 0; k < by_states.branch_points.size(); ++k) {
      EXPECT_NEAR(by_states.branch_points[k].gain / by_transfer.branch_points[k].gain, 1.0, 1e-5);
    }
  }
}

TEST(RootLocus, AtADampingRatio) {
  // s² + 2s + k has ζ = 1/√k.
  const TransferFunction L = transfer({1}, {1, 2, 0});
  const auto points = locus_at_damping(L, 0.5).value();
  ASSERT_EQ(points.size(), 1U);
  EXPECT_NEAR(points[0].gain, 4.0, 1e-12);
  EXPECT_NEAR(std::abs(points[0].point - Complex(-1.0, std::sqrt(3.0))), 0.0, 1e-12);
  // Discrete: the pole found has that ratio by ln z.
  const auto sampled =
      TransferFunction::create(flyball::test::vector_of({0.1, 0.08}),
                               flyball::test::vector_of({1.0, -1.6, 0.6}), Time(0.1))
          .value();
  const auto found = locus_at_damping(sampled, 0.5).value();
  ASSERT_FALSE(found.empty());
  for (const LocusPoint& point : found) {
    const Complex s = std::log(point.point);
    EXPECT_NEAR(-s.real() / std::abs(s), 0.5, 1e-12);
    EXPECT_NEAR(std::abs(1.0 + point.gain * sampled.at(point.point).value()), 0.0, 1e-11);
  }
}

TEST(RootLocus, GainAtAPoint) {
  const TransferFunction L = transfer({1}, {1, 2, 0});
  const auto on = gain_at_point(L, Complex(-1.0, 2.0)).value();
  EXPECT_NEAR(on.gain, 5.0, 1e-14);
  EXPECT_NEAR(on.angle, 0.0, 1e-12);
  EXPECT_LT(gain_at_point(L, 1.0).value().gain, 0.0);
  EXPECT_TRUE(gain_at_point(L, 0.0).error().is(TransferError::at_a_pole));
}

TEST(RootLocus, Refusals) {
  EXPECT_TRUE(root_locus(transfer({1}, {1, 1}, 0.1)).error().is(TransferError::delay_in_loop));
  EXPECT_TRUE(root_locus(transfer({0}, {1, 1})).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(root_locus(transfer({2}, {1})).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(root_locus(transfer({1}, {1, 1}), {.largest_gain = 0.0})
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(locus_at_damping(transfer({1}, {1, 1}), 1.0).error().is(ArgumentError::out_of_range));
}

TEST(RootLocus, UpToAGain) {
  const auto locus = root_locus(transfer({1}, {1, 3, 2, 0}), {.largest_gain = 10.0}).value();
  EXPECT_DOUBLE_EQ(locus.gains(locus.gains.size() - 1), 10.0);
}

TEST(RootLocus, ThirtyPoles) {
  Random random(30);
  for (int i = 0; i < 5; ++i) {
    const TransferFunction L = random_loop(random, 30, false);
    const auto locus = root_locus(L);
    ASSERT_TRUE(locus) << to_string(locus.error());
    EXPECT_GT(check_continuity(L, *locus), 10'000);
  }
}

}  // namespace
}  // namespace flyball::classical::root_locus_test
