#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include <flyball/math/spectra/welch.hpp>
#include <flyball/systems/system.hpp>

namespace flyball::identification {

/// How to fit a frequency response.
struct FrequencyFitOptions {
  Eigen::Index poles = 2;   ///< Common to all entries.
  bool feedthrough = true;  ///< Whether D is fitted; else it is zero.
  bool stable = true;       ///< Poles that are not stable are reflected.
  /// Frequencies x 1, or x entries (column by column of the response), not negative: what an error
  /// counts, as 1/deviation. None: every error counts alike.
  std::optional<Eigen::MatrixXd> weights{};
  int most_iterations = 40;
};

/// A fitted system, and how near it is.
template <class System>
struct FrequencyFit {
  System system;                 ///< poles · min(inputs, outputs) states.
  Eigen::VectorXcd poles;        ///< The common ones.
  double error = 0.0;            ///< √(Σ |w (G - Ĝ)|² / Σ |w G|²).
  Eigen::Index frequencies = 0;  ///< Those that counted.
  int iterations = 0;
};

/// The rational system nearest to a measured frequency response.
///
/// Vector fitting: G σ = Σ R_i/(s - p_i) + D with σ = d + Σ c_i/(s - p_i) is linear in all but the
/// poles; the zeros of σ are better poles, until they stay. The best of all iterations is then
/// corrected by Gauss and Newton, the residues following the poles, to the least squares of G - Ĝ
/// itself.
/// @param frequency  rad/s, not negative, increasing. @param response  Outputs x inputs for each
/// frequency; those with NaN do not count.
/// @errors ArgumentError for shapes, entries, options; IdentificationError::too_short for fewer
/// frequencies than poles need.
/// Cost: O(frequencies poles² entries) an iteration, allocates.
/// Source: book, section E.7; Gustavsen and Semlyen, IEEE Trans. Power Delivery 14 (1999);
/// Gustavsen, same, 21 (2006) (the free d); Deschrijver et al., IEEE Microwave and Wireless
/// Components Letters 18 (2008) (entry by entry); Golub and Pereyra, SIAM J. Numerical Analysis 10
/// (1973) (variable projection).
[[nodiscard]] Expected<FrequencyFit<ContinuousSystem<>>> fit_frequency_response(
    const Eigen::VectorXd& frequency, const std::vector<Eigen::MatrixXcd>& response,
    const FrequencyFitOptions& options);

/// The same of a discrete system: Ĝ(e^(jωT)) by the bilinear map of its circle to the axis.
/// @param frequency  Below half the sample rate.
[[nodiscard]] Expected<FrequencyFit<DiscreteSystem<>>> fit_frequency_response(
    const Eigen::VectorXd& frequency, const std::vector<Eigen::MatrixXcd>& response, Time period,
    const FrequencyFitOptions& options);

/// 1/radius of each entry: an estimate's own weights. Where it is not known it does not count.
[[nodiscard]] Eigen::MatrixXd weights_of(const FrequencyResponseEstimate& estimate);

}  // namespace flyball::identification
