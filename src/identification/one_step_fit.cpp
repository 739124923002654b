#include <flyball/identification/one_step_fit.hpp>

#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Core>
#include <Eigen/QR>

#include <flyball/identification/identification_error.hpp>

#include "core/try.hpp"
#include "identification/one_step_gains.hpp"

namespace flyball::identification {

OneStepFit one_step_gains(const Eigen::VectorXd& solution, double period, bool elevator, bool arm) {
  OneStepFit fit;
  fit.period = period;
  fit.alpha = solution[0];
  fit.beta = solution[1];
  fit.gamma = solution[2];
  fit.kS = -fit.gamma / fit.beta;         // (14.7)
  fit.kV = (1.0 - fit.alpha) / fit.beta;  // (14.8)
  fit.kA = fit.alpha > 0.0 ? (fit.alpha - 1.0) * fit.period / (fit.beta * std::log(fit.alpha))
                           : std::numeric_limits<double>::quiet_NaN();  // (14.9)
  if (elevator) {
    fit.kG = -solution[3] / fit.beta;
  } else if (arm) {
    // kG cos(θ + offset) = kG cos(offset) cos θ − kG sin(offset) sin θ
    const double cosine = -solution[3] / fit.beta;
    const double sine = -solution[4] / fit.beta;
    fit.kG = std::hypot(cosine, sine);
    fit.angle_offset = std::atan2(-sine, cosine);
  }
  return fit;
}

Expected<OneStepFit> fit_one_step(const PreparedRecording& recording) {
  using mechanisms::MechanismKind;
  if (!recording.mechanism) {
    return refusal(IdentificationError::unknown_mechanism, "fit_one_step", "the mechanism");
  }
  const bool elevator = *recording.mechanism == MechanismKind::elevator;
  const bool arm = *recording.mechanism == MechanismKind::arm && recording.has_position;
  const Eigen::Index terms = 3 + (elevator ? 1 : 0) + (arm ? 2 : 0);

  std::vector<double> values;
  std::vector<double> next;
  for (const PreparedRun& prepared : recording.runs) {
    const TestRun& run = prepared.run;
    const std::vector<double>& velocity =
        recording.has_velocity ? run.velocity : prepared.smoothed_velocity;
    for (std::size_t i = prepared.first; prepared.moved && i + 1 < prepared.last; ++i) {
      const double step = run.time[i + 1] - run.time[i];
      if (velocity[i] == 0.0 || step > 1.5 * recording.row_period) {
        continue;
      }
      values.insert(values.end(), {velocity[i], run.voltage[i], std::copysign(1.0, velocity[i])});
      if (elevator) {
        values.push_back(1.0);
      } else if (arm) {
        values.insert(values.end(), {std::cos(run.position[i]), std::sin(run.position[i])});
      }
      next.push_back(velocity[i + 1]);
    }
  }
  const auto rows = static_cast<Eigen::Index>(next.size());
  if (rows < 10 * terms) {
    return refusal(IdentificationError::too_short, "fit_one_step")
        .hint("record longer tests")
        .with("rows in motion", static_cast<double>(rows));
  }
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::MatrixXd regressors = Eigen::Map<const RowMajor>(values.data(), rows, terms);
  const Eigen::VectorXd x_next = Eigen::Map<const Eigen::VectorXd>(next.data(), rows);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(regressors);
  if (qr.rank() < terms) {
    return refusal(IdentificationError::singular, "fit_one_step")
        .hint("record ramps and steps in both directions")
        .with("rank", static_cast<double>(qr.rank()))
        .with("gains", static_cast<double>(terms));
  }
  const Eigen::VectorXd solution = qr.solve(x_next);

  OneStepFit fit = one_step_gains(solution, recording.row_period, elevator, arm);
  const double residual = (x_next - regressors * solution).squaredNorm();
  const double total = (x_next.array() - x_next.mean()).matrix().squaredNorm();
  fit.r_squared = total > 0.0 ? 1.0 - residual / total : 0.0;
  return fit;
}

}  // namespace flyball::identification
