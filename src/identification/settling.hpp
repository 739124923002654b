#pragma once

#include <optional>

#include "identification/robust_fit.hpp"

/// What happens before a mechanism moves as one body.
namespace flyball::identification {

/// A recording whose steps begin later.
struct LaterStarts {
  PreparedRecording recording;
  std::size_t steps = 0;  ///< How many begin later.
  double longest = 0.0;   ///< s, left out at most.
  double excess = 0.0;    ///< How many times the noise the residuals there were, at most.
};

/// Steps from rest whose speed first rises as no inertia makes it: beyond six times the noise of
/// the rest of the step, and 6 % of top speed, within 0.25 s of the voltage's edge. Backlash and
/// elasticity between the encoder and the load do that; what is left of the step tells kA.
[[nodiscard]] std::optional<LaterStarts> without_irregular_starts(OutputErrorProblem& problem,
                                                                  const Eigen::VectorXd& x);

}  // namespace flyball::identification
