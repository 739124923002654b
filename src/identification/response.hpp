#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <type_traits>
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

/// What drives a run: everything is held from a row to the next.
struct RunInput {
  std::vector<double> time;     ///< s, ascending.
  std::vector<double> voltage;  ///< V.
  /// What the forces' factors multiply, in their order; an empty one is nothing.
  std::array<std::vector<double>, force_count> forces;
};

/// The parameters that sensitivities are taken by, ascending: friction, velocity gain and time
/// constant are the first three always; empty for none.
using SimulationColumns = std::vector<int>;

/// Calls action with the least supported width (an integral constant) that holds so many columns:
/// loops over them are unrolled, and a term that the model lacks costs nothing.
template <class Action>
decltype(auto) with_width(std::size_t columns, Action&& action) {
  const auto as = [&]<int width>() -> decltype(auto) {
    return action(std::integral_constant<int, width>{});
  };
  return columns <= 4    ? as.template operator()<4>()
         : columns <= 6  ? as.template operator()<6>()
         : columns <= 8  ? as.template operator()<8>()
         : columns <= 12 ? as.template operator()<12>()
                         : as.template operator()<18>();
}

/// Position (from 0) and velocity at the rows, and between them by cubic Hermite interpolation.
class Response {
 public:
  /// A time among the rows.
  struct Place {
    Eigen::Index row = 0;
    /// Of position and velocity at the row, then of those at the next, in the position.
    std::array<double, 4> weights{};
    double share = 0.0;  ///< Of the next row's velocity in the velocity.
  };

  /// Integrates kA v̇ = V − kS sgn(v) − kV v − forces exactly from row to row: exponential pieces,
  /// split where the velocity reaches zero (there it sticks if |V − forces| ≤ kS), and parabolic
  /// ones where the current is limited (|V − kV v| = headroom).
  /// @param input  Two rows or more; stays.
  void simulate(const RunInput& input, const SimulationVector& parameters,
                const SimulationColumns& columns = {});

  /// Before the first row the velocity is the initial one, after the last row it stays.
  /// @param hint  A row near `time`, to start the search from; it is moved to the row found.
  [[nodiscard]] Place place(double time, std::size_t& hint) const {
    const std::vector<double>& knots = input_->time;
    if (time <= knots.front()) {
      return {0, {1.0, time - knots.front(), 0.0, 0.0}, 0.0};
    }
    if (time >= knots.back()) {
      return {states_.rows() - 2, {0.0, 0.0, 1.0, time - knots.back()}, 1.0};
    }
    // knots[hint] <= time < knots[hint + 1]; times are asked for nearly in order.
    hint = std::min(hint, knots.size() - 2);
    while (knots[hint] > time) {
      --hint;
    }
    while (knots[hint + 1] <= time) {
      ++hint;
    }
    const double width = knots[hint + 1] - knots[hint];
    const double s = (time - knots[hint]) * inverse_steps_[static_cast<Eigen::Index>(hint)];
    // Cubic Hermite basis of values (h00, h01) and slopes (h10, h11).
    const double h01 = s * s * (3.0 - 2.0 * s);
    return {static_cast<Eigen::Index>(hint),
            {1.0 - h01, width * s * (1.0 - s) * (1.0 - s), h01, width * s * s * (s - 1.0)},
            s};
  }

  [[nodiscard]] double position(const Place& at) const {
    const double* row = states_.data() + 2 * at.row;
    return at.weights[0] * row[0] + at.weights[1] * row[1] + at.weights[2] * row[2] +
           at.weights[3] * row[3];
  }
  [[nodiscard]] double velocity(const Place& at) const {
    const double* row = states_.data() + 2 * at.row;
    return (1.0 - at.share) * row[1] + at.share * row[3];
  }
  /// Adds factor times the position's derivatives by the columns to `sum`.
  /// @tparam width  That of `with_width` for the columns; `sum` has so many.
  template <int width>
  void add_gradient(const Place& at, double factor, double* sum) const {
    using Row = Eigen::Map<const Eigen::Array<double, width, 1>>;
    const double* row = gradients_.data() + 2 * width * at.row;
    Eigen::Map<Eigen::Array<double, width, 1>>(sum) +=
        (factor * at.weights[0]) * Row(row) + (factor * at.weights[1]) * Row(row + width) +
        (factor * at.weights[2]) * Row(row + 2 * width) +
        (factor * at.weights[3]) * Row(row + 3 * width);
  }

 private:
  template <int width>
  void simulate_with(const SimulationVector& parameters, const SimulationColumns& columns);

  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  const RunInput* input_ = nullptr;
  Eigen::VectorXd inverse_steps_;  ///< 1/s, from each row to the next.
  Rows states_;                    ///< Position and velocity of each row.
  Rows gradients_;                 ///< Their derivatives, each as wide as `with_width` says.
};

}  // namespace flyball::identification
