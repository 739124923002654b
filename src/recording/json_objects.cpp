#include <cmath>

#include <fmt/format.h>

#include <flyball/core/text.hpp>
#include <flyball/io/json_text.hpp>
#include <flyball/recording/trajectory_file.hpp>

#include "core/try.hpp"
#include "recording/json_objects.hpp"

namespace flyball::recording {

using nlohmann::json;

Expected<json> json_of(std::string_view text, const std::string& source) {
  std::size_t at = 0;
  try {
    if (text.starts_with("\xEF\xBB\xBF")) {
      text.remove_prefix(3);
    }
    return json::parse(text);
  } catch (const json::parse_error& problem) {
    at = problem.byte > 0 ? problem.byte - 1 : 0;
  } catch (const json::exception&) {  // 1e999
    return refusal(TrajectoryFileError::not_json, source, "a number of the text")
        .got("larger than a double holds")
        .expected("a finite number");
  }
  const Place place = place_of(text, at);
  std::size_t begin = std::min(at, text.size());
  while (begin > 0 && text[begin - 1] != ':' && text[begin - 1] != ',' && at - begin < 12) {
    --begin;
  }
  const std::string_view near = text.substr(begin, 14);
  const bool no_number = near.find("NaN") != std::string_view::npos ||
                         near.find("Infinity") != std::string_view::npos ||
                         near.find("nan") != std::string_view::npos ||
                         near.find("inf") != std::string_view::npos;
  return refusal(TrajectoryFileError::not_json,
                 fmt::format("{}:{}:{}", source, place.line, place.column), "the text")
      .got(at >= text.size() ? std::string("cut off")
                             : fmt::format("\"{}\"", shortened(std::string(near))))
      .expected(no_number ? "a finite number" : "JSON")
      .hint(no_number           ? "the tool that wrote it divided by zero: generate the path again"
            : at >= text.size() ? "copy the file again"
                                : "");
}

Expected<double> number_of(const json& object, const char* key, std::string_view called,
                           const std::string& where, std::optional<double> otherwise) {
  const auto found = object.find(key);
  if (found == object.end()) {
    if (otherwise) {
      return *otherwise;
    }
    return refusal(TrajectoryFileError::wrong_sample, where, std::string(called))
        .got("missing")
        .expected("a number");
  }
  if (!found->is_number() || !std::isfinite(found->get<double>())) {
    return refusal(TrajectoryFileError::wrong_sample, where, std::string(called))
        .got(shortened(found->dump()))
        .expected("a finite number")
        .hint(found->is_null() ? "the tool that wrote it had NaN there: generate it again" : "");
  }
  return found->get<double>();
}

ObjectPlaces::ObjectPlaces(std::string_view text, int depth, std::string_view member) {
  int level = 0;
  bool inside = member.empty();
  std::size_t line = 1;
  std::size_t column = 1;
  std::string last;  // string of the outermost object, which may be a key
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const Place here{line, column};
    if (c == '"') {
      const std::size_t begin = ++i;
      for (; i < text.size() && text[i] != '"'; ++i) {
        i += text[i] == '\\' ? 1 : 0;
      }
      if (level == 1 && !member.empty()) {
        last = std::string(text.substr(begin, std::min(i, text.size()) - begin));
      }
      column += i - begin + 2;
      continue;
    }
    if (c == '[' || c == '{') {
      if (!member.empty() && level == 1 && c == '[') {
        inside = last == member;
      }
      if (c == '{' && inside && level == depth) {
        places_.push_back(here);
      }
      ++level;
    } else if (c == ']' || c == '}') {
      --level;
    }
    if (c == '\n') {
      ++line;
      column = 1;
    } else if ((static_cast<unsigned char>(c) & 0xC0U) != 0x80U) {
      ++column;
    }
  }
}

}  // namespace flyball::recording
