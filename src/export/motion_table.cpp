#include <flyball/export/motion_table.hpp>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>

#include "core/try.hpp"
#include "export/text.hpp"

namespace flyball::exports {

namespace {

constexpr std::string_view in_motion_table = "motion_table";

bool is_identifier(std::string_view name) {
  return !name.empty() && !(name.front() >= '0' && name.front() <= '9') &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return c == '_' || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                  (c >= '0' && c <= '9');
         });
}

}  // namespace

Expected<std::string> motion_table(const TimeSeries& table, const std::string& name,
                                   const std::string& about, std::span<const MotionRate> rates) {
  if (table.rows() < 2 || table.columns().empty()) {
    return refusal(ArgumentError::empty, in_motion_table, "the table")
        .got(fmt::format("of {} rows and {} columns", table.rows(), table.columns().size()))
        .expected("two rows and a column or more");
  }
  const auto check_name = [](const std::string& of) -> Expected<void> {
    if (!is_identifier(of)) {
      return refusal(ArgumentError::malformed, in_motion_table, "a name")
          .got(fmt::format("\"{}\"", cut(printable(of), 40)))
          .expected("an identifier of C++");
    }
    return {};
  };
  FLYBALL_CHECK(check_name(name));
  std::string members = "  double time;  // s\n";
  std::string mixed;
  std::string cubics;
  const auto is_column = [&](std::string_view of) {
    return std::any_of(table.columns().begin(), table.columns().end(),
                       [&](const TimeSeries::Column& column) { return column.name == of; });
  };
  for (const MotionRate& rate : rates) {
    for (const std::string_view of : {rate.value, rate.rate}) {
      if (!is_column(of)) {
        return refusal(ArgumentError::unknown_name, in_motion_table, "a rate's column")
            .got(fmt::format("\"{}\"", cut(printable(of), 40)))
            .expected("one of the table");
      }
    }
  }
  for (const TimeSeries::Column& column : table.columns()) {
    FLYBALL_CHECK(check_name(column.name));
    members += fmt::format("  double {};  // {}\n", column.name, ascii(column.unit));
    const auto rate = std::find_if(rates.begin(), rates.end(),
                                   [&](const MotionRate& one) { return one.value == column.name; });
    if (rate != rates.end()) {
      mixed +=
          fmt::format(",\n          cubic(a.{0}, a.{1}, b.{0}, b.{1})", column.name, rate->rate);
      cubics += fmt::format("{}{} with {}", cubics.empty() ? "" : ", ", column.name, rate->rate);
    } else {
      mixed += fmt::format(",\n          a.{0} + s * (b.{0} - a.{0})", column.name);
    }
    for (const double value : column.values) {
      if (!std::isfinite(value)) {
        return refusal(ArgumentError::not_finite, in_motion_table, column.name)
            .got(fmt::format("{}", value))
            .expected("finite");
      }
    }
  }
  std::string rows;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    rows += fmt::format("    {{{}", literal(table.time()[i]));
    for (const TimeSeries::Column& column : table.columns()) {
      rows += ", " + literal(column.values[i]);
    }
    rows += "},\n";
  }
  std::string between = "/// What the table says at a time: between two rows in proportion.\n";
  std::string cubic;
  if (!cubics.empty()) {
    between =
        "/// What the table says at a time. Between two rows, h apart, values go along the cubic "
        "that\n"
        "/// has both rows' values and rates (" +
        ascii(cubics) +
        "):\n"
        "/// within h^4/384 of their largest fourth derivative, and where the rate's own rate "
        "jumps\n"
        "/// by J between them within 0.017 h^2 J. The others go in proportion.\n";
    cubic =
        "  const double h = b.time - a.time;\n"
        "  const auto cubic = [s, h](double p, double v, double q, double w) noexcept {\n"
        "    return p + s * (h * v + s * (3.0 * (q - p) - h * (2.0 * v + w) +\n"
        "                                 s * (2.0 * (p - q) + h * (v + w))));\n"
        "  };\n";
  }
  return fmt::format(
      "// {}\n"
      "#pragma once\n\n"
      "#include <algorithm>\n"
      "#include <array>\n\n"
      "namespace {} {{\n\n"
      "struct Row {{\n{}}};\n\n"
      "inline constexpr std::array<Row, {}> table{{{{\n{}}}}};\n\n"
      "{}"
      "[[nodiscard]] inline Row at(double time) noexcept {{\n"
      "  if (!(time > table.front().time)) {{\n"
      "    return table.front();\n"
      "  }}\n"
      "  if (time >= table.back().time) {{\n"
      "    return table.back();\n"
      "  }}\n"
      "  const auto next = std::upper_bound(table.begin(), table.end(), time,\n"
      "                                     [](double t, const Row& row) {{ return t < row.time; "
      "}});\n"
      "  const Row& b = *next;\n"
      "  const Row& a = *(next - 1);\n"
      "  const double s = (time - a.time) / (b.time - a.time);\n"
      "{}"
      "  return {{time{}}};\n"
      "}}\n\n"
      "}}  // namespace {}\n",
      ascii(comment_text(cut(about, 200))), name, members, table.rows(), rows, between, cubic,
      mixed, name);
}

}  // namespace flyball::exports
