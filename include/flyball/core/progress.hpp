#pragma once

#include <cstddef>

namespace flyball {

/// How far long work is, for whoever shows it: the last that was told.
struct Progress {
  const char* stage = nullptr;  ///< "fits the model"; none before work that tells.
  std::size_t done = 0;
  std::size_t of = 0;  ///< 0 where nobody knows how much there is.
};

/// Tells what begins, or how much of it is done; from any thread, without waiting.
/// @param stage  A text that stays, a literal.
void tell_progress(const char* stage, std::size_t done = 0, std::size_t of = 0) noexcept;

/// What was told last; from any thread.
[[nodiscard]] Progress progress() noexcept;

}  // namespace flyball
