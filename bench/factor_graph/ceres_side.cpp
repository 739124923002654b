#include <cmath>

#include <ceres/ceres.h>

#include "pose_graph.hpp"
#include "timing.hpp"

namespace bench {

namespace {

struct Residual {
  Edge edge;

  template <class T>
  bool operator()(const T* a, const T* b, T* r) const {
    const T c = cos(a[2]);
    const T s = sin(a[2]);
    const T dx = b[0] - a[0];
    const T dy = b[1] - a[1];
    T turn = b[2] - a[2] - edge.angle;
    turn -= 2.0 * M_PI * floor((turn + M_PI) / (2.0 * M_PI));
    const T e[3] = {c * dx + s * dy - edge.x, -s * dx + c * dy - edge.y, turn};
    for (int i = 0; i < 3; ++i) {
      r[i] = edge.root(i, 0) * e[0] + edge.root(i, 1) * e[1] + edge.root(i, 2) * e[2];
    }
    return true;
  }
};

}  // namespace

Solved solve_with_ceres(const PoseGraph& graph) {
  std::vector<std::array<double, 3>> x;
  for (const auto& pose : graph.start) {
    x.push_back({pose.x(), pose.y(), pose.angle()});
  }
  Solved solved;
  solved.milliseconds =
      1e-3 * microseconds(1, [&] {
        ceres::Problem problem;
        for (const Edge& edge : graph.edges) {
          problem.AddResidualBlock(
              new ceres::AutoDiffCostFunction<Residual, 3, 3, 3>(new Residual{edge}), nullptr,
              x[edge.a].data(), x[edge.b].data());
        }
        problem.SetParameterBlockConstant(x[0].data());
        ceres::Solver::Options options;
        options.max_num_iterations = 100;
        options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
        ceres::Solver::Summary summary;
        ceres::Solve(options, &problem, &summary);
        solved.cost = 2.0 * summary.final_cost;
        solved.iterations = static_cast<int>(summary.iterations.size());
      });
  return solved;
}

}  // namespace bench
