#pragma once

#include <optional>
#include <string>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/identification/feedforward_fit.hpp>
#include <flyball/identification/preparation.hpp>

namespace flyball::identification {

/// How well the gravity of a kind explains a recording.
struct KindEvidence {
  mechanisms::MechanismKind kind{};
  /// Fall of the robust χ² below that of a model without gravity, over what correlated residuals
  /// inflate it by; 0 for a flywheel.
  double evidence = 0.0;
  double gravity = 0.0;         ///< V, |kG|.
  double standard_error = 0.0;  ///< V, of it; infinite if the tests do not tell it from friction.
  double nrmse = 0.0;           ///< Of the simulated velocity.
};

/// What a recording tells of the kind of its mechanism.
struct MechanismChoice {
  /// The kinds that explain it; a single one is the clear winner. An elevator of a recording in
  /// radians is one whose drum's angle was recorded.
  std::vector<mechanisms::MechanismKind> fitting{};
  std::string evidence{};                ///< As a clause with its numbers.
  std::vector<KindEvidence> compared{};  ///< Of every kind that the unit allows.
  double travel = 0.0;                   ///< Largest in one test, m or rad.
};

/// Weighs no gravity (flywheel), a constant one (elevator) and one with the angle's cosine (arm):
/// each is fitted, and the falls of the cost are compared as those of other terms of the model.
/// Beside gravity the travel speaks: an arm keeps within a turn, an elevator within a few metres,
/// a flywheel within neither; what keeps within a turn without gravity may be a turret.
///
/// @param prepared  With or without a mechanism, which is not looked at.
/// @errors IdentificationError, as `identify_feedforward` for tests that give no gains.
/// Cost: some three fits of the gains, thinned.
[[nodiscard]] Expected<MechanismChoice> choose_mechanism(const PreparedRecording& prepared,
                                                         const FitOptions& options = {});

}  // namespace flyball::identification
