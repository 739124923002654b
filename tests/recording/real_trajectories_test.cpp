// Files that teams have published.
#include <string>

#include <gtest/gtest.h>

#include <flyball/core/errors.hpp>
#include <flyball/recording/trajectory_file.hpp>

namespace flyball::real_trajectories_test {
namespace {

TEST(TrajectoryFile, ARealOneOfPathPlanner2023) {
  const std::string folder = FLYBALL_TEST_DATA;
  const auto read =
      read_trajectory(folder + "/wpilib-trajectory/firebears-frc_New_Path.wpilib.json");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_GT(read->samples.size(), 50u);
  // Its velocities are the changes of its poses: over a whole it adds up.
  Eigen::Vector2d moved = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i + 1 < read->samples.size(); ++i) {
    const MotionSample& a = read->samples[i];
    const MotionSample& b = read->samples[i + 1];
    moved += 0.5 * (b.time - a.time) * (a.velocity + b.velocity);
  }
  const Eigen::Vector2d whole =
      read->samples.back().pose.translation() - read->samples.front().pose.translation();
  EXPECT_LT((moved - whole).norm(), 0.02 * whole.norm());
}

TEST(PathPlannerSettings, ARealOne) {
  const std::string folder = FLYBALL_TEST_DATA;
  const auto read = read_pathplanner_settings(folder + "/pathplanner/pp2025_settings.json");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_TRUE(read->diagnostics.empty());
  EXPECT_EQ(read->modules[3], Eigen::Vector2d(-0.273, -0.273));
}

}  // namespace
}  // namespace flyball::real_trajectories_test
