#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/controls.hpp"
#include "export/text.hpp"

namespace flyball::exports {

std::string literal(double value, int digits) {
  std::string text = digits > 0 ? fmt::format("{:.{}g}", value, digits) : fmt::format("{}", value);
  if (text.find_first_of(".en") == std::string::npos) {
    text += ".0";
  }
  return text;
}

std::string rows_of(const Eigen::MatrixXd& M) {
  std::vector<std::string> lines;
  for (Eigen::Index i = 0; i < M.rows(); ++i) {
    std::vector<std::string> words;
    for (Eigen::Index j = 0; j < M.cols(); ++j) {
      words.push_back(literal(M(i, j)));
    }
    lines.push_back(fmt::format("{{{}}}", fmt::join(words, ", ")));
  }
  return fmt::format("{{{}}}", fmt::join(lines, ", "));
}

std::string constant_line(std::string_view name, double value, std::string_view comment) {
  return fmt::format("inline constexpr double {} = {};  // {}\n", name,
                     std::isinf(value) ? "std::numeric_limits<double>::infinity()" : literal(value),
                     comment);
}

bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

std::string capitalized(mechanisms::MechanismKind kind) {
  std::string name;
  bool first = true;
  for (const char c : to_string(kind)) {
    if (c != ' ') {
      name += first ? static_cast<char>(c - 'a' + 'A') : c;
    }
    first = c == ' ';
  }
  return name;
}

std::string comment_text(std::string_view text) {
  std::string line(text);
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::replace(line.begin(), line.end(), '\\', '/');  // at the end of a line it would continue it
  return text::without_steering(std::move(line), false);
}

std::string_view name_of(Language language) {
  return language == Language::cpp ? "C++" : language == Language::java ? "Java" : "Python";
}

std::string constants_file(std::string_view library, Language language) {
  const char* word = language == Language::cpp    ? "cpp"
                     : language == Language::java ? "java"
                                                  : "python";
  return fmt::format("constants/{}_{}.txt", library, word);
}

std::string_view comment_mark(Language language) {
  return language == Language::python ? "#" : "//";
}

std::string comments(std::string text, Language language) {
  if (language != Language::python) {
    return text;
  }
  std::string written;
  std::string_view rest = text;
  while (!rest.empty()) {
    const std::string_view line = rest.substr(0, std::min(rest.find('\n'), rest.size() - 1) + 1);
    written += "#";
    written += line.substr(2);
    rest.remove_prefix(line.size());
  }
  return written;
}

std::string assignments(const std::vector<Constant>& constants, Language language,
                        std::string_view before, std::string_view assign, std::string_view end) {
  std::size_t width = 0;
  for (const Constant& constant : constants) {
    width = std::max(width, constant.name.size() + literal(constant.value, constant_digits).size());
  }
  std::string text;
  for (const Constant& constant : constants) {
    const std::string value = literal(constant.value, constant_digits);
    text += fmt::format("{}{}{}{}{}{:{}}  {} {}\n", before, constant.name, assign, value, end, "",
                        width - constant.name.size() - value.size(), comment_mark(language),
                        constant.comment);
  }
  return text;
}

std::string scope(const std::string& name, const std::vector<Constant>& constants,
                  Language language) {
  switch (language) {
    case Language::cpp:
      return fmt::format("namespace {0} {{\n{1}}}  // namespace {0}\n", name,
                         assignments(constants, language, "inline constexpr double ", " = ", ";"));
    case Language::java:
      return fmt::format(
          "public final class {0} {{\n{1}\n  private {0}() {{}}\n}}\n", name,
          assignments(constants, language, "  public static final double ", " = ", ";"));
    case Language::python:
      break;
  }
  return fmt::format("class {}:\n{}", name, assignments(constants, language, "    ", " = ", ""));
}

}  // namespace flyball::exports
