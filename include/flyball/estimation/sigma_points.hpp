#pragma once

#include <cmath>
#include <limits>

#include <Eigen/Core>

/// The points at which unscented filters ask a function, and what its values there say of it: how
/// far its mean is from the value at the centre, m, and its covariance as
///
///     cov = B Bᵀ + C Cᵀ + c m mᵀ
///
/// where B is its slope along the columns of S (P = S Sᵀ; the cross covariance is S Bᵀ), and the
/// rest is what a straight line leaves. The usual sum over weights, of which some are negative, is
/// the same number; here only c can be negative, and is not for usual settings, so that there is
/// nothing to subtract.
namespace flyball {

/// The scaled points, 2n on the axes of S and the centre.
///
/// With γ² = α² (n + κ) and s_i the sum of the two values on an axis less twice the centre's:
/// B_i = (f(x + γ S_i) - f(x - γ S_i))/2γ, C_i = s_i/2γ, m = Σ s_i/2γ², c = β - α².
/// Source: van der Merwe, "Sigma-point Kalman filters for probabilistic inference in dynamic
/// state-space models" (2004), algorithm 3.1, whose weights this is in another order.
struct ScaledPoints {
  double alpha = 0.5;                                       ///< How far out, in (0, ∞).
  double beta = 2.0;                                        ///< 2 for Gaussian errors; α² or more.
  double kappa = std::numeric_limits<double>::quiet_NaN();  ///< More than -n; NaN: 3 - n.

  /// The number of points beside the centre.
  [[nodiscard]] static constexpr int outer(int n) noexcept { return 2 * n; }
  /// The columns of C.
  [[nodiscard]] static constexpr int rest(int n) noexcept { return n; }

  /// The place of a point, from the centre. @param S  n x n. @param i  Below `outer(n)`.
  template <class Matrix>
  [[nodiscard]] auto place(const Matrix& S, Eigen::Index i) const noexcept {
    const Eigen::Index n = S.rows();
    const double gamma = spread(n);
    Eigen::Matrix<double, Matrix::RowsAtCompileTime, 1> delta =
        S.col(i < n ? i : i - n) * (i < n ? gamma : -gamma);
    return delta;
  }
  /// @param E  d x outer, the values less that of the centre. @param m  d x 1.
  /// @param Z  d x (n + rest), B and C beside each other. @return  c.
  template <class Values, class Mean, class Columns>
  double regress(const Values& E, Mean& m, Columns& Z) const noexcept {
    const Eigen::Index n = E.cols() / 2;
    const double gamma = spread(n);
    const double half = 0.5 / gamma;
    m.setZero(E.rows());
    for (Eigen::Index i = 0; i < n; ++i) {
      Z.col(i) = (E.col(i) - E.col(n + i)) * half;
      Z.col(n + i) = (E.col(i) + E.col(n + i)) * half;
      m += Z.col(n + i);
    }
    m *= 1.0 / gamma;
    return beta - alpha * alpha;
  }

 private:
  [[nodiscard]] double spread(Eigen::Index n) const noexcept {
    const double k = kappa == kappa ? kappa : 3.0 - static_cast<double>(n);
    return alpha * std::sqrt(static_cast<double>(n) + k);
  }
};

/// The spherical simplex, n + 1 points at one distance from the centre, and the centre: about half
/// as many, for a little less knowledge of what is not straight.
///
/// With W = (1 - w0)/α² shared by the outer points, at S h_i √((n + 1)/W), h_i the columns of
/// Helmert's matrix: C has no columns, and c = α² w0/(1 - w0) + β.
/// Source: Julier, "The spherical simplex unscented transformation", ACC (2003).
struct SimplexPoints {
  double alpha = 1.0;          ///< How far out, in (0, ∞).
  double beta = 2.0;           ///< 2 for Gaussian errors; not negative.
  double centre_weight = 0.0;  ///< w0, in [0, 1).

  [[nodiscard]] static constexpr int outer(int n) noexcept { return n + 1; }
  [[nodiscard]] static constexpr int rest(int) noexcept { return 0; }

  /// As ScaledPoints::place.
  template <class Matrix>
  [[nodiscard]] auto place(const Matrix& S, Eigen::Index i) const noexcept {
    const Eigen::Index n = S.rows();
    const double radius = 1.0 / std::sqrt(weight(n));
    Eigen::Matrix<double, Matrix::RowsAtCompileTime, 1> delta = S.col(0) * 0.0;
    // Row k of Helmert's matrix, k = 1 … n: k times 1, then -k, over √(k (k + 1)).
    for (Eigen::Index k = i > 0 ? i : 1; k <= n; ++k) {
      const double entry = k == i ? -static_cast<double>(k) : 1.0;
      delta += S.col(k - 1) * (entry * radius / length(k));
    }
    return delta;
  }
  /// As ScaledPoints::regress.
  template <class Values, class Mean, class Columns>
  double regress(const Values& E, Mean& m, Columns& Z) const noexcept {
    const Eigen::Index n = E.cols() - 1;
    const double w = weight(n);
    const double root = std::sqrt(w);
    m = E.col(0);
    for (Eigen::Index k = 1; k <= n; ++k) {
      Z.col(k - 1) = (m - static_cast<double>(k) * E.col(k)) * (root / length(k));
      m += E.col(k);
    }
    m *= w;
    return alpha * alpha * centre_weight / (1.0 - centre_weight) + beta;
  }

 private:
  [[nodiscard]] double weight(Eigen::Index n) const noexcept {
    return (1.0 - centre_weight) / (alpha * alpha * static_cast<double>(n + 1));
  }
  [[nodiscard]] static double length(Eigen::Index k) noexcept {
    return std::sqrt(static_cast<double>(k * (k + 1)));
  }
};

}  // namespace flyball
