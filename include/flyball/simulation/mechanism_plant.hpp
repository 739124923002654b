#pragma once

#include <flyball/mechanisms/mechanism.hpp>

namespace flyball {

using mechanisms::MechanismState;

/// The mechanism that a simulation takes for the truth: kA dv/dt = V - kV v - gravity - friction,
/// with friction that sticks: at rest it holds whatever does not exceed breakaway kS.
///
/// A flywheel and an elevator are integrated exactly, with the instants at which the velocity
/// changes sign. An arm is integrated in steps of at most `arm_step` which are exact but for the
/// gravity, taken at the middle of the step (second order, and stable however small kA is). With
/// kA = 0 the velocity follows the voltage at once (Theorem 14.3.2).
class MechanismPlant {
 public:
  static constexpr double arm_step = 2.5e-4;  ///< s

  /// @param breakaway  Static over sliding friction, >= 1.
  /// @errors ArgumentError: kV not positive, kA or kS negative, breakaway below one, not finite.
  [[nodiscard]] static Expected<MechanismPlant> create(mechanisms::MechanismKind kind,
                                                       const mechanisms::FeedforwardGains& gains,
                                                       double breakaway = 1.0);

  /// The state after `duration` seconds under a constant voltage.
  [[nodiscard]] MechanismState step(const MechanismState& state, double voltage,
                                    double duration) const noexcept;

  /// dv/dt at a state that is moving or about to, m/s² or rad/s²; 0 while it sticks or if kA = 0.
  [[nodiscard]] double acceleration(const MechanismState& state, double voltage) const noexcept;

  [[nodiscard]] mechanisms::MechanismKind kind() const noexcept { return kind_; }
  [[nodiscard]] const mechanisms::FeedforwardGains& gains() const noexcept { return gains_; }

 private:
  MechanismPlant(mechanisms::MechanismKind kind, const mechanisms::FeedforwardGains& gains,
                 double breakaway) noexcept
      : kind_(kind),
        gains_(gains),
        friction_{gains.kS, breakaway},
        motion_(gains.kV, gains.kA, friction_) {}

  mechanisms::MechanismKind kind_;
  mechanisms::FeedforwardGains gains_;
  mechanisms::Friction friction_;
  mechanisms::FrictionMotion motion_;  ///< Exact for a constant drive V - gravity.
};

}  // namespace flyball
