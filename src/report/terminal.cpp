#include <flyball/report/terminal.hpp>

#include <algorithm>

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

std::string render(const Code& code, const TerminalStyle& style) {
  std::string out = std::string(indent) + bold(code.title, style) + "\n";
  for (const std::string_view line : text::split(code.text, "\n")) {
    out += line.empty() ? "\n" : std::string(indent) + printable(line) + "\n";
  }
  return out;
}

std::string render(const Table& table, const TerminalStyle& style) {
  const std::size_t columns = table.header.size();
  std::vector<std::size_t> width(columns, 0);
  for (std::size_t c = 0; c < columns; ++c) {
    width[c] = display_width(table.header[c]);
    for (const auto& row : table.rows) {
      width[c] = std::max(width[c], c < row.size() ? display_width(row[c].text) : 0);
    }
  }
  std::size_t total = indent.size() + gap * (columns - std::min<std::size_t>(columns, 1));
  for (const std::size_t w : width) {
    total += w;
  }
  if (table.wide_column < columns && total > style.width) {
    std::size_t& wide = width[table.wide_column];
    wide = std::max<std::size_t>(12, wide - std::min(wide, total - style.width));
  }

  const auto line = [&](const std::vector<std::vector<std::string>>& cells, std::size_t row,
                        const auto& code_of) {
    std::string out(indent);
    for (std::size_t c = 0; c < columns; ++c) {
      const std::string text = c < cells.size() && row < cells[c].size() ? cells[c][row] : "";
      const std::string pad = spaces(width[c] - std::min(width[c], display_width(text)));
      const bool words = table.is_words(c);
      const std::string painted = paint(text, code_of(c), style);
      out += c == 0 ? "" : spaces(gap);
      out += words ? painted + pad : pad + painted;
    }
    out.erase(out.find_last_not_of(' ') + 1);
    return out + "\n";
  };

  std::string out;
  if (!table.caption.empty()) {
    out += beside("", 0, table.caption, Tone::plain, style);
  }
  std::vector<std::vector<std::string>> head;
  for (const std::string& name : table.header) {
    head.push_back({name});
  }
  out += line(head, 0, [](std::size_t) { return std::string_view("\x1b[1m"); });
  std::string rule(indent);
  for (std::size_t c = 0; c < columns; ++c) {
    rule += c == 0 ? "" : spaces(gap);
    for (std::size_t i = 0; i < width[c]; ++i) {
      rule += "─";
    }
  }
  out += paint(rule, escape_code(Tone::quiet), style) + "\n";
  for (const auto& row : table.rows) {
    std::vector<std::vector<std::string>> cells;
    std::size_t height = 1;
    for (std::size_t c = 0; c < row.size() && c < columns; ++c) {
      const std::string text = printable(row[c].text);
      cells.push_back(c == table.wide_column ? wrap(text, width[c])
                                             : std::vector<std::string>{text});
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

}  // namespace

std::string to_terminal(const Document& document, const TerminalStyle& style,
                        std::string_view report_folder) {
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
