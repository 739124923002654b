// Where a straight move is in a region: intervals of its parameter, with the boundary or without.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "planning/configuration/polygons.hpp"
#include "planning/configuration/space_model.hpp"

namespace flyball::detail {

namespace {

using Kind = RegionNode::Kind;
using Interval = std::pair<double, double>;
using Intervals = std::vector<Interval>;  // ascending, apart

/// A move, and whether the boundary counts as inside.
struct Move {
  const SpaceModel& model;
  const double* from;
  const double* by;
};

/// How near to the boundary is on it, as a share of the numbers' size.
constexpr double touch = 1e-12;

Intervals merged(Intervals all) {
  std::sort(all.begin(), all.end());
  Intervals to;
  for (const Interval& one : all) {
    if (!to.empty() && one.first <= to.back().second) {
      to.back().second = std::max(to.back().second, one.second);
    } else {
      to.push_back(one);
    }
  }
  return to;
}

/// What is in both; of open ones no single point.
Intervals common(const Intervals& a, const Intervals& b, bool closed) {
  Intervals to;
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    const double low = std::max(a[i].first, b[j].first);
    const double high = std::min(a[i].second, b[j].second);
    if (low < high || (closed && low == high)) {
      to.emplace_back(low, high);
    }
    (a[i].second < b[j].second ? i : j) += 1;
  }
  return to;
}

/// What is left of [0, 1].
Intervals others(const Intervals& all) {
  Intervals to;
  double from = 0.0;
  for (const Interval& one : all) {
    if (one.first > from) {
      to.emplace_back(from, one.first);
    }
    from = std::max(from, one.second);
  }
  if (from < 1.0) {
    to.emplace_back(from, 1.0);
  }
  return to;
}

/// Where value + s slope >= 0; without the boundary > 0.
Intervals above(double value, double slope, double size, bool closed) {
  const double near = touch * size;
  if (std::abs(slope) <= near) {
    return (closed ? std::max(value, value + slope) >= -near
                   : std::min(value, value + slope) > near)
               ? Intervals{{0.0, 1.0}}
               : Intervals{};
  }
  const double shift = closed ? near : -near;
  const double at = -(value + shift) / slope;
  const double low = slope > 0.0 ? std::max(at, 0.0) : 0.0;
  const double high = slope > 0.0 ? 1.0 : std::min(at, 1.0);
  return low < high || (closed && low == high) ? Intervals{{low, high}} : Intervals{};
}

Intervals in_interval(const Move& move, const RegionNode& node, bool closed) {
  const auto k = static_cast<std::size_t>(node.coordinate);
  const SpaceAxis& axis = move.model.axes[k];
  const double q = move.from[k];
  const double by = move.by[k];
  constexpr double turn = 2.0 * std::numbers::pi;
  if (!axis.wraps) {
    const double size = 1.0 + std::abs(q) + std::abs(by);
    Intervals all{{0.0, 1.0}};
    if (node.low > -std::numeric_limits<double>::infinity()) {
      all = common(all, above(q - node.low, by, size + std::abs(node.low), closed), closed);
    }
    if (node.high < std::numeric_limits<double>::infinity()) {
      all = common(all, above(node.high - q, -by, size + std::abs(node.high), closed), closed);
    }
    return all;
  }
  if (node.high - node.low >= turn * (1.0 - 1e-12)) {
    return {{0.0, 1.0}};
  }
  const double first = std::floor((std::min(q, q + by) - node.high) / turn);
  const double last = std::ceil((std::max(q, q + by) - node.low) / turn);
  Intervals all;
  for (double t = first; t <= last; t += 1.0) {
    const double low = node.low + t * turn;
    const double high = node.high + t * turn;
    const double size = 1.0 + std::abs(q) + std::abs(by) + std::abs(low) + std::abs(high);
    const Intervals part =
        common(above(q - low, by, size, closed), above(high - q, -by, size, closed), closed);
    all.insert(all.end(), part.begin(), part.end());
  }
  return merged(all);
}

/// -1 outside, 0 on the boundary, 1 inside.
int place_of(const std::vector<Point>& polygon, const Point& p, double near) {
  bool inside = false;
  const std::size_t n = polygon.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Point& a = polygon[i];
    const Point& b = polygon[(i + 1) % n];
    const double dx = b[0] - a[0];
    const double dy = b[1] - a[1];
    const double squared = dx * dx + dy * dy;
    const double along = std::clamp(((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / squared, 0.0, 1.0);
    if (std::hypot(p[0] - a[0] - along * dx, p[1] - a[1] - along * dy) <= near) {
      return 0;
    }
    if ((a[1] > p[1]) != (b[1] > p[1]) &&
        p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])) {
      inside = !inside;
    }
  }
  return inside ? 1 : -1;
}

Intervals in_one_polygon(const std::vector<Point>& polygon, const Point& from, const Point& by,
                         bool closed) {
  double size = 1.0 + std::abs(from[0]) + std::abs(from[1]) + std::abs(by[0]) + std::abs(by[1]);
  for (const Point& v : polygon) {
    size = std::max(size, std::abs(v[0]) + std::abs(v[1]));
  }
  const double near = touch * size;
  // It can change only where it crosses an edge, or passes the end of one that it runs along.
  std::vector<double> cuts{0.0, 1.0};
  const double squared = by[0] * by[0] + by[1] * by[1];
  const std::size_t n = polygon.size();
  for (std::size_t i = 0; squared > 0.0 && i < n; ++i) {
    const Point& a = polygon[i];
    const Point& b = polygon[(i + 1) % n];
    const double ex = b[0] - a[0];
    const double ey = b[1] - a[1];
    const double turn = by[0] * ey - by[1] * ex;
    if (std::abs(turn) > 1e-15 * std::sqrt(squared * (ex * ex + ey * ey))) {
      cuts.push_back(((a[0] - from[0]) * ey - (a[1] - from[1]) * ex) / turn);
    }
    cuts.push_back(((a[0] - from[0]) * by[0] + (a[1] - from[1]) * by[1]) / squared);
  }
  std::sort(cuts.begin(), cuts.end());
  Intervals all;
  const auto at = [&](double s) { return Point{from[0] + s * by[0], from[1] + s * by[1]}; };
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    const double s = cuts[i];
    if (s < 0.0 || s > 1.0) {
      continue;
    }
    if (closed && place_of(polygon, at(s), near) >= 0) {
      all.emplace_back(s, s);
    }
    if (i + 1 < cuts.size() && cuts[i + 1] > s && s < 1.0) {
      const double end = std::min(cuts[i + 1], 1.0);
      const int place = place_of(polygon, at(0.5 * (s + end)), near);
      if (place > 0 || (place == 0 && closed)) {
        all.emplace_back(s, end);
      }
    }
  }
  if (squared == 0.0 && !closed && place_of(polygon, from, near) > 0) {
    all.emplace_back(0.0, 1.0);
  }
  return merged(all);
}

Intervals in_polygon(const Move& move, const RegionNode& node, bool closed) {
  const auto i = static_cast<std::size_t>(node.coordinate);
  const auto j = static_cast<std::size_t>(node.up);
  const Point from{move.from[i], move.from[j]};
  const Point by{move.by[i], move.by[j]};
  constexpr double turn = 2.0 * std::numbers::pi;
  double low[2] = {node.vertices[0][0], node.vertices[0][1]};
  double high[2] = {low[0], low[1]};
  for (const Point& v : node.vertices) {
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], v[k]);
      high[k] = std::max(high[k], v[k]);
    }
  }
  const auto images = [&](std::size_t k, std::size_t coordinate) {
    if (!move.model.axes[coordinate].wraps) {
      return std::pair(0.0, 0.0);
    }
    return std::pair(std::floor((std::min(from[k], from[k] + by[k]) - high[k]) / turn),
                     std::ceil((std::max(from[k], from[k] + by[k]) - low[k]) / turn));
  };
  const auto [x0, x1] = images(0, i);
  const auto [y0, y1] = images(1, j);
  Intervals all;
  for (double x = x0; x <= x1; x += 1.0) {
    for (double y = y0; y <= y1; y += 1.0) {
      const Intervals part =
          in_one_polygon(node.vertices, {from[0] - x * turn, from[1] - y * turn}, by, closed);
      all.insert(all.end(), part.begin(), part.end());
    }
  }
  return merged(all);
}

Intervals inside(const Move& move, const RegionNode& node, bool closed) {
  switch (node.kind) {
    case Kind::everything:
      return {{0.0, 1.0}};
    case Kind::half_space: {
      double value = node.offset;
      double slope = 0.0;
      double size = 1.0 + std::abs(node.offset);
      for (std::size_t k = 0; k < node.normal.size(); ++k) {
        value -= node.normal[k] * move.from[k];
        slope -= node.normal[k] * move.by[k];
        size += std::abs(node.normal[k]) * (std::abs(move.from[k]) + std::abs(move.by[k]));
      }
      return above(value, slope, size, closed);
    }
    case Kind::interval:
      return in_interval(move, node, closed);
    case Kind::polygon:
      return in_polygon(move, node, closed);
    case Kind::both:
      return common(inside(move, *node.a, closed), inside(move, *node.b, closed), closed);
    case Kind::either: {
      Intervals all = inside(move, *node.a, closed);
      const Intervals more = inside(move, *node.b, closed);
      all.insert(all.end(), more.begin(), more.end());
      return merged(std::move(all));
    }
    case Kind::complement:
      return others(inside(move, *node.a, !closed));
  }
  return {};
}

std::shared_ptr<const RegionNode> make(RegionNode node) {
  return std::make_shared<const RegionNode>(std::move(node));
}

}  // namespace

double first_exit(const SpaceModel& model, const SpaceConstraint& constraint, const double* from,
                  const double* by) {
  const Move move{model, from, by};
  constexpr double none = 2.0;
  if (constraint.forbidden) {
    const Intervals in = inside(move, *constraint.region, false);
    return in.empty() ? none : in.front().first;
  }
  const Intervals in = inside(move, *constraint.region, true);
  if (in.empty() || in.front().first > 0.0) {
    return 0.0;
  }
  return in.front().second >= 1.0 ? none : in.front().second;
}

std::shared_ptr<const RegionNode> beyond_stops(const SpaceModel& model,
                                               const std::shared_ptr<const RegionNode>& node) {
  RegionNode to = *node;
  // The stops as they were before a buffer was taken off.
  struct Stops {
    double low, high, range;
    bool there;
  };
  const auto stops = [&](int coordinate) {
    const auto k = static_cast<std::size_t>(coordinate);
    const SpaceAxis& axis = model.axes[k];
    const double low = axis.low - model.buffer[k];
    const double high = axis.high + model.buffer[k];
    return Stops{low, high, high - low, !axis.wraps};
  };
  switch (node->kind) {
    case Kind::everything:
    case Kind::half_space:
      break;
    case Kind::interval:
      if (const Stops at = stops(to.coordinate); at.there) {
        constexpr double infinite = std::numeric_limits<double>::infinity();
        to.low = to.low <= at.low + touch * at.range ? -infinite : to.low;
        to.high = to.high >= at.high - touch * at.range ? infinite : to.high;
      }
      break;
    case Kind::polygon: {
      std::vector<Point> vertices = tidy(to.vertices);
      for (std::size_t k = 0; k < 2; ++k) {
        const Stops at = stops(k == 0 ? to.coordinate : to.up);
        if (!at.there) {
          continue;
        }
        for (const bool up : {false, true}) {
          const double stop = up ? at.high : at.low;
          const double out = up ? at.high + at.range : at.low - at.range;
          std::vector<Point> all;
          for (std::size_t i = 0; i < vertices.size(); ++i) {
            const Point& a = vertices[i];
            const Point& b = vertices[(i + 1) % vertices.size()];
            all.push_back(a);
            if (std::abs(a[k] - stop) <= touch * at.range &&
                std::abs(b[k] - stop) <= touch * at.range) {
              Point a_out = a;
              Point b_out = b;
              a_out[k] = out;
              b_out[k] = out;
              all.push_back(a_out);
              all.push_back(b_out);
            }
          }
          vertices = std::move(all);
        }
      }
      to.vertices = std::move(vertices);
      break;
    }
    case Kind::both:
    case Kind::either:
      to.a = beyond_stops(model, node->a);
      to.b = beyond_stops(model, node->b);
      break;
    case Kind::complement:
      to.a = beyond_stops(model, node->a);
      break;
  }
  return make(std::move(to));
}

std::shared_ptr<const RegionNode> offset_region(const std::shared_ptr<const RegionNode>& node,
                                                const std::vector<double>& error, bool grow) {
  RegionNode to = *node;
  const double sign = grow ? 1.0 : -1.0;
  switch (node->kind) {
    case Kind::everything:
      break;
    case Kind::half_space:
      for (std::size_t k = 0; k < to.normal.size(); ++k) {
        to.offset += sign * std::abs(to.normal[k]) * error[k];
      }
      break;
    case Kind::interval:
      to.low -= sign * error[static_cast<std::size_t>(to.coordinate)];
      to.high += sign * error[static_cast<std::size_t>(to.coordinate)];
      break;
    case Kind::polygon: {
      const double ex = error[static_cast<std::size_t>(to.coordinate)];
      const double ey = error[static_cast<std::size_t>(to.up)];
      if (ex == 0.0 && ey == 0.0) {
        break;
      }
      // The sum with a rectangle: the polygon, and what the rectangle sweeps along its edges.
      std::shared_ptr<const RegionNode> all = make(std::move(to));
      const std::vector<Point> vertices = tidy(node->vertices);
      for (std::size_t i = 0; i < vertices.size(); ++i) {
        std::vector<Point> corners;
        for (const Point& v : {vertices[i], vertices[(i + 1) % vertices.size()]}) {
          for (const double x : {-ex, ex}) {
            for (const double y : {-ey, ey}) {
              corners.push_back({v[0] + x, v[1] + y});
            }
          }
        }
        RegionNode swept;
        swept.kind = Kind::polygon;
        swept.coordinate = node->coordinate;
        swept.up = node->up;
        swept.vertices = convex_hull(std::move(corners));
        if (swept.vertices.size() < 3) {
          continue;
        }
        RegionNode joined;
        joined.kind = grow ? Kind::either : Kind::both;
        joined.a = all;
        joined.b = make(std::move(swept));
        if (!grow) {
          RegionNode outside;
          outside.kind = Kind::complement;
          outside.a = joined.b;
          joined.b = make(std::move(outside));
        }
        all = make(std::move(joined));
      }
      return all;
    }
    case Kind::both:
    case Kind::either:
      to.a = offset_region(node->a, error, grow);
      to.b = offset_region(node->b, error, grow);
      break;
    case Kind::complement:
      to.a = offset_region(node->a, error, !grow);
      break;
  }
  return make(std::move(to));
}

}  // namespace flyball::detail
