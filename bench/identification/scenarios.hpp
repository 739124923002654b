#pragma once

#include <array>
#include <cstdint>
#include <numbers>
#include <string_view>

#include <flyball/core/random.hpp>
#include <flyball/simulation/characterization.hpp>

/// The six mechanisms that the identification is measured on.
namespace scenarios {

using flyball::CharacterizationOptions;
using flyball::mechanisms::MechanismKind;

struct Truth {
  std::string_view name;
  MechanismKind kind;
  double kS, kV, kA, kG, offset;
};

inline constexpr std::array<Truth, 6> mechanisms{{
    {"flywheel 1", MechanismKind::flywheel, 0.2, 0.02, 0.004, 0.0, 0.0},
    {"flywheel 2", MechanismKind::flywheel, 0.5, 0.12, 0.05, 0.0, 0.0},
    {"elevator 1", MechanismKind::elevator, 0.15, 4.0, 0.3, 0.6, 0.0},
    {"elevator 2", MechanismKind::elevator, 0.4, 9.4, 0.8, 0.36, 0.0},
    {"arm 1", MechanismKind::arm, 0.1, 1.2, 0.15, 0.65, 0.2},
    {"arm 2", MechanismKind::arm, 0.25, 0.9, 0.06, 0.5, -0.4},
}};

/// A session of that mechanism; whatever the description leaves open varies with the seed.
inline CharacterizationOptions session(const Truth& truth, std::uint64_t seed) {
  flyball::Random random(seed * 7919 + 17);
  CharacterizationOptions options;
  options.mechanism = truth.kind;
  options.kS = truth.kS;
  options.kV = truth.kV;
  options.kA = truth.kA;
  options.kG = truth.kG;
  options.angle_offset = truth.offset;
  options.resolution =
      truth.kind == MechanismKind::elevator ? 1e-4 : 2.0 * std::numbers::pi / 4096.0;
  if (truth.kind == MechanismKind::elevator) {
    const double travel = random.uniform(0.9, 1.5);
    options.travel_low = 0.0;
    options.travel_high = travel;
    options.travel_margin = random.uniform(0.02, 0.1) * travel;
  } else if (truth.kind == MechanismKind::arm) {
    options.travel_low = -random.uniform(0.8, 1.3);
    options.travel_high = random.uniform(0.8, 1.5);
    options.travel_margin = random.uniform(0.02, 0.1);
  }
  options.ramp_limit = truth.kind == MechanismKind::flywheel ? random.uniform(3.0, 6.0) : 10.0;
  options.step_duration = random.uniform(1.5, 3.0);
  options.rest_before = 0.005 * static_cast<double>(1 + static_cast<int>(random.uniform() * 20.0));
  options.coast_after = random.uniform(0.0, 0.2);
  options.noise_per_row = random.uniform() < 0.5;
  options.sensor_delay = random.uniform(0.0, 0.02);
  options.seed = seed;
  return options;
}

/// What a family of sessions adds to the clean one, and what the identification should say of it.
struct Family {
  std::string_view name;
  /// The codes of diagnoses, or what `term_in_doubt` names, one of which is right; empty if the
  /// model can be right without.
  std::array<std::string_view, 3> diagnoses;
  void (*spoil)(const Truth& truth, flyball::Random& random, CharacterizationOptions& options);
  /// Whether that kind of mechanism can have it.
  bool (*has)(MechanismKind kind) = [](MechanismKind) { return true; };
};

inline constexpr auto not_a_flywheel = [](MechanismKind kind) {
  return kind != MechanismKind::flywheel;
};

/// Half of the travel, or a turn of what turns on.
inline double reach(const CharacterizationOptions& options) {
  return options.mechanism == MechanismKind::flywheel
             ? 2.0 * std::numbers::pi
             : 0.5 * (options.travel_high - options.travel_low);
}

inline constexpr std::array<Family, 13> families{{
    {"clean", {}, [](const Truth&, flyball::Random&, CharacterizationOptions&) {}},
    {"skew",
     {},
     [](const Truth&, flyball::Random& random, CharacterizationOptions& options) {
       options.defects.position_delay = random.uniform(0.0, 0.04);
       options.defects.velocity_delay = random.uniform(0.0, 0.04);
     }},
    {"filter",
     {},
     [](const Truth&, flyball::Random& random, CharacterizationOptions& options) {
       options.velocity_window = random.uniform(0.0, 0.1);
     }},
    {"friction",
     {},
     [](const Truth&, flyball::Random&, CharacterizationOptions& options) {
       options.friction_variation = 0.4;
       options.breakaway = 1.3;
     }},
    {"coarse rows",
     {},
     [](const Truth& truth, flyball::Random& random, CharacterizationOptions& options) {
       options.row_period = 0.02;
       options.velocity_noise = random.uniform(0.01, 0.03) * (6.0 - truth.kS) / truth.kV;
     }},
    {"stale first row",
     {},
     [](const Truth&, flyball::Random&, CharacterizationOptions& options) {
       options.defects.stale_first_row = true;
     },
     not_a_flywheel},
    {"spring",
     {"spring", "a force that grows along the travel"},
     [](const Truth&, flyball::Random& random, CharacterizationOptions& options) {
       options.defects.spring = random.uniform(0.2, 0.5) / reach(options);
     },
     not_a_flywheel},
    {"drag",
     {"drag", "drag that grows"},
     [](const Truth& truth, flyball::Random& random, CharacterizationOptions& options) {
       const double top = (options.step_voltage - truth.kS) / truth.kV;
       options.defects.drag = random.uniform(0.3, 1.0) / (top * top);
     }},
    {"asymmetric friction",
     {"asymmetric_friction", "friction that differs by direction"},
     [](const Truth&, flyball::Random& random, CharacterizationOptions& options) {
       options.defects.friction_asymmetry = random.uniform(0.3, 0.5);
     },
     // An elevator's is gravity: no log of it moving tells them apart.
     [](MechanismKind kind) { return kind != MechanismKind::elevator; }},
    {"current limit",
     {"current_limit", "a current limit"},
     [](const Truth& truth, flyball::Random& random, CharacterizationOptions& options) {
       options.defects.headroom =
           random.uniform(0.4, 0.7) * options.step_voltage + truth.kG + truth.kS;
     }},
    {"sag",
     {"sag", "current_limit", "battery that sags"},
     [](const Truth&, flyball::Random& random, CharacterizationOptions& options) {
       options.defects.sag = random.uniform(0.1, 0.3);
     }},
    {"backlash",
     {"elastic", "backlash", "there is backlash"},
     [](const Truth&, flyball::Random& random, CharacterizationOptions& options) {
       options.defects.backlash =
           random.uniform(0.01, 0.03) * (options.mechanism == MechanismKind::elevator ? 0.1 : 1.0);
     }},
    {"slip",
     {"slip", "position_jumps"},
     [](const Truth&, flyball::Random& random, CharacterizationOptions& options) {
       options.defects.slip = random.uniform(0.05, 0.1) * reach(options);
     }},
}};

}  // namespace scenarios
