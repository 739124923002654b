#include <flyball/math/derivatives/differentiation.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/constants.hpp"
#include "core/error_rows.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Refusal not_finite(std::string_view where, Index variable, const VectorXd& x) {
  return refusal(DifferentiationError::not_finite, where, "f(x)")
      .got("NaN or infinite beside the point")
      .hint("take a smaller step, or a point inside f's domain")
      .with("variable", static_cast<double>(variable))
      .with("x", std::vector<double>(x.data(), x.data() + x.size()));
}

Expected<void> check_point(const Eigen::Ref<const VectorXd>& x, double step,
                           std::string_view where) {
  return Checks(where).finite(x, "x").not_negative(step, "step");
}

/// (f(x + h e_j) - f(x - h e_j)) / 2h.
VectorXd central(const VectorFunction& f, const Eigen::Ref<const VectorXd>& x, Index j, double h,
                 Index outputs) {
  VectorXd moved = x;
  VectorXd above(outputs);
  VectorXd below(outputs);
  moved(j) = x(j) + h;
  const double high = moved(j);
  f(moved, above);
  moved(j) = x(j) - h;
  const double low = moved(j);
  f(moved, below);
  return (above - below) / (high - low);
}

/// Neville's table over steps that shrink by 1.4; each output keeps the entry whose two neighbours
/// agree with it best.
VectorXd richardson(const VectorFunction& f, const Eigen::Ref<const VectorXd>& x, Index j, double h,
                    Index outputs) {
  constexpr std::size_t rows = 10;
  constexpr double shrink = 1.4;
  std::array<std::array<VectorXd, rows>, rows> table;
  VectorXd best = VectorXd::Constant(outputs, std::numeric_limits<double>::quiet_NaN());
  VectorXd error = VectorXd::Constant(outputs, std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < rows; ++i, h /= shrink) {
    table[0][i] = central(f, x, j, h, outputs);
    double power = shrink * shrink;
    for (std::size_t k = 1; k <= i; ++k, power *= shrink * shrink) {
      table[k][i] = (power * table[k - 1][i] - table[k - 1][i - 1]) / (power - 1.0);
      for (Index row = 0; row < outputs; ++row) {
        const double estimate = std::max(std::abs(table[k][i](row) - table[k - 1][i](row)),
                                         std::abs(table[k][i](row) - table[k - 1][i - 1](row)));
        if (estimate <= error(row)) {
          error(row) = estimate;
          best(row) = table[k][i](row);
        }
      }
    }
  }
  return best;
}

}  // namespace

ErrorInfo error_info(DifferentiationError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"not_finite", "the function is not finite where it is differenced", ErrorKind::no_answer},
  };
  return detail::info_of(code, "differentiation", rows);
}

Expected<MatrixXd> numerical_jacobian(VectorFunction f, const Eigen::Ref<const VectorXd>& x,
                                      Index outputs, const DifferenceOptions& options) {
  constexpr std::string_view where = "numerical_jacobian";
  FLYBALL_CHECK(check_point(x, options.step, where));
  const bool is_central = options.scheme == DifferenceScheme::central;
  MatrixXd J(outputs, x.size());
  for (Index j = 0; j < x.size(); ++j) {
    const double relative = is_central ? std::cbrt(epsilon) : 0.1;
    const double h = options.step > 0.0 ? options.step : relative * std::max(1.0, std::abs(x(j)));
    J.col(j) = is_central ? central(f, x, j, h, outputs) : richardson(f, x, j, h, outputs);
    if (!J.col(j).allFinite()) {
      return not_finite(where, j, x);
    }
  }
  return J;
}

Expected<VectorXd> numerical_gradient(ScalarFunction f, const Eigen::Ref<const VectorXd>& x,
                                      const DifferenceOptions& options) {
  const auto vector_function = [&](const Eigen::Ref<const VectorXd>& at, Eigen::Ref<VectorXd> y) {
    y(0) = f(at);
  };
  return numerical_jacobian(vector_function, x, 1, options).map([](const MatrixXd& J) {
    return VectorXd(J.transpose());
  });
}

Expected<MatrixXd> numerical_hessian(ScalarFunction f, const Eigen::Ref<const VectorXd>& x,
                                     double step) {
  constexpr std::string_view where = "numerical_hessian";
  FLYBALL_CHECK(check_point(x, step, where));
  const Index n = x.size();
  const auto h = [&](Index j) {
    return step > 0.0 ? step : std::pow(epsilon, 0.25) * std::max(1.0, std::abs(x(j)));
  };
  VectorXd moved = x;
  const double middle = f(moved);
  MatrixXd H(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j <= i; ++j) {
      const auto at = [&](double by_i, double by_j) {
        moved(i) += by_i * h(i);
        moved(j) += by_j * h(j);
        const double value = f(moved);
        moved(i) = x(i);
        moved(j) = x(j);
        return value;
      };
      H(i, j) = i == j ? (at(1.0, 0.0) - 2.0 * middle + at(-1.0, 0.0)) / (h(i) * h(i))
                       : (at(1.0, 1.0) - at(1.0, -1.0) - at(-1.0, 1.0) + at(-1.0, -1.0)) /
                             (4.0 * h(i) * h(j));
      H(j, i) = H(i, j);
      if (!std::isfinite(H(i, j))) {
        return not_finite(where, i, x);
      }
    }
  }
  return H;
}

}  // namespace flyball
