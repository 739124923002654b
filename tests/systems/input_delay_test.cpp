#include <flyball/systems/input_delay.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/systems/discretize.hpp>

namespace flyball::input_delay_test {
namespace {

Eigen::MatrixXd scalar(double value) {
  return Eigen::MatrixXd::Constant(1, 1, value);
}

// dx/dt = -a x + u, 30 % of a period late:
// B_0 = (1 - e^{-0.7aT})/a, B_1 = e^{-0.7aT} (1 - e^{-0.3aT})/a.
TEST(InputDelay, ScalarInClosedForm) {
  const double a = 3.0;
  const double T = 0.1;
  const auto parts =
      discretize_delayed_input(scalar(-a), scalar(1.0), Time(T), Time(2.3 * T)).value();
  EXPECT_EQ(parts.whole_periods, 2);
  EXPECT_NEAR(parts.A(0, 0), std::exp(-a * T), 1e-15);
  EXPECT_NEAR(parts.B_0(0, 0), -std::expm1(-0.7 * a * T) / a, 1e-15);
  EXPECT_NEAR(parts.B_1(0, 0), -std::exp(-0.7 * a * T) * std::expm1(-0.3 * a * T) / a, 1e-15);
}

// 0.06/0.02 is not 3 to the last bit, but it is three periods.
TEST(InputDelay, WholePeriodsStayWhole) {
  for (int d = 0; d < 50; ++d) {
    const auto parts =
        discretize_delayed_input(scalar(-1.0), scalar(1.0), Time(0.02), Time(0.02 * d)).value();
    EXPECT_EQ(parts.whole_periods, d);
    EXPECT_TRUE(parts.B_1.isZero(0.0));
  }
}

// The augmented system against the plant itself, integrated exactly between the instants at which
// its input changes.
TEST(InputDelay, IsThePlantWithALateInput) {
  Random random(13);
  const double T = 0.05;
  for (const double delay : {0.0, 0.02, 0.05, 0.071, 0.1, 0.16}) {
    ContinuousSystem<> plant{Eigen::MatrixXd::NullaryExpr(2, 2, [&] { return random.normal(); }),
                             Eigen::MatrixXd::NullaryExpr(2, 1, [&] { return random.normal(); }),
                             Eigen::MatrixXd::Identity(2, 2), Eigen::MatrixXd::Zero(2, 1)};
    const auto delayed = discretize_with_input_delay(plant, Time(T), Time(delay)).value();
    EXPECT_EQ(delayed.A.rows(), 2 + static_cast<int>(std::ceil(delay / T - 1e-9)));
    Eigen::VectorXd x_aug = Eigen::VectorXd::Zero(delayed.A.rows());
    Eigen::VectorXd x = Eigen::VectorXd::Zero(2);
    std::vector<double> u;
    const auto input_at = [&](int sample) {
      return sample < 0 ? 0.0 : u[static_cast<std::size_t>(sample)];
    };
    const auto advance = [&](double input, double duration) {
      if (duration > 1e-12) {
        const auto step = discretize_zoh(plant.A, plant.B, Time(duration)).value();
        x = (step.A * x + step.B * input).eval();
      }
    };
    const int d = static_cast<int>(std::floor(delay / T + 1e-9));
    const double f = std::max(0.0, delay - d * T);
    for (int k = 0; k < 30; ++k) {
      u.push_back(random.normal());
      ASSERT_LT((delayed.C * x_aug - x).norm(), 1e-12 * (1.0 + x.norm())) << delay;
      advance(input_at(k - d - 1), f);
      advance(input_at(k - d), T - f);
      x_aug = (delayed.A * x_aug + delayed.B * u.back()).eval();
    }
  }
}

// A direct path to the output is as late as the input.
TEST(InputDelay, DelaysTheFeedthrough) {
  const ContinuousSystem<> plant{scalar(-1.0), scalar(0.0), scalar(0.0), scalar(2.0)};
  const auto delayed = discretize_with_input_delay(plant, Time(0.1), Time(0.2)).value();
  EXPECT_EQ(delayed.C, Eigen::RowVector3d(0.0, 0.0, 2.0));
  EXPECT_EQ(delayed.D(0, 0), 0.0);
  EXPECT_EQ(discretize_with_input_delay(plant, Time(0.1), Time(0.0)).value().D(0, 0), 2.0);
}

TEST(InputDelay, Errors) {
  const auto parts = [](double A, double T, double delay) {
    return discretize_delayed_input(scalar(A), scalar(1.0), Time(T), Time(delay));
  };
  EXPECT_TRUE(parts(1.0, 0.0, 0.0).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(parts(1.0, 0.1, -0.1).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(parts(1.0, 0.1, std::nan("")).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(parts(1.0, 1e-9, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(parts(std::nan(""), 0.1, 0.0).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(discretize_delayed_input(scalar(1.0), Eigen::MatrixXd::Ones(2, 1), Time(0.1), Time(0))
                  .error()
                  .is(ArgumentError::wrong_shape));
}

}  // namespace
}  // namespace flyball::input_delay_test
