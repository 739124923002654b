#include <flyball/io/motion/choreo.hpp>
#include <flyball/io/motion/pathplanner.hpp>
#include <flyball/io/motion/wpilib_trajectory.hpp>
#include <flyball/recording/motion_file.hpp>

#include "targets/require.hpp"

namespace {

using namespace flyball;

/// What was read is written byte by byte as it stood.
void require_same(const Expected<std::string>& written, std::string_view text) {
  fuzz::require(written && *written == text, "writing what was read gives the same bytes");
}

void require_motion(const Expected<RobotTrajectory>& motion) {
  if (!motion) {
    return;
  }
  std::vector<double> time;
  std::vector<double> numbers;
  for (const MotionSample& sample : motion->samples) {
    time.push_back(sample.time);
    numbers.insert(numbers.end(), {sample.pose.x(), sample.pose.y()});
  }
  fuzz::require_time(time);
  fuzz::require_finite(numbers);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = fuzz::text_of(data, size);
  if (const auto file = parse_choreo_trajectory(text, "fuzz.traj")) {
    require_same(to_choreo(*file), text);
    require_motion(trajectory_of(*file, "fuzz.traj"));
  }
  if (const auto file = parse_choreo_project(text, "fuzz.chor")) {
    require_same(to_choreo(*file), text);
    for (const ChoreoPath2024& path : file->paths) {
      require_motion(trajectory_of(path, "fuzz.chor"));
    }
  }
  if (const auto file = parse_pathplanner_path(text, "fuzz.path")) {
    require_same(to_pathplanner(*file), text);
  }
  if (const auto file = parse_pathplanner_auto(text, "fuzz.auto")) {
    require_same(to_pathplanner(*file), text);
  }
  if (const auto file = parse_pathplanner_settings_file(text, "settings.json")) {
    require_same(to_pathplanner(*file), text);
  }
  if (const auto file = parse_pathplanner_grid(text, "navgrid.json")) {
    require_same(to_pathplanner(*file), text);
  }
  if (const auto file = parse_wpilib_trajectory(text, "fuzz.json")) {
    require_same(to_wpilib(*file), text);
  }
  require_motion(parse_trajectory(text, "fuzz.json"));
  return 0;
}
