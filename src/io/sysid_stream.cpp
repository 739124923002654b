// A SysId JSON, row by row as the parser walks through the file.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <flyball/io/log_error.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "io/json_walk.hpp"
#include "io/log_streams.hpp"
#include "io/sysid_rows.hpp"
#include "io/text.hpp"

namespace flyball::io {

namespace {

/// Hands each row on and forgets it.
class Rows final : public SysIdRows {
 public:
  explicit Rows(LogSink& sink) : sink_(sink) {}

  bool end_array() override {
    SysIdRows::end_array();
    for (std::size_t run = 0; run < tables.size(); ++run) {
      SysIdTable& table = tables[run];
      if (table.widths.empty()) {
        continue;
      }
      const std::size_t width = table.widths.front();
      if (width != 4) {
        drive = true;  // both sides: for who reads it whole
        return false;
      }
      hand_on(run, table.values.data());
      table.values.clear();
      table.widths.clear();
    }
    return true;
  }

  bool drive = false;
  bool unsorted = false;
  std::size_t rows = 0;
  std::size_t not_finite = 0;

 private:
  void hand_on(std::size_t run, const double* row) {
    for (std::size_t c = 0; c < 4; ++c) {
      if (!std::isfinite(row[c])) {
        ++not_finite;
        return;
      }
    }
    if (run != run_) {
      run_ = run;
      last_ = row[0];
      sink_.test(run_names[run]);
    }
    unsorted = unsorted || row[0] < last_;
    last_ = row[0];
    ++rows;
    for (std::size_t c = 1; c < 4; ++c) {
      sink_.number(c - 1, row[0], row[c]);
    }
  }

  LogSink& sink_;
  std::size_t run_ = run_names.size();
  double last_ = 0.0;
};

/// Whether nothing but blanks and the zeros of a tail that was never filled is left.
bool ends_here(ChunkedFile& file) {
  do {
    const std::string_view rest = file.rest();
    if (rest.find_first_not_of(std::string_view(" \t\r\n\0", 5)) != std::string_view::npos) {
      return false;
    }
    file.pass(rest.size());
  } while (file.more());
  return true;
}

}  // namespace

Expected<std::optional<StreamedLog>> stream_sysid_json(ChunkedFile& file, const std::string& source,
                                                       LogSink& sink) {
  sink.channel(0, "voltage", "V");
  sink.channel(1, "position", "");
  sink.channel(2, "velocity", "");
  Rows rows(sink);
  const JsonEnd end = JsonWalk(file, rows).walk();
  const bool complete = end == JsonEnd::complete;
  const bool truncated =
      rows.rows > 0 && (end == JsonEnd::cut || (end == JsonEnd::broken && ends_here(file)));
  if (rows.drive || rows.unsorted || (!complete && !truncated) || !rows.top_is_object) {
    return std::optional<StreamedLog>();  // Whoever reads it whole tells what is wrong.
  }
  StreamedLog log{"SysId JSON", SysIdJson{}, rows.rows, {}};
  log.sysid->test = rows.test;
  log.sysid->units = rows.units;
  log.sysid->units_per_rotation = rows.units_per_rotation;
  log.sysid->layout = SysIdJson::Layout::mechanism;
  if (truncated) {
    warn(log.diagnostics, "truncated_log",
         "the file ends in the middle; the complete rows before the cut are used");
  }
  if (rows.not_finite > 0) {
    warn(log.diagnostics, "non_finite_rows", "{} with null, NaN or infinity dropped",
         counted(rows.not_finite, "row"));
  }
  if (rows.odd_rows > 0) {
    warn(log.diagnostics, "malformed_rows", "{} without exactly 4 numbers dropped",
         counted(rows.odd_rows, "row"));
  }
  if (rows.rows == 0) {
    return refusal(LogError::no_data, source, "the SysId JSON")
        .got("without one complete row of finite numbers")
        .hint("record the tests again");
  }
  return std::optional(std::move(log));
}

}  // namespace flyball::io
