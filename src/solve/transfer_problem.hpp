#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <flyball/classical/step_metrics.hpp>
#include <flyball/classical/transfer_expression.hpp>

#include "solve/row.hpp"

/// Transfer functions in problems and answers.
namespace flyball::solve {

/// num, den, dt, delay and expr: each of the last in place of the first two.
/// @param delay  What the delay is, for the help.
[[nodiscard]] std::vector<Field> transfer_fields(std::string_view delay = "dead time, exact");

/// What they say, with any dead times. @errors ArgumentError::malformed for num and den beside
/// expr, or nothing; those of `TransferFunction::create` and `parse_transfer_system`.
[[nodiscard]] Expected<classical::TransferSystem> transfer_system_of(const Problem& problem,
                                                                     std::string_view where);
[[nodiscard]] Expected<classical::TransferSystem> transfer_system_of(
    const TransferCoefficients& written, std::string_view where);

/// The same where it must have one dead time. @errors TransferError::delay_in_loop.
[[nodiscard]] Expected<classical::TransferFunction> transfer_of(const Problem& problem,
                                                                std::string_view where);
[[nodiscard]] Expected<classical::TransferFunction> transfer_of(const TransferCoefficients& written,
                                                                std::string_view where);
/// As one with dead time anywhere.
[[nodiscard]] Expected<classical::DelaySystem> delay_system_of(
    const classical::TransferSystem& system);

/// {"num", "den", "dt", "delay"}, the last two where they say something.
void write_transfer(std::string_view name, const classical::TransferFunction& transfer,
                    JsonWriter& answer);

/// delays, B_w, C_z, D_w, D_z and D_zw of a continuous system with dead time, beside A to D.
[[nodiscard]] std::vector<Field> delay_form_fields();
/// A to D and, with dead time, those. @param system  Continuous.
void write_delay_form(const classical::DelaySystem& system, JsonWriter& answer);

/// The field of `write_step_metrics`.
[[nodiscard]] Field step_metrics_field(std::string_view name, std::string_view help);
/// Overshoot and undershoot in percent; null what there is not.
void write_step_metrics(std::string_view name, const classical::StepMetrics& metrics,
                        JsonWriter& answer);

/// A number of poles; infinity for the largest integer, which stands for infinitely many.
[[nodiscard]] double count_of_poles(int count);

/// NaN, which is null, where there is none.
[[nodiscard]] double or_nan(const std::optional<double>& value);
[[nodiscard]] std::optional<double> optional_number(const Problem& problem, std::string_view name);

}  // namespace flyball::solve
