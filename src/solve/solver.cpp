#include <flyball/solve/solver.hpp>

#include "core/try.hpp"
#include "io/answer_writer.hpp"
#include "solve/json_object.hpp"
#include "solve/problem.hpp"

namespace flyball::solve {

using Json = nlohmann::json;

namespace {

Answer refused(AnswerWriter& answer, const Json* id, const Error& error) {
  answer.begin(id);
  answer.add(error);
  return {answer.end(), false, error.kind()};
}

}  // namespace

Expected<Solver> Solver::create(std::string_view kind) {
  return find_kind(kind).map([](const Kind* found) { return Solver(*found); });
}

std::string Solver::error_json(const Error& error) {
  AnswerWriter answer;
  return refused(answer, nullptr, error).json;
}

bool Solver::is_complete(std::string_view text) {
  return Json::accept(text);
}

Answer Solver::solve(std::string_view text) const {
  AnswerWriter answer;
  const auto object = parse_object(text, kind_->name, "problem");
  if (!object) {
    return refused(answer, nullptr, object.error());
  }
  const auto found = object->find("id");
  const Json* const id = found == object->end() ? nullptr : &*found;
  const auto problem = Problem::read(*object, kind_->fields, kind_->name);
  if (!problem) {
    return refused(answer, id, problem.error());
  }
  answer.begin(id);
  if (const Expected<void> outcome = kind_->function(*problem, answer); !outcome) {
    return refused(answer, id, outcome.error());
  }
  return {answer.end(), true, ErrorKind::no_answer};
}

}  // namespace flyball::solve
