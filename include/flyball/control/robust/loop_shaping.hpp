#pragma once

#include <optional>

#include <flyball/control/robust/h_infinity.hpp>

namespace flyball {

/// How robustly a controller stabilises a plant, for every kind of error at once: the loop stays
/// stable for every plant whose normalised coprime factors are wrong by less than ε,
///
///   ε = 1/‖[I; K] (I + GK)⁻¹ [I, G]‖∞, 0 <= ε <= 1
///
/// (0.25 to 0.3 is good); also the distance, in the ν-gap, up to which another plant is stabilised.
/// @param controller  K of negative feedback, u = -K y. @return ε, 0 of an unstable loop.
/// @errors ArgumentError for shapes and entries; SystemError::period_mismatch, algebraic_loop,
///         no_convergence. Cost: one H∞ norm; allocates.
/// Source: Glover and McFarlane, IEEE Trans. Automatic Control 34 (1989); Vinnicombe, same, 38
/// (1993).
[[nodiscard]] Expected<double> coprime_margin(const ContinuousSystem<>& plant,
                                              const ContinuousSystem<>& controller);
[[nodiscard]] Expected<double> coprime_margin(const DiscreteSystem<>& plant,
                                              const DiscreteSystem<>& controller);

/// What brings a plant into the shape that its loop is to have, W₂ G W₁: high gain where it is to
/// follow, low gain where it is not known, a slope of about one between. One that is left out is
/// one.
template <class System = ContinuousSystem<>>
struct LoopShape {
  std::optional<System> before{};  ///< W₁, on the plant's inputs; such as an integrator.
  std::optional<System> behind{};  ///< W₂, on its outputs.
};

/// A controller of H∞ loop shaping.
template <class System = ContinuousSystem<>>
struct LoopShapingDesign {
  System controller;         ///< W₁ K_s W₂, of negative feedback u = -K y.
  System shaped_plant;       ///< W₂ G W₁
  System shaped_controller;  ///< K_s
  Eigen::VectorXcd poles;    ///< Of the closed loop of the two.
  double margin = 0.0;       ///< ε of the shaped plant and controller, computed of that loop.
  /// The largest ε of any controller, 1/√(1 + ρ(XZ)): whether the shape is compatible with
  /// stability. Below 0.2 or so it is not: choose another.
  double largest_margin = 0.0;
};

/// Glover and McFarlane's loop shaping: the controller that stabilises the shaped plant with the
/// margin ε = largest/factor, in closed form from two Riccati equations, no iteration.
/// @param factor  Above 1: how much of the margin is given away for a controller whose poles are
/// ordinary; 1.1 is usual.
/// @errors ArgumentError for shapes, entries and the factor; SynthesisError::not_stabilizable,
///         not_detectable of the shaped plant, not_verified; SystemError::period_mismatch,
///         no_image, algebraic_loop. Cost: two Riccati equations, one norm; allocates.
/// Source: McFarlane and Glover, IEEE Trans. Automatic Control 37 (1992); Skogestad and
/// Postlethwaite, "Multivariable Feedback Control", section 9.4, equations (9.67) to (9.71).
[[nodiscard]] Expected<LoopShapingDesign<ContinuousSystem<>>> loop_shaping(
    const ContinuousSystem<>& plant, const LoopShape<ContinuousSystem<>>& shape = {},
    double factor = 1.1);
[[nodiscard]] Expected<LoopShapingDesign<DiscreteSystem<>>> loop_shaping(
    const DiscreteSystem<>& plant, const LoopShape<DiscreteSystem<>>& shape = {},
    double factor = 1.1);

}  // namespace flyball
