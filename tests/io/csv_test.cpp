#include <flyball/io/csv.hpp>

#include <cmath>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "io/examples.hpp"
#include "io/temporary_folder.hpp"

namespace flyball::csv_test {
namespace {

using namespace std::string_literals;
using Values = std::vector<double>;

Expected<Log> parse(std::string_view text) {
  return parse_csv(text, "a.csv");
}

TEST(Csv, UnitsInParenthesesAndBrackets) {
  const Log log = parse(
                      "Timestamp,Volts (V),Velocity [m/s],Position(m),pose[0],bare\n"
                      "0.5,1,2,3,4,5\n")
                      .value();
  ASSERT_EQ(log.signals.size(), 5U);
  EXPECT_EQ(log.signals[0].name, "Volts");
  EXPECT_EQ(log.signals[0].unit, "V");
  EXPECT_EQ(log.find_signal("Velocity")->unit, "m/s");
  EXPECT_EQ(log.find_signal("Position")->unit, "m");
  EXPECT_EQ(log.find_signal("pose[0]")->unit, "");
  EXPECT_EQ(log.find_signal("bare")->time, Values{0.5});
}

TEST(Csv, EveryLineEndAndDelimiter) {
  for (const char* end : {"\n", "\r\n", "\r"}) {
    for (const char* delimiter : {",", ";", "\t"}) {
      const std::string d = delimiter;
      const std::string text =
          "\xEF\xBB\xBFtime (s)" + d + "a" + end + "0" + d + "1.5" + end + end + "1" + d + "-2e3";
      const Expected<Log> log = parse(text);
      ASSERT_TRUE(log) << text << to_string(log.error());
      EXPECT_EQ(log->signals[0].time, (Values{0, 1})) << text;
      EXPECT_EQ(log->signals[0].value, (Values{1.5, -2000})) << text;
    }
  }
}

TEST(Csv, DecimalCommas) {
  const Log log = parse("t;x;y\n0,5;1,25;\"3,5\"\n0,75;-2,5e1;4.5\n").value();
  EXPECT_EQ(log.find_signal("x")->time, (Values{0.5, 0.75}));
  EXPECT_EQ(log.find_signal("x")->value, (Values{1.25, -25}));
  EXPECT_EQ(log.find_signal("y")->value, (Values{3.5, 4.5}));
}

TEST(Csv, BlankCellsAreNoValue) {
  const Log log = parse("Timestamp,a,b\n0,1,\n1,,2\n2, ,3,\n3\n").value();
  EXPECT_EQ(log.find_signal("a")->time, Values{0});
  EXPECT_EQ(log.find_signal("b")->time, (Values{1, 2}));
  EXPECT_TRUE(log.diagnostics.empty());
}

TEST(Csv, AdvantageScopeList) {
  const Log log = parse(
                      "Timestamp,Key,Value\n0.1,/v,1.5\n0.2,/state,none\n0.3,/v,2.5\n"
                      "0.4,/on,true\n0.5,/state,7\n")
                      .value();
  EXPECT_EQ(log.find_signal("/v")->time, (Values{0.1, 0.3}));
  EXPECT_EQ(log.find_signal("/v")->value, (Values{1.5, 2.5}));
  EXPECT_EQ(log.find_signal("/on")->value, Values{1});
  EXPECT_EQ(log.find_text("/state")->value, (std::vector<std::string>{"none", "7"}));
}

TEST(Csv, SysIdToCsv) {
  const Log log = parse(
                      "Timestamp (s),Test,Volts (V),Position(m),Velocity (m/s)\n\n"
                      "0.1,slow-forward,0.5,1,2\n0.2,fast-backward,-7,1.5,-2\n")
                      .value();
  EXPECT_EQ(log.find_text("Test")->value,
            (std::vector<std::string>{"slow-forward", "fast-backward"}));
  EXPECT_EQ(log.find_signal("Velocity")->value, (Values{2, -2}));
  EXPECT_EQ(log.find_signal("Position")->unit, "m");
}

TEST(Csv, QuotesCommentsAndMultilineCells) {
  const Log log = parse(
                      "# a comment\n\"Time (s)\",\"a, \"\"b\"\" (V)\",note\n"
                      "0,\"1\",\"two\nlines\"\n1,2,plain\n")
                      .value();
  EXPECT_EQ(log.signals[0].name, "a, \"b\"");
  EXPECT_EQ(log.signals[0].value, (Values{1, 2}));
  EXPECT_EQ(log.find_text("note")->value, (std::vector<std::string>{"two\nlines", "plain"}));
}

TEST(Csv, Windows1252) {
  const Log log = parse("Time (s),Torque (N\xB7m),cost (\x80)\n0,1,2\n").value();
  EXPECT_EQ(log.signals[0].unit, "N·m");
  EXPECT_EQ(log.signals[1].unit, "€");
}

TEST(Csv, TimeUnitsAndNames) {
  EXPECT_EQ(parse("x,Time (ms)\n5,250\n")->signals[0].time, Values{0.25});
  EXPECT_EQ(parse("x,TIME [us]\n5,250000\n")->signals[0].time, Values{0.25});
  const Log odd = parse("Time (fortnights),x\n1,2\n").value();
  EXPECT_EQ(odd.signals[0].time, Values{1});
  EXPECT_TRUE(has_diagnostic(odd.diagnostics, "unknown_time_unit"));
}

// A time without a unit whose steps are no seconds of anything that moves.
TEST(Csv, TheUnitOfTimeIsSeenByItsSteps) {
  const auto expect = [](const std::string& text, double first, const std::string& unit) {
    const Log log = parse(text).value();
    EXPECT_EQ(log.signals[0].time.front(), first) << text;
    EXPECT_EQ(has_diagnostic(log.diagnostics, "assumed_time_unit"), !unit.empty()) << text;
    for (const Diagnostic& diagnostic : log.diagnostics) {
      EXPECT_TRUE(contains(diagnostic.message, "taken for " + unit)) << diagnostic.message;
    }
  };
  expect("timestamp,x\n10000000,1\n10019990,2\n10040039,3\n", 10.0, "microseconds");
  expect("timestamp,x\n10000,1\n10005,2\n10010,3\n", 10.0, "milliseconds");
  expect("timestamp,x\n2000000000,1\n2020000000,2\n", 2.0, "nanoseconds");
  expect("Timestamp,Key,Value\n20000,a,1\n20000,b,1\n40000,a,2\n", 0.02, "microseconds");
  expect("timestamp,x\n0,1\n4.9,2\n9.8,3\n", 0.0, "");
  expect("timestamp,x\n7,1\n7.02,2\n900,3\n900.02,4\n", 7.0, "");  // one gap
  expect("time (s),x\n10000000,1\n10020000,2\n", 1e7, "");
  expect("time,x\n10000000,1\n", 1e7, "");
}

TEST(Csv, TheUnitOfTimeIsInItsName) {
  for (const auto& [name, scale] : {std::pair{"timestamp_us", 1e-6},
                                    {"Time_ms", 1e-3},
                                    {"t_ns", 1e-9},
                                    {"time_s", 1.0},
                                    {"TimestampMicros", 1e-6},
                                    {"elapsed time sec", 1.0}}) {
    const auto log = parse_csv(std::string(name) + ",x\n0,1\n4,2\n8,3\n", "log.csv");
    ASSERT_TRUE(log) << to_string(log.error());
    EXPECT_DOUBLE_EQ(log->signals.at(0).time.at(1), 4.0 * scale) << name;
    EXPECT_TRUE(log->diagnostics.empty()) << name;
  }
  // A name that only ends like a unit.
  EXPECT_FALSE(parse_csv("status,x\nb,1\na,2\n", "log.csv"));
}

TEST(Csv, NoValueIsWrittenInManyWays) {
  const auto log =
      parse_csv("Timestamp,x,state\n0,null,null\n1,null,none\n2,null,N/A\n3,5,on\n", "a.csv");
  ASSERT_TRUE(log) << to_string(log.error());
  ASSERT_EQ(log->signals.size(), 1U);
  EXPECT_EQ(log->signals[0].value, std::vector<double>{5.0});
  // "none" is a word: the state of a robot in which no test runs.
  ASSERT_EQ(log->texts.size(), 1U);
  EXPECT_EQ(log->texts[0].value, (std::vector<std::string>{"none", "on"}));
  const auto list = parse_csv("Timestamp,Key,Value\n0,x,null\n1,x,2\n", "a.csv");
  ASSERT_TRUE(list) << to_string(list.error());
  EXPECT_EQ(list->signals.at(0).value, std::vector<double>{2.0});
}

TEST(Csv, LinesBeforeTheHeader) {
  for (const char* before : {"sep=;\n", "SEP=;\r\n", "Robot log, exported 2025\n\n",
                             "My log; of today\nsecond\n", "sep=;\nRobot log\n"}) {
    const auto log = parse_csv(std::string(before) + "Time (s);x\n0,5;1,5\n1,5;2\n", "a.csv");
    ASSERT_TRUE(log) << before << to_string(log.error());
    ASSERT_EQ(log->signals.size(), 1U) << before;
    EXPECT_EQ(log->signals[0].time, (std::vector<double>{0.5, 1.5})) << before;
    EXPECT_EQ(log->signals[0].value, (std::vector<double>{1.5, 2.0})) << before;
  }
}

TEST(Csv, QuotedDecimalCommas) {
  const auto log = parse_csv("time,x\n\"0,020\",\"1,5\"\n\"0,040\",\"-2,25\"\n", "a.csv");
  ASSERT_TRUE(log) << to_string(log.error());
  EXPECT_EQ(log->signals.at(0).time, (std::vector<double>{0.02, 0.04}));
  EXPECT_EQ(log->signals.at(0).value, (std::vector<double>{1.5, -2.25}));
}

TEST(Csv, TimesWrittenAsDates) {
  for (const char* rows : {"2025-02-28T23:59:59.500Z,1\n2025-03-01T00:00:00.250Z,2\n",
                           "2025-02-28 23:59:59.5,1\n2025-03-01 00:00:00.25,2\n",
                           "2025-03-01T00:59:59.5+01:00,1\n2025-02-28T23:00:00.25-0100,2\n",
                           "12:00:00.5,1\n12:00:01.25,2\n"}) {
    const auto log = parse_csv(std::string("time,x\n") + rows, "a.csv");
    ASSERT_TRUE(log) << to_string(log.error());
    ASSERT_EQ(log->signals.at(0).time.size(), 2U) << rows;
    EXPECT_NEAR(log->signals[0].time[0], 0.0, 1e-9) << rows;
    EXPECT_NEAR(log->signals[0].time[1], 0.75, 1e-6) << rows;
  }
  EXPECT_FALSE(parse_csv("time,x\n2025-13-01T00:00:00,1\n2025-13-01T00:00:01,2\n", "a.csv"));
}

TEST(Csv, TimeThatBeginsAnewIsPutInOrder) {
  std::string text = "time (s),x\n";
  for (int part = 0; part < 3; ++part) {
    for (int k = 0; k < 50; ++k) {
      text += fmt::format("{},{}\n", 0.02 * k, part);
    }
  }
  const auto log = parse_csv(text, "a.csv");
  ASSERT_TRUE(log) << to_string(log.error());
  const Signal& x = log->signals.at(0);
  ASSERT_EQ(x.time.size(), 150U);
  EXPECT_TRUE(std::is_sorted(x.time.begin(), x.time.end()));
  EXPECT_EQ(x.value[49], 0.0);
  EXPECT_EQ(x.value[50], 1.0);
  EXPECT_NEAR(x.time[50] - x.time[49], 2.0, 1e-12);
  EXPECT_NEAR(x.time[149] - x.time[100], 0.98, 1e-12);
  ASSERT_EQ(log->diagnostics.size(), 1U);
  EXPECT_EQ(log->diagnostics[0].code, "time_restarts");
  // One block of rows that comes late is rows out of order.
  const auto shuffled = parse_csv("time (s),x\n5,1\n6,2\n7,3\n1,0\n8,4\n9,5\n", "a.csv");
  ASSERT_TRUE(shuffled) << to_string(shuffled.error());
  EXPECT_EQ(shuffled->diagnostics.at(0).code, "unsorted_time");
}

TEST(Csv, TheFirstColumnIsTimeOnlyIfItCanBe) {
  EXPECT_TRUE(has_diagnostic(parse("step,x\n0,2\n1,3\n")->diagnostics, "assumed_time_column"));
  EXPECT_TRUE(has_diagnostic(parse("0,2\n1,3\n")->diagnostics, "no_header"));
  EXPECT_EQ(parse("0,2\n1,3\n")->signals[0].name, "column 2");
  for (const char* text : {"Speed (RPM),x\n0,2\n1,3\n", "step,x\n1,2\n0,3\n", "step,x\na,2\n"}) {
    EXPECT_TRUE(parse(text).error().is(LogError::no_time)) << text;
  }
}

TEST(Csv, UnsortedNonFiniteAndStrayCells) {
  const Log log = parse("t,x\n2,20\n1,10\n3,NaN\n4,inf\n5,oops\nwhen,60\n7,70\n8,80\n").value();
  EXPECT_EQ(log.signals[0].time, (Values{1, 2, 7, 8}));
  EXPECT_EQ(log.signals[0].value, (Values{10, 20, 70, 80}));
  for (const char* code :
       {"unsorted_time", "non_finite_rows", "non_numeric_cells", "malformed_rows"}) {
    EXPECT_TRUE(has_diagnostic(log.diagnostics, code)) << code;
  }
}

TEST(Csv, WritesHeaderAndShortestNumbers) {
  TimeSeries series(Values{0.0, 0.1});
  ASSERT_TRUE(series.add("velocity", "m/s", {1.0 / 3.0, std::nan("")}));
  ASSERT_TRUE(series.add("a,b \"c\"", "", {1e-300, -2.0}));
  EXPECT_EQ(to_csv(series),
            "time (s),velocity (m/s),\"a,b \"\"c\"\"\"\n0,0.3333333333333333,1e-300\n0.1,,-2\n");
}

TEST(Csv, ReadsBackWhatItWrites) {
  const bool ok = rc::check("read(write(table)) == table, to the last bit", [] {
    const auto finite = rc::gen::suchThat(rc::gen::arbitrary<double>(),
                                          [](double value) { return std::isfinite(value); });
    const auto rows = *rc::gen::inRange<std::size_t>(1, 20);
    Values time = *rc::gen::container<Values>(rows, finite);
    std::sort(time.begin(), time.end());
    TimeSeries series(time);
    const Values a = *rc::gen::container<Values>(rows, finite);
    const Values b = *rc::gen::container<Values>(rows, finite);
    RC_ASSERT(series.add("größe; \"a\",", "rad/s", a).has_value());
    RC_ASSERT(series.add("#b", "", b).has_value());
    const Expected<Log> log = parse(to_csv(series));
    RC_ASSERT(log.has_value());
    RC_ASSERT(log->diagnostics.empty());
    RC_ASSERT(log->signals.size() == 2U);
    RC_ASSERT(log->signals[0].name == "größe; \"a\",");
    RC_ASSERT(log->signals[0].unit == "rad/s");
    RC_ASSERT(log->signals[0].time == time);
    RC_ASSERT(log->signals[0].value == a);
    RC_ASSERT(log->signals[1].value == b);
  });
  EXPECT_TRUE(ok);
}

TEST(Csv, WritesAFile) {
  const TemporaryFolder folder;
  TimeSeries series(Values{0.0});
  ASSERT_TRUE(write_csv(folder.file("a.csv"), series));
  EXPECT_EQ(folder.get("a.csv"), "time (s)\n0\n");
}

}  // namespace
}  // namespace flyball::csv_test
