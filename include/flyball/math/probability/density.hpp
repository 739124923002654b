#pragma once

#include <limits>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/function_ref.hpp>
#include <flyball/math/probability/moments.hpp>

/// Expectations of random variables: of densities by quadrature, and of data (sections 9.3.1 to
/// 9.3.14).
namespace flyball {

/// A density p(x) >= 0 of one variable, in 1/(unit of x); of two variables, p(x, y).
using Density = FunctionRef<double(double)>;
using JointDensity = FunctionRef<double(double, double)>;

/// Where a density is not zero; ends may be infinite. Ends within some standard deviations of its
/// peak are faster, and needed for a peak far from zero.
struct Support {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

/// What two random variables are like together.
struct JointMoments {
  Eigen::Vector2d mean;        ///< E[x], E[y].
  Eigen::Matrix2d covariance;  ///< var x, cov(x, y); cov(x, y), var y.
  double correlation = 0.0;    ///< cov(x, y)/√(var x var y); zero where one of them is certain.
};

/// ∫ p(x) dx from `low` to `high`: the probability of the interval.
/// @errors As `quadrature`; ArgumentError::out_of_range where p is negative, with the place.
[[nodiscard]] Expected<double> probability(Density p, double low, double high);

/// E[f(x)] = ∫ f(x) p(x) dx.
/// @errors As `probability`; ArgumentError::out_of_range if ∫ p dx is not one to 1e-6.
/// Cost: two quadratures. Source: book, section 9.3.2.
[[nodiscard]] Expected<double> expectation(FunctionRef<double(double)> f, Density p,
                                           Support support = {});

/// E[x] and var x = E[(x - E[x])²]. @errors As `expectation`. Source: book, 9.3.2 and 9.3.3.
[[nodiscard]] Expected<Moments> moments(Density p, Support support = {});

/// The marginal density p(x) = ∫ p(x, y) dy at one x.
/// @errors As `probability`. Source: book, section 9.3.8.
[[nodiscard]] Expected<double> marginal(JointDensity p, double x, Support of_y = {});

/// E[x | y] and var(x | y): the moments of p(x | y) = p(x, y)/∫ p(x, y) dx.
/// @errors As `probability`; ArgumentError::out_of_range for a y that does not happen.
/// Source: book, sections 9.3.9 to 9.3.12.
[[nodiscard]] Expected<Moments> conditional_moments(JointDensity p, double y, Support of_x = {});

/// E[f(x, y)] = ∬ f(x, y) p(x, y) dx dy.
/// @errors As `expectation`. Cost: quadratures within a quadrature. Source: book, section 9.3.4.
[[nodiscard]] Expected<double> expectation(FunctionRef<double(double, double)> f, JointDensity p,
                                           Support of_x, Support of_y);

/// Means, covariance and correlation. @errors As `expectation`.
/// Source: book, sections 9.3.4 to 9.3.6.
[[nodiscard]] Expected<JointMoments> joint_moments(JointDensity p, Support of_x = {},
                                                   Support of_y = {});

/// What data are like: samples x₁ … x_N of a random vector.
struct SampleMoments {
  Eigen::VectorXd mean;         ///< n, Σx/N.
  Eigen::MatrixXd covariance;   ///< n x n, Σ(x - mean)(x - mean)ᵀ/(N - 1), unbiased.
  Eigen::MatrixXd correlation;  ///< n x n, Σ_ij/√(Σ_ii Σ_jj); zero beside a constant entry.
};

/// @param samples  n x N, one column a sample.
/// @errors ArgumentError::not_finite; empty for less than two samples.
/// Cost: O(n²N), allocates. The mean is taken off before the products are made, so that data far
/// from zero lose nothing. Source: book, sections 9.3.5, 9.3.6 and 9.3.14.
[[nodiscard]] Expected<SampleMoments> sample_moments(const MatrixRef& samples);

/// ρ_ij = Σ_ij/√(Σ_ii Σ_jj): the covariance in units in which each variance is one.
/// @param covariance  n x n. @return n x n, ones on the diagonal (zero for a variance of zero).
/// @errors ArgumentError for shapes, entries, asymmetry; out_of_range for a negative variance.
/// Source: book, section 9.3.6.
[[nodiscard]] Expected<Eigen::MatrixXd> correlation(const MatrixRef& covariance);

}  // namespace flyball
