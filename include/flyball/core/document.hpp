#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <flyball/core/diagnostic.hpp>

/// What an answer says, before it is decided whether a terminal or a page shows it: all render the
/// same document, so they cannot disagree.
namespace flyball {

/// How good what is said is.
enum class Tone { plain, good, caution, bad, quiet };

/// What stands in a cell or beside a name: words, or a number with its unit.
struct Value {
  std::string text{};
  Tone tone = Tone::plain;
  std::optional<double> number{};  ///< What `text` shows, if it is one number.
  std::string unit{};              ///< Of the number; in a table the header may say it instead.

  Value() = default;
  Value(std::string words, Tone how = Tone::plain) : text(std::move(words)), tone(how) {}
  Value(const char* words, Tone how = Tone::plain) : text(words), tone(how) {}
};

/// A number with `digits` significant digits, and its unit. @param shown  Whether the unit is said
/// beside the number, too.
[[nodiscard]] Value quantity(double number, std::string unit, int digits = 4, bool shown = true);

/// Names and their values.
struct Facts {
  /// One name and its value.
  struct Fact {
    std::string name;
    Value value;
  };
  std::vector<Fact> facts{};

  void add(std::string name, Value value) { facts.push_back({std::move(name), std::move(value)}); }
  void add(std::string name, std::string words, Tone tone) {
    add(std::move(name), Value(std::move(words), tone));
  }
};

/// Rows under a header.
struct Table {
  static constexpr std::size_t npos = static_cast<std::size_t>(-1);

  std::string caption{};
  std::vector<std::string> header{};
  std::vector<std::vector<Value>> rows{};
  std::vector<std::size_t> words{0};  ///< Columns of words; the others are numbers, right-aligned.
  std::size_t wide_column = npos;     ///< Column of words that takes the rest of the line.

  /// Whether a column is of words, left-aligned.
  [[nodiscard]] bool is_words(std::size_t column) const;
};

/// Sentences.
struct Paragraph {
  std::string text{};
  Tone tone = Tone::plain;
};

/// Diagnostics, each with its code.
struct Findings {
  std::vector<Diagnostic> diagnostics{};
};

/// Lines to copy.
struct Code {
  std::string title{};
  std::string text{};
  std::string file{};  ///< Its name in the report's folder.
};

/// What to do, one thing after the other.
struct Steps {
  std::vector<std::string> steps{};
};

/// What a section is made of.
using Block = std::variant<Facts, Table, Paragraph, Findings, Code, Steps>;

/// A part of an answer under its title.
struct Section {
  std::string id{};  ///< Of the page's anchor; pictures are placed by it.
  std::string title{};
  std::vector<Block> blocks{};
};

/// Whether the result can be used, in a line, with the reasons.
struct Verdict {
  Tone tone = Tone::good;
  std::string line{};
  std::vector<std::string> reasons{};

  /// A reason not to be content: the tone is this one, if it is not worse already.
  void add(Tone tone_of_reason, std::string reason);
};

/// What an answer says, whole.
struct Document {
  std::string title{};
  Verdict verdict{};
  std::vector<Section> sections{};
  Facts origins{};  ///< What it was made from: the log, the seed.
};

/// The worse of two tones: bad, caution, then the others.
[[nodiscard]] Tone worse(Tone a, Tone b);

/// How an answer shows it: information quietly, a warning as a caution, an error as bad.
[[nodiscard]] Tone tone_of(Severity severity);

/// "What was noticed": the most severe first, in the order found among equals, equal sentences
/// once.
[[nodiscard]] Section diagnostics_section(std::vector<Diagnostic> diagnostics);

}  // namespace flyball
