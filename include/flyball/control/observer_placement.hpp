#pragma once

#include <complex>
#include <initializer_list>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include <flyball/control/pole_placement.hpp>

namespace flyball {

/// An observer's gain from its poles.
struct ObserverPlacement {
  Eigen::MatrixXd L;  ///< n x p, predictor form (Theorem 9.2.1).
  /// n x p, filter form A⁻¹L of a discrete plant (Theorem 9.2.2), if A has an inverse.
  std::optional<Eigen::MatrixXd> K;
  Eigen::VectorXcd poles;   ///< Eigenvalues of A - LC, in the order that was asked for.
  double condition = 0.0;   ///< As of a PolePlacement.
  double pole_error = 0.0;  ///< As there.
  std::vector<std::complex<double>> unobservable;  ///< Modes that no output shows, which stay.
};

/// The L whose error dynamics e⁺ = (A - LC) e (9.8) have the given poles: the dual of `place`,
/// whose gain for (Aᵀ, Cᵀ) is Lᵀ. Poles that are some times faster than those of the regulator are
/// the custom; `kalman_gain` finds those that fit the noise. By the separation principle
/// (section 9.2.2) the regulator's poles stay what they are.
/// @param plant  A and C of it are used. @param poles  n, complex ones in conjugate pairs, in the
///               z-plane of a discrete plant and the s-plane of a continuous one.
/// @errors As `place`; instead of not_controllable, PolePlacementError::not_observable with the
/// mode
///         that no output shows. Cost: as `place`. Source: book, sections 9.2.1 and 7.6.
///@{
[[nodiscard]] Expected<ObserverPlacement> place_observer(const DiscreteSystem<>& plant,
                                                         const Eigen::VectorXcd& poles);
[[nodiscard]] Expected<ObserverPlacement> place_observer(const ContinuousSystem<>& plant,
                                                         const Eigen::VectorXcd& poles);
///@}

/// The same for a plant with its sizes.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<ObserverPlacement> place_observer(
    const DiscreteSystem<States, Inputs, Outputs>& plant, const Eigen::VectorXcd& poles) {
  return place_observer(DiscreteSystem<>{plant.A, plant.B, plant.C, plant.D, plant.period}, poles);
}
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<ObserverPlacement> place_observer(
    const ContinuousSystem<States, Inputs, Outputs>& plant, const Eigen::VectorXcd& poles) {
  return place_observer(ContinuousSystem<>{plant.A, plant.B, plant.C, plant.D}, poles);
}

}  // namespace flyball
