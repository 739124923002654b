#pragma once

#include <string_view>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>

namespace flyball::detail {

/// What an instant loop is told by: I + s F G of two gains, whose product is formed in 31 digits,
/// or I + F of one.
struct AlgebraicLoop {
  Eigen::MatrixXd F;
  Eigen::MatrixXd G;  ///< Empty: none.
  double sign = 1.0;
  std::string_view subject;  ///< What is singular: "I + D1 D2".
  std::string_view hint;
};

/// X of (I + s F G) X = R: the signals of a loop that acts instantly.
///
/// Whether it is singular does not depend on the signals' units, but on what the entries of F and G
/// are known to: with T = I + |F||G|, no E with |E_ij| <= t T_ij makes I + s F G singular for
/// t < 1/ρ(|(I + s F G)⁻¹| T), which is the same for the loop in all other units (S⁻¹ F G S with
/// any diagonal S). Up to ten roundings it counts as singular. In 31 digits with exponents of their
/// own, so that neither products nor units lose anything. Cost: O(m³) of some 100 ns where F G is
/// not zero; nothing where it is.
/// @errors SystemError::algebraic_loop with that distance.
/// Source: Bauer's and Skeel's condition; Higham, "Accuracy and Stability of Numerical Algorithms",
/// sections 7.2 and 7.3.
[[nodiscard]] Expected<Eigen::MatrixXd> solve_algebraic_loop(const AlgebraicLoop& loop,
                                                             const Eigen::MatrixXd& R,
                                                             std::string_view where);

}  // namespace flyball::detail
