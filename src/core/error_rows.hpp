#pragma once

#include <cstddef>

#include <flyball/core/error.hpp>

namespace flyball::detail {

/// What an enumerator means. The rows of a family are in the order of its enum, under the names
/// of its enumerators; scripts/check-includes compares them.
struct ErrorRow {
  std::string_view name;
  std::string_view summary;
  ErrorKind kind;
};

/// The row of `code`.
template <class E, std::size_t N>
[[nodiscard]] ErrorInfo info_of(E code, std::string_view family, const ErrorRow (&rows)[N]) {
  const auto index = static_cast<std::size_t>(code);
  return index < N ? ErrorInfo{family, rows[index].name, rows[index].summary, rows[index].kind}
                   : ErrorInfo{family, "unknown", "unknown error", ErrorKind::defect};
}

}  // namespace flyball::detail
