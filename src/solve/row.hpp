#pragma once

#include <initializer_list>
#include <vector>

#include <flyball/io/json_writer.hpp>
#include <flyball/systems/system.hpp>

#include "solve/problem.hpp"

/// What the tables of kinds are written with: one row a kind, one file a domain.
namespace flyball::solve {

using Outcome = Expected<void>;

// Fields.

constexpr Field number(std::string_view name, std::string_view unit, std::string_view help) {
  return {.name = name, .type = FieldType::number, .unit = unit, .help = help};
}
constexpr Field integer(std::string_view name, std::string_view help) {
  return {.name = name, .type = FieldType::integer, .help = help};
}
constexpr Field flag(std::string_view name, std::string_view help) {
  return {.name = name, .type = FieldType::flag, .help = help};
}
constexpr Field text(std::string_view name, std::string_view help) {
  return {.name = name, .type = FieldType::text, .help = help};
}
constexpr Field texts(std::string_view name, std::string_view length, std::string_view help) {
  return {.name = name, .type = FieldType::texts, .rows = length, .help = help};
}
constexpr Field choice(std::string_view name, std::string_view choices, std::string_view help) {
  return {.name = name, .type = FieldType::choice, .help = help, .choices = choices};
}
constexpr Field matrix(std::string_view name, std::string_view rows, std::string_view columns,
                       std::string_view help, std::string_view unit = {}) {
  return {.name = name,
          .type = FieldType::matrix,
          .rows = rows,
          .columns = columns,
          .unit = unit,
          .help = help};
}
constexpr Field samples(std::string_view name, std::string_view rows, std::string_view columns,
                        std::string_view help) {
  return {.name = name, .type = FieldType::samples, .rows = rows, .columns = columns, .help = help};
}
constexpr Field list(std::string_view name, std::string_view length, std::string_view unit,
                     std::string_view help) {
  return {.name = name,
          .type = FieldType::list,
          .rows = length,
          .columns = "1",
          .unit = unit,
          .help = help};
}
constexpr Field complex_list(std::string_view name, std::string_view length,
                             std::string_view help) {
  return {.name = name, .type = FieldType::complex_list, .rows = length, .help = help};
}
constexpr Field matrices(std::string_view name, std::string_view rows, std::string_view columns,
                         std::string_view help) {
  return {
      .name = name, .type = FieldType::matrices, .rows = rows, .columns = columns, .help = help};
}
/// @param names  Of its numbers, separated by spaces. They may be null where there is none.
constexpr Field record(std::string_view name, std::string_view names, std::string_view help) {
  return {
      .name = name, .type = FieldType::record, .help = help, .choices = names, .unbounded = true};
}
constexpr Field records(std::string_view name, std::string_view names, std::string_view help) {
  return {
      .name = name, .type = FieldType::records, .help = help, .choices = names, .unbounded = true};
}
constexpr Field system(std::string_view name, std::string_view states, std::string_view inputs,
                       std::string_view outputs, std::string_view help) {
  return {.name = name,
          .type = FieldType::system,
          .rows = states,
          .columns = inputs,
          .outputs = outputs,
          .help = help};
}

/// A transfer function. @param num, den  The sizes of its lists of coefficients.
constexpr Field transfer(std::string_view name, std::string_view num, std::string_view den,
                         std::string_view help) {
  return {.name = name, .type = FieldType::transfer, .rows = num, .columns = den, .help = help};
}

/// Rows of transfer functions.
constexpr Field transfers(std::string_view name, std::string_view rows, std::string_view columns,
                          std::string_view help) {
  return {
      .name = name, .type = FieldType::transfers, .rows = rows, .columns = columns, .help = help};
}

/// @param inner  The fields of each; letters of its shapes are its own.
constexpr Field objects(std::string_view name, const std::vector<Field>& inner,
                        std::string_view help) {
  return {.name = name, .type = FieldType::objects, .help = help, .inner = &inner};
}

// What holds for a field that is left out.

constexpr Field optional(Field field, Absent absent = Absent::nothing, double otherwise = 0.0) {
  field.absent = absent;
  field.otherwise = otherwise;
  return field;
}
constexpr Field or_zero(Field field) {
  return optional(field, Absent::zero);
}
constexpr Field or_identity(Field field) {
  return optional(field, Absent::identity);
}
constexpr Field or_number(Field field, double value) {
  return optional(field, Absent::number, value);
}
constexpr Field or_first(Field field) {
  return optional(field, Absent::first_choice);
}

/// A field of an answer that may be infinite, or NaN where there is no such number.
constexpr Field unbounded(Field field) {
  field.unbounded = true;
  return field;
}

// Fields that many kinds have.

namespace field {

inline constexpr Field A = matrix("A", "n", "n", "how the states move by themselves");
inline constexpr Field B = matrix("B", "n", "m", "how the inputs move the states");
inline constexpr Field C = or_identity(matrix("C", "p", "n", "how the outputs see the states"));
inline constexpr Field D = or_zero(matrix("D", "p", "m", "how the inputs reach the outputs"));
inline constexpr Field Q = matrix("Q", "n", "n", "symmetric weight of the states", "1/state²");
inline constexpr Field R = matrix("R", "m", "m", "symmetric weight of the inputs", "1/input²");
inline constexpr Field N = optional(matrix(
    "N", "n", "m", "cross weight of states and inputs, 2xᵀNu in the cost", "1/(state input)"));
inline constexpr Field domain =
    choice("domain", "continuous discrete", "whether dx/dt = Ax + Bu or x⁺ = Ax + Bu");
inline constexpr Field period = number("T", "s", "sample period of a discrete system");
/// The period where it only scales time and frequency.
inline constexpr Field any_period = or_number(period, 1.0);

inline constexpr Field riccati_residual = number(
    "residual", "",
    "what is left of the equation with K as answered, or of K's own, over the sum of its terms' "
    "norms, the larger");
inline constexpr Field residual =
    number("residual", "", "what is left of the equation over the sum of its terms' norms");
inline constexpr Field error = number(
    "relative_error", "", "how much the last digits of the data move the answer, relative to it");
inline constexpr Field condition = unbounded(number(
    "condition", "", "how much relative errors of the data grow in the answer, an estimate"));

}  // namespace field

/// A, B, C and D of an answer.
[[nodiscard]] std::vector<Field> answered_system(std::string_view states, std::string_view inputs,
                                                 std::string_view outputs);
template <class System>
void write_system(const System& system, JsonWriter& answer) {
  answer.add("A", system.A);
  answer.add("B", system.B);
  answer.add("C", system.C);
  answer.add("D", system.D);
}

[[nodiscard]] std::vector<Field> operator+(std::vector<Field> some, const std::vector<Field>& more);

/// An answer that is not much larger than a machine's memory: how many numbers it would hold.
/// @param about  The field that makes it large. @errors ArgumentError::out_of_range.
[[nodiscard]] Outcome check_size(double numbers, std::string_view where, std::string_view about);

/// A system whose matrices are those of a discrete one, with the problem's T.
[[nodiscard]] inline DiscreteSystem<> sampled(const Problem& problem,
                                              const ContinuousSystem<>& system) {
  return {system.A, system.B, system.C, system.D, Time(problem.number("T"))};
}

/// What `function` makes of the matrices A, B, C, D as a system of the problem's domain.
template <class Function>
[[nodiscard]] Outcome with_system(const Problem& problem, Function&& function) {
  const ContinuousSystem<> system = problem.system();
  return problem.domain() == TimeDomain::continuous ? function(system)
                                                    : function(sampled(problem, system));
}

// The tables, one a domain.

[[nodiscard]] std::vector<Kind> matrix_equation_kinds();
[[nodiscard]] std::vector<Kind> system_kinds();
[[nodiscard]] std::vector<Kind> response_kinds();
[[nodiscard]] std::vector<Kind> transfer_function_kinds();
[[nodiscard]] std::vector<Kind> root_locus_kinds();
[[nodiscard]] std::vector<Kind> step_kinds();
[[nodiscard]] std::vector<Kind> transfer_algebra_kinds();
[[nodiscard]] std::vector<Kind> frequency_response_kinds();
[[nodiscard]] std::vector<Kind> realization_kinds();
[[nodiscard]] std::vector<Kind> interconnection_kinds();
[[nodiscard]] std::vector<Kind> diagram_kinds();
[[nodiscard]] std::vector<Kind> certificate_kinds();
[[nodiscard]] std::vector<Kind> regulator_kinds();
[[nodiscard]] std::vector<Kind> predictive_control_kinds();
[[nodiscard]] std::vector<Kind> feedforward_kinds();
[[nodiscard]] std::vector<Kind> follower_kinds();
[[nodiscard]] std::vector<Kind> pid_kinds();
[[nodiscard]] std::vector<Kind> compensator_kinds();
[[nodiscard]] std::vector<Kind> estimator_kinds();
[[nodiscard]] std::vector<Kind> regression_kinds();
[[nodiscard]] std::vector<Kind> spectrum_kinds();
[[nodiscard]] std::vector<Kind> filter_kinds();
[[nodiscard]] std::vector<Kind> identification_kinds();

}  // namespace flyball::solve
