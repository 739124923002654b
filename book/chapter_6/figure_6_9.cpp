#include <flyball/mechanisms/arm.hpp>
#include <flyball/planning/profiles/generate_trapezoid_profile.hpp>

#include "book/figure_functions.hpp"
#include "book/mechanism_case_study.hpp"

namespace flyball::book {

using namespace flyball::literals;

/// Figure 6.9: a single-jointed arm follows a trapezoid profile to 1.04 rad (section 6.11.4). The
/// figure leaves gravity out; its feedforward is 6.11.3.
FigureResult figure_6_9() {
  // Theorem 6.11.1: x = [angle, angular velocity], u = voltage. The arm is a uniform rod that turns
  // about its end, J = m l²/3.
  const Mass mass = 2.2675_kg;
  const Length length = 1.2192_m;
  const auto arm = mechanisms::arm({.motor = mechanisms::cim(),
                                    .gearing = 1.0 / 2.0,
                                    .moment_of_inertia = MomentOfInertia(mass.si() * length.si() *
                                                                         length.si() / 3.0),
                                    .mass = mass,
                                    .center_of_mass = Length(length.si() / 2.0)})
                       .value();
  // 0.5 rad/s after 0.5 s, until 1.04 rad.
  const TimeSeries profile = generate_trapezoid_profile(0.5, 0.5_s, 5_ms, 1.04).value();

  return mechanism_case_study(
      {.id = "6.9",
       .title = "Single-jointed arm response",
       .model = model_of(arm),
       .states = {{"angle", "rad", "Angle"}, {"velocity", "rad/s", "Angular velocity"}},
       .tolerances = {0.01745, 0.08726},  // 1° and 5°/s
       .model_noise = {0.01745, 0.1745329},
       .encoder_noise = 0.01},
      profile_reference(profile));
}

}  // namespace flyball::book
