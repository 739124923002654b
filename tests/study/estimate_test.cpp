// A project's [estimate]: a model's states from a log.
#include <flyball/study/estimate.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/core/random.hpp>
#include <flyball/io/csv.hpp>
#include <flyball/io/wpilog.hpp>
#include <flyball/math/probability/truncated_normal.hpp>

namespace flyball::study::estimate_test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// A pendulum: θ'' = -k sin θ - d θ' + u/J, k = 20, d = 0.2, J = 0.5.
std::string swing(const std::string& estimate) {
  return "[model]\nname = \"swing\"\nstates = { theta = \"rad\", omega = \"rad/s\" }\n"
         "inputs = { u = \"N m\" }\n"
         "parameters = { k = \"20 1/s^2\", d = \"0.2 1/s\", J = \"0.5 kg m^2\" }\n"
         "[model.derivative]\ntheta = \"omega\"\nomega = \"-k*sin(theta) - d*omega + u/J\"\n"
         "[model.outputs]\nangle = \"theta\"\n" +
         estimate;
}

const char* const noises =
    "[estimate]\nprocess_noise = { omega = \"0.3 rad/s\" }\n"
    "measurement_noise = { angle = \"0.02 rad\" }\ninitial = { theta = \"0.5 rad\" }\n"
    "initial_std = { theta = \"0.3 rad\", omega = \"1 rad/s\" }\n";

struct Swing {
  Log log;
  std::vector<double> theta{}, omega{};
};

/// What the pendulum with those noises does, from a state drawn from the start's distribution.
Swing swing_log(int samples = 1500, unsigned long long seed = 5, double rho = 0.02) {
  Random random(seed);
  Swing made;
  made.log.source = "swing.csv";
  Signal u{"u", "N m", {}, {}};
  Signal angle{"angle", "rad", {}, {}};
  constexpr double dt = 0.01;
  constexpr int fine = 20;
  double theta = 0.5 + 0.3 * random.normal();
  double omega = random.normal();
  for (int k = 0; k < samples; ++k) {
    const double torque = k / 100 % 2 == 0 ? 1.0 : -1.0;
    u.time.push_back(dt * k);
    u.value.push_back(torque);
    angle.time.push_back(dt * k);
    angle.value.push_back(theta + rho * random.normal());
    made.theta.push_back(theta);
    made.omega.push_back(omega);
    for (int i = 0; i < fine; ++i) {  // symplectic Euler and Euler-Maruyama
      constexpr double h = dt / fine;
      omega += h * (-20.0 * std::sin(theta) - 0.2 * omega + torque / 0.5) +
               0.3 * std::sqrt(h) * random.normal();
      theta += h * omega;
    }
  }
  made.log.signals = {u, angle};
  return made;
}

Project project_of(const std::string& text) {
  const auto project = parse_project(text, "swing.toml");
  EXPECT_TRUE(project) << (project ? "" : to_string(project.error()));
  return project.value_or(Project{});
}

Estimation estimated(const Log& log, const std::string& text) {
  auto result = estimate(log, project_of(text));
  EXPECT_TRUE(result) << (result ? "" : to_string(result.error()));
  return result ? *std::move(result) : Estimation(project_of(text).model_job->model);
}

std::string refusal(const Log& log, const std::string& text) {
  const auto result = estimate(log, project_of(text));
  return result ? "accepted" : to_string(result.error());
}

bool tells(const Estimation& result, std::string_view code) {
  return std::any_of(result.diagnostics.begin(), result.diagnostics.end(),
                     [&](const Diagnostic& one) { return one.code == code; });
}

/// Σ ((x - x̂)/σ)²/N and the rms error of a state.
struct Errors {
  double normalized = 0.0;
  double rms = 0.0;
};
Errors errors_of(const std::vector<double>& truth, const Eigen::MatrixXd& x,
                 const Eigen::MatrixXd& std, Eigen::Index state) {
  Errors errors;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    const double error = x(state, at) - truth[k];
    errors.rms += error * error / static_cast<double>(truth.size());
    errors.normalized += std::pow(error / std(state, at), 2.0) / static_cast<double>(truth.size());
  }
  errors.rms = std::sqrt(errors.rms);
  return errors;
}

// Errors in the model's own noises are as large as the estimate says; the smoother's are smaller.
// The errors of 15 s are correlated over about 0.2 s: 75 independent ones, variance within 50 %.
TEST(Estimate, TheErrorsAreAsLargeAsTheySay) {
  const Swing swing_of = swing_log();
  for (const char* filter : {"extended", "unscented"}) {
    const Estimation result =
        estimated(swing_of.log, swing(std::string(noises) + "filter = \"" + filter + "\"\n"));
    ASSERT_EQ(result.runs.size(), 1U);
    const EstimatedRun& run = result.runs[0];
    for (const Eigen::Index state : {0, 1}) {
      const std::vector<double>& truth = state == 0 ? swing_of.theta : swing_of.omega;
      const Errors filtered = errors_of(truth, run.filtered, run.filtered_std, state);
      const Errors smoothed = errors_of(truth, run.smoothed, run.smoothed_std, state);
      EXPECT_NEAR(filtered.normalized, 1.0, 0.5) << filter << state;
      EXPECT_NEAR(smoothed.normalized, 1.0, 0.5) << filter << state;
      EXPECT_LT(smoothed.rms, 0.8 * filtered.rms) << filter << state;
    }
    EXPECT_TRUE(result.nis.passed()) << result.nis.mean;
    EXPECT_EQ(result.nis.readings, 1500);
    EXPECT_NEAR(result.nis.within, 0.95, 0.02);
    EXPECT_TRUE(result.whiteness[0].is_white()) << result.whiteness[0].p_value;
    EXPECT_TRUE(result.diagnostics.empty()) << result.diagnostics.front().message;
    // At the last sample nothing is after it.
    EXPECT_NEAR(run.smoothed(1, 1499), run.filtered(1, 1499), 1e-12);
  }
}

TEST(Estimate, WrongNoisesAreSeenAndFound) {
  const Swing swing_of = swing_log(2000);
  const std::string wrong =
      "[estimate]\nprocess_noise = { omega = \"2 rad/s\" }\n"
      "measurement_noise = { angle = \"0.2 rad\" }\ninitial = { theta = \"0.5 rad\" }\n"
      "initial_std = { theta = \"0.3 rad\", omega = \"1 rad/s\" }\n";
  const Estimation before = estimated(swing_of.log, swing(wrong));
  EXPECT_FALSE(before.nis.passed());
  EXPECT_TRUE(tells(before, "innovations_too_small"));
  const Estimation result = estimated(swing_of.log, swing(wrong + "tune = true\n"));
  ASSERT_TRUE(result.tuned);
  EXPECT_TRUE(result.tuned->converged);
  EXPECT_FALSE(tells(result, "no_convergence"));
  EXPECT_TRUE(result.nis.passed()) << result.nis.mean;
  EXPECT_GT(result.log_likelihood, before.log_likelihood);
  const NoiseDeviation& process = result.tuned->process[0];
  const NoiseDeviation& measurement = result.tuned->measurement[0];
  EXPECT_NEAR(std::log(process.value / 0.3), 0.0, 3.0 * process.relative_error);
  EXPECT_NEAR(std::log(measurement.value / 0.02), 0.0, 3.0 * measurement.relative_error);
  EXPECT_LT(process.relative_error, 0.2);
  EXPECT_LT(measurement.relative_error, 0.03);
  EXPECT_EQ(result.settings.process_noise(1), process.value);
  // No other noise near it makes the filter's own likelihood, of the nonlinear model, larger by
  // more than the linearisation about the smoothed path errs.
  for (const double factor : {0.8, 1.25}) {
    const Estimation other = estimated(
        swing_of.log,
        swing("[estimate]\nprocess_noise = { omega = \"" + std::to_string(factor * process.value) +
              " rad/s\" }\nmeasurement_noise = { angle = \"" + std::to_string(measurement.value) +
              " rad\" }\ninitial = { theta = \"0.5 rad\" }\n"
              "initial_std = { theta = \"0.3 rad\", omega = \"1 rad/s\" }\n"));
    EXPECT_LT(other.log_likelihood, result.log_likelihood);
  }
}

TEST(Estimate, ReadingsMayBeMissingAndTheTimeMayJump) {
  Swing swing_of = swing_log(1000);
  Signal& angle = swing_of.log.signals[1];
  for (std::size_t k = 200; k < 250; ++k) {
    angle.value[k] = nan;
  }
  for (std::size_t k = 600; k < 1000; ++k) {
    angle.time[k] += 10.0;
    swing_of.log.signals[0].time[k] += 10.0;
  }
  const Estimation result = estimated(swing_of.log, swing(noises));
  ASSERT_EQ(result.runs.size(), 2U);
  EXPECT_EQ(result.runs[1].name, "run 2");
  const EstimatedRun& run = result.runs[0];
  EXPECT_TRUE(tells(result, "missing_readings"));
  EXPECT_EQ(result.nis.readings, 950);
  EXPECT_TRUE(std::isnan(run.nis[220]) && std::isnan(run.innovations(0, 220)));
  // Without a reading the filter knows less and less; the smoother knows the other end.
  EXPECT_GT(run.filtered_std(0, 249), 2.0 * run.filtered_std(0, 199));
  EXPECT_LT(run.smoothed_std(0, 249), run.filtered_std(0, 249));
  EXPECT_LT(std::abs(run.smoothed(0, 225) - swing_of.theta[225]), 4.0 * run.smoothed_std(0, 225));
}

// A reading that is not there is the same as one that is not a number, as long as other channels
// go on.
TEST(Estimate, ChannelsGoOnWithoutEachOther) {
  Swing swing_of = swing_log(500);
  Log blank = swing_of.log;
  Signal& angle = blank.signals[1];
  angle.time.erase(angle.time.begin() + 200, angle.time.begin() + 250);
  angle.value.erase(angle.value.begin() + 200, angle.value.begin() + 250);
  for (std::size_t k = 200; k < 250; ++k) {
    swing_of.log.signals[1].value[k] = nan;
  }
  const Estimation one = estimated(swing_of.log, swing(noises));
  const Estimation other = estimated(blank, swing(noises));
  ASSERT_EQ(other.runs.size(), 1U);
  EXPECT_EQ(other.runs[0].smoothed, one.runs[0].smoothed);
  EXPECT_TRUE(tells(other, "missing_readings"));
}

TEST(Estimate, OutputsMayHaveTimesOfTheirOwn) {
  Swing swing_of = swing_log(1000);
  Signal rate{"rate", "rad/s", {}, {}};
  Random random(3);
  for (std::size_t k = 7; k < 1000; k += 10) {
    rate.time.push_back(0.01 * static_cast<double>(k) + 0.004);
    rate.value.push_back(swing_of.omega[k] + 0.01 * random.normal());
  }
  swing_of.log.signals.push_back(rate);
  std::string text = swing(noises);
  text.replace(text.find("angle = \"theta\"\n"), 16, "angle = \"theta\"\nrate = \"omega\"\n");
  text.replace(text.find("{ angle ="), 2, "{ rate = \"0.1 rad/s\", ");
  const Estimation both = estimated(swing_of.log, text);
  EXPECT_EQ(both.runs[0].time.size(), 1100U);
  EXPECT_EQ(both.nis.readings, 1100);
  const Estimation one = estimated(swing_of.log, swing(noises));
  EXPECT_LT(both.runs[0].filtered_std.row(1).mean(), 0.9 * one.runs[0].filtered_std.row(1).mean());
}

TEST(Estimate, OutliersCountForLess) {
  Swing swing_of = swing_log(1000);
  for (std::size_t k = 50; k < 1000; k += 50) {
    swing_of.log.signals[1].value[k] += 1.0;
  }
  const auto error = [&](const Estimation& result) {
    return errors_of(swing_of.theta, result.runs[0].filtered, result.runs[0].filtered_std, 0).rms;
  };
  const Estimation naive = estimated(swing_of.log, swing(noises));
  EXPECT_TRUE(tells(naive, "innovations_too_large"));
  for (const std::string treatment : {"gate", "huber", "student"}) {
    const Estimation result =
        estimated(swing_of.log, swing(noises + ("outliers = \"" + treatment + "\"\n")));
    EXPECT_LT(error(result), 0.4 * error(naive)) << treatment;
    EXPECT_TRUE(tells(result, "outliers")) << treatment;
    EXPECT_LT(result.runs[0].weight[100], 0.1);
  }
}

TEST(Estimate, WhatNoReadingShowsIsTold) {
  std::string text = swing(noises);
  text.replace(text.find("omega = \"rad/s\" }"), 17,
               "omega = \"rad/s\", b = \"rad\", c = \"rad\" }");
  text.replace(text.find("[model.outputs]"), 15, "b = \"0\"\nc = \"-d*c\"\n[model.outputs]");
  const Estimation result = estimated(swing_log(300).log, text);
  const auto told = std::find_if(result.diagnostics.begin(), result.diagnostics.end(),
                                 [](const auto& one) { return one.code == "not_observed"; });
  ASSERT_NE(told, result.diagnostics.end());
  EXPECT_NE(told->message.find(" b"), std::string::npos) << told->message;
  EXPECT_EQ(told->message.find("theta"), std::string::npos) << told->message;
  EXPECT_EQ(told->message.find("omega"), std::string::npos) << told->message;
}

TEST(Estimate, WithoutProcessNoiseAndWithoutASmoother) {
  const Estimation result = estimated(
      swing_log(300).log, swing("[estimate]\nmeasurement_noise = { angle = \"0.02 rad\" }\n"
                                "smoother = false\n"));
  EXPECT_TRUE(tells(result, "no_process_noise"));
  EXPECT_EQ(result.runs[0].smoothed.size(), 0);
  EXPECT_EQ(result.runs[0].filtered.cols(), 300);
  // A state that is known at the start, and no noise: it stays known.
  const Estimation known = estimated(
      swing_log(300).log, swing("[estimate]\nmeasurement_noise = { angle = \"0.02 rad\" }\n"
                                "initial_std = { theta = \"0 rad\", omega = \"0 rad/s\" }\n"));
  EXPECT_LT(known.runs[0].filtered_std.maxCoeff(), 1e-90);  // the filter keeps P > 0
  EXPECT_LT(known.runs[0].smoothed_std.maxCoeff(), 1e-90);
}

// Steps of 0.2 s are long against 20/s: the model is stepped in between.
TEST(Estimate, AFastModelIsSteppedOften) {
  Swing swing_of = swing_log(2000);
  for (Signal& signal : swing_of.log.signals) {
    Signal sparse{signal.name, signal.unit, {}, {}};
    for (std::size_t k = 0; k < 2000; k += 20) {
      sparse.time.push_back(signal.time[k]);
      sparse.value.push_back(signal.value[k]);
    }
    signal = sparse;
  }
  const Estimation result = estimated(swing_of.log, swing(noises));
  EXPECT_TRUE(result.nis.passed()) << result.nis.mean;
  EXPECT_FALSE(tells(result, "stiff"));
}

TEST(Estimate, RefusalsSayTheMend) {
  const Log log = swing_log(100).log;
  EXPECT_EQ(
      refusal(log, swing("")),
      "estimate: estimate.measurement_noise.angle is not said; it must be the standard "
      "deviation of a reading; write [estimate] measurement_noise = { angle = \"0.01 rad\" }; "
      "--tune-noise finds the size from there");
  Log other = log;
  other.signals[1].name = "angel";
  const std::string told = refusal(other, swing(noises));
  EXPECT_NE(told.find("\"angle\" is not a channel of the log; did you mean \"angel\"? Or say it in "
                      "[fit]: channels = { angle ="),
            std::string::npos)
      << told;
  Log one = log;
  for (Signal& signal : one.signals) {
    signal.time.resize(1);
    signal.value.resize(1);
  }
  EXPECT_NE(refusal(one, swing(noises)).find("is 1 sample of angle; it must be two samples"),
            std::string::npos);
  EXPECT_EQ(to_string(estimate(log, Project{}).error()),
            "estimate: the project is without a [model]");
  EXPECT_NE(refusal(log, swing(noises + std::string("tune = true\n[fit]\nto = \"-1 s\"\n")))
                .find("0 samples of angle"),
            std::string::npos);
}

// A lift in free coasting that rests on its stop, read with much noise: with the stop known, no
// estimate is below it, and the errors are smaller. Where the estimate is inside, the one that is
// told is its Gaussian cut off, of the same recursion.
TEST(Estimate, LimitsOfStatesAreKept) {
  const std::string lift =
      "[model]\nstates = { height = \"m\" }\ninputs = { v = \"m/s\" }\n"
      "[model.derivative]\nheight = \"v\"\n[model.outputs]\nread = \"height\"\n"
      "[estimate]\nprocess_noise = { height = \"0.02 m\" }\n"
      "measurement_noise = { read = \"0.1 m\" }\ninitial = { height = \"0.1 m\" }\n"
      "initial_std = { height = \"0.1 m\" }\n";
  Random random(11);
  Log log;
  log.source = "lift.csv";
  Signal v{"v", "m/s", {}, {}};
  Signal read{"read", "m", {}, {}};
  for (int k = 0; k < 400; ++k) {
    v.time.push_back(0.02 * k);
    v.value.push_back(0.0);
    read.time.push_back(0.02 * k);
    read.value.push_back(0.1 * random.normal());
  }
  log.signals = {v, read};
  for (const std::string filter : {"extended", "unscented"}) {
    const std::string base = lift + "filter = \"" + filter + "\"\n";
    const Estimation without = estimated(log, base);
    const Estimation with = estimated(log, base + "lower_limit = { height = \"0 m\" }\n");
    ASSERT_EQ(with.runs.size(), 1U);
    const EstimatedRun& free = without.runs[0];
    const EstimatedRun& kept = with.runs[0];
    EXPECT_LT(free.filtered.minCoeff(), 0.0);
    EXPECT_GE(kept.filtered.minCoeff(), 0.0);
    EXPECT_GE(kept.smoothed.minCoeff(), 0.0);
    EXPECT_TRUE(tells(with, "at_a_limit"));
    EXPECT_FALSE(tells(without, "at_a_limit"));
    for (const Eigen::Index k : {Eigen::Index(0), Eigen::Index(1)}) {
      ASSERT_GT(free.filtered(0, k), 0.0);  // until then both recursions are the same
      const double sigma = free.filtered_std(0, k);
      const Moments cut = truncated_normal(free.filtered(0, k), sigma * sigma, 0.0, 1e300);
      EXPECT_NEAR(kept.filtered(0, k), cut.mean, 1e-12);
      EXPECT_NEAR(kept.filtered_std(0, k), std::sqrt(cut.variance), 1e-12);
    }
    // At the stop itself the mean of a Gaussian cut there is above it by 0.8 σ and its rms less.
    const std::vector<double> truth(400, 0.0);
    EXPECT_LT(errors_of(truth, kept.smoothed, kept.smoothed_std, 0).normalized, 3.0);
  }
  const auto wide = lift + "upper_limit = { height = \"9 m\" }\n";
  const auto open = estimated(log, lift);
  EXPECT_LT((estimated(log, wide).runs[0].smoothed - open.runs[0].smoothed).cwiseAbs().maxCoeff(),
            1e-15);
}

// Down against the stop for two seconds, up for one, and readings that tell nothing: a height that
// had gone on below the stop would come back to it at the end, where the lift is 1 m above.
TEST(Estimate, AStopStopsWhatTheFilterCarriesOn) {
  Log log;
  log.source = "lift.csv";
  Signal v{"v", "m/s", {}, {}};
  Signal read{"read", "m", {}, {}};
  for (int k = 0; k <= 300; ++k) {
    v.time.push_back(0.01 * k);
    v.value.push_back(k < 200 ? -1.0 : 1.0);
    read.time.push_back(0.01 * k);
    read.value.push_back(0.0);
  }
  log.signals = {v, read};
  const std::string lift =
      "[model]\nstates = { height = \"m\" }\ninputs = { v = \"m/s\" }\n"
      "[model.derivative]\nheight = \"v\"\n[model.outputs]\nread = \"height\"\n"
      "[estimate]\nsmoother = false\nmeasurement_noise = { read = \"1000 m\" }\n"
      "initial = { height = \"0.1 m\" }\ninitial_std = { height = \"0.01 m\" }\n";
  const Estimation kept = estimated(log, lift + "lower_limit = { height = \"0 m\" }\n");
  const Estimation lost = estimated(log, lift);
  EXPECT_NEAR(kept.runs[0].filtered(0, 300), 1.0, 0.05);
  EXPECT_NEAR(lost.runs[0].filtered(0, 300), -0.9, 0.05);
}

TEST(Estimate, WrongLimitsAreTold) {
  const auto told = [](const std::string& limits) {
    const auto project = parse_project(swing(std::string(noises) + limits), "swing.toml");
    return project ? std::string("accepted") : to_string(project.error());
  };
  EXPECT_NE(told("lower_limit = { theta = \"1 rad\" }\nupper_limit = { theta = \"-1 rad\" }\n")
                .find("above lower_limit"),
            std::string::npos);
  const std::string outside = told("upper_limit = { theta = \"0.4 rad\" }\n");
  EXPECT_NE(outside.find("a limit that the start keeps"), std::string::npos) << outside;
  EXPECT_NE(outside.find("swing.toml:"), std::string::npos) << outside;
  EXPECT_NE(told("upper_limit = { angle = \"1 rad\" }\n").find("\"angle\" is not a state"),
            std::string::npos);
  EXPECT_NE(told("upper_limit = { theta = \"1 m\" }\n").find("m"), std::string::npos);
  EXPECT_EQ(told("lower_limit = { theta = \"-90 deg\" }\n"), "accepted");
}

TEST(Estimate, WhatTheFileSaysWronglyIsToldWithItsPlace) {
  const auto project =
      parse_project(swing("[estimate]\nfilter = \"particle\"\noutliers = \"hide\"\n"
                          "process_noise = { theta = \"-1 rad\", alpha = \"1 rad\" }\n"
                          "measurement_noise = { theta = \"1 rad\", angle = \"0 rad\" }\n"
                          "initial_std = { omega = \"1 kg\" }\n"),
                    "swing.toml");
  ASSERT_FALSE(project);
  std::string told;
  for (const QuotedError& error : project.error().all()) {
    told += to_string(error) + "\n";
  }
  for (const std::string_view part :
       {"swing.toml:12:", "not one of the choices", "process_noise.theta is -1 rad",
        "\"alpha\" is not a state", "\"theta\" is not an output; there are angle", "zero", "kg"}) {
    EXPECT_NE(told.find(part), std::string::npos) << part << " in\n" << told;
  }
}

TEST(Estimate, TheAnswerHoldsTheEstimates) {
  const Swing swing_of = swing_log(400);
  const Answer answer =
      answer_of(estimated(swing_of.log, swing(noises + std::string("tune = true\n"))));
  const auto json = nlohmann::json::parse(answer.json);
  EXPECT_EQ(json["schema"], "flyball.estimate/1");
  EXPECT_EQ(json["runs"][0]["samples"], 400);
  EXPECT_EQ(json["noise"][0]["of"], "omega");
  EXPECT_EQ(json["noise"][1]["kind"], "measurement");
  EXPECT_TRUE(json["tuning"]["converged"]);
  EXPECT_EQ(json["states"][0]["name"], "theta");
  EXPECT_LT(json["states"][0]["smoother_std"], json["states"][0]["filter_std"]);
  ASSERT_EQ(answer.figures.size(), 2U);
  EXPECT_EQ(answer.figures[0].plot.panels.size(), 2U);
  EXPECT_EQ(answer.figures[0].plot.panels[0].bands.size(), 2U);
  ASSERT_EQ(answer.files.size(), 2U);
  const auto table = parse_csv(answer.files[0].contents, "run.csv");
  ASSERT_TRUE(table) << to_string(table.error());
  const Signal* omega = table->find_signal("smoother_omega");
  ASSERT_NE(omega, nullptr);
  EXPECT_EQ(omega->unit, "rad/s");
  const auto wpilog = parse_wpilog(answer.files[1].contents, "estimate.wpilog");
  ASSERT_TRUE(wpilog);
  const Signal* same = wpilog->find_signal("flyball/smoother_omega");
  ASSERT_NE(same, nullptr);
  ASSERT_EQ(same->value.size(), 400U);
  EXPECT_EQ(same->value[17], omega->value[17]);
}

}  // namespace
}  // namespace flyball::study::estimate_test
