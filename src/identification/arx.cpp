#include <algorithm>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <flyball/identification/identification_error.hpp>
#include <flyball/identification/polynomial_model.hpp>
#include <flyball/math/regression/streamed_least_squares.hpp>

#include "core/try.hpp"
#include "identification/polynomials.hpp"
#include "identification/record_kernel.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/panels.hpp"

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

/// What a regression answers here.
struct Estimate {
  VectorXd coefficients;
  VectorXd standard_errors;
  MatrixXd covariance;
};

/// The regression by its normal equations, whose sums of products follow from those a sample
/// earlier by what enters and what leaves; nothing where squaring the data costs more than half of
/// the digits.
std::optional<Estimate> regress_by_products(const ScaledRecord& record,
                                            const PolynomialOrders& orders, Index first) {
  const Index inputs = record.u.cols();
  const Index channels = inputs + 1;
  const Index d = parameters_of(orders, inputs);
  const Index count = record.y.size() - first;
  MatrixXd w(record.y.size() + detail::record_margin, channels);
  w.topRows(record.y.size()) << record.y, record.u;
  w.bottomRows(detail::record_margin).setZero();
  const Index shifts = first + 1;
  const Index apart = (shifts + 3) / 4 * 4;
  MatrixXd products(apart, channels * channels);
  detail::lag_products({w.data(), static_cast<int>(w.rows()), static_cast<int>(channels),
                        static_cast<int>(record.y.size())},
                       static_cast<int>(count), static_cast<int>(shifts), products.data());
  MatrixXd G(shifts * channels, shifts * channels);
  for (Index b = 0; b < shifts; ++b) {
    for (Index a = 0; a <= b; ++a) {
      for (Index j = 0; j < channels; ++j) {
        for (Index i = 0; i < channels; ++i) {
          const double sum =
              a == 0 ? products(b, j * channels + i)
                     : G((a - 1) * channels + i, (b - 1) * channels + j) +
                           (w(count + a - 1, i) * w(count + b - 1, j) - w(a - 1, i) * w(b - 1, j));
          G(a * channels + i, b * channels + j) = sum;
          G(b * channels + j, a * channels + i) = sum;
        }
      }
    }
  }
  // Rows of G: a sample l late is shift first - l. The target is the last.
  std::vector<Index> rows;
  VectorXd sign = VectorXd::Ones(d + 1);
  for (Index i = 0; i < orders.a; ++i) {
    sign(static_cast<Index>(rows.size())) = -1.0;
    rows.push_back((first - 1 - i) * channels);
  }
  for (Index j = 0; j < inputs; ++j) {
    for (Index i = 0; i < orders.b; ++i) {
      rows.push_back((first - orders.delay - i) * channels + j + 1);
    }
  }
  rows.push_back(first * channels);
  MatrixXd S = sign.asDiagonal() * G(rows, rows) * sign.asDiagonal();
  const VectorXd squares = S.diagonal();
  constexpr double least = 1e-7;
  if (!(squares.minCoeff() > 0.0) || !detail::cholesky_in_place(S) ||
      !(S.diagonal().array().square() > least * squares.array()).all()) {
    return std::nullopt;
  }
  // L of [X y]: its last row tells the coefficients, its last entry what they leave.
  MatrixXd inverse = MatrixXd::Identity(d, d);
  detail::divide_by_triangle(inverse, S.topLeftCorner(d, d));
  Estimate estimate;
  estimate.coefficients = inverse.transpose() * S.row(d).head(d).transpose();
  estimate.covariance = MatrixXd::Zero(d, d);
  const MatrixXd turned = inverse.transpose();
  detail::add_product_transposed(S(d, d) * S(d, d) / static_cast<double>(count - d), turned, turned,
                                 estimate.covariance);
  estimate.covariance = detail::symmetrized(estimate.covariance);
  estimate.standard_errors = estimate.covariance.diagonal().cwiseSqrt();
  return estimate;
}

/// -y_{k-1} … -y_{k-a}, then u_{k-delay} … of each input, from the first sample that counts on.
Expected<Estimate> regress(const ScaledRecord& record, const PolynomialOrders& orders, Index first,
                           std::string_view where) {
  const Index inputs = record.u.cols();
  const Index d = parameters_of(orders, inputs);
  if (d == 0) {
    return Estimate{};
  }
  if (auto found = regress_by_products(record, orders, first)) {
    return *std::move(found);
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
  return Estimate{std::move(regression.coefficients), std::move(regression.standard_errors),
                  std::move(regression.covariance)};
}

Expected<PolynomialFit> fit(const ScaledRecord& record, Time period, const PolynomialOrders& orders,
                            std::string_view where) {
  FLYBALL_TRY(Estimate regression, regress(record, orders, start_of(orders), where));
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
