// Bode, Nyquist and Nichols plots, root loci and responses of loops.
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/text.hpp>

#include "core/constants.hpp"
#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/loop_study_parts.hpp"

namespace flyball::study {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using enum LoopView;

constexpr const char* frequency_clock = "frequency";

double in_decibels(double gain) {
  return 20.0 * std::log10(gain);
}

int color_of(std::size_t index) {
  return static_cast<int>(index % 7);
}

bool is_single(const LoopResult& result) {
  return result.loops.size() == 1;
}

std::string label_of(const LoopResult& result, const LoopFindings& loop) {
  return is_single(result) ? "" : short_name(loop);
}

std::string title_of(const LoopResult& result, std::string_view what) {
  return is_single(result) ? fmt::format("{} of {}", what, short_name(result.loops.front()))
                           : std::string(what);
}

/// Whether a frequency has a place on a logarithmic axis.
bool is_drawn(double frequency) {
  return frequency > 0.0 && std::isfinite(frequency);
}

/// The gain crossing whose margin is the loop's.
const classical::GainCrossing* least_phase(const classical::LoopMargins& margins) {
  const auto& all = margins.gain_crossings;
  const auto least = std::min_element(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return std::abs(a.phase_margin) < std::abs(b.phase_margin);
  });
  return least == all.end() ? nullptr : &*least;
}

const classical::PhaseCrossing* least_gain(const classical::LoopMargins& margins) {
  const auto& all = margins.phase_crossings;
  const auto least = std::min_element(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return std::abs(std::log(a.gain_margin)) < std::abs(std::log(b.gain_margin));
  });
  return least == all.end() ? nullptr : &*least;
}

Figure bode_figure(const LoopResult& result) {
  Figure figure{"margins",
                "bode",
                title_of(result, "Bode plot"),
                "Gain and phase of the opened loop. Where the gain is 0 dB, what the phase is "
                "above −180° is the phase margin; where the phase is −180° (and every whole turn "
                "from it), what the gain is below 0 dB is the gain margin.",
                {}};
  figure.plot.title = figure.title;
  figure.plot.x_label = "Frequency (rad/s)";
  figure.plot.log_x = true;
  figure.plot.clock = frequency_clock;
  PlotPanel gain{.y_label = "Gain (dB)", .marks = {{.at = 0.0}}};
  PlotPanel phase{.y_label = "Phase (°)"};
  const std::vector<double> frequency(result.frequency.begin(), result.frequency.end());
  double lowest = 0.0;
  double highest = 0.0;
  for (std::size_t i = 0; i < result.loops.size(); ++i) {
    const LoopFindings& loop = result.loops[i];
    PlotLine gains{.label = label_of(result, loop), .x = frequency, .color = color_of(i)};
    PlotLine phases = gains;
    phases.color = is_single(result) ? quiet_color : color_of(i);
    for (Index k = 0; k < result.frequency.size(); ++k) {
      gains.y.push_back(in_decibels(loop.bode->gain(k)));
      phases.y.push_back(loop.bode->phase(k));
      lowest = std::min(lowest, loop.bode->phase(k));
      highest = std::max(highest, loop.bode->phase(k));
    }
    gain.lines.push_back(std::move(gains));
    phase.lines.push_back(std::move(phases));
  }
  // -180° and its turns, as far as the curve comes near one.
  for (double level = -180.0; level >= lowest - 20.0 && level > -4000.0; level -= 360.0) {
    phase.marks.push_back({.at = level});
  }
  for (double level = 180.0; level <= highest + 20.0 && level < 4000.0; level += 360.0) {
    phase.marks.push_back({.at = level});
  }
  if (is_single(result) && result.loops.front().margins) {
    const classical::LoopMargins& margins = *result.loops.front().margins;
    if (const auto* at = least_phase(margins)) {
      phase.marks.push_back({at->frequency,
                             fmt::format("phase margin {}°", text::number(at->phase_margin, 3)),
                             true});
      gain.marks.push_back({at->frequency, "", true});
    }
    if (const auto* at = least_gain(margins); at != nullptr && is_drawn(at->frequency)) {
      gain.marks.push_back(
          {at->frequency,
           fmt::format("gain margin {} dB", text::number(in_decibels(at->gain_margin), 3)), true});
      phase.marks.push_back({at->frequency, "", true});
    }
  }
  figure.plot.panels = {std::move(gain), std::move(phase)};
  return figure;
}

/// The points of a Nyquist curve, and more between those that are far apart: between two of them
/// ln L is all but straight, as the grid was chosen.
std::vector<Complex> drawn_curve(const classical::NyquistData& data) {
  std::vector<Complex> points;
  for (Index k = 0; k < data.value.size(); ++k) {
    const Complex now = data.value(k);
    if (!points.empty()) {
      const Complex before = points.back();
      const Complex way = std::log(now / before);
      const double parts = std::isfinite(std::abs(way)) ? std::ceil(std::abs(way) / 0.05) : 1.0;
      for (int i = 1; i < static_cast<int>(std::min(parts, 64.0)); ++i) {
        points.push_back(before * std::exp(way * (i / std::min(parts, 64.0))));
      }
    }
    points.push_back(now);
  }
  return points;
}

/// How far from the origin a Nyquist curve is shown: beyond its crossings of the negative axis.
double nyquist_reach(const LoopResult& result) {
  double reach = 2.5;
  double largest = 0.0;
  for (const LoopFindings& loop : result.loops) {
    for (const auto& crossing : loop.margins->phase_crossings) {
      const double at = 1.0 / crossing.gain_margin;
      reach = at < 50.0 ? std::max(reach, 1.3 * at) : reach;
    }
    largest = std::max(largest, loop.nyquist->value.cwiseAbs().maxCoeff());
  }
  return largest < 4.0 * reach ? 1.05 * largest : reach;
}

Figure nyquist_figure(const LoopResult& result) {
  Figure figure{"nyquist",
                "nyquist",
                title_of(result, "Nyquist curve"),
                "The opened loop in the complex plane along the imaginary axis (of a discrete loop "
                "the unit circle), cut off far from the origin; dashed is that of negative "
                "frequencies. The closed loop has as many unstable poles as the whole curve "
                "encircles −1 clockwise, and those of the opened loop. The circle is a gain of "
                "one.",
                {}};
  figure.plot = {.title = figure.title,
                 .x_label = "Real part",
                 .equal_axes = true,
                 .unit_circle = true,
                 .width = 640};
  PlotPanel panel{.y_label = "Imaginary part",
                  .marks = {{.at = 0.0, .vertical = true}, {.at = 0.0}}};
  const double reach = nyquist_reach(result);
  for (std::size_t i = 0; i < result.loops.size(); ++i) {
    const LoopFindings& loop = result.loops[i];
    PlotLine curve{.label = is_single(result) ? "L" : short_name(loop), .color = color_of(i)};
    PlotLine mirrored{.label = is_single(result) ? "negative frequencies" : "",
                      .style = LineStyle::dashed,
                      .color = color_of(i)};
    for (const Complex& L : drawn_curve(*loop.nyquist)) {
      const bool shown = std::abs(L) <= reach;
      // A gap, once, where it is out of the picture.
      if (!shown && (curve.x.empty() || std::isnan(curve.x.back()))) {
        continue;
      }
      curve.x.push_back(shown ? L.real() : nan);
      curve.y.push_back(shown ? L.imag() : nan);
      mirrored.x.push_back(shown ? L.real() : nan);
      mirrored.y.push_back(shown ? -L.imag() : nan);
    }
    panel.lines.push_back(std::move(curve));
    panel.lines.push_back(std::move(mirrored));
  }
  panel.lines.push_back({.label = "−1",
                         .x = {-1.0},
                         .y = {0.0},
                         .style = LineStyle::crosses,
                         .color = static_cast<int>(std::min<std::size_t>(result.loops.size(), 6))});
  figure.plot.panels = {std::move(panel)};
  return figure;
}

Figure nichols_figure(const LoopResult& result) {
  Figure figure{"margins",
                "nichols",
                title_of(result, "Nichols plot"),
                "Gain over phase of the opened loop; thin are the curves of equal gain of the "
                "closed loop, L/(1 + L). A loop that passes the crosses (0 dB at −180° and its "
                "turns) at a distance bears what the model does not know.",
                {}};
  figure.plot = {.title = figure.title, .x_label = "Phase (°)", .width = 760};
  PlotPanel panel{.y_label = "Gain (dB)", .marks = {{.at = 0.0}}};
  double low = -180.0;
  double high = -180.0;
  constexpr double floor = -40.0;
  constexpr double roof = 40.0;
  std::vector<PlotLine> curves;
  for (std::size_t i = 0; i < result.loops.size(); ++i) {
    const LoopFindings& loop = result.loops[i];
    PlotLine curve{.label = label_of(result, loop), .color = color_of(i)};
    for (Index k = 0; k < result.frequency.size(); ++k) {
      const double gain = in_decibels(loop.bode->gain(k));
      const bool shown = gain >= floor && gain <= roof;
      if (!shown && (curve.x.empty() || std::isnan(curve.x.back()))) {
        continue;
      }
      curve.x.push_back(shown ? loop.bode->phase(k) : nan);
      curve.y.push_back(shown ? gain : nan);
      low = shown ? std::min(low, loop.bode->phase(k)) : low;
      high = shown ? std::max(high, loop.bode->phase(k)) : high;
    }
    curves.push_back(std::move(curve));
  }
  // A dead time turns for ever: four turns are shown.
  low = std::max(low, high - 1440.0);
  // From the lowest cross that the curves come near.
  constexpr double near = 60.0;
  const double first = std::ceil((low - near + 180.0) / 360.0) * 360.0 - 180.0;
  PlotLine crosses{.label = "0 dB at −180°", .style = LineStyle::crosses, .color = 1};
  for (double center = first; center <= high + 1.0; center += 360.0) {
    crosses.x.push_back(center);
    crosses.y.push_back(0.0);
    for (const double closed : {6.0, 3.0, 1.0, -3.0, -6.0, -12.0}) {
      // |T| = M: L = T/(1 - T) with T = M e^{jφ}.
      PlotLine guide{.style = LineStyle::guide};
      const double M = std::pow(10.0, closed / 20.0);
      double before = 0.0;
      for (int k = 0; k <= 240; ++k) {
        const Complex T = std::polar(M, 2.0 * pi * (k + 0.001) / 240.0);
        const Complex L = T / (1.0 - T);
        double angle = std::arg(-L) * 180.0 / pi;  // about the cross
        const double gain = in_decibels(std::abs(L));
        const bool jumps = k > 0 && std::abs(angle - before) > 180.0;
        before = angle;
        angle += center;
        const bool seen = gain >= floor && gain <= roof && angle >= std::min(low, center) - near &&
                          angle <= std::max(high, center) + near;
        if (jumps || !seen) {
          guide.x.push_back(nan);
          guide.y.push_back(nan);
        }
        if (seen) {
          guide.x.push_back(angle);
          guide.y.push_back(gain);
        }
      }
      if (center + 360.0 > high + 1.0) {
        // Above or below the cross, where the curves are apart.
        const bool beside = closed == -3.0;  // Those of -3 and -6 dB would touch.
        const double at =
            M > 1.0  ? M / (M - 1.0)
            : beside ? M * (std::sqrt(1.0 - 0.5 * M * M) - M * std::sqrt(0.5)) / (1.0 - M * M)
                     : M / (1.0 + M);
        panel.notes.push_back(
            {center + (beside ? 45.0 : 0.0), in_decibels(at), fmt::format("{} dB", closed)});
      }
      panel.lines.push_back(std::move(guide));
    }
  }
  for (PlotLine& curve : curves) {
    panel.lines.push_back(std::move(curve));
  }
  panel.lines.push_back(std::move(crosses));
  figure.plot.panels = {std::move(panel)};
  return figure;
}

/// What a picture of a locus has to show, as a distance from the origin.
double locus_size(const LoopFindings& loop) {
  double size = 0.0;
  const auto see = [&](const auto& roots) {
    for (const Complex& root : roots) {
      size = std::max(size, std::abs(root));
    }
  };
  see(loop.locus->poles);
  see(loop.locus->zeros);
  if (loop.closed_poles) {
    see(*loop.closed_poles);
  }
  for (const auto& point : loop.locus->branch_points) {
    size = std::max(size, std::abs(point.point));
  }
  for (const auto& crossing : loop.locus->crossings) {
    size = std::max(size, std::abs(crossing.point));
  }
  return size > 0.0 ? size : 1.0;
}

std::vector<Complex> complex_list(const auto& values) {
  return {values.begin(), values.end()};
}

/// The grid of damping ratios reaches from the poles and zeros to where branches are shown, with
/// its labels, which stand upon each other else.
void widen_grid(PlotPanel& panel, double reach, const std::vector<PolePlotGroup>& groups) {
  double largest = 0.0;
  for (const PolePlotGroup& group : groups) {
    for (const auto* roots : {&group.poles, &group.zeros}) {
      for (const Complex& root : *roots) {
        largest = std::max(largest, std::abs(root));
      }
    }
  }
  if (!(largest > 0.0)) {
    return;
  }
  const double wider = std::max(1.0, 0.85 * reach / largest);
  for (PlotLine& line : panel.lines) {
    if (line.style == LineStyle::guide) {
      for (std::size_t k = 0; k < line.x.size(); ++k) {
        line.x[k] *= wider;
        line.y[k] *= wider;
      }
    }
  }
  for (PlotNote& note : panel.notes) {
    note.x *= wider;
    note.y *= wider;
  }
}

Figure locus_figure(const LoopResult& result) {
  const bool discrete = result.loops.front().period().has_value();
  Figure figure{
      "rlocus",
      "root_locus",
      title_of(result, "Root locus"),
      fmt::format("The closed loop's poles as the gain goes from 0, at the crosses, to {}∞, at "
                  "the circles or along the dotted asymptotes. {} it is stable; dots are the "
                  "poles at the gain that was asked for.",
                  result.job.negative ? "−" : "",
                  discrete ? "Inside the unit circle" : "Left of the vertical line"),
      {}};
  std::vector<PolePlotGroup> groups;
  double size = 0.0;
  for (const LoopFindings& loop : result.loops) {
    groups.push_back({.label = label_of(result, loop),
                      .poles = complex_list(loop.locus->poles),
                      .zeros = complex_list(loop.locus->zeros)});
    size = std::max(size, locus_size(loop));
  }
  figure.plot = pole_plot(figure.title, groups, discrete);
  PlotPanel& panel = figure.plot.panels.front();
  const double reach = discrete ? std::max(1.5, std::min(1.2 * size, 4.0)) : 1.6 * size;
  if (!discrete) {
    widen_grid(panel, reach, groups);
  }
  std::vector<PlotLine> under;
  for (std::size_t i = 0; i < result.loops.size(); ++i) {
    const LoopFindings& loop = result.loops[i];
    const classical::RootLocus& locus = *loop.locus;
    for (const double angle : discrete ? std::vector<double>{} : locus.asymptotes.angles) {
      const Complex ray = std::polar(1.0, angle * pi / 180.0);
      const double center = locus.asymptotes.center;
      PlotLine asymptote{.style = LineStyle::dotted, .color = color_of(i)};
      for (const double far : {0.0, reach}) {
        asymptote.x.push_back(center + far * ray.real());
        asymptote.y.push_back(far * ray.imag());
      }
      under.push_back(std::move(asymptote));
    }
    for (Index branch = 0; branch < locus.branches.cols(); ++branch) {
      PlotLine line{.color = is_single(result) ? color_of(static_cast<std::size_t>(branch))
                                               : color_of(i)};
      for (Index k = 0; k < locus.branches.rows(); ++k) {
        const Complex s = locus.branches(k, branch);
        const bool shown = std::abs(s) <= reach;
        if (!shown && (line.x.empty() || std::isnan(line.x.back()))) {
          continue;
        }
        line.x.push_back(shown ? s.real() : nan);
        line.y.push_back(shown ? s.imag() : nan);
      }
      under.push_back(std::move(line));
    }
    if (loop.closed_poles && !result.job.negative) {
      PlotLine closed{.label = is_single(result) ? fmt::format("closed loop, k = {}",
                                                               text::number(result.job.gain))
                                                 : "",
                      .style = LineStyle::points,
                      .color = is_single(result) ? 1 : color_of(i)};
      for (const Complex& pole : *loop.closed_poles) {
        closed.x.push_back(pole.real());
        closed.y.push_back(pole.imag());
      }
      panel.lines.push_back(std::move(closed));
    }
  }
  // Grids first, then branches, then what is marked on them.
  const auto marks = std::find_if(panel.lines.begin(), panel.lines.end(), [](const PlotLine& line) {
    return line.style != LineStyle::guide;
  });
  panel.lines.insert(marks, std::make_move_iterator(under.begin()),
                     std::make_move_iterator(under.end()));
  return figure;
}

Figure response_figure(const LoopResult& result) {
  const bool closed =
      result.job.closed || result.job.view == sisotool || result.job.view == pidtune;
  const bool impulse = result.job.view == LoopView::impulse;
  const bool discrete = result.loops.front().period().has_value();
  const std::string what = fmt::format("{} response{}", impulse ? "Impulse" : "Step",
                                       closed ? " of the closed loop" : "");
  Figure figure = over_time(
      "response", impulse ? "impulse_response" : "step_response",
      closed && is_single(result) ? what : title_of(result, what),
      fmt::format("The output after a unit {} {}, from rest.", impulse ? "impulse" : "step",
                  closed ? "of the reference" : "of the input"));
  PlotPanel panel{.y_label = "Output"};
  for (std::size_t i = 0; i < result.loops.size(); ++i) {
    const LoopFindings& loop = result.loops[i];
    panel.lines.push_back(line(
        is_single(result) && loop.load ? "after a step of the reference" : label_of(result, loop),
        loop.response->time, loop.response->value, color_of(i),
        discrete ? LineStyle::steps : LineStyle::solid));
    if (loop.load) {
      panel.lines.push_back(line(is_single(result) ? "after a step of load" : "", loop.load->time,
                                 loop.load->value, is_single(result) ? quiet_color : color_of(i),
                                 LineStyle::dashed));
    }
  }
  if (const auto& metrics = result.loops.front().response->metrics;
      is_single(result) && metrics && std::isfinite(metrics->final_value)) {
    panel.marks.push_back({.at = metrics->final_value});
    if (metrics->settling_time && *metrics->settling_time > 0.0) {
      panel.marks.push_back({*metrics->settling_time,
                             "settled after " + text::seconds(*metrics->settling_time), true});
    }
  }
  figure.plot.panels = {std::move(panel)};
  return figure;
}

/// Columns of one length as CSV.
std::string csv_of(const std::vector<std::pair<std::string, std::vector<double>>>& columns) {
  std::string csv;
  for (const auto& [name, values] : columns) {
    std::string quoted = name;
    for (std::size_t at = 0; (at = quoted.find('"', at)) != std::string::npos; at += 2) {
      quoted.insert(at, 1, '"');
    }
    csv += fmt::format("{}\"{}\"", csv.empty() ? "" : ",", quoted);
  }
  csv += '\n';
  const std::size_t rows = columns.front().second.size();
  for (std::size_t row = 0; row < rows; ++row) {
    bool first = true;
    for (const auto& [name, values] : columns) {
      csv += first ? "" : ",";
      csv += std::isfinite(values[row]) ? text::exact(values[row]) : "";
      first = false;
    }
    csv += '\n';
  }
  return csv;
}

}  // namespace

std::string short_name(const LoopFindings& loop) {
  constexpr std::size_t longest = 48;
  return cut(loop.name, longest);
}

std::vector<Figure> figures_of(const LoopResult& result) {
  const LoopView view = result.job.view;
  const LoopFindings& first = result.loops.front();
  std::vector<Figure> figures;
  if ((view == rlocus || view == sisotool) && first.locus) {
    figures.push_back(locus_figure(result));
  }
  if (view == bode || view == margins || view == sisotool || view == pidtune) {
    figures.push_back(bode_figure(result));
  }
  if (view == nyquist || view == sisotool) {
    figures.push_back(nyquist_figure(result));
  }
  if (view == nichols) {
    figures.push_back(nichols_figure(result));
  }
  if (first.response) {
    figures.push_back(response_figure(result));
  }
  return figures;
}

std::vector<AnswerFile> data_files(const LoopResult& result) {
  std::vector<AnswerFile> files;
  if (result.frequency.size() > 0) {
    std::vector<std::pair<std::string, std::vector<double>>> columns{
        {"frequency (rad/s)", {result.frequency.begin(), result.frequency.end()}}};
    for (const LoopFindings& loop : result.loops) {
      std::vector<double> gains;
      for (const double gain : loop.bode->gain) {
        gains.push_back(in_decibels(gain));
      }
      columns.emplace_back("gain of " + loop.name + " (dB)", std::move(gains));
      columns.emplace_back("phase of " + loop.name + " (deg)",
                           std::vector<double>(loop.bode->phase.begin(), loop.bode->phase.end()));
    }
    files.push_back({"data/bode.csv", csv_of(columns)});
  }
  for (std::size_t i = 0; i < result.loops.size(); ++i) {
    const LoopFindings& loop = result.loops[i];
    const std::string number = is_single(result) ? "" : fmt::format("_{}", i + 1);
    if (loop.locus) {
      std::vector<std::pair<std::string, std::vector<double>>> columns{
          {"gain", {loop.locus->gains.begin(), loop.locus->gains.end()}}};
      for (Index branch = 0; branch < loop.locus->branches.cols(); ++branch) {
        std::vector<double> real;
        std::vector<double> imaginary;
        for (const Complex& s : loop.locus->branches.col(branch)) {
          real.push_back(s.real());
          imaginary.push_back(s.imag());
        }
        columns.emplace_back(fmt::format("real part of pole {}", branch + 1), std::move(real));
        columns.emplace_back(fmt::format("imaginary part of pole {}", branch + 1),
                             std::move(imaginary));
      }
      files.push_back({fmt::format("data/root_locus{}.csv", number), csv_of(columns)});
    }
    if (loop.response) {
      files.push_back(
          {fmt::format("data/response{}.csv", number),
           csv_of({{"time (s)", loop.response->time}, {"output", loop.response->value}})});
    }
    if (loop.load) {
      files.push_back({fmt::format("data/load{}.csv", number),
                       csv_of({{"time (s)", loop.load->time}, {"output", loop.load->value}})});
    }
    if (loop.nyquist) {
      std::vector<double> real;
      std::vector<double> imaginary;
      for (const Complex& L : loop.nyquist->value) {
        real.push_back(L.real());
        imaginary.push_back(L.imag());
      }
      files.push_back({fmt::format("data/nyquist{}.csv", number),
                       csv_of({{"frequency (rad/s)",
                                {loop.nyquist->frequency.begin(), loop.nyquist->frequency.end()}},
                               {"real part", std::move(real)},
                               {"imaginary part", std::move(imaginary)}})});
    }
  }
  return files;
}

}  // namespace flyball::study
