#pragma once

#include <optional>

#include "control/robust/member_search.hpp"
#include "control/robust/structured_bound.hpp"

namespace flyball::detail {

/// A matrix with its bound, and the coordinates in which the bound is a largest singular value,
/// near enough: 2^-size F_out 2^out M 2^-in F_in⁻¹. The powers of two are M's balance, and a number
/// between them and M is never formed.
struct ScaledPoint {
  Eigen::MatrixXcd F_out, F_in_inverse;
  Eigen::VectorXi out, in;  ///< Exponents.
  int size = 0;
  double scale = 1.0;         ///< 2^size
  double beta = 0.0;          ///< Proven, of M.
  double work = 0.0;          ///< That it took to find, in multiplications.
  StructuredScaling scaling;  ///< Of M itself.

  [[nodiscard]] Eigen::MatrixXcd coordinates_of(const Eigen::MatrixXcd& M) const;
  /// The member in which the largest singular value's vectors are aligned.
  [[nodiscard]] UnitMember first_member(const Eigen::MatrixXcd& M, const MemberClimb& climb,
                                        double frequency) const;
};

/// @param enough  Below this β the bound need not be the least. @param accuracy  Of β².
[[nodiscard]] ScaledPoint scaled_point(const Eigen::MatrixXcd& M,
                                       const UncertaintyStructure& structure, double enough = 0.0,
                                       double accuracy = 1e-7);

/// What is left of (I - M Δ) z beside (1 + ‖M‖ ‖Δ‖) ‖z‖; all in a point's coordinates.
[[nodiscard]] double residual_of(const Eigen::MatrixXcd& M, const Eigen::MatrixXcd& Q,
                                 const SingularMember& found);

}  // namespace flyball::detail
