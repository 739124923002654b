#include <limits>
#include <random>
#include <string>

#include <flyball/math/expression/formula.hpp>

#include "math/expression/formula_text.hpp"

namespace flyball::expression::formula_error_test {
namespace {

struct Case {
  const char* text;
  const char* codes;
};

void check(std::initializer_list<Case> cases) {
  for (const Case& each : cases) {
    EXPECT_EQ(codes(errors_of(each.text)), each.codes) << each.text;
  }
}

TEST(FormulaErrors, OfGrammarWithTheirPlace) {
  check({{"", "empty_formula@0"},
         {"  ", "empty_formula@2"},
         {"2x", "missing_operator@1"},
         {"x y", "missing_operator@2"},
         {"2(x)", "missing_operator@1"},
         {"x(y + 1)", "missing_operator@1"},
         {"(x)(y)", "missing_operator@3"},
         {"x if y > 0 else 2",
          "missing_operator@2 wrong_arity@2 missing_operator@5 "
          "missing_operator@11 unknown_name@11 missing_operator@16"},
         {"x +", "missing_operand@3"},
         {"* x", "missing_operand@0"},
         {"x + * y", "missing_operand@4"},
         {"()", "missing_operand@1"},
         {"sin()", "wrong_arity@0"},
         {"x = y", "assignment@2"},
         {"x := y", "unexpected_symbol@2 missing_operand@3 assignment@3"},
         {"(x + y", "unclosed_parenthesis@0"},
         {"((x + y)*x", "unclosed_parenthesis@0"},
         {"sin(x", "unclosed_parenthesis@3"},
         {"x + y)", "unopened_parenthesis@5"},
         {"(x + y))*2)", "unopened_parenthesis@7 unopened_parenthesis@10"},
         {"x, y", "unexpected_symbol@1"},
         {"(1,5)", "unexpected_symbol@2"},
         {"x ? 1", "missing_operand@2"},
         {"x > 0 ? 1", "missing_operand@6"},
         {"0 < x < 1 ? 1 : 0", "chained_comparison@6"},
         {"x == y == 1 ? 1 : 0", "chained_comparison@7"},
         {"x!", "missing_operator@1 missing_operand@2"},
         {"1.2.3", "malformed_number@0"},
         {"1..2", "malformed_number@0"},
         {"1e999", "malformed_number@0"},
         {"x $ y", "stray_character@2 missing_operator@4"},
         {"x % 2", "stray_character@2 missing_operator@4"},
         {"[x]", "stray_character@0 stray_character@2"},
         {"x’", "stray_character@1"},
         {"$", "stray_character@0"}});
}

TEST(FormulaErrors, OfNamesAndArguments) {
  check({{"thata", "unknown_name@0"},
         {"sine(x)", "unknown_function@0"},
         {"foo(x) + bar(y)", "unknown_function@0 unknown_function@9"},
         {"sin", "wrong_arity@0"},
         {"sin x", "wrong_arity@0 missing_operator@4"},
         {"sin(x, y)", "wrong_arity@0"},
         {"atan2(x)", "wrong_arity@0"},
         {"min(x)", "wrong_arity@0"},
         {"clamp(x, y)", "wrong_arity@0"},
         {"if(x > 0, 1)", "wrong_arity@0"},
         {"sin(x + foo) + bar", "unknown_name@8 unknown_name@15"}});
}

TEST(FormulaErrors, OfComparisonsAndNumbersMixed) {
  check({{"x > 0", "wrong_type@0"},
         {"(x > 0)*2", "wrong_type@0"},
         {"if(x, 1, 2)", "wrong_type@3"},
         {"x and y > 0 ? 1 : 2", "wrong_type@0"},
         {"not x ? 1 : 2", "wrong_type@4"},
         {"if(x > 0, x > 1, 2)", "wrong_type@10"},
         {"sin(x > 0)", "wrong_type@4"},
         {"x + (y > 0)", "wrong_type@4"}});
}

TEST(FormulaErrors, SayTheWholeSentence) {
  const auto sentence = [](const char* text) {
    const auto errors = errors_of(text);
    return errors.size() == 1 ? to_string(errors[0]) : codes(errors);
  };
  EXPECT_EQ(
      sentence("sin(x, y)"),
      "f: \"sin\" is given 2 arguments; it must be given 1 argument (offset = 0, length = 9)");
  EXPECT_EQ(
      sentence("2*thete"),
      "f: \"thete\" is not known; it must be a variable, a parameter or a definition; did you "
      "mean \"theta\"? (offset = 2, length = 5)");
  EXPECT_EQ(sentence("2x"),
            "f: \"2x\" is two values without an operator between them; write \"2*x\" for the "
            "product (offset = 1, length = 1)");
  EXPECT_EQ(sentence("arctan(x)"),
            "f: \"arctan\" is not a function; did you mean \"atan\"? (offset = 0, length = 6)");
  EXPECT_EQ(
      sentence("(x"),
      "f: this parenthesis is not closed; write the ) that closes it (offset = 0, length = 1)");
}

TEST(FormulaErrors, CaretsStandUnderThePlace) {
  const auto carets = [](const std::string& text) {
    const auto errors = errors_of(text);
    return errors.empty() ? "" : caret_lines(text, errors[0]);
  };
  EXPECT_EQ(carets("-x/l*sin(theta) + u/(m*l^2"),
            "-x/l*sin(theta) + u/(m*l^2\n"
            "                    ^ this parenthesis is not closed");
  EXPECT_EQ(carets("x +"), "x +\n   ^ a value is missing here");
  EXPECT_EQ(carets("π*αβγ"), "π*αβγ\n  ^~~ this name is not known");
  EXPECT_EQ(carets("x\t+ foo"), "x + foo\n    ^~~ this name is not known");
  const std::string zero("x \0y", 4);
  EXPECT_EQ(carets(zero), "x \\x00y\n  ^~~~ this character means nothing here");
  std::string sum = "x";
  for (int i = 0; i < 50; ++i) {
    sum += " + x";
  }
  EXPECT_EQ(
      carets(sum + " + foo" + sum),
      "...x + x + x + x + x + x + x + x + x + x + x + x + x + x + x + foox + x + x + x + x + x + "
      "x + x + x + x...\n"
      "                                                               ^~~~ this name is not known");
  EXPECT_EQ(caret_lines("x", Error(ExpressionError::not_finite)), "");
}

TEST(FormulaErrors, OfASetAreAllReported) {
  const auto compiled = compile({
      .variables = {{"x", "furlongs"}, {"2x", ""}, {"x", ""}, {"sin", ""}, {"and", ""}},
      .parameters = {{"k", "N/m", std::numeric_limits<double>::quiet_NaN()}, {"x", "", 1.0}},
      .definitions = {{"a", "b + 1"}, {"b", "a + b"}, {"c", "a +"}},
      .outputs = {{"first", "a + c + missing"}, {"second", "k*(x"}},
  });
  ASSERT_FALSE(compiled);
  EXPECT_EQ(codes(compiled.error()),
            "unknown_unit unusable_name duplicate_name unusable_name unusable_name not_finite "
            "duplicate_name unknown_name@0 unknown_name@4 missing_operand@3 unknown_name@8 "
            "unclosed_parenthesis@2");
  EXPECT_EQ(compiled.error()[10].where(), "first");
  EXPECT_EQ(to_string(compiled.error()[7]),
            "a: \"b\" is a definition that comes later, or this one; define it before its use "
            "(offset = 0, length = 1)");
}

TEST(FormulaErrors, HostileTextIsRefusedWithoutHarm) {
  const std::size_t million = 1'000'000;
  EXPECT_EQ(codes(errors_of(std::string(million, '('))), "too_large@0");
  EXPECT_EQ(codes(errors_of("x" + std::string(million, '+') + "x")), "too_large@0");
  const std::size_t fits = 99'000;
  EXPECT_EQ(codes(errors_of(std::string(fits, '('))), "too_deep@200");
  EXPECT_EQ(codes(errors_of(std::string(fits, '-') + "x")), "too_deep@200");
  EXPECT_EQ(codes(errors_of(std::string(150, '(') + "x" + std::string(150, ')'))), "");
  EXPECT_EQ(errors_of(std::string(fits, ')')).size(), 20U);
  std::string powers = "x";
  std::string choices = "x";
  std::string sums = "x";
  while (sums.size() < fits) {
    powers += "^x";
    choices += ">0?x:x";
    sums += "+x";
  }
  EXPECT_EQ(codes(errors_of(powers.substr(0, fits))), "too_deep@400");
  EXPECT_NE(codes(errors_of(choices.substr(0, fits))), "");
  EXPECT_EQ(codes(errors_of(sums)), "");
  EXPECT_EQ(codes(errors_of(std::string("x\0y", 3))), "stray_character@1 missing_operator@2");
  EXPECT_EQ(codes(errors_of("x + \xff\xfe y")), "stray_character@4 stray_character@5");
  EXPECT_EQ(codes(errors_of(std::string(5000, 'q'))), "unknown_name@0");
}

TEST(FormulaErrors, ATapeHasAMillionNodesAtMost) {
  // 45 000 sums a formula, which begin with different numbers and so share nothing.
  std::string sums;
  for (int i = 0; i < 45'000; ++i) {
    sums += "+x";
  }
  FormulaSet set{.variables = {{"x", ""}}};
  for (int k = 1; k <= 22; ++k) {
    set.outputs.push_back({"f" + std::to_string(k), std::to_string(k) + sums});
  }
  set.outputs.push_back({"last", "23" + sums});
  const auto compiled = compile(set);
  ASSERT_FALSE(compiled);
  EXPECT_EQ(codes(compiled.error()), "too_large@0");
  EXPECT_EQ(compiled.error()[0].where(), "last");
}

// Every mixture of tokens is answered, and each error has a place that a caret can show.
TEST(FormulaErrors, RandomTextIsAnswered) {
  const char* const pieces[] = {"x",   "y ",   "2", ".5",  "(",   ")",  ",",    "+",
                                "-",   "*",    "/", "^",   "<",   "==", "=",    "and ",
                                "or ", "not ", "?", ":",   "sin", "if", "min(", "\xff",
                                "²",   "π",    "!", "foo", "1e5", "..", "\n"};
  std::mt19937_64 random(1);
  int good = 0;
  for (int k = 0; k < 20'000; ++k) {
    std::string text;
    const auto length = 1 + random() % 9;
    for (std::uint64_t i = 0; i < length; ++i) {
      text += pieces[random() % std::size(pieces)];
    }
    const auto errors = errors_of(text);
    good += errors.empty() ? 1 : 0;
    for (const Error& error : errors) {
      ASSERT_NE(caret_lines(text, error), "") << text;
    }
  }
  EXPECT_GT(good, 500);
}

}  // namespace
}  // namespace flyball::expression::formula_error_test
