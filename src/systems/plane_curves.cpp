#include <flyball/systems/plane_curves.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/constants.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;

Expected<void> check(Time period, int points, std::string_view where) {
  FLYBALL_CHECK(check_positive(period.si(), where, "period", "s"));
  if (points >= 2 && points <= 1'000'000) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, where, "points")
      .got(std::to_string(points))
      .expected("from 2 to a million");
}

/// @param place  s at a share of the curve.
template <class Place>
PlaneCurve curve(double value, Time period, int points, Place&& place) {
  PlaneCurve found{.value = value, .s = {}, .z = {}};
  for (int k = 0; k < points; ++k) {
    const Complex s = place(static_cast<double>(k) / (points - 1));
    found.s.push_back(s);
    found.z.push_back(std::exp(s * period.si()));
  }
  return found;
}

}  // namespace

Expected<std::vector<PlaneCurve>> damping_curves(std::span<const double> damping_ratios,
                                                 Time period, int points) {
  constexpr std::string_view where = "damping_curves";
  FLYBALL_CHECK(check(period, points, where));
  std::vector<PlaneCurve> curves;
  for (const double zeta : damping_ratios) {
    FLYBALL_CHECK(check_within(zeta, 0.0, 1.0, where, "a damping ratio"));
    const double upright = std::sqrt((1.0 - zeta) * (1.0 + zeta));
    // To where the imaginary part is π/T; a fast real pole ends where z is nothing.
    const double end = std::min(pi / (upright * period.si()), 2.0 * pi / (period.si() * zeta));
    curves.push_back(curve(zeta, period, points,
                           [&](double share) { return share * end * Complex(-zeta, upright); }));
  }
  return curves;
}

Expected<std::vector<PlaneCurve>> frequency_curves(std::span<const double> frequencies, Time period,
                                                   int points) {
  constexpr std::string_view where = "frequency_curves";
  FLYBALL_CHECK(check(period, points, where));
  std::vector<PlaneCurve> curves;
  for (const double frequency : frequencies) {
    FLYBALL_CHECK(check_positive(frequency, where, "a frequency", "rad/s"));
    const double nyquist = pi / period.si();
    const double begin = frequency > nyquist ? pi - std::asin(nyquist / frequency) : 0.5 * pi;
    curves.push_back(curve(frequency, period, points, [&](double share) {
      const double angle = begin + share * (pi - begin);
      return share == 1.0 ? Complex(-frequency, 0.0) : std::polar(frequency, angle);
    }));
  }
  return curves;
}

}  // namespace flyball
