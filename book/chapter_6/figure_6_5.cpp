#include "book/figure_functions.hpp"
#include "book/mechanism_case_study.hpp"

namespace flyball::book {

using namespace flyball::literals;

/// Figure 6.5: a flywheel is spun up to 9000 rpm and stopped again (section 6.10.3).
FigureResult figure_6_5() {
  const AngularVelocity speed = 9000_rpm;
  return mechanism_case_study({.id = "6.5",
                               .title = "Flywheel response",
                               .model = model_of(case_study_flywheel()),
                               .states = {{"velocity", "rad/s", "Angular velocity"}},
                               .tolerances = {9.42},  // 90 rpm
                               .model_noise = {1.0},
                               .encoder_noise = 0.01},
                              pulse_reference(speed.si(), 1, 5_ms));
}

}  // namespace flyball::book
