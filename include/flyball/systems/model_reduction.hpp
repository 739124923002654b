#pragma once

#include <string_view>

#include <flyball/systems/system.hpp>
#include <flyball/systems/system_error.hpp>

namespace flyball {

/// A system as the sum of two, G = stable + unstable.
template <class System>
struct SpectralSplit {
  System stable;          ///< With the feedthrough; maybe of no states.
  System unstable;        ///< Its poles are beyond the border of stability; D = 0.
  Eigen::MatrixXd T;      ///< n x n: x = T [x_s; x_u].
  double residual = 0.0;  ///< What couples the two, relative to A, and was left out.
};

/// Splits a system by its stable and unstable poles: an orthonormal basis of the unstable modes by
/// the matrix sign function, then the coupling that is left is taken out by a Sylvester equation.
/// @errors ArgumentError for the system; SystemError::not_stable with a pole on the border, which
///         belongs to neither; no_convergence. Cost: some twenty times O(n³), allocates.
/// Source: Roberts, Int. J. Control 32 (1980); Safonov, Jonckheere, Verma and Limebeer, same, 46
/// (1987).
[[nodiscard]] Expected<SpectralSplit<ContinuousSystem<>>> split_spectrum(
    const ContinuousSystem<>& system);
[[nodiscard]] Expected<SpectralSplit<DiscreteSystem<>>> split_spectrum(
    const DiscreteSystem<>& system);

/// How a model becomes smaller.
enum class ReductionMethod {
  truncation,  ///< The weakest balanced states are left out: exact at infinite frequency.
  matched,     ///< They are at rest always (singular perturbation): exact at frequency zero.
  coprime,     ///< The normalised right coprime factors are truncated: unstable poles may move.
};
/// "truncation", "matched", "coprime".
[[nodiscard]] std::string_view to_string(ReductionMethod method);

/// A smaller model, and how far it is from the given one.
template <class System>
struct ReducedModel {
  System system;              ///< Of `order` states.
  Eigen::VectorXd hankel;     ///< σ of what was reduced: the stable part, or the coprime factors.
  Eigen::Index unstable = 0;  ///< States of the unstable part, kept as they are; 0 of coprime.
  double error_bound = 0.0;   ///< 2 Σ of the σ left out.
  /// ‖G - G_r‖∞, or that of the factors [M; N], computed: at most `error_bound`. The largest gain
  /// found, where the search for the norm did not end.
  double error = 0.0;
};

/// The stable part is balanced and its weakest states are left out; the unstable part is kept. Of
/// all frequencies the error is at most 2 Σ σ of what was left out, and is computed besides.
/// @param order  Of the reduced model: at least the number of unstable poles, at most that of
/// states with a σ above rounding, the unstable ones counted.
/// @errors ArgumentError::out_of_range for the order, with its range; as `split_spectrum`,
///         `balanced_truncation`; RiccatiError of coprime factors.
/// Cost: O(n³ log κ) and an H∞ norm; allocates.
/// Source: Enns, IEEE Conf. Decision and Control (1984); Liu and Anderson, Int. J. Control 50
/// (1989), for matched; Meyer, American Control Conference (1988), for coprime factors.
[[nodiscard]] Expected<ReducedModel<ContinuousSystem<>>> reduce_model(
    const ContinuousSystem<>& system, Eigen::Index order,
    ReductionMethod method = ReductionMethod::truncation);
[[nodiscard]] Expected<ReducedModel<DiscreteSystem<>>> reduce_model(
    const DiscreteSystem<>& system, Eigen::Index order,
    ReductionMethod method = ReductionMethod::truncation);

}  // namespace flyball
