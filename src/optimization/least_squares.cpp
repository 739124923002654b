#include <flyball/optimization/least_squares.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <flyball/core/argument.hpp>
#include <flyball/core/random.hpp>

#include "core/constants.hpp"
#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "optimization/evaluation.hpp"

namespace flyball::optimization {

namespace {

/// In the linearised problem, so small that only directions without any effect are held by it.
constexpr double no_damping = 1e-22;
/// A change of the cost that is smaller than this share of it is not told from rounding.
constexpr double cost_noise = 1e-11;

/// Where the iteration stands.
struct Point {
  VectorXd x{};
  double cost = 0.0;
  ArrowSystem system{};
  BoxStep full{};  ///< The step of no damping, which the optimality is measured by.
  double optimality = 0.0;
};

/// The iteration, from a point to the next.
class LevenbergMarquardt {
 public:
  LevenbergMarquardt(const LeastSquaresProblem& problem, const LeastSquaresOptions& options)
      : evaluator_(problem),
        options_(options),
        largest_norms_(VectorXd::Zero(evaluator_.parameters())) {}

  Expected<LeastSquaresResult> run() {
    const VectorXd start =
        evaluator_.problem().start.cwiseMax(evaluator_.lower()).cwiseMin(evaluator_.upper());
    auto first = look(start);
    if (!first) {
      return no_start(start);
    }
    at_ = *std::move(first);
    LeastSquaresResult result;
    result.start_cost = at_.cost;
    std::optional<LeastSquaresStop> stop = ended(result.start_cost);
    for (; !stop && result.iterations < options_.max_iterations; ++result.iterations) {
      if (!step()) {
        stop = LeastSquaresStop::rounding;
        break;
      }
      stop = ended(result.start_cost);
    }
    result.stop = stop.value_or(LeastSquaresStop::iteration_limit);
    result.x = at_.x;
    result.cost = at_.cost;
    result.optimality = at_.optimality;
    describe(evaluator_, at_.system, options_.rank_tolerance, result);
    result.converged = result.stop == LeastSquaresStop::optimal ||
                       result.stop == LeastSquaresStop::zero_residual ||
                       (result.stop == LeastSquaresStop::rounding &&
                        std::min(at_.optimality, result.projected_gradient) < good_for_rounding);
    result.evaluations = evaluator_.evaluations;
    result.jacobians = evaluator_.jacobians;
    return result;
  }

 private:
  Refusal no_start(const VectorXd& start) const {
    const std::string block =
        evaluator_.problem().blocks.size() == 1
            ? std::string()
            : flyball::detail::format(" of block {}", evaluator_.failed_block + 1);
    const bool undefined = evaluator_.failed_residual < 0;
    return refusal(LeastSquaresError::no_start, "solve_least_squares",
                   undefined ? flyball::detail::format("the start{}", block)
                             : flyball::detail::format("residual {}{} at the start",
                                                       evaluator_.failed_residual + 1, block))
        .got(undefined ? "outside of where the residuals are defined"
                       : "not finite, or its derivatives are not")
        .expected("finite, with finite derivatives")
        .hint("start elsewhere, or bound the parameters to where the residuals are defined")
        .with("start", std::vector<double>(start.begin(), start.end()));
  }

  [[nodiscard]] VectorXd units() const {
    return (largest_norms_.array() > 0.0).select(largest_norms_, 1.0);
  }

  /// The linearised problem at x, and how far it is from its optimum; nothing where it is not
  /// finite.
  std::optional<Point> look(const VectorXd& x) {
    Point point{.x = x};
    auto system = evaluator_.linearize(x, point.cost);
    if (!system) {
      return std::nullopt;
    }
    point.system = *std::move(system);
    largest_norms_ = largest_norms_.cwiseMax(point.system.column_norms);
    point.full =
        box_step(point.system, evaluator_.lower() - x, evaluator_.upper() - x, no_damping, units());
    point.optimality =
        point.cost > 0.0 ? std::sqrt(std::max(0.0, point.full.decrease) / point.cost) : 0.0;
    return point;
  }

  [[nodiscard]] std::optional<LeastSquaresStop> ended(double start_cost) const {
    // What the rounding of the parameters themselves does to the residuals.
    const double noise =
        epsilon * at_.system.column_norms.cwiseProduct(at_.x.cwiseAbs()).maxCoeff();
    if (std::sqrt(at_.cost) <= std::max(noise, 0.5 * epsilon * std::sqrt(start_cost))) {
      return LeastSquaresStop::zero_residual;
    }
    return at_.optimality <= options_.tolerance ? std::optional(LeastSquaresStop::optimal)
                                                : std::nullopt;
  }

  /// Tries a step. False where none is left to be tried.
  bool step() {
    const VectorXd low = evaluator_.lower() - at_.x;
    const VectorXd high = evaluator_.upper() - at_.x;
    const bool last_digits = at_.optimality * at_.optimality <= cost_noise;
    const BoxStep step = last_digits && damping_growth_ == 2.0
                             ? at_.full
                             : box_step(at_.system, low, high, damping_, units());
    VectorXd trial = at_.x + step.d;
    for (Index i = 0; i < trial.size(); ++i) {  // Bounds are met exactly.
      trial(i) = step.d(i) == low(i) ? evaluator_.lower()(i)
                 : step.d(i) == high(i)
                     ? evaluator_.upper()(i)
                     : std::clamp(trial(i), evaluator_.lower()(i), evaluator_.upper()(i));
    }
    if (trial == at_.x || !(step.decrease > 0.0) || damping_ > most_damping) {
      return false;
    }
    const auto cost = evaluator_.cost(trial);
    if (last_digits) {
      return polish(trial, cost);
    }
    if (cost && at_.cost - *cost > 1e-4 * step.decrease) {
      if (auto next = look(trial)) {
        const double better = 2.0 * (at_.cost - *cost) / step.damped_decrease - 1.0;
        damping_ = std::max(1e-18, damping_ * std::max(1.0 / 3.0, 1.0 - better * better * better));
        damping_growth_ = 2.0;
        at_ = *std::move(next);
        return true;
      }
    }
    damp();
    return true;
  }

  /// Where costs no longer tell which point is better, the optimality does.
  bool polish(const VectorXd& trial, const std::optional<double>& cost) {
    if (cost && *cost <= at_.cost * (1.0 + 1e-12)) {
      if (auto next = look(trial); next && next->optimality < 0.9 * at_.optimality) {
        damping_growth_ = 2.0;
        at_ = *std::move(next);
        return true;
      }
    }
    damp();
    return ++failed_ < 12;
  }

  void damp() {
    damping_ *= damping_growth_;
    damping_growth_ *= 2.0;
  }

  static constexpr double good_for_rounding = 1e-3;  // Bates and Watts's own criterion
  static constexpr double most_damping = 1e40;

  Evaluator evaluator_;
  LeastSquaresOptions options_;
  VectorXd largest_norms_;
  Point at_{};
  double damping_ = 1e-3;  ///< Of the squares of the largest column norms.
  double damping_growth_ = 2.0;
  int failed_ = 0;
};

Expected<void> check_options(const LeastSquaresOptions& options, std::string_view where) {
  return Checks(where)
      .within(options.max_iterations, 0, 1e9, "max_iterations")
      .positive(options.tolerance, "tolerance")
      .positive(options.rank_tolerance, "rank_tolerance");
}

}  // namespace

ErrorInfo error_info(LeastSquaresError code) {
  static constexpr flyball::detail::ErrorRow rows[] = {
      {"no_start", "the residuals are not finite where the fit starts", ErrorKind::no_answer},
      {"no_residuals", "there is nothing to fit", ErrorKind::misuse},
  };
  return flyball::detail::info_of(code, "least_squares", rows);
}

std::string_view to_string(LeastSquaresStop stop) {
  switch (stop) {
    case LeastSquaresStop::optimal:
      return "optimal";
    case LeastSquaresStop::zero_residual:
      return "zero_residual";
    case LeastSquaresStop::rounding:
      return "rounding";
    case LeastSquaresStop::iteration_limit:
      return "iteration_limit";
  }
  return "unknown";
}

Expected<LeastSquaresResult> solve_least_squares(const LeastSquaresProblem& problem,
                                                 const LeastSquaresOptions& options) {
  constexpr std::string_view where = "solve_least_squares";
  FLYBALL_CHECK(check_options(options, where));
  FLYBALL_CHECK(check_problem(problem, where));
  return LevenbergMarquardt(problem, options).run();
}

Expected<MultiStartResult> solve_from_several_starts(const LeastSquaresProblem& problem,
                                                     const MultiStartOptions& options) {
  constexpr std::string_view where = "solve_from_several_starts";
  const Index n = problem.start.size();
  FLYBALL_CHECK(check_problem(problem, where));
  FLYBALL_CHECK(Checks(where).within(options.starts, 1, 1e6, "starts"));
  if (options.from.size() != 0 || options.to.size() != 0) {
    FLYBALL_CHECK(Checks(where)
                      .shape(options.from, n, 1, "from", "parameters x 1")
                      .shape(options.to, n, 1, "to", "parameters x 1")
                      .finite(options.from, "from")
                      .finite(options.to, "to"));
  }
  Random random(options.seed);
  // Column j has each parameter's share of its range at start j: one in each of as many parts.
  const Index drawn = options.starts - 1;
  MatrixXd shares(n, drawn);
  for (Index i = 0; i < n; ++i) {
    std::vector<Index> order(static_cast<std::size_t>(drawn));
    std::iota(order.begin(), order.end(), Index{0});
    for (std::size_t k = order.size(); k > 1; --k) {
      std::swap(order[k - 1], order[random.bits() % k]);
    }
    for (Index j = 0; j < drawn; ++j) {
      shares(i, j) = (static_cast<double>(order[static_cast<std::size_t>(j)]) + random.uniform()) /
                     static_cast<double>(drawn);
    }
  }
  const auto start_of = [&](Index i, double share) {
    const bool ranged = options.from.size() != 0;
    const double low = ranged                      ? options.from(i)
                       : problem.lower.size() != 0 ? problem.lower(i)
                                                   : -infinity;
    const double high = ranged                      ? options.to(i)
                        : problem.upper.size() != 0 ? problem.upper(i)
                                                    : infinity;
    return !std::isfinite(low) || !std::isfinite(high) ? problem.start(i)
           : low > 0.0 && high >= 10.0 * low           ? low * std::pow(high / low, share)
                                                       : low + share * (high - low);
  };
  MultiStartResult made;
  std::optional<Error> failure;
  bool found = false;
  for (Index j = 0; j <= drawn; ++j) {
    LeastSquaresProblem from = problem;
    for (Index i = 0; i < n && j > 0; ++i) {
      from.start(i) = start_of(i, shares(i, j - 1));
    }
    auto result = solve_least_squares(from, options.each);
    if (!result) {
      made.costs.push_back(infinity);
      failure = failure ? std::move(failure) : std::optional(std::move(result).error());
      continue;
    }
    made.costs.push_back(result->cost);
    if (!found || result->cost < made.best.cost) {
      found = true;
      made.best = *std::move(result);
    }
  }
  if (!found) {
    return tl::unexpected(*std::move(failure));
  }
  std::sort(made.costs.begin(), made.costs.end());
  made.agreeing =
      static_cast<int>(std::count_if(made.costs.begin(), made.costs.end(), [&](double cost) {
        return cost <= made.best.cost * (1.0 + 1e-6);
      }));
  return made;
}

}  // namespace flyball::optimization
