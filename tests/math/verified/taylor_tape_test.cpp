#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/expression/tape_builder.hpp>

#include "math/verified/taylor_tape.hpp"

namespace flyball::detail::taylor_tape_test {
namespace {

using expression::Operation;
using expression::Slot;
using expression::TapeBuilder;

/// A form at some ε, without its radius.
double at(const TaylorForm& x, const std::array<double, most_parameters>& epsilon) {
  double sum = x.centre;
  for (std::size_t i = 0; i < epsilon.size(); ++i) {
    sum += x.slope[i] * epsilon[i];
    for (std::size_t j = i; j < epsilon.size(); ++j) {
      sum += x.square[square_index(i, j)] * epsilon[i] * epsilon[j];
    }
  }
  return sum;
}

// Every operation on x y + x, x and y over random boxes: the value at a point of the box is within
// the radius of the form there, and below the upper bound.
TEST(TaylorTape, HoldsWhatItBounds) {
  Random random(66);
  int narrow = 0;
  for (auto number = static_cast<int>(Operation::add);
       number <= static_cast<int>(Operation::select); ++number) {
    const auto operation = static_cast<Operation>(number);
    TapeBuilder builder(2, 0);
    const Slot x = builder.input(0);
    const Slot y = builder.input(1);
    const Slot a = builder.binary(Operation::add, builder.binary(Operation::multiply, x, y), x);
    const int operands = expression::operand_count(operation);
    const Slot result = operands == 1   ? builder.unary(operation, a)
                        : operands == 2 ? builder.binary(operation, a, y)
                                        : builder.select(a, x, y);
    const std::array outputs{result};
    const expression::Tape tape = builder.finish(outputs);
    TaylorTape forms(tape, {});
    std::vector<double> values(tape.size());
    tape.prepare<double>({}, values);
    for (int trial = 0; trial < 100; ++trial) {
      const double reach = trial % 2 == 0 ? 0.4 : 3.0;
      const std::array<double, 2> centre{random.uniform(-reach, reach),
                                         random.uniform(-reach, reach)};
      const double half = reach * std::exp(random.uniform(-9.0, -1.0));
      const std::array in{TaylorForm::parameter(0, centre[0], half),
                          TaylorForm::parameter(1, centre[1], half)};
      const TaylorForm form = forms.evaluate(in)[0];
      const double top = upper_bound(form);
      narrow += form.radius < half * half ? 1 : 0;
      for (int k = 0; k < 10; ++k) {
        std::array<double, most_parameters> epsilon{};
        epsilon[0] = k == 0 ? 1.0 : random.uniform(-1.0, 1.0);
        epsilon[1] = k == 0 ? -1.0 : random.uniform(-1.0, 1.0);
        const std::array point{centre[0] + half * epsilon[0], centre[1] + half * epsilon[1]};
        std::array<double, 1> exact{};
        tape.evaluate<double>(point, exact, values);
        if (!std::isfinite(exact[0])) {
          EXPECT_FALSE(std::isfinite(form.radius)) << number;
          continue;
        }
        const double rounding = 1e-13 * (1.0 + std::abs(exact[0]));
        EXPECT_LE(std::abs(exact[0] - at(form, epsilon)), form.radius + rounding) << number;
        EXPECT_FALSE(exact[0] > top + rounding) << number;
      }
    }
  }
  EXPECT_GT(narrow, 1000);
}

// 2 - (ε - 1/2)² has its top inside, -ε₁ε₂ in a corner.
TEST(TaylorTape, UpperBoundIsSharp) {
  TaylorForm inside(1.75);
  inside.slope[0] = 1.0;
  inside.square[square_index(0, 0)] = -1.0;
  EXPECT_NEAR(upper_bound(inside), 2.0, 1e-14);
  inside.slope[0] = 4.0;  // at ε = 1
  EXPECT_NEAR(upper_bound(inside), 1.75 + 3.0, 1e-13);
  TaylorForm mixed;
  mixed.square[square_index(0, 1)] = -1.0;
  mixed.radius = 0.25;
  EXPECT_NEAR(upper_bound(mixed), 1.25, 1e-13);
}

}  // namespace
}  // namespace flyball::detail::taylor_tape_test
