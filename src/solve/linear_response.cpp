#include "solve/linear_response.hpp"

namespace flyball::solve {

LinearResponse linear_response(const DiscretizedMatrices& model, const Eigen::MatrixXd& C,
                               const Eigen::MatrixXd& D, const Eigen::MatrixXd& u,
                               const Eigen::VectorXd& x0) {
  LinearResponse response{Eigen::MatrixXd(u.rows() + 1, x0.size()),
                          Eigen::MatrixXd(u.rows(), C.rows())};
  Eigen::VectorXd x = x0;
  Eigen::VectorXd x_next(x.size());
  response.x.row(0) = x.transpose();
  for (Eigen::Index k = 0; k < u.rows(); ++k) {
    const auto u_k = u.row(k).transpose();
    response.y.row(k).transpose().noalias() = C * x;
    response.y.row(k).transpose().noalias() += D * u_k;
    x_next.noalias() = model.A * x;
    x_next.noalias() += model.B * u_k;
    x.swap(x_next);
    response.x.row(k + 1) = x.transpose();
  }
  return response;
}

}  // namespace flyball::solve
