#include <flyball/io/csv.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <limits>
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

std::optional<double> plain_number(std::string_view cell) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  const bool whole = error == std::errc{} && end == cell.data() + cell.size();
  return whole ? std::optional(value) : std::nullopt;
}

std::optional<double> cell_number(std::string_view cell) {
  if (const std::optional<double> plain = plain_number(cell)) {
    return plain;
  }
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

class CsvReader {
 public:
  /// @param period  s, between rows that have no time of their own.
  CsvReader(CsvTable table, const std::string& source, std::optional<double> period = {})
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
    if (is_list() || table_.rows() <= first_row_) {
      return std::optional<io::CsvLayout>();
    }
    FLYBALL_TRY(const std::size_t clock, time_column());
    const double scale = time_scale(clock);
    std::vector<double> time(table_.rows(), not_a_number);
    double last = -std::numeric_limits<double>::infinity();
    for (std::size_t row = first_row_; row < table_.rows(); ++row) {
      const std::optional<double> value = number(cell(row, clock));
      // Dates, and rows that are out of order or of another clock, are for who sees them all.
      if (!value || !std::isfinite(*value) || *value < last) {
        return std::optional<io::CsvLayout>();
      }
      last = *value;
      time[row] = *value * scale;
    }
    io::CsvLayout layout{table_.delimiter(), clock, scale, {}, {}};
    const std::vector<bool> words = read_columns(clock, time);
    for (std::size_t c = 0; c < headers_.size(); ++c) {
      layout.columns.push_back({headers_[c].name, headers_[c].unit, words[c]});
    }
    layout.diagnostics = log_.diagnostics;
    return std::optional(std::move(layout));
  }

 private:
  static std::optional<double> number(std::string_view cell) { return io::cell_number(cell); }

  /// Lines before the header: a program's name, a date, a line without two cells.
  void skip_titles() {
    constexpr std::size_t most = 20;
    const std::size_t end = std::min(most, table_.rows());
    const auto first_with = [&](auto holds) {
      std::size_t row = 0;
      for (; row < end; ++row) {
        table_.read(row, cells_);
        if (cells_.size() >= 2 && holds()) {
          break;
        }
      }
      return row;
    };
    const auto has_time = [&] {
      for (std::size_t c = 0; c < cells_.size(); ++c) {
        if (is_time_name(split_header(cells_[c]).name)) {
          return true;
        }
      }
      return false;
    };
    std::size_t header = first_with(has_time);
    if (header == end) {
      header = first_with([] { return true; });
    }
    const std::size_t numbers = first_with([&] { return number(cells_[0]) && number(cells_[1]); });
    if (header > 0 && header < end && numbers >= header) {
      note(log_.diagnostics, "title_lines", "{} before the header passed over",
           io::counted(header, "line"));
      table_.drop(header);
    }
  }

  Expected<void> read_header() {
    skip_titles();
    cells_ = {};
    if (table_.rows() > 0) {
      table_.read(0, cells_);
    }
    if (cells_.size() < 2) {
      return refusal(LogError::not_a_log, source_, "the file")
          .got("text without a table")
          .expected("a CSV with a header and at least two columns, a SysId JSON or a WPILOG");
    }
    bool headless = true;
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      headless = headless && (io::is_blank_cell(cells_[c]) || number(cells_[c]));
    }
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      headers_.push_back(headless ? Header{fmt::format("column {}", c + 1), {}}
                                  : split_header(cells_[c]));
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

  /// Lives until another is asked for.
  std::string_view cell(std::size_t row, std::size_t column) {
    table_.read(row, cells_, column + 1);
    return cells_[column];
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
    for (std::size_t row = first_row_; row < table_.rows(); ++row) {
      const std::optional<double> value = number(cell(row, 0));
      if (other_unit || !value || (last && !(*value >= *last))) {
        return refusal(LogError::no_time,
                       fmt::format("{}:{}", source_, table_.line(other_unit ? 0 : row)),
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
    log_.diagnostics.back().place = Place{table_.line(0), 1};
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
    for (std::size_t row = first_row_; row < table_.rows(); ++row) {
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
        log_.diagnostics.back().place = Place{table_.line(0), 1};
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
    log_.diagnostics.back().place = Place{table_.line(0), 1};
    return 1.0;
  }

  Expected<void> read_table() {
    FLYBALL_TRY(const std::size_t clock, time_column());
    const double scale = time_scale(clock);
    std::vector<double> time(table_.rows(), not_a_number);
    std::optional<double> first_date;
    for (std::size_t row = first_row_; row < table_.rows(); ++row) {
      const std::string_view text = cell(row, clock);
      std::optional<double> value = number(text);
      if (!value) {
        // Dates and times of day, counted from the first.
        value = io::clock_time(text);
        first_date = value && !first_date ? value : first_date;
        value = value ? std::optional((*value - *first_date) / scale) : std::nullopt;
      }
      if (!value || !std::isfinite(*value)) {
        ++bad_times_;
      } else {
        time[row] = *value * scale;
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
    read_columns(clock, time);
    return {};
  }

  /// The rows are the clock.
  void read_rows(double period) {
    std::vector<double> time(table_.rows(), not_a_number);
    for (std::size_t row = first_row_; row < table_.rows(); ++row) {
      time[row] = static_cast<double>(row - first_row_) * period;
    }
    read_columns(headers_.size(), time);
  }

  /// All columns but that of time. @param time  NaN of a row without one.
  /// @return Which are of words. A few words in a column of numbers are a logger's hiccup; more,
  /// and it is a column of words.
  std::vector<bool> read_columns(std::size_t clock, const std::vector<double>& time) {
    const std::size_t columns = headers_.size();
    std::vector<Signal> signals(columns);
    std::vector<std::size_t> words(columns, 0);
    std::vector<std::size_t> wanted;
    for (std::size_t c = 0; c < columns; ++c) {
      if (c != clock) {
        wanted.push_back(c);
      }
    }
    const std::size_t looked_at = std::min(first_row_ + 1000, table_.rows());
    for (std::size_t row = first_row_; row < table_.rows(); ++row) {
      if (row == looked_at) {  // full columns will stay so, and need not grow step by step
        for (Signal& signal : signals) {
          if (signal.time.size() == looked_at - first_row_) {
            signal.time.reserve(table_.rows());
            signal.value.reserve(table_.rows());
          }
        }
      }
      if (std::isnan(time[row])) {
        continue;
      }
      table_.read(row, cells_, columns);
      for (const std::size_t c : wanted) {
        if (const std::string_view raw = cells_.raw(c); !raw.empty()) {
          std::optional<double> value = io::plain_number(raw);
          if (!value) {
            const std::string_view text = io::trim(raw);
            if (io::is_blank_cell(text)) {
              continue;
            }
            value = number(text);
          }
          if (value) {
            signals[c].time.push_back(time[row]);
            signals[c].value.push_back(*value);
          } else {
            ++words[c];
          }
        }
      }
    }
    std::vector<bool> of_words(columns, false);
    for (const std::size_t c : wanted) {
      of_words[c] = signals[c].time.size() < words[c];
      if (of_words[c]) {
        signals[c] = {};
      } else {
        bad_cells_ += words[c];
        signals[c].name = headers_[c].name;
        signals[c].unit = headers_[c].unit;
        log_.signals.push_back(std::move(signals[c]));
      }
    }
    read_words(of_words, time);
    return of_words;
  }

  void read_words(const std::vector<bool>& of_words, const std::vector<double>& time) {
    const std::size_t first = log_.texts.size();
    std::vector<std::size_t> wanted;
    for (std::size_t c = 0; c < of_words.size(); ++c) {
      if (of_words[c]) {
        wanted.push_back(c);
        log_.texts.push_back({headers_[c].name, {}, {}});
      }
    }
    for (std::size_t row = first_row_; row < table_.rows() && !wanted.empty(); ++row) {
      if (std::isnan(time[row])) {
        continue;
      }
      table_.read(row, cells_, wanted.back() + 1);
      for (std::size_t k = 0; k < wanted.size(); ++k) {
        if (const std::string_view value = cells_[wanted[k]]; !io::is_blank_cell(value)) {
          log_.texts[first + k].time.push_back(time[row]);
          log_.texts[first + k].value.emplace_back(value);
        }
      }
    }
  }

  /// Rows of a time, a key and a value: first the keys and their numbers, then what is words.
  void read_list() {
    const double scale = time_scale(0);
    std::vector<Signal> signals;
    std::vector<bool> of_words;
    std::map<std::string, std::size_t, std::less<>> index;
    for (std::size_t row = first_row_; row < table_.rows(); ++row) {
      table_.read(row, cells_, 3);
      const std::optional<double> time = number(cells_[0]);
      if (!time || !std::isfinite(*time)) {
        ++bad_times_;
        continue;
      }
      if (io::is_blank_cell(cells_[2])) {
        continue;
      }
      auto found = index.find(cells_[1]);
      if (found == index.end()) {
        found = index.emplace(cells_[1], signals.size()).first;
        signals.push_back({found->first, {}, {}, {}});
        of_words.push_back(false);
      }
      const std::size_t key = found->second;
      if (!of_words[key]) {
        if (const std::optional<double> value = number(cells_[2])) {
          signals[key].time.push_back(*time * scale);
          signals[key].value.push_back(*value);
        } else {
          of_words[key] = true;
        }
      }
    }
    std::vector<std::size_t> place(signals.size(), 0);
    for (std::size_t k = 0; k < signals.size(); ++k) {
      if (of_words[k]) {
        place[k] = log_.texts.size();
        log_.texts.push_back({std::move(signals[k].name), {}, {}});
      } else {
        log_.signals.push_back(std::move(signals[k]));
      }
    }
    const bool any = std::find(of_words.begin(), of_words.end(), true) != of_words.end();
    for (std::size_t row = first_row_; any && row < table_.rows(); ++row) {
      table_.read(row, cells_, 3);
      const std::optional<double> time = number(cells_[0]);
      const auto found = index.find(cells_[1]);
      if (time && std::isfinite(*time) && !io::is_blank_cell(cells_[2]) &&
          of_words[found->second]) {
        TextSignal& text = log_.texts[place[found->second]];
        text.time.push_back(*time * scale);
        text.value.emplace_back(cells_[2]);
      }
    }
  }

  static constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

  CsvTable table_;
  CsvTable::Cells cells_;
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
    return CsvReader(std::move(table), source).layout();
  });
}

Expected<Log> parse_csv(std::string_view text, const std::string& source) {
  return io::split_csv(text, source).and_then([&](CsvTable table) {
    return CsvReader(std::move(table), source).read();
  });
}

Expected<Log> parse_csv(std::string_view text, const std::string& source, double period) {
  FLYBALL_CHECK(check_positive(period, "parse_csv", "period", "s"));
  return io::split_csv(text, source).and_then([&](CsvTable table) {
    return CsvReader(std::move(table), source, period).read();
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
