#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include <flyball/io/wpilog.hpp>

/// Frames that are put together bit by bit, as REV's specification of its CAN frames lays them out.
namespace flyball::urcl_test {
namespace {

template <class T>
std::string bytes_of(T value) {
  std::string text(sizeof value, '\0');
  std::memcpy(text.data(), &value, sizeof value);
  return text;
}

/// The low half of a CAN identifier: class, index, device.
std::uint16_t identifier(unsigned kind, unsigned index, unsigned device) {
  return static_cast<std::uint16_t>(kind << 10 | index << 6 | device);
}

std::string frame(std::uint32_t milliseconds, std::uint16_t id, const std::string& data) {
  return bytes_of(milliseconds) + bytes_of(id) + data;
}

/// Firmware 24.0.1 and the model of a device; 6 bytes of what it answered each.
std::string facts(unsigned device, std::uint32_t model) {
  return bytes_of(identifier(9, 8, device)) + std::string("\x18\x00\x00\x01\x00\x00", 6) +
         bytes_of(identifier(57, 11, device)) + bytes_of(model) + std::string(2, '\0');
}

// Status 1 of 2024: velocity (float), temperature, 12 bits of volts/128 and 12 of amperes/32.
std::string status_1(float rpm, unsigned volts_128, unsigned amperes_32) {
  return bytes_of(rpm) + std::string(1, '\x20') +
         bytes_of(static_cast<std::uint32_t>(volts_128 | amperes_32 << 12)).substr(0, 3);
}
std::string status_0(std::int16_t duty) {
  return bytes_of(duty) + std::string(6, '\0');
}

const Signal& found(const Log& log, const std::string& name) {
  const Signal* signal = log.find_signal(name);
  EXPECT_NE(signal, nullptr) << name;
  static const Signal none;
  return signal != nullptr ? *signal : none;
}

std::string first_frames() {
  return frame(1000, identifier(6, 0, 11), status_0(32767)) +  // before the battery is known
         frame(1010, identifier(6, 1, 11), status_1(-1500.5F, 1600, 96)) +
         frame(1015, identifier(6, 0, 11), status_0(-16383)) +
         frame(1020, identifier(6, 2, 11), bytes_of(2.25F) + std::string(4, '\0'));
}

void expect_first(const Log& log, const std::string& device) {
  const Signal& velocity = found(log, device + "/MotorVelocityRPM");
  EXPECT_EQ(velocity.unit, "RPM");
  EXPECT_EQ(velocity.time, std::vector<double>{1.01});
  EXPECT_EQ(velocity.value, std::vector<double>{-1500.5});
  EXPECT_EQ(found(log, device + "/BusVoltage").value, std::vector<double>{12.5});
  EXPECT_EQ(found(log, device + "/MotorCurrentAmps").value, std::vector<double>{3.0});
  EXPECT_EQ(found(log, device + "/MotorPositionRotations").value, std::vector<double>{2.25});
  EXPECT_EQ(found(log, device + "/AppliedOutput").value.size(), 2U);
  const Signal& volts = found(log, device + "/AppliedOutputVoltage");
  ASSERT_EQ(volts.value.size(), 1U);
  EXPECT_EQ(volts.unit, "V");
  EXPECT_EQ(volts.time[0], 1.015);
  EXPECT_NEAR(volts.value[0], -12.5 * 16383.0 / 32767.0, 1e-12);
}

TEST(Urcl, TheFirstRevisionHasAllInOneRecord) {
  WpilogWriter writer;
  const auto id = writer.start("NT:/URCL", "URCL");
  writer.append_raw(
      id, 1.03,
      bytes_of(std::uint32_t{2}) + bytes_of(std::uint32_t{4}) + facts(11, 0x2158) + first_frames());
  const Log log = parse_wpilog(writer.bytes(), "a.wpilog").value();
  expect_first(log, "NT:/URCL/SparkMax-11");
  ASSERT_EQ(log.diagnostics.size(), 1U);
  EXPECT_EQ(log.diagnostics[0].code, "raw_frames");
  EXPECT_EQ(log.diagnostics[0].message,
            "the raw CAN frames of 1 REV motor controller were decoded: SparkMax-11");
}

// A SparkFlex of firmware 24 sends the fraction of its position beside it, in 1/65536 rotations; an
// encoder that is not there reads zero throughout and is left out.
TEST(Urcl, TheSecondHasNames) {
  WpilogWriter writer;
  writer.append_raw(writer.start("NT:/URCL/Raw/Aliases", "URCLr2_aliases"), 0.5,
                    R"({"11":"Shooter","x":"no","12":7})");
  writer.append_raw(writer.start("NT:/URCL/Raw/Persistent", "URCLr2_persistent"), 0.5,
                    facts(11, 0x2158) + facts(12, 0x2159));
  const auto periodic = writer.start("NT:/URCL/Raw/Periodic", "URCLr2_periodic");
  writer.append_raw(periodic, 1.03, first_frames());
  writer.append_raw(
      periodic, 1.05,
      frame(1040, identifier(6, 2, 12), bytes_of(-3.0F) + bytes_of(std::uint32_t{16384})) +
          frame(1041, identifier(6, 4, 12), std::string(8, '\0')) +
          frame(1042, identifier(6, 4, 12), std::string(8, '\0')));
  const Log log = parse_wpilog(writer.bytes(), "a.wpilog").value();
  expect_first(log, "NT:/URCL/Shooter");
  EXPECT_EQ(found(log, "NT:/URCL/SparkFlex-12/MotorPositionRotations").value,
            std::vector<double>{-3.25});
  EXPECT_EQ(log.find_signal("NT:/URCL/SparkFlex-12/ExternalEncoder/VelocityRPM"), nullptr);
}

// Frames of 2025: 16 bits of duty (32442 is full), 12 of volts (4095 is 30 V), 12 of amperes (150
// A). Its empty frame of the older class is not taken for a motor that stands.
TEST(Urcl, TheThirdHasTheFramesOf2025) {
  const std::uint64_t status = std::uint64_t{static_cast<std::uint16_t>(-16221)} |
                               std::uint64_t{1638} << 16 | std::uint64_t{273} << 28;
  WpilogWriter writer;
  const auto periodic = writer.start("/URCL/Raw/Periodic", "URCLr3_periodic");
  writer.append_raw(periodic, 2.0,
                    frame(1990, identifier(46, 0, 5), bytes_of(status)) +
                        frame(1991, identifier(6, 0, 5), status_0(0)) +
                        frame(1995, identifier(46, 2, 5), bytes_of(-31.5F) + bytes_of(8.125F)));
  writer.append_raw(periodic, 2.1, "short");
  const Log log = parse_wpilog(writer.bytes(), "a.wpilog").value();
  EXPECT_NEAR(found(log, "/URCL/Spark-5/InputVoltage").value.at(0), 12.0, 1e-12);
  EXPECT_NEAR(found(log, "/URCL/Spark-5/CurrentOutput").value.at(0), 10.0, 1e-12);
  ASSERT_EQ(found(log, "/URCL/Spark-5/AppliedOutput").value.size(), 1U);
  EXPECT_NEAR(found(log, "/URCL/Spark-5/AppliedOutputVoltage").value.at(0), -6.0, 1e-3);
  EXPECT_EQ(found(log, "/URCL/Spark-5/PrimaryEncoderVelocity").value, std::vector<double>{-31.5});
  EXPECT_EQ(found(log, "/URCL/Spark-5/PrimaryEncoderPosition").value, std::vector<double>{8.125});
  EXPECT_EQ(found(log, "/URCL/Spark-5/PrimaryEncoderPosition").time, std::vector<double>{1.995});
  ASSERT_EQ(log.diagnostics.size(), 2U);
  EXPECT_EQ(log.diagnostics[1].code, "wrong_sizes");
}

// Counts that the record does not hold are not believed.
TEST(Urcl, CountsAreHeldAgainstTheBytesThatAreThere) {
  WpilogWriter writer;
  const auto id = writer.start("URCL", "URCL");
  writer.append_raw(id, 1.0, bytes_of(std::uint32_t{0xFFFFFFFF}) + bytes_of(std::uint32_t{1}));
  writer.append_raw(id, 1.1, bytes_of(std::uint32_t{0}) + bytes_of(std::uint32_t{0xFFFFFFFF}));
  writer.append_raw(id, 1.2, "1234");
  writer.append(writer.start("v", "double"), 1.0, 1.0);
  const Log log = parse_wpilog(writer.bytes(), "a.wpilog").value();
  EXPECT_EQ(log.signals.size(), 1U);
  ASSERT_EQ(log.diagnostics.size(), 1U);
  EXPECT_EQ(log.diagnostics[0].message.substr(0, 9), "3 records");
}

// One drive as raw frames and as AdvantageScope's export of them: every value that the export has
// is ours at its time.
TEST(Urcl, AgreesWithAdvantageScopesDecoder) {
  const std::filesystem::path folder = std::filesystem::path(FLYBALL_TEST_DATA) / "wpilog";
  const std::string name = "miami_drive_FRC_20240119_152551";
  if (!std::filesystem::exists(folder / (name + ".wpilog"))) {
    GTEST_SKIP() << "no recordings";
  }
  const Log raw = read_log((folder / (name + ".wpilog")).string()).value();
  const Log exported =
      read_log((folder / (name + "_advantagescope_export.wpilog")).string()).value();
  std::size_t compared = 0;
  for (const char* device : {"11", "12", "13", "14"}) {
    for (const char* of : {"MotorVelocityRPM", "MotorPositionRotations", "BusVoltage",
                           "MotorCurrentAmps", "AppliedOutput", "AppliedOutputVoltage"}) {
      const std::string signal = std::string("NT:/URCL/SparkMax-") + device + "/" + of;
      const Signal& ours = found(raw, signal);
      const Signal& theirs = found(exported, signal);
      std::size_t at = 0;
      std::size_t misses = 0;
      for (std::size_t i = 0; i < theirs.time.size(); ++i) {
        while (at < ours.time.size() && ours.time[at] < theirs.time[i] - 1e-4) {
          ++at;
        }
        // Times are milliseconds, less rounding; two frames of one are two values of ours.
        bool same = false;
        for (std::size_t k = at;
             k < ours.time.size() && std::abs(ours.time[k] - theirs.time[i]) < 1e-4; ++k) {
          same = same || std::abs(ours.value[k] - theirs.value[i]) < 1e-9;
        }
        misses += same ? 0 : 1;
        ++compared;
      }
      EXPECT_EQ(misses, 0U) << signal << " of " << theirs.time.size();
    }
  }
  EXPECT_GT(compared, 1000U);
}

}  // namespace
}  // namespace flyball::urcl_test
