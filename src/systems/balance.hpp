#pragma once

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/systems/analysis.hpp>
#include <flyball/systems/system.hpp>

namespace flyball::detail {

/// Powers of two, so that scaling does not round: states x = diag(states) x', inputs and outputs
/// such that the scaled B diag(inputs) and diag(outputs) C are of the size of the scaled A.
struct SystemScaling {
  Eigen::VectorXd states;
  double inputs = 1.0;
  double outputs = 1.0;
};

/// The scaling of states under which rows and columns of [A B; C 0] are of like size (SLICOT's
/// TB01ID). B or C may have no columns or rows: then they do not count. A state that acts on
/// nothing, or on which nothing acts, has a free scale: it takes the one of the others.
[[nodiscard]] SystemScaling scaling_of(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C);

/// diag(states)⁻¹ A diag(states).
[[nodiscard]] Eigen::MatrixXd scaled_state_matrix(const MatrixRef& A, const SystemScaling& scaling);

/// The system in the scaled states x'; its inputs and outputs keep their units.
[[nodiscard]] ContinuousSystem<> scaled_system(const ContinuousSystem<>& system,
                                               const SystemScaling& scaling);

/// G(s) = 2^gain G'(s / 2^time) with G' = C'(sI - A')⁻¹B' + D' in units of states, time, inputs and
/// outputs in which the largest entries of A' and of B' and of C' or D' are near one. Time of
/// discrete systems stays; of continuous ones `time` is even.
struct NormalizedSystem {
  ContinuousSystem<> system;
  int gain = 0;
  int time = 0;
};
[[nodiscard]] NormalizedSystem normalized(const ContinuousSystem<>& system, TimeDomain domain);

}  // namespace flyball::detail
