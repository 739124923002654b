#pragma once

#include <Eigen/Core>

#include "math/dense/pair_scaling.hpp"

namespace flyball::detail {

/// Units in which nothing is far from one. Where all entries are ordinary those that were given
/// stay, but for time if the poles are far from one.
[[nodiscard]] PairScaling placement_units(const MatrixRef& A, const MatrixRef& B,
                                          const Eigen::VectorXcd& poles);

/// The poles times 2^exponent.
[[nodiscard]] Eigen::VectorXcd in_units_of(const Eigen::VectorXcd& poles, int exponent);

}  // namespace flyball::detail
