#include <algorithm>
#include <array>

#include <fmt/format.h>

#include <flyball/mechanisms/arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/mechanisms/lift/cascade_elevator.hpp>
#include <flyball/mechanisms/swerve_drive.hpp>
#include <flyball/mechanisms/turret.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
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

Expected<mechanisms::CascadeElevator> lift_of(const MechanismParts& parts,
                                              const mechanisms::DcMotor& motor, double gearing) {
  mechanisms::CascadeElevatorParameters of{
      .shaft = {.motor = motor, .gearing = gearing},
      .drum_radius = *parts.drum_radius,
      .carriage = *parts.mass,
      .counterbalance = {.force = parts.counterbalance.value_or(Force(0.0))}};
  FLYBALL_CHECK(check_positive(parts.mass->si(), "elevator", "mass", "kg"));
  for (const std::string& text : parts.stages) {
    FLYBALL_TRY(const double kilograms, parse_quantity(text, mass, "stages"));
    if (!(kilograms >= 0.0)) {
      return refusal(ArgumentError::out_of_range, {}, "stages")
          .got(fmt::format("\"{}\"", text))
          .expected("masses, none of them negative");
    }
    of.stages.emplace_back(kilograms);
  }
  return mechanisms::cascade_elevator(of);
}

Expected<void> make_elevator(const MechanismParts& parts, PlantDescription& plant) {
  if (parts.stages.empty() && !parts.counterbalance) {
    return take(plant, mechanisms::elevator(
                           mechanisms::ElevatorParameters{.motor = *plant.motor,
                                                          .gearing = *parts.gearing,
                                                          .mass = *parts.mass,
                                                          .drum_radius = *parts.drum_radius}));
  }
  FLYBALL_TRY(const mechanisms::CascadeElevator lift, lift_of(parts, *plant.motor, *parts.gearing));
  plant.drum_radius = lift.rise();
  return take(plant, lift.elevator());
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
constexpr std::array<std::string_view, 2> elevator_may{"stages", "counterbalance"};
constexpr std::array<std::string_view, 5> arm_needs{"motor", "gearing", "moment_of_inertia", "mass",
                                                    "center_of_mass"};

constexpr std::array part_rows{
    MechanismRow{
        MechanismKind::flywheel,
        {flywheel_states, angular_velocity, angular_acceleration, angular_acceleration, torque},
        wheel_needs,
        {},
        &make_wheel<MechanismKind::flywheel>},
    MechanismRow{MechanismKind::elevator,
                 {elevator_states, length, velocity, acceleration, force},
                 elevator_needs,
                 elevator_may,
                 &make_elevator},
    MechanismRow{MechanismKind::arm,
                 {arm_states, angle, angular_velocity, angular_acceleration, torque},
                 arm_needs,
                 {},
                 &make_arm},
    MechanismRow{
        MechanismKind::roller,
        {flywheel_states, angular_velocity, angular_acceleration, angular_acceleration, torque},
        wheel_needs,
        {},
        &make_wheel<MechanismKind::roller>},
    MechanismRow{MechanismKind::turret,
                 {arm_states, angle, angular_velocity, angular_acceleration, torque},
                 wheel_needs,
                 {},
                 &make_turret<MechanismKind::turret>},
    MechanismRow{MechanismKind::swerve_steer,
                 {arm_states, angle, angular_velocity, angular_acceleration, torque},
                 wheel_needs,
                 {},
                 &make_turret<MechanismKind::swerve_steer>},
    MechanismRow{MechanismKind::swerve_drive,
                 {drive_states, velocity, acceleration, acceleration, force},
                 drive_needs,
                 {},
                 &make_swerve_drive}};

}  // namespace

Expected<ElevatorLift> elevator_lift(const MechanismParts& parts) {
  // Which motor is no matter: nothing of it is asked for.
  FLYBALL_TRY(const auto motor, mechanisms::motor("NEO"));
  FLYBALL_TRY(const auto lift, lift_of(parts, motor, 1.0));
  const Eigen::Vector4d& p = lift.parameters();
  return ElevatorLift{.rise = lift.rise(), .inertia = p(0), .weight = p(1) - p(2)};
}

void doubt_arm(const MechanismParts& parts, std::vector<Diagnostic>& doubts) {
  if (parts.type != MechanismKind::arm || !parts.moment_of_inertia || !parts.mass ||
      !parts.center_of_mass) {
    return;
  }
  constexpr double rounded = 0.95;  // a twentieth for what is rounded
  const double l = parts.center_of_mass->si();
  const double least = parts.mass->si() * l * l;
  const double J = parts.moment_of_inertia->si();
  if (J < rounded * least) {
    warn(doubts, "light_arm",
         "an arm of this mass and centre of mass has at least {:.4g} kg m² about its joint, and "
         "mechanism.moment_of_inertia is {:.4g} kg m²: it is lighter to move here than it can be; "
         "give it about the joint, which is that about the centre of mass and {:.4g} kg m² more",
         least, J, least);
  }
}

std::span<const MechanismRow> mechanism_rows() {
  return part_rows;
}

const MechanismRow& mechanism_row(MechanismKind kind) {
  return *std::find_if(part_rows.begin(), part_rows.end(),
                       [&](const MechanismRow& row) { return row.kind == kind; });
}

}  // namespace flyball::study
