#include <flyball/io/csv.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/io/file.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "io/csv_layout.hpp"
#include "io/csv_table.hpp"
#include "io/csv_time.hpp"
#include "io/signals.hpp"
#include "io/text.hpp"

namespace flyball {

namespace io {

bool is_blank_cell(std::string_view cell) {
  if (cell.empty()) {
    return true;
  }
  constexpr std::array<std::string_view, 5> words{"null", "undefined", "n/a", "#n/a", "nil"};
  return cell.size() <= 9 && std::find(words.begin(), words.end(), lower(cell)) != words.end();
}

std::optional<double> cell_number(std::string_view cell) {
  const std::string word = lower(trim(cell));
  if (word == "true" || word == "false") {
    return word == "true" ? 1.0 : 0.0;
  }
  // A comma in a cell of a table that commas separate was quoted: it is a decimal one too.
  if (std::count(word.begin(), word.end(), ',') == 1 && word.find('.') == std::string::npos) {
    std::string with_point = word;
    std::replace(with_point.begin(), with_point.end(), ',', '.');
    return parse_number(with_point);
  }
  return parse_number(word);
}

}  // namespace io

namespace {

using io::CsvTable;

struct Header {
  std::string name;
  std::string unit;
};

/// "Velocity (m/s)", "Velocity [m/s]" and "Position(m)" into name and unit.
Header split_header(std::string_view text) {
  text = io::trim(text);
  for (const auto& [open, close] : {std::pair{'(', ')'}, std::pair{'[', ']'}}) {
    const std::size_t at = text.rfind(open);
    if (text.ends_with(close) && at != std::string_view::npos && at > 0) {
      const std::string_view unit = io::trim(text.substr(at + 1, text.size() - at - 2));
      // "pose[0]" is an element of an array, not a unit.
      const bool index =
          !unit.empty() && unit.find_first_not_of("0123456789") == std::string_view::npos;
      if (!index) {
        return {std::string(io::trim(text.substr(0, at))), std::string(unit)};
      }
    }
  }
  return {std::string(text), {}};
}

bool is_time_name(std::string_view name) {
  return io::time_name(name).is_time;
}

class Reader {
 public:
  /// @param period  s, between rows that have no time of their own.
  Reader(CsvTable table, const std::string& source, std::optional<double> period = {})
      : table_(std::move(table)), source_(source), period_(period) {
    log_.source = source;
    log_.format = "CSV";
  }

  Expected<Log> read() {
    FLYBALL_CHECK(read_header());
    if (period_) {
      read_rows(*period_);
    } else if (is_list()) {
      read_list();
    } else {
      FLYBALL_CHECK(read_table());
    }
    if (bad_times_ > 0) {
      warn(log_.diagnostics, "malformed_rows", "{} without a time dropped",
           io::counted(bad_times_, "row"));
    }
    if (bad_cells_ > 0) {
      warn(log_.diagnostics, "non_numeric_cells",
           "{} in columns of numbers held words and were dropped", io::counted(bad_cells_, "cell"));
    }
    io::tidy(log_);
    if (log_.signals.empty() && log_.texts.empty()) {
      Error error = refusal(LogError::no_data, source_, "the table")
                        .got("without one row that has a time and a value");
      return tl::unexpected(io::with_diagnostics(std::move(error), log_.diagnostics));
    }
    return std::move(log_);
  }

  /// Of a table whose first lines these are.
  Expected<std::optional<io::CsvLayout>> layout() {
    FLYBALL_CHECK(read_header());
    if (is_list() || table_.rows.size() <= first_row_) {
      return std::optional<io::CsvLayout>();
    }
    FLYBALL_TRY(const std::size_t clock, time_column());
    const double scale = time_scale(clock);
    std::vector<std::optional<double>> time(table_.rows.size());
    std::optional<double> last;
    for (std::size_t row = first_row_; row < table_.rows.size(); ++row) {
      const std::optional<double> value = number(cell(row, clock));
      // Dates, and rows that are out of order or of another clock, are for who sees them all.
      if (!value || !std::isfinite(*value) || (last && *value < *last)) {
        return std::optional<io::CsvLayout>();
      }
      last = value;
      time[row] = *value * scale;
    }
    io::CsvLayout layout{table_.delimiter, clock, scale, {}, {}};
    for (std::size_t c = 0; c < headers_.size(); ++c) {
      const std::size_t texts = log_.texts.size();
      if (c != clock) {
        read_column(c, time);
      }
      layout.columns.push_back({headers_[c].name, headers_[c].unit, log_.texts.size() > texts});
    }
    layout.diagnostics = log_.diagnostics;
    return std::optional(std::move(layout));
  }

 private:
  static std::optional<double> number(std::string_view cell) { return io::cell_number(cell); }

  /// Lines before the header: a program's name, a date, a line without two cells.
  void skip_titles() {
    constexpr std::size_t most = 20;
    const auto is_header = [](const std::vector<std::string>& cells) {
      return cells.size() >= 2 && std::any_of(cells.begin(), cells.end(), [](const auto& cell) {
               return is_time_name(split_header(cell).name);
             });
    };
    const std::size_t end = std::min(most, table_.rows.size());
    const auto begin = table_.rows.begin();
    auto header = std::find_if(begin, begin + static_cast<std::ptrdiff_t>(end), is_header);
    if (header == begin + static_cast<std::ptrdiff_t>(end)) {
      header = std::find_if(begin, begin + static_cast<std::ptrdiff_t>(end),
                            [](const auto& cells) { return cells.size() >= 2; });
    }
    const auto titles = header - begin;
    const bool words = std::none_of(begin, header, [](const std::vector<std::string>& cells) {
      return cells.size() >= 2 && number(cells[0]) && number(cells[1]);
    });
    if (titles > 0 && header != begin + static_cast<std::ptrdiff_t>(end) && words) {
      note(log_.diagnostics, "title_lines", "{} before the header passed over",
           io::counted(static_cast<std::size_t>(titles), "line"));
      table_.rows.erase(begin, header);
      table_.lines.erase(table_.lines.begin(), table_.lines.begin() + titles);
    }
  }

  Expected<void> read_header() {
    skip_titles();
    if (table_.rows.empty() || table_.rows.front().size() < 2) {
      return refusal(LogError::not_a_log, source_, "the file")
          .got("text without a table")
          .expected("a CSV with a header and at least two columns, a SysId JSON or a WPILOG");
    }
    const std::vector<std::string>& first = table_.rows.front();
    const bool headless = std::all_of(first.begin(), first.end(), [&](const std::string& cell) {
      return io::is_blank_cell(io::trim(cell)) || number(cell).has_value();
    });
    for (std::size_t c = 0; c < first.size(); ++c) {
      headers_.push_back(headless ? Header{fmt::format("column {}", c + 1), {}}
                                  : split_header(first[c]));
    }
    first_row_ = headless ? 0 : 1;
    if (headless) {
      warn(log_.diagnostics, "no_header", "the table has no header; its columns are numbered");
    }
    return {};
  }

  bool is_list() const {
    return headers_.size() == 3 && is_time_name(headers_[0].name) &&
           io::lower(headers_[1].name) == "key" && io::lower(headers_[2].name) == "value";
  }

  std::string_view cell(std::size_t row, std::size_t column) const {
    const std::vector<std::string>& cells = table_.rows[row];
    return column < cells.size() ? io::trim(cells[column]) : std::string_view();
  }

  /// The time column: by name, or the first, if its numbers ascend and its unit does not deny it.
  Expected<std::size_t> time_column() {
    for (std::size_t c = 0; c < headers_.size(); ++c) {
      if (is_time_name(headers_[c].name)) {
        return c;
      }
    }
    const Expected<Unit> unit = parse_unit(headers_[0].unit);
    const bool other_unit = !headers_[0].unit.empty() && unit && unit->dimension != Dimension::time;
    std::optional<double> last;
    for (std::size_t row = first_row_; row < table_.rows.size(); ++row) {
      const std::optional<double> value = number(cell(row, 0));
      if (other_unit || !value || (last && !(*value >= *last))) {
        return refusal(LogError::no_time,
                       fmt::format("{}:{}", source_, table_.lines[other_unit ? 0 : row]),
                       "the table")
            .got("without a column of time")
            .expected(
                "a table with a column named Timestamp, Time or t, or with a first column whose "
                "numbers ascend")
            .hint("name the column of time \"Time (s)\" in the header");
      }
      last = value;
    }
    warn(log_.diagnostics, "assumed_time_column",
         "no column is named Timestamp, Time or t; the first, \"{}\", is taken for time",
         io::printable(headers_[0].name, 40));
    log_.diagnostics.back().place = Place{table_.lines[0], 1};
    return std::size_t{0};
  }

  /// Seconds per unit of a time column that names none: steps of five and more are no seconds of
  /// anything that moves.
  double usual_scale(std::size_t column) {
    struct Row {
      double least_step;
      double scale;
      std::string_view unit;
    };
    static constexpr std::array<Row, 3> rows{
        {{1e6, 1e-9, "nanoseconds"}, {1e3, 1e-6, "microseconds"}, {5.0, 1e-3, "milliseconds"}}};
    std::vector<double> steps;
    std::optional<double> last;
    for (std::size_t row = first_row_; row < table_.rows.size(); ++row) {
      const std::optional<double> value = number(cell(row, column));
      if (value && std::isfinite(*value)) {
        if (last && *value > *last) {
          steps.push_back(*value - *last);
        }
        last = value;
      }
    }
    if (steps.empty()) {
      return 1.0;
    }
    const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
    std::nth_element(steps.begin(), middle, steps.end());
    for (const Row& row : rows) {
      if (*middle >= row.least_step) {
        warn(log_.diagnostics, "assumed_time_unit",
             "the time column \"{}\" names no unit and goes in steps of {}; they are taken for {} "
             "(write \"time (s)\" or \"time (us)\" in the header to say what they are)",
             io::printable(headers_[column].name, 40), *middle, row.unit);
        log_.diagnostics.back().place = Place{table_.lines[0], 1};
        return row.scale;
      }
    }
    return 1.0;
  }

  /// Seconds per unit of the time column.
  double time_scale(std::size_t column) {
    const Header& header = headers_[column];
    if (header.unit.empty()) {
      const std::optional<double> said = io::time_name(header.name).seconds;
      return said ? *said : usual_scale(column);
    }
    const Expected<Unit> unit = parse_unit(header.unit);
    if (unit && unit->dimension == Dimension::time) {
      return unit->factor;
    }
    warn(log_.diagnostics, "unknown_time_unit",
         "the time column's unit \"{}\" is not a unit of time; seconds are assumed",
         io::printable(header.unit, 20));
    log_.diagnostics.back().place = Place{table_.lines[0], 1};
    return 1.0;
  }

  Expected<void> read_table() {
    FLYBALL_TRY(const std::size_t clock, time_column());
    const double scale = time_scale(clock);
    std::vector<std::optional<double>> time(table_.rows.size());
    std::optional<double> first_date;
    for (std::size_t row = first_row_; row < table_.rows.size(); ++row) {
      time[row] = number(cell(row, clock));
      if (!time[row]) {
        // Dates and times of day, counted from the first.
        time[row] = io::clock_time(cell(row, clock));
        first_date = time[row] && !first_date ? time[row] : first_date;
        time[row] = time[row] ? std::optional((*time[row] - *first_date) / scale) : std::nullopt;
      }
      if (!time[row] || !std::isfinite(*time[row])) {
        time[row].reset();
        ++bad_times_;
      } else {
        *time[row] *= scale;
      }
    }
    if (first_date) {
      note(log_.diagnostics, "dates",
           "times are written as dates or times of day; they are counted "
           "from the first");
    }
    if (const std::size_t restarts = io::join_restarts(time); restarts > 0) {
      note(log_.diagnostics, "time_restarts",
           "time begins anew {}: each part has a clock of its own; they were put one after the "
           "other",
           restarts == 1 ? "once" : fmt::format("{} times", restarts));
    }
    for (std::size_t c = 0; c < headers_.size(); ++c) {
      if (c != clock) {
        read_column(c, time);
      }
    }
    return {};
  }

  /// The rows are the clock.
  void read_rows(double period) {
    std::vector<std::optional<double>> time(table_.rows.size());
    for (std::size_t row = first_row_; row < table_.rows.size(); ++row) {
      time[row] = static_cast<double>(row - first_row_) * period;
    }
    for (std::size_t c = 0; c < headers_.size(); ++c) {
      read_column(c, time);
    }
  }

  void read_column(std::size_t column, const std::vector<std::optional<double>>& time) {
    Signal signal{headers_[column].name, headers_[column].unit, {}, {}};
    TextSignal text{headers_[column].name, {}, {}};
    for (std::size_t row = first_row_; row < table_.rows.size(); ++row) {
      const std::string_view value = cell(row, column);
      if (io::is_blank_cell(value) || !time[row]) {
        continue;
      }
      text.time.push_back(*time[row]);
      text.value.emplace_back(value);
      if (const std::optional<double> parsed = number(value)) {
        signal.time.push_back(*time[row]);
        signal.value.push_back(*parsed);
      }
    }
    // A few words in a column of numbers are a logger's hiccup; more, and it is a column of words.
    if (2 * signal.time.size() >= text.time.size()) {
      bad_cells_ += text.time.size() - signal.time.size();
      log_.signals.push_back(std::move(signal));
    } else {
      log_.texts.push_back(std::move(text));
    }
  }

  void read_list() {
    const double scale = time_scale(0);
    struct Samples {
      std::vector<double> time;
      std::vector<std::string_view> value;
    };
    std::vector<Samples> samples;
    std::vector<std::string> keys;
    std::map<std::string, std::size_t, std::less<>> index;
    for (std::size_t row = first_row_; row < table_.rows.size(); ++row) {
      const std::optional<double> time = number(cell(row, 0));
      if (!time || !std::isfinite(*time)) {
        ++bad_times_;
        continue;
      }
      if (io::is_blank_cell(cell(row, 2))) {
        continue;
      }
      const std::string_view key = cell(row, 1);
      const auto [found, added] = index.try_emplace(std::string(key), keys.size());
      if (added) {
        keys.emplace_back(key);
        samples.emplace_back();
      }
      samples[found->second].time.push_back(*time * scale);
      samples[found->second].value.push_back(cell(row, 2));
    }
    for (std::size_t k = 0; k < keys.size(); ++k) {
      Signal signal{keys[k], {}, {}, {}};
      bool all_numbers = true;
      for (std::size_t i = 0; i < samples[k].time.size() && all_numbers; ++i) {
        const std::optional<double> value = number(samples[k].value[i]);
        all_numbers = value.has_value();
        if (value) {
          signal.time.push_back(samples[k].time[i]);
          signal.value.push_back(*value);
        }
      }
      if (all_numbers) {
        log_.signals.push_back(std::move(signal));
      } else {
        log_.texts.push_back({keys[k],
                              std::move(samples[k].time),
                              {samples[k].value.begin(), samples[k].value.end()}});
      }
    }
  }

  CsvTable table_;
  const std::string& source_;
  std::optional<double> period_;
  Log log_;
  std::vector<Header> headers_;
  std::size_t first_row_ = 1;
  std::size_t bad_times_ = 0;
  std::size_t bad_cells_ = 0;
};

std::string quoted_cell(const std::string& text) {
  if (text.find_first_of(",\"\n\r;") == std::string::npos && !text.starts_with('#')) {
    return text;
  }
  std::string result = "\"";
  for (const char c : text) {
    result += c == '"' ? std::string("\"\"") : std::string(1, c);
  }
  return result + "\"";
}

std::string header_cell(const std::string& name, const std::string& unit) {
  return quoted_cell(unit.empty() ? name : fmt::format("{} ({})", name, unit));
}

}  // namespace

Expected<std::optional<io::CsvLayout>> io::csv_layout(std::string_view head,
                                                      const std::string& source) {
  return split_csv(head, source).and_then([&](CsvTable table) {
    return Reader(std::move(table), source).layout();
  });
}

Expected<Log> parse_csv(std::string_view text, const std::string& source) {
  return io::split_csv(text, source).and_then([&](CsvTable table) {
    return Reader(std::move(table), source).read();
  });
}

Expected<Log> parse_csv(std::string_view text, const std::string& source, double period) {
  FLYBALL_CHECK(check_positive(period, "parse_csv", "period", "s"));
  return io::split_csv(text, source).and_then([&](CsvTable table) {
    return Reader(std::move(table), source, period).read();
  });
}

std::string to_csv(const TimeSeries& series) {
  std::string text = "time (s)";
  for (const TimeSeries::Column& column : series.columns()) {
    text += "," + header_cell(column.name, column.unit);
  }
  text += "\n";
  for (std::size_t row = 0; row < series.rows(); ++row) {
    fmt::format_to(std::back_inserter(text), "{}", series.time()[row]);
    for (const TimeSeries::Column& column : series.columns()) {
      text += ",";
      if (!std::isnan(column.values[row])) {
        fmt::format_to(std::back_inserter(text), "{}", column.values[row]);
      }
    }
    text += "\n";
  }
  return text;
}

Expected<void> write_csv(const std::string& path, const TimeSeries& series) {
  return write_file_atomically(path, to_csv(series));
}

}  // namespace flyball
