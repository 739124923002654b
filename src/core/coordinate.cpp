#include <flyball/core/coordinate.hpp>

namespace flyball {

std::string label(const Coordinate& coordinate) {
  return coordinate.unit.empty() ? coordinate.name : coordinate.name + " (" + coordinate.unit + ")";
}

std::vector<std::string> labels(std::span<const Coordinate> coordinates) {
  std::vector<std::string> texts;
  texts.reserve(coordinates.size());
  for (const Coordinate& coordinate : coordinates) {
    texts.push_back(label(coordinate));
  }
  return texts;
}

Coordinate coordinate_from_label(std::string_view text) {
  const std::size_t open = text.rfind(" (");
  if (open == std::string_view::npos || open == 0 || !text.ends_with(')') ||
      open + 3 == text.size()) {
    return {.name = std::string(text)};
  }
  return {.name = std::string(text.substr(0, open)),
          .unit = std::string(text.substr(open + 2, text.size() - open - 3))};
}

}  // namespace flyball
