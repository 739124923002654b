#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "estimation/steady_filter.hpp"
#include "math/equations/lyapunov_correction.hpp"
#include "math/extended/extended_eigenvalues.hpp"

namespace flyball::detail {

namespace {

std::optional<FilterUpdate> update_of(const DoubleDoubleMatrix& P, const DoubleDoubleMatrix& C,
                                      const DoubleDoubleMatrix& R) {
  const DoubleDoubleMatrix CP = product(C, P);
  const auto K = solve(symmetrized(add_product(R, 1.0, CP, C.transpose())), CP);
  if (!K || !K->all_finite()) {
    return std::nullopt;
  }
  DoubleDoubleMatrix gain = K->transpose();
  DoubleDoubleMatrix posterior = symmetrized(add_product(P, -1.0, gain, CP));
  // Nothing is left of that where a measurement takes away most of its digits.
  constexpr double cancels = 1e-15;
  if ((posterior.hi.diagonal().array() < cancels * P.hi.diagonal().array()).any()) {
    const DoubleDoubleMatrix rest =
        add_product(DoubleDoubleMatrix::identity(P.rows()), -1.0, gain, C);
    posterior = symmetrized(add_product(product(product(rest, P), rest.transpose()), 1.0,
                                        product(gain, R), gain.transpose()));
  }
  return FilterUpdate{std::move(gain), std::move(posterior)};
}

FilterUnits filter_units(const MatrixRef& C, const Eigen::MatrixXd& R, const Eigen::MatrixXd& P) {
  constexpr double none = -1e4;
  const auto size = [&](double x) { return x > 0.0 ? std::log2(x) : none; };
  const auto unit = [](double exponent) {
    return exponent > none / 2.0 ? static_cast<int>(std::lround(exponent)) : 0;
  };
  FilterUnits units{Eigen::VectorXi::Zero(P.rows()), Eigen::VectorXi::Zero(C.rows())};
  for (Eigen::Index i = 0; i < P.rows(); ++i) {
    units.states(i) = unit(0.5 * size(std::abs(P(i, i))));
  }
  for (Eigen::Index j = 0; j < C.rows(); ++j) {
    double largest = 0.5 * size(R(j, j));
    for (Eigen::Index i = 0; i < C.cols(); ++i) {
      largest = std::max(largest, size(std::abs(C(j, i))) + units.states(i));
    }
    units.outputs(j) = unit(largest);
  }
  return units;
}

/// What is left of P's equation.
DoubleDoubleMatrix left_of(const SteadyFilter& f) {
  const DoubleDoubleMatrix predicted =
      add_product(f.Q, 1.0, product(f.A, f.update.P), f.A.transpose());
  return sum(predicted, -1.0, f.P);
}

/// The filter at another P in the same units.
std::optional<SteadyFilter> moved_to(DoubleDoubleMatrix P, const SteadyFilter& from) {
  auto update = update_of(P, from.C, from.R);
  if (!update) {
    return std::nullopt;
  }
  SteadyFilter found = from;
  found.P = std::move(P);
  found.update = std::move(*update);
  return found;
}

/// P = SPSᵀ + LRLᵀ + Q with S = A - LC: the covariance of the filter with any gain L that is
/// stable. A sum of covariances, of which the small ones are not lost beside the large.
std::optional<DoubleDoubleMatrix> covariance_with(const SteadyFilter& f,
                                                  const DoubleDoubleMatrix& L) {
  constexpr int most_doublings = 60;
  constexpr double nothing = 1e-20;
  DoubleDoubleMatrix S = add_product(f.A, -1.0, L, f.C);
  DoubleDoubleMatrix P = symmetrized(add_product(f.Q, 1.0, product(L, f.R), L.transpose()));
  for (int k = 0; k < most_doublings; ++k) {
    P = symmetrized(add_product(P, 1.0, product(S, P), S.transpose()));
    S = product(S, S);
    if (!P.all_finite() || !S.all_finite()) {
      return std::nullopt;
    }
    if (S.norm() < nothing) {
      return P;
    }
  }
  return std::nullopt;
}

/// The largest of what is left beside the largest of its terms, 2^(row_i + column_j) times both.
double share_of(const DoubleDoubleMatrix& left, const Eigen::MatrixXd& terms,
                const Eigen::VectorXi& row, const Eigen::VectorXi& column) {
  const auto largest = [&](const Eigen::MatrixXd& M) {
    double most = -std::numeric_limits<double>::infinity();
    for (Eigen::Index j = 0; j < M.cols(); ++j) {
      for (Eigen::Index i = 0; i < M.rows(); ++i) {
        most = std::max(most, std::log2(std::abs(M(i, j))) + row(i) + column(j));
      }
    }
    return most;
  };
  const double rest = largest(left.hi);
  return std::isfinite(rest) ? std::exp2(rest - largest(terms)) : 0.0;
}

}  // namespace

std::optional<SteadyFilter> filter_at(const FilterProblem& problem, const Eigen::MatrixXd& P) {
  const FilterUnits units = filter_units(problem.C, problem.R, P);
  const auto scaled = [](const Eigen::MatrixXd& M, const Eigen::VectorXi& row,
                         const Eigen::VectorXi& column) {
    return DoubleDoubleMatrix(times_powers(M, row, column, 0));
  };
  const Eigen::VectorXi& x = units.states;
  const Eigen::VectorXi& y = units.outputs;
  SteadyFilter found{units, scaled(problem.A, -x, x), scaled(problem.C, -y, x),
                     scaled(symmetrized(problem.Q), -x, -x),
                     scaled(symmetrized(problem.R), -y, -y)};
  found.P = scaled(P, -x, -x);
  auto update = found.all_finite() ? update_of(found.P, found.C, found.R) : std::nullopt;
  if (!update) {
    return std::nullopt;
  }
  found.update = std::move(*update);
  return found;
}

SteadyFilter corrected(SteadyFilter found) {
  constexpr int most_steps = 5;
  constexpr double small = 1e-3;
  constexpr double last = 1e-12;
  DoubleDoubleMatrix left = left_of(found);
  for (int step = 0; step < most_steps; ++step) {
    const DoubleDoubleMatrix loop =
        add_product(found.A, -1.0, product(found.A, found.update.K), found.C);
    const auto missing = discrete_lyapunov_correction(loop.rounded(), left.rounded());
    const double size = found.P.norm();
    if (!missing || !(missing->X.norm() <= small * size)) {
      break;
    }
    auto better = moved_to(symmetrized(sum(found.P, 1.0, DoubleDoubleMatrix(missing->X))), found);
    if (!better) {
      break;
    }
    DoubleDoubleMatrix still = left_of(*better);
    if (!(still.norm() < left.norm())) {
      break;
    }
    found = std::move(*better);
    left = std::move(still);
    if (missing->X.norm() <= last * size) {
      break;
    }
  }
  return found;
}

std::optional<SteadyFilter> iterated(const FilterProblem& problem, const Eigen::MatrixXd& P,
                                     const Eigen::MatrixXd& L) {
  constexpr int most_steps = 20;
  constexpr double enough = 1e-25;
  auto found = filter_at(problem, P);
  for (int pass = 0; pass < 2 && found; ++pass) {
    // First for the units, then for the answer.
    const FilterUnits& units = found->units;
    const auto covariance = covariance_with(
        *found, DoubleDoubleMatrix(times_powers(L, -units.states, units.outputs, 0)));
    if (!covariance) {
      return std::nullopt;
    }
    found = pass == 0 ? filter_at(problem, found->covariance(*covariance))
                      : moved_to(*covariance, *found);
  }
  for (int step = 0; step < most_steps && found; ++step) {
    auto next = covariance_with(*found, product(found->A, found->update.K));
    if (!next) {
      return std::nullopt;
    }
    const double moved = sum(*next, -1.0, found->P).norm();
    found = moved_to(std::move(*next), *found);
    if (found && moved <= enough * found->P.norm()) {
      break;
    }
  }
  return found;
}

double residual_of(const SteadyFilter& f) {
  const DoubleDoubleMatrix K(f.update.K.rounded());
  const DoubleDoubleMatrix P(symmetrized(f.P.rounded()));
  const DoubleDoubleMatrix L = product(f.A, K);
  const DoubleDoubleMatrix S = add_product(f.A, -1.0, L, f.C);
  const DoubleDoubleMatrix LR = product(L, f.R);
  const DoubleDoubleMatrix CP = product(f.C, P);
  DoubleDoubleMatrix loop = add_product(f.Q, 1.0, product(S, P), S.transpose());
  loop = sum(add_product(std::move(loop), 1.0, LR, L.transpose()), -1.0, P);
  const DoubleDoubleMatrix W = add_product(f.R, 1.0, CP, f.C.transpose());
  const DoubleDoubleMatrix gain = sum(product(K, W), -1.0, CP.transpose());
  const DoubleDoubleMatrix updated(f.update.P.rounded());
  const DoubleDoubleMatrix posterior = add_product(sum(updated, -1.0, P), 1.0, K, CP);
  const auto size = [](const DoubleDoubleMatrix& M) -> Eigen::MatrixXd { return M.hi.cwiseAbs(); };
  const Eigen::MatrixXd S_terms = size(f.A) + size(f.A) * size(K) * size(f.C);
  const Eigen::MatrixXd L_terms = size(f.A) * size(K);
  const Eigen::MatrixXd PC_terms = size(P) * size(f.C).transpose();
  const Eigen::MatrixXd loop_terms = S_terms * size(P) * S_terms.transpose() +
                                     L_terms * size(f.R) * L_terms.transpose() + size(f.Q) +
                                     size(P);
  const Eigen::MatrixXd gain_terms = size(K) * (size(f.C) * PC_terms + size(f.R)) + PC_terms;
  const Eigen::MatrixXd posterior_terms = size(updated) + size(P) + size(K) * PC_terms.transpose();
  // And P is a covariance, to what rounding leaves of its zeros.
  constexpr double rounding = 1e-12;
  const Eigen::Index n = P.rows();
  if (!loop.all_finite() || !gain.all_finite() || !posterior.all_finite() ||
      !loop_terms.allFinite() || !gain_terms.allFinite() || !posterior_terms.allFinite() ||
      P.hi.diagonal().minCoeff() < 0.0 ||
      !cholesky_of(P.hi + rounding * Eigen::MatrixXd::Identity(n, n))) {
    return std::numeric_limits<double>::infinity();
  }
  const Eigen::VectorXi& x = f.units.states;
  const Eigen::VectorXi& y = f.units.outputs;
  const Eigen::VectorXi own_x = Eigen::VectorXi::Zero(x.size());
  const Eigen::VectorXi own_y = Eigen::VectorXi::Zero(y.size());
  return std::max({share_of(loop, loop_terms, own_x, own_x), share_of(loop, loop_terms, x, x),
                   share_of(gain, gain_terms, own_x, own_y), share_of(gain, gain_terms, x, y),
                   share_of(posterior, posterior_terms, own_x, own_x),
                   share_of(posterior, posterior_terms, x, x)});
}

std::optional<Eigen::VectorXcd> poles_of(const SteadyFilter& f) {
  const DoubleDoubleMatrix K(f.update.K.rounded());
  const DoubleDoubleMatrix loop = add_product(f.A, -1.0, product(f.A, K), f.C);
  const Eigen::MatrixXd rounded = loop.rounded();
  Eigen::VectorXcd poles = eigenvalues_of(rounded);
  if (poles.cwiseAbs().maxCoeff() < 1.0) {
    return poles;
  }
  auto extended = balanced_extended_eigenvalues_of(loop);
  if (!extended || !(extended->cwiseAbs().maxCoeff() < 1.0)) {
    return std::nullopt;
  }
  return extended;
}

}  // namespace flyball::detail
