#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>

#include "core/plain_format.hpp"

namespace flyball::detail::plain {

namespace {

std::string number(double value, std::string_view specification) {
  std::array<char, 400> buffer{};
  char* const end = buffer.data() + buffer.size();
  if (specification.empty()) {
    // Its own digits, with an exponent from 1e16 on and below 1e-4.
    const double size = std::abs(value);
    const bool fixed = size == 0.0 || (size >= 1e-4 && size < 1e16) || !std::isfinite(value);
    const auto form = fixed ? std::chars_format::fixed : std::chars_format::scientific;
    return {buffer.data(), std::to_chars(buffer.data(), end, value, form).ptr};
  }
  const char type = specification.back();
  int precision = 6;
  if (specification.front() == '.') {
    std::from_chars(specification.data() + 1, specification.data() + specification.size(),
                    precision);
  }
  const auto form = type == 'f'   ? std::chars_format::fixed
                    : type == 'e' ? std::chars_format::scientific
                                  : std::chars_format::general;
  const auto written = std::to_chars(buffer.data(), end, value, form, precision);
  return {buffer.data(), written.ec == std::errc() ? written.ptr : buffer.data()};
}

}  // namespace

int Argument::whole() const {
  if (const auto* value = std::get_if<long long>(&value_)) {
    return static_cast<int>(*value);
  }
  const auto* value = std::get_if<unsigned long long>(&value_);
  return value == nullptr ? -1 : static_cast<int>(*value);
}

std::string Argument::text(std::string_view specification) const {
  if (const auto* text = std::get_if<std::string>(&value_)) {
    return *text;
  }
  if (const auto* value = std::get_if<double>(&value_)) {
    return number(*value, specification);
  }
  if (const auto* value = std::get_if<long long>(&value_)) {
    return std::to_string(*value);
  }
  return std::to_string(std::get<unsigned long long>(value_));
}

std::string format(std::string_view pattern, const Argument* arguments, std::size_t count) {
  std::string out;
  std::size_t next = 0;
  const auto argument = [&](std::string_view index) -> const Argument* {
    std::size_t at = 0;
    if (index.empty()) {
      at = next++;
    } else {
      std::from_chars(index.data(), index.data() + index.size(), at);
    }
    return at < count ? arguments + at : nullptr;
  };
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    const char c = pattern[i];
    if ((c == '{' || c == '}') && i + 1 < pattern.size() && pattern[i + 1] == c) {
      out += c;
      ++i;
    } else if (c == '{') {
      std::size_t end = i + 1;
      for (int depth = 1; end < pattern.size(); ++end) {
        depth += pattern[end] == '{' ? 1 : pattern[end] == '}' ? -1 : 0;
        if (depth == 0) {
          break;
        }
      }
      const std::string_view field = pattern.substr(i + 1, end - i - 1);
      const std::size_t colon = std::min(field.find(':'), field.size());
      const Argument* const shown = argument(field.substr(0, colon));
      std::string specification(field.substr(std::min(colon + 1, field.size())));
      if (const std::size_t nested = specification.find("{}"); nested != std::string::npos) {
        const Argument* const precision = argument({});
        specification.replace(nested, 2,
                              std::to_string(precision == nullptr ? 6 : precision->whole()));
      }
      out += shown == nullptr ? std::string() : shown->text(specification);
      i = end;
    } else {
      out += c;
    }
  }
  return out;
}

}  // namespace flyball::detail::plain
