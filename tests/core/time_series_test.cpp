#include <flyball/core/time_series.hpp>

#include <vector>

#include <gtest/gtest.h>

namespace flyball::time_series_test {
namespace {

TEST(TimeSeries, StartsEmpty) {
  const TimeSeries series;
  EXPECT_EQ(series.rows(), 0U);
  EXPECT_TRUE(series.columns().empty());
  EXPECT_EQ(series.find("position"), nullptr);
}

TEST(TimeSeries, FindsItsColumnsByName) {
  TimeSeries series({0.0, 0.1, 0.2});
  ASSERT_TRUE(series.add("position", "m", {1.0, 2.0, 3.0}).has_value());
  ASSERT_TRUE(series.add("voltage", "V", {4.0, 5.0, 6.0}).has_value());
  EXPECT_EQ(series.rows(), 3U);
  EXPECT_EQ(series.time(), (std::vector<double>{0.0, 0.1, 0.2}));
  ASSERT_NE(series.find("voltage"), nullptr);
  EXPECT_EQ(*series.find("voltage"), (std::vector<double>{4.0, 5.0, 6.0}));
  EXPECT_EQ(series.find("Voltage"), nullptr);
  ASSERT_EQ(series.columns().size(), 2U);
  EXPECT_EQ(series.columns()[0].name, "position");
  EXPECT_EQ(series.columns()[1].unit, "V");
}

TEST(TimeSeries, RefusesAColumnOfAnotherLength) {
  TimeSeries series({0.0, 0.1, 0.2});
  const auto result = series.add("position", "m", {1.0, 2.0});
  ASSERT_FALSE(result.has_value());
  EXPECT_TRUE(result.error().is(ArgumentError::wrong_shape));
  EXPECT_EQ(to_string(result.error()),
            "TimeSeries::add: position is 2 values long; it must be one value a row (3)");
  EXPECT_TRUE(series.columns().empty());
}

TEST(TimeSeries, GrowsByRows) {
  TimeSeries series;
  ASSERT_TRUE(series.add("x", "m", {}).has_value());
  ASSERT_TRUE(series.add("v", "m/s", {}).has_value());
  series.reserve(2);
  series.append(0.0, {1.0, 10.0});
  series.append(0.5, {2.0, 20.0});
  EXPECT_EQ(series.time(), (std::vector<double>{0.0, 0.5}));
  EXPECT_EQ(*series.find("x"), (std::vector<double>{1.0, 2.0}));
  EXPECT_EQ(*series.find("v"), (std::vector<double>{10.0, 20.0}));
}

TEST(TimeSeries, RoomThatIsReservedIsNotTakenAgain) {
  TimeSeries series;
  ASSERT_TRUE(series.add("x", "m", {}).has_value());
  series.reserve(100);
  const double* const first = series.find("x")->data();
  for (int i = 0; i < 100; ++i) {
    series.append(i, {1.0 * i});
  }
  EXPECT_EQ(series.find("x")->data(), first);
}

}  // namespace
}  // namespace flyball::time_series_test
