#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <flyball/classical/filters/iir_design.hpp>

#include "classical/filters/bands.hpp"
#include "classical/filters/elliptic_functions.hpp"
#include "core/constants.hpp"
#include "core/try.hpp"

namespace flyball::classical {

namespace {

using std::numbers::ln10;

constexpr std::string_view in_filter_order = "filter_order";

/// 10^(dB/10) - 1.
double loss(double decibels) {
  return std::expm1(decibels * ln10 / 10.0);
}

Expected<void> check_edges(FilterBand band, const FilterSpecification& wanted, double nyquist) {
  const bool two = has_two_edges(band);
  for (std::size_t i = 0; i < (two ? 2U : 1U); ++i) {
    for (const auto& [edges, name] : {std::pair{&wanted.pass, "pass"}, {&wanted.stop, "stop"}}) {
      FLYBALL_CHECK(check_positive((*edges)[i], in_filter_order, name, "rad/s"));
      if (!((*edges)[i] < nyquist)) {
        return refusal(ArgumentError::out_of_range, in_filter_order, name)
            .got(format_number((*edges)[i]) + " rad/s")
            .expected("below half the sample rate, which is " + format_number(nyquist) + " rad/s");
      }
    }
  }
  const auto [p1, p2] = wanted.pass;
  const auto [s1, s2] = wanted.stop;
  const bool in_order = band == FilterBand::low_pass    ? p1 < s1
                        : band == FilterBand::high_pass ? s1 < p1
                        : band == FilterBand::band_pass ? s1 < p1 && p1 < p2 && p2 < s2
                                                        : p1 < s1 && s1 < s2 && s2 < p2;
  if (in_order) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, in_filter_order, "edges")
      .got("not in the order of a " + std::string(to_string(band)) + " filter")
      .expected(band == FilterBand::low_pass    ? "pass below stop"
                : band == FilterBand::high_pass ? "stop below pass"
                : band == FilterBand::band_pass ? "stop, pass, pass, stop upwards"
                                                : "pass, stop, stop, pass upwards");
}

/// What is left to do once edges are those of analog filters.
struct Edges {
  double p1, p2, s1, s2;
};

/// The prototype's stop edge, its pass edge being 1.
double transition(FilterBand band, Edges& e) {
  switch (band) {
    case FilterBand::low_pass:
      return e.s1 / e.p1;
    case FilterBand::high_pass:
      return e.p1 / e.s1;
    case FilterBand::band_pass: {
      const auto at = [&](double w) {
        return std::abs((w - e.p1) * (w + e.p1) + e.p1 * (e.p1 - e.p2)) / (w * (e.p2 - e.p1));
      };
      return std::min(at(e.s1), at(e.s2));
    }
    case FilterBand::band_stop:
      break;
  }
  // The wider pass edge comes nearer until both stop edges ask for the same.
  if (e.p1 * e.p2 < e.s1 * e.s2) {
    e.p1 = e.s1 * e.s2 / e.p2;
  } else {
    e.p2 = e.s1 * e.s2 / e.p1;
  }
  return (e.p2 - e.p1) / (e.s2 - e.s1);
}

/// The edges of a filter whose prototype has its own at `edge`, in units of the pass edge.
std::pair<double, double> moved(FilterBand band, const Edges& e, double edge) {
  const double width = (e.p2 - e.p1) * (band == FilterBand::band_stop ? 1.0 / edge : edge);
  switch (band) {
    case FilterBand::low_pass:
      return {e.p1 * edge, 0.0};
    case FilterBand::high_pass:
      return {e.p1 / edge, 0.0};
    default:
      break;
  }
  const double upper = 0.5 * (width + std::sqrt(width * width + 4.0 * e.p1 * e.p2));
  return {e.p1 * e.p2 / upper, upper};
}

}  // namespace

Expected<FilterOrder> filter_order(FilterFamily family, FilterBand band,
                                   const FilterSpecification& wanted, std::optional<Time> period) {
  const double T = period ? period->si() : 0.0;
  if (period) {
    FLYBALL_CHECK(check_positive(T, in_filter_order, "period", "s"));
  }
  if (family == FilterFamily::bessel) {
    return refusal(ArgumentError::malformed, in_filter_order, "family")
        .got("bessel")
        .expected("one with a stop band: butterworth, chebyshev1, chebyshev2, elliptic");
  }
  FLYBALL_CHECK(Checks(in_filter_order)
                    .within(wanted.ripple, 1e-12, 300.0, "ripple", "dB")
                    .within(wanted.attenuation, 1e-12, 3000.0, "attenuation", "dB"));
  if (!(wanted.attenuation > wanted.ripple)) {
    return refusal(ArgumentError::out_of_range, in_filter_order, "attenuation")
        .got(format_number(wanted.attenuation) + " dB")
        .expected("above the ripple, which is " + format_number(wanted.ripple) + " dB");
  }
  FLYBALL_CHECK(check_edges(band, wanted, period ? pi / T : HUGE_VAL));

  const auto warped = [&](double w) { return period ? std::tan(0.5 * w * T) : w; };
  Edges edges{warped(wanted.pass[0]), warped(wanted.pass[1]), warped(wanted.stop[0]),
              warped(wanted.stop[1])};
  const double stop = transition(band, edges);
  if (!(stop > 1.0)) {
    return refusal(ArgumentError::out_of_range, in_filter_order, "edges")
        .got("so near each other that nothing lies between")
        .expected("farther apart");
  }
  const double ratio = std::sqrt(loss(wanted.attenuation) / loss(wanted.ripple));
  double exact = 0.0;
  switch (family) {
    case FilterFamily::butterworth:
      exact = std::log(ratio) / std::log(stop);
      break;
    case FilterFamily::elliptic: {
      // n = K(k) K(k₁')/(K(k') K(k₁)): the nome of the losses is the transition's to the power n.
      const detail::Modulus losses{
          1.0 / ratio,
          std::pow(10.0, wanted.ripple / 20.0) *
              std::sqrt(loss(wanted.attenuation - wanted.ripple) / loss(wanted.attenuation))};
      exact = detail::log_nome(losses) /
              detail::log_nome({1.0 / stop, std::sqrt((stop - 1.0) * (stop + 1.0)) / stop});
      break;
    }
    default:
      exact = std::acosh(ratio) / std::acosh(stop);
      break;
  }
  // What is a whole number but for rounding stays one.
  const double order = std::max(1.0, std::ceil(exact * (1.0 - 1e-12)));
  constexpr double most = 20.0;
  if (!(order <= most)) {
    return refusal(ArgumentError::out_of_range, in_filter_order, "the order")
        .got(format_number(exact))
        .expected("at most 20; another family, or a wider transition, needs less");
  }
  double edge = 1.0;
  if (family == FilterFamily::butterworth) {
    edge = std::pow(loss(wanted.ripple), -0.5 / order);
  } else if (family == FilterFamily::chebyshev2) {
    edge = std::cosh(std::acosh(ratio) / order);
  }
  const auto [low, high] = moved(band, edges, edge);
  const auto back = [&](double w) { return period ? 2.0 * std::atan(w) / T : w; };
  return FilterOrder{.design = {.family = family,
                                .band = band,
                                .order = static_cast<int>(order),
                                .frequency = back(low),
                                .upper_frequency = back(high),
                                .ripple = wanted.ripple,
                                .attenuation = wanted.attenuation},
                     .exact = exact};
}

}  // namespace flyball::classical
