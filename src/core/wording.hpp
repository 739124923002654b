#pragma once

#include <complex>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/text.hpp>

/// How answers say numbers and lists to people, and what makes text from outside harmless.
namespace flyball::text {

/// A number for people: `digits` significant digits, trailing zeros of a fraction dropped, a power
/// of ten only beyond 1e-4 and 1e6; "none" for NaN, "∞" for infinity.
[[nodiscard]] std::string number(double value, int digits = 4);

/// The shortest digits that read back to the same double; "NaN", "inf" where there is no number.
[[nodiscard]] std::string exact(double value);

/// "0.150 ± 0.012": the half-width with two significant digits, the value with as many decimals.
[[nodiscard]] std::string with_half_width(double value, double half_width);

/// The value with as many decimals as `with_half_width` would give it.
[[nodiscard]] std::string in_digits_of(double value, double half_width);

/// "12 %" of a ratio.
[[nodiscard]] std::string percent(double ratio, int digits = 3);

/// "20 ms" below a second, "1.2 s" from there.
[[nodiscard]] std::string seconds(double value);

/// "0.91 ± 0.1j" for a pair's member with a positive imaginary part, "0.91" for a real number.
[[nodiscard]] std::string complex_number(std::complex<double> value, int digits = 4);

/// "[0 1; 0 -13.3]", rows separated by semicolons.
[[nodiscard]] std::string matrix(const Eigen::MatrixXd& M, int digits = 5);

/// The text with each byte that is not UTF-8 replaced by U+FFFD.
[[nodiscard]] std::string valid_utf8(std::string_view text);

using flyball::printable;

/// The pieces between separators; one at the end ends the last piece.
[[nodiscard]] std::vector<std::string_view> split(std::string_view text,
                                                  std::string_view separator);

/// Words joined as "a, b and c".
[[nodiscard]] std::string enumerate(const std::vector<std::string>& words);

/// "1 run", "4 runs".
[[nodiscard]] std::string count(std::size_t n, std::string_view thing);

/// "Elevator" of "elevator".
[[nodiscard]] std::string capitalized(std::string_view name);

}  // namespace flyball::text
