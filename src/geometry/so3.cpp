#include <flyball/geometry/so3.hpp>

#include <cmath>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

Expected<Rotation3d> rotation_from_quaternion(double w, double x, double y, double z) {
  constexpr std::string_view where = "rotation_from_quaternion";
  const Eigen::Vector4d q{w, x, y, z};
  FLYBALL_CHECK(check_finite(q, where, "(w, x, y, z)"));
  const double largest = q.cwiseAbs().maxCoeff();
  if (largest == 0.0) {
    return refusal(ArgumentError::out_of_range, where, "(w, x, y, z)")
        .got("zero")
        .expected("a quaternion of some length; (1, 0, 0, 0) does not turn");
  }
  const Eigen::Vector4d scaled = q / largest;
  return Rotation3d::from_unit(scaled / scaled.norm());
}

Expected<Rotation3d> rotation_from_matrix(const Eigen::Matrix3d& R) {
  constexpr std::string_view where = "rotation_from_matrix";
  FLYBALL_CHECK(check_finite(R, where, "R"));
  const Eigen::Matrix3d gram = R.transpose() * R;
  const double defect = (gram - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  // The third column of a right-handed frame is the product of the others.
  const double determinant = (Rotation3d::hat(R.col(0)) * R.col(1)).dot(R.col(2));
  if (!(defect <= 1e-6) || determinant < 0.0) {
    return refusal(ArgumentError::out_of_range, where, "R")
        .got(defect <= 1e-6 ? "a reflection" : detail::format("off by {:.3g} in RᵀR - I", defect))
        .expected("a rotation: RᵀR = I to 1e-6 and det R = 1");
  }
  // One step of Newton's to the nearest rotation: what RᵀR lacks of I is squared.
  const Eigen::Matrix3d M = R * (3.0 * Eigen::Matrix3d::Identity() - gram) / 2.0;
  // 4 q_i q_j for the i whose q_i is largest, so that nothing cancels.
  Eigen::Matrix4d Q;
  Q << 1.0 + M.trace(), M(2, 1) - M(1, 2), M(0, 2) - M(2, 0), M(1, 0) - M(0, 1),  //
      0.0, 1.0 + M(0, 0) - M(1, 1) - M(2, 2), M(0, 1) + M(1, 0), M(0, 2) + M(2, 0), 0.0, 0.0,
      1.0 - M(0, 0) + M(1, 1) - M(2, 2), M(1, 2) + M(2, 1),  //
      0.0, 0.0, 0.0, 1.0 - M(0, 0) - M(1, 1) + M(2, 2);
  Eigen::Index i = 0;
  Q.diagonal().maxCoeff(&i);
  const Eigen::Vector4d q = Q.selfadjointView<Eigen::Upper>() * Eigen::Vector4d::Unit(i);
  return Rotation3d::from_unit(q / q.norm());
}

}  // namespace flyball
