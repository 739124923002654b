#include <flyball/solve/solver.hpp>

#include <utility>

#include <flyball/io/json_writer.hpp>

#include "core/try.hpp"
#include "solve/json_object.hpp"
#include "solve/problem.hpp"

namespace flyball::solve {

using Json = nlohmann::json;

namespace {

/// A new answer, open, with the problem's id if it has one.
JsonWriter begin(const Json* id) {
  JsonWriter answer;
  answer.open('{');
  if (id != nullptr) {
    answer.add_json("id", id->dump(-1, ' ', false, Json::error_handler_t::replace));
  }
  return answer;
}

std::string end(JsonWriter answer) {
  answer.close('}');
  return std::move(answer).text();
}

Answer refused(const Json* id, const Error& error) {
  JsonWriter answer = begin(id);
  answer.add("error", error);
  return {end(std::move(answer)), false, error.kind()};
}

}  // namespace

Expected<Solver> Solver::create(std::string_view kind) {
  return find_kind(kind).map([](const Kind* found) { return Solver(*found); });
}

std::string Solver::error_json(const Error& error) {
  return refused(nullptr, error).json;
}

bool Solver::is_complete(std::string_view text) {
  return Json::accept(text);
}

Answer Solver::solve(std::string_view text) const {
  const auto object = parse_object(text, kind_->name, "problem");
  if (!object) {
    return refused(nullptr, object.error());
  }
  const auto found = object->find("id");
  const Json* const id = found == object->end() ? nullptr : &*found;
  const auto problem = Problem::read(*object, kind_->fields, kind_->name);
  if (!problem) {
    return refused(id, problem.error());
  }
  JsonWriter answer = begin(id);
  if (const Expected<void> outcome = kind_->function(*problem, answer); !outcome) {
    return refused(id, outcome.error());
  }
  return {end(std::move(answer)), true, ErrorKind::no_answer};
}

}  // namespace flyball::solve
