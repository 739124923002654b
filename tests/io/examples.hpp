#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include <flyball/io/log.hpp>
#include <flyball/io/sysid_json.hpp>

/// Small logs that the tests share, and how to look into results.

inline bool has_diagnostic(const std::vector<flyball::Diagnostic>& diagnostics,
                           std::string_view code) {
  return std::any_of(diagnostics.begin(), diagnostics.end(),
                     [&](const flyball::Diagnostic& d) { return d.code == code; });
}

inline bool contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

/// An elevator's four tests of `rows` rows each, or a drive's.
inline flyball::SysIdJson example_sysid(std::size_t rows, bool drive = false) {
  flyball::SysIdJson log;
  log.layout = drive ? flyball::SysIdJson::Layout::drive : flyball::SysIdJson::Layout::mechanism;
  log.test = drive ? "Drivetrain" : "Elevator";
  log.units = "Meters";
  log.units_per_rotation = 0.1144;
  double start = 1.0;
  for (const char* name : {"slow-forward", "slow-backward", "fast-forward", "fast-backward"}) {
    flyball::SysIdJson::Run run;
    run.name = name;
    for (std::size_t i = 0; i < rows; ++i) {
      const double t = 0.005 * static_cast<double>(i);
      run.time.push_back(start + t);
      run.voltage.push_back(0.25 * t);
      run.position.push_back(std::sin(t) / 3.0);
      run.velocity.push_back(std::cos(t) / 3.0);
      if (drive) {
        run.right_voltage.push_back(0.26 * t);
        run.right_position.push_back(std::sin(t) / 7.0);
        run.right_velocity.push_back(std::cos(t) / 7.0);
        run.angle.push_back(0.1 * t);
        run.angle_rate.push_back(0.1);
      }
    }
    log.runs.push_back(run);
    start += 10.0;
  }
  return log;
}

/// A SysIdRoutine log: a state text and three channels with units.
inline flyball::Log example_log(std::size_t rows) {
  flyball::Log log;
  log.signals = {{"voltage-arm-Arm", "Volt", {}, {}},
                 {"position-arm-Arm", "Rotation", {}, {}},
                 {"velocity-arm-Arm", "Rotation per Second", {}, {}}};
  flyball::TextSignal state{"sysid-test-state-Arm", {}, {}};
  for (std::size_t i = 0; i < rows; ++i) {
    const double t = 1.0 + 0.02 * static_cast<double>(i);
    for (std::size_t c = 0; c < 3; ++c) {
      log.signals[c].time.push_back(t + 0.001 * static_cast<double>(c));
      log.signals[c].value.push_back(std::sin(t + static_cast<double>(c)) / 3.0);
    }
    state.time.push_back(t + 0.004);
    state.value.emplace_back(i % 2 == 0 ? "quasistatic-forward" : "none");
  }
  log.texts.push_back(state);
  return log;
}
