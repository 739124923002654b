#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include <flyball/classical/delay_system.hpp>
#include <flyball/classical/transfer_function.hpp>
#include <flyball/classical/zero_pole_gain.hpp>

namespace flyball::classical {

/// What no transfer function can be made of, beyond errors of grammar
/// (expression::ExpressionError). All carry the evidence `offset` and `length`: the place in the
/// text, in bytes.
enum class TransferTextError {
  both_variables,      ///< s and z in one expression.
  period_missing,      ///< z, and nobody said its sample period.
  period_without_z,    ///< s, and a sample period.
  negative_delay,      ///< e^{+Ts}: the output would be there before the input.
  not_a_delay,         ///< e to the power of anything else than -T s.
  power_not_whole,     ///< s^0.5, s^s.
  not_a_number,        ///< s where only a number can stand, or a result that is none.
  ambiguous_division,  ///< 1/2s, which some read as 1/(2s) and others as (1/2)s.
  degree_too_high,     ///< More than 100 poles or zeros.
};
[[nodiscard]] ErrorInfo error_info(TransferTextError code);

/// A transfer function as people write it: "2/(s^2+3*s+2)*exp(-0.1*s)".
///
/// Numbers, s or z, + - * / ^ with whole powers, parentheses, products without a sign (2s, 3(s+1)),
/// dead time as exp(-T*s) or e^(-T*s), powers z^-1, coefficients in descending powers ([1 2]/[1 3
/// 2]), pi, sqrt(number), feedback(G, H) for G/(1 + G H), H = 1 if left out. −, ·, ×, ², ³ and **
/// are read, too. Whatever a division 1/2s might mean is asked, not guessed.
///
/// Factors stay factors: nothing is multiplied out but where a sum needs it, and then in 31 digits.
/// Sums of fractions have the least common denominator of the factors as written, and compound
/// fractions are cleared of what both sides have below: G/(1 + G) has the poles of the closed loop
/// alone, (1 + z^-1)/(1 - 0.5z^-1) no pole at 0. Nothing else is cancelled.
/// @param text  UTF-8, at most 10 000 bytes. @param period  Of z; a constant is taken for discrete
/// with it.
/// @errors TransferTextError; expression::ExpressionError for grammar; TransferError::improper,
/// zero_denominator, delay_in_loop for sums of different dead times and a dead time below a
/// fraction. `expression::caret_lines` shows the place.
/// Cost: O(bytes degree²), allocates.
[[nodiscard]] Expected<TransferFunction> parse_transfer_function(
    std::string_view text, std::optional<Time> period = std::nullopt);

/// The product of several texts, of which one alone may be improper: a PD controller before its
/// plant. @errors As above, and `text` as evidence: which of them, from 0.
[[nodiscard]] Expected<TransferFunction> parse_transfer_product(
    std::span<const std::string> texts, std::optional<Time> period = std::nullopt);

/// A rational function behind one dead time, or a system with several of them.
using TransferSystem = std::variant<TransferFunction, DelaySystem>;

/// What stands before an expression beside the texts.
struct TransferScale {
  double gain = 1.0;
  std::optional<Time> period{};  ///< Of z.
  Time delay{0.0};               ///< s, further dead time of the whole.
};

/// The product of several texts in which dead times may stand anywhere: in sums of different ones,
/// and below, so that "exp(-s)/(s+1) + exp(-0.3*s)/(s+2)", "exp(-s)/(s + exp(-s))" and
/// "feedback(2/s*exp(-s), 1)" are read and nothing is approximated. A quotient of sums of them
/// becomes one chain of states, of the degree that stands below.
/// @errors As `parse_transfer_product`, but not delay_in_loop; TransferError::improper where the
/// highest derivative below is delayed.
[[nodiscard]] Expected<TransferSystem> parse_transfer_system(std::span<const std::string> texts,
                                                             const TransferScale& loop = {});

/// The same by its roots: those of each factor as it is written, so that (s+1)^20 has twenty poles
/// at -1. It may be improper. @errors As above, and SystemError::no_convergence.
[[nodiscard]] Expected<ZeroPoleGain> parse_zero_pole_gain(
    std::span<const std::string> texts, std::optional<Time> period = std::nullopt);

}  // namespace flyball::classical
