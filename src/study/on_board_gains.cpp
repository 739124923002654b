// Feedback gains for the loops that run on motor controllers, every millisecond.
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>

#include "core/constants.hpp"
#include "study/design_steps.hpp"

namespace flyball::study {

namespace {

struct PdMargins {
  double gain = std::numeric_limits<double>::infinity();   ///< Ratio.
  double phase = std::numeric_limits<double>::infinity();  ///< rad
};

/// Of L(jω) = (kP + kD jω) P(jω) e^(−jω (delay + T/2)), P = 1/(kA s² + kV s) of a position and
/// 1/(kA s + kV) of a velocity: what a PID makes of the sensor's value, without an observer. T/2 is
/// the hold's. The least margins over all crossings up to Nyquist.
PdMargins margins_of(double kP, double kD, const PlantDescription& plant, double delay,
                     double period) {
  constexpr int points = 4000;
  const mechanisms::FeedforwardGains& gains = plant.gains;
  const bool velocity = controls_velocity(plant.kind);
  const double highest = pi / period;
  const double lowest = 1e-3 * std::min(gains.kV / gains.kA, highest);
  PdMargins margins;
  double last_size = 0.0;
  double last_angle = 0.0;
  for (int i = 0; i < points; ++i) {
    const double w = lowest * std::pow(highest / lowest, static_cast<double>(i) / (points - 1));
    const std::complex<double> s(0.0, w);
    const std::complex<double> first = gains.kA * s + gains.kV;
    const double size = std::abs((kP + kD * s) / (velocity ? first : s * first));
    // The arguments of its factors, each continuous in ω.
    const double angle = std::arg(kP + kD * s) - std::arg(first) - (velocity ? 0.0 : 0.5 * pi) -
                         w * (delay + 0.5 * period);
    if (i > 0) {
      if ((size - 1.0) * (last_size - 1.0) <= 0.0) {
        margins.phase = std::min(margins.phase, angle + pi);
      }
      for (const double critical : {-pi, -3.0 * pi, -5.0 * pi}) {
        if ((angle - critical) * (last_angle - critical) <= 0.0) {
          margins.gain = std::min(margins.gain, 1.0 / size);
        }
      }
    }
    last_size = size;
    last_angle = angle;
  }
  return margins;
}

bool is_comfortable(double kP, double kD, const PlantDescription& plant, double delay,
                    double period) {
  constexpr double least_gain = 2.0;
  constexpr double least_phase = pi / 4.0;
  const PdMargins nominal = margins_of(kP, kD, plant, delay, period);
  if (nominal.gain < least_gain || nominal.phase < least_phase) {
    return false;
  }
  for (const double gain : {0.8, 1.2}) {
    for (const double inertia : {0.8, 1.2}) {
      PlantDescription other = plant;
      other.gains.kA *= inertia;
      const PdMargins margins = margins_of(gain * kP, gain * kD, other, delay, period);
      if (margins.gain <= 1.0 || margins.phase <= 0.0) {
        return false;
      }
    }
  }
  return true;
}

}  // namespace

std::vector<PasteGains> on_board_gains(const DesignJob& said) {
  if (!said.plant.kA_determined || said.controller.period <= on_board_period) {
    return {};
  }
  DesignJob job = said;
  job.controller.period = on_board_period;
  job.controller.predict_delay = false;
  const auto model = linear_model(job.plant, on_board_period);
  if (!model) {
    return {};
  }
  const double delay = job.controller.delay.value_or(0.0);
  const std::vector<double> start =
      default_tolerances(job.plant, static_cast<std::size_t>(model->A.rows()));
  std::optional<Eigen::MatrixXd> best;
  constexpr int steps = 40;
  constexpr double step = 1.25;
  double factor = 1.0;
  for (int i = 0; i < steps; ++i, factor *= step) {
    std::vector<double> tolerances = start;
    for (double& tolerance : tolerances) {
      tolerance *= factor;
    }
    const auto loop = feedback_of(*model, job, tolerances);
    if (!loop) {
      continue;
    }
    const Eigen::MatrixXd& K = loop->K_delayed;
    const double kD = K.cols() > 1 ? K(0, 1) : 0.0;
    if (K(0, 0) > 0.0 && kD >= 0.0 && (!best || K(0, 0) > (*best)(0, 0)) &&
        is_comfortable(K(0, 0), kD, job.plant, delay, on_board_period)) {
      best = K;
    }
  }
  return best ? paste_gains(job.plant, *best) : std::vector<PasteGains>();
}

}  // namespace flyball::study
