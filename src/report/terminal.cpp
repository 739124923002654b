#include <flyball/report/terminal.hpp>

#include <algorithm>

#include <flyball/core/text.hpp>

#include "core/wording.hpp"
#include "report/format.hpp"

namespace flyball::report {

namespace {

using text::printable;

constexpr std::string_view indent = "  ";
constexpr std::size_t gap = 2;  ///< Columns between two cells.

std::string_view escape_code(Tone tone) {
  switch (tone) {
    case Tone::good:
      return "\x1b[32m";
    case Tone::caution:
      return "\x1b[33m";
    case Tone::bad:
      return "\x1b[1;31m";
    case Tone::quiet:
      return "\x1b[2m";
    case Tone::plain:
      break;
  }
  return {};
}

std::string paint(std::string_view text, std::string_view code, const TerminalStyle& style) {
  const std::string clean = printable(text);
  if (!style.color || code.empty()) {
    return clean;
  }
  return std::string(code) + clean + "\x1b[0m";
}

std::string bold(std::string_view text, const TerminalStyle& style) {
  return paint(text, "\x1b[1m", style);
}

std::string spaces(std::size_t n) {
  return std::string(n, ' ');
}

/// Lines of a wrapped text behind a label: the first beside it, the rest below the text.
std::string beside(std::string_view label, std::size_t label_width, std::string_view text,
                   Tone tone, const TerminalStyle& style) {
  const std::size_t left = indent.size() + label_width;
  const std::size_t room = std::max<std::size_t>(20, style.width - std::min(style.width, left));
  std::string out;
  bool first = true;
  for (const std::string& line : wrap(printable(text), room)) {
    if (first) {
      out += std::string(indent) + paint(label, escape_code(Tone::quiet), style) +
             spaces(label_width - display_width(label));
    } else {
      out += spaces(left);
    }
    out += paint(line, escape_code(tone), style) + "\n";
    first = false;
  }
  return out;
}

std::string render(const Facts& facts, const TerminalStyle& style) {
  std::size_t width = 0;
  for (const Facts::Fact& fact : facts.facts) {
    width = std::max(width, display_width(fact.name));
  }
  std::string out;
  for (const Facts::Fact& fact : facts.facts) {
    out += beside(fact.name, width + gap, fact.value.text, fact.value.tone, style);
  }
  return out;
}

std::string render(const Paragraph& paragraph, const TerminalStyle& style) {
  return beside("", 0, paragraph.text, paragraph.tone, style);
}

std::string render(const Findings& findings, const TerminalStyle& style) {
  std::string out;
  for (const Diagnostic& diagnostic : findings.diagnostics) {
    const std::string label(to_string(diagnostic.severity));
    std::string lines =
        beside(label, 9, diagnostic.message + " [" + diagnostic.code + "]", Tone::plain, style);
    if (style.color) {
      // The word carries the colour, the sentence stays readable.
      const std::string quiet = paint(label, escape_code(Tone::quiet), style);
      const std::size_t at = lines.find(quiet);
      if (at != std::string::npos) {
        lines.replace(at, quiet.size(),
                      paint(label, escape_code(tone_of(diagnostic.severity)), style));
      }
    }
    out += lines;
  }
  return out;
}

std::string render(const Steps& steps, const TerminalStyle& style) {
  std::string out;
  for (std::size_t i = 0; i < steps.steps.size(); ++i) {
    out += beside(std::to_string(i + 1) + ".", 3, steps.steps[i], Tone::plain, style);
  }
  return out;
}

std::string render(const Code& code, const TerminalStyle& style) {
  std::string out = std::string(indent) + bold(code.title, style) + "\n";
  for (const std::string_view line : text::split(code.text, "\n")) {
    out += line.empty() ? "\n" : std::string(indent) + printable(line) + "\n";
  }
  return out;
}

/// Lines of cells below each other, one group of columns.
std::string render_columns(const Table& table, const std::vector<std::size_t>& columns,
                           const std::vector<std::size_t>& width, const TerminalStyle& style) {
  const auto line = [&](const std::vector<std::vector<std::string>>& cells, std::size_t row,
                        const auto& code_of) {
    std::string out(indent);
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const std::size_t c = columns[k];
      const std::string text = row < cells[k].size() ? cells[k][row] : "";
      const std::string pad = spaces(width[c] - std::min(width[c], display_width(text)));
      const std::string painted = paint(text, code_of(c), style);
      out += k == 0 ? "" : spaces(gap);
      out += table.is_words(c) ? painted + pad : pad + painted;
    }
    out.erase(out.find_last_not_of(' ') + 1);
    return out + "\n";
  };
  std::vector<std::vector<std::string>> head;
  std::size_t head_height = 1;
  for (const std::size_t c : columns) {
    head.push_back(wrap(table.header[c], width[c]));
    head_height = std::max(head_height, head.back().size());
  }
  std::string out;
  for (std::size_t i = 0; i < head_height; ++i) {
    out += line(head, i, [](std::size_t) { return std::string_view("\x1b[1m"); });
  }
  std::string rule(indent);
  for (std::size_t k = 0; k < columns.size(); ++k) {
    rule += k == 0 ? "" : spaces(gap);
    for (std::size_t i = 0; i < width[columns[k]]; ++i) {
      rule += style.ascii ? "-" : "─";
    }
  }
  out += paint(rule, escape_code(Tone::quiet), style) + "\n";
  for (const auto& row : table.rows) {
    std::vector<std::vector<std::string>> cells;
    std::size_t height = 1;
    for (const std::size_t c : columns) {
      const std::string text = c < row.size() ? printable(row[c].text) : "";
      cells.push_back(wrap(text, width[c]));
      height = std::max(height, cells.back().size());
    }
    for (std::size_t i = 0; i < height; ++i) {
      out += line(cells, i, [&](std::size_t c) {
        return c < row.size() ? escape_code(row[c].tone) : std::string_view();
      });
    }
  }
  return out;
}

/// How wide a text is at least when it is folded: a word, such as a path, is not cut.
std::size_t longest_word(std::string_view words) {
  std::size_t longest = 0;
  for (const std::string_view word : text::split(words, " ")) {
    longest = std::max(longest, display_width(word));
  }
  return longest;
}

std::string render(const Table& table, const TerminalStyle& style) {
  const std::size_t columns = table.header.size();
  const std::size_t room = std::max<std::size_t>(20, style.width) - indent.size();
  constexpr std::size_t narrow = 12;
  std::vector<std::size_t> width(columns, 0);
  std::vector<std::size_t> narrowest(columns, narrow);
  for (std::size_t c = 0; c < columns; ++c) {
    const auto hold = [&](std::string_view text) {
      width[c] = std::max(width[c], display_width(text));
      narrowest[c] = std::max(narrowest[c], std::min(longest_word(text), room));
    };
    hold(table.header[c]);
    for (const auto& row : table.rows) {
      hold(c < row.size() ? std::string_view(row[c].text) : std::string_view());
    }
  }
  std::size_t total = gap * (columns - std::min<std::size_t>(columns, 1));
  for (const std::size_t w : width) {
    total += w;
  }
  if (table.wide_column < columns && total > room) {
    std::size_t& wide = width[table.wide_column];
    const std::size_t least = std::min(wide, narrowest[table.wide_column]);
    const std::size_t cut = std::min(wide - least, total - room);
    wide -= cut;
    total -= cut;
  }
  std::string out;
  if (!table.caption.empty()) {
    out += beside("", 0, table.caption, Tone::plain, style);
  }
  if (total > room) {
    // Words that fill half of the line are folded; what is still too wide follows below.
    for (std::size_t c = 0; c < columns; ++c) {
      width[c] =
          table.is_words(c) ? std::min(width[c], std::max(narrowest[c], room / 2)) : width[c];
    }
  }
  std::vector<std::size_t> group;
  std::size_t taken = 0;
  for (std::size_t c = 0; c < columns; ++c) {
    if (group.size() > 1 && taken + gap + width[c] > room) {
      out += render_columns(table, group, width, style) + "\n";
      group = {0};
      taken = width[0];
    }
    taken += (group.empty() ? 0 : gap) + width[c];
    group.push_back(c);
  }
  return group.empty() ? out : out + render_columns(table, group, width, style);
}

void change(std::string& text) {
  text = ascii(text);
}
void change(Value& value) {
  change(value.text);
}
void change(Facts& facts) {
  for (Facts::Fact& fact : facts.facts) {
    change(fact.name);
    change(fact.value);
  }
}
void change(Table& table) {
  change(table.caption);
  for (std::string& name : table.header) {
    change(name);
  }
  for (std::vector<Value>& row : table.rows) {
    for (Value& value : row) {
      change(value);
    }
  }
}
void change(Paragraph& paragraph) {
  change(paragraph.text);
}
void change(Findings& findings) {
  for (Diagnostic& diagnostic : findings.diagnostics) {
    change(diagnostic.message);
  }
}
void change(Code& code) {
  change(code.title);
  change(code.text);
}
void change(Steps& steps) {
  for (std::string& step : steps.steps) {
    change(step);
  }
}

/// Every text of a document in ASCII.
Document in_ascii(Document document) {
  change(document.title);
  change(document.verdict.line);
  for (std::string& reason : document.verdict.reasons) {
    change(reason);
  }
  for (Section& section : document.sections) {
    change(section.title);
    for (Block& block : section.blocks) {
      std::visit([](auto& b) { change(b); }, block);
    }
  }
  return document;
}

}  // namespace

std::string to_terminal(const Document& given, const TerminalStyle& style,
                        std::string_view report_folder) {
  const Document document = style.ascii ? in_ascii(given) : given;
  std::string out;
  const auto begin_line = [&] { out += out.empty() ? "" : "\n"; };
  if (!document.title.empty()) {
    out += bold(document.title, style) + "\n";
  }
  for (const std::string& line : wrap(printable(document.verdict.line), style.width)) {
    if (!line.empty()) {
      out += paint(line, escape_code(document.verdict.tone), style) + "\n";
    }
  }
  for (const std::string& reason : document.verdict.reasons) {
    out += beside("-", 2, reason, Tone::plain, style);
  }
  for (const Section& section : document.sections) {
    if (!section.title.empty()) {
      begin_line();
      out += bold(section.title, style) + "\n";
    }
    bool first = !section.title.empty();
    for (const Block& block : section.blocks) {
      if (!first) {
        begin_line();
      }
      first = false;
      out += std::visit([&](const auto& b) { return render(b, style); }, block);
    }
  }
  if (!report_folder.empty()) {
    out += "\n" + bold("Report", style) + "  " + printable(report_folder) + "/index.html\n";
  }
  return out;
}

}  // namespace flyball::report
