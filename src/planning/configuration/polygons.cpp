#include <algorithm>
#include <cmath>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "planning/configuration/polygons.hpp"

namespace flyball::detail {

namespace {

/// Whether two closed segments have a point in common.
bool meet(const Point& a, const Point& b, const Point& c, const Point& d) {
  const double c1 = cross(a, b, c);
  const double c2 = cross(a, b, d);
  const double d1 = cross(c, d, a);
  const double d2 = cross(c, d, b);
  if (((c1 > 0.0 && c2 < 0.0) || (c1 < 0.0 && c2 > 0.0)) &&
      ((d1 > 0.0 && d2 < 0.0) || (d1 < 0.0 && d2 > 0.0))) {
    return true;
  }
  const auto on = [](const Point& p, const Point& q, const Point& r) {
    return r[0] >= std::min(p[0], q[0]) && r[0] <= std::max(p[0], q[0]) &&
           r[1] >= std::min(p[1], q[1]) && r[1] <= std::max(p[1], q[1]);
  };
  return (c1 == 0.0 && on(a, b, c)) || (c2 == 0.0 && on(a, b, d)) || (d1 == 0.0 && on(c, d, a)) ||
         (d2 == 0.0 && on(c, d, b));
}

bool in_triangle(const Point& p, const Point& a, const Point& b, const Point& c) {
  return cross(a, b, p) >= 0.0 && cross(b, c, p) >= 0.0 && cross(c, a, p) >= 0.0;
}

}  // namespace

double signed_area(const std::vector<Point>& vertices) {
  double area = 0.0;
  for (std::size_t i = 1; i + 1 < vertices.size(); ++i) {
    area += cross(vertices[0], vertices[i], vertices[i + 1]);
  }
  return area;
}

std::vector<Point> tidy(std::vector<Point> vertices) {
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  while (vertices.size() > 1 && vertices.front() == vertices.back()) {
    vertices.pop_back();
  }
  if (signed_area(vertices) < 0.0) {
    std::reverse(vertices.begin(), vertices.end());
  }
  return vertices;
}

Expected<void> check_polygon(const std::vector<Point>& vertices, std::string_view where,
                             std::string_view name) {
  for (const Point& vertex : vertices) {
    FLYBALL_CHECK(Checks(where).finite(vertex[0], name).finite(vertex[1], name));
  }
  const std::vector<Point> all = tidy(vertices);
  constexpr std::size_t most = 1000;
  if (all.size() < 3 || all.size() > most) {
    return refusal(ArgumentError::out_of_range, where, name)
        .got(format("{} different vertices", all.size()))
        .expected("3 to 1000 vertices");
  }
  double extent = 0.0;
  for (const Point& vertex : all) {
    extent = std::max({extent, std::abs(vertex[0] - all[0][0]), std::abs(vertex[1] - all[0][1])});
  }
  const std::size_t n = all.size();
  const double least = 1e-12 * extent * extent;
  const Point& far = *std::max_element(all.begin(), all.end(), [&](const Point& a, const Point& b) {
    return std::hypot(a[0] - all[0][0], a[1] - all[0][1]) <
           std::hypot(b[0] - all[0][0], b[1] - all[0][1]);
  });
  if (std::all_of(all.begin(), all.end(), [&](const Point& vertex) {
        return !(std::abs(cross(all[0], far, vertex)) > least);
      })) {
    return refusal(ArgumentError::out_of_range, where, name)
        .got("without an area")
        .expected("a polygon whose vertices are not all on a line");
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 2; j < n; ++j) {
      if ((i != 0 || j + 1 != n) && meet(all[i], all[i + 1], all[j], all[(j + 1) % n])) {
        return refusal(ArgumentError::out_of_range, where, name)
            .got(format("a polygon whose edges from ({}, {}) and from ({}, {}) cross or touch",
                        format_number(all[i][0]), format_number(all[i][1]),
                        format_number(all[j][0]), format_number(all[j][1])))
            .expected("its vertices in their order around it")
            .with("vertex", {all[i][0], all[i][1]});
      }
    }
  }
  if (!(std::abs(signed_area(all)) > least)) {
    return refusal(ArgumentError::out_of_range, where, name)
        .got("without an area")
        .expected("a polygon that encloses one");
  }
  return {};
}

bool is_convex(const std::vector<Point>& vertices) {
  const std::size_t n = vertices.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (cross(vertices[i], vertices[(i + 1) % n], vertices[(i + 2) % n]) < 0.0) {
      return false;
    }
  }
  return true;
}

std::vector<std::vector<Point>> convex_pieces(const std::vector<Point>& vertices) {
  if (is_convex(vertices)) {
    return {vertices};
  }
  std::vector<Point> left = vertices;
  std::vector<std::vector<Point>> pieces;
  while (left.size() > 3) {
    const std::size_t n = left.size();
    std::size_t ear = n;
    for (std::size_t i = 0; i < n && ear == n; ++i) {
      const Point& a = left[(i + n - 1) % n];
      const Point& b = left[i];
      const Point& c = left[(i + 1) % n];
      if (!(cross(a, b, c) > 0.0)) {
        continue;
      }
      bool empty = true;
      for (const Point& p : left) {
        empty = empty && (p == a || p == b || p == c || !in_triangle(p, a, b, c));
      }
      ear = empty ? i : n;
    }
    if (ear == n) {
      // Vertices on a line have no triangle of their own.
      for (std::size_t i = 0; i < n && ear == n; ++i) {
        ear = cross(left[(i + n - 1) % n], left[i], left[(i + 1) % n]) == 0.0 ? i : n;
      }
      if (ear == n) {
        break;
      }
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
      continue;
    }
    pieces.push_back({left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  if (left.size() == 3 && signed_area(left) > 0.0) {
    pieces.push_back(left);
  }
  return pieces;
}

std::vector<Point> convex_hull(std::vector<Point> points) {
  std::sort(points.begin(), points.end());
  std::vector<Point> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t base = hull.size();
    for (const Point& p : points) {
      while (hull.size() >= base + 2 && cross(hull[hull.size() - 2], hull.back(), p) <= 0.0) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

}  // namespace flyball::detail
