#include <fstream>

#include <nlohmann/json.hpp>

#include "run.hpp"

namespace flyball::test::plan_command_test {
namespace {

using Json = nlohmann::json;

class PlanCommand : public Command {
 protected:
  [[nodiscard]] std::string space() const { return FLYBALL_EXAMPLES "/space_elevator_arm.toml"; }
  /// A file of one axis and whatever else.
  [[nodiscard]] std::string file(const std::string& rest) const {
    const auto path = work() / "space.toml";
    std::ofstream(path) << "[[axis]]\nname = \"arm\"\nlow = \"-90 deg\"\nhigh = \"90 deg\"\n"
                        << rest;
    return path.string();
  }
};

// Around the chassis, with its errors: the corners move out by 2° and 2 cm.
TEST_F(PlanCommand, FindsAndTimesTheWay) {
  const Answer told = run("plan " + space() + " --json");
  ASSERT_EQ(told.status, 0) << told.err;
  const Json json = Json::parse(told.out);
  ASSERT_EQ(json.at("waypoints").size(), 4U);
  EXPECT_NEAR(json.at("waypoints").at(1).at(1).get<double>(), 2.02, 1e-9);
  EXPECT_EQ(json.at("method"), "corners");
  EXPECT_GT(json.at("duration").get<double>(), 1.0);
  const Json other = Json::parse(run("plan " + space() + " --traversal sequential --json").out);
  EXPECT_NEAR(other.at("other_duration").get<double>(), json.at("duration").get<double>(), 1e-12);
  EXPECT_LE(other.at("duration").get<double>(), json.at("duration").get<double>());
}

TEST_F(PlanCommand, WritesPicturesAndTables) {
  const Answer told =
      run("plan " + std::string(FLYBALL_EXAMPLES) + "/space_scoring_arm.toml --out plan");
  ASSERT_EQ(told.status, 0) << told.err;
  EXPECT_TRUE(holds(contents(work() / "plan/data/motion.csv"), "shoulder velocity (rad/s)"));
  EXPECT_TRUE(holds(contents(work() / "plan/data/waypoints.csv"), "elevator (m),shoulder (rad)"));
  EXPECT_TRUE(
      holds(contents(work() / "plan/plan.hpp"), "inline constexpr std::array<Configuration"));
  EXPECT_TRUE(std::filesystem::exists(work() / "plan/index.html"));
}

// OMPL's trees, our judgement of moves: the same kind of answer, if the command is built with it.
TEST_F(PlanCommand, AsksOmpl) {
  const std::string arm = std::string(FLYBALL_EXAMPLES) + "/space_scoring_arm.toml";
  const Answer told = run("plan " + arm + " --method ompl --json");
  if (told.status == 2) {
    ASSERT_TRUE(holds(told.err, "not in this build")) << told.err;
    GTEST_SKIP() << "built without OMPL";
  }
  ASSERT_EQ(told.status, 0) << told.err;
  const Json json = Json::parse(told.out);
  const Json own = Json::parse(run("plan " + arm + " --json").out);
  EXPECT_EQ(json.at("method"), "ompl");
  EXPECT_GT(json.at("moves").get<double>(), 0.0);
  EXPECT_EQ(json.at("waypoints").front(), own.at("waypoints").front());
  EXPECT_EQ(json.at("waypoints").back(), own.at("waypoints").back());
  EXPECT_GE(json.at("clearance").get<double>(), 0.0);
  // Where there is none it cannot know, and says so.
  const Answer none =
      run("plan " +
          file("[[region]]\nname = \"post\"\nbox = { arm = [\"0 deg\", \"1 deg\"] }\n"
               "[plan]\nstart = [\"-10 deg\"]\ngoal = [\"10 deg\"]\n") +
          " --method ompl --seconds '0.1 s'");
  EXPECT_EQ(none.status, 1);
  EXPECT_TRUE(holds(none.err, "without a path after 0.1 s")) << none.err;
}

TEST_F(PlanCommand, SaysWhyThereIsNoWay) {
  const Answer inside = run("plan " + space() + " --goal '0 deg, 1 m'");
  EXPECT_EQ(inside.status, 1);
  EXPECT_TRUE(holds(inside.err, "the goal is in breach of chassis by")) << inside.err;
  const Answer near = run("plan " + space() + " --goal '46 deg, 1 m'");
  EXPECT_EQ(near.status, 1);
  EXPECT_TRUE(holds(near.err, "the goal, with the tracking error, is in breach of chassis"))
      << near.err;
  const Answer none = run("plan " + file("[[region]]\nname = \"post\"\nbox = { arm = [\"0 deg\", "
                                         "\"1 deg\"] }\n[plan]\nstart = [\"-10 deg\"]\ngoal = "
                                         "[\"10 deg\"]\n"));
  EXPECT_EQ(none.status, 1);
  EXPECT_TRUE(holds(none.err, "boxes prove it")) << none.err;
}

TEST_F(PlanCommand, TellsWhatIsWrongWithAFile) {
  const Answer wrong =
      run("plan " + file("velocity = \"3 m\"\n[[region]]\nbox = { leg = [0, 1] "
                         "}\n[[obstacle]]\nshape = \"cone\"\n[plan]\nstrat = 3\n"));
  EXPECT_EQ(wrong.status, 2);
  for (const char* part : {"space.toml:5:12", "velocity", "\"leg\"", "one of the axes arm", "cone",
                           "disc, box, polygon, half_plane or frame", "did you mean \"start\"?"}) {
    EXPECT_TRUE(holds(wrong.err, part)) << part << "\n" << wrong.err;
  }
  // All at once, each at its place: of axes, bodies, obstacles, holding limits and bounds of the
  // search.
  std::ofstream(work() / "all.toml") << R"([[axis]]
name = "a"
kind = "length"
low = "5 m"
high = "4 m"
[[axis]]
name = "a"
kind = "length"
low = "0 m"
high = "4 m"
error = "3 m"
[plan]
start = ["1 m"]
cells = 100000000
nodes = 1000000000
)";
  const Answer all = run("plan " + (work() / "all.toml").string() + " --method nonsense");
  for (const char* part :
       {"all.toml:4:7: a is from 5 to 4", "all.toml:7:8: name is \"a\", which another axis has",
        "all.toml:11:9: buffer of a is 3 m", "all.toml:13:9: plan.start is of 1 value",
        "plan.goal is missing", "all.toml:14:9: cells is 100000000",
        "all.toml:15:9: nodes is 1000000000", "or ompl where it is built with it"}) {
    EXPECT_TRUE(holds(all.err, part)) << part << "\n" << all.err;
  }
  const Answer parts =
      run("plan " + file("[[joint]]\nname = \"j\"\naxis = \"arm\"\n"
                         "[[body]]\nname = \"b\"\njoint = \"j\"\nradius = \"-1 m\"\n"
                         "[[obstacle]]\nname = \"o\"\nshape = \"frame\"\n"
                         "points = [[\"0 m\", \"0 m\"], [\"1 m\", \"0 m\"], [\"0.5 m\", "
                         "\"0.1 m\"], [\"1 m\", \"1 m\"]]\n"
                         "[[holding]]\njoint = \"j\"\nmost = \"-3 N m\"\n"
                         "[plan]\nstart = [\"0 deg\"]\ngoal = [\"1 deg\"]\n"));
  EXPECT_EQ(parts.status, 2);
  for (const char* part : {"space.toml:8:1: b.radius is -1 m", "space.toml:12:1: o is a frame",
                           "space.toml:16:1: holding limit is -3"}) {
    EXPECT_TRUE(holds(parts.err, part)) << part << "\n" << parts.err;
  }
  std::ofstream(work() / "bow.toml") << R"([[axis]]
name = "a"
kind = "length"
low = "0 m"
high = "4 m"
[[axis]]
name = "b"
kind = "length"
low = "0 m"
high = "4 m"
[[region]]
name = "wall"
polygon = { axes=["a","b"], points=[["1 m","0 m"],["2 m","1 m"],["1 m","1 m"],["2 m","0 m"]] }
[plan]
start = ["0 m", "0 m"]
goal = ["3 m", "3 m"]
)";
  EXPECT_TRUE(holds(run("plan " + (work() / "bow.toml").string()).err, "cross or touch"));
  EXPECT_TRUE(holds(run("plan " + space() + " --start '1 rad, 1 m, 2 m'").err,
                    "--start is of 3 values; it must be of 2"));
  EXPECT_EQ(run("plan nothing.toml").status, 2);
  EXPECT_EQ(run("plan " + space() + " --method teleport").status, 2);
  EXPECT_EQ(run("plan " + space() + " --start '1 rad'").status, 2);
  EXPECT_EQ(run("plan " + space() + " --seconds '0 s'").status, 2);
}

}  // namespace
}  // namespace flyball::test::plan_command_test
