#pragma once

#include <cstdint>
#include <span>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/random.hpp>

namespace flyball {

/// Why a Gaussian vector has no answer.
enum class GaussianError {
  no_density,     ///< The covariance is singular: along some direction nothing is random.
  contradiction,  ///< A value differs from what is certain of it.
};
[[nodiscard]] ErrorInfo error_info(GaussianError code);

struct GaussianPosterior;

/// A Gaussian random vector x ~ N(mean, covariance); some directions of it may be certain (a
/// covariance that is singular, or zero).
///
/// p(x) = exp(-(x - x̄)ᵀΣ⁻¹(x - x̄)/2)/√|2πΣ|. For design time: dynamic sizes, allocates. What is
/// computed from covariances is computed from their factors, so that none is inverted and what
/// comes out is symmetric and positive semidefinite.
/// Source: book, sections 9.3.13 to 9.3.16 and 9.5; Rasmussen and Williams, "Gaussian Processes for
/// Machine Learning" (2006), appendix A.2.
class GaussianVector {
 public:
  /// @param mean  n. @param covariance  n x n.
  /// @errors ArgumentError for shapes, entries and asymmetry; empty; not_positive with the
  ///         direction along which the variance is negative.
  [[nodiscard]] static Expected<GaussianVector> create(const Eigen::VectorXd& mean,
                                                       const MatrixRef& covariance);

  [[nodiscard]] const Eigen::VectorXd& mean() const noexcept { return mean_; }
  [[nodiscard]] const Eigen::MatrixXd& covariance() const noexcept { return covariance_; }
  /// F, n x k, with covariance = F Fᵀ.
  [[nodiscard]] const Eigen::MatrixXd& factor() const noexcept { return factor_; }
  /// In how many directions it is random.
  [[nodiscard]] Eigen::Index rank() const noexcept { return rank_; }

  /// (x - x̄)ᵀΣ⁺(x - x̄), the squared Mahalanobis distance; of a random x it is χ² with `rank`
  /// degrees of freedom, so that `chi_squared_quantile` gives its gate.
  /// @errors ArgumentError for the shape and entries of x, and out_of_range where x is beyond the
  ///         largest double from the mean; GaussianError::contradiction for an x
  ///         that differs from the mean along a direction that is certain, with that entry.
  [[nodiscard]] Expected<double> squared_distance(const Eigen::VectorXd& x) const;

  /// log p(x), which does not underflow.
  /// @errors As there, and GaussianError::no_density with the direction that is certain.
  [[nodiscard]] Expected<double> log_density(const Eigen::VectorXd& x) const;

  /// A sample, n; the same for the same state of `random`.
  [[nodiscard]] Eigen::VectorXd sample(Random& random) const;
  /// n x count, one column a sample. @errors ArgumentError::out_of_range for a negative count.
  [[nodiscard]] Expected<Eigen::MatrixXd> samples(Eigen::Index count, std::uint64_t seed) const;

  /// z = A x + b: N(A x̄ + b, A Σ Aᵀ). @param A  k x n. @param b  k; empty for zero.
  /// @errors ArgumentError for shapes and entries. Source: book, sections 9.3.15 and 9.4.
  [[nodiscard]] Expected<GaussianVector> mapped(const MatrixRef& A,
                                                const Eigen::VectorXd& b = {}) const;

  /// x + y of an independent y. @errors ArgumentError::wrong_shape. Source: book, section 9.3.15.
  [[nodiscard]] Expected<GaussianVector> plus(const GaussianVector& y) const;

  /// Some of its entries, whatever the others are.
  /// @param entries  Indices below n, each once at most. @errors ArgumentError::out_of_range,
  /// empty. Source: book, section 9.3.8.
  [[nodiscard]] Expected<GaussianVector> marginal(std::span<const Eigen::Index> entries) const;

  /// What is left to know when some entries are known, as a vector of all entries:
  /// x̄_a + Σ_ab Σ_bb⁻¹(b - b̄) with Σ_aa - Σ_ab Σ_bb⁻¹ Σ_ba, and b itself without variance.
  /// @param entries  Indices b. @param values  As many.
  /// @errors As `marginal`; ArgumentError for shapes and entries of the values;
  ///         GaussianError::contradiction with the entry for values that differ from what is
  ///         certain. Source: book, sections 9.3.9 to 9.3.12.
  [[nodiscard]] Expected<GaussianPosterior> conditional(std::span<const Eigen::Index> entries,
                                                        const Eigen::VectorXd& values) const;

  /// Bayes's rule with the measurement y = C x + v, v ~ N(0, R) independent of x:
  /// x̄ + K(y - C x̄), K = ΣCᵀ(CΣCᵀ + R)⁻¹. @param C  p x n. @param R  p x p, may be singular.
  /// @errors ArgumentError for shapes and entries, not_positive for R, and out_of_range where y is
  ///         beyond the largest double from what was expected;
  ///         GaussianError::contradiction with the entry of y.
  /// Source: book, sections 9.3.10 and 9.5; equations 9.11 to 9.13 for one entry.
  [[nodiscard]] Expected<GaussianPosterior> measured(const MatrixRef& C, const MatrixRef& R,
                                                     const Eigen::VectorXd& y) const;

 private:
  GaussianVector(Eigen::VectorXd mean, Eigen::MatrixXd covariance, Eigen::MatrixXd factor);
  /// From a factor alone.
  GaussianVector(Eigen::VectorXd mean, const Eigen::MatrixXd& factor);
  [[nodiscard]] Expected<GaussianPosterior> given(const MatrixRef& C, const Eigen::MatrixXd& noise,
                                                  const Eigen::VectorXd& y, std::string_view where,
                                                  std::string_view name) const;

  Eigen::VectorXd mean_;
  Eigen::MatrixXd covariance_;
  Eigen::MatrixXd factor_;
  Eigen::Index rank_ = 0;
};

/// What a Gaussian vector is after it was measured.
struct GaussianPosterior {
  GaussianVector estimate;
  double squared_distance = 0.0;  ///< Of the measurement from what was expected; χ² with `rank`.
  Eigen::Index rank = 0;          ///< How many entries of it were random.
  /// log p(y), the evidence for the model: of entries that others determine nothing.
  double log_evidence = 0.0;
};

/// Two independent statements on one vector made one: of the density p(x) ∝ p_a(x) p_b(x),
/// x̂ = x̄_a + Σ_a(Σ_a + Σ_b)⁻¹(x̄_b - x̄_a), Σ = Σ_a - Σ_a(Σ_a + Σ_b)⁻¹Σ_a, which for one entry is
/// μ = (σ₀² z + σ² x₀)/(σ₀² + σ²) and σ²σ₀²/(σ₀² + σ²) (9.11, 9.12). Its log_evidence is
/// log ∫ p_a p_b dx.
/// @errors ArgumentError::wrong_shape; GaussianError::contradiction where both are certain of
///         different values.
/// Source: book, section 9.5.
[[nodiscard]] Expected<GaussianPosterior> fuse(const GaussianVector& a, const GaussianVector& b);

}  // namespace flyball
