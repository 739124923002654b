#include <flyball/control/saturation.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/control/lqr.hpp>
#include <flyball/core/random.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

namespace flyball::saturation_test {
namespace {

using namespace flyball::literals;
constexpr double infinity = std::numeric_limits<double>::infinity();

Eigen::VectorXd vector(std::initializer_list<double> values) {
  return Eigen::Map<const Eigen::VectorXd>(values.begin(),
                                           static_cast<Eigen::Index>(values.size()));
}

// Section 3.2: k = 10, e = 3 asks for 30 V of 12: k_max = 12/3 = 4.
TEST(Saturation, IsAReducedGain) {
  const Eigen::MatrixXd K = Eigen::MatrixXd::Constant(1, 1, 10.0);
  const auto analysis =
      analyze_saturation(K, vector({3.0}), vector({-12.0}), vector({12.0}), vector({0.0})).value();
  EXPECT_DOUBLE_EQ(analysis.u(0), 30.0);
  EXPECT_DOUBLE_EQ(analysis.u_limited(0), 12.0);
  EXPECT_DOUBLE_EQ(analysis.gain_fraction(0), 0.4);
  EXPECT_DOUBLE_EQ(analysis.effective_K(0, 0), 4.0);
  EXPECT_DOUBLE_EQ(analysis.largest_error(0), 1.2);
}

// The reduced gain gives the limited input, at any error and feedforward.
TEST(Saturation, EffectiveGainGivesTheLimitedInput) {
  Random random(1);
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::Index n = 1 + trial % 4;
    const Eigen::Index m = 1 + trial % 3;
    const Eigen::MatrixXd K =
        Eigen::MatrixXd::NullaryExpr(m, n, [&] { return 5.0 * random.normal(); });
    const Eigen::VectorXd e = Eigen::VectorXd::NullaryExpr(n, [&] { return random.normal(); });
    const Eigen::VectorXd u_ff = Eigen::VectorXd::NullaryExpr(m, [&] { return random.normal(); });
    const Eigen::VectorXd limit = Eigen::VectorXd::Constant(m, 6.0);
    const auto analysis = analyze_saturation(K, e, -limit, limit, u_ff).value();
    ASSERT_LT((analysis.effective_K * e + u_ff - analysis.u_limited).norm(), 1e-12);
    for (Eigen::Index i = 0; i < m; ++i) {
      ASSERT_LE(std::abs(analysis.u_limited(i)), 6.0);
      ASSERT_EQ(analysis.gain_fraction(i) == 1.0, analysis.u(i) == analysis.u_limited(i));
    }
    for (Eigen::Index j = 0; j < n; ++j) {
      Eigen::VectorXd alone = Eigen::VectorXd::Zero(n);
      for (const double sign : {-1.0, 1.0}) {
        alone(j) = sign * 0.999 * analysis.largest_error(j);
        ASSERT_LE((K * alone + u_ff).cwiseAbs().maxCoeff(),
                  std::max(6.0, u_ff.cwiseAbs().maxCoeff()));
      }
    }
  }
}

// No feedback of a state, no limit on its error; a feedforward at the limit leaves none.
TEST(Saturation, Ends) {
  const Eigen::MatrixXd K = Eigen::RowVector2d(3.0, 0.0);
  const auto free = analyze_saturation(K, vector({1.0, 1.0}), vector({-infinity}),
                                       vector({infinity}), vector({0.0}))
                        .value();
  EXPECT_EQ(free.gain_fraction(0), 1.0);
  EXPECT_EQ(free.largest_error(0), infinity);
  EXPECT_EQ(free.largest_error(1), infinity);
  const auto full =
      analyze_saturation(K, vector({1.0, 0.0}), vector({-12.0}), vector({12.0}), vector({12.0}))
          .value();
  EXPECT_EQ(full.gain_fraction(0), 0.0);
  EXPECT_EQ(full.largest_error(0), 0.0);
}

// x₊ = x + 0.1 u with |u| <= 1 goes to 10 in a straight line: 99 or 100 periods, where the linear
// loop K = 5 halves the error each step.
TEST(SaturatedStep, IsAStraightLine) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  const DiscreteSystem<> plant{one, 0.1 * one, one, 0.0 * one, 100_ms};
  const auto step =
      saturation_of_step(plant, 5.0 * one, vector({10.0}), vector({-1.0}), vector({1.0}), 300)
          .value();
  // Saturated while 5 (10 - x) > 1, which is until x = 9.8, 98 periods.
  EXPECT_NEAR(step.saturated_time, 9.8, 0.11);
  EXPECT_NEAR(step.last_saturated, step.saturated_time, 1e-9);
  EXPECT_NEAR(step.settling_time.value(), 9.8, 0.11);
  // 0.5^k < 0.02 from the sixth step on.
  EXPECT_NEAR(step.linear_settling_time.value(), 0.6, 1e-12);
  EXPECT_TRUE(step.reference_can_be_held);
  EXPECT_NEAR(step.holding_input(0), 0.0, 1e-12);
}

// x₊ = 0.9 x + 0.1 u holds 10 with u = 10: not with 5.
TEST(SaturatedStep, SaysWhatCannotBeHeld) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  const DiscreteSystem<> plant{0.9 * one, 0.1 * one, one, 0.0 * one, 100_ms};
  const auto step =
      saturation_of_step(plant, 5.0 * one, vector({10.0}), vector({-5.0}), vector({5.0}), 300)
          .value();
  EXPECT_NEAR(step.holding_input(0), 10.0, 1e-12);
  EXPECT_FALSE(step.reference_can_be_held);
  EXPECT_FALSE(step.settling_time.has_value());
  EXPECT_TRUE(step.linear_settling_time.has_value());
  EXPECT_NEAR(step.saturated_time, 30.0, 1e-9);
}

TEST(Saturation, Errors) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  const auto swapped =
      analyze_saturation(one, vector({1.0}), vector({1.0}), vector({-1.0}), vector({0.0}));
  EXPECT_EQ(to_string(swapped.error()),
            "analyze_saturation: u_min(0) is 1; it must be below u_max(0), which is -1");
  EXPECT_TRUE(
      analyze_saturation(one, vector({1.0, 2.0}), vector({-1.0}), vector({1.0}), vector({0.0}))
          .error()
          .is(ArgumentError::wrong_shape));
  const DiscreteSystem<> plant{one, one, one, one, 100_ms};
  EXPECT_TRUE(saturation_of_step(plant, one, vector({1.0}), vector({-1.0}), vector({1.0}), 0)
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(saturation_of_step(plant, one, vector({infinity}), vector({-1.0}), vector({1.0}), 5)
                  .error()
                  .is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::saturation_test
