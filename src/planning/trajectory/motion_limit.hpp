#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/planning/path/path.hpp>
#include <flyball/planning/trajectory/path_constraint.hpp>

/// Constraints as the timing of a path takes them, at a place of it.
namespace flyball::detail {

/// |a u + b x + k √x + c| <= 1 with x = (ds/dt)², u = d²s/dt².
struct MotionRow {
  double a = 0.0;
  double b = 0.0;
  double k = 0.0;
  double c = 0.0;
};

/// |√x (e x + b u + ½ a x'')| <= 1: a jerk e ṡ³ + b ṡ s̈ + a s⃛.
struct JerkRow {
  double a = 0.0;
  double b = 0.0;
  double e = 0.0;
};

/// A constraint, checked and in plain numbers. Rows and caps, w x <= 1, are the same ones
/// everywhere.
class MotionLimit {
 public:
  virtual ~MotionLimit() = default;
  /// @param s  Parameter of the path. @param rows  As many as there are row names. @param caps  The
  /// same of caps.
  virtual void evaluate(const PathState& state, double s, MotionRow* rows,
                        double* caps) const noexcept = 0;
  /// @param rows  As many as there are jerk names.
  virtual void evaluate_jerk(const PathState& /*state*/, double /*s*/,
                             JerkRow* /*rows*/) const noexcept {}
  /// Places of a piece where the limit jumps, t in (0, 1), in any order.
  virtual void jumps(const Path& /*path*/, std::size_t /*piece*/,
                     std::vector<double>& /*t*/) const {}
  /// The parameter where it holds, of a limit of a single place.
  [[nodiscard]] virtual std::optional<double> place() const { return std::nullopt; }

  std::vector<std::string> row_names;
  std::vector<std::string> cap_names;
  std::vector<std::string> jerk_names;

 protected:
  MotionLimit() = default;
  MotionLimit(const MotionLimit&) = default;
  MotionLimit& operator=(const MotionLimit&) = default;
};

/// @errors As `time_optimal`.
[[nodiscard]] Expected<std::vector<std::unique_ptr<MotionLimit>>> motion_limits(
    const Path& path, std::span<const PathConstraint> constraints, std::string_view where);

/// How a robot moves in its own frame along a path of the plane, per ds/dt.
struct PlanarMotion {
  Eigen::Vector3d twist;   ///< ξ: its velocity is ξ ds/dt.
  Eigen::Vector3d bend;    ///< dξ/ds
  Eigen::Vector2d first;   ///< p' in its frame
  Eigen::Vector2d second;  ///< p'' in its frame
  Eigen::Vector2d third;   ///< p''' in its frame
};
/// Of a robot that faces where it goes, or backwards.
[[nodiscard]] PlanarMotion facing_motion(const PathState& state, bool backwards) noexcept;
/// Of a robot whose heading is the third coordinate, or constant.
[[nodiscard]] PlanarMotion holonomic_motion(const PathState& state) noexcept;

/// The drives' part of `motion_limits`.
[[nodiscard]] Expected<std::unique_ptr<MotionLimit>> drive_limit(
    const DifferentialDriveLimits& limits, std::string_view where);
[[nodiscard]] Expected<std::unique_ptr<MotionLimit>> drive_limit(const SwerveDriveLimits& limits,
                                                                 std::string_view where);
[[nodiscard]] Expected<std::unique_ptr<MotionLimit>> drive_limit(const MecanumDriveLimits& limits,
                                                                 std::string_view where);

/// Positive or infinite. @errors ArgumentError::not_positive, not_finite (NaN).
[[nodiscard]] Expected<void> check_limit(double value, std::string_view where,
                                         std::string_view name, std::string_view unit = {});

}  // namespace flyball::detail
