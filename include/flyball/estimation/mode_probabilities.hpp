#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

namespace flyball {

/// Which of several models is true, as far as measurements tell: the probability of each.
///
/// Between measurements the mode may change: μ⁻_j = Σ_i Π_ij μ_i. A measurement of which model j
/// says that its log density is ℓ_j makes it μ_j = μ⁻_j e^{ℓ_j}/Σ μ⁻_i e^{ℓ_i} (Bayes's rule), the
/// largest ℓ taken off before the exponential so that none overflows and not all underflow.
///
/// Run-time object: noexcept, bounded, allocation-free, probabilities that sum up to one whatever
/// comes. For filters of any kind; `MultipleModelFilter` has it for linear ones.
/// Source: book, section 9.10; Bar-Shalom, Li, Kirubarajan, "Estimation with Applications to
/// Tracking and Navigation" (2001), sections 11.6.2 and 11.6.6.
template <int Models>
class ModeProbabilities {
  static_assert(Models >= 1, "there is at least one model");

 public:
  using Vector = Eigen::Matrix<double, Models, 1>;
  using Matrix = Eigen::Matrix<double, Models, Models>;

  /// @param prior  Not negative; it is scaled to a sum of one.
  /// @param transition  Π_ij, the probability that mode i is followed by mode j, each row of sum
  /// one
  ///        (1e-9); the identity where the mode never changes.
  /// @param floor  What no probability sinks below by measurements, so that a model that was ruled
  ///        out can come back; 0 to 1/Models.
  /// @errors ArgumentError::not_finite, out_of_range, each naming the entry.
  [[nodiscard]] static Expected<ModeProbabilities> create(const Vector& prior,
                                                          const Matrix& transition,
                                                          double floor = 0.0);

  /// Each is as likely as the others, and stays what it is.
  ModeProbabilities()
      : probabilities_(Vector::Constant(1.0 / Models)), transition_(Matrix::Identity()) {}

  [[nodiscard]] const Vector& probabilities() const noexcept { return probabilities_; }
  [[nodiscard]] const Matrix& transition() const noexcept { return transition_; }
  /// The model whose probability is the largest, the first of equal ones.
  [[nodiscard]] int most_likely() const noexcept {
    Eigen::Index place = 0;
    probabilities_.maxCoeff(&place);
    return static_cast<int>(place);
  }

  /// μ <- Πᵀμ.
  /// @return  The mixing probabilities: entry (i, j) is P(mode i before | mode j now); a column of
  ///          the identity for a mode that cannot be.
  Matrix predict() noexcept;

  /// Bayes's rule. @param log_likelihoods  log p(y | model) of each; one that is not a number, or
  /// -infinity, says that its model is impossible.
  /// @return  Whether they were used: if all models are impossible, or one is certain beyond a
  ///          double (+infinity), nothing changes.
  bool update(const Vector& log_likelihoods) noexcept;

 private:
  Vector probabilities_;
  Matrix transition_;
  double floor_ = 0.0;
};

namespace detail {

/// What ModeProbabilities::create asks of its arguments.
[[nodiscard]] Expected<void> check_modes(const MatrixRef& prior, const MatrixRef& transition,
                                         double floor);

}  // namespace detail

template <int Models>
Expected<ModeProbabilities<Models>> ModeProbabilities<Models>::create(const Vector& prior,
                                                                      const Matrix& transition,
                                                                      double floor) {
  if (auto checked = detail::check_modes(prior, transition, floor); !checked) {
    return tl::unexpected(checked.error());
  }
  ModeProbabilities modes;
  modes.probabilities_ = prior / prior.sum();
  modes.transition_ = transition;
  modes.floor_ = floor;
  return modes;
}

template <int Models>
auto ModeProbabilities<Models>::predict() noexcept -> Matrix {
  Matrix mixing = probabilities_.asDiagonal() * transition_;
  Vector predicted = mixing.colwise().sum().transpose();
  for (int j = 0; j < Models; ++j) {
    if (predicted(j) > 0.0) {
      mixing.col(j) /= predicted(j);
    } else {
      mixing.col(j) = Vector::Unit(j);
    }
  }
  probabilities_ = predicted / predicted.sum();
  return mixing;
}

template <int Models>
bool ModeProbabilities<Models>::update(const Vector& log_likelihoods) noexcept {
  constexpr double impossible = -std::numeric_limits<double>::infinity();
  Vector exponents;
  double largest = impossible;
  for (int j = 0; j < Models; ++j) {
    const double l = log_likelihoods(j);
    exponents(j) = l == l && probabilities_(j) > 0.0 ? l : impossible;
    largest = exponents(j) > largest ? exponents(j) : largest;
  }
  if (!std::isfinite(largest)) {
    return false;
  }
  Vector updated;
  for (int j = 0; j < Models; ++j) {
    updated(j) = probabilities_(j) * std::exp(exponents(j) - largest);
  }
  updated /= updated.sum();
  if (floor_ > 0.0) {
    updated = updated.cwiseMax(floor_);
    updated /= updated.sum();
  }
  probabilities_ = updated;
  return true;
}

/// The Gaussian vector with the mean and covariance of a mixture Σ μ_i N(x_i, P_i).
/// @param weights  Of sum one. @param x  n x Models. @param P  Models covariances.
/// @param mean, covariance  Receive it. Allocation-free for sizes known at compile time.
template <int States, std::size_t Models, class Weights>
void match_moments(const Weights& weights,
                   const std::array<Eigen::Matrix<double, States, 1>, Models>& x,
                   const std::array<Eigen::Matrix<double, States, States>, Models>& P,
                   Eigen::Matrix<double, States, 1>& mean,
                   Eigen::Matrix<double, States, States>& covariance) noexcept {
  mean = weights(0) * x[0];
  for (std::size_t i = 1; i < Models; ++i) {
    mean += weights(static_cast<Eigen::Index>(i)) * x[i];
  }
  covariance = 0.0 * P[0];
  Eigen::Matrix<double, States, 1> difference = mean;
  for (std::size_t i = 0; i < Models; ++i) {
    const double weight = weights(static_cast<Eigen::Index>(i));
    difference = x[i] - mean;
    covariance += weight * P[i];
    covariance.noalias() += weight * difference * difference.transpose();
  }
}

}  // namespace flyball
