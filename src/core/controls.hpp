#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace flyball::text {

/// How many bytes the character at `at` has if it steers what shows the text, else 0: a control
/// (C0, DEL, C1: a terminal obeys them), a mark or override of the direction of writing (with which
/// a name reads otherwise than it is), a separator of lines, a byte order mark.
/// Source: Unicode 15, sections 23.1 to 23.3 and 23.8; Unicode Technical Report 36, 2.10.
constexpr std::size_t steering_bytes(std::string_view text, std::size_t at) noexcept {
  const auto byte = [&](std::size_t i) -> unsigned {
    return at + i < text.size() ? static_cast<unsigned char>(text[at + i]) : 0U;
  };
  const auto in = [](unsigned x, unsigned low, unsigned high) { return low <= x && x <= high; };
  const unsigned first = byte(0);
  if (first < 0x80) {
    return first < 0x20 || first == 0x7F ? 1 : 0;
  }
  if (first == 0xC2) {  // U+0080 to U+009F
    return in(byte(1), 0x80, 0x9F) ? 2 : 0;
  }
  if (first == 0xD8) {  // U+061C
    return byte(1) == 0x9C ? 2 : 0;
  }
  bool steers = false;
  if (first == 0xE2 && byte(1) == 0x80) {  // U+200E and U+200F, U+2028 to U+202E
    steers = in(byte(2), 0x8E, 0x8F) || in(byte(2), 0xA8, 0xAE);
  } else if (first == 0xE2 && byte(1) == 0x81) {  // U+2066 to U+206F
    steers = in(byte(2), 0xA6, 0xAF);
  } else if (first == 0xEF) {  // U+FEFF, U+FFF9 to U+FFFB
    steers = (byte(1) == 0xBB && byte(2) == 0xBF) || (byte(1) == 0xBF && in(byte(2), 0xB9, 0xBB));
  }
  return steers ? 3 : 0;
}

/// The number of a character of so many bytes, of those above.
constexpr unsigned steering_code(std::string_view text, std::size_t at,
                                 std::size_t bytes) noexcept {
  const auto low = [&](std::size_t i) { return static_cast<unsigned char>(text[at + i]) & 0x3FU; };
  const auto first = static_cast<unsigned char>(text[at]);
  return bytes == 1   ? first
         : bytes == 2 ? (first & 0x1FU) << 6U | low(1)
                      : (first & 0x0FU) << 12U | low(1) << 6U | low(2);
}

/// Each byte of such a character as '?', but for newlines where `lines`.
inline std::string without_steering(std::string text, bool lines) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t bytes = text[i] == '\n' && lines ? 0 : steering_bytes(text, i);
    for (std::size_t k = 0; k < bytes; ++k) {
      text[i + k] = '?';
    }
    i += bytes > 0 ? bytes : 1;
  }
  return text;
}

}  // namespace flyball::text
