#include <flyball/identification/recording.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include "core/try.hpp"

namespace flyball::identification {
namespace {

constexpr std::array<std::pair<std::string_view, TestKind>, 8> names{{
    {"quasistatic-forward", TestKind::quasistatic_forward},
    {"quasistatic-reverse", TestKind::quasistatic_reverse},
    {"dynamic-forward", TestKind::dynamic_forward},
    {"dynamic-reverse", TestKind::dynamic_reverse},
    {"slow-forward", TestKind::quasistatic_forward},
    {"slow-backward", TestKind::quasistatic_reverse},
    {"fast-forward", TestKind::dynamic_forward},
    {"fast-backward", TestKind::dynamic_reverse},
}};

}  // namespace

std::string_view to_string(TestKind kind) {
  const auto* const entry = std::find_if(names.begin(), names.end(),
                                         [&](const auto& name) { return name.second == kind; });
  return entry != names.end() ? entry->first : "unknown";
}

Expected<TestKind> parse_test_kind(std::string_view name) {
  std::string plain(name);
  std::transform(plain.begin(), plain.end(), plain.begin(), [](unsigned char letter) {
    return letter == '_' || letter == ' ' ? '-' : static_cast<char>(std::tolower(letter));
  });
  for (const auto& [known, kind] : names) {
    if (plain == known) {
      return kind;
    }
  }
  return refusal(ArgumentError::unknown_name, "parse_test_kind", "the test")
      .got("'" + std::string(name) + "'")
      .expected("quasistatic-forward, quasistatic-reverse, dynamic-forward or dynamic-reverse");
}

}  // namespace flyball::identification
