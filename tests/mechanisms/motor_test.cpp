#include <flyball/mechanisms/motor.hpp>

#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace flyball::mechanisms::motor_test {
namespace {

using namespace flyball::literals;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

bool mentions(const Error& error, std::string_view words) {
  return to_string(error).find(words) != std::string::npos;
}

std::vector<std::vector<std::string>> rows_of_datasheets() {
  std::ifstream stream(std::string(FLYBALL_PROJECT_DATA) + "/motors.csv");
  std::vector<std::vector<std::string>> rows;
  std::string line;
  std::getline(stream, line);
  while (std::getline(stream, line)) {
    std::vector<std::string> cells;
    std::stringstream text(line);
    for (std::string cell; std::getline(text, cell, ',');) {
      cells.push_back(cell);
    }
    rows.push_back(cells);
  }
  return rows;
}

TEST(MotorTable, HoldsEveryDatasheet) {
  const auto rows = rows_of_datasheets();
  ASSERT_EQ(rows.size(), 19U);
  ASSERT_EQ(motor_table().size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const MotorTableEntry& entry = motor_table()[i];
    ASSERT_EQ(rows[i].size(), 7U);
    EXPECT_EQ(entry.name, rows[i][0]);
    EXPECT_EQ(entry.nominal_voltage, std::stod(rows[i][2])) << entry.name;
    EXPECT_EQ(entry.stall_torque, std::stod(rows[i][3])) << entry.name;
    EXPECT_EQ(entry.stall_current, std::stod(rows[i][4])) << entry.name;
    EXPECT_EQ(entry.free_current, std::stod(rows[i][5])) << entry.name;
    EXPECT_EQ(entry.free_speed_rpm, std::stod(rows[i][6])) << entry.name;
  }
}

TEST(MotorTable, EveryNameAndAliasFindsItsMotor) {
  for (const auto& row : rows_of_datasheets()) {
    for (const std::string& name : {row[0], row[1]}) {
      if (name.empty()) {
        continue;
      }
      const auto found = motor(name);
      ASSERT_TRUE(found) << name << ": " << to_string(found.error());
      EXPECT_EQ(found->name, row[0]);
      EXPECT_EQ(found->free_speed, std::stod(row[6]) * std::numbers::pi / 30.0);
    }
  }
}

// What every row must satisfy, whatever its numbers: at the nominal voltage the motor stands with
// its stall torque and current, and at its free speed it draws its free current.
TEST(MotorTable, StallsAndRunsFreeAsTheDatasheetSays) {
  for (const MotorTableEntry& entry : motor_table()) {
    const DcMotor one = motor(entry.name).value();
    const double V = entry.nominal_voltage;
    EXPECT_NEAR(one.current(0.0, V), entry.stall_current, 1e-12 * entry.stall_current);
    EXPECT_NEAR(one.torque(0.0, V), entry.stall_torque, 1e-12 * entry.stall_torque);
    EXPECT_NEAR(one.current(one.free_speed, V), entry.free_current, 1e-12 * entry.stall_current);
  }
}

// R, K_t and K_v in full from the scripts that draw the book's figures (frccontrol's models.py in
// Python 3.11: DcBrushedMotor(nominal_voltage, stall_torque, stall_current, free_current, rpm)).
TEST(MotorTable, ConstantsOfTheBooksScripts) {
  struct Golden {
    std::string_view name;
    double R;
    double Kt;
    double Kv;
  };
  constexpr std::array golden{
      Golden{"CIM", 0.09022556390977443, 0.01819548872180451, 47.29869062302208},
      Golden{"MiniCIM", 0.1348314606741573, 0.015842696629213483, 52.741414652126316},
      Golden{"BAG", 0.22641509433962265, 0.008113207547169812, 119.06077106329288},
      Golden{"775pro", 0.08955223880597014, 0.005298507462686567, 164.30841197450897},
      Golden{"AndyMark RS775-125", 0.6666666666666666, 0.015555555555555557, 55.55255302079512},
      Golden{"BaneBots RS-775", 0.12371134020618557, 0.007422680412371134, 117.14342702211147},
      Golden{"AndyMark 9015", 0.16901408450704225, 0.0050704225352112674, 131.37557490661925},
      Golden{"BaneBots RS-550", 0.14285714285714285, 0.004523809523809524, 166.59961041764055},
      Golden{"NEO", 0.11428571428571428, 0.024761904761904763, 50.39638215133627},
      Golden{"NEO 550", 0.12, 0.0097, 97.35609417818267},
      Golden{"Falcon 500", 0.04669260700389105, 0.01824902723735409, 56.00286812769124},
  };
  for (const Golden& expected : golden) {
    const DcMotor found = motor(expected.name).value();
    EXPECT_NEAR(found.R, expected.R, 1e-15 * expected.R * 4) << expected.name;
    EXPECT_NEAR(found.Kt, expected.Kt, 1e-15 * expected.Kt * 4) << expected.name;
    EXPECT_NEAR(found.Kv, expected.Kv, 1e-15 * expected.Kv * 4) << expected.name;
  }
}

TEST(MotorTable, FunctionsAreTheTablesRows) {
  const std::array<std::pair<DcMotor (*)(int), std::string_view>, 14> functions{{
      {cim, "CIM"},
      {mini_cim, "MiniCIM"},
      {bag, "BAG"},
      {vex_775pro, "775pro"},
      {neo, "NEO"},
      {neo_550, "NEO 550"},
      {neo_vortex, "NEO Vortex"},
      {falcon_500, "Falcon 500"},
      {falcon_500_foc, "Falcon 500 FOC"},
      {kraken_x60, "Kraken X60"},
      {kraken_x60_foc, "Kraken X60 FOC"},
      {kraken_x44, "Kraken X44"},
      {kraken_x44_foc, "Kraken X44 FOC"},
      {minion, "Minion"},
  }};
  for (const auto& [function, name] : functions) {
    const DcMotor from_function = function(2);
    const DcMotor from_name = motor(name, 2).value();
    EXPECT_EQ(from_function.name, name);
    EXPECT_EQ(from_function.R, from_name.R);
    EXPECT_EQ(from_function.Kt, from_name.Kt);
    EXPECT_EQ(from_function.Kv, from_name.Kv);
    EXPECT_EQ(from_function.count, 2);
  }
}

// n motors in one gearbox: torque and current times n at the same speed, so R/n, K_t and K_v stay.
TEST(Motor, CountMultipliesTorqueAndCurrent) {
  {
    const bool holds = rc::check([] {
      const int n = *rc::gen::inRange(1, 20);
      const auto index = *rc::gen::inRange<std::size_t>(0, motor_table().size());
      const double omega = *rc::gen::inRange(-2000, 2001);
      const double V = 0.1 * *rc::gen::inRange(-120, 121);
      const DcMotor one = motor(motor_table()[index].name).value();
      const DcMotor many = motor(motor_table()[index].name, n).value();
      RC_ASSERT(std::abs(many.R - one.R / n) <= 1e-14 * one.R);
      RC_ASSERT(std::abs(many.Kt - one.Kt) <= 1e-14 * one.Kt);
      RC_ASSERT(std::abs(many.Kv - one.Kv) <= 1e-14 * one.Kv);
      RC_ASSERT(many.free_speed == one.free_speed);
      const double scale = one.stall_current * n;
      RC_ASSERT(std::abs(many.current(omega, V) - n * one.current(omega, V)) <= 1e-12 * scale);
    });
    EXPECT_TRUE(holds);
  }
}

// R = V/I_stall = 24/120 = 0.2 Ω (12.5), K_t = 6/120 = 0.05 N m/A (12.4),
// K_v = 440/(24 - 10·0.2) = 20 rad/s/V (12.6).
TEST(Motor, FromDatasheetNumbers) {
  const DcMotor found = motor("shop motor", {.nominal_voltage = 24_V,
                                             .stall_torque = Torque(6.0),
                                             .stall_current = 120_A,
                                             .free_current = 10_A,
                                             .free_speed = AngularVelocity(440.0)})
                            .value();
  EXPECT_EQ(found.name, "shop motor");
  EXPECT_EQ(found.count, 1);
  EXPECT_EQ(found.nominal_voltage, 24.0);
  EXPECT_DOUBLE_EQ(found.R, 0.2);
  EXPECT_DOUBLE_EQ(found.Kt, 0.05);
  EXPECT_DOUBLE_EQ(found.Kv, 20.0);
  // τ = K_t (V/R - ω/(K_v R)) = 0.05 (12/0.2 - 100/(20·0.2)) = 1.75 N m.
  EXPECT_DOUBLE_EQ(found.current(100.0, 12.0), 35.0);
  EXPECT_DOUBLE_EQ(found.torque(100.0, 12.0), 1.75);
}

TEST(Motor, ADatasheetWithoutFreeCurrentIsOfALosslessMotor) {
  const DcMotor found = motor("lossless", {.nominal_voltage = 12_V,
                                           .stall_torque = Torque(1.0),
                                           .stall_current = 100_A,
                                           .free_current = 0_A,
                                           .free_speed = AngularVelocity(120.0)})
                            .value();
  EXPECT_DOUBLE_EQ(found.Kv, 10.0);
}

TEST(Motor, RefusesImpossibleDatasheets) {
  const MotorDatasheet good{.nominal_voltage = 12_V,
                            .stall_torque = Torque(2.0),
                            .stall_current = 100_A,
                            .free_current = 2_A,
                            .free_speed = AngularVelocity(500.0)};
  ASSERT_TRUE(motor("good", good));
  const auto refuses = [](MotorDatasheet sheet, ArgumentError code, std::string_view name) {
    const auto found = motor("bad", sheet);
    return !found && found.error().is(code) && found.error().subject() == name;
  };
  for (const double bad : {0.0, -1.0, nan, infinity}) {
    const ArgumentError code =
        std::isfinite(bad) ? ArgumentError::not_positive : ArgumentError::not_finite;
    MotorDatasheet sheet = good;
    sheet.nominal_voltage = Voltage(bad);
    EXPECT_TRUE(refuses(sheet, code, "nominal_voltage")) << bad;
    sheet = good;
    sheet.stall_torque = Torque(bad);
    EXPECT_TRUE(refuses(sheet, code, "stall_torque")) << bad;
    sheet = good;
    sheet.stall_current = Current(bad);
    EXPECT_TRUE(refuses(sheet, code, "stall_current")) << bad;
    sheet = good;
    sheet.free_speed = AngularVelocity(bad);
    EXPECT_TRUE(refuses(sheet, code, "free_speed")) << bad;
  }
  MotorDatasheet sheet = good;
  for (const double bad : {-0.1, 100.0, 101.0}) {  // (12.6) divides by V - I_free R
    sheet.free_current = Current(bad);
    EXPECT_TRUE(refuses(sheet, ArgumentError::out_of_range, "free_current")) << bad;
  }
  sheet.free_current = Current(nan);
  EXPECT_TRUE(refuses(sheet, ArgumentError::not_finite, "free_current"));
}

// Each number is a double, their quotients need not be: 1e300 V / 1e-300 A.
TEST(Motor, RefusesDatasheetsWhoseConstantsOverflow) {
  const auto found = motor("absurd", {.nominal_voltage = Voltage(1e300),
                                      .stall_torque = Torque(1.0),
                                      .stall_current = Current(1e-300),
                                      .free_current = Current(0.0),
                                      .free_speed = AngularVelocity(1.0)});
  ASSERT_FALSE(found);
  EXPECT_TRUE(found.error().is(ArgumentError::not_finite));
}

TEST(Motor, RefusesACountBelowOne) {
  for (const int count : {0, -1, std::numeric_limits<int>::min()}) {
    EXPECT_TRUE(motor("NEO", count).error().is(ArgumentError::out_of_range));
    EXPECT_TRUE(motor("x", MotorDatasheet{}, count).error().is(ArgumentError::out_of_range));
  }
  EXPECT_EQ(motor("NEO", 0).error().kind(), ErrorKind::misuse);
}

TEST(MotorName, CaseSpacesAndPunctuationDoNotMatter) {
  for (const std::string_view name :
       {"krakenX60foc", "KRAKEN X60 FOC", "kraken-x60_foc", " Kraken.X60 (FOC) "}) {
    EXPECT_EQ(motor(name).value().name, "Kraken X60 FOC") << name;
  }
  EXPECT_EQ(motor("rs775 125").value().name, "AndyMark RS775-125");
  EXPECT_EQ(motor("mini-cim").value().name, "MiniCIM");
  // A name that is whole wins over the longer names that it begins.
  EXPECT_EQ(motor("neo").value().name, "NEO");
  EXPECT_EQ(motor("cim").value().name, "CIM");
  EXPECT_EQ(motor("kraken x60").value().name, "Kraken X60");
  // A word that only one motor has is enough.
  EXPECT_EQ(motor("vortex").value().name, "NEO Vortex");
  EXPECT_EQ(motor("romi").value().name, "Romi built-in");
}

// Any mixture of case, and separators between any two letters, is the same name.
TEST(MotorName, AnySpellingOfANameIsTheName) {
  {
    const bool holds = rc::check([] {
      const auto index = *rc::gen::inRange<std::size_t>(0, motor_table().size());
      std::string spelled;
      for (const char c : motor_table()[index].name) {
        spelled += *rc::gen::element<std::string>("", " ", "-", "_", "\t", ".");
        const auto byte = static_cast<unsigned char>(c);
        spelled += static_cast<char>(*rc::gen::arbitrary<bool>() ? std::toupper(byte)
                                                                 : std::tolower(byte));
      }
      RC_ASSERT(motor(spelled).value().name == motor_table()[index].name);
    });
    EXPECT_TRUE(holds);
  }
}

TEST(MotorName, AnAmbiguousNameIsAnsweredWithTheCandidates) {
  const auto found = motor("kraken");
  ASSERT_FALSE(found);
  EXPECT_TRUE(found.error().is(ArgumentError::ambiguous_name));
  EXPECT_EQ(found.error().kind(), ErrorKind::misuse);
  EXPECT_TRUE(mentions(found.error(), "\"kraken\""));
  for (const std::string_view candidate :
       {"Kraken X60,", "Kraken X60 FOC", "Kraken X44,", "Kraken X44 FOC"}) {
    EXPECT_TRUE(mentions(found.error(), candidate)) << candidate;
  }
  EXPECT_FALSE(mentions(found.error(), "Falcon"));
  // A name and an alias of one motor are one candidate.
  const Error of_775 = motor("775").error();
  EXPECT_TRUE(of_775.is(ArgumentError::ambiguous_name));
  const std::string text = to_string(of_775);
  EXPECT_EQ(text.find("AndyMark RS775-125"), text.rfind("AndyMark RS775-125"));
}

// Part of a word is no word: who writes "NEO 5" may mean another motor than the NEO 550.
TEST(MotorName, APartOfAWordIsNoName) {
  for (const auto& [part, whole] : {std::pair{"NEO 5", "NEO 550"},
                                    {"neo55", "NEO 550"},
                                    {"vort", "NEO Vortex"},
                                    {"falcon 50", "Falcon 500"}}) {
    const auto found = motor(part);
    ASSERT_FALSE(found) << part;
    EXPECT_TRUE(mentions(found.error(), whole)) << to_string(found.error());
  }
  EXPECT_EQ(motors_like("kraken").size(), 4U);
  EXPECT_EQ(motors_like("NEO 5"), std::vector<std::string_view>{"NEO 550"});
  EXPECT_TRUE(motors_like("").empty());
}

TEST(MotorName, AnUnknownNameIsAnsweredWithTheNearest) {
  const Error misspelt = motor("Kracken X60").error();
  EXPECT_TRUE(misspelt.is(ArgumentError::unknown_name));
  EXPECT_TRUE(mentions(misspelt, "did you mean \"Kraken X60\"?"));
  const Error alien = motor("hamster wheel").error();
  EXPECT_TRUE(alien.is(ArgumentError::unknown_name));
  EXPECT_TRUE(mentions(alien, "known motors are CIM, "));
  EXPECT_TRUE(mentions(alien, "datasheet numbers"));
  for (const std::string_view nothing : {"", " ", "--"}) {
    EXPECT_TRUE(motor(nothing).error().is(ArgumentError::unknown_name)) << nothing;
  }
}

}  // namespace
}  // namespace flyball::mechanisms::motor_test
