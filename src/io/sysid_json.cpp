#include <flyball/io/sysid_json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <flyball/io/json_text.hpp>
#include <flyball/io/log_error.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "io/json_walk.hpp"
#include "io/signals.hpp"
#include "io/sysid_columns.hpp"
#include "io/sysid_rows.hpp"
#include "io/text.hpp"

namespace flyball {
namespace {

using io::run_names;
using io::SysIdRows;
using io::SysIdTable;

Refusal not_sysid(const std::string& source, std::string got) {
  return refusal(LogError::not_a_log, source, "the JSON")
      .got(std::move(got))
      .expected("an object with slow-forward, slow-backward, fast-forward and fast-backward")
      .hint("give the sysid_data….json that the logger wrote");
}

/// Which layout the rows have: by their width, and 9 columns by what else the file says.
SysIdJson::Layout layout_of(const SysIdRows& handler, std::size_t columns, bool truncated) {
  if (columns == 4) {
    return SysIdJson::Layout::mechanism;
  }
  if (columns == 10) {
    return SysIdJson::Layout::characterization_2020;
  }
  // SysId says `sysid`, `test` and `units`, but at the end, where a cut takes them away; it also
  // sorts its keys, which its forerunner did not.
  const bool says_so = handler.sysid || !handler.test.empty() || !handler.units.empty();
  const bool sorted = truncated && handler.first_key == "fast-backward";
  return says_so || sorted ? SysIdJson::Layout::drive : SysIdJson::Layout::characterization_2019;
}

/// How many numbers most rows have.
std::size_t common_width(const SysIdRows& handler) {
  std::array<std::size_t, io::max_columns + 1> count{};
  for (const SysIdTable& table : handler.tables) {
    for (const unsigned char width : table.widths) {
      ++count[width];
    }
  }
  return static_cast<std::size_t>(std::max_element(count.begin(), count.end()) - count.begin());
}

struct Dropped {
  std::size_t non_finite = 0;
  std::size_t other_width = 0;
  std::size_t backward = 0;
};

/// A table's good rows in time order, spread over the columns of a run.
SysIdJson::Run to_run(std::string name, SysIdTable& table, SysIdJson::Layout layout,
                      std::size_t columns, Dropped& dropped) {
  // The good rows move to the front, so that a long log is not held twice.
  std::vector<double>& values = table.values;
  std::size_t from = 0;
  std::size_t rows = 0;
  bool sorted = true;
  for (const unsigned char width : table.widths) {
    const auto row = values.begin() + static_cast<std::ptrdiff_t>(from);
    from += width;
    if (width != columns) {
      ++dropped.other_width;
    } else if (!std::all_of(row, row + width, [](double value) { return std::isfinite(value); })) {
      ++dropped.non_finite;
    } else {
      const auto to = values.begin() + static_cast<std::ptrdiff_t>(rows * columns);
      std::copy(row, row + width, to);
      const bool backward = rows > 0 && to[0] < values[(rows - 1) * columns];
      dropped.backward += backward ? 1 : 0;
      sorted = sorted && !backward;
      ++rows;
    }
  }
  std::vector<std::size_t> order(rows);
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (!sorted) {
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return values[a * columns] < values[b * columns];
    });
  }
  SysIdJson::Run run;
  run.name = std::move(name);
  const auto members = io::columns_of(layout);
  for (std::size_t c = 0; c < members.size(); ++c) {
    if (members[c] != nullptr) {
      std::vector<double>& column = run.*members[c];
      column.reserve(rows);
      for (const std::size_t row : order) {
        column.push_back(values[row * columns + c]);
      }
    }
  }
  std::vector<double>().swap(table.values);  // Frees it, as the next table needs the memory.
  std::vector<unsigned char>().swap(table.widths);
  return run;
}

void tell_missing(SysIdJson& log, const SysIdRows& handler) {
  for (std::size_t i = 0; i < run_names.size(); ++i) {
    if (log.find(run_names[i]) == nullptr) {
      const bool present = handler.tables[i].present;
      if (!present) {
        log.missing.emplace_back(run_names[i]);
      }
      warn(log.diagnostics, "missing_run", "the test {} {}", run_names[i],
           present ? "has no usable row" : "is not in the file");
    }
  }
  const bool legacy = log.layout == SysIdJson::Layout::characterization_2019 ||
                      log.layout == SysIdJson::Layout::characterization_2020;
  const auto tell = [&](std::string_view key, std::string_view consequence) {
    log.missing.emplace_back(key);
    log.diagnostics.push_back({"missing_key", legacy ? Severity::info : Severity::warning,
                               fmt::format("\"{}\" is not in the file; {}", key, consequence)});
  };
  if (log.test.empty()) {
    tell("test", "it does not say which mechanism was tested");
  }
  if (log.units.empty()) {
    tell("units", "it does not say the unit of position");
  }
  if (!log.units_per_rotation) {
    tell("unitsPerRotation", "positions cannot be scaled from rotations by the file alone");
  }
  if (legacy) {
    note(log.diagnostics, "frc_characterization",
         "a drive log of frc-characterization {}, the forerunner of SysId",
         log.layout == SysIdJson::Layout::characterization_2019 ? "2019" : "2020");
  }
}

}  // namespace

const SysIdJson::Run* SysIdJson::find(std::string_view name) const noexcept {
  const auto run =
      std::find_if(runs.begin(), runs.end(), [&](const Run& r) { return r.name == name; });
  return run == runs.end() ? nullptr : &*run;
}

Expected<SysIdJson> parse_sysid_json(std::string_view text, const std::string& source) {
  if (io::trim(text).empty()) {
    return refusal(LogError::empty, source, "the file")
        .got("empty")
        .expected("a SysId JSON")
        .hint("record it again, or copy it again");
  }
  SysIdRows handler;
  io::WholeText whole(text);
  bool complete = io::JsonWalk(whole, handler).walk() == io::JsonEnd::complete;
  const bool ordinary = complete;
  // An allocated tail that was never filled is zeros; nlohmann's parser calls the first the end.
  const std::size_t content_end = text.find_last_not_of(std::string_view(" \t\r\n\0", 5)) + 1;
  const std::size_t zero = complete ? std::string_view::npos : text.find('\0');
  if (zero < content_end) {
    return refusal(LogError::malformed, io::place(source, text, zero), "the JSON")
        .got("cut by a zero byte, with more behind it")
        .expected("valid JSON")
        .hint("copy the file again: what stands behind the zero byte is not read");
  }
  if (!complete) {  // nlohmann's parser says what is wrong, and where
    handler = SysIdRows();
    complete = nlohmann::json::sax_parse(text.begin(), text.end(), &handler);
  }
  if (!complete) {
    const std::string replaced = io::without_nan_words(text);
    if (replaced != text) {
      handler = SysIdRows();
      complete = nlohmann::json::sax_parse(replaced.begin(), replaced.end(), &handler);
    }
  }
  // The parser counts from 1.
  const bool truncated = !complete && handler.error_at > content_end;
  if (!complete && !truncated) {
    const std::size_t detail = handler.error_text.rfind("; ");
    return refusal(LogError::malformed,
                   io::place(source, text, handler.error_at == 0 ? 0 : handler.error_at - 1),
                   "the JSON")
        .got("broken")
        .expected("valid JSON")
        .hint("copy the file again, or repair that place")
        .with("parser", io::printable(detail == std::string::npos
                                          ? std::string_view(handler.error_text)
                                          : std::string_view(handler.error_text).substr(detail + 2),
                                      120));
  }
  if (const auto repeated = ordinary ? std::nullopt : repeated_key(text)) {
    return refusal(LogError::malformed, io::place(source, text, repeated->at), "the JSON")
        .got(fmt::format("an object with the key \"{}\" twice", io::printable(repeated->key)))
        .expected("an object with each key once")
        .hint("take one of them out");
  }
  if (!handler.top_is_object) {
    return not_sysid(source, "a list or a single value");
  }
  const bool any_test = std::any_of(handler.tables.begin(), handler.tables.end(),
                                    [](const SysIdTable& table) { return table.present; });
  if (!any_test && !handler.sysid && !truncated) {
    return not_sysid(source, handler.first_key ? fmt::format("an object that begins with \"{}\"",
                                                             io::printable(*handler.first_key, 30))
                                               : std::string("an empty object"));
  }

  SysIdJson log;
  log.test = handler.test;
  log.units = handler.units;
  log.units_per_rotation = handler.units_per_rotation;
  const std::size_t columns = common_width(handler);
  log.layout = layout_of(handler, columns, truncated);
  if (truncated) {
    warn(log.diagnostics, "truncated_log",
         "the file ends in the middle, after {} bytes; the complete rows before the cut are used",
         text.size());
    log.diagnostics.back().place = place_of(text, text.size());
  }
  if (complete && zero != std::string_view::npos) {
    note(log.diagnostics, "unfilled_tail", "the file ends in {} zero bytes, which are passed over",
         text.size() - content_end);
  }
  Dropped dropped;
  dropped.other_width = handler.odd_rows;
  for (std::size_t i = 0; i < run_names.size(); ++i) {
    SysIdJson::Run run =
        to_run(std::string(run_names[i]), handler.tables[i], log.layout, columns, dropped);
    if (!run.time.empty()) {
      log.runs.push_back(std::move(run));
    }
  }
  if (dropped.non_finite > 0) {
    warn(log.diagnostics, "non_finite_rows", "{} with null, NaN or infinity dropped",
         io::counted(dropped.non_finite, "row"));
  }
  if (dropped.other_width > 0) {
    warn(log.diagnostics, "malformed_rows", "{} without exactly {} numbers dropped",
         io::counted(dropped.other_width, "row"),
         columns == 0 ? std::string("4, 9 or 10") : std::to_string(columns));
  }
  if (dropped.backward > 0) {
    warn(log.diagnostics, "unsorted_time", "time runs backwards {}; the rows were sorted",
         io::counted(dropped.backward, "time"));
  }
  if (!handler.unknown_keys.empty()) {
    note(log.diagnostics, "unknown_keys", "{} not used, such as \"{}\"",
         io::counted(handler.unknown_keys.size(), "key"),
         io::printable(handler.unknown_keys.front(), 30));
  }
  if (log.runs.empty()) {
    Error error = refusal(LogError::no_data, source, "the SysId JSON")
                      .got(truncated ? "cut before its first complete row"
                                     : "without one complete row of finite numbers")
                      .hint("record the tests again");
    return tl::unexpected(io::with_diagnostics(std::move(error), log.diagnostics));
  }
  tell_missing(log, handler);
  return log;
}

}  // namespace flyball
