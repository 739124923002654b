#pragma once

#include <flyball/systems/system.hpp>

namespace flyball {

/// A plant under zero-order hold together with what a continuous cost costs over one period: the
/// data of a discrete LQR that minimises the continuous integral.
struct SampledCost {
  Eigen::MatrixXd A;  ///< n x n, e^{AT}.
  Eigen::MatrixXd B;  ///< n x m, ∫₀ᵀ e^{Aτ} dτ B.
  Eigen::MatrixXd Q;  ///< n x n, symmetric.
  Eigen::MatrixXd
      R;  ///< m x m, symmetric; positive even where R = 0, if the input is weighed in x.
  Eigen::MatrixXd N;  ///< n x m, not zero even where N = 0.
};

/// The discrete cost xᵀQ_d x + 2xᵀN_d u + uᵀR_d u of one period under a held input u, which is
/// ∫₀ᵀ xᵀQx + 2xᵀNu + uᵀRu dt: with F = [A B; 0 0],
///   [Q_d N_d; N_dᵀ R_d] = ∫₀ᵀ e^{Fᵀτ} [Q N; Nᵀ R] e^{Fτ} dτ.
///
/// An explicit choice beside the book's own, which is to use Q and R as they are, per sample
/// (section 7.7): with these weights the gain tends to the continuous LQR's as T → 0, and two
/// periods give the same trade. By doubling, as for process noise: nothing cancels, whatever ‖A‖T.
///
/// @param A  n x n, continuous. @param B  n x m, continuous.
/// @param Q  n x n, symmetric. @param R  m x m, symmetric. @param N  n x m, the cross weight.
/// @param period  T, s.
/// @errors ArgumentError for shapes, entries, asymmetry and a period that is not positive;
///         not_finite where the cost itself overflows; those of `expm`.
/// Cost: O((n + m)³ log ‖A‖T), allocates.
/// Source: the sampling of quadratic costs: Åström and Wittenmark, "Computer-Controlled Systems",
/// 3rd ed., section 11.1; Van Loan, IEEE Trans. Automatic Control 23 (1978).
[[nodiscard]] Expected<SampledCost> sampled_cost(const MatrixRef& A, const MatrixRef& B,
                                                 const MatrixRef& Q, const MatrixRef& R,
                                                 const MatrixRef& N, Time period);
/// The same with N = 0. @errors As above.
[[nodiscard]] Expected<SampledCost> sampled_cost(const MatrixRef& A, const MatrixRef& B,
                                                 const MatrixRef& Q, const MatrixRef& R,
                                                 Time period);

}  // namespace flyball
