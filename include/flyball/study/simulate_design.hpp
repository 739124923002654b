#pragma once

#include <flyball/simulation/mechanism_loop.hpp>
#include <flyball/study/design.hpp>

namespace flyball::study {

/// The mechanism that a designed loop is tried on, as it differs from the model. A kA that is not
/// determined is its upper bound.
struct DesignTrial {
  double inertia_factor = 1.0;     ///< True inertia over the model's.
  double gain_factor = 1.0;        ///< True actuator gain over the model's.
  double measurement_noise = 0.0;  ///< Standard deviation of a reading, unit (unit/s: flywheel).
  unsigned long long seed = 1;
  MechanismState initial{};          ///< Where the mechanism is when the motion begins.
  std::optional<double> duration{};  ///< s; if absent, the motion and half a second.
};

/// The controller of a design, as robot code, simulations and generated code run it.
[[nodiscard]] MechanismControllerDesign controller_of(const DesignResult& design);

/// The design's reference: the trapezoid to its goal, one row a period, held for half a second or
/// to the end of the duration; of more than a million periods the beginning.
[[nodiscard]] std::vector<MotionState> reference_of(const DesignResult& design,
                                                    std::optional<double> duration = {});

/// Simulates the design's trapezoid with its delay, quantisation, noise and battery.
/// @errors ArgumentError for factors that are not positive, noise that is negative, and a motion of
/// more than a million periods.
[[nodiscard]] Expected<MechanismResponse> simulate_design(const DesignResult& design,
                                                          const DesignTrial& trial);

}  // namespace flyball::study
