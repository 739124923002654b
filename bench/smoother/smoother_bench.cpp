#include <vector>

#include <Eigen/Dense>
#include <benchmark/benchmark.h>

#include <flyball/estimation/fixed_lag_smoother.hpp>
#include <flyball/estimation/multiple_model.hpp>
#include <flyball/estimation/smoother.hpp>
#include <flyball/geometry/se2.hpp>

// Smoothers of three states, against a plain transcription of Theorem 9.7.1 in fixed-size Eigen
// with the inverse of P⁻. Budget: 100 µs for an update of a smoother with a lag of 50 steps.
namespace {

using namespace flyball;
using Eigen::Matrix3d;
using Eigen::Vector3d;

FilterStep<3> step(int k) {
  Matrix3d F = Matrix3d::Identity();
  F(0, 1) = 0.02;
  F(1, 2) = 0.01 * (k % 3);
  return {F, 1e-3 * Matrix3d::Identity(), Vector3d(0.1, 0.2, 0.3), Vector3d(0.11, 0.2, 0.29),
          0.01 * Matrix3d::Identity()};
}

void fixed_lag_update(benchmark::State& state) {
  FixedLagSmoother<3, 50> smoother(Vector3d::Zero(), Matrix3d::Identity());
  int k = 0;
  for (auto _ : state) {
    smoother.take(step(++k));
    benchmark::DoNotOptimize(smoother.at(50));
  }
}
BENCHMARK(fixed_lag_update);

void fixed_lag_update_of_poses(benchmark::State& state) {
  ManifoldFixedLagSmoother<Pose2d, 50> smoother(Pose2d(), Matrix3d::Identity());
  int k = 0;
  Pose2d pose;
  for (auto _ : state) {
    const FilterStep<3> one = step(++k);
    const Pose2d prior = pose.plus(Vector3d(0.02, 0.0, 0.01 * (k % 3)));
    pose = prior.plus(Vector3d(1e-3, -1e-3, 1e-3));
    smoother.take({one.F, one.Q, prior, pose, one.P});
    benchmark::DoNotOptimize(smoother.at(50));
  }
}
BENCHMARK(fixed_lag_update_of_poses);

void fixed_lag_update_transcribed(benchmark::State& state) {
  constexpr std::size_t lag = 50;
  std::vector<FilterStep<3>> steps(lag + 1, step(0));
  std::size_t k = 0;
  for (auto _ : state) {
    ++k;
    steps[k % (lag + 1)] = step(static_cast<int>(k));
    Vector3d x = steps[k % (lag + 1)].x;
    Matrix3d P = steps[k % (lag + 1)].P;
    for (std::size_t i = 0; i < lag; ++i) {
      const FilterStep<3>& after = steps[(k + 2 * (lag + 1) - i) % (lag + 1)];
      const FilterStep<3>& before = steps[(k + 2 * (lag + 1) - i - 1) % (lag + 1)];
      const Matrix3d P_prior = after.F * before.P * after.F.transpose() + after.Q;
      const Matrix3d K = before.P * after.F.transpose() * P_prior.inverse();
      x = before.x + K * (x - after.x_prior);
      P = before.P + K * (P - P_prior) * K.transpose();
    }
    benchmark::DoNotOptimize(x);
    benchmark::DoNotOptimize(P);
  }
}
BENCHMARK(fixed_lag_update_transcribed);

void smooth_record(benchmark::State& state) {
  const auto N = static_cast<std::size_t>(state.range(0));
  const LinearStep one{step(1).F,
                       {},
                       step(1).Q,
                       Eigen::RowVector3d(1.0, 0.0, 0.0),
                       Eigen::MatrixXd::Constant(1, 1, 0.1),
                       Eigen::VectorXd::Constant(1, 0.3)};
  const std::vector<LinearStep> steps(N, one);
  for (auto _ : state) {
    benchmark::DoNotOptimize(smooth(Vector3d::Zero(), Matrix3d::Identity(), steps));
  }
}
BENCHMARK(smooth_record)->Arg(1000)->Unit(benchmark::kMillisecond);

using Scalar = Eigen::Matrix<double, 1, 1>;

void two_models_step(benchmark::State& state) {
  const DiscreteSystem<2, 1, 1> plant{Eigen::Matrix2d{{1.0, 0.02}, {0.0, 1.0}},
                                      Eigen::Vector2d(2e-4, 0.02), Eigen::RowVector2d(1.0, 0.0),
                                      Scalar(0.0), Time(0.02)};
  const Eigen::Matrix2d Q = 1e-4 * Eigen::Matrix2d::Identity();
  const std::array<ModelHypothesis<2, 1, 1>, 2> models{
      {{plant, Q, Scalar(0.1), Q}, {plant, 100.0 * Q, Scalar(0.1), Q}}};
  const auto modes =
      ModeProbabilities<2>::create({0.5, 0.5}, Eigen::Matrix2d{{0.95, 0.05}, {0.05, 0.95}}).value();
  auto filter = MultipleModelFilter<2, 2, 1, 1>::create(models, modes).value();
  Scalar y(0.1);
  for (auto _ : state) {
    benchmark::DoNotOptimize(y);
    filter.predict(y);
    filter.update(y, y);
    benchmark::DoNotOptimize(filter.x_hat());
  }
}
BENCHMARK(two_models_step);

}  // namespace
