#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "core/try.hpp"
#include "io/plot_data.hpp"
#include "io/plot_labels.hpp"
#include "io/plot_legend.hpp"
#include "io/plot_script.hpp"
#include "io/text.hpp"

namespace flyball::io {
namespace {

// The layout in pixels.
constexpr int left_margin = 108;
constexpr int right_margin = 28;
constexpr int title_height = 40;
constexpr int bottom_margin = 66;
constexpr int panel_gap = 14;

constexpr int x_tick_pixels = 80;  ///< At least, from one tick to the next.
constexpr int y_tick_pixels = 34;

constexpr int label_size = 12;  ///< Of what stands beside marks, pixels.

constexpr std::size_t max_scatter = 4000;

Expected<void> check_lengths(const std::string& label, std::size_t x, std::size_t y) {
  if (x != y) {
    return refusal(ArgumentError::wrong_shape, "plot", fmt::format("the curve \"{}\"", label))
        .got(fmt::format("{} x and {} y long", x, y))
        .expected("as long in x as in y");
  }
  return {};
}

Expected<void> check(const Plot& plot) {
  if (plot.panels.empty()) {
    return refusal(ArgumentError::empty, "plot", "panels");
  }
  if (plot.width < 200 || plot.width > 8000 || plot.height < 0 || plot.height > 8000) {
    return refusal(ArgumentError::out_of_range, "plot", "the size")
        .got(fmt::format("{}x{} pixels", plot.width, plot.height))
        .expected("200 to 8000 wide and at most 8000 high");
  }
  for (const PlotPanel& panel : plot.panels) {
    for (const PlotLine& line : panel.lines) {
      if (Expected<void> ok = check_lengths(line.label, line.x.size(), line.y.size()); !ok) {
        return ok;
      }
    }
    for (const PlotBand& band : panel.bands) {
      Expected<void> ok = check_lengths(band.label, band.x.size(), band.low.size());
      if (ok) {
        ok = check_lengths(band.label, band.x.size(), band.high.size());
      }
      if (!ok) {
        return ok;
      }
    }
  }
  return {};
}

class Script {
 public:
  explicit Script(const Plot& plot)
      : plot_(plot),
        x_(plot.log_x),
        left_(left_of(plot)),
        box_width_(plot.width - left_ - right_margin) {}

  std::string build(PictureFormat format) {
    lay_out();
    script_ = script_head(format, plot_.width, height_);
    // Data first: gnuplot does not take data blocks inside a multiplot's plot command.
    for (const PlotPanel& panel : plot_.panels) {
      for (const PlotBand& band : panel.bands) {
        add_band(band);
      }
      for (const PlotLine& line : panel.lines) {
        add_line(line, panel.log_y);
      }
    }
    if (plot_.unit_circle) {
      add_unit_circle();
    }
    fmt::format_to(out(),
                   "set multiplot\nset border 3 lc rgb '#555555' lw 1\n"
                   "set tics out nomirror textcolor rgb '#333333' scale 0.6\n"
                   "set grid xtics ytics lc rgb '#DDDDDD' lw 1 lt 1\nset style fill noborder\n"
                   "unset key\nset xrange [{}:{}]\n{}",
                   x_.low(), x_.high(),
                   plot_.x_step > 0.0 ? fmt::format("set xtics {}\n", plot_.x_step)
                                      : ticks('x', x_, box_width_ / x_tick_pixels, plot_.log_x));
    if (plot_.log_x) {
      script_ += "set logscale x\n";
    }
    if (!plot_.title.empty()) {
      fmt::format_to(out(), "set label 1 {} at screen 0.5, screen {} center font ',{}'\n",
                     literal(plot_.title), 1.0 - 22.0 / height_,
                     title_size(plot_.title, plot_.width));
    }
    for (std::size_t i = 0; i < plot_.panels.size(); ++i) {
      draw_panel(i);
    }
    return script_ + "unset multiplot\n";
  }

 private:
  struct Box {
    int top;
    int bottom;
    Legend legend;
    Range y;
  };

  /// Words on an axis take the room that they need, beside the axis' name.
  static int left_of(const Plot& plot) {
    constexpr double name = 48.0;
    double left = left_margin;
    for (const PlotPanel& panel : plot.panels) {
      for (const PlotTick& tick : panel.y_ticks) {
        left = std::max(left, name + text_width(tick.label, font_size));
      }
    }
    return static_cast<int>(std::min(left, 0.5 * plot.width));
  }

  std::back_insert_iterator<std::string> out() { return std::back_inserter(script_); }

  void lay_out() {
    const std::size_t count = plot_.panels.size();
    int above = plot_.title.empty() ? 12 : title_height;
    int overhead = above + bottom_margin;
    std::vector<Legend> legends;
    for (const PlotPanel& panel : plot_.panels) {
      legends.emplace_back(panel, box_width_);
      overhead += legends.back().rows() * Legend::row_height + panel_gap;
    }
    const int usual = plot_.equal_axes ? box_width_ * 2 / 3
                      : count == 1     ? 380
                      : count == 2     ? 230
                                       : 170;
    const int given = (plot_.height - overhead) / static_cast<int>(count);
    const int box_height = plot_.height > 0 ? std::max(given, 40) : usual;
    height_ = overhead + box_height * static_cast<int>(count);
    for (std::size_t i = 0; i < count; ++i) {
      above += legends[i].rows() * Legend::row_height + panel_gap;
      boxes_.push_back({above, above + box_height, legends[i], y_range(plot_.panels[i])});
      above += box_height;
    }
    bool scatter = true;  // nothing but points: they should not lie on the frame
    for (const PlotPanel& panel : plot_.panels) {
      for (const PlotLine& line : panel.lines) {
        if (line.style != LineStyle::guide) {
          x_.include(line.x);
          scatter = scatter && scattered(line.style);
        }
      }
      for (const PlotBand& band : panel.bands) {
        x_.include(band.x);
      }
      for (const PlotMark& mark : panel.marks) {
        if (mark.vertical) {
          x_.include(mark.at);
        }
      }
      for (const PlotSpan& span : panel.spans) {
        x_.include(span.from);
        x_.include(span.to);
      }
      scatter = scatter || !panel.y_ticks.empty();
    }
    if (plot_.unit_circle) {
      x_.include(-1.0);
      x_.include(1.0);
    }
    x_.pad(scatter || plot_.equal_axes ? 0.05 : 0.0);
    if (!scatter && !plot_.equal_axes && !plot_.log_x) {
      round_out(x_, tick_step(x_.span(), box_width_ / x_tick_pixels));
    }
    if (plot_.equal_axes) {
      for (Box& box : boxes_) {
        const double per_pixel =
            std::max(x_.span() / box_width_, box.y.span() / (box.bottom - box.top));
        x_.widen_to(per_pixel * box_width_);
        box.y.widen_to(per_pixel * (box.bottom - box.top));
      }
    }
  }

  Range y_range(const PlotPanel& panel) const {
    Range range(panel.log_y);
    if (panel.y_limits) {
      range.include(panel.y_limits->low);
      range.include(panel.y_limits->high);
      return range;
    }
    for (const PlotLine& line : panel.lines) {
      if (line.style != LineStyle::guide) {
        range.include(line.y);
      }
    }
    for (const PlotBand& band : panel.bands) {
      range.include(band.low);
      range.include(band.high);
    }
    for (const PlotMark& mark : panel.marks) {
      if (!mark.vertical) {
        range.include(mark.at);
      }
    }
    if (plot_.unit_circle) {
      range.include(-1.0);
      range.include(1.0);
    }
    range.pad(0.06);
    return range;
  }

  void add_line(const PlotLine& line, bool log_y) {
    const auto pixels = static_cast<std::size_t>(box_width_);
    Points points;
    if (scattered(line.style)) {
      // Coarser cells until the picture stays small.
      for (std::size_t cells = 2 * pixels; cells > 16; cells /= 2) {
        points = thin_scatter(line.x, line.y, cells, cells / 2);
        if (points.x.size() <= max_scatter) {
          break;
        }
      }
    } else {
      points = thin_curve(line.x, line.y, pixels);
    }
    fmt::format_to(out(), "$d{} << EOD\n", blocks_++);
    bool any = false;
    for (std::size_t i = 0; i < points.x.size(); ++i) {
      const bool shown = std::isfinite(points.x[i]) && std::isfinite(points.y[i]) &&
                         !(plot_.log_x && points.x[i] <= 0.0) && !(log_y && points.y[i] <= 0.0);
      if (shown) {
        fmt::format_to(out(), "{:.7g} {:.7g}\n", points.x[i], points.y[i]);
      } else {
        script_ += "\n";
      }
      any = any || shown;
    }
    finish_block(any);
  }

  void add_band(const PlotBand& band) {
    const Points low = thin_curve(band.x, band.low, static_cast<std::size_t>(box_width_));
    const Points high = thin_curve(band.x, band.high, static_cast<std::size_t>(box_width_));
    fmt::format_to(out(), "$d{} << EOD\n", blocks_++);
    bool any = false;
    // A closed polygon: along the low edge and back along the high one.
    const auto add = [&](double x, double y) {
      if (std::isfinite(x) && std::isfinite(y)) {
        fmt::format_to(out(), "{:.7g} {:.7g}\n", x, y);
        any = true;
      }
    };
    for (std::size_t i = 0; i < low.x.size(); ++i) {
      add(low.x[i], low.y[i]);
    }
    for (std::size_t i = high.x.size(); i-- > 0;) {
      add(high.x[i], high.y[i]);
    }
    finish_block(any);
  }

  void add_unit_circle() {
    fmt::format_to(out(), "$circle << EOD\n");
    for (int i = 0; i <= 180; ++i) {
      const double angle = std::numbers::pi * i / 90.0;
      fmt::format_to(out(), "{:.6f} {:.6f}\n", std::cos(angle), std::sin(angle));
    }
    script_ += "EOD\n";
  }

  void finish_block(bool any) {
    script_ += "EOD\n";
    drawable_.push_back(any);
  }

  void draw_panel(std::size_t index) {
    const PlotPanel& panel = plot_.panels[index];
    const Box& box = boxes_[index];
    const bool last = index + 1 == plot_.panels.size();
    fmt::format_to(out(),
                   "set lmargin at screen {}\nset rmargin at screen {}\nset tmargin at screen {}\n"
                   "set bmargin at screen {}\nset yrange [{}:{}]\n{}set label {} at screen {}, "
                   "screen {} center rotate by 90 textcolor rgb '#333333'\n",
                   static_cast<double>(left_) / plot_.width,
                   1.0 - static_cast<double>(right_margin) / plot_.width,
                   1.0 - static_cast<double>(box.top) / height_,
                   1.0 - static_cast<double>(box.bottom) / height_, box.y.low(), box.y.high(),
                   panel.y_ticks.empty()
                       ? ticks('y', box.y, (box.bottom - box.top) / y_tick_pixels, panel.log_y)
                       : word_ticks(panel.y_ticks),
                   literal(panel.y_label), 16.0 / plot_.width,
                   1.0 - 0.5 * (box.top + box.bottom) / height_);
    script_ += panel.log_y ? "set logscale y\n" : "unset logscale y\n";
    if (last) {
      fmt::format_to(out(), "set label {} at screen {}, screen {} center textcolor rgb '#333333'\n",
                     literal(plot_.x_label), (left_ + 0.5 * box_width_) / plot_.width,
                     18.0 / height_);
      script_ += "set format x '%g'\n";
    } else {
      script_ += "set format x ''\n";
    }
    script_ += box.legend.commands(left_ + 10, box.top, plot_.width, height_);
    draw_marks(panel, box);
    draw_curves(panel);
    // The title belongs to the first panel only: a label drawn again and again grows bold.
    script_ += "unset label\nunset arrow\nunset object\n";
  }

  static std::string word_ticks(const std::vector<PlotTick>& ticks) {
    std::string words;
    for (const PlotTick& tick : ticks) {
      words += fmt::format("{}{} {}", words.empty() ? "" : ", ", literal(tick.label), tick.at);
    }
    return fmt::format("set ytics ({})\n", words);
  }

  void draw_marks(const PlotPanel& panel, const Box& box) {
    Labels labels(panel, {x_, box.y, plot_.log_x, panel.log_y, static_cast<double>(box_width_),
                          static_cast<double>(box.bottom - box.top)});
    for (const PlotSpan& span : panel.spans) {
      if (std::isfinite(span.from) && std::isfinite(span.to)) {
        fmt::format_to(out(),
                       "set object rectangle from first {}, graph 0 to first {}, graph 1 behind "
                       "fc rgb '{}' fs solid noborder\n",
                       span.from, span.to, span_color);
      }
    }
    for (std::size_t i = 0; i < panel.marks.size(); ++i) {
      const PlotMark& mark = panel.marks[i];
      if (!std::isfinite(mark.at)) {
        continue;
      }
      const std::string from = mark.vertical ? fmt::format("first {}, graph 0", mark.at)
                                             : fmt::format("graph 0, first {}", mark.at);
      const std::string to = mark.vertical ? fmt::format("first {}, graph 1", mark.at)
                                           : fmt::format("graph 1, first {}", mark.at);
      fmt::format_to(out(), "set arrow from {} to {} nohead dt (8,6) lc rgb '#777777' lw 1.2\n",
                     from, to);
      if (mark.label.empty()) {
        continue;
      }
      const std::string label = literal(mark.label);
      if (mark.vertical) {
        const auto [height, before] = labels.place(mark, label_size);
        fmt::format_to(out(), "set label {} at first {}, graph {:.3f} {} offset character {}, 0",
                       label, mark.at, height, before ? "right" : "left", before ? -0.5 : 0.5);
      } else {
        fmt::format_to(out(),
                       "set label {} at graph 0.995, first {} right offset 0, character -0.6",
                       label, mark.at);
      }
      fmt::format_to(out(), " font ',{}' textcolor rgb '#555555' front\n", label_size);
    }
    for (const PlotNote& note : panel.notes) {
      if (std::isfinite(note.x) && std::isfinite(note.y)) {
        fmt::format_to(out(),
                       "set label {} at first {}, first {} left offset character 0.8, character "
                       "0.6 font ',12' front\n",
                       literal(note.text), note.x, note.y);
      }
    }
  }

  void draw_curves(const PlotPanel& panel) {
    std::string curves;
    const auto add = [&](std::string text) {
      curves += (curves.empty() ? "" : ", ") + std::move(text);
    };
    const std::vector<std::string_view> colors = panel_colors(panel);
    if (plot_.unit_circle) {
      add("$circle with lines lc rgb '#999999' lw 1.2");
    }
    for (std::size_t i = 0; i < panel.bands.size(); ++i, ++drawn_) {
      if (drawable_[drawn_]) {
        add(fmt::format(
            "$d{} with filledcurves closed fc rgb '{}' fs transparent solid 0.2 noborder", drawn_,
            colors[i]));
      }
    }
    for (std::size_t i = 0; i < panel.lines.size(); ++i, ++drawn_) {
      const PlotLine& line = panel.lines[i];
      if (drawable_[drawn_]) {
        add(fmt::format("$d{} with {} {} lc rgb '{}'", drawn_, kind(line.style),
                        stroke(line.style, line.x.size()), colors[panel.bands.size() + i]));
      }
    }
    if (curves.empty()) {
      script_ += "set label 'no data' at graph 0.5, graph 0.5 center textcolor rgb '#999999'\n";
      curves = "NaN";
    }
    script_ += "plot " + curves + "\n";
  }

  static std::string_view kind(LineStyle style) {
    return scattered(style)              ? "points"
           : style == LineStyle::steps   ? "steps"
           : style == LineStyle::samples ? "linespoints"
                                         : "lines";
  }

  const Plot& plot_;
  std::string script_;
  Range x_;
  int left_;  ///< Of the boxes.
  int box_width_;
  int height_ = 0;
  std::vector<Box> boxes_;
  std::vector<bool> drawable_;  ///< Whether a data block has a point; gnuplot fails on one without.
  std::size_t blocks_ = 0;
  std::size_t drawn_ = 0;
};

}  // namespace

Expected<std::string> gnuplot_script(const Plot& plot, PictureFormat format) {
  FLYBALL_CHECK(check(plot));
  return Script(plot).build(format);
}

}  // namespace flyball::io
