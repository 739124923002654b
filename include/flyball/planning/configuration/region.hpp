#pragma once

#include <array>
#include <memory>
#include <vector>

namespace flyball {

namespace detail {
struct RegionNode;
}

/// A part of a configuration space: half-spaces, boxes and polygons, and what unions, intersections
/// and complements make of them.
///
/// Regions are closed: what lies on the boundary belongs to both a region and its complement, so
/// that a path may run along the edge of what is forbidden. Along a coordinate that wraps, a region
/// is there in each turn. A region is a value, copied in constant time; its numbers are checked by
/// the space that takes it (`ConfigurationSpace::require`, `forbid`).
/// Source: book, section 16.1 (half-planes, rectangles, etc.).
class Region {
 public:
  /// Everything.
  Region();

  /// {q : normal·q <= offset}. @param normal  An entry a coordinate, 1/unit; not all 0, and 0 for
  /// coordinates that wrap. @param offset  In the unit of normal·q.
  [[nodiscard]] static Region half_space(std::vector<double> normal, double offset);

  /// {q : low <= q_i <= high}. @param coordinate  i. @param low, high  In its unit; either may be
  /// infinite. Of a coordinate that wraps: from low up to high, in each turn.
  [[nodiscard]] static Region interval(int coordinate, double low, double high);

  /// The points within the bounds of all coordinates. @param low, high  An entry a coordinate; may
  /// be infinite.
  [[nodiscard]] static Region box(const std::vector<double>& low, const std::vector<double>& high);

  /// The points whose coordinates i and j lie in a polygon. @param across, up  i and j.
  /// @param vertices  At least three, in either sense, without crossing edges; (q_i, q_j).
  [[nodiscard]] static Region polygon(int across, int up,
                                      std::vector<std::array<double, 2>> vertices);

  /// What is in both.
  [[nodiscard]] friend Region operator&(const Region& a, const Region& b) { return both(a, b); }
  /// What is in one or the other.
  [[nodiscard]] friend Region operator|(const Region& a, const Region& b) { return either(a, b); }
  /// What is not in it, with the boundary.
  [[nodiscard]] Region operator!() const;

  /// What its parts are; for the library's own use.
  [[nodiscard]] const detail::RegionNode& node() const noexcept { return *node_; }

 private:
  explicit Region(std::shared_ptr<const detail::RegionNode> node);
  static Region both(const Region& a, const Region& b);
  static Region either(const Region& a, const Region& b);

  std::shared_ptr<const detail::RegionNode> node_;
};

}  // namespace flyball
