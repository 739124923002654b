#pragma once

#include <array>

#include <flyball/study/drive_section.hpp>

#include "study/field.hpp"

/// The keys of [drive] and [disturbance].
namespace flyball::study {

struct Project;
class TomlDocument;

/// What in [drive] cannot be, with its place: names and texts that mean nothing, parts that do not
/// go together, sizes that no drivetrain has.
void check_drive(TomlDocument& document, const Project& project);
/// "0.27 m, 0.27 m" as quantities. @param dimensions  Of each, the last ones optional.
/// @errors ArgumentError::malformed; those of `parse_quantity`.
[[nodiscard]] Expected<std::vector<double>> quantities_of(
    const std::string& text, std::initializer_list<Dimension> dimensions, std::size_t least,
    const std::string& name);
/// Whether a number of a drivetrain is one that a drivetrain can have. @param key  "trackwidth".
/// @errors ProjectError::wrong_value about drive.KEY.
[[nodiscard]] Expected<void> check_drive_size(std::string_view key, double value);

[[nodiscard]] Expected<void> check_drive_motor(const std::string& text);
/// @errors ArgumentError::unknown_name.
[[nodiscard]] Expected<void> check_drive_type(const std::string& text);
[[nodiscard]] Expected<void> check_drive_follower(const std::string& text);

inline constexpr std::array drive_fields{
    text("type", at<&DriveSection::type>(), "\"differential\"", "What moves it")
        .one_of("differential, swerve, mecanum")
        .checked(check_drive_type)
        .must()
        .no_option(),
    text("settings", at<&DriveSection::settings>(), "\"settings.json\"",
         "PathPlanner's description of the robot, beside the project file; keys here stand in "
         "place of its fields")
        .takes("FILE")
        .without("none"),
    text("motor", at<&DriveSection::motor>(), "\"NEO\"", "A motor's name, see `flyball motors`")
        .checked(check_drive_motor)
        .no_option()
        .without("needed, here or in the settings"),
    whole("motor_count", at<&DriveSection::motor_count>(), 1, 100, "2",
          "Motors of a side, of a module or of a mecanum wheel")
        .no_option()
        .without("2 of a side, else 1"),
    quantity("gearing", at<&DriveSection::gearing>(), Dimension::dimensionless, Range::positive,
             "8.45", "Motor turns per wheel turn")
        .no_option()
        .without("needed, here or in the settings"),
    quantity("wheel_radius", at<&DriveSection::wheel_radius>(), Dimension::length, Range::positive,
             "\"3 in\"", "Of the wheels")
        .no_option()
        .without("needed, here or in the settings"),
    quantity("mass", at<&DriveSection::mass>(), Dimension::mass, Range::positive, "\"54 kg\"",
             "Of the robot")
        .no_option()
        .without("needed, here or in the settings"),
    quantity("moment_of_inertia", at<&DriveSection::moment_of_inertia>(),
             Dimension::moment_of_inertia, Range::positive, "\"6 kg m^2\"",
             "Of the robot, about the vertical axis")
        .no_option()
        .without("needed, here or in the settings"),
    quantity("trackwidth", at<&DriveSection::trackwidth>(), Dimension::length, Range::positive,
             "\"0.6 m\"", "Between left and right wheels")
        .no_option()
        .without("needed, here or in the settings"),
    quantity(
        "wheelbase", at<&DriveSection::wheelbase>(), Dimension::length, Range::positive,
        "\"0.5 m\"",
        "Between front and back wheels; of a differential drive these then scrub when it turns")
        .no_option()
        .without("one wheel a side; of the others the trackwidth"),
    names("modules", at<&DriveSection::modules>(),
          "[\"0.27 m, 0.27 m\", \"0.27 m, -0.27 m\", \"-0.27 m, 0.27 m\", \"-0.27 m, -0.27 m\"]",
          "Where swerve modules or mecanum wheels are, from the middle: front left, front right, "
          "back left, back right")
        .no_option()
        .without("by trackwidth and wheelbase"),
    quantity("grip", at<&DriveSection::grip>(), Dimension::dimensionless, Range::positive, "1.1",
             "Coefficient of friction of the wheels")
        .called("wheel-grip")
        .without("1.1"),
    quantity("wheel_inertia", at<&DriveSection::wheel_inertia>(), Dimension::moment_of_inertia,
             Range::positive, "\"0.005 kg m^2\"",
             "Of the wheels of a side (of a module, a wheel), with gears and rotors, at the wheel")
        .no_option(),
    quantity("stator_limit", at<&DriveSection::stator_limit>(), Dimension::current, Range::positive,
             "\"80 A\"", "Limit of the current in a motor's windings")
        .called("drive-stator-limit")
        .without("none"),
    quantity("supply_limit", at<&DriveSection::supply_limit>(), Dimension::current, Range::positive,
             "\"60 A\"", "Limit of the current that a motor draws from the battery")
        .called("drive-supply-limit")
        .without("none"),
    text("steer_motor", at<&DriveSection::steer_motor>(), "\"NEO\"",
         "Of a swerve module: what turns it")
        .checked(check_drive_motor)
        .no_option()
        .without("the motor that drives it"),
    quantity("steer_gearing", at<&DriveSection::steer_gearing>(), Dimension::dimensionless,
             Range::positive, "21.43", "Of a swerve module: motor turns per turn of its direction")
        .no_option(),
    quantity("steer_inertia", at<&DriveSection::steer_inertia>(), Dimension::moment_of_inertia,
             Range::positive, "\"0.02 kg m^2\"",
             "Of a swerve module, about its steering axis, with the rotor")
        .no_option(),
    quantity("bumper_length", at<&DriveSection::bumper_length>(), Dimension::length,
             Range::positive, "\"0.85 m\"", "Of the robot, for the pictures")
        .no_option()
        .without("what the settings say, else 0.3 m more than the wheels"),
    quantity("bumper_width", at<&DriveSection::bumper_width>(), Dimension::length, Range::positive,
             "\"0.85 m\"", "The same")
        .no_option()
        .without("what the settings say, else 0.3 m more than the wheels"),
    text(
        "trajectory", at<&DriveSection::trajectory>(), "\"path.wpilib.json\"",
        "A trajectory or path of WPILib (JSON), Choreo (.traj) or PathPlanner (.path, .auto), or a "
        "table (CSV), beside the project file")
        .takes("FILE")
        .without("the waypoints"),
    text("path", at<&DriveSection::path>(), "\"c1sub\"",
         "Which of its paths, where the trajectory is a project of Choreo's 2024 with several")
        .takes("NAME")
        .called("trajectory-path")
        .without("its only one"),
    names("waypoints", at<&DriveSection::waypoints>(),
          "[\"1 m, 1 m, 0 deg\", \"3 m, 2 m, 45 deg\", \"5 m, 2 m, 0 deg\"]",
          "Poses that the path goes through, each with the direction in which it does; of what "
          "moves sideways a fourth value is the way it looks there")
        .no_option()
        .without("the trajectory"),
    flag("reversed", at<&DriveSection::reversed>(), "true",
         "Whether a differential drive backs along its waypoints")
        .no_option()
        .without("false"),
    quantity("max_velocity", at<&DriveSection::max_velocity>(), Dimension::velocity,
             Range::positive, "\"3 m/s\"", "Along the waypoints")
        .called("path-velocity")
        .without("the settings', else six tenths of the wheels' free speed"),
    quantity("max_acceleration", at<&DriveSection::max_acceleration>(), Dimension::acceleration,
             Range::positive, "\"2.5 m/s^2\"", "Along the waypoints")
        .called("path-acceleration")
        .without("the settings', else 2.5 m/s²"),
    quantity("max_centripetal", at<&DriveSection::max_centripetal>(), Dimension::acceleration,
             Range::positive, "\"2 m/s^2\"", "Across the waypoints' path")
        .called("path-centripetal")
        .without("2 m/s²"),
    text("follower", at<&DriveSection::follower>(), "\"ramsete\"", "What follows the trajectory")
        .one_of("ramsete, ltv unicycle, ltv drive, holonomic, pure pursuit")
        .checked(check_drive_follower)
        .takes("NAME")
        .without("ltv unicycle; of what moves sideways holonomic"),
    quantity("b", at<&DriveSection::b>(), Dimension::dimensionless, Range::positive, "2",
             "Of Ramsete, in rad²/m²: more turns harder to the path")
        .no_option(),
    quantity("zeta", at<&DriveSection::zeta>(), Dimension::dimensionless, Range::positive, "0.7",
             "Of Ramsete: its damping, below 1")
        .no_option(),
    quantity("x_tolerance", at<&DriveSection::x_tolerance>(), Dimension::length, Range::positive,
             "\"6 cm\"", "Largest acceptable error ahead (Bryson's rule)")
        .no_option()
        .without("6.25 cm; of a holonomic follower 5 cm"),
    quantity("y_tolerance", at<&DriveSection::y_tolerance>(), Dimension::length, Range::positive,
             "\"12 cm\"", "Largest acceptable error across")
        .no_option()
        .without("12.5 cm; of a holonomic follower 5 cm"),
    quantity("heading_tolerance", at<&DriveSection::heading_tolerance>(), Dimension::angle,
             Range::positive, "\"10 deg\"", "Largest acceptable error of the heading")
        .no_option()
        .without("2.5 rad; of a holonomic follower 0.1 rad"),
    quantity("velocity_tolerance", at<&DriveSection::velocity_tolerance>(), Dimension::velocity,
             Range::positive, "\"0.95 m/s\"", "Largest acceptable error of a wheel's speed")
        .no_option()
        .without(
            "0.95 m/s; of swerve and mecanum as loose as keeps a wheel calm that loses the floor"),
    quantity("least_lookahead", at<&DriveSection::least_lookahead>(), Dimension::length,
             Range::positive, "\"0.3 m\"", "Of pure pursuit: how far it looks ahead at least")
        .no_option(),
    quantity("lookahead_time", at<&DriveSection::lookahead_time>(), Dimension::time,
             Range::not_negative, "\"0.5 s\"",
             "Of pure pursuit: how far it looks ahead, times its speed")
        .no_option()};

inline constexpr std::array disturbance_fields{
    quantity("ahead", at<&DisturbanceSection::ahead>(), Dimension::length, Range::any, "\"10 cm\"",
             "How far ahead of its reference it starts")
        .called("start-ahead"),
    quantity("left", at<&DisturbanceSection::left>(), Dimension::length, Range::any, "\"20 cm\"",
             "How far to the left of it")
        .called("start-left"),
    quantity("turned", at<&DisturbanceSection::turned>(), Dimension::angle, Range::any,
             "\"15 deg\"", "By how much it is turned to the left")
        .called("start-turned"),
    quantity("latency", at<&DisturbanceSection::latency>(), Dimension::time, Range::not_negative,
             "\"40 ms\"", "Age of the pose that the follower gets"),
    quantity("mass_factor", at<&DisturbanceSection::mass_factor>(), Dimension::dimensionless,
             Range::positive, "1.2", "True mass and inertia over those that the follower knows"),
    quantity("strength_factor", at<&DisturbanceSection::strength_factor>(),
             Dimension::dimensionless, Range::positive, "0.8",
             "True torque of the motors over that which the follower knows"),
    quantity("left_factor", at<&DisturbanceSection::left_factor>(), Dimension::dimensionless,
             Range::positive, "0.9", "The same of the left wheels alone: the robot pulls aside"),
    quantity("push", at<&DisturbanceSection::push>(), Dimension::force, Range::not_negative,
             "\"80 N\"", "A force on the robot's middle"),
    quantity("push_direction", at<&DisturbanceSection::push_direction>(), Dimension::angle,
             Range::any, "\"90 deg\"", "Its direction in the field"),
    quantity("push_from", at<&DisturbanceSection::push_from>(), Dimension::time,
             Range::not_negative, "\"1 s\"", "When it begins"),
    quantity("push_for", at<&DisturbanceSection::push_for>(), Dimension::time, Range::not_negative,
             "\"0.3 s\"", "How long it lasts"),
    quantity("slip_grip", at<&DisturbanceSection::slip_grip>(), Dimension::dimensionless,
             Range::positive, "0.3", "Share of the wheels' grip that is left on a smooth spot"),
    quantity("slip_from", at<&DisturbanceSection::slip_from>(), Dimension::time,
             Range::not_negative, "\"1 s\"", "When it comes to that spot"),
    quantity("slip_for", at<&DisturbanceSection::slip_for>(), Dimension::time, Range::not_negative,
             "\"0.5 s\"", "How long it is on it"),
    quantity("position_noise", at<&DisturbanceSection::position_noise>(), Dimension::length,
             Range::not_negative, "\"1 cm\"",
             "Standard deviation of each coordinate that the follower gets"),
    quantity("heading_noise", at<&DisturbanceSection::heading_noise>(), Dimension::angle,
             Range::not_negative, "\"0.5 deg\"", "The same of the heading")};

}  // namespace flyball::study
