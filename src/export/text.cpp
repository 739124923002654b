#include <fmt/format.h>

#include "export/text.hpp"

namespace flyball::exports {

std::string literal(double value, int digits) {
  std::string text = digits > 0 ? fmt::format("{:.{}g}", value, digits) : fmt::format("{}", value);
  if (text.find_first_of(".en") == std::string::npos) {
    text += ".0";
  }
  return text;
}

std::string capitalized(mechanisms::MechanismKind kind) {
  std::string name;
  bool first = true;
  for (const char c : to_string(kind)) {
    if (c != ' ') {
      name += first ? static_cast<char>(c - 'a' + 'A') : c;
    }
    first = c == ' ';
  }
  return name;
}

std::string comment_text(std::string_view text) {
  std::string line;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    line += c == '\n'                     ? ' '
            : c == '\\'                   ? '/'  // at the end of a line it would continue it
            : byte < 0x20 || byte == 0x7F ? '?'
                                          : c;
  }
  return line;
}

}  // namespace flyball::exports
