#include <utility>

#include <flyball/systems/interconnection.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// Systems that are connected to each other.
namespace flyball::solve {

namespace {

/// What `connect` makes of two systems of the domain that the problem names.
template <class Connect>
Outcome connect_both(const Problem& problem, std::string_view first, std::string_view second,
                     JsonWriter& answer, Connect&& connect) {
  const auto write = [&](const auto& connected) -> Outcome {
    return connected.map([&](const auto& system) { write_system(system, answer); });
  };
  const ContinuousSystem<>& one = problem.system(first);
  const ContinuousSystem<>& other = problem.system(second);
  return problem.domain() == TimeDomain::continuous
             ? write(connect(one, other))
             : write(connect(sampled(problem, one), sampled(problem, other)));
}

/// A row's function for two systems that are called first and second.
template <auto connect>
Outcome solve_pair(const Problem& problem, JsonWriter& answer) {
  return connect_both(problem, "first", "second", answer, connect);
}

Outcome solve_feedback(const Problem& problem, JsonWriter& answer) {
  const FeedbackSign sign =
      problem.choice("sign") == "positive" ? FeedbackSign::positive : FeedbackSign::negative;
  // Without a system on the way back the outputs return as they are.
  const bool unity = !problem.has("back");
  return connect_both(problem, "forward", unity ? "forward" : "back", answer,
                      [&](const auto& forward, const auto& back) {
                        return unity ? feedback(forward, sign) : feedback(forward, back, sign);
                      });
}

}  // namespace

std::vector<Kind> interconnection_kinds() {
  using namespace field;
  const std::vector<Field> time{or_first(domain), any_period};
  constexpr std::string_view two =
      R"({"first": {"A": [[-1]], "B": [[1]]}, "second": {"A": [[-2]], "B": [[2]]}})";
  return {
      {"series", "the first system's outputs as the second one's inputs: G₂G₁",
       std::vector{system("first", "a", "m", "c", "the system at the input"),
                   system("second", "b", "c", "p", "the system at the output")} +
           time,
       answered_system("a+b", "m", "p"), two,
       &solve_pair<[](const auto& a, const auto& b) { return series(a, b); }>},
      {"parallel", "both systems on the same inputs, their outputs added: G₁ + G₂",
       std::vector{system("first", "a", "m", "p", "one system"),
                   system("second", "b", "m", "p", "the other")} +
           time,
       answered_system("a+b", "m", "p"), two,
       &solve_pair<[](const auto& a, const auto& b) { return parallel(a, b); }>},
      {"append", "both systems side by side, inputs and outputs stacked: diag(G₁, G₂)",
       std::vector{system("first", "a", "m", "p", "whose inputs and outputs come first"),
                   system("second", "b", "u", "y", "whose inputs and outputs come last")} +
           time,
       answered_system("a+b", "m+u", "p+y"), two,
       &solve_pair<[](const auto& a, const auto& b) { return append(a, b); }>},
      {"feedback", "a system with its outputs led back to its inputs: (I ± G₁G₂)⁻¹G₁",
       std::vector{system("forward", "a", "m", "p", "the system from input to output"),
                   optional(system("back", "b", "p", "m",
                                   "the system from output to input, none if left out")),
                   or_first(choice("sign", "negative positive",
                                   "with which the feedback is added to the input"))} +
           time,
       answered_system("s", "m", "p"),
       R"({"forward": {"A": [[-1]], "B": [[1]]}, "back": {"A": [[-2]], "B": [[2]]}})",
       &solve_feedback},
  };
}

}  // namespace flyball::solve
