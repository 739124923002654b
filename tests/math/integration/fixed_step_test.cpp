#include <flyball/math/integration/fixed_step.hpp>

#include <cmath>

#include <flyball/math/exponential/matrix_exponential.hpp>

#include "support/allocation_count.hpp"

namespace flyball::fixed_step_test {
namespace {

using Eigen::Vector2d;

/// x'' = -x.
Vector2d oscillator(const Vector2d& x) {
  return {x(1), -x(0)};
}

/// log2 of the ratio of the errors of two step sizes at t = 1 of dx/dt = x cos t, x = e^(sin t).
template <std::size_t Stages>
double measured_order(const ButcherTableau<Stages>& tableau) {
  const auto error = [&](int steps) {
    double x = 1.0;
    const double dt = 1.0 / steps;
    for (int k = 0; k < steps; ++k) {
      x = runge_kutta_step(
          tableau, [](double t, double at) { return at * std::cos(t); }, k * dt, x, dt);
    }
    return std::abs(x - std::exp(std::sin(1.0)));
  };
  return std::log2(error(40) / error(80));
}

TEST(Integration, ExplicitMethodsConvergeWithTheirOrder) {
  EXPECT_NEAR(measured_order(tableaus::forward_euler), 1.0, 0.05);
  EXPECT_NEAR(measured_order(tableaus::midpoint), 2.0, 0.1);
  EXPECT_NEAR(measured_order(tableaus::heun), 2.0, 0.1);
  EXPECT_NEAR(measured_order(tableaus::ralston), 2.0, 0.1);
  EXPECT_NEAR(measured_order(tableaus::bogacki_shampine), 3.0, 0.1);
  EXPECT_NEAR(measured_order(tableaus::rk4), 4.0, 0.15);
  EXPECT_NEAR(measured_order(tableaus::three_eighths), 4.0, 0.15);
  EXPECT_NEAR(measured_order(tableaus::dormand_prince), 5.0, 0.3);
}

// One step of h = 0.5 from (1, 0): the Taylor polynomial of order 4 of (cos h, -sin h):
// 1 - 1/8 + 1/384 = 0.877604166…, -(1/2 - 1/48) = -0.479166…
TEST(Integration, Rk4OfAnOscillatorIsItsTaylorPolynomial) {
  const Vector2d x = rk4(oscillator, Vector2d(1.0, 0.0), 0.5);
  EXPECT_DOUBLE_EQ(x(0), 1.0 - 1.0 / 8.0 + 1.0 / 384.0);
  EXPECT_DOUBLE_EQ(x(1), -(0.5 - 1.0 / 48.0));
  const Vector2d euler = forward_euler(oscillator, Vector2d(1.0, 0.0), 0.5);
  EXPECT_EQ(euler, Vector2d(1.0, -0.5));
}

TEST(Integration, FormsWithInputAndTimeAgree) {
  const auto f = [](const Vector2d& x, const Vector2d& u) { return Vector2d(x(1) + u(0), -x(0)); };
  const auto timed = [&](double, const Vector2d& x, const Vector2d& u) { return f(x, u); };
  const auto closed = [&](const Vector2d& x) { return f(x, Vector2d(0.3, 0.0)); };
  const Vector2d x(0.2, -0.7);
  const Vector2d u(0.3, 0.0);
  EXPECT_TRUE(rk4(f, x, u, 0.1).isApprox(rk4(closed, x, 0.1), 1e-15));
  EXPECT_TRUE(rk4(timed, 5.0, x, u, 0.1).isApprox(rk4(closed, x, 0.1), 1e-15));
  EXPECT_EQ(forward_euler(f, x, u, 0.1), forward_euler(closed, x, 0.1));
  EXPECT_EQ(forward_euler(timed, 5.0, x, u, 0.1), forward_euler(closed, x, 0.1));
  // Fixed and dynamic sizes.
  const auto dynamic = [](const Eigen::VectorXd& at) { return Eigen::VectorXd{{at(1), -at(0)}}; };
  EXPECT_EQ(Vector2d(rk4(dynamic, Eigen::VectorXd(x), 0.1)), rk4(oscillator, x, 0.1));
}

// ∫ t³ dt = 1/4 exactly: order 4 integrates cubics, also with a time of its own.
TEST(Integration, TimeIsPassedToEachStage) {
  const double x =
      rk4([](double t, double, double u) { return u * t * t * t; }, 0.0, 0.0, 1.0, 1.0);
  EXPECT_DOUBLE_EQ(x, 0.25);
  EXPECT_DOUBLE_EQ(forward_euler([](double t, double, double) { return t; }, 3.0, 0.0, 0.0, 0.5),
                   1.5);
}

TEST(Integration, FixedSizesDoNotAllocate) {
  Vector2d x(1.0, 0.0);
  const auto f = [](const Vector2d& at, double u) { return Vector2d(at(1), u - at(0)); };
  const test::AllocationCounter allocations;
  for (int k = 0; k < 100; ++k) {
    x = rk4(oscillator, x, 0.01);
    x = rk4(f, x, 0.5, 0.01);
    x = forward_euler(oscillator, x, 0.01);
    x = runge_kutta_step(
        tableaus::dormand_prince, [](double, const Vector2d& at) { return oscillator(at); }, 0.0, x,
        0.01);
  }
  if (test::counts_allocations()) {
    EXPECT_EQ(allocations.count(), 0u);
  }
  EXPECT_TRUE(x.allFinite());
}

// A double integrator under u = 2: v = 2t, x = t²; its A has no inverse.
TEST(Integration, LinearSystemsExactly) {
  const Eigen::Matrix2d A{{0.0, 1.0}, {0.0, 0.0}};
  const Vector2d B(0.0, 1.0);
  const Eigen::VectorXd u = Eigen::VectorXd::Constant(1, 2.0);
  const auto x = integrate_linear(A, B, Vector2d(1.0, 0.0), u, 3.0);
  EXPECT_NEAR((*x)(0), 10.0, 1e-14);
  EXPECT_NEAR((*x)(1), 6.0, 1e-14);
  // The input from 0 to 6 over 3 s is 2t: v = t² = 9, x = 1 + t³/3 = 10.
  const auto ramp =
      integrate_linear(A, B, Vector2d(1.0, 0.0), Eigen::VectorXd::Zero(1), 3.0 * u, 3.0);
  EXPECT_NEAR((*ramp)(0), 10.0, 1e-14);
  EXPECT_NEAR((*ramp)(1), 9.0, 1e-14);
}

TEST(Integration, LinearStepsCompose) {
  {
    const bool holds = rc::check("two steps are one, and back", [] {
      const auto entry = [] { return *rc::gen::inRange(-300, 300) / 100.0; };
      Eigen::MatrixXd A(3, 3);
      Eigen::MatrixXd B(3, 2);
      Eigen::VectorXd x(3);
      Eigen::VectorXd u(2);
      Eigen::VectorXd w(2);
      for (auto* M : {&A, &B}) {
        for (Eigen::Index i = 0; i < M->size(); ++i) {
          (*M)(i) = entry();
        }
      }
      for (auto* v : {&x, &u, &w}) {
        for (Eigen::Index i = 0; i < v->size(); ++i) {
          (*v)(i) = entry();
        }
      }
      const Eigen::VectorXd whole = integrate_linear(A, B, x, u, w, 0.5).value();
      const Eigen::VectorXd middle = u + 0.4 * (w - u);
      const Eigen::VectorXd half = integrate_linear(A, B, x, u, middle, 0.2).value();
      const Eigen::VectorXd two = integrate_linear(A, B, half, middle, w, 0.3).value();
      const double scale = 1.0 + whole.norm() + expm(A * 0.5).value().norm();
      RC_ASSERT((whole - two).norm() < 1e-12 * scale);
      const Eigen::VectorXd back =
          integrate_linear(A, B, integrate_linear(A, B, x, u, 0.5).value(), u, -0.5).value();
      RC_ASSERT((back - x).norm() < 1e-11 * (1.0 + expm(A.cwiseAbs()).value().norm()));
    });
    EXPECT_TRUE(holds);
  }
}

TEST(Integration, LinearRefusals) {
  const Eigen::Matrix2d A = Eigen::Matrix2d::Identity();
  const Vector2d one(1.0, 1.0);
  const Eigen::VectorXd u = Eigen::VectorXd::Ones(1);
  EXPECT_TRUE(integrate_linear(one, one, one, u, 1.0).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(integrate_linear(A, one, u, u, 1.0).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(integrate_linear(A, one, one, one, 1.0).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(integrate_linear(A, one, one, u, one, 1.0).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(integrate_linear(A, one, one, u, NAN).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(
      integrate_linear(A, one, one * INFINITY, u, 1.0).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(
      integrate_linear(A, one, one, u, 1000.0).error().is(MatrixExponentialError::overflow));
}

}  // namespace
}  // namespace flyball::fixed_step_test
