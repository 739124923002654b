#pragma once

#include <vector>

#include "identification/robust_fit.hpp"

/// Terms that a mechanism need not have, taken in where the log asks for them.
namespace flyball::identification {

/// What an extension did.
struct Extension {
  /// A term that the log leaves open, and what it would make of the parameters.
  struct Open {
    int term;  ///< Its first parameter.
    Eigen::VectorXd moved;
    bool instead;         ///< Of another that was taken in: told in any case.
    double weight = 1.0;  ///< Of `moved` in the doubts.
  };
  std::vector<Open> open{};
  bool extended = false;
  /// By how much each term that was not taken in, though something spoke for it, would move the
  /// parameters, times the root of its weight. As standard errors they keep intervals true where
  /// the log leaves open whether there is such a term.
  std::vector<Eigen::VectorXd> doubts{};
};

/// Extends the model by the terms (bias, spring, drag, sag, friction along the travel, backlash,
/// current limit) whose evidence is beyond doubt, the strongest first, two at most, and fits it
/// again.
/// @param best      The fit of the model without; becomes that of the extended one.
/// @param backlash  Whether it is one of the terms.
[[nodiscard]] Extension extend_model(OutputErrorProblem& problem, const Bounds& bounds,
                                     ChannelScales scales, RobustFit& best, bool backlash);

/// The terms of an extended model with their intervals.
[[nodiscard]] std::vector<ModelTerm> estimate_terms(const OutputErrorProblem& problem,
                                                    const RobustFit& best,
                                                    const Covariances& spread);

/// Tells of a term that the log leaves open where it is what makes an interval wide.
void report_open_terms(const Extension& extension, const FeedforwardFit& fit,
                       std::vector<Diagnostic>& diagnostics);

/// What there is to say of them.
void report_terms(const FeedforwardFit& fit, std::vector<Diagnostic>& diagnostics);

}  // namespace flyball::identification
