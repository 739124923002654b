#include <flyball/identification/innovations_model.hpp>

#include <flyball/core/argument.hpp>

#include "core/try.hpp"

namespace flyball::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

Expected<void> check_model(const InnovationsModel& model, const MatrixRef& u,
                           std::string_view where) {
  FLYBALL_CHECK(check_system(model.system, where));
  const Index n = model.system.A.rows();
  return Checks(where)
      .shape(model.x0, n, 1, "x0", "states")
      .finite(model.x0, "x0")
      .shape(u, u.rows(), model.system.B.cols(), "u", "samples x inputs")
      .finite(u, "u");
}

/// ŷ with x⁺ = A x + B u + K (y - ŷ), K of no columns for the free run.
Expected<MatrixXd> run(const InnovationsModel& model, const MatrixRef& u, const MatrixXd* y,
                       std::string_view where) {
  const DiscreteSystem<>& system = model.system;
  MatrixXd y_hat(u.rows(), system.C.rows());
  VectorXd x = model.x0;
  VectorXd next(x.size());
  VectorXd in(u.cols());
  VectorXd out(system.C.rows());
  for (Index k = 0; k < u.rows(); ++k) {
    in = u.row(k);
    out.noalias() = system.C * x;
    out.noalias() += system.D * in;
    y_hat.row(k) = out;
    next.noalias() = system.A * x;
    next.noalias() += system.B * in;
    if (y != nullptr) {
      out = y->row(k).transpose() - out;
      next.noalias() += model.K * out;
    }
    x.swap(next);
  }
  if (!y_hat.allFinite()) {
    return refusal(ArgumentError::not_finite, where, "the response")
        .got("beyond the largest double")
        .hint("the model is unstable: take a shorter record");
  }
  return y_hat;
}

}  // namespace

Expected<MatrixXd> simulate(const InnovationsModel& model, const MatrixRef& u) {
  FLYBALL_CHECK(check_model(model, u, "simulate"));
  return run(model, u, nullptr, "simulate");
}

Expected<MatrixXd> predict(const InnovationsModel& model, const MatrixRef& u, const MatrixRef& y) {
  constexpr std::string_view where = "predict";
  FLYBALL_CHECK(check_model(model, u, where));
  FLYBALL_CHECK(
      Checks(where)
          .shape(model.K, model.system.A.rows(), model.system.C.rows(), "K", "states x outputs")
          .finite(model.K, "K")
          .shape(y, u.rows(), model.system.C.rows(), "y", "samples x outputs")
          .finite(y, "y"));
  const MatrixXd measured = y;
  return run(model, u, &measured, where);
}

Expected<VectorXd> fit_of(const MatrixRef& y, const MatrixRef& y_hat) {
  FLYBALL_CHECK(Checks("fit_of")
                    .finite(y, "y")
                    .shape(y_hat, y.rows(), y.cols(), "y_hat", "as y")
                    .finite(y_hat, "y_hat"));
  VectorXd fit(y.cols());
  for (Index j = 0; j < y.cols(); ++j) {
    const double spread = (y.col(j).array() - y.col(j).mean()).matrix().norm();
    const double left = (y.col(j) - y_hat.col(j)).norm();
    fit(j) = left == 0.0 ? 1.0 : 1.0 - left / spread;
  }
  return fit;
}

}  // namespace flyball::identification
