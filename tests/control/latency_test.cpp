#include <flyball/control/latency.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/control/lqr.hpp>
#include <flyball/math/exponential/matrix_function.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

namespace flyball::latency_test {
namespace {

using namespace flyball::literals;

// The book's elevator with 50 ms at 5 ms: K (A - B K)^10. SciPy 1.10.1:
//   A=np.array([[1,0.003410460424794879],[0,0.43997153428542146]])
//   B=np.array([[0.00020770689038283711],[0.07317953761826645]])
//   K=np.array([[234.03740840771752,5.603383728032011]])
//   K @ np.linalg.matrix_power(A-B@K, 10); K @ fractional_matrix_power(A-B@K, 1.5)
TEST(CompensateLatency, IsTheBooksElevators) {
  Eigen::Matrix2d A;
  A << 1.0, 0.003410460424794879, 0.0, 0.43997153428542146;
  const Eigen::Vector2d B(0.00020770689038283711, 0.07317953761826645);
  const Eigen::RowVector2d K(234.03740840771752, 5.603383728032011);
  const Eigen::RowVector2d tenth = compensate_latency(K, A, B, 5_ms, 50_ms).value();
  const Eigen::RowVector2d gold_10(49.74766302946697, 0.1273466712167475);
  EXPECT_LT((tenth - gold_10).norm(), 1e-9 * gold_10.norm());
  const Eigen::RowVector2d half = compensate_latency(K, A, B, 5_ms, Time(0.0075)).value();
  const Eigen::RowVector2d gold_half(115.53039537957257, 0.3959890907917093);
  EXPECT_LT((half - gold_half).norm(), 1e-9 * gold_half.norm());
  EXPECT_EQ(compensate_latency(K, A, B, 5_ms, Time(0.0)).value(), Eigen::MatrixXd(K));
}

// What it is for: with whole delays of the measurement the compensated loop from a state that is
// d samples old repeats the undelayed input, once the transient's inputs are all feedback.
TEST(CompensateLatency, PredictsTheStateThatTheDelayHides) {
  const auto elevator = mechanisms::elevator({.kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.6}).value();
  const auto plant = discretize(elevator, 20_ms).value();
  const auto design = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value();
  const auto K = compensate_latency(design.K, plant, 60_ms).value();
  const Eigen::Matrix2d closed = plant.A - plant.B * design.K;
  const Eigen::Vector2d x(0.3, -0.2);
  EXPECT_NEAR((K * x)(0), (design.K * closed * closed * closed * x)(0), 1e-10);
}

// The continuous case (B.9): K e^{(A-BK)L}; scalar: k e^{(a-bk)L}.
TEST(CompensateLatency, Continuous) {
  using Scalar = Eigen::Matrix<double, 1, 1>;
  const ContinuousSystem<1, 1, 1> plant{Scalar(-1.0), Scalar(2.0), Scalar(1.0), Scalar(0.0)};
  const Scalar K(3.0);
  EXPECT_NEAR(compensate_latency(K, plant, Time(0.1)).value()(0), 3.0 * std::exp(-0.7), 1e-14);
}

TEST(CompensateLatency, Errors) {
  const Eigen::Matrix2d A = Eigen::Vector2d(0.5, -0.3).asDiagonal();
  const Eigen::Vector2d B(0.0, 0.0);
  const Eigen::RowVector2d K(1.0, 1.0);
  const auto fraction = compensate_latency(K, A, B, 10_ms, 15_ms);
  EXPECT_TRUE(fraction.error().is(MatrixFunctionError::no_real_power));
  EXPECT_EQ(fraction.error().where(), "compensate_latency");
  EXPECT_TRUE(
      compensate_latency(K, A, B, 10_ms, Time(-0.01)).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      compensate_latency(K, A, B, Time(0.0), 10_ms).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(compensate_latency(B, A, B, 10_ms, 10_ms).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(compensate_latency(K, A, K, 10_ms, 10_ms).error().is(ArgumentError::wrong_shape));
  Eigen::Matrix2d bad = A;
  bad(0, 1) = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(compensate_latency(K, bad, B, 10_ms, 10_ms).error().is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::latency_test
