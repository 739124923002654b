#include <cmath>

#include <flyball/classical/frequency_response.hpp>

#include "classical/factors.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

constexpr double turn = 360.0;

double phase_in_degrees(Complex value) {
  return std::arg(value) * 180.0 / std::numbers::pi;
}

/// The angle of the value that is nearest to another one.
double nearest(double angle, double to) {
  return to + std::remainder(angle - to, turn);
}

bool has_angle(Complex value) {
  return value != 0.0 && std::isfinite(value.real()) && std::isfinite(value.imag());
}

/// The asymptote's phase where gain and phase alone are known: from the slope of the gain.
double first_phase(const VectorXd& frequency, const Eigen::VectorXcd& values) {
  if (values.size() < 2 || !has_angle(values(0)) || !has_angle(values(1))) {
    return 0.0;
  }
  const double slope =
      std::log(std::abs(values(1) / values(0))) / std::log(frequency(1) / frequency(0));
  const double upward = 90.0 * std::round(slope);
  const double angle = phase_in_degrees(values(0));
  const double as_positive = nearest(angle, upward);
  const double as_negative = nearest(angle, upward - 180.0);
  return std::abs(as_positive - upward) <= std::abs(as_negative - upward + 180.0) ? as_positive
                                                                                  : as_negative;
}

}  // namespace

Expected<BodeData> bode(const FrequencyResponse& response, const VectorXd& frequencies) {
  constexpr std::string_view where = "bode";
  FLYBALL_CHECK(check_finite(Eigen::MatrixXd(frequencies), where, "the frequencies"));
  for (Index k = 0; k < frequencies.size(); ++k) {
    if (!(frequencies(k) > (k > 0 ? frequencies(k - 1) : 0.0))) {
      return refusal(ArgumentError::out_of_range, where, "a frequency")
          .got(flyball::detail::format("{} rad/s, number {}", frequencies(k), k + 1))
          .expected(k > 0 ? flyball::detail::format("above {} rad/s, the one before it",
                                                    frequencies(k - 1))
                          : std::string("positive"));
    }
  }
  FLYBALL_TRY(const MatrixXcd values, response.sample(frequencies));
  BodeData data;
  data.frequency = frequencies;
  const Index count = frequencies.size();
  for (Index input = 0; input < response.inputs(); ++input) {
    for (Index output = 0; output < response.outputs(); ++output) {
      const Eigen::VectorXcd G = values.row(output + input * response.outputs()).transpose();
      BodeCurve curve{output, input, G.cwiseAbs(), VectorXd(count)};
      const auto factors = response.factors(output, input);
      for (Index k = 0; k < count; ++k) {
        const double expected = factors
                                    ? unwrapped_phase(*factors, frequencies(k), response.period())
                                : k > 0 ? curve.phase(k - 1)
                                        : first_phase(frequencies, G);
        curve.phase(k) = has_angle(G(k)) ? nearest(phase_in_degrees(G(k)), expected) : expected;
      }
      data.curves.push_back(std::move(curve));
    }
  }
  return data;
}

Expected<BodeData> bode(const FrequencyResponse& response, const FrequencyGridOptions& options) {
  FLYBALL_TRY(const auto grid, frequency_grid(response, options));
  return bode(response, grid.frequency);
}

}  // namespace flyball::classical
