#include <flyball/recording/trajectory_file.hpp>

#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include <flyball/core/errors.hpp>

namespace flyball::trajectory_file_test {
namespace {

constexpr double degree = std::numbers::pi / 180.0;

std::string state(double t, double v, double a, double k, double x, double y, double angle) {
  return R"({"time": )" + std::to_string(t) + R"(, "velocity": )" + std::to_string(v) +
         R"(, "acceleration": )" + std::to_string(a) + R"(, "curvature": )" + std::to_string(k) +
         R"(, "pose": {"translation": {"x": )" + std::to_string(x) + R"(, "y": )" +
         std::to_string(y) + R"(}, "rotation": {"radians": )" + std::to_string(angle) + "}}}";
}

std::string refused(const std::string& text) {
  const auto read = parse_trajectory(text, "path.json");
  return read ? std::string() : to_string(read.error());
}

TEST(TrajectoryFile, StatesOfPathWeaver) {
  const std::string text = "[\n" + state(0.0, 0.0, 2.0, 0.5, 1.0, 2.0, 0.0) + ",\n" +
                           state(0.5, 1.0, 2.0, 0.5, 1.25, 2.0, 0.0) + ",\n  " +
                           state(1.0, -1.0, 0.0, 0.5, 1.0, 2.0, std::numbers::pi / 2) + "\n]";
  const auto read = parse_trajectory(text, "path.json");
  ASSERT_TRUE(read) << to_string(read.error());
  ASSERT_EQ(read->samples.size(), 3u);
  EXPECT_FALSE(read->holonomic);
  EXPECT_EQ(read->duration(), 1.0);
  EXPECT_NEAR(read->samples[1].omega, 0.5, 1e-12);
  EXPECT_NEAR(read->samples[1].velocity(0), 1.0, 1e-12);
  // Backing along its heading: the velocity in the field points the other way, ω = v κ.
  EXPECT_NEAR(read->samples[2].velocity(1), -1.0, 1e-6);
  EXPECT_NEAR(read->samples[2].forward(), -1.0, 1e-6);
  EXPECT_NEAR(read->samples[2].omega, -0.5, 1e-12);
  EXPECT_EQ(read->samples[2].place.line, 4u);
  EXPECT_EQ(read->samples[2].place.column, 3u);
  // Between samples, and outside of them.
  EXPECT_NEAR(read->at(0.25).velocity(0), 0.5, 1e-12);
  EXPECT_NEAR(read->at(0.25).pose.x(), 1.125, 1e-12);
  EXPECT_EQ(read->at(-1.0).time, 0.0);
  EXPECT_EQ(read->at(NAN).time, 0.0);
  EXPECT_EQ(read->at(9.0).velocity.norm(), 0.0);
}

TEST(TrajectoryFile, PathPlannersHeadingIsTheRobots) {
  const auto with = [](const std::string& text, double degrees) {
    return text.substr(0, text.size() - 1) + R"(, "holonomicRotation": )" +
           std::to_string(degrees) + R"(, "holonomicAngularVelocity": 90, "other": "left alone"})";
  };
  const auto read = parse_trajectory("[" + with(state(0, 1, 0, 0, 0, 0, 0), 0.0) + "," +
                                         with(state(1, 1, 0, 0, 1, 0, 0), 90.0) + "]",
                                     "path.json");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_TRUE(read->holonomic);
  EXPECT_NEAR(read->samples[1].pose.angle(), 90.0 * degree, 1e-12);
  EXPECT_NEAR(read->samples[1].omega, 90.0 * degree, 1e-12);
  EXPECT_NEAR(read->samples[1].velocity(0), 1.0, 1e-12);
  EXPECT_NEAR(read->samples[1].forward(), 0.0, 1e-12);
}

// Samples of a newer layout do not say in which frame velocities are: a robot that looks along +y
// and goes along +y has (1, 0) in its own and (0, 1) in the field's.
TEST(TrajectoryFile, TheFrameOfVelocitiesIsThatInWhichThePosesMove) {
  const auto sample = [](double t, double y, const std::string& velocity) {
    return R"({"time": )" + std::to_string(t) + R"(, "pose": {"translation": {"x": 0, "y": )" +
           std::to_string(y) + R"(}, "rotation": {"radians": 1.5707963267948966}}, "velocity": )" +
           velocity + "}";
  };
  for (const std::string velocity :
       {R"({"vx": 1, "vy": 0, "omega": 0})", R"({"vx": 0, "vy": 1, "omega": 0})"}) {
    const auto read = parse_trajectory(
        R"({"samples": [)" + sample(0, 0, velocity) + ",\n" + sample(1, 1, velocity) + "]}",
        "new.json");
    ASSERT_TRUE(read) << to_string(read.error());
    EXPECT_FALSE(read->holonomic);
    EXPECT_NEAR(read->samples[0].velocity(1), 1.0, 1e-12);
    EXPECT_NEAR(read->samples[0].velocity(0), 0.0, 1e-12);
    EXPECT_EQ(read->samples[1].place.line, 2u);
  }
}

TEST(TrajectoryFile, WhatIsWrongIsToldWithItsPlaceAndMend) {
  const std::string good = state(0, 0, 1, 0, 0, 0, 0);
  EXPECT_EQ(refused("[" + good + ",\n " + state(1, 1, 1, 0, 1, 0, 0) + ",\n " +
                    state(0.5, 1, 1, 0, 2, 0, 0) + "]"),
            "path.json:3:2: the time of sample 3 is 0.5 s after 1 s; it must be later than the one "
            "before; take the sample out, or generate the trajectory again (sample = 3)");
  std::string broken = "[" + good + ",\n" + state(1, 1, 1, 0, 1, 0, 0) + "]";
  broken.replace(broken.rfind("1.000000"), 8, "NaN");
  EXPECT_NE(refused(broken).find("path.json:2:"), std::string::npos) << refused(broken);
  EXPECT_NE(refused(broken).find("divided by zero"), std::string::npos) << refused(broken);
  broken = "[" + good + ",\n" + state(1, 1, 1, 0, 1, 0, 0) + "]";
  broken.replace(broken.rfind("1.000000"), 8, "null");
  EXPECT_NE(refused(broken).find("path.json:2:1: pose.translation.x is null"), std::string::npos)
      << refused(broken);
  EXPECT_NE(refused("[" + good + "]").find("two samples or more"), std::string::npos);
  EXPECT_NE(refused("[" + good).find("cut off"), std::string::npos) << refused("[" + good);
  EXPECT_NE(refused("{}").find("a list of"), std::string::npos);
  EXPECT_NE(refused(R"({"name": "a", "trajectory": {"samples": []}})").find("Choreo"),
            std::string::npos);
  EXPECT_NE(refused("[{\"time\": 1e999}]").find("larger than a double"), std::string::npos);
  EXPECT_NE(refused("[1, 2]").find("the sample is no object"), std::string::npos)
      << refused("[1, 2]");
}

TEST(TrajectoryFile, ASampleThatStandsTwiceIsTakenOnce) {
  const std::string one = state(1, 1, 0, 0, 1, 0, 0);
  const auto read = parse_trajectory("[" + state(0, 0, 1, 0, 0, 0, 0) + "," + one + "," + one +
                                         "," + state(2, 1, 0, 0, 2, 0, 0) + "]",
                                     "path.json");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->samples.size(), 3u);
  ASSERT_EQ(read->diagnostics.size(), 1u);
  EXPECT_EQ(read->diagnostics[0].code, "repeated_samples");
  // At one time in two places it cannot be.
  EXPECT_NE(refused("[" + one + "," + state(1, 1, 0, 0, 1.5, 0, 0) + "]").find("time of sample 2"),
            std::string::npos);
}

TEST(TrajectoryFile, MoreThanADrivetrainCanIsToldWithWhatItCan) {
  const auto read = parse_trajectory(
      "[" + state(0, 1, 0, 0, 0, 0, 0) + ",\n" + state(1, 3, 0, 4, 1, 0, 0) + "]", "tight.json");
  ASSERT_TRUE(read);
  // 3 m/s (1 + 4 · 0.3) = 6.6 m/s of the outer wheel; within 4 m/s is 4/2.2 = 1.818 m/s.
  const auto checked = check_reach(*read, {.wheel_speed = 4.0, .trackwidth = 0.6});
  ASSERT_FALSE(checked);
  EXPECT_EQ(
      to_string(checked.error()),
      "tight.json:2:1: sample 2 (t = 1 s) is at 3 m/s with a curvature of 4 1/m, which takes "
      "a wheel to 6.6 m/s; it must be within the 4 m/s of this drivetrain's wheels; lower the "
      "velocity there to 1.818 m/s, or make the path wider (sample = 2, wheel_speed = 6.6)");
  EXPECT_TRUE(check_reach(*read, {.wheel_speed = 6.7, .trackwidth = 0.6}));

  RobotTrajectory across = *read;
  across.samples[1].velocity = {0.0, 1.0};
  across.samples[1].omega = 0.0;
  const auto sideways = check_reach(across, {.wheel_speed = 4.0, .trackwidth = 0.6});
  ASSERT_FALSE(sideways);
  EXPECT_NE(to_string(sideways.error()).find("moving sideways at 1 m/s"), std::string::npos);
  EXPECT_TRUE(check_reach(across, {.wheel_speed = 4.0, .trackwidth = 0.6, .sideways = true}));
}

TEST(TrajectoryFile, VelocitiesThatContradictThePosesAreToldOf) {
  // A straight metre a second, and an arc of a radian a second; time, velocity, acceleration,
  // curvature, x, y, heading.
  const auto straight = [](double speed, double unit) {
    std::string text = "[";
    for (int i = 0; i <= 8; ++i) {
      text += (i ? "," : "") + state(0.25 * i, speed, 0, 0, 0.25 * i * unit, 0, 0);
    }
    return parse_trajectory(text + "]", "path.json");
  };
  const auto arc = [](double curvature) {
    std::string text = "[";
    for (int i = 0; i <= 8; ++i) {
      const double angle = 0.25 * i;
      text += (i ? "," : "") +
              state(angle, 1, 0, curvature, std::sin(angle), 1 - std::cos(angle), angle);
    }
    return parse_trajectory(text + "]", "path.json");
  };
  ASSERT_TRUE(straight(1, 1) && arc(1));
  EXPECT_TRUE(straight(1, 1)->diagnostics.empty());
  EXPECT_TRUE(arc(1)->diagnostics.empty());
  for (const auto& [speed, unit] : {std::pair{-1.0, 1.0}, {1.0, 1000.0}, {1000.0, 1.0}}) {
    const auto read = straight(speed, unit);
    ASSERT_TRUE(read);
    ASSERT_EQ(read->diagnostics.size(), 1u) << speed << " " << unit;
    EXPECT_EQ(read->diagnostics[0].code, "poses_disagree");
  }
  const auto turned = arc(-1);
  ASSERT_TRUE(turned);
  ASSERT_EQ(turned->diagnostics.size(), 1u);
  EXPECT_EQ(turned->diagnostics[0].code, "headings_disagree");
}

TEST(TrajectoryFile, APoseThatCannotBeGotToIsToldWithItsPlace) {
  for (const double far : {2.0, 1e308}) {
    auto read =
        parse_trajectory("[" + state(0, 1, 0, 0, 0, 0, 0) + ",\n" + state(0.1, 1, 0, 0, 0.1, 0, 0) +
                             ",\n" + state(0.2, 1, 0, 0, 0.2, 0, 0) + "]",
                         "path.json");
    ASSERT_TRUE(read);
    EXPECT_TRUE(check_reach(*read, {.wheel_speed = 4.0, .trackwidth = 0.6, .sideways = true}));
    read->samples[2].pose = Pose2d(far, 0.0, 0.0);
    const auto checked = check_reach(*read, {.wheel_speed = 4.0, .trackwidth = 0.6});
    ASSERT_FALSE(checked);
    EXPECT_EQ(to_string(checked.error()).find("path.json:3:1: sample 3 (t = 0.2 s) is "), 0u)
        << to_string(checked.error());
  }
}

TEST(PathPlannerSettings, EveryFieldInSi) {
  const auto read = parse_pathplanner_settings(R"({
    "robotWidth": 0.9, "robotLength": 0.8, "holonomicMode": true, "pathFolders": ["a"],
    "autoFolders": [], "defaultMaxVel": 3.0, "defaultMaxAccel": 2.5, "defaultMaxAngVel": 540.0,
    "defaultMaxAngAccel": 720.0, "defaultNominalVoltage": 12.0, "robotMass": 74.088,
    "robotMOI": 6.883, "robotTrackwidth": 0.546, "driveWheelRadius": 0.048, "driveGearing": 5.143,
    "maxDriveSpeed": 5.45, "driveMotorType": "krakenX60", "driveCurrentLimit": 60.0,
    "wheelCOF": 1.2, "flModuleX": 0.27, "flModuleY": 0.26, "bumperOffsetX": 0.1, "robotMas": 3,
    "robotFeatures": []})",
                                               "settings.json");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->robot_width, 0.9);
  EXPECT_EQ(read->robot_length, 0.8);
  EXPECT_EQ(read->holonomic, true);
  EXPECT_EQ(read->path_folders, std::vector<std::string>{"a"});
  EXPECT_EQ(read->max_velocity, 3.0);
  EXPECT_EQ(read->max_acceleration, 2.5);
  EXPECT_NEAR(*read->max_angular_velocity, 540.0 * degree, 1e-12);
  EXPECT_NEAR(*read->max_angular_acceleration, 720.0 * degree, 1e-12);
  EXPECT_EQ(read->nominal_voltage, 12.0);
  EXPECT_EQ(read->mass, 74.088);
  EXPECT_EQ(read->moment_of_inertia, 6.883);
  EXPECT_EQ(read->trackwidth, 0.546);
  EXPECT_EQ(read->wheel_radius, 0.048);
  EXPECT_EQ(read->gearing, 5.143);
  EXPECT_EQ(read->max_drive_speed, 5.45);
  EXPECT_EQ(read->motor, "krakenX60");
  EXPECT_EQ(read->current_limit, 60.0);
  EXPECT_EQ(read->wheel_friction, 1.2);
  EXPECT_EQ(read->modules[0], Eigen::Vector2d(0.27, 0.26));
  EXPECT_FALSE(read->modules[1]);
  EXPECT_EQ(read->bumper_offset, Eigen::Vector2d(0.1, 0.0));
  ASSERT_EQ(read->diagnostics.size(), 1u);
  EXPECT_NE(read->diagnostics[0].message.find("robotMass"), std::string::npos);
}

TEST(PathPlannerSettings, WhatCannotBeIsRefused) {
  const auto refusal = [](const std::string& text) {
    const auto read = parse_pathplanner_settings(text, "settings.json");
    return read ? std::string() : to_string(read.error());
  };
  EXPECT_NE(refusal(R"({"robotMass": -3})").find("robotMass is -3; it must be positive"),
            std::string::npos)
      << refusal(R"({"robotMass": -3})");
  EXPECT_NE(refusal(R"({"robotMass": "70"})").find("a finite number"), std::string::npos);
  EXPECT_NE(refusal(R"({"robotMass": 70, "holonomicMode": 1})").find("true or false"),
            std::string::npos);
  EXPECT_NE(refusal("[]").find("settings.json with"), std::string::npos);
  EXPECT_NE(refusal("{").find("cut off"), std::string::npos);
}

// Modules that are not where their names say.
TEST(PathPlannerSettings, ExchangedModulesAreRefused) {
  const auto settings = [](double fl, double br) {
    return parse_pathplanner_settings(
        R"({"robotMass": 60, "frModuleX": 0.27, "frModuleY": -0.28, "blModuleX": -0.27,
            "blModuleY": 0.28, "flModuleY": 0.28, "brModuleY": -0.28, "flModuleX": )" +
            std::to_string(fl) + R"(, "brModuleX": )" + std::to_string(br) + "}",
        "settings.json");
  };
  EXPECT_TRUE(settings(0.27, -0.27));
  const auto wrong = settings(-0.27, 0.27);
  ASSERT_FALSE(wrong);
  EXPECT_NE(
      to_string(wrong.error()).find("the front left module, (-0.27, 0.28) m, is not ahead of"),
      std::string::npos)
      << to_string(wrong.error());
}

}  // namespace
}  // namespace flyball::trajectory_file_test
