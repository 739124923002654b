#include <algorithm>
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

class Splitter {
 public:
  Splitter(std::string_view text, const std::string& source) : text_(text), source_(source) {}

  Expected<CsvTable> split() {
    bool first = true;
    while (at_ < text_.size()) {
      const std::size_t line_end = std::min(text_.find_first_of("\r\n", at_), text_.size());
      const std::string_view line = trim(text_.substr(at_, line_end - at_));
      if (line.empty() || line.starts_with('#')) {
        at_ = line_end;
        skip_line_end();
        continue;
      }
      if (first) {
        first = false;
        // A tab after "sep=" is blank space, which `line` is without.
        const char said = said_delimiter(text_.substr(at_, line_end - at_));
        table_.delimiter = said != '\0' ? said : tell_delimiter(text_.substr(at_));
        if (said != '\0') {
          at_ = line_end;
          skip_line_end();
          continue;
        }
      }
      FLYBALL_CHECK(read_row());
    }
    return std::move(table_);
  }

 private:
  void skip_line_end() {
    if (at_ < text_.size()) {
      at_ += text_.substr(at_, 2) == "\r\n" ? 2 : 1;
      ++line_;
    }
  }

  bool at_line_end() const {
    return at_ >= text_.size() || text_[at_] == '\n' || text_[at_] == '\r';
  }

  Expected<void> read_row() {
    std::vector<std::string> cells;
    const std::size_t line = line_;
    for (;;) {
      if (text_.substr(at_).starts_with('"')) {
        if (Expected<void> ok = read_quoted(cells.emplace_back()); !ok) {
          return ok;
        }
      } else {
        cells.emplace_back();
      }
      const std::size_t start = at_;
      while (!at_line_end() && text_[at_] != table_.delimiter) {
        ++at_;
      }
      cells.back() += text_.substr(start, at_ - start);
      if (at_line_end()) {
        break;
      }
      ++at_;
    }
    skip_line_end();
    const bool blank = std::all_of(cells.begin(), cells.end(),
                                   [](const std::string& cell) { return trim(cell).empty(); });
    if (!blank) {
      table_.rows.push_back(std::move(cells));
      table_.lines.push_back(line);
    }
    return {};
  }

  Expected<void> read_quoted(std::string& cell) {
    const std::size_t opened = at_++;
    for (;;) {
      const std::size_t quote = text_.find('"', at_);
      if (quote == std::string_view::npos) {
        return refusal(LogError::malformed, place(source_, text_, opened), "the quoted cell")
            .got("never closed")
            .hint("close it with \", or remove the \"");
      }
      const std::string_view part = text_.substr(at_, quote - at_);
      line_ += static_cast<std::size_t>(std::count(part.begin(), part.end(), '\n'));
      cell += part;
      at_ = quote + 1;
      if (!text_.substr(at_).starts_with('"')) {
        return {};
      }
      cell += '"';
      ++at_;
    }
  }

  std::string_view text_;
  const std::string& source_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
  CsvTable table_;
};

}  // namespace

Expected<CsvTable> split_csv(std::string_view text, const std::string& source) {
  if (text.starts_with("\xEF\xBB\xBF")) {
    text.remove_prefix(3);
  }
  if (is_utf8(text)) {
    return Splitter(text, source).split();
  }
  const std::string converted = from_windows_1252(text);
  return Splitter(converted, source).split();
}

}  // namespace flyball::io
