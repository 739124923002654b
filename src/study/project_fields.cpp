// The project file, row by row.
#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/study/project.hpp>

#include "core/try.hpp"
#include "study/drive_fields.hpp"
#include "study/field.hpp"
#include "study/mechanism_parts.hpp"
#include "study/model_fields.hpp"
#include "study/optimize_fields.hpp"
#include "study/size_fields.hpp"

namespace flyball::study {

namespace {

using enum Dimension;
using enum Range;
using Of = FieldDimension;
using recording::LogSelection;
using Subject::loops;
using Subject::mechanism;
using Subject::model;
using Subject::motors;

Expected<void> check_kind(const std::string& text) {
  return mechanisms::parse_mechanism_kind(text).map([](auto) {});
}

Expected<void> check_log_kind(const std::string& text) {
  return recording::means_drivetrain(text) ? Expected<void>() : check_kind(text);
}

/// A kind of mechanism, or a drivetrain.
constexpr FieldAccess log_kind{[](const void* section) {
                                 const auto& log = *static_cast<const LogSelection*>(section);
                                 return log.drivetrain ? FieldValue(std::string("drivetrain"))
                                        : log.mechanism
                                            ? FieldValue(std::string(to_string(*log.mechanism)))
                                            : FieldValue();
                               },
                               [](void* section, const FieldValue& value) {
                                 auto& log = *static_cast<LogSelection*>(section);
                                 const auto& text = std::get<std::string>(value);
                                 log.drivetrain = recording::means_drivetrain(text);
                                 log.mechanism.reset();
                                 if (!log.drivetrain) {
                                   log.mechanism = *mechanisms::parse_mechanism_kind(text);
                                 }
                               }};

Expected<void> check_position_unit(const std::string& text) {
  const auto unit = parse_unit(text);
  const bool fits = unit && (unit->dimension == length || unit->dimension == angle);
  return fits ? Expected<void>()
              : refusal(ArgumentError::wrong_unit, {}, "the position's unit")
                    .got(unit ? fmt::format("\"{}\", a {}", text, to_string(unit->dimension))
                              : fmt::format("\"{}\", which is not known", text))
                    .expected("of a length or an angle, such as \"m\" or \"rotations\"");
}

Expected<void> check_velocity_unit(const std::string& text) {
  const auto unit = parse_unit(text);
  const bool fits = unit && (unit->dimension == velocity || unit->dimension == angular_velocity);
  return fits ? Expected<void>()
              : refusal(ArgumentError::wrong_unit, {}, "the velocity's unit")
                    .got(unit ? fmt::format("\"{}\", a {}", text, to_string(unit->dimension))
                              : fmt::format("\"{}\", which is not known", text))
                    .expected("of a velocity, such as \"m/s\" or \"RPM\"");
}

Expected<void> check_motor(const std::string& text) {
  return mechanisms::motor(text).map([](const auto&) {});
}

constexpr std::string_view kind_words =
    "elevator, arm, flywheel, roller, turret, swerve steer, swerve drive";

constexpr std::array mechanism_fields{
    text("type", at<&MechanismParts::type>(), "\"elevator\"", "What it is")
        .one_of(kind_words)
        .checked(check_kind)
        .must()
        .no_option(),
    text("motor", at<&MechanismParts::motor>(), "\"NEO\"",
         "A motor's name, see `flyball motors`, or a table of datasheet numbers")
        .checked(check_motor)
        .takes("NAME"),
    whole("motor_count", at<&MechanismParts::motor_count>(), 1, 100, "2",
          "Identical motors in one gearbox")
        .without("1"),
    quantity("gearing", at<&MechanismParts::gearing>(), dimensionless, positive, "10.0",
             "Motor turns per output turn, > 1 is a reduction"),
    quantity("mass", at<&MechanismParts::mass>(), mass, not_negative, "\"8 kg\"",
             "What is moved, and gravity pulls"),
    quantity("drum_radius", at<&MechanismParts::drum_radius>(), length, positive, "\"1 in\"",
             "Radius at which the drum moves the carriage"),
    quantity("wheel_radius", at<&MechanismParts::wheel_radius>(), length, positive, "\"2 in\"",
             "Radius of a swerve module's wheel"),
    quantity("moment_of_inertia", at<&MechanismParts::moment_of_inertia>(), moment_of_inertia,
             positive, "\"0.003 kg m^2\"", "Inertia at the output, about its axis")
        .takes("INERTIA"),
    quantity("center_of_mass", at<&MechanismParts::center_of_mass>(), length, not_negative,
             "\"0.4 m\"", "Distance of the centre of mass from the joint"),
    names("stages", at<&MechanismParts::stages>(), "[\"3 kg\", \"2 kg\"]",
          "Of an elevator in cascade: the masses of the stages that move below the carriage, the "
          "one that the drum pulls first; of n moving parts the carriage goes n times as far as "
          "the drum's rope")
        .no_option()
        .without("none: the drum pulls the carriage"),
    quantity("counterbalance", at<&MechanismParts::counterbalance>(), force, not_negative,
             "\"60 N\"", "Of an elevator: a constant force that lifts the carriage, as a spring's")
        .no_option()
        .without("none")};

constexpr std::array motor_fields{
    quantity("nominal_voltage", at<&CustomMotor::nominal_voltage>(), voltage, positive, "\"12 V\"",
             "Voltage at which the others were measured")
        .no_option(),
    quantity("stall_torque", at<&CustomMotor::stall_torque>(), torque, positive, "\"2.6 N m\"",
             "Torque of one motor that is held still")
        .must()
        .no_option(),
    quantity("stall_current", at<&CustomMotor::stall_current>(), current, positive, "\"105 A\"",
             "Current of one motor that is held still")
        .must()
        .no_option(),
    quantity("free_current", at<&CustomMotor::free_current>(), current, not_negative, "\"1.8 A\"",
             "Current of one motor without load")
        .must()
        .no_option(),
    quantity("free_speed", at<&CustomMotor::free_speed>(), angular_velocity, positive,
             "\"5676 rpm\"", "Speed without load")
        .must()
        .no_option()};

constexpr std::array gains_fields{
    quantity("kS", at<&KnownGains::kS>(), dimensionless, not_negative, "0.1",
             "Against static friction, in V")
        .without("none"),
    quantity("kV", at<&KnownGains::kV>(), dimensionless, positive, "1.2",
             "To hold a velocity, in V·s per rad or m")
        .without("of the parts"),
    quantity("kA", at<&KnownGains::kA>(), dimensionless, positive, "0.15",
             "To hold an acceleration, in V·s² per rad or m")
        .without("not known if kV is given, else of the parts"),
    quantity(
        "kA_upper_bound", at<&KnownGains::kA_upper_bound>(), dimensionless, positive, "0.4",
        "What a kA that is not known is below, in V·s² per rad or m: loops are checked up to it")
        .without("none"),
    quantity("kG", at<&KnownGains::kG>(), dimensionless, any, "0.65",
             "To hold against gravity, in V (an arm: when horizontal)")
        .without("none if kV is given, else of the parts"),
    quantity("angle_offset", at<&KnownGains::angle_offset>(), angle, any, "\"10 deg\"",
             "Of an arm: its true angle from horizontal where the sensor reads zero")
        .without("none")};

constexpr std::array log_fields{
    text("mechanism", log_kind, "\"arm\"", "What the log is of")
        .one_of("elevator, arm, flywheel, roller, turret, swerve steer, swerve drive, drivetrain")
        .checked(check_log_kind)
        .without("the type in [mechanism], else what the log says")
        .takes("KIND"),
    text("unit", at<&LogSelection::unit>(), "\"rotations\"",
         "Unit of the recorded position (rad, deg, m, in, …)")
        .checked(check_position_unit)
        .without("what the log says")
        .takes("UNIT"),
    text("velocity_unit", at<&LogSelection::velocity_unit>(), "\"RPM\"",
         "Unit of the recorded velocity (RPM, rad/s, deg/s, m/s, …)")
        .checked(check_velocity_unit)
        .without("what the log says")
        .called("velocity-unit")
        .takes("UNIT"),
    flag("no_velocity", at<&LogSelection::no_velocity>(), "true",
         "Leave the recorded velocity out; the position tells it")
        .called("no-velocity"),
    quantity("scale", at<&LogSelection::scale>(), dimensionless, not_zero, "0.1",
             "Multiplies recorded positions and velocities; 1/gearing for a motor's encoder, "
             "metres per rotation for an elevator recorded in rotations")
        .takes("NUMBER"),
    quantity(
        "voltage_scale", at<&LogSelection::voltage_scale>(), dimensionless, not_zero, "12",
        "Volts a recorded unit of voltage; the battery's voltage for a duty cycle from -1 to 1")
        .called("voltage-scale")
        .takes("NUMBER"),
    names("runs", at<&LogSelection::runs>(), "[\"2:0.5..3\"]",
          "What to use of single runs: number, from and to in seconds after the run's start; an "
          "end may be left out")
        .without("what is found to be of use")
        .called("run")
        .takes("N:FROM..TO,…"),
    names("without_runs", at<&LogSelection::without_runs>(), "[\"3\"]",
          "The numbers of runs to leave out")
        .without("none")
        .called("without-run")
        .takes("N,…"),
    text("state", at<&LogSelection::state_channel>(), "\"/SysIdState\"",
         "Channel that names the running test")
        .without("found by its values")
        .takes("CHANNEL"),
    text("voltage", at<&LogSelection::voltage_channel>(), "\"/Arm/AppliedVolts\"",
         "Channel of the applied voltage; of a drivetrain's sides LEFT,RIGHT, as the next two")
        .without("found by its name")
        .takes("CHANNEL"),
    text("position", at<&LogSelection::position_channel>(), "\"/Arm/Position\"",
         "Channel of the position")
        .without("found by its name")
        .takes("CHANNEL"),
    text("velocity", at<&LogSelection::velocity_channel>(), "\"/Arm/Velocity\"",
         "Channel of the velocity")
        .without("found by its name")
        .takes("CHANNEL"),
    text("heading", at<&LogSelection::heading_channel>(), "\"/Gyro/Yaw\"",
         "Channel of a drivetrain's heading")
        .without("found by its name")
        .takes("CHANNEL"),
    text("also", at<&LogSelection::also>(), "\"rotation.json\"",
         "Another log of the same drivetrain: its rotation tests beside its straight ones")
        .without("none")
        .takes("LOG")};

constexpr std::array controller_fields{
    quantity("period", at<&ControllerOptions::period>(), time, positive, "\"20 ms\"",
             "Period of the control loop"),
    list("state_tolerance", at<&ControllerOptions::state_tolerance>(), Of::states, positive,
         "[\"2 cm\", \"0.4 m/s\"]", "Largest acceptable error of each state (Bryson's rule)")
        .without("as tight as leaves a gain margin of 2, a phase margin of 45° and ±20 % of "
                 "inertia and gain")
        .of(mechanism),
    quantity("input_tolerance", at<&ControllerOptions::input_tolerance>(), voltage, positive,
             "\"12 V\"", "Largest acceptable voltage (Bryson's rule)")
        .of(mechanism),
    quantity("max_voltage", at<&ControllerOptions::max_voltage>(), voltage, positive, "\"12 V\"",
             "Limit of the voltage")
        .of(motors),
    quantity("delay", at<&ControllerOptions::delay>(), time, not_negative, "\"10 ms\"",
             "Delay from sensing to acting")
        .without("what the log shows, else none")
        .of(loops),
    flag("predict_delay", at<&ControllerOptions::predict_delay>(), "true",
         "Whether the regulator predicts the state over the delay, of 50 periods at most, in place "
         "of a gain that is compensated for it: faster, where the delay is known to within 25 %")
        .without("false")
        .of(mechanism),
    map("tolerance", at<&ControllerOptions::named, &NamedControl::tolerance>(),
        "{ theta = \"5 deg\", omega = \"1 rad/s\", u = \"2 N m\" }",
        "Of a model by formula: largest acceptable error of each state and size of each input "
        "(Bryson's rule)")
        .without("one of each")
        .of(model),
    map("limit", at<&ControllerOptions::named, &NamedControl::limit>(), "{ u = \"3 N m\" }",
        "Of a model by formula: largest size of inputs")
        .without("none")
        .of(model),
    map("reference", at<&ControllerOptions::named, &NamedControl::reference>(),
        "{ theta = \"170 deg\" }", "Of a model by formula: the state that the loop goes to")
        .without("the point")
        .of(model)};

constexpr std::array estimator_fields{
    quantity("measurement_std", at<&EstimatorOptions::measurement_std>(), Of::output, positive,
             "\"0.5 mm\"", "Standard deviation of one reading")
        .without("what the log shows, else from the resolution"),
    list("model_std", at<&EstimatorOptions::model_std>(), Of::states, not_negative,
         "[\"0.1 mm\", \"0.02 m/s\"]", "Standard deviation, per sample, by which each state errs")
        .without("a voltage that errs by 0.5 V")};

constexpr std::array sensor_fields{quantity("resolution", at<&SensorOptions::resolution>(),
                                            Of::output, not_negative, "\"0.1 mm\"",
                                            "Smallest step of a reading")
                                       .without("what the log shows, else none")};

constexpr std::array battery_fields{
    quantity("open_circuit_voltage", at<&BatteryOptions::open_circuit_voltage>(), voltage, positive,
             "\"12.5 V\"", "Voltage of the battery without load"),
    quantity("resistance", at<&BatteryOptions::resistance>(), resistance, not_negative,
             "\"20 mOhm\"", "Resistance of the battery and its wires")
        .called("battery-resistance")};

// The goal and the limits are the profile's, the seed is the job's.
constexpr std::array profile_fields{
    quantity("goal", at<&DesignJob::profile, &ProfileOptions::goal>(), Of::output, any, "\"0.8 m\"",
             "Where the simulated motion ends")
        .without("1 m, 90°, or three quarters of top speed")
        .of(mechanism),
    quantity("max_velocity", at<&DesignJob::profile, &ProfileOptions::max_velocity>(), Of::rate,
             positive, "\"1.5 m/s\"", "Limit of the trapezoid's velocity")
        .without("the fastest that the motor can follow")
        .of(mechanism),
    quantity("max_acceleration", at<&DesignJob::profile, &ProfileOptions::max_acceleration>(),
             Of::acceleration, positive, "\"4 m/s^2\"", "Limit of the trapezoid's acceleration")
        .without("the fastest that the motor can follow")
        .of(mechanism),
    whole("seed", at<&DesignJob::seed>(), 0, largest_whole, "1", "Seed of the simulation's noise")};

constexpr std::array experiment_fields{
    quantity("travel_low", at<&ExperimentLimits::travel_low>(), Of::output, any, "\"0.05 m\"",
             "Lower end of an elevator's or arm's travel, as its sensor counts")
        .without("of a log: the least position in it")
        .of(mechanism),
    quantity("travel_high", at<&ExperimentLimits::travel_high>(), Of::output, any, "\"1.2 m\"",
             "Higher end")
        .without("of a log: the greatest position in it")
        .of(mechanism),
    quantity("voltage", at<&ExperimentLimits::voltage>(), voltage, positive, "\"10 V\"",
             "Largest voltage of a test")
        .called("test-voltage"),
    quantity("duration", at<&ExperimentLimits::duration>(), time, positive, "\"60 s\"",
             "Of all tests together")
        .called("test-time")};

constexpr std::array sections{
    Section{"mechanism", mechanism_fields, &within<&Project::parts>,
            "What the mechanism is, and the parts it is made of.", "every mechanism", mechanism},
    Section{"mechanism.motor", motor_fields,
            &within<&Project::parts, &MechanismParts::custom_motor>,
            "In place of a motor's name, its numbers.", "a custom motor", mechanism},
    Section{"model", model_fields, &within<&Project::model>,
            "A model by formula, in place of a mechanism.", "", model},
    Section{"point", point_fields, &within<&Project::point>,
            "Where a model by formula is linearised, and held by its controller.", "", model},
    Section{"simulation", simulation_fields, &within<&Project::simulation>,
            "What `flyball simulate` does."},
    Section{"fit", fit_fields, &within<&Project::fit>,
            "What `flyball identify LOG PROJECT.toml` finds of a model.", "", model},
    Section{"estimate", estimate_fields, &within<&Project::estimate>,
            "What `flyball estimate LOG PROJECT.toml` does with a model; channels and times of the "
            "log are those of [fit].",
            "", model},
    Section{"swing_up", swing_up_fields, &within<&Project::swing_up>,
            "How a model by formula comes to an unstable point from afar: by its energy, and from "
            "where the regulator is proven to hold it, by that.",
            "", model},
    Section{"gains", gains_fields, &within<&Project::gains>,
            "Feedforward gains that are known, in place of those that follow from the parts. With "
            "kV no part is needed.",
            "", mechanism},
    Section{"log", log_fields, &within<&Project::log>,
            "What `flyball identify LOG PROJECT.toml` and `flyball tune LOG PROJECT.toml` cannot "
            "find out from the log.",
            "", mechanism},
    Section{"controller", controller_fields, &within<&Project::job, &DesignJob::controller>,
            "What the loop has to do."},
    Section{"estimator", estimator_fields, &within<&Project::job, &DesignJob::estimator>,
            "How far the sensor and the model are trusted.", "", mechanism},
    Section{"sensor", sensor_fields, &within<&Project::job, &DesignJob::sensor>,
            "The sensor of the simulation.", "", mechanism},
    Section{"battery", battery_fields, &within<&Project::job, &DesignJob::battery>,
            "The battery whose voltage sags in the simulation; needs a motor.", "", motors},
    Section{"profile", profile_fields, &within<&Project::job>, "The motion that is simulated."},
    Section{"experiment", experiment_fields, &within<&Project::experiment>,
            "What tests may do that `flyball experiment` plans.", "", mechanism},
    Section{"size", size_fields, &within<&Project::size>,
            "The motion for which `flyball size` finds the gearing, and what it is done with.", "",
            mechanism},
    Section{"drive", drive_fields, &within<&Project::drive>,
            "A drivetrain, what it follows and how: what `flyball drive` simulates.",
            "every drivetrain", Subject::drive},
    Section{"disturbance", disturbance_fields, &within<&Project::disturbance>,
            "What the drivetrain meets that its follower does not know.", "", Subject::drive},
    Section{"optimize", optimize_fields, &within<&Project::optimize>,
            "Where a drivetrain is to go as fast as it can: what `flyball optimize` finds.", "",
            Subject::drive}};

std::optional<SignalDimensions> signals(const void* document) {
  const auto& project = *static_cast<const Project*>(document);
  const auto kind = project.parts.type ? project.parts.type : project.log.mechanism;
  return kind ? std::optional(mechanism_row(*kind).signals) : std::nullopt;
}

}  // namespace

Expected<void> check_drive_motor(const std::string& text) {
  return check_motor(text);
}

Expected<void> check_drive_type(const std::string& text) {
  return check_choice(text, {"differential", "swerve", "mecanum"});
}

Expected<void> check_drive_follower(const std::string& text) {
  return check_choice(text, {"ramsete", "ltv unicycle", "ltv drive", "holonomic", "pure pursuit"});
}

const Document& project_document() {
  static constexpr Document document{sections, &signals};
  return document;
}

const Section& section_of(std::string_view name) {
  return *std::find_if(sections.begin(), sections.end(),
                       [&](const Section& section) { return section.name == name; });
}

std::string name_of(std::string_view section, std::string_view key) {
  return section.empty() ? std::string(key) : fmt::format("{}.{}", section, key);
}

std::string option_of(const Field& field) {
  if (field.option == "-") {
    return "";
  }
  std::string option = "--" + std::string(field.option.empty() ? field.key : field.option);
  std::replace(option.begin(), option.end(), '_', '-');
  return option;
}

}  // namespace flyball::study
