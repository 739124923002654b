#include <algorithm>
#include <array>

#include <flyball/mechanisms/arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/mechanisms/swerve_drive.hpp>
#include <flyball/mechanisms/turret.hpp>

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

template <MechanismKind Kind>
Expected<void> make_wheel(const MechanismParts& parts, PlantDescription& plant) {
  const mechanisms::FlywheelParameters of{.motor = *plant.motor,
                                          .gearing = *parts.gearing,
                                          .moment_of_inertia = *parts.moment_of_inertia};
  return take(plant,
              Kind == MechanismKind::roller ? mechanisms::roller(of) : mechanisms::flywheel(of));
}

template <MechanismKind Kind>
Expected<void> make_turret(const MechanismParts& parts, PlantDescription& plant) {
  const mechanisms::TurretParameters of{.motor = *plant.motor,
                                        .gearing = *parts.gearing,
                                        .moment_of_inertia = *parts.moment_of_inertia};
  return take(
      plant, Kind == MechanismKind::turret ? mechanisms::turret(of) : mechanisms::swerve_steer(of));
}

Expected<void> make_swerve_drive(const MechanismParts& parts, PlantDescription& plant) {
  return take(plant, mechanisms::swerve_drive(
                         mechanisms::SwerveDriveParameters{.motor = *plant.motor,
                                                           .gearing = *parts.gearing,
                                                           .mass = *parts.mass,
                                                           .wheel_radius = *parts.wheel_radius}));
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
constexpr std::array drive_states{velocity};

constexpr std::array<std::string_view, 3> wheel_needs{"motor", "gearing", "moment_of_inertia"};
constexpr std::array<std::string_view, 4> drive_needs{"motor", "gearing", "mass", "wheel_radius"};
constexpr std::array<std::string_view, 4> elevator_needs{"motor", "gearing", "mass", "drum_radius"};
constexpr std::array<std::string_view, 5> arm_needs{"motor", "gearing", "moment_of_inertia", "mass",
                                                    "center_of_mass"};

constexpr std::array rows{
    MechanismRow{
        MechanismKind::flywheel,
        {flywheel_states, angular_velocity, angular_acceleration, angular_acceleration, torque},
        wheel_needs,
        &make_wheel<MechanismKind::flywheel>},
    MechanismRow{MechanismKind::elevator,
                 {elevator_states, length, velocity, acceleration, force},
                 elevator_needs,
                 &make_elevator},
    MechanismRow{MechanismKind::arm,
                 {arm_states, angle, angular_velocity, angular_acceleration, torque},
                 arm_needs,
                 &make_arm},
    MechanismRow{
        MechanismKind::roller,
        {flywheel_states, angular_velocity, angular_acceleration, angular_acceleration, torque},
        wheel_needs,
        &make_wheel<MechanismKind::roller>},
    MechanismRow{MechanismKind::turret,
                 {arm_states, angle, angular_velocity, angular_acceleration, torque},
                 wheel_needs,
                 &make_turret<MechanismKind::turret>},
    MechanismRow{MechanismKind::swerve_steer,
                 {arm_states, angle, angular_velocity, angular_acceleration, torque},
                 wheel_needs,
                 &make_turret<MechanismKind::swerve_steer>},
    MechanismRow{MechanismKind::swerve_drive,
                 {drive_states, velocity, acceleration, acceleration, force},
                 drive_needs,
                 &make_swerve_drive}};

}  // namespace

std::span<const MechanismRow> mechanism_rows() {
  return rows;
}

const MechanismRow& mechanism_row(MechanismKind kind) {
  return *std::find_if(rows.begin(), rows.end(),
                       [&](const MechanismRow& row) { return row.kind == kind; });
}

}  // namespace flyball::study
