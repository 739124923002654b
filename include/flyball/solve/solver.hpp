#pragma once

#include <span>
#include <string>
#include <string_view>

#include <flyball/core/expected.hpp>

namespace flyball::solve {

/// One kind of problem that `solve` knows.
struct SolveKind {
  std::string_view name;      ///< Such as "dare" or "discrete-lyapunov".
  std::string_view fields;    ///< What a problem must have, such as "A B Q R".
  std::string_view optional;  ///< What it may have, such as "N".
  std::string_view answer;    ///< What is answered, for the help.
};

/// All kinds, in the order of the documentation.
[[nodiscard]] std::span<const SolveKind> solve_kinds();

/// What one problem was answered with.
struct SolveAnswer {
  std::string json;  ///< One line, without the line's end; numbers round-trip.
  bool solved = true;
  ErrorKind kind = ErrorKind::no_answer;  ///< Of the error, if it was not solved.
};

/// Solves problems of one kind, given as JSON text: matrices as lists of rows, complex numbers as
/// [re, im], infinities as "inf" and "-inf". A field `id` is echoed. A problem that cannot be read
/// or solved is answered with {"error": {"code", "message", …evidence}}; no input throws.
class Solver {
 public:
  /// @param kind  A name of `solve_kinds`.
  /// @errors ArgumentError::unknown_name with the nearest name.
  [[nodiscard]] static Expected<Solver> create(std::string_view kind);

  /// Cost: that of the kernel, and of reading and writing the text.
  [[nodiscard]] SolveAnswer solve(std::string_view problem) const;

  /// {"error": {…}}: how an unknown kind is answered.
  [[nodiscard]] static std::string error_json(const Error& error);

  /// Whether a text is one whole JSON value, so that it need not be continued by the next line.
  [[nodiscard]] static bool is_complete(std::string_view text);

 private:
  explicit Solver(std::size_t index) : index_(index) {}
  std::size_t index_;
};

}  // namespace flyball::solve
