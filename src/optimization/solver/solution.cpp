#include <flyball/optimization/solver/solution.hpp>

namespace flyball::optimization {

std::string_view to_string(SolveStatus status) {
  switch (status) {
    case SolveStatus::solved:
      return "solved";
    case SolveStatus::acceptable:
      return "acceptable";
    case SolveStatus::infeasible:
      return "infeasible";
    case SolveStatus::unbounded:
      return "unbounded";
    case SolveStatus::iteration_limit:
      return "iteration limit";
    case SolveStatus::time_limit:
      return "time limit";
    case SolveStatus::stopped:
      return "stopped";
    case SolveStatus::no_progress:
      return "no progress";
    case SolveStatus::not_finite:
      return "not finite";
  }
  return "";
}

}  // namespace flyball::optimization
