// Rows of logs as lines of JSON: written, read again, put together.
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <flyball/core/argument.hpp>
#include <flyball/io/file.hpp>
#include <flyball/io/json_writer.hpp>
#include <flyball/study/identify_each.hpp>

#include "core/try.hpp"

namespace flyball::study {

namespace {

using Json = nlohmann::json;

constexpr std::string_view log_rows_schema = "flyball.log_row/1";
constexpr std::size_t most_logs = 100'000'000;

/// A member of that type, if the object has it.
template <class Value>
std::optional<Value> member(const Json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end()) {
    return std::nullopt;
  }
  if constexpr (std::is_same_v<Value, std::string>) {
    return found->is_string() ? std::optional(found->get<std::string>()) : std::nullopt;
  } else if constexpr (std::is_same_v<Value, bool>) {
    return found->is_boolean() ? std::optional(found->get<bool>()) : std::nullopt;
  } else {
    return found->is_number_unsigned() ? std::optional(found->get<Value>()) : std::nullopt;
  }
}

struct Line {
  NumberedRow numbered{};
  std::size_t logs = 0;
};

std::optional<Line> parse_line(std::string_view text) {
  const Json object = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  // Where the row's own members begin in what `to_json_line` writes.
  const std::size_t begin = text.find("\"path\":");
  if (!object.is_object() || member<std::string>(object, "schema") != log_rows_schema ||
      begin == std::string_view::npos || text.back() != '}') {
    return std::nullopt;
  }
  const auto number = member<std::size_t>(object, "log");
  const auto logs = member<std::size_t>(object, "logs");
  auto path = member<std::string>(object, "path");
  const auto size = member<std::uint64_t>(object, "size");
  auto sum = member<std::string>(object, "checksum");
  auto settings = member<std::string>(object, "settings");
  const auto status = member<std::size_t>(object, "status");
  const auto lasting = member<bool>(object, "lasting");
  if (!number || !logs || !path || !size || !sum || !settings || !status || !lasting ||
      *status > 2 || *logs > most_logs || *number >= *logs) {
    return std::nullopt;
  }
  return Line{
      {*number,
       {*std::move(path), *size, *std::move(sum), *std::move(settings), static_cast<int>(*status),
        *lasting, std::string(text.substr(begin, text.size() - 1 - begin))}},
      *logs};
}

Refusal not_rows(const std::string& where, std::string got) {
  return refusal(LogRowsError::not_rows, where, "the line")
      .got(std::move(got))
      .expected("a row that flyball identify --json writes, or logs.jsonl of its --out folder")
      .hint("give the files or folders of the parts");
}

/// The file of rows that a path names.
std::string rows_file(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored)
             ? (std::filesystem::path(path) / "logs.jsonl").string()
             : path;
}

/// "3, 7, 11 and 200 more".
std::string few(const std::vector<std::size_t>& numbers) {
  constexpr std::size_t shown = 5;
  const std::vector<std::size_t> first(
      numbers.begin(),
      numbers.begin() + static_cast<std::ptrdiff_t>(std::min(shown, numbers.size())));
  return fmt::format(
      "{}{}", fmt::join(first, ", "),
      numbers.size() > shown ? fmt::format(" and {} more", numbers.size() - shown) : std::string());
}

Refusal differing(const std::string& path, const std::string& got, const std::string& expected) {
  return refusal(LogRowsError::rows_differ, path, "the file")
      .got(got)
      .expected(expected)
      .hint("identify the parts again, all with the same version, options and logs");
}

}  // namespace

std::string to_json_line(const NumberedRow& row, std::size_t logs) {
  return fmt::format("{{\"schema\":\"{}\",\"log\":{},\"logs\":{},{}}}\n", log_rows_schema,
                     row.number, logs, row.row.members);
}

Expected<LogRows> read_log_rows(std::string_view text, const std::string& source, bool cut) {
  LogRows all;
  std::size_t line = 0;
  for (std::size_t at = 0; at < text.size();) {
    ++line;
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view row = text.substr(at, end - at);
    const bool ended = end < text.size();
    at = end + 1;
    if (row.empty()) {
      continue;
    }
    auto parsed = parse_line(row);
    if (!parsed) {
      if (cut && !ended) {
        break;
      }
      return not_rows(fmt::format("{}:{}", source, line), "another");
    }
    if (!cut && !all.rows.empty() && parsed->logs != all.logs) {
      return differing(fmt::format("{}:{}", source, line), fmt::format("of {} logs", parsed->logs),
                       fmt::format("of {} logs, as the lines before", all.logs));
    }
    all.logs = parsed->logs;
    all.rows.push_back(std::move(parsed->numbered));
  }
  return all;
}

Expected<LogRows> merge_log_rows(std::span<const std::string> paths) {
  if (paths.empty()) {
    return refusal(ArgumentError::empty, "merge", "the list of parts");
  }
  LogRows all;
  std::vector<std::size_t> from;  // The path of each row, by its index.
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const std::string file = rows_file(paths[i]);
    FLYBALL_TRY(const std::string text, read_file(file));
    FLYBALL_TRY(auto part, read_log_rows(text, file));
    if (part.rows.empty()) {
      continue;  // More parts than logs.
    }
    if (all.rows.empty()) {
      all.logs = part.logs;
    } else if (part.logs != all.logs) {
      return differing(file, fmt::format("of {} logs", part.logs),
                       fmt::format("of {}, as {}", all.logs, rows_file(paths[from.front()])));
    }
    for (NumberedRow& row : part.rows) {
      if (!all.rows.empty() && row.row.settings != all.rows.front().row.settings) {
        return differing(file, "made with other options, or by another version",
                         "as " + rows_file(paths[from.front()]));
      }
      all.rows.push_back(std::move(row));
      from.push_back(i);
    }
  }
  if (all.rows.empty()) {
    return refusal(LogRowsError::rows_missing, "merge", "the list of parts").got("without a row");
  }
  std::stable_sort(all.rows.begin(), all.rows.end(),
                   [](const auto& a, const auto& b) { return a.number < b.number; });
  for (std::size_t i = 1; i < all.rows.size(); ++i) {
    const LogRow& one = all.rows[i - 1].row;
    const LogRow& other = all.rows[i].row;
    if (all.rows[i].number == all.rows[i - 1].number && one.members != other.members) {
      return differing(other.path,
                       one.path == other.path ? "in two rows that differ"
                                              : fmt::format("under the number of {}", one.path),
                       "in one row, or in several that are the same");
    }
  }
  const auto repeated =
      std::unique(all.rows.begin(), all.rows.end(),
                  [](const auto& a, const auto& b) { return a.number == b.number; });
  all.rows.erase(repeated, all.rows.end());
  if (all.rows.size() < all.logs) {
    std::vector<std::size_t> missing;
    for (std::size_t number = 0, at = 0; number < all.logs; ++number) {
      if (at < all.rows.size() && all.rows[at].number == number) {
        ++at;
      } else {
        missing.push_back(number);
      }
    }
    return refusal(LogRowsError::rows_missing, "merge", "the list of parts")
        .got(fmt::format("without {} of {} logs: those numbered {} (from 0)", missing.size(),
                         all.logs, few(missing)))
        .hint("give all parts; a log's number divided by N leaves the I - 1 of its --shard I/N");
  }
  return all;
}

int status_of(const LogRows& rows) {
  int worst = 0;
  for (const NumberedRow& row : rows.rows) {
    worst = std::max(worst, row.row.status);
  }
  return worst;
}

Expected<Shard> parse_shard(std::string_view text) {
  Shard shard;
  const std::size_t slash = text.find('/');
  const auto take = [](std::string_view digits, std::size_t& number) {
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    return error == std::errc{} && end == digits.data() + digits.size();
  };
  const bool two = slash != std::string_view::npos && take(text.substr(0, slash), shard.part) &&
                   take(text.substr(slash + 1), shard.of);
  if (!two) {
    return refusal(ArgumentError::malformed, "shard", "the part")
        .got(fmt::format("\"{}\"", text))
        .expected("two whole numbers such as 2/8, the second of eight parts");
  }
  if (shard.of < 1 || shard.part < 1 || shard.part > shard.of) {
    return refusal(ArgumentError::out_of_range, "shard", "the part")
        .got(fmt::format("\"{}\"", text))
        .expected("one from 1/N to N/N");
  }
  return shard;
}

}  // namespace flyball::study
