// How wrong a loop may be before it is unstable (appendix E): gain and phase margin of an
// elevator's regulator, what a sensor's delay takes of them (E.6), and how much more delay there
// may be.
#include <cstdio>

#include <flyball/control/lqr.hpp>
#include <flyball/control/margins.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;

  const auto elevator = mechanisms::elevator(
      {.motor = mechanisms::cim(2), .gearing = 10.0, .mass = 6.8_kg, .drum_radius = 2.763_cm});
  const auto plant = discretize(elevator.value(), 5_ms).value();
  const auto K = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value().K;

  std::printf("%10s %16s %16s %16s\n", "delay", "gain margin", "phase margin", "further delay");
  double last = 180.0;
  bool falls = true;
  for (const Time delay : {0_ms, 5_ms, 10_ms}) {
    //! [margins]
    const auto loop = state_feedback_loop(elevator->A, elevator->B, K, plant.period, delay).value();
    const auto margins = stability_margins(loop).value();
    //! [margins]
    std::printf("%7.0f ms %15.2fx %12.1f deg %13.1f ms\n", 1e3 * delay.si(), margins.gain_margin_up,
                margins.phase_margin, 1e3 * margins.delay_margin);
    falls = falls && margins.stable && margins.phase_margin < last;
    last = margins.phase_margin;
  }
  return falls ? 0 : 1;
}
