#include <nlohmann/json.hpp>

#include <flyball/solve/solver.hpp>

#include "numeric/laws.hpp"
#include "numeric/problem_maker.hpp"
#include "targets/require.hpp"

/// The first byte is the kind. After an odd second byte the problem is text; after an even one it
/// is made from the bytes, so that shapes agree and the kernel is met.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flyball;
  if (size < 2) {
    return 0;
  }
  const std::span<const solve::Kind> kinds = solve::kinds();
  const solve::Kind& kind = kinds[data[0] % kinds.size()];
  const auto solver = solve::Solver::create(kind.name);
  fuzz::require(solver.has_value(), "every kind has a solver");
  if (data[1] % 2 == 1) {
    const solve::Answer answer = solver->solve(fuzz::text_of(data + 2, size - 2));
    fuzz::require(nlohmann::json::accept(answer.json), "an answer is JSON");
    return 0;
  }
  fuzz::Choices choices(std::span(data + 2, size - 2));
  const nlohmann::json problem = fuzz::make_problem(kind, choices);
  const solve::Answer answer = solver->solve(problem.dump());
  const nlohmann::json read = nlohmann::json::parse(answer.json, nullptr, false);
  fuzz::require(!read.is_discarded(), "an answer is JSON");
  if (answer.solved) {
    // Laws that do not hold are numeric_fuzzer's to tell, which counts them and goes on.
    for (const fuzz::Verdict& verdict : fuzz::check_answer(kind, problem, read)) {
      fuzz::require(!verdict.law.starts_with("finite") && !verdict.law.starts_with("has"),
                    "an answer is whole and finite");
    }
  }
  return 0;
}
