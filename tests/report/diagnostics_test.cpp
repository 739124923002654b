// No diagnostic is lost between a result and whoever reads its answer.
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/report/html.hpp>
#include <flyball/report/terminal.hpp>
#include <flyball/study/identify_model.hpp>

#include "drive_sessions.hpp"
#include "fixtures.hpp"
#include "report/format.hpp"

namespace flyball::report::diagnostics_test {
namespace {

using Json = nlohmann::json;

constexpr std::array severities{Severity::info, Severity::warning, Severity::error};

/// One of each severity, named after where it was found.
std::vector<Diagnostic> of_every_severity(const std::string& place) {
  std::vector<Diagnostic> diagnostics;
  for (const Severity severity : severities) {
    diagnostics.push_back({place + "_" + std::string(to_string(severity)), severity,
                           "seen in " + place + " <" + std::string(to_string(severity)) + ">"});
  }
  return diagnostics;
}

void add(std::vector<Diagnostic>& to, const std::string& place) {
  const std::vector<Diagnostic> more = of_every_severity(place);
  to.insert(to.end(), more.begin(), more.end());
}

/// Everything that stands under a key "diagnostics", wherever that is.
void collect(const Json& json, std::vector<Json>& found) {
  if (!json.is_structured()) {
    return;
  }
  for (const auto& [key, value] : json.items()) {
    if (json.is_object() && key == "diagnostics") {
      found.insert(found.end(), value.begin(), value.end());
    }
    collect(value, found);
  }
}

/// The text with blanks where lines were broken.
std::string unwrapped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const bool blank = c == ' ' || c == '\n';
    if (!blank) {
      out += c;
    } else if (out.empty() || out.back() != ' ') {
      out += ' ';
    }
  }
  return out;
}

/// What the document finds stands in JSON, on the page and on the terminal, with code, severity and
/// sentence; and what was put in at `places` is among it.
void expect_nothing_lost(const Answer& answer, const std::vector<std::string>& places) {
  std::vector<Diagnostic> told;
  for (const Section& section : answer.document.sections) {
    for (const Block& block : section.blocks) {
      if (const auto* findings = std::get_if<Findings>(&block)) {
        told.insert(told.end(), findings->diagnostics.begin(), findings->diagnostics.end());
      }
    }
  }
  std::set<std::string> codes;
  std::vector<Json> in_json;
  collect(Json::parse(answer.json), in_json);
  const std::string page = to_html(answer);
  const std::string terminal = unwrapped(to_terminal(answer.document));
  for (const Diagnostic& diagnostic : told) {
    codes.insert(diagnostic.code);
    const std::string severity(to_string(diagnostic.severity));
    const Json wanted{
        {"code", diagnostic.code}, {"severity", severity}, {"message", diagnostic.message}};
    EXPECT_NE(std::find(in_json.begin(), in_json.end(), wanted), in_json.end()) << wanted;
    EXPECT_NE(page.find(severity + "</span> " + escape_html(diagnostic.message) +
                        " <code class=\"quiet\">" + escape_html(diagnostic.code) + "</code>"),
              std::string::npos)
        << wanted;
    EXPECT_NE(terminal.find(" " + severity), std::string::npos) << wanted;
    EXPECT_NE(terminal.find(unwrapped(diagnostic.message) + " [" + diagnostic.code + "]"),
              std::string::npos)
        << wanted;
  }
  for (const Json& diagnostic : in_json) {
    EXPECT_EQ(codes.count(diagnostic.at("code")), 1U) << diagnostic << " is in JSON alone";
  }
  for (const std::string& place : places) {
    for (const Diagnostic& diagnostic : of_every_severity(place)) {
      EXPECT_EQ(codes.count(diagnostic.code), 1U) << diagnostic.code;
    }
  }
  if (answer.refusal) {
    EXPECT_EQ(Json::parse(answer.json).at("error").at("code"), std::string(answer.refusal->code()));
    EXPECT_NE(page.find(escape_html(to_string(*answer.refusal))), std::string::npos);
    EXPECT_NE(terminal.find(unwrapped(to_string(*answer.refusal))), std::string::npos);
  } else {
    EXPECT_FALSE(Json::parse(answer.json).contains("error"));
  }
}

study::IdentifyResult noted(study::IdentifyResult result) {
  add(result.source.diagnostics, "source");
  add(result.report.diagnostics, "fit");
  return result;
}

study::DesignResult noted(study::DesignResult result) {
  add(result.diagnostics, "design");
  return result;
}

TEST(Diagnostics, OfAnIdentification) {
  expect_nothing_lost(study::answer_of(noted(identify_result(MechanismKind::arm))),
                      {"source", "fit"});
}

TEST(Diagnostics, OfARefusedIdentification) {
  const Answer answer = study::answer_of(noted(refused_result()));
  ASSERT_TRUE(answer.refusal);
  expect_nothing_lost(answer, {"source", "fit"});
}

study::IdentifyResult drive_result(bool still) {
  identification::DriveRecording recording = drives::record({});
  if (still) {
    for (identification::DriveRun& run : recording.runs) {
      run.right.position.assign(run.time.size(), 0.5);
      run.right.velocity.assign(run.time.size(), 0.0);
    }
  }
  recording::LoadedRecording source;
  source.path = "drive.wpilog";
  source.format = "WPILOG";
  source.drive = recording;
  identification::DriveReport drive = identification::identify_drive(recording);
  const Error error = drive.fit ? Error(recording::RecordingError::drivetrain) : drive.fit.error();
  study::IdentifyResult result{
      std::move(source), {{}, drive.diagnostics, tl::unexpected(error)}, {}, "m", std::move(drive)};
  return noted(std::move(result));
}

TEST(Diagnostics, OfADrivetrain) {
  const Answer answer = study::answer_of(drive_result(false));
  EXPECT_FALSE(answer.refusal);
  expect_nothing_lost(answer, {"source", "fit"});
  // The gains' intervals; left, right, heading and the voltages of each of eight tests, and the
  // transients of the four steps.
  ASSERT_EQ(answer.figures.size(), 13u);
  EXPECT_EQ(answer.figures[0].name, "intervals");
  EXPECT_EQ(answer.figures[1].plot.panels.size(), 4u);
  // Of a ramp from rest the fit leaves out what is before the motion: it is marked, and shown from
  // where the voltage begins.
  const std::vector<PlotPanel>& panels = answer.figures[1].plot.panels;
  ASSERT_EQ(panels[2].lines.size(), 3u);
  EXPECT_EQ(panels[2].lines[0].label, "not used by the fit");
  EXPECT_EQ(panels[2].lines[0].x, panels[3].lines[0].x);
  for (const PlotPanel& panel : panels) {
    ASSERT_FALSE(panel.spans.empty());
    EXPECT_EQ(panel.spans[0].from, panels[3].lines[0].x.front());
    EXPECT_EQ(panel.spans[0].to, panels[2].lines[1].x.front());
  }
  EXPECT_EQ(answer.files.size(), 8u);
}

TEST(Diagnostics, OfARefusedDrivetrain) {
  const Answer answer = study::answer_of(drive_result(true));
  ASSERT_TRUE(answer.refusal);
  EXPECT_TRUE(answer.refusal->is(identification::IdentificationError::no_motion));
  expect_nothing_lost(answer, {"source", "fit"});
}

TEST(Diagnostics, OfADesign) {
  expect_nothing_lost(study::answer_of(noted(design_result(MechanismKind::elevator))), {"design"});
}

TEST(Diagnostics, OfATuning) {
  study::TuneResult result = tune_result(MechanismKind::elevator);
  result.identification = noted(std::move(result.identification));
  result.design = noted(**result.design);
  expect_nothing_lost(study::answer_of(result), {"source", "fit", "design"});
}

TEST(Diagnostics, OfATuningWithoutADesign) {
  const study::TuneResult no_fit{noted(refused_result()), std::nullopt};
  expect_nothing_lost(study::answer_of(no_fit), {"source", "fit"});
  study::TuneResult refused = tune_result(MechanismKind::elevator);
  refused.identification = noted(std::move(refused.identification));
  refused.design = tl::unexpected(Errors(Error(study::DesignError::gravity_too_strong).in("design"))
                                      .after(of_every_severity("design")));
  const Answer answer = study::answer_of(refused);
  ASSERT_TRUE(answer.refusal && answer.refusal->is(study::DesignError::gravity_too_strong));
  expect_nothing_lost(answer, {"source", "fit", "design"});
}

TEST(Diagnostics, OfAnAnalysis) {
  study::ModelFile model;
  model.system = {Eigen::MatrixXd::Constant(1, 1, -1.0), Eigen::MatrixXd::Constant(1, 1, 1.0),
                  Eigen::MatrixXd::Constant(1, 1, 1.0), Eigen::MatrixXd::Zero(1, 1)};
  add(model.notes, "model");
  expect_nothing_lost(study::answer_of(study::analyze(model).value()), {"model"});
}

TEST(Diagnostics, OfAFittedModelReachEveryReader) {
  study::ModelIdentification result{identification::PredictionErrorFit(
      ContinuousSystem<>{Eigen::MatrixXd::Constant(1, 1, -1.0), Eigen::MatrixXd::Ones(1, 1),
                         Eigen::MatrixXd::Ones(1, 1), Eigen::MatrixXd::Zero(1, 1)})};
  result.fit.whiteness.resize(1);
  result.fit.output_std = {1.0};
  add(result.diagnostics, "model");
  expect_nothing_lost(study::answer_of(result), {"model"});
}

}  // namespace
}  // namespace flyball::report::diagnostics_test
