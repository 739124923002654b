#include <flyball/study/project.hpp>

#include <vector>

#include <gtest/gtest.h>

#include <flyball/mechanisms/elevator.hpp>

namespace flyball::study::project_test {
namespace {

constexpr const char* elevator_text = R"([mechanism]
type = "elevator"
motor = "NEO"
motor_count = 2
gearing = 10.0            # motor turns per drum turn
mass = "8 kg"
drum_radius = "1 in"

[controller]
period = "20 ms"
state_tolerance = ["2 cm", "0.4 m/s"]
input_tolerance = "12 V"
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string message(const std::string& text) {
  const auto project = parse_project(text, "elevator.toml");
  return project ? "accepted" : to_string(project.error());
}

TEST(Project, ReadsTheElevatorOfTheDesignPage) {
  const auto project = parse_project(elevator_text, "elevator.toml");
  ASSERT_TRUE(project) << to_string(project.error());
  EXPECT_FALSE(project->plant_error);
  const auto model = mechanisms::elevator({.motor = mechanisms::neo(2),
                                           .gearing = 10.0,
                                           .mass = Mass(8.0),
                                           .drum_radius = Length(0.0254)});
  ASSERT_TRUE(model);
  EXPECT_DOUBLE_EQ(project->job.plant.gains.kV, model->gains.kV);
  EXPECT_DOUBLE_EQ(project->job.plant.gains.kA, model->gains.kA);
  EXPECT_DOUBLE_EQ(project->job.plant.gains.kG, model->gains.kG);
  EXPECT_DOUBLE_EQ(project->job.controller.period, 0.020);
  EXPECT_EQ(project->job.controller.state_tolerance, (std::vector<double>{0.02, 0.4}));
  EXPECT_DOUBLE_EQ(project->job.plant.drum_radius, 0.0254);
}

TEST(Project, SaysWhereAnUnknownKeyStandsAndWhatWasMeant) {
  EXPECT_EQ(message(replaced(elevator_text, "gearing =", "gearng =")),
            "elevator.toml:5:1: mechanism.gearng is not a key of [mechanism]; did you mean "
            "\"gearing\"?");
  EXPECT_EQ(message(replaced(elevator_text, "[controller]", "[controler]")),
            "elevator.toml:9:2: controler is not a section that is known; did you mean "
            "\"controller\"?");
}

TEST(Project, RefusesAWrongUnitAndNamesIt) {
  const std::string text = message(replaced(elevator_text, "\"8 kg\"", "\"8 m\""));
  EXPECT_NE(text.find("elevator.toml:6:"), std::string::npos) << text;
  EXPECT_NE(text.find("mechanism.mass is \"8 m\", a length"), std::string::npos) << text;
  EXPECT_NE(text.find("8 kg"), std::string::npos) << text;
}

TEST(Project, RefusesMeaninglessValues) {
  const auto refused = [](const std::string& from, const std::string& to, ErrorInfo info) {
    const auto project = parse_project(replaced(elevator_text, from, to), "p.toml");
    ASSERT_FALSE(project) << to;
    EXPECT_EQ(project.error().code(), info.name) << to_string(project.error());
    EXPECT_EQ(project.error().kind(), ErrorKind::misuse);
    EXPECT_TRUE(project.error().where().starts_with("p.toml:")) << project.error().where();
  };
  refused("\"8 kg\"", "\"-3 kg\"", error_info(ArgumentError::out_of_range));
  refused("\"8 kg\"", "\"0 kg\"", error_info(ArgumentError::not_positive));
  refused("\"8 kg\"", "8", error_info(ArgumentError::wrong_unit));
  refused("\"8 kg\"", "\"heavy\"", error_info(ArgumentError::malformed));
  refused("\"8 kg\"", "true", error_info(ProjectError::wrong_type));
  refused("10.0", "0", error_info(ArgumentError::not_positive));
  refused("10.0", "-4", error_info(ArgumentError::not_positive));
  refused("10.0", "nan", error_info(ArgumentError::not_finite));
  refused("10.0", "\"ten\"", error_info(ProjectError::wrong_type));
  refused("10.0", "\"10\"", error_info(ProjectError::wrong_type));  // the schema says number
  refused("10.0", "\"3:0\"", error_info(ArgumentError::malformed));
  refused("10.0", "\"0:3\"", error_info(ArgumentError::not_positive));
  refused("10.0", "\"3:2:1\"", error_info(ArgumentError::malformed));
  refused("10.0", "1e200", error_info(ArgumentError::out_of_range));
  refused("\"8 kg\"", "\"1e-200 kg\"", error_info(ArgumentError::out_of_range));
  refused("\"NEO\"", "\"NE0\"", error_info(ArgumentError::unknown_name));
  refused("\"NEO\"", "\"Kraken\"", error_info(ArgumentError::ambiguous_name));
  refused("motor_count = 2", "motor_count = 0", error_info(ProjectError::wrong_value));
  refused("motor_count = 2", "motor_count = 4294967297", error_info(ProjectError::wrong_value));
  refused("motor_count = 2", "motor_count = 1.5", error_info(ProjectError::wrong_type));
  refused("\"20 ms\"", "\"0 ms\"", error_info(ArgumentError::not_positive));
  refused("[\"2 cm\", \"0.4 m/s\"]", "[\"2 cm\"]", error_info(ArgumentError::wrong_shape));
  refused("[\"2 cm\", \"0.4 m/s\"]", "\"2 cm\"", error_info(ProjectError::wrong_type));
  refused("\"elevator\"", "\"escalator\"", error_info(ArgumentError::unknown_name));
  refused("[mechanism]", "[mechanism", error_info(ProjectError::syntax));
}

std::vector<std::string> messages(const Errors& errors) {
  std::vector<std::string> all;
  for (const QuotedError& error : errors.all()) {
    all.push_back(to_string(error));
  }
  return all;
}

TEST(Project, SaysEverythingThatIsMissingForAMechanism) {
  std::string text = replaced(elevator_text, "mass = \"8 kg\"\n", "");
  text = replaced(text, "gearing = 10.0            # motor turns per drum turn\n", "");
  const auto project = parse_project(text, "p.toml");
  ASSERT_TRUE(project) << to_string(project.error());
  ASSERT_TRUE(project->plant_error);
  EXPECT_TRUE(project->plant_error->is(ProjectError::missing_key));
  EXPECT_EQ(messages(*project->plant_error),
            (std::vector<std::string>{
                "p.toml:1:1: mechanism.gearing is missing; an elevator needs it, for example "
                "gearing = 10.0",
                "p.toml:1:1: mechanism.mass is missing; an elevator needs it, for example mass = "
                "\"8 kg\""}));
}

TEST(Project, OptionsStandInPlaceOfTheFile) {
  const std::vector<Override> given{
      {"--period", "5ms"},    {"--state-tolerance", "1cm, 0.5 m/s"}, {"--mass", "10 lb"},
      {"--motor-count", "3"}, {"--battery-resistance", "15 mOhm"},   {"--goal", "40 cm"},
      {"--seed", "7"}};
  const auto project = parse_project(elevator_text, "p.toml", given);
  ASSERT_TRUE(project) << to_string(project.error());
  EXPECT_EQ(project->job.controller.period, 0.005);
  EXPECT_EQ(project->job.controller.state_tolerance, (std::vector<double>{0.01, 0.5}));
  EXPECT_EQ(project->parts.mass, Mass(10 * 0.45359237));
  EXPECT_EQ(project->job.plant.motor->count, 3);
  EXPECT_EQ(project->job.battery.resistance, 0.015);
  EXPECT_EQ(project->job.profile.goal, 0.4);
  EXPECT_EQ(project->job.seed, 7u);
}

TEST(Project, AWrongOptionIsNamed) {
  const std::vector<Override> given{{"--period", "0ms"},
                                    {"--delay", "20"},
                                    {"--seed", "banana"},
                                    {"--motor", "NEP"},
                                    {"--state-tolerance", "1cm"}};
  const auto project = parse_project(replaced(elevator_text, "8 kg", "8 m"), "p.toml", given);
  ASSERT_FALSE(project);
  EXPECT_EQ(messages(project.error()),
            (std::vector<std::string>{
                "--motor: motor is \"NEP\", which is not in the table; did you mean "
                "\"NEO\"?",
                "--period is 0 s; it must be greater than zero",
                "--state-tolerance is 1 value long; it must be one value a state (2)",
                "--delay is \"20\", without a unit; it must be a time such as \"20 ms\"",
                "--seed is \"banana\"; it must be a whole number, 0 or greater",
                "p.toml:6:8: mechanism.mass is \"8 m\", a length; it must be a mass such as \"8 "
                "kg\" or \"18 lb\""}));
}

TEST(Project, AnOptionThatThereIsNotIsNamed) {
  const auto project =
      parse_project(elevator_text, "p.toml", std::vector<Override>{{"--perod", "5ms"}});
  ASSERT_FALSE(project);
  EXPECT_EQ(to_string(project.error()),
            "--perod is not an option that is known; did you mean \"--period\"?");
}

TEST(Project, AJobWithoutAFileTakesItsOptions) {
  const std::vector<Override> given{
      {"--mechanism", "arm"}, {"--unit", "rotations"}, {"--state-tolerance", "2deg,1rad/s"}};
  const auto job = tune_job("arm.json", "", given);
  ASSERT_TRUE(job) << to_string(job.error());
  EXPECT_EQ(job->identification.log, "arm.json");
  EXPECT_EQ(job->identification.selection.mechanism, mechanisms::MechanismKind::arm);
  EXPECT_EQ(job->identification.selection.unit, "rotations");
  EXPECT_EQ(job->design.controller.state_tolerance.size(), 2u);
  // What no log says.
  const auto motor =
      tune_job("arm.json", "", std::vector<Override>{{"--motor", "NEO"}, {"--gearing", "50"}});
  ASSERT_TRUE(motor) << to_string(motor.error());
  EXPECT_EQ(motor->design.plant.motor->name, "NEO");
  EXPECT_EQ(motor->design.plant.gearing, 50.0);
  // Which unit is right, only the mechanism says.
  const auto unknown = tune_job("arm.json", "", std::span(given).last(1));
  ASSERT_FALSE(unknown);
  EXPECT_EQ(to_string(unknown.error()),
            "--state-tolerance is in a unit that the mechanism decides, which is not known; say "
            "which with --mechanism");
  const auto unheard =
      identify_job("a.json", "", std::vector<Override>{{"--mechanism", "catapult"}});
  ASSERT_FALSE(unheard);
  EXPECT_EQ(unheard.error().where(), "--mechanism");
  const auto ten = tune_job("arm.json", "", std::vector<Override>{{"--gearing", "ten"}});
  ASSERT_FALSE(ten);
  EXPECT_EQ(to_string(ten.error()),
            "--gearing is \"ten\"; it must be a plain number, without quotes, or a ratio such as "
            "\"3:2\"");
  const auto ratio = tune_job("arm.json", "", std::vector<Override>{{"--gearing", "60:8"}});
  ASSERT_TRUE(ratio) << to_string(ratio.error());
}

TEST(Project, TheLogIsOfTheMechanismOfTheFile) {
  const std::string text = std::string(elevator_text) + "[log]\nscale = 0.5\n";
  const auto same =
      parse_project(text, "p.toml", std::vector<Override>{{"--mechanism", "Elevator"}});
  ASSERT_TRUE(same) << to_string(same.error());
  EXPECT_EQ(same->log.scale, 0.5);
  const auto other = parse_project(text, "p.toml", std::vector<Override>{{"--mechanism", "arm"}});
  ASSERT_FALSE(other);
  EXPECT_EQ(to_string(other.error()),
            "--mechanism is arm; it must be the type in [mechanism], elevator");
}

TEST(Project, AGainThatIsKnownStandsBesideTheParts) {
  const auto project = parse_project(std::string(elevator_text) + "[gains]\nkS = 0.3\n", "p.toml");
  ASSERT_TRUE(project) << to_string(project.error());
  const auto model = mechanisms::elevator({.motor = mechanisms::neo(2),
                                           .gearing = 10.0,
                                           .mass = Mass(8.0),
                                           .drum_radius = Length(0.0254)});
  EXPECT_FALSE(project->plant_error);
  EXPECT_EQ(project->job.plant.gains.kS, 0.3);
  EXPECT_EQ(project->job.plant.gains.kV, model->gains.kV);
  EXPECT_TRUE(project->job.plant.kA_determined);
}

TEST(Project, TakesACustomMotorByItsFiveNumbers) {
  // The numbers of a CIM, so that both ways must give the same model.
  const std::string custom = R"([mechanism]
type = "flywheel"
gearing = 1.5
moment_of_inertia = "0.003 kg m^2"
[mechanism.motor]
stall_torque = "2.42 N m"
stall_current = "133 A"
free_current = "2.7 A"
free_speed = "5310 rpm"
)";
  const std::string table = R"([mechanism]
type = "flywheel"
motor = "cim"
gearing = 1.5
moment_of_inertia = "0.003 kg m^2"
)";
  const auto a = parse_project(custom, "a.toml");
  const auto b = parse_project(table, "b.toml");
  ASSERT_TRUE(a) << to_string(a.error());
  ASSERT_TRUE(b) << to_string(b.error());
  ASSERT_FALSE(a->plant_error);
  EXPECT_NEAR(a->job.plant.gains.kV, b->job.plant.gains.kV, 1e-15);
  EXPECT_NEAR(a->job.plant.gains.kA, b->job.plant.gains.kA, 1e-17);
}

TEST(Project, TakesGainsInsteadOfParts) {
  const auto project = parse_project(R"([mechanism]
type = "arm"
[gains]
kS = 0.1
kV = 1.2
kA = 0.15
kG = 0.65
angle_offset = "10 deg"
)",
                                     "arm.toml");
  ASSERT_TRUE(project) << to_string(project.error());
  EXPECT_FALSE(project->plant_error);
  EXPECT_TRUE(project->job.plant.kA_determined);
  EXPECT_DOUBLE_EQ(project->job.plant.gains.kG, 0.65);
  EXPECT_NEAR(project->job.plant.gains.angle_offset, 0.17453292519943295, 1e-15);
}

TEST(Project, AFileWithoutAMechanismIsRefused) {
  const auto project = parse_project("", "empty.toml");
  ASSERT_FALSE(project);
  EXPECT_TRUE(project.error().is(ProjectError::missing_key));
  EXPECT_FALSE(parse_project("", "empty.toml", std::vector<Override>{{"--mass", "3 kg"}}));
}

}  // namespace
}  // namespace flyball::study::project_test
