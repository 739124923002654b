#pragma once

#include <string>
#include <string_view>

#include <flyball/core/expected.hpp>
#include <flyball/io/plot.hpp>

#include "io/plot_data.hpp"

/// Plots as gnuplot programs; private to io.
namespace flyball::io {

enum class PictureFormat { svg, png };

[[nodiscard]] Expected<std::string> gnuplot_script(const Plot& plot, PictureFormat format);
[[nodiscard]] Expected<std::string> gnuplot_script(const SurfacePlot& plot, PictureFormat format);

/// The commands that every picture begins with: terminal, fonts, encoding.
[[nodiscard]] std::string script_head(PictureFormat format, int width, int height);

/// The size of a title's font, smaller if it would not fit.
[[nodiscard]] double title_size(std::string_view title, int width);

/// The command for an axis' ticks, not more than so many. @param axis  'x', 'y'.
[[nodiscard]] std::string ticks(char axis, const Range& range, int at_most, bool logarithmic);

/// A text as a gnuplot literal in single quotes, in which neither backslash nor backtick means
/// anything. An apostrophe becomes the typographic one: gnuplot 5.4 takes a doubled quote at the
/// beginning of a literal for an empty literal, and what follows for commands. Control characters
/// are replaced.
[[nodiscard]] std::string literal(std::string_view text);

}  // namespace flyball::io
