#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "io/plot_legend.hpp"
#include "io/plot_script.hpp"
#include "io/text.hpp"

namespace flyball::io {

std::string literal(std::string_view text) {
  std::string result = "'";
  for (const char c : printable(text, 400)) {
    result += c == '\'' ? std::string("\u2019") : std::string(1, c);
  }
  return result + "'";
}

std::string script_head(PictureFormat format, int width, int height) {
  if (format == PictureFormat::svg) {
    return fmt::format(
        "set encoding utf8\nset terminal svg size {},{} dynamic standalone noenhanced font "
        "'DejaVu Sans,{}' background '#FFFFFF'\n",
        width, height, font_size);
  }
  constexpr double scale = 1.5;
  constexpr double points_per_pixel = 72.0 / 96.0;  // cairo's fonts are sized in points
  return fmt::format(
      "set encoding utf8\nset terminal pngcairo size {},{} noenhanced font 'DejaVu Sans,{}' "
      "fontscale {} linewidth {} pointscale {} background '#FFFFFF'\n",
      std::lround(width * scale), std::lround(height * scale), font_size, scale * points_per_pixel,
      scale, scale);
}

double title_size(std::string_view title, int width) {
  constexpr double usual = 17.0;
  return std::clamp((width - 20.0) / std::max(text_width(title, 1.0), 1.0), 9.0, usual);
}

std::string ticks(char axis, const Range& range, int at_most, bool logarithmic) {
  const double step = logarithmic ? 0.0 : tick_step(range.span(), at_most);
  return step > 0.0 ? fmt::format("set {}tics {}\n", axis, step)
                    : fmt::format("set {}tics autofreq\n", axis);
}

}  // namespace flyball::io
