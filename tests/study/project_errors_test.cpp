// Everything that is wrong with a project file is told, and where it stands.
#include <cstdio>
#include <fstream>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/study/project.hpp>

namespace flyball::study::project_errors_test {
namespace {

std::vector<std::string> messages(const Errors& errors) {
  std::vector<std::string> all;
  for (const QuotedError& error : errors.all()) {
    all.push_back(to_string(error));
  }
  return all;
}

TEST(ProjectErrors, TellsEveryErrorOfAFileInItsOrder) {
  const auto project = parse_project(R"([mechanism]
type = "elevator"
motor = "NEP"
gearng = 10.0
mass = "8 m"

[mechanism.motors]
[controler]
period = "20 ms"
[controller]
period = "0 ms"
state_tolerance = ["2 cm", "0.4 m"]
delay = 10
[profile]
goal = true
seed = "one"
)",
                                     "p.toml");
  ASSERT_FALSE(project);
  EXPECT_EQ(
      messages(project.error()),
      (std::vector<std::string>{
          // Not gearing: that it is misspelt is told.
          "p.toml:1:1: mechanism.drum_radius is missing; an elevator needs it, for example "
          "drum_radius = \"1 in\"",
          "p.toml:3:9: motor is \"NEP\", which is not in the table; did you mean "
          "\"NEO\"?",
          "p.toml:4:1: mechanism.gearng is not a key of [mechanism]; did you mean "
          "\"gearing\"?",
          "p.toml:5:8: mechanism.mass is \"8 m\", a length; it must be a mass such as \"8 "
          "kg\" or \"18 lb\"",
          "p.toml:7:12: mechanism.motors is not a key of [mechanism]; did you mean "
          "\"motor\"?",
          "p.toml:8:2: controler is not a section that is known; did you mean "
          "\"controller\"?",
          "p.toml:11:10: controller.period is 0 s; it must be greater than zero",
          "p.toml:12:19: controller.state_tolerance is \"0.4 m\", a length; it must be a "
          "velocity such as \"1.5 m/s\"",
          "p.toml:13:9: controller.delay is 10, without a unit; it must be a text with number "
          "and unit, such as \"10 s\"",
          "p.toml:15:8: profile.goal is true; it must be a text with number and unit, such as "
          "\"1 m\"",
          "p.toml:16:8: profile.seed is \"one\"; it must be a whole number, 0 or greater"}));
  // As an error it is the first of them.
  EXPECT_EQ(to_string(project.error()), to_string(project.error().all().front()));
  EXPECT_EQ(project.error().all()[3].excerpt, "    5 | mass = \"8 m\"\n      |        ^^^^^");
  EXPECT_EQ(project.error().all()[2].excerpt, "    4 | gearng = 10.0\n      | ^^^^^^");
}

TEST(ProjectErrors, ThePlaceAndTheCaretAreOfWhatIsWrong) {
  const auto project = parse_project("[mechanism]\ntype = \"elevater\"\nmoter  = 2\n", "p.toml");
  ASSERT_FALSE(project);
  const auto& all = project.error().all();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].where(), "p.toml:2:8");
  EXPECT_EQ(all[0].excerpt, "    2 | type = \"elevater\"\n      |        ^^^^^^^^^^");
  EXPECT_EQ(all[1].where(), "p.toml:3:1");
  EXPECT_EQ(all[1].excerpt, "    3 | moter  = 2\n      | ^^^^^");
}

TEST(ProjectErrors, AnExampleIsANumberThatMayBe) {
  const auto project = parse_project(
      "[mechanism]\ntype = \"arm\"\n[gains]\nkV = 1.0\n[controller]\nmax_voltage = inf\n",
      "p.toml");
  ASSERT_FALSE(project);
  EXPECT_EQ(to_string(project.error()),
            "p.toml:6:15: controller.max_voltage is inf, without a unit; it must be a text with "
            "number and unit, such as \"1 V\"");
}

TEST(ProjectErrors, ASectionThatIsNoneIsNotMissingToo) {
  const auto project = parse_project("mechanism = 3\n", "p.toml");
  ASSERT_FALSE(project);
  EXPECT_EQ(messages(project.error()),
            (std::vector<std::string>{"p.toml:1:13: mechanism is no section; it must be a section, "
                                      "written [mechanism]"}));
}

TEST(ProjectErrors, ShowsALongLineAboutThePlaceAndNothingThatATerminalObeys) {
  const std::string spaces(300, ' ');
  const auto project =
      parse_project("[mechanism]\ntype =" + spaces + "\"tür\u202e\" # \xe2\x82\xac \t and so on " +
                        spaces + "x\n",
                    "p.toml");
  ASSERT_FALSE(project);
  const std::string excerpt = project.error().all().front().excerpt;
  EXPECT_LT(excerpt.size(), 260u) << excerpt;
  EXPECT_NE(excerpt.find("\"tür"), std::string::npos) << excerpt;
  EXPECT_NE(excerpt.find("^^^"), std::string::npos) << excerpt;
  const auto bell = parse_project("[mechanism]\n\ttyp = 1 # \x1b[2J\n", "p.toml");
  ASSERT_FALSE(bell);
  EXPECT_EQ(bell.error().all().front().excerpt.find('\x1b'), std::string::npos);
}

TEST(ProjectErrors, CountsTheErrorsThatItDoesNotTell) {
  std::string text = "[mechanism]\ntype = \"arm\"\n";
  for (int i = 0; i < 100; ++i) {
    text += "key_" + std::to_string(i) + " = 1\n";
  }
  const auto project = parse_project(text, "p.toml");
  ASSERT_FALSE(project);
  ASSERT_EQ(project.error().all().size(), 21u);  // beside the 100 keys five parts are missing
  EXPECT_EQ(to_string(project.error().all().back()), "p.toml: there are more errors (number = 85)");
}

TEST(ProjectErrors, WhatIsMissingIsToldBesideWhatIsWrong) {
  constexpr const char* arm = R"([mechanism]
type = "arm"
mass = "3 kg"
[controller]
period = "20"
bogus = 1
state_tolerance = ["1 m"]
)";
  const std::vector<std::string> wrong{
      "p.toml:5:10: controller.period is \"20\", without a unit; it must be a time such as \"20 "
      "ms\"",
      "p.toml:6:1: controller.bogus is not a key of [controller]; known are period, "
      "state_tolerance, input_tolerance, max_voltage, delay, predict_delay, tolerance, limit, "
      "reference",
      "p.toml:7:19: controller.state_tolerance is 1 value long; it must be one value a state (2)",
      "p.toml:7:19: controller.state_tolerance is \"1 m\", a length; it must be an angle such as "
      "\"15 deg\"; an angle is the way over the radius of drum or wheel"};
  std::vector<std::string> all;
  for (const char* part : {"motor is missing; an arm needs it, for example motor = \"NEO\"",
                           "gearing is missing; an arm needs it, for example gearing = 10.0",
                           "moment_of_inertia is missing; an arm needs it, for example "
                           "moment_of_inertia = \"0.003 kg m^2\"",
                           "center_of_mass is missing; an arm needs it, for example center_of_mass "
                           "= \"0.4 m\""}) {
    all.push_back(std::string("p.toml:1:1: mechanism.") + part);
  }
  all.insert(all.end(), wrong.begin(), wrong.end());
  const auto project = parse_project(arm, "p.toml");
  ASSERT_FALSE(project);
  EXPECT_EQ(messages(project.error()), all);
  // A wrong kV is not a missing one; without it the gains or the parts make the plant.
  const auto gains = [](const std::string& text) {
    const auto read =
        parse_project("[mechanism]\ntype = \"arm\"\n[gains]\n" + text + "\n", "p.toml");
    return read ? std::vector<std::string>() : messages(read.error());
  };
  EXPECT_EQ(gains("kV = -1").size(), 1u);
  const auto both = gains("kS = -1");
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(both[0],
            "p.toml:3:1: gains.kV is missing; in V·s per rad or m, for example kV = 1.2; or else "
            "say in [mechanism]: motor, gearing, mass, moment_of_inertia, center_of_mass");
}

TEST(ProjectErrors, WhatALogSuppliesIsNotMissingBesideIt) {
  const std::string path = testing::TempDir() + "flyball_project_with_log.toml";
  std::ofstream(path) << "[mechanism]\ntype = \"arm\"\n[controller]\nperiod = \"20\"\n";
  const auto tuned = tune_job("arm.json", path);
  ASSERT_FALSE(tuned);
  EXPECT_EQ(tuned.error().all().size(), 1u);
  const auto designed = design_job(path);
  ASSERT_FALSE(designed);
  EXPECT_EQ(designed.error().all().size(), 6u);
  std::remove(path.c_str());
}

}  // namespace
}  // namespace flyball::study::project_errors_test
