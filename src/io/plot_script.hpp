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

/// A text as a gnuplot literal. Single quotes, in which neither backslash nor backtick means
/// anything; control characters are removed.
[[nodiscard]] std::string literal(std::string_view text);

}  // namespace flyball::io
