// A project's [fit]: a model by formula, found from a log.
#include <flyball/study/identify_model.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/core/random.hpp>
#include <flyball/io/csv.hpp>

namespace flyball::study::identify_model_test {
namespace {

/// x' = (gain u - x)/lag, the rest of the file behind it.
std::string lag_with(const std::string& fit) {
  return "[model]\nname = \"lag\"\nstates = { x = \"rad\" }\ninputs = { u = \"V\" }\n"
         "parameters = { gain = \"1 rad/V\", lag = \"200 ms\" }\n"
         "[model.derivative]\nx = \"(gain*u - x)/lag\"\n" +
         fit;
}

constexpr const char* search =
    "[fit]\nchannels = { u = \"/volts\", x = \"angle\" }\n"
    "free = { gain = \"-10 .. 10 rad/V\", lag = \">= 1 ms\" }\n";

/// What a lag of 0.5 s with a gain of 2 does with a square wave from x = 0.3, exactly, in degrees,
/// the reading of the angle with noise; at 100 s the recording goes on after a pause.
Log lag_log(double noise = 0.002) {
  Random random(1);
  Log log;
  log.source = "lag.csv";
  Signal u{"/volts", "V", {}, {}};
  Signal x{"angle", "deg", {}, {}};
  for (const double start : {0.0, 100.0}) {
    double state = 0.3;
    for (int k = 0; k < 300; ++k) {
      const double t = start + 0.02 * k;
      const double volts = k / 40 % 2 == 0 ? 1.0 : -0.5;
      if (k % 40 == 0) {  // the input is told where it changes
        u.time.push_back(t);
        u.value.push_back(volts);
      }
      x.time.push_back(t);
      x.value.push_back((state + noise * random.normal()) * 180.0 / std::numbers::pi);
      state = 2.0 * volts + (state - 2.0 * volts) * std::exp(-0.02 / 0.5);
    }
  }
  log.signals = {u, x};
  return log;
}

Project project_of(const std::string& text) {
  const auto project = parse_project(text, "lag.toml");
  EXPECT_TRUE(project) << (project ? "" : to_string(project.error()));
  return project.value_or(Project{});
}

std::string refusal(const Log& log, const std::string& text) {
  const auto result = identify_model(log, project_of(text));
  return result ? "accepted" : to_string(result.error());
}

std::string complaints(const std::string& text) {
  const auto project = parse_project(text, "lag.toml");
  std::string all;
  if (!project) {
    for (const QuotedError& error : project.error().all()) {
      all += to_string(error) + "\n";
    }
  }
  return all;
}

TEST(IdentifyModel, ALogGivesTheParametersInTheModelsUnits) {
  const auto result = identify_model(
      lag_log(), project_of(lag_with(std::string(search) + "free_initial = [\"x\"]\n")));
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_EQ(result->runs.size(), 2U);  // the pause
  EXPECT_EQ(result->runs[1].name, "fit 2");
  const auto& found = result->fit.parameters;
  EXPECT_NEAR(found[0].value, 2.0, 0.002);
  EXPECT_NEAR(found[1].value, 0.5, 0.002);
  EXPECT_LE(found[1].low, 0.5);
  EXPECT_GE(found[1].high, 0.5);
  EXPECT_NEAR(result->fit.runs[1].initial(0), 0.3, 0.005);
  EXPECT_NEAR(result->fit.runs[0].outputs[0].rmse, 0.002, 0.0004);
  EXPECT_TRUE(result->validation.empty());
}

TEST(IdentifyModel, APartIsKeptAside) {
  const auto result = identify_model(
      lag_log(), project_of(lag_with(std::string(search) + "free_initial = [\"x\"]\nto = \"50 s\"\n"
                                                           "validation_from = \"99 s\"\n")));
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_EQ(result->validation.size(), 1U);
  EXPECT_EQ(result->runs.size(), 1U);
  EXPECT_NEAR(result->validation[0].outputs[0].rmse, 0.002, 0.0004);
  EXPECT_NEAR(result->validation[0].initial(0), 0.3, 0.005);
  const auto same = identify_model(
      lag_log(), project_of(lag_with(std::string(search) +
                                     "free_initial = [\"x\"]\nto = \"50 s\"\n"
                                     "validation_from = \"99 s\"\nsame_initial = true\n")));
  ASSERT_TRUE(same);
  EXPECT_EQ(same->validation[0].initial(0), same->fit.runs[0].initial(0));
}

// What is kept aside is not fitted, whether [fit] says its own end or not, and a hole in what is
// fitted is no jump of the time: two runs.
TEST(IdentifyModel, WhatIsKeptAsideIsNotFitted) {
  const std::string fit = std::string(search) + "free_initial = [\"x\"]\n";
  const auto rest = identify_model(
      lag_log(), project_of(lag_with(fit + "to = \"50 s\"\nvalidation_from = \"4 s\"\n")));
  ASSERT_TRUE(rest) << to_string(rest.error());
  ASSERT_EQ(rest->runs.size(), 1U);
  EXPECT_LT(rest->runs[0].time.back(), 4.0);
  const auto hole = identify_model(
      lag_log(), project_of(lag_with(fit + "to = \"50 s\"\nvalidation_from = \"3 s\"\n"
                                           "validation_to = \"3.1 s\"\n")));
  ASSERT_TRUE(hole) << to_string(hole.error());
  ASSERT_EQ(hole->runs.size(), 2U);
  EXPECT_LT(hole->runs[0].time.back(), 3.0);
  EXPECT_GT(hole->runs[1].time.front(), 3.1);
  EXPECT_NEAR(hole->fit.parameters[1].value, 0.5, 0.005);
}

// The seed draws the places; the model's own values are always one of them.
TEST(IdentifyModel, StartsAreSeeded) {
  const std::string fit =
      "[fit]\nchannels = { u = \"/volts\", x = \"angle\" }\nfree_initial = [\"x\"]\nstarts = 5\n"
      "free = { gain = \"-10 .. 10 rad/V\", lag = \"1 ms .. 10 s\" }\n";
  const auto costs = [&](const std::string& seed) {
    const auto result = identify_model(lag_log(), project_of(lag_with(fit + seed)));
    EXPECT_TRUE(result) << (result ? "" : to_string(result.error()));
    EXPECT_NEAR(result->fit.parameters[1].value, 0.5, 0.002);
    EXPECT_EQ(result->fit.start_costs.size(), 5U);
    return result->fit.start_costs;
  };
  EXPECT_EQ(costs("seed = 7\n"), costs("seed = 7\n"));
  EXPECT_NE(costs("seed = 7\n"), costs("seed = 8\n"));
  const auto outside = identify_model(
      lag_log(), project_of(lag_with("[fit]\nchannels = { u = \"/volts\", x = \"angle\" }\n"
                                     "free = { gain = \"1.5 .. 3 rad/V\" }\n")));
  ASSERT_TRUE(outside);
  EXPECT_TRUE(
      std::any_of(outside->diagnostics.begin(), outside->diagnostics.end(), [](const auto& one) {
        return one.code == "start_moved" && one.message.starts_with("[model] has gain outside");
      }));
}

TEST(IdentifyModel, WhatIsFixedStaysAndAPriorHolds) {
  const auto result = identify_model(
      lag_log(), project_of(lag_with("[fit]\nchannels = { u = \"/volts\", x = \"angle\" }\n"
                                     "initial = { x = \"0.3 rad\" }\n"
                                     "free = { lag = \"300 ms ± 1 us\" }\n")));
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_EQ(result->fit.model.parameters()(0), 1.0);
  EXPECT_NEAR(result->fit.parameters[0].value, 0.3, 1e-4);
  EXPECT_EQ(result->fit.runs[0].initial(0), 0.3);
}

TEST(IdentifyModel, ABoundThatHoldsIsTold) {
  const auto result = identify_model(
      lag_log(), project_of(lag_with("[fit]\nchannels = { u = \"/volts\", x = \"angle\" }\n"
                                     "initial = { x = \"0.3 rad\" }\n"
                                     "free = { gain = \"free\", lag = \"1 .. 400 ms\" }\n")));
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_NEAR(result->fit.parameters[1].value, 0.4, 1e-12);
  EXPECT_TRUE(std::any_of(
      result->diagnostics.begin(), result->diagnostics.end(), [](const Diagnostic& one) {
        return one.code == "at_bound" && one.message.starts_with("lag is at the upper end");
      }));
}

TEST(IdentifyModel, ATableWithoutTimeHasAPeriod) {
  std::string text = "\"uEst\",\"yEst\",\"Ts\",\n";
  double x = 0.0;
  for (int k = 0; k < 200; ++k) {
    const double u = k / 25 % 2 == 0 ? 1.0 : -1.0;
    text += std::to_string(u) + "," + std::to_string(x) + (k == 0 ? ",4,\n" : ",,\n");
    x = 2.0 * u + (x - 2.0 * u) * std::exp(-4.0 / 50.0);
  }
  const Project project =
      project_of(lag_with("[fit]\nperiod = \"4 s\"\nchannels = { u = \"uEst\", x = \"yEst\" }\n"
                          "free = { gain = \"free\", lag = \"1 .. 1000 s\" }\n"));
  const auto log = parse_csv(text, "table.csv", *project.fit.period);
  ASSERT_TRUE(log) << to_string(log.error());
  const auto result = identify_model(*log, project);
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_NEAR(result->fit.parameters[0].value, 2.0, 1e-4);
  EXPECT_NEAR(result->fit.parameters[1].value, 50.0, 1e-2);
  EXPECT_FALSE(parse_csv(text, "table.csv", 0.0));
}

TEST(IdentifyModel, ChannelsThatDoNotFitAreRefused) {
  const std::string unknown =
      refusal(lag_log(), lag_with("[fit]\nchannels = { u = \"/vlts\", x = \"angle\" }\n"
                                  "free = { gain = \"free\" }\n"));
  EXPECT_NE(unknown.find("\"/vlts\" is not a channel of the log"), std::string::npos) << unknown;
  EXPECT_NE(unknown.find("did you mean \"/volts\"?"), std::string::npos) << unknown;
  Log wrong = lag_log();
  wrong.signals[1].unit = "kg";
  EXPECT_NE(refusal(wrong, lag_with(search)).find("\"angle\" of the log is in kg"),
            std::string::npos);
  const std::string aside = refusal(
      lag_log(), lag_with(std::string(search) + "validation_channels = { x = \"angle\" }\n"));
  EXPECT_NE(aside.find("say it in [fit]: validation_channels = { u ="), std::string::npos) << aside;
}

TEST(IdentifyModel, WhatIsEmptyIsRefusedWithWhatThereIs) {
  EXPECT_EQ(
      refusal(lag_log(), lag_with(std::string(search) + "from = \"400 s\"\n")),
      "identify: the part of the log for the fit is 0 samples of angle; it must be two samples "
      "at least; the log has it from 0 ms to 106 s");
  EXPECT_EQ(
      refusal(lag_log(), lag_with(std::string(search) + "validation_from = \"400 s\"\n")),
      "identify: the part of the log for the validation is 0 samples of angle; it must be two "
      "samples at least; the log has it from 0 ms to 106 s");
  EXPECT_NE(refusal(lag_log(), lag_with(std::string(search) + "validation_from = \"-1 s\"\n"))
                .find("for the fit is 0 samples of angle; it must be two samples at least; the log "
                      "has it from 0 ms to 106 s; what is kept aside is not fitted"),
            std::string::npos);
  EXPECT_EQ(
      refusal(lag_log(), lag_with("")),
      "identify: [fit] is without anything to look for; say what is free, such as [fit] free = "
      "{ gain = \"free\" }");
  EXPECT_EQ(to_string(identify_model(lag_log(), Project{}).error()),
            "identify: the project is without a [model]");
  Log late = lag_log();
  for (double& t : late.signals[0].time) {
    t += 200.0;
  }
  EXPECT_NE(
      refusal(late, lag_with(search)).find("without two times at which every input has a value"),
      std::string::npos);
}

TEST(IdentifyModel, WhatTheFileSaysWronglyIsToldWithItsPlace) {
  const std::string told = complaints(
      lag_with("[fit]\nchannels = { v = \"/volts\" }\nfree_initial = [\"y\"]\nhold = \"bent\"\n"
               "[fit.free]\ngian = \"free\"\nlag = \"5 .. 1 s\"\n"));
  for (const std::string_view part :
       {"lag.toml:10:", "\"v\" is not an input or an output", "\"y\" is not a state",
        "not one of the choices",
        "\"gian\" is not a parameter of the model; did you mean \"gain\"?", "upside down"}) {
    EXPECT_NE(told.find(part), std::string::npos) << part << " in\n" << told;
  }
  EXPECT_NE(complaints(lag_with("[fit]\nfree = { lag = \"1 .. 2 kg\" }\n")).find("kg"),
            std::string::npos);
  EXPECT_NE(complaints(lag_with("[fit]\nfree = { lag = \"about 3\" }\n")).find("not a range"),
            std::string::npos);
  EXPECT_NE(complaints(lag_with("[fit]\nfree = { lag = \"3 s ± 0 s\" }\n")).find("without a width"),
            std::string::npos);
}

TEST(IdentifyModel, TheAnswerHoldsWhatWasFound) {
  const auto result = identify_model(
      lag_log(), project_of(lag_with(std::string(search) + "free_initial = [\"x\"]\nto = \"50 s\"\n"
                                                           "validation_from = \"99 s\"\n")));
  ASSERT_TRUE(result);
  const Answer answer = answer_of(*result);
  const auto json = nlohmann::json::parse(answer.json);
  EXPECT_EQ(json["schema"], "flyball.identify_model/1");
  EXPECT_EQ(json["parameters"][1]["name"], "lag");
  EXPECT_EQ(json["parameters"][1]["unit"], "s");
  EXPECT_EQ(json["parameters"][1]["value"].get<double>(), result->fit.parameters[1].value);
  EXPECT_EQ(json["validation"][0]["outputs"][0]["rmse"].get<double>(),
            result->validation[0].outputs[0].rmse);
  ASSERT_EQ(answer.figures.size(), 2U);
  EXPECT_EQ(answer.figures[0].section, answer.document.sections[0].id);
  EXPECT_EQ(answer.files[1].name, "data/validation.csv");
  EXPECT_NE(answer.document.verdict.line.find("kept aside"), std::string::npos);
}

}  // namespace
}  // namespace flyball::study::identify_model_test
