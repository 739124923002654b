#pragma once

#include <exception>

namespace flyball::app {

/// Whether an exception says that the system has no memory left, be it for bytes, a thread or a
/// process.
[[nodiscard]] bool lacks_memory(const std::exception& problem) noexcept;

}  // namespace flyball::app
