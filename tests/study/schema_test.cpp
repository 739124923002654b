#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/study/answer.hpp>

namespace flyball::study::schema_test {
namespace {

using identification::FeedforwardFit;
using identification::GainEstimate;
using mechanisms::MechanismKind;

IdentifyResult arm_result() {
  FeedforwardFit fit;
  fit.mechanism = MechanismKind::arm;
  fit.unit = "rad";
  fit.kS = {.value = 0.1, .standard_error = 0.01, .interval = {0.08, 0.12}};
  fit.kV = {.value = 1.0 / 3.0, .standard_error = 0.001, .interval = {0.33, 0.34}};
  fit.kA = {.value = 0.01, .determined = false, .upper_bound = 0.05, .reason = "too quick"};
  fit.kG = GainEstimate{.value = 0.65, .standard_error = 0.002, .interval = {0.646, 0.654}};
  fit.angle_offset = GainEstimate{.value = 0.2, .standard_error = 0.01, .interval = {0.18, 0.22}};
  fit.r_squared = 0.999;
  fit.velocity_nrmse = std::numeric_limits<double>::quiet_NaN();
  identification::FitReport report{
      .prepared = {}, .diagnostics = {{"repeated_rows", Severity::info, "75 %"}}, .fit = fit};
  return {
      .source = {}, .report = std::move(report), .mechanism = MechanismKind::arm, .unit = "rad"};
}

TEST(Schema, IdentifyIsOneLineWhoseNumbersRoundTrip) {
  const std::string text = to_json(arm_result());
  EXPECT_EQ(text.find('\n'), std::string::npos);
  const auto json = nlohmann::json::parse(text);
  EXPECT_EQ(json["schema"], "flyball.identify/1");
  EXPECT_EQ(json["mechanism"], "arm");
  EXPECT_EQ(json["gains"]["kV"]["value"].get<double>(), 1.0 / 3.0);
  EXPECT_EQ(json["gains"]["kS"]["interval"], (nlohmann::json{0.08, 0.12}));
  EXPECT_EQ(json["gains"]["kS"]["unit"], "V");
  EXPECT_EQ(json["diagnostics"][0]["severity"], "info");
}

TEST(Schema, AGainThatIsNotDeterminedHasABoundAndAReason) {
  const auto kA = nlohmann::json::parse(to_json(arm_result()))["gains"]["kA"];
  EXPECT_TRUE(kA["value"].is_null());
  EXPECT_EQ(kA["determined"], false);
  EXPECT_EQ(kA["upper_bound"], 0.05);
  EXPECT_EQ(kA["reason"], "too quick");
}

TEST(Schema, WhatIsNoNumberIsNullAndInfinityIsAText) {
  const auto json = nlohmann::json::parse(to_json(arm_result()));
  EXPECT_TRUE(json["fit"]["velocity_nrmse"].is_null());
  DesignResult design;
  design.margins.gain_margin = std::numeric_limits<double>::infinity();
  EXPECT_EQ(nlohmann::json::parse(to_json(design))["margins"]["gain_margin"], "inf");
}

TEST(Schema, ARefusalCarriesCodeMessageAndEvidence) {
  IdentifyResult result = arm_result();
  result.report.fit = tl::unexpected(Error(identification::IdentificationError::no_motion)
                                         .in("log.json")
                                         .with("top_speed", 0.001));
  const auto json = nlohmann::json::parse(to_json(result));
  EXPECT_EQ(json["error"]["code"], "no_motion");
  EXPECT_EQ(json["error"]["top_speed"], 0.001);
  EXPECT_EQ(json["diagnostics"][0]["code"], "repeated_rows");
  EXPECT_FALSE(json.contains("gains"));
}

TEST(Schema, BytesThatAreNotUtf8DoNotThrow) {
  IdentifyResult result = arm_result();
  result.source.path = "bad\xff\xfename.json";
  EXPECT_TRUE(nlohmann::json::accept(to_json(result)));
}

}  // namespace
}  // namespace flyball::study::schema_test
