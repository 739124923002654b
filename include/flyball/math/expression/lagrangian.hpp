#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <flyball/math/expression/differentiate.hpp>
#include <flyball/math/expression/tape.hpp>
#include <flyball/math/expression/tape_builder.hpp>
#include <flyball/math/integration/butcher_tableau.hpp>

namespace flyball::expression {

/// What Newton's method on a constrained problem asks of functions y(v): values, Jacobian, and the
/// Hessian of their weighted sum Σ μᵢ yᵢ.
struct Lagrangian {
  /// Inputs: those of the function, then a weight μᵢ for each of its outputs. Outputs: y, the
  /// entries of the Jacobian, the entries of the Hessian.
  Tape tape;
  std::size_t rows = 0;           ///< Outputs of the function.
  std::size_t columns = 0;        ///< Variables: the first inputs of the function.
  std::size_t others = 0;         ///< Inputs of the function that are no variables.
  std::vector<Entry> jacobian{};  ///< ∂y/∂v; structural zeros have no entry.
  std::vector<Entry> hessian{};   ///< Lower triangle of ∂²(μᵀy)/∂v²: row >= column.
};

/// The function and its derivatives, exact but for rounding, as one tape.
/// @param function  Its first `variables` inputs are differentiated by; others are data.
/// Cost: as `differentiate` in reverse, then forward over that; allocates.
/// Source: Griewank and Walther, "Evaluating Derivatives", 2nd ed. 2008, section 3.3.
[[nodiscard]] Lagrangian lagrangian(const Tape& function, std::size_t variables);

/// Several functions of the same inputs as one: their outputs one after the other, the Hessian that
/// of the sum. What they share is computed once.
[[nodiscard]] Lagrangian stack(std::span<const Lagrangian> functions);

/// One step of an explicit Runge-Kutta method, x⁺ = x + h Σ bᵢ kᵢ with
/// kᵢ = f(x + h Σ aᵢⱼ kⱼ, rest): its value and derivatives by the chain rule over the stages, which
/// takes a fraction of the operations that differentiating the whole step would.
///
/// The Hessian is Σ Wᵢᵀ Hᵢ Wᵢ with Wᵢ = ∂(stage's point)/∂v, Hᵢ the Hessian of k̄ᵢᵀf there, and the
/// adjoints k̄ᵢ = h bᵢ μ + h Σ aⱼᵢ Jⱼᵀ k̄ⱼ.
/// @param f  The derivative's Lagrangian; x its first `f.rows` variables.
/// @param tableau  Of an explicit method; entries on the diagonal and above are not looked at.
/// @param step  h.
[[nodiscard]] Lagrangian runge_kutta_step(const Lagrangian& f, const ButcherTableauView& tableau,
                                          double step);

/// The function alone, without its derivatives.
[[nodiscard]] Tape values_of(const Lagrangian& function);

/// Writes what a tape computes into another builder.
/// @param inputs, parameters  What stands for the tape's, as many as it has.
/// @return the slots of its outputs.
[[nodiscard]] std::vector<Slot> replay(TapeBuilder& builder, const Tape& tape,
                                       std::span<const Slot> inputs,
                                       std::span<const Slot> parameters);

}  // namespace flyball::expression
