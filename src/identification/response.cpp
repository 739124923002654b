#include <algorithm>
#include <cmath>
#include <utility>

#include <flyball/mechanisms/friction.hpp>

#include "identification/response.hpp"

namespace flyball::identification {
namespace {

/// The state with its derivatives by the parameters.
struct State {
  double velocity;
  double position;
  SimulationGradient velocity_gradient;
  SimulationGradient position_gradient;
};

/// What pushes a run between two rows besides friction and damping.
struct Drive {
  double voltage;
  double opposed;  ///< Sum of the forces, V.
  /// Of the forces, by their factors.
  Eigen::Matrix<double, 1, force_count> by_factor{};
};

void add_force_gradient(const Drive& drive, double factor, SimulationGradient& gradient) {
  gradient.segment<force_count>(parameter::first_force) -= factor * drive.by_factor;
}

/// Slides for `duration` with friction against `sign`:
/// v' = a v + b w, p' = p + c v + d w with w = force − sign kS, a = exp(−T/τ), c = τ(1 − a),
/// b = (1 − a)/kV, d = (T − c)/kV.
void slide(State& state, const Drive& drive, double sign, double duration,
           const SimulationVector& x, double tau, bool sensitivities) {
  const double a = std::exp(-duration / tau);
  const double c = tau * (1.0 - a);
  const double kV = x[parameter::velocity_gain];
  const double b = (1.0 - a) / kV;
  const double d = (duration - c) / kV;
  const double w = drive.voltage - drive.opposed - sign * x[parameter::static_friction];
  if (sensitivities) {
    // ∂a/∂ln τ = a T/τ, ∂c/∂ln τ = c − a T.
    const double a_log = a * duration / tau;
    const double c_log = c - a * duration;
    state.position_gradient += c * state.velocity_gradient;
    state.position_gradient[parameter::static_friction] -= d * sign;
    add_force_gradient(drive, d, state.position_gradient);
    state.position_gradient[parameter::velocity_gain] -= d * w / kV;
    state.position_gradient[parameter::log_time_constant] += c_log * (state.velocity - w / kV);
    state.velocity_gradient *= a;
    state.velocity_gradient[parameter::static_friction] -= b * sign;
    add_force_gradient(drive, b, state.velocity_gradient);
    state.velocity_gradient[parameter::velocity_gain] -= b * w / kV;
    state.velocity_gradient[parameter::log_time_constant] += a_log * (state.velocity - w / kV);
  }
  state.position += c * state.velocity + d * w;
  state.velocity = a * state.velocity + b * w;
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

LimitedPiece limited_piece(const State& state, const Drive& drive, double side, double left,
                           const SimulationVector& x, double kA,
                           const mechanisms::Friction& friction) {
  const double headroom = x[parameter::headroom];
  const double push = side * headroom - drive.opposed;
  LimitedPiece piece{side, static_cast<double>(friction.direction(state.velocity, push))};
  piece.duration = left;
  if (piece.sign == 0.0) {
    return piece;
  }
  piece.acceleration = (push - piece.sign * x[parameter::static_friction]) / kA;
  // Until the motion stops or the limit is left, whichever is first.
  const double stop = -state.velocity / piece.acceleration;
  if (state.velocity != 0.0 && stop > 0.0 && stop <= piece.duration) {
    piece.duration = stop;
    piece.stops = true;
  }
  const double free_speed = (drive.voltage - side * headroom) / x[parameter::velocity_gain];
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
                  const SimulationVector& x, double tau) {
  Entry entry{duration};
  // |V − kV v| grows only while the speed falls away from V/kV.
  const double side = v_end < velocity ? 1.0 : -1.0;
  const double at = (voltage - side * x[parameter::headroom]) / x[parameter::velocity_gain];
  if (side * (velocity - at) > 0.0 && side * (at - v_end) > 0.0) {
    const double time = tau * std::log((velocity - v_end) / (at - v_end));
    if (time < duration) {
      entry = {time, side};
    }
  }
  return entry;
}

void push(State& state, const Drive& drive, const LimitedPiece& piece, const SimulationVector& x,
          double kA, bool sensitivities) {
  const double T = piece.duration;
  const double to_velocity = T / kA;
  const double to_position = 0.5 * T * T / kA;
  if (sensitivities) {
    state.position_gradient += T * state.velocity_gradient;
    for (auto& [gradient, factor] :
         {std::pair<SimulationGradient&, double>(state.velocity_gradient, to_velocity),
          std::pair<SimulationGradient&, double>(state.position_gradient, to_position)}) {
      gradient[parameter::static_friction] -= factor * piece.sign;
      gradient[parameter::headroom] += factor * piece.side;
      add_force_gradient(drive, factor, gradient);
      // kA = kV τ divides all of it.
      gradient[parameter::velocity_gain] -=
          factor * kA * piece.acceleration / x[parameter::velocity_gain];
      gradient[parameter::log_time_constant] -= factor * kA * piece.acceleration;
    }
  }
  state.position += T * state.velocity + to_position * kA * piece.acceleration;
  state.velocity += T * piece.acceleration;
}

/// The instant of a stop moves with the parameters: dv⁺ = (v̇⁺/v̇⁻) dv⁻, 0 if it sticks.
void stop(State& state, double sign, double force, double kS, const mechanisms::Friction& friction,
          bool sensitivities) {
  state.velocity = 0.0;
  if (sensitivities) {
    const double before = force - sign * kS;
    const double after = force + sign * kS;
    const bool turns = friction.direction(0.0, force) == static_cast<int>(-sign);
    state.velocity_gradient *= turns && before != 0.0 ? after / before : 0.0;
  }
}

void advance(State& state, const Drive& drive, double duration, const SimulationVector& x,
             bool sensitivities) {
  const double tau = std::exp(x[parameter::log_time_constant]);
  const double kV = x[parameter::velocity_gain];
  const double kS = x[parameter::static_friction];
  const mechanisms::Friction friction{kS};
  const mechanisms::FrictionMotion motion(kV, kV * tau, friction);
  double left = duration;
  const double across = drive.voltage - kV * state.velocity;
  double side = std::abs(across) > x[parameter::headroom] ? std::copysign(1.0, across) : 0.0;
  // At most: leave the limit, slow down to rest, slip the other way and reach a limit again.
  for (int motions = 0; motions < 6 && left > 0.0; ++motions) {
    if (side != 0.0) {
      const LimitedPiece piece = limited_piece(state, drive, side, left, x, kV * tau, friction);
      if (piece.sign == 0.0) {
        return;
      }
      push(state, drive, piece, x, kV * tau, sensitivities);
      left -= piece.duration;
      if (piece.stops) {
        stop(state, piece.sign, side * x[parameter::headroom] - drive.opposed, kS, friction,
             sensitivities);
      }
      side = piece.leaves ? 0.0 : side;
      continue;
    }
    const double force = drive.voltage - drive.opposed;
    const auto piece = motion.piece(state.velocity, force, left);
    if (piece.direction == 0) {
      return;
    }
    const Entry entry =
        limit_entry(state.velocity, piece.v_end, piece.duration, drive.voltage, x, tau);
    slide(state, drive, piece.direction, entry.time, x, tau, sensitivities);
    left -= entry.time;
    side = entry.side;
    if (piece.stops && side == 0.0) {
      stop(state, piece.direction, force, kS, friction, sensitivities);
    }
  }
}

}  // namespace

void Response::simulate(const RunInput& input, const SimulationVector& parameters,
                        bool sensitivities) {
  input_ = &input;
  const auto rows = static_cast<Eigen::Index>(input.time.size());
  // Made anew: resizing frees the old memory before the new is there.
  if (position_.size() != rows) {
    velocity_ = Eigen::VectorXd(rows);
    position_ = Eigen::VectorXd(rows);
  }
  if (sensitivities && position_gradient_.rows() != rows) {
    velocity_gradient_ = Gradients(rows, simulation_parameter_count);
    position_gradient_ = Gradients(rows, simulation_parameter_count);
  }
  State state{parameters[parameter::initial_velocity], 0.0, SimulationGradient::Zero(),
              SimulationGradient::Zero()};
  state.velocity_gradient[parameter::initial_velocity] = 1.0;
  for (Eigen::Index row = 0; row < rows; ++row) {
    velocity_[row] = state.velocity;
    position_[row] = state.position;
    if (sensitivities) {
      velocity_gradient_.row(row) = state.velocity_gradient;
      position_gradient_.row(row) = state.position_gradient;
    }
    if (row + 1 < rows) {
      const auto i = static_cast<std::size_t>(row);
      Drive drive{input.voltage[i], 0.0, Eigen::Matrix<double, 1, force_count>::Zero()};
      for (std::size_t k = 0; k < input.forces.size(); ++k) {
        if (!input.forces[k].empty()) {
          drive.by_factor[static_cast<Eigen::Index>(k)] = input.forces[k][i];
          drive.opposed += parameters[parameter::first_force + k] * input.forces[k][i];
        }
      }
      advance(state, drive, input.time[i + 1] - input.time[i], parameters, sensitivities);
    }
  }
}

Response::Sample Response::at(double time, bool gradient, std::size_t& hint) const {
  const std::vector<double>& knots = input_->time;
  Sample sample;
  if (time <= knots.front() || time >= knots.back()) {
    const Eigen::Index row = time <= knots.front() ? 0 : velocity_.size() - 1;
    const double beyond = time - knots[static_cast<std::size_t>(row)];
    sample.velocity = velocity_[row];
    sample.position = position_[row] + beyond * velocity_[row];
    if (gradient) {
      sample.position_gradient = position_gradient_.row(row) + beyond * velocity_gradient_.row(row);
    }
    return sample;
  }
  // knots[hint] <= time < knots[hint + 1]; times are asked for nearly in order.
  hint = std::min(hint, knots.size() - 2);
  while (knots[hint] > time) {
    --hint;
  }
  while (knots[hint + 1] <= time) {
    ++hint;
  }
  const auto k = static_cast<Eigen::Index>(hint);
  const double width = knots[hint + 1] - knots[hint];
  const double s = (time - knots[hint]) / width;
  // Cubic Hermite basis of values (h00, h01) and slopes (h10, h11).
  const double h01 = s * s * (3.0 - 2.0 * s);
  const double h00 = 1.0 - h01;
  const double h10 = width * s * (1.0 - s) * (1.0 - s);
  const double h11 = width * s * s * (s - 1.0);
  sample.position =
      h00 * position_[k] + h10 * velocity_[k] + h01 * position_[k + 1] + h11 * velocity_[k + 1];
  sample.velocity = (1.0 - s) * velocity_[k] + s * velocity_[k + 1];
  if (gradient) {
    sample.position_gradient = h00 * position_gradient_.row(k) + h10 * velocity_gradient_.row(k) +
                               h01 * position_gradient_.row(k + 1) +
                               h11 * velocity_gradient_.row(k + 1);
  }
  return sample;
}

}  // namespace flyball::identification
