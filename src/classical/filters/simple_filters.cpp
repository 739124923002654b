#include <flyball/classical/filters/simple_filters.hpp>

#include <cmath>

#include "classical/filters/root_sections.hpp"
#include "core/constants.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Complex = std::complex<double>;
using Eigen::VectorXcd;

namespace {

/// The notch's or the peak's zeros over z² - 2 b cos(θ) z + 2b - 1, b = 1/(1 + tan(Δ/2)).
Expected<DigitalFilter> resonance(double frequency, double bandwidth, Time period, bool notch,
                                  std::string_view where) {
  const double T = period.si();
  FLYBALL_CHECK(Checks(where)
                    .positive(T, "period", "s")
                    .positive(frequency, "frequency", "rad/s")
                    .positive(bandwidth, "bandwidth", "rad/s"));
  for (const auto& [value, name] : {std::pair{frequency, "frequency"}, {bandwidth, "bandwidth"}}) {
    if (!(value * T < pi)) {
      return refusal(ArgumentError::out_of_range, where, name)
          .got(format_number(value) + " rad/s")
          .expected("below half the sample rate, which is " + format_number(pi / T) + " rad/s");
    }
  }
  const double half = std::tan(0.5 * bandwidth * T);
  const double b = 1.0 / (1.0 + half);
  const double cosine = std::cos(frequency * T);
  // Roots of z² - 2 b cos θ z + (2b - 1): b cos θ ± √(b² cos² θ - 2b + 1), and
  // b² cos² θ - 2b + 1 = (1 - b)² - b² sin² θ.
  const double sine = std::sin(frequency * T);
  const double under = (1.0 - b - b * sine) * (1.0 - b + b * sine);
  DigitalFilter filter;
  filter.period = period;
  filter.poles.resize(2);
  filter.zeros.resize(2);
  const Complex root = std::sqrt(Complex(under));
  filter.poles << b * cosine + root, b * cosine - root;
  if (notch) {
    filter.zeros << std::polar(1.0, frequency * T), std::polar(1.0, -frequency * T);
    filter.gain = b;
  } else {
    filter.zeros << 1.0, -1.0;
    filter.gain = half * b;  // 1 - b
  }
  FLYBALL_TRY(filter.sections, detail::paired_sections(filter.zeros, filter.poles, where));
  // By their closed forms, so that the gains are right as the poles merge, too.
  Biquad& c = filter.sections.front();
  c.a1 = -2.0 * b * cosine;
  c.a2 = (1.0 - half) * b;
  detail::set_gains(filter.sections, 1.0, notch ? 0.0 : frequency * T);
  return filter;
}

Expected<DigitalFilter> single_pole(Time time_constant, Time period, bool low,
                                    std::string_view where) {
  FLYBALL_CHECK(Checks(where)
                    .positive(time_constant.si(), "time_constant", "s")
                    .positive(period.si(), "period", "s"));
  const double a = std::exp(-period.si() / time_constant.si());
  DigitalFilter filter;
  filter.period = period;
  filter.poles = VectorXcd::Constant(1, a);
  filter.zeros = VectorXcd::Constant(1, low ? 0.0 : 1.0);
  filter.gain = low ? -std::expm1(-period.si() / time_constant.si()) : a;
  filter.sections = {low ? Biquad{.b0 = 1.0 - a, .a1 = -a} : Biquad{.b0 = a, .b1 = -a, .a1 = -a}};
  return filter;
}

}  // namespace

Expected<DigitalFilter> notch_filter(double frequency, double bandwidth, Time period) {
  return resonance(frequency, bandwidth, period, true, "notch_filter");
}

Expected<DigitalFilter> peak_filter(double frequency, double bandwidth, Time period) {
  return resonance(frequency, bandwidth, period, false, "peak_filter");
}

Expected<DigitalFilter> exponential_average(Time time_constant, Time period) {
  return single_pole(time_constant, period, true, "exponential_average");
}

Expected<DigitalFilter> single_pole_high_pass(Time time_constant, Time period) {
  return single_pole(time_constant, period, false, "single_pole_high_pass");
}

}  // namespace flyball::classical
