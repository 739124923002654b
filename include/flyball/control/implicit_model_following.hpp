#pragma once

#include <flyball/control/quadratic_cost.hpp>

namespace flyball {

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
  constexpr std::string_view where = "implicit_model_following";
  const Checks checks = Checks(where).also([&] { return check_system(plant, where); }).also([&] {
    return check_system(reference, where);
  });
  if (!checks) {
    return tl::unexpected(checks.error());
  }
  if (plant.period.si() != reference.period.si()) {
    return tl::unexpected(Error(ArgumentError::out_of_range)
                              .in(std::string(where))
                              .about("the reference model's period")
                              .got(format_number(reference.period.si()) + " s")
                              .expected("the plant's, " + format_number(plant.period.si()) + " s"));
  }
  const Eigen::MatrixXd C = Eigen::MatrixXd::Identity(plant.A.rows(), plant.A.cols());
  return implicit_model_following(plant.A, plant.B, C, reference.A, reference.B, Q, R);
}

}  // namespace flyball
