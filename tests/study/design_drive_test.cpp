// The follower of a drivetrain, designed from a project file.
#include <flyball/study/design_drive.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/control/followers/ltv_drive.hpp>
#include <flyball/study/project.hpp>

namespace flyball::study::design_drive_test {
namespace {

const std::string robot =
    "[drive]\ntype = \"differential\"\nmotor = \"NEO\"\ngearing = 8.45\nwheel_radius = \"3 in\"\n"
    "mass = \"54 kg\"\nmoment_of_inertia = \"6 kg m^2\"\ntrackwidth = \"0.6 m\"\n";

ExpectedAll<DriveJob> job_of(const std::string& text) {
  const std::string path = testing::TempDir() + "design_drive_test.toml";
  std::ofstream(path) << text;
  return drive_design_job(path);
}

FollowerDesign designed(const std::string& text) {
  const auto job = job_of(text);
  EXPECT_TRUE(job) << (job ? "" : to_string(job.error()));
  auto design = design_follower(*job);
  EXPECT_TRUE(design) << (design ? "" : to_string(design.error()));
  return design ? *design : FollowerDesign{};
}

std::string text_of(const Answer& answer, const std::string& name) {
  const auto file = std::find_if(answer.files.begin(), answer.files.end(),
                                 [&](const AnswerFile& each) { return each.name == name; });
  return file == answer.files.end() ? std::string() : file->contents;
}

/// The number behind a name in constants.
double constant(const std::string& text, const std::string& name) {
  const std::size_t at = text.find(name);
  return at == std::string::npos ? std::nan("") : std::stod(text.substr(at + name.size()));
}

// The gains are Newton's: of two motors a side, all the mass on both sides' wheels.
TEST(DesignDrive, GainsAreTheModels) {
  const FollowerDesign design = designed(robot + "follower = \"ramsete\"\n");
  const DriveRobot& of = design.job.robot;
  const auto& motor = of.motor;
  const double r = of.wheel_radius;
  const double kV = of.gearing / (r * motor.Kv);
  const double mass = of.mass + 2.0 * of.wheel_inertia / (r * r);
  const double kA = 0.5 * mass * r * motor.R / (of.gearing * motor.Kt);
  EXPECT_NEAR(design.gains.kV_linear, kV, 1e-9 * kV);
  EXPECT_NEAR(design.gains.kA_linear, kA, 1e-9 * kA);
  // The loop of the sides is stable in both modes, and kP is of one side's error alone.
  for (const double pole : {design.poles(0), design.poles(1)}) {
    EXPECT_GT(pole, 0.0);
    EXPECT_LT(pole, 1.0);
  }
  EXPECT_NEAR(design.kP, std::min(design.K(0, 0) + design.K(0, 1), design.K(0, 0) - design.K(0, 1)),
              1e-12);
  // (8.25) and (8.26) at e = 0.
  const ScheduledGain& last = design.schedule.back();
  EXPECT_NEAR(last.velocity, of.free_speed(12.0), 1e-12);
  EXPECT_NEAR(last.K(0, 0), 2.0 * 0.7 * std::sqrt(2.0) * last.velocity, 1e-12);
  EXPECT_NEAR(last.K(1, 1), 2.0 * last.velocity, 1e-12);
}

// Every gain of the schedule is the Riccati equation's at its velocity, whatever the trajectory.
TEST(DesignDrive, ScheduleIsTheRegulators) {
  const FollowerDesign design = designed(robot + "follower = \"ltv drive\"\n");
  ASSERT_EQ(design.schedule.size(), 65U);
  LtvDriveSettings settings{.velocity_tolerance = design.job.velocity_tolerance};
  const auto exact = LtvDriveFollower::create(design.model, Length(0.6), settings);
  ASSERT_TRUE(exact);
  for (const auto& [v, K] : design.schedule) {
    EXPECT_LT((K - exact->K(v)).norm(), 1e-8 * K.norm()) << v;
    // The right side is the left one's mirror image.
    const Eigen::Matrix<double, 1, 5> mirrored(K(0, 0), -K(0, 1), -K(0, 2), K(0, 4), K(0, 3));
    EXPECT_LT((K.row(1) - mirrored).norm(), 1e-8 * K.norm()) << v;
  }
  ASSERT_TRUE(design.schedule_error);
  EXPECT_LT(*design.schedule_error, 0.01);
}

TEST(DesignDrive, AnswerHasConstantsAndHeader) {
  const FollowerDesign design = designed(robot);
  EXPECT_EQ(design.job.follower, DriveFollower::ltv_unicycle);
  const Answer answer = answer_of(design);
  const auto json = nlohmann::json::parse(answer.json);
  EXPECT_EQ(json.at("schema"), "flyball.design_drive/1");
  EXPECT_EQ(json.at("schedule").size(), design.schedule.size());
  EXPECT_EQ(json.at("velocity_loop").at("kP"), design.kP);
  EXPECT_NE(text_of(answer, "follower.hpp").find("namespace follower {"), std::string::npos);
  const std::string csv = text_of(answer, "data/schedule.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'),
            static_cast<std::ptrdiff_t>(design.schedule.size() + 1));

  const std::string wpilib = text_of(answer, "constants/wpilib_cpp.txt");
  EXPECT_NEAR(constant(wpilib, "kVAngular = "), 0.3 * design.gains.kV_angular, 1e-5);
  EXPECT_NEAR(constant(wpilib, "yTolerance = "), 0.125, 1e-9);
  EXPECT_NE(wpilib.find("frc::LTVUnicycleController follower{"), std::string::npos);
  // Per turn of the wheel, 2π·3 in, and per one a minute.
  const double turn = 2.0 * 3.14159265358979 * 0.0762;
  const std::string phoenix = text_of(answer, "constants/phoenix6_cpp.txt");
  EXPECT_NEAR(constant(phoenix, "WithKV("), turn * design.gains.kV_linear, 1e-5);
  EXPECT_NEAR(constant(phoenix, "WithKP("), turn * design.kP, 1e-4);
  const std::string rev = text_of(answer, "constants/revlib_cpp.txt");
  EXPECT_NEAR(constant(rev, "kV = "), turn / 60.0 * design.gains.kV_linear, 1e-7);
  EXPECT_NE(rev.find("Drivetrain"), std::string::npos);
}

TEST(DesignDrive, WpilibsFollowers) {
  const Answer ramsete = answer_of(designed(robot + "follower = \"ramsete\"\nb = 3\n"));
  const std::string java = text_of(ramsete, "constants/wpilib_java.txt");
  EXPECT_NE(java.find("RamseteController follower = new RamseteController("), std::string::npos);
  EXPECT_NEAR(constant(java, " b = "), 3.0, 1e-12);
  const Answer drive = answer_of(designed(robot + "follower = \"ltv drive\"\n"));
  const std::string python = text_of(drive, "constants/wpilib_python.txt");
  EXPECT_NE(python.find("import LTVDifferentialDriveController"), std::string::npos);
  EXPECT_NE(python.find("(c.voltageTolerance, c.voltageTolerance), 0.02)"), std::string::npos);
}

TEST(DesignDrive, WhatIsNoDifferentialDriveIsRefused) {
  std::string swerve = robot;
  swerve.replace(swerve.find("differential"), 12, "swerve");
  const auto job = job_of(swerve);
  ASSERT_TRUE(job);
  const auto design = design_follower(*job);
  ASSERT_FALSE(design);
  EXPECT_NE(to_string(design.error()).find("drive.type"), std::string::npos);
  const auto pursuit = job_of(robot + "follower = \"pure pursuit\"\n");
  ASSERT_TRUE(pursuit);
  EXPECT_NE(to_string(design_follower(*pursuit).error()).find("no gains"), std::string::npos);
  const auto incomplete = job_of("[drive]\ntype = \"differential\"\n");
  ASSERT_FALSE(incomplete);
  EXPECT_NE(to_string(incomplete.error()).find("drive.mass"), std::string::npos);
}

}  // namespace
}  // namespace flyball::study::design_drive_test
