// Filters (section 7.1.3): a low pass against a vibration of a sensor, as the robot runs it, and
// what keeps it from folding down where the samples are slow.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include <flyball/classical/filters/biquad_cascade.hpp>
#include <flyball/classical/filters/iir_design.hpp>
#include <flyball/classical/filters/sample_rate.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;
  constexpr double hertz = 2.0 * std::numbers::pi;  // rad/s

  //! [filters]
  // The signal lies below 2 Hz, the vibration at 20 Hz and above.
  const auto order = classical::filter_order(
      classical::FilterFamily::butterworth, classical::FilterBand::low_pass,
      {.pass = {2.0 * hertz}, .stop = {20.0 * hertz}, .ripple = 0.5, .attenuation = 40.0}, 5_ms);
  const auto design = classical::design_filter(order.value().design, 5_ms).value();
  auto filter = classical::BiquadCascade<4>::create(design.sections).value();

  const auto measured = [&](double t) {
    return std::sin(1.0 * hertz * t) + 0.5 * std::sin(25.0 * hertz * t);
  };
  filter.reset(measured(0.0));  // at rest with the first sample
  double worst = 0.0;
  for (int k = 0; k < 400; ++k) {
    const double y = filter.calculate(measured(0.005 * k));
    const double late = 0.005 * k - design.group_delay(1.0 * hertz);
    worst = k > 100 ? std::max(worst, std::abs(y - std::sin(1.0 * hertz * late))) : worst;
  }
  //! [filters]
  std::printf("order %d, %.1f ms late, within %.3f of the signal\n", order->design.order,
              1e3 * design.group_delay(1.0 * hertz), worst);

  //! [aliasing]
  // A loop at 50 Hz that crosses over at 3 Hz reads the sensor, which gives 1000 samples a second.
  const auto advice =
      classical::advise_anti_aliasing(20_ms, {.band = 3.0 * hertz, .attenuation = 40.0}, 1_ms)
          .value();
  //! [aliasing]
  std::printf(
      "from %.0f Hz on it folds: order %d at %.1f Hz costs %.0f deg, the samples %.0f deg\n",
      advice.first_alias / hertz, advice.design.order, advice.design.frequency / hertz,
      360.0 / hertz * advice.phase_lag, 360.0 / hertz * advice.sampling_phase_lag);
  return worst < 0.05 && advice.attenuation >= 40.0 ? 0 : 1;
}
