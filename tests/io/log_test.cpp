#include <flyball/io/log.hpp>

#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include <flyball/io/csv.hpp>
#include <flyball/io/file.hpp>
#include <flyball/io/wpilog.hpp>

#include "io/examples.hpp"
#include "io/temporary_folder.hpp"

namespace flyball::log_test {
namespace {

using namespace std::string_view_literals;

TEST(ReadLog, TellsTheFormatByTheContents) {
  const std::string json = to_sysid_json(example_sysid(5)).value();
  const std::string wpilog = to_wpilog(example_log(5)).value();
  EXPECT_EQ(parse_log(json, "renamed.csv")->format, "SysId JSON");
  EXPECT_EQ(parse_log("\xEF\xBB\xBF" + json, "with-a-mark.json")->format, "SysId JSON");
  EXPECT_EQ(parse_log(wpilog, "renamed.txt")->format, "WPILOG");
  EXPECT_EQ(parse_log("Time (s),Volts (V)\n0,1\n", "table")->format, "CSV");
}

TEST(ReadLog, KeepsThePath) {
  const TemporaryFolder folder;
  const std::string path = folder.put("a.wpilog", to_wpilog(example_log(3)).value());
  const Expected<Log> log = read_log(path);
  ASSERT_TRUE(log) << to_string(log.error());
  EXPECT_EQ(log->source, path);
  EXPECT_NE(log->find_signal("voltage-arm-Arm"), nullptr);
  EXPECT_NE(log->find_text("sysid-test-state-Arm"), nullptr);
  EXPECT_EQ(log->find_signal("nothing"), nullptr);
  EXPECT_EQ(log->find_text("nothing"), nullptr);
}

TEST(ReadLog, MissingFileAndFolder) {
  const TemporaryFolder folder;
  const Expected<Log> missing = read_log(folder.file("no.json"));
  ASSERT_FALSE(missing);
  EXPECT_TRUE(missing.error().is(FileError::not_found));
  EXPECT_TRUE(contains(to_string(missing.error()), "no.json"));
  EXPECT_TRUE(read_log(folder.file(".")).error().is(FileError::is_a_folder));
}

TEST(ReadLog, WhatIsNotALog) {
  struct Case {
    std::string_view bytes;
    std::string_view source;
    LogError error;
    std::string_view words;
  };
  const Case cases[] = {
      {"", "a.json", LogError::empty, "empty"},
      {"  \n\t ", "a.csv", LogError::not_a_log, "without a table"},
      {"WPILOX\0\1\0\0\0\0"sv, "a.wpilog", LogError::wrong_magic, "\"WPILOX\""},
      {"WPILOG\0\2\0\0\0\0"sv, "a.wpilog", LogError::wrong_version, "2.0"},
      {"WPILOG\0\1"sv, "a.wpilog", LogError::malformed, "8 bytes"},
      {"WPILOG\0\1\xFF\xFF\xFF\xFF"sv, "a.wpilog", LogError::malformed, "4294967307 bytes"},
      {"WPILOG\0\1\0\0\0\0"sv, "a.wpilog", LogError::no_data, "without a number"},
      {"\x89MCAP0\r\n"sv, "a.mcap", LogError::not_a_log, "MCAP"},
      {"PK\x03\x04sheet"sv, "a.xlsx", LogError::not_a_log, "save the sheet as CSV"},
      {"\x7F"
       "ELF\2\1\1\0\0\0\0"sv,
       "a.out", LogError::not_a_log, "binary"},
      {"hello", "a.json", LogError::not_a_log, "hello"},
      {"hello world\nof prose\n", "a.txt", LogError::not_a_log, "without a table"},
      {"[1, 2]", "a.json", LogError::not_a_log, "a list"},
      {"{}", "a.json", LogError::not_a_log, "empty object"},
      {R"({"samples": []})", "a.traj", LogError::not_a_log, "samples"},
      {"{\"slow-forward\": [[1, 2, 3, 4]],\n  ?}", "a.json", LogError::malformed, "a.json:2:3"},
      {"name,colour\nred,blue\n", "a.csv", LogError::no_time, "Time (s)"},
      {"time (s),x\n,3\n", "a.csv", LogError::no_data, "without one row"},
      {"time (s),x\n1,\"3\n", "a.csv", LogError::malformed, "a.csv:2:3"},
  };
  for (const Case& c : cases) {
    const Expected<Log> log = parse_log(c.bytes, std::string(c.source));
    ASSERT_FALSE(log) << c.bytes;
    EXPECT_TRUE(log.error().is(c.error)) << to_string(log.error());
    EXPECT_EQ(log.error().kind(), ErrorKind::misuse);
    EXPECT_TRUE(contains(to_string(log.error()), c.words)) << to_string(log.error());
    EXPECT_TRUE(contains(to_string(log.error()), c.source)) << to_string(log.error());
  }
}

TEST(LogErrorInfo, NamesEveryCode) {
  EXPECT_EQ(error_info(LogError::empty).name, "empty");
  EXPECT_EQ(error_info(LogError::no_data).name, "no_data");
  EXPECT_EQ(error_info(LogError::no_time).family, "log");
}

}  // namespace
}  // namespace flyball::log_test
