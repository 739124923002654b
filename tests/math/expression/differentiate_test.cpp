#include <flyball/math/expression/differentiate.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <flyball/math/derivatives/differentiation.hpp>
#include <flyball/math/derivatives/dual.hpp>
#include <flyball/math/expression/formula.hpp>

#include "math/expression/formula_text.hpp"
#include "math/expression/random_tree.hpp"

namespace flyball::expression::differentiate_test {
namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

Tape tape_of(const std::string& text) {
  const auto compiled = compile({.variables = {{"x"}, {"y"}, {"z"}}, .outputs = {{"f", text}}});
  EXPECT_TRUE(compiled) << text << ": " << to_string(compiled.error().front());
  return compiled ? compiled->tape : Tape();
}

/// The gradient of a formula of x, y and z.
Eigen::RowVector3d gradient_of(const std::string& text, std::array<double, 3> at,
                               Accumulation how = Accumulation::forward) {
  const Derivatives derivatives = differentiate(tape_of(text), how);
  std::vector<double> values(derivatives.workspace_size());
  derivatives.tape.prepare<double>({}, values);
  double y = 0.0;
  Eigen::MatrixXd J(1, 3);
  derivatives.evaluate(at, {&y, 1}, J, values);
  return J;
}

/// Finite entries within a tolerance of the largest.
void expect_near(const Eigen::RowVectorXd& J, const Eigen::RowVectorXd& wanted, double tolerance,
                 const std::string& text) {
  double largest = 1.0;  // what cancels to less leaves the rounding of its terms
  for (Eigen::Index i = 0; i < wanted.size(); ++i) {
    largest = std::isfinite(wanted(i)) ? std::max(largest, std::abs(wanted(i))) : largest;
  }
  for (Eigen::Index i = 0; i < wanted.size(); ++i) {
    if (std::isfinite(wanted(i))) {
      EXPECT_NEAR(J(i), wanted(i), tolerance * largest) << text << ", column " << i;
    }
  }
}

/// Forward and reverse against dual numbers, which share no line with them.
TEST(Differentiate, AgreesWithDualNumbers) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> point(-3.0, 3.0);
  const std::vector<std::string> names{"x", "y", "z"};
  int compared = 0;
  int singular = 0;  // in reverse ∞ - ∞
  for (int k = 0; k < 3000; ++k) {
    const RandomTree tree = RandomTree::make(random, 3, 5);
    const std::string text = tree.text(names);
    const Tape tape = tape_of(text);
    std::array<Dual<3>, 3> x;
    std::array<double, 3> at{};
    for (std::size_t i = 0; i < 3; ++i) {
      at[i] = point(random);
      x[i] = Dual<3>::variable(at[i], static_cast<Eigen::Index>(i));
    }
    const Dual<3> wanted = tree.evaluate<Dual<3>>(x);
    if (!std::isfinite(wanted.value) || !wanted.gradient.allFinite()) {
      continue;
    }
    ++compared;
    // The tape over duals.
    std::vector<Dual<3>> duals(tape.size());
    tape.prepare<Dual<3>>({}, duals);
    Dual<3> y;
    tape.evaluate<Dual<3>>(x, {&y, 1}, duals);
    expect_near(y.gradient.transpose(), wanted.gradient.transpose(), 1e-12, text);
    // The tape's derivative tapes.
    for (const Accumulation how : {Accumulation::forward, Accumulation::reverse}) {
      const Derivatives derivatives = differentiate(tape, how);
      std::vector<double> values(derivatives.workspace_size());
      derivatives.tape.prepare<double>({}, values);
      double value = 0.0;
      Eigen::MatrixXd J(1, 3);
      derivatives.evaluate(at, {&value, 1}, J, values);
      if (how == Accumulation::reverse && !J.allFinite()) {
        ++singular;
        continue;
      }
      EXPECT_TRUE(J.allFinite()) << text;
      expect_near(J.row(0), wanted.gradient.transpose(), 1e-12, text);
    }
  }
  EXPECT_GT(compared, 1500);
  EXPECT_LT(singular, compared / 50);
}

TEST(Differentiate, TwiceGivesTheHessianOfHyperDualNumbers) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> point(0.2, 0.9);
  const std::vector<std::string> names{"x", "y", "z"};
  int compared = 0;
  for (int k = 0; k < 500; ++k) {
    const RandomTree tree = RandomTree::make(random, 3, 4);
    const Tape tape = tape_of(tree.text(names));
    std::array<Dual<3, 2>, 3> x;
    std::array<double, 3> at{};
    for (std::size_t i = 0; i < 3; ++i) {
      at[i] = point(random);
      x[i] = Dual<3, 2>::variable(at[i], static_cast<Eigen::Index>(i));
    }
    const Dual<3, 2> wanted = tree.evaluate<Dual<3, 2>>(x);
    if (!std::isfinite(wanted.value) || !wanted.gradient.allFinite() ||
        !wanted.hessian.allFinite()) {
      continue;
    }
    ++compared;
    const Derivatives first = differentiate(tape, Accumulation::reverse);
    const Derivatives second = differentiate(first.tape, Accumulation::forward);
    std::vector<double> values(second.workspace_size());
    second.tape.prepare<double>({}, values);
    std::vector<double> y(second.rows);
    Eigen::MatrixXd H(static_cast<Eigen::Index>(second.rows), 3);
    second.evaluate(at, y, H, values);
    for (std::size_t e = 0; e < first.entries.size(); ++e) {
      expect_near(H.row(static_cast<Eigen::Index>(e) + 1),
                  wanted.hessian.row(first.entries[e].column), 1e-11, tree.text(names));
    }
  }
  EXPECT_GT(compared, 300);
}

/// Each function against Richardson's differences, which know no rule of differentiation.
TEST(Differentiate, AgreesWithDifferences) {
  const char* const formulas[] = {"sin(x)*y",
                                  "cos(x)",
                                  "tan(x)",
                                  "asin(x)",
                                  "acos(x)",
                                  "atan(x)",
                                  "atan2(x, y)",
                                  "sinh(x)",
                                  "cosh(x)",
                                  "tanh(x)",
                                  "asinh(x)",
                                  "acosh(1 + x)",
                                  "atanh(x)",
                                  "exp(x)",
                                  "expm1(x)",
                                  "log(x)",
                                  "log1p(x)",
                                  "log2(x)",
                                  "log10(x)",
                                  "sqrt(x)",
                                  "cbrt(x)",
                                  "hypot(x, y, z)",
                                  "abs(x - y)",
                                  "min(x, y, z)",
                                  "max(x, y, z)",
                                  "mod(y, x)",
                                  "mod(-y, x)",
                                  "remainder(y, x)",
                                  "erf(x)",
                                  "x^y",
                                  "x^7",
                                  "x^-3",
                                  "x^2.5",
                                  "x/y",
                                  "clamp(y, x, z)",
                                  "2^x",
                                  "if(x < y, x*z, y)",
                                  "sign(x)*z",
                                  "round(x) + y",
                                  "floor(x) + ceil(y)"};
  const Eigen::Vector3d at{0.4, 1.3, 0.7};
  for (const char* const formula : formulas) {
    const Tape tape = tape_of(formula);
    std::vector<double> values(tape.size());
    tape.prepare<double>({}, values);
    const auto f = [&](const Eigen::Ref<const Eigen::VectorXd>& x) {
      double y = 0.0;
      tape.evaluate<double>({x.data(), 3}, {&y, 1}, values);
      return y;
    };
    const auto wanted =
        numerical_gradient(f, at, {.scheme = DifferenceScheme::richardson, .step = 0.02});
    ASSERT_TRUE(wanted) << formula;
    for (const Accumulation how : {Accumulation::forward, Accumulation::reverse}) {
      const Eigen::RowVector3d J = gradient_of(formula, {at(0), at(1), at(2)}, how);
      EXPECT_LT((J - wanted->transpose()).cwiseAbs().maxCoeff(), 1e-9) << formula;
    }
  }
}

TEST(Differentiate, TakesTheBranchTakenAtAKink) {
  const auto by_x = [](const char* text, double x) { return gradient_of(text, {x, 0.0, 0.0})(0); };
  EXPECT_EQ(by_x("abs(x)", 0.0), 1.0);
  EXPECT_EQ(by_x("abs(x)", -1.0), -1.0);
  EXPECT_EQ(by_x("min(x, 2*x)", 0.0), 1.0);
  EXPECT_EQ(by_x("max(x, 2*x)", 0.0), 1.0);
  EXPECT_EQ(by_x("max(0, x)", 0.0), 0.0);
  EXPECT_EQ(by_x("max(x, 0)", 0.0), 1.0);
  EXPECT_EQ(by_x("clamp(x, 0, 1)", 0.0), 1.0);
  EXPECT_EQ(by_x("clamp(x, 0, 1)", 1.0), 1.0);
  EXPECT_EQ(by_x("clamp(x, 0, 1)", 2.0), 0.0);
  EXPECT_EQ(by_x("if(x > 0, 3*x, 5*x)", 0.0), 5.0);
  EXPECT_EQ(by_x("sign(x)", 0.0), 0.0);
  EXPECT_EQ(by_x("floor(x)", 1.0), 0.0);
}

TEST(Differentiate, AtASingularPoint) {
  for (const Accumulation how : {Accumulation::forward, Accumulation::reverse}) {
    EXPECT_EQ(gradient_of("sqrt(x)", {0.0, 0.0, 0.0}, how), Eigen::RowVector3d(inf, 0.0, 0.0));
    // The branch not taken has an infinite slope.
    EXPECT_EQ(gradient_of("if(x > 0, sqrt(x), y)", {0.0, 1.0, 0.0}, how),
              Eigen::RowVector3d(0.0, 1.0, 0.0));
    EXPECT_EQ(gradient_of("max(sqrt(x), y)", {0.0, 1.0, 0.0}, how),
              Eigen::RowVector3d(0.0, 1.0, 0.0));
    EXPECT_EQ(gradient_of("x^y", {0.0, 2.0, 0.0}, how), Eigen::RowVector3d(0.0, 0.0, 0.0));
    EXPECT_EQ(gradient_of("x^2.5", {0.0, 0.0, 0.0}, how), Eigen::RowVector3d(0.0, 0.0, 0.0));
    // A runtime zero through a slope that is not finite.
    EXPECT_EQ(gradient_of("sqrt(x*y)", {0.0, 0.0, 0.0}, how), Eigen::RowVector3d(0.0, 0.0, 0.0));
  }
}

TEST(Differentiate, LeavesStructuralZerosOut) {
  const auto compiled =
      compile({.variables = {{"x"}, {"v"}, {"u"}},
               .parameters = {{"m", "", 2.0}},
               .outputs = {{"a", "v"}, {"b", "u/m - sin(x)"}, {"c", "3"}, {"d", "sign(x)"}}});
  ASSERT_TRUE(compiled);
  const Derivatives forward = differentiate(compiled->tape);
  EXPECT_EQ(forward.entries, (std::vector<Entry>{{1, 0}, {0, 1}, {1, 2}}));
  const Derivatives reverse = differentiate(compiled->tape, Accumulation::reverse);
  EXPECT_EQ(reverse.entries, (std::vector<Entry>{{0, 1}, {1, 0}, {1, 2}}));
  // With respect to the parameter: ∂(u/m)/∂m = -u/m² = -3/4.
  const std::array by_m{compiled->tape.parameter_slot(0)};
  const Derivatives derivatives = differentiate(compiled->tape, by_m);
  std::vector<double> values(derivatives.workspace_size());
  std::vector<double> y(4);
  Eigen::MatrixXd J(4, 1);
  derivatives.tape.prepare<double>(compiled->parameters, values);
  derivatives.evaluate(std::array{0.0, 0.0, 3.0}, y, J, values);
  EXPECT_EQ(J, Eigen::Vector4d(0.0, -0.75, 0.0, 0.0));
}

/// The cart-pole of the book's section 13.3 over a generic scalar: ẍ and θ̈ from
/// (m_c + m_p sin²θ) ẍ = u + m_p sin θ (l θ̇² + g cos θ), and
/// l (m_c + m_p sin²θ) θ̈ = -u cos θ - m_p l θ̇² cos θ sin θ - (m_c + m_p) g sin θ.
struct CartPole {
  double m_c = 5.0;
  double m_p = 0.5;
  double l = 0.5;
  double g = 9.806;
  template <class T>
  Eigen::Vector<T, 4> operator()(const Eigen::Vector<T, 5>& x) const {
    using std::sin, std::cos;
    const T s = sin(x(1));
    const T c = cos(x(1));
    const T mass = m_c + m_p * s * s;
    return {x(2), x(3), (x(4) + m_p * s * (l * x(3) * x(3) + g * c)) / mass,
            (-(x(4) * c) - m_p * l * x(3) * x(3) * c * s - (m_c + m_p) * g * s) / (l * mass)};
  }
};

FormulaSet cart_pole_formulas() {
  return {.variables = {{"x", "m"}, {"θ", "rad"}, {"v", "m/s"}, {"ω", "rad/s"}, {"F", "N"}},
          .parameters = {{"m_c", "kg", 5.0},
                         {"m_p", "kg", 0.5},
                         {"l", "m", 0.5},
                         {"g", "m/s^2", 9.806}},
          .definitions = {{"s", "sin(θ)"}, {"c", "cos(θ)"}, {"mass", "m_c + m_p*s^2", "kg"}},
          .outputs = {{"x", "v", "m/s"},
                      {"θ", "ω", "rad/s"},
                      {"v", "(F + m_p*s*(l*ω^2 + g*c))/mass", "m/s^2"},
                      {"ω", "(-F*c - m_p*l*ω^2*c*s - (m_c + m_p)*g*s)/(l*mass)", "rad/s^2"}}};
}

TEST(Differentiate, AFormulaModelHasTheJacobianOfTheCompiledModel) {
  const auto compiled = compile(cart_pole_formulas());
  ASSERT_TRUE(compiled) << to_string(compiled.error().front());
  const Derivatives derivatives = differentiate(compiled->tape);
  EXPECT_EQ(derivatives.entries.size(), 8U);  // ẋ by v, θ̇ by ω, and θ, ω, F in the other two
  std::vector<double> values(derivatives.workspace_size());
  derivatives.tape.prepare<double>(compiled->parameters, values);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> point(-3.0, 3.0);
  for (int k = 0; k < 1000; ++k) {
    Eigen::Vector<double, 5> x;
    std::generate(x.begin(), x.end(), [&] { return point(random); });
    const auto wanted = flyball::jacobian([](const auto& at) { return CartPole{}(at.eval()); }, x);
    const Eigen::Vector4d f = CartPole{}(x);
    Eigen::Vector4d y;
    Eigen::MatrixXd J(4, 5);
    derivatives.evaluate({x.data(), 5}, {y.data(), 4}, J, values);
    for (Eigen::Index i = 0; i < 4; ++i) {
      EXPECT_NEAR(y(i), f(i), 1e-14 * f.cwiseAbs().maxCoeff());
      EXPECT_LT((J.row(i) - wanted.row(i)).norm(), 1e-14 * wanted.row(i).norm()) << x.transpose();
    }
  }
}

}  // namespace
}  // namespace flyball::expression::differentiate_test
