#pragma once

#include <utility>

#include <tl/expected.hpp>

/// The one way in which an error goes up to the caller. Both return from the function around them,
/// whose result is an Expected.

/// FLYBALL_TRY(auto plant, discretize(system, period)): a variable with the value, or its error to
/// the caller.
#define FLYBALL_TRY(declaration, ...) \
  FLYBALL_TRY_NAMED(FLYBALL_TRY_JOIN(flyball_try_, __COUNTER__), declaration, __VA_ARGS__)

/// FLYBALL_CHECK(check_square(A, where, "A")): nothing, or the error of an Expected to the caller.
#define FLYBALL_CHECK(...)                                         \
  do {                                                             \
    if (auto flyball_checked = (__VA_ARGS__); !flyball_checked) {  \
      return ::tl::unexpected(std::move(flyball_checked).error()); \
    }                                                              \
  } while (false)

#define FLYBALL_TRY_NAMED(result, declaration, ...)     \
  auto result = (__VA_ARGS__);                          \
  if (!result) {                                        \
    return ::tl::unexpected(std::move(result).error()); \
  }                                                     \
  declaration = *std::move(result)
#define FLYBALL_TRY_JOIN(a, b) FLYBALL_TRY_JOIN_NOW(a, b)
#define FLYBALL_TRY_JOIN_NOW(a, b) a##b
