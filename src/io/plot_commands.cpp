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

namespace {

/// Of an axis of a decade or two, where decades alone are too few: 1, 2 and 5 of each, the digits
/// between them without labels; of less than a decade even steps.
std::string decade_ticks(char axis, const Range& range, int at_most) {
  std::string list;
  const auto add = [&](double at, bool labelled) {
    if (at >= range.low() * (1.0 - 1e-9) && at <= range.high() * (1.0 + 1e-9)) {
      // Without a text gnuplot writes the number in the axis's format.
      list += labelled ? fmt::format("{}{}", list.empty() ? "" : ", ", at)
                       : fmt::format("{}'' {} 1", list.empty() ? "" : ", ", at);
    }
  };
  constexpr double few = 0.8;  // decades
  if (std::log10(range.high() / range.low()) < few) {
    const double step = tick_step(range.span(), at_most);
    for (double k = std::ceil(range.low() / step - 1e-9); k * step <= range.high() * (1.0 + 1e-9);
         ++k) {
      add(k * step, true);
    }
  } else {
    for (double power = std::floor(std::log10(range.low())); power <= std::log10(range.high());
         ++power) {
      for (int digit = 1; digit < 10; ++digit) {
        add(digit * std::pow(10.0, power), digit == 1 || digit == 2 || digit == 5);
      }
    }
  }
  return fmt::format("set {}tics ({})\n", axis, list);
}

}  // namespace

std::string ticks(char axis, const Range& range, int at_most, bool logarithmic) {
  constexpr double many = 2.2;  // decades
  if (logarithmic && range.low() > 1e-290 && range.high() > range.low() * (1.0 + 1e-6) &&
      std::log10(range.high() / range.low()) < many) {
    return decade_ticks(axis, range, at_most);
  }
  const double step = logarithmic ? 0.0 : tick_step(range.span(), at_most);
  return step > 0.0 ? fmt::format("set {}tics {}\n", axis, step)
                    : fmt::format("set {}tics autofreq\n", axis);
}

}  // namespace flyball::io
