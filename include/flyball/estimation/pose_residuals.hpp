#pragma once

#include <cmath>

#include <Eigen/Core>

#include <flyball/geometry/manifold.hpp>
#include <flyball/systems/model.hpp>

/// Residuals of poses for a FactorGraph, over a generic scalar, whitened: with W of WᵀW = Σ⁻¹ (such
/// as the upper Cholesky factor of the information matrix) |W e|² is a squared Mahalanobis
/// distance.
namespace flyball {

namespace detail {

/// W e.
template <class Scalar, int N>
[[nodiscard]] Eigen::Matrix<Scalar, N, 1> whitened(const Eigen::Matrix<double, N, N>& W,
                                                   const Eigen::Matrix<Scalar, N, 1>& e) {
  Eigen::Matrix<Scalar, N, 1> r;
  for (int i = 0; i < N; ++i) {
    r(i) = Scalar(0.0);
    for (int j = 0; j < N; ++j) {
      r(i) += W(i, j) * e(j);
    }
  }
  return r;
}

}  // namespace detail

/// Pose b as seen from pose a: e = (a⁻¹b) ⊖ z. Of SE2, SE3 and any other group.
/// Source: Dellaert, Kaess, "Factor graphs for robot perception" (2017), section 6.1.
template <class Pose>
struct RelativePose {
  Pose z;
  TangentMatrix<Pose> W;

  template <class A, class B>
  auto operator()(const A& a, const B& b) const {
    using Scalar = typename A::Scalar;
    return detail::whitened<Scalar, tangent_size<Pose>>(
        W, a.between(b).minus(z.template cast<Scalar>()));
  }
};

/// The same of poses of the plane by their coordinates, e = (Rₐᵀ(p_b - p_a) - p_z, θ_b - θ_a -
/// θ_z): what the numbers of .g2o files (EDGE_SE2) are of, as Ceres reads them.
struct RelativePoseByCoordinates {
  Eigen::Vector2d translation;  ///< p_z, m.
  double angle;                 ///< θ_z, rad.
  Eigen::Matrix3d W;

  template <class A, class B>
  auto operator()(const A& a, const B& b) const {
    using Scalar = typename A::Scalar;
    const auto seen = a.between(b);
    const Eigen::Matrix<Scalar, 3, 1> e{seen.x() - translation(0), seen.y() - translation(1),
                                        angle_difference(seen.angle(), Scalar(angle))};
    return detail::whitened<Scalar, 3>(W, e);
  }
};

/// What is known of a pose beforehand: e = x ⊖ mean.
template <class Pose>
struct KnownPose {
  Pose mean;
  TangentMatrix<Pose> W;

  template <class X>
  auto operator()(const X& x) const {
    using Scalar = typename X::Scalar;
    return detail::whitened<Scalar, tangent_size<Pose>>(W, x.minus(mean.template cast<Scalar>()));
  }
};

/// A point of the plane seen from a pose, by range and bearing; the point is known, or a variable.
struct RangeAndBearing {
  double range, bearing;          ///< m, rad, counter-clockwise from forward.
  double range_std, bearing_std;  ///< m, rad.

  template <class Pose, class Point>
  auto operator()(const Pose& pose, const Point& point) const {
    using Scalar = typename Pose::Scalar;
    using std::atan2;
    using std::sqrt;
    const Eigen::Matrix<Scalar, 2, 1> off{Scalar(point(0)) - pose.x(), Scalar(point(1)) - pose.y()};
    const Eigen::Matrix<Scalar, 2, 1> seen = pose.rotation().inverse() * off;
    const Scalar distance = sqrt(seen(0) * seen(0) + seen(1) * seen(1));
    const Scalar direction = atan2(seen(1), seen(0));
    return Eigen::Matrix<Scalar, 2, 1>{(range - distance) / range_std,
                                       angle_difference(Scalar(bearing), direction) / bearing_std};
  }
};

}  // namespace flyball
