#pragma once

#include <string>
#include <vector>

#include <tl/expected.hpp>

#include <flyball/math/expression/formula.hpp>
#include <flyball/systems/any_model.hpp>

namespace flyball {

/// A model in text; the language is that of docs/formulas.md. Units may be any that
/// `parse_si_unit` reads; the model itself is in SI.
///
/// ```
/// const AnyModel pendulum = formula_model({
///     .name = "pendulum",
///     .states = {{"theta", "rad", true}, {"omega", "rad/s"}},
///     .inputs = {{"u", "N m"}},
///     .parameters = {{"g", "m/s^2", 9.81}, {"l", "m", 0.5}, {"m", "kg", 2.0}},
///     .derivatives = {{"theta", "omega"}, {"omega", "-g/l*sin(theta) + u/(m*l^2)"}}}).value();
/// ```
struct ModelFormulas {
  std::string name{};
  /// A unit that is empty is not known, and not checked; "1" is that of a plain number.
  std::vector<Coordinate> states{};
  std::vector<Coordinate> inputs{};
  std::vector<Parameter> parameters{};  ///< Each value in its unit.
  /// Each usable by those after it, by the derivatives and by the outputs.
  std::vector<expression::Formula> definitions{};
  /// One a state, of its name, in any order; in the state's unit a second, said or not.
  std::vector<expression::Formula> derivatives{};
  /// Names that may be those of states; none: the states.
  std::vector<expression::Formula> outputs{};
};

/// The model that formulas describe: values, Jacobians by states, inputs and parameters, all exact,
/// from tapes that are made here once. The result may be used by several threads at once. An output
/// that is a state alone is an angle where the state is; a unit that an output does not say is that
/// of its formula.
///
/// @return   The model, or all that is wrong with the formulas. An error's `where()` is the name of
///           a definition, "derivative of NAME", "output NAME", or empty where the names and units
///           themselves are wrong, and then its subject is the name.
/// @errors   ExpressionError; ArgumentError::empty without states and for a state without
///           derivative, unknown_name for a derivative of something else, ambiguous_name for two of
///           one state, or two outputs of one name.
/// Cost: linear in the text and, for the Jacobians, in its product with the number of variables;
/// allocates. A call of the model is a pass over a tape, and allocates where that has more than
/// about 600 operations.
[[nodiscard]] tl::expected<AnyModel, std::vector<Error>> formula_model(
    const ModelFormulas& formulas);

/// The derivatives of a model, in the order of its states, and further formulas of its names after
/// them, as one tape of [x; u]: what proofs, energies and generated code are made of.
/// @param further  Each with its name, for messages. @errors As `formula_model`, whose outputs are
/// not looked at. Cost: linear in the text; allocates.
[[nodiscard]] tl::expected<expression::CompiledFormulas, std::vector<Error>> model_equations(
    const ModelFormulas& formulas, const std::vector<expression::Formula>& further = {});

}  // namespace flyball
