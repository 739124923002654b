#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>

#include "core/try.hpp"
#include "core/wording.hpp"
#include "solve/json_value.hpp"
#include "solve/problem.hpp"
#include "solve/shape.hpp"

namespace flyball::solve {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr std::array<Field, 4> fields_of_system(const Field& system) {
  const auto matrix = [](std::string_view name, std::string_view rows, std::string_view columns,
                         Absent absent) {
    return Field{.name = name,
                 .type = FieldType::matrix,
                 .rows = rows,
                 .columns = columns,
                 .absent = absent};
  };
  return {matrix("A", system.rows, system.rows, Absent::refused),
          matrix("B", system.rows, system.columns, Absent::refused),
          matrix("C", system.outputs, system.rows, Absent::identity),
          matrix("D", system.outputs, system.columns, Absent::zero)};
}

constexpr std::array<Field, 5> fields_of_transfer(const Field& transfer) {
  const auto list = [](std::string_view name, std::string_view length) {
    return Field{.name = name,
                 .type = FieldType::list,
                 .rows = length,
                 .columns = "1",
                 .absent = Absent::nothing};
  };
  const auto or_zero = [](std::string_view name) {
    return Field{.name = name, .type = FieldType::number, .absent = Absent::number};
  };
  return {list("num", transfer.rows), list("den", transfer.columns), or_zero("dt"),
          or_zero("delay"),
          Field{.name = "expr", .type = FieldType::text, .absent = Absent::nothing}};
}

/// Empty or left out in a static gain.
constexpr std::array<std::string_view, 3> stateless_names{"A", "B", "C"};

std::string in_quotes(std::string_view text) {
  return fmt::format("\"{}\"", text);
}

}  // namespace

/// Reads one object, field after field.
class ProblemReader {
 public:
  ProblemReader(JsonValue object, std::string_view where, std::string_view prefix, Sizes& sizes)
      : object_(object), where_(where), prefix_(prefix), sizes_(sizes) {}

  [[nodiscard]] Expected<void> check_names(std::span<const Field> fields) const;
  [[nodiscard]] Expected<void> read(std::span<const Field> fields, Problem& problem);

 private:
  using Value = Problem::Value;

  [[nodiscard]] std::string full(std::string_view name) const {
    return std::string(prefix_).append(name);
  }
  [[nodiscard]] Error malformed(const Field& field, std::string got, std::string expected) const {
    return refusal(ArgumentError::malformed, where_, full(field.name))
        .got(std::move(got))
        .expected(std::move(expected));
  }

  [[nodiscard]] std::optional<JsonValue> find(std::string_view name) const {
    const auto found = object_.find(name);
    return found == object_.end() || (*found).is_null() ? std::nullopt : std::optional(*found);
  }
  [[nodiscard]] Expected<void> read_value(const Field& field, JsonValue json, Value& value);
  [[nodiscard]] Expected<void> set_default(const Field& field, Value& value);
  [[nodiscard]] Expected<double> number(const Field& field, JsonValue json) const;
  [[nodiscard]] Expected<std::string_view> choice(const Field& field, JsonValue json) const;
  [[nodiscard]] Expected<void> matrix(const Field& field, JsonValue json, MatrixXd& M);
  [[nodiscard]] Expected<ContinuousSystem<>> system(const Field& field, JsonValue json);
  [[nodiscard]] Expected<TransferCoefficients> transfer(const Field& field, JsonValue json,
                                                        std::string_view place = {});
  [[nodiscard]] Expected<std::vector<std::vector<TransferCoefficients>>> transfers(
      const Field& field, JsonValue json);
  [[nodiscard]] Expected<std::vector<Problem>> objects(const Field& field, JsonValue json);
  [[nodiscard]] Expected<void> refused_if(const Verdict& verdict, const Field& field) const {
    if (verdict) {
      return tl::unexpected(malformed(field, verdict->got, verdict->expected));
    }
    return {};
  }

  JsonValue object_;
  std::string_view where_;
  std::string_view prefix_;                          ///< "first." within the object of that name.
  std::span<const std::string_view> passed_over_{};  ///< Members that are there and not wanted.
  Sizes& sizes_;
};

Expected<void> ProblemReader::check_names(std::span<const Field> fields) const {
  const auto names_of = [&](bool all) {
    std::vector<std::string_view> names;
    for (const Field& field : fields) {
      if (all || field.absent == Absent::refused) {
        names.push_back(field.name);
      }
    }
    return names;
  };
  for (auto member = object_.begin(); member != object_.end(); ++member) {
    const std::string_view name = member.key();
    const bool known = std::any_of(fields.begin(), fields.end(),
                                   [&](const Field& field) { return field.name == name; });
    if (known || (name == "id" && prefix_.empty()) ||
        std::find(passed_over_.begin(), passed_over_.end(), name) != passed_over_.end()) {
      continue;
    }
    const std::vector<std::string_view> names = names_of(true);
    const std::string nearest = nearest_name(std::string(name), names);
    return refusal(ArgumentError::unknown_name, where_,
                   prefix_.empty()
                       ? std::string("field")
                       : fmt::format("field of {}", prefix_.substr(0, prefix_.size() - 1)))
        .got(in_quotes(name))
        .expected(fmt::format("one of {}", fmt::join(names, ", ")))
        .hint(nearest.empty() ? "take it out" : "did you mean " + in_quotes(nearest) + "?");
  }
  for (const Field& field : fields) {
    if (field.absent == Absent::refused && !find(field.name)) {
      return tl::unexpected(
          malformed(field, "left out",
                    fmt::format("there; a problem needs {}", fmt::join(names_of(false), ", "))));
    }
  }
  return {};
}

Expected<void> ProblemReader::read(std::span<const Field> fields, Problem& problem) {
  FLYBALL_CHECK(check_names(fields));
  problem.fields_ = fields;
  problem.values_.resize(fields.size() + 1);
  for (std::size_t k = 0; k < fields.size(); ++k) {
    const std::optional<JsonValue> json = find(fields[k].name);
    problem.given_ |= std::uint64_t{json.has_value()} << k;
    FLYBALL_CHECK(json ? read_value(fields[k], *json, problem.values_[k])
                       : set_default(fields[k], problem.values_[k]));
  }
  return {};
}

Expected<void> ProblemReader::read_value(const Field& field, JsonValue json, Value& value) {
  switch (field.type) {
    case FieldType::number:
    case FieldType::integer: {
      FLYBALL_TRY(value, number(field, json));
      return {};
    }
    case FieldType::choice: {
      FLYBALL_TRY(value, choice(field, json));
      return {};
    }
    case FieldType::matrix:
    case FieldType::samples:
    case FieldType::list:
      return matrix(field, json, value.emplace<MatrixXd>());
    case FieldType::complex_list:
      return refused_if(read_complex_list(json, value.emplace<Eigen::VectorXcd>()), field);
    case FieldType::texts:
      return refused_if(read_texts(json, value.emplace<std::vector<std::string>>()), field);
    case FieldType::system: {
      FLYBALL_TRY(value, system(field, json));
      return {};
    }
    case FieldType::transfer: {
      FLYBALL_TRY(value, transfer(field, json));
      return {};
    }
    case FieldType::transfers: {
      FLYBALL_TRY(value, transfers(field, json));
      return {};
    }
    case FieldType::objects: {
      FLYBALL_TRY(auto all, objects(field, json));
      value = std::make_shared<const std::vector<Problem>>(std::move(all));
      return {};
    }
    case FieldType::text:
      if (!json.is_string()) {
        return tl::unexpected(malformed(field, kind_of(json), "a text"));
      }
      value = std::string(json.text());
      return {};
    case FieldType::flag:
    case FieldType::matrices:
    case FieldType::record:
    case FieldType::records:
      break;  // of answers alone
  }
  return {};
}

Expected<void> ProblemReader::set_default(const Field& field, Value& value) {
  switch (field.absent) {
    case Absent::zero: {
      const Index rows = sizes_.bind(field.rows, 0);
      value = MatrixXd(MatrixXd::Zero(rows, sizes_.bind(field.columns, 0)));
      break;
    }
    case Absent::identity: {
      const Index columns = sizes_.bind(field.columns, 0);
      if (const Index rows = sizes_.bind(field.rows, columns); rows != columns) {
        return tl::unexpected(malformed(
            field, "left out",
            fmt::format("there: the identity stands for it, which has not {} rows", rows)));
      }
      value = MatrixXd(MatrixXd::Identity(columns, columns));
      break;
    }
    case Absent::number:
      value = field.otherwise;
      break;
    case Absent::first_choice:
      value = field.choices.substr(0, field.choices.find(' '));
      break;
    case Absent::refused:
    case Absent::nothing:
      break;
  }
  return {};
}

Expected<double> ProblemReader::number(const Field& field, JsonValue json) const {
  double value = 0.0;
  if (!read_number(json, value)) {
    return tl::unexpected(malformed(field, kind_of(json), "a number"));
  }
  FLYBALL_CHECK(check_finite(value, where_, full(field.name)));
  if (field.type == FieldType::integer) {
    constexpr double most = 1e9;
    if (value != std::floor(value)) {
      return tl::unexpected(malformed(field, format_number(value), "a whole number"));
    }
    if (std::abs(value) > most) {
      return refusal(ArgumentError::out_of_range, where_, full(field.name))
          .got(fmt::format("{:.10g}", value))
          .expected("a whole number of at most 1000000000");
    }
  }
  return value;
}

Expected<std::string_view> ProblemReader::choice(const Field& field, JsonValue json) const {
  if (!json.is_string()) {
    return tl::unexpected(malformed(field, kind_of(json), "a text"));
  }
  const std::string_view text = json.text();
  const std::vector<std::string_view> choices = text::split(field.choices, " ");
  const auto found = std::find(choices.begin(), choices.end(), text);
  if (found != choices.end()) {
    return *found;
  }
  std::vector<std::string> listed;
  for (const std::string_view choice : choices) {
    listed.push_back(in_quotes(choice));
  }
  const std::string last = listed.back();
  listed.pop_back();
  const std::string nearest = nearest_name(std::string(text), choices);
  return refusal(ArgumentError::unknown_name, where_, full(field.name))
      .got(in_quotes(text))
      .expected(fmt::format("{} or {}", fmt::join(listed, ", "), last))
      .hint(nearest.empty() ? "" : "did you mean " + in_quotes(nearest) + "?");
}

Expected<void> ProblemReader::matrix(const Field& field, JsonValue json, MatrixXd& M) {
  // Samples are a list of rows, or of the numbers of the one column.
  const bool flat = json.is_array() && !json.empty() && !json.front().is_array();
  const bool column = field.type == FieldType::list || (field.type == FieldType::samples && flat);
  FLYBALL_CHECK(refused_if(column ? read_column(json, M) : read_rows(json, M), field));
  return check_shape_of(M, field, sizes_, where_, full(field.name));
}

Expected<ContinuousSystem<>> ProblemReader::system(const Field& field, JsonValue json) {
  if (!json.is_object()) {
    return tl::unexpected(
        malformed(field, kind_of(json), "a system, such as {\"A\": [[-1]], \"B\": [[1]]}"));
  }
  const std::array<Field, 4> fields = fields_of_system(field);
  const std::string prefix = full(field.name) + '.';
  Problem inner;
  const auto stateless = [&](const char* name) {
    const auto found = json.find(name);
    return found == json.end() || (*found).is_null() || ((*found).is_array() && (*found).empty());
  };
  if (stateless("A") && stateless("B") && stateless("C") && json.contains("D")) {
    // A static gain, y = D u.
    sizes_.bind(field.rows, 0);
    ProblemReader gain(json, where_, prefix, sizes_);
    gain.passed_over_ = stateless_names;
    FLYBALL_CHECK(gain.read(std::span(fields).last(1), inner));
    const MatrixXd& D = inner.matrix("D");
    return ContinuousSystem<>{MatrixXd(0, 0), MatrixXd(0, D.cols()), MatrixXd(D.rows(), 0), D};
  }
  FLYBALL_CHECK(ProblemReader(json, where_, prefix, sizes_).read(fields, inner));
  return inner.system();
}

Expected<TransferCoefficients> ProblemReader::transfer(const Field& field, JsonValue json,
                                                       std::string_view place) {
  TransferCoefficients found;
  const std::string name = std::string(field.name).append(place);
  if (json.is_string()) {
    found.expr = std::string(json.text());
    return found;
  }
  if (!json.is_object()) {
    return refusal(ArgumentError::malformed, where_, full(name))
        .got(kind_of(json))
        .expected("a transfer function, such as \"1/(s + 2)\" or {\"num\": [1], \"den\": [1, 2]}");
  }
  const std::array<Field, 5> fields = fields_of_transfer(field);
  const std::string prefix = full(name) + '.';
  Problem inner;
  FLYBALL_CHECK(ProblemReader(json, where_, prefix, sizes_).read(fields, inner));
  if (inner.has("expr")) {
    found.expr = inner.text("expr");
  }
  for (const char* polynomial : {"num", "den"}) {
    if (inner.has(polynomial) == inner.has("expr")) {
      return refusal(ArgumentError::malformed, where_, prefix + polynomial)
          .got(inner.has("expr") ? "given beside expr" : "left out")
          .expected("num and den, or expr in their place");
    }
    if (inner.has(polynomial)) {
      (polynomial[0] == 'n' ? found.num : found.den) = inner.matrix(polynomial);
    }
  }
  found.dt = inner.number("dt");
  found.delay = inner.number("delay");
  return found;
}

Expected<std::vector<std::vector<TransferCoefficients>>> ProblemReader::transfers(
    const Field& field, JsonValue json) {
  const auto refuse = [&](std::string got) {
    return tl::unexpected(malformed(field, std::move(got),
                                    "rows of transfer functions of one length, such as "
                                    "[[\"1/(s+1)\", \"0\"], [\"0\", \"2/s\"]]"));
  };
  if (!json.is_array() || json.empty()) {
    return refuse(json.is_array() ? "empty" : kind_of(json));
  }
  std::vector<std::vector<TransferCoefficients>> rows;
  for (const JsonValue row : json) {
    if (!row.is_array() || row.empty() || row.size() != json.front().size()) {
      return refuse(row.is_array() ? "of rows of several lengths" : "a list of " + kind_of(row));
    }
    rows.emplace_back();
    for (const JsonValue entry : row) {
      // Each has as many coefficients as it likes.
      Sizes own;
      const std::string place = fmt::format("[{}][{}]", rows.size() - 1, rows.back().size());
      FLYBALL_TRY(auto one,
                  ProblemReader(object_, where_, prefix_, own).transfer(field, entry, place));
      rows.back().push_back(std::move(one));
    }
  }
  sizes_.bind(field.rows, static_cast<Index>(rows.size()));
  sizes_.bind(field.columns, static_cast<Index>(rows.front().size()));
  return rows;
}

Expected<std::vector<Problem>> ProblemReader::objects(const Field& field, JsonValue json) {
  if (!json.is_array()) {
    return tl::unexpected(malformed(field, kind_of(json), "a list of objects"));
  }
  std::vector<Problem> all;
  for (const JsonValue one : json) {
    const std::string name = fmt::format("{}[{}]", full(field.name), all.size());
    if (!one.is_object()) {
      return refusal(ArgumentError::malformed, where_, name)
          .got(kind_of(one))
          .expected("an object");
    }
    const std::string prefix = name + '.';
    Sizes own;
    FLYBALL_CHECK(ProblemReader(one, where_, prefix, own).read(*field.inner, all.emplace_back()));
  }
  return all;
}

Expected<Problem> Problem::read(JsonValue object, std::span<const Field> fields,
                                std::string_view where) {
  Problem problem;
  Sizes sizes;
  FLYBALL_CHECK(ProblemReader(object, where, "", sizes).read(fields, problem));
  return problem;
}

std::size_t Problem::index_of(std::string_view name) const {
  std::size_t k = 0;
  while (k < fields_.size() && fields_[k].name != name) {
    ++k;
  }
  return k;
}

bool Problem::has(std::string_view name) const {
  return (given_ >> index_of(name) & 1U) != 0;
}

}  // namespace flyball::solve
