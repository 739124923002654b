#pragma once

#include <string>
#include <vector>

/// Drawings that move, as data: what there is to see and where it is, not how it is drawn.
namespace flyball {

/// How a part of a drawing looks.
enum class PartStyle {
  filled,    ///< What moves.
  outlined,  ///< Dashed and empty: where it should be.
  ground,    ///< Thin and grey: what does not move.
};

/// A rigid part of a drawing: its outline in a frame of its own, and where that frame is.
struct MovingPart {
  std::string label = {};      ///< In the legend; empty: not in it.
  std::vector<double> x = {};  ///< Of the outline; NaN lifts the pen.
  std::vector<double> y = {};  ///< As many as `x`.
  PartStyle style = PartStyle::filled;
  int color = 0;  ///< Index of the palette (0 to 6).
  /// Of the frame, at each time of the animation; empty: zero throughout. The angle counts
  /// counter-clockwise, in radians.
  std::vector<double> to_x = {};
  std::vector<double> to_y = {};
  std::vector<double> angle = {};
};

/// A number that is told beside the drawing.
struct TellingValue {
  std::string label = {};
  std::string unit = {};
  std::vector<double> values = {};  ///< At each time of the animation.
};

/// A drawing that moves, along the time of the plots of its clock: both show one moment.
struct Animation {
  std::string section = {};  ///< The document's section it belongs to.
  std::string name = {};
  std::string title = {};
  std::string description = {};        ///< For who cannot see it, and below it for who can.
  std::string clock = {};              ///< As `Plot::clock`.
  std::vector<double> time = {};       ///< s, ascending; between two of them all moves evenly.
  std::vector<MovingPart> parts = {};  ///< From back to front.
  std::vector<TellingValue> values = {};
};

}  // namespace flyball
