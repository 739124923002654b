#include <flyball/classical/filters/sample_rate.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <string>

#include <flyball/classical/filters/fir_design.hpp>

#include "core/constants.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXd;

namespace {

double decibels(Complex response) {
  return -20.0 * std::log10(std::abs(response));
}

/// -∠H, counted from rest, without whole turns lost: each root turns by less than half a turn.
double phase_lag(const AnalogFilter& filter, double frequency) {
  double lag = 0.0;
  for (const Complex pole : filter.poles) {
    lag += std::arg(Complex(0.0, frequency) - pole);
  }
  return lag;  // the zeros lie on the axis, above the frequency
}
double phase_lag(const DigitalFilter& filter, double frequency) {
  const Complex back = std::polar(1.0, -frequency * filter.period.si());
  double lag = 0.0;
  for (const Complex pole : filter.poles) {
    lag += std::arg(1.0 - pole * back);
  }
  for (const Complex zero : filter.zeros) {
    lag -= std::arg(1.0 - zero * back);
  }
  return lag;
}

template <class Filter>
void tell(const Filter& filter, double band, AntiAliasingAdvice& advice) {
  advice.attenuation = decibels(filter.response(advice.first_alias));
  advice.loss = decibels(filter.response(band));
  advice.phase_lag = phase_lag(filter, band);
  advice.delay = filter.group_delay(0.0);
}

}  // namespace

Expected<AntiAliasingAdvice> advise_anti_aliasing(Time period, const AntiAliasing& wanted,
                                                  std::optional<Time> source) {
  constexpr std::string_view where = "advise_anti_aliasing";
  const double T = period.si();
  FLYBALL_CHECK(Checks(where).positive(T, "period", "s").positive(wanted.band, "band", "rad/s"));
  const double nyquist = pi / T;
  if (!(wanted.band < nyquist)) {
    return refusal(ArgumentError::out_of_range, where, "band")
        .got(format_number(wanted.band) + " rad/s")
        .expected("below half the new sample rate, which is " + format_number(nyquist) + " rad/s")
        .hint("sample faster, or ask for less");
  }
  if (source) {
    FLYBALL_CHECK(check_positive(source->si(), where, "source", "s"));
    if (!(source->si() < T)) {
      return refusal(ArgumentError::out_of_range, where, "source")
          .got(format_number(source->si()) + " s")
          .expected("below the new period, which is " + format_number(T) + " s");
    }
  }
  AntiAliasingAdvice advice;
  advice.nyquist_frequency = nyquist;
  advice.first_alias = 2.0 * nyquist - wanted.band;
  advice.sampling_phase_lag = 0.5 * wanted.band * T;
  advice.design = {.family = wanted.family,
                   .order = 0,
                   .ripple = wanted.ripple,
                   .attenuation = wanted.attenuation};
  if (source && advice.first_alias >= pi / source->si()) {
    advice.attenuation = std::numeric_limits<double>::infinity();
    return advice;
  }
  FLYBALL_TRY_IN(where, const FilterOrder order,
                 filter_order(wanted.family, FilterBand::low_pass,
                              {.pass = {wanted.band, 0.0},
                               .stop = {advice.first_alias, 0.0},
                               .ripple = wanted.ripple,
                               .attenuation = wanted.attenuation},
                              source));
  advice.design = order.design;
  advice.exact_order = order.exact;
  if (!source) {
    FLYBALL_TRY_IN(where, const AnalogFilter filter, design_analog_filter(order.design));
    tell(filter, wanted.band, advice);
    return advice;
  }
  FLYBALL_TRY_IN(where, const DigitalFilter filter, design_filter(order.design, *source));
  tell(filter, wanted.band, advice);
  // Kaiser's ripple is the same in both bands: 1 - 10^(-ripple/20).
  const double ripple = -20.0 * std::log10(-std::expm1(-wanted.ripple * std::numbers::ln10 / 20.0));
  FLYBALL_TRY_IN(where, const KaiserChoice kaiser,
                 kaiser_choice(std::max({wanted.attenuation, ripple, 8.0}),
                               advice.first_alias - wanted.band, *source));
  advice.fir_taps = kaiser.taps;
  advice.fir_delay = 0.5 * static_cast<double>(kaiser.taps - 1) * source->si();
  return advice;
}

Expected<VectorXd> decimate(const MatrixRef& x, int factor) {
  constexpr std::string_view where = "decimate";
  if (factor < 1 || factor > 1000) {
    return refusal(ArgumentError::out_of_range, where, "factor")
        .got(std::to_string(factor))
        .expected("1 to 1000");
  }
  FLYBALL_CHECK(Checks(where).shape(x, x.rows(), 1, "x", "samples x 1").finite(x, "x"));
  if (factor == 1) {
    return VectorXd(x.col(0));
  }
  FLYBALL_TRY_IN(where, const DigitalFilter filter,
                 design_filter({.family = FilterFamily::chebyshev1,
                                .order = 8,
                                .frequency = 0.8 * pi / factor,
                                .ripple = 0.05},
                               Time(1.0)));
  FLYBALL_TRY_IN(where, const VectorXd smooth, filter_zero_phase(filter.sections, x));
  VectorXd y((x.rows() + factor - 1) / factor);
  for (Index k = 0; k < y.size(); ++k) {
    y(k) = smooth(k * factor);
  }
  return y;
}

Expected<VectorXd> resample(const MatrixRef& x, int up, int down, bool line) {
  constexpr std::string_view where = "resample";
  constexpr int most = 100000;
  for (const auto& [value, name] : {std::pair{up, "up"}, {down, "down"}}) {
    if (value < 1 || value > most) {
      return refusal(ArgumentError::out_of_range, where, name)
          .got(std::to_string(value))
          .expected("1 to " + std::to_string(most));
    }
  }
  if (x.size() == 0) {
    return refusal(ArgumentError::empty, where, "x").expected("samples x 1");
  }
  FLYBALL_CHECK(Checks(where).shape(x, x.rows(), 1, "x", "samples x 1").finite(x, "x"));
  const int common = std::gcd(up, down);
  const Index u = up / common;
  const Index d = down / common;
  if (u == 1 && d == 1) {
    return VectorXd(x.col(0));
  }
  const Index n = x.rows();
  constexpr double most_answered = 1e9;
  if (static_cast<double>(n) * static_cast<double>(u) / static_cast<double>(d) > most_answered) {
    return refusal(ArgumentError::out_of_range, where, "up")
        .got("so large that more than 10⁹ samples are answered")
        .expected("less");
  }
  const Index half = 10 * std::max(u, d);
  FLYBALL_TRY_IN(
      where, VectorXd h,
      design_fir({.taps = 2 * half + 1, .frequency = pi / static_cast<double>(std::max(u, d))},
                 Time(1.0), 5.0));
  h *= static_cast<double>(u);
  const double start = line ? x(0, 0) : 0.0;
  const double slope = line && n > 1 ? (x(n - 1, 0) - x(0, 0)) / static_cast<double>(n - 1) : 0.0;
  const auto on_line = [&](double k) { return start + slope * k; };
  VectorXd y((n * u + d - 1) / d);
  for (Index m = 0; m < y.size(); ++m) {
    // y_m = Σ x_k h(m d - k u), h centred.
    const Index at = m * d;
    const Index first = std::max<Index>(0, (at - half + u - 1) / u);
    const Index last = std::min<Index>(n - 1, (at + half) / u);
    double sum = 0.0;
    for (Index k = first; k <= last; ++k) {
      sum += (x(k, 0) - on_line(static_cast<double>(k))) * h(at - k * u + half);
    }
    y(m) = sum + on_line(static_cast<double>(at) / static_cast<double>(u));
  }
  return y;
}

}  // namespace flyball::classical
