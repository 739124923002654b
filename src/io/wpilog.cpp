#include <flyball/io/wpilog.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "io/signals.hpp"
#include "io/text.hpp"
#include "io/urcl.hpp"
#include "io/wpilog_format.hpp"

namespace flyball {
namespace {

using namespace io::wpilog;

/// Everything that one name and type has in the log, over all its entries.
struct Channel {
  std::string name;
  std::string type_name;
  Type type;
  std::string unit;
  std::vector<std::size_t> signals;  ///< Indices in Log::signals; one, or one an element.
  std::optional<std::size_t> text;   ///< Index in Log::texts.
  std::size_t records = 0;
  std::size_t skipped = 0;
};

class Reader {
 public:
  Reader(std::string_view bytes, const std::string& source) : bytes_(bytes), source_(source) {
    log_.source = source;
    log_.format = "WPILOG";
  }

  Expected<Log> read() {
    FLYBALL_CHECK(read_header());
    while (at_ < bytes_.size() && read_record()) {
    }
    return finish();
  }

 private:
  Expected<void> read_header() {
    if (!bytes_.starts_with(magic)) {
      return refusal(LogError::wrong_magic, source_ + ": byte 0", "the beginning of the file")
          .got(fmt::format("\"{}\"", io::printable(bytes_.substr(0, magic.size()))))
          .expected("\"WPILOG\"")
          .hint("copy the log again from the robot, or give the file its true extension");
    }
    if (bytes_.size() < header_bytes) {
      return tl::unexpected(cut_header(header_bytes));
    }
    const auto version = read_le<std::uint16_t>(bytes_.substr(6));
    if (version >> 8 != 1) {
      return refusal(LogError::wrong_version, source_ + ": byte 6", "the WPILOG version")
          .got(fmt::format("{}.{}", version >> 8, version & 0xFF))
          .expected("1.0")
          .hint("export the log with AdvantageScope, which writes version 1.0");
    }
    const std::size_t extra = read_le<std::uint32_t>(bytes_.substr(8));
    if (extra > bytes_.size() - header_bytes) {
      return tl::unexpected(cut_header(header_bytes + extra));
    }
    if (extra > 0) {
      log_.metadata["extra"] = io::printable(bytes_.substr(header_bytes, extra), 4096);
    }
    at_ = header_bytes + extra;
    return {};
  }

  Error cut_header(std::size_t needed) const {
    return refusal(LogError::malformed, fmt::format("{}: byte {}", source_, bytes_.size()),
                   "the WPILOG header")
        .got(fmt::format("cut after {} bytes", bytes_.size()))
        .expected(fmt::format("{} bytes long by its own account", needed))
        .hint("copy the log again from the robot");
  }

  /// Reads one record; false where the log ends early.
  bool read_record() {
    const std::string_view rest = bytes_.substr(at_);
    const auto [id_width, size_width, time_width] = record_head(rest.front());
    const std::size_t head = record_head(rest.front()).bytes();
    if (static_cast<unsigned char>(rest.front()) >> 7 != 0) {
      return stop("damaged_log", "is not the beginning of a record");
    }
    if (rest.size() < head) {
      return stop("truncated_log", "begins a record that the file does not hold whole");
    }
    const auto id = static_cast<std::uint32_t>(read_le(rest.substr(1), id_width));
    const std::uint64_t size = read_le(rest.substr(1 + id_width), size_width);
    const std::uint64_t time = read_le(rest.substr(1 + id_width + size_width), time_width);
    if (size > rest.size() - head) {
      return stop("truncated_log", fmt::format("begins a record of {} of which {} are there",
                                               io::counted(size, "byte"), rest.size() - head));
    }
    if (id == 0 && size == 0) {
      // No writer makes an empty control record; a file that was allocated and never filled does.
      return stop("truncated_log", "begins a stretch of zeros");
    }
    const std::string_view payload = rest.substr(head, size);
    if (id == 0) {
      control(payload);
    } else {
      data(id, static_cast<double>(time) * 1e-6, payload);
    }
    at_ += head + size;
    return true;
  }

  bool stop(std::string code, std::string_view what) {
    warn(log_.diagnostics, std::move(code), "byte {} of {} {}; the {} before it are used", at_,
         bytes_.size(), what, io::counted(data_records_, "record"));
    return false;
  }

  void control(std::string_view payload) {
    const char kind = payload.front();
    payload.remove_prefix(1);
    if (payload.size() < 4 || kind < 0 || kind > 2) {
      ++bad_control_;
      return;
    }
    const auto id = read_le<std::uint32_t>(payload);
    payload.remove_prefix(4);
    if (kind == 1) {
      entries_.erase(id);
      return;
    }
    if (kind == 2) {
      const std::optional<std::string_view> metadata = take_string(payload);
      const auto entry = entries_.find(id);
      if (!metadata || entry == entries_.end()) {
        ++bad_control_;
        return;
      }
      set_unit(channels_[entry->second], *metadata);
      return;
    }
    const std::optional<std::string_view> name = take_string(payload);
    const std::optional<std::string_view> type =
        name ? take_string(payload) : std::optional<std::string_view>();
    const std::optional<std::string_view> metadata =
        type ? take_string(payload) : std::optional<std::string_view>();
    if (!metadata) {
      ++bad_control_;
      return;
    }
    entries_[id] = channel(*name, *type);
    set_unit(channels_[entries_[id]], *metadata);
  }

  std::size_t channel(std::string_view name, std::string_view type) {
    const std::string clean_name =
        io::is_utf8(name) ? std::string(name) : io::printable(name, 4096);
    const auto [found, added] =
        by_name_.try_emplace({clean_name, std::string(type)}, channels_.size());
    if (added) {
      channels_.push_back(
          {clean_name, io::printable(type, 4096), parse_type(type), {}, {}, {}, 0, 0});
    }
    return found->second;
  }

  void set_unit(Channel& channel, std::string_view metadata) {
    std::string unit = unit_of(metadata);
    if (unit.empty()) {
      return;
    }
    channel.unit = std::move(unit);
    for (const std::size_t signal : channel.signals) {
      log_.signals[signal].unit = channel.unit;
    }
  }

  void data(std::uint32_t id, double time, std::string_view payload) {
    ++data_records_;
    const auto entry = entries_.find(id);
    if (entry == entries_.end()) {
      ++orphans_;
      return;
    }
    Channel& channel = channels_[entry->second];
    ++channel.records;
    if (channel.type.text) {
      append_text(channel, time, payload);
    } else if (channel.type.frames) {
      wrong_size_ += urcl_.take(channel.name, channel.type_name, payload) ? 0 : 1;
    } else if (channel.type.scalar == Scalar::none) {
      ++channel.skipped;
    } else {
      append_numbers(channel, time, payload);
    }
  }

  void append_text(Channel& channel, double time, std::string_view payload) {
    if (!channel.text) {
      if (log_.texts.size() >= max_channels) {
        ++channel.skipped;
        return;
      }
      channel.text = log_.texts.size();
      log_.texts.push_back({channel.name, {}, {}});
    }
    TextSignal& text = log_.texts[*channel.text];
    text.time.push_back(time);
    text.value.push_back(io::is_utf8(payload) ? std::string(payload)
                                              : io::printable(payload, payload.size()));
  }

  void append_numbers(Channel& channel, double time, std::string_view payload) {
    const std::size_t each = width(channel.type.scalar);
    const std::size_t count = payload.size() / each;
    if (payload.size() % each != 0 || (!channel.type.array && count != 1)) {
      ++wrong_size_;
      return;
    }
    if (count > max_array_width ||
        (count > channel.signals.size() && log_.signals.size() + count > max_channels)) {
      ++channel.skipped;
      return;
    }
    while (channel.signals.size() < count) {
      std::string name = channel.type.array
                             ? fmt::format("{}[{}]", channel.name, channel.signals.size())
                             : channel.name;
      channel.signals.push_back(log_.signals.size());
      log_.signals.push_back({std::move(name), channel.unit, {}, {}});
    }
    for (std::size_t i = 0; i < count; ++i) {
      Signal& signal = log_.signals[channel.signals[i]];
      signal.time.push_back(time);
      signal.value.push_back(decode(channel.type.scalar, payload.substr(i * each, each)));
    }
  }

  void tell(std::size_t count, std::string code, std::string_view noun, std::string_view what) {
    if (count > 0) {
      warn(log_.diagnostics, std::move(code), "{} {}", io::counted(count, noun), what);
    }
  }

  Expected<Log> finish() {
    urcl_.finish(log_.signals, log_.diagnostics, max_channels);
    tell(bad_control_, "damaged_records", "control record", "could not be read and were skipped");
    tell(orphans_, "unknown_entries", "record", "belong to no open entry and were skipped");
    tell(wrong_size_, "wrong_sizes", "record",
         "do not have the size of their type and were skipped");
    std::map<std::string, std::size_t> types;
    for (const Channel& channel : channels_) {
      if (channel.skipped > 0) {
        log_.skipped.push_back({channel.name, channel.type_name, channel.skipped});
        ++types[channel.type_name];
      }
    }
    if (!types.empty()) {
      std::string list;
      std::size_t listed = 0;
      for (const auto& [type, count] : types) {
        if (++listed > 8) {
          list += fmt::format(", and {} more", io::counted(types.size() - 8, "type"));
          break;
        }
        list += fmt::format("{}{} {}", list.empty() ? "" : ", ", count, io::printable(type, 40));
      }
      note(log_.diagnostics, "skipped_channels", "{} of types that are not decoded: {}",
           io::counted(log_.skipped.size(), "channel"), list);
    }
    io::tidy(log_);
    if (log_.signals.empty() && log_.texts.empty()) {
      Error error = refusal(LogError::no_data, source_, "the WPILOG")
                        .got("without a number or a text that can be decoded")
                        .hint("check that the robot program logs the mechanism (SysIdRoutineLog)");
      return tl::unexpected(io::with_diagnostics(std::move(error), log_.diagnostics));
    }
    return std::move(log_);
  }

  std::string_view bytes_;
  const std::string& source_;
  std::size_t at_ = 0;
  Log log_;
  io::UrclDecoder urcl_;
  std::vector<Channel> channels_;
  std::map<std::pair<std::string, std::string>, std::size_t> by_name_;
  std::unordered_map<std::uint32_t, std::size_t> entries_;
  std::size_t data_records_ = 0;
  std::size_t bad_control_ = 0;
  std::size_t orphans_ = 0;
  std::size_t wrong_size_ = 0;
};

}  // namespace

Expected<Log> parse_wpilog(std::string_view bytes, const std::string& source) {
  return Reader(bytes, source).read();
}

}  // namespace flyball
