#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <string>

#include <flyball/identification/identification_error.hpp>
#include <flyball/math/probability/distributions.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "identification/polynomials.hpp"
#include "math/dense/dense.hpp"

namespace flyball::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

void filter(const VectorXd& b, const VectorXd& a, const VectorXd& x, VectorXd& y) {
  const Index n = x.size();
  const Index moving = b.size();
  const Index recursive = a.size();
  VectorXd out(n);
  for (Index k = 0; k < n; ++k) {
    double sum = 0.0;
    for (Index i = 0; i < std::min(moving, k + 1); ++i) {
      sum += b(i) * x(k - i);
    }
    for (Index i = 1; i < std::min(recursive, k + 1); ++i) {
      sum -= a(i) * out(k - i);
    }
    out(k) = sum;
  }
  y = std::move(out);
}

VectorXd stabilized(const VectorXd& polynomial) {
  const Index n = polynomial.size() - 1;
  if (n < 1) {
    return polynomial;
  }
  constexpr double largest = 1.0 - 1e-6;
  MatrixXd companion = MatrixXd::Zero(n, n);
  companion.row(0) = -polynomial.tail(n).transpose();
  companion.diagonal(-1).setOnes();
  Eigen::VectorXcd roots = detail::eigenvalues_of(companion);
  if (!roots.allFinite() || roots.cwiseAbs().maxCoeff() <= largest) {
    return polynomial;
  }
  // Pairs stay pairs: what is reflected is reflected alike.
  Eigen::VectorXcd product = Eigen::VectorXcd::Zero(n + 1);
  product(0) = 1.0;
  for (std::complex<double> root : roots) {
    const double size = std::abs(root);
    if (size > largest) {
      root *= std::min(1.0 / size, largest) / size;
    }
    for (Index i = n; i > 0; --i) {
      product(i) -= root * product(i - 1);
    }
  }
  return product.real();
}

VectorXd prediction_errors(const PolynomialModel& model, const MatrixXd& u, const VectorXd& y) {
  const VectorXd one = VectorXd::Ones(1);
  VectorXd v;
  filter(model.A, one, y, v);
  VectorXd part;
  for (Index j = 0; j < u.cols(); ++j) {
    const auto at = static_cast<std::size_t>(j);
    filter(model.B[at], model.F[at], u.col(j), part);
    v -= part;
  }
  filter(model.D, model.C, v, part);
  return part;
}

Index parameters_of(const PolynomialOrders& orders, Index inputs) {
  return orders.a + orders.c + orders.d + inputs * (orders.b + orders.f);
}

Index start_of(const PolynomialOrders& orders) {
  return std::max({orders.a, orders.delay + orders.b - 1, orders.f});
}

PolynomialModel unpack(const VectorXd& parameters, const PolynomialOrders& orders, Index inputs) {
  PolynomialModel model;
  Index at = 0;
  const auto take = [&](Index order, Index zeros) {
    VectorXd polynomial = VectorXd::Zero(zeros + order);
    polynomial.tail(order) = parameters.segment(at, order);
    at += order;
    return polynomial;
  };
  const auto monic = [&](Index order) {
    VectorXd polynomial = take(order, 1);
    polynomial(0) = 1.0;
    return polynomial;
  };
  model.A = monic(orders.a);
  for (Index j = 0; j < inputs; ++j) {
    model.B.push_back(take(orders.b, orders.delay));
  }
  model.C = monic(orders.c);
  model.D = monic(orders.d);
  for (Index j = 0; j < inputs; ++j) {
    model.F.push_back(monic(orders.f));
  }
  return model;
}

VectorXd pack(const PolynomialModel& model, const PolynomialOrders& orders) {
  const auto inputs = static_cast<Index>(model.B.size());
  VectorXd parameters(parameters_of(orders, inputs));
  Index at = 0;
  const auto put = [&](const VectorXd& polynomial, Index order) {
    parameters.segment(at, order) = polynomial.tail(order);
    at += order;
  };
  put(model.A, orders.a);
  for (const VectorXd& b : model.B) {
    put(b, orders.b);
  }
  put(model.C, orders.c);
  put(model.D, orders.d);
  for (const VectorXd& f : model.F) {
    put(f, orders.f);
  }
  return parameters;
}

Expected<ScaledRecord> scaled_record(const MatrixRef& u, const MatrixRef& y, Time period,
                                     const PolynomialOrders& orders, std::string_view where) {
  FLYBALL_CHECK(Checks(where)
                    .finite(u, "u")
                    .shape(y, u.rows(), 1, "y", "samples of u")
                    .finite(y, "y")
                    .positive(period.si(), "period", "s"));
  constexpr int most = 200;
  for (const auto& [order, least, name] : {std::tuple{orders.a, 0, "the order of A"},
                                           {orders.b, 1, "the order of B"},
                                           {orders.c, 0, "the order of C"},
                                           {orders.d, 0, "the order of D"},
                                           {orders.f, 0, "the order of F"},
                                           {orders.delay, 0, "the delay"}}) {
    if (order < least || order > most) {
      return refusal(ArgumentError::out_of_range, where, name)
          .got(std::to_string(order))
          .expected(detail::format("from {} to {}", least, most));
    }
  }
  if (u.cols() == 0) {
    return refusal(ArgumentError::empty, where, "u").expected("samples x inputs");
  }
  const Index d = parameters_of(orders, u.cols());
  if (u.rows() - start_of(orders) < 2 * d + 2) {
    return refusal(IdentificationError::too_short, where)
        .hint("record more samples, or take smaller orders")
        .with("samples", static_cast<double>(u.rows()))
        .with("parameters", static_cast<double>(d));
  }
  const auto unit = [](double largest) {
    return largest > 0.0 ? std::ldexp(1.0, std::ilogb(largest)) : 1.0;
  };
  ScaledRecord record{u, y, VectorXd(u.cols()), unit(y.cwiseAbs().maxCoeff())};
  record.y /= record.y_unit;
  for (Index j = 0; j < u.cols(); ++j) {
    record.u_unit(j) = unit(u.col(j).cwiseAbs().maxCoeff());
    record.u.col(j) /= record.u_unit(j);
  }
  return record;
}

namespace {

/// Σ x_k y_{k-lag} over the norms, the largest of the lags, over what 1 of 100 white records has.
double correlation(const VectorXd& e, const VectorXd& x, Index first_lag) {
  constexpr Index lags = 25;
  const Index n = e.size();
  const double size = e.norm() * x.norm();
  double largest = 0.0;
  for (Index lag = first_lag; lag <= std::min(lags, n - 1); ++lag) {
    largest = std::max(largest, std::abs(e.tail(n - lag).dot(x.head(n - lag))));
  }
  const double bound = normal_quantile(1.0 - 0.005 / static_cast<double>(lags));
  return size > 0.0 ? largest / size * std::sqrt(static_cast<double>(n)) / bound : 0.0;
}

}  // namespace

void finish(PolynomialFit& fit, const ScaledRecord& record, Time period) {
  PolynomialModel& model = fit.model;
  const Index inputs = record.u.cols();
  const Index first = start_of(fit.orders);
  model = unpack(fit.parameters, fit.orders, inputs);
  model.period = period;
  const VectorXd e = prediction_errors(model, record.u, record.y);
  const Index n = e.size() - first;
  const auto d = static_cast<double>(fit.parameters.size());
  const auto count = static_cast<double>(n);
  fit.residuals = e.tail(n) * record.y_unit;
  const VectorXd y = record.y.tail(n);
  fit.prediction_fit = fit_of(y, y - e.tail(n))
                           .map([](const VectorXd& of) { return of(0); })
                           .value_or(-std::numeric_limits<double>::infinity());
  // The free run: y - Σ B/(A F) u.
  VectorXd v = record.y;
  VectorXd part;
  for (Index j = 0; j < inputs; ++j) {
    const auto at = static_cast<std::size_t>(j);
    filter(model.B[at], model.F[at], record.u.col(j), part);
    filter(VectorXd::Ones(1), model.A, part, part);
    v -= part;
  }
  fit.simulation_fit = v.allFinite() ? fit_of(y, y - v.tail(n))
                                           .map([](const VectorXd& of) { return of(0); })
                                           .value_or(-std::numeric_limits<double>::infinity())
                                     : -std::numeric_limits<double>::infinity();
  const double mean_square = std::max(fit.residuals.squaredNorm() / count, 1e-300);
  fit.aic = count * std::log(mean_square) + 2.0 * d;
  fit.bic = count * std::log(mean_square) + d * std::log(count);
  fit.mdl = mean_square * (1.0 + d * std::log(count) / count);
  fit.whiteness = correlation(fit.residuals, fit.residuals, 1);
  for (Index j = 0; j < inputs; ++j) {
    const VectorXd centred = record.u.col(j).tail(n).array() - record.u.col(j).tail(n).mean();
    fit.input_independence =
        std::max(fit.input_independence, correlation(fit.residuals, centred, fit.orders.delay));
  }
  model.noise = fit.residuals.squaredNorm() / std::max(count - d, 1.0);

  // b in units of y per unit of u.
  for (Index j = 0; j < inputs; ++j) {
    const double unit = record.y_unit / record.u_unit(j);
    const Index at = fit.orders.a + j * fit.orders.b;
    model.B[static_cast<std::size_t>(j)] *= unit;
    fit.parameters.segment(at, fit.orders.b) *= unit;
    fit.standard_errors.segment(at, fit.orders.b) *= unit;
    fit.covariance.middleRows(at, fit.orders.b) *= unit;
    fit.covariance.middleCols(at, fit.orders.b) *= unit;
  }
}

}  // namespace flyball::identification
