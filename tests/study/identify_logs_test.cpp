#include <flyball/study/identify_logs.hpp>

#include <algorithm>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/study/design.hpp>

#include "session_file.hpp"

namespace flyball::study::identify_logs_test {
namespace {

CharacterizationOptions elevator(std::uint64_t seed, double kV = 2.0) {
  CharacterizationOptions session;
  session.mechanism = mechanisms::MechanismKind::elevator;
  session.kS = 0.4;
  session.kV = kV;
  session.kA = 0.3;
  session.kG = 0.8;
  session.resolution = 1e-4;
  session.sensor_delay = 0.010;
  session.seed = seed;
  return session;
}

bool has(const std::vector<Diagnostic>& diagnostics, std::string_view code) {
  return std::any_of(diagnostics.begin(), diagnostics.end(),
                     [&](const Diagnostic& found) { return found.code == code; });
}

TEST(IdentifyLogs, LogsOfOneMechanismAgreeAndAreFittedTogether) {
  const SessionFile a(elevator(1), "Elevator", "flyball_logs_a.json");
  const SessionFile b(elevator(2), "Elevator", "flyball_logs_b.json");
  const auto result = identify_logs({.logs = {a.path(), b.path()}, .selection = {}});
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_TRUE(result->repeats());
  ASSERT_TRUE(result->joint.report.fit);
  EXPECT_EQ(result->joint.report.prepared.runs.size(), 8u);
  EXPECT_NEAR(result->joint.report.fit->kV.value, 2.0, 0.02);
  EXPECT_NEAR(result->joint.report.fit->kG->value, 0.8, 0.02);

  const Answer answer = answer_of(*result);
  EXPECT_NE(answer.document.verdict.line.find("The 2 logs agree."), std::string::npos);
  const auto json = nlohmann::json::parse(answer.json);
  EXPECT_EQ(json["schema"], "flyball.identify_logs/1");
  EXPECT_EQ(json["repeats"], true);
  EXPECT_EQ(json["logs"][1]["gains"]["kV"]["value"].get<double>(), result->logs[1].fit->kV.value);
  EXPECT_EQ(json["comparisons"][0]["gain"], "kS");
  EXPECT_EQ(json["comparisons"][0]["logs"], (nlohmann::json{0.0, 1.0}));
}

// Three of kV = 2 and one of 2.1: that one is named. At 2.5 there are no joint gains.
TEST(IdentifyLogs, ALogThatDiffersIsNamed) {
  const SessionFile a(elevator(1), "Elevator", "flyball_logs_c.json");
  const SessionFile b(elevator(2), "Elevator", "flyball_logs_d.json");
  const SessionFile c(elevator(3), "Elevator", "flyball_logs_e.json");
  const SessionFile odd(elevator(4, 2.1), "Elevator", "flyball_logs_f.json");
  const auto result =
      identify_logs({.logs = {a.path(), odd.path(), b.path(), c.path()}, .selection = {}});
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_FALSE(result->repeats());
  ASSERT_TRUE(result->joint.report.fit);
  EXPECT_TRUE(has(result->joint.diagnostics(), "log_differs"));
  const auto told = result->joint.diagnostics();
  const auto found = std::find_if(told.begin(), told.end(),
                                  [](const Diagnostic& d) { return d.code == "log_differs"; });
  EXPECT_NE(found->message.find(odd.path()), std::string::npos);
  // The difference is in the interval.
  const auto& kV = result->joint.report.fit->kV;
  EXPECT_LT(kV.interval[0], 2.0);
  EXPECT_GT(kV.interval[1] - kV.interval[0], 4.0 * 1.96 * result->logs[0].fit->kV.standard_error);

  const SessionFile other(elevator(5, 2.6), "Elevator", "flyball_logs_g.json");
  const auto differing = identify_logs({.logs = {a.path(), other.path()}, .selection = {}});
  ASSERT_TRUE(differing) << to_string(differing.error());
  ASSERT_FALSE(differing->joint.report.fit);
  EXPECT_TRUE(
      differing->joint.report.fit.error().is(identification::IdentificationError::logs_differ));
  EXPECT_TRUE(answer_of(*differing).refusal);
}

TEST(IdentifyLogs, ALogThatCannotBeReadIsToldAndLeftOut) {
  const SessionFile a(elevator(1), "Elevator", "flyball_logs_h.json");
  const SessionFile b(elevator(2), "Elevator", "flyball_logs_i.json");
  const auto result =
      identify_logs({.logs = {a.path(), "no_such_log.json", b.path()}, .selection = {}});
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_EQ(result->used, (std::vector<std::size_t>{0, 2}));
  EXPECT_TRUE(has(result->joint.diagnostics(), "log_left_out"));
  EXPECT_TRUE(nlohmann::json::parse(to_json(*result))["logs"][1].contains("error"));

  const auto none = identify_logs({.logs = {"no_such_log.json", "nor_this.json"}, .selection = {}});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().all().size(), 2u);
}

TEST(IdentifyLogs, Errors) {
  const SessionFile a(elevator(1), "Elevator", "flyball_logs_j.json");
  EXPECT_TRUE(
      identify_logs({.logs = {a.path()}, .selection = {}}).error().is(ArgumentError::wrong_shape));
  CharacterizationOptions session = elevator(2);
  session.mechanism = mechanisms::MechanismKind::flywheel;
  session.kG = 0.0;
  const SessionFile other(session, "Simple", "flyball_logs_k.json");
  const auto mixed = identify_logs({.logs = {a.path(), other.path()}, .selection = {}});
  ASSERT_FALSE(mixed);
  EXPECT_NE(to_string(mixed.error()).find(other.path()), std::string::npos);
}

TEST(IdentifyLogs, AMechanismThatTheDataTellWaitsForItsConfirmation) {
  const SessionFile a(elevator(1), "", "flyball_logs_open_a.json", "Meters");
  const SessionFile b(elevator(2), "", "flyball_logs_open_b.json", "Meters");
  const auto result = identify_logs({.logs = {a.path(), b.path()}, .selection = {}});
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_EQ(result->joint.mechanism, mechanisms::MechanismKind::elevator);
  EXPECT_TRUE(has(result->joint.report.diagnostics, "mechanism_assumed"));
}

}  // namespace
}  // namespace flyball::study::identify_logs_test
