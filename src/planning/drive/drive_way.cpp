#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "planning/drive/drive_rules.hpp"
#include "planning/drive/drive_way.hpp"

namespace flyball::drive_way {

using drive_rules::Disc;
using drive_rules::Span;
using Eigen::Vector2d;

namespace {

constexpr double clearance = 1.15;  // of what has to be kept
constexpr double pi = std::numbers::pi;

double wrapped(double angle) {
  return std::remainder(angle, 2.0 * pi);
}
Vector2d direction(double angle) {
  return {std::cos(angle), std::sin(angle)};
}
double angle_of(const Vector2d& v) {
  return std::atan2(v(1), v(0));
}
Vector2d place_of(const DriveWaypoint& w) {
  return {w.x, w.y};
}
bool steers(const DriveProblem& problem) {
  return problem.model.drivetrain == Drivetrain::differential;
}

/// A place that the spline goes through.
struct Knot {
  Vector2d point{};
  std::optional<Vector2d> tangent{};  ///< Of length 1, where it is given.
  std::size_t segment = 0;            ///< That begins at it or holds it.
  int waypoint = -1;
};

/// The derivatives of a C2 cubic spline over the chords' lengths, straight at free ends: each
/// interior row says that the second derivative is the same from both sides.
/// Source: Nurnberger, de Boor, "A practical guide to splines" (2001), chapter 4, equation (6).
std::vector<Vector2d> tangents_of(const std::vector<Knot>& knots) {
  const std::size_t n = knots.size();
  std::vector<double> below(n, 0.0), middle(n, 1.0), above(n, 0.0);
  std::vector<Vector2d> right(n, Vector2d::Zero());
  const auto chord = [&](std::size_t i) -> Vector2d { return knots[i + 1].point - knots[i].point; };
  const auto length = [&](std::size_t i) { return std::max(1e-3, chord(i).norm()); };
  for (std::size_t i = 0; i < n; ++i) {
    if (knots[i].tangent) {
      right[i] = *knots[i].tangent;
      continue;
    }
    middle[i] = 0.0;
    if (i > 0) {
      const double h = length(i - 1);
      below[i] = 1.0 / h;
      middle[i] += 2.0 / h;
      right[i] += 3.0 * chord(i - 1) / (h * h);
    }
    if (i + 1 < n) {
      const double h = length(i);
      above[i] = 1.0 / h;
      middle[i] += 2.0 / h;
      right[i] += 3.0 * chord(i) / (h * h);
    }
  }
  for (std::size_t i = 1; i < n; ++i) {  // diagonally dominant: no pivoting
    const double factor = below[i] / middle[i - 1];
    middle[i] -= factor * above[i - 1];
    right[i] -= factor * right[i - 1];
  }
  std::vector<Vector2d> tangents(n);
  for (std::size_t i = n; i-- > 0;) {
    tangents[i] = right[i];
    if (i + 1 < n) {
      tangents[i] -= above[i] * tangents[i + 1];
    }
    tangents[i] /= middle[i];
  }
  return tangents;
}

/// A spline as points.
struct Line {
  std::vector<Vector2d> points{}, tangents{};
  std::vector<std::size_t> knots{};  ///< The knot that a point is at or behind.
};

Line line_of(const std::vector<Knot>& knots) {
  constexpr double spacing = 0.12;  // m
  const std::vector<Vector2d> m = tangents_of(knots);
  Line line;
  for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
    const Vector2d a = knots[i].point;
    const Vector2d b = knots[i + 1].point;
    const double h = std::max(1e-3, (b - a).norm());
    const int count = std::clamp(static_cast<int>(std::ceil(h / spacing)), 4, 100);
    for (int j = 0; j < count; ++j) {
      const double s = static_cast<double>(j) / count;
      const double r = 1.0 - s;
      line.points.emplace_back(r * r * (1.0 + 2.0 * s) * a + s * s * (1.0 + 2.0 * r) * b +
                               s * r * h * (r * m[i] - s * m[i + 1]));
      line.tangents.emplace_back(6.0 * s * r * (b - a) / h + r * (1.0 - 3.0 * s) * m[i] +
                                 s * (1.0 - 3.0 * r) * m[i + 1]);
      line.knots.push_back(i);
    }
  }
  line.points.push_back(knots.back().point);
  line.tangents.push_back(m.back());
  line.knots.push_back(knots.size() - 1);
  return line;
}

/// Puts places beside obstacles between the knots until their spline is clear of them.
void avoid(const DriveProblem& problem, const Choice& choice, std::vector<Knot>& knots) {
  constexpr int most_places = 12;
  std::vector<std::pair<std::size_t, std::size_t>> passed;  // obstacle and segment
  for (int round = 0; round < most_places; ++round) {
    const Line line = line_of(knots);
    double worst = 0.02;
    std::optional<std::pair<std::size_t, Knot>> place;
    std::pair<std::size_t, std::size_t> met;
    for (std::size_t k = 0; k < line.points.size(); ++k) {
      const std::size_t at = line.knots[k];
      const std::size_t s = knots[at].segment;
      if (at + 1 == knots.size()) {
        break;
      }
      for (std::size_t c = 0; c < problem.constraints.size(); ++c) {
        const DriveConstraint& obstacle = problem.constraints[c];
        if (!drive_rules::is_obstacle(obstacle) || !applies(problem, obstacle, s)) {
          continue;
        }
        const Disc disc = drive_rules::disc_of(obstacle);
        const Vector2d a = place_of(problem.waypoints[s]);
        const Vector2d b = place_of(problem.waypoints[s + 1]);
        // No more than the waypoints themselves keep.
        const double need = std::min({berth(problem, obstacle), 0.98 * (a - disc.center).norm(),
                                      0.98 * (b - disc.center).norm()});
        const Vector2d off = line.points[k] - disc.center;
        const double inside = need - off.norm();
        if (inside <= worst) {
          continue;
        }
        const bool is_passed =
            std::find(passed.begin(), passed.end(), std::pair(c, s)) != passed.end();
        Vector2d to = off.norm() > 1e-6 ? Vector2d(off.normalized()) : Vector2d(0.0, 1.0);
        if (!is_passed && choice.sides[c] != 0 && (b - a).norm() > 1e-9) {
          const Vector2d along = (b - a).normalized();
          to = choice.sides[c] * Vector2d(-along(1), along(0));
        }
        worst = inside;
        met = {c, s};
        place = std::pair(at + 1, Knot{.point = disc.center + need * to, .segment = s});
      }
    }
    if (!place) {
      return;
    }
    passed.push_back(met);
    knots.insert(knots.begin() + static_cast<std::ptrdiff_t>(place->first), place->second);
  }
}

/// Waypoints from stop to stop.
std::vector<std::pair<std::size_t, std::size_t>> runs_of(const DriveProblem& problem) {
  std::vector<std::pair<std::size_t, std::size_t>> runs;
  std::size_t begin = 0;
  for (std::size_t i = 1; i < problem.waypoints.size(); ++i) {
    if (i + 1 == problem.waypoints.size() || drive_rules::stops_at(problem, static_cast<int>(i))) {
      runs.emplace_back(begin, i);
      begin = i;
    }
  }
  return runs;
}

/// Whether what steers goes forwards (1) or backwards (-1) from a stop to the next: as most of the
/// headings on the way look.
int end_of(const DriveProblem& problem, std::size_t from, std::size_t to) {
  double sum = 0.0;
  for (std::size_t i = from; i <= to; ++i) {
    const DriveWaypoint& w = problem.waypoints[i];
    if (w.fix_heading) {
      const Vector2d before = place_of(problem.waypoints[std::max(i, from + 1) - 1]);
      const Vector2d after = place_of(problem.waypoints[std::min(i + 1, to)]);
      const Vector2d way = after - before;
      sum += way.norm() > 1e-9 ? direction(w.heading).dot(way.normalized()) : 0.0;
    }
  }
  return sum < 0.0 ? -1 : 1;
}

std::vector<Knot> knots_of(const DriveProblem& problem, const Choice& choice, std::size_t from,
                           std::size_t to, int end) {
  std::vector<Knot> knots;
  for (std::size_t i = from; i <= to; ++i) {
    const DriveWaypoint& w = problem.waypoints[i];
    Knot knot{.point = place_of(w),
              .segment = std::min(i, problem.waypoints.size() - 2),
              .waypoint = static_cast<int>(i)};
    const bool moves = !drive_rules::stops_at(problem, static_cast<int>(i));
    if (steers(problem) && w.fix_heading && (choice.curved || moves)) {
      knot.tangent = end * direction(w.heading);
    }
    knots.push_back(knot);
  }
  avoid(problem, choice, knots);
  return knots;
}

/// Where waypoints look, of what moves sideways: as they are fixed, at what they have to look at,
/// and else as their neighbours do.
std::vector<std::optional<double>> looks_of(const DriveProblem& problem, bool as_typed) {
  std::vector<std::optional<double>> looks;
  std::optional<double> before;
  for (std::size_t i = 0; i < problem.waypoints.size(); ++i) {
    const DriveWaypoint& w = problem.waypoints[i];
    std::optional<double> look;
    if (w.fix_heading) {
      look = as_typed || !before ? w.heading : *before + wrapped(w.heading - *before);
    } else {
      for (const DriveConstraint& c : problem.constraints) {
        const Span span = drive_rules::span_of(problem, c);
        if (c.kind == DriveConstraintKind::point_at && span.from <= static_cast<int>(i) &&
            static_cast<int>(i) <= span.to) {
          const double seen = angle_of(Vector2d(c.x, c.y) - place_of(w)) + (c.flip ? pi : 0.0);
          look = before ? *before + wrapped(seen - *before) : seen;
        }
      }
    }
    looks.push_back(look);
    before = look ? look : before;
  }
  return looks;
}

/// Writes the headings of what moves sideways along points that are there.
void look_along(const DriveProblem& problem, const Choice& choice, Way& way) {
  const auto looks = looks_of(problem, choice.as_typed);
  std::vector<double> lengths{0.0};
  for (std::size_t k = 1; k < way.points.size(); ++k) {
    // Where it stands, evenly.
    lengths.push_back(lengths.back() + std::max(1e-6, (way.points[k] - way.points[k - 1]).norm()));
  }
  std::vector<std::pair<double, double>> said;  // length and heading
  for (std::size_t i = 0; i < looks.size(); ++i) {
    if (looks[i]) {
      said.emplace_back(lengths[way.waypoints[i]], *looks[i]);
    }
  }
  if (said.empty()) {
    said.emplace_back(0.0, problem.waypoints.front().heading);
  }
  way.headings.assign(way.points.size(), said.front().second);
  std::size_t next = 0;
  for (std::size_t k = 0; k < way.points.size(); ++k) {
    while (next < said.size() && said[next].first < lengths[k]) {
      ++next;
    }
    if (next == 0 || next == said.size()) {
      way.headings[k] = next == 0 ? said.front().second : said.back().second;
      continue;
    }
    const auto& [a, from] = said[next - 1];
    const auto& [b, to] = said[next];
    way.headings[k] = from + (to - from) * (lengths[k] - a) / std::max(1e-9, b - a);
  }
  for (const DriveConstraint& c : problem.constraints) {
    const Span span = drive_rules::span_of(problem, c);
    if (c.kind != DriveConstraintKind::point_at || span.from == span.to) {
      continue;
    }
    const std::size_t first = way.waypoints[static_cast<std::size_t>(span.from)];
    const std::size_t last = way.waypoints[static_cast<std::size_t>(span.to)];
    for (std::size_t k = first + 1; k < last; ++k) {
      const double seen = angle_of(Vector2d(c.x, c.y) - way.points[k]) + (c.flip ? pi : 0.0);
      way.headings[k] = way.headings[k - 1] + wrapped(seen - way.headings[k - 1]);
    }
  }
}

/// A point of what steers that turns where it stands.
void turn_to(double heading, Way& way) {
  constexpr double step = 0.1;  // rad
  const Vector2d at = way.points.back();
  const double from = way.headings.back();
  const double turn = wrapped(heading - from);
  const int count = static_cast<int>(std::ceil(std::abs(turn) / step));
  for (int j = 1; j <= count; ++j) {
    way.points.push_back(at);
    way.headings.push_back(from + turn * j / count);
  }
}

}  // namespace

bool applies(const DriveProblem& problem, const DriveConstraint& constraint, std::size_t segment) {
  const Span span = drive_rules::span_of(problem, constraint);
  const auto s = static_cast<int>(segment);
  return span.from <= s && s + 1 <= span.to;
}

Approach nearest(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const Vector2d edge = b - a;
  const double square = edge.squaredNorm();
  const double share = square > 0.0 ? std::clamp((p - a).dot(edge) / square, 0.0, 1.0) : 0.0;
  return {(p - a - share * edge).norm(), share};
}

double berth(const DriveProblem& problem, const DriveConstraint& obstacle) {
  return clearance * (drive_rules::disc_of(obstacle).radius + drive_rules::reach_of(problem.model));
}

Way way_of(const DriveProblem& problem, const Choice& choice) {
  Way way;
  way.waypoints.assign(problem.waypoints.size(), 0);
  for (const auto& [from, to] : runs_of(problem)) {
    const int end = (choice.other_end ? -1 : 1) * end_of(problem, from, to);
    const std::vector<Knot> knots = knots_of(problem, choice, from, to, end);
    const Line line = line_of(knots);
    for (std::size_t k = 0; k < line.points.size(); ++k) {
      const bool at_knot = k == 0 || line.knots[k] != line.knots[k - 1];
      const int waypoint = at_knot ? knots[line.knots[k]].waypoint : -1;
      const bool begins = k == 0;
      if (!steers(problem)) {
        if (begins && !way.points.empty()) {
          continue;  // where the run before ended
        }
        way.points.push_back(line.points[k]);
        way.headings.push_back(0.0);
      } else {
        const Vector2d look = end * line.tangents[k];
        const double before = way.headings.empty() ? 0.0 : way.headings.back();
        const double heading =
            look.norm() > 1e-9 ? before + wrapped(angle_of(look) - before) : before;
        if (begins && way.points.empty()) {
          const DriveWaypoint& w = problem.waypoints[from];
          way.points.push_back(line.points[k]);
          way.headings.push_back(w.fix_heading ? w.heading : heading);
        }
        if (begins) {
          turn_to(heading, way);
          continue;
        }
        way.points.push_back(line.points[k]);
        way.headings.push_back(heading);
      }
      if (waypoint > static_cast<int>(from) || (begins && from == 0)) {
        const DriveWaypoint& w = problem.waypoints[static_cast<std::size_t>(waypoint)];
        if (steers(problem) && w.fix_heading && waypoint == static_cast<int>(to)) {
          turn_to(w.heading, way);
        }
        way.waypoints[static_cast<std::size_t>(waypoint)] = way.points.size() - 1;
      }
    }
  }
  if (!steers(problem)) {
    look_along(problem, choice, way);
  }
  const double reach = drive_rules::wheel_reach_of(problem.model);
  way.arcs.push_back(0.0);
  for (std::size_t k = 1; k < way.points.size(); ++k) {
    const double moved = (way.points[k] - way.points[k - 1]).norm();
    const double turned = reach * std::abs(way.headings[k] - way.headings[k - 1]);
    way.arcs.push_back(way.arcs.back() + std::max({moved, turned, 1e-6}));
  }
  return way;
}

Timing time_way(const DriveProblem& problem, const Way& way) {
  constexpr double share = 0.9;   // of speeds
  constexpr double effort = 0.8;  // of forces
  constexpr double gravity = 9.80665;
  const DriveModel& model = problem.model;
  const std::size_t n = way.points.size();
  const double reach = drive_rules::wheel_reach_of(model);
  const double wheels = model.wheel_count();
  const double force = effort * wheels * model.force();
  double across = steers(problem) ? 2.0 * gravity : force / model.mass;
  if (steers(problem) && model.friction > 0.0) {
    across = effort * wheels * model.friction / model.mass;
  }
  struct Stretch {
    double length = 0.0, moved = 0.0, turned = 0.0;  ///< m; of the length, 1 and rad/m
    double cap = 0.0, acceleration = 0.0;            ///< of the arc
  };
  std::vector<Stretch> stretches(n - 1);
  std::vector<double> caps(n, 1e3);
  std::size_t segment = 0;
  for (std::size_t k = 0; k + 1 < n; ++k) {
    while (segment + 2 < way.waypoints.size() && k >= way.waypoints[segment + 1]) {
      ++segment;
    }
    Stretch& s = stretches[k];
    s.length = way.arcs[k + 1] - way.arcs[k];
    s.moved = (way.points[k + 1] - way.points[k]).norm() / s.length;
    s.turned = std::abs(way.headings[k + 1] - way.headings[k]) / s.length;
    s.cap = share * model.max_speed / std::max(0.1, s.moved + reach * s.turned);
    s.acceleration =
        force * std::hypot(s.moved, reach * s.turned) /
        (model.mass * s.moved * s.moved + model.moment_of_inertia * s.turned * s.turned + 1e-9);
    s.acceleration = std::max(s.acceleration, 0.1 * force / model.mass);
    for (const DriveConstraint& c : problem.constraints) {
      if (!c.to || !applies(problem, c, segment) || c.limit < 1e-3) {
        continue;
      }
      if (c.kind == DriveConstraintKind::max_velocity) {
        s.cap = std::min(s.cap, share * c.limit / std::max(1e-3, s.moved));
      } else if (c.kind == DriveConstraintKind::max_angular_velocity) {
        s.cap = std::min(s.cap, share * c.limit / std::max(1e-3, s.turned));
      } else if (c.kind == DriveConstraintKind::max_acceleration) {
        s.acceleration = std::min(s.acceleration, share * c.limit / std::max(1e-2, s.moved));
        across = std::min(across, share * c.limit);
      }
    }
    caps[k] = std::min(caps[k], s.cap);
    caps[k + 1] = std::min(caps[k + 1], s.cap);
  }
  // v² κ of the middle where the way bends; what stands to turn does not move.
  std::vector<double> bends(n, 0.0);
  for (std::size_t k = 1; k + 1 < n; ++k) {
    const Vector2d a = way.points[k] - way.points[k - 1];
    const Vector2d b = way.points[k + 1] - way.points[k];
    if (a.norm() > 1e-6 && b.norm() > 1e-6) {
      const double bend = std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0, 1.0));
      const double moved = std::max(stretches[k].moved, stretches[k - 1].moved);
      bends[k] = moved * moved * 2.0 * bend / (a.norm() + b.norm());
      caps[k] = std::min(caps[k], std::sqrt(across / std::max(1e-9, bends[k])));
    } else if (steers(problem) && (a.norm() > 1e-6 || b.norm() > 1e-6)) {
      caps[k] = 0.0;
    }
  }
  for (std::size_t i = 0; i < problem.waypoints.size(); ++i) {
    double& cap = caps[way.waypoints[i]];
    if (drive_rules::stops_at(problem, static_cast<int>(i))) {
      cap = 0.0;
    }
    for (const DriveConstraint& c : problem.constraints) {
      const Span span = drive_rules::span_of(problem, c);
      if (c.kind == DriveConstraintKind::max_velocity && span.from <= static_cast<int>(i) &&
          static_cast<int>(i) <= span.to) {
        cap = std::min(cap, c.limit);
      }
    }
  }
  Timing timing;
  timing.speeds = caps;
  const auto reached = [&](double speed, const Stretch& s, double bend, bool pushes) {
    double a = s.acceleration;
    if (pushes && model.free_speed > 0.0) {  // the motors' line
      const double wheel = speed * (s.moved + reach * s.turned);
      const double most = model.stall_force * std::max(0.05, 1.0 - wheel / model.free_speed);
      a *= std::min(1.0, most / model.force());
    }
    const double side = speed * speed * bend / across;  // what pushes aside does not push ahead
    a *= std::sqrt(std::max(0.05, 1.0 - side * side));
    return std::sqrt(speed * speed + 2.0 * a * s.length);
  };
  for (std::size_t k = 0; k + 1 < n; ++k) {
    timing.speeds[k + 1] =
        std::min(timing.speeds[k + 1], reached(timing.speeds[k], stretches[k], bends[k], true));
  }
  for (std::size_t k = n - 1; k-- > 0;) {
    timing.speeds[k] = std::min(timing.speeds[k],
                                reached(timing.speeds[k + 1], stretches[k], bends[k + 1], false));
  }
  timing.times.push_back(0.0);
  for (std::size_t k = 0; k + 1 < n; ++k) {
    const double sum = timing.speeds[k] + timing.speeds[k + 1];
    const double least = 2.0 * std::sqrt(stretches[k].length / stretches[k].acceleration);
    timing.times.push_back(timing.times.back() +
                           (sum > 1e-6 ? 2.0 * stretches[k].length / sum : least));
  }
  return timing;
}

double intrusion(const DriveProblem& problem, const Way& way) {
  constexpr std::size_t instants = 60;
  const std::size_t stride = std::max<std::size_t>(1, way.points.size() / instants);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(6);
  const Eigen::VectorXd u = Eigen::VectorXd::Zero(8);
  double worst = 0.0;
  std::size_t segment = 0;
  for (std::size_t k = 0; k < way.points.size(); k += stride) {
    while (segment + 2 < way.waypoints.size() && k >= way.waypoints[segment + 1]) {
      ++segment;
    }
    x.head<3>() << way.points[k], way.headings[k];
    for (const DriveConstraint& c : problem.constraints) {
      const bool area = drive_rules::is_obstacle(c) ||
                        c.kind == DriveConstraintKind::keep_in_rectangle ||
                        c.kind == DriveConstraintKind::keep_in_circle ||
                        c.kind == DriveConstraintKind::keep_in_polygon;
      if (area && applies(problem, c, segment)) {
        worst = std::max(worst, drive_rules::excess(problem, c, x, u).amount);
      }
    }
  }
  return worst;
}

}  // namespace flyball::drive_way
