#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/geometry/se2.hpp>

namespace bench {

/// An edge of a pose graph: pose b as seen from a.
struct Edge {
  std::size_t a = 0, b = 0;
  double x = 0.0, y = 0.0, angle = 0.0;
  Eigen::Matrix3d root = Eigen::Matrix3d::Identity();  ///< UᵀU is the information.
};

/// A graph and the poses from which a solver starts.
struct PoseGraph {
  std::vector<flyball::Pose2d> start{};
  std::vector<Edge> edges{};
};

/// What a solver reached.
struct Solved {
  double cost = 0.0;  ///< Σ|r|²
  int iterations = 0;
  double milliseconds = 0.0;
};

/// Ceres, as its example of pose graphs: Levenberg and Marquardt's method, sparse normal Cholesky.
[[nodiscard]] Solved solve_with_ceres(const PoseGraph& graph);

}  // namespace bench
