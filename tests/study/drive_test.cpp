#include <flyball/study/drive.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <tuple>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/io/wpilog.hpp>
#include <flyball/math/integration/adaptive.hpp>
#include <flyball/mechanisms/gravity.hpp>
#include <flyball/study/project.hpp>

#include "study/drive_plant.hpp"

namespace flyball::study::drive_test {
namespace {

using Eigen::VectorXd;

std::string robot(const std::string& type) {
  return "[drive]\ntype = \"" + type +
         "\"\nmotor = \"NEO\"\ngearing = 8.45\nwheel_radius = \"3 in\"\nmass = \"54 kg\"\n"
         "moment_of_inertia = \"6 kg m^2\"\ntrackwidth = \"0.6 m\"\n";
}

const std::string bend =
    "waypoints = [\"1 m, 1 m, 0 deg\", \"3 m, 2 m, 45 deg\", \"4 m, 4 m, 90 deg\"]\n"
    "max_velocity = \"2 m/s\"\n";

ExpectedAll<DriveJob> job_of(const std::string& text) {
  const std::string path = testing::TempDir() + "drive_test.toml";
  std::ofstream(path) << text;
  return drive_job(path);
}

DriveResult driven(const std::string& text) {
  auto job = job_of(text);
  EXPECT_TRUE(job) << (job ? "" : to_string(job.error()));
  const auto result = drive(*job);
  EXPECT_TRUE(result) << (result ? "" : to_string(result.error()));
  return result ? *result : DriveResult{};
}

std::string refused(const std::string& text) {
  const auto job = job_of(text);
  if (!job) {
    return to_string(job.error());
  }
  const auto result = drive(*job);
  return result ? std::string() : to_string(result.error());
}

// Every follower comes to the end within 2 cm, undisturbed and from a start 20 cm and 10° off.
TEST(Drive, EveryFollowerComesToTheEnd) {
  for (const char* follower : {"ramsete", "ltv unicycle", "ltv drive"}) {
    const std::string with = "follower = \"" + std::string(follower) + "\"\n";
    const DriveResult calm = driven(robot("differential") + bend + with);
    EXPECT_LT(calm.errors.largest_across, 0.03) << follower;
    EXPECT_LT(std::hypot(calm.errors.final_across, calm.errors.final_along), 0.02) << follower;
    const DriveResult off = driven(robot("differential") + bend + with +
                                   "[disturbance]\nleft = \"20 cm\"\nturned = \"10 deg\"\n");
    EXPECT_NEAR((*off.series.find("error_across"))[0], 0.2, 1e-9) << follower;
    EXPECT_LT(std::abs(off.errors.final_across), 0.05) << follower;
    EXPECT_FALSE(off.lost) << follower;
  }
  for (const char* type : {"swerve", "mecanum"}) {
    const DriveResult off =
        driven(robot(type) + bend + "[disturbance]\nleft = \"20 cm\"\nahead = \"-10 cm\"\n");
    EXPECT_LT(std::hypot(off.errors.final_across, off.errors.final_along), 0.02) << type;
    EXPECT_FALSE(off.lost) << type;
    for (const double volts : *off.series.find("front_left_voltage")) {
      EXPECT_LE(std::abs(volts), 12.0);
    }
  }
}

// ±20 % of mass and strength, 40 ms, a push and a smooth floor: it is still there at the end.
TEST(Drive, DisturbancesTogether) {
  for (const double factor : {0.8, 1.2}) {
    const DriveResult result = driven(
        robot("differential") + bend +
        "follower = \"ramsete\"\n[disturbance]\nlatency = \"40 ms\"\n" + "mass_factor = " +
        std::to_string(factor) + "\nstrength_factor = " + std::to_string(2.0 - factor) +
        "\npush = \"100 N\"\npush_direction = \"90 deg\"\npush_from = \"0.7 s\"\n"
        "push_for = \"0.2 s\"\nslip_grip = 0.3\nslip_from = \"1.1 s\"\nslip_for = \"0.3 s\"\n");
    EXPECT_FALSE(result.lost);
    EXPECT_LT(std::abs(result.errors.final_across), 0.1) << factor;
  }
}

// Who loses the way says so, with an answer that is there all the same.
TEST(Drive, ALostRobotIsNoSuccess) {
  const DriveResult calm = driven(robot("differential") + bend);
  EXPECT_FALSE(answer_of(calm).refusal);
  const DriveResult lost = driven(robot("differential") + bend +
                                  "[disturbance]\nleft = \"1.2 m\"\nlatency = \"200 ms\"\n");
  ASSERT_TRUE(lost.lost);
  const Answer answer = answer_of(lost);
  ASSERT_TRUE(answer.refusal);
  EXPECT_TRUE(answer.refusal->is(DriveError::lost));
  EXPECT_FALSE(answer.figures.empty());
  // Pure pursuit with a lookahead of the way's length cuts the bend and circles.
  const DriveResult circling = driven(robot("differential") + bend +
                                      "follower = \"pure pursuit\"\nleast_lookahead = \"4 m\"\n"
                                      "[disturbance]\nstrength_factor = 0.05\n");
  ASSERT_FALSE(circling.arrival);
  ASSERT_TRUE(answer_of(circling).refusal);
}

// A trajectory that is typed is taken from the working folder, in place of the file's waypoints.
TEST(Drive, TypedTrajectoriesReplaceTheProjects) {
  const std::string table = testing::TempDir() + "typed_trajectory.csv";
  std::ofstream(table) << "time,x,y,heading,vx,vy,omega\n0,0,0,0,0,0,0\n1,0.5,0,0,1,0,0\n"
                          "2,1,0,0,0,0,0\n";
  const std::string folder = testing::TempDir() + "typed_project/";
  std::filesystem::remove_all(folder);  // of an earlier run
  std::filesystem::create_directories(folder);
  const std::string path = folder + "robot.toml";
  std::ofstream(path) << robot("differential") + bend;
  const std::string relative = std::filesystem::relative(table).string();
  const std::vector<Override> typed{{"--trajectory", relative}};
  const auto job = drive_job(path, typed);
  ASSERT_TRUE(job) << to_string(job.error());
  EXPECT_EQ(job->trajectory.source, relative);
  EXPECT_NEAR(job->trajectory.duration(), 2.0, 1e-9);
  // Named by the project it stands beside it.
  std::ofstream(path) << robot("differential") + "trajectory = \"typed_trajectory.csv\"\n";
  EXPECT_FALSE(drive_job(path));
  std::filesystem::copy_file(table, folder + "typed_trajectory.csv",
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_TRUE(drive_job(path));
}

/// The drive of two wheels written out anew, in the field's frame and with the wheels' positions as
/// its states, the rail solved for by fixed-point iteration.
struct IndependentDrive {
  const DriveRobot& robot;
  const mechanisms::Battery& battery;
  Eigen::Vector2d volts;

  [[nodiscard]] Eigen::Vector2d currents(const Eigen::Vector2d& wheel, double rail) const {
    const auto& motor = robot.motor;
    Eigen::Vector2d I;
    for (int k = 0; k < 2; ++k) {
      const double e = robot.gearing * wheel(k) / motor.Kv;
      double V = volts(k);
      V = std::clamp(V, e - robot.stator_limit * motor.R, e + robot.stator_limit * motor.R);
      V = std::clamp(V, -rail, rail);
      I(k) = (V - e) / motor.R;
    }
    return I;
  }
  VectorXd operator()(double, const VectorXd& s) const {
    // x, y, θ, field velocity, ω, left and right wheel rad/s
    const auto& motor = robot.motor;
    const Eigen::Vector2d wheel(s(6), s(7));
    double rail = battery.open_circuit_voltage;
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector2d I = currents(wheel, rail);
      double supply = 0.0;
      for (int k = 0; k < 2; ++k) {
        supply += (robot.gearing * wheel(k) / motor.Kv + motor.R * I(k)) * I(k) / rail;
      }
      rail = battery.open_circuit_voltage - battery.resistance * supply;
    }
    const Eigen::Vector2d I = currents(wheel, rail);
    const Eigen::Vector2d ahead(std::cos(s(2)), std::sin(s(2)));
    const Eigen::Vector2d left(-ahead(1), ahead(0));
    const double load = 0.5 * robot.mass * mechanisms::standard_gravity;
    VectorXd ds = VectorXd::Zero(8);
    ds.head<3>() << s(3), s(4), s(5);
    for (int k = 0; k < 2; ++k) {
      const double y = (k == 0 ? 0.5 : -0.5) * robot.trackwidth;
      const Eigen::Vector2d contact = s.segment<2>(3) + s(5) * y * -ahead;
      const double rolling = robot.wheel_radius * wheel(k);
      const Eigen::Vector2d sliding = contact - rolling * ahead;
      const double reference = std::hypot(rolling, 0.05);
      const double slip = sliding.norm() / reference;
      const double B = 20.0 / (robot.grip * 1.3);
      const double share =
          slip > 1e-14 ? robot.grip * std::sin(1.3 * std::atan(B * slip)) / slip : 20.0;
      const Eigen::Vector2d F = -load * share / reference * sliding;
      ds.segment<2>(3) += F / robot.mass;
      ds(5) += y * -F.dot(ahead) / robot.moment_of_inertia;
      const double friction = robot.gearing * motor.Kt * motor.free_current;
      ds(6 + k) = (robot.gearing * motor.Kt * I(k) - friction * std::tanh(wheel(k) / 0.5) -
                   robot.wheel_radius * F.dot(ahead)) /
                  robot.wheel_inertia;
    }
    return ds;
  }
};

// The plant that is simulated against those equations, integrated to 1e-10 by another method.
TEST(Drive, ThePlantAgreesWithAnIndependentIntegration) {
  auto job = job_of(robot("differential") + bend + "stator_limit = \"50 A\"\n");
  ASSERT_TRUE(job);
  const auto plant = make_drive_plant(job->robot, job->battery);
  ASSERT_TRUE(plant) << to_string(plant.error());
  VectorXd x = (*plant)->state_of(Pose2d(1.0, 2.0, 0.4), {1.0, 0.1, 0.3}, {});
  VectorXd s = x;
  s(3) = std::cos(0.4) * x(3) - std::sin(0.4) * x(4);
  s(4) = std::sin(0.4) * x(3) + std::cos(0.4) * x(4);
  const VectorXd volts = Eigen::Vector2d(11.0, 4.0);
  const auto ours = integrate(
      [&](double, const VectorXd& at) {
        VectorXd dx(8);
        (*plant)->derivative(at, volts, {}, dx);
        return dx;
      },
      0.0, x, 0.5, {.relative_tolerance = job->accuracy, .absolute_tolerance = job->accuracy});
  ASSERT_TRUE(ours) << to_string(ours.error());
  const auto theirs = integrate(IndependentDrive{job->robot, job->battery, volts}, 0.0, s, 0.5,
                                {.method = IntegrationMethod::radau,
                                 .relative_tolerance = 1e-10,
                                 .absolute_tolerance = 1e-10});
  ASSERT_TRUE(theirs) << to_string(theirs.error());
  VectorXd expected = theirs->final_state();
  const double c = std::cos(expected(2));
  const double sine = std::sin(expected(2));
  const double vx = expected(3);
  const double vy = expected(4);
  expected(3) = c * vx + sine * vy;
  expected(4) = c * vy - sine * vx;
  EXPECT_LT((ours->final_state() - expected).norm(), 1e-8 * expected.norm());
}

/// A swerve or a mecanum drive written out anew, as above; every wheel carries a quarter.
struct IndependentHolonomic {
  const DriveRobot& robot;
  const mechanisms::Battery& battery;
  VectorXd volts;

  [[nodiscard]] bool swerves() const { return robot.kind == DriveKind::swerve; }
  [[nodiscard]] int place(int wheel) const { return swerves() ? 6 + 3 * wheel : 6 + wheel; }
  /// (motor, its speed in rad/s, its limit in A)
  [[nodiscard]] std::tuple<const mechanisms::DcMotor&, double, double> motor(const VectorXd& s,
                                                                             int k) const {
    if (k < 4) {
      return {robot.motor, robot.gearing * s(place(k) + (swerves() ? 2 : 0)), robot.stator_limit};
    }
    return {robot.steer_motor, robot.steer_gearing * s(place(k - 4) + 1), 40.0};
  }
  [[nodiscard]] double current(const VectorXd& s, int k, double rail) const {
    const auto [of, speed, limit] = motor(s, k);
    const double e = speed / of.Kv;
    double V = std::clamp(volts(k), e - limit * of.R, e + limit * of.R);
    V = std::clamp(V, -rail, rail);
    return (V - e) / of.R;
  }
  VectorXd operator()(double, const VectorXd& s) const {
    const int motors = swerves() ? 8 : 4;
    double rail = battery.open_circuit_voltage;
    for (int i = 0; i < 200; ++i) {
      double supply = 0.0;
      for (int k = 0; k < motors; ++k) {
        const auto [of, speed, limit] = motor(s, k);
        const double I = current(s, k, rail);
        supply += (speed / of.Kv + of.R * I) * I / rail;
      }
      rail = battery.open_circuit_voltage - battery.resistance * supply;
    }
    VectorXd ds = VectorXd::Zero(s.size());
    ds.head<3>() << s(3), s(4), s(5);
    const Eigen::Rotation2Dd turned(s(2));
    const double load = 0.25 * robot.mass * mechanisms::standard_gravity;
    const auto torque = [&](int k, double Omega) {
      const auto [of, speed, limit] = motor(s, k);
      const double G = k < 4 ? robot.gearing : robot.steer_gearing;
      return G * of.Kt * (current(s, k, rail) - of.free_current * std::tanh(Omega / 0.5));
    };
    double moment = 0.0;
    std::array<double, 4> steering{};
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector2d r = turned * robot.modules[static_cast<std::size_t>(k)];
      const int at = place(k);
      const double angle = swerves() ? s(at) : 0.0;
      const double Omega = s(swerves() ? at + 2 : at);
      const Eigen::Vector2d d = turned * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      const double rolling = robot.wheel_radius * Omega;
      Eigen::Vector2d sliding = s.segment<2>(3) + s(5) * Eigen::Vector2d(-r(1), r(0)) - rolling * d;
      if (!swerves()) {  // along the rollers' axes alone, which form an X
        const double way = (k == 0 || k == 3 ? -1.0 : 1.0) * 0.78539816339744831;
        const Eigen::Vector2d axis = turned * Eigen::Vector2d(std::cos(way), std::sin(way));
        sliding = Eigen::Vector2d(sliding.dot(axis) * axis);
      }
      const double reference = std::hypot(rolling, 0.05);
      const double slip = sliding.norm() / reference;
      const double B = 20.0 / (robot.grip * 1.3);
      const double share =
          slip > 1e-14 ? robot.grip * std::sin(1.3 * std::atan(B * slip)) / slip : 20.0;
      const Eigen::Vector2d F = -load * share / reference * sliding;
      ds.segment<2>(3) += F / robot.mass;
      moment += r(0) * F(1) - r(1) * F(0);
      ds(swerves() ? at + 2 : at) =
          (torque(k, Omega) - robot.wheel_radius * F.dot(d)) / robot.wheel_inertia;
      if (swerves()) {
        steering[static_cast<std::size_t>(k)] = torque(4 + k, s(at + 1));
        moment -= steering[static_cast<std::size_t>(k)];
        ds(at) = s(at + 1);
      }
    }
    ds(5) = moment / robot.moment_of_inertia;
    for (int k = 0; swerves() && k < 4; ++k) {
      ds(place(k) + 1) = steering[static_cast<std::size_t>(k)] / robot.steer_inertia - ds(5);
    }
    return ds;
  }
};

TEST(Drive, SwerveAndMecanumAgreeWithAnIndependentIntegration) {
  for (const char* type : {"swerve", "mecanum"}) {
    const auto job = job_of(robot(type) + bend + "stator_limit = \"50 A\"\n");
    ASSERT_TRUE(job);
    const auto plant = make_drive_plant(job->robot, job->battery);
    ASSERT_TRUE(plant) << to_string(plant.error());
    const VectorXd x =
        (*plant)->state_of(Pose2d(1.0, 2.0, 0.4), {1.0, 0.3, 0.5}, {0.3, -0.2, 0.1, 0.6});
    VectorXd s = x;
    s(3) = std::cos(0.4) * x(3) - std::sin(0.4) * x(4);
    s(4) = std::sin(0.4) * x(3) + std::cos(0.4) * x(4);
    VectorXd volts(job->robot.motors());
    volts.head<4>() << 11.0, 4.0, 7.0, -3.0;
    volts.tail(volts.size() - 4).setLinSpaced(-1.0, 2.0);
    constexpr double duration = 0.2;
    const auto ours = integrate(
        [&](double, const VectorXd& at) {
          VectorXd dx(at.size());
          (*plant)->derivative(at, volts, {}, dx);
          return dx;
        },
        0.0, x, duration,
        {.relative_tolerance = job->accuracy,
         .absolute_tolerance = job->accuracy,
         .max_steps = 200'000});
    ASSERT_TRUE(ours) << to_string(ours.error());
    const auto theirs =
        integrate(IndependentHolonomic{job->robot, job->battery, volts}, 0.0, s, duration,
                  {.method = IntegrationMethod::radau,
                   .relative_tolerance = 1e-11,
                   .absolute_tolerance = 1e-11,
                   .max_steps = 200'000});
    ASSERT_TRUE(theirs) << to_string(theirs.error());
    VectorXd expected = theirs->final_state();
    const double c = std::cos(expected(2));
    const double sine = std::sin(expected(2));
    const double vx = expected(3);
    const double vy = expected(4);
    expected(3) = c * vx + sine * vy;
    expected(4) = c * vy - sine * vx;
    EXPECT_GT((expected - x).norm(), 1.0) << type;
    EXPECT_LT((ours->final_state() - expected).norm(), 1e-8 * expected.norm()) << type;
  }
}

// A robot that starts beside its path comes to its end by the path alone: backwards, too, and
// sideways; it says when it arrived.
TEST(Drive, PurePursuitComesToTheEnd) {
  for (const char* more : {"", "reversed = true\n", "type = swerve", "type = mecanum"}) {
    const std::string text(more);
    const bool sides = text.find("type") == std::string::npos;
    const DriveResult result = driven(robot(sides ? "differential" : text.substr(7)) + bend +
                                      "follower = \"pure pursuit\"\n" + (sides ? text : "") +
                                      "[disturbance]\nleft = \"20 cm\"\nlatency = \"20 ms\"\n");
    ASSERT_TRUE(result.arrival) << more;
    EXPECT_LT(*result.arrival, 1.5 * result.duration) << more;
    EXPECT_LT(std::hypot(result.errors.final_across, result.errors.final_along), 0.08) << more;
    EXPECT_LT(result.errors.largest_across, 0.3) << more;
    EXPECT_FALSE(result.lost) << more;
  }
  EXPECT_FALSE(driven(robot("swerve") + bend).arrival);
}

// Wheels that lose the floor: with a loop that is too tight for them they go back and forth each
// period at their current limit, with the one that is taken they do not.
TEST(Drive, WheelsThatLoseTheFloorDoNotOscillate) {
  const std::string smooth =
      "stator_limit = \"80 A\"\n[disturbance]\nslip_grip = 0.1\nslip_from = \"0.4 s\"\n"
      "slip_for = \"0.5 s\"\n";
  const auto swings = [](const DriveResult& result) {
    const std::vector<double>& volts = *result.series.find("front_left_voltage");
    double most = 0.0;
    for (std::size_t k = 22; k < 45; ++k) {  // on the smooth spot
      most = std::max(most, std::abs(volts[k - 1] - 0.5 * (volts[k - 2] + volts[k])));
    }
    return most;
  };
  const DriveResult calm = driven(robot("swerve") + bend + smooth);
  const DriveResult tight =
      driven(robot("swerve") + bend + "velocity_tolerance = \"0.95 m/s\"\n" + smooth);
  EXPECT_LT(swings(calm), 1.5);
  EXPECT_GT(swings(tight), 4.0);
  EXPECT_TRUE(std::any_of(tight.diagnostics.begin(), tight.diagnostics.end(),
                          [](const Diagnostic& d) { return d.code == "spinning_wheels"; }));
}

// What is little is told: motors that do not give the acceleration, wheels at their own speed,
// wheels that cannot hold.
TEST(Drive, WhatATrajectoryLeavesIsTold) {
  const auto told = [](const DriveResult& result, const char* code) {
    return std::any_of(result.diagnostics.begin(), result.diagnostics.end(),
                       [&](const Diagnostic& d) { return d.code == code; });
  };
  const std::string straight = "waypoints = [\"1 m, 1 m, 0 deg\", \"7 m, 1 m, 0 deg\"]\n";
  const DriveResult weak = driven(robot("differential") + straight +
                                  "stator_limit = \"20 A\"\nmax_acceleration = \"6 m/s^2\"\n");
  EXPECT_TRUE(told(weak, "weak_motors"));
  EXPECT_FALSE(told(weak, "little_grip"));
  const DriveResult fast = driven(
      robot("differential") +
      "waypoints = [\"1 m, 1 m, 0 deg\", \"17 m, 1 m, 0 deg\"]\nmax_velocity = \"5.3 m/s\"\n");
  EXPECT_TRUE(told(fast, "no_reserve"));
  const DriveResult slips =
      driven(robot("differential") + straight + "grip = 0.4\nmax_acceleration = \"6 m/s^2\"\n");
  EXPECT_TRUE(told(slips, "little_grip"));
  const DriveResult calm = driven(robot("differential") + straight);
  EXPECT_FALSE(told(calm, "weak_motors") || told(calm, "no_reserve") || told(calm, "little_grip"));
}

TEST(Drive, TheAnswerHasItsPicturesAndALogThatReadsBack) {
  const DriveResult result = driven(robot("swerve") + bend);
  const Answer answer = answer_of(result);
  EXPECT_EQ(answer.schema, "flyball.drive/1");
  EXPECT_EQ(answer.figures.size(), 4u);
  ASSERT_EQ(answer.animations.size(), 1u);
  EXPECT_EQ(answer.animations[0].time.size(), answer.animations[0].parts.back().angle.size());
  const auto json = nlohmann::json::parse(answer.json);
  EXPECT_EQ(json.at("drivetrain"), "swerve");
  ASSERT_EQ(answer.files.size(), 2u);
  const auto log = parse_wpilog(answer.files[1].contents, "drive.wpilog");
  ASSERT_TRUE(log) << to_string(log.error());
  const auto find = [&](const std::string& name) {
    for (const Signal& signal : log->signals) {
      if (signal.name == name) {
        return signal.value.size();
      }
    }
    return std::size_t{0};
  };
  EXPECT_EQ(find("/Flyball/Drive/x"), result.series.rows());
  EXPECT_EQ(find("NT:/SmartDashboard/Drive/front_left/wheel/angle"), result.series.rows());
  EXPECT_NE(answer.files[1].contents.find("struct:SwerveModuleState[]"), std::string::npos);
  EXPECT_NE(answer.files[1].contents.find("Mechanism2d"), std::string::npos);
}

TEST(DriveJob, SettingsOfPathPlannerStandWhereNothingIsSaid) {
  const std::string settings = testing::TempDir() + "drive_settings.json";
  std::ofstream(settings) << R"({"holonomicMode": true, "robotMass": 74, "robotMOI": 6.9,
    "robotTrackwidth": 0.546, "driveWheelRadius": 0.048, "driveGearing": 5.143,
    "driveMotorType": "krakenX60", "driveCurrentLimit": 60, "wheelCOF": 1.2,
    "robotWidth": 0.9, "robotLength": 0.8, "defaultMaxVel": 2.5,
    "flModuleX": 0.27, "flModuleY": 0.28, "frModuleX": 0.27, "frModuleY": -0.28,
    "blModuleX": -0.27, "blModuleY": 0.28, "brModuleX": -0.27, "brModuleY": -0.28})";
  const auto job = job_of(
      "[drive]\ntype = \"swerve\"\nsettings = \"drive_settings.json\"\n"
      "mass = \"60 kg\"\n"
      "waypoints = [\"0 m, 0 m, 0 deg\", \"3 m, 1 m, 0 deg\"]\n");
  ASSERT_TRUE(job) << to_string(job.error());
  EXPECT_EQ(job->robot.mass, 60.0);
  EXPECT_EQ(job->robot.moment_of_inertia, 6.9);
  EXPECT_EQ(job->robot.motor.name, "Kraken X60");
  EXPECT_EQ(job->robot.stator_limit, 60.0);
  EXPECT_EQ(job->robot.grip, 1.2);
  EXPECT_EQ(job->robot.modules[1], Eigen::Vector2d(0.27, -0.28));
  EXPECT_EQ(job->robot.width, 0.9);
  double fastest = 0.0;
  for (const MotionSample& sample : job->trajectory.samples) {
    fastest = std::max(fastest, sample.velocity.norm());
  }
  EXPECT_LE(fastest, 2.5 + 1e-9);
  EXPECT_NE(refused("[drive]\ntype = \"differential\"\nsettings = \"drive_settings.json\"\n" + bend)
                .find("holonomic drive"),
            std::string::npos);
}

TEST(DriveJob, WhatIsMissingOrCannotBeIsToldWithTheMend) {
  EXPECT_NE(refused("[drive]\ntype = \"differential\"\n" + bend).find("drive.mass is missing"),
            std::string::npos)
      << refused("[drive]\ntype = \"differential\"\n" + bend);
  EXPECT_NE(refused(robot("differential")).find("missing, and so are waypoints"),
            std::string::npos);
  EXPECT_NE(refused(robot("differential") + bend + "follower = \"holonomic\"\n").find("ramsete"),
            std::string::npos);
  EXPECT_NE(refused(robot("differential") + "waypoints = [\"1 m, 1 m\", \"2 m, 1 m, 0 deg\"]\n")
                .find("waypoints[0]"),
            std::string::npos);
  EXPECT_NE(
      refused(robot("differential") + "waypoints = [\"1 m, 1 m, 0 deg\", \"1 m, 1 m, 0 deg\"]\n")
          .find("drive.waypoints"),
      std::string::npos);
  EXPECT_NE(refused(robot("tank") + bend).find("differential, swerve, mecanum"), std::string::npos)
      << refused(robot("tank") + bend);
  std::string unknown = robot("differential") + bend;
  unknown.replace(unknown.find("NEO"), 3, "Neeo");
  std::string none = robot("differential") + bend;
  none.replace(none.find("0.6 m"), 5, "0 m");
  EXPECT_NE(refused(none).find("greater than zero"), std::string::npos) << refused(none);
  EXPECT_NE(refused(robot("differential") +
                    "waypoints = [\"1 m, 1 m, 0 deg\", \"3 m, 2 m, 45 deg\"]\nmax_velocity = "
                    "\"9 m/s\"\nmax_acceleration = \"90 m/s^2\"\nmax_centripetal = \"90 m/s^2\"\n")
                .find("lower the velocity there"),
            std::string::npos);
  // Each with its line and column.
  const auto quoted = [&](const std::string& text, const std::string& part) {
    const std::string said = refused(text);
    EXPECT_NE(said.find(part), std::string::npos) << said;
    EXPECT_NE(said.find("drive_test.toml:"), std::string::npos) << said;
  };
  quoted(unknown, "did you mean \"NEO\"?");
  quoted(robot("differential") + bend + "follower = \"holonomic\"\n", "ltv drive");
  quoted(robot("swerve") + bend + "follower = \"ramsete\"\n", "holonomic or pure pursuit");
  std::string narrow = robot("differential") + bend;
  narrow.replace(narrow.find("0.6 m"), 5, "1e-9 m");
  quoted(narrow, "drive.trackwidth is 1e-09 m; it must be 0.01 m to 100 m");
  std::string heavy = robot("differential") + bend;
  heavy.replace(heavy.find("54 kg"), 5, "1e12 kg");
  quoted(heavy, "drive.mass");
  const std::string corners = "\"0.2 m, 0.2 m\", \"0.2 m, -0.2 m\", \"-0.2 m, 0.2 m\"";
  quoted(robot("swerve") + bend + "modules = [" + corners + "]\n", "3 places");
  quoted(robot("swerve") + bend + "modules = [" + corners + ", \"-0.2 m, 0.2 m\"]\n",
         "where modules[2] is");
  quoted(robot("swerve") + bend + "modules = [\"-0.2 m, -0.2 m\", " + corners + "]\n",
         "is not ahead of");
  quoted(robot("differential") + "waypoints = [\"1 m, 1 m, 0 deg\",\n\"2 kg, 1 m, 0 deg\"]\n",
         "drive.waypoints[1]");
  EXPECT_NE(refused("[drive]\ntype = \"swerve\"\n[mechanism]\ntype = \"arm\"\n").find("one of"),
            std::string::npos);
}

}  // namespace
}  // namespace flyball::study::drive_test
