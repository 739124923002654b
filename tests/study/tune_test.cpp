#include <flyball/study/tune.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/study/answer.hpp>
#include <flyball/study/identify_each.hpp>
#include <flyball/study/identify_logs.hpp>
#include <flyball/study/project.hpp>

#include "session_file.hpp"

namespace flyball::study::tune_test {
namespace {

using mechanisms::MechanismKind;

CharacterizationOptions arm_session(double ramp_limit = 10.0) {
  CharacterizationOptions session;
  session.mechanism = MechanismKind::arm;
  session.kS = 0.1;
  session.kV = 1.2;
  session.kA = 0.15;
  session.kG = 0.65;
  session.angle_offset = 0.2;
  session.ramp_limit = ramp_limit;
  return session;
}

TEST(Tune, GoesFromALogToAProvenController) {
  CharacterizationOptions session = arm_session(6.0);
  session.resolution = 2.0 * 3.141592653589793 / 4096.0;
  session.sensor_delay = 0.010;
  session.seed = 5;
  const SessionFile file(session, "Arm", "flyball_tune_test_arm.json");

  TuneJob job;
  job.identification.log = file.path();
  const auto result = tune(job);
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_TRUE(result->identification.report.fit)
      << to_string(result->identification.report.fit.error());
  const identification::FeedforwardFit& fit = *result->identification.report.fit;
  EXPECT_NEAR(fit.kV.value, 1.2, 0.03 * 1.2);
  EXPECT_NEAR(fit.kG->value, 0.65, 0.05 * 0.65);
  EXPECT_NEAR(fit.angle_offset->value, 0.2, 0.05);
  ASSERT_TRUE(result->design);
  ASSERT_TRUE(*result->design) << to_string(result->design->error());
  const DesignResult& design = **result->design;
  EXPECT_TRUE(design.robust);
  // Of the errors that the grid samples, and of what the log leaves open.
  ASSERT_EQ(design.proofs.size(), 2u);
  for (const PlantProof& proof : design.proofs) {
    EXPECT_EQ(proof.certificate.verdict, LoopVerdict::stable) << proof.set;
  }
  // The joint set is no smaller than what each gain is told with.
  const auto& joint = fit.joint_covariance;
  EXPECT_GE(std::sqrt(joint[0][0]) * fit.kV.value, fit.kV.standard_error * (1.0 - 1e-9));
  EXPECT_GE(std::sqrt(joint[1][1]) * fit.kA.value, fit.kA.standard_error * (1.0 - 1e-9));
  EXPECT_GT(joint[2][2], 0.0);
  EXPECT_LT(joint[0][1] * joint[0][1], joint[0][0] * joint[1][1]);
  EXPECT_EQ(joint[1][2], joint[2][1]);
  // The delay that the log shows is the one that the loop is designed for.
  EXPECT_NEAR(*design.job.controller.delay, std::max(0.0, fit.position_delay), 1e-12);

  const auto json = nlohmann::json::parse(to_json(*result));
  EXPECT_EQ(json["schema"], "flyball.tune/2");
  EXPECT_EQ(json["identification"]["schema"], "flyball.identify/1");
  EXPECT_EQ(json["identification"]["gains"]["kV"]["value"].get<double>(), fit.kV.value);
  EXPECT_EQ(json["identification"]["gains"]["kV"]["unit"], "V·s/rad");
  EXPECT_EQ(json["design"]["K"][0][0].get<double>(), design.K(0, 0));
  for (const char* key : {"kalman_gain", "poles", "feedforward", "margins"}) {
    EXPECT_TRUE(json["design"].contains(key)) << key;
  }
}

// A log of kV = 4.0 beside a project of 2 NEO, 10:1 on a drum of an inch, whose kV is 7.81: the
// ratio, and what makes it 1/2. A project of the same mechanism is not complained of.
TEST(Tune, ALogThatContradictsItsProjectIsWarnedOf) {
  CharacterizationOptions session;
  session.mechanism = MechanismKind::elevator;
  session.kS = 0.15;
  session.kV = 4.0;
  session.kA = 0.05;
  session.kG = 0.46;
  session.resolution = 1e-4;
  session.travel_low = 0.0;
  session.travel_high = 2.0;
  const SessionFile file(session, "Elevator", "flyball_tune_test_contradiction.json");
  const auto warning = [&](const std::string& drum_radius) -> std::string {
    const std::string project =
        (std::filesystem::temp_directory_path() / "flyball_tune_test_contradiction.toml").string();
    std::ofstream(project) << "[mechanism]\ntype = \"elevator\"\nmotor = \"NEO\"\nmotor_count = "
                              "2\ngearing = 10.0\nmass = \"8 kg\"\ndrum_radius = \""
                           << drum_radius << "\"\n";
    const auto job = tune_job(file.path(), project);
    EXPECT_TRUE(job) << to_string(job.error());
    const auto result = tune(*job);
    EXPECT_TRUE(result) << to_string(result.error());
    // Who only identifies is told the same.
    const auto alone = identify_job(file.path(), project).value();
    const auto identified = identify(alone).value();
    const auto told = [](const IdentifyResult& of) {
      std::string all;
      for (const Diagnostic& found : of.diagnostics()) {
        all += found.code == "project_contradicts_log" ? found.message : "";
      }
      return all;
    };
    EXPECT_EQ(told(identified), told(result->identification));
    const auto logs = identify_logs(
        {.logs = {file.path(), file.path()}, .selection = alone.selection, .said = alone.said});
    EXPECT_TRUE(logs && told(logs->joint).empty() == told(identified).empty());
    const LogRow row = identify_row(alone);
    EXPECT_EQ(row.members.find("project_contradicts_log") == std::string::npos,
              told(identified).empty());
    std::filesystem::remove(project);
    for (const Diagnostic& diagnostic : result->identification.diagnostics()) {
      if (diagnostic.code == "project_contradicts_log") {
        EXPECT_EQ(diagnostic.severity, Severity::warning);
        EXPECT_NE(to_json(*result).find("project_contradicts_log"), std::string::npos);
        return diagnostic.message;
      }
    }
    return "";
  };
  const std::string text = warning("1 in");
  for (const char* part : {"kV = 4", "7.81", "by motor and gearing", "0.51", "drum_radius is half",
                           "the gearing is 5.1"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " in: " << text;
  }
  EXPECT_EQ(warning("5 cm"), "");
}

// Each factor has its own cause; what no factor explains is the gearing's.
TEST(Tune, AContradictionNamesItsLikelyCause) {
  constexpr double turn = 2.0 * 3.141592653589793;
  identification::FeedforwardFit fit;
  fit.mechanism = MechanismKind::arm;
  PlantDescription said;
  said.kind = MechanismKind::arm;
  said.gains = {.kV = 1.0, .kA = 0.1, .kG = 0.5};
  said.motor = mechanisms::motor("NEO", 1).value();
  said.gearing = 40.0;
  const auto cause = [&](double ratio) -> std::string {
    fit.kV.value = ratio;
    fit.kA.value = 0.1;
    const auto found = contradictions(fit, said);
    return found.empty() ? "" : found.front().message;
  };
  const auto contains = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_EQ(cause(1.1), "");
  EXPECT_TRUE(contains(cause(turn), "rotations taken for radians")) << cause(turn);
  EXPECT_TRUE(contains(cause(1.0 / turn), "radians taken for rotations"));
  EXPECT_TRUE(contains(cause(turn / 360.0), "degrees taken for radians"));
  EXPECT_TRUE(contains(cause(1.0 / 40.0), "before the gearing of 40"));
  EXPECT_TRUE(contains(cause(1.5), "the gearing is 60 and not 40, or the motor is another"));
  said.unit = "m";
  said.kind = fit.mechanism = MechanismKind::elevator;
  said.drum_radius = 0.0254;
  EXPECT_TRUE(contains(cause(2.0), "diameter"));
  EXPECT_TRUE(contains(cause(1.0 / 39.37), "inches taken for metres"));
  // kV agrees: what hangs on the mass is held against it with more patience.
  fit.kG = identification::GainEstimate{.value = 0.1};
  EXPECT_TRUE(contains(cause(1.0), "kG")) << cause(1.0);
  EXPECT_TRUE(contains(cause(1.0), "counterweight"));
  fit.kG->value = 0.4;
  EXPECT_EQ(cause(1.0), "");
  fit.kA.determined = true;
  said.gains.kV = 0.0;
  EXPECT_EQ(cause(3.0), "");
}

TEST(Tune, ARefusedLogHasNoDesignAndSaysWhy) {
  CharacterizationOptions session;
  session.mechanism = MechanismKind::elevator;
  session.kS = 20.0;  // friction that no test overcomes
  session.kV = 4.0;
  session.kA = 0.3;
  session.velocity_noise = 1e-3;
  session.resolution = 1e-4;
  const SessionFile file(session, "Elevator", "flyball_tune_test_stuck.json");
  TuneJob job;
  job.identification.log = file.path();
  const auto result = tune(job);
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_FALSE(result->identification.report.fit);
  EXPECT_TRUE(
      result->identification.report.fit.error().is(identification::IdentificationError::no_motion))
      << to_string(result->identification.report.fit.error());
  EXPECT_FALSE(result->design);
  const auto json = nlohmann::json::parse(to_json(*result));
  EXPECT_EQ(json["error"]["code"], "no_motion");
  EXPECT_FALSE(json.contains("design"));
}

TEST(Tune, AMissingLogIsAnError) {
  TuneJob job;
  job.identification.log = "/nowhere/to/be/found.json";
  const auto result = tune(job);
  ASSERT_FALSE(result);
  EXPECT_NE(to_string(result.error()).find("found.json"), std::string::npos);
}

TEST(Identify, TakesTheMechanismFromTheDataUntilItIsConfirmed) {
  const SessionFile log(arm_session(), "", "flyball_open_arm.json");
  const auto open = identify({.log = log.path(), .selection = {}});
  ASSERT_TRUE(open) << to_string(open.error());
  ASSERT_TRUE(open->report.fit) << to_string(open->report.fit.error());
  EXPECT_EQ(open->mechanism, MechanismKind::arm);
  const Document document = answer_of(*open).document;
  EXPECT_EQ(document.verdict.line, "The gains can be used once the mechanism is confirmed.");
  ASSERT_FALSE(document.verdict.reasons.empty());
  EXPECT_NE(document.verdict.reasons.front().find("taken for an arm"), std::string::npos);
  recording::LogSelection said;
  said.mechanism = MechanismKind::arm;
  const auto told = identify({.log = log.path(), .selection = said});
  ASSERT_TRUE(told && told->report.fit);
  EXPECT_EQ(told->report.fit->kG->value, open->report.fit->kG->value);
}

TEST(Identify, AsksForTheMechanismThatTheDataLeaveOpen) {
  CharacterizationOptions turret = arm_session();
  turret.kG = 0.0;
  const SessionFile log(turret, "", "flyball_open_turret.json");
  const auto open = identify({.log = log.path(), .selection = {}});
  ASSERT_FALSE(open);
  EXPECT_TRUE(open.error().is(identification::IdentificationError::unknown_mechanism));
  EXPECT_EQ(open.error().kind(), ErrorKind::misuse);
  const std::string text = to_string(open.error());
  EXPECT_NE(text.find("--mechanism arm or --mechanism turret"), std::string::npos) << text;
}

// Two facts are missing, and both are asked for.
TEST(Identify, AsksForTheUnitBesideTheMechanism) {
  CharacterizationOptions turret = arm_session();
  turret.kG = 0.0;
  const SessionFile log(turret, "", "flyball_open_unit.json", "");
  const auto open = identify({.log = log.path(), .selection = {}});
  ASSERT_FALSE(open);
  ASSERT_EQ(open.error().all().size(), 2U);
  EXPECT_NE(to_string(open.error().all()[0]).find("--mechanism"), std::string::npos);
  EXPECT_NE(to_string(open.error().all()[1]).find("--unit"), std::string::npos);
}

TEST(Identify, ShowsWhatAPersonTrimmed) {
  const SessionFile log(arm_session(), "Arm", "flyball_trimmed_arm.json");
  IdentifyJob job{.log = log.path(), .selection = {}};
  job.selection.runs = {"1:..4"};
  job.selection.without_runs = {"4"};
  const auto result = identify(job);
  ASSERT_TRUE(result) << to_string(result.error());
  const Answer answer = answer_of(*result);
  const auto json = nlohmann::json::parse(answer.json);
  EXPECT_EQ(json.at("log").at("runs").at(0).at("used_to"), 4.0);
  EXPECT_EQ(json.at("log").at("runs").at(3).at("left_out"), true);
  EXPECT_FALSE(json.at("log").at("runs").at(1).contains("used_to"));
  const auto titled = [&](const char* words) {
    return std::count_if(answer.figures.begin(), answer.figures.end(), [&](const Figure& figure) {
      return figure.title.find(words) != std::string::npos;
    });
  };
  EXPECT_EQ(titled("to 4 s by hand"), 1);
  EXPECT_EQ(titled("left out by hand"), 1);
}

}  // namespace
}  // namespace flyball::study::tune_test
