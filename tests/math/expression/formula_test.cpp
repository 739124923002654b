#include <flyball/math/expression/formula.hpp>

#include <cmath>
#include <numbers>

#include "math/expression/formula_text.hpp"

namespace flyball::expression::formula_test {
namespace {

struct Case {
  const char* text;
  double value;
};

// Each value computed by hand, or by the function of cmath that the formula names.
void check(std::initializer_list<Case> cases) {
  for (const Case& each : cases) {
    EXPECT_DOUBLE_EQ(
        value_of(each.text,
                 {{"x", 2.0}, {"y", 3.0}, {"z", 5.0}, {"θ", 0.5}, {"x_dot", 7.0}, {"a1", 11.0}}),
        each.value)
        << each.text;
  }
}

TEST(Formula, Numbers) {
  check({{"1", 1},
         {".5", 0.5},
         {"1.", 1},
         {"1e-3", 1e-3},
         {"1.25E+2", 125},
         {"2.5e2", 250},
         {"1e308", 1e308},
         {"pi", std::numbers::pi},
         {"π", std::numbers::pi},
         {"e", std::numbers::e},
         {"tau", 2 * std::numbers::pi}});
}

TEST(Formula, OperatorsBindAsInMathematics) {
  check({{"x + y*z", 17},
         {"(x + y)*z", 25},
         {"z - y - x", 0},
         {"z - (y - x)", 4},
         {"z/y/x", 5.0 / 3 / 2},
         {"z/(y/x)", 5 / 1.5},
         {"z*y/x", 7.5},
         {"x^y^2", 512},
         {"(x^y)^2", 64},
         {"-x^2", -4},
         {"(-x)^2", 4},
         {"x^-2", 0.25},
         {"x^-y^2", std::pow(2, -9)},
         {"-x*y", -6},
         {"x*-y", -6},
         {"x - -y", 5},
         {"--x", 2},
         {"+x", 2},
         {"-+-x", 2},
         {"x**y", 8},
         {"2*x^3", 16},
         {"x²", 4},
         {"y³", 27},
         {"-x²", -4},
         {"x^y²", 512},
         {"x·y × z ⋅ 2", 60},
         {"x − y", -1},
         {" \tx\n+\r y ", 5}});
}

TEST(Formula, LogicBindsLooserThanComparisonsAndTheyThanSums) {
  check({{"x < y ? 10 : 20", 10},
         {"x > y ? 10 : 20", 20},
         {"x + 1 >= y ? 10 : 20", 10},
         {"x <= 2 ? 10 : 20", 10},
         {"x == 2 ? 10 : 20", 10},
         {"x != 2 ? 10 : 20", 20},
         {"x ≤ 2 and y ≥ 3 and z ≠ 4 ? 10 : 20", 10},
         {"x > 5 or y > 2 and z > 9 ? 10 : 20", 20},
         {"x < 5 or y > 2 and z > 9 ? 10 : 20", 10},
         {"not x > 5 and y > 2 ? 10 : 20", 10},
         {"not (x < 5 and y > 9) ? 10 : 20", 10},
         {"!(x < 5) || y > 2 && z > 2 ? 10 : 20", 10},
         {"x > 9 ? 1 : y > 9 ? 2 : 3", 3},
         {"x < 9 ? y < 9 ? 1 : 2 : 3", 1},
         {"1 + (x < y ? 10 : 20)", 11},
         {"if(x < y, 10, 20) + 1", 11},
         {"if(if(x < y, x < 0, y < 9), 1, 2)", 2}});
}

TEST(Formula, Functions) {
  check({{"sin(θ)", std::sin(0.5)},
         {"cos(θ)", std::cos(0.5)},
         {"tan(θ)", std::tan(0.5)},
         {"asin(θ)", std::asin(0.5)},
         {"acos(θ)", std::acos(0.5)},
         {"atan(θ)", std::atan(0.5)},
         {"atan2(-x, -y)", std::atan2(-2.0, -3.0)},
         {"sinh(x)", std::sinh(2.0)},
         {"cosh(x)", std::cosh(2.0)},
         {"tanh(x)", std::tanh(2.0)},
         {"asinh(x)", std::asinh(2.0)},
         {"acosh(x)", std::acosh(2.0)},
         {"atanh(θ)", std::atanh(0.5)},
         {"exp(x)", std::exp(2.0)},
         {"expm1(x)", std::expm1(2.0)},
         {"log(x)", std::log(2.0)},
         {"ln(x)", std::log(2.0)},
         {"log1p(x)", std::log1p(2.0)},
         {"log2(z)", std::log2(5.0)},
         {"log10(z)", std::log10(5.0)},
         {"erf(θ)", std::erf(0.5)},
         {"sqrt(x)", std::sqrt(2.0)},
         {"cbrt(x)", std::cbrt(2.0)},
         {"hypot(x, y)", std::hypot(2.0, 3.0)},
         {"hypot(x, y, z)", std::sqrt(38.0)},
         {"abs(-x)", 2},
         {"sign(-x)", -1},
         {"sign(x - 2)", 0},
         {"sign(x)", 1},
         {"floor(-2.5)", -3},
         {"ceil(-2.5)", -2},
         {"round(-2.5)", -3},
         {"min(z, x, y)", 2},
         {"max(x, z, y)", 5},
         {"clamp(z, x, y)", 3},
         {"clamp(1, x, y)", 2},
         {"clamp(2.5, x, y)", 2.5},
         {"pow(x, y)", 8},
         {"mod(z, y)", 2},
         {"mod(-z, y)", 1},
         {"mod(z, -y)", -1},
         {"mod(6, y)", 0},
         {"remainder(z, y)", -1},
         {"x_dot + a1", 18}});
}

TEST(Formula, WholePowersAreProducts) {
  for (int n = -20; n <= 20; ++n) {
    EXPECT_NEAR(value_of("x^" + std::to_string(n), {{"x", -1.7}}) / std::pow(-1.7, n), 1.0, 4e-15)
        << n;
  }
  EXPECT_EQ(value_of("x^0.5", {{"x", 2.0}}), std::sqrt(2.0));
  EXPECT_EQ(value_of("x^-0.5", {{"x", 2.0}}), 1.0 / std::sqrt(2.0));
  EXPECT_EQ(value_of("x^1.5", {{"x", 2.0}}), std::pow(2.0, 1.5));
}

TEST(Formula, WhatIsNotANumberIsAValue) {
  EXPECT_TRUE(std::isnan(value_of("sqrt(x)", {{"x", -1.0}})));
  EXPECT_TRUE(std::isinf(value_of("1/x", {{"x", 0.0}})));
  EXPECT_TRUE(std::isnan(value_of("0*x", {{"x", std::nan("")}})));
  EXPECT_TRUE(std::isnan(value_of("sign(x)", {{"x", std::nan("")}})));
  EXPECT_EQ(value_of("if(x > 0, sqrt(x), 0)", {{"x", -1.0}}), 0.0);
}

TEST(Formula, DeclaredNamesHideConstants) {
  EXPECT_EQ(value_of("2*tau + e", {{"tau", 3.0}, {"e", 1.0}}), 7.0);
}

TEST(Formula, DefinitionsAndParameters) {
  // Cart-pole: M = m_c + m_p sin²θ, by a definition used twice. At θ = π/2 sin is 1 and M = 3.
  const auto compiled = compile({
      .variables = {{"theta", "rad"}, {"u", "N"}},
      .parameters = {{"m_c", "kg", 2.0}, {"m_p", "lb", 1.0 / 0.45359237}},
      .definitions = {{"s", "sin(theta)"}, {"M", "m_c + m_p*s^2", "kg"}, {"heavy", "M > 2.5*m_p"}},
      .outputs = {{"a", "u/M", "m/s^2"}, {"b", "if(heavy, M, 0)"}},
  });
  ASSERT_TRUE(compiled) << to_string(compiled.error().front());
  EXPECT_EQ(compiled->tape.inputs(), 2U);
  ASSERT_EQ(compiled->parameters.size(), 2U);
  EXPECT_EQ(compiled->parameters[0], 2.0);
  EXPECT_DOUBLE_EQ(compiled->parameters[1], 1.0);
  EXPECT_TRUE(compiled->outputs[1]->fits(si_dimension(Dimension::mass)));

  std::vector<double> values(compiled->tape.size());
  std::vector<double> y(2);
  compiled->tape.prepare<double>(compiled->parameters, values);
  compiled->tape.evaluate<double>(std::array{std::numbers::pi / 2, 6.0}, y, values);
  EXPECT_DOUBLE_EQ(y[0], 2.0);
  EXPECT_DOUBLE_EQ(y[1], 3.0);
  // Other parameters, the same tape.
  compiled->tape.prepare<double>(std::array{1.0, 1.0}, values);
  compiled->tape.evaluate<double>(std::array{std::numbers::pi / 2, 6.0}, y, values);
  EXPECT_DOUBLE_EQ(y[0], 3.0);
  EXPECT_DOUBLE_EQ(y[1], 0.0);
}

}  // namespace
}  // namespace flyball::expression::formula_test
