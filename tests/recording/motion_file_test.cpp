#include <flyball/recording/motion_file.hpp>

#include <cmath>
#include <filesystem>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/io/csv.hpp>
#include <flyball/io/file.hpp>

namespace flyball::motion_file_test {
namespace {

/// x = t², y = 0, heading = t/2: accelerated along x at 2 m/s², turning at 0.5 rad/s.
RobotTrajectory example(bool holonomic) {
  RobotTrajectory motion{.source = "example", .holonomic = holonomic};
  for (int i = 0; i <= 20; ++i) {
    const double t = 0.05 * i;
    MotionSample sample{.time = t, .pose = Pose2d(t * t, 0.0, holonomic ? 0.5 * t : 0.0)};
    sample.velocity = {2.0 * t, 0.0};
    sample.acceleration = {2.0, 0.0};
    sample.omega = holonomic ? 0.5 : 0.0;
    motion.samples.push_back(sample);
  }
  return motion;
}

void expect_same(const RobotTrajectory& a, const RobotTrajectory& b, double acceleration = 1e-12) {
  ASSERT_EQ(a.samples.size(), b.samples.size());
  for (std::size_t i = 0; i < a.samples.size(); ++i) {
    EXPECT_EQ(a.samples[i].time, b.samples[i].time);
    EXPECT_NEAR((a.samples[i].pose.translation() - b.samples[i].pose.translation()).norm(), 0.0,
                1e-15);
    EXPECT_NEAR(a.samples[i].pose.angle(), b.samples[i].pose.angle(), 1e-14);
    EXPECT_NEAR((a.samples[i].velocity - b.samples[i].velocity).norm(), 0.0, 1e-12);
    EXPECT_NEAR(a.samples[i].omega, b.samples[i].omega, 1e-12);
    EXPECT_NEAR((a.samples[i].acceleration - b.samples[i].acceleration).norm(), 0.0, acceleration);
  }
}

TEST(MotionFile, GoesThroughEachFormatAndBack) {
  for (const bool holonomic : {false, true}) {
    const RobotTrajectory motion = example(holonomic);
    const std::string choreo = to_choreo(to_choreo_trajectory(motion, "example")).value();
    EXPECT_EQ(motion_format(choreo, "a"), MotionFormat::choreo_trajectory);
    expect_same(trajectory_of(parse_choreo_trajectory(choreo, "a").value(), "a").value(), motion);

    const std::string wpilib = to_wpilib(to_wpilib_trajectory(motion)).value();
    EXPECT_EQ(motion_format(wpilib, "a"), MotionFormat::wpilib_trajectory);
    // The list says what is along the path; of a robot that looks elsewhere not where it moves at
    // each instant: its poses do.
    const RobotTrajectory back = parse_trajectory(wpilib, "a").value();
    ASSERT_EQ(back.samples.size(), motion.samples.size());
    EXPECT_EQ(back.holonomic, holonomic);
    EXPECT_NEAR(back.samples[10].pose.angle(), motion.samples[10].pose.angle(), 1e-14);
    EXPECT_NEAR(back.samples[10].omega, motion.samples[10].omega, 1e-12);
    EXPECT_NEAR((back.samples[10].velocity - motion.samples[10].velocity).norm(), 0.0, 1e-12);

    const std::string csv = to_csv(to_table(motion).value());
    EXPECT_EQ(motion_format(csv, "a"), MotionFormat::trajectory_table);
    expect_same(trajectory_of(parse_csv(csv, "a.csv").value()).value(), motion);
  }
  // Sides of a differential drive: at 0.6 m between its wheels.
  RobotTrajectory arc{.source = "arc"};
  for (int i = 0; i <= 10; ++i) {  // 1 m/s along a circle of 2 m
    const double t = 0.1 * i;
    MotionSample sample{
        .time = t, .pose = Pose2d(2.0 * std::sin(t / 2.0), 2.0 - 2.0 * std::cos(t / 2.0), t / 2.0)};
    sample.velocity = {std::cos(t / 2.0), std::sin(t / 2.0)};
    sample.acceleration = {-0.5 * std::sin(t / 2.0), 0.5 * std::cos(t / 2.0)};
    sample.omega = 0.5;
    arc.samples.push_back(sample);
  }
  const ChoreoTrajectory sides = to_choreo_trajectory(arc, "arc", ChoreoSides{0.6});
  EXPECT_NEAR(*sides.trajectory.samples[3].vl, 1.0 - 0.3 * 0.5, 1e-15);
  EXPECT_NEAR(*sides.trajectory.samples[3].vr, 1.0 + 0.3 * 0.5, 1e-15);
  EXPECT_TRUE(sides.differential());
  expect_same(trajectory_of(sides, "arc").value(), arc, 1e-12);
}

TEST(MotionFile, WhatVersionsLackComesOfDifferences) {
  // Without ω and accelerations, as a differential drive of version 0 or 2024.
  ChoreoTrajectory file = to_choreo_trajectory(example(true), "example");
  for (ChoreoSample& sample : file.trajectory.samples) {
    sample.omega.reset();
    sample.ax.reset();
    sample.ay.reset();
  }
  const auto motion = trajectory_of(file, "a").value();
  EXPECT_NEAR(motion.samples[7].omega, 0.5, 1e-12);
  EXPECT_NEAR(motion.samples[7].acceleration(0), 2.0, 1e-12);
  EXPECT_NEAR(motion.samples[0].omega, 0.5, 1e-12);

  const auto table = parse_csv("time (s),x (ft),y (ft)\n0,0,0\n1,1,1\n2,2,2\n", "a.csv").value();
  const auto places = trajectory_of(table).value();
  EXPECT_NEAR(places.samples[1].pose.x(), 0.3048, 1e-15);
  EXPECT_NEAR(places.samples[1].velocity(1), 0.3048, 1e-15);
  EXPECT_NEAR(places.samples[1].pose.angle(), std::numbers::pi / 4.0, 1e-15);
}

TEST(MotionFile, TellsWhatIsWrong) {
  ChoreoTrajectory file = to_choreo_trajectory(example(true), "example");
  const auto refusal_of = [](const auto& result) {
    return result ? "read" : to_string(static_cast<const Error&>(result.error()));
  };
  std::swap(file.trajectory.samples[3].time, file.trajectory.samples[4].time);
  EXPECT_NE(
      refusal_of(trajectory_of(file, "a.traj")).find("the time of sample 5 is 0.15 s after 0.2 s"),
      std::string::npos)
      << refusal_of(trajectory_of(file, "a.traj"));
  std::swap(file.trajectory.samples[3].time, file.trajectory.samples[4].time);
  file.trajectory.samples[2].vx = 1e300;
  EXPECT_NE(
      refusal_of(trajectory_of(file, "a.traj")).find("the velocity of sample 3 is 1e+300 m/s"),
      std::string::npos)
      << refusal_of(trajectory_of(file, "a.traj"));
  file.trajectory.samples.clear();
  EXPECT_EQ(refusal_of(trajectory_of(file, "a.traj")),
            "a.traj: the trajectory is without samples; it must be generated; generate it in "
            "Choreo, and save");
  EXPECT_EQ(refusal_of(motion_format("{\"a\": 1, \"b\": 2}", "a.json")),
            "a.json: the JSON is an object of a, b; it must be a file of Choreo (.traj, .chor), "
            "PathPlanner (.path, .auto), or a WPILib trajectory");
  EXPECT_EQ(refusal_of(motion_format(" \n", "a.json")), "a.json: the file is empty");
  EXPECT_EQ(refusal_of(trajectory_of(parse_csv("time,v\n0,1\n1,2\n", "a.csv").value())),
            "a.csv: the table is of columns v; it must be columns time, x, y, heading, and best "
            "vx, vy, omega, ax, ay");
}

TEST(MotionFile, RealFilesAreMotions) {
  const std::string folder = FLYBALL_TEST_DATA;
  if (!std::filesystem::exists(folder + "/choreo")) {
    GTEST_SKIP();
  }
  for (const char* name : {"trajectory_3_swerve.traj", "trajectory_3_differential.traj",
                           "trajectory_beta-6_swerve.traj", "choreo2024_test1.traj"}) {
    const auto motion = read_motion(folder + "/choreo/" + name);
    ASSERT_TRUE(motion) << to_string(motion.error());
    EXPECT_TRUE(motion->diagnostics.empty()) << name << motion->diagnostics.front().message;
    // Its velocities are what its poses change by.
    Eigen::Vector2d moved = Eigen::Vector2d::Zero();
    for (std::size_t i = 1; i < motion->samples.size(); ++i) {
      const MotionSample& a = motion->samples[i - 1];
      const MotionSample& b = motion->samples[i];
      moved += 0.5 * (b.time - a.time) * (a.velocity + b.velocity);
    }
    const Eigen::Vector2d way =
        motion->samples.back().pose.translation() - motion->samples.front().pose.translation();
    EXPECT_LT((moved - way).norm(), 0.1) << name;  // 2024: 75 ms between samples
  }
  const auto project = read_motion(folder + "/choreo/choreo2024_example.chor", "backup2m");
  ASSERT_TRUE(project) << to_string(project.error());
  EXPECT_NEAR(project->duration(), 1.385, 1e-3);
  const auto unnamed = read_motion(folder + "/choreo/choreo2024_example.chor");
  ASSERT_FALSE(unnamed);
  EXPECT_NE(to_string(static_cast<const Error&>(unnamed.error())).find("one of backup2m, c1sub"),
            std::string::npos);
  for (const char* name :
       {"choreo/project_2_swerve.chor", "pathplanner/pp2025_Pickup.path",
        "pathplanner/pp2025_Example_Auto.auto", "pathplanner/pp2025_settings.json"}) {
    EXPECT_FALSE(read_motion(folder + "/" + name)) << name;
  }
}

}  // namespace
}  // namespace flyball::motion_file_test
