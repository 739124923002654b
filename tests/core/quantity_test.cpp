#include <flyball/core/quantity.hpp>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <type_traits>

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

namespace flyball::quantity_test {
namespace {

using namespace flyball::literals;

constexpr double pi = std::numbers::pi;

constexpr std::array dimensions{Dimension::dimensionless,
                                Dimension::mass,
                                Dimension::length,
                                Dimension::time,
                                Dimension::angle,
                                Dimension::velocity,
                                Dimension::angular_velocity,
                                Dimension::acceleration,
                                Dimension::angular_acceleration,
                                Dimension::force,
                                Dimension::torque,
                                Dimension::moment_of_inertia,
                                Dimension::voltage,
                                Dimension::current,
                                Dimension::resistance,
                                Dimension::frequency};

static_assert(!std::is_convertible_v<double, Mass> && !std::is_convertible_v<Mass, double>);
static_assert(!std::is_convertible_v<Mass, Length> && !std::is_constructible_v<Mass, Length>);
static_assert(sizeof(Mass) == sizeof(double) && std::is_trivially_copyable_v<Mass>);
static_assert(8_kg == Mass(8.0) && -(8_kg) == Mass(-8.0) && 1_in < 1_ft && Mass() == 0_kg);

// Factors by definition: 1 in = 0.0254 m, 1 lb = 0.45359237 kg, 1 rpm = 2π/60 rad/s.
TEST(Literals, AreInSi) {
  EXPECT_DOUBLE_EQ((500_g).si(), 0.5);
  EXPECT_DOUBLE_EQ((2_lb).si(), 0.90718474);
  EXPECT_DOUBLE_EQ((2.54_cm).si(), (1_in).si());
  EXPECT_DOUBLE_EQ((254_mm).si(), (10_in).si());
  EXPECT_DOUBLE_EQ((1_ft).si(), (12_in).si());
  EXPECT_DOUBLE_EQ((1.5_m).si(), 1.5);
  EXPECT_DOUBLE_EQ((20_ms).si(), (0.02_s).si());
  EXPECT_DOUBLE_EQ((250_us).si(), 2.5e-4);
  EXPECT_DOUBLE_EQ((180_deg).si(), pi);
  EXPECT_DOUBLE_EQ((0.5_rot).si(), pi);
  EXPECT_DOUBLE_EQ((2_rad).si(), 2.0);
  EXPECT_DOUBLE_EQ((60_rpm).si(), 2.0 * pi);
  EXPECT_DOUBLE_EQ((3_rad_per_s).si(), 3.0);
  EXPECT_DOUBLE_EQ((3_mps).si(), 3.0);
  EXPECT_DOUBLE_EQ((3_mps2).si(), 3.0);
  EXPECT_DOUBLE_EQ((3_N).si(), 3.0);
  EXPECT_DOUBLE_EQ((3_Nm).si(), 3.0);
  EXPECT_DOUBLE_EQ((3_kg_m2).si(), 3.0);
  EXPECT_DOUBLE_EQ((12_V).si(), 12.0);
  EXPECT_DOUBLE_EQ((40_A).si(), 40.0);
  EXPECT_DOUBLE_EQ((40_mA).si(), 0.04);
  EXPECT_DOUBLE_EQ((2_Ohm).si(), 2.0);
  EXPECT_DOUBLE_EQ((15_mOhm).si(), 0.015);
  EXPECT_DOUBLE_EQ((50_Hz).si(), 50.0);
}

struct Accepted {
  std::string_view text;
  Dimension dimension;
  double si;
};

// lbf = 0.45359237·9.80665 N; lbf·in = lbf·0.0254; oz·in = lbf·in/16; lb·in² = lb·0.0254².
constexpr std::array accepted{
    Accepted{"8 kg", Dimension::mass, 8.0},
    Accepted{"8kg", Dimension::mass, 8.0},
    Accepted{"  8\tkg \n", Dimension::mass, 8.0},
    Accepted{"+8 kg", Dimension::mass, 8.0},
    Accepted{"8e0 kg", Dimension::mass, 8.0},
    Accepted{".5 kg", Dimension::mass, 0.5},
    Accepted{"5. kg", Dimension::mass, 5.0},
    Accepted{"8 KG", Dimension::mass, 8.0},
    Accepted{"8 Kilograms", Dimension::mass, 8.0},
    Accepted{"18 lbs", Dimension::mass, 8.16466266},
    Accepted{"16 oz", Dimension::mass, 0.45359237},
    Accepted{"250 g", Dimension::mass, 0.25},
    Accepted{"2.54cm", Dimension::length, 0.0254},
    Accepted{"1 in", Dimension::length, 0.0254},
    Accepted{"1\"", Dimension::length, 0.0254},
    Accepted{"2 inches", Dimension::length, 0.0508},
    Accepted{"1 inch", Dimension::length, 0.0254},
    Accepted{"3 feet", Dimension::length, 0.9144},
    Accepted{"3 Meters", Dimension::length, 3.0},
    Accepted{"-0.5 m", Dimension::length, -0.5},
    Accepted{"20ms", Dimension::time, 0.02},
    Accepted{"20 milliseconds", Dimension::time, 0.02},
    Accepted{"5 µs", Dimension::time, 5e-6},
    Accepted{"5 μs", Dimension::time, 5e-6},
    Accepted{"2 min", Dimension::time, 120.0},
    Accepted{"15 deg", Dimension::angle, pi / 12.0},
    Accepted{"15°", Dimension::angle, pi / 12.0},
    Accepted{"2 Rotations", Dimension::angle, 4.0 * pi},
    Accepted{"0.5 turns", Dimension::angle, pi},
    Accepted{"1.5 m/s", Dimension::velocity, 1.5},
    Accepted{"1.5 Meters per Second", Dimension::velocity, 1.5},
    Accepted{"10 ft/s", Dimension::velocity, 3.048},
    Accepted{"10 inches/second", Dimension::velocity, 0.254},
    Accepted{"3000 rpm", Dimension::angular_velocity, 100.0 * pi},
    Accepted{"3000 RPM", Dimension::angular_velocity, 100.0 * pi},
    Accepted{"-1.5e3 rpm", Dimension::angular_velocity, -50.0 * pi},
    Accepted{"1 Rotation per Second", Dimension::angular_velocity, 2.0 * pi},
    Accepted{"60 Rotations Per Minute", Dimension::angular_velocity, 2.0 * pi},
    Accepted{"60 ROTATIONS PER MINUTE", Dimension::angular_velocity, 2.0 * pi},
    Accepted{"180 degrees_per_second", Dimension::angular_velocity, pi},
    Accepted{"7 rad/s", Dimension::angular_velocity, 7.0},
    Accepted{"2 m/s^2", Dimension::acceleration, 2.0},
    Accepted{"2 m/s²", Dimension::acceleration, 2.0},
    Accepted{"2 m/s/s", Dimension::acceleration, 2.0},
    Accepted{"2 rotations per second per second", Dimension::angular_acceleration, 4.0 * pi},
    Accepted{"2 rad/s**2", Dimension::angular_acceleration, 2.0},
    Accepted{"10 N", Dimension::force, 10.0},
    Accepted{"1 lbf", Dimension::force, 4.4482216152605},
    Accepted{"2.4 N m", Dimension::torque, 2.4},
    Accepted{"2.4 N·m", Dimension::torque, 2.4},
    Accepted{"2.4 N*m", Dimension::torque, 2.4},
    Accepted{"2.4 newton-meters", Dimension::torque, 2.4},
    Accepted{"710 mN·m", Dimension::torque, 0.71},
    Accepted{"16 oz-in", Dimension::torque, 0.1129848290276167},
    Accepted{"1 ft-lb", Dimension::torque, 1.3558179483314004},
    Accepted{"0.01 kg m^2", Dimension::moment_of_inertia, 0.01},
    Accepted{"0.01 kg·m²", Dimension::moment_of_inertia, 0.01},
    Accepted{"0.01kg*m**2", Dimension::moment_of_inertia, 0.01},
    Accepted{"10 lb in^2", Dimension::moment_of_inertia, 10.0 * 0.45359237 * 0.0254 * 0.0254},
    Accepted{"12 V", Dimension::voltage, 12.0},
    Accepted{"12 volts", Dimension::voltage, 12.0},
    Accepted{"20 mV", Dimension::voltage, 0.02},
    Accepted{"20 Millivolts", Dimension::voltage, 0.02},
    Accepted{"40 A", Dimension::current, 40.0},
    Accepted{"40 amps", Dimension::current, 40.0},
    Accepted{"15 mOhm", Dimension::resistance, 0.015},
    Accepted{"15 mΩ", Dimension::resistance, 0.015},
    Accepted{"2 \u2126", Dimension::resistance, 2.0},  // OHM SIGN, not GREEK CAPITAL OMEGA
    Accepted{"2 ohms", Dimension::resistance, 2.0},
    Accepted{"50 Hz", Dimension::frequency, 50.0},
    Accepted{"1 kHz", Dimension::frequency, 1000.0},
    Accepted{"0.5", Dimension::dimensionless, 0.5},
    Accepted{"50 %", Dimension::dimensionless, 0.5},
    Accepted{"3:2", Dimension::dimensionless, 1.5},
    Accepted{" 60 : 8 ", Dimension::dimensionless, 7.5},
    Accepted{"30 in/min", Dimension::velocity, 0.0127},
    Accepted{"10 mph", Dimension::velocity, 4.4704},
    Accepted{"36 km/h", Dimension::velocity, 10.0},
    Accepted{"6 feet per minute", Dimension::velocity, 0.03048},
};

TEST(ParseQuantity, ReadsWhatPeopleWrite) {
  for (const Accepted& row : accepted) {
    const auto si = parse_quantity(row.text, row.dimension, "x");
    ASSERT_TRUE(si.has_value()) << row.text << ": " << to_string(si.error());
    EXPECT_DOUBLE_EQ(*si, row.si) << row.text;
  }
}

struct Refused {
  std::string_view text;
  Dimension dimension;
  ArgumentError code;
};

constexpr std::array refused{
    // A unit of another dimension, an unknown one, none.
    Refused{"8 m", Dimension::mass, ArgumentError::wrong_unit},
    Refused{"8 kg", Dimension::length, ArgumentError::wrong_unit},
    Refused{"8 lbf", Dimension::mass, ArgumentError::wrong_unit},
    Refused{"8 N m", Dimension::force, ArgumentError::wrong_unit},
    Refused{"20 Hz", Dimension::time, ArgumentError::wrong_unit},
    Refused{"20", Dimension::time, ArgumentError::wrong_unit},
    Refused{"8 kg", Dimension::dimensionless, ArgumentError::wrong_unit},
    Refused{"8 kgs 2", Dimension::mass, ArgumentError::wrong_unit},
    Refused{"8 quux", Dimension::mass, ArgumentError::wrong_unit},
    Refused{"8 9 kg", Dimension::mass, ArgumentError::wrong_unit},
    Refused{"1,5 kg", Dimension::mass, ArgumentError::wrong_unit},
    Refused{"0x10 kg", Dimension::mass, ArgumentError::wrong_unit},
    // Mega is not milli.
    Refused{"12 MV", Dimension::voltage, ArgumentError::wrong_unit},
    Refused{"2 MA", Dimension::current, ArgumentError::wrong_unit},
    Refused{"15 MOhm", Dimension::resistance, ArgumentError::wrong_unit},
    Refused{"15 MΩ", Dimension::resistance, ArgumentError::wrong_unit},
    Refused{"2 MNm", Dimension::torque, ArgumentError::wrong_unit},
    // No number.
    Refused{"", Dimension::mass, ArgumentError::malformed},
    Refused{"   ", Dimension::mass, ArgumentError::malformed},
    Refused{"abc", Dimension::mass, ArgumentError::malformed},
    Refused{"kg", Dimension::mass, ArgumentError::malformed},
    Refused{"in", Dimension::length, ArgumentError::malformed},
    Refused{"- 8 kg", Dimension::mass, ArgumentError::malformed},
    Refused{"+-8 kg", Dimension::mass, ArgumentError::malformed},
    Refused{"++8 kg", Dimension::mass, ArgumentError::malformed},
    Refused{"3:", Dimension::dimensionless, ArgumentError::malformed},
    Refused{"3:0", Dimension::dimensionless, ArgumentError::malformed},
    Refused{"3:2:1", Dimension::dimensionless, ArgumentError::malformed},
    Refused{"3:2", Dimension::length, ArgumentError::wrong_unit},
    // No finite number, or none in SI.
    Refused{"1e400 kg", Dimension::mass, ArgumentError::not_finite},
    Refused{"-1e400 kg", Dimension::mass, ArgumentError::not_finite},
    Refused{"nan kg", Dimension::mass, ArgumentError::not_finite},
    Refused{"inf kg", Dimension::mass, ArgumentError::not_finite},
    Refused{"-infinity kg", Dimension::mass, ArgumentError::not_finite},
    Refused{"1.7e308 rotations", Dimension::angle, ArgumentError::not_finite},
};

TEST(ParseQuantity, RefusesTheRestWithTheReason) {
  for (const Refused& row : refused) {
    const auto si = parse_quantity(row.text, row.dimension, "x");
    ASSERT_FALSE(si.has_value()) << row.text << " was read as " << *si;
    EXPECT_TRUE(si.error().is(row.code)) << row.text << ": " << si.error().code();
    EXPECT_EQ(si.error().subject(), "x");
  }
}

std::string message(std::string_view text, Dimension dimension, std::string_view name) {
  return to_string(parse_quantity(text, dimension, name).error());
}

TEST(ParseQuantity, MessagesNameTheThingAndWhatToDo) {
  EXPECT_EQ(message("8 m", Dimension::mass, "mass"),
            "mass is \"8 m\", a length; it must be a mass such as \"8 kg\" or \"18 lb\"");
  EXPECT_EQ(message("20", Dimension::time, "period"),
            "period is \"20\", without a unit; it must be a time such as \"20 ms\"");
  EXPECT_EQ(message("abc", Dimension::angle, "offset"),
            "offset is \"abc\"; it must be an angle such as \"15 deg\"");
  EXPECT_EQ(message("8 kgg", Dimension::mass, "mass"),
            "mass is \"8 kgg\", in an unknown unit; it must be a mass such as \"8 kg\" or \"18 "
            "lb\"; did you mean \"kg\"?");
  // A unit that is near but of another dimension is no help.
  EXPECT_EQ(message("8 lbs ft", Dimension::mass, "mass"),
            "mass is \"8 lbs ft\", in an unknown unit; it must be a mass such as \"8 kg\" or \"18 "
            "lb\"; did you mean \"lbs\"?");
  // What turns for what goes straight on.
  EXPECT_EQ(message("300 rpm", Dimension::velocity, "max_velocity"),
            "max_velocity is \"300 rpm\", an angular velocity; it must be a velocity such as \"1.5 "
            "m/s\"; what turns and what goes straight on differ by the radius of drum or wheel: "
            "multiply radians by it");
  EXPECT_NE(message("2 m", Dimension::angle, "x").find("over the radius"), std::string::npos);
  EXPECT_NE(message("5 quux", Dimension::mass, "x").find("flyball units"), std::string::npos);
  EXPECT_EQ(message("20 s m", Dimension::time, "period").find("cm"), std::string::npos);
}

TEST(ParseQuantity, GivesATaggedQuantity) {
  const auto mass = parse_quantity<Mass>("8 kg", "mass");
  ASSERT_TRUE(mass.has_value());
  EXPECT_EQ(*mass, 8_kg);
  EXPECT_FALSE(parse_quantity<Length>("8 kg", "mass").has_value());
}

TEST(ParseUnit, GivesDimensionAndFactor) {
  const auto unit = parse_unit(" Rotations per Second ");
  ASSERT_TRUE(unit.has_value());
  EXPECT_EQ(unit->dimension, Dimension::angular_velocity);
  EXPECT_DOUBLE_EQ(unit->factor, 2.0 * pi);
  EXPECT_EQ(parse_unit("")->dimension, Dimension::dimensionless);
}

TEST(ParseUnit, AnswersAnUnknownUnitWithTheNearest) {
  const auto near = parse_unit("metres per secnd");
  ASSERT_FALSE(near.has_value());
  EXPECT_TRUE(near.error().is(ArgumentError::wrong_unit));
  EXPECT_NE(to_string(near.error()).find("did you mean"), std::string::npos)
      << to_string(near.error());
  const auto far = parse_unit("quuxquuxquux");
  ASSERT_FALSE(far.has_value());
  EXPECT_EQ(to_string(far.error()),
            "unit is \"quuxquuxquux\", which is not known; units are written like kg, cm, in, rpm, "
            "V");
}

// Each name reads back to its unit; the SI unit leads.
TEST(Units, AreListed) {
  std::size_t names = 0;
  for (int d = 0; d <= static_cast<int>(Dimension::frequency); ++d) {
    const auto dimension = static_cast<Dimension>(d);
    const auto units = units_of(dimension);
    ASSERT_FALSE(units.empty());
    EXPECT_EQ(units.front().factor, 1.0);
    for (const NamedUnit& unit : units) {
      const auto read = parse_unit(unit.text);
      ASSERT_TRUE(read) << unit.text;
      EXPECT_EQ(read->dimension, dimension) << unit.text;
      EXPECT_EQ(read->factor, unit.factor) << unit.text;
    }
    names += units.size();
  }
  EXPECT_GE(names, 120U);
}

TEST(ToText, PrintsSiWithItsUnit) {
  EXPECT_EQ(to_text(8_kg), "8 kg");
  EXPECT_EQ(to_text(20_ms), "0.02 s");
  EXPECT_EQ(to_text(0.5, Dimension::dimensionless), "0.5");
  EXPECT_EQ(to_text(MomentOfInertia(0.01)), "0.01 kg m^2");
}

TEST(Dimensions, EachHasANameAndAUnitThatReadsBack) {
  for (const Dimension dimension : dimensions) {
    EXPECT_FALSE(to_string(dimension).empty());
    const auto unit = parse_unit(si_unit(dimension));
    ASSERT_TRUE(unit.has_value()) << si_unit(dimension);
    EXPECT_EQ(unit->dimension, dimension) << si_unit(dimension);
    EXPECT_EQ(unit->factor, 1.0) << si_unit(dimension);
  }
}

// What is printed is read back as the same number, to the last bit.
RC_GTEST_PROP(ToText, ReadsBackExactly, (double si)) {
  RC_PRE(std::isfinite(si));
  const Dimension dimension = *rc::gen::elementOf(dimensions);
  const auto read = parse_quantity(to_text(si, dimension), dimension, "x");
  RC_ASSERT(read.has_value());
  RC_ASSERT(*read == si);
}

// Whatever is written, the answer is a finite number or an error.
RC_GTEST_PROP(ParseQuantity, NeverAnswersWithANumberThatIsNotFinite,
              (const std::string& text, double number)) {
  const Dimension dimension = *rc::gen::elementOf(dimensions);
  for (const std::string& tried : {text, std::to_string(number) + text}) {
    const auto read = parse_quantity(tried, dimension, "x");
    RC_ASSERT(!read.has_value() || std::isfinite(*read));
  }
}

}  // namespace
}  // namespace flyball::quantity_test
