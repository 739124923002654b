#include <flyball/report/terminal.hpp>

#include <cmath>
#include <regex>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/report/html.hpp>

#include "fixtures.hpp"
#include "report/format.hpp"

namespace flyball::report::terminal_test {
namespace {

using Json = nlohmann::json;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    lines.push_back(line);
  }
  return lines;
}

/// What a terminal shows of a result's answer.
template <class Result>
std::string text_of(const Result& result, const TerminalStyle& style = {},
                    std::string_view report_folder = {}) {
  return to_terminal(study::answer_of(result).document, style, report_folder);
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// Every number that stands in a text.
std::vector<double> numbers_in(const std::string& text) {
  std::vector<double> numbers;
  const char* at = text.c_str();
  while (*at != '\0') {
    const bool begins = (*at >= '0' && *at <= '9') || (*at == '-' && at[1] >= '0' && at[1] <= '9');
    if (!begins) {
      ++at;
      continue;
    }
    char* end = nullptr;
    numbers.push_back(std::strtod(at, &end));
    at = end;
  }
  return numbers;
}

/// Whether a value is shown to two digits, as it is or in ms, percent, degrees or decibels.
bool shown(double value, const std::vector<double>& numbers) {
  for (const double scale : {1.0, 1e3, 1e2, 180.0 / 3.141592653589793}) {
    for (const double number : numbers) {
      if (std::abs(number - scale * value) <= 6e-3 * std::abs(scale * value) + 1e-300) {
        return true;
      }
    }
  }
  return false;
}

void expect_all_shown(const Json& json, const std::string& path,
                      const std::vector<double>& numbers) {
  if (json.is_number()) {
    EXPECT_TRUE(shown(json.get<double>(), numbers)) << path << " = " << json;
  } else if (json.is_structured()) {
    for (const auto& [key, value] : json.items()) {
      if (key != "standard_error") {  // shown as the interval
        expect_all_shown(value, path + "/" + key, numbers);
      }
    }
  }
}

TEST(Terminal, ShowsEveryNumberThatTheJsonHas) {
  for (const MechanismKind kind :
       {MechanismKind::flywheel, MechanismKind::elevator, MechanismKind::arm}) {
    const study::TuneResult result = tune_result(kind);
    const std::vector<double> numbers = numbers_in(text_of(result));
    const Json json = Json::parse(study::to_json(result));
    for (const char* pointer :
         {"/identification/gains", "/identification/fit", "/identification/one_step_regression",
          "/design/period", "/design/K", "/design/kalman_gain", "/design/feedforward",
          "/design/margins", "/design/motion", "/design/plant", "/design/paste/0",
          "/design/robustness/worst_overshoot", "/design/simulation/tracking_error_rms",
          "/design/simulation/tracking_error_max", "/design/weights"}) {
      ASSERT_TRUE(json.contains(Json::json_pointer(pointer))) << pointer;
      expect_all_shown(json[Json::json_pointer(pointer)], pointer, numbers);
    }
    for (const Json& pole : json["/design/poles"_json_pointer]) {
      EXPECT_TRUE(shown(pole[0].get<double>(), numbers)) << pole;
      EXPECT_TRUE(shown(std::abs(pole[1].get<double>()), numbers)) << pole;
    }
  }
}

TEST(Terminal, IsWithinItsWidthAndAligned) {
  for (const MechanismKind kind :
       {MechanismKind::flywheel, MechanismKind::elevator, MechanismKind::arm}) {
    for (const std::string& line : lines_of(text_of(tune_result(kind)))) {
      // Code to paste keeps its lines.
      EXPECT_TRUE(display_width(line) <= 100 || has(line, "//") || has(line, "# ")) << line;
    }
  }
}

// Of 40 columns each table is folded into parts, its first column beside each; no cell is lost.
TEST(Terminal, ATableWiderThanTheTerminalIsFolded) {
  Table table{.header = {"name", "first number", "second number", "third number", "in words"},
              .words = {0, 4},
              .wide_column = 4};
  for (const char* name : {"one", "two"}) {
    table.rows.push_back(
        {name, "1.25", "-3.5e-7", "42", "a sentence that has to be folded into several lines"});
  }
  const Document document{.sections = {{"t", "", {table}}}};
  for (const std::size_t width : {30, 40, 60, 200}) {
    const std::string text = to_terminal(document, {.width = width});
    std::size_t names = 0;
    for (const std::string& line : lines_of(text)) {
      EXPECT_LE(display_width(line), width) << line;
      names += line.starts_with("  one") ? 1 : 0;
    }
    EXPECT_EQ(names, width == 30 ? 4U : width == 40 || width == 60 ? 2U : 1U) << text;
    for (const char* cell : {"1.25", "-3.5e-7", "42", "sentence", "several"}) {
      EXPECT_TRUE(has(text, cell)) << width << cell;
    }
  }
}

TEST(Terminal, AsciiWhereThereIsNoUtf8) {
  const Document document{
      .title = "10 rad/s²",
      .verdict = {.line = "±2σ"},
      .sections = {{"t",
                    "",
                    {Table{.header = {"Ω"}, .rows = {{"15 mΩ"}}}, Paragraph{"kg·m²"},
                     Facts{{{"σ", "1 °"}}}, Findings{{{"c", Severity::info, "− 3"}}},
                     Code{"Größe", "// V·s"}, Steps{{"at most 18 m/s²"}}}}}};
  const std::string text = to_terminal(document, {.ascii = true});
  for (const char c : text) {
    EXPECT_LT(static_cast<unsigned char>(c), 0x80) << text;
  }
  EXPECT_TRUE(has(text, "10 rad/s^2"));
  EXPECT_TRUE(has(text, "+-2sigma"));
  EXPECT_TRUE(has(text, "15 mOhm"));
  EXPECT_TRUE(has(text, "kg*m^2"));
  EXPECT_TRUE(has(text, "at most 18 m/s^2"));
  EXPECT_TRUE(has(text, "-------"));
}

TEST(Terminal, WithoutColourThereIsNoEscape) {
  const study::TuneResult result = tune_result(MechanismKind::elevator);
  const std::string plain = text_of(result);
  EXPECT_EQ(plain.find('\x1b'), std::string::npos);
  const std::string colored = text_of(result, {.color = true});
  EXPECT_NE(colored.find('\x1b'), std::string::npos);
  std::string stripped;
  for (std::size_t i = 0; i < colored.size(); ++i) {
    if (colored[i] == '\x1b') {
      i = colored.find('m', i);
    } else {
      stripped += colored[i];
    }
  }
  EXPECT_EQ(stripped, plain);
}

TEST(Terminal, NoNaNIsPrintedAsANumber) {
  study::TuneResult result = tune_result(MechanismKind::elevator);
  study::DesignResult& design = **result.design;
  design.margins.gain_margin = std::numeric_limits<double>::infinity();
  design.margins.phase_margin = std::nan("");
  design.robustness.front().stable = false;
  design.robustness.front().overshoot = std::numeric_limits<double>::infinity();
  design.robust = false;
  result.identification.report.fit->one_step->kA = std::nan("");
  const std::string text = text_of(result);
  EXPECT_EQ(text.find("nan"), std::string::npos);
  EXPECT_EQ(text.find("NaN"), std::string::npos);
  EXPECT_FALSE(std::regex_search(text, std::regex("\\binf\\b")));
  EXPECT_TRUE(has(text, "none"));
  EXPECT_TRUE(has(text, "∞"));
  EXPECT_TRUE(has(text, "unstable"));
  EXPECT_TRUE(has(text, "Do not run this controller as it is."));
}

TEST(Terminal, SaysWhatALogDoesNotDetermine) {
  const std::string text = text_of(tune_result(MechanismKind::elevator, false));
  EXPECT_TRUE(has(text, "not determined"));
  EXPECT_TRUE(has(text, "below 0.0371"));
  EXPECT_TRUE(has(text, "the speed-up is over within two rows"));
  EXPECT_TRUE(has(text, "14.3.2"));
}

TEST(Terminal, ARefusedLogIsToldWithItsReason) {
  const study::IdentifyResult refused = refused_result();
  ASSERT_FALSE(refused.report.fit);
  const std::string text = text_of(refused);
  EXPECT_TRUE(has(text, "No gains can be taken from this log."));
  const std::string reason(refused.report.fit.error().info().summary);
  EXPECT_TRUE(has(text, reason.substr(0, reason.find(' ')))) << text;
  EXPECT_TRUE(has(text_of(study::TuneResult{refused, std::nullopt}),
                  "No gains can be taken from this log."));
}

TEST(Terminal, DiagnosticsStandMostSevereFirstAndOnce) {
  study::IdentifyResult result = identify_result(MechanismKind::flywheel);
  result.source.diagnostics = {{"assumed", Severity::info, "first told"},
                               {"truncated_log", Severity::warning, "then this"},
                               {"assumed", Severity::info, "first told"},
                               {"worst", Severity::error, "above all"}};
  const std::string text = text_of(result);
  EXPECT_LT(text.find("above all"), text.find("then this"));
  EXPECT_LT(text.find("then this"), text.find("first told"));
  EXPECT_EQ(text.find("first told"), text.rfind("first told"));
  EXPECT_TRUE(has(text, "[truncated_log]"));
}

TEST(Terminal, TextOfALogCannotSteerTheTerminal) {
  study::IdentifyResult result = identify_result(MechanismKind::flywheel);
  result.source.subject = "\x1b]0;owned\x07 wheel";
  const std::string text = text_of(result, {.color = false});
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_EQ(text.find('\x07'), std::string::npos);
}

// Two carts on springs, one of them out of the input's reach, with the poles ±2j and -1.
TEST(Terminal, ALinearSystemIsToldInWordsAndNumbers) {
  const auto analysis =
      study::parse_model(R"({"A":[[0,1,0],[-4,0,0],[0,0,-1]],"B":[[0],[1],[0]],"T":0.1,
 "states":["position of a cart that has a long name","its velocity","<b>"]})",
                         "carts")
          .and_then(&study::analyze)
          .value();
  const std::string text = text_of(analysis);
  for (const std::string& line : lines_of(text)) {
    EXPECT_LE(display_width(line), 100U) << line;
  }
  EXPECT_TRUE(has(text, "Linear system from carts"));
  EXPECT_TRUE(has(text, "0 ± 2j"));
  EXPECT_TRUE(has(text, "rings for ever"));
  EXPECT_TRUE(has(text, "Not controllable, but stabilizable"));
  EXPECT_TRUE(has(text, "No input moves <b>."));
  EXPECT_TRUE(has(text, "0.9801 ± 0.1987j")) << "e^{2jT}";
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_NE(text_of(analysis, {.color = true}).find('\x1b'), std::string::npos);
  const std::string page = to_html(study::answer_of(analysis));
  EXPECT_TRUE(has(page, "&lt;b&gt;"));
  EXPECT_FALSE(has(page.substr(0, page.find("<script")), "<b>"));
}

TEST(Terminal, NamesTheReport) {
  const study::DesignResult design = design_result(MechanismKind::arm);
  EXPECT_TRUE(has(text_of(design, {}, "out/arm"), "out/arm/index.html"));
  EXPECT_FALSE(has(text_of(design), "index.html"));
}

TEST(Motors, TableHasEveryMotorWithItsNumbers) {
  std::vector<mechanisms::DcMotor> motors;
  for (const mechanisms::MotorTableEntry& entry : mechanisms::motor_table()) {
    motors.push_back(mechanisms::motor(entry.name).value());
  }
  const std::string text = text_of(std::span<const mechanisms::DcMotor>(motors));
  for (const mechanisms::MotorTableEntry& entry : mechanisms::motor_table()) {
    bool found = false;
    for (const std::string& line : lines_of(text)) {
      if (line.rfind("  " + std::string(entry.name) + "  ", 0) == 0) {
        found = true;
        const std::vector<double> numbers = numbers_in(line.substr(2 + entry.name.size()));
        EXPECT_TRUE(shown(entry.free_speed_rpm, numbers)) << line;
        EXPECT_TRUE(shown(entry.stall_torque, numbers)) << line;
        EXPECT_TRUE(shown(entry.nominal_voltage / entry.stall_current, numbers)) << line;
        EXPECT_TRUE(shown(entry.stall_torque / entry.stall_current, numbers)) << line;
      }
    }
    EXPECT_TRUE(found) << entry.name << "\n" << text;
  }
  EXPECT_TRUE(has(text, "Vex775Pro"));  // another name, not another way of writing it
  EXPECT_FALSE(has(text, "NeoVortex"));
  for (const std::string& line : lines_of(text)) {
    EXPECT_LE(display_width(line), 100u) << line;
  }
}

}  // namespace
}  // namespace flyball::report::terminal_test
