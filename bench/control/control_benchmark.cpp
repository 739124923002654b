#include <benchmark/benchmark.h>

#include <flyball/control/delay_compensation.hpp>
#include <flyball/control/integral_control.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/control/pid.hpp>
#include <flyball/control/pole_placement.hpp>
#include <flyball/core/random.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

// One period of the run-time controllers for a plant of two states (budget: 50 ns), and what a pole
// placement costs.
namespace {

using namespace flyball;
using namespace flyball::literals;
using Scalar = Eigen::Matrix<double, 1, 1>;

mechanisms::Elevator elevator() {
  return mechanisms::elevator({.kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.6}).value();
}

DiscreteSystem<2, 1, 1> plant() {
  return discretize(elevator(), 20_ms).value();
}

Eigen::RowVector2d gain() {
  return lqr(plant(), bryson({0.02, 0.4}), bryson({12.0})).value().K;
}

void pid_step(benchmark::State& state) {
  PidSettings settings{.gains = {.kp = 40.0, .ki = 5.0, .kd = 2.0}};
  settings.derivative_time_constant = 0.01;
  settings.output_min = -12.0;
  settings.output_max = 12.0;
  settings.turn = state.range(0) != 0 ? 6.283185307179586 : 0.0;
  settings.anti_windup = state.range(0) != 0 ? AntiWindup::back_calculation : AntiWindup::clamping;
  Pid controller = Pid::create(settings).value();
  double y = 0.1;
  for (auto _ : state) {
    benchmark::DoNotOptimize(y);
    benchmark::DoNotOptimize(controller.calculate(y, 0.5, 0.6));
  }
}
BENCHMARK(pid_step)->ArgName("wraps")->Arg(0)->Arg(1);

void integral_feedback_step(benchmark::State& state) {
  const auto design = lqi(plant(), bryson({0.02, 0.4, 0.01}), bryson({12.0})).value();
  IntegralStateFeedback<2, 1, 1> controller(design.K, design.K_I, 0.02, Scalar(-12.0),
                                            Scalar(12.0));
  Eigen::Vector2d x(0.1, 0.0);
  const Eigen::Vector2d r(0.5, 0.0);
  const Scalar u_ff(0.6);
  for (auto _ : state) {
    benchmark::DoNotOptimize(x);
    benchmark::DoNotOptimize(controller.calculate(x, r, Scalar(r(0) - x(0)), u_ff));
  }
}
BENCHMARK(integral_feedback_step);

void delay_compensated_step(benchmark::State& state) {
  auto controller =
      DelayCompensatedFeedback<2, 1>::create(plant(), gain(), 50_ms, Scalar(-12.0), Scalar(12.0))
          .value();
  Eigen::Vector2d x(0.1, 0.0);
  const Eigen::Vector2d r(0.5, 0.0);
  const Scalar u_ff(0.6);
  for (auto _ : state) {
    benchmark::DoNotOptimize(x);
    benchmark::DoNotOptimize(controller.calculate(x, r, u_ff));
  }
}
BENCHMARK(delay_compensated_step);

void delay_predictor_step(benchmark::State& state) {
  auto predictor = DelayPredictor<2, 1>::create(
                       elevator(), 20_ms, Time(0.02 * static_cast<double>(state.range(0)) + 0.005))
                       .value();
  Eigen::Vector2d x(0.1, 0.0);
  for (auto _ : state) {
    benchmark::DoNotOptimize(x);
    const Eigen::Vector2d ahead = predictor.predict(x);
    predictor.sent(Scalar(ahead(0)));
    benchmark::DoNotOptimize(predictor);
  }
}
BENCHMARK(delay_predictor_step)->ArgName("periods")->Arg(1)->Arg(5);

void placement(benchmark::State& state) {
  Random random(1);
  const auto n = state.range(0);
  const auto m = state.range(1);
  const Eigen::MatrixXd A = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return random.normal(); });
  const Eigen::MatrixXd B = Eigen::MatrixXd::NullaryExpr(n, m, [&] { return random.normal(); });
  Eigen::VectorXcd poles(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    poles(i) = -1.0 - 0.2 * static_cast<double>(i);
  }
  for (auto _ : state) {
    benchmark::DoNotOptimize(place(A, B, poles));
  }
}
BENCHMARK(placement)
    ->Unit(benchmark::kMicrosecond)
    ->ArgNames({"states", "inputs"})
    ->Args({2, 1})
    ->Args({4, 1})
    ->Args({4, 2})
    ->Args({10, 3})
    ->Args({40, 8});

}  // namespace
