#include <algorithm>

#include <fmt/format.h>

#include <flyball/core/text.hpp>
#include <flyball/io/json_writer.hpp>

#include "io/motion/json_fields.hpp"

namespace flyball::io {

// ---- reading -----------------------------------------------------------------------------------

void JsonReading::fail(const JsonNode& node, Error error) {
  if (!error_) {
    error_ = quoted_at(tree_->text, node.begin, node.end - node.begin, source_, std::move(error));
  }
}

namespace {

std::string joined(const std::vector<std::string>& path, std::string_view key = {}) {
  std::string text;
  for (const std::string& part : path) {
    text += text.empty() || part.starts_with('[') ? part : "." + part;
  }
  if (!key.empty()) {
    text += text.empty() ? std::string(key) : "." + std::string(key);
  }
  return text.empty() ? "the file" : printable(cut(text, 120));
}

}  // namespace

void JsonReading::refuse(const JsonNode& node, std::string_view expected, std::string got,
                         std::string hint) {
  if (got.empty()) {
    got = node.kind == JsonKind::array || node.kind == JsonKind::object
              ? std::string(to_string(node.kind))
              : cut(printable(tree_->slice(node)), 40);
    if (hint.empty() && node.kind == JsonKind::null && expected.find("number") != expected.npos) {
      hint = "the tool that wrote it had no number there: generate it again";
    }
  }
  fail(node, Error(MotionFileError::wrong_field)
                 .about(joined(path))
                 .got(std::move(got))
                 .expected(std::string(expected))
                 .hint(std::move(hint)));
}

void JsonReading::miss(const JsonNode& object, std::string_view key) {
  if (!error_) {
    error_ = quoted_at(tree_->text, object.begin, 1, source_,
                       Error(MotionFileError::wrong_field).about(joined(path, key)).got("missing"));
  }
}

bool read_value(JsonReading& reading, const JsonNode& node, double& value) {
  if (node.kind != JsonKind::number) {
    reading.refuse(node, "a number");
    return false;
  }
  value = node.number;
  return true;
}

bool read_value(JsonReading& reading, const JsonNode& node, int& value) {
  constexpr double most = 1e9;
  if (node.kind != JsonKind::number || node.number != std::floor(node.number) ||
      std::abs(node.number) > most) {
    reading.refuse(node, "a whole number");
    return false;
  }
  value = static_cast<int>(node.number);
  return true;
}

bool read_value(JsonReading& reading, const JsonNode& node, bool& value) {
  if (node.kind != JsonKind::boolean) {
    reading.refuse(node, "true or false");
    return false;
  }
  value = node.number != 0.0;
  return true;
}

bool read_value(JsonReading& reading, const JsonNode& node, std::string& value) {
  if (node.kind != JsonKind::string) {
    reading.refuse(node, "a text");
    return false;
  }
  value = reading.tree()->string(node);
  return true;
}

bool read_value(JsonReading& reading, const JsonNode& node, JsonText& value) {
  value.text = std::string(reading.tree()->slice(node));
  return true;
}

namespace {

struct DescribeExpressed {
  template <class A, class N>
  void operator()(A& a, N& number) const {
    a("exp", number.expression);
    a("val", number.value);
  }
};

struct DescribeCommandData {
  template <class A, class C>
  void operator()(A& a, C& command) const {
    if (command.type == "path") {
      a.maybe("pathName", command.name);
    } else if (command.type == "named") {
      a.maybe("name", command.name);
    } else if (command.type == "wait") {
      a("waitTime", command.wait);
    } else if (command.type == "sequential" || command.type == "parallel" ||
               command.type == "race" || command.type == "deadline") {
      a("commands", command.commands);
    }
  }
};

/// `data` has no origin of its own: its object is a member of the command's.
struct DescribeCommand {
  void operator()(JsonMembersIn& a, AutoCommand& command) const {
    a("type", command.type);
    if (a.reading().failed()) {
      return;
    }
    const JsonNode* data = a.node().find("data");
    if (data == nullptr || data->kind != JsonKind::object) {
      return;
    }
    a.reading().path.emplace_back("data");
    JsonMembersIn members(a.reading(), *data);
    DescribeCommandData{}(members, command);
    if (!a.reading().failed()) {
      a.reading().path.pop_back();
    }
  }
};

}  // namespace

bool read_value(JsonReading& reading, const JsonNode& node, ExpressedNumber& value) {
  if (node.kind == JsonKind::object) {
    return JsonMembersIn::read(reading, node, value, DescribeExpressed{});
  }
  value.expression.clear();
  if (node.kind != JsonKind::number) {
    reading.refuse(node, "a number, or {\"exp\": …, \"val\": …}");
    return false;
  }
  value.value = node.number;
  value.origin = JsonOrigin(reading.tree(), node);
  return true;
}

bool read_value(JsonReading& reading, const JsonNode& node, std::array<double, 4>& value) {
  if (node.kind != JsonKind::array || node.children.size() != value.size()) {
    reading.refuse(node, "a list of four numbers",
                   node.kind == JsonKind::array
                       ? fmt::format("a list of {} values", node.children.size())
                       : "");
    return false;
  }
  for (std::size_t i = 0; i < value.size(); ++i) {
    reading.path.push_back(fmt::format("[{}]", i));
    if (!read_value(reading, node.children[i], value[i])) {
      return false;
    }
    reading.path.pop_back();
  }
  return true;
}

bool read_value(JsonReading& reading, const JsonNode& node, AutoCommand& value) {
  return JsonMembersIn::read(reading, node, value, DescribeCommand{});
}

bool read_value(JsonReading& reading, const JsonNode& node, std::vector<bool>& values) {
  if (node.kind != JsonKind::array) {
    reading.refuse(node, "a list");
    return false;
  }
  values.clear();
  values.reserve(node.children.size());
  for (const JsonNode& child : node.children) {
    bool value = false;
    reading.path.push_back(fmt::format("[{}]", values.size()));
    if (!read_value(reading, child, value)) {
      return false;
    }
    reading.path.pop_back();
    values.push_back(value);
  }
  return true;
}

void JsonMembersIn::id(std::string_view key, std::string& value) {
  if (const JsonNode* node = find(key, false)) {
    in(key, [&] {
      if (node->kind != JsonKind::number && node->kind != JsonKind::string) {
        reading_.refuse(*node, "a number or a text");
        return false;
      }
      value = node->kind == JsonKind::number ? std::string(reading_.tree()->slice(*node))
                                             : reading_.tree()->string(*node);
      return true;
    });
  }
}

void JsonMembersIn::id(std::string_view key, std::optional<std::string>& value) {
  if (const JsonNode* node = find(key, true); node != nullptr && !is_null(*node)) {
    id(key, value.emplace());
  }
}

void JsonMembersIn::numbers(std::string_view key, std::vector<NamedNumber>& values,
                            std::string_view flag_name, std::optional<bool>& flag) {
  const JsonNode* node = find(key, true);
  if (node == nullptr || node->kind == JsonKind::null) {
    return;
  }
  in(key, [&] {
    if (node->kind != JsonKind::object) {
      reading_.refuse(*node, "an object");
      return false;
    }
    values.clear();
    for (const JsonNode& child : node->children) {
      if (child.key == flag_name && child.kind == JsonKind::boolean) {
        static_cast<void>(read_value(reading_, child, flag.emplace()));
        continue;
      }
      const bool expressed = child.kind == JsonKind::object && child.find("exp") != nullptr &&
                             child.find("val") != nullptr;
      if (child.kind != JsonKind::number && !expressed) {
        continue;
      }
      NamedNumber& number = values.emplace_back();
      number.name = child.key;
      reading_.path.push_back(child.key);
      if (!read_value(reading_, child, number.number)) {
        return false;
      }
      reading_.path.pop_back();
    }
    return true;
  });
}

// ---- writing -----------------------------------------------------------------------------------

JsonSpot JsonSpot::member(std::string_view key) const {
  JsonSpot spot = *this;
  spot.old = old != nullptr && old->kind == JsonKind::object ? old->find(key) : nullptr;
  ++spot.depth;
  return spot;
}

JsonSpot JsonSpot::element(std::size_t index) const {
  JsonSpot spot = *this;
  spot.old = old != nullptr && old->kind == JsonKind::array && index < old->children.size()
                 ? &old->children[index]
                 : nullptr;
  ++spot.depth;
  spot.row = row || style.rows;
  return spot;
}

JsonSpot JsonSpot::of(const JsonOrigin& origin) const {
  JsonSpot spot = *this;
  if (origin.node() != nullptr) {
    spot.tree = origin.tree();
    spot.old = origin.node();
  }
  return spot;
}

namespace {

std::string line_break(const JsonSpot& spot, int deeper) {
  return "\n" +
         std::string(static_cast<std::size_t>((spot.depth + deeper) * spot.style.indent), ' ');
}

std::string_view colon_of(const JsonSpot& spot) {
  return spot.style.colon.empty() ? std::string_view(":") : spot.style.colon;
}

/// How the members of an old value are separated, for what is new.
struct Separators {
  std::string open, between, close;
};

Separators separators_of(const JsonSpot& spot, char first, char last, bool on_one_line) {
  const JsonNode* old = spot.old;
  Separators all;
  const auto begin_of = [](const JsonNode& node) {
    return node.key_end > node.key_begin ? node.key_begin : node.begin;
  };
  if (old != nullptr && !old->children.empty()) {
    all.open = spot.tree->slice(old->begin, begin_of(old->children.front()));
    all.close = spot.tree->slice(old->children.back().end, old->end);
    if (old->children.size() > 1) {
      const std::size_t n = old->children.size();
      all.between = spot.tree->slice(old->children[n - 2].end, begin_of(old->children[n - 1]));
    } else {  // what is before the first one, too
      all.between = "," + (all.open.size() > 1 ? all.open.substr(1) : std::string(" "));
    }
    return all;
  }
  const bool one_line = spot.row || on_one_line;
  all.open = std::string(1, first) + (one_line ? "" : line_break(spot, 1));
  all.between = one_line ? ", " : "," + line_break(spot, 1);
  all.close = (one_line ? "" : line_break(spot, 0)) + std::string(1, last);
  return all;
}

}  // namespace

std::string compose_object(const JsonSpot& spot, std::vector<JsonPiece> members) {
  const JsonNode* old =
      spot.old != nullptr && spot.old->kind == JsonKind::object ? spot.old : nullptr;
  JsonSpot here = spot;
  here.old = old;
  const Separators separators = separators_of(here, '{', '}', false);
  std::string text;
  bool first = true;
  const auto colon = [&]() -> std::string_view {
    return old != nullptr && !old->children.empty()
               ? spot.tree->slice(old->children.front().key_end, old->children.front().begin)
               : colon_of(spot);
  };
  if (old != nullptr && !old->children.empty()) {
    const std::vector<JsonNode>& children = old->children;
    text += separators.open;
    for (std::size_t i = 0; i < children.size(); ++i) {
      const JsonNode& child = children[i];
      const auto known = std::find_if(members.begin(), members.end(), [&](const JsonPiece& piece) {
        return piece.key == child.key;
      });
      text += spot.tree->slice(child.key_begin, child.begin);
      if (known == members.end()) {
        text += spot.tree->slice(child);
      } else {
        text += known->there ? known->text : "null";
        members.erase(known);
      }
      if (i + 1 < children.size()) {
        text += spot.tree->slice(child.end, children[i + 1].key_begin);
      }
    }
    first = false;
  }
  for (const JsonPiece& piece : members) {
    if (!piece.there) {
      continue;
    }
    text += first ? separators.open : separators.between;
    text += json_quoted(piece.key);
    text += colon();
    text += piece.text;
    first = false;
  }
  if (first) {
    return old != nullptr ? std::string(spot.tree->slice(*old)) : "{}";
  }
  return text + separators.close;
}

std::string compose_list(const JsonSpot& spot, const std::vector<JsonPiece>& pieces, bool named,
                         bool numbers) {
  const JsonKind kind = named ? JsonKind::object : JsonKind::array;
  const JsonNode* old = spot.old != nullptr && spot.old->kind == kind ? spot.old : nullptr;
  if (pieces.empty()) {
    return old != nullptr && old->children.empty() ? std::string(spot.tree->slice(*old))
           : named                                 ? "{}"
                                                   : "[]";
  }
  JsonSpot here = spot;
  here.old = old;
  const Separators separators = separators_of(here, named ? '{' : '[', named ? '}' : ']', numbers);
  std::string text = separators.open;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const bool kept = old != nullptr && pieces.size() == old->children.size();
    if (named) {
      text +=
          kept && old->children[i].key == pieces[i].key
              ? std::string(spot.tree->slice(old->children[i].key_begin, old->children[i].begin))
              : json_quoted(pieces[i].key) + std::string(colon_of(spot));
    }
    text += pieces[i].text;
    if (i + 1 == pieces.size()) {
      break;
    }
    if (kept) {
      const JsonNode& next = old->children[i + 1];
      text += spot.tree->slice(old->children[i].end, named ? next.key_begin : next.begin);
    } else {
      text += separators.between;
    }
  }
  return text + separators.close;
}

std::string written(const JsonSpot& spot, double value) {
  const JsonNode* old = spot.old;
  if (old != nullptr && old->kind == JsonKind::number && old->number == value &&
      std::signbit(old->number) == std::signbit(value)) {
    return std::string(spot.tree->slice(*old));
  }
  return std::isfinite(value) ? json_number(value) : "NaN";
}

std::string written(const JsonSpot& spot, int value) {
  const JsonNode* old = spot.old;
  return old != nullptr && old->kind == JsonKind::number && old->number == value
             ? std::string(spot.tree->slice(*old))
             : std::to_string(value);
}

std::string written(const JsonSpot&, bool value) {
  return value ? "true" : "false";
}

std::string written(const JsonSpot& spot, const std::string& value) {
  const JsonNode* old = spot.old;
  return old != nullptr && old->kind == JsonKind::string && spot.tree->string(*old) == value
             ? std::string(spot.tree->slice(*old))
             : json_quoted(value);
}

std::string written(const JsonSpot&, const JsonText& value) {
  return value.text;
}

std::string written(const JsonSpot& spot, const ExpressedNumber& value) {
  const bool bare = value.expression.empty();
  JsonSpot here = spot;
  if (here.old != nullptr && (here.old->kind == JsonKind::number) != bare) {
    here.old = nullptr;
  }
  if (bare) {
    return written(here, value.value);
  }
  return JsonMembersOut::members(here, value, DescribeExpressed{});
}

std::string written(const JsonSpot& spot, const std::array<double, 4>& value) {
  return written(spot, std::vector<double>(value.begin(), value.end()));
}

std::string written(const JsonSpot& spot, const std::vector<bool>& values) {
  std::vector<JsonPiece> pieces;
  pieces.reserve(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    pieces.push_back({{}, written(spot.element(i), static_cast<bool>(values[i]))});
  }
  return compose_list(spot, pieces, false, true);
}

std::string written(const JsonSpot& spot, const AutoCommand& value) {
  const JsonSpot here = spot.of(value.origin);
  std::vector<JsonPiece> pieces{{"type", written(here.member("type"), value.type)}};
  const JsonSpot data = here.member("data");
  // One that its file had without data, and that says no more, stays so.
  const bool bare = here.old != nullptr && data.old == nullptr && value.name.empty() &&
                    value.commands.empty() && value.wait.value == 0.0;
  if (!bare && (data.old == nullptr || data.old->kind == JsonKind::object)) {
    pieces.push_back({"data", JsonMembersOut::members(data, value, DescribeCommandData{})});
  }
  return compose_object(here, std::move(pieces));
}

void JsonMembersOut::id(std::string_view key, const std::string& value) {
  const JsonNode* old = spot_.member(key).old;
  if (old != nullptr && (old->kind == JsonKind::number ? spot_.tree->slice(*old) == value
                                                       : old->kind == JsonKind::string &&
                                                             spot_.tree->string(*old) == value)) {
    add(key, std::string(spot_.tree->slice(*old)));
    return;
  }
  const bool whole = !value.empty() && value.size() < 10 &&
                     value.find_first_not_of("0123456789") == std::string::npos &&
                     (value.size() == 1 || value.front() != '0');
  add(key, whole ? value : json_quoted(value));
}

void JsonMembersOut::id(std::string_view key, const std::optional<std::string>& value) {
  value ? id(key, *value) : nothing(key);
}

void JsonMembersOut::numbers(std::string_view key, const std::vector<NamedNumber>& values,
                             std::string_view flag_name, const std::optional<bool>& flag) {
  const JsonSpot spot = spot_.member(key);
  if (values.empty() && !flag && (spot.old == nullptr || spot.old->kind != JsonKind::object)) {
    spot.old == nullptr&& spot_.old == nullptr ? add(key, "{}") : absent(key);
    return;
  }
  std::vector<JsonPiece> pieces;
  for (const NamedNumber& value : values) {
    pieces.push_back(
        {value.name, written(spot.member(value.name).of(value.number.origin), value.number)});
  }
  if (flag) {
    pieces.push_back({std::string(flag_name), written(spot.member(flag_name), *flag)});
  }
  add(key, compose_object(spot, std::move(pieces)));
}

Expected<std::string> checked_text(std::string text) {
  if (auto tree = parse_json_tree(text, "the file that is written"); !tree) {
    return tl::unexpected(Error(MotionFileError::wrong_field)
                              .about("a number of what is to be written")
                              .got("not finite")
                              .expected("a finite number"));
  }
  return text;
}

}  // namespace flyball::io
