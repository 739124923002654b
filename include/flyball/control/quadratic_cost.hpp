#pragma once

#include <flyball/control/lqr.hpp>

namespace flyball {

/// The weights of Σ xᵀQx + 2 xᵀNu + uᵀRu.
struct QuadraticCost {
  Eigen::MatrixXd Q;  ///< n x n
  Eigen::MatrixXd R;  ///< m x m
  Eigen::MatrixXd N;  ///< n x m
};

/// The cost of the outputs Σ yᵀQy + uᵀRu in terms of the states, with y = C x + D u (B.2):
/// CᵀQC, DᵀQD + R and CᵀQD.
/// @param C  p x n. @param D  p x m. @param Q  p x p, symmetric, 1/output².
/// @param R  m x m, symmetric, 1/input².
/// @errors ArgumentError for shapes, entries and asymmetry; the error of the weight's maker.
/// Source: book, Theorem B.2.1.
[[nodiscard]] Expected<QuadraticCost> output_cost(const MatrixRef& C, const MatrixRef& D,
                                                  const Weight& Q, const Weight& R);

/// The regulator for weights that are on the plant's outputs, outputs x outputs, instead of its
/// states. @errors As `output_cost` and `lqr`. Source: book, Theorem B.2.1.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<LqrDesign<States, Inputs>> output_lqr(
    const DiscreteSystem<States, Inputs, Outputs>& plant, const Weight& Q, const Weight& R) {
  if (auto checked = check_system(plant, "output_lqr"); !checked) {
    return tl::unexpected(checked.error());
  }
  return output_cost(plant.C, plant.D, Q, R).and_then([&](const QuadraticCost& cost) {
    return lqr(plant, cost.Q, cost.R, cost.N);
  });
}

/// A feedback that makes a plant behave like another one, u_imf = -K x + K_u u.
struct ImplicitModel {
  Eigen::MatrixXd K;       ///< m x n
  Eigen::MatrixXd K_u;     ///< m x q, B⁺B_ref: what the reference model's inputs become.
  QuadraticCost cost;      ///< Q_imf, R_imf, N_imf of Theorem B.3.1.
  Eigen::VectorXcd poles;  ///< Of A - B K: near those of A_ref as far as the inputs allow.
  /// ‖(CA - A_ref C) - C B K‖_F: how far C x follows the reference model's free motion from one
  /// period to the next; zero where it does exactly.
  double mismatch = 0.0;
};

/// The cost of implicit model following: Σ (y - z)ᵀQ(y - z) + uᵀRu one period ahead, y = C x, with
/// z_{k+1} = A_ref y_k.
/// @param A  n x n, discrete. @param B  n x m. @param C  p x n: which of the states follow.
/// @param A_ref  p x p, discrete. @param Q  p x p. @param R  m x m.
/// @errors ArgumentError for shapes, entries and asymmetry.
/// Source: book, Theorem B.3.1, (B.4).
[[nodiscard]] Expected<QuadraticCost> implicit_model_cost(const MatrixRef& A, const MatrixRef& B,
                                                          const MatrixRef& C,
                                                          const MatrixRef& A_ref, const Weight& Q,
                                                          const Weight& R);

/// Implicit model following: the closed loop moves like z₊ = A_ref z + B_ref u.
/// Modes that cost nothing because the plant follows them by itself are left as they are, also on
/// the unit circle: a position in both models stays an integrator.
/// @param B_ref  p x q, discrete. B_ref's inputs act through K_u = (C B)⁺ B_ref.
/// @errors As `implicit_model_cost`; RiccatiError as `dare`, singular where (CB)ᵀQ(CB) + R is not
/// positive definite.
/// Source: book, Theorem B.3.1 and section B.3.2.
[[nodiscard]] Expected<ImplicitModel> implicit_model_following(
    const MatrixRef& A, const MatrixRef& B, const MatrixRef& C, const MatrixRef& A_ref,
    const MatrixRef& B_ref, const Weight& Q, const Weight& R);

/// The same where plant and reference model have the same states (B.6), C = I.
template <int States, int Inputs, int Outputs, int Outputs2>
[[nodiscard]] Expected<ImplicitModel> implicit_model_following(
    const DiscreteSystem<States, Inputs, Outputs>& plant,
    const DiscreteSystem<States, Inputs, Outputs2>& reference, const Weight& Q, const Weight& R) {
  if (auto checked = check_all(check_system(plant, "implicit_model_following"),
                               check_system(reference, "implicit_model_following"));
      !checked) {
    return tl::unexpected(checked.error());
  }
  if (plant.period.si() != reference.period.si()) {
    return tl::unexpected(Error(ArgumentError::out_of_range)
                              .in("implicit_model_following")
                              .about("the reference model's period")
                              .got(format_number(reference.period.si()) + " s")
                              .expected("the plant's, " + format_number(plant.period.si()) + " s"));
  }
  const Eigen::MatrixXd C = Eigen::MatrixXd::Identity(plant.A.rows(), plant.A.cols());
  return implicit_model_following(plant.A, plant.B, C, reference.A, reference.B, Q, R);
}

/// The regulator of a continuous plant whose input is continuous too, u = K (r - x), which
/// minimises ∫ xᵀQx + 2 xᵀNu + uᵀRu dt. A sampled controller wants `lqr` on the discretised plant;
/// its gains approach these as the period goes to zero.
///
/// K = R⁻¹(BᵀS + Nᵀ) with S from the continuous algebraic Riccati equation (5.1).
/// @param A  n x n, continuous. @param B  n x m, continuous. @param Q  n x n, 1/(state² s).
/// @param R  m x m, 1/(input² s), positive definite. @param N  n x m; none is zero.
/// @errors ArgumentError; RiccatiError as `care`. Source: book, section 7.7 and appendix B.1.
[[nodiscard]] Expected<LqrDesign<>> continuous_lqr(const MatrixRef& A, const MatrixRef& B,
                                                   const Weight& Q, const Weight& R,
                                                   const MatrixRef& N);
[[nodiscard]] Expected<LqrDesign<>> continuous_lqr(const MatrixRef& A, const MatrixRef& B,
                                                   const Weight& Q, const Weight& R);
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<LqrDesign<States, Inputs>> continuous_lqr(
    const ContinuousSystem<States, Inputs, Outputs>& plant, const Weight& Q, const Weight& R) {
  return continuous_lqr(plant.A, plant.B, Q, R).map([](const LqrDesign<>& design) {
    return LqrDesign<States, Inputs>{design.K, design.S, design.poles, design.residual,
                                     design.condition};
  });
}

}  // namespace flyball
