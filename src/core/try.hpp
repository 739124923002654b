#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include <flyball/core/expected.hpp>

/// How an error begins, and the one way in which it goes up to the caller.
namespace flyball {

/// An error as a function answers it: as any Expected, or bare. Its parts are those of Error.
class [[nodiscard]] Refusal : public tl::unexpected<Error> {
 public:
  explicit Refusal(Error&& error) : tl::unexpected<Error>(std::move(error)) {}

  // NOLINTNEXTLINE(google-explicit-constructor): it is what a function that words errors returns.
  operator Error() && { return std::move(value()); }

  Refusal&& expected(std::string what) && {
    std::move(value()).expected(std::move(what));
    return std::move(*this);
  }
  Refusal&& got(std::string what) && {
    std::move(value()).got(std::move(what));
    return std::move(*this);
  }
  Refusal&& hint(std::string how_to_mend) && {
    std::move(value()).hint(std::move(how_to_mend));
    return std::move(*this);
  }
  template <class Value>
  Refusal&& with(std::string name, Value&& evidence) && {
    std::move(value()).with(std::move(name), std::forward<Value>(evidence));
    return std::move(*this);
  }
  Refusal&& with(std::string name, std::initializer_list<double> values) && {
    std::move(value()).with(std::move(name), values);
    return std::move(*this);
  }
};

/// return refusal(RiccatiError::not_definite, where, "R").got("-1").expected("positive");
/// @param where    The function, or "file:line:column".  @param subject  The thing that is wrong.
template <ErrorEnum E>
[[nodiscard]] Refusal refusal(E code, std::string_view where = {}, std::string_view subject = {}) {
  return Refusal(Error(code).in(std::string(where)).about(std::string(subject)));
}

}  // namespace flyball

// The macros return from the function around them, whose result is an Expected.

/// FLYBALL_TRY(auto plant, discretize(system, period)): a variable with the value, or its error to
/// the caller.
#define FLYBALL_TRY(declaration, ...) \
  FLYBALL_TRY_NAMED(FLYBALL_TRY_JOIN(flyball_try_, __COUNTER__), error(), declaration, __VA_ARGS__)

/// FLYBALL_TRY_IN("lqr", auto solution, dare(A, B, Q, R)): the same, the error in this place.
#define FLYBALL_TRY_IN(where, declaration, ...)                                                  \
  FLYBALL_TRY_NAMED(FLYBALL_TRY_JOIN(flyball_try_, __COUNTER__), error().in(std::string(where)), \
                    declaration, __VA_ARGS__)

/// FLYBALL_CHECK(check_square(A, where, "A")): nothing, or the error of an Expected to the caller.
#define FLYBALL_CHECK(...)                                         \
  do {                                                             \
    if (auto flyball_checked = (__VA_ARGS__); !flyball_checked) {  \
      return ::tl::unexpected(std::move(flyball_checked).error()); \
    }                                                              \
  } while (false)

#define FLYBALL_TRY_NAMED(result, failure, declaration, ...)                                   \
  auto result = (__VA_ARGS__);                                                                 \
  if (!result) {                                                                               \
    return ::tl::unexpected<typename decltype(result)::error_type>(std::move(result).failure); \
  }                                                                                            \
  declaration = *std::move(result)
#define FLYBALL_TRY_JOIN(a, b) FLYBALL_TRY_JOIN_NOW(a, b)
#define FLYBALL_TRY_JOIN_NOW(a, b) a##b
