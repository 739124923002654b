#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

/// The covariances of a linear system's noises from the innovations of any stable filter of it,
/// without a guess of them and in one convex problem: what maximum likelihood (noise_fit.hpp) finds
/// from a start that is near.
namespace flyball {

/// Why innovations do not tell the noises.
enum class AutocovarianceError {
  unstable,        ///< A - L C does not decay: its innovations have no autocovariance.
  too_few,         ///< Fewer innovations than their autocovariances need.
  not_determined,  ///< Other noises have the same autocovariances.
};
[[nodiscard]] ErrorInfo error_info(AutocovarianceError code);

/// Ĉ_j = Σ_{k ≥ j} ν_k ν_{k-j}ᵀ/(N - j) for j = 0 … lags.
/// @param innovations  p x N, N > lags. Allocates.
[[nodiscard]] std::vector<Eigen::MatrixXd> autocovariances(const MatrixRef& innovations,
                                                           Eigen::Index lags);

/// y_k - C x̂_k of the predictor x̂⁺ = A x̂ + added + L (y - C x̂) that starts at x̂ = 0.
/// @param A, C, L  n x n, p x n, n x p. @param y  p x N, without D u.
/// @param added  n x N, what the inputs add in each step; empty: nothing.
/// @errors ArgumentError for shapes and entries. Cost: O(N n²); allocates.
[[nodiscard]] Expected<Eigen::MatrixXd> innovations_of(const MatrixRef& A, const MatrixRef& C,
                                                       const MatrixRef& L, const MatrixRef& y,
                                                       const MatrixRef& added);

/// How noises are found from autocovariances.
struct AutocovarianceOptions {
  /// The last of the autocovariances; 0: as long as A - L C remembers (to 2 %), 5 to 100.
  Eigen::Index lags = 0;
  bool diagonal_process = true;      ///< The entries of w are independent,
  bool diagonal_measurement = true;  ///< and those of v.
  int iterations = 50'000;           ///< Of the projected gradient, at most.
};

/// Noises that explain autocovariances.
struct AutocovarianceFit {
  Eigen::MatrixXd Q;      ///< g x g, of w, positive semidefinite.
  Eigen::MatrixXd R;      ///< p x p, of v, positive semidefinite.
  Eigen::MatrixXd Q_std;  ///< g x g, standard errors of the entries; 0 of those that are fixed.
  Eigen::MatrixXd R_std;  ///< p x p
  Eigen::Index lags = 0;
  /// √ of the mean squared misfit, in standard errors of an autocovariance: about 1 where model and
  /// noises are right and the innovations nearly white.
  double misfit = 0.0;
  double condition = 0.0;    ///< Of the least-squares problem, its columns of one length.
  bool at_boundary = false;  ///< Without the constraint Q or R would not be semidefinite.
  bool converged = false;
  int iterations = 0;       ///< 0 where the constraint does not bind.
  double optimality = 0.0;  ///< By how much a projected step still moves, relative.
};

/// Autocovariance least squares: with ε = x - x̂ of x⁺ = A x + G w, y = C x + v and Ā = A - L C,
///
///     P = Ā P Āᵀ + G Q Gᵀ + L R Lᵀ,   C_0 = C P Cᵀ + R,   C_j = C Āʲ P Cᵀ - C Āʲ⁻¹ L R,
///
/// which are linear in Q and R: the least squares of Ĉ_j - C_j, the outputs scaled so that Ĉ_0 = I
/// (in which all entries of white innovations' autocovariances err alike), over Q ⪰ 0 and R ⪰ 0.
///
/// @param A, C  n x n, p x n. @param G  n x g. @param L  n x p, of the predictor that gave them.
/// @param covariances  Ĉ_0 … Ĉ_lags, p x p each. @param count  How many innovations they are from.
/// @errors ArgumentError for shapes and entries, not_positive for a Ĉ_0 that is no covariance or
///         singular; AutocovarianceError::unstable, too_few, not_determined with the direction.
/// Standard errors are those of the unconstrained problem with white innovations: right where the
/// filter is nearly optimal.
/// Cost: a Lyapunov equation for each unknown entry; allocates.
/// Source: Odelson, Rajamani, Rawlings, "A new autocovariance least-squares method for estimating
/// noise covariances", Automatica 42 (2006), equations 10 to 15; the projected gradient by Beck,
/// Teboulle (2009) with O'Donoghue and Candès' restarts (2015).
[[nodiscard]] Expected<AutocovarianceFit> fit_autocovariances(
    const MatrixRef& A, const MatrixRef& C, const MatrixRef& G, const MatrixRef& L,
    const std::vector<Eigen::MatrixXd>& covariances, Eigen::Index count,
    const AutocovarianceOptions& options = {});

/// The same from a record: the innovations of a first filter (of `L`; where it is empty the Kalman
/// filter's of Q = R = I), their noises, the Kalman filter of these, and again until the noises
/// stay, five times at most. The first samples, in which a filter forgets where it started, do not
/// count.
/// @param y, added  As `innovations_of`.
/// @errors As `fit_autocovariances` and `innovations_of`; those of `kalman_gain` for the first.
[[nodiscard]] Expected<AutocovarianceFit> fit_noise_by_autocovariances(
    const MatrixRef& A, const MatrixRef& C, const MatrixRef& G, const MatrixRef& y,
    const MatrixRef& added, const MatrixRef& L, const AutocovarianceOptions& options = {});

}  // namespace flyball
