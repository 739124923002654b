// A WPILOG, record by record.
#include <cmath>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include <flyball/io/log_error.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "io/log_streams.hpp"
#include "io/wpilog_format.hpp"

namespace flyball::io {

namespace {

using namespace wpilog;

constexpr std::size_t longest_record = std::size_t{1} << 26;

class Records {
 public:
  Records(ChunkedFile& file, LogSink& sink) : file_(file), sink_(sink) {}

  /// @return Whether the file is one that can be streamed.
  bool run() {
    while (file_.fill(1) && record()) {
    }
    return !frames_;
  }

  std::size_t records = 0;
  std::vector<Diagnostic> diagnostics{};

 private:
  struct Entry {
    std::string name;
    Type type;
    std::string unit;
    std::vector<std::size_t> ids;  ///< One, or one an element.
    double last = 0.0;
  };

  bool record() {
    const char first = file_.rest().front();
    const RecordHead widths = record_head(first);
    if (static_cast<unsigned char>(first) >> 7 != 0) {
      return stop("damaged_log", "is not the beginning of a record");
    }
    if (!file_.fill(widths.bytes())) {
      return stop("truncated_log", "begins a record that the file does not hold whole");
    }
    const std::string_view head = file_.rest();
    const auto id = static_cast<std::uint32_t>(read_le(head.substr(1), widths.id_width));
    const std::uint64_t size = read_le(head.substr(1 + widths.id_width), widths.size_width);
    const std::uint64_t time =
        read_le(head.substr(1 + widths.id_width + widths.size_width), widths.time_width);
    if (size > longest_record || (id == 0 && size == 0) || !file_.fill(widths.bytes() + size)) {
      return stop("truncated_log", "begins a record that the file does not hold whole");
    }
    const std::string_view payload = file_.rest().substr(widths.bytes(), size);
    if (id == 0) {
      control(payload);
    } else {
      data(id, static_cast<double>(time) * 1e-6, payload);
    }
    file_.pass(widths.bytes() + size);
    return !frames_;
  }

  bool stop(std::string code, std::string_view what) {
    warn(diagnostics, std::move(code), "byte {} {}; the {} before it are used", file_.position(),
         what, counted(records, "record"));
    return false;
  }

  void control(std::string_view payload) {
    const char kind = payload.front();
    payload.remove_prefix(1);
    if (payload.size() < 4) {
      return;
    }
    const auto id = read_le<std::uint32_t>(payload);
    payload.remove_prefix(4);
    if (kind == 1) {
      open_.erase(id);
    } else if (const auto text = take_string(payload); text && kind == 2) {
      if (const auto found = open_.find(id); found != open_.end()) {
        set_unit(entries_[found->second], unit_of(*text));
      }
    } else if (text && kind == 0) {
      const auto type = take_string(payload);
      const auto metadata = type ? take_string(payload) : std::optional<std::string_view>();
      if (metadata && entries_.size() < max_channels) {
        start(id, *text, *type, unit_of(*metadata));
      }
    }
  }

  void start(std::uint32_t id, std::string_view name, std::string_view type, std::string unit) {
    std::string clean = is_utf8(name) ? std::string(name) : printable(name, 4096);
    const auto [found, added] = by_name_.try_emplace({clean, std::string(type)}, entries_.size());
    if (added) {
      entries_.push_back({std::move(clean), parse_type(type), {}, {}, 0.0});
    }
    open_[id] = found->second;
    set_unit(entries_[found->second], std::move(unit));
  }

  void set_unit(Entry& entry, std::string unit) {
    if (unit.empty() || unit == entry.unit) {
      return;
    }
    entry.unit = std::move(unit);
    for (std::size_t i = 0; i < entry.ids.size(); ++i) {
      sink_.channel(entry.ids[i], name_of(entry, i), entry.unit);
    }
  }

  static std::string name_of(const Entry& entry, std::size_t element) {
    return entry.type.array ? entry.name + "[" + std::to_string(element) + "]" : entry.name;
  }

  bool has_ids(Entry& entry, std::size_t count) {
    while (entry.ids.size() < count) {
      if (next_id_ >= max_channels) {
        return false;
      }
      sink_.channel(next_id_, name_of(entry, entry.ids.size()), entry.unit);
      entry.ids.push_back(next_id_++);
    }
    return true;
  }

  void data(std::uint32_t id, double time, std::string_view payload) {
    ++records;
    const auto found = open_.find(id);
    if (found == open_.end()) {
      return;
    }
    Entry& entry = entries_[found->second];
    if (entry.type.frames) {
      frames_ = true;
      return;
    }
    if (time < entry.last) {
      return;  // A sample that came late, which who reads the log whole would sort.
    }
    entry.last = time;
    if (entry.type.text) {
      if (has_ids(entry, 1)) {
        sink_.text(entry.ids[0], time,
                   is_utf8(payload) ? std::string(payload) : printable(payload, payload.size()));
      }
      return;
    }
    const std::size_t each = width(entry.type.scalar);
    const std::size_t count = payload.size() / each;
    if (entry.type.scalar == Scalar::none || payload.size() % each != 0 ||
        (!entry.type.array && count != 1) || count > max_array_width || !has_ids(entry, count)) {
      return;
    }
    for (std::size_t i = 0; i < count; ++i) {
      const double value = decode(entry.type.scalar, payload.substr(i * each, each));
      if (std::isfinite(value)) {
        sink_.number(entry.ids[i], time, value);
      }
    }
  }

  ChunkedFile& file_;
  LogSink& sink_;
  std::vector<Entry> entries_{};
  std::map<std::pair<std::string, std::string>, std::size_t> by_name_{};
  std::unordered_map<std::uint32_t, std::size_t> open_{};
  std::size_t next_id_ = 0;
  bool frames_ = false;
};

}  // namespace

Expected<std::optional<StreamedLog>> stream_wpilog(ChunkedFile& file, const std::string& source,
                                                   LogSink& sink) {
  if (!file.fill(header_bytes) || read_le<std::uint16_t>(file.rest().substr(6)) >> 8 != 1) {
    return std::optional<StreamedLog>();
  }
  const std::size_t extra = read_le<std::uint32_t>(file.rest().substr(8));
  if (extra > longest_record || !file.fill(header_bytes + extra)) {
    return std::optional<StreamedLog>();
  }
  file.pass(header_bytes + extra);
  Records records(file, sink);
  if (!records.run()) {
    return std::optional<StreamedLog>();
  }
  if (records.records == 0) {
    return refusal(LogError::no_data, source, "the WPILOG")
        .got("without a number or a text that can be decoded")
        .hint("check that the robot program logs the mechanism (SysIdRoutineLog)");
  }
  return std::optional(StreamedLog{"WPILOG", {}, records.records, std::move(records.diagnostics)});
}

}  // namespace flyball::io
