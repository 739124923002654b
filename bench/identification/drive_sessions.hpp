#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <flyball/core/random.hpp>
#include <flyball/identification/drive_fit.hpp>

/// Simulated sessions of a differential drive, as a logger of real robots would record them.
namespace drives {

using flyball::identification::DriveRecording;
using flyball::identification::DriveRun;
using flyball::identification::TestKind;
using flyball::mechanisms::DriveGains;

/// A robot of 50 kg with wheels that scrub when it turns.
inline constexpr DriveGains truth{.kS_left = 0.55,
                                  .kS_right = 0.65,
                                  .kV_linear = 2.4,
                                  .kA_linear = 0.38,
                                  .kV_angular = 2.7,
                                  .kA_angular = 0.22};
inline constexpr double trackwidth = 0.62;  ///< m
inline constexpr double scrub = 0.2;        ///< V of friction more in each side while it turns.

struct Session {
  bool straight = true;
  bool turning = true;
  double sensor_refresh = 20e-3;   ///< s
  double sensor_delay = 10e-3;     ///< s
  double velocity_window = 40e-3;  ///< s
  double resolution = 5e-5;        ///< m
  double velocity_noise = 0.01;    ///< m/s
  double voltage_noise = 0.01;     ///< V
  bool staggered = false;          ///< The right side's encoder is refreshed half a period later.
  bool gyro = true;
  std::uint64_t seed = 1;
};

/// One test. @param left  Sign of the left side's voltage. @param right  Of the right side's.
inline DriveRun drive(const Session& session, TestKind kind, double left, double right,
                      flyball::Random random) {
  constexpr double step = 0.25e-3;  // s
  constexpr double row_period = 5e-3;
  const bool ramp = flyball::identification::is_quasistatic(kind);
  const double duration = ramp ? 12.0 : 2.5;
  const double more = left * right < 0.0 ? scrub : 0.0;
  std::vector<double> ways[2];
  double heading = 0.0;
  std::vector<double> headings;
  double v[2] = {0.0, 0.0};
  double way[2] = {0.0, 0.0};
  const double friction[2] = {truth.kS_left + more, truth.kS_right + more};
  const double sign[2] = {left, right};
  const auto volts = [&](double time) {
    return time < 0.1 ? 0.0 : ramp ? 0.25 * (time - 0.1) : 4.0;
  };
  const auto steps = static_cast<std::size_t>(duration / step);
  for (std::size_t i = 0; i < steps; ++i) {
    for (int side = 0; side < 2; ++side) {
      ways[side].push_back(way[side]);
    }
    headings.push_back(heading);
    const double time = static_cast<double>(i) * step;
    // The voltage is that of the row before.
    const double held = volts(std::floor(time / row_period + 1e-9) * row_period);
    double u[2];
    for (int side = 0; side < 2; ++side) {
      const double raw = sign[side] * held;
      u[side] = v[side] == 0.0 && std::abs(raw) <= friction[side]
                    ? 0.0
                    : raw - std::copysign(friction[side], v[side] != 0.0 ? v[side] : raw);
    }
    const double mean = 0.5 * (v[1] + v[0]);
    const double half = 0.5 * (v[1] - v[0]);
    const double a = (0.5 * (u[1] + u[0]) - truth.kV_linear * mean) / truth.kA_linear;
    const double w = (0.5 * (u[1] - u[0]) - truth.kV_angular * half) / truth.kA_angular;
    heading += step * (v[1] - v[0]) / trackwidth;
    const double next[2] = {v[0] + step * (a - w), v[1] + step * (a + w)};
    for (int side = 0; side < 2; ++side) {
      way[side] += 0.5 * step * (v[side] + next[side]);
      v[side] = next[side] * v[side] < 0.0 ? 0.0 : next[side];
    }
  }
  const auto at = [&](const std::vector<double>& values, double time) {
    const double place = std::clamp(time / step, 0.0, static_cast<double>(values.size() - 1));
    const auto index = std::min(static_cast<std::size_t>(place), values.size() - 2);
    return values[index] +
           (place - static_cast<double>(index)) * (values[index + 1] - values[index]);
  };
  const double phase = random.uniform() * session.sensor_refresh;
  DriveRun run;
  run.kind = kind;
  flyball::identification::DriveSide* sides[2] = {&run.left, &run.right};
  double shown[2] = {-1.0, -1.0};
  double position[2] = {0.0, 0.0};
  double velocity[2] = {0.0, 0.0};
  for (double time = 0.0; time < duration - row_period; time += row_period) {
    run.time.push_back(time);
    for (int side = 0; side < 2; ++side) {
      const double offset =
          phase + (session.staggered && side == 1 ? 0.5 * session.sensor_refresh : 0.0);
      const double latest =
          std::floor((time - offset) / session.sensor_refresh + 1e-9) * session.sensor_refresh +
          offset;
      if (run.time.size() == 1 || latest > shown[side] + 1e-9) {
        shown[side] = latest;
        const double seen = latest - session.sensor_delay;
        position[side] = std::floor(at(ways[side], seen) / session.resolution) * session.resolution;
        velocity[side] = (at(ways[side], seen) - at(ways[side], seen - session.velocity_window)) /
                             session.velocity_window +
                         session.velocity_noise * random.normal();
      }
      sides[side]->position.push_back(position[side]);
      sides[side]->velocity.push_back(velocity[side]);
      sides[side]->voltage.push_back(sign[side] * volts(time) +
                                     session.voltage_noise * random.normal());
    }
    if (session.gyro) {
      run.heading.push_back(at(headings, time - 0.015) + 2e-4 * random.normal());
      run.heading_rate.push_back((at(headings, time - 0.01) - at(headings, time - 0.03)) / 0.02);
    }
  }
  return run;
}

/// The four tests straight on, then the four of rotations.
inline DriveRecording record(const Session& session) {
  flyball::Random random(session.seed);
  DriveRecording recording;
  constexpr TestKind kinds[] = {TestKind::quasistatic_forward, TestKind::quasistatic_reverse,
                                TestKind::dynamic_forward, TestKind::dynamic_reverse};
  for (const bool turning : {false, true}) {
    for (const TestKind kind : kinds) {
      const double sign = flyball::identification::is_forward(kind) ? 1.0 : -1.0;
      flyball::Random own = random.split();
      if (turning ? session.turning : session.straight) {
        recording.runs.push_back(
            drive(session, kind, turning ? -sign : sign, sign, std::move(own)));
      }
    }
  }
  return recording;
}

}  // namespace drives
