#include <flyball/identification/mechanism_choice.hpp>

#include "recordings.hpp"

namespace mechanism_choice_test {
namespace {

using namespace flyball::identification;
using flyball::mechanisms::MechanismKind;
using recordings::find;
using recordings::record;
using Kinds = std::vector<MechanismKind>;

MechanismChoice choose(const Recording& recording) {
  const auto prepared = prepare(recording);
  const auto choice = choose_mechanism(*prepared);
  EXPECT_TRUE(choice) << to_string(choice.error());
  return choice.value_or(MechanismChoice{});
}

void scale(Recording& recording, double factor, const char* unit) {
  for (TestRun& run : recording.runs) {
    for (auto* column : {&run.position, &run.velocity}) {
      for (double& value : *column) {
        value *= factor;
      }
    }
  }
  recording.unit = unit;
}

Recording recorded(const flyball::CharacterizationOptions& options) {
  return flyball::record_characterization(options).value();
}

TEST(MechanismChoice, IsThatOfTheSession) {
  for (std::size_t mechanism = 0; mechanism < scenarios::mechanisms.size(); ++mechanism) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const MechanismChoice choice = choose(record(mechanism, seed));
      EXPECT_EQ(choice.fitting, Kinds{scenarios::mechanisms[mechanism].kind})
          << scenarios::mechanisms[mechanism].name << ", seed " << seed << ": " << choice.evidence;
    }
  }
}

TEST(MechanismChoice, TellsItsNumbers) {
  const MechanismChoice choice = choose(record(recordings::arm));
  ASSERT_EQ(choice.compared.size(), 3U);
  EXPECT_EQ(choice.compared[0].kind, MechanismKind::flywheel);
  EXPECT_EQ(choice.compared[0].evidence, 0.0);
  EXPECT_EQ(choice.compared[2].kind, MechanismKind::arm);
  EXPECT_NEAR(choice.compared[2].gravity, 0.65, 0.02);
  EXPECT_GT(choice.compared[2].evidence, 100.0);
  EXPECT_LT(choice.compared[2].nrmse, choice.compared[0].nrmse);
  EXPECT_NE(choice.evidence.find("cosine"), std::string::npos) << choice.evidence;
}

// A turret and a balanced arm are one model; what the loop is to do is not.
TEST(MechanismChoice, AsksForWhatTurnsWithinATurnWithoutGravity) {
  auto options = scenarios::session(scenarios::mechanisms[recordings::arm], 2);
  options.kG = 0.0;
  EXPECT_EQ(choose(recorded(options)).fitting, (Kinds{MechanismKind::arm, MechanismKind::turret}));
}

// Said to be one of those without gravity, its fit is that of the flywheel's model, with the
// position: nothing contradicts it, and the gains are the session's.
TEST(MechanismChoice, ATurretThatIsSaidIsBelieved) {
  auto options = scenarios::session(scenarios::mechanisms[recordings::arm], 2);
  options.kG = 0.0;
  for (const MechanismKind kind : {MechanismKind::turret, MechanismKind::swerve_steer}) {
    Recording recording = recorded(options);
    recording.mechanism = kind;
    const auto report = identify_feedforward(recording);
    ASSERT_TRUE(report.fit) << to_string(report.fit.error());
    EXPECT_EQ(report.fit->mechanism, kind);
    EXPECT_FALSE(report.fit->kG);
    EXPECT_FALSE(report.fit->angle_offset);
    EXPECT_NEAR(report.fit->kV.value, options.kV, 0.01 * options.kV);
    EXPECT_NEAR(report.fit->kS.value, options.kS, 0.02);
    EXPECT_EQ(find(report.diagnostics, "mechanism_contradicted"), nullptr);
  }
  // With gravity it is an arm, whatever is said.
  Recording arm = record(recordings::arm);
  arm.mechanism = MechanismKind::turret;
  EXPECT_NE(find(identify_feedforward(arm).diagnostics, "mechanism_contradicted"), nullptr);
}

TEST(MechanismChoice, AsksForAForceThatMayBeADrumsGravityOrFriction) {
  Recording drum = record(recordings::elevator);
  scale(drum, 1.0 / 0.01, "rad");
  EXPECT_EQ(choose(drum).fitting, (Kinds{MechanismKind::flywheel, MechanismKind::elevator}));
}

TEST(MechanismChoice, LengthsWithinAFewMetresAreAnElevator) {
  auto options = scenarios::session(scenarios::mechanisms[recordings::elevator], 3);
  options.kG = 0.0;
  EXPECT_EQ(choose(recorded(options)).fitting, Kinds{MechanismKind::elevator});
  Recording roller = record(recordings::flywheel);
  scale(roller, 0.05, "m");
  EXPECT_EQ(choose(roller).fitting, Kinds{MechanismKind::flywheel});
}

TEST(MechanismChoice, WorksWithoutPosition) {
  Recording recording = record(recordings::flywheel);
  for (TestRun& run : recording.runs) {
    run.position.clear();
  }
  EXPECT_EQ(choose(recording).fitting, Kinds{MechanismKind::flywheel});
}

TEST(MechanismChoice, IsTakenAloud) {
  Recording recording = record(recordings::arm);
  const auto said = identify_feedforward(recording);
  recording.mechanism.reset();
  const auto report = identify_feedforward(recording);
  ASSERT_TRUE(report.fit) << to_string(report.fit.error());
  EXPECT_EQ(report.prepared.mechanism, MechanismKind::arm);
  ASSERT_FALSE(report.diagnostics.empty());
  EXPECT_EQ(report.diagnostics.front().code, "mechanism_assumed");
  EXPECT_EQ(report.diagnostics.front().severity, flyball::Severity::warning);
  EXPECT_EQ(report.fit->kG->value, said.fit->kG->value);
  EXPECT_EQ(find(said.diagnostics, "mechanism_assumed"), nullptr);
}

TEST(MechanismChoice, IsRefusedWithTheOptionsWhereTwoFit) {
  Recording drum = record(recordings::elevator);
  scale(drum, 1.0 / 0.01, "rad");
  drum.mechanism.reset();
  const auto fit = fit_feedforward(drum);
  ASSERT_FALSE(fit);
  EXPECT_TRUE(fit.error().is(IdentificationError::unknown_mechanism));
  EXPECT_EQ(fit.error().kind(), flyball::ErrorKind::misuse);
  const std::string text = to_string(fit.error());
  for (const char* part :
       {"--mechanism flywheel", "--mechanism elevator", "--scale", "gravity of 0."}) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
}

TEST(MechanismChoice, ContradictsAWrongWord) {
  Recording recording = record(recordings::arm);
  recording.mechanism = MechanismKind::flywheel;
  const auto report = identify_feedforward(recording);
  const flyball::Diagnostic* told = find(report.diagnostics, "mechanism_contradicted");
  ASSERT_NE(told, nullptr);
  EXPECT_NE(told->message.find("of an arm, not of a flywheel"), std::string::npos) << told->message;
  EXPECT_EQ(find(identify_feedforward(record(recordings::flywheel)).diagnostics,
                 "mechanism_contradicted"),
            nullptr);
}

// A roller's straight way of some metres is no lift; friction may differ by direction.
TEST(MechanismChoice, IsNotContradictedByATravelOrAFrictionOfOneDirection) {
  auto options = scenarios::session(scenarios::mechanisms[recordings::elevator], 4);
  options.kG = 0.0;
  options.defects.friction_asymmetry = 0.5;
  Recording roller = recorded(options);
  roller.mechanism = MechanismKind::flywheel;
  const auto report = identify_feedforward(roller);
  EXPECT_EQ(find(report.diagnostics, "mechanism_contradicted"), nullptr);
  Recording lift = record(recordings::elevator, 4);
  lift.mechanism = MechanismKind::flywheel;
  EXPECT_NE(find(identify_feedforward(lift).diagnostics, "mechanism_contradicted"), nullptr);
}

TEST(MechanismChoice, RefusesWhatGivesNoGains) {
  const auto choice = choose_mechanism(PreparedRecording{});
  ASSERT_FALSE(choice);
  EXPECT_TRUE(choice.error().is(IdentificationError::no_data));
}

}  // namespace
}  // namespace mechanism_choice_test
