#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "io/svg.hpp"
#include "io/text.hpp"

namespace flyball::io {

namespace {

constexpr std::array<std::string_view, 20> elements{
    "svg",    "title",   "desc",  "g",       "defs",     "path",       "rect",
    "circle", "ellipse", "line",  "polygon", "polyline", "clipPath",   "use",
    "image",  "text",    "tspan", "filter",  "feFlood",  "feComposite"};
constexpr std::string_view blank = " \t\r\n";

bool is_harmless(std::string_view name, std::string_view value) {
  if (lower(name).starts_with("on") || lower(name) == "style" || name == "xml:base") {
    return false;
  }
  if (name.ends_with("href")) {
    return value.starts_with('#') || value.starts_with("data:image/png;base64,");
  }
  for (std::size_t at = value.find("url("); at != std::string_view::npos;
       at = value.find("url(", at + 1)) {
    if (!value.substr(at + 4).starts_with('#')) {
      return false;
    }
  }
  return value.find('<') == std::string_view::npos;
}

/// Takes ` name="value"` off a tag. @return Whether it is there and harmless.
bool take_attribute(std::string_view& tag) {
  const std::size_t equals = tag.find('=');
  if (equals == std::string_view::npos || equals + 1 == tag.size()) {
    return false;
  }
  const std::string_view name = trim(tag.substr(0, equals));
  std::string_view rest = tag.substr(equals + 1);
  rest.remove_prefix(std::min(rest.find_first_not_of(blank), rest.size()));
  const std::size_t end =
      !rest.empty() && (rest[0] == '"' || rest[0] == '\'') ? rest.find(rest[0], 1) : rest.npos;
  if (end == rest.npos || name.find_first_of(blank) != name.npos ||
      !is_harmless(name, rest.substr(1, end - 1))) {
    return false;
  }
  tag = rest.substr(end + 1);
  return true;
}

/// Where a tag ends, behind its '>'; what stands in quotes does not end it.
std::size_t end_of_tag(std::string_view text) {
  char quote = '\0';
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (quote != '\0') {
      quote = c == quote ? '\0' : quote;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '>') {
      return at + 1;
    }
  }
  return std::string_view::npos;
}

}  // namespace

bool is_plain_svg(std::string_view text) {
  if (!is_utf8(text)) {
    return false;
  }
  std::vector<std::string_view> open;
  bool begun = false;
  for (text = trim(text); !text.empty() && (!begun || !open.empty());) {
    const std::size_t from = text.find('<');
    if (from == std::string_view::npos || (!begun && from != 0)) {
      return false;
    }
    text.remove_prefix(from);
    const std::size_t end = end_of_tag(text);
    if (end == std::string_view::npos) {
      return false;
    }
    std::string_view tag = text.substr(1, end - 2);
    text.remove_prefix(end);
    if (tag.starts_with('/')) {
      if (open.empty() || open.back() != trim(tag.substr(1))) {
        return false;
      }
      open.pop_back();
      continue;
    }
    const bool closed = tag.ends_with('/');
    tag.remove_suffix(closed ? 1 : 0);
    const std::string_view name = tag.substr(0, tag.find_first_of(blank));
    if (std::find(elements.begin(), elements.end(), name) == elements.end() ||
        begun == (name == "svg")) {
      return false;
    }
    begun = true;
    for (tag = trim(tag.substr(name.size())); !tag.empty(); tag = trim(tag)) {
      if (!take_attribute(tag)) {
        return false;
      }
    }
    if (!closed) {
      open.push_back(name);
    }
  }
  return begun && open.empty() && trim(text).empty();
}

}  // namespace flyball::io
