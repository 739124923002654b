#include <flyball/study/project.hpp>

#include <gtest/gtest.h>

#include <flyball/mechanisms/elevator.hpp>

namespace flyball::study {
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
  refused("10.0", "\"ten\"", error_info(ArgumentError::malformed));
  refused("\"NEO\"", "\"NE0\"", error_info(ArgumentError::unknown_name));
  refused("\"NEO\"", "\"Kraken\"", error_info(ArgumentError::ambiguous_name));
  refused("motor_count = 2", "motor_count = 0", error_info(ProjectError::wrong_value));
  refused("motor_count = 2", "motor_count = 1.5", error_info(ProjectError::wrong_type));
  refused("\"20 ms\"", "\"0 ms\"", error_info(ArgumentError::not_positive));
  refused("[\"2 cm\", \"0.4 m/s\"]", "[\"2 cm\"]", error_info(ArgumentError::wrong_shape));
  refused("[\"2 cm\", \"0.4 m/s\"]", "\"2 cm\"", error_info(ProjectError::wrong_type));
  refused("\"elevator\"", "\"escalator\"", error_info(ArgumentError::unknown_name));
  refused("[mechanism]", "[mechanism", error_info(ProjectError::syntax));
}

TEST(Project, SaysWhatIsMissingForAMechanism) {
  const auto project = parse_project(replaced(elevator_text, "mass = \"8 kg\"\n", ""), "p.toml");
  ASSERT_TRUE(project) << to_string(project.error());
  ASSERT_TRUE(project->plant_error);
  EXPECT_TRUE(project->plant_error->is(ProjectError::missing_key));
  EXPECT_NE(to_string(*project->plant_error).find("mechanism.mass is missing"), std::string::npos);
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
}

}  // namespace
}  // namespace flyball::study
