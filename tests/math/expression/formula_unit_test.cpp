#include <flyball/math/expression/formula.hpp>

#include "math/expression/formula_text.hpp"

namespace flyball::expression::formula_unit_test {
namespace {

struct Case {
  const char* text;
  const char* unit;
  const char* codes;
};

// x and y have no unit; theta rad, m kg, l m, t s, u N m.
void check(std::initializer_list<Case> cases) {
  for (const Case& each : cases) {
    EXPECT_EQ(codes(errors_of(each.text, each.unit)), each.codes) << each.text;
  }
}

TEST(FormulaUnits, ThatAddUp) {
  check({{"u/(m*l^2)", "rad/s^2", ""},
         {"m*l^2/2*(theta/t)^2", "J", ""},
         {"l + 0", "m", ""},
         {"0", "m", ""},
         {"-0*1", "m", ""},
         {"max(l, 0)", "m", ""},
         {"max(0, l, 0)", "m", ""},
         {"if(l > 0, l, 0)", "m", ""},
         {"clamp(l, 0, 2*l)", "m", ""},
         {"sqrt(l^2 + l*l)", "m", ""},
         {"hypot(l, l)", "m", ""},
         {"cbrt(l^3)", "m", ""},
         {"l^(1/2)*sqrt(l)", "m", ""},
         {"(l^(2/3))^1.5", "m", ""},
         {"l²", "m^2", ""},
         {"sin(theta) + theta", "1", ""},
         {"atan2(l, 2*l)", "rad", ""},
         {"acos(l/l)", "rad", ""},
         {"exp(-t/t)*l", "m", ""},
         {"sign(l)*l", "m", ""},
         {"abs(l)/t", "m/s", ""},
         {"mod(theta, 2*pi)", "rad", ""},
         {"l/t > 0 or l < l ? m : m", "kg", ""},
         {"theta^t/theta^t + 0", "", "unit_mismatch@6 unit_mismatch@14"},
         {"2^theta", "1", ""}});
}

TEST(FormulaUnits, ThatDoNotAddUpAreShown) {
  check({{"m*l + theta", "", "unit_mismatch@4"},
         {"l + 1", "", "unit_mismatch@2"},
         {"l - t", "", "unit_mismatch@2"},
         {"l < t ? 1 : 2", "", "unit_mismatch@2"},
         {"l > t ? 1 : 2", "", "unit_mismatch@2"},
         {"min(l, l, t)", "", "unit_mismatch@10"},
         {"if(x > 0, l, t)", "", "unit_mismatch@13"},
         {"x > 0 ? l : t", "", "unit_mismatch@12"},
         {"sin(l)", "", "unit_mismatch@4"},
         {"exp(l/t)", "", "unit_mismatch@4"},
         {"asin(m)", "", "unit_mismatch@5"},
         {"atan2(l, t)", "", "unit_mismatch@9"},
         {"hypot(l, m)", "", "unit_mismatch@9"},
         {"l^x", "", "unit_mismatch@2"},
         {"l^theta", "", "unit_mismatch@2"},
         {"2^l", "", "unit_mismatch@2"},
         {"u/(m*l)", "rad/s^2", "unit_mismatch@0"},
         {"sin(l) + m*(l + t)", "", "unit_mismatch@4 unit_mismatch@14"},
         {"mod(theta, l)", "", "unit_mismatch@11"},
         {"1", "m", "unit_mismatch@0"}});
}

TEST(FormulaUnits, UnknownOnesRaiseNoFalseAlarm) {
  check({{"x + l", "kg", ""},
         {"x*l + t", "", ""},
         {"sin(x) + sin(x*l)", "", ""},
         {"x^y", "s", ""},
         {"x^y + l", "s", ""},
         {"min(x, l)", "s", ""},
         {"min(x, l, t)", "", "unit_mismatch@10"}});
}

TEST(FormulaUnits, SayTheWholeSentence) {
  const auto sentence = [](const char* text, const char* unit) {
    const auto errors = errors_of(text, unit);
    return errors.size() == 1 ? to_string(errors[0]) : codes(errors);
  };
  EXPECT_EQ(sentence("m*l + theta", ""),
            "f: \"m*l + theta\" is kg m plus rad; it must be in one unit (offset = 4, length = 1)");
  EXPECT_EQ(sentence("l > t ? 1 : 2", ""),
            "f: \"l > t\" is m compared with s; it must be in one unit (offset = 2, length = 1)");
  EXPECT_EQ(sentence("u/(m*l)", "rad/s^2"),
            "f: \"u/(m*l)\" is in m/s^2; it must be in rad/s^2, the unit of f "
            "(offset = 0, length = 7)");
  EXPECT_EQ(sentence("sin(u)", ""),
            "f: \"u\" is in N m; it must be a plain number or an angle, which sin takes "
            "(offset = 4, length = 1)");
  EXPECT_EQ(
      sentence("l + 1", ""),
      "f: \"l + 1\" is m plus a plain number; it must be in one unit (offset = 2, length = 1)");
}

TEST(FormulaUnits, OfDefinitionsAreCarriedOn) {
  const auto compiled = compile({
      .variables = {{"l", "m"}, {"t", "s"}, {"x", ""}},
      .definitions = {{"v", "l/t"}, {"w", "x", "s"}, {"two", "4/2"}},
      .outputs = {{"a", "v + l"}, {"b", "w + l"}, {"c", "v^two"}},
  });
  ASSERT_FALSE(compiled);
  EXPECT_EQ(codes(compiled.error()), "unit_mismatch@2 unit_mismatch@2");
}

}  // namespace
}  // namespace flyball::expression::formula_unit_test
