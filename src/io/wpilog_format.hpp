#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "io/text.hpp"
#include "io/urcl.hpp"

/// The bytes of a WPILOG, for its two readers; private to io.
namespace flyball::io::wpilog {

static_assert(std::endian::native == std::endian::little, "payloads are copied as they are");

inline constexpr std::string_view magic = "WPILOG";
inline constexpr std::size_t header_bytes = 12;
/// Beyond these a hostile file could turn each of its bytes into a channel of its own.
inline constexpr std::size_t max_array_width = 64;
inline constexpr std::size_t max_channels = 50'000;

template <class T>
T read_le(std::string_view bytes) {
  T value;
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

inline std::uint64_t read_le(std::string_view bytes, std::size_t width) {
  std::uint64_t value = 0;
  std::memcpy(&value, bytes.data(), width);
  return value;
}

/// Takes a string (u32 length, bytes) from the front of `bytes`, if it fits.
inline std::optional<std::string_view> take_string(std::string_view& bytes) {
  if (bytes.size() < 4) {
    return std::nullopt;
  }
  const std::size_t length = read_le<std::uint32_t>(bytes);
  if (length > bytes.size() - 4) {
    return std::nullopt;
  }
  const std::string_view text = bytes.substr(4, length);
  bytes.remove_prefix(4 + length);
  return text;
}

enum class Scalar { none, float64, float32, int64, boolean };

struct Type {
  Scalar scalar = Scalar::none;
  bool array = false;
  bool text = false;
  bool frames = false;  ///< Of URCL.
};

inline Type parse_type(std::string_view name) {
  Type type;
  type.text = name == "string" || name == "json";
  type.frames = UrclDecoder::knows(name);
  if (name.ends_with("[]")) {
    type.array = true;
    name.remove_suffix(2);
  }
  type.scalar = name == "double"    ? Scalar::float64
                : name == "float"   ? Scalar::float32
                : name == "int64"   ? Scalar::int64
                : name == "boolean" ? Scalar::boolean
                                    : Scalar::none;
  return type;
}

inline constexpr std::size_t width(Scalar scalar) {
  return scalar == Scalar::boolean ? 1 : scalar == Scalar::float32 ? 4 : 8;
}

inline double decode(Scalar scalar, std::string_view bytes) {
  switch (scalar) {
    case Scalar::float64:
      return read_le<double>(bytes);
    case Scalar::float32:
      return static_cast<double>(read_le<float>(bytes));
    case Scalar::int64:
      return static_cast<double>(read_le<std::int64_t>(bytes));
    case Scalar::boolean:
    case Scalar::none:
      break;
  }
  return bytes.front() == 0 ? 0.0 : 1.0;
}

/// "Volt" is itself a unit; of JSON metadata only the member "unit" is one.
inline std::string unit_of(std::string_view metadata) {
  metadata = trim(metadata);
  if (!metadata.starts_with('{')) {
    return is_utf8(metadata) ? std::string(metadata) : std::string();
  }
  const auto json = nlohmann::json::parse(metadata, nullptr, /*allow_exceptions=*/false);
  const auto unit = json.is_object() ? json.find("unit") : json.end();
  return unit != json.end() && unit->is_string() ? unit->get<std::string>() : std::string();
}

/// The first byte of a record says how wide its head's numbers are.
struct RecordHead {
  std::size_t id_width = 0;
  std::size_t size_width = 0;
  std::size_t time_width = 0;
  [[nodiscard]] std::size_t bytes() const { return 1 + id_width + size_width + time_width; }
};
[[nodiscard]] inline RecordHead record_head(char first) {
  const auto bits = static_cast<unsigned char>(first);
  return {(bits & 3U) + 1U, ((bits >> 2) & 3U) + 1U, ((bits >> 4) & 7U) + 1U};
}

}  // namespace flyball::io::wpilog
