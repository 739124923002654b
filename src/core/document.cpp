#include <flyball/core/document.hpp>

#include <algorithm>

#include "core/wording.hpp"

namespace flyball {

namespace {

int rank(Tone tone) {
  return tone == Tone::bad ? 2 : tone == Tone::caution ? 1 : 0;
}

}  // namespace

Value quantity(double number, std::string unit, int digits, bool shown) {
  Value value(text::number(number, digits));
  if (shown && !unit.empty()) {
    value.text += ' ' + unit;
  }
  value.number = number;
  value.unit = std::move(unit);
  return value;
}

bool Table::is_words(std::size_t column) const {
  return column == wide_column || std::find(words.begin(), words.end(), column) != words.end();
}

void Verdict::add(Tone tone_of_reason, std::string reason) {
  tone = worse(tone, tone_of_reason);
  reasons.push_back(std::move(reason));
}

Tone worse(Tone a, Tone b) {
  return rank(a) >= rank(b) ? a : b;
}

Tone tone_of(Severity severity) {
  return severity == Severity::info      ? Tone::quiet
         : severity == Severity::warning ? Tone::caution
                                         : Tone::bad;
}

Section diagnostics_section(std::vector<Diagnostic> diagnostics) {
  if (diagnostics.empty()) {
    return {
        "diagnostics", "What was noticed", {Paragraph{"Nothing out of the ordinary.", Tone::good}}};
  }
  std::stable_sort(
      diagnostics.begin(), diagnostics.end(),
      [](const Diagnostic& a, const Diagnostic& b) { return a.severity > b.severity; });
  Findings findings;
  for (Diagnostic& diagnostic : diagnostics) {
    const auto known = [&](const Diagnostic& other) {
      return other.code == diagnostic.code && other.message == diagnostic.message;
    };
    if (std::none_of(findings.diagnostics.begin(), findings.diagnostics.end(), known)) {
      findings.diagnostics.push_back(std::move(diagnostic));
    }
  }
  return {"diagnostics", "What was noticed", {std::move(findings)}};
}

}  // namespace flyball
