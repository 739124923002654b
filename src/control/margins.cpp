#include <flyball/control/margins.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/systems/system_error.hpp>

#include "classical/loop_peaks.hpp"
#include "control/delay_margin.hpp"
#include "control/sampled_loop.hpp"
#include "core/constants.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;
using detail::SampledLoop;

Crossover crossover(double frequency, const Complex& L) {
  return {frequency, std::abs(L), std::arg(L) * 180.0 / pi};
}

void set_gain_margins(StabilityMargins& margins) {
  margins.gain_margin_up = infinity;
  margins.gain_margin_down = 0.0;
  for (const Crossover& c : margins.phase_crossovers) {
    const double factor = 1.0 / c.gain;
    if (factor > 1.0) {
      margins.gain_margin_up = std::min(margins.gain_margin_up, factor);
    } else {
      margins.gain_margin_down = std::max(margins.gain_margin_down, factor);
    }
  }
}

void set_disk_margin(StabilityMargins& margins, const classical::Peak& spread) {
  const double alpha = 2.0 / spread.value;
  margins.disk_margin = alpha;
  margins.disk_gain_up = alpha < 2.0 ? (2.0 + alpha) / (2.0 - alpha) : infinity;
  margins.disk_gain_down = (2.0 - alpha) / (2.0 + alpha);
  margins.disk_phase = 2.0 * std::atan(0.5 * alpha) * 180.0 / pi;
  margins.disk_frequency = spread.frequency;
}

/// Whether L is another one by its poles and zeros than by its matrices: then it is neither.
bool is_rounding(const SampledLoop& sampled, const classical::FrequencyResponse& response) {
  const auto factors = response.factors();
  if (!factors || factors->gain == 0.0) {
    return false;
  }
  int other = 0;
  constexpr int count = 16;
  for (int i = 0; i < count; ++i) {
    const double theta = pi * std::pow(10.0, -0.25 * i);
    const Complex z = std::polar(1.0, theta);
    Complex expected = std::polar(factors->gain, -theta * factors->delay);
    for (const Complex zero : factors->zeros) {
      expected *= z - zero;
    }
    for (const Complex pole : factors->poles) {
      expected /= z - pole;
    }
    const Complex L = sampled.response(theta);
    other += std::abs(L - expected) > 0.01 * std::abs(L) ? 1 : 0;
  }
  return 2 * other > count;
}

/// What `classical` finds of any loop, by rad a sample: periods may be of any size.
Expected<classical::detail::WholeMargins> found_of(const SampledLoop& sampled) {
  constexpr std::string_view where = "stability_margins";
  FLYBALL_TRY_IN(where, const auto response, sampled.open(Time(1.0)));
  const bool rounding = is_rounding(sampled, response);
  auto found = rounding ? Expected<classical::detail::WholeMargins>{}
                        : classical::detail::whole_margins(response);
  if (rounding || (!found && found.error().is(SystemError::no_convergence))) {
    return refusal(SystemError::no_convergence, where, "the loop's response")
        .got("rounding: it turns between any two frequencies")
        .hint(
            "measure states and outputs in units in which the entries of A, B, C and K are near "
            "one");
  }
  return found;
}

}  // namespace

Expected<StabilityMargins> stability_margins(const PlantInputLoop& loop) {
  FLYBALL_CHECK(detail::check_loop(loop, "stability_margins"));
  FLYBALL_TRY(const auto sampled, SampledLoop::create(loop));
  FLYBALL_TRY(const auto found, found_of(sampled));
  const double period = loop.period.si();
  StabilityMargins margins;
  margins.spectral_radius = detail::spectral_radius(sampled.closed(1.0));
  margins.stable = margins.spectral_radius < 1.0;
  std::vector<double> thetas;
  for (const classical::GainCrossing& at : found.margins.gain_crossings) {
    margins.gain_crossovers.push_back(
        crossover(at.frequency / period, sampled.response(at.frequency)));
    thetas.push_back(at.frequency);
  }
  for (const classical::PhaseCrossing& at : found.margins.phase_crossings) {
    margins.phase_crossovers.push_back(
        crossover(at.frequency / period, Complex(-1.0 / at.gain_margin, 0.0)));
  }
  if (!margins.stable) {
    return margins;
  }
  set_gain_margins(margins);
  margins.phase_margin = std::abs(found.margins.phase_margin.value_or(180.0));
  margins.delay_margin = detail::delay_margin(loop, thetas, sampled);
  set_disk_margin(margins, {found.spread.value, found.spread.frequency / period});
  return margins;
}

}  // namespace flyball
