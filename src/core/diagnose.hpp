#pragma once

#include <string>
#include <utility>
#include <vector>

#include <flyball/core/diagnostic.hpp>

#include "core/format.hpp"

/// What a job has to tell about its data: warn(diagnostics, "gaps", "{} gaps in time", gaps).
namespace flyball {

template <class... T>
void warn(std::vector<Diagnostic>& diagnostics, std::string code,
          detail::FormatString<T...> message, T&&... arguments) {
  diagnostics.push_back(
      {std::move(code), Severity::warning, detail::format(message, std::forward<T>(arguments)...)});
}

template <class... T>
void note(std::vector<Diagnostic>& diagnostics, std::string code,
          detail::FormatString<T...> message, T&&... arguments) {
  diagnostics.push_back(
      {std::move(code), Severity::info, detail::format(message, std::forward<T>(arguments)...)});
}

}  // namespace flyball
