#pragma once

#include <initializer_list>
#include <span>

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

}  // namespace flyball
