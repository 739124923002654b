#pragma once

#include <string>

#include <fmt/core.h>

namespace flyball::detail {

/// fmt::vformat, compiled into core: what a numeric domain says of its errors costs its users no
/// library to link, and its sources no seconds.
[[nodiscard]] std::string format_arguments(fmt::string_view pattern, fmt::format_args arguments);

/// fmt::format of numbers and text.
template <class... T>
[[nodiscard]] std::string format(fmt::format_string<T...> pattern, T&&... arguments) {
  return format_arguments(pattern, fmt::make_format_args(arguments...));
}

/// The entries of a list, each written by the pattern, with commas between.
template <class Range>
[[nodiscard]] std::string comma_separated(
    fmt::format_string<const typename Range::value_type&> pattern, const Range& entries) {
  std::string text;
  for (const auto& entry : entries) {
    text += (text.empty() ? "" : ", ") + detail::format(pattern, entry);
  }
  return text;
}

}  // namespace flyball::detail
