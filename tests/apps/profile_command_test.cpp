#include <cmath>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "run.hpp"

namespace flyball::test::profile_command_test {
namespace {

using Json = nlohmann::json;

class ProfileCommand : public Command {
 protected:
  [[nodiscard]] Json answer(const std::string& arguments) const {
    const Answer answer = run("profile " + arguments + " --json");
    EXPECT_EQ(answer.status, 0) << arguments << "\n" << answer.err;
    const Json json = Json::parse(answer.out, nullptr, false);
    EXPECT_FALSE(json.is_discarded()) << answer.out;
    return json;
  }
};

constexpr const char* limited = "--to 1.2m --velocity 1.5m/s --acceleration 3m/s^2 ";

// 1.2 m: 0.5 s up and 0.5 s down take 0.75 m, the rest 0.3 s.
TEST_F(ProfileCommand, TellsTheMotionAndWhy) {
  const Answer told = run(std::string("profile ") + limited);
  ASSERT_EQ(told.status, 0) << told.err;
  EXPECT_TRUE(holds(told.out, "1.3 s")) << told.out;
  EXPECT_TRUE(holds(told.out, "Nothing rings")) << told.out;
  const Json json = answer(limited);
  EXPECT_EQ(json.at("kind"), "trapezoid");
  EXPECT_NEAR(json.at("duration").get<double>(), 1.3, 1e-12);
  EXPECT_EQ(json.at("time").size(), 66U);  // each 20 ms and the end
  EXPECT_EQ(json.at("position").back().get<double>(), 1.2);
}

// From 0.5 m/s to -1 m/s with 3 m/s²: half a second.
TEST_F(ProfileCommand, ChangesAVelocity) {
  const std::string change =
      "--start-velocity 0.5m/s --to-velocity -1m/s --velocity 1.5m/s --acceleration 3m/s^2 ";
  for (const char* kind : {"trapezoid", "s-curve", "parabolic", "stepper"}) {
    const Json json = answer(change + "--kind " + kind);
    EXPECT_EQ(json.at("velocity").back().get<double>(), -1.0) << kind;
    EXPECT_GE(json.at("duration").get<double>(), 0.5 * (1.0 - 1e-12)) << kind;
    if (std::string(kind) == "trapezoid") {
      EXPECT_NEAR(json.at("duration").get<double>(), 0.5, 1e-12);
      EXPECT_NEAR(json.at("position").back().get<double>(), -0.125, 1e-12);
    }
  }
  const Json motor = answer("--to-velocity 1m/s --kv 4 --ka 0.4");
  EXPECT_EQ(motor.at("kind"), "exponential");
  EXPECT_NEAR(motor.at("duration").get<double>(), 0.1 * std::log(1.5), 1e-12);
  EXPECT_EQ(run("profile " + change + "--kind minimum-jerk").status, 2);
  EXPECT_EQ(run("profile " + change + "--to 1m").status, 2);
  EXPECT_EQ(run("profile --to-velocity 2m/s --velocity 1m/s --acceleration 1m/s^2").status, 2);
}

TEST_F(ProfileCommand, Kinds) {
  const std::string limits = limited;
  const Json s_curve = answer(limits + "--kind s-curve --ramp 0.1s");
  EXPECT_NEAR(s_curve.at("duration").get<double>(), 1.4, 1e-9);
  EXPECT_NEAR(s_curve.at("limits").at("jerk").get<double>(), 30.0, 1e-9);
  EXPECT_EQ(answer(limits + "--resonance 4Hz").at("kind"), "s-curve");
  EXPECT_EQ(answer(limits + "--step-motor").at("kind"), "parabolic");
  EXPECT_EQ(answer("--to 2m --kv 4 --ka 0.4").at("kind"), "exponential");
  // A turret goes the short way from 350° to 10°.
  const Json turret = answer(
      "--angle --continuous --from 350deg --to 10deg --velocity 3rad/s --acceleration 9rad/s^2");
  EXPECT_EQ(turret.at("unit"), "rad");
  EXPECT_NEAR(turret.at("position").back().get<double>(), 370.0 * std::acos(-1.0) / 180.0, 1e-12);
}

// What a kind does not take is refused, and a velocity that is not reached: nothing is passed over.
TEST_F(ProfileCommand, NothingThatIsAskedForIsPassedOver) {
  for (const auto& [options, named] :
       {std::pair("--goal-velocity 5m/s", "goal_velocity"),
        {"--kind trapezoid --start-acceleration 3m/s^2", "start_acceleration"},
        {"--kind trapezoid --ramp 0.5s", "ramp"},
        {"--kind trapezoid --jump 0.2m/s", "jump"},
        {"--kind parabolic --deceleration 3m/s^2", "deceleration"}}) {
    const Answer told = run(std::string("profile ") + limited + options);
    EXPECT_EQ(told.status, 2) << options;
    EXPECT_TRUE(holds(told.err, named)) << options << "\n" << told.err;
  }
  EXPECT_EQ(answer(std::string(limited) + "--ramp 0.1s").at("kind"), "s-curve");
  const Json moving = answer(std::string(limited) + "--goal-velocity 1m/s");
  EXPECT_NEAR(moving.at("velocity").back().get<double>(), 1.0, 1e-9);
}

TEST_F(ProfileCommand, WritesPictureAndTables) {
  const Answer told = run(std::string("profile ") + limited + "--kind s-curve --out lift");
  ASSERT_EQ(told.status, 0) << told.err;
  EXPECT_TRUE(holds(contents(work() / "lift/data/profile.csv"), "position (m)"));
  const std::string header = contents(work() / "lift/profile.hpp");
  EXPECT_TRUE(holds(header, "inline constexpr std::array<Row, "));
  EXPECT_TRUE(holds(header, "1.2, 0, 0}"));
}

// The picture and the JSON have the instants at which full voltage turns round, not the row after.
TEST_F(ProfileCommand, ChangesAreExact) {
  const Json json = answer("--to 2m --kv 4 --ka 0.4 --kind exponential");
  const auto changes = json.at("changes").get<std::vector<double>>();
  ASSERT_EQ(changes.size(), 2U);  // up, down: the goal is too near for a cruise
  EXPECT_EQ(changes[0], 0.0);
  // x'' = 10 (3 - x') up, -10 (3 + x') down: over 2 m the peak is near 3 m/s, and braking from it
  // takes ln(2)/10 s.
  EXPECT_NEAR(json.at("duration").get<double>() - changes[1], 0.1 * std::log(2.0), 1e-3);
  EXPECT_NEAR(json.at("peak_acceleration").get<double>(), 60.0, 0.5);  // as braking begins
}

constexpr const char* two_axes =
    "[[axis]]\n"
    "name = \"lift\"\n"
    "to = \"1.2 m\"\n"
    "velocity = \"1.5 m/s\"\n"
    "acceleration = \"3 m/s^2\"\n"
    "ramp = \"0.1 s\"\n"
    "\n"
    "[[axis]]\n"
    "name = \"arm\"\n"
    "angle = true\n"
    "to = \"30 deg\"\n"
    "velocity = \"3 rad/s\"\n"
    "acceleration = \"10 rad/s^2\"\n"
    "ramp = \"0.1 s\"\n";

// The lift alone takes 1.4 s (0.5 s up, 0.3 s, 0.5 s down and a ramp); the arm waits for it.
TEST_F(ProfileCommand, SeveralAxes) {
  write("axes.toml", two_axes);
  const Json json = answer("axes.toml");
  EXPECT_EQ(json.at("schema"), "flyball.axes/1");
  EXPECT_NEAR(json.at("duration").get<double>(), 1.4, 1e-9);
  EXPECT_EQ(json.at("slowest"), "lift");
  EXPECT_EQ(json.at("synchronize"), "time");
  EXPECT_LT(json.at("axes")[1].at("alone").get<double>(), 1.0);
  EXPECT_EQ(json.at("columns").at("lift position").back().get<double>(), 1.2);
  EXPECT_NEAR(json.at("columns").at("arm position").back().get<double>(), std::acos(-1.0) / 6.0,
              1e-12);
  // In phase each has at any time the same share of its way behind it.
  const Json line = answer("axes.toml --synchronize phase --period 50ms");
  EXPECT_EQ(line.at("synchronize"), "phase");
  EXPECT_EQ(line.at("slowest"), "lift");  // whose limits are all the tighter ones
  const auto lift = line.at("columns").at("lift position").get<std::vector<double>>();
  const auto arm = line.at("columns").at("arm position").get<std::vector<double>>();
  ASSERT_EQ(lift.size(), arm.size());
  for (std::size_t i = 0; i < lift.size(); ++i) {
    EXPECT_NEAR(lift[i] / 1.2, arm[i] / (std::acos(-1.0) / 6.0), 1e-9);
  }
  EXPECT_NEAR(answer("axes.toml --least 3s").at("duration").get<double>(), 3.0, 1e-9);
  // Not on a line: said, and in time.
  write("bent.toml", std::string(two_axes) + "start_velocity = \"1 rad/s\"\n");
  const Answer bent = run("profile bent.toml --synchronize phase");
  EXPECT_EQ(bent.status, 0) << bent.err;
  EXPECT_TRUE(holds(bent.out, "do not lie on it")) << bent.out;
  const Answer told = run("profile axes.toml --out axes");
  ASSERT_EQ(told.status, 0) << told.err;
  EXPECT_TRUE(holds(contents(work() / "axes/data/profile.csv"), "arm acceleration (rad/s²)"));
  EXPECT_TRUE(holds(contents(work() / "axes/profile.hpp"), "inline constexpr int axes = 2;"));
  for (const char* picture : {"profile_angles.svg", "profile_lengths.svg"}) {
    EXPECT_FALSE(contents(work() / "axes/pictures" / picture).empty()) << picture;
  }
  EXPECT_TRUE(holds(contents(work() / "axes/data/profile.wpilog"), "profile/arm/acceleration"));
}

// TOML has several spellings of a list of tables.
TEST_F(ProfileCommand, AxesAsTomlSpellsThem) {
  write("inline.toml",
        "axis = [{name = \"lift\", to = \"1.2 m\", velocity = \"1.5 m/s\", acceleration = "
        "\"3 m/s^2\", ramp = \"0.1 s\"},\n"
        "  {to = \"30 deg\", angle = true, velocity = \"3 rad/s\", acceleration = \"10 "
        "rad/s^2\"}]\n");
  write("spaced.toml",
        "[profile]\nleast = \"2 s\"\n  [[ axis ]] # the lift\nname = \"\"\"\n[[axis]]\"\"\"\n"
        "to = \"1.2 m\"\nvelocity = \"1.5 m/s\"\nacceleration = \"3 m/s^2\"\n");
  EXPECT_NEAR(answer("inline.toml").at("duration").get<double>(), 1.4, 1e-9);
  const Json spaced = answer("spaced.toml");
  EXPECT_NEAR(spaced.at("duration").get<double>(), 2.0, 1e-9);
  EXPECT_EQ(spaced.at("axes")[0].at("name"), "[[axis]]");
}

TEST_F(ProfileCommand, SaysWhatIsWrongWithAxes) {
  const auto refused = [&](const std::string& text, const std::string& arguments,
                           std::string_view words) {
    write("axes.toml", text);
    const Answer answer = run("profile axes.toml" + arguments);
    EXPECT_EQ(answer.status, 2) << text << "\n" << answer.err;
    EXPECT_TRUE(holds(answer.err, words)) << text << "\n" << answer.err;
  };
  const std::string two = two_axes;
  refused("", "", "[[axis]]");
  refused("[[axis]]\nto = \"1 m\"\n", "", "velocity of axis 1");
  refused(two + "velosity = \"1 m\"\n", "", "axes.toml:15:1");
  refused(two + "reverse_velocity = \"1 m/s\"\n", "", "axes.toml:15:20");
  refused(two +
              "[[axis]]\nname = \"arm\"\nto = \"1 m\"\nvelocity = \"1 m/s\"\n"
              "acceleration = \"1 m/s^2\"\n",
          "", "twice");
  refused(two + "[profile]\nsynchronize = \"space\"\n", "", "time, phase");
  refused(two + "[axes]\nx = 1\n", "", "axes.toml:15:");
  refused(two + "[[axis]\n", "", "axes.toml:15:");
  refused(two, " --to 1m", "--to");
  refused(two, " --period 1us", "a million periods");
  std::string many;
  for (int i = 0; i < 20; ++i) {
    many += two;
  }
  refused(many, "", "at most 16");
  refused(two, " --synchronize space", "time, phase");
  refused("axis = 1\n", "", "axes.toml:1:8");
  refused("[axis]\nto = \"1 m\"\n", "", "[[axis]]");
  const Answer alone = run(std::string("profile ") + limited + "--synchronize phase");
  EXPECT_EQ(alone.status, 2);
  EXPECT_TRUE(holds(alone.err, "AXES.toml")) << alone.err;
}

TEST_F(ProfileCommand, SaysWhatIsWrong) {
  const auto refused = [&](const std::string& arguments, std::string_view words) {
    const Answer answer = run("profile " + arguments);
    EXPECT_EQ(answer.status, 2) << arguments << "\n" << answer.err;
    EXPECT_TRUE(holds(answer.err, words)) << arguments << "\n" << answer.err;
  };
  refused("--to 1m", "--velocity");
  refused("--to 1m --velocity 0m/s --acceleration 1m/s^2", "velocity");
  refused(std::string(limited) + "--kind s-kurve", "s-curve");
  refused(std::string(limited) + "--kind exponential", "--kv");
  refused("--to 2m --kv 4 --ka 0.4 --kind exponential --acceleration 3m/s^2", "acceleration");
  refused("--to 1m --kv 4", "kA");
  refused("--to 1m --kv 4 --ka 0.4 --kg 13", "gravity");
  refused("--to 90deg --velocity 1.5m/s --acceleration 3m/s^2", "deg");
  refused("--to 1km --velocity 1mm/s --acceleration 3m/s^2 --period 0.1ms", "a million periods");
}

}  // namespace
}  // namespace flyball::test::profile_command_test
