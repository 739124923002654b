#include <flyball/core/text.hpp>

#include <algorithm>
#include <iterator>
#include <vector>

#include "core/controls.hpp"
#include "core/wording.hpp"

namespace flyball {

namespace {

std::string lower_case(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return out;
}

bool continues(char c) {
  return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U;
}

/// Both ends of a word without blanks: those of a path say the most.
std::string ends_of(std::string_view word) {
  constexpr std::size_t longest = 240;
  constexpr std::size_t tail = 40;
  if (word.size() <= longest) {
    return std::string(word);
  }
  std::size_t from = word.size() - tail;
  while (from < word.size() && continues(word[from])) {
    ++from;
  }
  return cut(word, longest - tail).append(word.substr(from));
}

}  // namespace

std::string cut(std::string_view text, std::size_t most) {
  std::size_t at = 0;
  for (std::size_t count = 0; at < text.size(); ++count) {
    if (count == most) {
      return std::string(text.substr(0, at)) + "…";
    }
    ++at;
    while (at < text.size() && continues(text[at])) {
      ++at;
    }
  }
  return std::string(text);
}

std::string ascii(std::string_view text) {
  struct Spelling {
    std::string_view symbol;
    std::string_view ascii;
  };
  static constexpr Spelling spellings[] = {
      {"⁻¹", "^-1"},  {"⁻²", "^-2"},  {"²", "^2"},     {"³", "^3"},    {"¹", "^1"},
      {"⁺", "+"},     {"⁻", "-"},     {"ᵀ", "'"},      {"ᵖ", "^p"},    {"₀", "0"},
      {"₁", "1"},     {"₂", "2"},     {"₃", "3"},      {"·", "*"},     {"⋅", "*"},
      {"×", "x"},     {"±", "+-"},    {"−", "-"},      {"–", "-"},     {"—", "-"},
      {"…", "..."},   {"°", " deg"},  {"Ω", "Ohm"},    {"µ", "u"},     {"μ", "u"},
      {"σ", "sigma"}, {"Σ", "sum"},   {"π", "pi"},     {"β", "beta"},  {"ω", "omega"},
      {"ζ", "zeta"},  {"χ", "chi"},   {"θ", "theta"},  {"τ", "tau"},   {"λ", "lambda"},
      {"φ", "phi"},   {"Δ", "Delta"}, {"∞", "inf"},    {"√", "sqrt "}, {"∫", "int "},
      {"≤", "<="},    {"≥", ">="},    {"≠", "!="},     {"≈", "~"},     {"‖", "|"},
      {"“", "\""},    {"”", "\""},    {"‘", "'"},      {"’", "'"},     {"─", "-"},
      {"│", "|"},     {"✔", "ok"},    {"✖", "x"},      {"▲", "^"},     {"ŷ", "y^"},
      {"Ĝ", "G^"},    {"→", "->"},    {"\u0302", "^"}, {"é", "e"},     {"è", "e"},
      {"ä", "ae"},    {"ö", "oe"},    {"ü", "ue"},     {"ß", "ss"}};
  const std::string valid = text::valid_utf8(text);
  std::string out;
  for (std::size_t at = 0; at < valid.size();) {
    if (static_cast<unsigned char>(valid[at]) < 0x80) {
      out += valid[at++];
      continue;
    }
    const std::string_view rest = std::string_view(valid).substr(at);
    const auto* const found =
        std::find_if(std::begin(spellings), std::end(spellings),
                     [&](const Spelling& s) { return rest.starts_with(s.symbol); });
    const bool known = found != std::end(spellings);
    out += known ? found->ascii : "?";
    at += known ? found->symbol.size() : 1;
    while (!known && at < valid.size() && continues(valid[at])) {
      ++at;
    }
  }
  return out;
}

std::string printable(std::string_view text) {
  return text::without_steering(text::valid_utf8(text), true);
}

std::string shortened(std::string_view whole) {
  const std::string clean = printable(whole);
  const std::string_view message = clean;
  constexpr std::size_t longest_quotation = 80;
  constexpr std::size_t longest = 4000;
  std::string text;
  bool quoted = false;
  for (std::size_t at = 0; at < message.size();) {
    const char c = message[at];
    if (c == '"' || c == ' ' || c == '\n') {
      quoted = c == '"' ? !quoted : quoted;
      text += c;
      ++at;
      if (!quoted || c != '"') {
        continue;
      }
    }
    const std::size_t end =
        std::min(message.find_first_of(quoted ? "\"" : "\" \n", at), message.size());
    const std::string_view part = message.substr(at, end - at);
    text += quoted ? cut(part, longest_quotation) : ends_of(part);
    at = end;
  }
  return cut(text, longest);
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) {
    row[j] = j;
  }
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      const std::size_t substitution = diagonal + (a[i - 1] == b[j - 1] ? 0U : 1U);
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substitution});
      diagonal = above;
    }
  }
  return row[b.size()];
}

std::string nearest_name(std::string_view wanted, std::span<const std::string_view> names) {
  const std::string folded = lower_case(wanted);
  std::string_view best;
  std::size_t best_distance = std::max<std::size_t>(2, wanted.size() / 3) + 1;
  for (const std::string_view name : names) {
    // As many letters as one is longer, at least: long texts are not compared letter by letter.
    if (std::max(name.size(), wanted.size()) - std::min(name.size(), wanted.size()) >=
        best_distance) {
      continue;
    }
    const std::size_t distance = edit_distance(folded, lower_case(name));
    if (distance < best_distance && distance < name.size()) {
      best_distance = distance;
      best = name;
    }
  }
  return std::string(best);
}

}  // namespace flyball
