#pragma once

#include <array>
#include <memory>
#include <vector>

#include <flyball/planning/configuration/region.hpp>

namespace flyball::detail {

/// A region as a tree.
struct RegionNode {
  enum class Kind { everything, half_space, interval, polygon, both, either, complement };
  Kind kind = Kind::everything;
  std::vector<double> normal{};  ///< Of a half-space.
  double offset = 0.0;
  int coordinate = 0;  ///< Of an interval; of a polygon the one across.
  double low = 0.0;
  double high = 0.0;
  int up = 0;
  std::vector<std::array<double, 2>> vertices{};
  std::shared_ptr<const RegionNode> a{};
  std::shared_ptr<const RegionNode> b{};
};

}  // namespace flyball::detail
