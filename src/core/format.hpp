#pragma once

#include <array>
#include <string>
#include <string_view>

#ifndef FLYBALL_WITHOUT_FMT
#include <fmt/core.h>
#else
#include "core/plain_format.hpp"
#endif

namespace flyball::detail {

#ifndef FLYBALL_WITHOUT_FMT
/// A pattern that is checked against its arguments when it is compiled.
template <class... T>
using FormatString = fmt::format_string<T...>;

/// fmt::vformat, compiled into core: what a numeric domain says of its errors costs its users no
/// library to link, and its sources no seconds.
[[nodiscard]] std::string format_arguments(fmt::string_view pattern, fmt::format_args arguments);

/// fmt::format of numbers and text.
template <class... T>
[[nodiscard]] std::string format(FormatString<T...> pattern, T&&... arguments) {
  return format_arguments(pattern, fmt::make_format_args(arguments...));
}
#else
template <class... T>
using FormatString = std::string_view;

template <class... T>
[[nodiscard]] std::string format(std::string_view pattern, T&&... arguments) {
  const std::array<plain::Argument, sizeof...(T)> all{plain::Argument(arguments)...};
  return plain::format(pattern, all.data(), all.size());
}
#endif

/// The entries of a list, each written by the pattern, with commas between.
template <class Range>
[[nodiscard]] std::string comma_separated(FormatString<const typename Range::value_type&> pattern,
                                          const Range& entries) {
  std::string text;
  for (const auto& entry : entries) {
    text += (text.empty() ? "" : ", ") + detail::format(pattern, entry);
  }
  return text;
}

}  // namespace flyball::detail
