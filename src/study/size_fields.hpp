#pragma once

#include <array>

#include <flyball/study/size_section.hpp>

#include "study/field.hpp"

/// The keys of [size].
namespace flyball::study {

struct Project;
class TomlDocument;

/// What in [size] would be without effect, or cannot be, with its place.
void check_size(TomlDocument& document, const Project& project);

inline constexpr std::array size_fields{
    quantity("start", at<&SizeSection::start>(), FieldDimension::output, Range::any, "\"0.1 m\"",
             "Where the motion begins, at rest; of what is controlled by its speed, that speed")
        .without("zero"),
    quantity("end", at<&SizeSection::end>(), FieldDimension::output, Range::any, "\"1.3 m\"",
             "Where it ends, at rest; or the speed to be reached")
        .without("the profile's goal, else a metre, 90° or three quarters of the motor's speed"),
    quantity("distance", at<&SizeSection::distance>(), Dimension::length, Range::positive,
             "\"6 m\"", "Of a swerve drive, in place of a speed: how far it goes from rest")
        .without("5 m"),
    flag("stop", at<&SizeSection::stop>(), "true", "Whether it is at rest at the end of that way")
        .without("false"),
    quantity("stator_limit", at<&SizeSection::stator_limit>(), Dimension::current, Range::positive,
             "\"60 A\"", "Limit of the current in a motor's windings")
        .without("none"),
    quantity("supply_limit", at<&SizeSection::supply_limit>(), Dimension::current, Range::positive,
             "\"40 A\"", "Limit of the current that a motor draws from the battery")
        .without("none"),
    quantity("efficiency", at<&SizeSection::efficiency>(), Dimension::dimensionless,
             Range::positive, "0.9", "Of the gears"),
    quantity("friction", at<&SizeSection::friction>(), FieldDimension::effort, Range::not_negative,
             "\"10 N\"", "Against the motion at the output, a force or a torque")
        .without("what gains.kS tells; the motors' own, by their free current, comes on top"),
    quantity("rotor_inertia", at<&SizeSection::rotor_inertia>(), Dimension::moment_of_inertia,
             Range::not_negative, "\"3e-4 kg m^2\"", "Of one motor's rotor and pinion")
        .takes("INERTIA"),
    quantity("grip", at<&SizeSection::grip>(), Dimension::dimensionless, Range::positive, "1.1",
             "Of a swerve drive: the coefficient of friction of its wheels")
        .without("they do not slip"),
    quantity("brownout_voltage", at<&SizeSection::brownout_voltage>(), Dimension::voltage,
             Range::not_negative, "\"6.75 V\"",
             "Of the battery, below which the robot is switched off"),
    quantity("other_current", at<&SizeSection::other_current>(), Dimension::current,
             Range::not_negative, "\"5 A\"", "What the rest of the robot draws"),
    quantity("winding_heat_capacity", at<&SizeSection::winding_heat_capacity>(),
             Dimension::dimensionless, Range::positive, "45", "Of one motor's windings, in J/K")
        .called("heat-capacity")
        .without("not known: temperatures are left out"),
    quantity("winding_thermal_resistance", at<&SizeSection::winding_thermal_resistance>(),
             Dimension::dimensionless, Range::positive, "2",
             "From one motor's windings to the air, in K/W")
        .called("thermal-resistance")
        .without("infinite: nothing cools them"),
    text("locked_rotor", at<&SizeSection::locked_rotor>(), "\"cim-locked-rotor.csv\"",
         "A dynamometer's file of the motor, locked, which tells the heat capacity; beside the "
         "project file")
        .takes("FILE")
        .without("none"),
    quantity("ambient_temperature", at<&SizeSection::ambient_temperature>(),
             Dimension::dimensionless, Range::any, "25",
             "Of the air and of the windings at the start, in °C"),
    quantity("temperature_limit", at<&SizeSection::temperature_limit>(), Dimension::dimensionless,
             Range::any, "125", "Of the windings, in °C"),
    quantity("gearing_low", at<&SizeSection::gearing_low>(), Dimension::dimensionless,
             Range::positive, "3", "Lowest gearing that is looked at")
        .without("0.05; drawn is a fifth of the best"),
    quantity("gearing_high", at<&SizeSection::gearing_high>(), Dimension::dimensionless,
             Range::positive, "60", "Highest gearing that is looked at")
        .without("5000; drawn is five times the best"),
    flag("compare_motors", at<&SizeSection::compare_motors>(), "false",
         "Whether the motors of the table are tried in the place of this one"),
    quantity("longest", at<&SizeSection::longest>(), Dimension::time, Range::positive, "\"30 s\"",
             "Time after which a motion is given up")};

}  // namespace flyball::study
