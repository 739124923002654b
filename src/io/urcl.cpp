#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "core/diagnose.hpp"
#include "io/text.hpp"
#include "io/urcl.hpp"

namespace flyball::io {
namespace {

constexpr std::size_t fact_bytes = 8;
constexpr std::size_t frame_bytes = 14;
constexpr unsigned class_2024 = 6;
constexpr unsigned class_2025 = 46;
constexpr unsigned firmware_frame = 0x98;        // class 9, index 8
constexpr unsigned model_frame = 0x300U | 155U;  // parameter 155
constexpr std::uint32_t flex_model = 0x2159;

template <class T>
T at(std::string_view bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

/// `length` bits from `first` on, the lowest first.
std::uint32_t bits(std::string_view bytes, unsigned first, unsigned length) {
  return static_cast<std::uint32_t>(at<std::uint64_t>(bytes, 0) >> first & ((1ULL << length) - 1));
}

unsigned device_of(unsigned identifier) {
  return identifier & 0x3FU;
}
unsigned index_of(unsigned identifier) {
  return identifier >> 6 & 0xFU;
}
unsigned class_of(unsigned identifier) {
  return identifier >> 10 & 0x3FU;
}

/// A device's signals by their names, and the battery's voltage that it told last.
struct Decoded {
  std::map<std::string, Signal, std::less<>> signals;
  double bus = 0.0;

  void add(std::string_view name, std::string_view unit, double time, double value) {
    auto found = signals.find(name);
    if (found == signals.end()) {
      found = signals.emplace(name, Signal{std::string(name), std::string(unit), {}, {}}).first;
    }
    found->second.time.push_back(time);
    found->second.value.push_back(value);
  }
  void add_output(double time, double duty) {
    add("AppliedOutput", "", time, duty);
    if (bus > 0.0) {
      add("AppliedOutputVoltage", "V", time, duty * bus);
    }
  }
};

void decode_2024(unsigned index, double time, std::string_view data, bool flex, int firmware,
                 Decoded& to) {
  const auto number = [&](std::size_t offset) {
    return static_cast<double>(at<float>(data, offset));
  };
  const char* const second = flex ? "ExternalEncoder" : "AlternateEncoder";
  switch (index) {
    case 0:
      to.add_output(time, at<std::int16_t>(data, 0) / 32767.0);
      break;
    case 1:
      to.bus = bits(data, 40, 12) / 128.0;
      to.add("MotorVelocityRPM", "RPM", time, number(0));
      to.add("BusVoltage", "V", time, to.bus);
      to.add("MotorCurrentAmps", "A", time, bits(data, 52, 12) / 32.0);
      break;
    case 2: {
      double position = number(0);
      if (flex && firmware >= 24) {  // the fraction stands beside it
        position = std::trunc(position);
        position += std::copysign(at<std::uint16_t>(data, 4) / 65536.0, position);
      }
      to.add("MotorPositionRotations", "rotations", time, position);
      break;
    }
    case 4:
      to.add(fmt::format("{}/VelocityRPM", second), "RPM", time, number(0));
      to.add(fmt::format("{}/PositionRotations", second), "rotations", time, number(4));
      break;
    case 5:
      to.add("AbsoluteEncoder/PositionRotations", "rotations", time, number(0));
      break;
    case 6:
      to.add("AbsoluteEncoder/VelocityRPM", "RPM", time, number(0));
      break;
    default:
      break;
  }
}

// Positions and velocities are in whatever unit the conversion factors make: rotations and RPM
// without one.
void decode_2025(unsigned index, double time, std::string_view data, Decoded& to) {
  const auto motion = [&](std::string_view encoder) {
    to.add(fmt::format("{}Velocity", encoder), "", time, static_cast<double>(at<float>(data, 0)));
    to.add(fmt::format("{}Position", encoder), "", time, static_cast<double>(at<float>(data, 4)));
  };
  switch (index) {
    case 0:
      to.bus = bits(data, 16, 12) * (30.0 / 4095.0);
      to.add("InputVoltage", "V", time, to.bus);
      to.add("CurrentOutput", "A", time, bits(data, 28, 12) * (150.0 / 4095.0));
      to.add_output(time, at<std::int16_t>(data, 0) / 32442.5725);
      break;
    case 2:
      motion("PrimaryEncoder");
      break;
    case 4:
      motion("ExternalEncoder/");
      break;
    case 5:
      motion("AbsoluteEncoder/");
      break;
    default:
      break;
  }
}

/// "NT:/URCL/" of "NT:/URCL/Raw/Periodic" and of "NT:/URCL".
std::string root_of(std::string_view channel) {
  for (const std::string_view end : {"Raw/Periodic", "Raw/Persistent", "Raw/Aliases"}) {
    if (channel.ends_with(end)) {
      return std::string(channel.substr(0, channel.size() - end.size()));
    }
  }
  return std::string(channel) + "/";
}

bool all_equal(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(),
                     [&](double value) { return value == values.front(); });
}

}  // namespace

bool UrclDecoder::knows(std::string_view type) {
  return type == "URCL" || ((type.starts_with("URCLr2_") || type.starts_with("URCLr3_")) &&
                            (type.ends_with("_periodic") || type.ends_with("_persistent") ||
                             type.ends_with("_aliases")));
}

UrclDecoder::Device& UrclDecoder::device(const std::string& root, unsigned identifier) {
  return devices_[{root, device_of(identifier)}];
}

bool UrclDecoder::take(std::string_view channel, std::string_view type, std::string_view payload) {
  const std::string root = root_of(channel);
  if (type.ends_with("_aliases")) {
    take_names(root, payload);
    return true;
  }
  if (type.ends_with("_persistent")) {
    return take_facts(root, payload);
  }
  if (type.ends_with("_periodic")) {
    return take_frames(root, payload);
  }
  if (payload.size() < 8) {
    return false;
  }
  const std::uint64_t facts = std::uint64_t{at<std::uint32_t>(payload, 0)} * fact_bytes;
  const std::uint64_t frames = std::uint64_t{at<std::uint32_t>(payload, 4)} * frame_bytes;
  payload.remove_prefix(8);
  return facts + frames <= payload.size() && take_facts(root, payload.substr(0, facts)) &&
         take_frames(root, payload.substr(facts, frames));
}

bool UrclDecoder::take_facts(const std::string& root, std::string_view payload) {
  for (std::size_t i = 0; i + fact_bytes <= payload.size(); i += fact_bytes) {
    const unsigned identifier = at<std::uint16_t>(payload, i);
    const std::string_view value = payload.substr(i + 2, 6);
    if (identifier >> 6 == firmware_frame) {
      device(root, identifier).firmware = static_cast<unsigned char>(value[0]);
    } else if (identifier >> 6 == model_frame) {
      device(root, identifier).flex = value[5] == 0 && at<std::uint32_t>(value, 0) == flex_model;
    }
  }
  return payload.size() % fact_bytes == 0;
}

bool UrclDecoder::take_frames(const std::string& root, std::string_view payload) {
  for (std::size_t i = 0; i + frame_bytes <= payload.size(); i += frame_bytes) {
    Frame frame{at<std::uint32_t>(payload, i), at<std::uint16_t>(payload, i + 4), {}};
    std::memcpy(frame.data.data(), payload.data() + i + 6, frame.data.size());
    const unsigned kind = class_of(frame.identifier);
    if (kind == class_2024 || kind == class_2025) {
      Device& of = device(root, frame.identifier);
      of.current = of.current || kind == class_2025;
      of.frames.push_back(frame);
    }
  }
  return payload.size() % frame_bytes == 0;
}

void UrclDecoder::take_names(const std::string& root, std::string_view payload) {
  const auto json = nlohmann::json::parse(payload, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) {
    return;
  }
  for (const auto& [text, name] : json.items()) {
    unsigned id = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
    if (error == std::errc() && end == text.data() + text.size() && id < 64 && name.is_string()) {
      device(root, id).alias = printable(name.get<std::string>(), 200);
    }
  }
}

void UrclDecoder::finish(std::vector<Signal>& signals, std::vector<Diagnostic>& diagnostics,
                         std::size_t most) {
  std::vector<std::string> names;
  for (auto& [key, of] : devices_) {
    const auto& [root, id] = key;
    // A record holds what arrived since the last one, each kind of frame for itself.
    std::stable_sort(of.frames.begin(), of.frames.end(),
                     [](const Frame& a, const Frame& b) { return a.time < b.time; });
    Decoded decoded;
    for (const Frame& frame : of.frames) {
      // Firmware of 2025 sends an empty frame of the older class, for older robot code.
      if ((class_of(frame.identifier) == class_2025) != of.current) {
        continue;
      }
      const std::string_view data(frame.data.data(), frame.data.size());
      const double time = frame.time / 1000.0;
      if (of.current) {
        decode_2025(index_of(frame.identifier), time, data, decoded);
      } else {
        decode_2024(index_of(frame.identifier), time, data, of.flex, of.firmware, decoded);
      }
    }
    if (decoded.signals.empty()) {
      continue;
    }
    const char* const model = of.current ? "Spark" : of.flex ? "SparkFlex" : "SparkMax";
    const std::string name = of.alias.empty() ? fmt::format("{}-{}", model, id) : of.alias;
    for (auto& [own, signal] : decoded.signals) {
      // A further encoder that is not there reads one value for ever.
      const bool further = own.find('/') != std::string::npos;
      if (signals.size() < most && !(further && all_equal(signal.value))) {
        signal.name = fmt::format("{}{}/{}", root, name, own);
        signals.push_back(std::move(signal));
      }
    }
    names.push_back(name);
  }
  if (!names.empty()) {
    constexpr std::size_t shown = 8;
    const std::size_t all = names.size();
    names.resize(std::min(all, shown));
    note(diagnostics, "raw_frames", "the raw CAN frames of {} were decoded: {}{}",
         counted(all, "REV motor controller"), fmt::join(names, ", "), all > shown ? ", …" : "");
  }
}

}  // namespace flyball::io
