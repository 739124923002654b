#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/control/margins.hpp>
#include <flyball/math/dense/linear_algebra.hpp>

#include "control/regulated_plant.hpp"

namespace flyball::robustness_test {
namespace {

using namespace flyball::literals;
using namespace test;
constexpr double infinity = std::numeric_limits<double>::infinity();

// Stability and overshoot of each case, checked against a simulation of that case written out.
TEST(RobustnessGrid, AgreesWithASimulation) {
  const auto design = regulated_elevator();
  const Time delay(0.02);
  const auto grid = robustness_grid(design.truth.A, design.truth.B, design.truth.C, design.model,
                                    design.K, design.K_e, delay)
                        .value();
  ASSERT_EQ(grid.cases.size(), 25u);
  const Eigen::MatrixXd B_pinv = pseudoinverse(design.model.B).value().X;
  double worst = 0.0;
  bool all_stable = true;
  for (const RobustnessCase& c : grid.cases) {
    const auto truth =
        discretize(elevator(4.0 / c.gain, 0.3 * c.inertia / c.gain), Time(0.02)).value();
    Eigen::Vector2d x = Eigen::Vector2d::Zero();
    Eigen::Vector2d x_hat = Eigen::Vector2d::Zero();
    const Eigen::Vector2d r(1.0, 0.0);
    double u = 0.0;
    double u_before = 0.0;
    double peak = 0.0;
    double last = 0.0;
    for (int k = 0; k < 3000; ++k) {
      x = truth.A * x + truth.B * u_before;  // The delay is one period.
      x_hat = design.model.A * x_hat + design.model.B * u;
      x_hat += design.K_e * (x(0) - x_hat(0));
      u_before = u;
      u = (design.K * (r - x_hat))(0) + (B_pinv * (r - design.model.A * r))(0);
      peak = std::max(peak, x(0));
      last = x(0);
    }
    EXPECT_EQ(c.stable, std::abs(last) < 10.0) << c.inertia << " " << c.gain;
    if (c.stable) {
      EXPECT_NEAR(last - 1.0, c.steady_error, 1e-9);
      EXPECT_NEAR(std::max(0.0, peak / last - 1.0), c.overshoot, 1e-9);
    }
    worst = std::max(worst, c.overshoot);
    all_stable = all_stable && c.stable;
  }
  EXPECT_EQ(grid.worst_overshoot, worst);
  EXPECT_EQ(grid.all_stable, all_stable);
}

TEST(RobustnessGrid, SaysWhichCaseIsUnstable) {
  const auto design = regulated_elevator();
  const auto grid =
      robustness_grid(design.truth.A, design.truth.B, design.truth.C, design.model, design.K,
                      design.K_e, 0_ms, {.inertia = {1.0}, .gain = {1.0, 50.0}})
          .value();
  EXPECT_TRUE(grid.cases[0].stable);
  EXPECT_FALSE(grid.cases[1].stable);
  EXPECT_EQ(grid.cases[1].overshoot, infinity);
  EXPECT_FALSE(grid.all_stable);
}

TEST(RobustnessGrid, Errors) {
  const auto d = regulated_elevator();
  const auto grid = [&](RobustnessOptions options) {
    return robustness_grid(d.truth.A, d.truth.B, d.truth.C, d.model, d.K, d.K_e, 0_ms, options);
  };
  EXPECT_TRUE(grid({.inertia = {0.0}}).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(grid({.gain = {1.0, -1.0}}).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(grid({.gain = {}}).error().is(ArgumentError::empty));
  EXPECT_TRUE(robustness_grid(d.truth.A, d.truth.B, d.truth.C, d.model, d.K_e, d.K_e, 0_ms)
                  .error()
                  .is(ArgumentError::wrong_shape));
}

}  // namespace
}  // namespace flyball::robustness_test
