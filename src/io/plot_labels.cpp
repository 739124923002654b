#include <algorithm>
#include <cmath>
#include <limits>

#include "io/plot_labels.hpp"
#include "io/plot_legend.hpp"

namespace flyball::io {
namespace {

double along(double value, const Range& range, bool logarithmic, double length) {
  return length * (logarithmic
                       ? std::log(value / range.low()) / std::log(range.high() / range.low())
                       : (value - range.low()) / range.span());
}

}  // namespace

Labels::Labels(const PlotPanel& panel, const PanelView& view) : view_(view) {
  if (std::none_of(panel.marks.begin(), panel.marks.end(),
                   [](const PlotMark& mark) { return mark.vertical && !mark.label.empty(); })) {
    return;
  }
  for (const PlotMark& mark : panel.marks) {
    if (mark.vertical) {
      marks_.push_back(along(mark.at, view.x, view.log_x, view.width));
    }
  }
  for (const PlotLine& line : panel.lines) {
    if (line.style == LineStyle::guide) {
      continue;  // it is behind all else
    }
    Curve& curve = curves_.emplace_back();
    curve.scattered = scattered(line.style);
    for (std::size_t i = 0; i < line.x.size(); ++i) {
      curve.points.x.push_back(along(line.x[i], view.x, view.log_x, view.width));
      curve.points.y.push_back(along(line.y[i], view.y, view.log_y, view.height));
    }
  }
}

/// How many points, or pieces of a curve, lie in a place.
std::size_t Labels::hidden(const Curve& curve, const Place& place) {
  const auto& [x, y] = curve.points;
  std::size_t count = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const std::size_t before = curve.scattered || i == 0 ? i : i - 1;
    const double first = std::min(x[before], x[i]);
    const double last = std::max(x[before], x[i]);
    if (!(first <= place.right && last >= place.left)) {
      continue;
    }
    // Of a piece that is not steep only what lies beside the place counts.
    const auto y_at = [&](double at) {
      return y[before] + (at - x[before]) / (x[i] - x[before]) * (y[i] - y[before]);
    };
    const bool upright = !(last > first);
    const double one = upright ? y[before] : y_at(std::max(first, place.left));
    const double other = upright ? y[i] : y_at(std::min(last, place.right));
    count += std::min(one, other) <= place.top && std::max(one, other) >= place.bottom ? 1U : 0U;
  }
  return count;
}

Labels::Placement Labels::place(const PlotMark& mark, double size) {
  constexpr std::size_t a_label = 1'000'000;  // worse than any curve
  const double half = 0.75 * size;
  const double at = along(mark.at, view_.x, view_.log_x, view_.width);
  const double width = text_width(mark.label, size) + size;
  const bool fits_after = at + width <= view_.width;
  const bool fits_before = at >= width;
  Placement best;
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  Place chosen;
  for (const double share : {0.96, 0.05, 0.84, 0.16, 0.7, 0.3, 0.5}) {
    for (const bool before : {false, true}) {
      if (before ? !fits_before : !fits_after && fits_before) {
        continue;
      }
      const double middle = share * view_.height;
      const Place place{before ? at - width : at, before ? at : at + width, middle - half,
                        middle + half};
      std::size_t covered = 0;
      for (const Place& other : taken_) {
        covered += place.left < other.right && other.left < place.right &&
                           place.bottom < other.top && other.bottom < place.top
                       ? a_label
                       : 0U;
      }
      for (const Curve& curve : curves_) {
        covered += hidden(curve, place);
      }
      for (const double line : marks_) {
        covered += line != at && line > place.left && line < place.right ? 1U : 0U;
      }
      if (covered < fewest) {
        fewest = covered;
        best = {share, before};
        chosen = place;
      }
    }
  }
  taken_.push_back(chosen);
  return best;
}

}  // namespace flyball::io
