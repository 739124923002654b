#include <limits>

#include <flyball/control/lqr.hpp>
#include <flyball/control/pole_placement.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/figure_functions.hpp"
#include "book/motor_case_study.hpp"

namespace flyball::book {

using namespace flyball::literals;

/// Figure 7.8: poles placed by hand, and by LQR from what is tolerable (section 7.7.4): faster
/// poles need more than 12 V.
FigureResult figure_7_8() {
  const auto plant = discretize(case_study_motor(), 1_ms).value();
  const Eigen::RowVector2d placed_1 = place(plant, Eigen::Vector2cd(0.1, 0.5)).value().K;
  const Eigen::RowVector2d placed_2 = place(plant, Eigen::Vector2cd(0.1, 0.4)).value().K;
  // The current is free: its tolerance is infinite.
  constexpr double any = std::numeric_limits<double>::infinity();
  const auto regulator = lqr(plant, bryson({20.0, any}), bryson({12.0})).value();

  FigureResult figure =
      case_study("7.8", "Second-order CIM motor response with pole placement and LQR", plant,
                 {{"placed_1", "Pole placement at 0.1 and 0.5", placed_1},
                  {"placed_2", "Pole placement at 0.1 and 0.4", placed_2},
                  {"lqr", "LQR at 0.175 ± 0.21j", regulator.K}});
  figure.numbers = {{"K_1_placed_1", "V/(rad/s)", placed_1(0)},
                    {"K_2_placed_1", "V/A", placed_1(1)},
                    {"K_1_placed_2", "V/(rad/s)", placed_2(0)},
                    {"K_2_placed_2", "V/A", placed_2(1)},
                    {"K_1_lqr", "V/(rad/s)", regulator.K(0)},
                    {"K_2_lqr", "V/A", regulator.K(1)},
                    {"lqr_pole_re", "", regulator.poles(0).real()},
                    {"lqr_pole_im", "", regulator.poles.imag().maxCoeff()}};
  return figure;
}

}  // namespace flyball::book
