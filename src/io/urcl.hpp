#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/time_series.hpp>

namespace flyball::io {

/// The status frames of REV motor controllers that URCL writes into a log as they came from CAN,
/// each with its own time of arrival (ms), as signals of volts, duty cycles, positions and
/// velocities.
///
/// A frame is its time (u32), the low half of its CAN identifier (u16: class, index, device) and
/// eight bytes. Revision 1 has counts, facts of the devices and frames in one record; 2 and 3 have
/// a channel each for frames, facts and names. Firmware before 2025 sends class 6, later firmware
/// class 46. Source: AdvantageScope's decoder of URCL, revisions 1 to 3; REV's specification of
/// public CAN frames 2.0.5 and 2.1.0 (REVrobotics/can-specs).
class UrclDecoder {
 public:
  /// Whether a channel's type is one of URCL's.
  [[nodiscard]] static bool knows(std::string_view type);

  /// One record of such a channel. @return  False if it is not as long as it says.
  bool take(std::string_view channel, std::string_view type, std::string_view payload);

  /// Appends the signals, named as AdvantageScope names them; tells whose they are.
  /// @param most  Signals at most.
  void finish(std::vector<Signal>& signals, std::vector<Diagnostic>& diagnostics, std::size_t most);

 private:
  struct Frame {
    std::uint32_t time = 0;  ///< ms
    std::uint16_t identifier = 0;
    std::array<char, 8> data{};
  };
  struct Device {
    std::string alias;
    bool flex = false;
    int firmware = 0;      ///< Its year.
    bool current = false;  ///< Sends the frames of 2025 and later.
    std::vector<Frame> frames;
  };

  bool take_facts(const std::string& root, std::string_view payload);
  bool take_frames(const std::string& root, std::string_view payload);
  void take_names(const std::string& root, std::string_view payload);
  Device& device(const std::string& root, unsigned identifier);

  std::map<std::pair<std::string, unsigned>, Device> devices_;
};

}  // namespace flyball::io
