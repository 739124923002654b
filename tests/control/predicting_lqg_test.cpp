#include <flyball/control/predicting_lqg.hpp>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/control/lqg.hpp>
#include <flyball/control/running_loop.hpp>
#include <flyball/core/random.hpp>

#include "control/regulated_plant.hpp"
#include "support/allocation_count.hpp"

namespace flyball::predicting_lqg_test {
namespace {

using Scalar = Eigen::Matrix<double, 1, 1>;
constexpr double infinity = std::numeric_limits<double>::infinity();

/// An elevator, its regulator for no delay, and the one that predicts.
struct Late {
  test::Regulated prompt = test::regulated_elevator();
  Time delay;
  double limit;

  [[nodiscard]] DelayPredictor<2, 1> predictor() const {
    const ContinuousSystem<2, 1, 1> truth{prompt.truth.A, prompt.truth.B, prompt.truth.C,
                                          prompt.truth.D};
    return DelayPredictor<2, 1>::create(truth, prompt.model.period, delay).value();
  }
  [[nodiscard]] DiscreteSystem<2, 1, 1> model() const {
    return {prompt.model.A, prompt.model.B, prompt.model.C, prompt.model.D, prompt.model.period};
  }
  [[nodiscard]] PredictingLqg<2, 1, 1> regulator() const {
    return PredictingLqg<2, 1, 1>::create(model(), predictor(), prompt.K, prompt.K_e,
                                          Scalar(-limit), Scalar(limit))
        .value();
  }
  [[nodiscard]] PredictingLqg<> dynamic() const {
    return PredictingLqg<>::create(
               prompt.model,
               DelayPredictor<>::create(prompt.truth, prompt.model.period, delay).value(), prompt.K,
               prompt.K_e, Eigen::VectorXd(Scalar(-limit)), Eigen::VectorXd(Scalar(limit)))
        .value();
  }
};

/// The elevator's state at each sample as the sensor sees it, late.
class LatePlant {
 public:
  LatePlant(const Late& late, const Eigen::Vector2d& x)
      : delayed_(discretize_delayed_input(late.prompt.truth.A, late.prompt.truth.B,
                                          late.prompt.model.period, late.delay)
                     .value()),
        sent_(static_cast<std::size_t>(delayed_.whole_periods) + 1, 0.0),
        x_(x) {}

  void send(double u) {
    sent_.push_back(u);
    x_ = (delayed_.A * x_ + delayed_.B_0 * sent_[1] + delayed_.B_1 * sent_[0]).eval();
    sent_.pop_front();
  }
  [[nodiscard]] const Eigen::Vector2d& x() const { return x_; }

 private:
  DelayedInputMatrices delayed_;
  std::deque<double> sent_;
  Eigen::Vector2d x_;
};

// The loop of one observer over [x; u_{k-1}; …], whose poles are those of no delay and zeros (see
// PredictingRegulator), written out: the run-time object answers the same, whole periods or not.
TEST(PredictingLqg, IsTheRegulatorWithTheInputsOnTheirWayAsStates) {
  for (const double periods : {0.0, 0.4, 1.0, 2.7, 10.0}) {
    SCOPED_TRACE(periods);
    const Late late{.delay = Time(0.02 * periods), .limit = infinity};
    const auto made = predicting_regulator(late.prompt.truth, late.prompt.model.period,
                                           late.prompt.K, late.prompt.K_e, late.delay)
                          .value();
    auto regulator = late.regulator();
    auto dynamic = late.dynamic();
    LatePlant plant(late, {0.3, -0.5});
    Eigen::VectorXd x_hat = Eigen::VectorXd::Zero(made.model.A.rows());
    double u = 0.0;
    for (int k = 0; k < 120; ++k) {
      const double y = plant.x()(0);
      x_hat = (made.model.A * x_hat + made.model.B * u).eval();
      x_hat += made.K_e * (y - made.model.C.row(0).dot(x_hat));
      u = -(made.K * x_hat)(0);
      const Eigen::Vector2d zero = Eigen::Vector2d::Zero();
      const double got = regulator.step(zero, zero, Scalar(y), Scalar(0.0), infinity)(0);
      ASSERT_NEAR(got, u, 1e-9 * (1.0 + std::abs(u))) << k;
      ASSERT_NEAR(dynamic.step(zero, zero, Scalar(y), Scalar(0.0), infinity)(0), got,
                  1e-12 * (1.0 + std::abs(got)))
          << k;
      plant.send(u);
    }
    EXPECT_LT(plant.x().norm(), 1e-3);
  }
}

// With the true state at the start the loop is the one without delay, later: through limits, a rail
// and voltages that the model does not see.
TEST(PredictingLqg, IsLqgWithoutTheDelay) {
  const Late late{.delay = Time(0.05), .limit = 12.0};
  auto regulator = late.regulator();
  auto prompt = Lqg<2, 1, 1>::create(late.model(), late.prompt.K, late.prompt.K_e, Scalar(-12.0),
                                     Scalar(12.0))
                    .value();
  LatePlant plant(late, Eigen::Vector2d::Zero());
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
  int limited = 0;
  for (int k = 0; k < 400; ++k) {
    const auto reference = [](int at) {
      return Eigen::Vector2d(at < 20 ? 0.0 : at < 200 ? 1.5 : -0.5, 0.0);
    };
    const double rail = k % 3 == 0 ? 9.0 : 11.0;
    const Scalar extra(0.6);
    const double u = prompt.step(reference(k), reference(k + 1), Scalar(x(0)), extra, rail)(0);
    ASSERT_NEAR(
        regulator.step(reference(k), reference(k + 1), Scalar(plant.x()(0)), extra, rail)(0), u,
        1e-7)
        << k;
    ASSERT_LT((regulator.x_hat() - prompt.x_hat()).norm(), 1e-8);
    limited += std::abs(u) >= rail ? 1 : 0;
    x = late.prompt.model.A * x + late.prompt.model.B * (u - 0.6);
    plant.send(u - 0.6);
  }
  EXPECT_GT(limited, 20);
}

TEST(PredictingLqg, StartsAgainWithNothingOnItsWay) {
  const Late late{.delay = Time(0.05), .limit = 12.0};
  auto regulator = late.regulator();
  const Eigen::Vector2d there(0.4, 0.0);
  for (int k = 0; k < 10; ++k) {
    (void)regulator.step(there, there, Scalar(0.1 * k), Scalar(0.0), 12.0);
  }
  EXPECT_FALSE(regulator.reset({std::nan(""), 0.0}));
  EXPECT_TRUE(regulator.reset(there));
  EXPECT_EQ(regulator.x_hat(), there);
  EXPECT_NEAR(regulator.step(there, there, Scalar(0.4), Scalar(0.0), 12.0)(0), 0.0, 1e-12);
  EXPECT_TRUE(regulator.measured());
  (void)regulator.step(there, there, Scalar(std::nan("")), Scalar(0.0), 12.0);
  EXPECT_FALSE(regulator.measured());
}

// An angle of 6.2 rad is 0.08 rad short of a turn: it goes on, not back.
TEST(PredictingLqg, TakesAnAnglesShorterWay) {
  const Late late{.delay = Time(0.04), .limit = 12.0};
  auto regulator = late.regulator();
  regulator.set_angle(0, 6.283185307179586);
  regulator.reset({6.2, 0.0});
  const Eigen::Vector2d zero = Eigen::Vector2d::Zero();
  EXPECT_NEAR(regulator.step(zero, zero, Scalar(6.2), Scalar(0.0), 12.0)(0),
              std::min(12.0, late.prompt.K(0) * (6.283185307179586 - 6.2)), 1e-9);
}

TEST(PredictingLqg, AllocatesNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  auto regulator = Late{.delay = Time(0.05), .limit = 12.0}.regulator();
  const Eigen::Vector2d zero = Eigen::Vector2d::Zero();
  const Scalar nothing(0.0);
  static_assert(noexcept(regulator.step(zero, zero, nothing, nothing, 12.0)));
  const test::AllocationCounter counter;
  for (int k = 0; k < 30; ++k) {
    (void)regulator.step(zero, zero, Scalar(0.1 * k), Scalar(0.0), 12.0);
  }
  regulator.reset(zero);
  EXPECT_EQ(counter.count(), 0u);
}

TEST(PredictingLqg, Errors) {
  const Late late{.delay = Time(0.05), .limit = 12.0};
  const auto error = [&](const DiscreteSystem<>& model, const ContinuousSystem<>& predicts) {
    return PredictingLqg<>::create(
               model, DelayPredictor<>::create(predicts, model.period, late.delay).value(),
               late.prompt.K, late.prompt.K_e, Eigen::VectorXd(Scalar(-12.0)),
               Eigen::VectorXd(Scalar(12.0)))
        .error();
  };
  const ContinuousSystem<> other{test::scalar(-1.0), test::scalar(1.0), test::scalar(1.0),
                                 test::scalar(0.0)};
  EXPECT_TRUE(error(late.prompt.model, other).is(ArgumentError::wrong_shape));
  auto through = late.prompt.model;
  through.D(0, 0) = 1.0;
  EXPECT_EQ(
      to_string(error(through, late.prompt.truth)),
      "PredictingLqg: the plant's D is not zero; it must be zero: a measurement that contains "
      "the input closes a second loop");
}

}  // namespace
}  // namespace flyball::predicting_lqg_test
