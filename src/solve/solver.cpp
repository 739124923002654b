#include <flyball/solve/solver.hpp>

#include <algorithm>
#include <exception>
#include <new>
#include <utility>

#include <nlohmann/json.hpp>

#include <flyball/io/json_text.hpp>
#include <flyball/io/json_writer.hpp>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "solve/json_object.hpp"
#include "solve/problem.hpp"

namespace flyball::solve {

ErrorInfo error_info(SolveError code) {
  static constexpr flyball::detail::ErrorRow rows[] = {
      {"overflow", "the answer is too large for a double", ErrorKind::no_answer},
      {"not_determined", "the last digits of the data decide about the answer",
       ErrorKind::no_answer},
      {"defect", "a defect of Flyball", ErrorKind::defect},
  };
  return flyball::detail::info_of(code, "solve", rows);
}

namespace {

/// The id of a problem, a number or a string to the byte, on one line; empty if it has none, or if
/// that is cut off.
std::string id_of(std::string_view text) {
  const auto written = written_member(text, "id");
  if (!written || !nlohmann::json::accept(*written)) {
    return {};
  }
  const bool structured = written->starts_with('{') || written->starts_with('[');
  return structured ? json_escaped(nlohmann::json::parse(*written).dump(
                          -1, ' ', false, nlohmann::json::error_handler_t::replace))
                    : std::string(*written);
}

/// A text whose end is missing may end in the middle of a number.
std::string id_of_beginning(std::string_view text) {
  const auto written = written_member(text, "id");
  const bool whole = written && written->data() + written->size() < text.data() + text.size();
  return whole ? id_of(text) : std::string();
}

/// A new answer, open, with the problem's id if it has one.
JsonWriter begin(const std::string& id) {
  JsonWriter answer;
  answer.open('{');
  if (!id.empty()) {
    answer.add_json("id", id);
  }
  return answer;
}

std::string end(JsonWriter answer) {
  answer.close('}');
  return std::move(answer).text();
}

/// Whether a JSON value has a number that is NaN (null) or infinite.
bool is_bounded(JsonValue value) {
  if (value.is_structured()) {
    for (const JsonValue element : value) {
      if (!is_bounded(element)) {
        return false;
      }
    }
    return true;
  }
  return !value.is_null() &&
         !(value.is_string() && (value.text() == "inf" || value.text() == "-inf"));
}

/// Refuses an answer in which a number overflowed where its kind's row has no place for that.
Expected<void> check_answer(const std::string& answer, const Kind& kind) {
  FLYBALL_TRY(const JsonTree tree, parse_object(answer, kind.name, "answer"));
  const JsonValue json = tree.root();
  for (const Field& field : kind.answer) {
    const auto found = json.find(field.name);
    if (!field.unbounded && found != json.end() && !is_bounded(*found)) {
      return refusal(SolveError::overflow, kind.name, field.name)
          .got("beyond the range of a double")
          .hint("choose units in which the numbers are nearer to 1");
    }
  }
  return {};
}

Answer refused(const std::string& id, const Error& error) {
  JsonWriter answer = begin(id);
  answer.add("error", error);
  return {end(std::move(answer)), false, error.kind()};
}

Answer answer_to(JsonValue object, const std::string& id, const Kind& kind) {
  const auto problem = Problem::read(object, kind.fields, kind.name);
  if (!problem) {
    return refused(id, problem.error());
  }
  JsonWriter answer = begin(id);
  if (const Expected<void> outcome = kind.function(*problem, answer); !outcome) {
    return refused(id, outcome.error());
  }
  const bool all_finite = answer.all_finite();
  std::string json = end(std::move(answer));
  if (!all_finite) {
    if (const auto checked = check_answer(json, kind); !checked) {
      return refused(id, checked.error());
    }
  }
  return {std::move(json), true, ErrorKind::no_answer};
}

}  // namespace

Expected<Solver> Solver::create(std::string_view kind) {
  return find_kind(kind).map([](const Kind* found) { return Solver(*found); });
}

std::string Solver::error_json(const Error& error) {
  return refused("", error).json;
}

Answer Solver::without_memory(std::string_view beginning) {
  std::string id;
  try {
    id = id_of_beginning(beginning);
  } catch (const std::bad_alloc&) {  // not even for that
  }
  return refused(id, not_enough_memory("this problem"));
}

Answer Solver::solve(std::string_view text) const {
  Expected<JsonTree> object{};
  std::string id;
  try {
    object = parse_object(text, kind_->name, "problem");
    if (!object) {
      return refused(id, object.error());
    }
    if (object->root().contains("id")) {
      id = id_of(text);
    }
    return answer_to(object->root(), id, *kind_);
  } catch (const std::bad_alloc&) {
    object = {};
    return id.empty() ? without_memory(text) : refused(id, not_enough_memory("this problem"));
  } catch (const std::exception& defect) {  // the other problems are answered all the same
    return refused(
        id,
        Error(SolveError::defect).in(std::string(kind_->name)).with("exception", defect.what()));
  }
}

}  // namespace flyball::solve
