#include <flyball/io/log_stream.hpp>

#include <cmath>
#include <map>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <flyball/io/csv.hpp>
#include <flyball/io/log.hpp>
#include <flyball/io/wpilog.hpp>

#include "temporary_folder.hpp"

namespace flyball::log_stream_test {
namespace {

/// Keeps everything, by name.
class Keeper : public LogSink {
 public:
  void channel(std::size_t id, const std::string& name, const std::string& unit) override {
    if (id >= names_.size()) {
      names_.push_back(name);
    }
    units[name] = unit;
  }
  void number(std::size_t id, double time, double value) override {
    Signal& signal = numbers[test_ + names_[id]];
    signal.time.push_back(time);
    signal.value.push_back(value);
  }
  void text(std::size_t id, double time, std::string_view value) override {
    TextSignal& text = texts[names_[id]];
    text.time.push_back(time);
    text.value.emplace_back(value);
  }
  void test(std::string_view name) override { test_ = std::string(name) + " "; }

  std::map<std::string, Signal> numbers;
  std::map<std::string, TextSignal> texts;
  std::map<std::string, std::string> units;

 private:
  std::vector<std::string> names_;
  std::string test_;
};

void expect_whole(const Keeper& kept, const Log& log) {
  EXPECT_EQ(kept.numbers.size(), log.signals.size());
  for (const Signal& signal : log.signals) {
    const auto found = kept.numbers.find(signal.name);
    ASSERT_NE(found, kept.numbers.end()) << signal.name;
    EXPECT_EQ(found->second.time, signal.time) << signal.name;
    EXPECT_EQ(found->second.value, signal.value) << signal.name;
    EXPECT_EQ(kept.units.at(signal.name), signal.unit);
  }
  for (const TextSignal& text : log.texts) {
    ASSERT_TRUE(kept.texts.contains(text.name)) << text.name;
    EXPECT_EQ(kept.texts.at(text.name).time, text.time) << text.name;
    EXPECT_EQ(kept.texts.at(text.name).value, text.value) << text.name;
  }
}

// More than the chunks that it is read in, with all that cells may hold.
TEST(LogStream, ATableIsThatOfTheWholeFile) {
  const TemporaryFolder folder;
  for (const std::string end : {"\n", "\r\n"}) {
    std::string table =
        "A title" + end + "time (ms),state,Position [m],\"a, b\",flag,gap (V)" + end;
    for (int i = 0; i < 40'000; ++i) {
      table +=
          fmt::format("{},{},{},{},{},{}{}", 5 * i, i % 700 < 350 ? "none" : "\"dynamic-forward\"",
                      std::sin(0.01 * i), i % 3 == 0 ? "\"1,5\"" : " 2.5 ",
                      i % 2 == 0 ? "true" : "False", i % 5 == 0 ? "null" : "-1e-3", end);
      table += i % 1000 == 0 ? "# a comment" + end : "";
    }
    table += "200000,none,1,2";  // without an end, and cells that are not there
    const std::string path = folder.put("table.csv", table);
    Keeper kept;
    const auto streamed = stream_log(path, kept);
    ASSERT_TRUE(streamed) << to_string(streamed.error());
    ASSERT_TRUE(*streamed);
    EXPECT_EQ((*streamed)->samples, 40'001U);
    const auto whole = read_log(path);
    ASSERT_TRUE(whole);
    expect_whole(kept, *whole);
  }
}

TEST(LogStream, AWpilogIsThatOfTheWholeFile) {
  WpilogWriter writer;
  const auto state = writer.start("state", "string");
  const auto volts = writer.start("volts", "double", "Volt");
  const auto speed = writer.start("speed", "float", R"({"unit": "m/s"})");
  const auto count = writer.start("count", "int64");
  const auto flag = writer.start("flag", "boolean");
  const auto both = writer.start("both", "double[]");
  const auto raw = writer.start("raw", "struct:Nothing");
  for (int i = 0; i < 30'000; ++i) {
    const double t = 0.01 * i;
    writer.append(volts, t, 0.1 * i);
    writer.append(speed, t, static_cast<float>(i));
    writer.append(count, t, std::int64_t{i});
    writer.append(flag, t, i % 2 == 0);
    writer.append(both, t, std::vector<double>{1.0 * i, -1.0 * i});
    writer.append_raw(raw, t, "12345");
    if (i % 100 == 0) {
      writer.append(state, t, "none");
    }
  }
  writer.set_metadata(count, "Rotation", 300.0);
  const TemporaryFolder folder;
  // Whole, and cut in its last record.
  for (const std::size_t cut : {std::size_t{0}, std::size_t{3}}) {
    const std::string path =
        folder.put("log.wpilog", writer.bytes().substr(0, writer.bytes().size() - cut));
    Keeper kept;
    const auto streamed = stream_log(path, kept);
    ASSERT_TRUE(streamed && *streamed);
    EXPECT_EQ((*streamed)->diagnostics.size(), cut > 0 ? 1U : 0U);
    const auto whole = read_log(path);
    ASSERT_TRUE(whole);
    expect_whole(kept, *whole);
  }
}

TEST(LogStream, ASysIdJsonIsThatOfTheWholeFile) {
  std::string rows;
  for (int i = 0; i < 20'000; ++i) {
    rows += fmt::format("{}[{}, {}, {}, {}]", i == 0 ? "" : ", ", 0.005 * i, 1.0 + i, 2.0 * i,
                        -0.5 * i);
  }
  const TemporaryFolder folder;
  const std::string text =
      R"({"fast-forward": [)" + rows + R"(, [1, 2, null, 4]], "slow-forward": [)" + rows +
      R"(], "sysid": true, "test": "Arm", "units": "Degrees",)" + R"("unitsPerRotation": 360.0})";
  const std::string path = folder.put("log.json", text);
  Keeper kept;
  const auto streamed = stream_log(path, kept);
  ASSERT_TRUE(streamed && *streamed);
  const auto whole = read_log(path);
  ASSERT_TRUE(whole);
  EXPECT_EQ((*streamed)->samples, 40'000U);
  EXPECT_EQ((*streamed)->sysid->test, "Arm");
  EXPECT_EQ((*streamed)->sysid->units, "Degrees");
  EXPECT_EQ((*streamed)->sysid->units_per_rotation, 360.0);
  for (const SysIdJson::Run& run : whole->sysid->runs) {
    EXPECT_EQ(kept.numbers.at(run.name + " voltage").time, run.time);
    EXPECT_EQ(kept.numbers.at(run.name + " voltage").value, run.voltage);
    EXPECT_EQ(kept.numbers.at(run.name + " position").value, run.position);
    EXPECT_EQ(kept.numbers.at(run.name + " velocity").value, run.velocity);
  }
  // A cut leaves what precedes it.
  Keeper part;
  const auto cut = stream_log(folder.put("cut.json", text.substr(0, text.size() / 3)), part);
  ASSERT_TRUE(cut && *cut);
  EXPECT_EQ((*cut)->diagnostics.front().code, "truncated_log");
  EXPECT_GT(part.numbers.at("fast-forward velocity").time.size(), 10'000U);
}

TEST(LogStream, WhatOnlyAWholeFileTellsIsLeft) {
  const TemporaryFolder folder;
  std::string restarts = "time,volts\n";
  for (int i = 0; i < 100'000; ++i) {
    restarts += fmt::format("{},1\n", i % 50'000);
  }
  const std::map<std::string, std::string> files{
      {"list.csv", "Timestamp,Key,Value\n0,a,1\n1,a,2\n"},
      {"dates.csv", "time,volts\n2026-01-01T00:00:00Z,1\n2026-01-01T00:00:01Z,2\n"},
      {"restarts.csv", restarts},
      {"drive.json", R"({"sysid":true,"slow-forward":[[0,1,1,0,0,0,0,0,0],[1,1,1,0,0,0,0,0,0]]})"},
      {"broken.json", R"({"slow-forward": [[0,1,1,0]] x})"},
      {"list.json", "[1, 2]"},
      {"none.wpilog", "WPIL"},
      {"wrong.wpilog", std::string("WPILOG\0\2\0\0\0\0", 12)},
      {"one_line.csv", "time,volts"},
      {"other_letters_at_the_end.csv", "time,volts,a\n0,1,b\n1,2,\x91"},
      {"key_twice.json", R"({"slow-forward": [[0,1,1,0]], "test": "a", "test": "b"})"},
      {"blank.csv", "  \n "},
      {"empty.csv", ""}};
  for (const auto& [name, contents] : files) {
    Keeper kept;
    const auto streamed = stream_log(folder.put(name, contents), kept);
    EXPECT_TRUE(!streamed || !*streamed) << name;
  }
  Keeper kept;
  EXPECT_FALSE(*stream_log(folder.file("."), kept));
  const auto missing = stream_log(folder.file("missing.csv"), kept);
  EXPECT_TRUE(!missing || !*missing);
}

}  // namespace
}  // namespace flyball::log_stream_test
