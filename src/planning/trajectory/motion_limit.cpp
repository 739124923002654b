#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "planning/trajectory/motion_limit.hpp"
#include "planning/trajectory/region.hpp"

namespace flyball::detail {

namespace {

using Eigen::Index;
using Eigen::Vector2d;

class OfCoordinates final : public MotionLimit {
 public:
  OfCoordinates(const CoordinateLimits& limits, int coordinates) {
    for (int j = 0; j < coordinates; ++j) {
      if (limits.velocity.size() > 0 && std::isfinite(limits.velocity(j))) {
        cap_names.push_back(format("coordinate {}: velocity", j + 1));
        velocity_.emplace_back(j, 1.0 / limits.velocity(j));
      }
      if (limits.acceleration.size() > 0 && std::isfinite(limits.acceleration(j))) {
        row_names.push_back(format("coordinate {}: acceleration", j + 1));
        acceleration_.emplace_back(j, 1.0 / limits.acceleration(j));
      }
      if (limits.jerk.size() > 0 && std::isfinite(limits.jerk(j))) {
        jerk_names.push_back(format("coordinate {}: jerk", j + 1));
        jerk_.emplace_back(j, 1.0 / limits.jerk(j));
      }
    }
  }
  void evaluate_jerk(const PathState& state, double /*s*/, JerkRow* rows) const noexcept override {
    for (const auto& [j, inverse] : jerk_) {
      *rows++ = {state.first(j) * inverse, 3.0 * state.second(j) * inverse,
                 state.third(j) * inverse};
    }
  }
  void evaluate(const PathState& state, double /*s*/, MotionRow* rows,
                double* caps) const noexcept override {
    for (const auto& [j, inverse] : acceleration_) {
      *rows++ = {state.first(j) * inverse, state.second(j) * inverse, 0.0, 0.0};
    }
    for (const auto& [j, inverse] : velocity_) {
      const double e = state.first(j) * inverse;
      *caps++ = e * e;
    }
  }

 private:
  std::vector<std::pair<int, double>> velocity_;
  std::vector<std::pair<int, double>> acceleration_;
  std::vector<std::pair<int, double>> jerk_;
};

/// dl/ds, d²l/ds² and d³l/ds³ of the length l in the plane.
Eigen::Vector3d length_rates(const PathState& state) noexcept {
  const Vector2d p1 = state.first.head<2>();
  const Vector2d p2 = state.second.head<2>();
  const Vector2d p3 = state.third.head<2>();
  const double square = p1.squaredNorm();
  if (square > 1e-20 * p2.squaredNorm()) {
    const double first = std::sqrt(square);
    const double second = p1.dot(p2) / first;
    return {first, second, (p2.squaredNorm() + p1.dot(p3) - second * second) / first};
  }
  const double second = p2.norm();  // a cusp: what follows it
  return {0.0, second, second > 0.0 ? p2.dot(p3) / second : 0.0};
}

/// Of a circle of accelerations a polygon of twice as many sides.
constexpr std::size_t circle_directions = 12;
constexpr std::size_t most_travel_rows = circle_directions + 2;
/// The same of jerks, which are dear.
constexpr std::size_t jerk_directions = 6;

class OfTravel final : public MotionLimit {
 public:
  explicit OfTravel(const TravelLimits& limits) : limits_(limits) {
    const auto name = [](std::vector<std::string>& names, double limit, const char* text) {
      if (std::isfinite(limit)) {
        names.emplace_back(text);
      }
    };
    name(cap_names, limits.velocity, "velocity");
    name(cap_names, limits.centripetal, "centripetal acceleration");
    name(cap_names, limits.angular_velocity, "angular velocity");
    name(row_names, limits.acceleration, "acceleration");
    name(row_names, limits.angular_acceleration, "angular acceleration");
    name(jerk_names, limits.jerk, "jerk");
    if (std::isfinite(limits.total_acceleration)) {
      row_names.insert(row_names.end(), circle_directions, "acceleration");
      constexpr double step = std::numbers::pi / circle_directions;
      const double size = std::cos(0.5 * step) * limits.total_acceleration;
      for (std::size_t i = 0; i < circle_directions; ++i) {
        const double angle = step * (static_cast<double>(i) + 0.5);
        circle_[i] = Vector2d(std::cos(angle), std::sin(angle)) / size;
      }
    }
    if (std::isfinite(limits.total_jerk)) {
      jerk_names.insert(jerk_names.end(), jerk_directions, "jerk");
      constexpr double step = std::numbers::pi / jerk_directions;
      const double size = std::cos(0.5 * step) * limits.total_jerk;
      for (std::size_t i = 0; i < jerk_directions; ++i) {
        const double angle = step * (static_cast<double>(i) + 0.5);
        jerk_circle_[i] = Vector2d(std::cos(angle), std::sin(angle)) / size;
      }
    }
  }
  void evaluate_jerk(const PathState& state, double /*s*/, JerkRow* rows) const noexcept override {
    if (std::isfinite(limits_.jerk)) {
      const Eigen::Vector3d l = length_rates(state) / limits_.jerk;
      *rows++ = {l(0), 3.0 * l(1), l(2)};
    }
    if (std::isfinite(limits_.total_jerk)) {  // q' s⃛ + 3 q'' ṡ s̈ + q''' ṡ³
      const PlanarMotion facing = facing_motion(state, false);
      for (const Vector2d& normal : jerk_circle_) {
        *rows++ = {normal.dot(facing.first), 3.0 * normal.dot(facing.second),
                   normal.dot(facing.third)};
      }
    }
  }
  void evaluate(const PathState& state, double /*s*/, MotionRow* rows,
                double* caps) const noexcept override {
    const PlanarMotion facing = facing_motion(state, false);
    const bool turns = state.position.size() > 2;
    const double turn = turns ? state.first(2) : facing.twist(2);
    const double bend = turns ? state.second(2) : facing.bend(2);
    const double sigma = facing.twist(0);
    if (std::isfinite(limits_.velocity)) {
      *caps++ = sigma * sigma / (limits_.velocity * limits_.velocity);
    }
    if (std::isfinite(limits_.centripetal)) {  // κ σ² = σ θ'
      *caps++ = std::abs(sigma * facing.twist(2)) / limits_.centripetal;
    }
    if (std::isfinite(limits_.angular_velocity)) {
      *caps++ = turn * turn / (limits_.angular_velocity * limits_.angular_velocity);
    }
    if (std::isfinite(limits_.acceleration)) {
      *rows++ = {sigma / limits_.acceleration, facing.bend(0) / limits_.acceleration, 0.0, 0.0};
    }
    if (std::isfinite(limits_.angular_acceleration)) {
      *rows++ = {turn / limits_.angular_acceleration, bend / limits_.angular_acceleration, 0.0,
                 0.0};
    }
    if (std::isfinite(limits_.total_acceleration)) {
      for (const Vector2d& normal : circle_) {
        *rows++ = {normal(0) * facing.first(0), normal.dot(facing.second), 0.0, 0.0};
      }
    }
  }

 private:
  TravelLimits limits_;
  std::array<Vector2d, circle_directions> circle_{};
  std::array<Vector2d, jerk_directions> jerk_circle_{};
};

class OfStretch final : public MotionLimit {
 public:
  OfStretch(const StretchLimits& stretch, std::size_t number)
      : inner_(stretch.limits), from_(stretch.from), to_(stretch.to) {
    const std::string name = stretch.name.empty() ? format("stretch {}", number) : stretch.name;
    const auto named = [&](const std::vector<std::string>& limits, std::vector<std::string>& all) {
      for (const std::string& limit : limits) {
        all.push_back(name + ": " + limit);
      }
    };
    named(inner_.cap_names, cap_names);
    if (from_ < to_) {
      named(inner_.row_names, row_names);
      named(inner_.jerk_names, jerk_names);
    }
  }
  void evaluate_jerk(const PathState& state, double s, JerkRow* rows) const noexcept override {
    if (s >= from_ && s <= to_) {
      inner_.evaluate_jerk(state, s, rows);
    } else {
      std::fill_n(rows, jerk_names.size(), JerkRow{});
    }
  }
  void evaluate(const PathState& state, double s, MotionRow* rows,
                double* caps) const noexcept override {
    if (s >= from_ && s <= to_) {
      std::array<MotionRow, most_travel_rows> skipped;  // of a single place: velocities alone count
      inner_.evaluate(state, s, from_ < to_ ? rows : skipped.data(), caps);
    } else {
      std::fill_n(rows, row_names.size(), MotionRow{});
      std::fill_n(caps, cap_names.size(), 0.0);
    }
  }
  void jumps(const Path& path, std::size_t piece, std::vector<double>& t) const override {
    for (const double s : {from_, to_}) {
      const double at = (s - path.breaks()[piece]) / path.pieces()[piece].span;
      if (at > 0.0 && at < 1.0) {
        t.push_back(at);
      }
    }
  }
  [[nodiscard]] std::optional<double> place() const override {
    return from_ < to_ ? std::nullopt : std::optional(from_);
  }

 private:
  OfTravel inner_;
  double from_;
  double to_;
};

class OfRegion final : public MotionLimit {
 public:
  OfRegion(const RegionLimit& limit, std::size_t number) : limit_(limit) {
    cap_names.push_back((limit.name.empty() ? format("region {}", number) : limit.name) +
                        ": velocity");
  }
  void evaluate(const PathState& state, double /*s*/, MotionRow* /*rows*/,
                double* caps) const noexcept override {
    const bool inside = contains(limit_, state.position.head<2>());
    *caps =
        inside ? state.first.head<2>().squaredNorm() / (limit_.velocity * limit_.velocity) : 0.0;
  }
  void jumps(const Path& path, std::size_t piece, std::vector<double>& t) const override {
    border_crossings(limit_, path.pieces()[piece], t);
  }

 private:
  RegionLimit limit_;
};

Expected<void> check_travel(const TravelLimits& limits, std::string_view where) {
  FLYBALL_CHECK(check_limit(limits.velocity, where, "velocity limit", "m/s"));
  FLYBALL_CHECK(check_limit(limits.acceleration, where, "acceleration limit", "m/s²"));
  FLYBALL_CHECK(check_limit(limits.centripetal, where, "centripetal acceleration limit", "m/s²"));
  FLYBALL_CHECK(check_limit(limits.total_acceleration, where, "acceleration limit", "m/s²"));
  FLYBALL_CHECK(check_limit(limits.angular_velocity, where, "angular velocity limit", "rad/s"));
  FLYBALL_CHECK(check_limit(limits.jerk, where, "jerk limit", "m/s³"));
  FLYBALL_CHECK(check_limit(limits.total_jerk, where, "jerk limit", "m/s³"));
  return check_limit(limits.angular_acceleration, where, "angular acceleration limit", "rad/s²");
}

Expected<void> check_coordinate_limits(const Eigen::VectorXd& limits, const Path& path,
                                       std::string_view where, std::string_view name) {
  if (limits.size() != 0 && limits.size() != path.coordinates()) {
    return refusal(ArgumentError::wrong_shape, where, name)
        .got(format("{} of them", limits.size()))
        .expected(format("one a coordinate of the path ({}), or none", path.coordinates()));
  }
  for (Index j = 0; j < limits.size(); ++j) {
    FLYBALL_CHECK(check_limit(limits(j), where, format("{} {}", name, j + 1)));
  }
  return {};
}

}  // namespace

Expected<void> check_limit(double value, std::string_view where, std::string_view name,
                           std::string_view unit) {
  // Squares of limits and of their shares are formed.
  constexpr double least = 1e-150;
  if (value >= least) {
    return {};
  }
  const std::string after = unit.empty() ? std::string() : " " + std::string(unit);
  if (value > 0.0) {
    return refusal(ArgumentError::out_of_range, where, name)
        .got(format_number(value) + after)
        .expected("at least 1e-150, or infinite for no limit");
  }
  return refusal(std::isnan(value) ? ArgumentError::not_finite : ArgumentError::not_positive, where,
                 name)
      .got(format_number(value) + after)
      .expected("positive, or infinite for no limit");
}

PlanarMotion facing_motion(const PathState& state, bool backwards) noexcept {
  const Vector2d p1 = state.first.head<2>();
  const Vector2d p2 = state.second.head<2>();
  const Vector2d p3 = state.third.head<2>();
  const auto cross = [](const Vector2d& a, const Vector2d& b) { return a(0) * b(1) - a(1) * b(0); };
  const double square = p1.squaredNorm();
  const double sigma = std::sqrt(square);
  double c = 1.0;
  double s = 0.0;
  double along = 0.0;
  double turn = 0.0;
  double bend = 0.0;
  if (square > 1e-20 * p2.squaredNorm()) {
    c = p1(0) / sigma;
    s = p1(1) / sigma;
    along = p1.dot(p2) / sigma;
    turn = cross(p1, p2) / square;                                     // θ'
    bend = cross(p1, p3) / square - 2.0 * p1.dot(p2) * turn / square;  // θ''
  } else if (const double a = p2.norm(); a > 0.0) {                    // a cusp: what follows it
    c = p2(0) / a;
    s = p2(1) / a;
    along = a;
    turn = 0.5 * cross(p2, p3) / (a * a);
  }
  const double side = backwards ? -1.0 : 1.0;
  const auto turned = [&](const Vector2d& v) {
    return Vector2d(side * (c * v(0) + s * v(1)), side * (c * v(1) - s * v(0)));
  };
  return {{side * sigma, 0.0, turn}, {side * along, 0.0, bend}, turned(p1), turned(p2), turned(p3)};
}

PlanarMotion holonomic_motion(const PathState& state) noexcept {
  const bool turns = state.position.size() > 2;
  const double theta = turns ? state.position(2) : 0.0;
  const double rate = turns ? state.first(2) : 0.0;
  const double c = std::cos(theta);
  const double s = std::sin(theta);
  const auto turned = [&](const auto& v) {
    return Vector2d(c * v(0) + s * v(1), c * v(1) - s * v(0));
  };
  const Vector2d first = turned(state.first);
  const Vector2d second = turned(state.second);
  return {{first(0), first(1), rate},
          {second(0) + rate * first(1), second(1) - rate * first(0), turns ? state.second(2) : 0.0},
          first,
          second,
          turned(state.third)};
}

Expected<std::vector<std::unique_ptr<MotionLimit>>> motion_limits(
    const Path& path, std::span<const PathConstraint> constraints, std::string_view where) {
  std::vector<std::unique_ptr<MotionLimit>> limits;
  std::size_t regions = 0;
  std::size_t stretches = 0;
  for (const PathConstraint& constraint : constraints) {
    if (const auto* of = std::get_if<CoordinateLimits>(&constraint)) {
      FLYBALL_CHECK(check_coordinate_limits(of->velocity, path, where, "velocity limit"));
      FLYBALL_CHECK(check_coordinate_limits(of->acceleration, path, where, "acceleration limit"));
      FLYBALL_CHECK(check_coordinate_limits(of->jerk, path, where, "jerk limit"));
      limits.push_back(std::make_unique<OfCoordinates>(*of, path.coordinates()));
      continue;
    }
    if (path.coordinates() != 2 && path.coordinates() != 3) {
      return refusal(ArgumentError::wrong_shape, where, "path")
          .got(format("of {} coordinates", path.coordinates()))
          .expected("of two (x, y) or three (x, y, θ), as what limits a robot needs")
          .hint("use limits of the coordinates");
    }
    if (const auto* of = std::get_if<TravelLimits>(&constraint)) {
      FLYBALL_CHECK(check_travel(*of, where));
      limits.push_back(std::make_unique<OfTravel>(*of));
    } else if (const auto* region = std::get_if<RegionLimit>(&constraint)) {
      FLYBALL_CHECK(check_region(*region, ++regions, where));
      limits.push_back(std::make_unique<OfRegion>(*region, regions));
    } else if (const auto* stretch = std::get_if<StretchLimits>(&constraint)) {
      FLYBALL_CHECK(check_travel(stretch->limits, where));
      FLYBALL_CHECK(
          Checks(where).finite(stretch->from, "stretch: from").finite(stretch->to, "stretch: to"));
      if (!(stretch->from <= stretch->to)) {
        return refusal(ArgumentError::out_of_range, where, "stretch: to")
            .got(format_number(stretch->to))
            .expected("from, " + format_number(stretch->from) + ", or more");
      }
      limits.push_back(std::make_unique<OfStretch>(*stretch, ++stretches));
    } else if (const auto* differential = std::get_if<DifferentialDriveLimits>(&constraint)) {
      if (path.coordinates() != 2) {
        return refusal(ArgumentError::wrong_shape, where, "path")
            .got("of three coordinates")
            .expected("of two (x, y): a differential drive faces where it goes");
      }
      FLYBALL_TRY(auto limit, drive_limit(*differential, where));
      limits.push_back(std::move(limit));
    } else if (const auto* swerve = std::get_if<SwerveDriveLimits>(&constraint)) {
      FLYBALL_TRY(auto limit, drive_limit(*swerve, where));
      limits.push_back(std::move(limit));
    } else if (const auto* mecanum = std::get_if<MecanumDriveLimits>(&constraint)) {
      FLYBALL_TRY(auto limit, drive_limit(*mecanum, where));
      limits.push_back(std::move(limit));
    }
  }
  return limits;
}

}  // namespace flyball::detail
