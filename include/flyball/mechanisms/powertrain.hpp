#pragma once

#include <limits>
#include <string_view>

#include <flyball/core/expected.hpp>
#include <flyball/mechanisms/battery.hpp>
#include <flyball/mechanisms/mechanism_kind.hpp>
#include <flyball/mechanisms/motor.hpp>

/// What motors can do within their limits, and what a gearbox makes of it: the forces of a
/// mechanism that is pushed as hard as may be.
namespace flyball::mechanisms {

/// What keeps a motor from giving more.
enum class PowerBound {
  voltage,  ///< The controller's highest voltage.
  rail,     ///< The battery's voltage under its sag, all of which is on the motor.
  battery,  ///< The most power that the battery gives: more duty would draw less.
  stator,   ///< The limit of the winding's current.
  supply,   ///< The limit of the current from the battery.
  grip,     ///< What wheels can push on the floor.
};
inline constexpr int power_bounds = 6;
/// "the voltage limit", "the battery's voltage", …
[[nodiscard]] std::string_view to_string(PowerBound bound);

/// Limits of a drive, for all motors together.
struct PowerLimits {
  double voltage = 12.0;                                            ///< V, at the motor.
  double stator_current = std::numeric_limits<double>::infinity();  ///< A, of the windings.
  /// A, drawn from the battery; what flows back is not limited.
  double supply_current = std::numeric_limits<double>::infinity();
  Battery battery{};
};

/// A motor under a controller: D V_rail is on its windings, D I comes from the battery.
struct MotorPoint {
  double voltage = 0.0;         ///< V, at the motor.
  double current = 0.0;         ///< A, of the windings, all motors together.
  double supply_current = 0.0;  ///< A, negative where it flows back.
  double rail = 0.0;            ///< V, of the battery under this load.
  PowerBound bound = PowerBound::voltage;

  /// W, from the rail.
  [[nodiscard]] double power() const noexcept { return voltage * current; }
};

/// The point at which a motor pushes hardest in a direction. With e the back-EMF in that direction
/// and I the current, u = e + R I is on the motor and u I = V_rail I_supply comes from the rail, so
///
///     I <= I_stator,   u <= V_max,   u <= V_open - R_b I (all of the rail),
///     u I <= (V_open - R_b I_supply,max) I_supply,max,   u I <= V_open²/(4 R_b),
///
/// the last where the first of the rail's two solutions would lie below half of V_open: there, less
/// duty gives more current. The current is not negative: a motor that turns faster than the limits
/// let it push is left to coast.
/// @param omega  Of the motor, rad/s. @param direction  1 or -1. @param R  Ω, of the windings as
/// warm as they are, all motors in parallel.
/// Cost: two square roots; noexcept, allocation-free. Source: book, sections 12.1 and 12.1.3.
[[nodiscard]] MotorPoint strongest_push(const DcMotor& motor, const PowerLimits& limits,
                                        double omega, int direction, double R) noexcept;

/// The point of a given current, which the limits allow; of one that they do not, the nearest in
/// its direction. @param current  A, signed as the direction.
[[nodiscard]] MotorPoint push_with(const DcMotor& motor, const PowerLimits& limits, double omega,
                                   int direction, double R, double current) noexcept;

/// A mechanism of one degree of freedom behind a gearbox. "Output" is where its position is
/// counted: metres of a carriage, radians of a wheel.
struct GearedLoad {
  MechanismKind kind = MechanismKind::flywheel;
  DcMotor motor{};
  double gearing = 1.0;         ///< G, motor turns per turn of the drum, wheel or joint.
  double radius = 1.0;          ///< r, m per radian of that; 1 of what turns.
  double inertia = 0.0;         ///< M, kg or kg m², at the output without the rotors.
  double rotor_inertia = 0.0;   ///< J_r, kg m², of all rotors and pinions.
  double gravity = 0.0;         ///< N or N m: m g, or m g l of an arm that is level.
  double angle_offset = 0.0;    ///< rad, of an arm: true angle less the measured one.
  double friction = 0.0;        ///< N or N m, at the output, while it moves.
  double motor_friction = 0.0;  ///< N m, at the motors' shaft: K_t I_free.
  double efficiency = 1.0;      ///< η of the gears, in (0, 1].
  double grip = std::numeric_limits<double>::infinity();  ///< N, most that wheels push.

  /// G/r, radians of the motor per unit of the output.
  [[nodiscard]] double ratio() const noexcept { return gearing / radius; }
  /// The force or torque of gravity against rising positions.
  [[nodiscard]] double weight(double position) const noexcept;
  /// The most of it, in size, between two positions.
  [[nodiscard]] double greatest_weight(double from, double to) const noexcept;
  /// What the motors need to hold it against the most of gravity between two positions, A of all
  /// motors together, friction not counted.
  [[nodiscard]] double holding_current(double from, double to) const noexcept {
    return greatest_weight(from, to) / (ratio() * motor.Kt);
  }
  /// The acceleration under a current while it moves in a direction, with
  ///
  ///     M a = F - weight(x) - friction · direction,
  ///     F = η^{±1} k (K_t I - τ_f direction - J_r k a),   k = G/r,
  ///
  /// η where the motors drive the gears, 1/η where the gears drive the motors: there their losses
  /// brake, too.
  /// @param current  A, signed. @param direction  1 or -1. @return m/s² or rad/s².
  [[nodiscard]] double acceleration(double position, int direction, double current) const noexcept;
  /// The current, in size, at which the wheels begin to slip. @param push  Its direction.
  [[nodiscard]] double slipping_current(int direction, int push) const noexcept;
};

/// @errors ArgumentError::not_positive (gearing, radius, inertia, efficiency, grip), out_of_range
/// (motor count, efficiency above one, negative friction or inertia of rotors), not_finite.
[[nodiscard]] Expected<void> check_load(const GearedLoad& load, std::string_view where);
/// @errors ArgumentError::not_positive, out_of_range; infinite currents are no limits.
[[nodiscard]] Expected<void> check_limits(const PowerLimits& limits, std::string_view where);

}  // namespace flyball::mechanisms
