#include <flyball/simulation/linear_loop.hpp>

#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/control/lqg.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/planning/profiles/generate_trapezoid_profile.hpp>
#include <flyball/systems/discretize.hpp>

namespace flyball::linear_loop_test {
namespace {

using namespace flyball::literals;

// The elevator of Figures 2.3 and 6.3.
DiscreteSystem<> books_elevator() {
  const auto elevator = mechanisms::elevator({.motor = mechanisms::cim(2),
                                              .gearing = 10.0,
                                              .mass = Mass(6.803886),
                                              .drum_radius = Length(0.02762679089)})
                            .value();
  const auto plant = discretize(elevator, 5_ms).value();
  return {plant.A, plant.B, plant.C, plant.D, plant.period};
}

LinearLoop books_loop() {
  LinearLoop loop;
  loop.plant = books_elevator();
  loop.K = lqr(loop.plant, bryson({0.02, 0.4}), bryson({12.0})).value().K;
  loop.u_min = Eigen::VectorXd::Constant(1, -12.0);
  loop.u_max = Eigen::VectorXd::Constant(1, 12.0);
  return loop;
}

struct Checkpoint {
  int k;
  double x, v, u;
};

template <std::size_t N>
void expect_checkpoints(const LinearTrajectory& result, const std::array<Checkpoint, N>& points) {
  for (const Checkpoint& point : points) {
    EXPECT_NEAR(result.x(0, point.k), point.x, 1e-9 * 3.0) << point.k;
    EXPECT_NEAR(result.x(1, point.k), point.v, 1e-9 * 1.6) << point.k;
    EXPECT_NEAR(result.u(0, point.k), point.u, 1e-9 * 12.0) << point.k;
  }
}

// Figure 2.3: PD control of a trapezoid reference. Checkpoints computed with SciPy 1.10.1 by the
// book's own script.
TEST(SimulateLinear, IsFigure2_3) {
  LinearLoop loop = books_loop();
  loop.plant_inversion = false;
  const auto profile = generate_trapezoid_profile(0.5, Time(0.5), 5_ms, 3.0).value();
  Eigen::MatrixXd r(2, static_cast<Eigen::Index>(profile.rows()));
  for (Eigen::Index k = 0; k < r.cols(); ++k) {
    r(0, k) = (*profile.find("position"))[static_cast<std::size_t>(k)];
    r(1, k) = (*profile.find("velocity"))[static_cast<std::size_t>(k)];
  }
  const auto result = simulate_linear(loop, r).value();
  ASSERT_EQ(result.x.cols(), 1302);
  EXPECT_NEAR(result.time(1301), 6.505, 1e-12);
  expect_checkpoints(result,
                     std::array<Checkpoint, 6>{
                         {{1, 0.0, 0.0, 0.03386785385035299},
                          {163, 0.26740364638017927, 0.4999380923521961, 3.826005130405353},
                          {325, 0.6724004740385652, 0.4999999999907304, 3.8264006847600056},
                          {650, 1.4849004740380736, 0.4999999999999877, 3.8264006848191343},
                          {1138, 2.7049004740380473, 0.49999999999999556, 3.8264006848191943},
                          {1301, 2.9987008390845458, 0.025535819519296045, 0.16096525818236823}}});
}

// Figure 6.3: observer, plant inversion and limits; the reference steps at 0.1 s and 5.1 s.
TEST(SimulateLinear, IsFigure6_3) {
  LinearLoop loop = books_loop();
  const auto Q = discretize((Eigen::Matrix2d() << 0.0, 1.0, 0.0, -164.20904979369794).finished(),
                            ProcessDensity{Eigen::Vector2d(0.0025, 1.0).asDiagonal()}, 5_ms);
  const auto R = discretize(MeasurementDensity{Eigen::MatrixXd::Constant(1, 1, 1e-8)}, 5_ms);
  loop.K_e = kalman_gain(loop.plant, Q, R).value().K;
  Eigen::MatrixXd r = Eigen::MatrixXd::Zero(2, 2040);
  r.row(0).segment(20, 1000).setConstant(1.524);
  const auto result = simulate_linear(loop, r).value();
  expect_checkpoints(
      result, std::array<Checkpoint, 10>{
                  {{19, 0.0, 0.0, 0.05910892350429255},
                   {20, 1.2277330694953598e-05, 0.004325563691157611, 12.0},
                   {21, 0.0025195121790726215, 0.8800575763130454, 12.0},
                   {25, 0.029847817555911954, 1.5422731766447764, 12.0},
                   {70, 0.38250280166248823, 1.5680532422556417, 12.0},
                   {255, 1.5233489776961886, 0.012704575488372146, 0.08117496123654801},
                   {1019, 1.5239999999999985, 2.7441319243265114e-14, -0.05910892350408255},
                   {1020, 1.5239877226693035, -0.00432556369113017, -12.0},
                   {1070, 1.1414971983375117, -1.5680532422556417, -12.0},
                   {1274, 0.00010306425215389079, -0.0020112791281893267, -0.012850921734149636}}});
  EXPECT_LT((result.x - result.x_hat).cwiseAbs().maxCoeff(), 1e-12);
}

// It is the loop that the run-time regulator closes.
TEST(SimulateLinear, IsTheRegulatorsLoop) {
  LinearLoop loop = books_loop();
  loop.K_e = Eigen::Vector2d(0.5, 3.0);
  loop.x0 = Eigen::Vector2d(0.2, 0.0);
  const Eigen::MatrixXd r = Eigen::Vector2d(1.0, 0.0).replicate(1, 300);
  const auto result = simulate_linear(loop, r).value();
  auto regulator = Lqg<>::create(loop.plant, loop.K, *loop.K_e, loop.u_min, loop.u_max).value();
  regulator.reset(loop.x0);
  for (Eigen::Index k = 0; k < 300; ++k) {
    ASSERT_NEAR(regulator.step(r.col(k), r.col(k), result.y.col(k))(0), result.u(0, k), 1e-9);
  }
}

TEST(SimulateLinear, Errors) {
  const Eigen::MatrixXd r = Eigen::MatrixXd::Zero(2, 3);
  LinearLoop loop = books_loop();
  EXPECT_TRUE(
      simulate_linear(loop, Eigen::MatrixXd::Zero(1, 3)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(simulate_linear(loop, Eigen::MatrixXd::Constant(2, 3, std::nan("")))
                  .error()
                  .is(ArgumentError::not_finite));
  loop.K_e = Eigen::MatrixXd::Zero(1, 2);
  EXPECT_TRUE(simulate_linear(loop, r).error().is(ArgumentError::wrong_shape));
  loop.K_e.reset();
  loop.x0 = Eigen::VectorXd::Zero(3);
  EXPECT_TRUE(simulate_linear(loop, r).error().is(ArgumentError::wrong_shape));
  loop.x0.resize(0);
  loop.K = Eigen::MatrixXd::Zero(2, 1);
  EXPECT_TRUE(simulate_linear(loop, r).error().is(ArgumentError::wrong_shape));
  EXPECT_EQ(simulate_linear(books_loop(), Eigen::MatrixXd::Zero(2, 0)).value().x.cols(), 0);
}

// An observer that knows the plant, and starts where it does, stays with it, feedthrough and all.
TEST(SimulateLinear, AnExactObserverStaysWithThePlant) {
  LinearLoop loop;
  loop.plant.A = Eigen::Matrix2d{{1.0, 0.1}, {0.0, 0.9}};
  loop.plant.B = Eigen::Vector2d(0.01, 0.1);
  loop.plant.C = Eigen::RowVector2d(1.0, 0.0);
  loop.plant.D = Eigen::MatrixXd::Constant(1, 1, 0.7);
  loop.plant.period = Time(0.1);
  loop.K = Eigen::RowVector2d(3.0, 1.0);
  loop.K_e = Eigen::Vector2d(0.5, 0.8);
  const auto result = simulate_linear(loop, Eigen::MatrixXd::Ones(2, 40)).value();
  EXPECT_GT(result.u.norm(), 0.1);
  EXPECT_LT((result.x - result.x_hat).norm(), 1e-12 * result.x.norm());
}

}  // namespace
}  // namespace flyball::linear_loop_test
