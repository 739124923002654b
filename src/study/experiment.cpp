#include <flyball/study/experiment.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <flyball/core/argument.hpp>
#include <flyball/identification/repeatability.hpp>
#include <flyball/simulation/characterization.hpp>
#include <flyball/study/tune.hpp>

#include "core/constants.hpp"
#include "core/diagnose.hpp"
#include "core/try.hpp"

namespace flyball::study {

namespace {

using identification::FeedforwardFit;
using identification::GainEstimate;
using identification::Recording;
using mechanisms::MechanismKind;

constexpr std::string_view in_plan_experiment = "plan_experiment";
constexpr double least_voltage = 0.5;  ///< V, of a step beyond friction and gravity.
constexpr int most_repeats = 6;
constexpr double usual_friction = 0.15;  ///< V, of a mechanism of which none is known.

/// What is chosen.
struct Choice {
  double ramp_rate;
  double step_voltage;
};

/// The four tests of a choice, as many times as there is time for.
struct Trial {
  Choice choice{};
  int repeats = 1;
  double one = 0.0;  ///< s, of the four tests.
  double score = infinity;
};

bool travels(const ExperimentJob& job) {
  return !controls_velocity(job.plant.kind);
}

/// kA that is simulated: half of its bound where it is not known.
double inertia(const PlantDescription& plant) {
  return plant.kA_determined ? plant.gains.kA : 0.5 * plant.kA_upper_bound;
}

CharacterizationOptions session_of(const ExperimentJob& job, const Choice& choice,
                                   unsigned long long seed) {
  const PlantDescription& plant = job.plant;
  CharacterizationOptions session;
  session.mechanism = plant.kind;
  session.kS = plant.gains.kS;
  session.kV = plant.gains.kV;
  session.kA = inertia(plant);
  session.kG = plant.gains.kG;
  session.angle_offset = plant.gains.angle_offset;
  session.ramp_rate = choice.ramp_rate;
  session.step_voltage = choice.step_voltage;
  session.ramp_limit = job.limits.voltage;
  // Long enough to reach its speed; a short travel ends it before.
  session.step_duration = std::clamp(8.0 * session.kA / session.kV, 1.0, 5.0);
  if (travels(job)) {
    session.travel_low = *job.limits.travel_low + plant.gains.angle_offset;
    session.travel_high = *job.limits.travel_high + plant.gains.angle_offset;
    session.travel_margin = 0.05 * (session.travel_high - session.travel_low);
  }
  session.row_period = job.sensor.row_period;
  session.sensor_refresh = std::max(job.sensor.refresh, job.sensor.row_period);
  session.sensor_delay = job.sensor.delay;
  session.resolution = job.sensor.resolution;
  session.velocity_window = job.sensor.velocity_window;
  session.velocity_noise = job.sensor.velocity_noise ? *job.sensor.velocity_noise
                                                     : 0.005 * job.limits.voltage / plant.gains.kV;
  session.seed = seed;
  return session;
}

double duration_of(const Recording& recording) {
  double sum = 0.0;
  for (const identification::TestRun& run : recording.runs) {
    sum += run.time.empty() ? 0.0 : run.time.back() - run.time.front();
  }
  return sum;
}

std::vector<GainForecast> forecasts(const FeedforwardFit& fit) {
  std::vector<GainForecast> gains;
  const auto add = [&](const char* name, std::string unit, const GainEstimate& gain, double share,
                       double least) {
    GainForecast& forecast = gains.emplace_back();
    forecast.name = name;
    forecast.unit = std::move(unit);
    forecast.value = gain.value;
    forecast.determined = gain.determined;
    forecast.half_width = gain.determined ? 0.5 * (gain.interval[1] - gain.interval[0])
                                          : std::max(gain.upper_bound, std::abs(gain.value));
    forecast.wanted = std::max(share * std::abs(gain.value), least);
  };
  add("kS", "V", fit.kS, 0.1, 0.02);
  add("kV", "V·s/" + fit.unit, fit.kV, 0.009, 0.0);
  add("kA", "V·s²/" + fit.unit, fit.kA, 0.05, 0.0);
  if (fit.kG) {
    add("kG", "V", *fit.kG, 0.025, 0.02);
  }
  return gains;
}

/// The worst of the gains that are determined; first of all as many as possible are.
double score_of(const std::vector<GainForecast>& gains) {
  constexpr double undetermined = 1e6;
  double worst = 0.0;
  double missing = 0.0;
  for (const GainForecast& gain : gains) {
    missing += gain.determined ? 0.0 : undetermined;
    worst = gain.determined ? std::max(worst, gain.half_width / gain.wanted) : worst;
  }
  return missing + worst;
}

/// All repeats of a choice, each with other noise, as one recording.
Expected<Recording> repeated(const ExperimentJob& job, const Choice& choice, int repeats,
                             unsigned long long seed) {
  std::vector<Recording> recordings;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    FLYBALL_TRY(auto recording, record_characterization(session_of(
                                    job, choice, seed + static_cast<unsigned long long>(repeat))));
    recordings.push_back(std::move(recording));
  }
  return identification::joined(recordings);
}

/// The score of a choice, by the simulated log of all of its repeats; infinity where it does not
/// fit the limits.
Trial try_choice(const ExperimentJob& job, const Choice& choice, unsigned long long seed) {
  Trial trial{.choice = choice};
  const auto one = repeated(job, choice, 1, seed);
  if (!one) {
    return trial;
  }
  trial.one = duration_of(*one);
  if (!(trial.one > 0.0) || trial.one > job.limits.duration) {
    return trial;
  }
  trial.repeats = std::min(most_repeats, static_cast<int>(job.limits.duration / trial.one));
  const auto all = repeated(job, choice, trial.repeats, seed);
  if (!all) {
    return trial;
  }
  if (const auto fit = identification::fit_feedforward(*all)) {
    trial.score = score_of(forecasts(*fit));
  }
  return trial;
}

double median_score(const ExperimentJob& job, const Choice& choice) {
  std::array<double, 3> scores{};
  for (std::size_t i = 0; i < scores.size(); ++i) {
    scores[i] = try_choice(job, choice, job.seed + 100 * (i + 1)).score;
  }
  std::sort(scores.begin(), scores.end());
  return scores[1];
}

PlannedTest planned(const identification::TestRun& run, double kV, double ramp_rate) {
  PlannedTest test{.kind = run.kind, .ramp_rate = is_quasistatic(run.kind) ? ramp_rate : 0.0};
  double travel_low = infinity;
  double travel_high = -infinity;
  std::size_t last = 0;
  for (std::size_t i = 0; i < run.time.size(); ++i) {
    travel_low = std::min(travel_low, run.position[i]);
    travel_high = std::max(travel_high, run.position[i]);
    test.top_speed = std::max(test.top_speed, std::abs(run.velocity[i]));
    if (std::abs(run.voltage[i]) > std::abs(test.voltage)) {
      test.voltage = run.voltage[i];
    }
    last = std::abs(run.voltage[i]) > 0.2 * std::abs(test.voltage) ? i : last;
  }
  test.top_speed = std::min(test.top_speed, std::abs(test.voltage) / kV);
  test.duration = run.time[last] - run.time.front();
  test.travel = travel_high - travel_low;
  return test;
}

/// What all repeats of a choice tell together: simulated, each with other noise, and fitted.
Expected<Experiment> carry_out(const ExperimentJob& job, const Choice& choice) {
  CharacterizationOptions quiet = session_of(job, choice, job.seed);
  quiet.velocity_noise = 0.0;
  quiet.voltage_noise = 0.0;
  FLYBALL_TRY(const auto shown, record_characterization(quiet));
  Experiment experiment;
  for (const identification::TestRun& run : shown.runs) {
    if (!run.time.empty()) {
      experiment.tests.push_back(planned(run, job.plant.gains.kV, choice.ramp_rate));
    }
  }
  const double one = duration_of(shown);
  experiment.repeats = std::clamp(static_cast<int>(job.limits.duration / one), 1, most_repeats);
  experiment.duration = one * experiment.repeats;
  FLYBALL_TRY(const auto all, repeated(job, choice, experiment.repeats, job.seed));
  experiment.score = infinity;
  if (const auto fit = identification::fit_feedforward(all)) {
    experiment.gains = forecasts(*fit);
    experiment.score = score_of(experiment.gains);
  }
  return experiment;
}

Expected<void> check_job(const ExperimentJob& job) {
  const ExperimentLimits& limits = job.limits;
  FLYBALL_CHECK(Checks(in_plan_experiment)
                    .positive(job.plant.gains.kV, "kV")
                    .positive(inertia(job.plant), "kA")
                    .positive(limits.voltage, "voltage", "V")
                    .positive(limits.duration, "duration", "s"));
  const double needed = job.plant.gains.kS + std::abs(job.plant.gains.kG) + least_voltage;
  if (limits.voltage < needed) {
    return refusal(ArgumentError::out_of_range, in_plan_experiment, "the voltage")
        .got(format_number(limits.voltage) + " V")
        .expected("at least " + format_number(needed, 3) +
                  " V: friction, gravity and half a volt to move with");
  }
  if (!travels(job)) {
    return {};
  }
  if (!limits.travel_low || !limits.travel_high) {
    return refusal(ArgumentError::out_of_range, in_plan_experiment, "the travel")
        .got("not said")
        .expected("both ends of it: --travel-low and --travel-high");
  }
  if (!(*limits.travel_low < *limits.travel_high)) {
    return refusal(ArgumentError::out_of_range, in_plan_experiment, "the travel")
        .got(format_number(*limits.travel_low) + " to " + format_number(*limits.travel_high) + " " +
             job.plant.unit)
        .expected("from its lower to its higher end");
  }
  return {};
}

}  // namespace

ExperimentJob experiment_after(const IdentifyResult& result, const ExperimentLimits& limits) {
  ExperimentJob job{.plant = {}, .limits = limits, .sensor = {}};
  if (!result.report.fit) {
    return job;
  }
  const FeedforwardFit& fit = *result.report.fit;
  const identification::PreparedRecording& data = result.report.prepared;
  job.plant = plant_from_fit(fit);
  job.log = fit;
  job.log->runs.clear();
  double low = infinity;
  double high = -infinity;
  for (const identification::PreparedRun& run : data.runs) {
    for (const double position : run.run.position) {
      low = std::min(low, position);
      high = std::max(high, position);
    }
  }
  if (low < high) {
    job.limits.travel_low = limits.travel_low.value_or(low);
    job.limits.travel_high = limits.travel_high.value_or(high);
  }
  if (data.row_period > 0.0) {
    job.sensor.row_period = data.row_period;
    job.sensor.refresh = std::max({data.row_period, data.position_refresh_period,
                                   data.has_velocity ? data.velocity_refresh_period : 0.0});
  }
  job.sensor.delay = std::max(0.0, data.has_position ? fit.position_delay : fit.velocity_delay);
  job.sensor.resolution = data.position_quantum;
  job.sensor.velocity_window = fit.averaging_width;
  job.sensor.velocity_noise = fit.velocity_noise;
  return job;
}

Expected<ExperimentResult> plan_experiment(const ExperimentJob& given) {
  ExperimentJob job = given;
  if (job.plant.gains.kS <= 0.0) {
    job.plant.gains.kS = usual_friction;
  }
  FLYBALL_CHECK(check_job(job));
  const double most = job.limits.voltage;
  const double least =
      std::max(job.plant.gains.kS + std::abs(job.plant.gains.kG) + least_voltage, 0.15 * most);
  const Choice usual{1.0, std::clamp(7.0, least, most)};
  std::vector<Trial> trials{try_choice(job, usual, job.seed)};
  for (const double rate : {0.1, 0.2, 0.5, 1.0, 2.0, 4.0}) {
    for (const double share : {0.0, 0.35, 0.65, 1.0}) {
      trials.push_back(try_choice(job, {rate, least + share * (most - least)}, job.seed));
    }
  }
  std::sort(trials.begin(), trials.end(),
            [](const Trial& a, const Trial& b) { return a.score < b.score; });
  if (!std::isfinite(trials.front().score)) {
    const auto shortest =
        std::min_element(trials.begin(), trials.end(), [](const Trial& a, const Trial& b) {
          return (a.one > 0.0 ? a.one : infinity) < (b.one > 0.0 ? b.one : infinity);
        });
    return refusal(ArgumentError::out_of_range, in_plan_experiment, "the limits")
        .got("such that no test that was tried tells the gains")
        .expected(shortest->one > job.limits.duration
                      ? "a duration of at least " + format_number(std::ceil(shortest->one)) +
                            " s, which the shortest four tests take"
                      : "more travel or more voltage");
  }
  // One log of each is a rough measure: the best few are looked at again.
  constexpr std::size_t few = 4;
  Choice chosen = trials.front().choice;
  double best = infinity;
  for (std::size_t i = 0; i < few && std::isfinite(trials[i].score); ++i) {
    if (const double score = median_score(job, trials[i].choice); score < best) {
      best = score;
      chosen = trials[i].choice;
    }
  }
  ExperimentResult result{.job = job, .best = {}, .usual = {}};
  if (given.plant.gains.kS <= 0.0) {
    note(result.diagnostics, "assumed",
         "kS is not known; it was taken to be {} V, as of a mechanism that moves easily",
         usual_friction);
  }
  FLYBALL_TRY(result.best, carry_out(job, chosen));
  FLYBALL_TRY(result.usual, carry_out(job, usual));
  if (!job.plant.kA_determined) {
    note(result.diagnostics, "assumed",
         "kA is not known; it was taken to be {:.3g} V·s²/{}, half of its upper bound",
         inertia(job.plant), job.plant.unit);
  }
  return result;
}

}  // namespace flyball::study
