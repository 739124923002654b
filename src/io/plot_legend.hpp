#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/io/plot.hpp>

/// Strokes, colours and legends of panels; private to io.
namespace flyball::io {

/// Of stretches that are shaded over a whole panel.
inline constexpr std::string_view span_color = "#ECECEC";

/// Of every text of a picture, in its pixels.
inline constexpr int font_size = 14;

/// About how wide a text is in DejaVu Sans, in pixels.
[[nodiscard]] double text_width(std::string_view text, double size);

/// The colours of a panel's bands and then of its lines, as "#0072B2".
[[nodiscard]] std::vector<std::string_view> panel_colors(const PlotPanel& panel);

/// Width and dashes of a line, or shape and size of points, without the colour.
[[nodiscard]] std::string stroke(LineStyle style, std::size_t points);

/// Whether a style has no line.
[[nodiscard]] bool scattered(LineStyle style);

/// A legend as rows of samples and words above a panel. gnuplot's own breaks into columns by
/// another estimate of widths in each terminal, so that its height is not known beforehand.
class Legend {
 public:
  /// @param width  Pixels that a row may have.
  Legend(const PlotPanel& panel, int width);

  [[nodiscard]] int rows() const { return rows_; }

  /// The commands that draw it. @param left, bottom  Pixels from the picture's left and top edge.
  [[nodiscard]] std::string commands(int left, int bottom, int width, int height) const;

  static constexpr int row_height = 22;  ///< Pixels.

 private:
  struct Entry {
    std::string label;
    std::string stroke;
    std::string_view color;
    std::string_view fill;  ///< "transparent solid 0.2" of a band, "solid" of a span; empty: none.
    bool scattered;
    double x;  ///< Pixels from the left edge.
    int row;
  };
  std::vector<Entry> entries_;
  int rows_ = 0;
};

}  // namespace flyball::io
