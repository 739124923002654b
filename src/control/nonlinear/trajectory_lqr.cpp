#include <flyball/control/nonlinear/trajectory_lqr.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

/// One RK4 step of x together with X = [∂x/∂x₀, ∂x/∂u]: dX/dt = A X + [0, B].
class VariationalStep {
 public:
  explicit VariationalStep(const AnyModel& model)
      : model_(model),
        n_(model.states()),
        A_(n_, n_),
        B_(n_, model.inputs()),
        f_(n_),
        rate_(n_, n_ + model.inputs()) {}

  void step(Eigen::VectorXd& x, Eigen::MatrixXd& X, const Eigen::VectorXd& u, double T) {
    constexpr double node[] = {0.0, 0.5, 0.5, 1.0};
    constexpr double weight[] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
    Eigen::VectorXd x_sum = x;
    Eigen::MatrixXd X_sum = X;
    for (int i = 0; i < 4; ++i) {
      const Eigen::VectorXd at = i == 0 ? x : Eigen::VectorXd(x + node[i] * T * f_);
      const Eigen::MatrixXd X_at = i == 0 ? X : Eigen::MatrixXd(X + node[i] * T * rate_);
      model_.derivative(at, u, f_);
      model_.jacobians(at, u, A_, B_);
      rate_ = detail::product(A_, X_at);
      rate_.rightCols(B_.cols()) += B_;
      x_sum += weight[i] * T * f_;
      X_sum += weight[i] * T * rate_;
    }
    x = x_sum;
    X = X_sum;
  }

 private:
  const AnyModel& model_;
  Eigen::Index n_;
  Eigen::MatrixXd A_;
  Eigen::MatrixXd B_;
  Eigen::VectorXd f_;
  Eigen::MatrixXd rate_;
};

}  // namespace

Expected<TrajectoryLinearization> linearize_along(const AnyModel& model, const MatrixRef& x,
                                                  const MatrixRef& u, Time period) {
  constexpr std::string_view where = "linearize_along";
  const Eigen::Index n = model.states();
  const Eigen::Index m = model.inputs();
  const Eigen::Index N = u.cols();
  if (N == 0) {
    return refusal(ArgumentError::empty, where, "u").got("no step").expected("one step or more");
  }
  FLYBALL_CHECK(Checks(where)
                    .shape(x, n, N + 1, "x", "states x (steps + 1)")
                    .shape(u, m, N, "u", "inputs x steps")
                    .finite(x, "x")
                    .finite(u, "u")
                    .positive(period.si(), "period", "s"));
  TrajectoryLinearization result{.steps = {}, .defects = Eigen::MatrixXd(n, N)};
  VariationalStep variation(model);
  for (Eigen::Index k = 0; k < N; ++k) {
    const Eigen::VectorXd u_k = u.col(k);
    FLYBALL_CHECK(
        model.check(Eigen::VectorXd(x.col(k)), u_k, where, static_cast<double>(k) * period.si()));
    Eigen::VectorXd next = x.col(k);
    Eigen::MatrixXd X = Eigen::MatrixXd::Identity(n, n + m);
    variation.step(next, X, u_k, period.si());
    const std::string name = detail::format("step {}", k + 1);
    FLYBALL_CHECK(Checks(where).finite(next, name).finite(X, name));
    result.defects.col(k) = next - x.col(k + 1);
    result.steps.push_back({X.leftCols(n), X.rightCols(m)});
  }
  return result;
}

Expected<TrajectoryLqr> trajectory_lqr(const AnyModel& model, const MatrixRef& x,
                                       const MatrixRef& u, Time period, const QuadraticCost& cost,
                                       const Weight& S_N) {
  constexpr std::string_view where = "trajectory_lqr";
  FLYBALL_TRY_IN(where, TrajectoryLinearization along, linearize_along(model, x, u, period));
  FLYBALL_TRY_IN(where, FiniteHorizonLqr regulator, finite_horizon_lqr(along.steps, cost, S_N));
  return TrajectoryLqr{std::move(regulator), std::move(along), x, u, period};
}

}  // namespace flyball
