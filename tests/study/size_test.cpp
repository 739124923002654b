#include <flyball/study/size.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/core/random.hpp>
#include <flyball/mechanisms/gravity.hpp>
#include <flyball/mechanisms/lift/elevator_arm.hpp>
#include <flyball/study/project.hpp>

namespace flyball::study::size_test {
namespace {

using mechanisms::MechanismKind;

/// Under a current limit alone: t = 2 √(θ (J + G² J_r)/(G τ)), least at G = √(J/J_r).
SizeJob turret(double J, double J_r) {
  SizeJob job;
  job.travel.load = {.kind = MechanismKind::turret,
                     .motor = mechanisms::kraken_x60(1),
                     .inertia = J,
                     .rotor_inertia = J_r};
  job.travel.limits = {.voltage = 1e4, .stator_current = 40.0};
  job.travel.limits.battery = {.open_circuit_voltage = 1e4};
  job.travel.end = 2.0;
  job.compare_motors = false;
  return job;
}

TEST(Size, UnderConstantTorqueTheBestGearingMatchesTheInertias) {
  const double J = 0.5;
  const double J_r = 2e-4;
  const auto result = size(turret(J, J_r));
  ASSERT_TRUE(result) << to_string(result.error());
  const double best = std::sqrt(J / J_r);
  // The least is flat: a place is known to the root of the time's accuracy.
  EXPECT_NEAR(result->best.gearing, best, 1e-3 * best);
  const double torque = 40.0 * mechanisms::kraken_x60(1).Kt;
  const double t = 2.0 * std::sqrt(2.0 * 2.0 * J / (best * torque));
  EXPECT_NEAR(result->best.travel.time, t, 1e-8 * t);
  // t(G)/t = √((g + 1/g)/2) with g = G/best is 1.02 at g = 1.0404 ± √(1.0404² - 1).
  const double s = 1.02 * 1.02;
  EXPECT_NEAR(result->high, best * (s + std::sqrt(s * s - 1.0)), 1e-3 * best);
  EXPECT_NEAR(result->low, best * (s - std::sqrt(s * s - 1.0)), 1e-3 * best);
  EXPECT_FALSE(result->reason.empty());
}

// A flywheel without a rotor of its own reaches a speed the sooner, the nearer its gearing is to
// the one between torque and speed: d/dx of ln(1/(1-x))/x² at x = G ω/ω_free.
TEST(Size, AFlywheelsBestGearingIsBetweenTorqueAndSpeed) {
  SizeJob job;
  job.travel.load = {.kind = MechanismKind::flywheel, .motor = mechanisms::neo(1), .inertia = 5e-3};
  job.travel.load.motor_friction = job.travel.load.motor.Kt * job.travel.load.motor.free_current;
  job.travel.limits.battery = {.open_circuit_voltage = 12.0};
  job.travel.speed = true;
  job.travel.end = 300.0;
  job.compare_motors = false;
  const auto result = size(job);
  ASSERT_TRUE(result) << to_string(result.error());
  // -ln(1 - x)/x² is least where x/(1 - x) = -2 ln(1 - x): x = 0.71533…
  const double x = result->best.gearing * 300.0 / job.travel.load.motor.free_speed;
  EXPECT_NEAR(x / (1.0 - x), -2.0 * std::log1p(-x), 2e-3);
}

TEST(Size, BrownoutsAndHeatAreNotTheBest) {
  SizeJob job = turret(2.0, 1e-4);
  job.travel.load.motor = mechanisms::kraken_x60(4);
  job.travel.limits = {.voltage = 12.0};
  job.travel.limits.battery = {.open_circuit_voltage = 12.0, .resistance = 0.03};
  job.brownout_voltage = 7.5;
  const auto browned = size(job);
  ASSERT_TRUE(browned) << to_string(browned.error());
  // Four of them at a standstill take the rail to half: every gearing browns out, and it is said.
  EXPECT_TRUE(browned->best.browns_out);
  EXPECT_TRUE(std::any_of(browned->diagnostics.begin(), browned->diagnostics.end(),
                          [](const Diagnostic& d) { return d.code == "browns_out"; }));
  job.travel.limits.supply_current = 120.0;
  const auto limited = size(job);
  ASSERT_TRUE(limited) << to_string(limited.error());
  EXPECT_FALSE(limited->best.browns_out);
  EXPECT_GE(limited->best.travel.least_rail, 12.0 - 0.03 * 120.0 - 1e-6);
  // Warmer than allowed is not the best either.
  job.travel.winding.heat_capacity = 20.0;
  const double warm = size(job)->best.travel.temperature;
  job.temperature_limit = 25.0 + 0.7 * (warm - 25.0);
  const auto cool = size(job);
  ASSERT_TRUE(cool) << to_string(cool.error());
  EXPECT_LE(cool->best.travel.temperature, job.temperature_limit + 1e-6);
  EXPECT_GT(cool->best.travel.time, limited->best.travel.time);
}

std::string project(const std::string& more, const std::string& size_keys) {
  return "[mechanism]\ntype = \"elevator\"\nmotor = \"NEO\"\nmotor_count = 2\nmass = \"8 kg\"\n"
         "drum_radius = \"1 in\"\n" +
         more + "[size]\n" + size_keys;
}

std::string written(const std::string& text) {
  const std::string path = testing::TempDir() + "size_test.toml";
  std::ofstream(path) << text;
  return path;
}

ExpectedAll<SizeJob> job_of(const std::string& text) {
  return size_job(written(text));
}

std::string refused(const std::string& text) {
  const auto job = job_of(text);
  return job ? std::string() : to_string(job.error());
}

TEST(SizeJob, APartOfAFileIsItsPartInSi) {
  const auto job = job_of(project("gearing = 10\n",
                                  "start = \"10 cm\"\nend = \"1.2 m\"\nstator_limit = \"60 A\"\n"
                                  "supply_limit = \"40 A\"\nefficiency = 0.9\nfriction = \"10 N\"\n"
                                  "rotor_inertia = \"5e-5 kg m^2\"\nwinding_heat_capacity = 45\n"));
  ASSERT_TRUE(job) << to_string(job.error());
  const TravelJob& travel = job->travel;
  EXPECT_EQ(job->gearing, 10.0);
  EXPECT_EQ(travel.start, 0.1);
  EXPECT_EQ(travel.end, 1.2);
  EXPECT_EQ(travel.limits.stator_current, 120.0);  // of both
  EXPECT_EQ(travel.limits.supply_current, 80.0);
  EXPECT_EQ(travel.load.inertia, 8.0);
  EXPECT_EQ(travel.load.radius, 0.0254);
  EXPECT_EQ(travel.load.gravity, 8.0 * mechanisms::standard_gravity);
  EXPECT_EQ(travel.load.rotor_inertia, 1e-4);
  EXPECT_EQ(travel.load.friction, 10.0);
  EXPECT_EQ(travel.winding.heat_capacity, 45.0);
  EXPECT_TRUE(travel.stops);
  EXPECT_FALSE(travel.speed);
}

// Two stages below the carriage: it goes three times as far as the rope, stage k counts by k/3 in
// weight and by (k/3)² in inertia; the spring lifts.
TEST(SizeJob, AnElevatorOfStages) {
  const std::string parts = "stages = [\"3 kg\", \"2 kg\"]\ncounterbalance = \"40 N\"\n";
  const auto job = job_of(project("gearing = 10\n" + parts, "end = \"1.2 m\"\n"));
  ASSERT_TRUE(job) << to_string(job.error());
  const auto& load = job->travel.load;
  EXPECT_NEAR(load.radius, 3.0 * 0.0254, 1e-15);
  EXPECT_NEAR(load.inertia, 8.0 + 3.0 / 9.0 + 2.0 * 4.0 / 9.0, 1e-12);
  EXPECT_NEAR(load.gravity, (8.0 + 1.0 + 4.0 / 3.0) * mechanisms::standard_gravity - 40.0, 1e-12);
  // The same plant where it is designed.
  const auto plant = parse_project(project("gearing = 10\n" + parts, ""), "p.toml");
  ASSERT_TRUE(plant) << to_string(plant.error());
  const auto& motor = *plant->job.plant.motor;
  const double volts = motor.R * load.radius / (10.0 * motor.Kt);  // per newton
  EXPECT_NEAR(plant->job.plant.gains.kG, volts * load.gravity, 1e-12);
  EXPECT_NEAR(plant->job.plant.gains.kA, volts * load.inertia, 1e-12);
  EXPECT_NEAR(plant->job.plant.gains.kV, 10.0 / (motor.Kv * load.radius), 1e-12);
  const auto sized = size(*job);
  ASSERT_TRUE(sized) << to_string(sized.error());
  EXPECT_GT(sized->best.travel.time, 0.0);
  const std::string wrong = refused(project("stages = [\"3 m\"]\ngearing = 10\n", ""));
  EXPECT_NE(wrong.find("stages"), std::string::npos) << wrong;
  const std::string other = refused(
      "[mechanism]\ntype = \"turret\"\nmotor = \"NEO\"\ngearing = 9\n"
      "moment_of_inertia = \"1 kg m^2\"\ncounterbalance = \"3 N\"\n");
  EXPECT_NE(other.find("without meaning for this turret"), std::string::npos) << other;
}

// The example by formula moves as the compiled model of the same numbers does.
TEST(SizeJob, AnArmOnAnElevatorByFormula) {
  const auto project = read_project(std::string(FLYBALL_EXAMPLES) + "/elevator_arm.toml");
  ASSERT_TRUE(project) << to_string(project.error());
  ASSERT_TRUE(project->model_job);
  mechanisms::DcMotor lift{.R = 0.05715, .Kt = 0.02476, .Kv = 50.4};
  mechanisms::DcMotor joint{.R = 0.1143, .Kt = 0.02476, .Kv = 50.4};
  lift.count = joint.count = 1;
  const auto made =
      mechanisms::elevator_arm({.elevator = {.shaft = {.motor = lift, .gearing = 10.0},
                                             .drum_radius = Length(0.0254),
                                             .carriage = Mass(4.0),
                                             .stages = {Mass(3.0)},
                                             .counterbalance = {.force = Force(40.0)}},
                                .joint = {.motor = joint, .gearing = 60.0},
                                .moment_of_inertia = MomentOfInertia(0.45),
                                .mass = Mass(3.0),
                                .center_of_mass = Length(0.35)});
  ASSERT_TRUE(made) << to_string(made.error());
  Random random(3);
  for (int k = 0; k < 50; ++k) {
    const Eigen::Vector4d x = Eigen::Vector4d::NullaryExpr([&] { return random.normal(); });
    const Eigen::Vector2d u = 5.0 * Eigen::Vector2d::NullaryExpr([&] { return random.normal(); });
    const Eigen::VectorXd ours =
        project->model_job->model.derivative(Eigen::VectorXd(x), Eigen::VectorXd(u));
    const Eigen::Vector4d theirs = made->derivative(x, u);
    EXPECT_LT((ours - theirs).norm(), 1e-12 * theirs.norm()) << k;
  }
}

TEST(SizeJob, AGearingNeedNotBeThere) {
  const auto job = job_of(project("", "end = \"1 m\"\n"));
  ASSERT_TRUE(job) << to_string(job.error());
  EXPECT_FALSE(job->gearing);
  const auto missing = refused("[mechanism]\ntype = \"elevator\"\nmotor = \"NEO\"\n[size]\n");
  EXPECT_NE(missing.find("mechanism.mass is missing"), std::string::npos) << missing;
}

TEST(SizeJob, AnArmLighterThanItsMassesPlaceIsToldOf) {
  const auto arm = [](const std::string& inertia) {
    return job_of(
        "[mechanism]\ntype = \"arm\"\nmotor = \"NEO\"\nmass = \"4 kg\"\n"
        "center_of_mass = \"50 cm\"\nmoment_of_inertia = \"" +
        inertia + " kg m^2\"\n[size]\nrotor_inertia = \"5e-5 kg m^2\"\nend = \"1 rad\"\n");
  };
  const auto told = [](const auto& job) {
    return job && std::any_of(job->diagnostics.begin(), job->diagnostics.end(),
                              [](const Diagnostic& d) { return d.code == "light_arm"; });
  };
  ASSERT_TRUE(arm("1"));
  EXPECT_FALSE(told(arm("1")));     // a point mass: 4 kg · (0.5 m)²
  EXPECT_FALSE(told(arm("0.99")));  // rounded
  EXPECT_TRUE(told(arm("0.9")));
  EXPECT_TRUE(told(arm("0.333")));  // of a rod about its middle, that is
}

TEST(SizeJob, WhatHasNoMeaningOrCannotBeIsRefusedWithTheMend) {
  EXPECT_NE(refused(project("", "distance = \"5 m\"\n")).find("without meaning for this elevator"),
            std::string::npos);
  // With its line and column.
  const std::string light = refused(project("", "winding_heat_capacity = 1e-9\n"));
  EXPECT_NE(light.find("size.winding_heat_capacity is 1e-09 J/K"), std::string::npos) << light;
  EXPECT_NE(light.find("size_test.toml:8:25"), std::string::npos) << light;
  EXPECT_NE(refused(project("", "grip = 1.1\n")).find("wheels on a floor"), std::string::npos);
  EXPECT_NE(refused(project("", "efficiency = 90\n")).find("90 % is 0.9"), std::string::npos);
  EXPECT_NE(refused(project("", "end = \"90 deg\"\n")).find("it must be a length"),
            std::string::npos)
      << refused(project("", "end = \"90 deg\"\n"));
  EXPECT_NE(refused(project("", "friction = \"2 N m\"\n")).find("force"), std::string::npos)
      << refused(project("", "friction = \"2 N m\"\n"));
  EXPECT_NE(refused(project("", "stator_limt = \"60 A\"\n")).find("stator_limit"),
            std::string::npos);
  EXPECT_NE(refused(project("", "winding_thermal_resistance = 2\n")).find("heat capacity"),
            std::string::npos);
  std::string unknown = project("", "end = \"1 m\"\n");
  unknown.replace(unknown.find("NEO"), 3, "NEOO");
  EXPECT_NE(refused(unknown).find("did you mean \"NEO"), std::string::npos) << refused(unknown);
  EXPECT_NE(refused("[size]\nend = \"1 m\"\n").find("[mechanism]"), std::string::npos);
}

TEST(SizeJob, ALockedRotorTellsTheHeatCapacity) {
  // 45 J/K: V = 4, R = 0.09 (1 + α E/C).
  const std::string csv = testing::TempDir() + "size_locked.csv";
  std::ofstream file(csv);
  file << "Time (s),Voltage (V),Current (A),Torque (N m)\n";
  double energy = 0.0;
  for (int k = 0; k < 100; ++k) {
    const double I = 4.0 / (0.09 * (1.0 + 0.00393 * energy / 45.0));
    file << 0.05 * k << ",4," << I << "," << 0.0184 * I << "\n";
    energy += 0.05 * 4.0 * I;
  }
  file.close();
  const auto job = job_of(project("", "end = \"1 m\"\nlocked_rotor = \"size_locked.csv\"\n"));
  ASSERT_TRUE(job) << to_string(job.error());
  EXPECT_NEAR(job->travel.winding.heat_capacity, 45.0, 0.1);
}

TEST(Size, WhatNoGearingCarriesIsRefusedWithItsReason) {
  auto job = job_of(project("",
                            "end = \"1 m\"\nstator_limit = \"5 A\"\nsupply_limit = \"1 A\"\n"
                            "friction = \"4000 N\"\nlongest = \"2 s\"\n"));
  ASSERT_TRUE(job) << to_string(job.error());
  const auto result = size(*job);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind(), ErrorKind::no_answer);
  EXPECT_NE(to_string(result.error()).find("after 2 s"), std::string::npos)
      << to_string(result.error());
}

TEST(Size, EveryMotorHasItsOwnBestGearingTheFastestFirst) {
  auto job = job_of(project("gearing = 30\n", "end = \"1.2 m\"\nstator_limit = \"60 A\"\n"));
  ASSERT_TRUE(job);
  const auto result = size(*job);
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_EQ(result->motors.size(), mechanisms::motor_table().size());
  double last = 0.0;
  for (const SizeMotor& motor : result->motors) {
    if (motor.choice && motor.choice->is_good()) {
      EXPECT_GE(motor.choice->travel.time, last);
      last = motor.choice->travel.time;
    }
    if (motor.is_own) {
      EXPECT_NEAR(motor.choice->travel.time, result->best.travel.time, 1e-3);
    }
  }
  // The given gearing is slower, and the answer says by how much.
  ASSERT_TRUE(result->given);
  EXPECT_GT(result->given->travel.time, result->best.travel.time);
  EXPECT_GE(result->best.gearing, result->low);
  EXPECT_LE(result->best.gearing, result->high);
  const Answer answer = answer_of(*result);
  EXPECT_EQ(answer.document.verdict.tone, Tone::caution);
  EXPECT_EQ(answer.figures.size(), 5u);
  EXPECT_EQ(answer.animations.size(), 1u);
  const auto json = nlohmann::json::parse(answer.json);
  EXPECT_EQ(json.at("schema"), "flyball.size/1");
  EXPECT_EQ(json.at("motors").size(), result->motors.size());
  EXPECT_EQ(json.at("sweeps").size(), 3u);
}

TEST(Size, ExamplesAreAnswered) {
  const std::string folder = FLYBALL_EXAMPLES;
  for (const char* name : {"/sized_elevator.toml", "/sized_arm.toml"}) {
    auto job = size_job(folder + name);
    ASSERT_TRUE(job) << to_string(job.error());
    job->compare_motors = false;
    const auto result = size(*job);
    ASSERT_TRUE(result) << to_string(result.error());
    EXPECT_TRUE(result->best.is_good());
  }
}

}  // namespace
}  // namespace flyball::study::size_test
