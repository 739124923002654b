#pragma once

#include <vector>

#include <flyball/classical/frequency_response.hpp>
#include <flyball/systems/conversion.hpp>

namespace flyball::classical {

/// What a method makes of a continuous system, over the frequencies.
struct DiscretizedResponse {
  ConversionMethod method = ConversionMethod::zoh;
  Eigen::VectorXcd response;    ///< G_d(e^{jωT})
  Eigen::VectorXd gain_error;   ///< dB, 20 log |G_d/G|.
  Eigen::VectorXd phase_error;  ///< deg, arg G_d/G in (-180, 180].
  double largest_error = 0.0;   ///< |G_d/G - 1| at most, of the frequencies that were asked for.
  bool stable = false;          ///< Of G_d: forward Euler may lose it.
};

/// The methods of Table 7.2 and E.3 side by side; those that have no image of the system are left
/// out.
struct DiscretizationComparison {
  Eigen::VectorXd frequency;  ///< rad/s, up to π/T.
  Eigen::VectorXcd continuous;
  std::vector<DiscretizedResponse> methods{};  ///< By largest error.
};

/// @param system  One input, one output. @param period  T, s.
/// @param frequencies  rad/s, positive, increasing, up to π/T.
/// @errors ArgumentError for the system, period and frequencies; TransferError::at_a_pole for a
/// frequency at a pole. Cost: O(n³). Source: book, sections 7.3 and E.5.
[[nodiscard]] Expected<DiscretizationComparison> compare_discretizations(
    const ContinuousSystem<>& system, Time period, const Eigen::VectorXd& frequencies);
/// At 200 frequencies from a thousandth of π/T up to it. @errors As above.
[[nodiscard]] Expected<DiscretizationComparison> compare_discretizations(
    const ContinuousSystem<>& system, Time period);

}  // namespace flyball::classical
