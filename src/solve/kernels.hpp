#pragma once

#include "io/answer_writer.hpp"
#include "solve/problem_reader.hpp"

/// The kinds of problems that `solve` knows: each reads a problem whose fields are there, and
/// leaves fields in the answer or an error.
namespace flyball::solve {

using Outcome = Expected<void>;

[[nodiscard]] Outcome solve_dare(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_care(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_lyapunov(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_discrete_lyapunov(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_sylvester(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_discrete_sylvester(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_expm(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_logm(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_powm(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_c2d(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_d2c(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_lqr(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_place(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_kalman(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_gramians(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_analyze(ProblemReader& problem, AnswerWriter& answer);
[[nodiscard]] Outcome solve_simulate(ProblemReader& problem, AnswerWriter& answer);

}  // namespace flyball::solve
