#include <flyball/io/motion/wpilib_trajectory.hpp>

#include <filesystem>

#include <gtest/gtest.h>

#include <flyball/io/file.hpp>

namespace flyball::wpilib_trajectory_test {
namespace {

const std::string list_text =
    R"([{"acceleration":1.0,"curvature":0.5,"pose":{"rotation":{"radians":0.25},"translation":{"x":1.0,"y":2}},"time":0.0,"velocity":0.0,"mine":[1,2]},
{"time":1.0,"velocity":1.0,"pose":{"translation":{"x":1.5,"y":2.0},"rotation":{"radians":0.5}}}])";

const std::string object_text =
    R"({"samples": [{"time": 0.0, "pose": {"translation": {"x": 0.0, "y": 0.0}, "rotation": {"value": 0.0}}, "velocity": {"vx": 1.0, "vy": 0.0, "omega": 0.5}, "acceleration": {"ax": 0.25, "ay": 0.0, "alpha": 0.0}, "leftVelocity": 0.8, "rightVelocity": 1.2}]})";

std::string refusal_of(const std::string& text) {
  const auto file = parse_wpilib_trajectory(text, "a.json");
  return file ? "read" : to_string(static_cast<const Error&>(file.error()));
}

TEST(WpilibTrajectory, WritingWhatWasReadIsTheSameBytes) {
  for (const std::string& text : {list_text, object_text, std::string("[]\n")}) {
    const auto file = parse_wpilib_trajectory(text, "a.json");
    ASSERT_TRUE(file) << to_string(file.error());
    EXPECT_EQ(to_wpilib(*file).value(), text);
  }
  const auto list = parse_wpilib_trajectory(list_text, "a.json").value();
  EXPECT_EQ(list.states[0].angle, 0.25);
  EXPECT_EQ(list.states[0].curvature, 0.5);
  EXPECT_EQ(list.states[1].velocity, 1.0);
  const auto object = parse_wpilib_trajectory(object_text, "a.json").value();
  EXPECT_EQ(object.states[0].speeds.omega, 0.5);
  EXPECT_EQ(object.states[0].accelerations->ax, 0.25);
  EXPECT_EQ(object.states[0].right_velocity, 1.2);
}

TEST(WpilibTrajectory, WritesAFileOfItsOwn) {
  WpilibTrajectory file;
  file.states.resize(2);
  file.states[1].time = 1.5;
  file.states[1].x = 2.0;
  file.states[1].velocity = 1.0;
  for (const bool is_object : {false, true}) {
    file.is_object = is_object;
    const std::string text = to_wpilib(file).value();
    const auto again = parse_wpilib_trajectory(text, "a.json");
    ASSERT_TRUE(again) << to_string(again.error()) << text;
    EXPECT_EQ(again->states[1].x, 2.0);
    EXPECT_EQ(again->states[1].time, 1.5);
    EXPECT_EQ(to_wpilib(*again).value(), text);
  }
}

TEST(WpilibTrajectory, SaysWhatIsWrongAndWhere) {
  EXPECT_EQ(refusal_of("{\"a\": 1}"),
            "a.json: the JSON is an object of a; it must be a WPILib trajectory: a list of {time, "
            "velocity, acceleration, curvature, pose}");
  EXPECT_EQ(refusal_of("[1]"), "a.json:1:2: [0] is 1; it must be an object");
  EXPECT_EQ(refusal_of("[{\"time\": 0}]"), "a.json:1:2: [0].pose is missing");
}

TEST(WpilibTrajectory, RealFiles) {
  const std::string folder = FLYBALL_TEST_DATA "/wpilib-trajectory";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP();
  }
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string text = read_file(entry.path().string()).value();
    const auto file = parse_wpilib_trajectory(text, entry.path().string());
    ASSERT_TRUE(file) << to_string(file.error());
    EXPECT_GT(file->states.size(), 50U);
    EXPECT_EQ(to_wpilib(*file).value(), text);
  }
}

}  // namespace
}  // namespace flyball::wpilib_trajectory_test
