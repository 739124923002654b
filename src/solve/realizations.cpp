#include <utility>

#include <flyball/systems/realization.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// The same behaviour in other states, and in fewer.
namespace flyball::solve {

namespace {

Outcome solve_minimal(const Problem& problem, JsonWriter& answer) {
  return with_system(problem, [&](const auto& plant) -> Outcome {
    FLYBALL_TRY(const auto minimal, minimal_realization(plant, problem.number("tolerance")));
    write_system(minimal.system, answer);
    answer.add("unreached", minimal.unreached);
    answer.add("unseen", minimal.unseen);
    answer.add("transform", minimal.T);
    return {};
  });
}

Outcome solve_balanced(const Problem& problem, JsonWriter& answer) {
  return with_system(problem, [&](const auto& plant) -> Outcome {
    FLYBALL_TRY(const auto balanced, problem.has("order")
                                         ? balanced_truncation(plant, problem.integer("order"))
                                         : balanced_realization(plant));
    write_system(balanced.system, answer);
    answer.add("hankel_singular_values", balanced.hankel);
    answer.add("transform", balanced.T);
    answer.add("inverse_transform", balanced.T_inverse);
    answer.add("error_bound", balanced.error_bound);
    return {};
  });
}

Outcome solve_canonical(const Problem& problem, JsonWriter& answer) {
  return with_system(problem, [&](const auto& plant) -> Outcome {
    FLYBALL_TRY(const auto canonical, problem.choice("form") == "controllable"
                                          ? controllable_canonical_form(plant)
                                          : observable_canonical_form(plant));
    write_system(canonical, answer);
    return {};
  });
}

Outcome solve_similarity(const Problem& problem, JsonWriter& answer) {
  return with_system(problem, [&](const auto& plant) -> Outcome {
    FLYBALL_TRY(const auto transformed, similarity_transform(plant, problem.matrix("transform")));
    write_system(transformed, answer);
    return {};
  });
}

}  // namespace

std::vector<Kind> realization_kinds() {
  using namespace field;
  const std::vector<Field> any_system{A, B, C, D, or_first(domain), any_period};
  return {
      {"minimal-realization", "the part of a system that inputs reach and outputs see",
       any_system + std::vector{or_number(
                        number("tolerance", "",
                               "relative changes of the data that may cut off what is left out; "
                               "0 takes 100 n times the rounding error"),
                        0.0)},
       answered_system("r", "m", "p") +
           std::vector{
               integer("unreached", "states that no input moves, left out"),
               integer("unseen", "states that are moved and that no output shows, left out"),
               matrix("transform", "n", "r", "x = transform x' for motions from rest")},
       R"({"A": [[-1, 0], [0, -2]], "B": [[1], [0]], "C": [[1, 1]]})", &solve_minimal},
      {"balanced-realization",
       "a stable system in states that are as easy to reach as to see, all or the strongest of "
       "them",
       any_system + std::vector{optional(integer(
                        "order", "how many of the strongest states to keep, all if left out"))},
       answered_system("r", "m", "p") +
           std::vector{list("hankel_singular_values", "n", "", "of the given system, decreasing"),
                       matrix("transform", "n", "r", "x = transform x'"),
                       matrix("inverse_transform", "r", "n", "x' = inverse_transform x"),
                       number("error_bound", "",
                              "no gain of the difference to the given system exceeds it")},
       R"({"A": [[-1, 0], [0, -10]], "B": [[1], [1]], "C": [[1, 1]], "order": 1})",
       &solve_balanced},
      {"canonical-form",
       "the companion form, whose entries are the transfer function's coefficients",
       any_system + std::vector{or_first(choice("form", "controllable observable",
                                                "of one input, or of one output"))},
       answered_system("n", "m", "p"),
       R"({"A": [[-1, 1], [0, -2]], "B": [[0], [1]], "C": [[1, 0]]})", &solve_canonical},
      {"similarity-transform", "the same system in the states x' = transform⁻¹ x",
       any_system + std::vector{matrix("transform", "n", "n", "x = transform x', invertible")},
       answered_system("n", "m", "p"),
       R"({"A": [[0, 1], [-2, -3]], "B": [[0], [1]], "transform": [[1, 1], [-1, -2]]})",
       &solve_similarity},
  };
}

}  // namespace flyball::solve
