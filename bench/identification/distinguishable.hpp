#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

#include <Eigen/Dense>

#include <flyball/simulation/characterization.hpp>

/// Whether a log can tell a defect at all, from the simulator's truth and no fit of the log.
namespace scenarios {

using flyball::CharacterizationOptions;
using flyball::identification::Recording;
using flyball::identification::TestRun;

/// What the sensors show without noise, in two columns; of rows that are new there.
inline Recording noiseless(CharacterizationOptions options) {
  options.voltage_noise = 0.0;
  options.velocity_noise = 0.0;
  options.resolution = 0.0;
  return flyball::record_characterization(options).value();
}

/// The same mechanism without the defect.
inline CharacterizationOptions without_defect(CharacterizationOptions options) {
  const double position_delay = options.defects.position_delay;
  const double velocity_delay = options.defects.velocity_delay;
  options.defects = {};
  options.defects.position_delay = position_delay;
  options.defects.velocity_delay = velocity_delay;
  return options;
}

/// What the gains' model may change to look like the defect: the gains and the sensors.
struct PlainParameter {
  double* (*of)(CharacterizationOptions& options);
  double step;  ///< To differentiate by.
  double least;
  double most;
};

inline std::vector<PlainParameter> plain_parameters(const CharacterizationOptions& options) {
  using Options = CharacterizationOptions;
  std::vector<PlainParameter> all{
      {[](Options& o) { return &o.kS; }, 1e-3 * options.kS, 0.0, 1e9},
      {[](Options& o) { return &o.kV; }, 1e-3 * options.kV, 0.1 * options.kV, 1e9},
      {[](Options& o) { return &o.kA; }, 1e-2 * options.kA, 0.1 * options.kA, 1e9},
      {[](Options& o) { return &o.defects.position_delay; }, 5e-4, 0.0, 0.12},
      {[](Options& o) { return &o.defects.velocity_delay; }, 5e-4, 0.0, 0.12},
      {[](Options& o) { return &o.velocity_window; }, 2e-3, 0.0, 0.24}};
  if (options.mechanism != flyball::mechanisms::MechanismKind::flywheel) {
    all.push_back({[](Options& o) { return &o.kG; }, 1e-3 * options.kG, 0.0, 1e9});
  }
  if (options.mechanism == flyball::mechanisms::MechanismKind::arm) {
    all.push_back({[](Options& o) { return &o.angle_offset; }, 1e-3, -3.0, 3.0});
  }
  return all;
}

/// Rows of a run that two logs have in common: until one of them ends or cuts the voltage.
inline std::size_t common_rows(const TestRun& a, const TestRun& b) {
  const std::size_t rows = std::min(a.time.size(), b.time.size());
  std::size_t row = 0;
  while (row < rows && a.voltage[row] == b.voltage[row]) {
    ++row;
  }
  return row;
}

/// The sensors' noise, and that of the recorded voltage as the simulated speed follows it, made
/// white by a Kalman filter of (e_p, e_v): ė_p = e_v, ė_v = −e_v/τ + w/kA, w held over a row.
/// @param columns  Differences of noiseless logs, position over velocity a row; from rest.
/// @return  The innovations in their standard deviations, of each column.
inline Eigen::MatrixXd whitened(const CharacterizationOptions& options, const TestRun& run,
                                std::size_t rows,
                                const std::function<Eigen::RowVectorXd(std::size_t, bool)>& column,
                                Eigen::Index columns) {
  const double tau = options.kA / options.kV;
  const double quantum = std::max(options.resolution, 1e-9);
  const double rows_a_refresh = std::max(1.0, options.sensor_refresh / options.row_period);
  const double velocity_std =
      options.velocity_noise.value_or(0.005 * std::abs(options.step_voltage - options.kS) /
                                      options.kV) /
      std::sqrt(options.noise_per_row ? rows_a_refresh : 1.0);
  const Eigen::Vector2d R(quantum * quantum / 12.0, velocity_std * velocity_std);
  Eigen::Matrix2d P = Eigen::Matrix2d::Zero();
  Eigen::MatrixXd state = Eigen::MatrixXd::Zero(2, columns);
  std::vector<Eigen::RowVectorXd> all;
  for (std::size_t row = 1; row < rows; ++row) {
    const double dt = run.time[row] - run.time[row - 1];
    const bool fresh = run.position[row] != run.position[row - 1];
    if (!fresh && P.isZero(0.0)) {
      continue;  // Rests: the voltage's noise moves nothing.
    }
    const double a = std::exp(-dt / tau);
    const double c = tau * (1.0 - a);
    Eigen::Matrix2d A;
    A << 1.0, c, 0.0, a;
    const Eigen::Vector2d b((dt - c) / options.kV, (1.0 - a) / options.kV);
    state = A * state;
    P = A * P * A.transpose() + options.voltage_noise * options.voltage_noise * b * b.transpose();
    if (!fresh) {
      continue;
    }
    for (int channel = 0; channel < 2; ++channel) {
      const double S = P(channel, channel) + R[channel];
      const Eigen::RowVectorXd innovation = column(row, channel == 0) - state.row(channel);
      all.push_back(innovation / std::sqrt(S));
      const Eigen::Vector2d K = P.col(channel) / S;
      state += K * innovation;
      P -= K * P.row(channel);
    }
  }
  Eigen::MatrixXd white(static_cast<Eigen::Index>(all.size()), columns);
  for (std::size_t k = 0; k < all.size(); ++k) {
    white.row(static_cast<Eigen::Index>(k)) = all[k];
  }
  return white;
}

/// How far a session with a defect is from the nearest one without: the least χ² of the whitened
/// difference of their noiseless logs over all gains, sensors' delays and averages, and where
/// within a row each test's sensors were read. It is the noncentrality of the best test that
/// there can be, one that knows the defect's kind and size beforehand.
inline double distance_to_plain(const CharacterizationOptions& spoiled) {
  const Recording shown = noiseless(spoiled);
  CharacterizationOptions plain = without_defect(spoiled);
  const std::vector<PlainParameter> parameters = plain_parameters(spoiled);
  const auto shared = static_cast<Eigen::Index>(parameters.size());
  const auto runs = static_cast<Eigen::Index>(shown.runs.size());
  const Eigen::Index width = shared + runs;
  Eigen::VectorXd ages = Eigen::VectorXd::Zero(runs);  // s, beyond the delay.
  double least = std::numeric_limits<double>::infinity();
  constexpr int most = 8;
  for (int iteration = 0; iteration < most; ++iteration) {
    const Recording base = noiseless(plain);
    std::vector<Recording> moved;
    for (const PlainParameter& parameter : parameters) {
      CharacterizationOptions other = plain;
      *parameter.of(other) += parameter.step;
      moved.push_back(noiseless(other));
    }
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(width, width);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(width);
    double squares = 0.0;
    for (Eigen::Index r = 0; r < runs; ++r) {
      const auto at = static_cast<std::size_t>(r);
      const TestRun& of_base = base.runs[at];
      std::size_t rows = common_rows(shown.runs[at], of_base);
      for (const Recording& other : moved) {
        rows = std::min(rows, common_rows(of_base, other.runs[at]));
      }
      const auto column = [&](std::size_t row, bool position) {
        const auto value = [&](const TestRun& run) {
          return position ? run.position[row] : run.velocity[row];
        };
        Eigen::RowVectorXd values = Eigen::RowVectorXd::Zero(shared + 2);
        for (Eigen::Index k = 0; k < shared; ++k) {
          const auto which = static_cast<std::size_t>(k);
          values[k] = (value(moved[which].runs[at]) - value(of_base)) / parameters[which].step;
        }
        // Older by the row's share: both delays.
        values[shared] = values[3] + values[4];
        values[shared + 1] = value(shown.runs[at]) - value(of_base) - values[shared] * ages[r];
        return values;
      };
      const Eigen::MatrixXd white = whitened(spoiled, shown.runs[at], rows, column, shared + 2);
      Eigen::MatrixXd J = Eigen::MatrixXd::Zero(white.rows() + 1, width);
      Eigen::VectorXd d = Eigen::VectorXd::Zero(white.rows() + 1);
      J.topLeftCorner(white.rows(), shared) = white.leftCols(shared);
      J.col(shared + r).head(white.rows()) = white.col(shared);
      d.head(white.rows()) = white.col(shared + 1);
      const double deviation = spoiled.row_period / std::sqrt(12.0);
      J(white.rows(), shared + r) = 1.0 / deviation;
      d[white.rows()] = -ages[r] / deviation;
      H += J.transpose() * J;
      g += J.transpose() * d;
      squares += d.squaredNorm();
    }
    const Eigen::VectorXd scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    Eigen::MatrixXd scaled = scale.asDiagonal() * H * scale.asDiagonal();
    scaled.diagonal().array() += 1e-9;
    const Eigen::VectorXd step = scale.cwiseProduct(scaled.ldlt().solve(scale.cwiseProduct(g)));
    // What the linear step leaves; as the truth is not linear, the next iteration's is better.
    least = std::min(least, squares);
    const double left = squares - g.dot(step);
    if (squares - left < 0.5 || iteration + 1 == most) {
      least = std::min(least, std::max(0.0, left));
      break;
    }
    for (Eigen::Index k = 0; k < shared; ++k) {
      const PlainParameter& parameter = parameters[static_cast<std::size_t>(k)];
      double* value = parameter.of(plain);
      const double reach = 0.5 * std::abs(*value) + 20.0 * parameter.step;
      *value =
          std::clamp(*value + std::clamp(step[k], -reach, reach), parameter.least, parameter.most);
    }
    ages += step.tail(runs);
  }
  return least;
}

/// A test that suspects one clean log in fifty finds 19 in 20 of what is (2.05 + 1.64)² away; what
/// is nearer does not act in the log.
inline constexpr double acts_from = 13.7;

}  // namespace scenarios
