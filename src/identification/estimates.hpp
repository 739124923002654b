#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/identification/feedforward_fit.hpp>

#include "identification/robust_fit.hpp"
#include "identification/test_coverage.hpp"

namespace flyball::identification {

/// A value with its 95 % interval by a standard error.
[[nodiscard]] GainEstimate symmetric_estimate(double value, double standard_error);

/// Gains with intervals from the parameters; what the data do not determine is marked.
/// @errors IdentificationError::singular, unphysical_gains.
[[nodiscard]] Expected<void> estimate_gains(const PreparedRecording& prepared,
                                            const Eigen::VectorXd& x, const Covariances& spread,
                                            const Bounds& bounds, FeedforwardFit& fit);

/// Marks what the tests that were made cannot tell apart, and says which test would.
void estimate_what_tests_leave(const TestCoverage& coverage, const OutputErrorProblem& problem,
                               const Eigen::VectorXd& x, const Covariances& spread,
                               FeedforwardFit& fit);

/// What there is to say about a fit: undetermined gains, delays, filters, poor agreement.
void report_fit(const PreparedRecording& prepared, const FeedforwardFit& fit,
                std::vector<Diagnostic>& diagnostics);

}  // namespace flyball::identification
