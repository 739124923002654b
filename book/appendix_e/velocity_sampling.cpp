#include <algorithm>
#include <cmath>

#include <flyball/control/lqr.hpp>
#include <flyball/simulation/linear_loop.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/figure_functions.hpp"
#include "book/mechanism_case_study.hpp"

namespace flyball::book {

using namespace flyball::literals;

namespace {

constexpr double step_height = 1.524;  // m
constexpr double fine_step = 0.005;
constexpr double sample_period = 0.1;
constexpr int pulse_samples = 1240;  // until 6.2 s
constexpr int stretch = 20;          // samples of a sample period

struct Response {
  std::vector<double> time;
  std::vector<double> position;
  std::vector<double> velocity;
  Eigen::MatrixXd K;
};

/// The elevator sent up at 0.1 s and down at 5.1 s: each 5 ms, without an observer.
Response elevator_response() {
  const auto plant = discretize(model_of(case_study_elevator()), 5_ms).value();
  const auto K = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value().K;
  const Eigen::MatrixXd r = pulse_reference(step_height, 2, 5_ms).leftCols(pulse_samples);
  const auto loop = simulate_linear({.plant = plant,
                                     .K = K,
                                     .u_min = Eigen::VectorXd::Constant(1, -12.0),
                                     .u_max = Eigen::VectorXd::Constant(1, 12.0)},
                                    r)
                        .value();
  return {values(loop.time), values(loop.x.row(0)), values(loop.x.row(1)), K};
}

/// A velocity as the methods of section E.5 take it between the samples of 0.1 s.
struct Discretized {
  std::vector<double> forward;         ///< f(tₙ) for the whole step: forward Euler.
  std::vector<double> backward;        ///< f(tₙ₊₁): backward Euler.
  std::vector<double> bilinear;        ///< The straight line between.
  std::vector<double> script_forward;  ///< The script's, which has the two names swapped.
  std::vector<double> script_backward;
};

Discretized discretized(const std::vector<double>& f) {
  Discretized y;
  double held_end = 0.0;  // of a last stretch that has no end
  double held_line = 0.0;
  // The script's floor(k Δt/T) T/Δt, whose rounding sometimes begins a stretch one sample late.
  const auto script_place = [](int k, double further) {
    return static_cast<int>((std::floor(k * fine_step / sample_period) + further) * sample_period /
                            fine_step);
  };
  for (int k = 0; k < pulse_samples; ++k) {
    const int start = k / stretch * stretch;
    const int end = start + stretch;
    const auto at = [&](int i) { return f[static_cast<std::size_t>(i)]; };
    y.forward.push_back(at(start));
    y.backward.push_back(at(std::min(end, pulse_samples - 1)));
    if (end < pulse_samples) {
      const double share = static_cast<double>(k - start) / stretch;
      held_line = (1.0 - share) * at(start) + share * at(end);
    }
    y.bilinear.push_back(held_line);
    if (script_place(k, 1.0) < pulse_samples) {
      held_end = at(script_place(k, 1.0));
    }
    y.script_forward.push_back(held_end);
    y.script_backward.push_back(at(script_place(k, 0.0)));
  }
  return y;
}

/// Σ f Δt; where there is no next sample, the script adds nothing more.
std::vector<double> integral(const std::vector<double>& f, bool whole) {
  std::vector<double> sums;
  double sum = 0.0;
  for (int k = 0; k < pulse_samples; ++k) {
    if (whole || k / stretch * stretch + stretch < pulse_samples) {
      sum += f[static_cast<std::size_t>(k)] * fine_step;
    }
    sums.push_back(sum);
  }
  return sums;
}

void add_gain(FigureResult& figure, const Eigen::MatrixXd& K) {
  figure.numbers = {{"K_p", "V/m", K(0)}, {"K_d", "V/(m/s)", K(1)}};
}

}  // namespace

/// Figure E.20: what a zero-order hold of 0.1 s makes of a position (section E.5). The first sample
/// is taken with the 20th step, at 0.095 s, as the book's script counts.
FigureResult figure_E_20() {
  const Response response = elevator_response();
  std::vector<double> held;
  double sample = response.position[0];
  for (int k = 0; k < pulse_samples; ++k) {
    if ((k + 1) % stretch == 0) {
      sample = response.position[static_cast<std::size_t>(k)];
    }
    held.push_back(sample);
  }
  FigureResult figure{.id = "E.20", .title = "Zero-order hold of a system response"};
  figure.columns = {{"time", "s", response.time},
                    {"position", "m", response.position},
                    {"zero_order_hold", "m", std::move(held)}};
  add_gain(figure, response.K);
  figure.picture =
      line_plot(figure, "Position (m)",
                {{"position", "Continuous", LineStyle::solid, state_color},
                 {"zero_order_hold", "Zero-order hold (T = 0.1 s)", LineStyle::steps, 1}});
  return figure;
}

/// Figure E.21: the rectangles and trapezoids under a velocity, of 0.1 s (section E.5). In the
/// book's script forward Euler holds the value at the end of a step and backward Euler the one at
/// its start; by their definitions it is the other way around.
FigureResult figure_E_21() {
  const Response response = elevator_response();
  Discretized y = discretized(response.velocity);
  FigureResult figure{.id = "E.21", .title = "Discretisation methods applied to velocity data"};
  figure.columns = {{"time", "s", response.time},
                    {"velocity", "m/s", response.velocity},
                    {"forward_euler", "m/s", std::move(y.forward)},
                    {"backward_euler", "m/s", std::move(y.backward)},
                    {"bilinear", "m/s", std::move(y.bilinear)},
                    {"script_forward_euler", "m/s", std::move(y.script_forward)},
                    {"script_backward_euler", "m/s", std::move(y.script_backward)}};
  add_gain(figure, response.K);
  figure.picture = line_plot(figure, "Velocity (m/s)",
                             {{"velocity", "Continuous", LineStyle::solid, 0},
                              {"forward_euler", "Forward Euler (T = 0.1 s)", LineStyle::dashed, 1},
                              {"backward_euler", "Backward Euler", LineStyle::dotted, 2},
                              {"bilinear", "Bilinear transform", LineStyle::dash_dot, 3}});
  return figure;
}

/// Figure E.22: the positions that these areas add up to (section E.5).
FigureResult figure_E_22() {
  const Response response = elevator_response();
  const Discretized y = discretized(response.velocity);
  FigureResult figure{.id = "E.22", .title = "Positions from discretised velocity data"};
  figure.columns = {{"time", "s", response.time},
                    {"position", "m", response.position},
                    {"forward_euler", "m", integral(y.forward, true)},
                    {"backward_euler", "m", integral(y.backward, true)},
                    {"bilinear", "m", integral(y.bilinear, false)},
                    {"script_forward_euler", "m", integral(y.script_forward, false)},
                    {"script_backward_euler", "m", integral(y.script_backward, true)}};
  figure.picture = line_plot(figure, "Position (m)",
                             {{"position", "Continuous", LineStyle::solid, 0},
                              {"forward_euler", "Forward Euler (T = 0.1 s)", LineStyle::dashed, 1},
                              {"backward_euler", "Backward Euler", LineStyle::dotted, 2},
                              {"bilinear", "Bilinear transform", LineStyle::dash_dot, 3}});
  return figure;
}

}  // namespace flyball::book
