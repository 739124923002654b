#pragma once

#include <flyball/estimation/covariance.hpp>
#include <flyball/estimation/forms/cholesky.hpp>

namespace flyball {

/// The covariance R of a measurement's noise, and what makes its entries independent, R = L D Lᵀ
/// with L unit lower triangular: of L⁻¹ y, which a filter takes entry by entry.
///
/// A run-time object as well: a sensor whose noise is another one each time makes a new one.
template <int M>
class MeasurementNoise {
 public:
  using Matrix = Eigen::Matrix<double, M, M>;
  using Vector = Eigen::Matrix<double, M, 1>;

  /// @errors  Those of R's maker; ArgumentError::wrong_shape (for another size than M), empty,
  ///          not_finite, not_symmetric, and not_positive where R is no covariance.
  [[nodiscard]] static Expected<MeasurementNoise> create(const Covariance& R) {
    const auto& given = R.get();
    if (!given) {
      return tl::unexpected(given.error());
    }
    const Eigen::Index m = M == Eigen::Dynamic ? given->rows() : M;
    const auto checks =
        Checks("MeasurementNoise")
            .square(*given, "R")
            .shape(*given, m, m, "R", "outputs x outputs")
            .also([&] { return check_covariance(*given, "MeasurementNoise", "R"); });
    return checks.map([&] { return MeasurementNoise(Matrix(*given)); });
  }
  /// From a covariance that the caller has made sure of; of another one `usable()` is false, and a
  /// filter answers `UpdateStatus::invalid_noise`.
  explicit MeasurementNoise(const Matrix& R) noexcept : R_(R) { factorize(); }
  /// Of independent entries. @param variances  m x 1, σ².
  [[nodiscard]] static MeasurementNoise independent(const Vector& variances) noexcept {
    return MeasurementNoise(Matrix(variances.asDiagonal()));
  }

  [[nodiscard]] const Matrix& R() const noexcept { return R_; }
  [[nodiscard]] const Matrix& L() const noexcept { return L_; }
  [[nodiscard]] const Vector& D() const noexcept { return D_; }
  /// R is diagonal.
  [[nodiscard]] bool is_diagonal() const noexcept { return diagonal_; }
  /// R is finite, symmetric and positive semidefinite.
  [[nodiscard]] bool usable() const noexcept { return usable_; }
  [[nodiscard]] Eigen::Index size() const noexcept { return D_.size(); }

  /// M <- L⁻¹ M. @param rows  m x any.
  template <class Rows>
  void make_independent(Rows& rows) const noexcept {
    for (Eigen::Index i = 1; i < L_.rows(); ++i) {
      for (Eigen::Index k = 0; k < i; ++k) {
        rows.row(i) -= L_(i, k) * rows.row(k);
      }
    }
  }

 private:
  void factorize() noexcept {
    const Eigen::Index m = R_.rows();
    constexpr double eps = std::numeric_limits<double>::epsilon();
    const double rounding = 1e3 * eps * static_cast<double>(m);
    usable_ = detail::is_variance(R_) && detail::is_symmetric(R_);
    diagonal_ = true;
    L_.setIdentity(m, m);
    D_.resize(m);
    for (Eigen::Index j = 0; j < m; ++j) {
      double pivot = R_(j, j);
      for (Eigen::Index k = 0; k < j; ++k) {
        pivot -= L_(j, k) * L_(j, k) * D_(k);
      }
      const bool empty = !(pivot > rounding * R_(j, j));
      usable_ = usable_ && pivot >= -rounding * std::abs(R_(j, j));
      D_(j) = empty ? 0.0 : pivot;
      for (Eigen::Index i = j + 1; i < m; ++i) {
        double rest = R_(i, j);
        diagonal_ = diagonal_ && rest == 0.0;
        for (Eigen::Index k = 0; k < j; ++k) {
          rest -= L_(i, k) * L_(j, k) * D_(k);
        }
        usable_ =
            usable_ && !(empty && rest * rest > rounding * std::abs(R_(i, i)) * std::abs(R_(j, j)));
        L_(i, j) = empty ? 0.0 : rest / pivot;
      }
    }
  }

  Matrix R_;
  Matrix L_;
  Vector D_;
  bool diagonal_ = true;
  bool usable_ = true;
};

}  // namespace flyball
