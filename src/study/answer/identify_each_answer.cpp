// Many logs' rows as a table, a page and CSV.
#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <flyball/study/identify_each.hpp>

#include "core/wording.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using Json = nlohmann::json;

constexpr const char* identify_each_schema = "flyball.identify_each/1";
constexpr std::size_t most_logs_shown = 200;

constexpr std::array<const char*, 9> gains{
    "kS", "kV", "kA", "kG", "angle_offset", "kS_angular", "kV_angular", "kA_angular", "trackwidth"};

Json parsed(const NumberedRow& row) {
  return Json::parse("{" + row.row.members + "}", nullptr, /*allow_exceptions=*/false);
}

std::string word(const Json& row, const char* name) {
  const auto found = row.find(name);
  return found != row.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::string in_quotes(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) {
    return text;
  }
  std::string quoted = "\"";
  for (const char c : text) {
    quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  }
  return quoted + "\"";
}

/// A number of a row's JSON as it stands there; empty for null.
std::string number_text(const Json& value) {
  return value.is_number_float()     ? json_number(value.get<double>())
         : value.is_number_integer() ? value.dump()
         : value.is_string()         ? value.get<std::string>()
                                     : std::string();
}

const Json* gain_of(const Json& row, const char* name) {
  const auto all = row.find("gains");
  if (all == row.end() || !all->contains(name)) {
    return nullptr;
  }
  return &(*all)[name];
}

bool determined(const Json& gain) {
  return gain.value("determined", false);
}

void add_gain(std::string& line, const Json* gain) {
  std::array<std::string, 3> cells;
  if (gain != nullptr && determined(*gain)) {
    cells = {number_text((*gain)["value"]), number_text((*gain)["interval"][0]),
             number_text((*gain)["interval"][1])};
  } else if (gain != nullptr) {
    cells[2] = number_text(gain->value("upper_bound", Json()));
  }
  for (const std::string& cell : cells) {
    line += "," + cell;
  }
}

/// The least R² of what was fitted.
std::optional<double> r_squared(const Json& row) {
  std::optional<double> least;
  const auto take = [&](const Json& fit) {
    if (const auto found = fit.find("r_squared"); found != fit.end() && found->is_number()) {
      least = std::min(least.value_or(1.0), found->get<double>());
    }
  };
  if (const auto fit = row.find("fit"); fit != row.end()) {
    take(*fit);
  }
  if (const auto modes = row.find("modes"); modes != row.end()) {
    for (const Json& mode : *modes) {
      take(mode);
    }
  }
  return least;
}

/// The first of a row's warnings, or null; and how many there are.
std::pair<const Json*, std::size_t> warnings_of(const Json& row) {
  const Json* first = nullptr;
  std::size_t count = 0;
  if (const auto all = row.find("diagnostics"); all != row.end()) {
    for (const Json& found : *all) {
      if (word(found, "severity") != "info") {
        first = first == nullptr ? &found : first;
        ++count;
      }
    }
  }
  return {first, count};
}

std::string csv_line(const NumberedRow& numbered) {
  const Json row = parsed(numbered);
  std::string line = fmt::format("{},{},{},{},{},{}", numbered.number, in_quotes(numbered.row.path),
                                 numbered.row.status, word(row, "verdict"), word(row, "mechanism"),
                                 word(row, "unit"));
  for (const char* name : gains) {
    add_gain(line, gain_of(row, name));
  }
  const auto [warning, count] = warnings_of(row);
  const auto explained = r_squared(row);
  const auto error = row.find("error");
  line += fmt::format(",{},{},{},{},{},{},{},{},{}\n",
                      explained ? json_number(*explained) : std::string(),
                      row.contains("rows") ? row["rows"].dump() : std::string(), count,
                      warning != nullptr ? word(*warning, "code") : std::string(),
                      warning != nullptr ? in_quotes(word(*warning, "message")) : std::string(),
                      error != row.end() ? word(*error, "code") : std::string(),
                      error != row.end() ? in_quotes(word(*error, "message")) : std::string(),
                      numbered.row.size, numbered.row.checksum);
  return line;
}

/// How often each code was met, and where first.
class Codes {
 public:
  void add(const std::string& code, const std::string& path, const std::string& message) {
    const auto [found, added] = index_.try_emplace(code, all_.size());
    if (added) {
      all_.push_back({code, path, message, 0});
    }
    ++all_[found->second].logs;
  }

  [[nodiscard]] bool empty() const { return all_.empty(); }

  /// The most frequent first. @param folder  Of all logs, which is left out.
  [[nodiscard]] Facts facts(const std::string& folder) const {
    std::vector<Code> sorted = all_;
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const Code& a, const Code& b) { return a.logs > b.logs; });
    Facts facts;
    for (const Code& code : sorted) {
      facts.add(fmt::format("{}, {}", code.code, text::count(code.logs, "log")),
                fmt::format("{} ({}{})", code.message, code.logs > 1 ? "first in " : "",
                            code.path.substr(folder.size())));
    }
    return facts;
  }

  void write(JsonWriter& json, std::string_view name) const {
    json.list(name, all_, [&](const Code& code) {
      json.object([&] {
        json.add("code", code.code);
        json.add("logs", code.logs);
        json.add("first", code.path);
      });
    });
  }

 private:
  struct Code {
    std::string code, path, message;
    std::size_t logs = 0;
  };
  std::vector<Code> all_;
  std::map<std::string, std::size_t> index_;
};

Value gain_cell(const Json& row, const char* name) {
  const Json* gain = gain_of(row, name);
  if (gain == nullptr) {
    return {"", Tone::quiet};
  }
  if (!determined(*gain) || !(*gain)["value"].is_number()) {
    return {"not determined", Tone::caution};
  }
  const double value = (*gain)["value"].get<double>();
  const Json& interval = (*gain)["interval"];
  const bool closed = interval[0].is_number() && interval[1].is_number();
  Value cell = closed ? text::with_half_width(
                            value, 0.5 * (interval[1].get<double>() - interval[0].get<double>()))
                      : text::number(value);
  cell.number = value;
  return cell;
}

Tone tone_of_row(const Json& row) {
  const std::string verdict = word(row, "verdict");
  return verdict == "good" ? Tone::good : verdict == "caution" ? Tone::caution : Tone::bad;
}

/// What a row has to say beside its gains: the error, or the first warning.
Value remark(const Json& row) {
  if (const auto error = row.find("error"); error != row.end()) {
    return {word(*error, "code"), Tone::bad};
  }
  const auto [warning, count] = warnings_of(row);
  if (warning == nullptr) {
    return {tone_of_row(row) == Tone::good ? "" : "with care", Tone::quiet};
  }
  return {count > 1 ? fmt::format("{} and {} more", word(*warning, "code"), count - 1)
                    : word(*warning, "code"),
          Tone::caution};
}

/// The folder that all logs are in, with its slash; empty where there is none.
std::string common_folder(const LogRows& rows) {
  std::string_view common = rows.rows.empty() ? std::string_view() : rows.rows.front().row.path;
  for (const NumberedRow& row : rows.rows) {
    const std::string_view path = row.row.path;
    const auto [end, other] = std::mismatch(common.begin(), common.end(), path.begin(), path.end());
    common = common.substr(0, static_cast<std::size_t>(end - common.begin()));
  }
  const std::size_t slash = common.rfind('/');
  return std::string(common.substr(0, slash == std::string_view::npos ? 0 : slash + 1));
}

std::vector<Value> table_row(const std::string& path, const Json& row) {
  const auto explained = r_squared(row);
  return {path,
          word(row, "mechanism"),
          gain_cell(row, "kS"),
          gain_cell(row, "kV"),
          gain_cell(row, "kA"),
          gain_cell(row, "kG"),
          word(row, "unit"),
          explained ? Value(text::number(*explained, 4)) : Value(""),
          remark(row)};
}

struct Summary {
  Table table{};
  Codes errors{};
  Codes warnings{};
  std::size_t with_gains = 0;
  std::size_t good = 0;
};

Summary summary_of(const LogRows& rows) {
  Summary summary;
  const std::string folder = common_folder(rows);
  if (!folder.empty()) {
    summary.table.caption = "In " + folder;
  }
  summary.table.header = {"log",    "mechanism", "kS (V)", "kV",    "kA",
                          "kG (V)", "per",       "R²",     "remark"};
  summary.table.words = {0, 1, 6, 8};
  for (const NumberedRow& numbered : rows.rows) {
    const Json row = parsed(numbered);
    if (summary.table.rows.size() < most_logs_shown) {
      summary.table.rows.push_back(table_row(numbered.row.path.substr(folder.size()), row));
    }
    if (const auto error = row.find("error"); error != row.end()) {
      summary.errors.add(word(*error, "code"), numbered.row.path, word(*error, "message"));
    } else {
      ++summary.with_gains;
      summary.good += tone_of_row(row) == Tone::good ? 1 : 0;
    }
    std::vector<std::string> seen;
    for (const Json& found : row.value("diagnostics", Json::array())) {
      const std::string code = word(found, "code");
      if (word(found, "severity") != "info" &&
          std::find(seen.begin(), seen.end(), code) == seen.end()) {
        seen.push_back(code);
        summary.warnings.add(code, numbered.row.path, word(found, "message"));
      }
    }
  }
  return summary;
}

Verdict verdict_of(const LogRows& rows, const Summary& summary, std::size_t passed_over) {
  const std::size_t all = rows.rows.size();
  Verdict verdict;
  verdict.line =
      fmt::format("{} of {} {} gains, {} of them that can be used as they are.", summary.with_gains,
                  text::count(all, "log"), all == 1 ? "has" : "have", summary.good);
  verdict.tone = summary.with_gains == 0 ? Tone::bad
                 : summary.good < all    ? Tone::caution
                                         : Tone::good;
  if (all < rows.logs) {
    verdict.reasons.push_back(fmt::format(
        "a part: {} of {} logs; flyball merge puts the parts together", all, rows.logs));
  }
  if (passed_over > 0) {
    verdict.reasons.push_back(
        fmt::format("{} passed over: the names of logs end in .json, .wpilog or .csv",
                    text::count(passed_over, "other file")));
  }
  return verdict;
}

}  // namespace

std::string to_csv(const LogRows& rows) {
  std::string csv = "log,path,status,verdict,mechanism,unit";
  for (const char* name : gains) {
    csv += fmt::format(",{0},{0}_low,{0}_high", name);
  }
  csv += ",r_squared,rows,warnings,warning,warning_text,error,error_text,size,checksum\n";
  for (const NumberedRow& row : rows.rows) {
    csv += csv_line(row);
  }
  return csv;
}

Answer answer_of(const LogRows& rows, std::size_t passed_over) {
  Summary summary = summary_of(rows);
  const std::string folder = common_folder(rows);
  JsonWriter json;
  json.object([&] {
    json.add("schema", identify_each_schema);
    json.add("logs", rows.logs);
    json.add("rows", rows.rows.size());
    json.add("with_gains", summary.with_gains);
    json.add("good", summary.good);
    json.add("status", status_of(rows));
    summary.errors.write(json, "errors");
    summary.warnings.write(json, "warnings");
  });
  Answer answer{.schema = identify_each_schema, .json = std::move(json).text()};
  Document& document = answer.document;
  document.title = text::count(rows.rows.size(), "log") + ", each by itself";
  document.verdict = verdict_of(rows, summary, passed_over);
  Section logs{"logs", "Logs", {}};
  logs.blocks.emplace_back(std::move(summary.table));
  if (rows.rows.size() > most_logs_shown) {
    logs.blocks.emplace_back(Paragraph{
        fmt::format("The first {} of {}; all are in logs.csv and logs.jsonl of a report (--out), "
                    "and in the lines of --json.",
                    most_logs_shown, rows.rows.size())});
  }
  document.sections.push_back(std::move(logs));
  if (!summary.errors.empty()) {
    document.sections.push_back({"errors", "Logs without gains", {summary.errors.facts(folder)}});
  }
  if (!summary.warnings.empty()) {
    document.sections.push_back({"warnings", "Warnings", {summary.warnings.facts(folder)}});
  }
  std::string lines;
  for (const NumberedRow& row : rows.rows) {
    lines += to_json_line(row, rows.logs);
  }
  answer.files.push_back({"logs.csv", to_csv(rows)});
  answer.files.push_back({"logs.jsonl", std::move(lines)});
  return answer;
}

}  // namespace flyball::study
