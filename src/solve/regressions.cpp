#include <vector>

#include <flyball/math/regression/bounded_least_squares.hpp>
#include <flyball/math/regression/least_squares.hpp>

#include "core/constants.hpp"
#include "core/try.hpp"
#include "solve/row.hpp"

// Regressions.
namespace flyball::solve {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// The place of a choice among those of its row, in the order of an enum.
template <class Enum>
Enum choice_of(const Problem& problem, std::string_view name,
               std::initializer_list<std::string_view> names) {
  int index = 0;
  for (const std::string_view each : names) {
    if (each == problem.choice(name)) {
      break;
    }
    ++index;
  }
  return static_cast<Enum>(index);
}

Outcome solve_least_squares(const Problem& problem, JsonWriter& answer) {
  LeastSquaresOptions options;
  options.errors =
      choice_of<ErrorModel>(problem, "errors", {"classical", "hc0", "hc1", "hc2", "hc3", "hac"});
  options.confidence = problem.number("confidence");
  if (problem.has("lags")) {
    options.lags = problem.integer("lags");
  }
  if (problem.has("weights")) {
    options.weights = problem.matrix("weights");
  }
  if (problem.has("C") != problem.has("d")) {
    return refusal(ArgumentError::malformed, "least-squares", "C β = d")
        .got("without one of C and d")
        .expected("both or neither");
  }
  if (problem.has("C")) {
    options.equality = {problem.matrix("C"), problem.matrix("d")};
  }
  FLYBALL_TRY(const LeastSquares fit,
              least_squares(problem.matrix("X"), problem.matrix("y"), options));
  answer.add("coefficients", fit.coefficients);
  answer.add("standard_errors", fit.standard_errors);
  answer.add("intervals", fit.intervals);
  answer.add("p_values", fit.p_values);
  answer.add("covariance", fit.covariance);
  answer.add("rank", fit.rank);
  answer.add("undetermined", fit.undetermined);
  answer.add("variance", fit.variance);
  answer.add("r_squared", fit.r_squared);
  answer.add("adjusted_r_squared", fit.adjusted_r_squared);
  answer.add("residuals", fit.residuals);
  answer.add("leverage", fit.leverage);
  answer.add("durbin_watson", fit.durbin_watson);
  answer.add("condition", fit.condition);
  return {};
}

Outcome solve_bounded(const Problem& problem, JsonWriter& answer) {
  const Index p = problem.matrix("X").cols();
  const auto bounds = [&](std::string_view name, double otherwise) {
    return problem.has(name) ? VectorXd(problem.matrix(name)) : VectorXd::Constant(p, otherwise);
  };
  FLYBALL_TRY(const BoundedLeastSquares fit,
              bounded_least_squares(problem.matrix("X"), problem.matrix("y"), bounds("lower", 0.0),
                                    bounds("upper", infinity)));
  answer.add("coefficients", fit.coefficients);
  VectorXd bound(p);
  for (Index j = 0; j < p; ++j) {
    const BoundState state = fit.state[static_cast<std::size_t>(j)];
    bound(j) = state == BoundState::at_lower ? -1.0 : state == BoundState::at_upper ? 1.0 : 0.0;
  }
  answer.add("bound", bound);
  answer.add("gradient", fit.gradient);
  answer.add("residual_norm", fit.residual_norm);
  return {};
}

}  // namespace

std::vector<Kind> regression_kinds() {
  using namespace field;
  const Field X = matrix("X", "k", "v", "the regressors, a row a sample");
  const Field y = samples("y", "k", "1", "what Xβ should be");
  return {
      {"least-squares",
       "the β that minimises Σ w (y - Xβ)², with its errors and what the data do not tell (14.1)",
       {X, y, optional(list("weights", "k", "", "1/variance of each sample")),
        optional(matrix("C", "e", "v", "of constraints C β = d")),
        optional(list("d", "e", "", "of constraints C β = d")),
        or_first(choice("errors", "classical hc0 hc1 hc2 hc3 hac",
                        "what is assumed of the samples' errors: independent of one variance, "
                        "independent, or correlated in time")),
        optional(integer("lags", "samples over which errors are correlated, for hac")),
        or_number(number("confidence", "", "of the intervals"), 0.95)},
       {list("coefficients", "v", "", "β; the shortest where the data do not tell all"),
        unbounded(list("standard_errors", "v", "", "infinite for what the data do not tell")),
        unbounded(matrix("intervals", "v", "2", "lower and upper end")),
        list("p_values", "v", "", "of as large a coefficient if it were zero"),
        unbounded(matrix("covariance", "v", "v", "of the coefficients")),
        integer("rank", "how many combinations of coefficients the data tell"),
        matrix("undetermined", "v", "l", "directions in which β may change without a trace"),
        unbounded(number("variance", "", "of the samples' errors")),
        number("r_squared", "", "share of y's variance that is explained"),
        unbounded(number("adjusted_r_squared", "", "less what chance explains")),
        list("residuals", "k", "", "y - Xβ"),
        list("leverage", "k", "", "how much each sample decides its own value, up to 1"),
        number("durbin_watson", "", "near 2 where neighbouring residuals are not correlated"),
        condition},
       R"({"X": [[1, 0], [1, 1], [1, 2], [1, 3]], "y": [1, 3, 4, 4]})",
       &solve_least_squares},
      {"bounded-least-squares",
       "the β between bounds that minimises ‖y - Xβ‖; not negative where none are told",
       {X, y, optional(list("lower", "v", "", "bounds; zero if left out")),
        optional(list("upper", "v", "", "bounds; none if left out"))},
       {list("coefficients", "v", "", "β"),
        list("bound", "v", "", "-1 at the lower bound, 1 at the upper one, else 0"),
        list("gradient", "v", "", "Xᵀ(Xβ - y)"), number("residual_norm", "", "‖y - Xβ‖")},
       R"({"X": [[1, 1], [1, 2], [1, 3]], "y": [0, 2, 4]})",
       &solve_bounded},
  };
}

}  // namespace flyball::solve
