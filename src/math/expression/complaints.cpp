#include <algorithm>
#include <utility>

#include "core/controls.hpp"
#include "core/format.hpp"
#include "math/expression/complaints.hpp"

namespace flyball::expression {

namespace {

/// A character to show: blanks for blanks, a code for what cannot be seen.
std::string shown(std::string_view text, std::size_t at, Character c) {
  if (c.code == U'\n' || c.code == U'\r' || c.code == U'\t') {
    return " ";
  }
  if (c.code < 0x20 || c.code == 0x7F || c.code == 0xFFFD) {
    constexpr std::string_view digits = "0123456789abcdef";
    const auto byte = static_cast<unsigned char>(text[at]);
    return std::string("\\x") + digits[byte >> 4U] + digits[byte & 15U];
  }
  return text::steering_bytes(text, at) > 0 ? "?" : std::string(text.substr(at, c.length));
}

}  // namespace

Character character_at(std::string_view text, std::size_t at) noexcept {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(at);
  if (lead < 0x80) {
    return {lead, 1};
  }
  const std::size_t length = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  constexpr Character invalid{0xFFFD, 1};
  if (lead < 0xC2 || lead > 0xF4 || at + length > text.size()) {
    return invalid;
  }
  char32_t code = lead & (0xFFU >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(at + i) & 0xC0U) != 0x80U) {
      return invalid;
    }
    code = code << 6U | (byte(at + i) & 0x3FU);
  }
  const bool overlong = (length == 3 && code < 0x800) || (length == 4 && code < 0x10000);
  return overlong || code > 0x10FFFF || (code >= 0xD800 && code < 0xE000) ? invalid
                                                                          : Character{code, length};
}

void Complaints::add(Error error, Place place) {
  if (stopped_ || errors_.size() - first_ >= most) {
    return;
  }
  errors_.push_back(std::move(error)
                        .in(formula_)
                        .with("offset", static_cast<double>(place.offset))
                        .with("length", static_cast<double>(place.length)));
}

std::string Complaints::quote(Place place) const {
  constexpr std::size_t longest = 60;
  std::string quoted = "\"";
  for (std::size_t at = place.offset; at < place.end();) {
    const Character c = character_at(text_, at);
    if (quoted.size() > longest) {
      quoted += "...";
      break;
    }
    quoted += shown(text_, at, c);
    at += c.length;
  }
  return quoted + "\"";
}

std::string caret_lines(std::string_view text, const Error& error) {
  const auto find = [&](std::string_view name) -> const Evidence* {
    for (const Evidence& evidence : error.evidence()) {
      if (evidence.name == name && evidence.values.size() == 1 && evidence.values[0] >= 0.0) {
        return &evidence;
      }
    }
    return nullptr;
  };
  const Evidence* const offset = find("offset");
  const Evidence* const length = find("length");
  if (offset == nullptr || length == nullptr) {
    return "";
  }
  constexpr std::size_t before = 60;
  constexpr std::size_t widest = 100;
  const auto clip = [&](double value) {
    return static_cast<std::size_t>(std::min(value, static_cast<double>(text.size())));
  };
  const std::size_t first = clip(offset->values[0]);
  const std::size_t last = clip(offset->values[0] + length->values[0]);
  std::size_t start = first > before ? first - before : 0;
  while (start > 0 && (static_cast<unsigned char>(text[start]) & 0xC0U) == 0x80U) {
    --start;
  }
  std::string line = start > 0 ? "..." : "";
  std::string marks(line.size(), ' ');
  std::size_t at = start;
  while (at < text.size() && at < start + widest) {
    const Character c = character_at(text, at);
    const std::string piece = shown(text, at, c);
    line += piece;
    const std::size_t columns = c.length > 1 ? 1 : piece.size();
    if (at < std::max(last, first + 1)) {
      marks += at < first ? std::string(columns, ' ')
                          : (at == first ? "^" : "~") + std::string(columns - 1, '~');
    }
    at += c.length;
  }
  if (first >= text.size()) {
    marks += "^";
  }
  line += at < text.size() ? "..." : "";
  return detail::format("{}\n{} {}", line, marks, error.info().summary);
}

}  // namespace flyball::expression
