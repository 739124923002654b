#pragma once

#include <flyball/control/robust/h_infinity.hpp>

#include "control/robust/partition.hpp"

namespace flyball::detail {

/// A plant with D₁₂ = [0; I], D₂₁ = [0 I] and D₂₂ = 0: z and w turned, u and y in other units.
struct NormalizedPlant {
  Partition P;
  Eigen::MatrixXd controls;      ///< u = controls u'.
  Eigen::MatrixXd measurements;  ///< y' = measurements y.
  Eigen::MatrixXd D22;           ///< Of the plant as given.
};

/// @errors SynthesisError::control_without_weight, measurement_without_noise.
[[nodiscard]] Expected<NormalizedPlant> normalized(Partition P, std::string_view where);

/// What must hold for any γ. @param discrete  The plant's bilinear image is what is given: zeros
/// and modes are told as they are in z.
/// @errors SynthesisError of the first five.
[[nodiscard]] Expected<void> check_assumptions(const NormalizedPlant& plant, bool discrete,
                                               std::string_view where);

/// The controller of the given plant from one of the normalized plant.
/// @errors SystemError::algebraic_loop.
[[nodiscard]] Expected<ContinuousSystem<>> denormalized(const NormalizedPlant& plant,
                                                        const ContinuousSystem<>& controller,
                                                        std::string_view where);

}  // namespace flyball::detail
