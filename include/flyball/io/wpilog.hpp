#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/io/log.hpp>

namespace flyball {

/// Decodes a WPILOG 1.x, WPILib's robot data log.
///
/// Decoded: double, float, int64, boolean, their arrays (element i of `name` is `name[i]`, up to 64
/// of them), string and json; and the raw CAN frames of REV motor controllers that URCL (revisions
/// 1 to 3, AdvantageKit's too) logs, as "root/SparkMax-3/AppliedOutputVoltage",
/// "…/MotorVelocityRPM" and so on, at the times that they arrived at. Everything else is listed in
/// `Log::skipped`. A channel's unit is its metadata ("Volt"), or the "unit" of metadata that is
/// JSON. Entries of one name and type are one channel, also when an id is finished and reused.
///
/// No length in the file is believed before it is compared with the bytes that are there; a record
/// that does not fit ends the log (`truncated_log`), which is what a power cut leaves behind.
///
/// @errors LogError::wrong_magic, wrong_version, malformed (a header that is cut), no_data.
/// Source: WPILib Data Log File Format Specification, version 1.0.
[[nodiscard]] Expected<Log> parse_wpilog(std::string_view bytes, const std::string& source);

/// Builds a WPILOG 1.0 in memory.
class WpilogWriter {
 public:
  using Id = std::uint32_t;

  /// @param extra  The header's free text.
  explicit WpilogWriter(std::string_view extra = "Flyball");

  /// Opens a channel. @param type  "double", "string", …: what will be appended.
  /// @param metadata  The unit's name, or JSON. @param time  s, as all times here.
  Id start(std::string_view name, std::string_view type, std::string_view metadata = {},
           double time = 0.0);
  /// Opens a channel of poses of the plane (struct:Pose2d), which AdvantageScope shows on its
  /// field; what is appended is {x, y, angle}, m and rad.
  Id start_pose(std::string_view name, double time = 0.0);
  /// The same of poses in space (struct:Pose3d); what is appended is {x, y, z, qw, qx, qy, qz}, m
  /// and a unit quaternion.
  Id start_pose3(std::string_view name, double time = 0.0);
  void finish(Id id, double time);
  void set_metadata(Id id, std::string_view metadata, double time);

  /// A value of the type that the channel was started with. @param time  s.
  void append(Id id, double time, double value);
  void append(Id id, double time, float value);
  void append(Id id, double time, std::int64_t value);
  void append(Id id, double time, bool value);
  void append(Id id, double time, std::string_view value);
  void append(Id id, double time, const char* value) { append(id, time, std::string_view(value)); }
  void append(Id id, double time, std::span<const double> values);
  /// A payload of a type that this class does not encode.
  void append_raw(Id id, double time, std::string_view payload);

  [[nodiscard]] const std::string& bytes() const noexcept { return bytes_; }

 private:
  void record(Id id, double time, std::string_view payload);
  using Schema = std::pair<std::string_view, std::string_view>;  ///< A struct and its members.
  void write_schemas(std::span<const Schema> schemas, double time);

  std::string bytes_;
  Id next_ = 1;
  bool has_pose_schema_ = false;
  bool has_pose3_schema_ = false;
};

/// Appends what `write_wpilog` writes. @errors Those of `to_wpilog`.
[[nodiscard]] Expected<void> append_log(WpilogWriter& writer, const Log& log);

/// Writes the signals (as double, their unit as metadata) and texts (as string) of a log in time
/// order, atomically. Times are rounded to microseconds, which is what the format holds.
/// @errors FileError, ArgumentError::not_finite or out_of_range (a time that is negative),
///         wrong_shape.
[[nodiscard]] Expected<void> write_wpilog(const std::string& path, const Log& log);

/// The bytes that `write_wpilog` writes. @errors The same, without FileError.
[[nodiscard]] Expected<std::string> to_wpilog(const Log& log);

}  // namespace flyball
