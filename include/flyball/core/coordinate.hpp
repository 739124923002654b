#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace flyball {

/// A state, an input or an output of a model.
struct Coordinate {
  std::string name{};
  std::string unit{};     ///< SI; empty where it has none.
  bool is_angle = false;  ///< Whether values that differ by 2π are the same; rad.
};

/// "angle (rad)"; the name alone where there is no unit.
[[nodiscard]] std::string label(const Coordinate& coordinate);

/// One label for each.
[[nodiscard]] std::vector<std::string> labels(std::span<const Coordinate> coordinates);

/// What `label` gave, taken apart again; a text that ends in no parentheses is a name without a
/// unit.
[[nodiscard]] Coordinate coordinate_from_label(std::string_view text);

}  // namespace flyball
