#include <cmath>

#include <Eigen/Eigenvalues>

#include "math/dense/generalized.hpp"

namespace flyball::detail {

using Eigen::MatrixXd;

std::optional<GeneralizedEigenvalues> generalized_eigenvalues_of(const MatrixRef& A,
                                                                 const MatrixRef& E) {
  if (A.rows() == 0) {
    return GeneralizedEigenvalues{Eigen::VectorXcd(0), Eigen::VectorXd(0)};
  }
  if (!A.allFinite() || !E.allFinite()) {
    return std::nullopt;
  }
  Eigen::GeneralizedEigenSolver<MatrixXd> solver(A.rows());
  solver.compute(A, E, false);
  if (solver.info() != Eigen::Success) {
    return std::nullopt;
  }
  GeneralizedEigenvalues found{solver.alphas(), solver.betas()};
  for (Eigen::Index i = 0; i < found.betas.size(); ++i) {
    if (found.betas(i) < 0.0) {
      found.betas(i) = -found.betas(i);
      found.alphas(i) = -found.alphas(i);
    }
  }
  return found;
}

}  // namespace flyball::detail
