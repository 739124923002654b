#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/try.hpp"
#include "io/plot_data.hpp"
#include "io/plot_script.hpp"

namespace flyball::io {
namespace {

/// More cells than this a side only make the picture's file larger: each of a surface is a polygon.
constexpr std::size_t max_cells = 48;

/// Whether an axis ascends evenly, so that the values are the pixels of an image.
bool even(const std::vector<double>& axis) {
  const double step = (axis.back() - axis.front()) / static_cast<double>(axis.size() - 1);
  for (std::size_t i = 1; i < axis.size(); ++i) {
    if (!(std::abs(axis[i] - axis[i - 1] - step) <= 1e-6 * step)) {
      return false;
    }
  }
  return step > 0.0;
}

Expected<void> check(const SurfacePlot& plot, bool from_above) {
  if (plot.x.size() < 2 || plot.y.size() < 2 || plot.z.size() != plot.x.size() * plot.y.size()) {
    return refusal(ArgumentError::wrong_shape, "plot", "z")
        .got(fmt::format("{} values long", plot.z.size()))
        .expected(
            fmt::format("rows x columns ({}x{}), at least 2x2", plot.y.size(), plot.x.size()));
  }
  if (from_above && !(even(plot.x) && even(plot.y))) {
    return refusal(ArgumentError::out_of_range, "plot", "the axes of a map")
        .got("uneven steps")
        .expected("x and y that ascend evenly");
  }
  if (plot.width < 200 || plot.width > 8000 || plot.height < 200 || plot.height > 8000) {
    return refusal(ArgumentError::out_of_range, "plot", "the size")
        .got(fmt::format("{}x{} pixels", plot.width, plot.height))
        .expected("200 to 8000 pixels a side");
  }
  return {};
}

/// Every k-th index, the last one always, such that about `max_cells` remain.
std::vector<std::size_t> chosen(std::size_t count) {
  const std::size_t step = (count + max_cells - 1) / max_cells;
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < count; i += step) {
    result.push_back(i);
  }
  if (result.back() != count - 1) {
    result.push_back(count - 1);
  }
  return result;
}

constexpr std::string_view viridis =
    "set palette defined (0 '#440154', 1 '#472D7B', 2 '#3B528B', 3 '#2C728E', 4 '#21918C', 5 "
    "'#28AE80', 6 '#5EC962', 7 '#ADDC30', 8 '#FDE725')\n";

/// Maps beside each other, and the bar of their colours at the right.
class MapScript {
 public:
  MapScript(const SurfacePlot& plot, const Range& z) : plot_(plot), z_(z) {
    maps_.push_back(&plot);
    for (const SurfacePlot& other : plot.beside) {
      maps_.push_back(&other);
    }
    const auto count = static_cast<double>(maps_.size());
    cell_width_ = (plot.width - bar_space) / count;
  }

  std::string build(PictureFormat format) {
    script_ = script_head(format, plot_.width, plot_.height);
    for (std::size_t i = 0; i < maps_.size(); ++i) {
      add_data(*maps_[i], i);
    }
    fmt::format_to(out(),
                   "{}set multiplot\nset border 31 lc rgb '#555555' lw 1\n"
                   "set tics out nomirror textcolor rgb '#333333' scale 0.6\nunset key\n"
                   "set label 1 {} at screen 0.5, screen {} center font ',{}'\n"
                   "set cbrange [{}:{}]\n",
                   viridis, literal(plot_.title), 1.0 - 22.0 / plot_.height,
                   title_size(plot_.title, plot_.width), z_.low(), z_.high());
    for (std::size_t i = 0; i < maps_.size(); ++i) {
      draw(*maps_[i], i);
    }
    return script_ + "unset multiplot\n";
  }

 private:
  // Pixels: what lies around the box of a map, and the colours' bar with its ticks and label.
  static constexpr double left = 76.0;
  static constexpr double right = 18.0;
  static constexpr double top = 52.0;
  static constexpr double bottom = 62.0;
  static constexpr double bar_space = 96.0;
  static constexpr double bar_width = 16.0;

  std::back_insert_iterator<std::string> out() { return std::back_inserter(script_); }

  void add_data(const SurfacePlot& map, std::size_t index) {
    // With the axes in the first row and column: gnuplot takes twenty times as long where it has to
    // compute them from the indices.
    fmt::format_to(out(), "$z{} << EOD\n0", index);
    for (const double x : map.x) {
      fmt::format_to(out(), " {:.9g}", x);
    }
    script_ += "\n";
    for (std::size_t i = 0; i < map.y.size(); ++i) {
      fmt::format_to(out(), "{:.9g} ", map.y[i]);
      for (std::size_t j = 0; j < map.x.size(); ++j) {
        const double value = map.z[i * map.x.size() + j];
        // gnuplot leaves pixels that are no number transparent.
        if (std::isfinite(value)) {
          fmt::format_to(out(), "{:.5g} ", value);
        } else {
          script_ += "NaN ";
        }
      }
      script_ += "\n";
    }
    script_ += "EOD\n";
    if (map.unit_circle) {
      fmt::format_to(out(), "$circle{} << EOD\n", index);
      for (int i = 0; i <= 180; ++i) {
        const double angle = std::numbers::pi * i / 90.0;
        fmt::format_to(out(), "{:.6f} {:.6f}\n", std::cos(angle), std::sin(angle));
      }
      script_ += "EOD\n";
    }
  }

  void draw(const SurfacePlot& map, std::size_t index) {
    // Pixels lie about their nodes.
    const double dx = map.x[1] - map.x[0];
    const double dy = map.y[1] - map.y[0];
    Range x;
    x.include(map.x.front() - 0.5 * dx);
    x.include(map.x.back() + 0.5 * dx);
    Range y;
    y.include(map.y.front() - 0.5 * dy);
    y.include(map.y.back() + 0.5 * dy);
    double box_width = cell_width_ - left - right;
    double box_height = plot_.height - top - bottom;
    if (plot_.equal_axes) {
      const double per_pixel = std::max(x.span() / box_width, y.span() / box_height);
      box_width = x.span() / per_pixel;
      box_height = y.span() / per_pixel;
    }
    const double from = cell_width_ * static_cast<double>(index) + left;
    const double above = top + 0.5 * (plot_.height - top - bottom - box_height);
    const double width = plot_.width;
    const double height = plot_.height;
    const bool last = index + 1 == maps_.size();
    fmt::format_to(
        out(),
        "set lmargin at screen {}\nset rmargin at screen {}\nset tmargin at screen {}\n"
        "set bmargin at screen {}\nset xrange [{}:{}]\nset yrange [{}:{}]\n{}{}"
        "set label {} at screen {}, screen {} center textcolor rgb '#333333'\n"
        "set label {} at screen {}, screen {} center rotate by 90 textcolor rgb '#333333'\n",
        from / width, (from + box_width) / width, 1.0 - above / height,
        1.0 - (above + box_height) / height, x.low(), x.high(), y.low(), y.high(),
        ticks('x', x, static_cast<int>(box_width / 60.0), false),
        ticks('y', y, static_cast<int>(box_height / 40.0), false), literal(map.x_label),
        (from + 0.5 * box_width) / width, 1.0 - (above + box_height + 44.0) / height,
        literal(map.y_label), (from - 58.0) / width, 1.0 - (above + 0.5 * box_height) / height);
    if (last) {
      const double bar = from + box_width + right;
      fmt::format_to(
          out(),
          "set colorbox user origin screen {}, screen {} size screen {}, screen {}\n{}"
          "set label {} at screen {}, screen {} center rotate by 90 textcolor rgb '#333333'\n",
          bar / width, 1.0 - (above + box_height) / height, bar_width / width, box_height / height,
          plot_.z_step > 0.0 ? fmt::format("set cbtics {}\n", plot_.z_step) : std::string(),
          literal(plot_.z_label), (bar + bar_width + 62.0) / width,
          1.0 - (above + 0.5 * box_height) / height);
    } else {
      script_ += "unset colorbox\n";
    }
    fmt::format_to(out(), "plot $z{} nonuniform matrix using 1:2:3 with image", index);
    if (map.unit_circle) {
      fmt::format_to(out(), ", $circle{} with lines lc rgb '#333333' lw 1.5", index);
    }
    script_ += "\nunset label\n";
  }

  const SurfacePlot& plot_;
  const Range& z_;
  std::vector<const SurfacePlot*> maps_;
  double cell_width_;
  std::string script_;
};

std::string perspective_script(const SurfacePlot& plot, const Range& z, PictureFormat format) {
  std::string script = script_head(format, plot.width, plot.height) + "$z << EOD\n";
  const auto out = std::back_inserter(script);
  for (const std::size_t i : chosen(plot.y.size())) {
    for (const std::size_t j : chosen(plot.x.size())) {
      const double value = plot.z[i * plot.x.size() + j];
      if (std::isfinite(value)) {
        fmt::format_to(out, "{:.7g} {:.7g} {:.7g}\n", plot.x[j], plot.y[i], value);
      } else {
        fmt::format_to(out, "{:.7g} {:.7g} NaN\n", plot.x[j], plot.y[i]);
      }
    }
    script += "\n";
  }
  fmt::format_to(out,
                 "EOD\n{}set title {} font ',{}'\nset tics out nomirror textcolor rgb '#333333'\n"
                 "unset key\nset zrange [{}:{}]\nset cbrange [{}:{}]\n"
                 "set xlabel {} rotate parallel offset 0, -0.5\nset ylabel {} rotate parallel\n"
                 "set zlabel {} rotate by 90 offset -3\nset view 58, 325, 1.0, 1.0\nset xyplane "
                 "relative 0.08\n"
                 "set border 15 lc rgb '#555555'\nset grid x y z lc rgb '#DDDDDD'\n"
                 "set pm3d depthorder border lc rgb '#40FFFFFF' lw 0.4\nunset colorbox\n"
                 "splot $z with pm3d\n",
                 viridis, literal(plot.title), title_size(plot.title, plot.width), z.low(),
                 z.high(), z.low(), z.high(), literal(plot.x_label), literal(plot.y_label),
                 literal(plot.z_label));
  return script;
}

}  // namespace

Expected<std::string> gnuplot_script(const SurfacePlot& plot, PictureFormat format) {
  Expected<void> ok = check(plot, plot.from_above);
  Range z;
  z.include(plot.z);
  if (plot.from_above) {
    for (const SurfacePlot& other : plot.beside) {
      ok = ok ? check(other, true) : ok;
      z.include(other.z);
    }
  }
  FLYBALL_CHECK(std::move(ok));
  if (z.empty()) {
    return refusal(ArgumentError::empty, "plot", "z").got("without a finite value");
  }
  z.pad(0.0);
  return plot.from_above ? MapScript(plot, z).build(format) : perspective_script(plot, z, format);
}

}  // namespace flyball::io
