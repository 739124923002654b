#pragma once

#include <flyball/systems/discretize.hpp>

namespace flyball::solve {

/// What a sampled linear system does.
struct LinearResponse {
  Eigen::MatrixXd x;  ///< (samples + 1) x states.
  Eigen::MatrixXd y;  ///< samples x outputs.
};

/// x_{k+1} = A x_k + B u_k, y_k = C x_k + D u_k (7.3). Shapes must fit.
/// @param u  samples x inputs. @param x0  states x 1.
[[nodiscard]] LinearResponse linear_response(const DiscretizedMatrices& model,
                                             const Eigen::MatrixXd& C, const Eigen::MatrixXd& D,
                                             const Eigen::MatrixXd& u, const Eigen::VectorXd& x0);

}  // namespace flyball::solve
