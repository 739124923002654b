#include <flyball/math/expression/tape.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <flyball/math/expression/differentiate.hpp>
#include <flyball/math/expression/formula.hpp>
#include <flyball/math/expression/tape_builder.hpp>

#include "math/expression/formula_text.hpp"
#include "math/expression/random_tree.hpp"
#include "support/allocation_count.hpp"

namespace flyball::expression::tape_test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

Tape tape_of(const std::string& text, std::vector<std::string> names = {"x", "y", "z"}) {
  FormulaSet set{.outputs = {{"f", text}}};
  for (const std::string& name : names) {
    set.variables.push_back({name});
  }
  const auto compiled = compile(set);
  EXPECT_TRUE(compiled) << text << ": " << to_string(compiled.error().front());
  return compiled ? compiled->tape : Tape();
}

/// How many nodes compute something.
std::size_t work(const Tape& tape) {
  std::size_t count = 0;
  for (const Node& node : tape.nodes()) {
    count += operand_count(node.operation) > 0 ? 1 : 0;
  }
  return count;
}

TEST(TapeBuilder, ComputesOnceWhatIsWrittenTwice) {
  EXPECT_EQ(work(tape_of("sin(x*y) + cos(y*x)*sin(y*x)")), 5U);  // x y, sin, cos, *, +
  EXPECT_EQ(work(tape_of("(x + y)^2")), 2U);
  EXPECT_EQ(work(tape_of("x^4")), 2U);
  EXPECT_EQ(work(tape_of("x^7")), 4U);
  EXPECT_EQ(work(tape_of("x^7 + x^4")), 5U);
  EXPECT_EQ(work(tape_of("x*y - x*y")), 2U);
}

TEST(TapeBuilder, FoldsConstantsAndNeutralElements) {
  EXPECT_EQ(work(tape_of("2*pi/3 + sin(1)")), 0U);
  EXPECT_EQ(work(tape_of("1*x + 0")), 0U);
  EXPECT_EQ(work(tape_of("0 + x*1/1 - 0")), 0U);
  EXPECT_EQ(work(tape_of("-(-x)")), 0U);
  EXPECT_EQ(work(tape_of("-1*x")), 1U);
  EXPECT_EQ(work(tape_of("x + -y")), 1U);
  EXPECT_EQ(work(tape_of("-x + y")), 1U);
  EXPECT_EQ(work(tape_of("x - -y")), 1U);
  EXPECT_EQ(work(tape_of("0 - x")), 1U);
  EXPECT_EQ(work(tape_of("x^0")), 0U);
  EXPECT_EQ(work(tape_of("x^1")), 0U);
  EXPECT_EQ(work(tape_of("if(1 > 2, x, y)")), 0U);
  EXPECT_EQ(work(tape_of("if(x > 2, y, y)")), 0U);
  EXPECT_EQ(work(tape_of("0*x")), 1U);  // NaN where x is infinite
}

TEST(TapeBuilder, LeavesOutWhatNoOutputNeeds) {
  TapeBuilder builder(2);
  const Slot x = builder.input(0);
  builder.unary(Operation::sin, x);
  const std::array outputs{builder.unary(Operation::cos, x), x};
  const Tape tape = builder.finish(outputs);
  EXPECT_EQ(work(tape), 1U);
  EXPECT_EQ(tape.inputs(), 2U);
  EXPECT_EQ(tape.outputs(), 2U);
}

TEST(Tape, WhatDependsOnParametersAloneIsComputedByPrepare) {
  const auto compiled = compile({.variables = {{"x"}},
                                 .parameters = {{"m", "", 3.0}, {"l", "", 2.0}},
                                 .outputs = {{"f", "x/(m*l^2)"}}});
  ASSERT_TRUE(compiled);
  const Tape& tape = compiled->tape;
  std::vector<double> values(tape.size(), nan);
  tape.prepare<double>(compiled->parameters, values);
  EXPECT_EQ(values[tape.input_slot(0).index - 1], 12.0);  // the last before the inputs
  EXPECT_EQ(tape.nodes().size() - tape.input_slot(0).index, 2U);
}

TEST(Tape, EvaluatesWithoutAllocation) {
  const Tape tape = tape_of("if(x > y, sin(x*y), cos(z)) + max(x, y, z)^3");
  const Derivatives derivatives = differentiate(tape);
  std::vector<double> values(derivatives.workspace_size());
  derivatives.tape.prepare<double>({}, values);
  const std::array x{1.0, 2.0, 3.0};
  double y = 0.0;
  Eigen::MatrixXd J(1, 3);
  const test::AllocationCounter allocations;
  tape.evaluate<double>(x, {&y, 1}, values);
  derivatives.evaluate(x, {&y, 1}, J, values);
  EXPECT_TRUE(!test::counts_allocations() || allocations.count() == 0U);
}

// -0 and 0 are one: x + 0 is simplified to x.
bool same(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

/// Random formulas, evaluated by the tape and by the tree that wrote their text.
TEST(Tape, OfARandomFormulaComputesWhatTheFormulaSays) {
  std::mt19937_64 random(20260101);
  std::uniform_real_distribution<double> point(-3.0, 3.0);
  const std::vector<std::string> names{"x", "y", "z"};
  int finite = 0;
  for (int k = 0; k < 3000; ++k) {
    const RandomTree tree = RandomTree::make(random, 3, 5);
    const Tape tape = tape_of(tree.text(names));
    std::vector<double> values(tape.size());
    tape.prepare<double>({}, values);
    for (int i = 0; i < 3; ++i) {
      const std::array x{point(random), point(random), point(random)};
      double y = 0.0;
      tape.evaluate<double>(x, {&y, 1}, values);
      const double wanted = tree.evaluate<double>(x);
      finite += std::isfinite(wanted) ? 1 : 0;
      // Whole and half exponents take another form; see WholePowersAreProducts.
      const bool powers = tree.text(names).find("pow") != std::string::npos;
      ASSERT_TRUE(same(y, wanted) || powers) << tree.text(names) << " at " << x[0] << ", " << x[1]
                                             << ", " << x[2] << ": " << y << " for " << wanted;
    }
  }
  EXPECT_GT(finite, 4000);
}

}  // namespace
}  // namespace flyball::expression::tape_test
