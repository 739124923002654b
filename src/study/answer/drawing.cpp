#include <algorithm>
#include <cmath>

#include "study/answer/drawing.hpp"

namespace flyball::study {

namespace {

/// The rows whose x is within, of columns as long as it.
void keep(const PlotLimits& stretch, std::vector<double>& x,
          std::initializer_list<std::vector<double>*> columns) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (x[i] >= stretch.low && x[i] <= stretch.high) {
      rows.push_back(i);
    }
  }
  const auto pick = [&](std::vector<double>& values) {
    std::vector<double> kept(rows.size());
    std::transform(rows.begin(), rows.end(), kept.begin(),
                   [&](std::size_t row) { return values[row]; });
    values = std::move(kept);
  };
  for (std::vector<double>* column : columns) {
    pick(*column);
  }
  pick(x);
}

}  // namespace

std::vector<double> since(double beginning, const std::vector<double>& time) {
  std::vector<double> counted(time.size());
  std::transform(time.begin(), time.end(), counted.begin(),
                 [&](double t) { return t - beginning; });
  return counted;
}

std::optional<PlotLimits> transient_of(const std::vector<double>& time,
                                       const std::vector<double>& value) {
  constexpr double share = 0.8;
  constexpr double short_part = 0.25;
  const std::size_t count = std::min(time.size(), value.size());
  if (count < 10) {
    return std::nullopt;
  }
  std::vector<double> variation(count, 0.0);
  for (std::size_t i = 1; i < count; ++i) {
    const double step = std::abs(value[i] - value[i - 1]);
    variation[i] = variation[i - 1] + (std::isfinite(step) ? step : 0.0);
  }
  const double wanted = share * variation.back();
  if (!(wanted > 0.0)) {
    return std::nullopt;
  }
  PlotLimits shortest{time[0], time[count - 1]};
  for (std::size_t from = 0, to = 0; to < count; ++to) {
    while (variation[to] - variation[from + 1] >= wanted) {
      ++from;
    }
    if (variation[to] - variation[from] >= wanted &&
        time[to] - time[from] < shortest.high - shortest.low) {
      shortest = {time[from], time[to]};
    }
  }
  const double length = shortest.high - shortest.low;
  if (!(length > 0.0) || length >= short_part * (time[count - 1] - time[0])) {
    return std::nullopt;
  }
  return PlotLimits{std::max(time[0], shortest.low - 0.5 * length),
                    std::min(time[count - 1], shortest.high + length)};
}

Figure transient(const Figure& whole, const PlotLimits& stretch) {
  Figure figure = whole;
  figure.name += "_transient";
  figure.title += ", its transient";
  figure.description = "The same where most of the motion is.";
  figure.plot.title = figure.title;
  figure.plot.clock.clear();
  for (PlotPanel& panel : figure.plot.panels) {
    for (PlotLine& line : panel.lines) {
      keep(stretch, line.x, {&line.y});
    }
    std::erase_if(panel.lines, [](const PlotLine& line) {
      return std::none_of(line.y.begin(), line.y.end(), [](double y) { return std::isfinite(y); });
    });
    for (PlotBand& band : panel.bands) {
      keep(stretch, band.x, {&band.low, &band.high});
    }
    std::erase_if(panel.marks, [&](const PlotMark& mark) {
      return mark.vertical && (mark.at < stretch.low || mark.at > stretch.high);
    });
    for (PlotSpan& span : panel.spans) {
      span.from = std::max(span.from, stretch.low);
      span.to = std::min(span.to, stretch.high);
    }
    std::erase_if(panel.spans, [](const PlotSpan& span) { return span.from >= span.to; });
  }
  return figure;
}

}  // namespace flyball::study
