#pragma once

#include <string>
#include <vector>

#include <flyball/core/animation.hpp>
#include <flyball/study/design.hpp>

#include "study/answer/drawing.hpp"

namespace flyball::study {

/// What of a mechanism its drawing shows.
struct DrawnMechanism {
  mechanisms::MechanismKind kind{};
  std::string name{};
  std::string unit = "rad";    ///< Of its position.
  double angle_offset = 0.0;   ///< rad, of an arm: true angle from horizontal less the measured.
  double wheel_radius = 0.05;  ///< m, of a swerve drive's wheel.
  std::string section{};       ///< Where it stands.
  std::string clock{};         ///< Of the plots that it moves with.
};

/// Of a known plant; a wheel of unknown size is drawn as one of two inches.
[[nodiscard]] DrawnMechanism drawn(const PlantDescription& plant, std::string section,
                                   std::string clock);

/// The mechanism as it moves in a simulation: carriage, arm, pointer or wheel, dashed where the
/// reference is. None of a series without "position" and "velocity" or with fewer than two rows.
/// @param series  Columns as `MechanismResponse`; without those of a reference it is left out.
[[nodiscard]] std::vector<Animation> mechanism_animation(const DrawnMechanism& mechanism,
                                                         const TimeSeries& series);

}  // namespace flyball::study
