#include <limits>

#include <flyball/control/feedforward.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/figure_functions.hpp"
#include "book/motor_case_study.hpp"

namespace flyball::book {

using namespace flyball::literals;

/// Figure 7.10: what plant inversion adds to feedback (section 7.8.1): without it an error remains.
FigureResult figure_7_10() {
  const auto plant = discretize(case_study_motor(), 1_ms).value();
  // The current is free: its tolerance is infinite.
  constexpr double any = std::numeric_limits<double>::infinity();
  const auto K = lqr(plant, bryson({20.0, any}), bryson({12.0})).value().K;
  const auto inversion = linear_plant_inversion(plant).value();
  const double u_ff = inversion.calculate(case_study_reference(), case_study_reference())(0);

  FigureResult figure =
      case_study("7.10", "Second-order CIM motor response with plant inversion", plant,
                 {{"no_feedforward", "No feedforward", K, 0.0},
                  {"plant_inversion", "Plant inversion", K, u_ff}});
  figure.numbers = {
      {"K_1", "V/(rad/s)", K(0)}, {"K_2", "V/A", K(1)}, {"u_ff_plant_inversion", "V", u_ff}};
  return figure;
}

}  // namespace flyball::book
