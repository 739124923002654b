#pragma once

#include <complex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <flyball/core/expected.hpp>

/// Still pictures, drawn by gnuplot: the same plot gives the same bytes. Colours are told apart by
/// the colour-blind (Okabe and Ito, 2008), legends stand above the data, labels are UTF-8 taken
/// literally (write "m/s²"). Long series are thinned to their extremes per pixel, so that a picture
/// stays small; NaN and infinity are gaps.
namespace flyball {

/// Why there is no picture.
enum class PlotError {
  gnuplot_missing,  ///< There is no gnuplot on this machine.
  gnuplot_failed,   ///< It refused the picture; its own words are the evidence.
  timed_out,        ///< It did not finish within 30 s.
};
[[nodiscard]] ErrorInfo error_info(PlotError code);

/// How a curve is drawn. Several curves of one panel are told apart in grey by their dashes.
enum class LineStyle {
  solid,
  dashed,
  points,
  steps,
  crosses,
  circles,
  squares,
  dash_dot,
  dotted,
  samples,  ///< Points joined by a thin line: few values at whole steps.
};

/// One curve of a panel.
struct PlotLine {
  std::string label = {};  ///< In the legend; empty: not in it.
  std::vector<double> x = {};
  std::vector<double> y = {};  ///< As many as `x`.
  LineStyle style = LineStyle::solid;
  int color = -1;  ///< Index of the palette (0 to 6), so that panels agree; -1: the next one.
};

/// A shaded region between two curves, such as a confidence interval.
struct PlotBand {
  std::string label = {};
  std::vector<double> x = {};
  std::vector<double> low = {};
  std::vector<double> high = {};
  int color = -1;
};

/// A thin line across the panel, such as a limit or an event.
struct PlotMark {
  double at = 0.0;
  std::string label = {};
  bool vertical = false;
};

/// Words beside a point of a panel.
struct PlotNote {
  double x = 0.0;
  double y = 0.0;
  std::string text = {};
};

/// What an axis shows of data that go further.
struct PlotLimits {
  double low = 0.0;
  double high = 1.0;
};

/// One pair of axes. Panels of a plot stand above each other and share the x axis.
struct PlotPanel {
  std::string y_label = {};  ///< With its unit: "Velocity (m/s)".
  std::vector<PlotLine> lines = {};
  std::vector<PlotBand> bands = {};
  std::vector<PlotMark> marks = {};
  bool log_y = false;
  std::vector<PlotNote> notes = {};
  std::optional<PlotLimits> y_limits = {};  ///< Curves are cut there; absent: all is shown.
};

/// A picture of one or more panels above each other.
struct Plot {
  std::string title = {};
  std::string x_label = {};  ///< With its unit: "Time (s)".
  std::vector<PlotPanel> panels = {};
  bool log_x = false;
  bool equal_axes = false;  ///< One unit is as long on x as on y.
  bool unit_circle = false;
  int width = 900;      ///< Pixels.
  int height = 0;       ///< Pixels; 0: what the panels need.
  double x_step = 0.0;  ///< Between two ticks of the x axis; 0: chosen.
};

/// A function of two variables: a surface in perspective, or coloured from above. Viridis, which
/// keeps its order in grey and for the colour-blind (van der Walt and Smith, 2015); NaN stays
/// blank.
struct SurfacePlot {
  std::string title = {};
  std::string x_label = {};  ///< With its unit, as those below.
  std::string y_label = {};
  std::string z_label = {};
  std::vector<double> x = {};
  std::vector<double> y = {};
  std::vector<double> z = {};  ///< z[i * x.size() + j] belongs to (x[j], y[i]).
  bool from_above = false;     ///< Then x and y ascend evenly.
  int width = 900;
  int height = 620;
  bool equal_axes = false;   ///< From above: one unit is as long on x as on y.
  bool unit_circle = false;  ///< From above: drawn over the colours.
  double z_step = 0.0;       ///< From above: between two ticks of the colours; 0: chosen.
  /// From above: maps to the right of this one, in the same colours. Of theirs only the axes, the
  /// data and what is drawn over them count.
  std::vector<SurfacePlot> beside = {};
};

/// Closed-loop or open-loop poles (and zeros) in the complex plane, poles as crosses, zeros as
/// circles; of a discrete system with the unit circle, of a continuous one with the imaginary axis.
struct PolePlotGroup {
  std::string label = {};
  std::vector<std::complex<double>> poles = {};
  std::vector<std::complex<double>> zeros = {};
};
/// A pole map.
/// @param groups  Each with a colour and a legend of its own. @param discrete  Draws the unit
/// circle.
[[nodiscard]] Plot pole_plot(std::string title, const std::vector<PolePlotGroup>& groups,
                             bool discrete);

/// The `<svg>` element as text, fit for an HTML page or a file.
/// @errors PlotError, ArgumentError::wrong_shape (columns of unequal length), out_of_range (size,
/// axes of a map that do not ascend evenly), empty (no panel, no finite value).
/// Cost: starts gnuplot, about 0.1 s.
[[nodiscard]] Expected<std::string> render_svg(const Plot& plot);
[[nodiscard]] Expected<std::string> render_svg(const SurfacePlot& plot);

/// The bytes of a PNG at 1.5 times the size in pixels. @errors As `render_svg`.
[[nodiscard]] Expected<std::string> render_png(const Plot& plot);
[[nodiscard]] Expected<std::string> render_png(const SurfacePlot& plot);

/// The same into a file, atomically. @errors As `render_svg`, and FileError.
[[nodiscard]] Expected<void> write_svg(const std::string& path, const Plot& plot);
[[nodiscard]] Expected<void> write_svg(const std::string& path, const SurfacePlot& plot);
[[nodiscard]] Expected<void> write_png(const std::string& path, const Plot& plot);
[[nodiscard]] Expected<void> write_png(const std::string& path, const SurfacePlot& plot);

}  // namespace flyball
