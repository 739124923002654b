#include <flyball/mechanisms/mechanism_kind.hpp>

#include <gtest/gtest.h>

namespace flyball::mechanisms::mechanism_kind_test {
namespace {

TEST(MechanismKind, TextAndBack) {
  for (const MechanismKind kind :
       {MechanismKind::flywheel, MechanismKind::elevator, MechanismKind::arm, MechanismKind::turret,
        MechanismKind::roller, MechanismKind::swerve_steer, MechanismKind::swerve_drive}) {
    EXPECT_EQ(parse_mechanism_kind(to_string(kind)).value(), kind);
  }
  EXPECT_EQ(to_string(MechanismKind::flywheel), "flywheel");
  EXPECT_EQ(to_string(MechanismKind::elevator), "elevator");
  EXPECT_EQ(to_string(MechanismKind::arm), "arm");
  EXPECT_EQ(to_string(MechanismKind::swerve_steer), "swerve steer");
}

TEST(MechanismKind, ReadsWhatLogsAndPeopleWrite) {
  EXPECT_EQ(parse_mechanism_kind("Simple").value(), MechanismKind::flywheel);
  EXPECT_EQ(parse_mechanism_kind("ELEVATOR").value(), MechanismKind::elevator);
  EXPECT_EQ(parse_mechanism_kind("single-jointed arm").value(), MechanismKind::arm);
  EXPECT_EQ(parse_mechanism_kind("Single Jointed Arm").value(), MechanismKind::arm);
  EXPECT_EQ(parse_mechanism_kind("swerve-steer").value(), MechanismKind::swerve_steer);
  EXPECT_EQ(parse_mechanism_kind("SwerveDrive").value(), MechanismKind::swerve_drive);
}

TEST(MechanismKind, RefusesOthersWithTheKnownOnes) {
  for (const std::string_view text : {"", "swerve", "Drivetrain (Linear)", "armor"}) {
    const auto found = parse_mechanism_kind(text);
    ASSERT_FALSE(found) << text;
    EXPECT_TRUE(found.error().is(ArgumentError::unknown_name));
    EXPECT_NE(to_string(found.error()).find("elevator, arm, flywheel, roller, turret, "),
              std::string::npos);
  }
}

TEST(MechanismKind, Units) {
  EXPECT_EQ(position_unit(MechanismKind::flywheel), "rad");
  EXPECT_EQ(position_unit(MechanismKind::elevator), "m");
  EXPECT_EQ(position_unit(MechanismKind::arm), "rad");
  EXPECT_EQ(position_unit(MechanismKind::swerve_steer), "rad");
  EXPECT_EQ(position_unit(MechanismKind::swerve_drive), "m");
}

// What is controlled, and what gravity and the angle do to it.
TEST(MechanismKind, Properties) {
  using enum MechanismKind;
  for (const MechanismKind kind : {flywheel, roller, swerve_drive}) {
    EXPECT_TRUE(controls_velocity(kind) && !has_gravity(kind) && !turns_endlessly(kind))
        << to_string(kind);
  }
  for (const MechanismKind kind : {turret, swerve_steer}) {
    EXPECT_TRUE(!controls_velocity(kind) && !has_gravity(kind) && turns_endlessly(kind))
        << to_string(kind);
  }
  for (const MechanismKind kind : {elevator, arm}) {
    EXPECT_TRUE(!controls_velocity(kind) && has_gravity(kind) && !turns_endlessly(kind))
        << to_string(kind);
  }
}

}  // namespace
}  // namespace flyball::mechanisms::mechanism_kind_test
