#include <Eigen/SVD>

#include "support/oracle.hpp"

namespace flyball::test {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;

Eigen::VectorXd singular_values(const MatrixXd& A) {
  return Eigen::JacobiSVD<MatrixXd>(A).singularValues();
}

Eigen::VectorXd singular_values(const MatrixXcd& A) {
  return Eigen::JacobiSVD<MatrixXcd>(A).singularValues();
}

}  // namespace flyball::test
