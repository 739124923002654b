#pragma once

#include <cmath>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/core/signal.hpp>

namespace flyball {

/// Recursive least squares with exponential forgetting, for coefficients that are estimated while
/// the robot runs.
///
/// What is known is kept as a triangular factor R of the information matrix, RᵀR = P⁻¹, and z with
/// R β̂ = z, both turned by Givens rotations: P is positive definite by construction. What is
/// forgotten is replaced by as much of the initial information, around the present estimate: where
/// nothing excites the coefficients, P returns to P0 instead of growing without bound, and the
/// estimate stays where it is.
///
/// Run-time object: noexcept, bounded, finite whatever comes; for a size known at compile time
/// without allocation.
/// Source: Lawson and Hanson, "Solving Least Squares Problems" (1974), chapter 27; Gunnarsson, IEEE
/// Trans. Signal Processing 44 (1996) (regularised forgetting).
template <int Coefficients = Eigen::Dynamic>
class RecursiveLeastSquares {
 public:
  using Vector = Eigen::Matrix<double, Coefficients, 1>;
  using Matrix = Eigen::Matrix<double, Coefficients, Coefficients>;

  /// @param initial  β̂ before the first sample. @param deviation  How far each may be off: its
  /// standard deviation beside that of the noise (1 if the noise is not known beforehand); from
  /// 1e-50 to 1e50. @param forgetting  λ in (0, 1]: what a sample counts after n others is λⁿ.
  /// @errors ArgumentError for shapes, entries and ranges.
  [[nodiscard]] static Expected<RecursiveLeastSquares> create(const Vector& initial,
                                                              const Vector& deviation,
                                                              double forgetting = 1.0) {
    constexpr std::string_view where = "RecursiveLeastSquares";
    auto checked = Checks(where)
                       .finite(initial, "initial")
                       .shape(deviation, initial.size(), 1, "deviation", "coefficients")
                       .also([&]() -> Expected<void> {
                         for (Eigen::Index i = 0; i < deviation.size(); ++i) {
                           auto within =
                               check_within(deviation(i), 1e-50, 1e50, where, "deviation");
                           if (!within) {
                             return within;
                           }
                           within = check_within(initial(i), -1e50, 1e50, where, "initial");
                           if (!within) {
                             return within;
                           }
                         }
                         return {};
                       })
                       .within(forgetting, 1e-3, 1.0, "forgetting");
    return checked.map([&] { return RecursiveLeastSquares(initial, deviation, forgetting); });
  }

  /// One sample of y = xᵀβ + noise.
  /// @return  Whether it was used: what is not a signal leaves everything as it was.
  /// Cost: O(p²); with forgetting O(p³).
  bool update(const Vector& x, double y) noexcept {
    // Products of squares stay within doubles.
    constexpr double largest = 1e70;
    bool usable = std::abs(y) <= largest;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      usable = usable & (std::abs(x(i)) <= largest);
    }
    if (!usable) {
      return false;
    }
    error_ = y - x.dot(beta_);
    const Vector before = beta_;
    if (forgetting_ < 1.0) {
      const double root = std::sqrt(forgetting_);
      R_ *= root;
      z_ *= root;
      squares_ *= forgetting_;
      samples_ *= forgetting_;
      const double rest = std::sqrt(1.0 - forgetting_);
      for (Eigen::Index i = 0; i < x.size(); ++i) {
        Vector prior = Vector::Zero(x.size());
        prior(i) = rest / deviation_(i);
        rotate_in(prior, prior(i) * before(i));
      }
    }
    const double left = rotate_in(x, y);
    squares_ += left * left;
    samples_ += 1.0;
    Vector estimate = z_;
    R_.template triangularView<Eigen::Upper>().solveInPlace(estimate);
    if (is_signal(estimate)) {
      beta_ = estimate;
    }
    return true;
  }

  [[nodiscard]] const Vector& coefficients() const noexcept { return beta_; }
  /// y - xᵀβ̂ of the last sample, before it was used.
  [[nodiscard]] double prediction_error() const noexcept { return error_; }
  /// Σ of the weights of the samples: their number, with forgetting at most 1/(1 - λ).
  [[nodiscard]] double samples() const noexcept { return samples_; }
  /// Of the noise, from what the samples left; zero until there are more of them than coefficients.
  [[nodiscard]] double variance() const noexcept {
    const double freedom = samples_ - static_cast<double>(beta_.size());
    return freedom > 0.0 ? squares_ / freedom : 0.0;
  }
  /// P, in units of the noise's variance; P0 is the most that it can be. Cost: O(p³).
  [[nodiscard]] Matrix covariance() const noexcept {
    Matrix inverse = Matrix::Identity(beta_.size(), beta_.size());
    R_.template triangularView<Eigen::Upper>().solveInPlace(inverse);
    return inverse * inverse.transpose();
  }
  /// R, upper triangular: RᵀR = P⁻¹.
  [[nodiscard]] const Matrix& information_factor() const noexcept { return R_; }

 private:
  RecursiveLeastSquares(const Vector& initial, const Vector& deviation, double forgetting)
      : R_(Matrix::Zero(initial.size(), initial.size())),
        z_(initial.cwiseQuotient(deviation)),
        beta_(initial),
        deviation_(deviation),
        forgetting_(forgetting) {
    R_.diagonal() = deviation.cwiseInverse();
  }

  /// Rotates the row [x y] into [R z]. @return  What is left of y.
  double rotate_in(Vector x, double y) noexcept {
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      if (x(k) == 0.0) {
        continue;
      }
      const double length = std::hypot(R_(k, k), x(k));
      const double c = R_(k, k) / length;
      const double s = x(k) / length;
      R_(k, k) = length;
      for (Eigen::Index j = k + 1; j < x.size(); ++j) {
        const double above = R_(k, j);
        R_(k, j) = c * above + s * x(j);
        x(j) = c * x(j) - s * above;
      }
      const double above = z_(k);
      z_(k) = c * above + s * y;
      y = c * y - s * above;
    }
    return y;
  }

  Matrix R_;
  Vector z_;
  Vector beta_;
  Vector deviation_;
  double forgetting_;
  double error_ = 0.0;
  double squares_ = 0.0;
  double samples_ = 0.0;
};

}  // namespace flyball
