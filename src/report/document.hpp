#pragma once

#include <algorithm>
#include <string>
#include <variant>
#include <vector>

#include <flyball/core/diagnostic.hpp>

/// What a report says, before it is decided whether a terminal or a page shows it: both render the
/// same document, so they cannot disagree.
namespace flyball::report {

enum class Tone { plain, good, caution, bad, quiet };

/// Names and their values.
struct Facts {
  struct Fact {
    std::string name;
    std::string value;
    Tone tone = Tone::plain;
  };
  std::vector<Fact> facts;

  void add(std::string name, std::string value, Tone tone = Tone::plain) {
    facts.push_back({std::move(name), std::move(value), tone});
  }
};

struct Table {
  struct Cell {
    Cell(std::string content, Tone how = Tone::plain) : text(std::move(content)), tone(how) {}
    Cell(const char* content) : text(content) {}
    std::string text;
    Tone tone = Tone::plain;
  };
  std::string caption;
  std::vector<std::string> header;
  std::vector<std::vector<Cell>> rows;
  std::vector<std::size_t> words{0};  ///< Columns of words; the others are numbers, right-aligned.
  std::size_t wide_column = npos;     ///< Column of words that takes the rest of the line.

  static constexpr std::size_t npos = static_cast<std::size_t>(-1);

  [[nodiscard]] bool is_words(std::size_t column) const {
    return column == wide_column || std::find(words.begin(), words.end(), column) != words.end();
  }
};

struct Paragraph {
  std::string text;
  Tone tone = Tone::plain;
};

struct Findings {
  std::vector<Diagnostic> diagnostics;
};

struct Code {
  std::string title;
  std::string text;
  std::string file;  ///< Its name in the report's folder.
};

using Block = std::variant<Facts, Table, Paragraph, Findings, Code>;

struct Section {
  std::string id;  ///< Of the page's anchor; pictures are placed by it.
  std::string title;
  std::vector<Block> blocks;
};

/// Whether the result can be used, in a line, with the reasons.
struct Verdict {
  Tone tone = Tone::good;
  std::string line;
  std::vector<std::string> reasons;
};

struct Document {
  std::string title;
  Verdict verdict;
  std::vector<Section> sections;
};

}  // namespace flyball::report
