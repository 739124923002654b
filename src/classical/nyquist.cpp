#include <flyball/classical/nyquist.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include "classical/delay_characteristic.hpp"
#include "classical/factors.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

/// Poles in one place on the upper half of the axis.
struct AxisPoles {
  double frequency = 0.0;
  int multiplicity = 0;
  double radius = 0.0;
};

struct Point {
  double frequency = 0.0;
  Complex value;
};

class Contour {
 public:
  Contour(const FrequencyResponse& loop, Factors factors)
      : loop_(loop),
        period_(loop.period()),
        factors_(std::move(factors)),
        most_points_(points_within_reason(factors_)) {
    find_axis_poles();
  }

  [[nodiscard]] const std::vector<AxisPoles>& axis_poles() const { return axis_; }
  [[nodiscard]] bool passes_through() const { return passes_through_; }
  /// What 1 + L has turned so far, rad.
  [[nodiscard]] double turned() const { return turned_; }
  [[nodiscard]] const std::vector<Point>& points() const { return points_; }
  [[nodiscard]] double end() const { return loop_.highest_frequency(); }

  /// Along the axis from where it is to a frequency.
  void walk_to(double frequency) {
    if (points_.empty()) {
      points_.push_back({frequency, value(frequency)});
      return;
    }
    std::vector<Point> pending{{frequency, value(frequency)}};
    while (!pending.empty()) {
      const Point from = points_.back();
      const Point to = pending.back();
      const double moved = farthest(from, to.frequency);
      const Complex before = 1.0 + from.value;
      if (moved < 0.999 * std::abs(before)) {
        turned_ += std::arg((1.0 + to.value) / before);
        points_.push_back(to);
        pending.pop_back();
        continue;
      }
      const double width = to.frequency - from.frequency;
      if (!(width > 1e-14 * to.frequency) || points_.size() > most_points_) {
        passes_through_ = true;
        points_.push_back(to);
        pending.pop_back();
        continue;
      }
      const double middle = from.frequency > 0.0 && to.frequency > 2.0 * from.frequency
                                ? std::sqrt(from.frequency * to.frequency)
                                : from.frequency + 0.5 * width;
      pending.push_back({middle, value(middle)});
    }
  }

  /// Around poles on the axis; the first arc begins and one at π/T ends on the real axis.
  Indentation go_around(const AxisPoles& poles) {
    const double from = poles.frequency == 0.0 ? 0.0 : -0.5 * pi;
    const double to = poles.frequency == end() ? 0.0 : 0.5 * pi;
    const int steps = 16 * std::max(1, poles.multiplicity);
    Indentation arc{poles.frequency, poles.multiplicity, poles.radius};
    const bool begins = points_.empty();
    arc.first = static_cast<Index>(points_.size()) - (begins ? 0 : 1);
    for (int k = begins ? 0 : 1; k <= steps; ++k) {
      const double angle = from + (to - from) * k / steps;
      const Complex L =
          value_of(factors_, Complex(0.0, poles.frequency) + std::polar(poles.radius, angle));
      if (!points_.empty()) {
        turned_ += std::arg((1.0 + L) / (1.0 + points_.back().value));
      }
      points_.push_back(
          {k == steps ? poles.frequency + (to > 0.0 ? poles.radius : 0.0) : poles.frequency, L});
    }
    arc.last = static_cast<Index>(points_.size()) - 1;
    return arc;
  }

  /// From the last point on the axis to infinity, where L is a number; nothing if it circles -1
  /// for ever there.
  bool close() {
    const Index excess = factors_.poles.size() - factors_.zeros.size();
    const double direct = excess == 0 ? factors_.gain : 0.0;
    if (1.0 + direct == 0.0) {
      passes_through_ = true;
      return true;
    }
    if (period_) {
      return true;
    }
    if (factors_.delay > 0.0 && std::abs(direct) >= detail::endless_from) {
      return false;
    }
    double largest = 0.0;
    double sum = 0.0;
    for (const auto* roots : {&factors_.zeros, &factors_.poles}) {
      for (const Complex root : *roots) {
        largest = std::max(largest, std::abs(root));
        sum += std::abs(root);
      }
    }
    // Beyond W, |ln L - ln k (jω)^{-excess}| <= 2 Σ|r|/ω.
    const double allowed =
        direct == 0.0
            ? 0.5
            : std::log1p(
                  0.5 * (factors_.delay > 0.0 ? (1.0 - std::abs(direct)) : std::abs(1.0 + direct)) /
                  std::abs(direct));
    double W = std::max({2.0 * largest, 2.0 * sum / allowed, points_.back().frequency});
    if (direct == 0.0) {
      // |L| < 1/2 from there on.
      const double log_k = std::log(std::abs(factors_.gain)) + allowed + std::log(2.0);
      W = std::max(W, std::exp(log_k / static_cast<double>(excess)));
    }
    if (!std::isfinite(W)) {
      passes_through_ = true;
      return true;
    }
    if (W > points_.back().frequency) {
      walk_to(W);
    }
    turned_ += std::arg((factors_.delay > 0.0 ? 1.0 : 1.0 + direct) / (1.0 + points_.back().value));
    return true;
  }

  [[nodiscard]] int unstable_poles() const {
    int count = 0;
    for (const Complex pole : factors_.poles) {
      const bool right = period_ ? std::abs(pole) > 1.0 : pole.real() > 0.0;
      count += right && !detail::on_axis(pole, period_) ? 1 : 0;
    }
    return count;
  }

 private:
  /// An evaluation of n states costs O(n²); dead time turns L without end.
  static std::size_t points_within_reason(const Factors& factors) {
    const auto n = static_cast<double>(factors.poles.size());
    const double work = factors.delay > 0.0 ? 1e7 : 4e6;
    return static_cast<std::size_t>(std::max(20'000.0, work / (30.0 + n * n)));
  }

  [[nodiscard]] Complex value(double frequency) const { return loop_.at(frequency)(0, 0); }

  /// How far L may be from its value at the beginning, anywhere on a step.
  [[nodiscard]] double farthest(const Point& from, double to) const {
    // Zeros on the axis within the step would make ln L infinite: they are taken out.
    Factors rest = factors_;
    double beyond = 1.0;
    Index kept = 0;
    const double scale = period_ ? period_->si() : 1.0;
    for (const Complex zero : factors_.zeros) {
      const double place = period_ ? std::arg(zero) / scale : zero.imag();
      const double before = from.frequency - place;
      const double after = to - place;
      if (before <= 0.0 && after >= 0.0 && detail::on_axis(zero, period_)) {
        beyond *= scale * std::max(-before, after);
      } else {
        rest.zeros(kept++) = zero;
      }
    }
    const double size = std::abs(from.value);
    if (kept == factors_.zeros.size()) {
      return size * std::expm1(detail::variation(factors_, from.frequency, to, period_));
    }
    rest.zeros.conservativeResize(kept);
    const double others = std::abs(value_of(rest, Complex(0.0, from.frequency)));
    return size + others * beyond * std::exp(detail::variation(rest, from.frequency, to, period_));
  }

  /// By the factors, so that poles are where the indentations have them.
  [[nodiscard]] Complex value_of(const Factors& factors, Complex s) const {
    const Complex z = period_ ? std::exp(s * period_->si()) : s;
    Complex product = factors.gain * std::exp(-s * factors.delay);
    const Index most = std::max(factors.zeros.size(), factors.poles.size());
    for (Index i = 0; i < most; ++i) {
      product *= i < factors.zeros.size() ? z - factors.zeros(i) : 1.0;
      product /= i < factors.poles.size() ? z - factors.poles(i) : 1.0;
    }
    return product;
  }

  void find_axis_poles() {
    const auto place = [&](Complex root) {
      return period_ ? std::abs(std::arg(root)) / period_->si() : std::abs(root.imag());
    };
    const auto upper = [&](Complex root) {
      return detail::on_axis(root, period_) && root.imag() >= 0.0;
    };
    const auto count = [&](const VectorXcd& roots, int sign) {
      for (const Complex root : roots) {
        if (!upper(root)) {
          continue;
        }
        const double w = place(root);
        auto same = std::find_if(axis_.begin(), axis_.end(), [&](const AxisPoles& other) {
          return std::abs(other.frequency - w) <= 1e-9 * w;
        });
        if (same != axis_.end()) {
          same->multiplicity += sign;
        } else if (sign > 0) {
          axis_.push_back({w, sign});
        }
      }
    };
    count(factors_.poles, 1);
    count(factors_.zeros, -1);
    std::erase_if(axis_, [](const AxisPoles& poles) { return poles.multiplicity <= 0; });
    std::sort(axis_.begin(), axis_.end(),
              [](const AxisPoles& a, const AxisPoles& b) { return a.frequency < b.frequency; });
    for (AxisPoles& poles : axis_) {
      if (period_ && poles.frequency > end() * (1.0 - 1e-12)) {
        poles.frequency = end();
      }
      poles.radius = radius_at(poles);
    }
  }

  /// L = R/(s - jν)^m, of which ln R moves by a tenth at most and |L| is above 100.
  [[nodiscard]] double radius_at(const AxisPoles& poles) const {
    const double scale = period_ ? period_->si() : 1.0;
    const Complex here =
        period_ ? std::polar(1.0, poles.frequency * scale) : Complex(0.0, poles.frequency);
    double log_R = std::log(std::abs(factors_.gain));
    double steepness = factors_.delay;  // |d ln R/ds|
    double nearest = infinity;
    // Of a discrete one z - e^{jνT} ≈ T e^{jνT} (s - jν).
    log_R -= poles.multiplicity * std::log(scale);
    const auto add = [&](const VectorXcd& roots, double sign) {
      for (const Complex root : roots) {
        const double distance = std::abs(here - root);
        if (distance <= 1e-9 * std::abs(here) || distance == 0.0) {
          continue;
        }
        log_R += sign * std::log(distance);
        steepness += scale / distance;
        nearest = std::min(nearest, distance / scale);
      }
    };
    add(factors_.zeros, 1.0);
    add(factors_.poles, -1.0);
    double radius = std::exp((log_R - 0.1 - std::log(100.0)) / poles.multiplicity);
    radius = std::min({radius, 0.05 / steepness, 0.1 * nearest});
    return period_ ? std::min(radius, 0.01 / scale) : radius;
  }

  const FrequencyResponse& loop_;
  std::optional<Time> period_;
  Factors factors_;
  std::size_t most_points_;
  std::vector<AxisPoles> axis_;
  std::vector<Point> points_;
  double turned_ = 0.0;
  bool passes_through_ = false;
};

/// The grid's frequencies between the indentations, walked and gone around in their order.
std::vector<Indentation> follow(Contour& contour, const VectorXd& grid) {
  std::vector<Indentation> arcs;
  Index k = 0;
  const auto walk_until = [&](double end) {
    for (; k < grid.size() && grid(k) < end; ++k) {
      if (contour.points().empty() || grid(k) > contour.points().back().frequency) {
        contour.walk_to(grid(k));
      }
    }
  };
  if (contour.axis_poles().empty() || contour.axis_poles().front().frequency > 0.0) {
    contour.walk_to(0.0);
  }
  for (const AxisPoles& poles : contour.axis_poles()) {
    if (poles.frequency > 0.0) {
      walk_until(poles.frequency - poles.radius);
      contour.walk_to(poles.frequency - poles.radius);
    }
    arcs.push_back(contour.go_around(poles));
  }
  if (arcs.empty() || arcs.back().frequency < contour.end()) {
    walk_until(infinity);
    if (std::isfinite(contour.end()) && contour.points().back().frequency < contour.end()) {
      contour.walk_to(contour.end());
    }
  }
  return arcs;
}

}  // namespace

Expected<NyquistData> nyquist(const FrequencyResponse& loop, const FrequencyGridOptions& options) {
  constexpr std::string_view where = "nyquist";
  if (loop.inputs() != 1 || loop.outputs() != 1) {
    return refusal(ArgumentError::wrong_shape, where, "the loop")
        .got(flyball::detail::format("{} x {}", loop.outputs(), loop.inputs()))
        .expected("of one input and one output")
        .hint("close all loops but one, or take one entry");
  }
  auto factors = loop.factors();
  if (!factors) {
    return refusal(ArgumentError::empty, where, "the loop's poles")
        .got("not known: it is data, or has a delay inside a loop")
        .expected("a transfer function or a state space");
  }
  FLYBALL_TRY(const auto grid, frequency_grid(loop, options));
  NyquistData data;
  if (factors->gain == 0.0) {
    data.frequency = grid.frequency;
    data.value = VectorXcd::Zero(grid.frequency.size());
    data.encirclements = 0;
    data.closed_loop_unstable = 0;
    data.distance = 1.0;
    return data;
  }
  Contour contour(loop, *std::move(factors));
  data.indentations = follow(contour, grid.frequency);
  const auto shown = static_cast<Index>(contour.points().size());
  const bool ends = contour.close();
  data.frequency.resize(shown);
  data.value.resize(shown);
  data.distance = infinity;
  for (Index k = 0; k < shown; ++k) {
    const Point& point = contour.points()[static_cast<std::size_t>(k)];
    data.frequency(k) = point.frequency;
    data.value(k) = point.value;
    if (std::abs(1.0 + point.value) < data.distance) {
      data.distance = std::abs(1.0 + point.value);
      data.distance_frequency = point.frequency;
    }
  }
  data.open_loop_unstable = contour.unstable_poles();
  if (ends && !contour.passes_through()) {
    // The lower half turns as far as the upper one.
    data.encirclements = -static_cast<int>(std::lround(contour.turned() / pi));
    data.closed_loop_unstable = *data.encirclements + data.open_loop_unstable;
  }
  return data;
}

}  // namespace flyball::classical
