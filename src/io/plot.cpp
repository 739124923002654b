#include <flyball/io/plot.hpp>

#include <algorithm>
#include <cstddef>
#include <utility>

#include <flyball/io/file.hpp>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "io/plot_script.hpp"
#include "io/process.hpp"
#include "io/svg.hpp"
#include "io/text.hpp"

namespace flyball {
namespace {

using io::PictureFormat;
using io::ProcessResult;

/// The picture that gnuplot makes of a program. No shell, no files of the user's settings (-d).
Expected<std::string> run_gnuplot(const std::string& script, double seconds) {
  // By its path: gnuplot reads a program from "-" byte by byte.
  ProcessResult result =
      io::run_process({"gnuplot", "-d", "/dev/stdin"}, script, {.seconds = seconds});
  std::replace_if(
      result.err.begin(), result.err.end(), [](char c) { return c == '\n' || c == '\t'; }, ' ');
  const std::string words = io::printable(io::trim(result.err), 400);
  switch (result.end) {
    case ProcessResult::End::not_found:
      return refusal(PlotError::gnuplot_missing, "plot")
          .hint("install it (Debian and Ubuntu: apt install gnuplot-nox), or run without pictures");
    case ProcessResult::End::timed_out:
      return refusal(PlotError::timed_out, "plot").with("gnuplot", words);
    case ProcessResult::End::too_much:
      return refusal(PlotError::not_a_picture, "plot").with("gnuplot", words);
    case ProcessResult::End::not_started:
    case ProcessResult::End::signalled:
      break;
    case ProcessResult::End::exited:
      if (result.code == 0 && !result.out.empty()) {
        return std::move(result.out);
      }
      break;
  }
  return refusal(PlotError::gnuplot_failed, "plot")
      .with("code", static_cast<double>(result.code))
      .with("gnuplot", words);
}

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  std::string result;
  std::size_t at = 0;
  for (std::size_t next = text.find(from); next != std::string::npos; next = text.find(from, at)) {
    result.append(text, at, next - at).append(to);
    at = next + from.size();
  }
  text = result.append(text, at);
}

/// Removes what stands from each `begin` to the `end` that follows it, both included.
void remove_all(std::string& text, std::string_view begin, std::string_view end) {
  std::size_t at = text.find(begin);
  while (at != std::string::npos) {
    const std::size_t stop = text.find(end, at + begin.size());
    if (stop == std::string::npos) {
      return;
    }
    text.erase(at, stop + end.size() - at);
    at = text.find(begin, at);
  }
}

std::string xml_escaped(std::string text) {
  replace_all(text, "&", "&amp;");
  replace_all(text, "<", "&lt;");
  replace_all(text, ">", "&gt;");
  return text;
}

/// The element alone, with the picture's title for readers of screens, fonts that browsers without
/// DejaVu fall back to, and without ids and tooltips ("gnuplot_plot_1a") that would clash when
/// several pictures stand in one page.
std::string tidy_svg(std::string svg, const std::string& title) {
  const std::size_t element = svg.find("<svg");
  svg.erase(0, element == std::string::npos ? 0 : element);
  remove_all(svg, "<title>gnuplot_plot_", "</title>");
  remove_all(svg, " id=\"gnuplot_", "\"");
  replace_all(svg, "<title>Gnuplot</title>",
              "<title>" + xml_escaped(io::printable(title, 400)) + "</title>");
  replace_all(svg, "\"DejaVu Sans\"", "\"DejaVu Sans, Verdana, sans-serif\"");
  return svg;
}

/// Draws, and looks at what came.
template <class AnyPlot>
Expected<std::string> drawn(const AnyPlot& plot, PictureFormat format, double seconds) {
  FLYBALL_TRY(const std::string script, io::gnuplot_script(plot, format));
  FLYBALL_TRY(std::string picture, run_gnuplot(script, seconds));
  const bool vector = format == PictureFormat::svg;
  if (vector) {
    picture = tidy_svg(std::move(picture), plot.title);
  }
  if (!(vector ? io::is_plain_svg(picture) : picture.starts_with("\x89PNG\r\n\x1A\n"))) {
    return refusal(PlotError::not_a_picture, "plot");
  }
  return picture;
}

template <class AnyPlot>
Expected<std::string> svg_of(const AnyPlot& plot, double seconds) {
  return drawn(plot, PictureFormat::svg, seconds);
}

template <class AnyPlot>
Expected<std::string> png_of(const AnyPlot& plot, double seconds) {
  return drawn(plot, PictureFormat::png, seconds);
}

Expected<void> save(const std::string& path, const Expected<std::string>& picture) {
  return picture.and_then(
      [&](const std::string& bytes) { return write_file_atomically(path, bytes); });
}

}  // namespace

ErrorInfo error_info(PlotError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"gnuplot_missing", "gnuplot is not installed", ErrorKind::environment},
      {"gnuplot_failed", "gnuplot did not draw the picture", ErrorKind::environment},
      {"timed_out", "gnuplot did not finish in time", ErrorKind::environment},
      {"not_a_picture", "what gnuplot answered is no picture", ErrorKind::environment},
  };
  return detail::info_of(code, "plot", rows);
}

Expected<std::string> render_svg(const Plot& plot, double seconds) {
  return svg_of(plot, seconds);
}
Expected<std::string> render_svg(const SurfacePlot& plot, double seconds) {
  return svg_of(plot, seconds);
}
Expected<std::string> render_png(const Plot& plot, double seconds) {
  return png_of(plot, seconds);
}
Expected<std::string> render_png(const SurfacePlot& plot, double seconds) {
  return png_of(plot, seconds);
}

Expected<void> write_svg(const std::string& path, const Plot& plot) {
  return save(path, render_svg(plot));
}
Expected<void> write_svg(const std::string& path, const SurfacePlot& plot) {
  return save(path, render_svg(plot));
}
Expected<void> write_png(const std::string& path, const Plot& plot) {
  return save(path, render_png(plot));
}
Expected<void> write_png(const std::string& path, const SurfacePlot& plot) {
  return save(path, render_png(plot));
}

}  // namespace flyball
