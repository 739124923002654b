#include <flyball/estimation/autocovariance.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/math/equations/matrix_equation.hpp>

#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::string_view in_fit_autocovariances = "fit_autocovariances";

/// The unknown entries of Q and R, each symmetric or diagonal, in coordinates in which the distance
/// of matrices is that of vectors.
class Unknowns {
 public:
  Unknowns(Index g, Index p, const AutocovarianceOptions& options) : g_(g), p_(p) {
    list(0, g, options.diagonal_process);
    list(g, p, options.diagonal_measurement);
  }

  struct Entry {
    Index row, column;  ///< Of Q beside R, diag(Q, R).
  };
  [[nodiscard]] Index size() const { return static_cast<Index>(entries_.size()); }
  [[nodiscard]] const Entry& operator[](Index i) const {
    return entries_[static_cast<std::size_t>(i)];
  }
  /// Of what is off the diagonal there are two.
  [[nodiscard]] double weight(Index i) const {
    const Entry& e = (*this)[i];
    return e.row == e.column ? 1.0 : 1.0 / std::numbers::sqrt2;
  }
  /// diag(Q, R)
  [[nodiscard]] MatrixXd matrix(const VectorXd& theta) const {
    MatrixXd M = MatrixXd::Zero(g_ + p_, g_ + p_);
    for (Index i = 0; i < size(); ++i) {
      M((*this)[i].row, (*this)[i].column) += weight(i) * theta(i);
      if ((*this)[i].row != (*this)[i].column) {
        M((*this)[i].column, (*this)[i].row) += weight(i) * theta(i);
      }
    }
    return M;
  }
  /// The nearest semidefinite one.
  [[nodiscard]] VectorXd projected(const VectorXd& theta) const {
    MatrixXd M = matrix(theta);
    for (const auto& [begin, count] : {std::pair(Index{0}, g_), std::pair(g_, p_)}) {
      const auto [values, V] =
          detail::symmetric_eigensystem_of(MatrixXd(M.block(begin, begin, count, count)));
      M.block(begin, begin, count, count) = V * values.cwiseMax(0.0).asDiagonal() * V.transpose();
    }
    VectorXd out(size());
    for (Index i = 0; i < size(); ++i) {
      out(i) = M((*this)[i].row, (*this)[i].column) / weight(i);
    }
    return out;
  }

 private:
  void list(Index begin, Index count, bool diagonal) {
    for (Index j = 0; j < count; ++j) {
      for (Index i = j; i < (diagonal ? j + 1 : count); ++i) {
        entries_.push_back({begin + i, begin + j});
      }
    }
  }

  Index g_, p_;
  std::vector<Entry> entries_;
};

/// C_0 … C_lags, weighed, below each other: of C_0 what is on and below the diagonal.
VectorXd stacked(const std::vector<MatrixXd>& covariances) {
  const Index p = covariances.front().rows();
  VectorXd all(p * (p + 1) / 2 + (static_cast<Index>(covariances.size()) - 1) * p * p);
  Index at = 0;
  for (Index j = 0; j < p; ++j) {
    for (Index i = j; i < p; ++i) {
      // The variance of a variance is twice that of a covariance.
      all(at++) = covariances.front()(i, j) / (i == j ? std::numbers::sqrt2 : 1.0);
    }
  }
  for (std::size_t lag = 1; lag < covariances.size(); ++lag) {
    all.segment(at, p * p) = covariances[lag].reshaped();
    at += p * p;
  }
  return all;
}

double spectral_radius(const MatrixXd& A) {
  return detail::eigenvalues_of(A).cwiseAbs().maxCoeff();
}

/// How many steps it takes to forget all but a share.
Index memory(double radius, double share) {
  return radius > 0.0 ? static_cast<Index>(std::ceil(std::log(share) / std::log(radius))) : 1;
}

Index lags_of(const AutocovarianceOptions& options, double radius) {
  constexpr double forgotten = 0.02;
  return options.lags > 0 ? options.lags : std::clamp<Index>(memory(radius, forgotten), 5, 100);
}

/// min ‖M θ - b‖ over the semidefinite, from the unconstrained one.
struct Solution {
  VectorXd theta;
  int iterations = 0;
  bool converged = false;
  double optimality = 0.0;
};
Solution constrained(const MatrixXd& M, const VectorXd& b, const Unknowns& unknowns, int most) {
  const MatrixXd H = detail::transposed_product(M, M);
  const VectorXd g = M.transpose() * b;
  const double step = 1.0 / detail::symmetric_eigensystem_of(H).values.maxCoeff();
  Solution found{unknowns.projected(detail::solve_symmetric(H, g))};
  VectorXd point = found.theta;
  double momentum = 1.0;
  constexpr double settled = 1e-12;
  while (found.iterations < most && !found.converged) {
    ++found.iterations;
    const VectorXd next = unknowns.projected(point - step * (H * point - g));
    const VectorXd moved = next - found.theta;
    if ((point - next).dot(moved) > 0.0) {  // Uphill: without momentum.
      momentum = 1.0;
    }
    const double longer = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * momentum * momentum));
    point = next + ((momentum - 1.0) / longer) * moved;
    momentum = longer;
    found.theta = next;
    const VectorXd stays = unknowns.projected(next - step * (H * next - g));
    found.optimality = (stays - next).norm() / std::max(next.norm(), 1e-300);
    found.converged = found.optimality <= settled;
  }
  return found;
}

}  // namespace

ErrorInfo error_info(AutocovarianceError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"unstable", "the filter's error does not decay", ErrorKind::no_answer},
      {"too_few", "there are too few innovations", ErrorKind::no_answer},
      {"not_determined", "other noises have the same autocovariances", ErrorKind::no_answer},
  };
  return detail::info_of(code, "autocovariance", rows);
}

std::vector<MatrixXd> autocovariances(const MatrixRef& innovations, Index lags) {
  std::vector<MatrixXd> covariances;
  const Index count = innovations.cols();
  for (Index j = 0; j <= lags; ++j) {
    covariances.push_back(detail::product_transposed(innovations.rightCols(count - j),
                                                     innovations.leftCols(count - j)) /
                          static_cast<double>(count - j));
  }
  return covariances;
}

Expected<MatrixXd> innovations_of(const MatrixRef& A, const MatrixRef& C, const MatrixRef& L,
                                  const MatrixRef& y, const MatrixRef& added) {
  const Index n = A.rows();
  const Index p = C.rows();
  FLYBALL_CHECK(Checks("innovations_of")
                    .square(A, "A")
                    .shape(C, p, n, "C", "outputs x states")
                    .shape(L, n, p, "L", "states x outputs")
                    .shape(y, p, y.cols(), "y", "outputs x samples")
                    .finite(A, "A")
                    .finite(C, "C")
                    .finite(L, "L")
                    .finite(y, "y"));
  if (added.size() != 0) {
    FLYBALL_CHECK(Checks("innovations_of")
                      .shape(added, n, y.cols(), "added", "states x samples")
                      .finite(added, "added"));
  }
  MatrixXd innovations(p, y.cols());
  VectorXd x = VectorXd::Zero(n);
  for (Index k = 0; k < y.cols(); ++k) {
    innovations.col(k) = y.col(k) - C * x;
    x = (A * x + L * innovations.col(k)).eval();
    if (added.size() != 0) {
      x += added.col(k);
    }
  }
  return innovations;
}

Expected<AutocovarianceFit> fit_autocovariances(const MatrixRef& A, const MatrixRef& C,
                                                const MatrixRef& G, const MatrixRef& L,
                                                const std::vector<MatrixXd>& covariances,
                                                Index count, const AutocovarianceOptions& options) {
  const Index n = A.rows();
  const Index p = C.rows();
  const Index g = G.cols();
  FLYBALL_CHECK(Checks(in_fit_autocovariances)
                    .square(A, "A")
                    .shape(C, p, n, "C", "outputs x states")
                    .shape(G, n, g, "G", "states x noises")
                    .shape(L, n, p, "L", "states x outputs")
                    .finite(A, "A")
                    .finite(C, "C")
                    .finite(G, "G")
                    .finite(L, "L")
                    .within(static_cast<double>(count), 1.0, 1e15, "count")
                    .within(options.iterations, 1.0, 1e9, "iterations"));
  if (covariances.empty()) {
    return refusal(ArgumentError::empty, in_fit_autocovariances, "covariances")
        .got("empty")
        .expected("Ĉ_0 and later ones");
  }
  for (const MatrixXd& one : covariances) {
    FLYBALL_CHECK(Checks(in_fit_autocovariances)
                      .shape(one, p, p, "covariances", "outputs x outputs")
                      .finite(one, "covariances"));
  }
  const MatrixXd decays = A - L * C;
  const double radius = spectral_radius(decays);
  if (!(radius < 1.0)) {
    return refusal(AutocovarianceError::unstable, in_fit_autocovariances, "A - L C")
        .got(detail::format("not stable, with an eigenvalue of magnitude {}", radius))
        .expected("stable")
        .hint("take the gain of a Kalman filter");
  }
  const auto scale = detail::cholesky_of(detail::symmetrized(covariances.front()));
  if (!scale) {
    return refusal(ArgumentError::not_positive, in_fit_autocovariances,
                   "the innovations' covariance")
        .got("not positive definite")
        .expected("positive definite: an output without noise tells nothing of it");
  }
  const auto whitened = [&](const MatrixXd& M) {
    return MatrixXd(scale->triangularView<Eigen::Lower>().solve(M));
  };
  const auto scaled = [&](const MatrixXd& M) {
    return whitened(MatrixXd(whitened(M).transpose())).transpose().eval();
  };
  std::vector<MatrixXd> measured;
  for (const MatrixXd& one : covariances) {
    measured.push_back(scaled(one));
  }
  const VectorXd b = stacked(measured);

  // What each unknown entry adds to the autocovariances.
  const Unknowns unknowns(g, p, options);
  const MatrixXd into = [&] {
    MatrixXd M(n, g + p);
    M << G, L;
    return M;
  }();
  MatrixXd M(b.size(), unknowns.size());
  for (Index i = 0; i < unknowns.size(); ++i) {
    const MatrixXd E = unknowns.matrix(VectorXd::Unit(unknowns.size(), i));
    const MatrixXd R = E.bottomRightCorner(p, p);
    FLYBALL_TRY(const auto P, discrete_lyapunov(decays, detail::product_transposed(
                                                            detail::product(into, E), into)));
    std::vector<MatrixXd> added{scaled(C * P.X * C.transpose() + R)};
    MatrixXd later = decays * P.X * C.transpose() - L * R;  // Āʲ P Cᵀ - Āʲ⁻¹ L R
    for (std::size_t j = 1; j < covariances.size(); ++j) {
      added.push_back(scaled(C * later));
      later = (decays * later).eval();
    }
    M.col(i) = stacked(added);
  }

  // Columns of one length, by units of the noises: Q's and R's stay semidefinite.
  VectorXd unit = VectorXd::Ones(g + p);
  for (Index i = 0; i < unknowns.size(); ++i) {
    const auto& entry = unknowns[i];
    const double length = M.col(i).norm();
    if (entry.row == entry.column && length > 0.0) {
      unit(entry.row) = 1.0 / std::sqrt(length);
    }
  }
  VectorXd units(unknowns.size());
  for (Index i = 0; i < unknowns.size(); ++i) {
    units(i) = unit(unknowns[i].row) * unit(unknowns[i].column);
    M.col(i) *= units(i);
  }
  const auto [U, values, V] = detail::svd_of(M);
  constexpr double rounding = 1e-9;
  AutocovarianceFit fit;
  fit.condition = values(0) / values(values.size() - 1);
  if (M.rows() < M.cols() || !(values(values.size() - 1) > rounding * values(0))) {
    Index which = 0;
    V.col(unknowns.size() - 1).cwiseAbs().maxCoeff(&which);
    const auto& entry = unknowns[which];
    const bool is_process = entry.row < g;
    const Index first = is_process ? 0 : g;
    return refusal(AutocovarianceError::not_determined, in_fit_autocovariances, "the noise")
        .got(detail::format("not determined by {} outputs, above all {}({}, {})", p,
                            is_process ? "Q" : "R", entry.row - first + 1,
                            entry.column - first + 1))
        .expected("fewer unknown entries")
        .hint("take fewer process noises (G), or independent ones");
  }
  fit.lags = static_cast<Index>(covariances.size()) - 1;
  Solution solution{detail::solve_least_squares(M, b), 0, true, 0.0};
  fit.at_boundary =
      (unknowns.projected(solution.theta) - solution.theta).norm() > 1e-12 * solution.theta.norm();
  if (fit.at_boundary) {
    solution = constrained(M, b, unknowns, options.iterations);
  }
  fit.iterations = solution.iterations;
  fit.converged = solution.converged;
  fit.optimality = solution.optimality;
  fit.misfit = std::sqrt((M * solution.theta - b).squaredNorm() * static_cast<double>(count) /
                         static_cast<double>(std::max<Index>(b.size() - M.cols(), 1)));
  const MatrixXd noises = unknowns.matrix(solution.theta.cwiseProduct(units));
  fit.Q = noises.topLeftCorner(g, g);
  fit.R = noises.bottomRightCorner(p, p);
  // (MᵀM)⁻¹/N
  MatrixXd errors = MatrixXd::Zero(g + p, g + p);
  for (Index i = 0; i < unknowns.size(); ++i) {
    const auto& entry = unknowns[i];
    errors(entry.row, entry.column) = errors(entry.column, entry.row) =
        unknowns.weight(i) * units(i) * V.row(i).transpose().cwiseQuotient(values).norm() /
        std::sqrt(static_cast<double>(count));
  }
  fit.Q_std = errors.topLeftCorner(g, g);
  fit.R_std = errors.bottomRightCorner(p, p);
  return fit;
}

Expected<AutocovarianceFit> fit_noise_by_autocovariances(const MatrixRef& A, const MatrixRef& C,
                                                         const MatrixRef& G, const MatrixRef& y,
                                                         const MatrixRef& added, const MatrixRef& L,
                                                         const AutocovarianceOptions& options) {
  constexpr int most_rounds = 5;
  constexpr double forgotten = 1e-3;
  constexpr double same = 1e-3;
  const Index n = A.rows();
  const Index p = C.rows();
  FLYBALL_CHECK(
      Checks(in_fit_autocovariances).square(A, "A").shape(G, n, G.cols(), "G", "states x noises"));
  MatrixXd gain = L;
  if (L.size() == 0) {
    FLYBALL_TRY(const auto first, kalman_gain(A, C, MatrixXd(MatrixXd::Identity(n, n)),
                                              MatrixXd(MatrixXd::Identity(p, p))));
    gain = first.L;
  }
  AutocovarianceFit fit;
  for (int round = 0; round < most_rounds; ++round) {
    FLYBALL_TRY(const MatrixXd all, innovations_of(A, C, gain, y, added));
    const double radius = spectral_radius(A - gain * C);
    const Index lags = lags_of(options, radius);
    const Index skipped = radius < 1.0 ? memory(radius, forgotten) : 0;
    const Index count = all.cols() - skipped;
    if (count < 10 * lags) {
      if (round > 0) {
        break;  // The last filter forgets too slowly for the record; the one before did not.
      }
      return refusal(AutocovarianceError::too_few, in_fit_autocovariances, "y")
          .got(detail::format("{} samples, of which {} count", all.cols(),
                              std::max<Index>(count, 0)))
          .expected(detail::format("{} or more for {} autocovariances", skipped + 10 * lags, lags));
    }
    const MatrixXd innovations = all.rightCols(count);
    auto next =
        fit_autocovariances(A, C, G, gain, autocovariances(innovations, lags), count, options);
    if (!next) {
      if (round > 0) {
        break;
      }
      return tl::unexpected(next.error());
    }
    const bool stays = round > 0 && (next->Q - fit.Q).norm() <= same * fit.Q.norm() &&
                       (next->R - fit.R).norm() <= same * fit.R.norm();
    fit = *std::move(next);
    if (stays) {
      break;
    }
    const MatrixXd of_states =
        detail::symmetrized(detail::product_transposed(detail::product(G, fit.Q), G));
    const auto better = kalman_gain(A, C, of_states, fit.R);
    if (!better) {
      break;  // Noises that drive no filter, such as R = 0: those of this round stand.
    }
    gain = better->L;
  }
  return fit;
}

}  // namespace flyball
