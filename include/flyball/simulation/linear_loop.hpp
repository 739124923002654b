#pragma once

#include <optional>

#include <flyball/systems/system.hpp>

namespace flyball {

/// A linear loop without noise, as the book's figures close it.
struct LinearLoop {
  DiscreteSystem<> plant{};              ///< Truth and model.
  Eigen::MatrixXd K;                     ///< m x n
  std::optional<Eigen::MatrixXd> K_e{};  ///< n x p, filter form; none feeds the true state back.
  bool plant_inversion = true;
  Eigen::VectorXd u_min{};
  Eigen::VectorXd u_max{};
  Eigen::VectorXd x0{};  ///< n; empty is zero.
};

/// Trajectories, one column a row of the reference.
struct LinearTrajectory {
  Eigen::VectorXd time{};   ///< s
  Eigen::MatrixXd x;        ///< n x samples
  Eigen::MatrixXd x_hat{};  ///< n x samples; x without an observer.
  Eigen::MatrixXd y;        ///< p x samples
  Eigen::MatrixXd u;        ///< m x samples
};

/// Each sample: x = A x + B u_previous; the observer predicts with u_previous and corrects with
/// y = C x + D u_previous; u = clamp(B⁺ (r_next - A r) + K (r - x_hat)). At the last sample the
/// next reference is the last one.
/// @param r  n x samples, the references.
/// @errors ArgumentError for shapes and entries.
[[nodiscard]] Expected<LinearTrajectory> simulate_linear(const LinearLoop& loop,
                                                         const MatrixRef& r);

}  // namespace flyball
