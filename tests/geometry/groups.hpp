#pragma once

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/geometry/bundle.hpp>
#include <flyball/geometry/se2.hpp>
#include <flyball/geometry/se3.hpp>

/// What the one law suite is tried on.
namespace flyball::test {

using PoseAndBias = Bundle<Pose2d, Eigen::Vector2d>;
using Everything = Bundle<Rotation3d, Eigen::Vector3d, Pose2d, Rotation2d>;

using Groups = testing::Types<Rotation2d, Pose2d, Rotation3d, Pose3d, PoseAndBias, Everything,
                              SO2<float>, SE2<float>, SO3<float>, SE3<float>>;
/// Those whose Jacobians dual numbers check.
using DoubleGroups =
    testing::Types<Rotation2d, Pose2d, Rotation3d, Pose3d, PoseAndBias, Everything>;

/// Where in a tangent the rotation vectors stand: they have an injectivity radius, the rest none.
struct RotationBlock {
  int offset;
  int size;
};
template <class G>
struct Rotations;
template <class S>
struct Rotations<SO2<S>> {
  static std::vector<RotationBlock> blocks() { return {{0, 1}}; }
};
template <class S>
struct Rotations<SE2<S>> {
  static std::vector<RotationBlock> blocks() { return {{2, 1}}; }
};
template <class S>
struct Rotations<SO3<S>> {
  static std::vector<RotationBlock> blocks() { return {{0, 3}}; }
};
template <class S>
struct Rotations<SE3<S>> {
  static std::vector<RotationBlock> blocks() { return {{3, 3}}; }
};
template <>
struct Rotations<PoseAndBias> {
  static std::vector<RotationBlock> blocks() { return {{2, 1}}; }
};
template <>
struct Rotations<Everything> {
  static std::vector<RotationBlock> blocks() { return {{0, 3}, {8, 1}, {9, 1}}; }
};

/// A random tangent: translations up to `length`, each rotation by `angle` about a random axis.
template <class G>
[[nodiscard]] typename G::Tangent random_tangent(Random& random, double length, double angle) {
  using Scalar = typename G::Scalar;
  typename G::Tangent tau;
  for (int i = 0; i < G::tangent_size; ++i) {
    tau(i) = static_cast<Scalar>(random.uniform(-length, length));
  }
  for (const auto& [offset, size] : Rotations<G>::blocks()) {
    auto rotation = tau.segment(offset, size);
    Eigen::VectorXd axis(size);
    for (double& entry : axis) {
      entry = random.normal();
    }
    rotation = (axis * (angle / axis.norm())).template cast<Scalar>();
  }
  return tau;
}

/// Within the injectivity radius.
template <class G>
[[nodiscard]] typename G::Tangent random_tangent(Random& random) {
  return random_tangent<G>(random, 5.0, random.uniform(0.0, 0.999 * std::numbers::pi));
}

template <class G>
[[nodiscard]] G random_element(Random& random) {
  return G::exp(random_tangent<G>(random));
}

/// Sizes from which nothing is left of squares, to those where squares begin to count.
inline constexpr double small_sizes[] = {1e-300, 1e-160, 1e-150, 1e-80, 1e-20, 1e-16, 1e-12, 1e-9,
                                         1e-8,   1e-7,   1e-6,   1e-5,  1e-4,  1e-3,  1e-2,  0.1};

/// How far apart two elements are.
template <class G>
[[nodiscard]] double distance(const G& a, const G& b) {
  return static_cast<double>(a.minus(b).norm());
}

/// n roundings of a scalar, for elements and tangents of the size of the random ones.
template <class G>
[[nodiscard]] double roundings(double n) {
  return n * static_cast<double>(std::numeric_limits<typename G::Scalar>::epsilon());
}

}  // namespace flyball::test
