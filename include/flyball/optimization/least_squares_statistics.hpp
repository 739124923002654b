#pragma once

#include <optional>

#include <flyball/optimization/least_squares.hpp>

/// How sure the parameters of a fit are.
namespace flyball::optimization {

/// What is known of the residuals.
struct CovarianceOptions {
  /// Whether the residuals are in units of their standard deviation; otherwise that is estimated,
  /// σ² = Σ r² / (residuals - rank).
  bool scale_is_known = false;
  /// 0: the residuals are independent, with one variance, and the loss is the square. 1: they are
  /// independent, whatever their variance (White). More: as many consecutive ones of a block depend
  /// on each other. A loss that is not the square needs 1 at least.
  Eigen::Index batch = 0;
};

/// Covariance of a minimum's parameters.
struct Covariance {
  /// Parameters that several blocks share; all of a problem of one block.
  std::vector<Eigen::Index> parameters{};
  Eigen::MatrixXd matrix{};  ///< Of those; zero where a bound holds a parameter.
  /// n x 1, of all; zero where a bound holds a parameter, infinite where it is not determined.
  Eigen::VectorXd standard_errors{};
  double sigma = 1.0;    ///< The residuals' standard deviation.
  double freedom = 0.0;  ///< Residuals - rank.
};

/// σ² (JᵀJ)⁻¹, or the sandwich (JᵀJ)⁻¹ (Σ s sᵀ) (JᵀJ)⁻¹ with the gradients s of batches.
/// @param result  A minimum of the problem. @errors As `solve_least_squares`, and ArgumentError::
///                out_of_range where there are not more residuals than the rank.
/// Cost: one Jacobian, linear in the blocks; allocates.
/// Source: Seber, Wild, "Nonlinear Regression" (1989), 2.1; White (1980); Huber (1967).
[[nodiscard]] Expected<Covariance> covariance_of(const LeastSquaresProblem& problem,
                                                 const LeastSquaresResult& result,
                                                 const CovarianceOptions& options = {});

/// Where a parameter lies.
struct ProfileInterval {
  double low = 0.0;
  double high = 0.0;
  /// Whether the end is a bound, or infinite: the residuals do not tell where it ends.
  bool low_is_open = false;
  bool high_is_open = false;
  /// A point of lower cost than the minimum that was given, if one was met: fit again from it.
  std::optional<Eigen::VectorXd> better{};
};

/// How a profile is walked.
struct ProfileOptions {
  double confidence = 0.95;
  CovarianceOptions covariance{};  ///< Of its sigma; with batches of more than 1 the cost's rise is
                                   ///< scaled by what they make of the variance.
  LeastSquaresOptions fit{};
};

/// The values of a parameter for which the least cost, over the other parameters, rises by no more
/// than σ² t²: exact for one parameter of any model that is linear in some coordinates, where a
/// standard error is only right for a linear one.
/// @param parameter  Its place. @errors As `solve_least_squares`; ArgumentError for the options.
/// Cost: some ten fits of one parameter less. Source: Bates, Watts, "Nonlinear Regression Analysis
/// and Its Applications" (1988), 6.1.
[[nodiscard]] Expected<ProfileInterval> profile_interval(const LeastSquaresProblem& problem,
                                                         const LeastSquaresResult& result,
                                                         Eigen::Index parameter,
                                                         const ProfileOptions& options = {});

/// How residuals are drawn again.
struct BootstrapOptions {
  int samples = 200;
  unsigned long long seed = 1;
  Eigen::Index batch = 1;  ///< Consecutive residuals of a block that are drawn together.
  LeastSquaresOptions fit{};
};

/// Fits of data that could have been.
struct Bootstrap {
  Eigen::MatrixXd x{};  ///< n x the samples whose fit converged.
  int failed = 0;

  /// n x 1, of each parameter: the value below which this share of the samples lies.
  [[nodiscard]] Eigen::VectorXd quantile(double share) const;
};

/// Fits again, from the minimum, to residuals r(x) - r(x̂) + e with e drawn from the centred
/// residuals of the minimum, block by block: measured values enter residuals with the factor one.
/// @errors As `solve_least_squares`; ArgumentError for the options.
/// Source: Efron (1979); moving blocks: Künsch (1989).
[[nodiscard]] Expected<Bootstrap> bootstrap(const LeastSquaresProblem& problem,
                                            const LeastSquaresResult& result,
                                            const BootstrapOptions& options = {});

}  // namespace flyball::optimization
