#include <cmath>

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

TEST_F(ProfileCommand, WritesPictureAndTables) {
  const Answer told = run(std::string("profile ") + limited + "--kind s-curve --out lift");
  ASSERT_EQ(told.status, 0) << told.err;
  EXPECT_TRUE(holds(contents(work() / "lift/data/profile.csv"), "position (m)"));
  const std::string header = contents(work() / "lift/profile.hpp");
  EXPECT_TRUE(holds(header, "inline constexpr std::array<Row, "));
  EXPECT_TRUE(holds(header, "1.2, 0, 0}"));
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
  refused("--to 1m --kv 4", "kA");
  refused("--to 1m --kv 4 --ka 0.4 --kg 13", "gravity");
  refused("--to 90deg --velocity 1.5m/s --acceleration 3m/s^2", "deg");
  refused("--to 1km --velocity 1mm/s --acceleration 3m/s^2 --period 0.1ms", "a million periods");
}

}  // namespace
}  // namespace flyball::test::profile_command_test
