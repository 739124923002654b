#pragma once

#include <optional>
#include <string>
#include <vector>

#include <flyball/core/quantity.hpp>

namespace flyball::study {

/// [drive]: what the drivetrain is made of, what it follows and how. What PathPlanner's settings
/// say stands where nothing is said.
struct DriveSection {
  std::string type{};      ///< "differential", "swerve", "mecanum".
  std::string settings{};  ///< PathPlanner's settings.json, beside the project file.
  std::string motor{};
  std::optional<int> motor_count{};  ///< Of one side, module or wheel.
  std::optional<double> gearing{};
  std::optional<Length> wheel_radius{};
  std::optional<Mass> mass{};
  std::optional<MomentOfInertia> moment_of_inertia{};
  std::optional<Length> trackwidth{}, wheelbase{};
  std::vector<std::string> modules{};    ///< "x, y" of FL, FR, BL, BR.
  std::optional<double> grip{};          ///< μ
  MomentOfInertia wheel_inertia{0.005};  ///< Of what one shaft turns, at the wheel.
  std::optional<Current> stator_limit{}, supply_limit{};  ///< Of one motor.
  std::string steer_motor{};
  double steer_gearing = 21.43;
  MomentOfInertia steer_inertia{0.02};
  std::optional<Length> bumper_length{}, bumper_width{};
  std::string trajectory{};              ///< WPILib's JSON,
  std::string path{};                    ///< Of it, where it holds several,
  std::vector<std::string> waypoints{};  ///< or "x, y, heading" and, of what moves sideways, the
                                         ///< way it looks.
  bool reversed = false;
  std::optional<Velocity> max_velocity{};
  std::optional<Acceleration> max_acceleration{}, max_centripetal{};
  std::string follower{};
  double b = 2.0;     ///< Of Ramsete.
  double zeta = 0.7;  ///< Of Ramsete.
  std::optional<Length> x_tolerance{}, y_tolerance{};
  std::optional<Angle> heading_tolerance{};
  std::optional<Velocity> velocity_tolerance{};
  Length least_lookahead{0.3};  ///< Of pure pursuit.
  Time lookahead_time{0.5};     ///< Of pure pursuit.
};

/// [disturbance]: what the follower does not know.
struct DisturbanceSection {
  Length ahead{}, left{};  ///< Where it starts beside its reference, in the robot's frame.
  Angle turned{};
  Time latency{};                ///< Age of the pose that the follower gets.
  double mass_factor = 1.0;      ///< True mass and inertia over those of the model.
  double strength_factor = 1.0;  ///< True torque per volt over that of the model.
  double left_factor = 1.0;      ///< The same of the left wheels alone.
  Force push{};                  ///< That the robot is pushed with,
  Angle push_direction{};        ///< in the field,
  Time push_from{}, push_for{};  ///< when and how long.
  double slip_grip = 1.0;        ///< Share of the grip that is left
  Time slip_from{}, slip_for{};  ///< from then on, so long.
  Length position_noise{};       ///< Standard deviation of a pose that the follower gets.
  Angle heading_noise{};
};

}  // namespace flyball::study
