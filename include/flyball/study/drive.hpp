#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/control/followers/follower.hpp>
#include <flyball/core/answer.hpp>
#include <flyball/core/diagnostic.hpp>
#include <flyball/core/errors.hpp>
#include <flyball/core/time_series.hpp>
#include <flyball/mechanisms/battery.hpp>
#include <flyball/mechanisms/motor.hpp>
#include <flyball/recording/trajectory_file.hpp>
#include <flyball/study/drive_section.hpp>

/// A drivetrain that follows a trajectory, simulated with what it meets.
namespace flyball::study {

struct Override;

/// Why a drive is none.
enum class DriveError {
  lost,         ///< It was more than a metre from its reference.
  not_arrived,  ///< Pure pursuit is not at the path's end in twice the trajectory's time.
};
[[nodiscard]] ErrorInfo error_info(DriveError code);

/// What a drivetrain moves by.
enum class DriveKind { differential, swerve, mecanum };
/// "differential", "swerve", "mecanum".
[[nodiscard]] std::string_view to_string(DriveKind kind);

/// What follows the trajectory.
enum class DriveFollower {
  ramsete,       ///< Section 8.8, with a tracker of the sides' velocities.
  ltv_unicycle,  ///< Section 8.9, with the same tracker.
  ltv_drive,     ///< Section 8.7: voltages of the whole state.
  holonomic,     ///< Section 8.6.
  pure_pursuit,  ///< The path, whatever the times; of any drivetrain.
};
/// "ramsete", "ltv unicycle", "ltv drive", "holonomic", "pure pursuit".
[[nodiscard]] std::string_view to_string(DriveFollower follower);

/// A drivetrain in SI.
struct DriveRobot {
  DriveKind kind = DriveKind::differential;
  double mass = 0.0;               ///< kg
  double moment_of_inertia = 0.0;  ///< kg m²
  mechanisms::DcMotor motor{};     ///< Of one shaft, all its motors together.
  double gearing = 1.0;
  double wheel_radius = 0.0;                 ///< m
  double wheel_inertia = 0.0;                ///< kg m², of a shaft.
  double trackwidth = 0.0;                   ///< m, of a differential drive.
  double wheelbase = 0.0;                    ///< m, of a differential drive; 0: one wheel a side.
  std::array<Eigen::Vector2d, 4> modules{};  ///< m, of swerve and mecanum.
  double grip = 1.1;
  double stator_limit = 0.0;  ///< A, of one shaft; infinite: none.
  double supply_limit = 0.0;
  mechanisms::DcMotor steer_motor{};
  double steer_gearing = 1.0;
  double steer_inertia = 0.0;  ///< kg m²
  double length = 0.8;         ///< m, of the bumpers: for the pictures.
  double width = 0.8;          ///< m

  /// m/s, of the wheels without load at a voltage.
  [[nodiscard]] double free_speed(double voltage) const noexcept;
  /// Motors, in the order of the voltages: sides, wheels, or the modules' drive and then steer.
  [[nodiscard]] int motors() const noexcept;
};

/// A drivetrain, a trajectory, a follower and what comes between them.
struct DriveJob {
  std::string path{};
  DriveRobot robot{};
  DriveFollower follower = DriveFollower::ramsete;
  RobotTrajectory trajectory{};
  double b = 2.0, zeta = 0.7;
  double x_tolerance = 0.0625, y_tolerance = 0.125, heading_tolerance = 2.5;  ///< m, m, rad
  double velocity_tolerance = 0.95;                                           ///< m/s
  double least_lookahead = 0.3;  ///< m, of pure pursuit.
  double lookahead_time = 0.5;   ///< s, of pure pursuit.
  double period = 0.020;
  double max_voltage = 12.0;
  mechanisms::Battery battery{};
  DisturbanceSection disturbance{};
  double settle = 1.0;      ///< s, simulated after the trajectory's end.
  double accuracy = 1e-10;  ///< Relative, of a step of the integration.
  unsigned long long seed = 1;
  std::vector<Diagnostic> diagnostics{};
};

/// How far it was from where it should be.
struct TrackingErrors {
  double largest_across = 0.0, final_across = 0.0;    ///< m, of the way it should go.
  double largest_along = 0.0, final_along = 0.0;      ///< m
  double largest_heading = 0.0, final_heading = 0.0;  ///< rad
  double rms = 0.0;                                   ///< m, of the distance.
};

/// A trajectory that was followed.
struct DriveResult {
  DriveJob job{};
  TimeSeries series{};  ///< A row a period: pose, reference, errors, speeds, voltages, battery.
  TrackingErrors errors{};
  double duration = 0.0;            ///< s, of the trajectory.
  std::optional<double> arrival{};  ///< s, of pure pursuit: when it came to the path's end.
  double saturated_share = 0.0;     ///< Of the periods, in which more was asked for than there is.
  double largest_slip = 0.0;        ///< m/s, of a wheel over the floor.
  double least_rail = 0.0;          ///< V
  double peak_current = 0.0;        ///< A, of the battery.
  double energy = 0.0;              ///< J, from the battery.
  bool lost = false;  ///< Whether it was ever farther than a metre from its reference.
  std::vector<Diagnostic> diagnostics{};
};

/// The job of a project file with [drive]. @errors As `read_project`; ProjectError for parts that
/// are missing or have no meaning; FileError, TrajectoryFileError and those of the splines.
[[nodiscard]] ExpectedAll<DriveJob> drive_job(const std::string& project,
                                              std::span<const Override> overrides = {});

/// The same without a trajectory, whether there is one or not: what a follower is designed for.
[[nodiscard]] ExpectedAll<DriveJob> drive_design_job(const std::string& project,
                                                     std::span<const Override> overrides = {});

/// Simulates it: each period the follower gets a pose (as old and as noisy as the disturbance says)
/// and what its wheels do, and answers voltages, which motors get within current limits from a
/// battery that sags; the robot, its wheels that slip and its modules are integrated to the job's
/// accuracy between. Pure pursuit follows a path and not its times: its errors are from where the
/// path is beside the robot, and it has twice the trajectory's time to arrive.
/// @errors ArgumentError, those of the models and followers; TrajectoryFileError::too_tight;
/// IntegrationError. Cost: some milliseconds a second of the trajectory.
[[nodiscard]] Expected<DriveResult> drive(const DriveJob& job);

/// Numbers, pictures over time and on the field, an animation, CSV and a WPILOG that AdvantageScope
/// replays. The refusal is there where the robot lost its way or did not arrive. Schema
/// "flyball.drive/1".
[[nodiscard]] Answer answer_of(const DriveResult& result);
[[nodiscard]] std::string to_json(const DriveResult& result);

}  // namespace flyball::study
