#pragma once

#include <flyball/control/lqr.hpp>
#include <flyball/systems/any_model.hpp>

namespace flyball {

/// A model about any point, an equilibrium or not (8.4): with x = x₀ + δx and u = u₀ + δu
///
///     dx/dt ≈ c + A δx + B δu,    c = f(x₀, u₀).
struct AffineModel {
  Eigen::VectorXd x;  ///< x₀, n x 1
  Eigen::VectorXd u;  ///< u₀, m x 1
  Eigen::MatrixXd A;  ///< ∂f/∂x, n x n
  Eigen::MatrixXd B;  ///< ∂f/∂u, n x m
  Eigen::VectorXd c;  ///< f(x₀, u₀), n x 1
};

/// The first-order model about a point, exact derivatives. @errors As `check_model`;
/// ArgumentError::not_finite for a derivative. Cost: a call of the model and its Jacobians.
/// Source: book, section 8.4.
[[nodiscard]] Expected<AffineModel> affine_model(const AnyModel& model, const MatrixRef& x,
                                                 const MatrixRef& u);

/// The input that holds a state as well as inputs can.
struct OperatingPoint {
  AffineModel model;   ///< About (x₀, u₀); c is what no input cancels, zero at an equilibrium.
  bool holds = false;  ///< Whether |c| is zero, to 1e-9 of its terms.
  int iterations = 0;  ///< 1 where the model is affine in its input.
};

/// u₀ with f(x₀, u₀) as near zero as it can be, the state held: Newton's method on the input alone,
/// u ← u - B⁺ f(x₀, u). For a control-affine model that is (8.2), u₀ = -B⁺ f(x₀), in one step.
///
/// @param u  m x 1, where to begin; it decides where inputs are more than enough.
/// @errors As `affine_model`; SearchError::no_convergence with the last input after 50 steps.
/// Source: book, equations (8.1) and (8.2).
[[nodiscard]] Expected<OperatingPoint> operating_point(const AnyModel& model, const MatrixRef& x,
                                                       const MatrixRef& u);

/// The regulator about an operating point, u = u₀ + K (x₀ - x): the three steps of section 8.4.
struct OperatingPointRegulator {
  OperatingPoint point;
  LqrDesign<> design;  ///< Discrete, of the linear part.
};
/// @param Q, R  As of `lqr`. @param period  T, s.
/// @errors As `operating_point`; SearchError::no_convergence where no input holds x₀, with what is
///         left of f; those of `lqr` and the discretisation. Source: book, section 8.4.
[[nodiscard]] Expected<OperatingPointRegulator> regulate_about(const AnyModel& model,
                                                               const MatrixRef& x,
                                                               const MatrixRef& u, const Weight& Q,
                                                               const Weight& R, Time period);

}  // namespace flyball
