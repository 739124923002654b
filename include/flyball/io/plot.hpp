#pragma once

#include <span>
#include <string>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/core/figure.hpp>

/// Still pictures, drawn by gnuplot: the same plot gives the same bytes. Colours are told apart by
/// the colour-blind (Okabe and Ito, 2008), legends stand above the data, labels are UTF-8 taken
/// literally (write "m/s²"). Long series are thinned to their extremes per pixel, so that a picture
/// stays small; NaN and infinity are gaps.
namespace flyball {

/// Why there is no picture.
enum class PlotError {
  gnuplot_missing,  ///< There is no gnuplot on this machine.
  gnuplot_failed,   ///< It refused the picture; its own words are the evidence.
  timed_out,        ///< It did not finish in time.
  not_a_picture,    ///< It answered something else, or without end.
  no_fonts,         ///< It has no font, and a PNG would lack every word.
};
[[nodiscard]] ErrorInfo error_info(PlotError code);

/// The `<svg>` element as text, fit for an HTML page or a file.
/// @errors PlotError, ArgumentError::wrong_shape (columns of unequal length), out_of_range (size,
/// axes of a map that do not ascend evenly), empty (no panel, no finite value).
/// Of what gnuplot answers only elements that draw are taken. @param seconds  The time it has.
/// Cost: starts gnuplot: about 20 ms, a PNG 80 ms.
[[nodiscard]] Expected<std::string> render_svg(const Plot& plot, double seconds = 30.0);
[[nodiscard]] Expected<std::string> render_svg(const SurfacePlot& plot, double seconds = 30.0);

/// The bytes of a PNG at 1.5 times the size in pixels. @errors As `render_svg`.
[[nodiscard]] Expected<std::string> render_png(const Plot& plot, double seconds = 30.0);
[[nodiscard]] Expected<std::string> render_png(const SurfacePlot& plot, double seconds = 30.0);

/// Several pictures by one gnuplot, each what it is alone, or the reason why there is none:
/// starting gnuplot takes as long as drawing an SVG. @param seconds  What all of them have
/// together.
[[nodiscard]] std::vector<Expected<std::string>> render_svgs(std::span<const Plot* const> plots,
                                                             double seconds = 60.0);
[[nodiscard]] std::vector<Expected<std::string>> render_pngs(std::span<const Plot* const> plots,
                                                             double seconds = 60.0);

/// The same into a file, atomically. @errors As `render_svg`, and FileError.
[[nodiscard]] Expected<void> write_svg(const std::string& path, const Plot& plot);
[[nodiscard]] Expected<void> write_svg(const std::string& path, const SurfacePlot& plot);
[[nodiscard]] Expected<void> write_png(const std::string& path, const Plot& plot);
[[nodiscard]] Expected<void> write_png(const std::string& path, const SurfacePlot& plot);

}  // namespace flyball
