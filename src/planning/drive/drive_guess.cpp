#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/format.hpp"
#include "planning/drive/drive_guess.hpp"
#include "planning/drive/drive_rules.hpp"

namespace flyball::drive_guess {

using drive_rules::Disc;
using drive_rules::Span;
using drive_transcription::Guess;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

namespace {

constexpr double clearance = 1.15;  // of what has to be kept

/// The way as corners with headings, and where along it the waypoints are.
struct Way {
  std::vector<Vector2d> points{};
  std::vector<double> headings{};
  std::vector<double> arcs{};            ///< m, turning counted as moving by the wheels' distance.
  std::vector<std::size_t> waypoints{};  ///< Points that waypoints are.
};

double wheel_reach(const DriveModel& model) {
  double reach = 0.5 * model.trackwidth;
  for (const Vector2d& wheel : model.wheels) {
    reach = std::max(reach, wheel.norm());
  }
  return std::max(reach, 0.05);
}

bool applies(const DriveProblem& problem, const DriveConstraint& obstacle, std::size_t segment) {
  const Span span = drive_rules::span_of(problem, obstacle);
  const auto s = static_cast<int>(segment);
  return span.from <= s && s + 1 <= span.to;
}

/// How near a straight way comes to a point; where along it.
std::pair<double, double> nearest(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const Vector2d edge = b - a;
  const double square = edge.squaredNorm();
  const double share = square > 0.0 ? std::clamp((p - a).dot(edge) / square, 0.0, 1.0) : 0.0;
  return {(p - a - share * edge).norm(), share};
}

double wrapped(double angle) {
  return std::remainder(angle, 2.0 * std::numbers::pi);
}

std::vector<double> turned_headings(const DriveProblem& problem, bool as_typed) {
  std::vector<double> headings;
  for (const DriveWaypoint& w : problem.waypoints) {
    headings.push_back(headings.empty() || as_typed
                           ? w.heading
                           : headings.back() + wrapped(w.heading - headings.back()));
  }
  // A heading that is not fixed turns evenly between those that are, or looks where it has to.
  for (std::size_t i = 0; i < headings.size(); ++i) {
    if (problem.waypoints[i].fix_heading) {
      continue;
    }
    for (const DriveConstraint& c : problem.constraints) {
      const Span span = drive_rules::span_of(problem, c);
      if (c.kind == DriveConstraintKind::point_at && span.from <= static_cast<int>(i) &&
          static_cast<int>(i) <= span.to) {
        const DriveWaypoint& w = problem.waypoints[i];
        const double look = std::atan2(c.y - w.y, c.x - w.x) + (c.flip ? std::numbers::pi : 0.0);
        const double before = i > 0 ? headings[i - 1] : look;
        headings[i] = before + wrapped(look - before);
      }
    }
  }
  return headings;
}

Way way_of(const DriveProblem& problem, const Choice& choice, const std::vector<double>& headings) {
  Way way;
  const double reach = drive_rules::reach_of(problem.model);
  const bool steers = problem.model.drivetrain == Drivetrain::differential;
  const auto& waypoints = problem.waypoints;
  const auto add = [&](const Vector2d& p, double heading) {
    way.points.push_back(p);
    way.headings.push_back(heading);
  };
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    const Vector2d a(waypoints[i].x, waypoints[i].y);
    way.waypoints.push_back(way.points.size());
    add(a, headings[i]);
    if (i + 1 == waypoints.size()) {
      break;
    }
    const Vector2d b(waypoints[i + 1].x, waypoints[i + 1].y);
    std::vector<std::pair<double, Vector2d>> detours;
    for (std::size_t c = 0; c < problem.constraints.size(); ++c) {
      if (choice.sides[c] == 0 || !applies(problem, problem.constraints[c], i)) {
        continue;
      }
      const Disc disc = drive_rules::disc_of(problem.constraints[c]);
      const auto [gap, share] = nearest(disc.center, a, b);
      const double need = clearance * (disc.radius + reach);
      if (gap >= need || (b - a).norm() < 1e-9) {
        continue;
      }
      const Vector2d along = (b - a).normalized();
      const Vector2d left(-along(1), along(0));
      detours.emplace_back(share, disc.center + choice.sides[c] * need * left);
    }
    std::sort(detours.begin(), detours.end(),
              [](const auto& p, const auto& q) { return p.first < q.first; });
    if (steers && choice.curved && detours.empty() && (b - a).norm() > 1e-9) {
      // A cubic that leaves and arrives along the headings, forwards or backwards.
      const double length = (b - a).norm();
      const auto tangent = [&](std::size_t w) {
        const double h = headings[w];
        Vector2d t(std::cos(h), std::sin(h));
        if (!waypoints[w].fix_heading) {
          t = (b - a) / length;
        }
        return Vector2d(t.dot(b - a) < -0.2 * length ? -length * t : length * t);
      };
      const Vector2d ta = tangent(i);
      const Vector2d tb = tangent(i + 1);
      for (int j = 1; j < 12; ++j) {
        const double s = j / 12.0;
        const double r = 1.0 - s;
        add(r * r * (1.0 + 2.0 * s) * a + s * s * (1.0 + 2.0 * r) * b + s * r * (r * ta - s * tb),
            headings[i] + s * (headings[i + 1] - headings[i]));
      }
    }
    for (const auto& [share, point] : detours) {
      add(point, headings[i] + share * (headings[i + 1] - headings[i]));
    }
  }
  way.arcs.push_back(0.0);
  const double radius = wheel_reach(problem.model);
  for (std::size_t i = 1; i < way.points.size(); ++i) {
    const double moved = (way.points[i] - way.points[i - 1]).norm();
    const double turned = radius * std::abs(way.headings[i] - way.headings[i - 1]);
    way.arcs.push_back(way.arcs.back() + std::max({moved, turned, 1e-6}));
  }
  return way;
}

/// Time and way of a motion from rest to rest: a trapezoid of speed.
struct Trapezoid {
  double length = 0.0, speed = 0.0, acceleration = 0.0, ramp = 0.0, duration = 0.0;

  Trapezoid(double way, double v, double a) : length(way), speed(v), acceleration(a) {
    if (speed * speed / acceleration > length) {
      speed = std::sqrt(length * acceleration);
    }
    ramp = speed / acceleration;
    duration = length / speed + ramp;
  }
  [[nodiscard]] double at(double t) const {
    if (t <= ramp) {
      return 0.5 * acceleration * t * t;
    }
    if (t >= duration - ramp) {
      const double left = duration - t;
      return length - 0.5 * acceleration * left * left;
    }
    return 0.5 * speed * ramp + speed * (t - ramp);
  }
  [[nodiscard]] double when(double s) const {
    const double ramped = 0.5 * speed * ramp;
    if (s <= ramped) {
      return std::sqrt(2.0 * std::max(0.0, s) / acceleration);
    }
    if (s >= length - ramped) {
      return duration - std::sqrt(2.0 * std::max(0.0, length - s) / acceleration);
    }
    return ramp + (s - ramped) / speed;
  }
};

/// A point of the way by its arc.
struct Spot {
  Vector2d point{};
  double heading = 0.0;
};
Spot spot_at(const Way& way, double arc) {
  std::size_t i = 1;
  while (i + 1 < way.arcs.size() && arc > way.arcs[i]) {
    ++i;
  }
  const double share =
      std::clamp((arc - way.arcs[i - 1]) / (way.arcs[i] - way.arcs[i - 1]), 0.0, 1.0);
  return {(1.0 - share) * way.points[i - 1] + share * way.points[i],
          (1.0 - share) * way.headings[i - 1] + share * way.headings[i]};
}

}  // namespace

std::vector<Choice> choices(const DriveProblem& problem, int most) {
  std::vector<std::size_t> in_the_way;
  const double reach = drive_rules::reach_of(problem.model);
  Choice first;
  first.sides.assign(problem.constraints.size(), 0);
  for (std::size_t c = 0; c < problem.constraints.size(); ++c) {
    const DriveConstraint& obstacle = problem.constraints[c];
    if (!drive_rules::is_obstacle(obstacle)) {
      continue;
    }
    const Disc disc = drive_rules::disc_of(obstacle);
    for (std::size_t i = 0; i + 1 < problem.waypoints.size(); ++i) {
      const Vector2d a(problem.waypoints[i].x, problem.waypoints[i].y);
      const Vector2d b(problem.waypoints[i + 1].x, problem.waypoints[i + 1].y);
      if (!applies(problem, obstacle, i) ||
          nearest(disc.center, a, b).first >= clearance * (disc.radius + reach)) {
        continue;
      }
      // Its middle lies to the right: the shorter way is to its left.
      const Vector2d along = b - a;
      const Vector2d to = disc.center - a;
      first.sides[c] = along(0) * to(1) - along(1) * to(0) <= 0.0 ? 1 : -1;
      in_the_way.push_back(c);
      break;
    }
  }
  std::vector<Choice> all{first};
  const bool steers = problem.model.drivetrain == Drivetrain::differential;
  const auto has_room = [&] { return static_cast<int>(all.size()) < most; };
  if (steers && in_the_way.empty() && has_room()) {
    all.push_back(first);
    all.back().curved = false;
  }
  const bool turns_differ = turned_headings(problem, true) != turned_headings(problem, false);
  if (turns_differ && has_room()) {
    all.push_back(first);
    all.back().as_typed = true;
  }
  for (std::size_t mask = 1; mask < (std::size_t{1} << std::min<std::size_t>(in_the_way.size(), 3));
       ++mask) {
    if (!has_room()) {
      break;
    }
    Choice other = first;
    for (std::size_t bit = 0; bit < std::min<std::size_t>(in_the_way.size(), 3); ++bit) {
      if ((mask >> bit & 1U) != 0) {
        other.sides[in_the_way[bit]] *= -1;
      }
    }
    all.push_back(other);
  }
  return all;
}

Guess guess(const DriveProblem& problem, const Choice& choice, std::vector<int>& intervals) {
  const DriveModel& model = problem.model;
  const std::size_t segments = problem.waypoints.size() - 1;
  Guess result;
  result.headings = turned_headings(problem, choice.as_typed);
  const Way way = way_of(problem, choice, result.headings);
  // Several wheels push; where a limit of the middle's speed stands, that counts.
  const double a = 0.7 * model.wheel_count() * model.force() / model.mass;
  double v = 0.8 * model.max_speed;
  for (const DriveConstraint& c : problem.constraints) {
    if (c.kind == DriveConstraintKind::max_velocity && c.to && c.limit > 1e-4) {
      v = std::min(v, c.limit);
    }
  }
  // Runs from stop to stop.
  VectorXd times(static_cast<Index>(problem.waypoints.size()));
  times(0) = 0.0;
  std::vector<std::pair<std::size_t, std::size_t>> runs;
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= segments; ++i) {
    if (i == segments || drive_rules::stops_at(problem, static_cast<int>(i))) {
      runs.emplace_back(begin, i);
      begin = i;
    }
  }
  const auto arc_of = [&](std::size_t waypoint) { return way.arcs[way.waypoints[waypoint]]; };
  std::vector<Trapezoid> motions;
  for (const auto& [from, to] : runs) {
    motions.emplace_back(arc_of(to) - arc_of(from), v, a);
    for (std::size_t i = from + 1; i <= to; ++i) {
      times(static_cast<Index>(i)) =
          times(static_cast<Index>(from)) + motions.back().when(arc_of(i) - arc_of(from));
    }
  }
  result.durations =
      (times.tail(static_cast<Index>(segments)) - times.head(static_cast<Index>(segments)))
          .cwiseMax(2e-3);
  if (intervals.empty()) {
    for (std::size_t i = 0; i < segments; ++i) {
      const int told = problem.waypoints[i].intervals;
      const double wanted = result.durations(static_cast<Index>(i)) / problem.target_interval;
      // An even number: full ahead and full astern meet at a point of the mesh.
      intervals.push_back(
          told > 0 ? told : 2 * std::clamp(static_cast<int>(std::ceil(0.5 * wanted)), 4, 100));
    }
  }
  int N = 0;
  for (const int count : intervals) {
    N += count;
  }
  const bool steers = model.drivetrain == Drivetrain::differential;
  result.states = MatrixXd::Zero(steers ? 5 : 6, N + 1);
  int k = 0;
  for (std::size_t i = 0; i < segments; ++i) {
    std::size_t run = 0;
    while (runs[run].second <= i) {
      ++run;
    }
    const Trapezoid& motion = motions[run];
    const double start = times(static_cast<Index>(runs[run].first));
    const double base = arc_of(runs[run].first);
    const int last = i + 1 == segments ? intervals[i] : intervals[i] - 1;
    for (int j = 0; j <= last; ++j, ++k) {
      const double t = times(static_cast<Index>(i)) +
                       result.durations(static_cast<Index>(i)) * j / intervals[i] - start;
      const Spot here = spot_at(way, base + motion.at(t));
      constexpr double dt = 1e-3;
      const Spot before = spot_at(way, base + motion.at(std::max(0.0, t - dt)));
      const Spot after = spot_at(way, base + motion.at(std::min(motion.duration, t + dt)));
      const Vector2d velocity = (after.point - before.point) / (2.0 * dt);
      const double omega = (after.heading - before.heading) / (2.0 * dt);
      result.states.col(k).head<3>() << here.point, here.heading;
      if (steers) {
        const double speed = velocity.dot(Vector2d(std::cos(here.heading), std::sin(here.heading)));
        result.states(3, k) = speed - 0.5 * model.trackwidth * omega;
        result.states(4, k) = speed + 0.5 * model.trackwidth * omega;
      } else {
        result.states.col(k).tail<3>() << velocity, omega;
      }
    }
  }
  // Its name.
  for (std::size_t c = 0; c < choice.sides.size(); ++c) {
    if (choice.sides[c] != 0) {
      result.name += flyball::detail::format("{}{} of {}", result.name.empty() ? "" : ", ",
                                             choice.sides[c] > 0 ? "left" : "right",
                                             drive_rules::name_of(problem, c));
    }
  }
  if (choice.as_typed) {
    result.name += flyball::detail::format("{}turning as typed", result.name.empty() ? "" : ", ");
  }
  if (result.name.empty()) {
    result.name = steers && choice.curved ? "curved" : "straight";
  }
  return result;
}

}  // namespace flyball::drive_guess
