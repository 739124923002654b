#include <flyball/classical/transfer_expression.hpp>

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/expression/formula.hpp>

#include "classical/transfer_cases.hpp"

namespace flyball::classical::transfer_expression_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXd;
using expression::ExpressionError;

VectorXd list(std::initializer_list<double> values) {
  return Eigen::Map<const VectorXd>(values.begin(), static_cast<Index>(values.size()));
}

void expect(std::string_view text, const VectorXd& num, const VectorXd& den, double delay = 0.0,
            std::optional<Time> period = {}) {
  const auto G = parse_transfer_function(text, period);
  ASSERT_TRUE(G) << text << ": " << to_string(G.error());
  ASSERT_EQ(G->num().size(), num.size()) << text << ": " << G->num().transpose();
  ASSERT_EQ(G->den().size(), den.size()) << text << ": " << G->den().transpose();
  const double unit = den(0) / G->den()(0);
  EXPECT_LE((unit * G->num() - num).cwiseAbs().maxCoeff(), 1e-15 * num.cwiseAbs().maxCoeff())
      << text << ": " << G->num().transpose();
  EXPECT_LE((unit * G->den() - den).cwiseAbs().maxCoeff(), 1e-15 * den.cwiseAbs().maxCoeff())
      << text << ": " << G->den().transpose();
  EXPECT_NEAR(G->delay(), delay, 1e-16) << text;
  EXPECT_EQ(G->period().has_value(), period.has_value()) << text;
}

TEST(TransferExpression, Spellings) {
  const VectorXd two = list({2});
  const VectorXd den = list({1, 3, 2});
  for (const char* text : {"2/(s^2+3*s+2)",
                           "2/(s**2 + 3s + 2)",
                           "2/((s+1)*(s+2))",
                           "2 / ((s+1)(s+2))",
                           "[2]/[1 3 2]",
                           "[2]/[1, 3, 2]",
                           "2/[1  3 +2]",
                           "2*[1 3 2]^-1",
                           "2*(s²+3·s+2)^(-1)",
                           "-2/(-s^2-3s-2)",
                           "1/(s+1)*(2/(s+2))",
                           "4/(2s^2+6s+4)",
                           "2e0/(s*s+3*s+2)",
                           "(1/(s+1) - 1/(s+2))*2",
                           "2/(s+1) * 1/(s+2)",
                           "sqrt(4)/(s^2 + 3s + 2)",
                           "2/(s^2 \xE2\x88\x92 (\xE2\x88\x92"
                           "3s) + 2)",
                           "((((2))))/(((s)^2+3s+2))",
                           "+2/(s^2+3s+2)",
                           "2s^0/(s^2+3s+2)",
                           "\t2/(s^2+3s+2)\n"}) {
    expect(text, two, den);
  }
  expect("[1 2]/[1 3 2]", list({1, 2}), den);
  expect("[1 -2]/[1 3 2]", list({1, -2}), den);
  expect("5", list({5}), list({1}));
  expect("1/s", list({1}), list({1, 0}));
  expect("s/(s+1)^3", list({1, 0}), list({1, 3, 3, 1}));
  expect("1e-3/(1e-3s+1)", list({1}), list({1, 1000}));
  expect("pi*s/(s+2pi)", list({std::acos(-1.0), 0}), list({1, 2.0 * std::acos(-1.0)}));
  expect("10^(-3/20)/(s+1)", list({std::pow(10.0, -0.15)}), list({1, 1}));
  expect("0", list({0}), list({1}));
  expect("0*s/(s+1) + 1/s - 1/s", list({0}), list({1}));
}

TEST(TransferExpression, DeadTime) {
  const VectorXd one = list({1});
  for (const char* text :
       {"exp(-0.1*s)/(s+1)", "exp(-s*0.1)/(s+1)", "exp(-0.1s)/(s+1)", "e^(-0.1s)/(s+1)",
        "e^(-0.1*s)*1/(s+1)", "1/(s+1)*exp(-s/10)", "1/(s+1) exp(-(0.1)*s)",
        "exp(-s*(0.04+0.06))/(s+1)", "exp(-0.05s)^2/(s+1)", "exp(-0.03s)/(s+1)*exp(-0.07*s)",
        "e^-(0.1s)/(s+1)", "exp(-0.1s)*(1/(s+2) + 1/((s+1)(s+2)))*(s+2)/(s+2)*(s+2)/(s+2)*1"}) {
    const auto G = parse_transfer_function(text);
    ASSERT_TRUE(G) << text << ": " << to_string(G.error());
    EXPECT_NEAR(G->delay(), 0.1, 2e-17) << text;
    const Complex at = G->response(0.7);
    const Complex wanted = std::polar(1.0, -0.07) / Complex(1.0, 0.7);
    EXPECT_LE(std::abs(at - wanted), 3e-16 * 2) << text;
  }
  // Sums of one dead time are rational functions before it.
  expect("exp(-s)/(s+1) + 2exp(-s)/(s+2)", list({3, 4}), list({1, 3, 2}), 1.0);
  expect("exp(-2)/(s+1)", list({std::exp(-2.0)}), list({1, 1}));
  expect("exp(-1-2s)/s", list({std::exp(-1.0)}), list({1, 0}), 2.0);
}

TEST(TransferExpression, Discrete) {
  const auto period = std::optional(Time(0.02));
  expect("0.5/(z-0.5)", list({0.5}), list({1, -0.5}), 0.0, period);
  // (1 + 2z⁻¹)/(1 - 0.5z⁻¹) is (z + 2)/(z - 0.5), and no pole at 0.
  expect("(1+2z^-1)/(1-0.5z^-1)", list({1, 2}), list({1, -0.5}), 0.0, period);
  expect("z^-1/(1-z^-1)", list({1}), list({1, -1}), 0.0, period);
  expect("0.1*z^-3/(1-0.9z^-1)", list({0.1}), list({1, -0.9, 0, 0}), 0.0, period);
  expect("(z^-1+z^-2)/(1-z^(-1))", list({1, 1}), list({1, -1, 0}), 0.0, period);
  expect("z*z^-1/(z-0.5)", list({1}), list({1, -0.5}), 0.0, period);
  expect("[1 2]/[1 -0.5]", list({1, 2}), list({1, -0.5}), 0.0, period);
  expect("3", list({3}), list({1}), 0.0, period);
}

TEST(TransferExpression, CompoundFractions) {
  // G/(1 + G): the closed loop's poles alone, not the plant's beside them.
  expect("(1/(s*(s+1)))/(1 + 1/(s*(s+1)))", list({1}), list({1, 1, 1}));
  expect("1/(s+1) + 1/(s+1)^2", list({1, 2}), list({1, 2, 1}));
  // What is written above and below one bar stays.
  expect("(s+1)/((s+1)*(s+2))", list({1, 1}), list({1, 3, 2}));
  // Factors in front stay in front: 20 roots at -1, expanded in 31 digits, are integers.
  const auto G = parse_transfer_function("1/(s+1)^20").value();
  double binomial = 1.0;
  for (Index k = 0; k <= 20; ++k) {
    EXPECT_EQ(G.den()(k), binomial);
    binomial = std::round(binomial * static_cast<double>(20 - k) / static_cast<double>(k + 1));
  }
}

/// A random expression and its value at a point by plain complex arithmetic.
struct Sample {
  std::string text;
  Complex value;
};
Sample sample(Random& random, int depth, Complex s) {
  const double pick = random.uniform(0.0, 1.0);
  const double x = std::round(random.uniform(0.1, 9.0) * 8.0) / 8.0;
  const std::string number = std::to_string(x);
  if (depth == 0 || pick < 0.1) {
    return pick < 0.5 ? Sample{"1/(s+" + number + ")", 1.0 / (s + x)}
                      : Sample{"(s+" + number + ")/(" + number + "s^2+s+7)",
                               (s + x) / (x * s * s + s + 7.0)};
  }
  const Sample a = sample(random, depth - 1, s);
  const Sample b = sample(random, depth - 1, s);
  if (pick < 0.4) {
    return {"(" + a.text + "+" + b.text + ")", a.value + b.value};
  }
  if (pick < 0.6) {
    return {"(" + a.text + ")(" + b.text + ")", a.value * b.value};
  }
  if (pick < 0.8) {
    return {"(" + a.text + "-" + number + "*(" + b.text + "))", a.value - x * b.value};
  }
  return {"(" + a.text + ")/(1+" + b.text + ")", a.value / (1.0 + b.value)};
}

TEST(TransferExpression, ValuesOfRandomExpressions) {
  Random random(11);
  int seen = 0;
  for (int i = 0; i < 2000; ++i) {
    const Complex s(random.uniform(0.1, 2.0), random.uniform(-3.0, 3.0));
    const Sample drawn = sample(random, 3, s);
    const auto G = parse_transfer_function(drawn.text);
    ASSERT_TRUE(G) << drawn.text << ": " << to_string(G.error());
    // Differences of the sample itself may be small.
    const double scale = std::max(std::abs(drawn.value), 1e-3);
    EXPECT_LE(std::abs(G->at(s).value() - drawn.value), 2e-11 * scale) << drawn.text;
    ++seen;
  }
  EXPECT_EQ(seen, 2000);
}

template <class E>
void refuse(std::string_view text, E code, std::string_view marks,
            std::optional<Time> period = {}) {
  const auto G = parse_transfer_function(text, period);
  ASSERT_FALSE(G) << text;
  EXPECT_TRUE(G.error().is(code)) << text << ": " << to_string(G.error());
  const std::string shown = expression::caret_lines(text, G.error());
  const std::size_t line = shown.find('\n');
  ASSERT_NE(line, std::string::npos) << text;
  EXPECT_EQ(shown.substr(line + 1, marks.size() + 1), std::string(marks) + " ")
      << text << "\n"
      << shown << "\n"
      << to_string(G.error());
}

TEST(TransferExpression, ErrorsAndTheirPlaces) {
  refuse("2/(s^2+3s+2", ExpressionError::unclosed_parenthesis, "  ^");
  refuse("2/(s+1))", ExpressionError::unopened_parenthesis, "       ^");
  refuse("2/(s+x)", ExpressionError::unknown_name, "     ^");
  refuse("2/(ss+1)", ExpressionError::unknown_name, "   ^~");
  refuse("2/(s+1)+1/(z-1)", TransferTextError::both_variables, "           ^");
  refuse("2*/s", ExpressionError::missing_operand, "  ^");
  refuse("2/", ExpressionError::missing_operand, "  ^");
  refuse("", ExpressionError::empty_formula, "^");
  refuse("   ", ExpressionError::empty_formula, "   ^");
  refuse("1,5/s", ExpressionError::stray_character, " ^");
  refuse("1.2.3/s", ExpressionError::malformed_number, "^~~~~");
  refuse("1e999/s", ExpressionError::malformed_number, "^~~~~");
  refuse("inf/s", ExpressionError::unknown_name, "^~~");
  refuse("exp(0.1s)/(s+1)", TransferTextError::negative_delay, "^~~~~~~~~");
  refuse("1/exp(-0.1s)", TransferTextError::negative_delay, "^~~~~~~~~~~~");
  refuse("exp(-s^2)", TransferTextError::not_a_delay, "^~~~~~~~~");
  refuse("exp(-1/s)", TransferTextError::not_a_delay, "^~~~~~~~~");
  refuse("s^0.5", TransferTextError::power_not_whole, "^~~~~");
  refuse("1/s^s", TransferTextError::power_not_whole, "  ^~~");
  refuse("sqrt(s)", TransferTextError::power_not_whole, "^~~~~~~");
  refuse("sqrt(-2)/s", TransferTextError::not_a_number, "^~~~~~~~");
  refuse("1/2s", TransferTextError::ambiguous_division, "  ^~");
  refuse("2/(s+1)(s+2)", TransferTextError::ambiguous_division, "  ^~~~~~~~~~");
  refuse("e^-0.1s", TransferTextError::ambiguous_division, "^~~~~~~");
  refuse("1/(s-s)", TransferError::zero_denominator, "^~~~~~~");
  refuse("1/0", TransferError::zero_denominator, "^~~");
  refuse("s^2/(s+1)", TransferError::improper, "^~~~~~~~~");
  refuse("s", TransferError::improper, "^");
  refuse("1/s + exp(-s)/s", TransferError::delay_in_loop, "^~~~~~~~~~~~~~~");
  refuse("1/(s+1)^101", TransferTextError::degree_too_high, "  ^~~~~~~~~");
  refuse("[1 2", ExpressionError::unclosed_parenthesis, "^");
  refuse("1/[]", ExpressionError::missing_operand, "  ^~");
  refuse("[1 x]/[1 2]", ExpressionError::malformed_number, "   ^");
  refuse("[1,,2]/[1 2 3]", ExpressionError::missing_operand, "   ^");
  refuse("1/(z-0.5)", TransferTextError::period_missing, "   ^");
  refuse("1/(s+1)", TransferTextError::period_without_z, "   ^", Time(0.1));
  refuse("exp(-z)", TransferTextError::not_a_delay, "^~~~~~~", Time(0.1));
  refuse("1/(s+1)\x01", ExpressionError::stray_character, "       ^~~~");
}

/// The same expression by complex arithmetic.
struct Late {
  std::string text;
  std::complex<double> (*value)(std::complex<double> s);
};

// What has several dead times is a system in which they stand; nothing is approximated.
TEST(TransferExpression, SeveralDeadTimes) {
  static constexpr auto e = [](Complex x) { return std::exp(x); };
  const Late cases[] = {
      {"exp(-s)/(s+1) + exp(-0.3*s)/(s+2)",
       [](Complex s) { return e(-s) / (s + 1.0) + e(-0.3 * s) / (s + 2.0); }},
      {"1/s + exp(-s)/s", [](Complex s) { return (1.0 + e(-s)) / s; }},
      {"feedback(2/s*exp(-s), 1)", [](Complex s) { return 2.0 * e(-s) / (s + 2.0 * e(-s)); }},
      {"feedback(2/s*exp(-s))", [](Complex s) { return 2.0 * e(-s) / (s + 2.0 * e(-s)); }},
      {"exp(-s)/(s + exp(-s))", [](Complex s) { return e(-s) / (s + e(-s)); }},
      {"(s^3+1)/(s^3 + 2s^2*exp(-0.1s) + 3exp(-0.5s))",
       [](Complex s) {
         return (s * s * s + 1.0) / (s * s * s + 2.0 * s * s * e(-0.1 * s) + 3.0 * e(-0.5 * s));
       }},
      {"feedback(exp(-0.2s)/(s+1)^2, exp(-0.3s)*(0.1 + 1/(s+3)))*(2 - exp(-s))/(s^2+s+4)",
       [](Complex s) {
         const Complex G = e(-0.2 * s) / ((s + 1.0) * (s + 1.0));
         const Complex H = e(-0.3 * s) * (0.1 + 1.0 / (s + 3.0));
         return G / (1.0 + G * H) * (2.0 - e(-s)) / (s * s + s + 4.0);
       }},
      {"(1 + exp(-s))^3/(s+1)^2",
       [](Complex s) {
         const Complex a = 1.0 + e(-s);
         return a * a * a / ((s + 1.0) * (s + 1.0));
       }},
      {"(0.5 - exp(-0.7s))^-1", [](Complex s) { return 1.0 / (0.5 - e(-0.7 * s)); }},
  };
  for (const Late& c : cases) {
    const std::string texts[] = {c.text};
    const auto parsed = parse_transfer_system(texts, {.gain = -1.5, .delay = Time(0.25)});
    ASSERT_TRUE(parsed) << c.text << ": " << to_string(parsed.error());
    const auto* system = std::get_if<DelaySystem>(&*parsed);
    ASSERT_NE(system, nullptr) << c.text;
    for (const Complex s : {Complex(0.0, 0.3), Complex(0.2, -2.0), Complex(-0.1, 11.0)}) {
      const Complex expected = -1.5 * e(-0.25 * s) * c.value(s);
      EXPECT_LE(std::abs(system->at(s).value()(0, 0) - expected), 2e-13 * std::abs(expected))
          << c.text;
    }
  }
  // No pole stands twice: that of s alone is the integrator, not two of them.
  const std::string shared[] = {"1/s + exp(-s)/s"};
  EXPECT_EQ(std::get<DelaySystem>(parse_transfer_system(shared).value()).states(), 1);
  // What cancels leaves a rational function, and so do delays that are one but for rounding.
  for (const char* text :
       {"feedback(1/s, 1)", "(exp(-s)+2)/(exp(-s)+2)/s", "exp(-0.1s)*exp(-0.2s)/s + exp(-0.3s)/s^2",
        "(1/s + exp(-s)/s)/(1 + exp(-s))", "exp(-s)/s + 1/s - exp(-s)/s"}) {
    const std::string texts[] = {text};
    EXPECT_TRUE(std::holds_alternative<TransferFunction>(parse_transfer_system(texts).value()))
        << text;
  }
  EXPECT_EQ(parse_transfer_function("feedback(2/(s+1), 3)").value().den(),
            Eigen::Vector2d(1.0, 7.0));
}

// Of random degree: the chain keeps what companion matrices lose.
TEST(TransferExpression, SeveralDeadTimesOfHighOrder) {
  Random random(3);
  for (int i = 0; i < 40; ++i) {
    std::string den;
    std::vector<double> at;
    for (int k = 0; k < 12; ++k) {
      const std::string digits = std::to_string(std::pow(10.0, 4.0 * random.uniform() - 2.0));
      at.push_back(std::stod(digits));
      den += "(s+" + digits + ")";
    }
    const std::string texts[] = {"(s+2)*exp(-0.1s)/(" + den + " + exp(-0.4s))"};
    const auto system = std::get<DelaySystem>(parse_transfer_system(texts).value());
    EXPECT_EQ(system.states(), 12);
    for (const double w : {0.02, 0.7, 30.0}) {
      const std::complex<double> s(0.0, w);
      std::complex<double> below = 1.0;
      for (const double p : at) {
        below *= s + p;
      }
      const auto expected = (s + 2.0) * std::exp(-0.1 * s) / (below + std::exp(-0.4 * s));
      EXPECT_LE(std::abs(system.at(s).value()(0, 0) - expected), 1e-11 * std::abs(expected));
    }
  }
}

TEST(TransferExpression, ErrorsOfSeveralDeadTimes) {
  const auto refused = [](const char* text) {
    const std::string texts[] = {text};
    return parse_transfer_system(texts).error();
  };
  EXPECT_TRUE(refused("1/(1 + s*exp(-s))").is(TransferError::improper));
  EXPECT_TRUE(refused("s + exp(-s)").is(TransferError::improper));
  EXPECT_TRUE(refused("1/(exp(-2s) + exp(-s))").is(TransferTextError::negative_delay));
  EXPECT_TRUE(refused("feedback(1, -1)").is(TransferError::zero_denominator));
  EXPECT_TRUE(refused("feedback").is(ExpressionError::missing_operand));
  EXPECT_TRUE(refused("feedback(1/s").is(ExpressionError::unclosed_parenthesis));
  EXPECT_TRUE(refused("feedback(1/s, 1, 2)").is(ExpressionError::stray_character));
  EXPECT_TRUE(refused("exp(-(1+exp(-s)))").is(TransferTextError::not_a_delay));
  EXPECT_TRUE(refused("(1+exp(-s)+exp(-pi*s))^20/s").is(TransferTextError::degree_too_high));
  EXPECT_EQ(
      to_string(parse_transfer_function("1/s + exp(-s)/s").error()),
      "transfer function: \"1/s + exp(-s)/s\" is made of parts of several dead times; it must "
      "be a rational function behind one dead time; approximate the others by (1 - T*s/2)/(1 "
      "+ T*s/2) (offset = 0, length = 15)");
}

TEST(TransferExpression, Sentences) {
  const auto said = [](std::string_view text) {
    return to_string(parse_transfer_function(text).error());
  };
  EXPECT_EQ(said("2/(s^2+3s+2"),
            "transfer function: \"(\" is not closed; write the ) that closes it (offset = 2, "
            "length = 1)");
  EXPECT_EQ(said("1/2s"),
            "transfer function: \"/2s\" is a division by a product without a sign; write /(2*s) to "
            "divide by both, or /2*s to divide by the first (offset = 2, length = 2)");
  EXPECT_EQ(
      said("1/(p+1)"),
      "transfer function: \"p\" is not known; it must be s or z, a number, exp(-T*s), sqrt(2) "
      "or pi; write s for the Laplace variable (offset = 3, length = 1)");
}

TEST(TransferExpression, BoundedDepthAndSize) {
  const std::string deep = std::string(5000, '(') + "s" + std::string(5000, ')');
  EXPECT_TRUE(parse_transfer_function("1/" + deep).error().is(ExpressionError::too_large));
  const std::string nested = "1/" + std::string(300, '(') + "s" + std::string(300, ')');
  EXPECT_TRUE(parse_transfer_function(nested).error().is(ExpressionError::too_deep));
  std::string powers = "2";
  for (int i = 0; i < 1000; ++i) {
    powers += "^1";
  }
  EXPECT_TRUE(parse_transfer_function(powers).error().is(ExpressionError::too_deep));
  std::string signs = "1/(s+1)";
  for (int i = 0; i < 4000; ++i) {
    signs = "-" + signs;
  }
  EXPECT_TRUE(parse_transfer_function(signs));
  const std::string fine = "1/" + std::string(150, '(') + "s" + std::string(150, ')');
  EXPECT_TRUE(parse_transfer_function(fine));
  std::string sum = "1/(s+1)";
  for (int i = 0; i < 900; ++i) {
    sum += "+1/(s+1)";
  }
  EXPECT_EQ(parse_transfer_function(sum).value().num()(0), 901.0);
}

TEST(TransferExpression, AnyBytesAreAnswered) {
  Random random(5);
  const std::string letters = "0123456789.e+-*/^()[]sz, xpqrt\xC2\xB2";
  int parsed = 0;
  for (int i = 0; i < 50'000; ++i) {
    std::string text;
    const int length = static_cast<int>(random.uniform(0.0, 20.0));
    for (int k = 0; k < length; ++k) {
      text += letters[static_cast<std::size_t>(
          random.uniform(0.0, static_cast<double>(letters.size()) - 1e-9))];
    }
    const auto G = parse_transfer_function(text);
    if (G) {
      ++parsed;
      EXPECT_TRUE(G->num().allFinite() && G->den().allFinite()) << text;
    } else {
      EXPECT_FALSE(expression::caret_lines(text, G.error()).empty()) << text;
    }
  }
  EXPECT_GT(parsed, 100);
}

TEST(TransferExpression, RootsAsWritten) {
  const std::vector<std::string> texts{"3(2s+1)", "1/((s+1)^20*(s^2+2s+5)^2)*exp(-s)"};
  const auto G = parse_zero_pole_gain(texts).value();
  ASSERT_EQ(G.poles().size(), 24);
  int at_one = 0;
  int complex = 0;
  for (const Complex& pole : G.poles()) {
    at_one += pole == -1.0 ? 1 : 0;
    complex += std::abs(pole - Complex(-1.0, 2.0)) < 1e-15 ? 1 : 0;
  }
  EXPECT_EQ(at_one, 20);
  EXPECT_EQ(complex, 2);
  EXPECT_EQ(G.zeros()(0), -0.5);
  EXPECT_EQ(G.gain(), 6.0);
  EXPECT_EQ(G.delay(), 1.0);
  EXPECT_TRUE(parse_zero_pole_gain(std::vector<std::string>{"1/("})
                  .error()
                  .is(ExpressionError::missing_operand));
}

TEST(TransferExpression, Products) {
  // A PD controller is improper alone.
  const std::vector<std::string> texts{"2*(1+0.1s)", "1/(s^2+s)"};
  const auto L = parse_transfer_product(texts).value();
  EXPECT_NEAR((L.num() - list({0.2, 2})).norm(), 0.0, 1e-16);
  const std::vector<std::string> wrong{"2", "1/(s+"};
  const Error error = parse_transfer_product(wrong).error();
  EXPECT_TRUE(error.is(ExpressionError::missing_operand));
  EXPECT_EQ(error.evidence().back().name, "text");
  EXPECT_EQ(error.evidence().back().values.front(), 1.0);
  const std::vector<std::string> mixed{"1/s", "1/z"};
  EXPECT_TRUE(parse_transfer_product(mixed).error().is(TransferTextError::period_missing));
}

}  // namespace
}  // namespace flyball::classical::transfer_expression_test
