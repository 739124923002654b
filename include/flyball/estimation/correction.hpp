#pragma once

#include <cmath>
#include <numbers>

#include <flyball/estimation/measurement_noise.hpp>
#include <flyball/estimation/update_status.hpp>

namespace flyball {

class OutlierGuard;

/// How a measurement is taken.
struct CorrectionOptions {
  OutlierGuard* guard = nullptr;  ///< What becomes of one that does not fit; none: it is taken.
  /// How often at most a nonlinear measurement is linearised, each time at the estimate of before
  /// (the iterated filter, Gauss and Newton's); 1: once, at the prediction.
  int iterations = 1;
  bool missing_entries = false;  ///< An entry that is NaN is missing, and the others are taken.
};

/// What a measurement did to an estimate, and how well it fitted.
template <int M>
struct Correction {
  using Vector = Eigen::Matrix<double, M, 1>;
  using Matrix = Eigen::Matrix<double, M, M>;

  UpdateStatus status = UpdateStatus::not_finite;
  /// What it counted for: 1 fully, 0 not at all. An OutlierGuard takes a measurement that does not
  /// fit with R/weight.
  double weight = 0.0;
  /// The normalised innovation squared νᵀ S⁻¹ ν: χ² distributed with `entries` degrees of freedom
  /// where the filter's model is right. Of the measurement with R, before any weight.
  double nis = 0.0;
  Eigen::Index entries = 0;  ///< How many of the measurement's entries were there.
  Vector innovation{};       ///< ν = y - h(x_hat), m x 1; zero where an entry was missing.
  Matrix L{};                ///< m x m, unit lower triangular.
  Vector D{};  ///< m x 1: S = L D Lᵀ is the innovation's covariance. Of an InformationForm that
               ///< knew nothing there is infinite.

  [[nodiscard]] bool accepted() const noexcept { return status == UpdateStatus::updated; }
  /// S = C P Cᵀ + R, m x m.
  [[nodiscard]] Matrix S() const noexcept { return L * D.asDiagonal() * L.transpose(); }
  /// The innovation in independent entries of variance one, D^(-1/2) L⁻¹ ν: what tests of whiteness
  /// take.
  [[nodiscard]] Vector normalized() const noexcept {
    Vector z = innovation;
    for (Eigen::Index i = 0; i < z.size(); ++i) {
      for (Eigen::Index k = 0; k < i; ++k) {
        z(i) -= L(i, k) * z(k);
      }
    }
    return z.cwiseQuotient(D.cwiseSqrt());
  }
  /// log N(ν; 0, S) = -(νᵀ S⁻¹ ν + log det S + entries log 2π)/2. Entries of infinite variance
  /// count as missing.
  [[nodiscard]] double log_likelihood() const noexcept {
    double sum = nis + static_cast<double>(entries) * std::log(2.0 * std::numbers::pi);
    for (Eigen::Index i = 0; i < D.size(); ++i) {
      sum += std::isfinite(D(i)) ? std::log(D(i)) : -std::log(2.0 * std::numbers::pi);
    }
    return -0.5 * sum;
  }
};

/// The noise's covariance that the corrections of the recent past show:
/// R <- (1 - share) R + share (e eᵀ + H P⁺ Hᵀ) with the residual e = y - h(x_hat⁺) after the
/// correction; both follow from ν and S. A sum of covariances, so it stays one.
/// @param R      What was used. @param correction  What came of it.
/// @param share  In (0, 1], of the newest: about 1/(number of measurements to average over).
/// @return  R where the correction was not accepted.
/// Source: Akhlaghi, Zhou, Huang, "Adaptive adjustment of noise covariance in Kalman filter for
/// dynamic state estimation", IEEE PES General Meeting (2017), equation (12).
template <int M>
[[nodiscard]] MeasurementNoise<M> adapted(const MeasurementNoise<M>& R,
                                          const Correction<M>& correction, double share) noexcept {
  using Matrix = Eigen::Matrix<double, M, M>;
  if (!correction.accepted() || !(share > 0.0 && share <= 1.0)) {
    return R;
  }
  // Z = L⁻¹ [R, ν]; R S⁻¹ R = Zᵀ D⁻¹ Z, and e = R S⁻¹ ν.
  const Eigen::Index m = R.size();
  Matrix Z = R.R();
  Eigen::Matrix<double, M, 1> z = correction.innovation;
  for (Eigen::Index i = 1; i < m; ++i) {
    for (Eigen::Index k = 0; k < i; ++k) {
      Z.row(i) -= correction.L(i, k) * Z.row(k);
      z(i) -= correction.L(i, k) * z(k);
    }
  }
  const Eigen::Matrix<double, M, 1> inverse = correction.D.cwiseInverse();
  const Eigen::Matrix<double, M, 1> e = Z.transpose().lazyProduct(inverse.cwiseProduct(z));
  const Matrix left = Z.transpose().lazyProduct(inverse.asDiagonal() * Z);
  const Matrix shown = e.lazyProduct(e.transpose()) + R.R() - left;
  const Matrix updated = (1.0 - share) * R.R() + share * shown;
  const MeasurementNoise<M> next(Matrix(0.5 * (updated + updated.transpose())));
  return next.usable() ? next : R;
}

}  // namespace flyball
