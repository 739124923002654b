#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/control/feedforward.hpp>
#include <flyball/control/latency.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/math/exponential/matrix_function.hpp>
#include <flyball/mechanisms/arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/mechanisms/swerve_drive.hpp>
#include <flyball/mechanisms/turret.hpp>
#include <flyball/mechanisms/velocity_servo.hpp>
#include <flyball/systems/discretize.hpp>

#include "core/try.hpp"
#include "study/design_steps.hpp"
#include "study/told.hpp"

// The plant, and the loop that a choice of tolerances gives.
namespace flyball::study {

using mechanisms::MechanismKind;

namespace {

template <class Mechanism>
void take(LinearModel& model, const Mechanism& mechanism) {
  model.A = mechanism.A;
  model.B = mechanism.B;
  model.C = mechanism.C;
}

/// Theorems 6.9.1, 6.10.1 and 6.11.1, which the other kinds share.
Expected<void> build(LinearModel& model, const PlantDescription& plant) {
  const auto into = [&](const auto& built) { take(model, built); };
  switch (plant.kind) {
    case MechanismKind::flywheel:
      return mechanisms::flywheel(plant.gains).map(into);
    case MechanismKind::roller:
      return mechanisms::roller(plant.gains).map(into);
    case MechanismKind::swerve_drive:
      return mechanisms::swerve_drive(plant.gains).map(into);
    case MechanismKind::elevator:
      return mechanisms::elevator(plant.gains).map(into);
    case MechanismKind::arm:
      return mechanisms::arm(plant.gains).map(into);
    case MechanismKind::turret:
      return mechanisms::turret(plant.gains).map(into);
    case MechanismKind::swerve_steer:
      return mechanisms::swerve_steer(plant.gains).map(into);
  }
  return {};
}

double top_speed(const PlantDescription& plant) {
  return plant.nominal_voltage / plant.gains.kV;
}

// Process noise per sample: the model's voltage is believed to within half a volt.
Eigen::MatrixXd process_covariance(const LinearModel& model, const DesignJob& job) {
  if (!job.estimator.model_std.empty()) {
    const Eigen::Map<const Eigen::VectorXd> std(
        job.estimator.model_std.data(), static_cast<Eigen::Index>(job.estimator.model_std.size()));
    return std.array().square().matrix().asDiagonal();
  }
  constexpr double voltage_std = 0.5;
  const Eigen::MatrixXd Bv = model.discrete.B * voltage_std;
  return Bv * Bv.transpose();
}

/// The smaller of each margin, with the crossings of the smaller phase margin.
StabilityMargins worse(const StabilityMargins& a, const StabilityMargins& b) {
  StabilityMargins worst = a.phase_margin <= b.phase_margin ? a : b;
  worst.stable = a.stable && b.stable;
  worst.spectral_radius = std::max(a.spectral_radius, b.spectral_radius);
  worst.gain_margin_up = std::min(a.gain_margin_up, b.gain_margin_up);
  worst.gain_margin_down = std::max(a.gain_margin_down, b.gain_margin_down);
  worst.delay_margin = std::min(a.delay_margin, b.delay_margin);
  worst.disk_margin = std::min(a.disk_margin, b.disk_margin);
  return worst;
}

}  // namespace

double measurement_std(const DesignJob& job) {
  if (job.estimator.measurement_std) {
    return *job.estimator.measurement_std;
  }
  if (job.sensor.resolution > 0.0) {
    // A quantised reading errs uniformly over one step: q/√12.
    return job.sensor.resolution / std::sqrt(12.0);
  }
  return controls_velocity(job.plant.kind) ? 0.005 * top_speed(job.plant)
         : job.plant.unit == "m"           ? 5e-4
                                           : 1e-3;
}

Expected<LinearModel> linear_model(const PlantDescription& plant, double period) {
  LinearModel model;
  const Coordinate position{"position", plant.unit};
  const Coordinate velocity{"velocity", plant.unit + "/s"};
  const bool flywheel = controls_velocity(plant.kind);
  const auto zero = Eigen::MatrixXd::Zero(1, 1);
  if (!plant.kA_determined) {
    model.states = {flywheel ? velocity : position};
    model.C = Eigen::MatrixXd::Identity(1, 1);
    if (flywheel) {
      // The velocity u/kV is reached within a period: x_{k+1} = u_k/kV. Its continuous model for
      // the margins is as fast as the period can show.
      const double kA = 0.1 * plant.gains.kV * period;
      model.A = Eigen::MatrixXd::Constant(1, 1, -plant.gains.kV / kA);
      model.B = Eigen::MatrixXd::Constant(1, 1, 1.0 / kA);
      model.discrete = {zero, Eigen::MatrixXd::Constant(1, 1, 1.0 / plant.gains.kV), model.C, zero,
                        Time(period)};
      return model;
    }
    // Theorem 14.3.2, its velocity written as the volts kV v.
    const auto servo = mechanisms::velocity_servo();
    model.A = servo.A;
    model.B = servo.B / plant.gains.kV;
    model.discrete = {Eigen::MatrixXd::Identity(1, 1), model.B * period, model.C, zero,
                      Time(period)};
    return model;
  }
  FLYBALL_CHECK(build(model, plant));
  model.states = flywheel ? std::vector{velocity} : std::vector{position, velocity};
  FLYBALL_TRY(auto discrete,
              told_of("controller.period", discretize_zoh(model.A, model.B, Time(period))));
  model.discrete = {discrete.A, discrete.B, model.C, zero, Time(period)};
  return model;
}

Diagnostic unknown_kA(const PlantDescription& plant) {
  return {"kA_not_determined", Severity::info,
          controls_velocity(plant.kind)
              ? "kA is not known: the flywheel is taken to follow its voltage within a period, and "
                "feedforward alone drives it"
              : "kA is not known: the velocity is taken to follow the voltage (Theorem 14.3.2)"};
}

Expected<std::vector<PossiblePlant>> possible_plants(const LinearModel& model,
                                                     const PlantDescription& plant) {
  const Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(1, 1);
  std::vector<PossiblePlant> plants{
      {plant.kA_determined ? plant.gains.kA : 0.0, {model.A, model.B, model.C, zero}}};
  if (plant.kA_determined || !(plant.kA_upper_bound > 0.0)) {
    return plants;
  }
  for (const double share : {0.25, 0.5, 0.75, 1.0}) {
    PlantDescription with = plant;
    with.kA_determined = true;
    with.gains.kA = share * plant.kA_upper_bound;
    LinearModel built;
    FLYBALL_CHECK(build(built, with));
    plants.push_back({with.gains.kA, {built.A, built.B, built.C, zero}});
  }
  return plants;
}

std::vector<double> default_tolerances(const PlantDescription& plant, std::size_t states) {
  const double speed = top_speed(plant);
  std::vector<double> tolerances;
  if (controls_velocity(plant.kind)) {
    tolerances = {0.01 * speed};
  } else {
    const double position = plant.unit == "m" ? 0.005 : std::numbers::pi / 360.0;
    tolerances = {position, 0.1 * speed};
  }
  tolerances.resize(states);
  return tolerances;
}

bool predicts_delay(const DesignJob& job) {
  return job.controller.predict_delay.value_or(false) && job.controller.delay.value_or(0.0) > 0.0;
}

Expected<LoopDesign> feedback_of(const LinearModel& model, const DesignJob& job,
                                 const std::vector<double>& tolerances) {
  const ControllerOptions& controller = job.controller;
  const DiscreteSystem<>& plant = model.discrete;
  const Time delay(controller.delay.value_or(0.0));
  if (static_cast<Eigen::Index>(tolerances.size()) != plant.A.rows()) {
    return refusal(ArgumentError::wrong_shape, "design", "controller.state_tolerance")
        .got(fmt::format("{} values long", tolerances.size()))
        .expected(fmt::format("one value a state: {}", fmt::join(labels(model.states), ", ")));
  }
  LoopDesign loop;
  loop.tolerances = tolerances;
  loop.predicts = predicts_delay(job);
  FLYBALL_TRY(loop.Q, told_of("controller.state_tolerance", bryson(tolerances)));
  FLYBALL_TRY(loop.R, told_of("controller.input_tolerance", bryson({controller.input_tolerance})));
  FLYBALL_TRY(auto regulator, lqr(plant, loop.Q, loop.R));
  loop.K = regulator.K;
  loop.poles = regulator.poles;

  if (loop.predicts) {
    loop.K_delayed = loop.K;
  } else {
    auto delayed = compensate_latency(loop.K, plant.A, plant.B, plant.period, delay);
    if (!delayed && delayed.error().is(MatrixFunctionError::no_real_power)) {
      // A closed-loop pole on the negative real axis has no real fractional power.
      loop.whole_periods = true;
      const Time whole(std::round(delay.si() / plant.period.si()) * plant.period.si());
      delayed = compensate_latency(loop.K, plant.A, plant.B, plant.period, whole);
    }
    FLYBALL_TRY(loop.K_delayed, told_of("controller.delay", std::move(delayed)));
  }

  const double sigma = measurement_std(job);
  FLYBALL_TRY(auto observer, told_of("the observer",
                                     kalman_gain(plant, process_covariance(model, job),
                                                 standard_deviations({sigma})),
                                     "raise estimator.model_std, or leave it out"));
  loop.kalman_gain = observer.K;
  loop.estimator_poles = observer.poles;

  FLYBALL_TRY(const auto inversion, pseudoinverse(plant.B));
  loop.inversion = inversion.X;

  loop.regulator = {plant, loop.K_delayed, loop.kalman_gain};
  if (loop.predicts) {
    const ContinuousSystem<> believed{model.A, model.B, model.C, Eigen::MatrixXd::Zero(1, 1)};
    FLYBALL_TRY(loop.regulator,
                told_of("controller.delay", predicting_regulator(believed, plant.period, loop.K,
                                                                 loop.kalman_gain, delay)));
  }
  return loop;
}

namespace {

bool has_comfortable_margins(const StabilityMargins& margins) {
  return margins.stable && margins.gain_margin_up >= 2.0 && margins.phase_margin >= 45.0 &&
         margins.disk_margin >= 0.5;
}

// How far a loop is judged: one without comfortable margins needs no grid where it is then dropped.
enum class Judged { whole, while_comfortable };

/// Margins of the loop with its delay, the worst over what the plant may be, and the grid.
Expected<void> judge(LoopDesign& loop, const LinearModel& model, const DesignJob& job,
                     Judged judged) {
  const auto& [believed, K, K_e] = loop.regulator;
  const Time delay(job.controller.delay.value_or(0.0));
  FLYBALL_TRY(const auto plants, possible_plants(model, job.plant));
  const bool determined = job.plant.kA_determined;
  for (const PossiblePlant& plant : plants) {
    const ContinuousSystem<>& truth = plant.system;
    FLYBALL_TRY(const auto opened,
                observer_regulator_loop(truth.A, truth.B, truth.C, believed, K, K_e, delay));
    FLYBALL_TRY(auto margins, stability_margins(opened));
    const bool first = &plant == &plants.front();
    loop.stable = first ? margins.stable : loop.stable;
    loop.margins = first ? std::move(margins) : worse(loop.margins, margins);
    if (judged == Judged::while_comfortable && !has_comfortable_margins(loop.margins)) {
      return {};
    }
    const auto add_grid = [&](double delay_factor, const RobustnessOptions& options) {
      return robustness_grid(truth.A, truth.B, truth.C, believed, K, K_e,
                             Time(delay_factor * delay.si()), options)
          .map([&](const RobustnessGrid& grid) {
            for (const RobustnessCase& point : grid.cases) {
              loop.robustness.push_back({.inertia_factor = determined ? point.inertia : NAN,
                                         .kA = plant.kA * point.inertia,
                                         .gain_factor = point.gain,
                                         .delay_factor = delay_factor,
                                         .stable = point.stable,
                                         .spectral_radius = point.spectral_radius,
                                         .overshoot = point.overshoot});
            }
            loop.robust = loop.robust && grid.all_stable;
            loop.worst_overshoot = std::max(loop.worst_overshoot, grid.worst_overshoot);
          });
    };
    RobustnessOptions options;
    if (!determined) {
      options.inertia = {1.0};  // it is the plant's own
    }
    FLYBALL_CHECK(add_grid(1.0, options));
    if (loop.predicts) {
      // A prediction over the wrong time is what such a loop is sensitive to.
      for (const double factor : {0.75, 1.25}) {
        FLYBALL_CHECK(add_grid(factor, {.inertia = {1.0}, .gain = {1.0}}));
      }
    }
  }
  return {};
}

}  // namespace

Expected<LoopDesign> design_loop(const LinearModel& model, const DesignJob& job,
                                 const std::vector<double>& tolerances) {
  FLYBALL_TRY(auto loop, feedback_of(model, job, tolerances));
  FLYBALL_CHECK(judge(loop, model, job, Judged::whole));
  return loop;
}

std::string tolerances_text(const LinearModel& model, const std::vector<double>& tolerances) {
  std::vector<std::string> words;
  for (std::size_t k = 0; k < tolerances.size(); ++k) {
    words.push_back(
        fmt::format("{} for {}", format_number(tolerances[k], 3), label(model.states[k])));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

// The tightest comfortable ones may not be the best: the compensation of a long delay (B.12) turns
// an aggressive gain into nearly none. So the largest gain that is left is tried first; where the
// delay is predicted, that is the tightest tolerances'.
Expected<LoopDesign> search_tolerances(const LinearModel& model, const DesignJob& job,
                                       std::vector<double>& tolerances) {
  const std::vector<double> start =
      default_tolerances(job.plant, static_cast<std::size_t>(model.A.rows()));
  constexpr int steps = 40;
  constexpr double step = 1.25;
  std::vector<LoopDesign> tried;
  std::optional<Error> last;
  double factor = 1.0;
  for (int i = 0; i < steps; ++i, factor *= step) {
    std::vector<double> looser = start;
    for (double& tolerance : looser) {
      tolerance *= factor;
    }
    if (auto loop = feedback_of(model, job, looser)) {
      tried.push_back(*std::move(loop));
    } else {
      last = std::move(loop).error();
    }
  }
  std::ranges::stable_sort(tried, std::ranges::greater{},
                           [](const LoopDesign& loop) { return loop.K_delayed(0, 0); });
  for (LoopDesign& loop : tried) {
    if (auto done = judge(loop, model, job, Judged::while_comfortable); !done) {
      last = std::move(done).error();
    } else if (is_comfortable(loop)) {
      tolerances = loop.tolerances;
      return std::move(loop);
    }
  }
  if (last) {
    return tl::unexpected(*std::move(last));
  }
  return refusal(DesignError::margins_lost, "design", "the loop")
      .got(fmt::format("without margins at any tolerance with a delay of {} ms",
                       format_number(1e3 * job.controller.delay.value_or(0.0), 3)))
      .hint("shorten the delay or the period");
}

bool is_comfortable(const LoopDesign& loop) {
  return has_comfortable_margins(loop.margins) && loop.robust &&
         (!loop.predicts || loop.worst_overshoot <= 0.25);
}

}  // namespace flyball::study
