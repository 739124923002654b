#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <flyball/study/identify.hpp>

#include "core/diagnose.hpp"

// What a log says of a mechanism, held against what the project file says of it.
namespace flyball::study {

namespace {

using mechanisms::MechanismKind;

/// A factor between what was logged and what was said, and what would explain it.
struct Cause {
  double factor;  ///< Measured kV over the project's.
  std::string text;
};

constexpr double apart = 1.25;   ///< kV is of the motor's data sheet and of no friction.
constexpr double alike = 1.1;    ///< Within this of a factor, the factor explains it.
constexpr double far_off = 2.0;  ///< kA and kG hang on masses that are estimated.

bool differs(double ratio, double by) {
  return std::abs(std::log(ratio)) > std::log(by);
}

std::string shown(double value) {
  return format_number(value, 3);
}

std::string cause_of(double ratio, const PlantDescription& said) {
  constexpr double turn = 2.0 * std::numbers::pi;
  const double G = said.gearing;
  const bool straight = said.unit == "m";
  const std::string_view logged = controls_velocity(said.kind) ? "velocities"
                                  : straight                   ? "distances"
                                                               : "angles";
  std::vector<Cause> causes;
  if (straight) {
    causes = {{0.5,
               "drum_radius is half of what it should be, or a second stage moves the "
               "carriage twice as far as the belt"},
              {2.0, "drum_radius holds the drum's diameter"},
              {1.0 / 39.37, "the log's distances are inches taken for metres"},
              {0.3048, "the log's distances are feet taken for metres"}};
    if (said.drum_radius > 0.0) {
      causes.push_back({turn * said.drum_radius, "the log's distances are turns of the drum"});
    }
  } else {
    causes = {{turn, fmt::format("the log's {} are rotations taken for radians", logged)},
              {1.0 / turn, fmt::format("the log's {} are radians taken for rotations", logged)},
              {std::numbers::pi / 180.0,
               fmt::format("the log's {} are degrees taken for radians", logged)}};
  }
  if (G != 1.0 && G > 0.0) {
    causes.push_back({1.0 / G, fmt::format("the log's {} are the motor's, before the gearing of {}",
                                           logged, shown(G))});
    causes.push_back({1.0 / (G * G), fmt::format("the gearing of {} is upside down: it is motor "
                                                 "turns per output turn",
                                                 shown(G))});
  }
  const Cause* best = nullptr;
  for (const Cause& cause : causes) {
    if (cause.factor > 0.0 && std::isfinite(cause.factor) &&
        !differs(ratio / cause.factor, alike) &&
        (best == nullptr ||
         std::abs(std::log(ratio / cause.factor)) < std::abs(std::log(ratio / best->factor)))) {
      best = &cause;
    }
  }
  const std::string geared =
      fmt::format("the gearing is {} and not {}", shown(G * ratio), shown(G));
  return best != nullptr ? fmt::format("{}; or {}", best->text, geared)
                         : fmt::format("{}, or the motor is another", geared);
}

}  // namespace

std::vector<Diagnostic> contradictions(const identification::FeedforwardFit& fit,
                                       const PlantDescription& said) {
  std::vector<Diagnostic> found;
  const mechanisms::FeedforwardGains& gains = said.gains;
  if (!(gains.kV > 0.0) || !fit.kV.determined || said.kind != fit.mechanism) {
    return found;
  }
  const std::string_view by = said.motor ? "by motor and gearing" : "by its gains";
  const auto tell = [&](std::string_view name, double measured, double project,
                        std::string_view unit, std::string_view source, const std::string& cause) {
    warn(
        found, "project_contradicts_log",
        "the log says {0} = {1} {3}, the project file {2} {3} {4}, a ratio of {5}: likely {6}. The "
        "log's is used",
        name, shown(measured), shown(project), unit, source, shown(measured / project), cause);
  };
  const double ratio = fit.kV.value / gains.kV;
  if (differs(ratio, apart)) {
    tell("kV", fit.kV.value, gains.kV, "V·s/" + said.unit, by,
         said.motor ? cause_of(ratio, said) : "another mechanism, gearing or unit");
    return found;  // the others follow from the same cause
  }
  const std::string_view weighed = said.motor ? "by motor, gearing and mass" : "by its gains";
  if (said.kA_determined && gains.kA > 0.0 && fit.kA.determined && fit.kA.value > 0.0 &&
      differs(fit.kA.value / gains.kA, far_off)) {
    tell("kA", fit.kA.value, gains.kA, "V·s²/" + said.unit, weighed,
         fit.kA.value > gains.kA
             ? "more mass or inertia moves than the file says, that of rotor and gears included"
             : "less mass or inertia moves than the file says");
  }
  if (fit.kG && fit.kG->determined && gains.kG > 0.0 && fit.kG->value > 0.0 &&
      differs(fit.kG->value / gains.kG, far_off)) {
    tell("kG", fit.kG->value, gains.kG, "V", weighed,
         fit.kG->value < gains.kG ? "a spring or a counterweight carries part of the mass"
                                  : "the mass, or its distance from the pivot, is larger");
  }
  return found;
}

}  // namespace flyball::study
