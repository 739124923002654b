#include <algorithm>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include <flyball/io/log_error.hpp>

#include "core/try.hpp"
#include "io/csv_table.hpp"
#include "io/text.hpp"

namespace flyball::io {
namespace {

/// Tab before semicolon before comma: a comma may also be a decimal point, the others may not. A
/// title may hold either, so that most of the first lines have to.
char tell_delimiter(std::string_view text) {
  constexpr int looked_at = 20;
  int lines = 0;
  int tabs = 0;
  int semicolons = 0;
  bool quoted = false;
  bool tab = false;
  bool semicolon = false;
  bool any = false;
  const auto end_line = [&] {
    lines += any ? 1 : 0;
    tabs += tab ? 1 : 0;
    semicolons += semicolon ? 1 : 0;
    tab = semicolon = any = false;
  };
  for (const char c : text) {
    if (!quoted && (c == '\n' || c == '\r')) {
      end_line();
      if (lines >= looked_at) {
        break;
      }
      continue;
    }
    any = true;
    quoted = quoted != (c == '"');
    tab = tab || (!quoted && c == '\t');
    semicolon = semicolon || (!quoted && c == ';');
  }
  end_line();
  return 2 * tabs > lines ? '\t' : 2 * semicolons > lines ? ';' : ',';
}

/// The separator of a first line such as "sep=;", which spreadsheets write and read; 0 if it is
/// none.
char said_delimiter(std::string_view line) {
  const bool says = line.size() >= 4 && lower(line.substr(0, 4)) == "sep=";
  return !says ? '\0' : line.size() > 4 ? line[4] : ',';
}

/// Where the first of a character is, or the end.
const char* find(const char* at, const char* end, char c) {
  const void* found = at == end ? nullptr : std::memchr(at, c, static_cast<std::size_t>(end - at));
  return found == nullptr ? end : static_cast<const char*>(found);
}

/// Whether a line has nothing but what a row without cells has.
bool may_be_blank(std::string_view line) {
  const char first = line.front();
  return !((first >= '0' && first <= '9') || (first >= 'A' && first <= 'Z') ||
           (first >= 'a' && first <= 'z') || first == '-');
}

}  // namespace

std::string_view CsvTable::Cells::operator[](std::size_t column) const {
  return trim(raw(column));
}

void CsvTable::read(std::size_t row, Cells& cells, std::size_t most) const {
  const std::string_view line = text_.substr(rows_[row].at, rows_[row].size);
  cells.cells_.clear();
  cells.unquoted_.clear();
  const char* at = line.data();
  const char* const end = at + line.size();
  while (cells.cells_.size() < most) {
    if (at != end && *at == '"') {
      cells.unquoted_.reserve(line.size());  // no cell moves any more
      const std::size_t begin = cells.unquoted_.size();
      for (++at;; ++at) {
        const char* quote = find(at, end, '"');
        cells.unquoted_.append(at, quote);
        at = std::min(quote + 1, end);
        if (at == end || *at != '"') {
          break;
        }
        cells.unquoted_ += '"';
      }
      const char* stop = find(at, end, delimiter_);
      cells.unquoted_.append(at, stop);
      cells.cells_.push_back(std::string_view(cells.unquoted_).substr(begin));
      at = stop;
    } else {
      const char* begin = at;
      while (at != end && *at != delimiter_) {
        ++at;
      }
      cells.cells_.emplace_back(begin, static_cast<std::size_t>(at - begin));
    }
    if (at == end) {
      break;
    }
    ++at;
  }
}

class CsvSplitter {
 public:
  CsvSplitter(std::string_view text, const std::string& source) : text_(text), source_(source) {
    table_.text_ = text;
  }

  Expected<CsvTable> split() {
    bool first = true;
    while (at_ < text_.size()) {
      const std::size_t end = line_end(at_);
      const std::string_view line = trim(text_.substr(at_, end - at_));
      if (line.empty() || line.starts_with('#')) {
        next_line(end);
        continue;
      }
      if (first) {
        first = false;
        // A tab after "sep=" is blank space, which `line` is without.
        const char said = said_delimiter(text_.substr(at_, end - at_));
        table_.delimiter_ = said != '\0' ? said : tell_delimiter(text_.substr(at_));
        if (said != '\0') {
          next_line(end);
          continue;
        }
      }
      FLYBALL_CHECK(read_row(end));
    }
    return std::move(table_);
  }

 private:
  [[nodiscard]] std::size_t line_end(std::size_t at) const {
    const char* begin = text_.data() + at;
    const char* feed = find(begin, text_.data() + text_.size(), '\n');
    return static_cast<std::size_t>(find(begin, feed, '\r') - text_.data());
  }

  void next_line(std::size_t end) {
    at_ = end;
    if (at_ < text_.size()) {
      at_ += text_.substr(at_, 2) == "\r\n" ? 2 : 1;
      ++line_;
    }
  }

  /// @param end  Of the line; the row goes on behind it where it lies within quotes.
  Expected<void> read_row(std::size_t end) {
    const std::size_t begin = at_;
    const std::size_t line = line_;
    if (text_.substr(at_, end - at_).find('"') != std::string_view::npos) {
      FLYBALL_TRY(end, end_of_quoted_row(end));
    }
    const std::string_view row = text_.substr(begin, end - begin);
    table_.rows_.push_back({begin, row.size(), line});
    if (may_be_blank(row) && is_blank()) {
      table_.rows_.pop_back();
    }
    next_line(end);
    return {};
  }

  bool is_blank() {
    table_.read(table_.rows() - 1, cells_);
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      if (!cells_[c].empty()) {
        return false;
      }
    }
    return true;
  }

  Expected<std::size_t> end_of_quoted_row(std::size_t end) {
    for (std::size_t at = at_;;) {
      if (at < text_.size() && text_[at] == '"') {
        const std::size_t opened = at++;
        for (;;) {
          const std::size_t quote = text_.find('"', at);
          if (quote == std::string_view::npos) {
            return refusal(LogError::malformed, place(source_, text_, opened), "the quoted cell")
                .got("never closed")
                .hint("close it with \", or remove the \"");
          }
          const std::string_view part = text_.substr(at, quote - at);
          line_ += static_cast<std::size_t>(std::count(part.begin(), part.end(), '\n'));
          at = quote + 1;
          if (!text_.substr(at).starts_with('"')) {
            break;
          }
          ++at;
        }
        end = line_end(at);
      }
      at = static_cast<std::size_t>(find(text_.data() + at, text_.data() + end, table_.delimiter_) -
                                    text_.data());
      if (at == end) {
        return end;
      }
      ++at;
    }
  }

  std::string_view text_;
  const std::string& source_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
  CsvTable table_;
  CsvTable::Cells cells_;
};

Expected<CsvTable> split_csv(std::string_view text, const std::string& source) {
  if (text.starts_with("\xEF\xBB\xBF")) {
    text.remove_prefix(3);
  }
  if (is_utf8(text)) {
    return CsvSplitter(text, source).split();
  }
  auto converted = std::make_unique<const std::string>(from_windows_1252(text));
  FLYBALL_TRY(CsvTable table, CsvSplitter(*converted, source).split());
  table.converted_ = std::move(converted);
  return table;
}

}  // namespace flyball::io
