#include <flyball/io/json_text.hpp>

#include <algorithm>
#include <iterator>
#include <unordered_set>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/controls.hpp"

namespace flyball {

namespace {

/// A bracket that is open.
struct Open {
  bool object = false;
  std::unordered_set<std::string> keys{};
};

/// Where a string ends, behind its quotes; npos if it is cut off. @param at  Where it begins.
std::size_t end_of_string(std::string_view json, std::size_t at) {
  for (++at; at < json.size() && json[at] != '"'; ++at) {
    at += json[at] == '\\' ? 1 : 0;
  }
  return at < json.size() ? at + 1 : std::string_view::npos;
}

/// Where the value ends that a text begins with; npos if it is cut off.
std::size_t end_of_value(std::string_view json) {
  if (json.empty() || json[0] == '"') {
    return json.empty() ? std::string_view::npos : end_of_string(json, 0);
  }
  if (json[0] != '{' && json[0] != '[') {
    return json.find_first_of(" \t\r\n,}");
  }
  std::size_t depth = 0;
  for (std::size_t at = 0; at < json.size(); ++at) {
    if (json[at] == '"') {
      at = end_of_string(json, at) - 1;  // npos - 1 ends the text
    } else if (json[at] == '{' || json[at] == '[') {
      ++depth;
    } else if ((json[at] == '}' || json[at] == ']') && --depth == 0) {
      return at + 1;
    }
  }
  return std::string_view::npos;
}

/// What a string says: "\\u0041" is "A".
std::string said_by(std::string_view quoted) {
  if (quoted.find('\\') != std::string_view::npos) {
    const nlohmann::json value = nlohmann::json::parse(quoted, nullptr, false);
    if (value.is_string()) {
      return value.get<std::string>();
    }
  }
  return std::string(quoted.substr(1, quoted.size() - 2));
}

}  // namespace

Place place_of(std::string_view text, std::size_t offset) {
  const std::string_view before = text.substr(0, std::min(offset, text.size()));
  const auto lines = std::count(before.begin(), before.end(), '\n');
  const std::string_view line = before.substr(before.rfind('\n') + 1);  // npos + 1 is 0
  const auto characters = std::count_if(line.begin(), line.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  });
  return {static_cast<std::size_t>(lines) + 1, static_cast<std::size_t>(characters) + 1};
}

std::optional<std::string_view> written_member(std::string_view json, std::string_view key) {
  constexpr std::string_view blank = " \t\r\n";
  int depth = 0;
  bool key_follows = false;
  for (std::size_t at = 0; at < json.size(); ++at) {
    const char c = json[at];
    depth += c == '{' || c == '[' ? 1 : c == '}' || c == ']' ? -1 : 0;
    if (c == '"') {
      const std::size_t end = end_of_string(json, at);
      if (key_follows && said_by(json.substr(at, end - at)) == key) {
        json.remove_prefix(std::min(json.find(':', end), json.size() - 1) + 1);
        json.remove_prefix(std::min(json.find_first_not_of(blank), json.size()));
        return json.substr(0, end_of_value(json));
      }
      at = end - 1;
    }
    key_follows = depth == 1 && (c == '{' || c == ',' || (key_follows && c != '"'));
  }
  return std::nullopt;
}

std::string json_escaped(std::string_view json) {
  std::string text;
  text.reserve(json.size());
  for (std::size_t i = 0; i < json.size();) {
    // Between its values a text has line ends and tabs; in them those are escaped already.
    const std::size_t bytes =
        static_cast<unsigned char>(json[i]) < 0x20 ? 0 : flyball::text::steering_bytes(json, i);
    if (bytes > 0) {
      fmt::format_to(std::back_inserter(text), "\\u{:04x}",
                     flyball::text::steering_code(json, i, bytes));
    } else {
      text += json[i];
    }
    i += bytes > 0 ? bytes : 1;
  }
  return text;
}

std::optional<RepeatedKey> repeated_key(std::string_view json) {
  constexpr std::size_t deepest = 64;
  std::vector<Open> open;
  std::size_t too_deep = 0;
  bool key_follows = false;
  for (std::size_t at = 0; at < json.size(); ++at) {
    const char c = json[at];
    if (c == '"') {
      const std::size_t end = end_of_string(json, at);
      if (end == std::string_view::npos) {
        break;
      }
      if (key_follows) {
        std::string key = said_by(json.substr(at, end - at));
        if (!open.back().keys.insert(key).second) {
          return RepeatedKey{std::move(key), at};
        }
      }
      key_follows = false;
      at = end - 1;
    } else if (c == '{' || c == '[') {
      too_deep += open.size() == deepest ? 1 : 0;
      if (too_deep == 0) {
        open.push_back({c == '{', {}});
      }
      key_follows = too_deep == 0 && c == '{';
    } else if (c == '}' || c == ']') {
      if (too_deep > 0) {
        --too_deep;
      } else if (!open.empty()) {
        open.pop_back();
      }
      key_follows = false;
    } else if (c == ',') {
      key_follows = too_deep == 0 && !open.empty() && open.back().object;
    }
  }
  return std::nullopt;
}

std::optional<std::string_view> scalar_member(std::string_view json, std::string_view key) {
  const auto written = written_member(json, key);
  const bool scalar = written && !written->empty() && (*written)[0] != '{' && (*written)[0] != '[';
  return scalar ? written : std::nullopt;
}

}  // namespace flyball
