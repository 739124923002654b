#include <flyball/classical/filters/fir_design.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <flyball/classical/filters/room.hpp>
#include <flyball/core/signal.hpp>

#include "classical/filters/bands.hpp"
#include "core/constants.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

bool passes_half(FilterBand band) {
  return band == FilterBand::high_pass || band == FilterBand::band_stop;
}

Expected<void> check_count(Index taps, Index most, std::string_view where) {
  if (taps >= 1 && taps <= most) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, where, "taps")
      .got(std::to_string(taps))
      .expected("1 to " + std::to_string(most));
}

Expected<void> check_design(const FirDesign& design, Time period) {
  constexpr std::string_view where = "design_fir";
  FLYBALL_CHECK(check_count(design.taps, 1000000, where));
  FLYBALL_CHECK(Checks(where)
                    .positive(period.si(), "period", "s")
                    .positive(design.frequency, "frequency", "rad/s"));
  if (passes_half(design.band) && design.taps % 2 == 0) {
    return refusal(ArgumentError::out_of_range, where, "taps")
        .got(std::to_string(design.taps))
        .expected("odd: with an even number half the sample rate cannot pass");
  }
  const bool band = has_two_edges(design.band);
  if (band && !(design.upper_frequency > design.frequency)) {
    return refusal(ArgumentError::out_of_range, where, "upper_frequency")
        .got(design.upper_frequency == 0.0 ? "missing"
                                           : format_number(design.upper_frequency) + " rad/s")
        .expected("above frequency, which is " + format_number(design.frequency) + " rad/s");
  }
  const double top = band ? design.upper_frequency : design.frequency;
  if (!(top * period.si() < pi)) {
    return refusal(ArgumentError::out_of_range, where, band ? "upper_frequency" : "frequency")
        .got(format_number(top) + " rad/s")
        .expected("below half the sample rate, which is " + format_number(pi / period.si()) +
                  " rad/s");
  }
  return {};
}

VectorXd windowed(const FirDesign& design, Time period, const VectorXd& window) {
  const double low = design.frequency * period.si();
  const double high = design.upper_frequency * period.si();
  const double middle = 0.5 * static_cast<double>(design.taps - 1);
  // sin(ωk)/(πk)
  const auto ideal = [](double edge, double k) {
    return k == 0.0 ? edge / pi : std::sin(edge * k) / (pi * k);
  };
  VectorXd b(design.taps);
  for (Index i = 0; i < design.taps; ++i) {
    const double k = static_cast<double>(i) - middle;
    const double all = ideal(pi, k) * (design.taps % 2 == 1 && k != 0.0 ? 0.0 : 1.0);
    switch (design.band) {
      case FilterBand::low_pass:
        b(i) = ideal(low, k);
        break;
      case FilterBand::high_pass:
        b(i) = all - ideal(low, k);
        break;
      case FilterBand::band_pass:
        b(i) = ideal(high, k) - ideal(low, k);
        break;
      case FilterBand::band_stop:
        b(i) = all - ideal(high, k) + ideal(low, k);
        break;
    }
    b(i) *= window(i);
  }
  const double reference = design.band == FilterBand::high_pass   ? pi
                           : design.band == FilterBand::band_pass ? 0.5 * (low + high)
                                                                  : 0.0;
  double gain = 0.0;
  for (Index i = 0; i < design.taps; ++i) {
    gain += b(i) * std::cos(reference * (static_cast<double>(i) - middle));
  }
  return b / gain;
}

/// I₀(x) = Σ (x²/4)^k/k!², with the sum's logarithm taken out: I₀(x) e^{-x}.
double scaled_bessel(double x) {
  double term = std::exp(-x);
  if (term > 0.0) {
    double sum = term;
    for (int k = 1; k < 10000 && term > 1e-18 * sum; ++k) {
      term *= 0.25 * x * x / (static_cast<double>(k) * k);
      sum += term;
    }
    return sum;
  }
  // e^x/√(2πx) (1 + 1/8x + 9/128x² + …), beyond 745.
  const double y = 1.0 / (8.0 * x);
  return (1.0 + y * (1.0 + y * (4.5 + y * 37.5))) / std::sqrt(2.0 * pi * x);
}

}  // namespace

Expected<VectorXd> design_fir(const FirDesign& design, Time period, Window window) {
  FLYBALL_CHECK(check_design(design, period));
  VectorXd samples = VectorXd::Ones(design.taps);
  if (design.taps > 1) {
    FLYBALL_TRY(const VectorXd around, window_samples(window, design.taps - 1));
    samples.head(design.taps - 1) = around;
    samples(design.taps - 1) = around(0);
  }
  return windowed(design, period, samples);
}

Expected<VectorXd> design_fir(const FirDesign& design, Time period, double beta) {
  FLYBALL_CHECK(check_design(design, period));
  FLYBALL_TRY_IN("design_fir", const VectorXd samples, kaiser_window(design.taps, beta));
  return windowed(design, period, samples);
}

Expected<VectorXd> kaiser_window(Index length, double beta) {
  FLYBALL_CHECK(check_count(length, 1000000, "kaiser_window"));
  FLYBALL_CHECK(check_within(beta, 0.0, 1e6, "kaiser_window", "beta"));
  VectorXd samples = VectorXd::Ones(length);
  const double whole = scaled_bessel(beta);
  for (Index i = 0; i < length && length > 1; ++i) {
    // 1 - x² as a product: exact at the ends.
    const double up = 2.0 * static_cast<double>(i) / static_cast<double>(length - 1);
    const double root = beta * std::sqrt(up * (2.0 - up));
    samples(i) = scaled_bessel(root) / whole * std::exp(root - beta);
  }
  return samples;
}

Expected<KaiserChoice> kaiser_choice(double attenuation, double width, Time period) {
  constexpr std::string_view where = "kaiser_choice";
  FLYBALL_CHECK(Checks(where)
                    .within(attenuation, 8.0, 3000.0, "attenuation", "dB")
                    .positive(period.si(), "period", "s")
                    .positive(width, "width", "rad/s"));
  if (!(width * period.si() < pi)) {
    return refusal(ArgumentError::out_of_range, where, "width")
        .got(format_number(width) + " rad/s")
        .expected("below half the sample rate, which is " + format_number(pi / period.si()) +
                  " rad/s");
  }
  const double taps = std::ceil((attenuation - 7.95) / (2.285 * width * period.si()) + 1.0);
  if (!(taps <= 1e6)) {
    return refusal(ArgumentError::out_of_range, where, "width")
        .got("so narrow that " + format_number(taps) + " taps are needed")
        .expected("such that 10⁶ are enough");
  }
  const double above = attenuation - 21.0;
  const double beta = attenuation > 50.0   ? 0.1102 * (attenuation - 8.7)
                      : attenuation > 21.0 ? 0.5842 * std::pow(above, 0.4) + 0.07886 * above
                                           : 0.0;
  return KaiserChoice{static_cast<Index>(taps), beta};
}

Expected<VectorXd> moving_average(Index taps) {
  FLYBALL_CHECK(check_count(taps, 1000000, "moving_average"));
  return VectorXd(VectorXd::Constant(taps, 1.0 / static_cast<double>(taps)));
}

std::complex<double> fir_response(const VectorXd& taps, double angle) {
  const std::complex<double> back = std::polar(1.0, -angle);
  std::complex<double> sum = 0.0;
  for (Index i = taps.size() - 1; i >= 0; --i) {
    sum = sum * back + taps(i);
  }
  return sum;
}

namespace detail {

Expected<void> check_taps(std::span<const double> taps, std::size_t room) {
  if (taps.empty()) {
    return refusal(ArgumentError::empty, "FirFilter", "taps").expected("one at least");
  }
  for (const double tap : taps) {
    if (!is_signal(tap)) {
      return refusal(ArgumentError::not_finite, "FirFilter", "a tap")
          .got(format_number(tap))
          .expected("finite, and not above 1e100");
    }
  }
  return check_room(taps.size(), room, "FirFilter", "taps");
}

Expected<void> check_window(int window, int room) {
  if (window >= 1 && window <= room) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, "MedianFilter", "window")
      .got(std::to_string(window))
      .expected("1 to " + std::to_string(room) + ", for which it has room");
}

}  // namespace detail

}  // namespace flyball::classical
