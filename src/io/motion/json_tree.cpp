#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <tuple>

#include <fmt/format.h>

#include <flyball/core/text.hpp>
#include <flyball/io/json_text.hpp>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "io/motion/json_tree.hpp"

namespace flyball {

ErrorInfo error_info(MotionFileError code) {
  static constexpr flyball::detail::ErrorRow rows[] = {
      {"not_json", "the file is not JSON", ErrorKind::misuse},
      {"wrong_kind", "the file is of something else", ErrorKind::misuse},
      {"wrong_field", "a field is missing, or cannot be", ErrorKind::misuse},
      {"too_large", "the file is larger than a file of its kind can be", ErrorKind::misuse},
  };
  return flyball::detail::info_of(code, "motion_file", rows);
}

Place JsonOrigin::place() const {
  return node_ == nullptr ? Place{} : place_of(tree_->text, node_->begin);
}

std::vector<Place> places_of(std::span<const JsonOrigin> origins) {
  std::vector<Place> places;
  const io::JsonTree* tree = nullptr;
  std::size_t done = 0;
  Place place;
  for (const JsonOrigin& origin : origins) {
    if (origin.node() == nullptr) {
      places.emplace_back();
      continue;
    }
    const std::size_t begin = origin.node()->begin;
    if (origin.tree() != tree || begin < done) {
      tree = origin.tree();
      done = 0;
      place = {};
    }
    for (; done < begin; ++done) {
      const char c = tree->text[done];
      if (c == '\n') {
        ++place.line;
        place.column = 1;
      } else if ((static_cast<unsigned char>(c) & 0xC0U) != 0x80U) {
        ++place.column;
      }
    }
    places.push_back(place);
  }
  return places;
}

ExpectedAll<std::vector<std::string>> json_keys(std::string_view text, const std::string& source) {
  FLYBALL_TRY(const auto tree, io::parse_json_tree(text, source));
  std::vector<std::string> keys;
  for (const io::JsonNode& child : tree->root.children) {
    if (tree->root.kind == io::JsonKind::object) {
      keys.push_back(child.key);
    }
  }
  return keys;
}

}  // namespace flyball

namespace flyball::io {

std::string_view to_string(JsonKind kind) {
  constexpr std::string_view names[] = {"null",   "true or false", "a number",
                                        "a text", "a list",        "an object"};
  return names[static_cast<std::size_t>(kind)];
}

const JsonNode* JsonNode::find(std::string_view name, std::size_t* hint) const {
  const std::size_t n = children.size();
  const std::size_t from = hint != nullptr && *hint < n ? *hint : 0;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = from + k < n ? from + k : from + k - n;
    if (children[i].key == name) {
      if (hint != nullptr) {
        *hint = i + 1;
      }
      return &children[i];
    }
  }
  return nullptr;
}

namespace {

void append_utf8(std::string& text, std::uint32_t code) {
  const auto tail = [&](unsigned shift) {
    text += static_cast<char>(0x80U | ((code >> shift) & 0x3FU));
  };
  if (code < 0x80U) {
    text += static_cast<char>(code);
  } else if (code < 0x800U) {
    text += static_cast<char>(0xC0U | (code >> 6U));
    tail(0);
  } else if (code < 0x10000U) {
    text += static_cast<char>(0xE0U | (code >> 12U));
    tail(6);
    tail(0);
  } else {
    text += static_cast<char>(0xF0U | (code >> 18U));
    tail(12);
    tail(6);
    tail(0);
  }
}

std::uint32_t hex4(std::string_view digits) {
  std::uint32_t code = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), code, 16);
  return code;
}

/// @param quoted  Checked: with its quotes, whole escapes.
std::string unescaped(std::string_view quoted) {
  const std::string_view inside = quoted.substr(1, quoted.size() - 2);
  std::string text;
  text.reserve(inside.size());
  for (std::size_t i = 0; i < inside.size(); ++i) {
    if (inside[i] != '\\') {
      text += inside[i];
      continue;
    }
    const char c = inside[++i];
    constexpr std::string_view letters = "bfnrt";
    constexpr std::string_view meant = "\b\f\n\r\t";
    if (const std::size_t found = letters.find(c); found != std::string_view::npos) {
      text += meant[found];
    } else if (c != 'u') {
      text += c;
    } else {
      std::uint32_t code = hex4(inside.substr(i + 1, 4));
      i += 4;
      const bool high = code >= 0xD800U && code < 0xDC00U;
      if (high && inside.substr(i + 1, 2) == "\\u") {
        const std::uint32_t low = hex4(inside.substr(i + 3, 4));
        if (low >= 0xDC00U && low < 0xE000U) {
          code = 0x10000U + ((code - 0xD800U) << 10U) + (low - 0xDC00U);
          i += 6;
        }
      }
      append_utf8(text, code >= 0xD800U && code < 0xE000U ? 0xFFFDU : code);
    }
  }
  return text;
}

/// What a reading of a text finds wrong.
struct Fault {
  std::size_t at = 0;
  MotionFileError code = MotionFileError::not_json;
  std::string subject{};
  std::string got{};
  std::string expected{};
  std::string hint{};
};

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  bool run(JsonNode& root) {
    at_ = text_.starts_with("\xEF\xBB\xBF") ? 3 : 0;
    skip();
    if (at_ == text_.size()) {
      return fail("the text", "empty", "JSON", "");
    }
    if (!value(root, 0)) {
      return false;
    }
    skip();
    if (at_ != text_.size()) {
      return fail("what follows the end", near(), "nothing", "two files may have been joined");
    }
    return true;
  }
  [[nodiscard]] const Fault& fault() const { return fault_; }

 private:
  bool fail(std::string subject, std::string got, std::string expected, std::string hint,
            MotionFileError code = MotionFileError::not_json) {
    fault_ = {std::min(at_, text_.size()), code,           std::move(subject), std::move(got),
              std::move(expected),         std::move(hint)};
    return false;
  }
  [[nodiscard]] std::string near() const {
    return at_ >= text_.size() ? std::string("the end of the file")
                               : fmt::format("\"{}\"", cut(printable(text_.substr(at_, 24)), 12));
  }
  bool unexpected(std::string expected) {
    if (at_ >= text_.size()) {
      return fail("the text", "cut off", std::move(expected), "copy the file again");
    }
    const std::string_view rest = text_.substr(at_, 9);
    const bool no_number = rest.starts_with("NaN") || rest.starts_with("nan") ||
                           rest.starts_with("Infinity") || rest.starts_with("-Infinity") ||
                           rest.starts_with("inf") || rest.starts_with("-inf");
    return no_number ? fail("a number", near(), "a finite number",
                            "the tool that wrote it divided by zero: generate the path again")
                     : fail("the text", near(), std::move(expected), "");
  }
  void skip() {
    while (at_ < text_.size() &&
           (text_[at_] == ' ' || text_[at_] == '\n' || text_[at_] == '\t' || text_[at_] == '\r')) {
      ++at_;
    }
  }
  [[nodiscard]] bool is(char c) const { return at_ < text_.size() && text_[at_] == c; }

  bool value(JsonNode& node, std::size_t depth) {
    if (++values_ > most_json_values) {
      return fail("the file", fmt::format("of more than {} values", most_json_values),
                  "a file that a planning tool wrote", "", MotionFileError::too_large);
    }
    node.begin = at_;
    bool good = false;
    if (is('{') || is('[')) {
      if (depth >= most_json_depth) {
        return fail("the text", fmt::format("of more than {} brackets inside each other", depth),
                    "a file that a planning tool wrote", "", MotionFileError::too_large);
      }
      good = is('{') ? object(node, depth) : array(node, depth);
    } else if (is('"')) {
      node.kind = JsonKind::string;
      good = string();
    } else if (is('-') || (at_ < text_.size() && text_[at_] >= '0' && text_[at_] <= '9')) {
      good = number(node);
    } else {
      good = word(node);
    }
    node.end = at_;
    return good;
  }

  bool word(JsonNode& node) {
    for (const auto& [text, kind, number] :
         {std::tuple(std::string_view("null"), JsonKind::null, 0.0),
          {std::string_view("true"), JsonKind::boolean, 1.0},
          {std::string_view("false"), JsonKind::boolean, 0.0}}) {
      if (text_.substr(at_, text.size()) == text) {
        at_ += text.size();
        node.kind = kind;
        node.number = number;
        return true;
      }
    }
    return unexpected("a value");
  }

  std::size_t digits() {
    const std::size_t from = at_;
    while (at_ < text_.size() && text_[at_] >= '0' && text_[at_] <= '9') {
      ++at_;
    }
    return at_ - from;
  }

  bool number(JsonNode& node) {
    const std::size_t from = at_;
    at_ += is('-') ? 1U : 0U;
    if (is('0')) {
      ++at_;
    } else if (digits() == 0) {
      const std::size_t here = at_;
      at_ = from;
      if (text_.substr(here, 3) == "Inf" || text_.substr(here, 3) == "inf") {
        return unexpected("a number");
      }
      at_ = here;
      return unexpected("a digit");
    }
    if (is('.')) {
      ++at_;
      if (digits() == 0) {
        return unexpected("a digit");
      }
    }
    if (is('e') || is('E')) {
      ++at_;
      at_ += is('+') || is('-') ? 1U : 0U;
      if (digits() == 0) {
        return unexpected("a digit");
      }
    }
    node.kind = JsonKind::number;
    const std::string_view written = text_.substr(from, at_ - from);
    const auto [end, problem] =
        std::from_chars(written.data(), written.data() + written.size(), node.number);
    if (problem == std::errc::result_out_of_range) {
      node.number = std::strtod(std::string(written).c_str(), nullptr);
      if (std::isfinite(node.number)) {  // smaller than any double but zero
        return true;
      }
      at_ = from;
      return fail("a number", fmt::format("{}, larger than a double holds", cut(written, 24)),
                  "a finite number", "");
    }
    return true;
  }

  bool string() {
    ++at_;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '"') {
        ++at_;
        return true;
      }
      if (static_cast<unsigned char>(c) < 0x20U) {
        return fail("a text", "broken by a line end or a control character", "a closing quote", "");
      }
      if (c == '\\') {
        ++at_;
        constexpr std::string_view letters = "\"\\/bfnrtu";
        if (at_ >= text_.size() || letters.find(text_[at_]) == std::string_view::npos) {
          return unexpected("one of \" \\ / b f n r t u after the backslash");
        }
        if (text_[at_] == 'u') {
          for (int i = 0; i < 4; ++i) {
            ++at_;
            const bool hex =
                at_ < text_.size() && std::string_view("0123456789abcdefABCDEF").find(text_[at_]) !=
                                          std::string_view::npos;
            if (!hex) {
              return unexpected("four hexadecimal digits");
            }
          }
        }
      }
      ++at_;
    }
    return unexpected("a closing quote");
  }

  bool array(JsonNode& node, std::size_t depth) {
    node.kind = JsonKind::array;
    ++at_;
    skip();
    if (is(']')) {
      ++at_;
      return true;
    }
    for (;;) {
      if (!value(node.children.emplace_back(), depth + 1)) {
        return false;
      }
      skip();
      if (is(']')) {
        ++at_;
        return true;
      }
      if (!is(',')) {
        return unexpected("a comma or ]");
      }
      ++at_;
      skip();
    }
  }

  bool object(JsonNode& node, std::size_t depth) {
    node.kind = JsonKind::object;
    ++at_;
    skip();
    if (is('}')) {
      ++at_;
      return true;
    }
    for (;;) {
      if (!is('"')) {
        return unexpected("a key in quotes");
      }
      JsonNode& member = node.children.emplace_back();
      member.key_begin = at_;
      if (!string()) {
        return false;
      }
      member.key_end = at_;
      member.key = unescaped(text_.substr(member.key_begin, member.key_end - member.key_begin));
      skip();
      if (!is(':')) {
        return unexpected("a colon");
      }
      ++at_;
      skip();
      if (!value(member, depth + 1)) {
        return false;
      }
      skip();
      if (is('}')) {
        ++at_;
        return no_key_twice(node);
      }
      if (!is(',')) {
        return unexpected("a comma or }");
      }
      ++at_;
      skip();
    }
  }

  bool no_key_twice(const JsonNode& node) {
    std::vector<const JsonNode*> sorted;
    sorted.reserve(node.children.size());
    for (const JsonNode& child : node.children) {
      sorted.push_back(&child);
    }
    std::sort(sorted.begin(), sorted.end(), [](const JsonNode* a, const JsonNode* b) {
      return a->key != b->key ? a->key < b->key : a->key_begin < b->key_begin;
    });
    const auto twice =
        std::adjacent_find(sorted.begin(), sorted.end(),
                           [](const JsonNode* a, const JsonNode* b) { return a->key == b->key; });
    if (twice == sorted.end()) {
      return true;
    }
    const JsonNode& again = **std::next(twice);
    at_ = again.key_begin;
    return fail(fmt::format("the key \"{}\"", cut(printable(again.key), 40)), "there twice",
                "once in its object", "");
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t values_ = 0;
  Fault fault_;
};

/// A character's first byte at or before an offset.
std::size_t whole_character(std::string_view line, std::size_t at) {
  while (at > 0 && at < line.size() && (static_cast<unsigned char>(line[at]) & 0xC0U) == 0x80U) {
    --at;
  }
  return at;
}

}  // namespace

QuotedError quoted_at(std::string_view text, std::size_t offset, std::size_t length,
                      const std::string& source, Error error) {
  offset = std::min(offset, text.size());
  const Place place = place_of(text, offset);
  const std::size_t line_begin =
      offset == 0 ? 0 : text.rfind('\n', offset - 1) + 1;  // npos + 1 is 0
  const std::size_t line_end = std::min(text.find('\n', offset), text.size());
  const std::string_view line = text.substr(line_begin, line_end - line_begin);
  // Files of one line are common: only what is near is shown.
  constexpr std::size_t before = 40;
  constexpr std::size_t after = 32;
  const std::size_t at = offset - line_begin;
  const std::size_t from = at > before ? whole_character(line, at - before) : 0;
  const std::size_t to = at + after < line.size() ? whole_character(line, at + after) : line.size();
  const auto shown = [](std::string_view part) {
    std::string words = printable(part);
    std::replace(words.begin(), words.end(), '\t', ' ');
    return words;
  };
  const std::string left = (from > 0 ? "…" : "") + shown(line.substr(from, at - from));
  const std::string right = shown(line.substr(at, to - at)) + (to < line.size() ? "…" : "");
  const auto width = static_cast<std::size_t>(std::count_if(left.begin(), left.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
  const std::size_t shown_length = std::clamp<std::size_t>(std::min(length, to - at), 1, after);
  QuotedError quoted{
      std::move(error).in(fmt::format("{}:{}:{}", source, place.line, place.column)), {}, place};
  if (!line.empty()) {
    quoted.excerpt = fmt::format("{:>5} | {}{}\n{:>5} | {}{}", place.line, left, right, "",
                                 std::string(width, ' '), std::string(shown_length, '^'));
  }
  return quoted;
}

std::string outline(const JsonNode& root) {
  if (root.kind != JsonKind::object) {
    return std::string(to_string(root.kind));
  }
  std::string keys;
  for (std::size_t i = 0; i < std::min<std::size_t>(root.children.size(), 4); ++i) {
    keys += (i == 0 ? "" : ", ") + cut(printable(root.children[i].key), 20);
  }
  return keys.empty() ? "an empty object" : "an object of " + keys;
}

std::string JsonTree::string(const JsonNode& node) const {
  return unescaped(slice(node));
}

ExpectedAll<std::shared_ptr<const JsonTree>> parse_json_tree(std::string_view text,
                                                             const std::string& source) {
  if (text.size() > most_json_bytes) {
    return tl::unexpected(
        Errors(Error(MotionFileError::too_large)
                   .in(source)
                   .about("the file")
                   .got(fmt::format("{} bytes long", text.size()))
                   .expected(fmt::format("at most {} MiB", most_json_bytes >> 20U))));
  }
  auto tree = std::make_shared<JsonTree>();
  tree->text = std::string(text);
  Parser parser(tree->text);
  if (!parser.run(tree->root)) {
    const Fault& fault = parser.fault();
    return tl::unexpected(Errors(std::vector<QuotedError>{quoted_at(tree->text, fault.at, 1, source,
                                                                    Error(fault.code)
                                                                        .about(fault.subject)
                                                                        .got(fault.got)
                                                                        .expected(fault.expected)
                                                                        .hint(fault.hint))}));
  }
  return tree;
}

}  // namespace flyball::io
