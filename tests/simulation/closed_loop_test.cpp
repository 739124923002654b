#include <flyball/simulation/closed_loop.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/control/lqg.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/control/pid.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/linearize.hpp>

namespace flyball::closed_loop_test {
namespace {

using namespace flyball::literals;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

// A pendulum of 1 m with a torque per inertia, which names what it has.
struct Pendulum {
  static constexpr int states() { return 2; }
  static constexpr int inputs() { return 1; }
  template <class X, class U>
  auto derivative(const X& x, const U& u) const {
    using std::sin;
    return Eigen::Vector<ScalarOf<X, U>, 2>{x(1), -9.81 * sin(x(0)) + u(0)};
  }
  template <class X, class U>
  auto output(const X& x, const U&) const {
    return Eigen::Vector<ScalarOf<X>, 1>{x(0)};
  }
  static ModelDescription description() {
    return {.name = "pendulum",
            .states = {{"theta", "rad", true}, {"omega", "rad/s"}},
            .inputs = {{"torque", "rad/s²"}},
            .outputs = {{"theta", "rad", true}}};
  }
};

// Two integrators, each with its input.
ContinuousSystem<> integrators() {
  return {MatrixXd::Zero(2, 2), MatrixXd::Identity(2, 2), MatrixXd::Identity(2, 2),
          MatrixXd::Zero(2, 2)};
}

ClosedLoop periods(Eigen::Index count, Time period = 20_ms) {
  ClosedLoop loop;
  loop.period = period;
  loop.reference = MatrixXd::Zero(0, count);
  return loop;
}

const std::vector<double>& column(const ClosedLoopResult& result, const char* name) {
  const auto* values = result.series.find(name);
  EXPECT_NE(values, nullptr) << name;
  return *values;
}

LoopCommand nothing(const LoopSample&) {
  return VectorXd::Zero(1);
}

// A sampled state feedback of a linear plant is x <- (A_d - B_d K) x, with the exact
// discretisation.
TEST(SimulateClosedLoop, OfALinearPlantIsItsDiscreteLoop) {
  ContinuousSystem<2, 1, 1> plant;
  plant.A << 0.0, 1.0, 2.0, -1.0;
  plant.B << 0.0, 1.0;
  plant.C << 1.0, 0.0;
  plant.D << 0.0;
  const auto discrete = discretize(plant, 20_ms).value();
  const Eigen::RowVector2d K = lqr(discrete, bryson({0.1, 1.0}), bryson({10.0})).value().K;
  ClosedLoop loop = periods(100);
  loop.reference = Vector2d(0.3, 0.0).replicate(1, 100);
  for (const double accuracy : {0.0, 1e-12}) {
    Vector2d x(1.0, -2.0);
    auto simulated = ModelPlant::create(plant, x, {.accuracy = accuracy}).value();
    const auto result =
        simulate_closed_loop(
            simulated, [&](const LoopSample& s) -> LoopCommand { return {K * (s.r - s.x)}; }, loop)
            .value();
    double squares = 0.0;
    double fastest = 0.0;
    for (std::size_t k = 0; k < 100; ++k) {
      fastest = std::max(fastest, std::abs(x(1)));
      ASSERT_NEAR(column(result, "x1")[k], x(0), 1e-10) << k;
      ASSERT_NEAR(column(result, "x2")[k], x(1), 1e-10) << k;
      const double u = (K * (Vector2d(0.3, 0.0) - x))(0);
      ASSERT_NEAR(column(result, "commanded_u1")[k], u, 1e-8);
      squares += (0.3 - x(0)) * (0.3 - x(0));
      x = discrete.A * x + discrete.B * u;
    }
    EXPECT_LT((simulated.state() - x).norm(), 1e-10);
    EXPECT_NEAR(result.tracking[0].rms, std::sqrt(squares / 100.0), 1e-9);
    EXPECT_NEAR(result.tracking[0].max, 0.7, 1e-12);
    EXPECT_NEAR(result.tracking[1].max, fastest, 1e-9);
    EXPECT_EQ(result.series.time()[99], 99 * 0.02);
  }
}

// Inputs change one delay after their sample, each by its own, within its limits:
// ∫u from 0 to 50 ms is 3 (50 - 5) ms for 5 V limited to 3 V, and 2 (50 - 30) ms.
TEST(SimulateClosedLoop, DelaysAndLimitsEachInput) {
  auto plant = ModelPlant::create(integrators(), Vector2d::Zero()).value();
  ClosedLoop loop = periods(6, 10_ms);
  loop.actuators = {{.min = -1.0, .max = 3.0, .delay = 5_ms}, {.delay = 30_ms}};
  const auto result =
      simulate_closed_loop(
          plant, [](const LoopSample&) -> LoopCommand { return Vector2d(5.0, 2.0); }, loop)
          .value();
  EXPECT_NEAR(column(result, "x1")[5], 3.0 * 0.045, 1e-12);
  EXPECT_NEAR(column(result, "x2")[5], 2.0 * 0.020, 1e-12);
  EXPECT_EQ(column(result, "commanded_u1")[0], 5.0);
  EXPECT_EQ(column(result, "applied_u1")[1], 3.0);
  EXPECT_EQ(column(result, "applied_u2")[2], 0.0);
  EXPECT_EQ(result.inputs[0].saturated_fraction, 1.0);
  EXPECT_EQ(result.inputs[1].saturated_fraction, 0.0);
  EXPECT_EQ(result.inputs[0].peak, 3.0);
}

// The pendulum upright by LQG of its linearisation: angles are followed the shorter way round, so
// that upright seen from below is no error of a whole turn.
TEST(SimulateClosedLoop, BalancesAPendulumByLqg) {
  const Vector2d upright(std::numbers::pi, 0.0);
  const auto linear = linearize(Pendulum{}, upright, Eigen::Vector<double, 1>(0.0)).value();
  const auto discrete =
      discretize(ContinuousSystem<2, 1, 1>{linear.A, linear.B, linear.C, linear.D}, 20_ms).value();
  const Eigen::RowVector2d K = lqr(discrete, bryson({0.1, 1.0}), bryson({10.0})).value().K;
  const Vector2d K_e =
      kalman_gain(discrete, standard_deviations({0.01, 0.1}), standard_deviations({0.01}))
          .value()
          .K;
  auto regulator = lqg(discrete, K, K_e, 30.0).value();
  ClosedLoop loop = periods(200);
  loop.reference = Vector2d(-std::numbers::pi, 0.0).replicate(1, 200);
  loop.sensors = {{.resolution = 1e-3, .noise = 1e-3}};
  loop.actuators = {{.min = -30.0, .max = 30.0}};
  const auto run = [&] {
    auto plant = ModelPlant::create(Pendulum{}, upright + Vector2d(0.2, 0.0)).value();
    regulator.reset(Vector2d::Zero());
    return simulate_closed_loop(
               plant,
               [&](const LoopSample& s) -> LoopCommand {
                 const Vector2d r = Vector2d::Zero();
                 const auto u =
                     regulator.step(r, r, Eigen::Vector<double, 1>(s.y(0) - std::numbers::pi));
                 return {u, regulator.x_hat() + upright};
               },
               loop)
        .value();
  };
  const auto result = run();
  EXPECT_LT(std::abs(result.tracking[0].final), 0.01);
  EXPECT_NEAR(result.tracking[0].max, 0.2, 0.05);
  EXPECT_EQ(column(result, "theta")[0], std::numbers::pi + 0.2);
  EXPECT_NEAR(column(result, "estimated_theta").back(), column(result, "theta").back(), 0.02);
  const double reading = column(result, "measured_theta")[5] / 1e-3;
  EXPECT_NEAR(reading, std::round(reading), 1e-9);
  // Named and in units as the model says.
  std::string names;
  for (const auto& each : result.series.columns()) {
    names += each.name + " [" + each.unit + "] ";
  }
  EXPECT_EQ(names,
            "reference_theta [rad] reference_omega [rad/s] theta [rad] omega [rad/s] "
            "output_theta [rad] measured_theta [rad] estimated_theta [rad] estimated_omega [rad/s] "
            "commanded_torque [rad/s²] applied_torque [rad/s²] ");
  // Deterministic, and of the seed.
  EXPECT_EQ(column(result, "omega"), column(run(), "omega"));
  loop.seed = 2;
  EXPECT_NE(column(result, "omega"), column(run(), "omega"));
}

// A PI controller reads the output and its reference; its plant is an integrator, so that the
// slower pole of s² + 5 s + 2 is -0.44/s.
TEST(SimulateClosedLoop, RunsAPid) {
  auto pid = Pid::create({.gains = {.kp = 5.0, .ki = 2.0}, .period = 0.01}).value();
  auto plant =
      ModelPlant::create(ContinuousSystem<1, 1, 1>{MatrixXd::Zero(1, 1), MatrixXd::Ones(1, 1),
                                                   MatrixXd::Ones(1, 1), MatrixXd::Zero(1, 1)},
                         MatrixXd::Zero(1, 1))
          .value();
  ClosedLoop loop = periods(2000, 10_ms);
  loop.reference = MatrixXd::Ones(1, 2000);
  loop.reference_of = ReferenceOf::outputs;
  const auto result = simulate_closed_loop(
                          plant,
                          [&](const LoopSample& s) -> LoopCommand {
                            return VectorXd::Constant(1, pid.calculate(s.y(0), s.r(0)));
                          },
                          loop)
                          .value();
  EXPECT_LT(std::abs(result.tracking[0].final), 1e-3);
  EXPECT_EQ(result.tracking[0].max, 1.0);
}

// Without control it keeps its energy; both ways to integrate agree.
TEST(SimulateClosedLoop, IntegratesStiffModelsToAnAccuracy) {
  const ContinuousSystem<1, 1, 1> stiff{MatrixXd::Constant(1, 1, -1e6),
                                        MatrixXd::Constant(1, 1, 1e6), MatrixXd::Ones(1, 1),
                                        MatrixXd::Zero(1, 1)};
  auto plant = ModelPlant::create(stiff, MatrixXd::Ones(1, 1), {.accuracy = 1e-8}).value();
  const auto follow = [](const LoopSample&) -> LoopCommand { return VectorXd::Constant(1, 0.5); };
  const auto result = simulate_closed_loop(plant, follow, periods(3)).value();
  EXPECT_NEAR(column(result, "x1")[2], 0.5, 1e-6);

  // Steps of 1 ms are far too long for it, and the message says so.
  auto coarse = ModelPlant::create(stiff, MatrixXd::Ones(1, 1)).value();
  const auto error = simulate_closed_loop(coarse, follow, periods(100)).error();
  EXPECT_TRUE(error.is(ArgumentError::not_finite));
  EXPECT_NE(to_string(error).find("x1"), std::string::npos) << to_string(error);
  EXPECT_NE(to_string(error).find("max_step"), std::string::npos) << to_string(error);

  const Vector2d start(3.0, 0.0);
  auto coarse_pendulum = ModelPlant::create(Pendulum{}, start).value();
  auto fine_pendulum = ModelPlant::create(Pendulum{}, start, {.accuracy = 1e-12}).value();
  (void)simulate_closed_loop(coarse_pendulum, nothing, periods(250)).value();
  (void)simulate_closed_loop(fine_pendulum, nothing, periods(250)).value();
  EXPECT_LT((coarse_pendulum.state() - fine_pendulum.state()).norm(), 1e-8);
  const VectorXd& x = fine_pendulum.state();
  EXPECT_NEAR(0.5 * x(1) * x(1) - 9.81 * std::cos(x(0)), -9.81 * std::cos(3.0), 1e-9);
}

// A delay of whole periods ends where a step does, but for the rounding of its sum with the
// sample's time: no step is taken of that. The position after k periods of 3 V, from the third on.
TEST(SimulateClosedLoop, DelaysByWholePeriods) {
  for (const double accuracy : {0.0, 1e-9}) {
    auto plant =
        ModelPlant::create(integrators(), Vector2d::Zero(), {.accuracy = accuracy}).value();
    ClosedLoop loop = periods(300, 10_ms);
    loop.actuators = {{.delay = 20_ms}, {.delay = 30_ms}};
    const auto law = [](const LoopSample& s) -> LoopCommand {
      const double step = static_cast<double>(s.index + 1);
      return Vector2d(3.0, step);
    };
    const auto result = simulate_closed_loop(plant, law, loop);
    ASSERT_TRUE(result) << to_string(result.error());
    EXPECT_NEAR(column(*result, "x1")[299], 3.0 * 0.01 * 297.0, 1e-9);
    EXPECT_NEAR(column(*result, "x2")[299], 0.01 * 296.0 * 297.0 / 2.0, 1e-9);
    EXPECT_EQ(result->inputs[1].peak, 297.0);
  }
}

// Sensors see what happens between the samples: of a ramp of 1 V/s, read 5 ms late at a period of
// 20 ms, and of one held by a refresh of 50 ms.
TEST(SimulateClosedLoop, SensorsLookBetweenTheSamples) {
  auto plant = ModelPlant::create(integrators(), Vector2d::Zero()).value();
  ClosedLoop loop = periods(10);
  loop.sensors = {{.delay = 5_ms}, {.refresh = 50_ms}};
  const auto law = [](const LoopSample&) -> LoopCommand { return Vector2d(1.0, 2.0); };
  const auto result = simulate_closed_loop(plant, law, loop).value();
  for (std::size_t k = 1; k < 10; ++k) {
    const double time = 0.02 * static_cast<double>(k);
    EXPECT_NEAR(column(result, "measured_y1")[k], time - 0.005, 1e-12) << k;
    EXPECT_NEAR(column(result, "measured_y2")[k], 2.0 * 0.05 * std::floor(time / 0.05 + 1e-9),
                1e-12)
        << k;
    EXPECT_NEAR(column(result, "output_y2")[k], 2.0 * time, 1e-12) << k;
  }
}

// What is added to a command is drawn once a period, after the limits, and has its deviation.
TEST(SimulateClosedLoop, AddsTheActuatorsNoise) {
  auto plant = ModelPlant::create(integrators(), Vector2d::Zero()).value();
  ClosedLoop loop = periods(4000, 1_ms);
  loop.actuators = {{.min = -1.0, .max = 1.0, .noise = 0.25}};
  const auto law = [](const LoopSample&) -> LoopCommand { return Vector2d(5.0, 0.0); };
  const auto result = simulate_closed_loop(plant, law, loop).value();
  double sum = 0.0;
  double squares = 0.0;
  const auto& x = column(result, "x1");
  for (std::size_t k = 0; k + 1 < x.size(); ++k) {
    const double noise = (x[k + 1] - x[k]) / 1e-3 - 1.0;
    sum += noise;
    squares += noise * noise;
  }
  EXPECT_NEAR(sum / 3999.0, 0.0, 0.02);
  EXPECT_NEAR(std::sqrt(squares / 3999.0), 0.25, 0.01);
}

TEST(SimulateClosedLoop, Errors) {
  const auto refused = [](auto change, auto law) {
    auto plant = ModelPlant::create(integrators(), Vector2d::Zero()).value();
    ClosedLoop loop = periods(5);
    change(loop);
    return simulate_closed_loop(plant, law, loop).error();
  };
  const auto still = [](const LoopSample&) -> LoopCommand { return Vector2d(0.0, 0.0); };
  const auto with = [&](auto change) { return refused(change, still); };
  const auto same = [](ClosedLoop&) {};
  EXPECT_TRUE(with([](auto& l) { l.period = Time(0.0); }).is(ArgumentError::not_positive));
  EXPECT_TRUE(with([](auto& l) { l.record_step = Time(-1.0); }).is(ArgumentError::not_positive));
  EXPECT_TRUE(with([](auto& l) { l.reference.resize(0, 0); }).is(ArgumentError::empty));
  EXPECT_TRUE(
      with([](auto& l) { l.reference = MatrixXd::Zero(3, 5); }).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(with([](auto& l) {
                l.reference = MatrixXd::Constant(2, 5, std::nan(""));
              }).is(ArgumentError::not_finite));
  EXPECT_TRUE(with([](auto& l) { l.sensors.resize(3); }).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(with([](auto& l) { l.actuators.resize(3); }).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(with([](auto& l) { l.sensors = {{.noise = -1.0}}; }).is(ArgumentError::out_of_range));
  EXPECT_TRUE(with([](auto& l) {
                l.actuators = {{.min = 1.0, .max = 1.0}};
              }).is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      with([](auto& l) { l.actuators = {{.delay = Time(-1.0)}}; }).is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      with([](auto& l) { l.actuators = {{.noise = -1.0}}; }).is(ArgumentError::out_of_range));

  EXPECT_TRUE(refused(same, [](const LoopSample&) -> LoopCommand {
                return VectorXd::Zero(1);
              }).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(refused(same, [](const LoopSample&) -> LoopCommand {
                return {VectorXd::Zero(2), VectorXd::Zero(1)};
              }).is(ArgumentError::wrong_shape));
  const auto error = refused(same, [](const LoopSample& s) -> LoopCommand {
    return Vector2d(0.0, s.index == 3 ? std::nan("") : 0.0);
  });
  EXPECT_EQ(to_string(error),
            "simulate_closed_loop: the controller's u2 is nan at t = 0.06 s; it must be a finite "
            "number (t = 0.06)");
  EXPECT_TRUE(ModelPlant::create(integrators(), Vector2d::Zero(), {.max_step = Time(0.0)})
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(ModelPlant::create(integrators(), Vector2d::Zero(), {.accuracy = -1.0})
                  .error()
                  .is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::closed_loop_test
