#include <flyball/mechanisms/arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/mechanisms/swerve_drive.hpp>
#include <flyball/mechanisms/turret.hpp>
#include <flyball/mechanisms/velocity_servo.hpp>

#include "core/try.hpp"
#include "mechanisms/motor_checks.hpp"

namespace flyball::mechanisms {

namespace {

// Parameters that are numbers can have a model that is none (J = 1e-320): A and B are checked too.
Expected<void> check_gains(const FeedforwardGains& gains, std::string_view where) {
  return Checks(where)
      .positive(gains.kV, "kV")
      .positive(gains.kA, "kA")
      .finite(gains.kV / gains.kA, "kV/kA")
      .finite(1.0 / gains.kA, "1/kA")
      .not_negative(gains.kS, "kS", "V")
      .finite(gains.kG, "kG")
      .finite(gains.angle_offset, "angle_offset");
}

Flywheel velocity_model(MechanismKind kind, const FeedforwardGains& gains, double nominal_voltage) {
  Flywheel model;
  model.A << -gains.kV / gains.kA;
  model.B << 1.0 / gains.kA;
  model.C << 1.0;
  model.D << 0.0;
  model.kind = kind;
  model.gains = gains;
  model.nominal_voltage = nominal_voltage;
  return model;
}

Mechanism<2> position_model(MechanismKind kind, const FeedforwardGains& gains,
                            double nominal_voltage) {
  Mechanism<2> model;
  model.A << 0.0, 1.0, 0.0, -gains.kV / gains.kA;
  model.B << 0.0, 1.0 / gains.kA;
  model.C << 1.0, 0.0;
  model.D << 0.0;
  model.kind = kind;
  model.gains = gains;
  model.nominal_voltage = nominal_voltage;
  return model;
}

// The theorems' matrices are -kV/kA and 1/kA of these gains:
// kV = G/K_v volts a rad/s at the output, kA = R J/(G K_t).
FeedforwardGains rotational_gains(const DcMotor& motor, double G, double J) {
  return {.kS = 0.0, .kV = G / motor.Kv, .kA = motor.R * J / (G * motor.Kt)};
}

/// The gains of what turns with a motor, motor turns an output turn and an inertia.
template <class Parameters>
Expected<FeedforwardGains> turning_gains(const Parameters& parameters, std::string_view where) {
  const auto& [motor, G, J] = parameters;
  FLYBALL_CHECK(Checks(where)
                    .also([&] { return check_drive(motor, G, where); })
                    .positive(J.si(), "moment_of_inertia", "kg m^2"));
  const FeedforwardGains gains = rotational_gains(motor, G, J.si());
  return check_gains(gains, where).map([&] { return gains; });
}

Expected<Flywheel> flywheel_like(MechanismKind kind, const FlywheelParameters& parameters,
                                 std::string_view where) {
  return turning_gains(parameters, where).map([&](const FeedforwardGains& gains) {
    return velocity_model(kind, gains, parameters.motor.nominal_voltage);
  });
}

Expected<Turret> turret_like(MechanismKind kind, const TurretParameters& parameters,
                             std::string_view where) {
  return turning_gains(parameters, where).map([&](const FeedforwardGains& gains) {
    return position_model(kind, gains, parameters.motor.nominal_voltage);
  });
}

Expected<Flywheel> velocity_model_of(MechanismKind kind, const FeedforwardGains& gains,
                                     std::string_view where) {
  return check_gains(gains, where).map([&] { return velocity_model(kind, gains, 12.0); });
}

Expected<Mechanism<2>> position_model_of(MechanismKind kind, const FeedforwardGains& gains,
                                         std::string_view where) {
  return check_gains(gains, where).map([&] { return position_model(kind, gains, 12.0); });
}

}  // namespace

Expected<void> check_drive(const DcMotor& motor, double gearing, std::string_view where,
                           std::string_view name) {
  if (motor.count < 1) {
    return refusal(ArgumentError::out_of_range, where, "motor count")
        .got(std::to_string(motor.count))
        .expected("at least 1");
  }
  FLYBALL_CHECK(Checks(where)
                    .positive(motor.R, "motor.R", "Ohm")
                    .positive(motor.Kt, "motor.Kt", "N m/A")
                    .positive(motor.Kv, "motor.Kv", "rad/s/V"));
  if (!(gearing > 0.0) || !std::isfinite(gearing)) {
    return refusal(std::isfinite(gearing) ? ArgumentError::not_positive : ArgumentError::not_finite,
                   where, std::string(name))
        .got(format_number(gearing))
        .expected("greater than zero; write motor turns per output turn, above 1 for a reduction");
  }
  return {};
}

ModelDescription description_of(MechanismKind kind, const FeedforwardGains& gains) {
  const std::string unit(position_unit(kind));
  ModelDescription description{.name = std::string(to_string(kind)),
                               .states = {{"position", unit}, {"velocity", unit + "/s"}},
                               .inputs = {{"voltage", "V"}},
                               .outputs = {{"position", unit}},
                               .parameters = {{"kS", "V", gains.kS},
                                              {"kV", "V·s/" + unit, gains.kV},
                                              {"kA", "V·s²/" + unit, gains.kA},
                                              {"kG", "V", gains.kG},
                                              {"angle_offset", "rad", gains.angle_offset}}};
  if (controls_velocity(kind)) {
    description.states.erase(description.states.begin());
    description.outputs = description.states;
  }
  return description;
}

Expected<Flywheel> flywheel(const FlywheelParameters& parameters) {
  return flywheel_like(MechanismKind::flywheel, parameters, "flywheel");
}

Expected<Flywheel> roller(const FlywheelParameters& parameters) {
  return flywheel_like(MechanismKind::roller, parameters, "roller");
}

Expected<Turret> turret(const TurretParameters& parameters) {
  return turret_like(MechanismKind::turret, parameters, "turret");
}

Expected<Turret> swerve_steer(const TurretParameters& parameters) {
  return turret_like(MechanismKind::swerve_steer, parameters, "swerve_steer");
}

Expected<SwerveDrive> swerve_drive(const SwerveDriveParameters& parameters) {
  constexpr std::string_view where = "swerve_drive";
  const auto& [motor, G, mass, wheel_radius] = parameters;
  const double m = mass.si();
  const double r = wheel_radius.si();
  FLYBALL_CHECK(Checks(where)
                    .also([&] { return check_drive(motor, G, where); })
                    .positive(m, "mass", "kg")
                    .positive(r, "wheel_radius", "m"));
  const FeedforwardGains gains{
      .kS = 0.0, .kV = G / (motor.Kv * r), .kA = motor.R * r * m / (G * motor.Kt)};
  return check_gains(gains, where).map([&] {
    return velocity_model(MechanismKind::swerve_drive, gains, motor.nominal_voltage);
  });
}

Expected<ContinuousSystem<1, 1, 1>> flywheel_without_encoder(const FlywheelParameters& parameters) {
  return flywheel(parameters).map([&](const Flywheel& wheel) {
    const DcMotor& motor = parameters.motor;
    ContinuousSystem<1, 1, 1> system = wheel;
    system.C << -parameters.gearing / (motor.Kv * motor.R);
    system.D << 1.0 / motor.R;
    return system;
  });
}

Expected<Elevator> elevator(const ElevatorParameters& parameters) {
  constexpr std::string_view where = "elevator";
  const auto& [motor, G, mass, drum_radius] = parameters;
  const double m = mass.si();
  const double r = drum_radius.si();
  FLYBALL_CHECK(Checks(where)
                    .also([&] { return check_drive(motor, G, where); })
                    .positive(m, "mass", "kg")
                    .positive(r, "drum_radius", "m"));
  const FeedforwardGains gains{.kS = 0.0,
                               .kV = G / (motor.Kv * r),
                               .kA = motor.R * r * m / (G * motor.Kt),
                               .kG = motor.R * r * m * standard_gravity / (G * motor.Kt)};
  return check_gains(gains, where).map([&] {
    return position_model(MechanismKind::elevator, gains, motor.nominal_voltage);
  });
}

Expected<Arm> arm(const ArmParameters& parameters) {
  constexpr std::string_view where = "arm";
  const auto& [motor, G, J, mass, center_of_mass] = parameters;
  const double m = mass.si();
  const double l = center_of_mass.si();
  FLYBALL_CHECK(Checks(where)
                    .also([&] { return check_drive(motor, G, where); })
                    .positive(J.si(), "moment_of_inertia", "kg m^2")
                    .not_negative(m, "mass", "kg")
                    .not_negative(l, "center_of_mass", "m"));
  FeedforwardGains gains = rotational_gains(motor, G, J.si());
  gains.kG = motor.R * m * standard_gravity * l / (G * motor.Kt);
  return check_gains(gains, where).map([&] {
    return position_model(MechanismKind::arm, gains, motor.nominal_voltage);
  });
}

Expected<Flywheel> flywheel(const FeedforwardGains& gains) {
  return velocity_model_of(MechanismKind::flywheel, gains, "flywheel");
}

Expected<Flywheel> roller(const FeedforwardGains& gains) {
  return velocity_model_of(MechanismKind::roller, gains, "roller");
}

Expected<SwerveDrive> swerve_drive(const FeedforwardGains& gains) {
  return velocity_model_of(MechanismKind::swerve_drive, gains, "swerve_drive");
}

Expected<Elevator> elevator(const FeedforwardGains& gains) {
  return position_model_of(MechanismKind::elevator, gains, "elevator");
}

Expected<Arm> arm(const FeedforwardGains& gains) {
  return position_model_of(MechanismKind::arm, gains, "arm");
}

Expected<Turret> turret(const FeedforwardGains& gains) {
  return position_model_of(MechanismKind::turret, gains, "turret");
}

Expected<Turret> swerve_steer(const FeedforwardGains& gains) {
  return position_model_of(MechanismKind::swerve_steer, gains, "swerve_steer");
}

ContinuousSystem<1, 1, 1> velocity_servo() {
  ContinuousSystem<1, 1, 1> system;
  system.A << 0.0;
  system.B << 1.0;
  system.C << 1.0;
  system.D << 0.0;
  return system;
}

}  // namespace flyball::mechanisms
