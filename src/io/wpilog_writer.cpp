#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/io/file.hpp>
#include <flyball/io/wpilog.hpp>

#include "core/try.hpp"

namespace flyball {
namespace {

template <class T>
void put(std::string& out, T value, std::size_t bytes = sizeof(T)) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  out.append(raw, bytes);
}

void put_string(std::string& out, std::string_view text) {
  put(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}

/// The fewest bytes that hold a number, at least one.
std::size_t width(std::uint64_t value) {
  std::size_t bytes = 1;
  while (bytes < 8 && value >> (8 * bytes) != 0) {
    ++bytes;
  }
  return bytes;
}

/// The format's clock: whole microseconds, never negative.
std::uint64_t microseconds(double time) {
  return time > 0.0 ? static_cast<std::uint64_t>(std::llround(std::min(time, 9e12) * 1e6)) : 0;
}

Expected<void> check_channel(const std::string& name, const std::vector<double>& time,
                             std::size_t values) {
  if (time.size() != values) {
    return refusal(ArgumentError::wrong_shape, "to_wpilog", name)
        .got(fmt::format("{} values long", values))
        .expected(fmt::format("one value a time ({})", time.size()));
  }
  for (const double t : time) {
    if (Expected<void> ok = check_not_negative(t, "to_wpilog", name + ": time", "s"); !ok) {
      return ok;
    }
  }
  return {};
}

}  // namespace

WpilogWriter::WpilogWriter(std::string_view extra) {
  bytes_ = "WPILOG";
  put(bytes_, std::uint16_t{0x0100});
  put_string(bytes_, extra);
}

void WpilogWriter::record(Id id, double time, std::string_view payload) {
  const std::uint64_t us = microseconds(time);
  const std::size_t id_width = width(id);
  const std::size_t size_width = width(payload.size());
  const std::size_t time_width = width(us);
  bytes_ += static_cast<char>((id_width - 1) | (size_width - 1) << 2 | (time_width - 1) << 4);
  put(bytes_, id, id_width);
  put(bytes_, static_cast<std::uint64_t>(payload.size()), size_width);
  put(bytes_, us, time_width);
  bytes_ += payload;
}

WpilogWriter::Id WpilogWriter::start(std::string_view name, std::string_view type,
                                     std::string_view metadata, double time) {
  std::string payload(1, '\0');
  put(payload, next_);
  put_string(payload, name);
  put_string(payload, type);
  put_string(payload, metadata);
  record(0, time, payload);
  return next_++;
}

void WpilogWriter::write_schemas(std::span<const Schema> schemas, double time) {
  for (const auto& [type, members] : schemas) {
    append(start(type, "structschema", {}, time), time, members);
  }
}

WpilogWriter::Id WpilogWriter::start_pose(std::string_view name, double time) {
  static constexpr Schema schemas[] = {
      {"/.schema/struct:Rotation2d", "double value"},
      {"/.schema/struct:Translation2d", "double x;double y"},
      {"/.schema/struct:Pose2d", "Translation2d translation;Rotation2d rotation"}};
  if (!has_pose_schema_) {
    has_pose_schema_ = true;
    write_schemas(schemas, time);
  }
  return start(name, "struct:Pose2d", {}, time);
}

WpilogWriter::Id WpilogWriter::start_pose3(std::string_view name, double time) {
  static constexpr Schema schemas[] = {
      {"/.schema/struct:Quaternion", "double w;double x;double y;double z"},
      {"/.schema/struct:Rotation3d", "Quaternion q"},
      {"/.schema/struct:Translation3d", "double x;double y;double z"},
      {"/.schema/struct:Pose3d", "Translation3d translation;Rotation3d rotation"}};
  if (!has_pose3_schema_) {
    has_pose3_schema_ = true;
    write_schemas(schemas, time);
  }
  return start(name, "struct:Pose3d", {}, time);
}

void WpilogWriter::finish(Id id, double time) {
  std::string payload(1, '\1');
  put(payload, id);
  record(0, time, payload);
}

void WpilogWriter::set_metadata(Id id, std::string_view metadata, double time) {
  std::string payload(1, '\2');
  put(payload, id);
  put_string(payload, metadata);
  record(0, time, payload);
}

void WpilogWriter::append(Id id, double time, double value) {
  std::string payload;
  put(payload, value);
  record(id, time, payload);
}

void WpilogWriter::append(Id id, double time, float value) {
  std::string payload;
  put(payload, value);
  record(id, time, payload);
}

void WpilogWriter::append(Id id, double time, std::int64_t value) {
  std::string payload;
  put(payload, value);
  record(id, time, payload);
}

void WpilogWriter::append(Id id, double time, bool value) {
  record(id, time, std::string_view(value ? "\1" : "\0", 1));
}

void WpilogWriter::append(Id id, double time, std::string_view value) {
  record(id, time, value);
}

void WpilogWriter::append(Id id, double time, std::span<const double> values) {
  std::string payload;
  for (const double value : values) {
    put(payload, value);
  }
  record(id, time, payload);
}

void WpilogWriter::append_raw(Id id, double time, std::string_view payload) {
  record(id, time, payload);
}

Expected<void> append_log(WpilogWriter& writer, const Log& log) {
  struct Sample {
    double time;
    bool text;
    std::size_t channel;
    std::size_t row;
  };
  std::vector<Sample> samples;
  for (std::size_t c = 0; c < log.signals.size(); ++c) {
    const Signal& signal = log.signals[c];
    FLYBALL_CHECK(check_channel(signal.name, signal.time, signal.value.size()));
    for (std::size_t i = 0; i < signal.time.size(); ++i) {
      FLYBALL_CHECK(check_finite(signal.value[i], "to_wpilog", signal.name));
      samples.push_back({signal.time[i], false, c, i});
    }
  }
  for (std::size_t c = 0; c < log.texts.size(); ++c) {
    const TextSignal& text = log.texts[c];
    FLYBALL_CHECK(check_channel(text.name, text.time, text.value.size()));
    for (std::size_t i = 0; i < text.time.size(); ++i) {
      samples.push_back({text.time[i], true, c, i});
    }
  }
  std::stable_sort(samples.begin(), samples.end(),
                   [](const Sample& a, const Sample& b) { return a.time < b.time; });

  std::vector<WpilogWriter::Id> signals;
  std::vector<WpilogWriter::Id> texts;
  for (const Signal& signal : log.signals) {
    signals.push_back(writer.start(signal.name, "double", signal.unit));
  }
  for (const TextSignal& text : log.texts) {
    texts.push_back(writer.start(text.name, "string"));
  }
  for (const Sample& sample : samples) {
    if (sample.text) {
      writer.append(texts[sample.channel], sample.time,
                    std::string_view(log.texts[sample.channel].value[sample.row]));
    } else {
      writer.append(signals[sample.channel], sample.time,
                    log.signals[sample.channel].value[sample.row]);
    }
  }
  return {};
}

Expected<std::string> to_wpilog(const Log& log) {
  const auto extra = log.metadata.find("extra");
  WpilogWriter writer(extra == log.metadata.end() ? "Flyball" : extra->second);
  return append_log(writer, log).map([&] { return writer.bytes(); });
}

Expected<void> write_wpilog(const std::string& path, const Log& log) {
  return to_wpilog(log).and_then(
      [&](const std::string& bytes) { return write_file_atomically(path, bytes); });
}

}  // namespace flyball
