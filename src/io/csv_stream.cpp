// A table of text, row by row.
#include <cmath>
#include <utility>
#include <vector>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "io/csv_layout.hpp"
#include "io/csv_table.hpp"
#include "io/log_streams.hpp"
#include "io/text.hpp"

namespace flyball::io {

namespace {

constexpr std::size_t head_bytes = std::size_t{1} << 20;
constexpr std::size_t longest_line = std::size_t{1} << 22;

class StreamedRows {
 public:
  StreamedRows(CsvLayout layout, LogSink& sink) : layout_(std::move(layout)), sink_(sink) {
    for (std::size_t c = 0, id = 0; c < layout_.columns.size(); ++c) {
      if (c != layout_.clock) {
        sink_.channel(id++, layout_.columns[c].name, layout_.columns[c].unit);
      }
    }
  }

  /// @return Whether the time went on.
  bool take(std::string_view line) {
    cells_.clear();
    if (line.find('"') != std::string_view::npos) {
      return take_quoted(line);
    }
    for (std::size_t at = 0;;) {
      const std::size_t end = std::min(line.find(layout_.delimiter, at), line.size());
      cells_.push_back(trim(line.substr(at, end - at)));
      if (end == line.size()) {
        break;
      }
      at = end + 1;
    }
    return take_cells();
  }

  std::size_t rows = 0;
  std::size_t without_time = 0;
  std::size_t words = 0;

 private:
  bool take_quoted(std::string_view line) {
    // The delimiter is told from a first line, which this is not.
    const std::string said = std::string("sep=") + layout_.delimiter + "\n" + std::string(line);
    const auto table = split_csv(said, "");
    if (!table || table->rows() == 0) {
      ++without_time;
      return true;
    }
    table->read(0, quoted_);
    for (std::size_t c = 0; c < quoted_.size(); ++c) {
      cells_.push_back(quoted_[c]);
    }
    return take_cells();
  }

  bool take_cells() {
    const auto time =
        layout_.clock < cells_.size() ? cell_number(cells_[layout_.clock]) : std::nullopt;
    if (!time || !std::isfinite(*time)) {
      without_time += rows > 0 ? 1 : 0;  // the header has none, either
      return true;
    }
    const double seconds = *time * layout_.scale;
    if (rows > 0 && seconds < last_) {
      return false;
    }
    last_ = seconds;
    ++rows;
    for (std::size_t c = 0, id = 0; c < layout_.columns.size(); ++c) {
      if (c == layout_.clock) {
        continue;
      }
      if (c < cells_.size() && !is_blank_cell(cells_[c])) {
        if (layout_.columns[c].text) {
          sink_.text(id, seconds, cells_[c]);
        } else if (const auto value = cell_number(cells_[c])) {
          if (std::isfinite(*value)) {
            sink_.number(id, seconds, *value);
          }
        } else {
          ++words;
        }
      }
      ++id;
    }
    return true;
  }

  CsvLayout layout_;
  LogSink& sink_;
  std::vector<std::string_view> cells_;
  CsvTable::Cells quoted_;
  double last_ = 0.0;
};

}  // namespace

Expected<std::optional<StreamedLog>> stream_csv(ChunkedFile& file, const std::string& source,
                                                LogSink& sink) {
  const bool goes_on = file.fill(head_bytes);
  std::string_view head = file.rest().substr(0, head_bytes);
  if (goes_on) {
    head = head.substr(0, head.rfind('\n') + 1);  // npos + 1 is 0
  }
  if (head.empty() || !is_utf8(head)) {
    return std::optional<StreamedLog>();
  }
  FLYBALL_TRY(auto layout, csv_layout(head, source));
  if (!layout) {
    return std::optional<StreamedLog>();
  }
  StreamedLog log{"CSV", {}, 0, layout->diagnostics};
  StreamedRows rows(*std::move(layout), sink);
  for (bool ended = false; !ended;) {
    std::size_t end = file.rest().find('\n');
    while (end == std::string_view::npos && !ended) {
      if (file.rest().size() > longest_line) {
        return std::optional<StreamedLog>();
      }
      ended = !file.more();
      end = file.rest().find('\n');
    }
    // All lines that are there, then the next chunk.
    while (end != std::string_view::npos || (ended && !file.rest().empty())) {
      const std::string_view line = file.rest().substr(0, end);
      const std::string_view text = trim(line);
      if (!text.empty() && !text.starts_with('#') && !rows.take(text)) {
        return std::optional<StreamedLog>();
      }
      file.pass(std::min(line.size() + 1, file.rest().size()));
      end = file.rest().find('\n');
    }
  }
  log.samples = rows.rows;
  if (rows.without_time > 0) {
    warn(log.diagnostics, "malformed_rows", "{} without a time dropped",
         counted(rows.without_time, "row"));
  }
  if (rows.words > 0) {
    warn(log.diagnostics, "non_numeric_cells",
         "{} in columns of numbers held words and were dropped", counted(rows.words, "cell"));
  }
  return std::optional(std::move(log));
}

}  // namespace flyball::io
