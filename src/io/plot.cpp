#include <flyball/io/plot.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <string_view>
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

/// Removes groups that draw nothing: gnuplot begins and ends with some, in colours that the picture
/// before has left.
void remove_empty_groups(std::string& text) {
  constexpr std::string_view close = ">\n</g>\n";
  std::string result;
  std::size_t at = 0;
  for (std::size_t end = text.find(close); end != std::string::npos; end = text.find(close, at)) {
    const std::size_t line = text.rfind('\n', end) + 1;
    const bool empty = line >= at && text.compare(line, 3, "<g ") == 0;
    result.append(text, at, (empty ? line : end + close.size()) - at);
    at = end + close.size();
  }
  text = result.append(text, at);
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
  remove_empty_groups(svg);
  return std::string(io::trim(svg)) + "\n";
}

constexpr std::string_view png_signature = "\x89PNG\r\n\x1A\n";

/// What gnuplot answered, if it is one picture.
Expected<std::string> picture_of(std::string answer, const std::string& title,
                                 PictureFormat format) {
  const bool vector = format == PictureFormat::svg;
  if (vector) {
    answer = tidy_svg(std::move(answer), title);
  }
  if (!(vector ? io::is_plain_svg(answer) : answer.starts_with(png_signature))) {
    return refusal(PlotError::not_a_picture, "plot");
  }
  return answer;
}

/// The pictures that stand one after the other: each begins where the last ended.
std::vector<std::string> parted(std::string_view answer, PictureFormat format) {
  constexpr std::string_view svg_end = "</svg>";  // Nowhere else: texts are escaped.
  std::vector<std::string> parts;
  while (!answer.empty()) {
    std::size_t end =
        format == PictureFormat::svg ? answer.find(svg_end) : answer.find(png_signature, 1);
    end = end == std::string_view::npos  ? answer.size()
          : format == PictureFormat::svg ? end + svg_end.size()
                                         : end;
    if (io::trim(answer.substr(0, end)).empty()) {
      break;
    }
    parts.emplace_back(answer.substr(0, end));
    answer.remove_prefix(end);
  }
  return parts;
}

/// What one gnuplot answers to programs, in their order; as many as it was asked for.
///
/// Before PNGs it draws a small picture with a letter and one without: where there are no fonts, of
/// which it says nothing, both are the same. An SVG is written with the fonts of who looks at it.
Expected<std::vector<std::string>> answers(const std::string& scripts, std::size_t count,
                                           PictureFormat format, double seconds) {
  const bool raster = format == PictureFormat::png;
  constexpr std::size_t probes = 2;
  const std::string letter = "set label 1 'H' at screen 0.5, screen 0.5 center\nplot NaN\n";
  FLYBALL_TRY(
      const std::string answer,
      run_gnuplot(raster ? io::script_head(format, 40, 30) +
                               "unset border\nunset tics\nunset key\nset margins 0, 0, 0, 0\n"
                               "set xrange [0:1]\nset yrange [0:1]\n" +
                               letter + "unset label\nplot NaN\nreset session\n" + scripts
                         : scripts,
                  seconds));
  std::vector<std::string> parts = parted(answer, format);
  if (raster && parts.size() >= probes) {
    if (parts[0] == parts[1]) {
      return refusal(PlotError::no_fonts, "plot")
          .hint("install some (Debian and Ubuntu: apt install fonts-dejavu-core)");
    }
    parts.erase(parts.begin(), parts.begin() + probes);
  }
  if (parts.size() != count) {
    return refusal(PlotError::not_a_picture, "plot");
  }
  return parts;
}

/// Draws, and looks at what came.
template <class AnyPlot>
Expected<std::string> drawn(const AnyPlot& plot, PictureFormat format, double seconds) {
  FLYBALL_TRY(const std::string script, io::gnuplot_script(plot, format));
  FLYBALL_TRY(auto parts, answers(script, 1, format, seconds));
  return picture_of(std::move(parts.front()), plot.title, format);
}

std::vector<Expected<std::string>> drawn_together(std::span<const Plot* const> plots,
                                                  PictureFormat format, double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  std::vector<Expected<std::string>> pictures;
  std::vector<std::size_t> asked;
  std::string script;
  for (const Plot* plot : plots) {
    pictures.push_back(io::gnuplot_script(*plot, format));
    if (pictures.back()) {
      asked.push_back(pictures.size() - 1);
      script += *pictures.back() + "reset session\n";
    }
  }
  if (asked.empty()) {
    return pictures;
  }
  auto parts = answers(script, asked.size(), format, seconds);
  const bool hopeless = !parts && (parts.error().is(PlotError::gnuplot_missing) ||
                                   parts.error().is(PlotError::no_fonts));
  for (std::size_t k = 0; k < asked.size(); ++k) {
    const Plot& plot = *plots[asked[k]];
    Expected<std::string>& picture = pictures[asked[k]];
    if (parts) {
      picture = picture_of(std::move((*parts)[k]), plot.title, format);
    } else if (hopeless) {
      picture = tl::unexpected(parts.error());
    } else {
      // One of them was refused: which, and with what words, is known of each alone.
      const std::chrono::duration<double> left = end - std::chrono::steady_clock::now();
      picture = drawn(plot, format, std::max(0.0, left.count()));
    }
  }
  return pictures;
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
      {"no_fonts", "gnuplot finds no font to write with", ErrorKind::environment},
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

std::vector<Expected<std::string>> render_svgs(std::span<const Plot* const> plots, double seconds) {
  return drawn_together(plots, PictureFormat::svg, seconds);
}
std::vector<Expected<std::string>> render_pngs(std::span<const Plot* const> plots, double seconds) {
  return drawn_together(plots, PictureFormat::png, seconds);
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
