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

constexpr std::string_view where = "motion_table";

bool is_identifier(std::string_view name) {
  return !name.empty() && !(name.front() >= '0' && name.front() <= '9') &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return c == '_' || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                  (c >= '0' && c <= '9');
         });
}

}  // namespace

Expected<std::string> motion_table(const TimeSeries& table, const std::string& name,
                                   const std::string& about) {
  if (table.rows() < 2 || table.columns().empty()) {
    return refusal(ArgumentError::empty, where, "the table")
        .got(fmt::format("of {} rows and {} columns", table.rows(), table.columns().size()))
        .expected("two rows and a column or more");
  }
  const auto check_name = [](const std::string& of) -> Expected<void> {
    if (!is_identifier(of)) {
      return refusal(ArgumentError::malformed, where, "a name")
          .got(fmt::format("\"{}\"", cut(printable(of), 40)))
          .expected("an identifier of C++");
    }
    return {};
  };
  FLYBALL_CHECK(check_name(name));
  std::string members = "  double time;  // s\n";
  std::string mixed;
  for (const TimeSeries::Column& column : table.columns()) {
    FLYBALL_CHECK(check_name(column.name));
    members += fmt::format("  double {};  // {}\n", column.name, ascii(column.unit));
    mixed += fmt::format(",\n          a.{0} + s * (b.{0} - a.{0})", column.name);
    for (const double value : column.values) {
      if (!std::isfinite(value)) {
        return refusal(ArgumentError::not_finite, where, column.name)
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
  return fmt::format(
      "// {}\n"
      "#pragma once\n\n"
      "#include <algorithm>\n"
      "#include <array>\n\n"
      "namespace {} {{\n\n"
      "struct Row {{\n{}}};\n\n"
      "inline constexpr std::array<Row, {}> table{{{{\n{}}}}};\n\n"
      "/// What the table says at a time: between two rows in proportion.\n"
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
      "  return {{time{}}};\n"
      "}}\n\n"
      "}}  // namespace {}\n",
      ascii(comment_text(cut(about, 200))), name, members, table.rows(), rows, mixed, name);
}

}  // namespace flyball::exports
