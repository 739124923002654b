#include <string>

#include <nlohmann/json.hpp>

#include "run.hpp"

namespace flyball::test::path_command_test {
namespace {

using Json = nlohmann::json;

class PathCommand : public Command {};

constexpr const char* examples = FLYBALL_EXAMPLES "/";

TEST_F(PathCommand, TimesDrawsAndWrites) {
  const std::string out = std::string(examples) + "paths/out.path";
  const Answer told = run("path " + out + " --out report");
  ASSERT_EQ(told.status, 0) << told.err;
  EXPECT_TRUE(holds(told.out, "What holds it back")) << told.out;
  EXPECT_TRUE(holds(contents(work() / "report/data/path.csv"), "heading (rad)"));
  EXPECT_TRUE(holds(contents(work() / "report/path.hpp"), "std::array<Row, "));
  EXPECT_TRUE(holds(contents(work() / "report/path.traj"), "\"sampleType\":\"Swerve\""));
  EXPECT_TRUE(holds(contents(work() / "report/path.wpilib.json"), "\"holonomicRotation\":180.0"));
  // What it has written it reads again.
  const double length = Json::parse(run("path " + out + " --json").out).at("length").get<double>();
  for (const char* name : {"report/path.traj", "report/path.wpilib.json", "report/data/path.csv"}) {
    const Answer again = run(std::string("path ") + name + " --json");
    ASSERT_EQ(again.status, 0) << name << again.err;
    const Json json = Json::parse(again.out);
    EXPECT_FALSE(json.at("timed").get<bool>());
    EXPECT_NEAR(json.at("length").get<double>(), length, 1e-3 * length) << name;
  }
}

TEST_F(PathCommand, WritesOneFormat) {
  const std::string routine = std::string(examples) + "paths/two_pieces.auto";
  const Answer printed = run("path " + routine + " --to csv");
  ASSERT_EQ(printed.status, 0) << printed.err;
  EXPECT_TRUE(printed.out.starts_with("time (s),x (m),y (m),heading (rad)")) << printed.out;
  const Answer written = run("path " + routine + " --mirror --to choreo --out mirrored.traj");
  ASSERT_EQ(written.status, 0) << written.err;
  const Json file = Json::parse(contents(work() / "mirrored.traj"));
  EXPECT_NEAR(file.at("trajectory").at("samples").at(0).at("x").get<double>(), 17.548 - 7.2, 1e-9);
}

TEST_F(PathCommand, RefusesWithPlaceAndCaret) {
  write("broken.traj",
        "{\"name\": \"a\",\n \"version\": 3, \"params\": {}, \"trajectory\": {\"samples\": [1e]}}");
  const Answer broken = run("path broken.traj");
  EXPECT_EQ(broken.status, 2);
  EXPECT_TRUE(holds(broken.err, "broken.traj:2:59")) << broken.err;
  EXPECT_TRUE(holds(broken.err, "^")) << broken.err;
  const Answer format = run("path broken.traj --to chore");
  EXPECT_EQ(format.status, 2);
  EXPECT_TRUE(holds(format.err, "did you mean \"choreo\"?")) << format.err;
  EXPECT_EQ(run("path nowhere.traj").status, 2);
}

class StatesCommand : public Command {};

TEST_F(StatesCommand, SaysWhetherAMachineIsSafe) {
  const std::string machine = std::string(examples) + "states.toml";
  const Answer safe = run("states " + machine);
  EXPECT_EQ(safe.status, 0) << safe.err << safe.out;
  EXPECT_TRUE(holds(safe.out, "leaves what is allowed")) << safe.out;
  std::string text = contents(machine);
  const std::string order = "to = \"floor\"\norder = [\"height\", \"arm\"]";
  ASSERT_NE(text.find(order), std::string::npos);
  text.replace(text.find(order), order.size(), "to = \"floor\"");
  write("unsafe.toml", text);
  const Answer unsafe = run("states unsafe.toml");
  EXPECT_EQ(unsafe.status, 1);
  EXPECT_TRUE(holds(unsafe.out, "arm in the bumper is broken")) << unsafe.out;
}

}  // namespace
}  // namespace flyball::test::path_command_test
