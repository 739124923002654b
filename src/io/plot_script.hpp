#pragma once

#include <string>

#include <flyball/core/expected.hpp>
#include <flyball/io/plot.hpp>

/// Plots as gnuplot programs; private to io.
namespace flyball::io {

enum class PictureFormat { svg, png };

[[nodiscard]] Expected<std::string> gnuplot_script(const Plot& plot, PictureFormat format);
[[nodiscard]] Expected<std::string> gnuplot_script(const SurfacePlot& plot, PictureFormat format);

/// The commands that every picture begins with: terminal, fonts, encoding.
[[nodiscard]] std::string script_head(PictureFormat format, int width, int height);

/// A text as a gnuplot literal in single quotes, in which neither backslash nor backtick means
/// anything. An apostrophe becomes the typographic one: gnuplot 5.4 takes a doubled quote at the
/// beginning of a literal for an empty literal, and what follows for commands. Control characters
/// are replaced.
[[nodiscard]] std::string literal(std::string_view text);

}  // namespace flyball::io
