#pragma once

#include <Eigen/Core>

#include <flyball/identification/subspace.hpp>

#include "identification/subspace_data.hpp"

/// States of a record's future that its past tells, and how they follow each other.
namespace flyball::identification {

/// Where the parts of `PastAndFuture` are.
struct Parts {
  Eigen::Index m;
  Eigen::Index p;
  Eigen::Index s;
  const PastAndFuture& data;

  [[nodiscard]] Eigen::Index past() const { return s * (m + p); }
  [[nodiscard]] Eigen::Index future() const { return s * p; }
  [[nodiscard]] auto L21() const { return data.L.block(s * m, 0, past(), s * m); }
  [[nodiscard]] auto L22() const { return data.L.block(s * m, s * m, past(), past()); }
  [[nodiscard]] auto L32() const { return data.L.block(s * m + past(), s * m, s * p, past()); }
  [[nodiscard]] auto L33() const { return data.L.bottomRightCorner(s * p, s * p); }
};

/// The weighted future as the past tells it: left singular vectors and singular values.
struct Observed {
  bool noisy = false;
  bool weighted = false;  ///< By J⁻¹, J Jᵀ = [L32 L33][L32 L33]ᵀ.
  Eigen::MatrixXd J;      ///< Where the data are noisy.
  Eigen::MatrixXd U;
  Eigen::VectorXd values;
  Eigen::VectorXd correlations;  ///< The canonical ones where the data are noisy, else the values.
};
/// @param most  As many columns of U are asked for.
[[nodiscard]] Observed observe(const Parts& parts, SubspaceWeighting weighting, Eigen::Index most);

/// [x⁺; y] = [A; C] X + what is left, over the coordinates of the past and one sample more.
struct StateSequence {
  Eigen::MatrixXd A;
  Eigen::MatrixXd C;
  Eigen::MatrixXd X;       ///< n x past
  Eigen::MatrixXd target;  ///< (n + p) x (past + p): [x⁺; y]
};
[[nodiscard]] StateSequence states_of(const Parts& parts, const Observed& observed,
                                      SubspaceWeighting weighting, Eigen::Index n);

}  // namespace flyball::identification
