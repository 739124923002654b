#include <flyball/solve/documentation.hpp>

#include <algorithm>

#include <fmt/format.h>

#include "core/wording.hpp"
#include "solve/shape.hpp"

namespace flyball::solve {

namespace {

/// "matrix n x m", "one of zoh, foh"; without its shape for the words in front of a sentence.
std::string type_of(const Field& field) {
  const std::string shape = shape_of(field);
  switch (field.type) {
    case FieldType::number:
      return "number";
    case FieldType::integer:
      return "whole number";
    case FieldType::flag:
      return "true or false";
    case FieldType::text:
      return "text";
    case FieldType::texts:
      return "list of texts";
    case FieldType::choice: {
      std::string listed;
      for (const std::string_view choice : text::split(field.choices, " ")) {
        listed += fmt::format("{}\"{}\"", listed.empty() ? "" : ", ", choice);
      }
      return listed;
    }
    case FieldType::matrix:
      return shape;
    case FieldType::samples:
      return shape + ", a flat list if it is one column";
    case FieldType::list:
      return fmt::format("list of {} numbers", shape);
    case FieldType::complex_list:
      return fmt::format("list of {} complex numbers", shape);
    case FieldType::matrices:
      return fmt::format("list of matrices, {}", shape);
    case FieldType::record:
    case FieldType::records:
      return fmt::format("{}{}", field.type == FieldType::records ? "list of, each with " : "",
                         fmt::join(text::split(field.choices, " "), ", "));
    case FieldType::system:
      return fmt::format("system of {}", shape);
    case FieldType::transfer:
      return "transfer function, num and den, or expr";
    case FieldType::transfers:
      return fmt::format("rows of transfer functions, {}", shape);
    case FieldType::objects: {
      std::string names;
      for (const Field& inner : *field.inner) {
        const bool refused = inner.absent == Absent::refused;
        names += fmt::format("{}{}{}{}", names.empty() ? "" : ", ", refused ? "" : "[", inner.name,
                             refused ? "" : "]");
      }
      return "list of objects with " + names;
    }
  }
  return {};
}

/// What holds where a field is left out; empty where it must not be or where the help says it.
std::string default_of(const Field& field) {
  switch (field.absent) {
    case Absent::zero:
      return "zero";
    case Absent::identity:
      return "the identity";
    case Absent::number:
      return fmt::format("{}", field.otherwise);
    case Absent::first_choice:
      return fmt::format("\"{}\"", field.choices.substr(0, field.choices.find(' ')));
    case Absent::refused:
    case Absent::nothing:
      break;
  }
  return {};
}

std::string description_of(const Field& field) {
  const std::string otherwise = default_of(field);
  return fmt::format("{}{}{}", field.help,
                     field.unit.empty() ? "" : fmt::format(" [{}]", field.unit),
                     otherwise.empty() ? "" : fmt::format("; {} if left out", otherwise));
}

/// "A B Q R [N]"
std::string names_of(const std::vector<Field>& fields) {
  std::string names;
  for (const Field& field : fields) {
    const bool refused = field.absent == Absent::refused;
    names += fmt::format("{}{}{}{}", names.empty() ? "" : " ", refused ? "" : "[", field.name,
                         refused ? "" : "]");
  }
  return names;
}

void tell_fields(std::string& text, const std::vector<Field>& fields) {
  for (const Field& field : fields) {
    const std::string name =
        field.absent == Absent::refused ? std::string(field.name) : fmt::format("[{}]", field.name);
    text += fmt::format("  {:<26} {}\n  {:<26}   {}\n", name, type_of(field), "",
                        description_of(field));
  }
}

/// @param line  With a place for the letter and one for what it counts.
std::string lines_of(std::span<const Letter> letters,
                     fmt::format_string<char, std::string_view> line) {
  std::string text;
  for (const auto& [letter, counts] : letters) {
    text += fmt::format(line, char{letter}, std::string_view(counts));
  }
  return text;
}

constexpr std::string_view introduction = R"(# flyball solve

`flyball solve KIND` reads problems on standard input and answers each on one line of standard output, as soon as it
is read: JSON Lines, of which the first object may stand on several lines. `flyball solve --list` lists the kinds,
`flyball solve KIND --help` the fields of one. This page is made of the same table (`flyball solve --markdown`), and so is
the JSON Schema of all problems and answers, [solve.schema.json](schemas/solve.schema.json) (`flyball solve --schema`).

- Matrices are lists of rows; a number stands for a 1 x 1 matrix. Complex numbers are `[re, im]`, infinities `"inf"` and
  `"-inf"`. Numbers round-trip.
- A field `id`, any JSON value, is echoed, a number or a string to the byte.
- A problem that cannot be read or solved is answered with `{"error": {"code", "message", …}}`, the evidence beside the
  message; the codes are those of [errors.md](errors.md). The others are answered all the same.
- Exit status, after the last line: 0 all solved; 1 some problem has no answer (the mathematics says no); 2 some input was
  no problem at all (JSON that is cut off, an unknown field, a ragged matrix, NaN), which outranks 1, or the kind is
  unknown. The code of each error says which it was.

A regulator for a cart that carries a pendulum, 4 states, run each 10 ms:

```sh
echo '{"A": [[0, 1, 0, 0], [0, -0.1, 3, 0], [0, 0, 0, 1], [0, -0.5, 30, 0]], "B": [[0], [2], [0], [5]],
       "Q": [[400, 0, 0, 0], [0, 4, 0, 0], [0, 0, 400, 0], [0, 0, 0, 4]], "R": [[0.0069]], "T": 0.01}' |
  flyball solve lqr
```

`K` is 1 x 4, `poles` are those of A − BK, sampled. To pass a solution on to another program, use
for example `jq .K`.

`residual` is what is left of the equation over the sum of its terms' norms, of a Riccati equation with the K that is
answered in it, which is not R⁻¹BᵀX to the last digit where R is nearly singular; `condition` times it estimates the
relative error of the answer. A field in brackets may be left out. Letters are sizes, equal letters of one kind are equal sizes:

)";

/// A cell of a table must not end it.
std::string cell(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) {
    text.insert(at, "\\");
  }
  return text;
}

void table_of(std::string& page, std::string_view title, const std::vector<Field>& fields) {
  page += fmt::format("\n| {} | is | meaning |\n|---|---|---|\n", title);
  for (const Field& field : fields) {
    const bool refused = field.absent == Absent::refused;
    page += fmt::format("| {}`{}`{} | {} | {} |\n", refused ? "" : "[", field.name,
                        refused ? "" : "]", cell(type_of(field)), cell(description_of(field)));
  }
}

}  // namespace

std::string list_of_kinds() {
  std::string text;
  std::string_view section;
  for (const Kind& kind : kinds()) {
    if (kind.section != section) {
      section = kind.section;
      text += fmt::format("{}{}\n", text.empty() ? "" : "\n", section);
    }
    text += fmt::format("  {:<24} {}\n", kind.name, kind.help);
  }
  return text;
}

std::string help_of(const Kind& kind) {
  std::string text = fmt::format("flyball solve {}: {}\n\nA problem has {}\n", kind.name, kind.help,
                                 names_of(kind.fields));
  tell_fields(text, kind.fields);
  text += "\nIts answer has\n";
  tell_fields(text, kind.answer);
  text += fmt::format(
      "\nA letter is a size, equal letters are equal sizes:\n{}"
      "A field in brackets may be left out.\n\n  echo '{}' |\n    flyball solve {}\n",
      lines_of(letters_of(kind), "  {}  {}\n"), kind.example, kind.name);
  return text;
}

std::string markdown() {
  std::string page(introduction);
  page += lines_of(all_letters(), "- `{}` {}\n");
  std::string_view section;
  for (const Kind& kind : kinds()) {
    if (kind.section != section) {
      section = kind.section;
      page += fmt::format("\n## {}\n", section);
    }
    page += fmt::format("\n### {}\n\n{}\n", kind.name, kind.help);
    table_of(page, "problem", kind.fields);
    table_of(page, "answer", kind.answer);
    page += fmt::format("\n```sh\necho '{}' |\n  flyball solve {}\n```\n", kind.example, kind.name);
  }
  return page;
}

}  // namespace flyball::solve
