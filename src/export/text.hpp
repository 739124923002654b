#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <flyball/export/language.hpp>
#include <flyball/mechanisms/mechanism_kind.hpp>

/// Pieces of text that the sources of all languages are made of.
namespace flyball::exports {

/// A number as source code: its digits, with a decimal point or an exponent ("12.0", never "12").
/// @param digits  Significant ones; 0 for as many as it takes to read back the same double.
[[nodiscard]] std::string literal(double value, int digits = 0);

/// A C++ initializer, "{{1.0, 0.5}, {0.0, 2.0}}".
[[nodiscard]] std::string rows_of(const Eigen::MatrixXd& M);

/// "inline constexpr double NAME = VALUE;  // comment", a line of C++.
[[nodiscard]] std::string constant_line(std::string_view name, double value,
                                        std::string_view comment);

/// Whether c may be in a name: of letters, digits and '_'.
[[nodiscard]] bool is_word(char c);

/// "Elevator", "SwerveSteer".
[[nodiscard]] std::string capitalized(mechanisms::MechanismKind kind);

/// One line that cannot end a comment, whatever a log says: no line break, no control character, no
/// backslash.
[[nodiscard]] std::string comment_text(std::string_view text);

/// "C++", "Java", "Python".
[[nodiscard]] std::string_view name_of(Language language);

/// "constants/wpilib_java.txt": a report's file of constants.
[[nodiscard]] std::string constants_file(std::string_view library, Language language);

/// What a comment begins with: "//" or "#".
[[nodiscard]] std::string_view comment_mark(Language language);

/// Whole lines of comments, "// …\n", as the language writes them.
[[nodiscard]] std::string comments(std::string text, Language language);

/// Significant digits of a constant: finer than any gain is known.
inline constexpr int constant_digits = 6;

/// A number that is pasted.
struct Constant {
  std::string name;
  double value = 0.0;
  std::string comment;  ///< Unit first.
};

/// A line for each, "<before>NAME<assign>VALUE<end>  // comment", the comments below each other.
[[nodiscard]] std::string assignments(const std::vector<Constant>& constants, Language language,
                                      std::string_view before, std::string_view assign,
                                      std::string_view end);

/// A namespace of them, or a class that holds nothing else.
[[nodiscard]] std::string scope(const std::string& name, const std::vector<Constant>& constants,
                                Language language);

}  // namespace flyball::exports
