#include <flyball/math/expression/source_text.hpp>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <flyball/math/expression/formula.hpp>

#include "math/expression/formula_text.hpp"
#include "math/expression/random_tree.hpp"

namespace flyball::expression::source_text_test {
namespace {

const std::vector<std::string> names{"x", "y", "z"};

CompiledFormulas compiled_of(const std::string& text) {
  const auto compiled = compile({.variables = {{"x"}, {"y"}, {"z"}}, .outputs = {{"f", text}}});
  EXPECT_TRUE(compiled) << text;
  return compiled.value_or(CompiledFormulas{});
}

/// The definitions and the output on one line.
std::string written(const std::string& text, Language language) {
  const auto source = source_text(compiled_of(text).tape, names, {}, language);
  if (!source) {
    return to_string(source.error());
  }
  std::string line;
  for (const auto& definition : source->definitions) {
    line += definition.name + (definition.truth ? " := " : " = ") + definition.text + "; ";
  }
  return line + source->outputs.at(0);
}

TEST(SourceText, InFlyballsOwnLanguage) {
  const auto own = [](const char* text) { return written(text, Language::formula); };
  EXPECT_EQ(own("x+y * z - ( 2.0 )"), "x + y*z - 2");
  EXPECT_EQ(own("x-(y-z)"), "x - (y - z)");
  EXPECT_EQ(own("x/(y*z)"), "x/(y*z)");
  EXPECT_EQ(own("-x^2"), "-(x*x)");
  EXPECT_EQ(own("(-x)^y"), "(-x)^y");
  EXPECT_EQ(own("x^(y^z)"), "x^(y^z)");
  EXPECT_EQ(own("sin(x*y)^2"), "t1 = sin(x*y); t1*t1");
  EXPECT_EQ(own("x > 0 and not y < z ? x : -1"), "if(0 < x and (not (y < z)), x, -1)");
  EXPECT_EQ(own("atan2(x, ln(y)) + 1/0"), "atan2(x, log(y)) + 1/0");
  EXPECT_EQ(own("sign(x) + mod(x, 2)"), "sign(x) + mod(x, 2)");
}

TEST(SourceText, InCAndItsRelatives) {
  const char* const text = "if(x > 0, max(x, abs(y)), 2)*sign(y + z)";
  EXPECT_EQ(written(text, Language::cpp),
            "t1 = y + z; (0.0 < x ? std::max(x, std::fabs(y)) : 2.0)*(t1 > 0.0 ? 1.0 : t1 < 0.0 ? "
            "-1.0 : t1)");
  EXPECT_EQ(
      written(text, Language::c),
      "t1 = y + z; (0.0 < x ? fmax(x, fabs(y)) : 2.0)*(t1 > 0.0 ? 1.0 : t1 < 0.0 ? -1.0 : t1)");
  EXPECT_EQ(written(text, Language::java),
            "t1 = y + z; (0.0 < x ? Math.max(x, Math.abs(y)) : 2.0)*(t1 > 0.0 ? 1.0 : t1 < 0.0 ? "
            "-1.0 : t1)");
  EXPECT_EQ(written("(x < y or x > z) and !(y == 0) ? 1 : 2", Language::cpp),
            "(x < y || z < x) && !(y == 0.0) ? 1.0 : 2.0");
  EXPECT_EQ(written("x^y + remainder(x, 2*pi)", Language::java),
            "Math.pow(x, y) + Math.IEEEremainder(x, 6.283185307179586)");
  EXPECT_EQ(written("asinh(x)", Language::java),
            "Math.copySign(Math.log1p(Math.abs(x) + x*x/(1.0 + Math.hypot(1.0, x))), x)");
}

TEST(SourceText, RefusesWhatCannotBeWritten) {
  EXPECT_EQ(written("erf(x)", Language::java),
            "source_text: erf is not in Java's library; leave it out of the formula, or write C++");
  const auto few = source_text(compiled_of("x").tape, {}, {}, Language::cpp);
  ASSERT_FALSE(few);
  EXPECT_TRUE(few.error().is(ArgumentError::wrong_shape));
}

TEST(SourceText, NamesOfDefinitionsAreFree) {
  const auto compiled = compile({.variables = {{"t1"}, {"tt"}}, .outputs = {{"f", "(t1 + tt)^2"}}});
  ASSERT_TRUE(compiled);
  const std::vector<std::string> taken{"t1", "tt"};
  const auto source = source_text(compiled->tape, taken, {}, Language::cpp);
  ASSERT_TRUE(source);
  EXPECT_EQ(source->definitions.at(0).name, "ttt1");
}

/// What is written, read again, computes the same bits.
TEST(SourceText, OfAFormulaReadsBack) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> point(-3.0, 3.0);
  int finite = 0;
  for (int k = 0; k < 1000; ++k) {
    const std::string text = RandomTree::make(random, 3, 6).text(names);
    const Tape tape = compiled_of(text).tape;
    const auto source = source_text(tape, names, {}, Language::formula);
    ASSERT_TRUE(source);
    FormulaSet set{.variables = {{"x"}, {"y"}, {"z"}}};
    for (const auto& definition : source->definitions) {
      set.definitions.push_back({definition.name, definition.text});
    }
    set.outputs.push_back({"f", source->outputs.at(0)});
    const auto again = compile(set);
    ASSERT_TRUE(again) << text << "\n" << to_string(again.error().front());
    std::vector<double> values(tape.size());
    std::vector<double> values_again(again->tape.size());
    tape.prepare<double>({}, values);
    again->tape.prepare<double>({}, values_again);
    const std::array x{point(random), point(random), point(random)};
    double y = 0.0;
    double y_again = 0.0;
    tape.evaluate<double>(x, {&y, 1}, values);
    again->tape.evaluate<double>(x, {&y_again, 1}, values_again);
    ASSERT_TRUE(y == y_again || (std::isnan(y) && std::isnan(y_again))) << text;
    finite += std::isfinite(y) ? 1 : 0;
  }
  EXPECT_GT(finite, 400);
}

}  // namespace
}  // namespace flyball::expression::source_text_test
