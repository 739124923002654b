#include <flyball/systems/formula_model.hpp>

#include <cmath>
#include <numbers>
#include <thread>

#include <gtest/gtest.h>

#include <flyball/math/integration/adaptive.hpp>
#include <flyball/math/search/search_error.hpp>
#include <flyball/systems/equilibrium.hpp>
#include <flyball/systems/linearize.hpp>
#include <flyball/systems/model_step.hpp>

#include "support/allocation_count.hpp"

namespace flyball::formula_model_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A cart with a pole: x, θ (0: hanging), x', θ'; the force on the cart.
struct CartPole {
  static constexpr int states() { return 4; }
  static constexpr int inputs() { return 1; }
  [[nodiscard]] Eigen::Vector4d parameters() const { return {5.0, 0.5, 0.5, 9.81}; }
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    return derivative(x, u, parameters());
  }
  template <class X, class U, class P>
  [[nodiscard]] auto derivative(const X& x, const U& u, const P& p) const {
    using std::cos;
    using std::sin;
    using Scalar = ScalarOf<X, U, P>;
    const Scalar c = cos(x(1));
    const Scalar s = sin(x(1));
    const Scalar mass = p(0) + p(1) * s * s;
    const Scalar a = (u(0) + p(1) * s * (p(2) * x(3) * x(3) + p(3) * c)) / mass;
    const Scalar alpha = -(a * c + p(3) * s) / p(2);
    return Eigen::Vector<Scalar, 4>{x(2), x(3), a, alpha};
  }
};

ModelFormulas cart_pole_formulas() {
  return {
      .name = "cart-pole",
      .states = {{"x", "m"}, {"theta", "rad", true}, {"v", "m/s"}, {"omega", "rad/s"}},
      .inputs = {{"F", "N"}},
      .parameters = {{"M", "kg", 5.0}, {"m", "g", 500.0}, {"l", "cm", 50.0}, {"g", "m/s^2", 9.81}},
      .definitions = {{"mass", "M + m*sin(theta)^2", "kg"},
                      {"a", "(F + m*sin(theta)*(l*omega^2 + g*cos(theta)))/mass", "m/s^2"}},
      .derivatives = {{"omega", "-(a*cos(theta) + g*sin(theta))/l"},
                      {"x", "v"},
                      {"theta", "omega"},
                      {"v", "a"}},
      .outputs = {{"tip", "x + l*sin(theta)"}, {"theta", "theta"}}};
}

VectorXd vector(std::initializer_list<double> values) {
  VectorXd v(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), v.data());
  return v;
}

const VectorXd x0 = vector({0.3, 2.9, -0.4, 1.7});
const VectorXd u0 = vector({3.1});

TEST(FormulaModel, IsTheCompiledModel) {
  const AnyModel formula = formula_model(cart_pole_formulas()).value();
  const AnyModel compiled = CartPole{};
  EXPECT_LT((formula.derivative(x0, u0) - compiled.derivative(x0, u0)).lpNorm<Eigen::Infinity>(),
            1e-14);
  MatrixXd A(4, 4);
  MatrixXd B(4, 1);
  MatrixXd A_compiled(4, 4);
  MatrixXd B_compiled(4, 1);
  formula.jacobians(x0, u0, A, B);
  compiled.jacobians(x0, u0, A_compiled, B_compiled);
  EXPECT_LT((A - A_compiled).lpNorm<Eigen::Infinity>(), 1e-14 * A.lpNorm<Eigen::Infinity>());
  EXPECT_LT((B - B_compiled).lpNorm<Eigen::Infinity>(), 1e-14);
  MatrixXd F(4, 4);
  MatrixXd H(2, 4);
  MatrixXd F_compiled(4, 4);
  MatrixXd H_compiled(4, 4);
  formula.parameter_jacobians(x0, u0, F, H);
  compiled.parameter_jacobians(x0, u0, F_compiled, H_compiled);
  EXPECT_LT((F - F_compiled).lpNorm<Eigen::Infinity>(), 1e-13);
  // ∂(x + l sin θ)/∂l
  EXPECT_EQ(H, (MatrixXd(2, 4) << 0, 0, std::sin(x0(1)), 0, 0, 0, 0, 0).finished());
  // The trajectory of ten seconds, swinging.
  const auto end = [](const AnyModel& model) {
    return integrate(with_input(model, vector({0.0})), 0.0, x0, 10.0,
                     {.relative_tolerance = 1e-12, .absolute_tolerance = 1e-12})
        .value()
        .final_state();
  };
  EXPECT_LT((end(formula) - end(compiled)).norm(), 1e-8);
}

TEST(FormulaModel, SaysWhatItIs) {
  const AnyModel model = formula_model(cart_pole_formulas()).value();
  const ModelDescription description = model.description();
  EXPECT_EQ(description.name, "cart-pole");
  EXPECT_EQ(label(description.states[3]), "omega (rad/s)");
  EXPECT_TRUE(description.states[1].is_angle);
  EXPECT_EQ(label(description.outputs[0]), "tip (m)");
  EXPECT_FALSE(description.outputs[0].is_angle);
  EXPECT_TRUE(description.outputs[1].is_angle);
  EXPECT_EQ(description.outputs[1].unit, "rad");
  // 500 g and 50 cm, in SI.
  EXPECT_EQ(description.parameters[1].value, 0.5);
  EXPECT_EQ(description.parameters[1].unit, "kg");
  EXPECT_EQ(description.parameters[2].value, 0.5);
  const auto system = linearize(model, x0, u0).value();
  EXPECT_EQ(system.C.row(1), (MatrixXd(1, 4) << 0, 1, 0, 0).finished());
  EXPECT_DOUBLE_EQ(system.C(0, 1), 0.5 * std::cos(x0(1)));
}

TEST(FormulaModel, TakesOtherParameters) {
  const AnyModel model = formula_model(cart_pole_formulas()).value();
  const AnyModel longer = model.with_parameter("l", 0.7).value();
  CartPole compiled;
  const VectorXd expected = compiled.derivative(x0, u0, Eigen::Vector4d(5.0, 0.5, 0.7, 9.81));
  EXPECT_LT((longer.derivative(x0, u0) - expected).norm(), 1e-14);
  EXPECT_GT((model.derivative(x0, u0) - expected).norm(), 0.1);
}

TEST(FormulaModel, StepsAsTheCompiledModelAndDoesNotAllocate) {
  const AnyModel formula = formula_model(cart_pole_formulas()).value();
  for (const double l : {0.5, 0.7}) {  // as it was made, and changed
    ModelStepper by_formula(formula.with_parameter("l", l).value());
    VectorXd x = x0;
    Eigen::Vector4d expected = x0;
    const Eigen::Vector4d p(5.0, 0.5, l, 9.81);
    const test::AllocationCounter count;
    for (int i = 0; i < 100; ++i) {
      by_formula.step(x, u0, 0.01);
    }
    EXPECT_EQ(test::counts_allocations() ? count.count() : 0U, 0U);
    for (int i = 0; i < 100; ++i) {
      expected =
          rk4([&](const Eigen::Vector4d& at) { return CartPole{}.derivative(at, u0, p).eval(); },
              expected, 0.01);
    }
    EXPECT_GT((x - x0).norm(), 0.5);
    EXPECT_LT((x - expected).norm(), 1e-12);
  }
}

TEST(FormulaModel, MayBeUsedByManyThreadsAndDoesNotAllocate) {
  const AnyModel model = formula_model(cart_pole_formulas()).value();
  const VectorXd expected = model.derivative(x0, u0);
  std::vector<int> wrong(4, 0);
  std::vector<std::thread> threads;
  for (std::size_t k = 0; k < wrong.size(); ++k) {
    threads.emplace_back([&, k] {
      const AnyModel own = k % 2 == 0 ? model : model.with_parameter("M", 5.0).value();
      VectorXd dxdt(4);
      for (int i = 0; i < 1000; ++i) {
        own.derivative(x0, u0, dxdt);
        wrong[k] += dxdt == expected ? 0 : 1;
      }
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  EXPECT_EQ(wrong, std::vector<int>(4, 0));
  VectorXd dxdt(4);
  MatrixXd A(4, 4);
  MatrixXd B(4, 1);
  const test::AllocationCounter count;
  model.derivative(x0, u0, dxdt);
  model.jacobians(x0, u0, A, B);
  EXPECT_EQ(test::counts_allocations() ? count.count() : 0U, 0U);
}

/// A tape that is longer than what fits on the stack: x' = -x/n Σ cos²(k x) with n = 400.
TEST(FormulaModel, MayBeLong) {
  std::string sum;
  double expected = 0.0;
  for (int k = 1; k <= 400; ++k) {
    sum += (k == 1 ? "cos(" : " + cos(") + std::to_string(k) + "*x)^2";
    expected += std::pow(std::cos(k * 0.3), 2);
  }
  const AnyModel model =
      formula_model({.states = {{"x", "1"}}, .derivatives = {{"x", "-x/400*(" + sum + ")", "1/s"}}})
          .value_or(
              formula_model({.states = {{"x", ""}}, .derivatives = {{"x", "-x/400*(" + sum + ")"}}})
                  .value());
  EXPECT_NEAR(model.derivative(vector({0.3}), VectorXd(0))(0), -0.3 / 400 * expected, 1e-14);
}

std::vector<std::string> errors_of(const ModelFormulas& formulas) {
  std::vector<std::string> all;
  const auto model = formula_model(formulas);
  for (const Error& error : model ? std::vector<Error>{} : model.error()) {
    all.push_back(to_string(error));
  }
  return all;
}

TEST(FormulaModel, TellsAllThatIsWrong) {
  const auto errors = errors_of({.states = {{"theta", "rad"}, {"omega", "rad/s"}},
                                 .inputs = {{"u", "N m"}},
                                 .parameters = {{"theta", "m", 1.0}},
                                 .derivatives = {{"theta", "omgea"}, {"omeg", "1"}}});
  const auto has = [&](std::string_view part) {
    return std::any_of(errors.begin(), errors.end(), [&](const std::string& error) {
      return error.find(part) != std::string::npos;
    });
  };
  EXPECT_EQ(errors.size(), 4U) << testing::PrintToString(errors);
  EXPECT_TRUE(has("derivative of omeg: \"omeg\" is not a state; did you mean \"omega\"?"));
  EXPECT_TRUE(has("derivative of omega: the derivative of \"omega\" is missing"));
  EXPECT_TRUE(has("derivative of theta: \"omgea\""));
  EXPECT_TRUE(has("\"theta\" is given to two"));
}

TEST(FormulaModel, HoldsUnitsTogether) {
  const auto errors = errors_of({.states = {{"x", "m"}, {"v", "m/s"}},
                                 .derivatives = {{"x", "x"}, {"v", "-v"}},
                                 .outputs = {{"y", "x"}, {"y", "v"}, {"z", "x + v"}}});
  ASSERT_EQ(errors.size(), 4U) << testing::PrintToString(errors);
  EXPECT_NE(errors[0].find("the output \"y\" is given twice"), std::string::npos);
  EXPECT_NE(errors[1].find("in m; it must be in m/s, the unit of derivative of x"),
            std::string::npos)
      << errors[1];
  EXPECT_FALSE(errors_of({}).empty());
  EXPECT_FALSE(
      errors_of({.states = {{"x", "m"}}, .derivatives = {{"x", "1*x"}, {"x", "2*x"}}}).empty());
}

TEST(Equilibrium, OfACartPole) {
  const AnyModel model = formula_model(cart_pole_formulas()).value();
  const auto up = find_equilibrium(model, vector({0.2, 3.0, 0.1, 0.0}), vector({0.0})).value();
  EXPECT_NEAR(up.x(1), std::numbers::pi, 1e-12);
  EXPECT_NEAR(up.x(0), 0.2, 1e-12);  // where it stands is nobody's business
  EXPECT_NEAR(up.x.tail(2).norm(), 0.0, 1e-12);
  EXPECT_TRUE(is_equilibrium(model, up.x, up.u));
  EXPECT_FALSE(is_equilibrium(model, x0, u0));
  // A cart that is pushed never stands, unless the push may go.
  const auto pushed = find_equilibrium(model, x0, u0);
  ASSERT_FALSE(pushed);
  EXPECT_TRUE(pushed.error().is(SearchError::no_convergence)) << to_string(pushed.error());
  const auto free = find_equilibrium(model, x0, u0, EquilibriumBy::states_and_inputs).value();
  EXPECT_NEAR(free.u(0), 0.0, 1e-12);
}

TEST(Equilibrium, WhereTheModelGivesNoNumberIsRefused) {
  const AnyModel model =
      formula_model({.states = {{"x", ""}}, .derivatives = {{"x", "sqrt(x) - 1"}}}).value();
  EXPECT_NEAR(find_equilibrium(model, vector({2.0}), VectorXd(0)).value().x(0), 1.0, 1e-12);
  EXPECT_NEAR(find_equilibrium(model, vector({9.0}), VectorXd(0)).value().x(0), 1.0, 1e-12);
  const auto outside = find_equilibrium(model, vector({-1.0}), VectorXd(0));
  ASSERT_FALSE(outside);
  EXPECT_TRUE(outside.error().is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::formula_model_test
