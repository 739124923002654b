#include <flyball/io/wpilog.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <flyball/core/argument.hpp>

#include "io/examples.hpp"
#include "io/temporary_folder.hpp"

namespace flyball::wpilog_test {
namespace {

using namespace std::string_view_literals;

Expected<Log> parse(std::string_view bytes) {
  return parse_wpilog(bytes, "a.wpilog");
}

/// The specification's own layout, byte by byte: header, Start of entry 1 ("v", "double",
/// metadata "Volt") at 1 us, the value 1.5 at 1 000 000 us, Finish at 2 us.
constexpr std::string_view by_hand =
    "WPILOG\x00\x01\x05\x00\x00\x00"
    "extra"
    "\x00\x00\x1C\x01"
    "\x00\x01\x00\x00\x00\x01\x00\x00\x00v\x06\x00\x00\x00"
    "double\x04\x00\x00\x00Volt"
    "\x20\x01\x08\x40\x42\x0F"
    "\x00\x00\x00\x00\x00\x00\xF8\x3F"
    "\x00\x00\x05\x02"
    "\x01\x01\x00\x00\x00"sv;

TEST(Wpilog, ReadsBytesLaidOutByHand) {
  const Expected<Log> log = parse(by_hand);
  ASSERT_TRUE(log) << to_string(log.error());
  ASSERT_EQ(log->signals.size(), 1U);
  EXPECT_EQ(log->signals[0].name, "v");
  EXPECT_EQ(log->signals[0].unit, "Volt");
  EXPECT_EQ(log->signals[0].time, std::vector<double>{1.0});
  EXPECT_EQ(log->signals[0].value, std::vector<double>{1.5});
  EXPECT_EQ(log->metadata.at("extra"), "extra");
  EXPECT_TRUE(log->diagnostics.empty());
}

TEST(Wpilog, WritesTheSameBytes) {
  WpilogWriter writer("extra");
  const WpilogWriter::Id id = writer.start("v", "double", "Volt", 1e-6);
  writer.append(id, 1.0, 1.5);
  writer.finish(id, 2e-6);
  EXPECT_EQ(writer.bytes(), by_hand);
}

TEST(Wpilog, DecodesEveryNumberAndText) {
  WpilogWriter writer;
  const auto d = writer.start("d", "double");
  const auto f = writer.start("f", "float");
  const auto i = writer.start("i", "int64");
  const auto b = writer.start("b", "boolean");
  const auto s = writer.start("s", "string");
  const auto j = writer.start("j", "json");
  const auto a = writer.start("a", "double[]");
  const auto flags = writer.start("flags", "boolean[]");
  writer.append(d, 1.0, -0.1);
  writer.append(f, 1.0, 0.5F);
  writer.append(i, 1.0, std::int64_t{-7});
  writer.append(b, 1.0, true);
  writer.append(s, 1.0, "grün");
  writer.append(j, 1.0, "{}");
  writer.append(a, 1.0, std::array{1.0, 2.0});
  writer.append(a, 2.0, std::array{3.0});
  writer.append(a, 3.0, std::array<double, 0>{});
  writer.append_raw(flags, 1.0, "\0\1"sv);
  const Expected<Log> log = parse(writer.bytes());
  ASSERT_TRUE(log) << to_string(log.error());
  EXPECT_EQ(log->find_signal("d")->value, std::vector<double>{-0.1});
  EXPECT_EQ(log->find_signal("f")->value, std::vector<double>{0.5});
  EXPECT_EQ(log->find_signal("i")->value, std::vector<double>{-7});
  EXPECT_EQ(log->find_signal("b")->value, std::vector<double>{1});
  EXPECT_EQ(log->find_signal("a[0]")->value, (std::vector<double>{1, 3}));
  EXPECT_EQ(log->find_signal("a[1]")->value, std::vector<double>{2});
  EXPECT_EQ(log->find_signal("flags[1]")->value, std::vector<double>{1});
  EXPECT_EQ(log->find_text("s")->value, std::vector<std::string>{"grün"});
  EXPECT_EQ(log->find_text("j")->value, std::vector<std::string>{"{}"});
}

TEST(Wpilog, ListsWhatItDoesNotDecode) {
  WpilogWriter writer;
  const auto pose = writer.start("pose", "struct:Pose2d");
  const auto wide = writer.start("wide", "double[]");
  writer.append_raw(pose, 1.0, std::string(24, 'x'));
  writer.append_raw(pose, 2.0, std::string(24, 'x'));
  writer.append(wide, 1.0, std::vector<double>(65, 1.0));
  writer.append(writer.start("v", "double"), 1.0, 2.0);
  const Expected<Log> log = parse(writer.bytes());
  ASSERT_TRUE(log) << to_string(log.error());
  ASSERT_EQ(log->skipped.size(), 2U);
  EXPECT_EQ(log->skipped[0].name, "pose");
  EXPECT_EQ(log->skipped[0].type, "struct:Pose2d");
  EXPECT_EQ(log->skipped[0].records, 2U);
  EXPECT_EQ(log->skipped[1].name, "wide");
  EXPECT_TRUE(has_diagnostic(log->diagnostics, "skipped_channels"));
  EXPECT_EQ(log->signals.size(), 1U);
}

TEST(Wpilog, UnitsComeFromMetadata) {
  WpilogWriter writer;
  const auto plain = writer.start("plain", "double", "Meter per Second");
  const auto json = writer.start("json", "double", R"({"source":"AdvantageKit","unit":"meters"})");
  const auto mirrored = writer.start("NT:x", "double", R"({"properties":{},"source":"NT"})");
  const auto later = writer.start("later", "double");
  for (const auto id : {plain, json, mirrored, later}) {
    writer.append(id, 1.0, 1.0);
  }
  writer.set_metadata(later, "Volt", 2.0);
  const Expected<Log> log = parse(writer.bytes());
  ASSERT_TRUE(log);
  EXPECT_EQ(log->find_signal("plain")->unit, "Meter per Second");
  EXPECT_EQ(log->find_signal("json")->unit, "meters");
  EXPECT_EQ(log->find_signal("NT:x")->unit, "");
  EXPECT_EQ(log->find_signal("later")->unit, "Volt");
}

/// A record with a one-byte id, size and a time in seconds times 1e6 that fits one byte.
std::string record(int id, std::string_view payload, int us) {
  return std::string(1, '\0') + static_cast<char>(id) + static_cast<char>(payload.size()) +
         static_cast<char>(us) + std::string(payload);
}

std::string start(int id, std::string_view name, std::string_view type) {
  const auto text = [](std::string_view t) {
    return std::string(1, static_cast<char>(t.size())) + std::string(3, '\0') + std::string(t);
  };
  const std::string number = std::string(1, static_cast<char>(id)) + std::string(3, '\0');
  return record(0, std::string(1, '\0') + number + text(name) + text(type) + text(""), 0);
}

const std::string header("WPILOG\0\1\0\0\0\0", 12);

TEST(Wpilog, AnIdIsReusedAfterFinish) {
  const std::string finish = record(0, "\1\1\0\0\0"sv, 0);
  const Expected<Log> log =
      parse(header + start(1, "first", "boolean") + record(1, "\1", 1) + finish +
            start(1, "second", "boolean") + record(1, "\0"sv, 2) + finish + record(1, "\1", 3));
  ASSERT_TRUE(log) << to_string(log.error());
  EXPECT_EQ(log->find_signal("first")->value, std::vector<double>{1});
  EXPECT_EQ(log->find_signal("second")->value, std::vector<double>{0});
  EXPECT_TRUE(has_diagnostic(log->diagnostics, "unknown_entries"));
}

TEST(Wpilog, EntriesOfOneNameAreOneChannel) {
  const Expected<Log> log =
      parse(header + start(1, "x", "boolean") + start(2, "x", "boolean") + start(3, "x", "string") +
            record(1, "\1", 1) + record(2, "\0"sv, 2) + record(3, "a", 3));
  ASSERT_TRUE(log) << to_string(log.error());
  ASSERT_EQ(log->signals.size(), 1U);
  EXPECT_EQ(log->signals[0].value, (std::vector<double>{1, 0}));
  EXPECT_EQ(log->texts.size(), 1U);
}

TEST(Wpilog, SortsByTimeAndSaysSo) {
  WpilogWriter writer;
  const auto id = writer.start("v", "double");
  const auto text = writer.start("s", "string");
  writer.append(id, 3.0, 3.0);
  writer.append(id, 1.0, 1.0);
  writer.append(id, 2.0, 2.0);
  writer.append(text, 2.0, "b");
  writer.append(text, 1.0, "a");
  const Expected<Log> log = parse(writer.bytes());
  ASSERT_TRUE(log);
  EXPECT_EQ(log->signals[0].time, (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(log->signals[0].value, (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(log->texts[0].value, (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(has_diagnostic(log->diagnostics, "unsorted_time"));
}

TEST(Wpilog, DropsNanAndSaysHowMany) {
  WpilogWriter writer;
  const auto id = writer.start("v", "double");
  writer.append(id, 1.0, 1.0);
  writer.append(id, 2.0, std::numeric_limits<double>::quiet_NaN());
  writer.append(id, 3.0, std::numeric_limits<double>::infinity());
  const Expected<Log> log = parse(writer.bytes());
  ASSERT_TRUE(log);
  EXPECT_EQ(log->signals[0].value, std::vector<double>{1.0});
  ASSERT_TRUE(has_diagnostic(log->diagnostics, "non_finite_rows"));
  EXPECT_TRUE(contains(log->diagnostics[0].message, "2 samples"));
}

TEST(Wpilog, DamagedRecordsAreCountedAndSkipped) {
  const Expected<Log> log =
      parse(header + start(1, "v", "double") + record(1, "\1", 1) + record(0, "\7\0\0\0\0"sv, 1) +
            record(0, "\0\1\0\0\0\xFF\xFF\xFF\xFFx"sv, 1) + record(0, "\2\x63\0\0\0\0\0\0\0"sv, 1) +
            record(9, "\1", 1) + record(1, std::string(8, '\0'), 2));
  ASSERT_TRUE(log) << to_string(log.error());
  EXPECT_EQ(log->signals[0].value, std::vector<double>{0});
  EXPECT_TRUE(has_diagnostic(log->diagnostics, "wrong_sizes"));
  EXPECT_TRUE(has_diagnostic(log->diagnostics, "damaged_records"));
  EXPECT_TRUE(has_diagnostic(log->diagnostics, "unknown_entries"));
}

TEST(Wpilog, ABrokenBeginningOfARecordEndsTheLog) {
  const std::string good = to_wpilog(example_log(3)).value();
  const Expected<Log> damaged = parse(good + "\xFFgarbage");
  ASSERT_TRUE(damaged);
  EXPECT_TRUE(has_diagnostic(damaged->diagnostics, "damaged_log"));
  EXPECT_EQ(damaged->signals[0].time.size(), 3U);
  // 4 GB announced, 3 bytes there; and a preallocated tail.
  const Expected<Log> absurd = parse(good + "\x0C\x01\xFF\xFF\xFF\xFF\x01" + "abc");
  ASSERT_TRUE(absurd);
  EXPECT_TRUE(has_diagnostic(absurd->diagnostics, "truncated_log"));
  EXPECT_TRUE(contains(absurd->diagnostics[0].message, "4294967295 bytes of which 3"));
  EXPECT_TRUE(has_diagnostic(parse(good + std::string(1000, '\0'))->diagnostics, "truncated_log"));
}

TEST(Wpilog, ACutAnywhereGivesTheSamplesBeforeIt) {
  const std::string bytes = to_wpilog(example_log(4)).value();
  const Log whole = parse(bytes).value();
  std::size_t last = 0;
  for (std::size_t cut = 0; cut < bytes.size(); ++cut) {
    const Expected<Log> log = parse(std::string_view(bytes).substr(0, cut));
    std::size_t samples = 0;
    if (log) {
      for (const Signal& signal : log->signals) {
        const Signal* same = whole.find_signal(signal.name);
        ASSERT_NE(same, nullptr);
        ASSERT_TRUE(std::equal(signal.value.begin(), signal.value.end(), same->value.begin()));
        samples += signal.value.size();
      }
    }
    ASSERT_GE(samples, last);
    last = samples;
  }
  EXPECT_EQ(last, 12U);
}

TEST(Wpilog, ReadsBackWhatItWrites) {
  const bool ok = rc::check("read(write(log)) == log, times to the microsecond", [] {
    Log log;
    const auto channels = *rc::gen::inRange<std::size_t>(1, 5);
    for (std::size_t c = 0; c < channels; ++c) {
      const auto us = *rc::gen::nonEmpty(
          rc::gen::container<std::vector<std::uint32_t>>(rc::gen::arbitrary<std::uint32_t>()));
      Signal signal{
          "signal " + std::to_string(c), *rc::gen::element<std::string>("", "Volt"), {}, {}};
      TextSignal text{"text " + std::to_string(c), {}, {}};
      for (const std::uint32_t t : us) {
        signal.time.push_back(1e-6 * t);
        signal.value.push_back(*rc::gen::suchThat(rc::gen::arbitrary<double>(),
                                                  [](double v) { return std::isfinite(v); }));
        text.value.push_back(*rc::gen::element<std::string>("", "none", "größer", "a\"b"));
      }
      std::sort(signal.time.begin(), signal.time.end());
      text.time = signal.time;
      log.signals.push_back(signal);
      log.texts.push_back(text);
    }
    const Expected<std::string> bytes = to_wpilog(log);
    RC_ASSERT(bytes.has_value());
    const Expected<Log> back = parse(*bytes);
    RC_ASSERT(back.has_value());
    RC_ASSERT(back->diagnostics.empty());
    for (const Signal& signal : log.signals) {
      const Signal* same = back->find_signal(signal.name);
      RC_ASSERT(same != nullptr);
      RC_ASSERT(same->unit == signal.unit);
      RC_ASSERT(same->time == signal.time);
      RC_ASSERT(same->value == signal.value);
    }
    for (const TextSignal& text : log.texts) {
      const TextSignal* same = back->find_text(text.name);
      RC_ASSERT(same != nullptr);
      RC_ASSERT(same->time == text.time);
      RC_ASSERT(same->value == text.value);
    }
  });
  EXPECT_TRUE(ok);
}

TEST(Wpilog, WriterRefusesWhatTheFormatCannotHold) {
  Log log = example_log(3);
  log.signals[0].time[0] = -1.0;
  EXPECT_TRUE(to_wpilog(log).error().is(ArgumentError::out_of_range));
  log = example_log(3);
  log.signals[0].value[0] = std::nan("");
  EXPECT_TRUE(to_wpilog(log).error().is(ArgumentError::not_finite));
  log = example_log(3);
  log.texts[0].value.pop_back();
  EXPECT_TRUE(to_wpilog(log).error().is(ArgumentError::wrong_shape));
}

TEST(Wpilog, WritesAFile) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_wpilog(folder.file("a.wpilog"), example_log(3)));
  EXPECT_EQ(folder.get("a.wpilog"), to_wpilog(example_log(3)).value());
}

// What AdvantageScope needs to show a pose on its field: the schemas once, then 24 bytes a pose.
TEST(Wpilog, WritesPosesWithTheirSchemas) {
  WpilogWriter writer;
  const auto first = writer.start_pose("/a");
  const auto second = writer.start_pose("/b");
  EXPECT_NE(first, second);
  const std::array<double, 3> pose{1.0, 2.0, 0.5};
  writer.append(first, 0.25, std::span<const double>(pose));
  const std::string& bytes = writer.bytes();
  const auto count = [&](std::string_view word) {
    std::size_t n = 0;
    for (std::size_t at = bytes.find(word); at != std::string::npos;
         at = bytes.find(word, at + 1)) {
      ++n;
    }
    return n;
  };
  EXPECT_EQ(count("/.schema/struct:Pose2d"), 1U);
  EXPECT_EQ(count("Translation2d translation;Rotation2d rotation"), 1U);
  EXPECT_EQ(count("double x;double y"), 1U);
  EXPECT_EQ(count("double value"), 1U);
  EXPECT_EQ(bytes.substr(bytes.size() - 24),
            std::string(reinterpret_cast<const char*>(pose.data()), 24));
  const auto log = parse(bytes);
  EXPECT_FALSE(log && !log->signals.empty());  // No plain number is in it.
}

// WPILib's structs of a pose in space: translation, then the quaternion from w, 56 bytes.
TEST(Wpilog, WritesPosesInSpaceWithTheirSchemas) {
  WpilogWriter writer;
  writer.start_pose("/flat");
  const std::size_t before = writer.bytes().size();
  const auto first = writer.start_pose3("/a");
  writer.start_pose3("/b");
  const std::array<double, 7> pose{1.0, 2.0, 3.0, 0.5, -0.5, 0.5, -0.5};
  writer.append(first, 0.25, std::span<const double>(pose));
  const std::string bytes = writer.bytes().substr(before);
  std::size_t at = 0;
  for (const char* words :
       {"/.schema/struct:Quaternion", "structschema", "double w;double x;double y;double z",
        "/.schema/struct:Rotation3d", "Quaternion q", "/.schema/struct:Translation3d",
        "double x;double y;double z", "/.schema/struct:Pose3d",
        "Translation3d translation;Rotation3d rotation", "/a", "struct:Pose3d", "/b"}) {
    at = bytes.find(words, at);
    ASSERT_NE(at, std::string::npos) << words;
  }
  EXPECT_EQ(bytes.find("/.schema", at), std::string::npos);  // Once.
  EXPECT_EQ(bytes.substr(bytes.size() - 56),
            std::string(reinterpret_cast<const char*>(pose.data()), 56));
}

}  // namespace
}  // namespace flyball::wpilog_test
