#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include "io/plot_data.hpp"
#include "io/plot_script.hpp"

namespace flyball::io {
namespace {

/// More cells than this a side only make the picture's file larger.
constexpr std::size_t max_cells = 48;

Expected<void> check(const SurfacePlot& plot) {
  if (plot.x.size() < 2 || plot.y.size() < 2 || plot.z.size() != plot.x.size() * plot.y.size()) {
    return tl::unexpected(Error(ArgumentError::wrong_shape)
                              .in("plot")
                              .about("z")
                              .got(fmt::format("{} values long", plot.z.size()))
                              .expected(fmt::format("rows x columns ({}x{}), at least 2x2",
                                                    plot.y.size(), plot.x.size())));
  }
  if (plot.width < 200 || plot.width > 8000 || plot.height < 200 || plot.height > 8000) {
    return tl::unexpected(Error(ArgumentError::out_of_range)
                              .in("plot")
                              .about("the size")
                              .got(fmt::format("{}x{} pixels", plot.width, plot.height))
                              .expected("200 to 8000 pixels a side"));
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

}  // namespace

Expected<std::string> gnuplot_script(const SurfacePlot& plot, PictureFormat format) {
  if (Expected<void> ok = check(plot); !ok) {
    return tl::unexpected(std::move(ok).error());
  }
  std::string script = script_head(format, plot.width, plot.height);
  const auto out = std::back_inserter(script);
  Range z;
  z.include(plot.z);
  if (z.empty()) {
    return tl::unexpected(
        Error(ArgumentError::empty).in("plot").about("z").got("without a finite value"));
  }
  z.pad(0.0);
  script += "$z << EOD\n";
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
  // Viridis, which keeps its order in grey and for the colour-blind (van der Walt and Smith, 2015).
  fmt::format_to(
      out,
      "EOD\nset palette defined (0 '#440154', 1 '#472D7B', 2 '#3B528B', 3 '#2C728E', 4 "
      "'#21918C', 5 '#28AE80', 6 '#5EC962', 7 '#ADDC30', 8 '#FDE725')\n"
      "set title {} font ',15'\nset tics out nomirror textcolor rgb '#333333'\nunset key\n"
      "set zrange [{}:{}]\nset cbrange [{}:{}]\nset cblabel {} offset 1\n",
      literal(plot.title), z.low(), z.high(), z.low(), z.high(), literal(plot.z_label));
  if (plot.from_above) {
    fmt::format_to(
        out,
        "set xlabel {}\nset ylabel {}\nset pm3d map corners2color mean\nset autoscale xfix\n"
        "set autoscale yfix\nsplot $z with pm3d\n",
        literal(plot.x_label), literal(plot.y_label));
  } else {
    fmt::format_to(out,
                   "set xlabel {} rotate parallel offset 0, -0.5\nset ylabel {} rotate parallel\n"
                   "set zlabel {} rotate by 90 offset -3\nset view 58, 325, 1.0, 1.0\nset xyplane "
                   "relative 0.08\n"
                   "set border 15 lc rgb '#555555'\nset grid x y z lc rgb '#DDDDDD'\n"
                   "set pm3d depthorder border lc rgb '#40FFFFFF' lw 0.4\nunset colorbox\n"
                   "splot $z with pm3d\n",
                   literal(plot.x_label), literal(plot.y_label), literal(plot.z_label));
  }
  return script;
}

}  // namespace flyball::io
