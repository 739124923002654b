#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <flyball/classical/delay_margins.hpp>
#include <flyball/classical/delay_poles.hpp>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Eigen::Index;
using Complex = std::complex<double>;

namespace {

struct DelayAxisPoles {
  double frequency = 0.0;
  int multiplicity = 0;
};

/// Those of the upper half of the axis, and how many lie right of it.
struct OpenPoles {
  std::vector<DelayAxisPoles> axis{};
  int right = 0;
};

OpenPoles sorted(const DelayPoles& found) {
  double fastest = 0.0;
  for (const Complex& pole : found.poles) {
    fastest = std::max(fastest, std::abs(pole));
  }
  OpenPoles open;
  for (const Complex& pole : found.poles) {
    const double blur = 1e-9 * std::max(std::abs(pole), 1e-6 * fastest);
    if (std::abs(pole.real()) > blur) {
      open.right += pole.real() > 0.0 ? 1 : 0;
      continue;
    }
    if (pole.imag() < -blur) {
      continue;
    }
    const double w = std::max(pole.imag(), 0.0) <= blur ? 0.0 : pole.imag();
    const auto same =
        std::find_if(open.axis.begin(), open.axis.end(), [&](const DelayAxisPoles& other) {
          return std::abs(other.frequency - w) <= std::max(blur, 1e-7 * w);
        });
    if (same != open.axis.end()) {
      ++same->multiplicity;
    } else {
      open.axis.push_back({w, 1});
    }
  }
  std::sort(
      open.axis.begin(), open.axis.end(),
      [](const DelayAxisPoles& a, const DelayAxisPoles& b) { return a.frequency < b.frequency; });
  return open;
}

class Curve {
 public:
  explicit Curve(const DelaySystem& loop) : loop_(loop) {}

  void add(double frequency, Complex offset = 0.0) {
    const auto L = loop_.at(Complex(0.0, frequency) + offset);
    if (L) {
      frequencies_.push_back(frequency + offset.imag());
      values_.push_back((*L)(0, 0));
    }
  }
  /// To the right of a pole, on a circle on which |L| is above 100.
  Indentation go_around(const DelayAxisPoles& poles, double lowest) {
    double radius = 0.01 * std::max(poles.frequency, lowest);
    const auto small = [&] {
      for (int i = 0; i <= 4; ++i) {
        const auto L = loop_.at(Complex(0.0, poles.frequency) +
                                std::polar(radius, 0.25 * pi * static_cast<double>(i - 2)));
        if (!L || std::abs((*L)(0, 0)) < 100.0) {
          return true;
        }
      }
      return false;
    };
    for (int i = 0; i < 200 && small(); ++i) {
      radius *= 0.5;
    }
    Indentation arc{.frequency = poles.frequency,
                    .multiplicity = poles.multiplicity,
                    .radius = radius,
                    .first = size()};
    const int steps = 16 * poles.multiplicity;
    for (int i = poles.frequency > 0.0 ? -steps : 0; i <= steps; ++i) {
      add(poles.frequency,
          std::polar(radius, 0.5 * pi * static_cast<double>(i) / static_cast<double>(steps)));
    }
    arc.last = size() - 1;
    return arc;
  }
  [[nodiscard]] Index size() const { return static_cast<Index>(values_.size()); }
  void finish(NyquistData& data) const {
    data.frequency = Eigen::Map<const Eigen::VectorXd>(frequencies_.data(), size());
    data.value = Eigen::Map<const Eigen::VectorXcd>(values_.data(), size());
    data.distance = std::numeric_limits<double>::infinity();
    for (Index k = 0; k < size(); ++k) {
      if (const double off = std::abs(1.0 + data.value(k)); off < data.distance) {
        data.distance = off;
        data.distance_frequency = data.frequency(k);
      }
    }
  }

 private:
  const DelaySystem& loop_;
  std::vector<double> frequencies_;
  std::vector<Complex> values_;
};

}  // namespace

Expected<NyquistData> nyquist(const DelaySystem& loop, const FrequencyGridOptions& options) {
  constexpr std::string_view where = "nyquist";
  if (loop.inputs() != 1 || loop.outputs() != 1) {
    return refusal(ArgumentError::wrong_shape, where, "the loop")
        .got(flyball::detail::format("{} x {}", loop.outputs(), loop.inputs()))
        .expected("of one input and one output");
  }
  if (loop.period()) {
    FLYBALL_TRY_IN(where, const auto states, loop.to_discrete());
    FLYBALL_TRY_IN(where, const auto response, frequency_response(states));
    return nyquist(response, options);
  }
  FLYBALL_TRY_IN(where, const DelayPoles of_loop, rightmost_poles(loop));
  FLYBALL_TRY_IN(where, const DelaySystem T, feedback(loop));
  FLYBALL_TRY_IN(where, const DelayPoles of_closed, rightmost_poles(T));
  FLYBALL_TRY_IN(where, const auto response, frequency_response(loop));
  FLYBALL_TRY_IN(where, const FrequencyGrid grid, frequency_grid(response, options));
  const OpenPoles open = sorted(of_loop);
  NyquistData data;
  Curve curve(loop);
  Index k = 0;
  const auto walk_until = [&](double end) {
    for (; k < grid.frequency.size() && grid.frequency(k) < end; ++k) {
      curve.add(grid.frequency(k));
    }
  };
  if (open.axis.empty() || open.axis.front().frequency > 0.0) {
    curve.add(0.0);
  }
  for (const DelayAxisPoles& poles : open.axis) {
    walk_until(poles.frequency);
    data.indentations.push_back(curve.go_around(poles, grid.frequency(0)));
    const Indentation& arc = data.indentations.back();
    while (k < grid.frequency.size() && grid.frequency(k) <= arc.frequency + arc.radius) {
      ++k;
    }
  }
  walk_until(std::numeric_limits<double>::infinity());
  curve.finish(data);
  data.open_loop_unstable = open.right;
  constexpr int endless = std::numeric_limits<int>::max();
  // A closed-loop pole on the axis lies on the curve.
  const auto on_axis = [](const Complex& pole) {
    return std::abs(pole.real()) <= 1e-9 * std::abs(pole);
  };
  if (of_loop.unstable != endless && of_closed.unstable != endless &&
      std::none_of(of_closed.poles.begin(), of_closed.poles.end(), on_axis)) {
    data.closed_loop_unstable = of_closed.unstable;
    data.encirclements = of_closed.unstable - open.right;
  }
  return data;
}

}  // namespace flyball::classical
