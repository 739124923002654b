#include <algorithm>
#include <array>

#include <flyball/mechanisms/arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>

#include "study/mechanism_parts.hpp"

namespace flyball::study {

namespace {

using mechanisms::MechanismKind;
using enum Dimension;

template <class Mechanism>
Expected<void> take(PlantDescription& plant, const Expected<Mechanism>& mechanism) {
  return mechanism.map([&](const Mechanism& made) {
    plant.gains = made.gains;
    plant.nominal_voltage = made.nominal_voltage;
  });
}

Expected<void> make_flywheel(const MechanismParts& parts, PlantDescription& plant) {
  return take(plant, mechanisms::flywheel(mechanisms::FlywheelParameters{
                         .motor = *plant.motor,
                         .gearing = *parts.gearing,
                         .moment_of_inertia = *parts.moment_of_inertia}));
}

Expected<void> make_elevator(const MechanismParts& parts, PlantDescription& plant) {
  return take(plant, mechanisms::elevator(
                         mechanisms::ElevatorParameters{.motor = *plant.motor,
                                                        .gearing = *parts.gearing,
                                                        .mass = *parts.mass,
                                                        .drum_radius = *parts.drum_radius}));
}

Expected<void> make_arm(const MechanismParts& parts, PlantDescription& plant) {
  return take(plant, mechanisms::arm(
                         mechanisms::ArmParameters{.motor = *plant.motor,
                                                   .gearing = *parts.gearing,
                                                   .moment_of_inertia = *parts.moment_of_inertia,
                                                   .mass = *parts.mass,
                                                   .center_of_mass = *parts.center_of_mass}));
}

constexpr std::array flywheel_states{angular_velocity};
constexpr std::array elevator_states{length, velocity};
constexpr std::array arm_states{angle, angular_velocity};

constexpr std::array<std::string_view, 3> flywheel_needs{"motor", "gearing", "moment_of_inertia"};
constexpr std::array<std::string_view, 4> elevator_needs{"motor", "gearing", "mass", "drum_radius"};
constexpr std::array<std::string_view, 5> arm_needs{"motor", "gearing", "moment_of_inertia", "mass",
                                                    "center_of_mass"};

constexpr std::array rows{
    MechanismRow{MechanismKind::flywheel,
                 {flywheel_states, angular_velocity, angular_acceleration, angular_acceleration},
                 flywheel_needs,
                 &make_flywheel},
    MechanismRow{MechanismKind::elevator,
                 {elevator_states, length, velocity, acceleration},
                 elevator_needs,
                 &make_elevator},
    MechanismRow{MechanismKind::arm,
                 {arm_states, angle, angular_velocity, angular_acceleration},
                 arm_needs,
                 &make_arm}};

}  // namespace

std::span<const MechanismRow> mechanism_rows() {
  return rows;
}

const MechanismRow& mechanism_row(MechanismKind kind) {
  return *std::find_if(rows.begin(), rows.end(),
                       [&](const MechanismRow& row) { return row.kind == kind; });
}

}  // namespace flyball::study
