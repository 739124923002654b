#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/identification/drive_fit.hpp>
#include <flyball/identification/feedforward_fit.hpp>

namespace flyball::identification {

/// What several logs of one mechanism say of one gain.
struct GainComparison {
  std::string name{};  ///< "kS", "kV", "kA", "kG", "angle_offset".
  std::string unit{};
  std::vector<std::size_t> logs{};  ///< Those that determine it, by their index.
  double mean = 0.0;                ///< Σ w x / Σ w, w = 1/(σ² + between²).
  double standard_error = 0.0;      ///< Of the mean.
  double between = 0.0;    ///< Standard deviation among logs beyond their own errors, at least 0.
  double ratio = 1.0;      ///< √(Q/(k − 1)), Birge's, at least 1: scatter over what was expected.
  double p_value = 1.0;    ///< Of as large a scatter where the logs measure one value.
  double largest_z = 0.0;  ///< Of two logs: |x − y|/√(σx² + σy²), the largest.
  std::array<std::size_t, 2> pair{};     ///< The two logs.
  std::optional<std::size_t> outlier{};  ///< The one log without which the others agree.

  /// Whether the scatter is what the logs' own errors explain.
  [[nodiscard]] bool agrees() const { return p_value >= least_p_value; }
  static constexpr double least_p_value = 0.01;
};

/// One gain of several logs, compared; nothing where fewer than two determine it.
/// @param gains  Of each log; null for one that has no such gain.
///
/// With x_i ± σ_i of k logs, w_i = 1/σ_i² and x̄ = Σ w x/Σ w, Q = Σ w (x − x̄)² has the
/// chi-squared distribution of k − 1 degrees of freedom where the logs measure one value;
/// between² = max(0, (Q − k + 1)/(Σ w − Σ w²/Σ w)).
/// Source: Cochran, "The combination of estimates from different experiments", Biometrics 10
/// (1954); DerSimonian and Laird, Controlled Clinical Trials 7 (1986).
[[nodiscard]] std::optional<GainComparison> compare_gain(
    std::string name, std::string unit, std::span<const GainEstimate* const> gains);

/// The gains that at least two of the fits determine, compared.
/// @errors ArgumentError::wrong_shape for less than two fits, wrong_unit for different mechanisms
/// or units.
[[nodiscard]] Expected<std::vector<GainComparison>> compare_fits(
    const std::vector<FeedforwardFit>& fits);

/// The gains of a joint fit with what the logs differ by. Where they agree, interval and standard
/// error grow by Birge's ratio; where not, the error is √(σ² + between²/k), and the interval takes
/// Student's t with Satterthwaite's degrees of freedom.
/// Source: Birge, Physical Review 40 (1932); Particle Data Group, "Review of Particle Physics",
/// section 5.2.2.
void widen_by_scatter(FeedforwardFit& joint, const std::vector<GainComparison>& comparisons);

/// A gain of a drivetrain by its name: "kS_linear", "kV_linear", "kA_linear", those of "angular"
/// (per unit of a wheel's way), "kS_left", "kS_right", "trackwidth". @return  Null if it has none.
[[nodiscard]] const GainEstimate* drive_gain(const DriveFit& fit, std::string_view name);

/// The gains of a drivetrain that at least two of its logs determine. @errors As those of fits.
[[nodiscard]] Expected<std::vector<GainComparison>> compare_fits(const std::vector<DriveFit>& fits);

/// The same for a drivetrain's joint fit.
void widen_by_scatter(DriveFit& joint, const std::vector<GainComparison>& comparisons);

/// The runs of several logs of one drivetrain, in their order.
/// @errors ArgumentError::empty; wrong_unit for different units.
[[nodiscard]] Expected<DriveRecording> joined(const std::vector<DriveRecording>& recordings);

/// The runs of several recordings of one mechanism, in their order. A channel that not every
/// recording has is left out.
/// @errors ArgumentError::empty; wrong_unit for different mechanisms or units; wrong_shape for
/// recordings that share neither position nor velocity.
[[nodiscard]] Expected<Recording> joined(const std::vector<Recording>& recordings);

}  // namespace flyball::identification
