#pragma once

#include <Eigen/Core>

#include <flyball/math/expression/lagrangian.hpp>

/// The same problems by IPOPT, in the same process, fed by the same exact derivatives.
namespace peer {

/// min Σ ℓ(z_k) + ℓ_N(z_N) subject to x_{k+1} = f(z_k) and bounds, z = (x, u).
struct StageProblem {
  int states = 0, inputs = 0, intervals = 0;
  flyball::expression::Lagrangian stage{};  ///< f, then ℓ, of z.
  flyball::expression::Lagrangian last{};   ///< ℓ_N.
  Eigen::MatrixXd lower{}, upper{};         ///< (states + inputs) x (intervals + 1).
  Eigen::MatrixXd start{};
};

struct Result {
  double milliseconds = 0.0;  ///< Of the process: all that IPOPT does, its setup included.
  int iterations = 0;
  double cost = 0.0;
  bool solved = false;
};

/// To a tolerance of 1e-8, with MUMPS and its other settings as they are. Compiling the derivatives
/// is not in the time.
[[nodiscard]] Result solve_with_ipopt(const StageProblem& problem);

}  // namespace peer
