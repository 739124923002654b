#include <algorithm>
#include <array>
#include <iterator>

#include <fmt/format.h>

#include "io/plot_legend.hpp"
#include "io/plot_script.hpp"

namespace flyball::io {
namespace {

/// Okabe and Ito, "Color universal design" (2008), the yellow left out: it is too light on white.
constexpr std::array<std::string_view, 7> palette = {"#0072B2", "#D55E00", "#009E73", "#CC79A7",
                                                     "#E69F00", "#56B4E9", "#333333"};

// An entry of a legend: its sample, the gap to its words, and the gap to the next one. Pixels.
constexpr double sample_width = 28.0;
constexpr double sample_gap = 8.0;
constexpr double entry_gap = 26.0;

}  // namespace

double text_width(std::string_view text, double size) {
  constexpr std::string_view narrow = " fijlrtI.,:;'|()[]!-";
  constexpr std::string_view wide = "mwMW@%";
  double width = 0.0;
  for (const char c : text) {
    if ((static_cast<unsigned char>(c) & 0xC0) == 0x80) {
      continue;  // within a character of UTF-8
    }
    width += narrow.find(c) != std::string_view::npos ? 0.38
             : wide.find(c) != std::string_view::npos ? 0.92
                                                      : 0.64;
  }
  return width * size;
}

bool scattered(LineStyle style) {
  return style == LineStyle::points || style == LineStyle::crosses || style == LineStyle::circles ||
         style == LineStyle::squares || style == LineStyle::frames || style == LineStyle::diamonds;
}

std::vector<std::string_view> panel_colors(const PlotPanel& panel) {
  std::vector<std::string_view> colors;
  std::size_t next = 0;
  const auto add = [&](int wanted) {
    colors.push_back(
        palette[(wanted >= 0 ? static_cast<std::size_t>(wanted) : next++) % palette.size()]);
  };
  for (const PlotBand& band : panel.bands) {
    add(band.color);
  }
  for (const PlotLine& line : panel.lines) {
    if (line.style == LineStyle::guide) {
      colors.push_back("#C4C4C4");
    } else {
      add(line.color);
    }
  }
  return colors;
}

std::string stroke(LineStyle style, std::size_t points) {
  switch (style) {
    case LineStyle::solid:
    case LineStyle::steps:
      return "lw 1.8";
    case LineStyle::dashed:
      return "lw 1.8 dt (18,8)";
    case LineStyle::dash_dot:
      return "lw 1.8 dt (20,6,4,6)";
    case LineStyle::dotted:
      return "lw 2 dt (4,5)";
    case LineStyle::guide:
      return "lw 0.8";
    case LineStyle::samples:
      return "lw 0.8 pt 7 ps 0.5";
    case LineStyle::crosses:
      return "pt 2 ps 1.2 lw 2";
    case LineStyle::circles:
      return "pt 6 ps 1.2 lw 2";
    case LineStyle::squares:
      return "pt 4 ps 1.2 lw 2";
    case LineStyle::frames:
      return "pt 4 ps 1.9 lw 1.6";
    case LineStyle::diamonds:
      return "pt 12 ps 2.9 lw 1.6";
    case LineStyle::points:
      break;
  }
  return fmt::format("pt 7 ps {}", points > 300 ? 0.22 : points > 60 ? 0.4 : 0.7);
}

Legend::Legend(const PlotPanel& panel, int width) {
  const std::vector<std::string_view> colors = panel_colors(panel);
  double x = 0.0;
  const auto add = [&](const std::string& label, std::string drawn, std::string_view color,
                       std::string_view fill, bool points) {
    if (label.empty()) {
      return;
    }
    const double wide = sample_width + sample_gap + text_width(label, font_size);
    if (rows_ == 0 || x + wide > width) {
      ++rows_;
      x = 0.0;
    }
    entries_.push_back({label, std::move(drawn), color, fill, points, x, rows_ - 1});
    x += wide + entry_gap;
  };
  for (std::size_t i = 0; i < panel.bands.size(); ++i) {
    add(panel.bands[i].label, {}, colors[i], "transparent solid 0.2", false);
  }
  for (std::size_t i = 0; i < panel.lines.size(); ++i) {
    const PlotLine& line = panel.lines[i];
    // One entry, however many points: dots too small to tell their colour are larger here.
    add(line.label, stroke(line.style, 1), colors[panel.bands.size() + i], {},
        scattered(line.style));
  }
  for (auto span = panel.spans.begin(); span != panel.spans.end(); ++span) {
    const auto same = [&](const PlotSpan& other) { return other.label == span->label; };
    if (std::none_of(panel.spans.begin(), span, same)) {
      add(span->label, {}, span_color, "solid", false);
    }
  }
}

std::string Legend::commands(int left, int bottom, int width, int height) const {
  std::string script;
  const auto out = std::back_inserter(script);
  for (const Entry& entry : entries_) {
    const double y = 1.0 - (bottom - 14.0 - row_height * (rows_ - 1 - entry.row)) / height;
    const double from = (left + entry.x) / width;
    const double to = (left + entry.x + sample_width) / width;
    const double half = 6.0 / height;
    if (!entry.fill.empty()) {
      fmt::format_to(out,
                     "set object rectangle from screen {}, screen {} to screen {}, screen {} "
                     "fc rgb '{}' fs {} noborder\n",
                     from, y - half, to, y + half, entry.color, entry.fill);
    } else if (entry.scattered) {
      fmt::format_to(out, "set label '' at screen {}, screen {} point {} lc rgb '{}' front\n",
                     0.5 * (from + to), y, entry.stroke, entry.color);
    } else {
      // Of points joined by a line both are shown.
      const std::size_t point = entry.stroke.find(" pt ");
      fmt::format_to(out,
                     "set arrow from screen {}, screen {} to screen {}, screen {} nohead lc rgb "
                     "'{}' {} front\n",
                     from, y, to, y, entry.color, entry.stroke.substr(0, point));
      if (point != std::string::npos) {
        fmt::format_to(out, "set label '' at screen {}, screen {} point{} lc rgb '{}' front\n",
                       0.5 * (from + to), y, entry.stroke.substr(point), entry.color);
      }
    }
    fmt::format_to(out, "set label {} at screen {}, screen {} left front\n", literal(entry.label),
                   to + sample_gap / width, y);
  }
  return script;
}

}  // namespace flyball::io
