#include <limits>

#include <flyball/identification/identification_error.hpp>
#include <flyball/identification/polynomial_model.hpp>
#include <flyball/math/regression/streamed_least_squares.hpp>

#include "core/try.hpp"
#include "identification/polynomials.hpp"

namespace flyball::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

Expected<PolynomialOrders> arx_orders(const PolynomialOrders& orders, std::string_view where) {
  if (orders.c != 0 || orders.d != 0 || orders.f != 0) {
    return refusal(ArgumentError::out_of_range, where, "an order")
        .got("not zero for C, D or F")
        .expected("of A or B; the others need fit_prediction_error");
  }
  return orders;
}

/// -y_{k-1} … -y_{k-a}, then u_{k-delay} … of each input, from the first sample that counts on.
Expected<Regression> regress(const ScaledRecord& record, const PolynomialOrders& orders,
                             Index first, std::string_view where) {
  const Index inputs = record.u.cols();
  const Index d = parameters_of(orders, inputs);
  if (d == 0) {
    return Regression{};
  }
  FLYBALL_TRY(auto stream, StreamedLeastSquares::create(d));
  VectorXd row(d);
  for (Index k = first; k < record.y.size(); ++k) {
    for (Index i = 0; i < orders.a; ++i) {
      row(i) = -record.y(k - 1 - i);
    }
    for (Index j = 0; j < inputs; ++j) {
      for (Index i = 0; i < orders.b; ++i) {
        row(orders.a + j * orders.b + i) = record.u(k - orders.delay - i, j);
      }
    }
    stream.add(row.data(), record.y(k));
  }
  FLYBALL_TRY(Regression regression, stream.solve());
  if (regression.rank < d) {
    return refusal(IdentificationError::singular, where)
        .hint("excite the input with more frequencies, or take smaller orders")
        .with("rank", static_cast<double>(regression.rank))
        .with("parameters", static_cast<double>(d));
  }
  return regression;
}

Expected<PolynomialFit> fit(const ScaledRecord& record, Time period, const PolynomialOrders& orders,
                            std::string_view where) {
  FLYBALL_TRY(Regression regression, regress(record, orders, start_of(orders), where));
  PolynomialFit result;
  result.orders = orders;
  result.parameters = regression.coefficients;
  result.covariance = regression.covariance;
  result.standard_errors = regression.standard_errors;
  finish(result, record, period);
  return result;
}

}  // namespace

Expected<PolynomialFit> fit_arx(const MatrixRef& u, const MatrixRef& y, Time period,
                                const PolynomialOrders& orders) {
  constexpr std::string_view where = "fit_arx";
  FLYBALL_CHECK(arx_orders(orders, where).map([](const auto&) {}));
  FLYBALL_TRY(const ScaledRecord record, scaled_record(u, y, period, orders, where));
  return fit(record, period, orders, where);
}

Expected<PolynomialFit> select_arx(const MatrixRef& u, const MatrixRef& y, Time period,
                                   const PolynomialOrders& most, OrderCriterion criterion) {
  constexpr std::string_view where = "select_arx";
  FLYBALL_CHECK(arx_orders(most, where).map([](const auto&) {}));
  // Every column that any of the orders has.
  PolynomialOrders widest = most;
  widest.b = most.b + most.delay;
  widest.delay = 0;
  FLYBALL_TRY(const ScaledRecord record, scaled_record(u, y, period, widest, where));
  const Index inputs = u.cols();
  const Index first = start_of(widest);
  const Index d = parameters_of(widest, inputs);
  const Index n = record.y.size() - first;
  FLYBALL_TRY(auto stream, StreamedLeastSquares::create(d));
  VectorXd row(d);
  for (Index k = first; k < record.y.size(); ++k) {
    for (Index i = 0; i < widest.a; ++i) {
      row(i) = -record.y(k - 1 - i);
    }
    for (Index j = 0; j < inputs; ++j) {
      for (Index i = 0; i < widest.b; ++i) {
        row(widest.a + j * widest.b + i) = record.u(k - i, j);
      }
    }
    stream.add(row.data(), record.y(k));
  }
  const MatrixXd R = stream.factor();

  const auto count = static_cast<double>(n);
  double least = std::numeric_limits<double>::infinity();
  PolynomialOrders best{.a = -1};
  std::vector<Index> columns;
  for (int a = 0; a <= most.a; ++a) {
    for (int delay = 0; delay <= most.delay; ++delay) {
      for (int b = 1; b <= most.b; ++b) {
        columns.clear();
        for (Index i = 0; i < a; ++i) {
          columns.push_back(i);
        }
        for (Index j = 0; j < inputs; ++j) {
          for (Index i = 0; i < b; ++i) {
            columns.push_back(widest.a + j * widest.b + delay + i);
          }
        }
        const auto part = least_squares(R(Eigen::all, columns), R.col(d + 1));
        if (!part || part->rank < static_cast<Index>(columns.size())) {
          continue;
        }
        const double square =
            std::max(part->residual_squares / count, 1e-32 * R.col(d + 1).squaredNorm() / count);
        const auto parameters = static_cast<double>(columns.size());
        const double value = criterion == OrderCriterion::aic
                                 ? count * std::log(square) + 2.0 * parameters
                             : criterion == OrderCriterion::bic
                                 ? count * std::log(square) + parameters * std::log(count)
                                 : square * (1.0 + parameters * std::log(count) / count);
        if (value < least) {
          least = value;
          best = {.a = a, .b = b, .delay = delay};
        }
      }
    }
  }
  if (best.a < 0) {
    return refusal(IdentificationError::singular, where)
        .hint("excite the input with more frequencies");
  }
  return fit(record, period, best, where);
}

}  // namespace flyball::identification
