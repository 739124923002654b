#include "book/figure_functions.hpp"
#include "book/mechanism_case_study.hpp"

namespace flyball::book {

using namespace flyball::literals;

/// Figure 6.3: an elevator is sent up by five feet and down again (section 6.9.4). Gravity is not
/// part of the linear model; a constant voltage holds it (6.9.3).
FigureResult figure_6_3() {
  return mechanism_case_study(
      {.id = "6.3",
       .title = "Elevator response",
       .model = model_of(case_study_elevator()),
       .states = {{"position", "m", "Position"}, {"velocity", "m/s", "Velocity"}},
       .tolerances = {0.02, 0.4},
       .model_noise = {0.05, 1.0},
       .encoder_noise = 0.0001},
      pulse_reference(1.524, 2, 5_ms));
}

}  // namespace flyball::book
