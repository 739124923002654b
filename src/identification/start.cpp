#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>

#include <flyball/identification/identification_error.hpp>

#include "core/try.hpp"
#include "identification/start.hpp"
#include "identification/statistics.hpp"
#include "math/dense/dense.hpp"

namespace flyball::identification {
namespace {

using mechanisms::MechanismKind;

constexpr double acceleration_half_width = 0.04;  // s
constexpr int reweightings = 10;

struct Rows {
  Eigen::MatrixXd regressors;  // sgn(v), v, a, gravity 1, gravity 2
  Eigen::VectorXd voltage;
};

Rows collect(const PreparedRecording& recording) {
  std::vector<double> values;
  std::vector<double> voltages;
  for (const PreparedRun& prepared : recording.runs) {
    const TestRun& run = prepared.run;
    if (!prepared.moved) {
      continue;
    }
    for (std::size_t i = prepared.first; i < prepared.last; ++i) {
      const double velocity = prepared.smoothed_velocity[i];
      const double low = run.time[i] - acceleration_half_width;
      const double high = run.time[i] + acceleration_half_width;
      if (std::abs(velocity) < 0.04 * recording.top_speed || low < run.time[prepared.first] ||
          high > run.time[prepared.last - 1]) {
        continue;
      }
      const double acceleration = (interpolate(run.time, prepared.smoothed_velocity, high) -
                                   interpolate(run.time, prepared.smoothed_velocity, low)) /
                                  (high - low);
      const bool arm = recording.mechanism == MechanismKind::arm && recording.has_position;
      const bool elevator = recording.mechanism == MechanismKind::elevator;
      values.insert(values.end(), {std::copysign(1.0, velocity), velocity, acceleration,
                                   arm ? std::cos(run.position[i]) : (elevator ? 1.0 : 0.0),
                                   arm ? std::sin(run.position[i]) : 0.0});
      voltages.push_back(run.voltage[i]);
    }
  }
  const auto rows = static_cast<Eigen::Index>(voltages.size());
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, 5, Eigen::RowMajor>;
  return {Eigen::Map<const RowMajor>(values.data(), rows, 5),
          Eigen::Map<const Eigen::VectorXd>(voltages.data(), rows)};
}

}  // namespace

Expected<StartGains> regress_gains(const PreparedRecording& recording) {
  const Rows rows = collect(recording);
  if (rows.voltage.size() < 20) {
    return refusal(IdentificationError::too_short, "fit_feedforward")
        .hint("record longer tests")
        .with("rows in motion", static_cast<double>(rows.voltage.size()));
  }
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(rows.voltage.size());
  Eigen::VectorXd gains = Eigen::VectorXd::Zero(5);
  for (int pass = 0; pass < reweightings; ++pass) {
    Eigen::MatrixXd normal = rows.regressors.transpose() * weights.asDiagonal() * rows.regressors;
    // A ridge far below the data keeps absent regressors (no gravity, no acceleration) at zero.
    const double ridge = 1e-9 * normal.trace();
    normal.diagonal().array() += ridge;
    gains = detail::solve_symmetric(
        normal, rows.regressors.transpose() * (weights.asDiagonal() * rows.voltage));
    const Eigen::VectorXd residuals = rows.voltage - rows.regressors * gains;
    const double scale =
        std::max(1e-6, mad_scale({residuals.data(), static_cast<std::size_t>(residuals.size())}));
    weights = (1.0 + (residuals.array() / (1.5 * scale)).square()).rsqrt();
  }
  StartGains start{std::max(0.0, gains[0]), gains[1], gains[3], gains[4]};
  if (!(start.kV > 0.0) || !std::isfinite(start.kV)) {
    std::vector<double> ratios;
    for (Eigen::Index i = 0; i < rows.voltage.size(); ++i) {
      ratios.push_back(std::abs(rows.voltage[i] / rows.regressors(i, 1)));
    }
    start = {0.0, median(std::move(ratios)), 0.0, 0.0};
  }
  return start;
}

}  // namespace flyball::identification
