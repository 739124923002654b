#pragma once

#include <string_view>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

/// Gaussian vectors by factors of their covariances, P = F Fᵀ with any number of columns: no
/// covariance is subtracted from another, and none is inverted, so that certain directions (P
/// singular) are no exception.
namespace flyball::detail {

/// F, n x rank, of a covariance P = F Fᵀ. Each entry is judged in the units of its row and column:
/// what is below n 1e-13 of the variances, scaled to one, counts as zero.
/// @errors ArgumentError for shapes, entries and asymmetry; not_positive with the direction along
///         which the variance is negative.
[[nodiscard]] Expected<Eigen::MatrixXd> covariance_factor(const MatrixRef& P,
                                                          std::string_view where,
                                                          std::string_view name);

/// The same P = F Fᵀ with n columns at most, by an orthogonal transformation. @param F  n x k.
[[nodiscard]] Eigen::MatrixXd compressed(const Eigen::MatrixXd& F);

/// x = x̄ + F ξ and z = z̄ + M ξ + G η with independent ξ, η ~ N(0, I), and what a value of z says
/// of x: E[x | z] = x̄ + K(z - z̄), cov(x | z) = factor factorᵀ.
///
/// With the orthogonal decomposition of W = [M G]ᵀ (r + q) x p, K = (W⁺[F 0]ᵀ)ᵀ, and the factor is
/// [F 0] on the complement of W's range. Entries of z that the ones before them determine add
/// nothing.
struct Conditioning {
  Eigen::MatrixXd K;             ///< n x p.
  Eigen::MatrixXd factor;        ///< n x k.
  Eigen::Index rank = 0;         ///< Of z's covariance.
  double log_determinant = 0.0;  ///< Of the covariance of the `rank` entries that determine z.

  Eigen::VectorXd units;     ///< p: deviations of the entries of z.
  Eigen::VectorXi order;     ///< p: the entries as they were taken.
  Eigen::MatrixXd triangle;  ///< rank x p: z's scaled, ordered covariance is its square.

  /// eᵀ(cov z)⁺e of e = z - z̄.
  /// @param sizes  p: what e's entries are differences of; within 1e-9 of it an entry may differ
  ///               from what the others determine.
  /// @param contradicted  Receives the entry that contradicts those, or -1.
  [[nodiscard]] double squared_distance(const Eigen::VectorXd& e, const Eigen::VectorXd& sizes,
                                        Eigen::Index& contradicted) const;
};

/// @param F  n x r. @param M  p x r. @param G  p x q.
/// @param reference  p: sizes of the terms that M and G are sums of; what is below rounding of them
///                   counts as zero.
[[nodiscard]] Conditioning condition(const Eigen::MatrixXd& F, const Eigen::MatrixXd& M,
                                     const Eigen::MatrixXd& G, const Eigen::VectorXd& reference);

/// The same of a measurement z = C x + G η. @param C  p x n.
/// @param G  p x rank: of a covariance's factor, so that fewer columns than rows say that some
///           combination of the measurement has no noise. Along that one C factor is zero to
///           rounding of the factor, however much smaller than F it is: seen again, it adds
///           nothing.
[[nodiscard]] Conditioning measure(const Eigen::MatrixXd& F, const MatrixRef& C,
                                   const Eigen::MatrixXd& G);

}  // namespace flyball::detail
