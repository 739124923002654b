#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/expected.hpp>

/// Text into rows of cells; private to io.
namespace flyball::io {

/// The rows of a text; their cells are taken apart when they are asked for, so that a table takes
/// no more memory than where its lines are.
class CsvTable {
 public:
  /// The cells of the row that was asked for last. They live as long as this and the text do.
  class Cells {
   public:
    [[nodiscard]] std::size_t size() const noexcept { return cells_.size(); }
    /// Without blank space around it; empty beyond the row's end.
    [[nodiscard]] std::string_view operator[](std::size_t column) const;
    /// As it stands.
    [[nodiscard]] std::string_view raw(std::size_t column) const {
      return column < cells_.size() ? cells_[column] : std::string_view();
    }

   private:
    friend class CsvTable;
    std::vector<std::string_view> cells_;
    std::string unquoted_;
  };

  [[nodiscard]] char delimiter() const noexcept { return delimiter_; }
  /// Without blank lines and lines of '#'.
  [[nodiscard]] std::size_t rows() const noexcept { return rows_.size(); }
  /// The line that a row began on, from 1.
  [[nodiscard]] std::size_t line(std::size_t row) const { return rows_[row].line; }
  /// @param most  How many cells are wanted; those behind them are not looked at.
  void read(std::size_t row, Cells& cells, std::size_t most = static_cast<std::size_t>(-1)) const;
  /// Forgets the first rows.
  void drop(std::size_t rows) {
    rows_.erase(rows_.begin(), rows_.begin() + static_cast<std::ptrdiff_t>(rows));
  }

 private:
  friend class CsvSplitter;
  friend Expected<CsvTable> split_csv(std::string_view text, const std::string& source);
  struct Row {
    std::size_t at;
    std::size_t size;
    std::size_t line;
  };

  std::string_view text_;
  std::unique_ptr<const std::string> converted_;  ///< What text_ is of, if it was not UTF-8.
  char delimiter_ = ',';
  std::vector<Row> rows_;
};

/// Splits text by RFC 4180, leniently: the delimiter is told from the first line, line ends may be
/// LF, CRLF or CR, a quote in the middle of a cell is a character like others.
///
/// Debian ships no header-only CSV reader that tells delimiters and decimal commas apart; the
/// hundred lines that it takes are ours.
/// @param text  It must outlive the table.
/// @errors LogError::malformed for a quote that is never closed.
[[nodiscard]] Expected<CsvTable> split_csv(std::string_view text, const std::string& source);

}  // namespace flyball::io
