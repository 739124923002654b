#include <flyball/mechanisms/mechanism_kind.hpp>

#include <gtest/gtest.h>

namespace flyball::mechanisms {
namespace {

TEST(MechanismKind, TextAndBack) {
  for (const MechanismKind kind :
       {MechanismKind::flywheel, MechanismKind::elevator, MechanismKind::arm}) {
    EXPECT_EQ(parse_mechanism_kind(to_string(kind)).value(), kind);
  }
  EXPECT_EQ(to_string(MechanismKind::flywheel), "flywheel");
  EXPECT_EQ(to_string(MechanismKind::elevator), "elevator");
  EXPECT_EQ(to_string(MechanismKind::arm), "arm");
}

TEST(MechanismKind, ReadsWhatLogsAndPeopleWrite) {
  EXPECT_EQ(parse_mechanism_kind("Simple").value(), MechanismKind::flywheel);
  EXPECT_EQ(parse_mechanism_kind("ELEVATOR").value(), MechanismKind::elevator);
  EXPECT_EQ(parse_mechanism_kind("single-jointed arm").value(), MechanismKind::arm);
  EXPECT_EQ(parse_mechanism_kind("Single Jointed Arm").value(), MechanismKind::arm);
}

TEST(MechanismKind, RefusesOthersWithTheKnownOnes) {
  for (const std::string_view text : {"", "turret", "Drivetrain (Linear)", "armor"}) {
    const auto found = parse_mechanism_kind(text);
    ASSERT_FALSE(found) << text;
    EXPECT_TRUE(found.error().is(ArgumentError::unknown_name));
    EXPECT_NE(to_string(found.error()).find("flywheel, elevator or arm"), std::string::npos);
  }
}

TEST(MechanismKind, Units) {
  EXPECT_EQ(position_unit(MechanismKind::flywheel), "rad");
  EXPECT_EQ(position_unit(MechanismKind::elevator), "m");
  EXPECT_EQ(position_unit(MechanismKind::arm), "rad");
}

}  // namespace
}  // namespace flyball::mechanisms
