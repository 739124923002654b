// A path through a configuration space as table, pictures, CSV and C++.
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/io/csv.hpp>
#include <flyball/io/json_writer.hpp>
#include <flyball/study/plan.hpp>

#include "core/wording.hpp"
#include "study/answer/plan_parts.hpp"

namespace flyball::study {

namespace {

using text::exact;
using text::number;

constexpr const char* plan_schema = "flyball.plan/1";

const char* method_of(const PlanResult& result) {
  return result.job.ompl ? "ompl" : to_string(result.path.method);
}

bool is_timed(const PlanResult& result) {
  return result.motion.table.rows() > 0;
}

std::string to_json(const PlanResult& result) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", plan_schema);
    json.add("method", method_of(result));
    json.list("axes", result.job.space.axes(), [&](const SpaceAxis& axis) {
      json.object([&] {
        json.add("name", axis.name);
        json.add("unit", axis.unit);
        json.add({{"low", axis.low}, {"high", axis.high}});
      });
    });
    json.add("waypoints", result.path.waypoints);
    json.add({{"length", result.path.length},
              {"moves", static_cast<double>(result.path.moves)},
              {"nodes", static_cast<double>(result.path.nodes)}});
    if (is_timed(result)) {
      const PathMotion& motion = result.motion;
      json.add("traversal", result.job.motion.traversal == Traversal::sequential ? "sequential"
                                                                                 : "synchronized");
      json.add({{"duration", motion.duration},
                {"other_duration", result.other_duration},
                {"clearance", motion.clearance},
                {"clearance_time", motion.clearance_time}});
      json.add("arrivals", motion.arrivals);
      json.add("time", motion.table.time());
      json.object("columns", [&] {
        for (const TimeSeries::Column& column : motion.table.columns()) {
          json.add(column.name, column.values);
        }
      });
    }
  });
  return std::move(json).text();
}

std::string waypoint_csv(const PlanResult& result) {
  std::string csv;
  for (const SpaceAxis& axis : result.job.space.axes()) {
    csv += (csv.empty() ? "" : ",") + axis.name + (axis.unit.empty() ? "" : " (" + axis.unit + ")");
  }
  csv += '\n';
  for (const auto& waypoint : result.path.waypoints) {
    for (std::size_t k = 0; k < waypoint.size(); ++k) {
      csv += (k > 0 ? "," : "") + exact(waypoint[k]);
    }
    csv += '\n';
  }
  return csv;
}

/// The waypoints, and the motion if there is one, as constants that a robot's program can include.
std::string cpp_header(const PlanResult& result) {
  const std::vector<SpaceAxis>& axes = result.job.space.axes();
  std::string code = fmt::format(
      "// A path of {} waypoints, found by {}: straight moves that are free along their whole "
      "length.\n// Axes, in their order:",
      result.path.waypoints.size(), method_of(result));
  for (const SpaceAxis& axis : axes) {
    code += fmt::format(" {} ({})", axis.name, axis.unit.empty() ? "1" : axis.unit);
  }
  code += fmt::format(
      "\n#pragma once\n\n#include <array>\n\nnamespace plan {{\n\n"
      "inline constexpr int axes = {};\n"
      "using Configuration = std::array<double, axes>;\n\n"
      "inline constexpr std::array<Configuration, {}> waypoints{{{{\n",
      axes.size(), result.path.waypoints.size());
  const auto list = [](const std::vector<double>& values) {
    std::string row = "{{";
    for (std::size_t k = 0; k < values.size(); ++k) {
      row += (k > 0 ? ", " : "") + exact(values[k]);
    }
    return row + "}}";
  };
  for (const auto& waypoint : result.path.waypoints) {
    code += "    " + list(waypoint) + ",\n";
  }
  code += "}};\n";
  if (is_timed(result)) {
    const TimeSeries& table = result.motion.table;
    code += fmt::format(
        "\n/// Every {} s; the last row is the end.\nstruct Row {{\n  double time;  // s\n"
        "  Configuration position;\n  Configuration velocity;      // of each axis, per s\n"
        "  Configuration acceleration;  // per s^2\n}};\n\n"
        "inline constexpr std::array<Row, {}> motion{{{{\n",
        number(result.job.motion.period), table.rows());
    for (std::size_t i = 0; i < table.rows(); ++i) {
      code += "    {" + exact(table.time()[i]);
      for (std::size_t of = 0; of < 3; ++of) {
        std::vector<double> values;
        for (std::size_t k = 0; k < axes.size(); ++k) {
          values.push_back(table.columns()[3 * k + of].values[i]);
        }
        code += ", " + list(values);
      }
      code += "},\n";
    }
    code += "}};\n";
  }
  code += "\n}  // namespace plan\n";
  return code;
}

Section path_section(const PlanResult& result) {
  const std::vector<SpaceAxis>& axes = result.job.space.axes();
  Section section{"path", "The path", {}};
  Facts facts;
  facts.add("found by", method_of(result), Tone::plain);
  facts.add("length", quantity(result.path.length, ""));
  facts.add("moves judged", fmt::format("{}", result.path.moves), Tone::plain);
  section.blocks.emplace_back(std::move(facts));
  Table table{.caption = "Waypoints", .header = {"waypoint"}, .words = {0}};
  for (const SpaceAxis& axis : axes) {
    table.header.push_back(axis.name + (axis.unit.empty() ? "" : " (" + axis.unit + ")"));
  }
  table.header.push_back("clearance");
  if (is_timed(result)) {
    table.header.push_back("time (s)");
  }
  for (std::size_t i = 0; i < result.path.waypoints.size(); ++i) {
    const std::vector<double>& waypoint = result.path.waypoints[i];
    std::vector<Value> row{Value(i == 0                                  ? "start"
                                 : i + 1 == result.path.waypoints.size() ? std::string("goal")
                                                                         : fmt::format("{}", i))};
    for (std::size_t k = 0; k < axes.size(); ++k) {
      row.push_back(quantity(waypoint[k], axes[k].unit, 4, false));
    }
    // What rounding leaves of a waypoint on an edge is none.
    const double clearance = result.job.space.clearance(waypoint);
    row.push_back(quantity(clearance > 1e-12 ? clearance : 0.0, "", 3, false));
    if (is_timed(result)) {
      row.push_back(quantity(i == 0 ? 0.0 : result.motion.arrivals[i - 1], "s", 4, false));
    }
    table.rows.push_back(std::move(row));
  }
  section.blocks.emplace_back(std::move(table));
  return section;
}

Section motion_section(const PlanResult& result) {
  const PathMotion& motion = result.motion;
  const bool sequential = result.job.motion.traversal == Traversal::sequential;
  Section section{"motion", "The motion", {}};
  Facts facts;
  facts.add("traversal", sequential ? "sequential" : "synchronized", Tone::plain);
  facts.add("duration", quantity(motion.duration, "s", 6));
  facts.add(sequential ? "synchronized, along the lines, it takes"
                       : "sequential, without stops, it takes",
            quantity(result.other_duration, "s", 6));
  facts.add("least clearance", quantity(motion.clearance, ""));
  facts.add("at", quantity(motion.clearance_time, "s"));
  section.blocks.emplace_back(std::move(facts));
  const bool buffered = std::any_of(result.job.motion.error.begin(), result.job.motion.error.end(),
                                    [](double e) { return e > 0.0; });
  section.blocks.emplace_back(Paragraph{
      buffered ? "Every constraint is kept along the whole motion while each axis is within its "
                 "error of the reference."
               : "Every constraint is kept along the whole motion by the reference itself; give "
                 "axes an error to leave room for tracking.",
      buffered ? Tone::plain : Tone::caution});
  return section;
}

}  // namespace

Answer answer_of(const PlanResult& result) {
  Answer answer{.schema = plan_schema, .json = to_json(result)};
  Document& document = answer.document;
  document.title = "Path through a configuration space";
  const std::size_t moves = result.path.waypoints.size() - 1;
  document.verdict.line = fmt::format(
      "A path of {} free move{} leads from the start to the goal{}.", moves, moves == 1 ? "" : "s",
      is_timed(result) ? fmt::format(", and takes {} s", number(result.motion.duration)) : "");
  document.sections.push_back(path_section(result));
  answer.figures = plan_figures(result);
  if (is_timed(result)) {
    document.sections.push_back(motion_section(result));
    answer.animations = plan_animation(result);
    answer.files.push_back({"data/motion.csv", to_csv(result.motion.table)});
  } else {
    document.verdict.add(Tone::caution,
                         "It is not timed: give every [[axis]] velocity and acceleration.");
  }
  answer.files.push_back({"data/waypoints.csv", waypoint_csv(result)});
  answer.files.push_back({"plan.hpp", cpp_header(result)});
  document.origins.add("space", result.job.path, Tone::plain);
  document.origins.add("seed", fmt::format("{}", result.job.search.seed), Tone::plain);
  return answer;
}

}  // namespace flyball::study
