#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "report/plot_data.hpp"

namespace flyball::report::plot_data_test {
namespace {

using Json = nlohmann::json;

std::vector<unsigned char> from_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<unsigned char> bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text.substr(0, text.find('='))) {
    bits = (bits << 6U) | static_cast<std::uint32_t>(digits.find(c));
    count += 6;
    if (count >= 8) {
      count -= 8;
      bytes.push_back(static_cast<unsigned char>((bits >> static_cast<unsigned>(count)) & 255U));
    }
  }
  return bytes;
}

/// The columns as the page's script reads them.
std::vector<std::vector<double>> columns_of(const Json& json) {
  const std::vector<unsigned char> bytes = from_base64(json.at("data"));
  std::vector<std::vector<double>> columns;
  std::size_t at = 0;
  for (const Json& column : json.at("columns")) {
    columns.emplace_back();
    for (std::size_t i = 0; i < column[0].get<std::size_t>(); ++i, at += 4) {
      std::uint32_t bits = 0;
      for (unsigned k = 0; k < 4; ++k) {
        bits |= static_cast<std::uint32_t>(bytes.at(at + k)) << (8U * k);
      }
      columns.back().push_back(column[1].get<double>() + std::bit_cast<float>(bits));
    }
  }
  EXPECT_EQ(at, bytes.size());
  return columns;
}

TEST(PlotData, CurvesComeBackAndSharedColumnsAreThereOnce) {
  Figure figure{.title = "T"};
  const std::vector<double> time{1e6 + 0.01, 1e6 + 0.02, 1e6 + 0.03};
  const std::vector<double> value{1.5, std::nan(""), -2.0 / 3.0};
  figure.plot.panels = {{.lines = {{.label = "a", .x = time, .y = value},
                                   {.x = time, .y = time, .style = LineStyle::dashed, .color = 4}},
                         .bands = {{.label = "b", .x = time, .low = time, .high = value}}}};
  const Json json = Json::parse(plot_data(figure));
  const auto columns = columns_of(json);
  ASSERT_EQ(json.at("columns").size(), 3U) << "NaN differs from itself, so that value is twice";
  const Json& panel = json.at("panels")[0];
  const Json& first = panel.at("lines")[0];
  const Json& second = panel.at("lines")[1];
  EXPECT_EQ(first.at("x"), second.at("y"));
  EXPECT_EQ(first.at("x"), panel.at("bands")[0].at("x"));
  EXPECT_EQ(second.at("style"), "dashed");
  EXPECT_EQ(second.at("color"), 4);
  // The band has the first colour of the palette, the line that has none of its own the next.
  EXPECT_EQ(panel.at("bands")[0].at("color"), 0);
  EXPECT_EQ(first.at("color"), 1);
  const auto& x = columns[first.at("x").get<std::size_t>()];
  const auto& y = columns[first.at("y").get<std::size_t>()];
  for (std::size_t i = 0; i < time.size(); ++i) {
    // A clock that began long ago keeps its steps: 2^-24 of them, not of the time.
    EXPECT_NEAR(x[i], time[i], 1e-9);
    EXPECT_EQ(std::isnan(y[i]), std::isnan(value[i]));
  }
  EXPECT_EQ(y[0], 1.5);
  EXPECT_NEAR(y[2], value[2], 1e-7);
}

TEST(PlotData, SmallNumbersBesideLargeOnesKeepTheirDigits) {
  Figure figure;
  figure.plot.panels = {{.lines = {{.x = {1.0, 1e-12, 1e12}, .y = {3.0, 3.0, 3.0}}}}};
  const auto columns = columns_of(Json::parse(plot_data(figure)));
  EXPECT_NEAR(columns[0][1], 1e-12, 1e-19);
  EXPECT_NEAR(columns[0][2], 1e12, 1e5);
  EXPECT_EQ(columns[1], (std::vector<double>{3.0, 3.0, 3.0}));
}

TEST(PlotData, WhatAxesMarksAndStretchesSayIsThereAndEndsNoElement) {
  Figure figure{.title = "Title of the figure"};
  figure.plot = {.x_label = "</script><b>", .log_x = true, .unit_circle = true, .clock = "c"};
  figure.plot.panels = {{.y_label = "y",
                         .marks = {{2.0, "m", true}},
                         .log_y = true,
                         .notes = {{1.0, 2.0, "n"}},
                         .y_limits = PlotLimits{0.0, 3.0},
                         .spans = {{0.5, 0.75, "s"}},
                         .y_ticks = {{1.0, "kS"}}}};
  const std::string text = plot_data(figure);
  EXPECT_EQ(text.find('<'), std::string::npos);
  const Json json = Json::parse(text);
  EXPECT_EQ(json.at("title"), "Title of the figure");
  EXPECT_EQ(json.at("x"), "</script><b>");
  EXPECT_EQ(json.at("clock"), "c");
  EXPECT_TRUE(json.at("logX").get<bool>() && json.at("circle").get<bool>());
  EXPECT_FALSE(json.at("equal").get<bool>());
  const Json& panel = json.at("panels")[0];
  EXPECT_EQ(panel.at("limits"), Json({0.0, 3.0}));
  EXPECT_EQ(panel.at("marks")[0], Json({{"at", 2.0}, {"label", "m"}, {"vertical", true}}));
  EXPECT_EQ(panel.at("spans")[0], Json({{"from", 0.5}, {"to", 0.75}, {"label", "s"}}));
  EXPECT_EQ(panel.at("notes")[0], Json({{"x", 1.0}, {"y", 2.0}, {"text", "n"}}));
  EXPECT_EQ(panel.at("ticks")[0], Json({{"at", 1.0}, {"label", "kS"}}));
}

TEST(PlotData, AnAnimationsPartsNameTheirColumns) {
  const double up = std::nan("");
  Animation animation{.title = "<b>", .clock = "c", .time = {0.0, 0.5, 1.0}};
  animation.parts = {{.label = "carriage",
                      .x = {0.0, up, 1.0},
                      .y = {2.0, up, 3.0},
                      .color = 9,
                      .to_y = {4.0, 5.0, 6.0}},
                     {.x = {1.0}, .y = {1.0}, .style = PartStyle::ground}};
  animation.values = {{"position", "m", {4.0, 5.0, 6.0}}};
  const std::string text = animation_data(animation);
  EXPECT_EQ(text.find('<'), std::string::npos);
  const Json json = Json::parse(text);
  const auto columns = columns_of(json);
  const auto column = [&](const Json& index) { return columns.at(index.get<std::size_t>()); };
  EXPECT_EQ(json.at("title"), "<b>");
  EXPECT_EQ(json.at("clock"), "c");
  EXPECT_EQ(column(json.at("time")), animation.time);
  const Json& part = json.at("parts")[0];
  EXPECT_EQ(part.at("style"), "filled");
  EXPECT_EQ(part.at("color"), 2);
  EXPECT_EQ(column(part.at("toY")), animation.parts[0].to_y);
  EXPECT_TRUE(std::isnan(column(part.at("x"))[1]));
  EXPECT_FALSE(part.contains("toX") || part.contains("angle")) << "what rests needs no column";
  EXPECT_EQ(json.at("parts")[1].at("style"), "ground");
  EXPECT_EQ(json.at("values")[0].at("values"), part.at("toY"));
}

}  // namespace
}  // namespace flyball::report::plot_data_test
