#include <flyball/solve/solver.hpp>

#include <array>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/text.hpp>

#include "solve/kernels.hpp"

namespace flyball::solve {

namespace {

using Json = nlohmann::json;
using Kernel = Outcome (*)(ProblemReader&, AnswerWriter&);

constexpr std::array kinds{
    SolveKind{"dare", "A B Q R", "N", "X K poles residual condition"},
    SolveKind{"care", "A B Q R", "N", "X K poles residual condition"},
    SolveKind{"lyapunov", "A Q", "", "X residual condition"},
    SolveKind{"discrete-lyapunov", "A Q", "", "X residual condition"},
    SolveKind{"sylvester", "A B C", "", "X residual condition"},
    SolveKind{"discrete-sylvester", "A B C", "", "X residual condition"},
    SolveKind{"expm", "A", "", "X"},
    SolveKind{"logm", "A", "", "X"},
    SolveKind{"powm", "A power", "", "X"},
    SolveKind{"c2d", "A B T", "C D method prewarp Q R", "A B C D Q R"},
    SolveKind{"d2c", "A B T", "C D method prewarp", "A B C D"},
    SolveKind{"lqr", "A B Q R", "N T domain", "K S poles residual condition"},
    SolveKind{"place", "A B poles", "", "K poles condition"},
    SolveKind{"kalman", "A C Q R", "", "K P poles P_posterior L residual condition"},
    SolveKind{"gramians", "A B C domain", "", "Wc Wo stable hankel_singular_values"},
    SolveKind{"analyze", "A B domain", "C D T",
              "controllable observable stabilizable detectable …"},
    SolveKind{"simulate", "A B u domain", "C D T x0", "x y"},
};

constexpr std::array<Kernel, kinds.size()> kernels{
    solve_dare,      solve_care,
    solve_lyapunov,  solve_discrete_lyapunov,
    solve_sylvester, solve_discrete_sylvester,
    solve_expm,      solve_logm,
    solve_powm,      solve_c2d,
    solve_d2c,       solve_lqr,
    solve_place,     solve_kalman,
    solve_gramians,  solve_analyze,
    solve_simulate,
};

SolveAnswer refused(AnswerWriter& answer, const Json* id, const Error& error) {
  answer.begin(id);
  answer.add(error);
  return {answer.end(), false, error.kind()};
}

}  // namespace

std::span<const SolveKind> solve_kinds() {
  return kinds;
}

Expected<Solver> Solver::create(std::string_view kind) {
  std::vector<std::string_view> names;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    if (kinds[k].name == kind) {
      return Solver(k);
    }
    names.push_back(kinds[k].name);
  }
  const std::string nearest = nearest_name(kind, names);
  return tl::unexpected(Error(ArgumentError::unknown_name)
                            .in("solve")
                            .about("kind of problem")
                            .got("\"" + std::string(kind.substr(0, 40)) + "\"")
                            .expected(fmt::format("one of {}", fmt::join(names, ", ")))
                            .hint(nearest.empty() ? "" : "did you mean \"" + nearest + "\"?"));
}

std::string Solver::error_json(const Error& error) {
  AnswerWriter answer;
  answer.begin(nullptr);
  answer.add(error);
  return answer.end();
}

bool Solver::is_complete(std::string_view text) {
  return Json::accept(text);
}

SolveAnswer Solver::solve(std::string_view problem) const {
  AnswerWriter answer;
  const SolveKind& kind = kinds[index_];
  const auto object = parse_object(problem, kind.name, "problem");
  if (!object) {
    return refused(answer, nullptr, object.error());
  }
  const auto found = object->find("id");
  const Json* const id = found == object->end() ? nullptr : &*found;
  if (const Outcome fields = check_fields(*object, kind.name, kind.fields, kind.optional);
      !fields) {
    return refused(answer, id, fields.error());
  }
  ProblemReader reader(*object, kind.name);
  answer.begin(id);
  if (const Outcome outcome = kernels[index_](reader, answer); !outcome) {
    return refused(answer, id, outcome.error());
  }
  return {answer.end(), true, ErrorKind::no_answer};
}

}  // namespace flyball::solve
