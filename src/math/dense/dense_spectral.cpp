#include <limits>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include "math/dense/dense.hpp"

namespace flyball::detail {

using Eigen::MatrixXd;

Eigensystem eigensystem_of(const MatrixRef& A) {
  const Eigen::VectorXd d = balance_of(A);
  const Eigen::EigenSolver<MatrixXd> solver(d.cwiseInverse().asDiagonal() * A * d.asDiagonal());
  if (solver.info() != Eigen::Success) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    return {Eigen::VectorXcd::Constant(A.rows(), nan),
            Eigen::MatrixXcd::Constant(A.rows(), A.cols(), nan)};
  }
  Eigensystem system{solver.eigenvalues(), d.asDiagonal() * solver.eigenvectors()};
  system.vectors.colwise().normalize();
  return system;
}

Eigen::VectorXcd eigenvalues_of(const MatrixRef& A) {
  if (A.rows() == 0) {
    return {};
  }
  const Eigen::VectorXd d = balance_of(A);
  const Eigen::EigenSolver<MatrixXd> solver(d.cwiseInverse().asDiagonal() * A * d.asDiagonal(),
                                            false);
  if (solver.info() != Eigen::Success) {
    return Eigen::VectorXcd::Constant(A.rows(), std::numeric_limits<double>::quiet_NaN());
  }
  return solver.eigenvalues();
}

SymmetricEigensystem symmetric_eigensystem_of(const MatrixRef& S) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(S);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

RealSchur real_schur_of(const MatrixRef& A) {
  const Eigen::RealSchur<MatrixXd> schur(A);
  return {schur.matrixT(), schur.matrixU(), schur.info() == Eigen::Success};
}

SingularValues svd_of(const MatrixRef& A) {
  const Eigen::JacobiSVD<MatrixXd, Eigen::FullPivHouseholderQRPreconditioner> svd(
      A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

Eigen::VectorXd singular_values_of(const MatrixRef& A) {
  return Eigen::JacobiSVD<MatrixXd>(A).singularValues();
}

Eigen::VectorXd singular_values_of_complex(const ComplexMatrixRef& A) {
  // [Re -Im; Im Re] has the same singular values, each twice.
  const Eigen::Index m = A.rows();
  const Eigen::Index n = A.cols();
  MatrixXd doubled(2 * m, 2 * n);
  doubled << A.real(), -A.imag(), A.imag(), A.real();
  const Eigen::VectorXd twice = singular_values_of(doubled);
  Eigen::VectorXd values(twice.size() / 2);
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    values(k) = twice(2 * k);
  }
  return values;
}

}  // namespace flyball::detail
