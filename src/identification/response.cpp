#include <algorithm>
#include <cmath>

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

struct Drive {
  double force;  ///< Voltage − gravity, V.
  double cosine;
  double sine;
};

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
  const double w = drive.force - sign * x[parameter::static_friction];
  if (sensitivities) {
    // ∂a/∂ln τ = a T/τ, ∂c/∂ln τ = c − a T.
    const double a_log = a * duration / tau;
    const double c_log = c - a * duration;
    SimulationGradient force = SimulationGradient::Zero();
    force[parameter::static_friction] = -sign;
    force[parameter::gravity_cosine] = -drive.cosine;
    force[parameter::gravity_sine] = -drive.sine;
    state.position_gradient += c * state.velocity_gradient + d * force;
    state.position_gradient[parameter::velocity_gain] -= d * w / kV;
    state.position_gradient[parameter::log_time_constant] += c_log * (state.velocity - w / kV);
    state.velocity_gradient = a * state.velocity_gradient + b * force;
    state.velocity_gradient[parameter::velocity_gain] -= b * w / kV;
    state.velocity_gradient[parameter::log_time_constant] += a_log * (state.velocity - w / kV);
  }
  state.position += c * state.velocity + d * w;
  state.velocity = a * state.velocity + b * w;
}

void advance(State& state, const Drive& drive, double duration, const SimulationVector& x,
             bool sensitivities) {
  const double tau = std::exp(x[parameter::log_time_constant]);
  const double kV = x[parameter::velocity_gain];
  const double kS = x[parameter::static_friction];
  const mechanisms::Friction friction{kS};
  const mechanisms::FrictionMotion motion(kV, kV * tau, friction);
  double left = duration;
  // At most: slow down to rest, then slip the other way.
  for (int motions = 0; motions < 2 && left > 0.0; ++motions) {
    const auto piece = motion.piece(state.velocity, drive.force, left);
    if (piece.direction == 0) {
      return;
    }
    slide(state, drive, piece.direction, piece.duration, x, tau, sensitivities);
    left -= piece.duration;
    if (piece.stops) {
      state.velocity = 0.0;
      if (sensitivities) {
        // The instant of the stop moves with the parameters: dv⁺ = (v̇⁺/v̇⁻) dv⁻, 0 if it sticks.
        const double before = drive.force - piece.direction * kS;
        const double after = drive.force + piece.direction * kS;
        const bool turns = friction.direction(0.0, drive.force) == -piece.direction;
        state.velocity_gradient *= turns && before != 0.0 ? after / before : 0.0;
      }
    }
  }
}

}  // namespace

void Response::simulate(const RunInput& input, const SimulationVector& parameters,
                        bool sensitivities) {
  input_ = &input;
  const auto rows = static_cast<Eigen::Index>(input.time.size());
  velocity_.resize(rows);
  position_.resize(rows);
  if (sensitivities) {
    velocity_gradient_.resize(rows, simulation_parameter_count);
    position_gradient_.resize(rows, simulation_parameter_count);
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
      const double gravity = parameters[parameter::gravity_cosine] * input.gravity_cosine[i] +
                             parameters[parameter::gravity_sine] * input.gravity_sine[i];
      advance(state, {input.voltage[i] - gravity, input.gravity_cosine[i], input.gravity_sine[i]},
              input.time[i + 1] - input.time[i], parameters, sensitivities);
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
