#include <flyball/math/integration/implicit.hpp>

#include <cmath>

#include <flyball/core/argument.hpp>
#include <flyball/math/derivatives/differentiation.hpp>
#include <flyball/math/integration/fixed_step.hpp>

namespace flyball::implicit_test {
namespace {

using Eigen::Vector2d;
using Scalar = Eigen::Vector<double, 1>;

// dx/dt = x cos t from x(0) = 1: x = e^(sin t).
double measured_order(const ButcherTableauView& tableau, int steps) {
  const auto f = [](double t, const Scalar& x) { return Scalar(x(0) * std::cos(t)); };
  const auto error = [&](int n) {
    Scalar x(1.0);
    const double dt = 1.0 / n;
    for (int k = 0; k < n; ++k) {
      x = implicit_runge_kutta_step(tableau, f, k * dt, x, dt).value();
    }
    return std::abs(x(0) - std::exp(std::sin(1.0)));
  };
  return std::log2(error(steps) / error(2 * steps));
}

TEST(ImplicitIntegration, MethodsConvergeWithTheirOrder) {
  EXPECT_NEAR(measured_order(tableaus::backward_euler, 24), 1.0, 0.02);
  EXPECT_NEAR(measured_order(tableaus::trapezoidal, 24), 2.0, 0.02);
  EXPECT_NEAR(measured_order(tableaus::gauss_legendre_2, 24), 2.0, 0.02);
  EXPECT_NEAR(measured_order(tableaus::sdirk_2, 24), 2.0, 0.02);
  EXPECT_NEAR(measured_order(tableaus::radau_iia_3, 24), 3.0, 0.05);
  EXPECT_NEAR(measured_order(tableaus::gauss_legendre_4, 12), 4.0, 0.02);
  EXPECT_NEAR(measured_order(tableaus::radau_iia_5, 6), 5.0, 0.05);
  EXPECT_NEAR(measured_order(tableaus::gauss_legendre_6, 6), 6.0, 0.05);
}

// A linear step multiplies by the stability function: dx/dt = -1000 x with dt = 1.
TEST(ImplicitIntegration, LinearStepsAreTheStabilityFunction) {
  const auto f = [](double, const Scalar& x) { return Scalar(-1000.0 * x); };
  const auto step = [&](const ButcherTableauView& tableau) {
    return implicit_runge_kutta_step(tableau, f, 0.0, Scalar(1.0), 1.0).value()(0);
  };
  for (const ButcherTableauView& tableau :
       {ButcherTableauView(tableaus::backward_euler), ButcherTableauView(tableaus::radau_iia_5),
        ButcherTableauView(tableaus::gauss_legendre_4), ButcherTableauView(tableaus::sdirk_2)}) {
    // The last sum cancels terms of the size of dt λ.
    EXPECT_NEAR(step(tableau), stability_function(tableau, -1000.0).real(), 1e-9);
  }
}

// Gauss methods keep quadratic invariants (Hairer, Lubich, Wanner, Theorem IV.2.1): the energy of
// an oscillator, over 10000 steps.
TEST(ImplicitIntegration, GaussKeepsTheEnergyOfAnOscillator) {
  const auto oscillator = [](double, const auto& x) {
    using T = typename std::decay_t<decltype(x)>::Scalar;
    return Eigen::Vector<T, 2>{x(1), -x(0)};
  };
  Vector2d x(1.0, 0.0);
  for (int k = 0; k < 10000; ++k) {
    x = implicit_runge_kutta_step(tableaus::gauss_legendre_4, with_exact_jacobian(oscillator), 0.0,
                                  x, 0.3)
            .value();
  }
  EXPECT_NEAR(x.squaredNorm(), 1.0, 1e-11);
}

TEST(ImplicitIntegration, ExplicitMethodsAreTheSpecialCase) {
  const auto f = [](double t, const Vector2d& x) {
    return Vector2d(x(1) * std::cos(t), -std::sin(x(0)));
  };
  const Vector2d x(0.4, 1.0);
  EXPECT_LT((implicit_runge_kutta_step(tableaus::rk4, f, 0.2, x, 0.1).value() -
             runge_kutta_step(tableaus::rk4, f, 0.2, x, 0.1))
                .norm(),
            1e-15);
}

TEST(ImplicitIntegration, Refusals) {
  const auto square = [](double, const Scalar& x) { return Scalar(x(0) * x(0)); };
  // z = (1 + z)² has no real solution.
  const auto none =
      implicit_runge_kutta_step(tableaus::backward_euler, square, 0.0, Scalar(1.0), 1.0);
  ASSERT_FALSE(none.has_value());
  EXPECT_TRUE(none.error().is(IntegrationError::no_convergence) ||
              none.error().is(IntegrationError::not_finite));
  const auto broken = [](double, const Scalar&) { return Scalar(NAN); };
  EXPECT_TRUE(implicit_runge_kutta_step(tableaus::backward_euler, broken, 0.0, Scalar(1.0), 1.0)
                  .error()
                  .is(IntegrationError::not_finite));
  // Bounded, but without a fixed point that Newton's iteration finds: a sign.
  const auto sign = [](double, const Scalar& x) { return Scalar(x(0) > 0.0 ? -1.0 : 1.0); };
  EXPECT_TRUE(implicit_runge_kutta_step(tableaus::backward_euler, sign, 0.0, Scalar(0.1), 1.0)
                  .error()
                  .is(IntegrationError::no_convergence));
  EXPECT_TRUE(implicit_runge_kutta_step(tableaus::backward_euler, square, NAN, Scalar(1.0), 1.0)
                  .error()
                  .is(ArgumentError::not_finite));
  EXPECT_TRUE(implicit_runge_kutta_step(
                  tableaus::backward_euler, [](double, const Eigen::VectorXd& x) { return x; }, 0.0,
                  Eigen::VectorXd(), 1.0)
                  .error()
                  .is(ArgumentError::empty));
}

}  // namespace
}  // namespace flyball::implicit_test
