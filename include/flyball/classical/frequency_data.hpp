#pragma once

#include <optional>

#include <flyball/classical/frequency_response.hpp>
#include <flyball/classical/loop_margins.hpp>
#include <flyball/math/spectra/welch.hpp>

namespace flyball::classical {

/// A frequency response that was measured: values at frequencies, and no model.
///
/// Between them ln G, gain and unwrapped phase, is a cubic over ln ω through the neighbours
/// (straight where a gain is zero, and from ω = 0 to the next), so that a power of ω is exact. The
/// phase is taken to turn by less than 180° from one frequency to the next.
class FrequencyData {
 public:
  /// @param frequency  rad/s, increasing, not negative.
  /// @param values  outputs·inputs x frequencies, each G column by column.
  /// @param period  Of a discrete system: frequencies up to π/T.
  /// @errors ArgumentError::empty, not_finite; wrong_shape; out_of_range with the place where the
  /// frequencies do not increase (one that is there twice, among them), are negative or above π/T.
  [[nodiscard]] static Expected<FrequencyData> create(const Eigen::VectorXd& frequency,
                                                      const Eigen::MatrixXcd& values,
                                                      Eigen::Index outputs = 1,
                                                      Eigen::Index inputs = 1,
                                                      std::optional<Time> period = std::nullopt);
  /// A measurement, without the frequencies at which an input had no power.
  /// @param least_coherence  Frequencies with less of it for any output are left out.
  /// @errors As `create`; empty where no frequency is left.
  [[nodiscard]] static Expected<FrequencyData> from_measurement(
      const FrequencyResponseEstimate& estimate, double least_coherence = 0.0);
  /// A system's values. @errors As `create` and `FrequencyResponse::sample`.
  [[nodiscard]] static Expected<FrequencyData> sampled(const FrequencyResponse& response,
                                                       const Eigen::VectorXd& frequency);

  [[nodiscard]] const Eigen::VectorXd& frequency() const { return frequency_; }
  [[nodiscard]] const Eigen::MatrixXcd& values() const { return values_; }
  [[nodiscard]] Eigen::Index outputs() const { return outputs_; }
  [[nodiscard]] Eigen::Index inputs() const { return inputs_; }
  [[nodiscard]] const std::optional<Time>& period() const { return period_; }
  /// Between the frequencies too: what `bode` and the others take.
  [[nodiscard]] FrequencyResponse response() const;

 private:
  FrequencyData() = default;

  Eigen::VectorXd frequency_;
  Eigen::MatrixXcd values_;
  Eigen::Index outputs_ = 1;
  Eigen::Index inputs_ = 1;
  std::optional<Time> period_;
};

/// G₂G₁ at the first's frequencies, the second interpolated.
/// @errors ArgumentError::wrong_shape; out_of_range where the second does not reach as far;
/// TransferError::period_mismatch.
[[nodiscard]] Expected<FrequencyData> series(const FrequencyData& first,
                                             const FrequencyData& second);
/// G₁ + G₂. @errors As `series`.
[[nodiscard]] Expected<FrequencyData> parallel(const FrequencyData& first,
                                               const FrequencyData& second);
/// (I ± G₁G₂)⁻¹G₁. @errors As `series`; TransferError::at_a_pole where I ± G₁G₂ is singular.
[[nodiscard]] Expected<FrequencyData> feedback(const FrequencyData& forward,
                                               const FrequencyData& back, bool negative = true);

/// Margins of a measured loop: every crossing of the cubics between its frequencies; what lies
/// beyond them is not known and not counted. Whether the loop is stable hangs on what was measured
/// as well: the curve is taken to begin on its asymptote and to end near zero.
/// @param loop  One input, one output, two frequencies at least.
/// @param open_loop_unstable  Poles of L right of the axis, which no response tells.
/// @errors ArgumentError::wrong_shape, empty, out_of_range.
[[nodiscard]] Expected<LoopMargins> loop_margins(const FrequencyData& loop,
                                                 int open_loop_unstable = 0);

}  // namespace flyball::classical
