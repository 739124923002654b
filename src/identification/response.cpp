#include <algorithm>
#include <cmath>
#include <utility>

#include <flyball/mechanisms/friction.hpp>

#include "identification/response.hpp"

namespace flyball::identification {
namespace {

/// The numbers of a simulation, and what follows from them.
struct Constants {
  explicit Constants(const SimulationVector& x)
      : kS(x[parameter::static_friction]),
        kV(x[parameter::velocity_gain]),
        tau(std::exp(x[parameter::log_time_constant])),
        kA(kV * tau),
        headroom(x[parameter::headroom]),
        limited(headroom < no_limit),
        friction{kS},
        motion(kV, kA, friction) {}
  double kS;
  double kV;
  double tau;
  double kA;
  double headroom;
  bool limited;  ///< Whether any voltage can reach the headroom.
  mechanisms::Friction friction;
  mechanisms::FrictionMotion motion;
};

/// Places of the first columns.
enum ResponseColumn : int { by_friction, by_velocity_gain, by_time_constant };

/// The state with its derivatives by the columns (none for a width of 0).
template <int width>
struct State {
  using Row = Eigen::Array<double, width, 1>;
  double velocity = 0.0;
  double position = 0.0;
  Row velocity_gradient = Row::Zero();
  Row position_gradient = Row::Zero();
};

/// What pushes a run between two rows besides friction and damping.
template <int width>
struct Drive {
  double voltage = 0.0;
  double opposed = 0.0;  ///< Sum of the forces, V.
  /// Of what pushes, by the columns; those of forces are filled in, those of friction and damping
  /// are each motion's.
  typename State<width>::Row pushed = State<width>::Row::Zero();
  int by_headroom = -1;  ///< Its column.
};

/// Slides for `duration` with friction against `sign`:
/// v' = a v + b w, p' = p + c v + d w with w = force − sign kS, a = exp(−T/τ), c = τ(1 − a),
/// b = (1 − a)/kV, d = (T − c)/kV.
template <int width>
void slide(State<width>& state, Drive<width>& drive, double sign, double duration,
           const Constants& x) {
  const double a = std::exp(-duration / x.tau);
  const double c = x.tau * (1.0 - a);
  const double end = (drive.voltage - drive.opposed - sign * x.kS) / x.kV;  // w/kV
  if constexpr (width > 0) {
    const double b = (1.0 - a) / x.kV;
    const double d = (duration - c) / x.kV;
    drive.pushed[by_friction] = -sign;
    drive.pushed[by_velocity_gain] = -end;
    drive.pushed[by_time_constant] = 0.0;
    state.position_gradient += c * state.velocity_gradient + d * drive.pushed;
    state.velocity_gradient = a * state.velocity_gradient + b * drive.pushed;
    // ∂a/∂ln τ = a T/τ, ∂c/∂ln τ = c − a T.
    state.position_gradient[by_time_constant] += (c - a * duration) * (state.velocity - end);
    state.velocity_gradient[by_time_constant] += a * duration / x.tau * (state.velocity - end);
  }
  state.position += c * state.velocity + (duration - c) * end;
  state.velocity = a * state.velocity + (1.0 - a) * end;
}

/// A motion at the current limit: kA v̇ = ±headroom − forces − sign kS is constant.
struct LimitedPiece {
  double side = 0.0;  ///< Of the limit.
  double sign = 0.0;  ///< Of the motion; 0 if it sticks.
  double acceleration = 0.0;
  double duration = 0.0;
  bool stops = false;
  bool leaves = false;  ///< The limit, at its end.
};

template <int width>
LimitedPiece limited_piece(const State<width>& state, const Drive<width>& drive, double side,
                           double left, const Constants& x) {
  const double push = side * x.headroom - drive.opposed;
  LimitedPiece piece{side, static_cast<double>(x.friction.direction(state.velocity, push))};
  piece.duration = left;
  if (piece.sign == 0.0) {
    return piece;
  }
  piece.acceleration = (push - piece.sign * x.kS) / x.kA;
  // Until the motion stops or the limit is left, whichever is first.
  const double stop = -state.velocity / piece.acceleration;
  if (state.velocity != 0.0 && stop > 0.0 && stop <= piece.duration) {
    piece.duration = stop;
    piece.stops = true;
  }
  const double free_speed = (drive.voltage - side * x.headroom) / x.kV;
  const double leave = (free_speed - state.velocity) / piece.acceleration;
  if (side * piece.acceleration > 0.0 && leave <= piece.duration) {
    piece.duration = std::max(0.0, leave);
    piece.stops = false;
    piece.leaves = true;
  }
  return piece;
}

/// When a motion v(t) = v_end + (v − v_end) e^(−t/τ) runs into a current limit: the time and the
/// limit's side; no side if not within `duration`.
struct Entry {
  double time;
  double side = 0.0;
};

Entry limit_entry(double velocity, double v_end, double duration, double voltage,
                  const Constants& x) {
  Entry entry{duration};
  if (!x.limited) {
    return entry;
  }
  // |V − kV v| grows only while the speed falls away from V/kV.
  const double side = v_end < velocity ? 1.0 : -1.0;
  const double at = (voltage - side * x.headroom) / x.kV;
  if (side * (velocity - at) > 0.0 && side * (at - v_end) > 0.0) {
    const double time = x.tau * std::log((velocity - v_end) / (at - v_end));
    if (time < duration) {
      entry = {time, side};
    }
  }
  return entry;
}

template <int width>
void push(State<width>& state, Drive<width>& drive, const LimitedPiece& piece, const Constants& x) {
  const double T = piece.duration;
  const double to_velocity = T / x.kA;
  const double to_position = 0.5 * T * T / x.kA;
  if constexpr (width > 0) {
    drive.pushed[by_friction] = -piece.sign;
    // kA = kV τ divides all of it.
    drive.pushed[by_velocity_gain] = -x.kA * piece.acceleration / x.kV;
    drive.pushed[by_time_constant] = -x.kA * piece.acceleration;
    state.position_gradient += T * state.velocity_gradient + to_position * drive.pushed;
    state.velocity_gradient += to_velocity * drive.pushed;
    if (drive.by_headroom >= 0) {
      state.position_gradient[drive.by_headroom] += to_position * piece.side;
      state.velocity_gradient[drive.by_headroom] += to_velocity * piece.side;
    }
  }
  state.position += T * state.velocity + to_position * x.kA * piece.acceleration;
  state.velocity += T * piece.acceleration;
}

/// The instant of a stop moves with the parameters: dv⁺ = (v̇⁺/v̇⁻) dv⁻, 0 if it sticks.
template <int width>
void stop(State<width>& state, double sign, double force, const Constants& x) {
  state.velocity = 0.0;
  if constexpr (width > 0) {
    const double before = force - sign * x.kS;
    const double after = force + sign * x.kS;
    const bool turns = x.friction.direction(0.0, force) == static_cast<int>(-sign);
    state.velocity_gradient *= turns && before != 0.0 ? after / before : 0.0;
  }
}

template <int width>
void advance(State<width>& state, Drive<width>& drive, double duration, const Constants& x) {
  double left = duration;
  const double across = drive.voltage - x.kV * state.velocity;
  double side = std::abs(across) > x.headroom ? std::copysign(1.0, across) : 0.0;
  // At most: leave the limit, slow down to rest, slip the other way and reach a limit again.
  for (int motions = 0; motions < 6 && left > 0.0; ++motions) {
    if (side != 0.0) {
      const LimitedPiece piece = limited_piece(state, drive, side, left, x);
      if (piece.sign == 0.0) {
        return;
      }
      push(state, drive, piece, x);
      left -= piece.duration;
      if (piece.stops) {
        stop(state, piece.sign, side * x.headroom - drive.opposed, x);
      }
      side = piece.leaves ? 0.0 : side;
      continue;
    }
    const double force = drive.voltage - drive.opposed;
    const auto piece = x.motion.piece(state.velocity, force, left);
    if (piece.direction == 0) {
      return;
    }
    const Entry entry = limit_entry(state.velocity, piece.v_end, piece.duration, drive.voltage, x);
    slide(state, drive, piece.direction, entry.time, x);
    left -= entry.time;
    side = entry.side;
    if (piece.stops && side == 0.0) {
      stop(state, piece.direction, force, x);
    }
  }
}

/// The column of a parameter, or -1.
int column_of(const SimulationColumns& columns, int parameter) {
  const auto found = std::find(columns.begin(), columns.end(), parameter);
  return found == columns.end() ? -1 : static_cast<int>(found - columns.begin());
}

/// A force of the input that counts: by its factor, or for its column.
struct Force {
  const double* values;
  double factor;
  int column;  ///< -1 if its derivative is not asked for.
};

/// @param columns  Empty, or the parameters of the columns.
std::vector<Force> forces_of(const RunInput& input, const SimulationVector& parameters,
                             const SimulationColumns& columns) {
  std::vector<Force> forces;
  for (std::size_t k = 0; k < input.forces.size(); ++k) {
    const auto number = static_cast<std::size_t>(parameter::first_force) + k;
    const int column = column_of(columns, static_cast<int>(number));
    if (!input.forces[k].empty() && (column >= 0 || parameters[number] != 0.0)) {
      forces.push_back({input.forces[k].data(), parameters[number], column});
    }
  }
  return forces;
}

}  // namespace

template <int width>
void Response::simulate_with(const SimulationVector& parameters, const SimulationColumns& columns) {
  const RunInput& input = *input_;
  const std::size_t rows = input.time.size();
  const Constants constants(parameters);
  const std::vector<Force> forces = forces_of(input, parameters, columns);
  State<width> state;
  Drive<width> drive;
  state.velocity = parameters[parameter::initial_velocity];
  drive.by_headroom = column_of(columns, parameter::headroom);
  if constexpr (width > 0) {
    if (const int own = column_of(columns, parameter::initial_velocity); own >= 0) {
      state.velocity_gradient[own] = 1.0;
    }
  }
  for (std::size_t row = 0; row < rows; ++row) {
    double* const states = states_.data() + 2 * row;
    states[0] = state.position;
    states[1] = state.velocity;
    if constexpr (width > 0) {
      using Row = Eigen::Map<Eigen::Array<double, width, 1>>;
      double* const gradients = gradients_.data() + 2 * width * row;
      Row{gradients} = state.position_gradient;
      Row{gradients + width} = state.velocity_gradient;
    }
    if (row + 1 < rows) {
      drive.voltage = input.voltage[row];
      drive.opposed = 0.0;
      for (const Force& force : forces) {
        drive.opposed += force.factor * force.values[row];
        if constexpr (width > 0) {
          if (force.column >= 0) {
            drive.pushed[force.column] = -force.values[row];
          }
        }
      }
      const double step = input.time[row + 1] - input.time[row];
      inverse_steps_[static_cast<Eigen::Index>(row)] = 1.0 / step;
      advance(state, drive, step, constants);
    }
  }
}

void Response::simulate(const RunInput& input, const SimulationVector& parameters,
                        const SimulationColumns& columns) {
  input_ = &input;
  const auto rows = static_cast<Eigen::Index>(input.time.size());
  // Made anew: resizing frees the old memory before the new is there.
  if (states_.rows() != rows) {
    states_ = Rows(rows, 2);
    inverse_steps_ = Eigen::VectorXd(rows);
  }
  if (columns.empty()) {
    simulate_with<0>(parameters, columns);
    return;
  }
  with_width(columns.size(), [&](auto width) {
    if (gradients_.rows() != rows || gradients_.cols() != 2 * width()) {
      gradients_ = Rows(rows, 2 * width());
    }
    simulate_with<width()>(parameters, columns);
  });
}

}  // namespace flyball::identification
