#include <flyball/control/mpc/nonlinear_mpc.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/control/mpc/linear_mpc.hpp>
#include <flyball/mechanisms/pendulum.hpp>
#include <flyball/optimization/ocp/optimal_control.hpp>

#include "control/mpc/mpc_problems.hpp"
#include "support/allocation_count.hpp"

namespace nonlinear_mpc_test {
namespace {

using namespace flyball;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A differential drive 0.6 m wide: pose and the sides' velocities, from their voltages.
struct Drive {
  static constexpr int states() { return 5; }
  static constexpr int inputs() { return 2; }
  template <class X, class U>
  auto derivative(const X& x, const U& u) const {
    using std::cos;
    using std::sin;
    using S = ScalarOf<X, U>;
    const S v = 0.5 * (x(3) + x(4));
    return Eigen::Vector<S, 5>{v * cos(x(2)), v * sin(x(2)), (x(4) - x(3)) / 0.6,
                               -4.0 * x(3) - 0.5 * x(4) + 2.5 * u(0) + 0.4 * u(1),
                               -0.5 * x(3) - 4.0 * x(4) + 0.4 * u(0) + 2.5 * u(1)};
  }
};

/// ẋ = A x + B u.
struct LinearModel {
  Eigen::Matrix3d A;
  Eigen::Matrix<double, 3, 2> B;
  static constexpr int states() { return 3; }
  static constexpr int inputs() { return 2; }
  template <class X, class U>
  auto derivative(const X& x, const U& u) const {
    Eigen::Vector<ScalarOf<X, U>, 3> y;
    for (int i = 0; i < 3; ++i) {
      y(i) = A(i, 0) * x(0) + A(i, 1) * x(1) + A(i, 2) * x(2) + B(i, 0) * u(0) + B(i, 1) * u(1);
    }
    return y;
  }
};

struct Case {
  MatrixXd Q = VectorXd{{100.0, 100.0, 10.0, 1.0, 1.0}}.asDiagonal();
  MatrixXd R = 0.1 * MatrixXd::Identity(2, 2);
  MpcSettings settings{.horizon = 20};
  Eigen::Vector<double, 5> x_0{-0.3, 0.25, 0.4, 0.0, 0.0};
  Case() {
    settings.u_min = VectorXd::Constant(2, -6.0);
    settings.u_max = VectorXd::Constant(2, 6.0);
    settings.Q_end = 10.0 * Q;
  }
};

// Of a linear model the linearisation is the model: one period is the linear program of the step
// I + hA + … + (hA)⁴/24.
TEST(NonlinearMpc, OfALinearModelIsTheLinearOne) {
  LinearModel model;
  model.A << 0.0, 1.0, 0.0, -2.0, -0.3, 0.5, 0.1, 0.0, -1.0;
  model.B << 0.0, 0.1, 1.0, 0.0, 0.2, 1.0;
  const double h = 0.1;
  const MatrixXd I = MatrixXd::Identity(3, 3);
  const MatrixXd hA = h * model.A;
  const MatrixXd A = I + hA * (I + hA / 2.0 * (I + hA / 3.0 * (I + hA / 4.0)));
  const MatrixXd B = h * (I + hA / 2.0 * (I + hA / 3.0 * (I + hA / 4.0))) * model.B;
  MpcSettings settings{.horizon = 15};
  settings.u_min = VectorXd::Constant(2, -1.0);
  settings.u_max = VectorXd::Constant(2, 1.5);
  settings.du_max = VectorXd::Constant(2, 0.8);
  settings.Q_end = 5.0 * I;
  const MatrixXd R = 0.05 * MatrixXd::Identity(2, 2);
  auto linear = LinearMpc<>::create(A, B, I, R, settings).value();
  auto nonlinear = nonlinear_mpc(model, Time(h), I, R, settings).value();
  VectorXd x = VectorXd{{1.0, -2.0, 1.5}};
  for (int k = 0; k < 30; ++k) {
    const VectorXd u = linear.calculate(x);
    EXPECT_LT((VectorXd(nonlinear.calculate(x)) - u).norm(), 1e-9) << k;
    EXPECT_NEAR(nonlinear.cost(), linear.cost(), 1e-9 * (1.0 + linear.cost())) << k;
    x = A * x + B * u;
  }
  EXPECT_LT(nonlinear.change(), 1e-2);  // what the guess of the last period was off
}

// The first period iterates to the nonlinear program's optimum, which the interior-point method of
// optimal control finds with exact second derivatives.
TEST(NonlinearMpc, FirstPeriodIsTheNonlinearOptimum) {
  const Case c;
  using namespace optimization;
  OptimalControlProblem problem(5, 2, 20);
  problem.set_derivative(Drive{}, 20 * 0.05);
  const auto cost = [](const MatrixXd& W, const auto& v) {
    Expression sum = 0.0;
    for (Eigen::Index i = 0; i < W.rows(); ++i) {
      sum += 0.5 * W(i, i) * v(i) * v(i);
    }
    return sum;
  };
  problem.set_stage_cost([&](const auto& x, const auto& u) { return cost(c.Q, x) + cost(c.R, u); });
  problem.set_terminal_cost([&](const auto& x) { return cost(c.settings.Q_end, x); });
  problem.bound_inputs(c.settings.u_min, c.settings.u_max);
  problem.fix_state(0, c.x_0);
  const auto optimum = solve(problem).value();
  ASSERT_TRUE(optimum.solved());
  auto mpc = nonlinear_mpc(Drive{}, Time(0.05), c.Q, c.R, c.settings).value();
  const Eigen::Vector2d u = mpc.calculate(c.x_0);
  EXPECT_EQ(mpc.status(), MpcStatus::optimal);
  EXPECT_LT(mpc.change(), 0.1);  // the first order of second derivatives is left out
  EXPECT_NEAR(mpc.cost(), optimum.cost, 1e-5 * optimum.cost);
  EXPECT_LT((u - optimum.inputs.col(0)).norm(), 1e-3);
}

TEST(NonlinearMpc, DrivesToAPose) {
  const Case c;
  auto mpc = nonlinear_mpc(Drive{}, Time(0.05), c.Q, c.R, c.settings).value();
  Eigen::Vector<double, 5> x = c.x_0;
  const Drive drive;
  const std::size_t before = test::allocation_count();
  for (int k = 0; k < 100; ++k) {
    const Eigen::Vector2d u = mpc.calculate(x);
    ASSERT_EQ(mpc.status(), MpcStatus::optimal) << k;
    ASSERT_LE(u.cwiseAbs().maxCoeff(), 6.0);
    for (int i = 0; i < 50; ++i) {
      x += 0.001 * drive.derivative(x, u);
    }
  }
  EXPECT_EQ(test::allocation_count(), before);
  EXPECT_LT(x.norm(), 0.1);
}

TEST(NonlinearMpc, RecordsModelsOfTheHouse) {
  const auto pendulum = mechanisms::pendulum({.mass = Mass(1.0), .length = Length(0.5)}).value();
  MpcSettings settings{.horizon = 25};
  settings.u_min = VectorXd::Constant(1, -8.0);
  settings.u_max = VectorXd::Constant(1, 8.0);
  const MatrixXd Q = VectorXd{{10.0, 1.0}}.asDiagonal();
  auto mpc =
      nonlinear_mpc(pendulum, Time(0.02), Q, MatrixXd::Constant(1, 1, 0.01), settings).value();
  Eigen::Vector<double, 2> x{0.8, 0.0};
  for (int k = 0; k < 150; ++k) {
    const auto u = mpc.calculate(x);
    ASSERT_NE(mpc.status(), MpcStatus::held);
    for (int i = 0; i < 20; ++i) {
      x += 0.001 * pendulum.derivative(x, u);
    }
  }
  EXPECT_LT(x.norm(), 0.02);
}

TEST(NonlinearMpc, FiniteWhateverComes) {
  const Case c;
  auto mpc = nonlinear_mpc(Drive{}, Time(0.05), c.Q, c.R, c.settings).value();
  for (const double bad : {std::nan(""), HUGE_VAL, 1e101, 1e99, -1e30, 1e9}) {
    Eigen::Vector<double, 5> x = c.x_0;
    x(2) = bad;
    const Eigen::Vector2d u = mpc.calculate(x);
    EXPECT_TRUE(u.allFinite()) << bad;
    EXPECT_LE(u.cwiseAbs().maxCoeff(), 6.0) << bad;
    for (int k = 0; k < 3; ++k) {
      (void)mpc.calculate(c.x_0);
    }
    EXPECT_EQ(mpc.status(), MpcStatus::optimal) << bad;
  }
}

TEST(NonlinearMpc, RefusesWhatMakesNoSense) {
  const Case c;
  EXPECT_FALSE(nonlinear_mpc(Drive{}, Time(0.0), c.Q, c.R, c.settings));
  const auto wrong = nonlinear_mpc(Drive{}, Time(0.05), MatrixXd::Identity(4, 4), c.R, c.settings);
  ASSERT_FALSE(wrong);
  EXPECT_NE(to_string(wrong.error()).find("Q"), std::string::npos);
}

}  // namespace
}  // namespace nonlinear_mpc_test
