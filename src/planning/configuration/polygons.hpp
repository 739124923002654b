#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/expected.hpp>

namespace flyball::detail {

using Point = std::array<double, 2>;

[[nodiscard]] inline double cross(const Point& o, const Point& a, const Point& b) {
  return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
}

/// Twice the signed area: > 0 counter-clockwise.
[[nodiscard]] double signed_area(const std::vector<Point>& vertices);

/// Without a vertex that repeats its neighbour, counter-clockwise.
[[nodiscard]] std::vector<Point> tidy(std::vector<Point> vertices);

/// At least three different vertices, finite, an area, no crossing edges; at most 1000.
[[nodiscard]] Expected<void> check_polygon(const std::vector<Point>& vertices,
                                           std::string_view where, std::string_view name);

/// Whether a counter-clockwise polygon is convex.
[[nodiscard]] bool is_convex(const std::vector<Point>& vertices);

/// A counter-clockwise polygon as convex pieces: itself, or triangles by ear clipping.
[[nodiscard]] std::vector<std::vector<Point>> convex_pieces(const std::vector<Point>& vertices);

/// The convex hull, counter-clockwise (Andrew's monotone chain).
[[nodiscard]] std::vector<Point> convex_hull(std::vector<Point> points);

}  // namespace flyball::detail
