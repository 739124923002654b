#pragma once

#include <vector>

#include <flyball/control/certificate.hpp>

namespace flyball {

/// The joint confidence set of estimated parameters, {x : (x - x̂)ᵀ Σ⁻¹ (x - x̂) <= χ²}, with the
/// intervals of the others, as a set for `certify_loop`. Some multiple of their standard errors is
/// a box about it that is right for any correlation, but of correlated estimates much larger.
///
/// @param low, high  [p; gain; delay]. Of estimated parameters both are the estimate.
/// @param covariance  Σ in their places; rows and columns of zeros of the other parameters.
/// @param probability  That the ellipsoid contains the truth, 0.95 for example: χ² is the quantile
/// for as many degrees of freedom as there are estimated parameters.
/// @return The ellipsoid's axes first, `round` of them: Σ's own in standard errors; each is wider
/// by more than its rounding.
/// @errors ArgumentError for lengths, shapes, entries, an estimate that is an interval, a Σ that is
/// not positive semidefinite, and a probability beyond (0, 1).
[[nodiscard]] Expected<ParameterSet> parameter_ellipsoid(const std::vector<double>& low,
                                                         const std::vector<double>& high,
                                                         const MatrixRef& covariance,
                                                         double probability = 0.95);

}  // namespace flyball
