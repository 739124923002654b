#include <algorithm>
#include <cmath>
#include <string>

#include "control/mpc/mpc_limits.hpp"
#include "core/constants.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using optimization::detail::StageQpSizes;
using optimization::detail::StageQpSolver;

namespace {

constexpr int longest_horizon = 1000;

/// Limits of one kind: of their size, ordered, with nothing that is NaN.
Expected<void> complete(VectorXd& low, VectorXd& high, Index size, std::string_view where,
                        std::string_view low_name, std::string_view high_name,
                        std::string_view meaning, double low_most, double high_least) {
  const auto fill = [&](VectorXd& v, double value, std::string_view name) -> Expected<void> {
    if (v.size() == 0) {
      v.setConstant(size, value);
      return {};
    }
    return check_shape(v, size, 1, where, name, meaning);
  };
  FLYBALL_CHECK(fill(low, -infinity, low_name));
  FLYBALL_CHECK(fill(high, infinity, high_name));
  for (Index i = 0; i < size; ++i) {
    const std::string entry = "[" + std::to_string(i) + "]";
    if (std::isnan(low(i)) || std::isnan(high(i))) {
      return refusal(ArgumentError::not_finite, where,
                     std::string(std::isnan(low(i)) ? low_name : high_name) + entry)
          .got("NaN")
          .expected("a number, or infinity for no limit");
    }
    if (!(low(i) < high(i))) {
      return refusal(ArgumentError::out_of_range, where, std::string(low_name) + entry)
          .got(format_number(low(i)))
          .expected("below " + std::string(high_name) + entry + ", which is " +
                    format_number(high(i)));
    }
    if (low(i) > low_most || high(i) < high_least) {
      const bool is_low = low(i) > low_most;
      return refusal(ArgumentError::out_of_range, where,
                     std::string(is_low ? low_name : high_name) + entry)
          .got(format_number(is_low ? low(i) : high(i)))
          .expected(is_low ? "at most 0: an input may stay as it is"
                           : "at least 0: an input may stay as it is");
    }
  }
  return {};
}

bool any_finite(const VectorXd& low, const VectorXd& high) {
  return low.array().isFinite().any() || high.array().isFinite().any();
}

Expected<MpcSettings> complete_limits(const MpcSettings& settings, Index n, Index m,
                                      std::string_view where) {
  MpcSettings all = settings;
  if (settings.horizon < 1 || settings.horizon > longest_horizon) {
    return refusal(ArgumentError::out_of_range, where, "horizon")
        .got(std::to_string(settings.horizon))
        .expected("1 to " + std::to_string(longest_horizon) + " periods");
  }
  FLYBALL_CHECK(complete(all.u_min, all.u_max, m, where, "u_min", "u_max", "inputs x 1", infinity,
                         -infinity));
  FLYBALL_CHECK(
      complete(all.du_min, all.du_max, m, where, "du_min", "du_max", "inputs x 1", 0.0, 0.0));
  FLYBALL_CHECK(complete(all.x_min, all.x_max, n, where, "x_min", "x_max", "states x 1", infinity,
                         -infinity));
  if (!any_finite(all.du_min, all.du_max)) {
    all.du_min = VectorXd();
    all.du_max = VectorXd();
  }
  for (VectorXd* v : {&all.sigma, &all.rho}) {
    const std::string_view name = v == &all.sigma ? "sigma" : "rho";
    if (v->size() == 0) {
      continue;
    }
    FLYBALL_CHECK(Checks(where).shape(*v, n, 1, name, "states x 1").finite(*v, name));
    for (Index i = 0; i < n; ++i) {
      FLYBALL_CHECK(
          check_not_negative((*v)(i), where, std::string(name) + "[" + std::to_string(i) + "]"));
    }
  }
  if (!any_finite(all.x_min, all.x_max)) {
    all.x_min = VectorXd();
    all.x_max = VectorXd();
  }
  return all;
}

Expected<void> check_semidefinite(const MatrixRef& Q, std::string_view where,
                                  std::string_view name) {
  const VectorXd spectrum = symmetric_eigensystem_of(Q).values;
  const double least = spectrum.minCoeff();
  const double size = spectrum.cwiseAbs().maxCoeff();
  if (least < -1e-12 * size) {
    return refusal(ArgumentError::not_positive, where, name)
        .got("an eigenvalue of " + format_number(least))
        .expected("a positive semidefinite matrix");
  }
  return {};
}

/// Q semidefinite and R definite.
Expected<void> check_weights(const MatrixRef& Q, const MatrixRef& R, std::string_view where) {
  FLYBALL_CHECK(check_semidefinite(Q, where, "Q"));
  const VectorXd spectrum = symmetric_eigensystem_of(R).values;
  const double least = spectrum.minCoeff();
  if (!(least > 1e-14 * spectrum.cwiseAbs().maxCoeff())) {
    return refusal(ArgumentError::not_positive, where, "R")
        .got("an eigenvalue of " + format_number(least))
        .expected("a positive definite matrix");
  }
  return {};
}

/// Gives limits of states that have no cost of violation one which no multiplier reaches.
void harden(MpcSettings& settings, double state_weight, double input_weight) {
  if (settings.x_min.size() == 0) {
    return;
  }
  const bool hard = settings.sigma.size() == 0 && settings.rho.size() == 0;
  const Index n = settings.x_min.size();
  if (hard) {
    double range = 1.0;
    for (Index i = 0; i < n; ++i) {
      for (const double bound : {settings.x_min(i), settings.x_max(i)}) {
        range = std::isfinite(bound) ? std::max(range, std::abs(bound)) : range;
      }
    }
    settings.sigma.setConstant(n, 1e4 * range * std::max(state_weight, input_weight));
  }
  if (settings.sigma.size() == 0) {
    settings.sigma.setZero(n);
  }
  if (settings.rho.size() == 0) {
    settings.rho.setZero(n);
  }
  // A limit that costs nothing to violate is none.
  for (Index i = 0; i < n; ++i) {
    if (settings.sigma(i) == 0.0 && settings.rho(i) == 0.0) {
      settings.x_min(i) = -infinity;
      settings.x_max(i) = infinity;
    }
  }
}

}  // namespace

Expected<MpcSettings> complete_settings(const MpcSettings& settings, Index n, Index m,
                                        const MatrixRef& Q, const MatrixRef& R,
                                        std::string_view where,
                                        FunctionRef<Expected<MatrixXd>()> Q_end) {
  FLYBALL_CHECK(Checks(where)
                    .shape(Q, n, n, "Q", "states x states")
                    .finite(Q, "Q")
                    .symmetric(Q, "Q")
                    .shape(R, m, m, "R", "inputs x inputs")
                    .finite(R, "R")
                    .symmetric(R, "R"));
  FLYBALL_TRY(MpcSettings complete, complete_limits(settings, n, m, where));
  FLYBALL_CHECK(check_weights(Q, R, where));
  const Index size = n + m * (complete.du_min.size() > 0 ? 2 : 1);
  if (size > StageQpSolver::largest) {
    return refusal(ArgumentError::out_of_range, where, "states and inputs")
        .got(std::to_string(size))
        .expected("at most " + std::to_string(StageQpSolver::largest) + " in all");
  }
  if (settings.Q_end.size() == 0) {
    FLYBALL_TRY(complete.Q_end, Q_end());
  } else {
    FLYBALL_CHECK(Checks(where)
                      .shape(settings.Q_end, n, n, "Q_end", "states x states")
                      .finite(settings.Q_end, "Q_end")
                      .symmetric(settings.Q_end, "Q_end"));
    FLYBALL_CHECK(check_semidefinite(settings.Q_end, where, "Q_end"));
  }
  harden(complete, std::max(Q.diagonal().maxCoeff(), complete.Q_end.diagonal().maxCoeff()),
         R.diagonal().maxCoeff());
  return complete;
}

StageQpSizes sizes_of(const MpcSettings& settings, Index n, Index m) {
  StageQpSizes sizes;
  sizes.horizon = settings.horizon;
  sizes.has_rates = settings.du_min.size() > 0;
  sizes.states = static_cast<int>(n + (sizes.has_rates ? m : 0));
  sizes.inputs = static_cast<int>(m);
  if (settings.x_min.size() > 0) {
    // The input before has its own limits.
    sizes.sigma.setZero(sizes.states);
    sizes.rho.setOnes(sizes.states);
    sizes.sigma.head(n) = settings.sigma;
    sizes.rho.head(n) = settings.rho;
  }
  return sizes;
}

}  // namespace flyball::detail
