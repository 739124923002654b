// The followers' headers, compiled and run against the library's objects.
#include <flyball/export/drive_follower.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include <flyball/core/random.hpp>

namespace flyball::exports::drive_follower_test {
namespace {

namespace fs = std::filesystem;
constexpr double trackwidth = 0.6;

struct Input {
  Pose2d pose{};
  double heading = 0.0;
  Eigen::Vector2d sides = Eigen::Vector2d::Zero();
  Pose2d reference{};
  double reference_heading = 0.0;
  double v = 0.0, omega = 0.0, v_next = 0.0, omega_next = 0.0;

  [[nodiscard]] TrackingPoint now() const { return {reference, {v, 0.0, omega}}; }
  [[nodiscard]] TrackingPoint next() const { return {reference, {v_next, 0.0, omega_next}}; }
};

struct Output {
  Eigen::Vector2d voltage = Eigen::Vector2d::Zero();
  int status = 0;
};

/// Near its reference and far from it, slow and fast, forward and back, and with every number once
/// not one.
std::vector<Input> inputs() {
  std::vector<Input> all;
  Random random(7);
  const auto add = [&](double x, double y, double heading, const Eigen::Vector2d& sides, double x_r,
                       double y_r, double heading_r, double v, double omega) {
    all.push_back({Pose2d(x, y, heading), heading, sides, Pose2d(x_r, y_r, heading_r), heading_r, v,
                   omega, v + 0.05 * random.normal(), omega + 0.05 * random.normal()});
  };
  for (int i = 0; i < 4000; ++i) {
    const double off = i % 4 == 0 ? 3.0 : 0.1;
    const double fast = i % 5 == 0 ? 0.08 : i % 5 == 1 ? 6.0 : 2.0;
    const double x = random.normal();
    const double y = random.normal();
    const double heading = 4.0 * random.normal();
    const double v = fast * random.normal();
    const double omega = i % 3 == 0 ? 0.0 : random.normal();
    add(x, y, heading, {v + 0.2 * random.normal(), v + 0.2 * random.normal()},
        x + off * random.normal(), y + off * random.normal(), heading + off * random.normal(), v,
        omega);
  }
  add(1.0, 2.0, 0.5, {0.0, 0.0}, 1.0, 2.0, 0.5, 0.0, 0.0);
  const Input good = all.front();
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e200}) {
    for (int which = 0; which < 10; ++which) {
      Input in = good;
      // A heading of 1e200 is an angle as good as any.
      const double angle = bad == 1e200 ? -std::numeric_limits<double>::infinity() : bad;
      switch (which) {
        case 0:
          in.pose = Pose2d(bad, 0.0, in.heading);
          break;
        case 1:
          in.pose = Pose2d(0.0, bad, in.heading);
          break;
        case 2:
          in.heading = angle;
          in.pose = Pose2d(0.0, 0.0, angle);
          break;
        case 3:
          in.sides(0) = bad;
          break;
        case 4:
          in.sides(1) = -bad;
          break;
        case 5:
          in.reference = Pose2d(bad, 0.0, in.reference_heading);
          break;
        case 6:
          in.reference_heading = angle;
          in.reference = Pose2d(0.0, 0.0, angle);
          break;
        case 7:
          in.v = bad;
          break;
        case 8:
          in.omega = bad;
          break;
        default:
          in.v_next = bad;
          break;
      }
      all.push_back(in);
    }
  }
  return all;
}

mechanisms::DifferentialDrive drive() {
  auto model = mechanisms::differential_drive(mechanisms::DriveGains{
      .kV_linear = 2.9, .kA_linear = 0.42, .kV_angular = 2.7, .kA_angular = 0.31});
  EXPECT_TRUE(model);
  model->kS_left = 0.35;
  model->kS_right = 0.41;
  return *model;
}

/// Compiles a header with a driver that reads inputs and answers outputs.
std::vector<Output> run(const std::string& header, const std::vector<Input>& inputs) {
  const fs::path folder =
      fs::path(testing::TempDir()) / ("drive_follower_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  std::ofstream(folder / "follower.hpp") << header;
  std::ofstream(folder / "main.cpp") << R"(#include "follower.hpp"
#include <cstdio>
static_assert(noexcept(follower::calculate({}, {}, {}, {}, {})), "");
int main() {
  double n[11];
  while (true) {
    for (double& value : n) {
      if (std::scanf("%lf", &value) != 1) {
        return 0;
      }
    }
    const follower::Command c = follower::calculate({n[0], n[1], n[2]}, {n[3], n[4]},
                                                    {n[5], n[6], n[7]}, {n[8], n[9]},
                                                    {n[10], n[9]});
    std::printf("%a %a %d\n", c.voltage.left, c.voltage.right, static_cast<int>(c.status));
  }
}
)";
  {
    std::ofstream file(folder / "in");
    for (const Input& in : inputs) {
      for (const double value :
           {in.pose.x(), in.pose.y(), in.heading, in.sides(0), in.sides(1), in.reference.x(),
            in.reference.y(), in.reference_heading, in.v, in.omega, in.v_next}) {
        char text[64];
        std::snprintf(text, sizeof text, "%a ", value);
        file << text;
      }
      file << '\n';
    }
  }
  const std::string line = "cd '" + folder.string() + "' && (" + FLYBALL_CXX +
                           " -std=c++17 -O2 -ffp-contract=off -fno-exceptions -Wall -Wextra "
                           "-Wpedantic -Wconversion -Wshadow -Werror main.cpp -o main && "
                           "./main < in > out) > log 2>&1";
  if (std::system(line.c_str()) != 0) {
    std::ifstream log(folder / "log");
    ADD_FAILURE() << std::string(std::istreambuf_iterator<char>(log), {});
  }
  std::vector<Output> outputs;
  std::ifstream file(folder / "out");
  std::string left;
  std::string right;
  int status = 0;
  while (file >> left >> right >> status) {
    outputs.push_back(
        {{std::strtod(left.c_str(), nullptr), std::strtod(right.c_str(), nullptr)}, status});
  }
  fs::remove_all(folder);
  return outputs;
}

/// Each output of the header within rounding of the library's, with its status; every status seen.
template <class Law>
void expect_same(const std::string& header, Law law) {
  std::vector<Input> given = inputs();
  for (Input& in : given) {
    in.omega_next = in.omega;
  }
  const std::vector<Output> outputs = run(header, given);
  ASSERT_EQ(outputs.size(), given.size());
  int seen[4] = {};
  for (std::size_t k = 0; k < given.size(); ++k) {
    const Output wanted = law(given[k]);
    EXPECT_LE((outputs[k].voltage - wanted.voltage).norm(), 1e-11) << k;
    EXPECT_LE(outputs[k].voltage.cwiseAbs().maxCoeff(), 11.0) << k;
    EXPECT_EQ(outputs[k].status, wanted.status) << k;
    ++seen[outputs[k].status];
  }
  for (const int times : seen) {
    EXPECT_GT(times, 0);
  }
}

/// A cascade as `flyball drive` runs it.
template <class Follower>
void expect_cascade(const Follower& follower) {
  const auto tracker = DriveVelocityTracker::create(drive(), {.voltage_limit = 11.0});
  ASSERT_TRUE(tracker);
  expect_same(drive_follower_header(follower, *tracker, trackwidth, "a \\ drive\n#error"),
              [&](const Input& in) {
                const FollowerCommand asked = follower.calculate(in.pose, in.now());
                const Eigen::Vector2d sides = side_velocities(asked.speeds, trackwidth);
                const Eigen::Vector2d gain = side_velocities(in.next().speeds, trackwidth) -
                                             side_velocities(in.now().speeds, trackwidth);
                const DriveCommand command = tracker->calculate(in.sides, sides, sides + gain);
                return Output{command.voltage,
                              static_cast<int>(std::min(asked.status, command.status))};
              });
}

TEST(DriveFollowerHeader, Ramsete) {
  const auto follower = RamseteFollower::create(
      {.limits = {.angular_velocity = 5.0, .wheel_velocity = 4.0, .trackwidth = trackwidth}});
  ASSERT_TRUE(follower);
  expect_cascade(*follower);
}

TEST(DriveFollowerHeader, LtvUnicycle) {
  const auto follower = LtvUnicycleFollower::create(
      {.limits = {.velocity = 3.5, .wheel_velocity = 4.0, .trackwidth = trackwidth}});
  ASSERT_TRUE(follower);
  expect_cascade(*follower);
}

TEST(DriveFollowerHeader, LtvUnicycleAsTheBookHasItAtRest) {
  const auto follower =
      LtvUnicycleFollower::create({.heading_tolerance = std::numeric_limits<double>::infinity(),
                                   .low_speed = {.cross_track = LowSpeed::CrossTrack::holds},
                                   .farthest_error = std::numeric_limits<double>::infinity()});
  ASSERT_TRUE(follower);
  expect_cascade(*follower);
}

TEST(DriveFollowerHeader, ScheduledLtvDrive) {
  for (const auto low : {LowSpeed::CrossTrack::fades, LowSpeed::CrossTrack::holds}) {
    const auto follower = LtvDriveFollower::create(
        drive(), Length(trackwidth),
        {.voltage_limit = 11.0, .low_speed = {.cross_track = low}, .source = GainSource::schedule});
    ASSERT_TRUE(follower);
    expect_same(drive_follower_header(*follower, "drive.toml"), [&](const Input& in) {
      const DriveCommand command = follower->calculate({in.pose, in.sides(0), in.sides(1)},
                                                       drive_state(in.now(), trackwidth),
                                                       drive_state(in.next(), trackwidth));
      return Output{command.voltage, static_cast<int>(command.status)};
    });
  }
}

}  // namespace
}  // namespace flyball::exports::drive_follower_test
