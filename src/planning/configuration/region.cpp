#include <flyball/planning/configuration/region.hpp>

#include <algorithm>
#include <limits>
#include <utility>

#include "planning/configuration/region_node.hpp"

namespace flyball {

using detail::RegionNode;
using Kind = RegionNode::Kind;

Region::Region() : node_(std::make_shared<const RegionNode>()) {}

Region::Region(std::shared_ptr<const RegionNode> node) : node_(std::move(node)) {}

Region Region::half_space(std::vector<double> normal, double offset) {
  RegionNode node;
  node.kind = Kind::half_space;
  node.normal = std::move(normal);
  node.offset = offset;
  return Region(std::make_shared<const RegionNode>(std::move(node)));
}

Region Region::interval(int coordinate, double low, double high) {
  RegionNode node;
  node.kind = Kind::interval;
  node.coordinate = coordinate;
  node.low = low;
  node.high = high;
  return Region(std::make_shared<const RegionNode>(std::move(node)));
}

Region Region::box(const std::vector<double>& low, const std::vector<double>& high) {
  Region all;
  constexpr double infinite = std::numeric_limits<double>::infinity();
  bool first = true;
  // Lists of different lengths bound a coordinate that is not there, which the space refuses.
  for (std::size_t i = 0; i < std::max(low.size(), high.size()); ++i) {
    const double least = i < low.size() ? low[i] : std::numeric_limits<double>::quiet_NaN();
    const double most = i < high.size() ? high[i] : std::numeric_limits<double>::quiet_NaN();
    if (least == -infinite && most == infinite) {
      continue;
    }
    const Region part = interval(static_cast<int>(i), least, most);
    all = first ? part : all & part;
    first = false;
  }
  return all;
}

Region Region::polygon(int across, int up, std::vector<std::array<double, 2>> vertices) {
  RegionNode node;
  node.kind = Kind::polygon;
  node.coordinate = across;
  node.up = up;
  node.vertices = std::move(vertices);
  return Region(std::make_shared<const RegionNode>(std::move(node)));
}

Region Region::both(const Region& a, const Region& b) {
  RegionNode node;
  node.kind = Kind::both;
  node.a = a.node_;
  node.b = b.node_;
  return Region(std::make_shared<const RegionNode>(std::move(node)));
}

Region Region::either(const Region& a, const Region& b) {
  RegionNode node;
  node.kind = Kind::either;
  node.a = a.node_;
  node.b = b.node_;
  return Region(std::make_shared<const RegionNode>(std::move(node)));
}

Region Region::operator!() const {
  RegionNode node;
  node.kind = Kind::complement;
  node.a = node_;
  return Region(std::make_shared<const RegionNode>(std::move(node)));
}

}  // namespace flyball
