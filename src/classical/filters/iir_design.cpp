#include <flyball/classical/filters/iir_design.hpp>

#include <cmath>
#include <string>

#include "classical/filters/bands.hpp"
#include "classical/filters/root_sections.hpp"
#include "core/constants.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXcd;

namespace {

Expected<void> check_edges(const IirDesign& design, std::string_view where) {
  return Checks(where).positive(design.frequency, "frequency", "rad/s").also([&]() {
    return !has_two_edges(design.band) || design.upper_frequency > design.frequency
               ? check_finite(design.upper_frequency, where, "upper_frequency")
               : Expected<void>(refusal(ArgumentError::out_of_range, where, "upper_frequency")
                                    .got(design.upper_frequency == 0.0
                                             ? std::string("missing")
                                             : format_number(design.upper_frequency) + " rad/s")
                                    .expected("above frequency, which is " +
                                              format_number(design.frequency) + " rad/s"));
  });
}

/// Both roots of s² - b s + c = 0, the larger one first so that none loses digits.
std::pair<Complex, Complex> quadratic_roots(Complex b, double c) {
  const Complex root = std::sqrt(b * b - 4.0 * c);
  const bool same = (std::conj(b) * root).real() >= 0.0;
  const Complex large = 0.5 * (same ? b + root : b - root);
  return {large, c / large};
}

/// A prototype moved to its edges, with its roots at infinity counted.
///
/// For the bands each root of the prototype becomes a pair whose product is ω₁ω₂.
AnalogFilter moved(const AnalogFilter& prototype, FilterBand band, double low, double high) {
  const Index n = prototype.poles.size();
  const Index missing = n - prototype.zeros.size();
  const bool inverted = band == FilterBand::high_pass || band == FilterBand::band_stop;
  const double width = has_two_edges(band) ? high - low : low;

  // Of one root: ω_c p, ω_c/p; for bands the roots of s² - (width p) s + ω₁ω₂.
  const auto map = [&](const VectorXcd& roots, Index at_infinity) {
    const Index each = has_two_edges(band) ? 2 : 1;
    // Infinity stays there with a low pass; a high pass brings it to zero, a band pass one of each
    // pair, a band stop to ±j√(ω₁ω₂).
    const Index more = band == FilterBand::low_pass    ? 0
                       : band == FilterBand::band_stop ? 2 * at_infinity
                                                       : at_infinity;
    VectorXcd out(each * roots.size() + more);
    Index next = 0;
    for (const Complex root : roots) {
      const Complex p = width * (inverted ? 1.0 / root : root);
      if (has_two_edges(band)) {
        const auto [first, second] = quadratic_roots(p, low * high);
        out(next++) = first;
        out(next++) = second;
      } else {
        out(next++) = p;
      }
    }
    for (Index i = 0; i < more; ++i) {
      out(next++) = band == FilterBand::band_stop
                        ? Complex(0.0, (i % 2 == 0 ? 1.0 : -1.0) * std::sqrt(low * high))
                        : Complex(0.0);
    }
    return out;
  };
  AnalogFilter filter{map(prototype.zeros, missing), map(prototype.poles, 0), prototype.gain};
  if (inverted) {  // gain Π(-z)/Π(-p)
    filter.gain =
        detail::root_quotient(prototype.zeros, prototype.poles, prototype.gain, 0.0).real();
  } else {
    filter.gain *= std::pow(width, static_cast<double>(missing));
  }
  return filter;
}

/// s = (z - 1)/(z + 1): z = (1 + s)/(1 - s), with what is missing at z = -1.
DigitalFilter bilinear(const AnalogFilter& filter, Time period) {
  const auto map = [](Complex s) { return (1.0 + s) / (1.0 - s); };
  DigitalFilter digital;
  digital.poles = filter.poles.unaryExpr(map);
  digital.zeros = VectorXcd::Constant(filter.poles.size(), -1.0);
  digital.zeros.head(filter.zeros.size()) = filter.zeros.unaryExpr(map);
  digital.gain = detail::root_quotient(filter.zeros, filter.poles, filter.gain, 1.0).real();
  digital.period = period;
  return digital;
}

}  // namespace

std::string_view to_string(FilterFamily family) {
  switch (family) {
    case FilterFamily::butterworth:
      return "butterworth";
    case FilterFamily::chebyshev1:
      return "chebyshev1";
    case FilterFamily::chebyshev2:
      return "chebyshev2";
    case FilterFamily::elliptic:
      return "elliptic";
    case FilterFamily::bessel:
      return "bessel";
  }
  return "unknown";
}

std::string_view to_string(FilterBand band) {
  switch (band) {
    case FilterBand::low_pass:
      return "low-pass";
    case FilterBand::high_pass:
      return "high-pass";
    case FilterBand::band_pass:
      return "band-pass";
    case FilterBand::band_stop:
      return "band-stop";
  }
  return "unknown";
}

Complex AnalogFilter::response(double frequency) const {
  return detail::root_quotient(zeros, poles, gain, Complex(0.0, frequency));
}

double AnalogFilter::group_delay(double frequency) const {
  // -d∠(jω - r)/dω = Re r/|jω - r|²
  const auto sum = [&](const VectorXcd& roots) {
    double delay = 0.0;
    for (const Complex root : roots) {
      delay += root.real() == 0.0 ? 0.0 : root.real() / std::norm(Complex(0.0, frequency) - root);
    }
    return delay;
  };
  return sum(zeros) - sum(poles);
}

Expected<AnalogFilter> design_analog_filter(const IirDesign& design) {
  FLYBALL_TRY_IN("design_analog_filter", const AnalogFilter prototype,
                 filter_prototype(design.family, design.order, design.ripple, design.attenuation));
  FLYBALL_CHECK(check_edges(design, "design_analog_filter"));
  AnalogFilter filter = moved(prototype, design.band, design.frequency, design.upper_frequency);
  if (!filter.poles.allFinite() || !std::isnormal(filter.gain)) {
    return refusal(ArgumentError::out_of_range, "design_analog_filter", "frequency")
        .got(format_number(design.frequency) + " rad/s")
        .expected("one whose power of the order is a number; take another unit of time");
  }
  return filter;
}

Expected<DigitalFilter> design_filter(const IirDesign& design, Time period) {
  constexpr std::string_view where = "design_filter";
  FLYBALL_TRY_IN(where, const AnalogFilter prototype,
                 filter_prototype(design.family, design.order, design.ripple, design.attenuation));
  FLYBALL_CHECK(check_positive(period.si(), where, "period", "s"));
  FLYBALL_CHECK(check_edges(design, where));
  const bool band = has_two_edges(design.band);
  const double top = band ? design.upper_frequency : design.frequency;
  if (!(top * period.si() < pi)) {
    return refusal(ArgumentError::out_of_range, where, band ? "upper_frequency" : "frequency")
        .got(format_number(top) + " rad/s")
        .expected("below half the sample rate, which is " + format_number(pi / period.si()) +
                  " rad/s");
  }
  // tan(ωT/2): the edges of the analog filter, in units in which the bilinear transform has none.
  const double low = std::tan(0.5 * design.frequency * period.si());
  const double high = band ? std::tan(0.5 * design.upper_frequency * period.si()) : 0.0;
  DigitalFilter filter = bilinear(moved(prototype, design.band, low, high), period);
  FLYBALL_TRY_IN(where, filter.sections,
                 detail::paired_sections(filter.zeros, filter.poles, where));

  // Where the prototype is at rest every filter has its gain there.
  const double at_rest =
      detail::root_quotient(prototype.zeros, prototype.poles, prototype.gain, 0.0).real();
  const double reference = design.band == FilterBand::high_pass ? pi
                           : design.band == FilterBand::band_pass
                               ? 2.0 * std::atan(std::sqrt(low * high))
                               : 0.0;
  detail::set_gains(filter.sections, std::copysign(at_rest, filter.gain), reference);
  if (!check_sections(filter.sections, where)) {
    return refusal(ArgumentError::out_of_range, where, "frequency")
        .got(format_number(design.frequency) + " rad/s, " +
             format_number(design.frequency * period.si()) + " rad a sample")
        .expected("not so far from the sample rate that rounded coefficients are unstable")
        .hint("take a lower order, or fewer samples (decimate)");
  }
  return filter;
}

}  // namespace flyball::classical
