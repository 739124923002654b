// Shapes as paths that can be timed: joints smoothed, headings laid along them.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/planning/path/edit_path.hpp>

#include "core/constants.hpp"
#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "study/path_geometry.hpp"

namespace flyball::study {

namespace {

using Coefficients = SplineSegment::Coefficients;
using Eigen::Vector2d;

/// A polynomial from a place of the shape to another.
struct PathStretch {
  Coefficients c;
  double from = 0.0, to = 0.0;

  [[nodiscard]] SplineEnd at(double t) const { return SplineSegment(c).at(t); }
};

/// cos 3°: more is a corner.
constexpr double straight = 0.9986295347545738;

/// The derivative at an end changed, the places and the other end's derivative kept.
void bend_end(Coefficients& c, bool at_end, const Vector2d& by) {
  if (at_end) {  // t³ - t²
    c.col(2) -= by;
    c.col(3) += by;
  } else {  // t - 2 t² + t³
    c.col(1) += by;
    c.col(2) -= 2.0 * by;
    c.col(3) += by;
  }
}

/// The second derivative at an end changed, all else of both ends kept.
void curve_end(Coefficients& c, bool at_end, const Vector2d& by) {
  const Vector2d half = 0.5 * by;
  if (at_end) {  // t³ (1 - t)²
    c.col(3) += half;
    c.col(4) -= 2.0 * half;
    c.col(5) += half;
  } else {  // t² (1 - t)³
    c.col(2) += half;
    c.col(3) -= 3.0 * half;
    c.col(4) += 3.0 * half;
    c.col(5) -= half;
  }
}

/// The same polynomial over a part of its parameter, [a, b] as [0, 1].
Coefficients part(const Coefficients& c, double a, double b) {
  Coefficients shifted = c;
  for (int k = 0; k < 5; ++k) {  // Horner's scheme, again and again: Taylor's about a
    for (int j = 4; j >= k; --j) {
      shifted.col(j) += a * shifted.col(j + 1);
    }
  }
  double power = 1.0;
  for (int k = 1; k < 6; ++k) {
    power *= b - a;
    shifted.col(k) *= power;
  }
  return shifted;
}

/// How long its control points are, nearly.
double extent(const Coefficients& c) {
  return c.rightCols(5).cwiseAbs().maxCoeff();
}

/// The direction in which a polynomial leaves or arrives, past an end at which it stands still.
Vector2d direction(const Coefficients& c, bool at_end) {
  const double size = extent(c);
  for (const double away : {0.0, 1e-6, 1e-4, 1e-2, 0.1}) {
    const Vector2d d = SplineSegment(c).at(at_end ? 1.0 - away : away).derivative;
    if (d.norm() > 1e-6 * size) {
      return d.normalized();
    }
  }
  return {1.0, 0.0};
}

double length_of(const Coefficients& c) {
  constexpr int steps = 32;
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {  // Simpson's rule
    const auto speed = [&](double t) { return SplineSegment(c).at(t / steps).derivative.norm(); };
    sum += (speed(i) + 4.0 * speed(i + 0.5) + speed(i + 1)) / (6.0 * steps);
  }
  return sum;
}

/// Where inside of a polynomial it stands still and goes back or aside: cusps, as a waypoint that
/// is there twice makes them.
std::vector<double> cusps_of(const Coefficients& c) {
  constexpr int steps = 128;
  constexpr double still = 1e-4;
  const SplineSegment segment(c);
  const auto speed = [&](double t) { return segment.at(t).derivative.squaredNorm(); };
  const double size = extent(c);
  std::vector<double> cusps;
  for (int i = 1; i < steps; ++i) {
    const double middle = static_cast<double>(i) / steps;
    double low = middle - 1.0 / steps;
    double high = middle + 1.0 / steps;
    if (speed(middle) > speed(low) || speed(middle) > speed(high)) {
      continue;
    }
    for (int k = 0; k < 80; ++k) {  // the least speed, by thirds
      const double third = (high - low) / 3.0;
      if (speed(low + third) < speed(high - third)) {
        high -= third;
      } else {
        low += third;
      }
    }
    const double t = 0.5 * (low + high);
    const bool inside = t > 1e-3 && t < 1.0 - 1e-3;
    if (inside && std::sqrt(speed(t)) < still * size &&
        (cusps.empty() || t - cusps.back() > 1e-3)) {
      cusps.push_back(t);
    }
  }
  return cusps;
}

/// @errors ArgumentError::out_of_range for what is too long, empty where nothing moves.
Expected<std::vector<PathStretch>> stretches_of(const RouteShape& shape,
                                                std::vector<Diagnostic>& noticed) {
  constexpr double least = 1e-6;  // m
  constexpr double most = 1e4;
  std::vector<PathStretch> all;
  for (std::size_t i = 0; i < shape.segments.size(); ++i) {
    const Coefficients& c = shape.segments[i].coefficients();
    const double length = c.allFinite() ? length_of(c) : std::nan("");
    if (!(length < most)) {
      return refusal(ArgumentError::out_of_range, shape.source,
                     fmt::format("segment {} of the path", i + 1))
          .got(fmt::format("{} m long", format_number(length, 4)))
          .expected("shorter than 10 km")
          .hint("places are in metres");
    }
    if (length > least) {
      const auto from = static_cast<double>(i);
      std::vector<double> cuts = cusps_of(c);
      if (!cuts.empty()) {
        note(noticed, "cusps", "segment {} of the path stands still inside and turns: a stop there",
             i + 1);
      }
      double before = 0.0;
      cuts.push_back(1.0);
      for (const double cut : cuts) {
        all.push_back({cuts.size() > 1 ? part(c, before, cut) : c, from + before, from + cut});
        before = cut;
      }
    } else {
      warn(noticed, "waypoints_coincide", "waypoints {} and {} are in one place", i + 1, i + 2);
    }
  }
  if (all.empty()) {
    return refusal(ArgumentError::empty, shape.source, "the path")
        .got("all in one place")
        .expected("one that goes somewhere")
        .hint("move a waypoint");
  }
  return all;
}

/// Ends at which a polynomial stands still (a control point on its anchor) get a derivative.
void start_moving(std::vector<PathStretch>& stretches, std::vector<Diagnostic>& noticed) {
  constexpr double still = 1e-3;
  constexpr double share = 0.1;
  std::size_t count = 0;
  for (PathStretch& stretch : stretches) {
    const double size = extent(stretch.c);
    for (const bool at_end : {false, true}) {
      const Vector2d d = stretch.at(at_end ? 1.0 : 0.0).derivative;
      if (d.norm() < still * size) {
        bend_end(stretch.c, at_end, share * size * direction(stretch.c, at_end) - d);
        ++count;
      }
    }
  }
  if (count > 0) {
    note(noticed, "control_on_anchor",
         "{} control {} on {} anchor: moved off it by a few percent of the way to the next", count,
         count == 1 ? "point is" : "points are", count == 1 ? "its" : "their");
  }
}

bool stops_at(const RouteShape& shape, double position) {
  return std::any_of(shape.stops.begin(), shape.stops.end(),
                     [&](double at) { return std::abs(at - position) < 1e-9; });
}

/// Whether each begins a part: after a corner or a stop. Joints that are off by less are smoothed.
std::vector<bool> begins_of(const RouteShape& shape, std::vector<PathStretch>& stretches,
                            std::vector<Diagnostic>& noticed) {
  std::vector<bool> begins(stretches.size(), false);
  constexpr double told = 0.06 * one_degree;
  double most = 0.0;
  std::size_t bent = 0;
  begins[0] = true;
  for (std::size_t i = 1; i < stretches.size(); ++i) {
    PathStretch& a = stretches[i - 1];
    PathStretch& b = stretches[i];
    const Vector2d u = direction(a.c, true);
    const Vector2d v = direction(b.c, false);
    begins[i] = u.dot(v) < straight || stops_at(shape, b.from);
    if (begins[i]) {
      continue;
    }
    const Vector2d common = (u + v).normalized();
    const Vector2d before = a.at(1.0).derivative;
    const Vector2d after = b.at(0.0).derivative;
    bend_end(a.c, true, before.norm() * common - before);
    bend_end(b.c, false, after.norm() * common - after);
    const double angle = (u - v).norm();
    most = std::max(most, angle);
    bent += angle > told ? 1U : 0U;
  }
  if (bent > 0) {
    note(noticed, "corners_smoothed", "{} of its joints {} off by up to {:.2g} degrees: smoothed",
         bent, bent == 1 ? "is" : "are", most / one_degree);
  }
  return begins;
}

double curvature_of(const SplineEnd& end) {
  const double speed = end.derivative.norm();
  return (end.derivative(0) * end.second(1) - end.derivative(1) * end.second(0)) /
         (speed * speed * speed);
}

/// What turns as it goes cannot turn at another rate at once, nor can an acceleration whose growth
/// is limited: where the curvature jumps it changes within 20 cm on both sides.
void round_curvature(std::vector<PathStretch>& stretches, std::vector<bool>& begins,
                     Smoothing smoothing, std::vector<Diagnostic>& noticed) {
  constexpr double within = 0.2;  // m
  constexpr double rounding = 1e-7;
  std::size_t count = 0;
  double farthest = 0.0;
  std::vector<PathStretch> all;
  std::vector<bool> first;
  // How much to change the second derivatives at both ends of each, across them.
  const std::size_t n = stretches.size();
  std::vector<std::array<double, 2>> change(n, {0.0, 0.0});
  for (std::size_t i = 1; i < n; ++i) {
    if (begins[i]) {
      continue;
    }
    const double before = curvature_of(stretches[i - 1].at(1.0));
    const double after = curvature_of(stretches[i].at(0.0));
    if (std::abs(after - before) > rounding * (std::abs(after) + std::abs(before)) + 1e-10) {
      change[i - 1][1] = 0.5 * (after - before);
      change[i][0] = 0.5 * (before - after);
      ++count;
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    const PathStretch& whole = stretches[i];
    const double share = std::min(0.25, within / length_of(whole.c));
    std::vector<double> cuts{0.0};
    if (change[i][0] != 0.0) {
      cuts.push_back(share);
    }
    if (change[i][1] != 0.0) {
      cuts.push_back(1.0 - share);
    }
    cuts.push_back(1.0);
    for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
      const double a = cuts[k];
      const double b = cuts[k + 1];
      PathStretch of{cuts.size() > 2 ? part(whole.c, a, b) : whole.c,
                     whole.from + a * (whole.to - whole.from),
                     whole.from + b * (whole.to - whole.from)};
      for (const bool at_end : {false, true}) {
        const double by =
            at_end ? (k + 2 == cuts.size() ? change[i][1] : 0.0) : (k == 0 ? change[i][0] : 0.0);
        if (by != 0.0) {
          const Vector2d d = of.at(at_end ? 1.0 : 0.0).derivative;
          curve_end(of.c, at_end, by * d.norm() * Vector2d(-d(1), d(0)));
          constexpr double peak = 0.5 * 0.03456;  // t² (1 - t)³ at 2/5
          farthest = std::max(farthest, peak * std::abs(by) * d.squaredNorm());
        }
      }
      first.push_back(k == 0 && begins[i]);
      all.push_back(of);
    }
  }
  stretches = std::move(all);
  begins = std::move(first);
  if (count > 0) {
    note(noticed, "curvature_rounded",
         "the curvature jumps at {} of its joints, where {} would, too: it changes "
         "within 20 cm there, at most {:.2g} mm beside the path",
         count,
         smoothing == Smoothing::wheels ? "the wheels' speeds" : "the acceleration across the path",
         1e3 * farthest);
  }
}

/// Headings by the path's parameter, ascending.
std::vector<PathHeading> headings_of(const RouteShape& shape, const RoutePath& route,
                                     const Path& plane) {
  std::vector<std::pair<double, double>> targets;
  for (const RouteHeading& heading : shape.headings) {
    const bool covered =
        std::any_of(shape.pointing.begin(), shape.pointing.end(), [&](const RoutePointing& zone) {
          return heading.position > zone.from && heading.position < zone.to;
        });
    if (!covered) {
      targets.emplace_back(route.parameter(heading.position), heading.heading);
    }
  }
  for (const RoutePointing& zone : shape.pointing) {
    constexpr double per_segment = 24.0;
    const double from = route.parameter(zone.from);
    const double to = route.parameter(zone.to);
    const int count = std::max(1, static_cast<int>(std::ceil(per_segment * (zone.to - zone.from))));
    for (int k = 0; k <= count; ++k) {
      const double s = from + (to - from) * k / count;
      const Vector2d d = zone.place - Vector2d(plane.position(s));
      targets.emplace_back(s, std::atan2(d(1), d(0)) + zone.offset);
    }
  }
  std::stable_sort(targets.begin(), targets.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<PathHeading> headings;
  const double apart = 1e-6 * plane.parameter_end();
  for (const auto& [s, heading] : targets) {
    if (!headings.empty() && s - headings.back().parameter < apart) {
      headings.back().heading = heading;
    } else {
      headings.push_back({s, heading});
    }
  }
  return headings;
}

}  // namespace

double RoutePath::parameter(double position) const {
  const auto next =
      std::upper_bound(knots.begin(), knots.end(), position,
                       [](double p, const RouteKnot& knot) { return p < knot.position; });
  if (next == knots.begin()) {
    return knots.front().parameter;
  }
  if (next == knots.end()) {
    return knots.back().parameter;
  }
  const RouteKnot& a = *(next - 1);
  const double share = (position - a.position) / (next->position - a.position);
  return a.parameter + share * (next->parameter - a.parameter);
}

Expected<RoutePath> path_of(const RouteShape& shape, Smoothing smoothing,
                            std::vector<Diagnostic>& noticed) {
  FLYBALL_TRY(std::vector<PathStretch> stretches, stretches_of(shape, noticed));
  start_moving(stretches, noticed);
  std::vector<bool> begins = begins_of(shape, stretches, noticed);
  if (smoothing != Smoothing::none) {
    round_curvature(stretches, begins, smoothing, noticed);
  }
  std::vector<PathPiece> pieces;
  double s = 0.0;
  double ahead = 1.0;  // |dp/ds| where the last piece ends
  std::vector<RouteKnot> knots;
  std::vector<double> starts;
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const PathStretch& stretch = stretches[i];
    const double leaves = stretch.at(0.0).derivative.norm();
    const double span = leaves / (begins[i] ? 1.0 : ahead);
    if (begins[i]) {
      starts.push_back(s);
    }
    knots.push_back({stretch.from, s});
    pieces.push_back({Eigen::MatrixXd(stretch.c), span});
    ahead = stretch.at(1.0).derivative.norm() / span;
    s += span;
  }
  knots.push_back({stretches.back().to, s});
  const auto named = [&](Error error) { return std::move(error).in(shape.source); };
  FLYBALL_TRY(Path plane, Path::join(std::move(pieces)).map_error(named));
  RoutePath route{plane, std::move(knots), {}};
  starts.push_back(s);
  for (std::size_t i = 0; i + 1 < starts.size(); ++i) {
    route.parts.emplace_back(starts[i], starts[i + 1]);
  }
  route.parts.back().second = plane.parameter_end();
  if (!shape.headings.empty()) {
    const std::vector<PathHeading> headings = headings_of(shape, route, plane);
    FLYBALL_TRY(route.path, with_headings(plane, headings).map_error(named));
  }
  return route;
}

}  // namespace flyball::study
