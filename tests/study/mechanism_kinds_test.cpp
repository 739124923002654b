#include <algorithm>
#include <string>

#include <gtest/gtest.h>

#include <flyball/study/answer.hpp>
#include <flyball/study/design.hpp>
#include <flyball/study/project.hpp>
#include <flyball/study/tune.hpp>

#include "session_file.hpp"

/// Turrets, rollers and swerve modules from a project file or a log to an answer.
namespace flyball::study::mechanism_kinds_test {
namespace {

using mechanisms::MechanismKind;

struct Case {
  MechanismKind kind;
  const char* parts;
  Eigen::Index states;
  const char* unit;  ///< Of what the loop controls.
};

constexpr const char* inertia = "moment_of_inertia = \"0.02 kg m^2\"\n";

const Case cases[] = {
    {MechanismKind::roller, inertia, 1, "rad/s"},
    {MechanismKind::turret, inertia, 2, "rad"},
    {MechanismKind::swerve_steer, inertia, 2, "rad"},
    {MechanismKind::swerve_drive, "mass = \"15 kg\"\nwheel_radius = \"2 in\"\n", 1, "m/s"}};

std::string project_text(const Case& of) {
  return "[mechanism]\ntype = \"" + std::string(to_string(of.kind)) +
         "\"\nmotor = \"NEO\"\ngearing = 20\n" + of.parts;
}

TEST(MechanismKinds, AProjectFileBecomesADesignThatReadsBack) {
  for (const Case& of : cases) {
    const auto project = parse_project(project_text(of), "module.toml");
    ASSERT_TRUE(project) << to_string(of.kind) << ": " << to_string(project.error());
    ASSERT_FALSE(project->plant_error) << to_string(*project->plant_error);
    const auto result = design(project->job);
    ASSERT_TRUE(result) << to_string(of.kind) << ": " << to_string(result.error());
    EXPECT_EQ(result->K.cols(), of.states) << to_string(of.kind);
    EXPECT_TRUE(result->robust) << to_string(of.kind);
    EXPECT_EQ(result->job.plant.gains.kG, 0.0);
    const Answer answer = answer_of(*result);
    const auto file = std::find_if(answer.files.begin(), answer.files.end(),
                                   [](const AnswerFile& f) { return f.name == "gains.toml"; });
    ASSERT_NE(file, answer.files.end());
    const auto again = parse_project(file->contents, "gains.toml");
    ASSERT_TRUE(again) << to_string(again.error()) << file->contents;
    EXPECT_EQ(again->job.plant.kind, of.kind);
    EXPECT_EQ(again->job.plant.drum_radius, project->job.plant.drum_radius);
    EXPECT_EQ(file->contents.find("kG"), std::string::npos) << file->contents;
    const auto repeated = design(again->job);
    ASSERT_TRUE(repeated) << to_string(repeated.error());
    EXPECT_NEAR(repeated->K(0, 0), result->K(0, 0), 1e-6 * result->K(0, 0));
  }
}

TEST(MechanismKinds, GravityAndForeignPartsAreRefused) {
  const auto text = [&](const std::string& more) {
    const auto project = parse_project(project_text(cases[1]) + more, "turret.toml");
    return project ? std::string("accepted") : to_string(project.error());
  };
  EXPECT_NE(text("mass = \"3 kg\"\n").find("it is made of motor, gearing, moment_of_inertia"),
            std::string::npos)
      << text("mass = \"3 kg\"\n");
  EXPECT_NE(text("[gains]\nkG = 0.5\n").find("gravity does not move it"), std::string::npos);
  EXPECT_NE(text("[gains]\nangle_offset = \"3 deg\"\n").find("it is of an arm"), std::string::npos);
}

// A session of a balanced arm, said to be a turret: its answer names it, has no gravity, and a
// position loop.
TEST(MechanismKinds, ATurretsLogIsTuned) {
  CharacterizationOptions session;
  session.mechanism = MechanismKind::turret;
  session.kS = 0.15;
  session.kV = 1.3;
  session.kA = 0.12;
  session.travel_low = -2.0;
  session.travel_high = 2.0;
  session.resolution = 1e-3;
  const SessionFile file(session, "Simple", "flyball_kinds_test_turret.json");
  TuneJob job;
  job.identification.log = file.path();
  job.identification.selection.mechanism = MechanismKind::turret;
  const auto result = tune(job);
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_TRUE(result->identification.report.fit)
      << to_string(result->identification.report.fit.error());
  EXPECT_EQ(result->identification.report.fit->mechanism, MechanismKind::turret);
  EXPECT_NEAR(result->identification.report.fit->kV.value, 1.3, 0.013);
  ASSERT_TRUE(result->design && *result->design);
  EXPECT_EQ((*result->design)->K.cols(), 2);
  const Answer answer = answer_of(*result);
  EXPECT_NE(answer.document.title.find("Turret"), std::string::npos) << answer.document.title;
  EXPECT_NE(answer.json.find("\"mechanism\":\"turret\""), std::string::npos);
}

}  // namespace
}  // namespace flyball::study::mechanism_kinds_test
