#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/control/lyapunov/region_of_attraction.hpp>

namespace flyball::detail {

/// Sizes, entries, limits, and that the point is an equilibrium.
[[nodiscard]] Expected<void> check_saturated_loop(const SaturatedLoop& loop,
                                                  std::string_view where);

/// ∂f/∂x and ∂f/∂u at the point.
struct LinearPart {
  Eigen::MatrixXd A, B;
};
[[nodiscard]] LinearPart linear_part(const SaturatedLoop& loop);

/// The loop's motion, in plain floating point.
class SaturatedMotion {
 public:
  explicit SaturatedMotion(const SaturatedLoop& loop);

  /// dx/dt under the loop's input. @param x, dxdt  n.
  void derivative(const Eigen::VectorXd& x, Eigen::VectorXd& dxdt);
  /// A Runge-Kutta step; `dt` may be negative.
  void step(Eigen::VectorXd& x, double dt);

 private:
  const SaturatedLoop& loop_;
  std::vector<double> values_, in_;
  Eigen::VectorXd k_[4], at_;
};

}  // namespace flyball::detail
