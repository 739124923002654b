// A profile as table, picture, CSV and C++.
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <flyball/io/csv.hpp>
#include <flyball/io/json_writer.hpp>
#include <flyball/study/profile.hpp>

#include "core/wording.hpp"
#include "study/answer/profile_log.hpp"

namespace flyball::study {

namespace {

using text::exact;
using text::number;

constexpr const char* profile_schema = "flyball.profile/1";

std::string to_json(const ProfileResult& result) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", profile_schema);
    json.add("kind", to_string(result.kind));
    json.add("unit", result.unit);
    json.add("reasons", result.reasons);
    json.add({{"duration", result.duration},
              {"trapezoid_duration", result.other_duration},
              {"peak_velocity", result.peak_velocity},
              {"peak_acceleration", result.peak_acceleration}});
    const MotionLimits all = result.limits.both_ways();
    json.object("limits", [&] {
      json.add({{"velocity", all.velocity},
                {"acceleration", all.acceleration},
                {"deceleration", all.deceleration},
                {"reverse_velocity", all.reverse_velocity}});
      if (std::isfinite(all.jerk)) {
        json.add({{"jerk", all.jerk}});
      }
    });
    json.add("changes", result.changes);
    json.add({{"period", result.job.period.si()}});
    json.add("time", result.table.time());
    for (const TimeSeries::Column& column : result.table.columns()) {
      json.add(column.name, column.values);
    }
  });
  return std::move(json).text();
}

/// The table as constants that a robot's program can include without Flyball.
std::string cpp_table(const ProfileResult& result) {
  std::string code = fmt::format(
      "// A {} profile over {} {} in {} s, every {} s; the last row is its end.\n"
      "#pragma once\n\n"
      "#include <array>\n\n"
      "namespace profile {{\n\n"
      "struct Row {{\n"
      "  double time;          // s\n"
      "  double position;      // {}\n"
      "  double velocity;      // {}/s\n"
      "  double acceleration;  // {}/s^2\n"
      "}};\n\n"
      "inline constexpr std::array<Row, {}> table{{{{\n",
      to_string(result.kind), number(result.job.to.position - result.job.from.position),
      result.unit, number(result.duration), number(result.job.period.si()), result.unit,
      result.unit, result.unit, result.table.rows());
  const auto& columns = result.table.columns();
  for (std::size_t i = 0; i < result.table.rows(); ++i) {
    code += fmt::format("    {{{}, {}, {}, {}}},\n", exact(result.table.time()[i]),
                        exact(columns[0].values[i]), exact(columns[1].values[i]),
                        exact(columns[2].values[i]));
  }
  code += "}};\n\n}  // namespace profile\n";
  return code;
}

Figure figure_of(const ProfileResult& result) {
  Figure figure{"motion",
                "profile",
                fmt::format("{} profile", to_string(result.kind)),
                "Position, velocity and acceleration. Dashed: the limits.",
                {}};
  figure.title[0] = static_cast<char>(figure.title[0] - 'a' + 'A');
  figure.plot.title = figure.title;
  figure.plot.x_label = "Time (s)";
  figure.plot.clock = "time";
  const MotionLimits all = result.limits.both_ways();
  const auto& columns = result.curve.columns();
  const char* const names[] = {"Position", "Velocity", "Acceleration"};
  for (std::size_t i = 0; i < 3; ++i) {
    PlotPanel panel{.y_label = fmt::format("{} ({})", names[i], columns[i].unit)};
    panel.lines.push_back({.label = names[i],
                           .x = result.curve.time(),
                           .y = columns[i].values,
                           .style = LineStyle::solid,
                           .color = static_cast<int>(i)});
    if (i == 1) {
      panel.marks = {{.at = all.velocity}, {.at = -all.reverse_velocity}};
    } else if (i == 2 && result.kind != ProfileKind::exponential) {
      panel.marks = {{.at = all.acceleration}, {.at = -all.deceleration}};
    }
    figure.plot.panels.push_back(std::move(panel));
  }
  return figure;
}

}  // namespace

Answer answer_of(const ProfileResult& result) {
  const std::string& unit = result.unit;
  Answer answer{.schema = profile_schema, .json = to_json(result)};
  Document& document = answer.document;
  document.title = "Motion profile";
  const bool vowel = result.kind == ProfileKind::exponential || result.kind == ProfileKind::s_curve;
  document.verdict.line = fmt::format(
      "{} {} profile over {} {} takes {} s.", vowel ? "An" : "A", to_string(result.kind),
      number(result.job.to.position - result.job.from.position), unit, number(result.duration));
  Section motion{"motion", "The motion", {}};
  Facts facts;
  facts.add("duration", quantity(result.duration, "s", 6));
  if (result.kind != ProfileKind::trapezoid) {
    facts.add("a trapezoid would take", quantity(result.other_duration, "s", 6));
  }
  facts.add("largest velocity", quantity(result.peak_velocity, unit + "/s"));
  facts.add("largest acceleration", quantity(result.peak_acceleration, unit + "/s²"));
  const MotionLimits all = result.limits.both_ways();
  if (std::isfinite(all.jerk)) {
    facts.add("jerk limit", quantity(all.jerk, unit + "/s³"));
    facts.add("time to full acceleration", quantity(all.acceleration / all.jerk, "s"));
  }
  motion.blocks.emplace_back(std::move(facts));
  for (const std::string& reason : result.reasons) {
    motion.blocks.emplace_back(Paragraph{reason});
  }
  Table table{.caption = "Ten instants of it",
              .header = {"time (s)", "position (" + unit + ")", "velocity (" + unit + "/s)",
                         "acceleration (" + unit + "/s²)"},
              .words = {}};
  constexpr std::size_t shown = 10;
  const std::size_t rows = result.table.rows();
  for (std::size_t k = 0; k <= shown; ++k) {
    const std::size_t i = k * (rows - 1) / shown;
    if (k > 0 && i == (k - 1) * (rows - 1) / shown) {
      continue;
    }
    std::vector<Value> row{quantity(result.table.time()[i], "s", 4, false)};
    for (const TimeSeries::Column& column : result.table.columns()) {
      row.push_back(quantity(column.values[i], column.unit, 4, false));
    }
    table.rows.push_back(std::move(row));
  }
  motion.blocks.emplace_back(std::move(table));
  document.sections.push_back(std::move(motion));
  answer.figures.push_back(figure_of(result));
  answer.files.push_back({"data/profile.csv", to_csv(result.table)});
  answer.files.push_back({"profile.hpp", cpp_table(result)});
  for (AnswerFile& file : log_of(result.table)) {
    answer.files.push_back(std::move(file));
  }
  return answer;
}

}  // namespace flyball::study
