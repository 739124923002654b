#pragma once

#include <initializer_list>
#include <span>
#include <string_view>

#include <flyball/core/argument.hpp>
#include <flyball/core/matrix_argument.hpp>

namespace flyball {

/// A covariance per sample: a matrix, or what `standard_deviations` or `discretize` answered.
/// A spectral density (ProcessDensity, MeasurementDensity) does not convert to it: `discretize` it.
using Covariance = MatrixArgument<struct CovarianceTag>;

/// diag(σ²) from standard deviations per sample.
/// @param sigmas  Of each state or output, in its unit; zero is allowed.
/// @errors ArgumentError::out_of_range (negative), not_finite, each naming the entry; empty.
[[nodiscard]] Expected<Eigen::MatrixXd> standard_deviations(std::span<const double> sigmas);
[[nodiscard]] Expected<Eigen::MatrixXd> standard_deviations(std::initializer_list<double> sigmas);

/// Whether a matrix can be a covariance: finite, symmetric, and without a negative variance in any
/// direction, each entry judged in the units of its row and column (by 1e-12).
/// @param S  Square. @param where  The function's name. @param name  The argument's name.
/// @errors ArgumentError::not_finite, not_symmetric; not_positive with the direction's variance,
///         relative to those of its entries.
/// Cost: O(n³), allocates.
[[nodiscard]] Expected<void> check_covariance(const MatrixRef& S, std::string_view where,
                                              std::string_view name);

namespace detail {

/// ArgumentError::not_finite: a state with what is no number.
[[nodiscard]] Expected<void> unusable_state(std::string_view where, std::string_view name);
/// ArgumentError::out_of_range: a covariance that is one, but not one that a filter can carry.
[[nodiscard]] Expected<void> unusable_covariance(std::string_view where, std::string_view name);

}  // namespace detail

}  // namespace flyball
