#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/control/delay_compensation.hpp>
#include <flyball/control/integral_control.hpp>
#include <flyball/control/lqg.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/control/mechanism_controller.hpp>
#include <flyball/control/pid.hpp>
#include <flyball/control/steady_state_feedforward.hpp>
#include <flyball/core/random.hpp>
#include <flyball/estimation/kalman_filter.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/planning/profiles/exponential_profile.hpp>
#include <flyball/planning/profiles/s_curve_profile.hpp>
#include <flyball/planning/profiles/trapezoid_profile.hpp>
#include <flyball/systems/discretize.hpp>

#include "elevator_loop.hpp"
#include "mechanism_designs.hpp"

// Every run-time object under the worst numbers there are: its outputs stay finite and within the
// limits, and when the numbers are ordinary again it goes back to the answers of its twin that
// never saw them.
namespace flyball::run_time_objects_test {
namespace {

using namespace flyball::literals;
using test::elevator;
using test::estimator_gain;
using test::gain;
using Scalar = Eigen::Matrix<double, 1, 1>;

constexpr double infinity = std::numeric_limits<double>::infinity();
using test::limit;

/// What is put in place of an input; nothing leaves the ordinary one.
using Faults = std::vector<std::optional<double>>;

/// One period of an object that runs against its plant: outputs, of which the first `limited` are
/// within ±12.
using Step = std::function<std::vector<double>(const Faults&)>;

struct Subject {
  std::string name;
  std::size_t inputs;
  std::size_t limited;
  std::function<Step()> make;
  bool returns = true;  ///< Within a hundred periods, to its twin's answers.
};

double of(const Faults& faults, std::size_t i, double ordinary) {
  return faults[i].value_or(ordinary);
}

std::vector<double> list(std::initializer_list<double> first, const Eigen::VectorXd& rest) {
  std::vector<double> all(first);
  all.insert(all.end(), rest.begin(), rest.end());
  return all;
}

Eigen::Vector2d reference(int k) {
  return {0.5 + 0.1 * std::sin(0.05 * k), 0.25 * std::cos(0.05 * k)};
}

/// The plant behind an object.
struct Plant {
  DiscreteSystem<2, 1, 1> model = elevator();
  Eigen::Vector2d x{0.4, 0.0};
  int k = 0;

  void step(double u) {
    x = model.A * x + model.B * u;
    ++k;
  }
};

// Inputs: r, dr/dt, their next ones, y, extra, rail.
template <class Regulator>
Step regulator(Regulator lqg) {
  return [lqg, plant = Plant{}](const Faults& faults) mutable {
    const Eigen::Vector2d now = reference(plant.k);
    const Eigen::Vector2d then = reference(plant.k + 1);
    const Eigen::Vector2d r(of(faults, 0, now(0)), of(faults, 1, now(1)));
    const Eigen::Vector2d r_next(of(faults, 2, then(0)), of(faults, 3, then(1)));
    const double u = lqg.step(r, r_next, Scalar(of(faults, 4, plant.x(0))),
                              Scalar(of(faults, 5, 0.6)), of(faults, 6, 11.5))(0);
    plant.step(std::isfinite(u) ? u - 0.6 : 0.0);
    return list({u, plant.x(0), plant.x(1), lqg.u_model()(0)}, lqg.x_hat());
  };
}

// Inputs: y, r, dr/dt, their next ones, rail.
Step mechanism(const MechanismControllerDesign& design) {
  const std::size_t late = design.predicts_with ? 2 : 0;  // periods
  return [controller = MechanismController<>::create(design).value(), design,
          x = Eigen::VectorXd(Eigen::VectorXd::Zero(design.plant.A.rows())),
          seen = std::vector<double>(late + 1, 0.0), k = 0](const Faults& faults) mutable {
    std::rotate(seen.begin(), seen.begin() + 1, seen.end());
    seen.back() = x(0);
    const bool flywheel = design.kind == mechanisms::MechanismKind::flywheel;
    const double speed = flywheel ? 200.0 : 1.0;
    const auto motion = [&](int at, std::size_t first) {
      const Eigen::Vector2d r = reference(at);
      return MotionState{of(faults, first, r(0)), of(faults, first + 1, speed * r(1))};
    };
    const double u = controller.update(of(faults, 0, seen.front()), motion(k, 1), motion(k + 1, 3),
                                       of(faults, 5, 11.0));
    const double drag = design.feed_forward_gravity ? 0.4 : 0.0;
    x = (design.plant.A * x + design.plant.B * (std::isfinite(u) ? u - drag : 0.0)).eval();
    ++k;
    return list({u, controller.command(), controller.limit()}, controller.x_hat());
  };
}

// Inputs: y, u.
template <class Filter>
Step filter(Filter kalman) {
  return [kalman, plant = Plant{}](const Faults& faults) mutable {
    const double u = std::sin(0.03 * plant.k);
    const double y = of(faults, 0, plant.x(0));
    const bool known = is_signal(y);
    const bool moved = kalman.predict(Scalar(of(faults, 1, u)));
    EXPECT_EQ(moved, is_signal(of(faults, 1, u)));
    EXPECT_EQ(kalman.update(Scalar(y), Scalar(of(faults, 1, u))),
              known ? UpdateStatus::updated : UpdateStatus::not_finite);
    plant.step(u);
    std::vector<double> all = list({}, kalman.x_hat());
    all.insert(all.end(), {kalman.P()(0, 0), kalman.P()(0, 1), kalman.P()(1, 1)});
    return all;
  };
}

std::vector<Subject> subjects() {
  const auto plant = elevator();
  const auto K = gain();
  const auto K_e = estimator_gain();
  const DiscreteSystem<> dynamic{plant.A, plant.B, plant.C, plant.D, plant.period};
  const auto Q = standard_deviations({1e-3, 0.05});
  const auto R = standard_deviations({1e-2});
  const Eigen::Matrix2d P0 = Eigen::Matrix2d::Identity();
  const Scalar bound(limit);
  std::vector<Subject> all;
  all.push_back({"Lqg", 7, 1, [=] { return regulator(lqg(plant, K, K_e, limit).value()); }});
  all.push_back({"Lqg of dynamic sizes", 7, 1, [=] {
                   return regulator(
                       lqg(dynamic, Eigen::MatrixXd(K), Eigen::MatrixXd(K_e), limit).value());
                 }});
  // Its plant really is driven out of this world.
  all.push_back(
      {"Lqg without limits", 7, 0, [=] { return regulator(lqg(plant, K, K_e).value()); }, false});
  for (const auto& [kind, kA_determined] : test::cases) {
    const auto design = test::design_of(kind, kA_determined);
    all.push_back({"MechanismController of a " + std::string(to_string(kind)) +
                       (kA_determined ? "" : " without kA"),
                   6, 3, [=] { return mechanism(design); }});
    const auto predicts = test::predicting(design, 40_ms);
    all.push_back({"predicting MechanismController of a " + std::string(to_string(kind)) +
                       (kA_determined ? "" : " without kA"),
                   6, 3, [=] { return mechanism(predicts); }});
  }
  all.push_back(
      {"KalmanFilter", 2, 0, [=] { return filter(kalman_filter(plant, Q, R, P0).value()); }});
  all.push_back({"KalmanFilter of dynamic sizes", 2, 0,
                 [=] { return filter(kalman_filter(dynamic, Q, R, P0).value()); }});
  all.push_back({"Observer", 2, 0, [=]() -> Step {
                   return [observer = Observer<2, 1, 1>(plant, K_e),
                           p = Plant{}](const Faults& faults) mutable {
                     const double u = std::sin(0.03 * p.k);
                     const double y = of(faults, 0, p.x(0));
                     EXPECT_EQ(observer.predict(Scalar(of(faults, 1, u))),
                               is_signal(of(faults, 1, u)));
                     EXPECT_EQ(observer.update(Scalar(y), Scalar(of(faults, 1, u))), is_signal(y));
                     p.step(u);
                     return list({}, observer.x_hat());
                   };
                 }});
  for (const AntiWindup anti_windup :
       {AntiWindup::none, AntiWindup::clamping, AntiWindup::back_calculation}) {
    for (const bool on_measurement : {false, true}) {
      all.push_back(
          {"Pid", 3, 1, [=]() -> Step {
             PidSettings settings{.gains = {.kp = 80.0, .ki = 400.0, .kd = 4.0}};
             settings.derivative_on_measurement = on_measurement;
             settings.derivative_time_constant = 0.02;
             settings.output_min = -limit;
             settings.output_max = limit;
             settings.integral_min = -limit;
             settings.integral_max = limit;
             settings.anti_windup = anti_windup;
             return
                 [pid = Pid::create(settings).value(), p = Plant{}](const Faults& faults) mutable {
                   const double u =
                       pid.calculate(of(faults, 0, p.x(0)), of(faults, 1, 0.5), of(faults, 2, 0.3));
                   p.step(std::isfinite(u) ? u : 0.0);
                   return std::vector{u, pid.integral(), pid.derivative(), pid.error(), p.x(0)};
                 };
           }});
    }
  }
  // Inputs: x (2), r (2), the output's error, u_ff.
  all.push_back(
      {"IntegralStateFeedback", 6, 1, [=]() -> Step {
         const auto design = lqi(plant, bryson({0.02, 0.4, 0.002}), bryson({limit})).value();
         return [feedback = IntegralStateFeedback<2, 1, 1>(
                     Eigen::RowVector2d(design.K), Scalar(design.K_I(0)), 0.02, -bound, bound),
                 p = Plant{}](const Faults& faults) mutable {
           const double u = feedback.calculate(
               Eigen::Vector2d(of(faults, 0, p.x(0)), of(faults, 1, p.x(1))),
               Eigen::Vector2d(of(faults, 2, 0.5), of(faults, 3, 0.0)),
               Scalar(of(faults, 4, 0.5 - p.x(0))), Scalar(of(faults, 5, 0.6)))(0);
           p.step(std::isfinite(u) ? u - 0.6 : 0.0);
           return std::vector{u, feedback.integral()(0), p.x(0), p.x(1)};
         };
       }});
  // Inputs: x (2), r (2), u_ff.
  all.push_back({"StateFeedback", 5, 1, [=]() -> Step {
                   StateFeedback<2, 1> made(K, -bound, bound);
                   made.set_angle(0, 6.0);
                   return [feedback = made, p = Plant{}](const Faults& faults) mutable {
                     const double u = feedback.calculate(
                         Eigen::Vector2d(of(faults, 0, p.x(0)), of(faults, 1, p.x(1))),
                         Eigen::Vector2d(of(faults, 2, 0.5), of(faults, 3, 0.0)),
                         Scalar(of(faults, 4, 0.6)))(0);
                     p.step(std::isfinite(u) ? u - 0.6 : 0.0);
                     return std::vector{u, p.x(0), p.x(1)};
                   };
                 }});
  all.push_back(
      {"DelayCompensatedFeedback", 5, 1, [=]() -> Step {
         // Gentle, so that the start at the limits leaves the loop stable.
         const Eigen::RowVector2d gentle =
             lqr(plant, bryson({0.5, 4.0}), bryson({limit})).value().K;
         return
             [feedback = DelayCompensatedFeedback<2, 1>::create(plant, gentle, 40_ms, -bound, bound)
                             .value(),
              old = std::array{Plant{}.x, Plant{}.x}, p = Plant{}](const Faults& faults) mutable {
               const Eigen::Vector2d x = std::exchange(old[0], std::exchange(old[1], p.x));
               const double u =
                   feedback.calculate(Eigen::Vector2d(of(faults, 0, x(0)), of(faults, 1, x(1))),
                                      Eigen::Vector2d(of(faults, 2, 0.5), of(faults, 3, 0.0)),
                                      Scalar(of(faults, 4, 0.6)))(0);
               p.step(std::isfinite(u) ? u - 0.6 : 0.0);
               return std::vector{u, p.x(0), p.x(1)};
             };
       }});
  // Inputs: x (2), the input that was sent.
  all.push_back(
      {"DelayPredictor", 3, 0, [=]() -> Step {
         const auto model =
             mechanisms::elevator({.kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.6}).value();
         const ContinuousSystem<2, 1, 1>& continuous = model;
         return [predictor = DelayPredictor<2, 1>::create(continuous, 20_ms, 50_ms).value(),
                 p = Plant{}](const Faults& faults) mutable {
           const Eigen::Vector2d ahead =
               predictor.predict(Eigen::Vector2d(of(faults, 0, p.x(0)), of(faults, 1, p.x(1))));
           const double u = std::sin(0.03 * p.k);
           EXPECT_EQ(predictor.sent(Scalar(of(faults, 2, u))), is_signal(of(faults, 2, u)));
           p.step(u);
           return std::vector{ahead(0), ahead(1)};
         };
       }});
  // Inputs: v_max, a_max, start and goal (2 each), t.
  all.push_back({"TrapezoidProfile", 7, 0, [=]() -> Step {
                   return [k = 0](const Faults& faults) mutable {
                     const TrapezoidProfile profile({of(faults, 0, 1.0), of(faults, 1, 2.0)},
                                                    {of(faults, 2, 0.1), of(faults, 3, 0.2)},
                                                    {of(faults, 4, 2.0), of(faults, 5, 0.3)});
                     const MotionState at = profile.sample(of(faults, 6, 0.02 * k++));
                     return std::vector{at.position, at.velocity, at.acceleration,
                                        profile.total_time(), profile.cruise_velocity()};
                   };
                 }});
  // Inputs: v_max, a_max, jerk, start (3) and goal (3), t.
  all.push_back({"SCurveProfile", 10, 0, [=]() -> Step {
                   return [k = 0](const Faults& faults) mutable {
                     const SCurveProfile profile(
                         {of(faults, 0, 1.0), of(faults, 1, 2.0), 0.0, 0.0, of(faults, 2, 9.0)},
                         {of(faults, 3, 0.1), of(faults, 4, 0.2), of(faults, 5, -0.3)},
                         {of(faults, 6, 2.0), of(faults, 7, 0.3), of(faults, 8, 0.4)});
                     const MotionState at = profile.sample(of(faults, 9, 0.02 * k++));
                     return std::vector{at.position, at.velocity, at.acceleration,
                                        profile.total_time()};
                   };
                 }});
  // Inputs: kV, kA, voltage, kS, kG, start and goal (2 each), t.
  all.push_back(
      {"ExponentialProfile", 10, 0, [=]() -> Step {
         return [k = 0](const Faults& faults) mutable {
           const ExponentialProfile profile(
               {of(faults, 0, 4.0), of(faults, 1, 0.4), of(faults, 2, 12.0), of(faults, 3, 0.2),
                of(faults, 4, 0.8)},
               {of(faults, 5, 0.1), of(faults, 6, 0.2)}, {of(faults, 7, 2.0), of(faults, 8, 0.3)});
           const MotionState at = profile.sample(of(faults, 9, 0.02 * k++));
           return std::vector{at.position, at.velocity, at.acceleration, profile.total_time()};
         };
       }});
  // Inputs: position, velocity, acceleration, next velocity, voltage, rail.
  all.push_back({"feedforwards", 6, 1, [=]() -> Step {
                   const auto simple =
                       SimpleFeedforward::create(
                           mechanisms::MechanismKind::arm,
                           {.kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.6, .angle_offset = 0.1}, 20_ms)
                           .value();
                   const auto inversion = linear_plant_inversion(plant).value();
                   const auto steady = steady_state_feedforward(plant).value();
                   const auto weighted =
                       qr_weighted_inversion(plant, bryson({0.02, 0.4}), bryson({limit})).value();
                   return [=](const Faults& faults) {
                     const double x = of(faults, 0, 0.3);
                     const double v = of(faults, 1, 0.5);
                     const double next = of(faults, 3, 0.6);
                     const VoltageCompensation compensation(limit);
                     return std::vector{
                         compensation.command(of(faults, 4, 6.0), of(faults, 5, 11.0)),
                         compensation.motor_voltage(of(faults, 4, 6.0), of(faults, 5, 11.0)),
                         simple.calculate(x, v, of(faults, 2, 1.0)),
                         simple.calculate_discrete(x, v, next),
                         inversion.calculate(Eigen::Vector2d(x, v), Eigen::Vector2d(x, next))(0),
                         weighted.calculate(Eigen::Vector2d(x, v), Eigen::Vector2d(x, next))(0),
                         steady.calculate(Eigen::Vector2d(x, v))(0)};
                   };
                 }});
  return all;
}

TEST(RunTimeObjects, ForgetWhatIsNotAMeasurement) {
  constexpr std::array worst{
      0.0,     2.2e-16,  -2.2e-16,  5e-324,
      -1e-310, 1e154,    -1e154,    1e-154,
      -1e-154, 1.7e308,  -1.7e308,  1e300,
      -1e300,  infinity, -infinity, std::numeric_limits<double>::quiet_NaN()};
  constexpr int ordinary_steps = 100;
  for (const Subject& subject : subjects()) {
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
      Random random(seed);
      const Faults none(subject.inputs);
      Step twin = subject.make();
      Step tried = subject.make();
      const auto both = [&](const Faults& faults) {
        const std::vector<double> expected = twin(none);
        std::vector<double> got = tried(faults);
        for (std::size_t i = 0; i < got.size(); ++i) {
          EXPECT_TRUE(std::isfinite(got[i])) << "output " << i;
          EXPECT_TRUE(i >= subject.limited || std::abs(got[i]) <= limit) << "output " << i;
        }
        return std::pair{expected, got};
      };
      SCOPED_TRACE(subject.name + ", seed " + std::to_string(seed));
      for (int k = 0; k < 20; ++k) {
        both(none);
      }
      const auto bad_steps = 1 + random.bits() % 4;
      for (std::uint64_t k = 0; k < bad_steps; ++k) {
        Faults faults(subject.inputs);
        // One input alone, or any of them.
        const std::size_t one = random.bits() % (2 * subject.inputs);
        for (std::size_t i = 0; i < subject.inputs; ++i) {
          if (one == i || (one >= subject.inputs && random.bits() % 2 == 0)) {
            faults[i] = worst[random.bits() % worst.size()];
          }
        }
        both(faults);
      }
      for (int k = 0; k < ordinary_steps; ++k) {
        const auto [expected, got] = both(none);
        const bool compared = subject.returns && k + 1 == ordinary_steps;
        for (std::size_t i = 0; compared && i < got.size(); ++i) {
          EXPECT_NEAR(got[i], expected[i], 1e-3 * (1.0 + std::abs(expected[i]))) << "output " << i;
        }
      }
      ASSERT_FALSE(HasFailure());
    }
  }
}

}  // namespace
}  // namespace flyball::run_time_objects_test
