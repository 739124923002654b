// Several axes that move together, as table, pictures, CSV and C++.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include <flyball/io/csv.hpp>
#include <flyball/io/json_writer.hpp>
#include <flyball/study/axes.hpp>

#include "core/wording.hpp"
#include "study/answer/profile_log.hpp"

namespace flyball::study {

namespace {

using text::exact;
using text::number;

constexpr const char* schema = "flyball.axes/1";

std::string to_json(const AxesResult& result) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", schema);
    json.add("synchronize", result.in_phase ? "phase" : "time");
    json.add({{"duration", result.duration}});
    if (result.slowest >= 0) {
      json.add("slowest", result.axes[static_cast<std::size_t>(result.slowest)].name);
    }
    json.list("axes", result.axes, [&](const AxisResult& axis) {
      json.object([&] {
        json.add("name", axis.name);
        json.add("unit", axis.unit);
        json.add({{"from", axis.from.position},
                  {"to", axis.to.position},
                  {"alone", axis.alone},
                  {"peak_velocity", axis.peak_velocity},
                  {"peak_acceleration", axis.peak_acceleration}});
        const MotionLimits all = axis.limits.both_ways();
        json.object("limits", [&] {
          json.add({{"velocity", all.velocity},
                    {"acceleration", all.acceleration},
                    {"deceleration", all.deceleration},
                    {"reverse_velocity", all.reverse_velocity},
                    {"jerk", all.jerk}});
        });
        json.add("changes", axis.changes);
      });
    });
    json.add({{"period", result.job.period.si()}});
    json.add("time", result.table.time());
    json.object("columns", [&] {
      for (const TimeSeries::Column& column : result.table.columns()) {
        json.add(column.name, column.values);
      }
    });
  });
  return std::move(json).text();
}

/// The table as constants that a robot's program can include without Flyball.
std::string cpp_table(const AxesResult& result) {
  std::string code = fmt::format(
      "// {} axes in {} s, every {} s; the last row is the end.\n// Axes, in their order:",
      result.axes.size(), number(result.duration), number(result.job.period.si()));
  for (const AxisResult& axis : result.axes) {
    std::string name = axis.name;
    for (char& c : name) {
      c = static_cast<unsigned char>(c) < 0x20 || c == '\\' ? ' ' : c;
    }
    code += fmt::format(" {} ({})", name, axis.unit);
  }
  code += fmt::format(
      "\n#pragma once\n\n#include <array>\n\nnamespace profile {{\n\n"
      "inline constexpr int axes = {};\n\n"
      "struct Row {{\n"
      "  double time;                              // s\n"
      "  std::array<double, axes> position;\n"
      "  std::array<double, axes> velocity;        // per s\n"
      "  std::array<double, axes> acceleration;    // per s^2\n"
      "}};\n\n"
      "inline constexpr std::array<Row, {}> table{{{{\n",
      result.axes.size(), result.table.rows());
  const auto& columns = result.table.columns();
  for (std::size_t i = 0; i < result.table.rows(); ++i) {
    code += "    {" + exact(result.table.time()[i]);
    for (std::size_t of = 0; of < 3; ++of) {
      code += ", {{";
      for (std::size_t k = 0; k < result.axes.size(); ++k) {
        code += (k > 0 ? ", " : "") + exact(columns[3 * k + of].values[i]);
      }
      code += "}}";
    }
    code += "},\n";
  }
  code += "}};\n\n}  // namespace profile\n";
  return code;
}

/// The axes of one unit in a picture of three panels.
Figure figure_of(const AxesResult& result, const std::string& unit, bool alone) {
  const std::string what = unit == "rad" ? "angles" : "lengths";
  Figure figure{alone ? "motion" : what,
                alone ? "profile" : "profile_" + what,
                alone ? "The motion of all axes" : fmt::format("The motion of the {}", what),
                "Position, velocity and acceleration of each axis.",
                {}};
  figure.plot.title = figure.title;
  figure.plot.x_label = "Time (s)";
  figure.plot.clock = "time";
  const char* const names[] = {"Position", "Velocity", "Acceleration"};
  const char* const per[] = {"", "/s", "/s²"};
  for (std::size_t of = 0; of < 3; ++of) {
    PlotPanel panel{.y_label = fmt::format("{} ({}{})", names[of], unit, per[of])};
    int color = 0;
    for (std::size_t k = 0; k < result.axes.size(); ++k) {
      if (result.axes[k].unit == unit) {
        panel.lines.push_back({.label = result.axes[k].name,
                               .x = result.curve.time(),
                               .y = result.curve.columns()[3 * k + of].values,
                               .style = LineStyle::solid,
                               .color = color++});
      }
    }
    figure.plot.panels.push_back(std::move(panel));
  }
  return figure;
}

}  // namespace

Answer answer_of(const AxesResult& result) {
  Answer answer{.schema = schema, .json = to_json(result)};
  Document& document = answer.document;
  document.title = "Motion of several axes";
  const std::size_t count = result.axes.size();
  document.verdict.line = fmt::format(
      "{} {} in {} s{}.", count, count == 1 ? "axis moves" : "axes move", number(result.duration),
      result.in_phase ? ", along a straight line" : ", all to arrive at once");
  Section motion{"motion", "The motion", {}};
  Facts facts;
  facts.add("duration", quantity(result.duration, "s", 6));
  facts.add("synchronized", result.in_phase ? "in phase: along a straight line" : "in time",
            Tone::plain);
  if (result.slowest >= 0) {
    facts.add(result.in_phase ? "limited by" : "the others wait for",
              result.axes[static_cast<std::size_t>(result.slowest)].name, Tone::plain);
  }
  motion.blocks.emplace_back(std::move(facts));
  if (result.job.synchronize == "phase" && !result.in_phase) {
    motion.blocks.emplace_back(Paragraph{
        result.job.least.si() > 0.0
            ? "They cannot move along a straight line: their velocities or accelerations do not "
              "lie on it, or the least duration is longer than the line takes. They arrive at "
              "once instead."
            : "They cannot move along a straight line: their velocities or accelerations do not "
              "lie on it. They arrive at once instead."});
  }
  Table axes{.caption = "Axes",
             .header = {"axis", "from", "to", "alone (s)", "largest velocity", "its limit",
                        "largest acceleration", "its limit"},
             .words = {0}};
  for (const AxisResult& axis : result.axes) {
    const MotionLimits all = axis.limits.both_ways();
    const std::string rate = axis.unit + "/s";
    const std::string change = axis.unit + "/s²";
    axes.rows.push_back({Value(axis.name, Tone::plain), quantity(axis.from.position, axis.unit),
                         quantity(axis.to.position, axis.unit), quantity(axis.alone, "s", 4, false),
                         quantity(axis.peak_velocity, rate),
                         quantity(std::max(all.velocity, all.reverse_velocity), rate),
                         quantity(axis.peak_acceleration, change),
                         quantity(std::max(all.acceleration, all.deceleration), change)});
  }
  motion.blocks.emplace_back(std::move(axes));
  document.sections.push_back(std::move(motion));
  bool angles = false;
  bool lengths = false;
  for (const AxisResult& axis : result.axes) {
    (axis.unit == "rad" ? angles : lengths) = true;
  }
  for (const auto& [unit, there] : {std::pair("m", lengths), std::pair("rad", angles)}) {
    if (there) {
      answer.figures.push_back(figure_of(result, unit, angles != lengths));
    }
  }
  answer.files.push_back({"data/profile.csv", to_csv(result.table)});
  answer.files.push_back({"profile.hpp", cpp_table(result)});
  for (AnswerFile& file : log_of(result.table)) {
    answer.files.push_back(std::move(file));
  }
  return answer;
}

}  // namespace flyball::study
