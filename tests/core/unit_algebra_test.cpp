#include <flyball/core/unit_algebra.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace flyball::unit_algebra_test {
namespace {

struct Case {
  const char* text;
  double factor;
  const char* dimension;
};

TEST(UnitAlgebra, ReadsProductsOfUnits) {
  constexpr double inch = 0.0254;
  constexpr double pound = 0.45359237;
  const Case cases[] = {
      {"", 1, "1"},
      {"1", 1, "1"},
      {"%", 0.01, "1"},
      {"kg", 1, "kg"},
      {"kg m^2", 1, "kg m^2"},
      {"kg m^2/s^2", 1, "N m"},
      {"kg·m²/s²", 1, "N m"},
      {"kg*m**2/s**2", 1, "N m"},
      {"kg m s^-2", 1, "N"},
      {"kg m s-2", 1, "N"},
      {"m s⁻¹", 1, "m/s"},
      {"1/s", 1, "1/s"},
      {"m/s/s", 1, "m/s^2"},
      {"V*s/rad", 1, nullptr},
      {"V/(rad/s)", 1, nullptr},
      {"N·m/A", 1, "N m/A"},
      {"J", 1, "N m"},
      {"W", 1, "W"},
      {"V A", 1, "W"},
      {"Ohm F", 1, "s"},
      {"H/Ohm", 1, "s"},
      {"T m^2/s", 1, "V"},
      {"Wb/s", 1, "V"},
      {"Pa m^2", 1, "N"},
      {"C/s", 1, "A"},
      {"kV", 1e3, "V"},
      {"mH", 1e-3, "H"},
      {"µF", 1e-6, "F"},
      {"MN", 1e6, "N"},
      {"GPa", 1e9, "kg/(m s^2)"},
      {"mm^2", 1e-6, "m^2"},
      {"cm^3", 1e-6, "m^3"},
      {"N/mm", 1e3, "kg/s^2"},
      {"lb in^2", pound * inch * inch, "kg m^2"},
      {"lb*ft/s^2", pound * 0.3048, "N"},
      {"rpm/V", std::numbers::pi / 30.0, nullptr},
      {"deg/s^2", std::numbers::pi / 180.0, "rad/s^2"},
      {"rotations per second per second", 2.0 * std::numbers::pi, "rad/s^2"},
      {"newton meters per amp", 1, "N m/A"},
      {"m^0.5", 1, "m^(1/2)"},
      {"m^(1/3)", 1, "m^(1/3)"},
      {"W/(m K)", 1, "kg m/(K s^3)"},
      {"km/h", 1000.0 / 3600.0, "m/s"},
      {"in lb", 0.1129848290276167, "N m"},
  };
  for (const Case& each : cases) {
    const auto unit = parse_si_unit(each.text);
    ASSERT_TRUE(unit) << each.text << ": " << to_string(unit.error());
    EXPECT_DOUBLE_EQ(unit->factor, each.factor) << each.text;
    if (each.dimension != nullptr) {
      EXPECT_EQ(to_text(unit->dimension), each.dimension) << each.text;
    }
  }
}

TEST(UnitAlgebra, WhatItPrintsItReads) {
  for (const char* text :
       {"kg m^2", "V s/rad", "m^(1/2)", "N m/A", "kg/(m s^2)", "K/s", "1/(A s)", "rad/s^2", "1"}) {
    const auto unit = parse_si_unit(text);
    ASSERT_TRUE(unit) << text;
    const auto again = parse_si_unit(to_text(unit->dimension));
    ASSERT_TRUE(again) << to_text(unit->dimension);
    EXPECT_TRUE(again->dimension.fits(unit->dimension)) << text;
  }
}

TEST(UnitAlgebra, EveryNamedDimensionPrintsItsSiUnit) {
  for (int k = 0; k <= static_cast<int>(Dimension::frequency); ++k) {
    const auto dimension = static_cast<Dimension>(k);
    const auto unit = parse_si_unit(si_unit(dimension));
    ASSERT_TRUE(unit) << k;
    EXPECT_EQ(unit->factor, 1.0) << k;
    EXPECT_TRUE(unit->dimension.fits(si_dimension(dimension))) << k;
  }
}

TEST(UnitAlgebra, AnglesFitPlainNumbers) {
  EXPECT_TRUE(parse_si_unit("rad/s")->dimension.fits(parse_si_unit("1/s")->dimension));
  EXPECT_TRUE(parse_si_unit("deg")->dimension.dimensionless());
  EXPECT_FALSE(parse_si_unit("m")->dimension.dimensionless());
  const SiDimension third = power(parse_si_unit("m")->dimension, 1.0 / 3.0);
  EXPECT_TRUE((third * third * third).fits(si_dimension(Dimension::length)));
}

TEST(UnitAlgebra, RefusesWhatItCannotRead) {
  for (const char* text :
       {"furlong", "kg furlong", "kg m/s/zz", "10 kg", "11", "2 m", "kin", "hh"}) {
    EXPECT_FALSE(parse_si_unit(text)) << text;
  }
  for (const char* text :
       {"m/", "/", "m//s", "(m", "m)", "m^", "m^x", "m^(1/0)", "m^1000", "m^nan"}) {
    const auto unit = parse_si_unit(text);
    ASSERT_FALSE(unit) << text;
    EXPECT_TRUE(unit.error().is(ArgumentError::malformed)) << text;
  }
  EXPECT_FALSE(parse_si_unit(std::string(100'000, '(')));
  EXPECT_EQ(to_string(parse_si_unit("kg fot").error()),
            "unit is \"fot\", which is not known; did you mean \"ft\"?");
}

TEST(UnitAlgebra, TakesQuantitiesApart) {
  const Case cases[] = {{"2.5 kg m^2", 2.5, "kg m^2"},
                        {" -1e3V ", -1000.0, "V"},
                        {"+.5", 0.5, ""},
                        {"3", 3.0, ""},
                        {"12\tN·m/A\n", 12.0, "N·m/A"}};
  for (const Case& each : cases) {
    const auto quantity = split_quantity(each.text, "k");
    ASSERT_TRUE(quantity) << each.text;
    EXPECT_EQ(quantity->number, each.factor) << each.text;
    EXPECT_EQ(quantity->unit, each.dimension) << each.text;
  }
  for (const char* text : {"", "  ", "kg", "+-1 kg", "--1", "+"}) {
    const auto quantity = split_quantity(text, "k");
    ASSERT_FALSE(quantity) << text;
    EXPECT_TRUE(quantity.error().is(ArgumentError::malformed)) << text;
  }
  for (const char* text : {"inf kg", "nan", "1e999 m"}) {
    const auto quantity = split_quantity(text, "k");
    ASSERT_FALSE(quantity) << text;
    EXPECT_TRUE(quantity.error().is(ArgumentError::not_finite)) << text;
  }
}

}  // namespace
}  // namespace flyball::unit_algebra_test
