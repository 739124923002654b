#include <algorithm>
#include <cmath>
#include <limits>

#include "math/dense/dense.hpp"
#include "math/verified/common_lyapunov.hpp"

namespace flyball::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Lower triangular factor in place; false where S is not positive definite.
bool factor_in_place(MatrixXd& S) {
  const Index n = S.rows();
  for (Index j = 0; j < n; ++j) {
    if (!(S(j, j) > 0.0) || !std::isfinite(S(j, j))) {
      return false;
    }
    const double pivot = std::sqrt(S(j, j));
    S(j, j) = pivot;
    for (Index i = j + 1; i < n; ++i) {
      S(i, j) /= pivot;
    }
    for (Index k = j + 1; k < n; ++k) {
      S.col(k).tail(n - k) -= S(k, j) * S.col(j).tail(n - k);
    }
  }
  return true;
}

/// S⁻¹ of a positive definite S, and ln det S; false otherwise.
bool invert(const MatrixXd& S, MatrixXd& inverse, double& log_det) {
  MatrixXd L = S;
  if (!factor_in_place(L)) {
    return false;
  }
  const Index n = S.rows();
  MatrixXd R = MatrixXd::Zero(n, n);  // L⁻¹
  log_det = 0.0;
  for (Index j = 0; j < n; ++j) {
    log_det += 2.0 * std::log(L(j, j));
    R(j, j) = 1.0 / L(j, j);
    for (Index i = j + 1; i < n; ++i) {
      R(i, j) = -L.row(i).segment(j, i - j).dot(R.col(j).segment(j, i - j)) / L(i, i);
    }
  }
  inverse = MatrixXd(R.transpose().lazyProduct(R));  // of another size it may have been
  return true;
}

/// The barrier of the inequalities at (P, t).
class Barrier {
 public:
  Barrier(const std::vector<MatrixXd>& M, Index fixed)
      : M_(M), size_(M.front().rows()), n_(size_ - fixed) {
    for (Index j = 0; j < n_; ++j) {
      for (Index i = j; i < n_; ++i) {
        rows_.push_back(i);
        columns_.push_back(j);
      }
    }
  }

  [[nodiscard]] Index unknowns() const { return static_cast<Index>(rows_.size()) + 1; }
  /// Of the sum of ln det: the gap of a centre of weight w is this over w.
  [[nodiscard]] double order() const {
    return static_cast<double>(static_cast<Index>(M_.size()) * size_ + 2 * n_);
  }

  [[nodiscard]] MatrixXd widened(const MatrixXd& P) const {
    MatrixXd full = MatrixXd::Identity(size_, size_);
    full.topLeftCorner(n_, n_) = P;
    return full;
  }

  /// The least eigenvalue of all P̂ - MᵀP̂M.
  [[nodiscard]] double least(const MatrixXd& P) const {
    double smallest = std::numeric_limits<double>::infinity();
    const MatrixXd full = widened(P);
    for (const MatrixXd& M : M_) {
      const MatrixXd S = full - M.transpose().lazyProduct(full.lazyProduct(M).eval());
      smallest = std::min(smallest, symmetric_eigensystem_of(symmetrized(S)).values(0));
    }
    return smallest;
  }

  /// -weight t - Σ ln det; infinite outside.
  [[nodiscard]] double value(const MatrixXd& P, double t, double weight) const {
    const double outside = std::numeric_limits<double>::infinity();
    double sum = -weight * t;
    const MatrixXd full = widened(P);
    const auto add = [&](MatrixXd S) {
      if (!factor_in_place(S)) {
        return false;
      }
      sum -= 2.0 * S.diagonal().array().log().sum();
      return true;
    };
    MatrixXd upper = -P;
    upper.diagonal().array() += largest;
    MatrixXd lower = P;
    lower.diagonal().array() -= least_size;
    if (!add(std::move(lower)) || !add(std::move(upper))) {
      return outside;
    }
    for (const MatrixXd& M : M_) {
      MatrixXd S = full - M.transpose().lazyProduct(full.lazyProduct(M).eval());
      S.diagonal().array() -= t;
      if (!add(std::move(S))) {
        return outside;
      }
    }
    return sum;
  }

  /// The Newton step at a point inside; false where it cannot be had.
  [[nodiscard]] bool step(const MatrixXd& P, double t, double weight, MatrixXd& dP, double& dt,
                          double& decrement) {
    const Index m = unknowns();
    gradient_ = VectorXd::Zero(m);
    hessian_ = MatrixXd::Zero(m, m);
    const MatrixXd full = widened(P);
    gradient_(m - 1) = -weight;
    double log_det = 0.0;
    MatrixXd W;
    for (const MatrixXd& M : M_) {
      MatrixXd S = full - M.transpose().lazyProduct(full.lazyProduct(M).eval());
      S.diagonal().array() -= t;
      if (!invert(S, W, log_det)) {
        return false;
      }
      add_inequality(M.topRows(n_), W);
    }
    MatrixXd lower = P;
    lower.diagonal().array() -= least_size;
    if (!invert(lower, W, log_det)) {
      return false;
    }
    add_bound(W, -1.0);
    MatrixXd upper = -P;
    upper.diagonal().array() += largest;
    if (!invert(upper, W, log_det)) {
      return false;
    }
    add_bound(W, 1.0);

    MatrixXd L = hessian_;
    L.diagonal() *= 1.0 + 1e-13;
    if (!factor_in_place(L)) {
      return false;
    }
    VectorXd x = -gradient_;
    for (Index i = 0; i < m; ++i) {
      x(i) = (x(i) - L.row(i).head(i).dot(x.head(i))) / L(i, i);
    }
    decrement = x.squaredNorm();
    for (Index i = m - 1; i >= 0; --i) {
      x(i) = (x(i) - L.col(i).tail(m - 1 - i).dot(x.tail(m - 1 - i))) / L(i, i);
    }
    dP.resize(n_, n_);
    for (Index k = 0; k < m - 1; ++k) {
      const auto at = static_cast<std::size_t>(k);
      dP(rows_[at], columns_[at]) = x(k);
      dP(columns_[at], rows_[at]) = x(k);
    }
    dt = x(m - 1);
    return x.allFinite();
  }

  static constexpr double largest = 100.0;    ///< κ
  static constexpr double least_size = 0.05;  ///< Without it a P of nothing would do.

 private:
  [[nodiscard]] static double half(Index i, Index j) { return i == j ? 0.5 : 1.0; }

  // <E_ij, G> with E_ij = e_i e_jᵀ + e_j e_iᵀ, or e_i e_iᵀ.
  void add_to_gradient(const MatrixXd& G, double sign) {
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      const Index i = rows_[k];
      const Index j = columns_[k];
      gradient_(static_cast<Index>(k)) += sign * (i == j ? G(i, i) : G(i, j) + G(j, i));
    }
  }

  // -ln det (P̂ - MᵀP̂M - t I) with inverse W; X are the rows of M that P multiplies.
  void add_inequality(const MatrixXd& X, const MatrixXd& W) {
    const Index m = unknowns();
    const MatrixXd XW = X.lazyProduct(W);
    const MatrixXd Z = XW.lazyProduct(X.transpose());
    const MatrixXd Y = XW.leftCols(n_);
    const MatrixXd W11 = W.topLeftCorner(n_, n_);
    add_to_gradient(W11 - Z, -1.0);
    gradient_(m - 1) += W.trace();

    const MatrixXd WW = W.lazyProduct(W);
    const MatrixXd cross = WW.topLeftCorner(n_, n_) - XW.lazyProduct(XW.transpose());
    hessian_(m - 1, m - 1) += WW.trace();
    for (std::size_t b = 0; b < rows_.size(); ++b) {
      const Index k = rows_[b];
      const Index l = columns_[b];
      const double scale_b = half(k, l);
      for (std::size_t a = b; a < rows_.size(); ++a) {
        const Index i = rows_[a];
        const Index j = columns_[a];
        const double sum = W11(i, k) * W11(j, l) + W11(i, l) * W11(j, k) + Z(i, k) * Z(j, l) +
                           Z(i, l) * Z(j, k) - Y(k, j) * Y(l, i) - Y(l, j) * Y(k, i) -
                           Y(j, k) * Y(i, l) - Y(j, l) * Y(i, k);
        hessian_(static_cast<Index>(a), static_cast<Index>(b)) += 2.0 * scale_b * half(i, j) * sum;
      }
      hessian_(m - 1, static_cast<Index>(b)) -= (k == l ? cross(k, k) : 2.0 * cross(k, l));
    }
  }

  // -ln det (P - 0.05 I) (sign -1) or -ln det (κI - P) (sign 1) with inverse W.
  void add_bound(const MatrixXd& W, double sign) {
    add_to_gradient(W, sign);
    for (std::size_t b = 0; b < rows_.size(); ++b) {
      for (std::size_t a = b; a < rows_.size(); ++a) {
        const Index i = rows_[a];
        const Index j = columns_[a];
        const Index k = rows_[b];
        const Index l = columns_[b];
        hessian_(static_cast<Index>(a), static_cast<Index>(b)) +=
            2.0 * half(k, l) * half(i, j) * (W(i, k) * W(j, l) + W(i, l) * W(j, k));
      }
    }
  }

  const std::vector<MatrixXd>& M_;
  Index size_;
  Index n_;
  std::vector<Index> rows_, columns_;
  VectorXd gradient_;
  MatrixXd hessian_;
};

}  // namespace

std::optional<MatrixXd> common_lyapunov(const std::vector<MatrixXd>& M, Index fixed,
                                        LyapunovSearch& search,
                                        const std::function<bool(const MatrixXd& T)>& good) {
  Barrier barrier(M, fixed);
  const Index n = M.front().rows() - fixed;
  MatrixXd P = MatrixXd::Identity(n, n);
  const auto last = [&] {
    MatrixXd L = barrier.widened(P);
    if (factor_in_place(L)) {
      search.last = MatrixXd(L.transpose());
      search.last.triangularView<Eigen::StrictlyLower>().setZero();
    }
  };
  const auto factor = [&]() -> std::optional<MatrixXd> {
    last();
    return good(search.last) ? std::optional(search.last) : std::nullopt;
  };
  double t = barrier.least(P);
  if (!std::isfinite(t)) {
    return std::nullopt;
  }
  if (t > 0.0) {
    if (auto T = factor()) {
      return T;
    }
  }
  t -= 0.1 * std::abs(t) + 1e-3;
  double weight = barrier.order() / (std::abs(t) + 1e-2);
  MatrixXd dP;
  double dt = 0.0;
  double decrement = 0.0;
  int vain = 0;
  while (search.steps < search.most_steps) {
    ++search.steps;
    if (!barrier.step(P, t, weight, dP, dt, decrement)) {
      return std::nullopt;
    }
    const double now = barrier.value(P, t, weight);
    double length = 1.0;
    while (length > 1e-6 && !(barrier.value(P + length * dP, t + length * dt, weight) <=
                              now - 0.1 * length * decrement)) {
      length *= 0.5;
    }
    if (!(length > 1e-6)) {
      return std::nullopt;
    }
    P += length * dP;
    t += length * dt;
    const bool centred = decrement < 0.5;
    if (t > 0.0) {
      if (auto T = factor()) {
        return T;
      }
      if (++vain >= search.most_vain) {
        return std::nullopt;
      }
    }
    if (centred) {
      // No t is larger by more than the gap.
      const double gap = barrier.order() / weight;
      if (t + gap < 0.0 || gap < 1e-7) {
        last();
        return std::nullopt;
      }
      weight *= 6.0;
    }
  }
  return std::nullopt;
}

std::optional<MatrixXd> lyapunov_factor(const MatrixXd& A) {
  const Index n = A.rows();
  const double radius = n == 0 ? 0.0 : eigenvalues_of(A).cwiseAbs().maxCoeff();
  if (!(radius < 1.0)) {
    return std::nullopt;
  }
  const double sigma = radius + 0.5 * (1.0 - radius);
  const VectorXd d = balance_of(A);
  MatrixXd power = (d.cwiseInverse().asDiagonal() * A * d.asDiagonal()) / sigma;
  MatrixXd P = MatrixXd::Identity(n, n);
  constexpr int doublings = 60;
  for (int k = 0; k < doublings; ++k) {
    const MatrixXd more = power.transpose().lazyProduct(P.lazyProduct(power).eval());
    P += more;
    if (!(more.cwiseAbs().maxCoeff() > 1e-12 * P.cwiseAbs().maxCoeff())) {
      break;
    }
    power = power.lazyProduct(power).eval();
  }
  if (!P.allFinite()) {
    return std::nullopt;
  }
  MatrixXd L = symmetrized(P) / P.trace() * static_cast<double>(n);
  if (!factor_in_place(L)) {
    return std::nullopt;
  }
  MatrixXd T = L.transpose();
  T.triangularView<Eigen::StrictlyLower>().setZero();
  return MatrixXd(T * d.cwiseInverse().asDiagonal());
}

}  // namespace flyball::detail
