#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

/// The mechanism's response to a recorded voltage, with its sensitivities.
namespace flyball::identification {

/// The numbers of the parameters, as columns of the sensitivities and rows of the estimate.
namespace parameter {

/// What a run's simulation depends on.
enum Simulation : int {
  static_friction = 0,    ///< kS, V.
  velocity_gain = 1,      ///< kV, V/(unit/s).
  log_time_constant = 2,  ///< ln(kA/kV), kA/kV in s.
  // Factors of the forces that a run's input holds, V a unit of theirs.
  gravity_cosine = 3,     ///< Of 1 (elevator) or cos θ.
  gravity_sine = 4,       ///< Of sin θ.
  bias = 5,               ///< Of 1: friction of one direction above the other's.
  spring = 6,             ///< Of the position from the middle of the travel.
  drag = 7,               ///< Of v |v|.
  sag = 8,                ///< Resistance of battery and wires over the motor's.
  friction_field = 9,     ///< The first of those of friction along the travel.
  headroom = 15,          ///< V, what |V − kV v| is limited to: resistance times current limit.
  initial_velocity = 16,  ///< Of this run, unit/s.
};
inline constexpr int first_force = gravity_cosine;

}  // namespace parameter

inline constexpr int force_count = parameter::headroom - parameter::first_force;
/// Sines and cosines of one, two and three waves along the travel.
inline constexpr int field_count = parameter::headroom - parameter::friction_field;
inline constexpr double no_limit = 1e6;  ///< V, a headroom that no voltage reaches.
inline constexpr int simulation_parameter_count = 17;
using SimulationVector = std::array<double, simulation_parameter_count>;
using SimulationGradient = Eigen::Matrix<double, 1, simulation_parameter_count>;

/// What drives a run: everything is held from a row to the next.
struct RunInput {
  std::vector<double> time;     ///< s, ascending.
  std::vector<double> voltage;  ///< V.
  /// What the forces' factors multiply, in their order; an empty one is nothing.
  std::array<std::vector<double>, force_count> forces;
};

/// Position (from 0) and velocity at the rows, and between them by cubic Hermite interpolation.
class Response {
 public:
  struct Sample {
    double position = 0.0;
    double velocity = 0.0;
    SimulationGradient position_gradient;  ///< Only set if asked for.
  };

  /// Integrates kA v̇ = V − kS sgn(v) − kV v − forces exactly from row to row: exponential pieces,
  /// split where the velocity reaches zero (there it sticks if |V − forces| ≤ kS), and parabolic
  /// ones where the current is limited (|V − kV v| = headroom).
  void simulate(const RunInput& input, const SimulationVector& parameters, bool sensitivities);

  /// Before the first row the velocity is the initial one, after the last row it stays.
  /// @param hint  A row near `time`, to start the search from; it is moved to the row found.
  [[nodiscard]] Sample at(double time, bool gradient, std::size_t& hint) const;

 private:
  using Gradients =
      Eigen::Matrix<double, Eigen::Dynamic, simulation_parameter_count, Eigen::RowMajor>;

  const RunInput* input_ = nullptr;
  Eigen::VectorXd velocity_;
  Eigen::VectorXd position_;
  Gradients velocity_gradient_;
  Gradients position_gradient_;
};

}  // namespace flyball::identification
