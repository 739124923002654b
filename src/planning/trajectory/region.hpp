#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/planning/path/path.hpp>
#include <flyball/planning/trajectory/path_constraint.hpp>

namespace flyball::detail {

/// @errors ArgumentError::not_positive, not_finite, out_of_range (a rectangle without area), empty
/// (a polygon of fewer than three corners).
[[nodiscard]] Expected<void> check_region(const RegionLimit& limit, std::size_t number,
                                          std::string_view where);

[[nodiscard]] bool contains(const RegionLimit& limit, const Eigen::Vector2d& point) noexcept;

/// Where a piece may cross the border: all its t in (0, 1) on the lines and ellipses that bound the
/// region.
void border_crossings(const RegionLimit& limit, const PathPiece& piece, std::vector<double>& t);

/// The roots in (0, 1) of Σ c_k t^k where it changes its sign, to rounding; of two nearer than 1e-7
/// one place. By halving until the Bézier coefficients change their sign once at most.
void polynomial_roots(const Eigen::VectorXd& c, std::vector<double>& t);

}  // namespace flyball::detail
