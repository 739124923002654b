#pragma once

#include <concepts>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace flyball {

/// Who has to act on an error; the command's exit status follows from it.
enum class ErrorKind {
  misuse,       ///< Malformed or meaningless input: wrong shape, unit, key, file (exit status 2).
  no_answer,    ///< The input is well formed, the mathematics says no (exit status 1).
  environment,  ///< The machine refused: a file cannot be opened, a folder cannot be written (2).
  defect,       ///< Our bug: an invariant of Flyball itself does not hold (exit status 2).
};

/// What an error enumerator means, written once beside its enum.
struct ErrorInfo {
  std::string_view family;   ///< The family's name, such as "riccati".
  std::string_view name;     ///< The enumerator's name, such as "not_stabilizable".
  std::string_view summary;  ///< One clause for people, without a full stop.
  ErrorKind kind = ErrorKind::misuse;
};

/// An enum whose values describe themselves through `ErrorInfo error_info(E)`, found by ADL.
template <class E>
concept ErrorEnum = requires(E code) {
  { error_info(code) } -> std::same_as<ErrorInfo>;
};

/// A number (or a few, or a text) that proves an error: the eigenvalue on the unit circle, the
/// row of a log, the pivot that vanished.
struct Evidence {
  std::string name;
  std::vector<double> values;
  std::string text;
};

/// The one error type: a code of some family, and what a person needs to correct it.
///
/// Every part but the code is optional; `to_string` puts together what is there:
/// "lqr: R is 2x2; it must be inputs x inputs (1x1) because B has 1 column".
///
/// ```
/// return tl::unexpected(Error(RiccatiError::not_stabilizable).in("dare").about("(A, B)")
///     .hint("give the unstable mode an input").with("eigenvalue", {1.02, 0.0}));
/// ```
class Error {
 public:
  /// An error that is no more than its code yet.
  template <ErrorEnum E>
  explicit Error(E code) : info_(error_info(code)) {}

  /// A copy for which memory is too short is MemoryError::not_enough_memory and no more:
  /// tl::expected copies its errors in functions that it declares noexcept.
  Error(const Error& other) noexcept;
  Error(Error&&) noexcept = default;
  Error& operator=(const Error& other) noexcept { return *this = Error(other); }
  /// Safe when both are one: `error = std::move(error).in("lqr")` keeps its text.
  Error& operator=(Error&& other) noexcept;
  ~Error() = default;

  Error&& in(std::string where) &&;          ///< The function, or "file:line:column".
  Error&& about(std::string subject) &&;     ///< The thing that is wrong.
  Error&& expected(std::string what) &&;     ///< What it must be.
  Error&& got(std::string what) &&;          ///< What it is.
  Error&& hint(std::string how_to_mend) &&;  ///< What to do about it.
  /// Evidence, listed in the order given.
  Error&& with(std::string name, double value) &&;
  Error&& with(std::string name, std::vector<double> values) &&;
  Error&& with(std::string name, std::initializer_list<double> values) &&;
  Error&& with(std::string name, std::string text) &&;

  /// Whether this is the given enumerator of the given family.
  template <ErrorEnum E>
  [[nodiscard]] bool is(E code) const {
    const ErrorInfo other = error_info(code);
    return info_.family == other.family && info_.name == other.name;
  }

  [[nodiscard]] const ErrorInfo& info() const noexcept { return info_; }
  [[nodiscard]] ErrorKind kind() const noexcept { return info_.kind; }
  /// The enumerator's name, such as "not_stabilizable"; what JSON answers carry as `code`.
  [[nodiscard]] std::string_view code() const noexcept { return info_.name; }
  [[nodiscard]] const std::string& where() const noexcept { return where_; }
  [[nodiscard]] const std::string& subject() const noexcept { return subject_; }
  [[nodiscard]] const std::vector<Evidence>& evidence() const noexcept { return evidence_; }

 private:
  friend std::string to_string(const Error& error);

  ErrorInfo info_;
  std::string where_;
  std::string subject_;
  std::string expected_;
  std::string got_;
  std::string hint_;
  std::vector<Evidence> evidence_;
};

/// The one place that words an error: "where: subject is got; it must be expected; hint
/// (evidence)".
[[nodiscard]] std::string to_string(const Error& error);

/// Misuse of a function's arguments; raised by the checks of argument.hpp.
enum class ArgumentError {
  wrong_shape,
  not_finite,
  not_symmetric,
  not_positive,
  out_of_range,
  empty,
  wrong_unit,
  unknown_name,
  ambiguous_name,
  malformed,
};
[[nodiscard]] ErrorInfo error_info(ArgumentError code);

}  // namespace flyball
