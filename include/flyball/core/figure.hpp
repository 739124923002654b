#pragma once

#include <complex>
#include <optional>
#include <string>
#include <vector>

/// Pictures as data: what is drawn, not how (flyball/io/plot.hpp draws it). Labels are UTF-8 taken
/// literally and carry their unit: "Velocity (m/s²)".
namespace flyball {

/// How a curve is drawn. Several curves of one panel are told apart in grey by their dashes.
enum class LineStyle {
  solid,
  dashed,
  points,
  steps,
  crosses,
  circles,
  squares,
  frames,    ///< Large squares: around other points.
  diamonds,  ///< Larger still: around those.
  dash_dot,
  dotted,
  samples,  ///< Points joined by a thin line: few values at whole steps.
  guide,    ///< Thin and grey behind the data, such as a grid; axes are not stretched to it.
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

/// A stretch of the x axis that is shaded over the whole panel, such as rows that were not used.
struct PlotSpan {
  double from = 0.0;
  double to = 0.0;
  std::string label = {};  ///< In the legend, once for all of one label; empty: not in it.
};

/// A word in place of a number on an axis.
struct PlotTick {
  double at = 0.0;
  std::string label = {};
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
  std::vector<PlotSpan> spans = {};
  std::vector<PlotTick> y_ticks = {};  ///< In place of numbers; empty: numbers.
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
  /// Plots of one clock are zoomed and read together along x; empty: each alone.
  std::string clock = {};
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
/// A pole map over a grid of equal damping ratios and natural frequencies.
/// @param groups  Each with a colour and a legend of its own; the second's poles are squares that
/// leave room for a cross, the third's diamonds around both, so that equal poles are all seen.
/// @param discrete  Draws the unit circle.
[[nodiscard]] Plot pole_plot(std::string title, const std::vector<PolePlotGroup>& groups,
                             bool discrete);

/// A picture of an answer, and what it shows in words.
struct Figure {
  std::string section = {};  ///< The document's section it belongs to.
  std::string name = {};     ///< Of its files, without extension: "fit_1_quasistatic-forward".
  std::string title = {};
  std::string description = {};  ///< For who cannot see it, and below it for who can.
  Plot plot = {};
};

}  // namespace flyball
