#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/expression/tape_builder.hpp>

#include "math/verified/interval_tape.hpp"

namespace flyball::detail::interval_tape_test {
namespace {

using expression::Operation;
using expression::Slot;

// Every operation, over random intervals: what it makes of numbers in them is in the result. sin
// and cos are held to the extended precision's.
TEST(IntervalFunctions, HoldWhatTheyBound) {
  Random random(6);
  const auto interval = [&](double reach) {
    const double centre = random.uniform(-reach, reach);
    const double half = reach * std::exp(random.uniform(-12.0, 0.0));
    return Interval(centre - half, centre + half);
  };
  const auto draw = [&](const Interval& x) {
    const double share = random.uniform();
    return share < 0.1 ? x.low : share > 0.9 ? x.high : random.uniform(x.low, x.high);
  };
  int bounded = 0;
  for (auto number = static_cast<int>(Operation::add);
       number <= static_cast<int>(Operation::select); ++number) {
    const auto operation = static_cast<Operation>(number);
    for (int trial = 0; trial < 400; ++trial) {
      const double reach = trial % 2 == 0 ? 2.0 : 20.0;
      const Interval a = interval(reach);
      const Interval b = interval(reach);
      const Interval c = interval(reach);
      const Interval range = apply_interval(operation, a, b, c);
      bounded += is_bounded(range) ? 1 : 0;
      for (int k = 0; k < 10; ++k) {
        const double value = expression::apply<double>(operation, draw(a), draw(b), draw(c));
        if (std::isfinite(value)) {
          EXPECT_LE(range.low, value) << number;
          EXPECT_GE(range.high, value) << number;
        } else {
          EXPECT_FALSE(is_bounded(range)) << number;
        }
      }
    }
  }
  EXPECT_GT(bounded, 9000);
}

TEST(IntervalFunctions, SineIsSharp) {
  Random random(7);
  for (int trial = 0; trial < 20'000; ++trial) {
    const double reach = std::exp(random.uniform(-20.0, std::log(largest_angle)));
    const double x = random.uniform(-reach, reach);
    const auto [s, c] = sine_and_cosine(x);
    EXPECT_LE(std::abs(static_cast<long double>(s) - std::sin(static_cast<long double>(x))),
              0.5L * sine_error);
    EXPECT_LE(std::abs(static_cast<long double>(c) - std::cos(static_cast<long double>(x))),
              0.5L * sine_error);
  }
  // Over its top: 1, and no less.
  EXPECT_EQ(sine({1.5, 1.6}, 0).high, 1.0);
  EXPECT_EQ(sine({4.6, 4.8}, 0).low, -1.0);
  EXPECT_EQ(sine({-0.1, 0.1}, 1).high, 1.0);
  EXPECT_LT(sine({0.1, 0.2}, 1).high, 0.9951);
  EXPECT_EQ(sine({0.0, 1e300}, 0).low, -1.0);
}

TEST(IntervalTape, SquaresAndParameters) {
  expression::TapeBuilder builder(1, 1);
  const Slot x = builder.input(0);
  const Slot p = builder.parameter(0);
  const Slot square = builder.binary(Operation::multiply, x, x);
  const std::array outputs{square, builder.binary(Operation::multiply, p, x),
                           builder.binary(Operation::divide, p, square)};
  IntervalTape tape(builder.finish(outputs), std::array{3.0});
  const auto range = tape.evaluate(std::array{Interval(-1.0, 2.0)});
  EXPECT_EQ(range[0].low, 0.0);  // not -2
  EXPECT_NEAR(range[0].high, 4.0, 1e-14);
  EXPECT_NEAR(range[1].low, -3.0, 1e-14);
  EXPECT_FALSE(is_bounded(range[2]));
  EXPECT_FALSE(is_bounded(tape.evaluate(std::array{anything})[1]));
}

}  // namespace
}  // namespace flyball::detail::interval_tape_test
