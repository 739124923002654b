#include <flyball/control/lyapunov/candidate.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/control/lyapunov/region_plot.hpp>

namespace flyball::candidate_test {
namespace {

using Eigen::Vector2d;

const auto damped = [](const Vector2d& x) { return Vector2d(x(1), -std::sin(x(0)) - x(1)); };

// The energy of a damped pendulum falls only where it moves: V̇ = -ω². One with a cross term falls
// everywhere near; a candidate that is not definite is told apart.
TEST(CheckCandidate, EnergyOfThePendulum) {
  const auto energy = [](const auto& x) { return 0.5 * x(1) * x(1) + 1.0 - cos(x(0)); };
  const Vector2d zero = Vector2d::Zero();
  const auto of_energy = check_candidate(energy, damped, zero, Vector2d(1.0, 1.0)).value();
  EXPECT_EQ(of_energy.at_equilibrium, 0.0);
  EXPECT_EQ(of_energy.positive, of_energy.samples);
  EXPECT_LE(of_energy.largest_rate, 0.0);
  EXPECT_NEAR(of_energy.largest_rate, 0.0, 1e-3);  // ω = 0 is nearly drawn
  const auto crossed = [](const auto& x) {
    return 0.5 * x(1) * x(1) + 0.5 * x(0) * x(1) + 0.25 * x(0) * x(0) + 1.0 - cos(x(0));
  };
  const auto check = check_candidate(crossed, damped, zero, Vector2d(0.7, 0.7)).value();
  EXPECT_TRUE(check.holds());
  EXPECT_LT(check.largest_rate, -0.1);
  EXPECT_GT(check.least_growth, 0.1);
  const auto saddle = [](const auto& x) { return x(0) * x(0) - x(1) * x(1); };
  const auto none = check_candidate(saddle, damped, zero, Vector2d(1.0, 1.0)).value();
  EXPECT_FALSE(none.holds());
  EXPECT_LT(none.least_growth, -0.9);
  const double at = none.lowest(0) * none.lowest(0) - none.lowest(1) * none.lowest(1);
  EXPECT_NEAR(at / none.lowest.squaredNorm(), none.least_growth, 1e-12);
  // Beyond the other equilibrium the pendulum does not come back.
  const auto far = check_candidate(crossed, damped, zero, Vector2d(6.0, 6.0)).value();
  EXPECT_LT(far.falling, far.samples);
  EXPECT_GT(far.largest_rate, 0.0);
}

TEST(CheckCandidate, Errors) {
  const auto V = [](const auto& x) { return x(0) * x(0) + x(1) * x(1); };
  const Vector2d zero = Vector2d::Zero();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(
      check_candidate(V, damped, zero, Vector2d(1.0, 0.0)).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(
      check_candidate(V, damped, zero, Vector2d(nan, 1.0)).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(check_candidate(V, damped, Vector2d(nan, 0.0), Vector2d(1.0, 1.0))
                  .error()
                  .is(ArgumentError::not_finite));
  EXPECT_TRUE(check_candidate(V, damped, zero, Vector2d(1.0, 1.0), 0)
                  .error()
                  .is(ArgumentError::out_of_range));
  const auto root = [](const auto& x) { return sqrt(x(0)); };
  EXPECT_TRUE(check_candidate(root, damped, zero, Vector2d(1.0, 1.0))
                  .error()
                  .is(ArgumentError::not_finite));
}

struct Oscillator {
  static constexpr int states() { return 2; }
  static constexpr int inputs() { return 1; }
  template <class X, class U>
  auto derivative(const X& x, const U& u) const {
    return Eigen::Vector<ScalarOf<X, U>, 2>{-x(1), x(0) + (x(0) * x(0) - 1.0) * x(1) + u(0)};
  }
};

// One curve for the certified set, one for each time, the point that limits it, and what comes.
TEST(RegionPlot, ShowsWhatIsKnown) {
  const SaturatedLoop loop{.model = model_tape(Oscillator{}),
                           .x = Eigen::VectorXd::Zero(2),
                           .u = Eigen::VectorXd::Zero(1),
                           .K = Eigen::MatrixXd::Zero(1, 2)};
  const auto region = certify_region(loop).value();
  const auto sampled =
      sample_region(loop, region, Vector2d(2.0, 2.0), {.step = 1e-2, .count = 100, .plane = {0, 1}})
          .value();
  const auto plot =
      region_plot(loop, region, {{"x", "m"}, {"v", "m/s"}}, 0, 1, &sampled, {0.5, 2.0}).value();
  ASSERT_EQ(plot.panels.size(), 1u);
  const auto& lines = plot.panels[0].lines;
  ASSERT_EQ(lines.size(), 6u);
  EXPECT_EQ(lines[0].x.size(), static_cast<std::size_t>(std::lround(100.0 * sampled.attracted)));
  EXPECT_EQ(lines[1].label, "certified");
  for (std::size_t k = 0; k < lines[1].x.size(); ++k) {
    EXPECT_NEAR(region.value(Vector2d(lines[1].x[k], lines[1].y[k])), region.level,
                1e-9 * region.level);
  }
  EXPECT_EQ(lines[3].label, "reaches it within 2 s");
  EXPECT_EQ(plot.x_label, "x (m)");
  EXPECT_EQ(plot.panels[0].y_label, "v (m/s)");
  EXPECT_FALSE(region_plot(loop, region, {}, 0, 0).has_value());
}

}  // namespace
}  // namespace flyball::candidate_test
