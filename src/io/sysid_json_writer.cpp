#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/io/file.hpp>
#include <flyball/io/json_writer.hpp>
#include <flyball/io/sysid_json.hpp>

#include "core/try.hpp"
#include "io/sysid_columns.hpp"

namespace flyball {
namespace {

Expected<void> check_run(const io::Run& run, std::span<const io::Column> columns) {
  for (std::size_t c = 0; c < columns.size(); ++c) {
    if (columns[c] == nullptr) {
      continue;
    }
    const std::vector<double>& values = run.*columns[c];
    if (values.size() != run.time.size()) {
      return refusal(ArgumentError::wrong_shape, "to_sysid_json",
                     fmt::format("column {} of {}", c, run.name))
          .got(fmt::format("{} values long", values.size()))
          .expected(fmt::format("one value a row ({})", run.time.size()));
    }
    for (const double value : values) {
      FLYBALL_CHECK(check_finite(value, "to_sysid_json", run.name));
    }
  }
  return {};
}

}  // namespace

Expected<std::string> to_sysid_json(const SysIdJson& log) {
  const std::span<const io::Column> columns = io::columns_of(log.layout);
  std::string text = "{";
  const char* separator = "\n";
  for (const io::Run& run : log.runs) {
    FLYBALL_CHECK(check_run(run, columns));
    text += fmt::format("{}  {}: [", separator, json_quoted(run.name));
    separator = ",\n";
    for (std::size_t i = 0; i < run.time.size(); ++i) {
      text += i == 0 ? "\n    [" : ",\n    [";
      for (std::size_t c = 0; c < columns.size(); ++c) {
        text += c == 0 ? "" : ", ";
        text += columns[c] == nullptr ? "0.0" : json_number((run.*columns[c])[i]);
      }
      text += "]";
    }
    text += "\n  ]";
  }
  const bool legacy = log.layout == SysIdJson::Layout::characterization_2019 ||
                      log.layout == SysIdJson::Layout::characterization_2020;
  if (!legacy) {
    text += fmt::format("{}  \"sysid\": true", separator);
    separator = ",\n";
  }
  if (!log.test.empty()) {
    text += fmt::format("{}  \"test\": {}", separator, json_quoted(log.test));
    separator = ",\n";
  }
  if (!log.units.empty()) {
    text += fmt::format("{}  \"units\": {}", separator, json_quoted(log.units));
    separator = ",\n";
  }
  if (log.units_per_rotation) {
    FLYBALL_CHECK(check_finite(*log.units_per_rotation, "to_sysid_json", "units_per_rotation"));
    text += fmt::format("{}  \"unitsPerRotation\": {}", separator,
                        json_number(*log.units_per_rotation));
  }
  return text + "\n}\n";
}

Expected<void> write_sysid_json(const std::string& path, const SysIdJson& log) {
  return to_sysid_json(log).and_then(
      [&](const std::string& text) { return write_file_atomically(path, text); });
}

}  // namespace flyball
