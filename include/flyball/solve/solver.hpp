#pragma once

#include <string>
#include <string_view>

#include <flyball/solve/kind.hpp>

namespace flyball::solve {

/// What one problem was answered with.
struct Answer {
  std::string json;  ///< One line, without the line's end; numbers round-trip.
  bool solved = true;
  ErrorKind kind = ErrorKind::no_answer;  ///< Of the error, if it was not solved.
};

/// Solves problems of one kind, given as JSON text: matrices as lists of rows, complex numbers as
/// [re, im], infinities as "inf" and "-inf". A field `id` is echoed. A problem that cannot be read
/// or solved is answered with {"error": {"code", "message", …evidence}}; no input throws.
class Solver {
 public:
  /// @param kind  A name of `kinds`. @errors ArgumentError::unknown_name with the nearest name.
  [[nodiscard]] static Expected<Solver> create(std::string_view kind);

  /// Cost: that of the kernel, and of reading and writing the text.
  [[nodiscard]] Answer solve(std::string_view problem) const;

  /// The answer to a problem that there is no memory for, with its id where the text has it.
  /// @param beginning  Of the problem, as far as it was read.
  [[nodiscard]] static Answer without_memory(std::string_view beginning);

  /// {"error": {…}}: how an unknown kind is answered.
  [[nodiscard]] static std::string error_json(const Error& error);

 private:
  explicit Solver(const Kind& kind) : kind_(&kind) {}
  const Kind* kind_;
};

}  // namespace flyball::solve
