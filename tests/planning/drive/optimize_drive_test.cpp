#include <flyball/planning/drive/optimize_drive.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

namespace optimize_drive_test {
namespace {

using Eigen::Vector2d;
using namespace flyball;
using Kind = DriveConstraintKind;

constexpr double pi = std::numbers::pi;
constexpr double inf = std::numeric_limits<double>::infinity();

std::vector<Vector2d> box(double half) {
  return {Vector2d(half, half), Vector2d(-half, half), Vector2d(-half, -half),
          Vector2d(half, -half)};
}
std::array<Vector2d, 4> square(double half) {
  return {Vector2d(half, half), Vector2d(half, -half), Vector2d(-half, half),
          Vector2d(-half, -half)};
}

/// The robot of Choreo's test projects: 150 lb, 6.5 : 1, 2 in, 1.2 N m, 6000 rpm.
DriveModel choreo_robot() {
  DriveModel model;
  model.mass = 68.0388555;
  model.moment_of_inertia = 6.0;
  model.wheels = square(0.2794);
  model.trackwidth = 0.5588;
  model.max_force = 1.2 * 6.5 / 0.0508;
  model.max_speed = 628.3185307179587 / 6.5 * 0.0508;
  model.friction = 1.5 * 68.0388555 * 9.80665 / 4.0;
  model.corners = box(0.4064);
  return model;
}

DriveConstraint stop(int waypoint) {
  return {.kind = Kind::stop_point, .from = waypoint};
}

DriveProblem from_to(const DriveModel& model, double x, double y, double heading) {
  DriveProblem problem;
  problem.model = model;
  problem.waypoints = {{.x = 0.0, .y = 0.0, .heading = 0.0}, {.x = x, .y = y, .heading = heading}};
  problem.constraints = {stop(0), stop(-1)};
  return problem;
}

/// Solved, with what an independent simulation says: waypoints to 1 mm, limits to 0.1 %.
DriveSolution solved(const DriveProblem& problem) {
  const auto found = optimize_drive(problem);
  EXPECT_TRUE(found) << to_string(found.error());
  if (!found) {
    return {};
  }
  EXPECT_TRUE(found->solved) << found->message;
  EXPECT_LT(found->waypoint_error, 1e-3);
  EXPECT_LT(found->heading_error, 1e-3);
  for (const DriveViolation& v : found->violations) {
    EXPECT_LT(v.share, 1e-3) << v.name << " by " << v.amount << " " << v.unit << " at " << v.time;
  }
  return *found;
}

/// What Choreo's trajectory files of the version 3 and of the sixth beta ask for.
DriveProblem choreo_swerve(double heading) {
  DriveProblem problem;
  problem.model = choreo_robot();
  problem.waypoints = {
      {.x = 1.0, .y = 1.0, .heading = 0.0},
      {.x = 2.0,
       .y = 2.0,
       .heading = 0.5 * heading,
       .fix_translation = false,
       .fix_heading = false},
      {.x = 3.0, .y = 3.0, .heading = heading, .fix_translation = true, .fix_heading = false}};
  problem.constraints = {
      stop(0),
      stop(-1),
      {.kind = Kind::keep_in_rectangle, .from = 0, .to = -1, .width = 16.54, .height = 8.21},
      {.kind = Kind::max_velocity, .from = 0, .to = 0, .limit = 1.0},
      {.kind = Kind::max_acceleration, .from = 2, .to = 2, .limit = 10.0},
      {.kind = Kind::max_angular_velocity, .from = 2, .to = 2, .limit = 0.0},
      {.kind = Kind::point_at,
       .from = 2,
       .to = 2,
       .x = 0.0,
       .y = 3.0,
       .tolerance = 0.017453292519943295},
      {.kind = Kind::keep_in_circle,
       .from = 2,
       .to = 2,
       .x = 3.008779128082097,
       .y = 2.9378172513097525,
       .radius = 1.0},
      {.kind = Kind::keep_in_lane, .from = 0, .to = 1, .tolerance = 0.01},
      {.kind = Kind::keep_out_circle, .from = 1, .to = 1, .x = 3.0, .y = 0.0, .radius = 1.0}};
  return problem;
}

// Four wheels of F push m: a trapezoid of speed is fastest.
TEST(OptimizeDrive, StraightIsATrapezoid) {
  const DriveModel swerve = choreo_robot();
  const double a = 4.0 * swerve.max_force / swerve.mass;
  const double v = swerve.max_speed;
  EXPECT_NEAR(solved(from_to(swerve, 2.0, 0.0, 0.0)).duration, 2.0 * std::sqrt(2.0 / a), 2e-4);
  EXPECT_NEAR(solved(from_to(swerve, 0.0, 6.0, 0.0)).duration, 6.0 / v + v / a, 6e-3);
  DriveModel mecanum = swerve;
  mecanum.drivetrain = Drivetrain::mecanum;
  EXPECT_NEAR(solved(from_to(mecanum, 2.0, 0.0, 0.0)).duration, 2.0 * std::sqrt(2.0 / a), 2e-4);
  EXPECT_NEAR(solved(from_to(mecanum, 0.0, 2.0, 0.0)).duration, 2.0 * std::sqrt(2.0 / a), 2e-4);
  DriveModel sides = swerve;
  sides.drivetrain = Drivetrain::differential;
  sides.friction *= 2.0;
  EXPECT_NEAR(solved(from_to(sides, 2.0, 0.0, 0.0)).duration, 2.0 * std::sqrt(4.0 / a), 2e-4);
  EXPECT_NEAR(solved(from_to(sides, -2.0, 0.0, 0.0)).duration, 2.0 * std::sqrt(4.0 / a), 2e-4);
}

// Half a turn on the spot: wheels push across their arms.
TEST(OptimizeDrive, TurnsOnTheSpot) {
  const DriveModel swerve = choreo_robot();
  const double arm = std::hypot(0.2794, 0.2794);
  const double alpha = 4.0 * swerve.max_force * arm / swerve.moment_of_inertia;
  EXPECT_NEAR(solved(from_to(swerve, 0.0, 0.0, 1.5)).duration, 2.0 * std::sqrt(1.5 / alpha), 2e-3);
  DriveModel sides = swerve;
  sides.drivetrain = Drivetrain::differential;
  sides.friction *= 2.0;
  const double turn = sides.max_force * sides.trackwidth / sides.moment_of_inertia;
  EXPECT_NEAR(solved(from_to(sides, 0.0, 0.0, 1.5)).duration, 2.0 * std::sqrt(1.5 / turn), 2e-3);
}

// Torque falls with speed: v = v_f (1 - exp(-t/τ)) with τ = m v_f/(4 F_s), then full brakes.
TEST(OptimizeDrive, MotorsPushLessAtSpeed) {
  DriveModel model = choreo_robot();
  model.max_force = 240.0;
  model.stall_force = 200.0;
  model.free_speed = 4.0;
  model.max_speed = 4.0;
  model.friction = 0.0;
  const double tau = model.mass * model.free_speed / (4.0 * model.stall_force);
  const double brake = 4.0 * model.max_force / model.mass;
  const double way = 4.0;
  const auto beyond = [&](double t) {
    const double v = model.free_speed * (1.0 - std::exp(-t / tau));
    const double s = model.free_speed * (t - tau * (1.0 - std::exp(-t / tau)));
    return s + 0.5 * v * v / brake - way;
  };
  double low = 0.0;
  double high = 10.0;
  for (int i = 0; i < 100; ++i) {
    (beyond(0.5 * (low + high)) > 0.0 ? high : low) = 0.5 * (low + high);
  }
  const double best = low + model.free_speed * (1.0 - std::exp(-low / tau)) / brake;
  DriveProblem problem = from_to(model, way, 0.0, 0.0);
  problem.target_interval = 0.02;
  const double found = solved(problem).duration;
  EXPECT_GT(found, best - 1e-3);
  EXPECT_LT(found, 1.01 * best);  // forces are held over intervals
}

// A wheel that draws P at most: F up to the speed P/F, then v dv/dt = n P/m, hence
// v³ = v₁³ + 3 n P s/m, then full brakes.
TEST(OptimizeDrive, BatteriesGiveSoMuch) {
  DriveModel model = choreo_robot();
  model.supply_power = 250.0;
  const double n = 4.0;
  const double a = n * model.max_force / model.mass;
  const double power = n * model.supply_power / model.mass;
  const double way = 3.0;
  const double v1 = model.supply_power / model.max_force;
  double low = v1;
  double high = model.max_speed;
  for (int i = 0; i < 100; ++i) {
    const double v = 0.5 * (low + high);
    const double s =
        0.5 * v1 * v1 / a + (v * v * v - v1 * v1 * v1) / (3.0 * power) + 0.5 * v * v / a;
    (s > way ? high : low) = v;
  }
  const double best = v1 / a + 0.5 * (low * low - v1 * v1) / power + low / a;
  DriveProblem problem = from_to(model, way, 0.0, 0.0);
  problem.target_interval = 0.02;
  const double found = solved(problem).duration;
  EXPECT_GT(found, best - 1e-3);
  EXPECT_LT(found, 1.01 * best);                     // forces are held over intervals
  EXPECT_GT(best, 1.05 * 2.0 * std::sqrt(way / a));  // and without it
  // Windings that lose what there is leave no force beyond √(P/R').
  problem.model.copper_loss = model.supply_power / std::pow(0.5 * model.max_force, 2);
  const DriveSolution heated = solved(problem);
  double most = 0.0;
  for (const DriveSample& sample : heated.samples) {
    if (sample.vx * sample.forces[0](0) > 0.0) {
      most = std::max(most, sample.forces[0].norm());
    }
  }
  EXPECT_LT(most, 0.501 * model.max_force);
  EXPECT_GT(heated.duration, found);
}

// Choreo's own trajectories, re-solved from their waypoints under the same model.
TEST(OptimizeDrive, IsNotSlowerThanChoreo) {
  EXPECT_LT(solved(choreo_swerve(pi)).duration, 1.005 * 1.19651);
  EXPECT_LT(solved(choreo_swerve(0.0)).duration, 1.005 * 2.525657212804956);

  DriveProblem of_2024;
  DriveModel& model = of_2024.model;
  model.mass = 74.08797700309194;
  model.moment_of_inertia = 6.0;
  model.wheels = square(0.5 * 0.6349996571001851);
  model.corners = box(0.5 * 0.7619995885202222);
  model.max_force = 1.3560109289617486 * 6.12 / 0.10159994513602963;
  model.max_speed = 4800.0 * pi / 30.0 / 6.12 * 0.10159994513602963;
  of_2024.waypoints = {{.x = 1.375, .y = 5.5, .heading = -3.141},
                       {.x = 3.375, .y = 5.5, .heading = 0.0, .fix_heading = false}};
  of_2024.constraints = {stop(0), stop(-1)};
  EXPECT_LT(solved(of_2024).duration, 1.005 * 1.385241871771899);
  of_2024.waypoints = {
      {.x = 1.3, .y = 5.5, .heading = -3.141},
      {.x = 2.6648950576782227, .y = 6.798984050750732, .heading = -2.4526681614630874},
      {.x = 1.3, .y = 5.5, .heading = -3.141}};
  EXPECT_LT(solved(of_2024).duration, 1.005 * 2.694928576289013);
}

TEST(OptimizeDrive, IsNotSlowerThanChoreosDifferentialDrive) {
  DriveProblem problem;
  problem.model = choreo_robot();
  problem.model.drivetrain = Drivetrain::differential;
  problem.model.friction *= 2.0;
  problem.waypoints = {
      {.x = 1.0, .y = 1.0, .heading = 0.0},
      {.x = 2.0, .y = 1.0, .heading = 0.0, .fix_translation = false, .fix_heading = false},
      {.x = 3.0, .y = 1.0, .heading = 0.0, .fix_translation = true, .fix_heading = false}};
  problem.constraints = {stop(0),
                         stop(-1),
                         {.kind = Kind::max_velocity, .from = 0, .to = 0, .limit = 0.0},
                         {.kind = Kind::max_acceleration, .from = 2, .to = 2, .limit = 10.0},
                         {.kind = Kind::max_angular_velocity, .from = 1, .to = 2, .limit = 0.0},
                         {.kind = Kind::point_at,
                          .from = 2,
                          .to = 2,
                          .x = 0.0,
                          .y = 1.0,
                          .tolerance = 0.017453292519943295,
                          .flip = true},
                         {.kind = Kind::keep_in_circle,
                          .from = 2,
                          .to = 2,
                          .x = 2.9236248955130577,
                          .y = 0.9550507944077252,
                          .radius = 1.0},
                         {.kind = Kind::keep_in_lane, .from = 0, .to = 1, .tolerance = 0.01},
                         {.kind = Kind::keep_out_circle,
                          .from = 2,
                          .to = 2,
                          .x = 3.13802407681942,
                          .y = 3.2159875966608524,
                          .radius = 1.0}};
  EXPECT_LT(solved(problem).duration, 1.005 * 1.33223);
}

// An obstacle a little to the left of the way: the right side is shorter, and is named.
TEST(OptimizeDrive, TriesBothSidesOfAnObstacle) {
  for (const Drivetrain kind :
       {Drivetrain::swerve, Drivetrain::mecanum, Drivetrain::differential}) {
    DriveProblem problem = from_to(choreo_robot(), 4.0, 0.0, 0.0);
    problem.model.drivetrain = kind;
    problem.constraints.push_back(
        {.kind = Kind::keep_out_circle, .from = 0, .to = -1, .x = 2.0, .y = 0.1, .radius = 0.6});
    const DriveSolution s = solved(problem);
    EXPECT_EQ(s.best, "right of keep out circle") << to_string(kind);
    ASSERT_GE(s.attempts.size(), 2U);
    EXPECT_EQ(s.attempts[1].name, "left of keep out circle");
    EXPECT_GT(s.attempts[1].duration, s.duration) << to_string(kind);
  }
}

// Corners of a robot that turns beside an obstacle swing into it between two points: at a hundred
// instants of each interval they keep out all the same.
TEST(OptimizeDrive, KeepsLimitsBetweenPointsToo) {
  for (const Drivetrain kind :
       {Drivetrain::swerve, Drivetrain::mecanum, Drivetrain::differential}) {
    DriveProblem problem = from_to(choreo_robot(), 4.0, 0.0, 2.0);
    problem.model.drivetrain = kind;
    if (kind == Drivetrain::differential) {
      problem.waypoints[1].fix_heading = false;
    }
    problem.constraints.push_back(
        {.kind = Kind::keep_out_circle, .from = 0, .to = -1, .x = 2.0, .y = 0.1, .radius = 0.5});
    const DriveSolution s = solved(problem);
    EXPECT_TRUE(s.found);
    const DriveCheck check = check_drive(problem, s.samples, s.waypoint_samples);
    EXPECT_LT(check.waypoint_error, 1e-3) << to_string(kind);
    for (const DriveViolation& v : check.violations) {
      EXPECT_LT(v.share, 1e-3) << to_string(kind) << " " << v.name;
    }
    // What pushes harder than it may is seen, and by how much.
    std::vector<DriveSample> harder = s.samples;
    harder[1].forces[0](0) = 1.05 * problem.model.force();
    harder[1].forces[0](1) = 0.0;
    const DriveCheck beyond = check_drive(problem, harder, s.waypoint_samples);
    const auto force =
        std::find_if(beyond.violations.begin(), beyond.violations.end(),
                     [](const DriveViolation& v) { return v.name.starts_with("force"); });
    ASSERT_NE(force, beyond.violations.end());
    EXPECT_NEAR(force->share, 0.05, 1e-9);
  }
}

// A crawl of five minutes is longer than a segment may be unless told: the limit is named.
TEST(OptimizeDrive, SaysThatASegmentIsAsLongAsItMayBe) {
  DriveProblem problem = from_to(choreo_robot(), 1.0, 0.0, 0.0);
  problem.constraints.push_back({.kind = Kind::max_velocity, .from = 0, .to = -1, .limit = 0.004});
  const DriveSolution s = optimize_drive(problem, {.longest_segment = 120.0}).value();
  EXPECT_FALSE(s.solved);
  EXPECT_NE(s.message.find("120 s"), std::string::npos) << s.message;
  EXPECT_FALSE(s.samples.empty());
  const DriveSolution longer = optimize_drive(problem, {.longest_segment = 600.0}).value();
  EXPECT_TRUE(longer.solved) << longer.message;
  EXPECT_NEAR(longer.duration, 250.0, 4.0);
}

TEST(OptimizeDrive, KeepsOutOfAndWithinPolygons) {
  DriveProblem problem = from_to(choreo_robot(), 4.0, 0.0, 0.0);
  problem.constraints.push_back({.kind = Kind::keep_out_polygon,
                                 .from = 0,
                                 .to = -1,
                                 .polygon = {Vector2d(1.7, 0.0), Vector2d(2.3, 0.0),
                                             Vector2d(2.3, 3.0), Vector2d(1.7, 3.0)}});
  const double free_side = solved(problem).duration;
  problem.constraints.push_back({.kind = Kind::keep_in_polygon,
                                 .from = 0,
                                 .to = -1,
                                 .polygon = {Vector2d(-1.0, -1.0), Vector2d(5.0, -1.0),
                                             Vector2d(5.0, 1.0), Vector2d(-1.0, 1.0)}});
  EXPECT_GT(solved(problem).duration, free_side - 1e-4);
}

// A stop on the way takes as long as two ways, a point that is passed does not.
TEST(OptimizeDrive, StopsWhereItIsTold) {
  DriveProblem problem = from_to(choreo_robot(), 4.0, 0.0, 0.0);
  const double once = solved(problem).duration;
  problem.waypoints.insert(problem.waypoints.begin() + 1, {.x = 2.0, .y = 0.0, .heading = 0.0});
  EXPECT_NEAR(solved(problem).duration, once, 5e-3);
  problem.waypoints[1].stop = true;
  const DriveSolution s = solved(problem);
  EXPECT_NEAR(s.duration, 2.0 * solved(from_to(choreo_robot(), 2.0, 0.0, 0.0)).duration, 1e-3);
  const DriveSample& middle = s.samples[static_cast<std::size_t>(s.waypoint_samples[1])];
  EXPECT_NEAR(std::hypot(middle.vx, middle.vy), 0.0, 1e-6);
  EXPECT_NEAR(s.waypoint_times[1], middle.time, 1e-12);
}

// What cannot be kept is named, with the place, and the rest is kept.
TEST(OptimizeDrive, SaysWhichConstraintsContradictEachOther) {
  DriveProblem problem = choreo_swerve(pi);
  problem.constraints.push_back({.kind = Kind::keep_in_circle,
                                 .from = 2,
                                 .to = 2,
                                 .x = 5.0,
                                 .y = 5.0,
                                 .radius = 1.0,
                                 .name = "scoring zone"});
  const DriveSolution s = optimize_drive(problem).value();
  EXPECT_FALSE(s.solved);
  EXPECT_TRUE(s.elastic);
  ASSERT_FALSE(s.relaxed.empty());
  EXPECT_EQ(s.relaxed[0].name, "scoring zone");
  EXPECT_EQ(s.relaxed[0].segment, 2);
  EXPECT_GT(s.relaxed[0].amount, 1.0);
  EXPECT_NE(s.message.find("scoring zone"), std::string::npos) << s.message;
  EXPECT_NE(s.message.find("waypoint 2"), std::string::npos) << s.message;

  // A crawl through 1 m in a lane where nobody may move.
  DriveProblem still = from_to(choreo_robot(), 1.0, 0.0, 0.0);
  still.constraints.push_back({.kind = Kind::max_velocity, .from = 0, .to = -1, .limit = 0.0});
  const DriveSolution t = optimize_drive(still).value();
  EXPECT_FALSE(t.solved);
  ASSERT_FALSE(t.relaxed.empty());
  EXPECT_EQ(t.relaxed[0].name, "max velocity");
}

// Whatever is asked for at random is found and holds in the simulation.
TEST(OptimizeDrive, RandomWaypointsAndLimits) {
  Random random(20);
  for (int i = 0; i < 6; ++i) {
    DriveProblem problem;
    problem.model = choreo_robot();
    problem.model.drivetrain = i % 3 == 2 ? Drivetrain::mecanum : Drivetrain::swerve;
    const int count = 3 + i % 3;
    for (int w = 0; w < count; ++w) {
      problem.waypoints.push_back({.x = 1.0 + 8.0 * random.uniform(),
                                   .y = 1.0 + 5.0 * random.uniform(),
                                   .heading = 6.0 * (random.uniform() - 0.5),
                                   .fix_heading = random.uniform() > 0.4});
    }
    problem.constraints = {
        stop(0),
        stop(-1),
        {.kind = Kind::max_velocity, .from = 0, .to = 1, .limit = 1.0 + 2.0 * random.uniform()},
        {.kind = Kind::max_angular_velocity, .from = 1, .to = -1, .limit = 4.0},
        {.kind = Kind::max_acceleration, .from = 0, .to = -1, .limit = 6.0}};
    const DriveSolution s = solved(problem);
    EXPECT_GT(s.duration, 0.2) << i;
  }
}

TEST(OptimizeDrive, RefusesWhatMakesNoSense) {
  const auto message = [](auto&& change) {
    DriveProblem problem = from_to(choreo_robot(), 2.0, 0.0, 0.0);
    change(problem);
    const auto s = optimize_drive(problem);
    return s ? std::string("no error") : to_string(s.error());
  };
  const auto names = [&](auto&& change, const char* what) {
    const std::string text = message(change);
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  using P = DriveProblem;
  names([](P& p) { p.model.mass = 0.0; }, "the mass");
  names([](P& p) { p.model.max_force = std::nan(""); }, "largest force");
  names(
      [](P& p) {
        p.model.wheels = {};
        p.model.wheels.fill(Vector2d::Zero());
      },
      "wheels");
  names(
      [](P& p) {
        p.model.corners.pop_back();
        p.model.corners.pop_back();
      },
      "bumpers");
  names([](P& p) { p.waypoints.pop_back(); }, "waypoints");
  names([](P& p) { p.waypoints[1].x = inf; }, "x of waypoint 1");
  names([](P& p) { p.constraints.push_back(stop(7)); }, "stop point 3");
  names([](P& p) { p.constraints.push_back({.kind = Kind::keep_out_circle, .from = 0, .to = 1}); },
        "radius");
  names([](P& p) { p.constraints.push_back({.kind = Kind::keep_in_lane, .from = 1, .to = 0}); },
        "keep in lane");
  names([](P& p) { p.constraints.push_back({.kind = Kind::keep_out_polygon, .from = 0}); },
        "polygon");
  names([](P& p) { p.constraints.push_back({.kind = Kind::max_velocity, .limit = -1.0}); },
        "limit");
}

TEST(OptimizeDrive, CanBeStoppedAndWatched) {
  int calls = 0;
  const DriveSolution s = optimize_drive(choreo_swerve(pi), {}, [&](const DriveProgress& at) {
                            ++calls;
                            EXPECT_FALSE(at.attempt.empty());
                            return at.iteration >= 3;
                          }).value();
  EXPECT_FALSE(s.solved);
  EXPECT_EQ(s.message, "stopped");
  EXPECT_EQ(calls, 3);
  const DriveSolution t = optimize_drive(choreo_swerve(pi), {.time_limit = 1e-6}).value();
  EXPECT_FALSE(t.solved);
  EXPECT_NE(t.message.find("time"), std::string::npos);
}

}  // namespace
}  // namespace optimize_drive_test
