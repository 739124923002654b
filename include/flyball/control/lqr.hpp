#pragma once

#include <complex>
#include <initializer_list>
#include <span>

#include <Eigen/Core>

#include <flyball/core/matrix_argument.hpp>
#include <flyball/systems/system.hpp>

namespace flyball {

/// A weight of a quadratic cost: a matrix, or what `bryson` answered.
using Weight = MatrixArgument<struct WeightTag>;

/// What an LQR design gives.
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic>
struct LqrDesign {
  Eigen::Matrix<double, Inputs, States> K;  ///< Inputs x states, feedback gain of u = K (r - x).
  Eigen::Matrix<double, States, States> S;  ///< States x states, cost-to-go xᵀ S x.
  Eigen::Matrix<std::complex<double>, States, 1> poles;  ///< Eigenvalues of A - B K.
  double residual = 0.0;   ///< Relative residual of the Riccati equation.
  double condition = 0.0;  ///< Condition estimate of its solution.
};

/// Bryson's rule: diag(ρ / tolerance²).
///
/// @param tolerances  The largest acceptable excursion of each state (or input), in its unit;
///                    infinity says that it does not matter and gives the weight 0.
/// @param rho  ρ, no unit: above 1 penalises these excursions more; the book puts it on Q.
/// @errors ArgumentError::not_positive, not_finite (NaN) naming the entry, empty.
/// Source: book, section 7.7.3.
[[nodiscard]] Expected<Eigen::MatrixXd> bryson(std::span<const double> tolerances,
                                               double rho = 1.0);
[[nodiscard]] Expected<Eigen::MatrixXd> bryson(std::initializer_list<double> tolerances,
                                               double rho = 1.0);

/// Infinite-horizon discrete linear-quadratic regulator, u = K (r - x) (7.15), which minimises
/// Σ xᵀQx + 2 xᵀNu + uᵀRu subject to x_{k+1} = A x_k + B u_k.
///
/// K = (BᵀSB + R)⁻¹(BᵀSA + Nᵀ) with S from the discrete algebraic Riccati equation.
/// @param A  n x n, discrete. @param B  n x m, discrete.
/// @param Q  n x n, symmetric, 1/state². @param R  m x m, symmetric, 1/input².
/// @param N  n x m, 1/(state input), the cross weight (B.1); none is zero.
/// @errors ArgumentError for shapes, entries and asymmetry; the error of the weight's maker;
///         RiccatiError as `dare`, such as not_stabilizable with the mode that no input reaches.
/// Cost: one Riccati solution, O(n³) a step; allocates; not for the control loop.
/// Source: book, Theorem 7.7.1; the cross term: appendix B.1.
[[nodiscard]] Expected<LqrDesign<>> lqr(const MatrixRef& A, const MatrixRef& B, const Weight& Q,
                                        const Weight& R, const MatrixRef& N);
[[nodiscard]] Expected<LqrDesign<>> lqr(const MatrixRef& A, const MatrixRef& B, const Weight& Q,
                                        const Weight& R);

/// The same for a discrete plant, with the plant's sizes.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<LqrDesign<States, Inputs>> lqr(
    const DiscreteSystem<States, Inputs, Outputs>& plant, const Weight& Q, const Weight& R) {
  return lqr(plant.A, plant.B, Q, R).map([](const LqrDesign<>& design) {
    return LqrDesign<States, Inputs>{design.K, design.S, design.poles, design.residual,
                                     design.condition};
  });
}
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<LqrDesign<States, Inputs>> lqr(
    const DiscreteSystem<States, Inputs, Outputs>& plant, const Weight& Q, const Weight& R,
    const MatrixRef& N) {
  return lqr(plant.A, plant.B, Q, R, N).map([](const LqrDesign<>& design) {
    return LqrDesign<States, Inputs>{design.K, design.S, design.poles, design.residual,
                                     design.condition};
  });
}

/// A continuous plant has to be discretised first: a gain for another sample period is another
/// gain.
template <int States, int Inputs, int Outputs, class... Rest>
void lqr(const ContinuousSystem<States, Inputs, Outputs>& plant, const Rest&...) = delete;

#define FLYBALL_STATES_INPUTS_OUTPUTS(States, Inputs, Outputs)                       \
  extern template Expected<LqrDesign<States, Inputs>> lqr(                           \
      const DiscreteSystem<States, Inputs, Outputs>&, const Weight&, const Weight&); \
  extern template Expected<LqrDesign<States, Inputs>> lqr(                           \
      const DiscreteSystem<States, Inputs, Outputs>&, const Weight&, const Weight&,  \
      const MatrixRef&);
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
