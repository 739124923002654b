#include <algorithm>
#include <cmath>
#include <vector>

#include <flyball/identification/identification_error.hpp>
#include <flyball/identification/polynomial_model.hpp>
#include <flyball/math/regression/least_squares.hpp>

#include "core/constants.hpp"
#include "core/try.hpp"
#include "identification/polynomials.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"

namespace flyball::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// The sum of squares of e over a record, and what Gauss and Newton make of it.
class PredictionErrors {
 public:
  PredictionErrors(const ScaledRecord& record, const PolynomialOrders& orders)
      : record_(record),
        orders_(orders),
        inputs_(record.u.cols()),
        first_(start_of(orders)),
        rows_(record.y.size() - first_),
        jacobian_(rows_, parameters_of(orders, inputs_) + 1) {}

  [[nodiscard]] PolynomialModel model(const VectorXd& parameters) const {
    return unpack(parameters, orders_, inputs_);
  }
  [[nodiscard]] double cost(const VectorXd& parameters) const {
    const double sum =
        prediction_errors(model(parameters), record_.u, record_.y).tail(rows_).squaredNorm();
    return std::isfinite(sum) ? sum : infinity;
  }
  /// C and F with stable roots.
  [[nodiscard]] VectorXd stable(const VectorXd& parameters) const {
    PolynomialModel of = model(parameters);
    of.C = stabilized(of.C);
    for (VectorXd& F : of.F) {
      F = stabilized(F);
    }
    return pack(of, orders_);
  }

  /// The triangular factor of [∂e/∂θ e].
  [[nodiscard]] MatrixXd factor(const VectorXd& parameters) {
    const PolynomialModel of = model(parameters);
    const VectorXd one = VectorXd::Ones(1);
    Index column = 0;
    // A derivative by the coefficient of q⁻ⁱ is the same signal i samples later.
    const auto put = [&](const VectorXd& signal, Index lag, Index order, double sign) {
      for (Index i = 0; i < order; ++i, ++lag) {
        for (Index k = 0; k < rows_; ++k) {
          const Index at = first_ + k - lag;
          jacobian_(k, column) = at >= 0 ? sign * signal(at) : 0.0;
        }
        ++column;
      }
    };
    std::vector<VectorXd> passed(static_cast<std::size_t>(inputs_));  // B/F u.
    VectorXd v;
    filter(of.A, one, record_.y, v);
    for (Index j = 0; j < inputs_; ++j) {
      const auto at = static_cast<std::size_t>(j);
      filter(of.B[at], of.F[at], record_.u.col(j), passed[at]);
      v -= passed[at];
    }
    VectorXd e;
    filter(of.D, of.C, v, e);
    VectorXd signal;
    if (orders_.a > 0) {
      filter(of.D, of.C, record_.y, signal);
      put(signal, 1, orders_.a, 1.0);
    }
    for (Index j = 0; j < inputs_; ++j) {
      filter(of.D, of.C, record_.u.col(j), signal);
      filter(one, of.F[static_cast<std::size_t>(j)], signal, signal);
      put(signal, orders_.delay, orders_.b, -1.0);
    }
    if (orders_.c > 0) {
      filter(one, of.C, e, signal);
      put(signal, 1, orders_.c, -1.0);
    }
    if (orders_.d > 0) {
      filter(one, of.C, v, signal);
      put(signal, 1, orders_.d, 1.0);
    }
    for (Index j = 0; orders_.f > 0 && j < inputs_; ++j) {
      const auto at = static_cast<std::size_t>(j);
      filter(of.D, of.C, passed[at], signal);
      filter(one, of.F[at], signal, signal);
      put(signal, 1, orders_.f, 1.0);
    }
    jacobian_.col(column) = e.tail(rows_);
    return detail::triangle_of(jacobian_);
  }

  [[nodiscard]] Index rows() const { return rows_; }

 private:
  const ScaledRecord& record_;
  PolynomialOrders orders_;
  Index inputs_;
  Index first_;
  Index rows_;
  MatrixXd jacobian_;
};

struct Minimised {
  VectorXd parameters;
  MatrixXd factor;  ///< Of [∂e/∂θ e] there.
  double cost = infinity;
  int iterations = 0;
};

/// Levenberg and Marquardt with Nielsen's rule.
Minimised minimise(PredictionErrors& errors, const VectorXd& start) {
  constexpr int most = 100;
  Minimised at{start, errors.factor(start), errors.cost(start)};
  const Index d = start.size();
  double damping = 1e-6;
  double growth = 2.0;
  while (at.iterations < most) {
    ++at.iterations;
    const MatrixXd R = at.factor.leftCols(d);
    const VectorXd z = at.factor.col(d);
    const VectorXd scale = R.colwise().norm().transpose().cwiseMax(1e-12);
    MatrixXd damped(R.rows() + d, d);
    damped << R, MatrixXd((std::sqrt(damping) * scale).asDiagonal());
    VectorXd right = VectorXd::Zero(R.rows() + d);
    right.head(R.rows()) = -z;
    const VectorXd step = detail::solve_least_squares(damped, right);
    const VectorXd candidate = errors.stable(at.parameters + step);
    const double cost = errors.cost(candidate);
    const double gain = at.cost - cost;
    if (gain > 0.0) {
      const double promised = z.squaredNorm() - (z + R * step).squaredNorm();
      const double rho = promised > 0.0 ? gain / promised : 1.0;
      const bool settled = gain <= 1e-10 * at.cost;
      at.parameters = candidate;
      at.cost = cost;
      at.factor = errors.factor(candidate);
      damping = std::max(damping * std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * rho - 1.0, 3)), 1e-15);
      growth = 2.0;
      if (settled) {
        break;
      }
    } else {
      // Nothing left to gain within rounding, or too long a step.
      if (step.cwiseProduct(scale).norm() <= 1e-9 * std::sqrt(at.cost) || damping > 1e10) {
        break;
      }
      damping *= growth;
      growth *= 2.0;
    }
  }
  return at;
}

}  // namespace

Expected<PolynomialFit> fit_prediction_error(const MatrixRef& u, const MatrixRef& y, Time period,
                                             const PolynomialOrders& orders) {
  constexpr std::string_view where = "fit_prediction_error";
  if (orders.c == 0 && orders.d == 0 && orders.f == 0) {
    return fit_arx(u, y, period, orders);
  }
  FLYBALL_TRY(const ScaledRecord record, scaled_record(u, y, period, orders, where));
  PredictionErrors errors(record, orders);
  Minimised best;
  for (const std::vector<VectorXd>& family : starts_of(record, orders)) {
    double least = infinity;
    VectorXd start;
    for (const VectorXd& each : family) {
      const VectorXd stable = errors.stable(each);
      const double cost = errors.cost(stable);
      if (cost < least) {
        least = cost;
        start = stable;
      }
    }
    if (std::isfinite(least)) {
      Minimised found = minimise(errors, start);
      if (found.cost < best.cost) {
        best = std::move(found);
      }
    }
  }
  if (!std::isfinite(best.cost)) {
    return refusal(IdentificationError::singular, where)
        .hint("excite the input with more frequencies, or take smaller orders");
  }
  const Index d = best.parameters.size();
  FLYBALL_TRY(const LeastSquares last, least_squares(best.factor.leftCols(d), best.factor.col(d)));
  PolynomialFit fit;
  fit.orders = orders;
  fit.parameters = best.parameters;
  fit.iterations = best.iterations;
  const double variance = best.cost / std::max(static_cast<double>(errors.rows() - d), 1.0);
  // `last` has as many rows as the factor; its covariance in units of the variance is that of e.
  const double own =
      last.residual_squares / std::max(static_cast<double>(last.degrees_of_freedom), 1.0);
  fit.covariance = own > 0.0 ? MatrixXd(last.covariance * (variance / own)) : MatrixXd::Zero(d, d);
  fit.standard_errors = fit.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  for (Index i = 0; i < d; ++i) {
    if (!last.determined[static_cast<std::size_t>(i)]) {
      fit.standard_errors(i) = infinity;
    }
  }
  finish(fit, record, period);
  return fit;
}

}  // namespace flyball::identification
