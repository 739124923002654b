#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>

#include "io/csv_time.hpp"
#include "io/text.hpp"

namespace flyball::io {
namespace {

/// Whole numbers of a fixed number of digits, one after the other.
class Digits {
 public:
  explicit Digits(std::string_view text) : text_(text) {}

  bool number(std::size_t digits, int& value) {
    const std::string_view part = text_.substr(0, digits);
    const auto [end, status] = std::from_chars(part.data(), part.data() + part.size(), value);
    const bool ok = part.size() == digits && status == std::errc{} &&
                    end == part.data() + part.size() && part.front() != '-';
    text_.remove_prefix(ok ? digits : 0);
    return ok;
  }
  bool one_of(std::string_view characters) {
    const bool ok = !text_.empty() && characters.find(text_.front()) != std::string_view::npos;
    text_.remove_prefix(ok ? 1 : 0);
    return ok;
  }
  [[nodiscard]] std::string_view rest() const { return text_; }
  void skip(std::size_t count) { text_.remove_prefix(count); }

 private:
  std::string_view text_;
};

/// Days since 1970-01-01 of a date of the Gregorian calendar. Source: Hinnant, "chrono-compatible
/// low-level date algorithms" (days_from_civil).
double days_since_1970(int year, int month, int day) {
  year -= month <= 2 ? 1 : 0;
  const int era = year / 400;
  const int year_of_era = year - era * 400;
  const int day_of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + day - 1;
  const int day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
  return era * 146097.0 + day_of_era - 719468.0;
}

/// "05:35:57.123" and, after it, "Z" or "+01:00".
std::optional<double> time_of_day(Digits text) {
  int hours = 0;
  int minutes = 0;
  int seconds = 0;
  if (!text.number(2, hours) || !text.one_of(":") || !text.number(2, minutes)) {
    return std::nullopt;
  }
  if (text.one_of(":") && !text.number(2, seconds)) {
    return std::nullopt;
  }
  double result = 3600.0 * hours + 60.0 * minutes + seconds;
  if (text.one_of(".,")) {
    const std::string_view rest = text.rest();
    const std::size_t digits = std::min(rest.find_first_not_of("0123456789"), rest.size());
    const std::optional<double> fraction = parse_number("0." + std::string(rest.substr(0, digits)));
    if (digits == 0 || !fraction) {
      return std::nullopt;
    }
    result += *fraction;
    text.skip(digits);
  }
  if (text.one_of("Zz")) {
    return text.rest().empty() ? std::optional(result) : std::nullopt;
  }
  const bool behind = text.rest().starts_with('-');
  if (text.one_of("+-")) {
    int zone_hours = 0;
    int zone_minutes = 0;
    if (!text.number(2, zone_hours)) {
      return std::nullopt;
    }
    text.one_of(":");
    if (!text.rest().empty() && !text.number(2, zone_minutes)) {
      return std::nullopt;
    }
    result -= (behind ? -1.0 : 1.0) * (3600.0 * zone_hours + 60.0 * zone_minutes);
  }
  return text.rest().empty() ? std::optional(result) : std::nullopt;
}

}  // namespace

TimeName time_name(std::string_view name) {
  struct Ending {
    std::string_view text;
    double seconds;
  };
  static constexpr std::array<std::string_view, 8> names{
      "timestamp", "time", "t", "elapsedtime", "times", "seconds", "clock", "fpgatimestamp"};
  static constexpr std::array<Ending, 18> endings{{{"microseconds", 1e-6},
                                                   {"milliseconds", 1e-3},
                                                   {"nanoseconds", 1e-9},
                                                   {"seconds", 1.0},
                                                   {"micros", 1e-6},
                                                   {"millis", 1e-3},
                                                   {"nanos", 1e-9},
                                                   {"microsec", 1e-6},
                                                   {"millisec", 1e-3},
                                                   {"nanosec", 1e-9},
                                                   {"secs", 1.0},
                                                   {"sec", 1.0},
                                                   {"usec", 1e-6},
                                                   {"msec", 1e-3},
                                                   {"us", 1e-6},
                                                   {"ms", 1e-3},
                                                   {"ns", 1e-9},
                                                   {"s", 1.0}}};
  std::string word;
  for (const char c : lower(trim(name))) {
    if (c != ' ' && c != '_' && c != '-') {
      word += c;
    }
  }
  const auto is_name = [](std::string_view text) {
    return std::find(names.begin(), names.end(), text) != names.end();
  };
  if (is_name(word)) {
    return {true, word == "seconds" ? std::optional(1.0) : std::nullopt};
  }
  for (const Ending& ending : endings) {
    if (word.ends_with(ending.text) &&
        is_name(std::string_view(word).substr(0, word.size() - ending.text.size()))) {
      return {true, ending.seconds};
    }
  }
  return {};
}

std::optional<double> clock_time(std::string_view cell) {
  constexpr double day = 86400.0;
  Digits text(trim(cell));
  int year = 0;
  int month = 0;
  int day_of_month = 0;
  Digits date = text;
  if (date.number(4, year) && date.one_of("-/") && date.number(2, month) && date.one_of("-/") &&
      date.number(2, day_of_month) && date.one_of("Tt ")) {
    const auto seconds = time_of_day(date);
    const bool valid = month >= 1 && month <= 12 && day_of_month >= 1 && day_of_month <= 31;
    return seconds && valid
               ? std::optional(day * days_since_1970(year, month, day_of_month) + *seconds)
               : std::nullopt;
  }
  return time_of_day(text);
}

std::size_t join_restarts(std::vector<double>& time) {
  constexpr std::size_t shortest = 10;  // rows
  constexpr double apart = 2.0;         // s
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < time.size(); ++row) {
    if (!std::isnan(time[row])) {
      rows.push_back(row);
    }
  }
  std::vector<std::size_t> begins{0};
  double longest = 0.0;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    if (time[rows[i]] < time[rows[i - 1]]) {
      begins.push_back(i);
    }
    longest = std::max(longest, time[rows[i]] - time[rows[begins.back()]]);
  }
  if (begins.size() == 1 || begins.size() * 2 * shortest > rows.size()) {
    return 0;
  }
  const double first = time[rows.front()];
  for (std::size_t k = 1; k < begins.size(); ++k) {
    const std::size_t end = k + 1 < begins.size() ? begins[k + 1] : rows.size();
    if (end - begins[k] < shortest ||
        std::abs(time[rows[begins[k]]] - first) > 0.05 * longest + 0.1) {
      return 0;
    }
  }
  double offset = 0.0;
  for (std::size_t k = 1; k < begins.size(); ++k) {
    offset = time[rows[begins[k] - 1]] + apart - time[rows[begins[k]]];
    const std::size_t end = k + 1 < begins.size() ? begins[k + 1] : rows.size();
    for (std::size_t i = begins[k]; i < end; ++i) {
      time[rows[i]] += offset;
    }
  }
  return begins.size() - 1;
}

}  // namespace flyball::io
