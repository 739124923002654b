#include <benchmark/benchmark.h>

#include <flyball/control/lqr.hpp>
#include <flyball/control/mechanism_controller.hpp>
#include <flyball/estimation/kalman_filter.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

// One period of the run-time objects for a plant of two states, against the same steps of Eigen's
// dynamic matrices (what a library without compile-time sizes costs). Budget: 100 ns for Lqg.
namespace {

using namespace flyball;
using namespace flyball::literals;
using Scalar = Eigen::Matrix<double, 1, 1>;

DiscreteSystem<2, 1, 1> plant() {
  const auto elevator = mechanisms::elevator({.kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.6}).value();
  return discretize(elevator, 20_ms).value();
}

const auto Q = standard_deviations({1e-3, 0.05});
const auto R = standard_deviations({1e-3});

void lqg_step(benchmark::State& state) {
  const auto model = plant();
  auto regulator = lqg(model, lqr(model, bryson({0.02, 0.4}), bryson({12.0})).value().K,
                       kalman_gain(model, Q, R).value().K, 12.0)
                       .value();
  Eigen::Vector2d r(0.5, 0.0);
  Scalar y(0.1);
  const Scalar extra(0.6);
  for (auto _ : state) {
    benchmark::DoNotOptimize(r);
    benchmark::DoNotOptimize(y);
    const Scalar u = regulator.step(r, r, y, extra, 11.5);
    benchmark::DoNotOptimize(u);
  }
}
BENCHMARK(lqg_step);

void lqg_step_dynamic(benchmark::State& state) {
  const auto model = plant();
  auto regulator = lqg(DiscreteSystem<>{model.A, model.B, model.C, model.D, model.period},
                       Eigen::MatrixXd(lqr(model, bryson({0.02, 0.4}), bryson({12.0})).value().K),
                       Eigen::MatrixXd(kalman_gain(model, Q, R).value().K), 12.0)
                       .value();
  Eigen::VectorXd r = Eigen::Vector2d(0.5, 0.0);
  Eigen::VectorXd y = Scalar(0.1);
  const Eigen::VectorXd extra = Scalar(0.6);
  for (auto _ : state) {
    benchmark::DoNotOptimize(r);
    benchmark::DoNotOptimize(y);
    const Eigen::VectorXd u = regulator.step(r, r, y, extra, 11.5);
    benchmark::DoNotOptimize(u);
  }
}
BENCHMARK(lqg_step_dynamic);

// The whole of a mechanism's period: the same step with gravity, friction, a late measurement and
// the voltage compensated. An arm's gravity costs a cosine.
template <class Controller>
void mechanism_controller_step(benchmark::State& state) {
  const auto model = plant();
  MechanismControllerDesign design;
  design.kind =
      state.range(0) != 0 ? mechanisms::MechanismKind::arm : mechanisms::MechanismKind::elevator;
  design.gains = {.kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.6};
  design.plant = {model.A, model.B, model.C, model.D, model.period};
  design.K = lqr(model, bryson({0.02, 0.4}), bryson({12.0})).value().K;
  design.K_e = kalman_gain(model, Q, R).value().K;
  design.measurement_delay = 15_ms;
  auto controller = Controller::create(design).value();
  MotionState r{0.5, 0.1};
  double y = 0.1;
  for (auto _ : state) {
    benchmark::DoNotOptimize(r);
    benchmark::DoNotOptimize(y);
    benchmark::DoNotOptimize(controller.update(y, r, r, 11.5));
  }
}
BENCHMARK(mechanism_controller_step<MechanismController<2>>)->ArgName("arm")->Arg(0)->Arg(1);
BENCHMARK(mechanism_controller_step<MechanismController<>>)->ArgName("arm")->Arg(0)->Arg(1);

void kalman_filter_step(benchmark::State& state) {
  auto filter = kalman_filter(plant(), Q, R).value();
  Scalar u(1.0);
  Scalar y(0.1);
  for (auto _ : state) {
    benchmark::DoNotOptimize(u);
    benchmark::DoNotOptimize(y);
    filter.predict(u);
    benchmark::DoNotOptimize(filter.update(y, u));
  }
}
BENCHMARK(kalman_filter_step);

void lqr_design(benchmark::State& state) {
  const auto model = plant();
  for (auto _ : state) {
    auto design = lqr(model, bryson({0.02, 0.4}), bryson({12.0}));
    benchmark::DoNotOptimize(design);
  }
}
BENCHMARK(lqr_design);

}  // namespace
