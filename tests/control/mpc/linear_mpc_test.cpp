#include <flyball/control/mpc/linear_mpc.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/control/lqr.hpp>

#include "control/mpc/mpc_problems.hpp"
#include "support/allocation_count.hpp"

namespace linear_mpc_test {
namespace {

using namespace flyball;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using mpc_problems::Program;

constexpr double infinity = std::numeric_limits<double>::infinity();

// Without limits that count, and with the Riccati equation's weight at the end, it is the LQR:
// u = -K x whatever the horizon.
TEST(LinearMpc, IsTheLqrWhereNoLimitCounts) {
  Program p = mpc_problems::drive();
  p.settings.Q_end = MatrixXd();
  const auto K = lqr(p.A, p.B, p.Q, p.R).value().K;
  for (const int horizon : {1, 7, 40}) {
    p.settings.horizon = horizon;
    auto mpc = mpc_problems::controller(p).value();
    const VectorXd x = 0.01 * p.x_0;
    EXPECT_LT((mpc.calculate(x) + K * x).norm(), 1e-9) << horizon;
    EXPECT_EQ(mpc.status(), MpcStatus::optimal);
    EXPECT_EQ(mpc.iterations(), 1);
    // ½ xᵀS x is what it costs.
    const MatrixXd S = lqr(p.A, p.B, p.Q, p.R).value().S;
    EXPECT_NEAR(mpc.cost(), 0.5 * x.dot(S * x), 1e-9 * mpc.cost());
  }
}

// One period, one state: min ½ q (a x + b u)² + ½ r u², u = -q a b x/(q b² + r), within its limits.
TEST(LinearMpc, OnePeriodInClosedForm) {
  const MatrixXd one = MatrixXd::Ones(1, 1);
  MpcSettings settings{.horizon = 1};
  settings.u_max = VectorXd::Constant(1, 0.5);
  settings.Q_end = 3.0 * one;
  auto mpc = LinearMpc<1, 1>::create(0.9 * one, 2.0 * one, one, 0.1 * one, settings).value();
  using Number = Eigen::Matrix<double, 1, 1>;
  const double gain = 3.0 * 0.9 * 2.0 / (3.0 * 4.0 + 0.1);
  EXPECT_NEAR(mpc.calculate(Number(1.0))(0), -gain, 1e-14);
  EXPECT_NEAR(mpc.calculate(Number(-0.3))(0), 0.3 * gain, 1e-14);
  EXPECT_EQ(mpc.calculate(Number(-3.0))(0), 0.5);
  EXPECT_NEAR(mpc.predicted_state(1)(0), -2.7 + 1.0, 1e-14);
}

/// Against the modelling layer's solver, which states and solves the same program another way.
void expect_as_problem(bool rates, bool states, std::uint64_t seed, int count) {
  Random random(seed);
  int limited = 0;
  for (int i = 0; i < count; ++i) {
    const Program p = mpc_problems::random_program(random, rates, states);
    const auto answer = mpc_problems::solve_as_problem(p);
    ASSERT_TRUE(answer.solved) << i;
    auto mpc = mpc_problems::controller(p).value();
    const VectorXd u = mpc.calculate(p.x_0);
    EXPECT_NE(mpc.status(), MpcStatus::capped) << i;
    EXPECT_NEAR(mpc.cost(), answer.cost, 2e-7 * (1.0 + std::abs(answer.cost))) << i;
    EXPECT_LT((u - answer.u).norm(), 2e-3) << i;  // of a cost that is nearly flat
    limited += mpc.iterations() > 1 ? 1 : 0;
    // Within the limits to the last bit, from the next state as well.
    EXPECT_TRUE((u.array() >= p.settings.u_min.array()).all()) << i;
    EXPECT_TRUE((u.array() <= p.settings.u_max.array()).all()) << i;
  }
  EXPECT_GT(limited, count / 2);
}

TEST(LinearMpc, RandomProgramsWithInputLimits) {
  expect_as_problem(false, false, 17, 60);
}
TEST(LinearMpc, RandomProgramsWithRates) {
  expect_as_problem(true, false, 18, 60);
}
TEST(LinearMpc, RandomProgramsWithSoftStates) {
  expect_as_problem(false, true, 19, 60);
}
TEST(LinearMpc, RandomProgramsWithRatesAndSoftStates) {
  expect_as_problem(true, true, 20, 60);
}

// 60 steps of the two loops that other solvers were measured with; each program's optimum by the
// modelling layer.
TEST(LinearMpc, ClosedLoopsOfTheBenchmarks) {
  for (Program p : {mpc_problems::drive(), mpc_problems::quadrotor()}) {
    auto mpc = mpc_problems::controller(p).value();
    auto cold = mpc;  // A copy has its own memory.
    for (int k = 0; k < 60; ++k) {
      const VectorXd u = mpc.calculate(p.x_0);
      ASSERT_EQ(mpc.status(), MpcStatus::optimal) << k;
      cold.reset();
      EXPECT_LT((cold.calculate(p.x_0) - u).norm(), 1e-9) << k;
      EXPECT_LE(mpc.iterations(), cold.iterations()) << k;
      if (k < 4 || k % 20 == 0) {
        const auto answer = mpc_problems::solve_as_problem(p);
        ASSERT_TRUE(answer.solved) << k;
        EXPECT_LT((u - answer.u).norm(), 1e-5) << k;
        EXPECT_NEAR(mpc.cost(), answer.cost, 1e-7 * (1.0 + answer.cost)) << k;
      }
      p.x_0 = p.A * p.x_0 + p.B * u;
    }
    EXPECT_LT((p.x_0 - p.r).norm(), 0.2);
  }
}

TEST(LinearMpc, WarmStartsAreNotWorseThanColdOnes) {
  Random random(21);
  int warm = 0;
  int cold_total = 0;
  for (int i = 0; i < 40; ++i) {
    Program p = mpc_problems::random_program(random, i % 2 == 0, false);
    p.settings.horizon = 12;
    auto mpc = mpc_problems::controller(p).value();
    auto cold = mpc;
    VectorXd x = p.x_0;
    for (int k = 0; k < 15; ++k) {
      const VectorXd last = k > 0 ? VectorXd(mpc.predicted_input(0)) : p.u_last;
      const VectorXd u = mpc.calculate(x);
      cold.reset();
      cold.set_last_input(last);
      EXPECT_LT((cold.calculate(x) - u).norm(), 1e-7) << i << ", " << k;
      warm += mpc.iterations();
      cold_total += cold.iterations();
      x = p.A * x + p.B * u + p.d;
      if (x.norm() > 1e3) {
        break;  // no input within the limits holds this plant
      }
    }
  }
  EXPECT_LT(warm, cold_total);
}

// x⁺ = x + u from 0 to 10 with |u| ≤ 1 and x ≤ 3: it stops at the limit that it can keep.
TEST(LinearMpc, KeepsALimitOfAStateThatCanBeKept) {
  const MatrixXd one = MatrixXd::Ones(1, 1);
  MpcSettings settings{.horizon = 8};
  settings.u_min = VectorXd::Constant(1, -1.0);
  settings.u_max = VectorXd::Constant(1, 1.0);
  settings.x_max = VectorXd::Constant(1, 3.0);
  auto mpc = LinearMpc<1, 1>::create(one, one, one, 0.1 * one, settings).value();
  using Number = Eigen::Matrix<double, 1, 1>;
  mpc.set_reference(Number(10.0), Number(0.0));
  double x = 0.0;
  for (int k = 0; k < 12; ++k) {
    x += mpc.calculate(Number(x))(0);
    EXPECT_EQ(mpc.status(), MpcStatus::optimal) << k;
    EXPECT_LT(mpc.violation(), 1e-7) << k;
    EXPECT_LT(x, 3.0 + 1e-7) << k;
  }
  EXPECT_NEAR(x, 3.0, 1e-6);
  // From beyond the limit no input keeps it at once: as fast as the input allows.
  EXPECT_NEAR(mpc.calculate(Number(5.5))(0), -1.0, 1e-6);
  EXPECT_EQ(mpc.status(), MpcStatus::softened);
  EXPECT_NEAR(mpc.violation(), 1.5, 1e-6);
}

TEST(LinearMpc, InputRatesHoldFromPeriodToPeriod) {
  Program p = mpc_problems::drive();
  p.settings.du_min = VectorXd::Constant(2, -3.0);
  p.settings.du_max = VectorXd::Constant(2, 2.0);
  auto mpc = mpc_problems::controller(p).value();
  VectorXd x = p.x_0;
  VectorXd last = VectorXd::Zero(2);
  int at_limit = 0;
  for (int k = 0; k < 60; ++k) {
    const VectorXd u = mpc.calculate(x);
    EXPECT_EQ(mpc.status(), MpcStatus::optimal);
    EXPECT_GE((u - last).minCoeff(), -3.0 - 1e-9);
    EXPECT_LE((u - last).maxCoeff(), 2.0 + 1e-9);
    at_limit += (u - last).maxCoeff() > 2.0 - 1e-9 || (u - last).minCoeff() < -3.0 + 1e-9 ? 1 : 0;
    last = u;
    x = p.A * x + p.B * u;
  }
  EXPECT_GT(at_limit, 3);
  EXPECT_LT(x.norm(), 0.05);
}

TEST(LinearMpc, FixedSizesAreTheDynamicOnes) {
  const Program p = mpc_problems::drive();
  auto dynamic = mpc_problems::controller(p).value();
  auto fixed = LinearMpc<5, 2>::create(p.A, p.B, p.Q, p.R, p.settings).value();
  VectorXd x = p.x_0;
  for (int k = 0; k < 20; ++k) {
    const Eigen::Matrix<double, 5, 1> same = x;
    const VectorXd u = dynamic.calculate(x);
    EXPECT_EQ(fixed.calculate(same), u);
    x = p.A * x + p.B * u;
  }
}

TEST(LinearMpc, DoesNotAllocate) {
  for (const bool limited : {false, true}) {
    Program p = mpc_problems::quadrotor();
    if (limited) {
      p.settings.x_max = VectorXd::Constant(12, 0.4);
      p.settings.du_max = VectorXd::Constant(4, 0.5);
    }
    auto mpc = mpc_problems::controller(p).value();
    VectorXd x = p.x_0;
    VectorXd next = x;
    const std::size_t before = test::allocation_count();
    for (int k = 0; k < 20; ++k) {
      const VectorXd& u = mpc.calculate(x);
      next = x;
      next.noalias() = p.A.lazyProduct(x) + p.B.lazyProduct(u);
      x = next;
      mpc.set_reference(p.r, p.u_r);
      mpc.set_disturbance(p.d);
    }
    EXPECT_EQ(test::allocation_count(), before);
  }
}

TEST(LinearMpc, FiniteAndWithinLimitsWhateverComes) {
  Program p = mpc_problems::drive();
  p.settings.x_max = VectorXd::Constant(5, 1.0);
  p.settings.du_max = VectorXd::Constant(2, 4.0);
  auto mpc = mpc_problems::controller(p).value();
  const double nan = std::nan("");
  for (const double bad : {nan, infinity, -infinity, 1e101, 1e99, 1e30, 1e12, -1e9, 1e-300}) {
    for (int i = 0; i < 5; ++i) {
      VectorXd x = p.x_0;
      x(i) = bad;
      const VectorXd u = mpc.calculate(x);
      EXPECT_TRUE(u.allFinite()) << bad;
      EXPECT_LE(u.cwiseAbs().maxCoeff(), 12.0) << bad;
      if (!(std::abs(bad) <= largest_signal)) {
        EXPECT_EQ(mpc.status(), MpcStatus::held);
      }
      // And the next good state is answered as if nothing had been.
      mpc.reset();
      const VectorXd after = mpc.calculate(p.x_0);
      EXPECT_NE(mpc.status(), MpcStatus::held);
      EXPECT_LT((after - mpc_problems::controller(p).value().calculate(p.x_0)).norm(), 1e-6);
    }
  }
  EXPECT_FALSE(mpc.set_reference(VectorXd::Constant(5, nan), VectorXd::Zero(2)));
  EXPECT_FALSE(mpc.set_disturbance(VectorXd::Constant(5, infinity)));
  EXPECT_FALSE(mpc.set_last_input(VectorXd::Constant(2, nan)));
  EXPECT_FALSE(mpc.set_input_limits(VectorXd::Constant(2, 1.0), VectorXd::Constant(2, -1.0)));
  EXPECT_FALSE(mpc.set_input_limits(VectorXd::Constant(2, -infinity), VectorXd::Ones(2)));
  EXPECT_TRUE(mpc.set_input_limits(VectorXd::Constant(2, -1.0), VectorXd::Ones(2)));
  EXPECT_LE(mpc.calculate(p.x_0).cwiseAbs().maxCoeff(), 1.0);
}

// A reference that moves is followed from before it moves.
TEST(LinearMpc, LooksAheadAlongATrajectory) {
  const MatrixXd one = MatrixXd::Ones(1, 1);
  MpcSettings settings{.horizon = 10};
  settings.u_min = VectorXd::Constant(1, -0.2);
  settings.u_max = VectorXd::Constant(1, 0.2);
  auto mpc = LinearMpc<>::create(one, one, one, 0.01 * one, settings).value();
  MatrixXd r = MatrixXd::Zero(1, 11);
  r.rightCols(7).setOnes();
  ASSERT_TRUE(mpc.set_trajectory(r, MatrixXd::Zero(1, 10)));
  EXPECT_FALSE(mpc.set_trajectory(r.leftCols(9), MatrixXd::Zero(1, 10)));
  const double first = mpc.calculate(VectorXd::Zero(1))(0);
  EXPECT_EQ(first, mpc.predicted_input(0)(0));
  EXPECT_NEAR(mpc.predicted_input(3)(0), 0.2, 1e-12);
  EXPECT_GT(mpc.predicted_state(3)(0), 0.05);  // it began before the step at stage 4
}

TEST(LinearMpc, RefusesWhatMakesNoSense) {
  const Program p = mpc_problems::drive();
  const auto message = [&](auto change) {
    Program q = p;
    change(q);
    const auto mpc = LinearMpc<>::create(q.A, q.B, q.Q, q.R, q.settings);
    return mpc ? std::string("taken") : to_string(mpc.error());
  };
  EXPECT_EQ(message([](Program& q) { q.settings.horizon = 0; }),
            "linear_mpc: horizon is 0; it must be 1 to 1000 periods");
  EXPECT_EQ(message([](Program& q) { q.settings.u_min(1) = 12.0; }),
            "linear_mpc: u_min[1] is 12; it must be below u_max[1], which is 12");
  EXPECT_EQ(message([](Program& q) { q.settings.x_max = VectorXd::Constant(5, std::nan("")); }),
            "linear_mpc: x_max[0] is NaN; it must be a number, or infinity for no limit");
  EXPECT_EQ(message([](Program& q) { q.settings.du_min = VectorXd::Constant(2, 0.5); }),
            "linear_mpc: du_min[0] is 0.5; it must be at most 0: an input may stay as it is");
  EXPECT_NE(message([](Program& q) { q.R(0, 0) = -1.0; }).find("positive definite"),
            std::string::npos);
  EXPECT_NE(message([](Program& q) { q.Q(2, 2) = -1.0; }).find("semidefinite"), std::string::npos);
  EXPECT_NE(message([](Program& q) { q.Q(0, 1) = 5.0; }).find("symmetric"), std::string::npos);
  EXPECT_NE(message([](Program& q) { q.B = MatrixXd::Ones(4, 2); }).find("states x inputs"),
            std::string::npos);
  EXPECT_NE(message([](Program& q) { q.A(0, 0) = infinity; }).find("A"), std::string::npos);
  EXPECT_NE(message([](Program& q) { q.settings.u_max = VectorXd::Ones(3); }).find("u_max"),
            std::string::npos);
  EXPECT_NE(message([](Program& q) { q.settings.Q_end = -q.Q; }).find("Q_end"), std::string::npos);
  EXPECT_NE(
      message([](Program& q) { q.settings.sigma = VectorXd::Constant(5, -1.0); }).find("sigma"),
      std::string::npos);
}

}  // namespace
}  // namespace linear_mpc_test
