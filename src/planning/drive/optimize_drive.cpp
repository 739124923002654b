#include <flyball/planning/drive/optimize_drive.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "planning/drive/drive_guess.hpp"
#include "planning/drive/drive_rules.hpp"
#include "planning/drive/drive_transcription.hpp"

namespace flyball {

using drive_transcription::Guess;
using drive_transcription::Layout;
using drive_transcription::Margins;
using optimization::OptimalControlSolution;
using optimization::OptimalControlSolver;
using optimization::SolverOptions;
using optimization::SolveStatus;

namespace {

constexpr std::string_view where = "drive trajectory";
constexpr int most_tightenings = 4;

/// A start that led to a trajectory.
struct Attempt {
  Layout layout;
  OptimalControlSolver solver;
  OptimalControlSolution found{};
};

class Search {
 public:
  using Watch = FunctionRef<bool(const DriveProgress&)>;

  Search(const DriveProblem& problem, const DriveOptions& options, Watch watch)
      : problem_(problem), options_(options), watch_(watch) {}

  Expected<DriveSolution> run() {
    const auto choices = drive_guess::choices(problem_, std::max(1, options_.max_attempts));
    std::optional<Attempt> best;
    std::optional<Attempt> nearest;
    double least = 0.0;
    std::vector<int> intervals;
    for (std::size_t i = 0; i < choices.size() && !over(); ++i) {
      const Guess guess = drive_guess::guess(problem_, choices[i], intervals);
      Layout layout(problem_, intervals, false);
      optimization::OptimalControlProblem ocp =
          drive_transcription::transcribe(problem_, layout, guess);
      const auto start = drive_transcription::start_of(problem_, layout, guess);
      ocp.set_start(start.states, start.inputs);
      FLYBALL_TRY_IN(where, OptimalControlSolver solver, OptimalControlSolver::make(ocp));
      Attempt attempt{std::move(layout), std::move(solver)};
      attempt.found = solve(attempt.solver, guess.name);
      const DriveAttempt& told = result_.attempts.back();
      if (told.solved && (!best || told.duration < least - 1e-6)) {
        least = told.duration;
        result_.best = told.name;
        best = std::move(attempt);
      } else if (!nearest || attempt.found.infeasibility < nearest->found.infeasibility) {
        nearest = std::move(attempt);
      }
    }
    if (best) {
      result_.solved = true;
      tighten(*best);
      return finish();
    }
    if (over()) {
      result_.message = stopped_ ? "stopped" : "the time limit is over";
      if (nearest) {
        take(nearest->layout, nearest->found);
      }
      return finish();
    }
    return elastic(choices.front(), intervals);
  }

 private:
  /// Of the barrier, where the start is a guess.
  static constexpr double first_barrier = 1.0;

  [[nodiscard]] double elapsed() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }
  [[nodiscard]] bool over() const { return stopped_ || elapsed() > options_.time_limit; }

  [[nodiscard]] SolverOptions solver_options() const {
    SolverOptions options;
    options.tolerance = options_.tolerance;
    options.max_iterations = options_.max_iterations;
    options.time_limit = std::max(0.0, options_.time_limit - elapsed());
    return options;
  }

  void note(const std::string& name, const OptimalControlSolution& found) {
    result_.attempts.push_back({.name = name,
                                .solved = found.solved(),
                                .duration = found.cost,
                                .iterations = found.counts.iterations,
                                .seconds = found.seconds});
  }

  OptimalControlSolution solve(OptimalControlSolver& solver, const std::string& name) {
    SolverOptions options = solver_options();
    options.first_barrier = first_barrier;
    OptimalControlSolution found =
        solver.solve(options, [&](const optimization::Iteration& iteration) {
          stopped_ = stopped_ || watch_({.attempt = name,
                                         .iteration = iteration.number,
                                         .duration = iteration.cost,
                                         .infeasibility = iteration.infeasibility});
          return stopped_;
        });
    note(name, found);
    return found;
  }

  void take(const Layout& layout, const OptimalControlSolution& found) {
    drive_transcription::write_samples(problem_, layout, found, result_);
    const DriveCheck check = check_drive(problem_, result_.samples, result_.waypoint_samples);
    result_.waypoint_error = check.waypoint_error;
    result_.heading_error = check.heading_error;
    result_.violations = check.violations;
  }

  /// Draws limits that are exceeded between points tighter by as much, and solves again.
  void tighten(Attempt& best) {
    Margins margins;
    margins.constraints.assign(problem_.constraints.size(), 0.0);
    take(best.layout, best.found);
    for (int round = 0; round < most_tightenings && !over(); ++round) {
      bool any = false;
      for (const DriveViolation& v : result_.violations) {
        const double beyond = v.constraint >= 0 && v.unit == "m" ? v.amount : v.share;
        if (beyond <= options_.keep_limits_to) {
          continue;
        }
        if (v.constraint >= 0) {
          margins.constraints[static_cast<std::size_t>(v.constraint)] += 1.1 * v.amount;
          any = true;
        } else if (v.name.starts_with("speed")) {
          margins.wheel_speed = std::max(margins.wheel_speed, last_speed_margin_ + 2.2 * v.share);
          any = true;
        } else if (v.name.starts_with("torque") || v.name.starts_with("grip")) {
          margins.motor_line = std::max(margins.motor_line, last_line_margin_ + 1.1 * v.share);
          any = true;
        }
      }
      if (!any) {
        return;
      }
      last_speed_margin_ = margins.wheel_speed;
      last_line_margin_ = margins.motor_line;
      if (!best.solver.set_data(drive_transcription::data_of(best.layout, margins))) {
        return;
      }
      OptimalControlSolution again = best.solver.resolve(solver_options());
      note(result_.best + ", limits drawn tighter", again);
      if (!again.solved()) {
        result_.message =
            "limits are kept at the points of the mesh, but exceeded between them: see violations";
        return;
      }
      take(best.layout, again);
    }
  }

  /// What cannot be kept gives way, at a price, so that as little as possible does.
  Expected<DriveSolution> elastic(const drive_guess::Choice& choice, std::vector<int> intervals) {
    const Guess guess = drive_guess::guess(problem_, choice, intervals);
    Layout layout(problem_, intervals, true);
    FLYBALL_TRY_IN(
        where, OptimalControlSolver solver,
        OptimalControlSolver::make(drive_transcription::transcribe(problem_, layout, guess)));
    const auto start = drive_transcription::start_of(problem_, layout, guess);
    FLYBALL_CHECK(solver.set_start(start.states, start.inputs));
    const OptimalControlSolution found = solve(solver, "constraints give way");
    result_.elastic = true;
    result_.best = result_.attempts.back().name;
    take(layout, found);
    result_.attempts.back().duration = result_.duration;  // without the price
    for (Eigen::Index i = 0; i < found.parameters.size(); ++i) {
      const double amount = found.parameters(i);
      if (amount <= 1e-4) {
        continue;
      }
      const bool is_waypoint = i >= layout.constraints;
      const int number = static_cast<int>(is_waypoint ? i - layout.constraints : i);
      DriveViolation v{.amount = amount, .share = amount};
      if (is_waypoint) {
        v.name = flyball::detail::format("waypoint {}", number);
        v.unit = "m";
        v.segment = number;
        v.time = result_.waypoint_times[static_cast<std::size_t>(number)];
      } else {
        const auto c = static_cast<std::size_t>(number);
        v.name = drive_rules::name_of(problem_, c);
        v.unit = drive_rules::unit_of(problem_.constraints[c].kind);
        v.constraint = number;
        const auto worst =
            std::find_if(result_.violations.begin(), result_.violations.end(),
                         [&](const DriveViolation& other) { return other.constraint == number; });
        if (worst != result_.violations.end()) {
          v.segment = worst->segment;
          v.time = worst->time;
          v.amount = worst->amount;
          v.share = worst->share;
        }
      }
      if (v.amount > 1e-3) {
        result_.relaxed.push_back(std::move(v));
      }
    }
    std::sort(result_.relaxed.begin(), result_.relaxed.end(),
              [](const DriveViolation& a, const DriveViolation& b) { return a.share > b.share; });
    if (!found.solved()) {
      result_.message = flyball::detail::format("no trajectory was found: {}", found.message);
      if (!result_.relaxed.empty()) {
        result_.message =
            flyball::detail::format("no trajectory was found; farthest from being kept is {}: {}",
                                    result_.relaxed.front().name, found.message);
      }
    } else if (result_.relaxed.empty()) {
      // What gives way by nothing holds: a start that the others did not have.
      result_.solved = true;
      result_.elastic = false;
    } else {
      const DriveViolation& v = result_.relaxed.front();
      result_.message = flyball::detail::format(
          "the constraints contradict each other: {} cannot be kept; the nearest trajectory "
          "exceeds it by {} {} {}, at {} s",
          v.name, format_number(v.amount, 3), v.unit,
          v.segment + 1 < static_cast<int>(problem_.waypoints.size())
              ? flyball::detail::format("between waypoints {} and {}", v.segment, v.segment + 1)
              : flyball::detail::format("at waypoint {}", v.segment),
          format_number(v.time, 4));
    }
    return finish();
  }

  DriveSolution finish() {
    result_.seconds = elapsed();
    return std::move(result_);
  }

  const DriveProblem& problem_;
  const DriveOptions& options_;
  Watch watch_;
  DriveSolution result_{};
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  bool stopped_ = false;
  double last_speed_margin_ = 0.0;
  double last_line_margin_ = 0.0;
};

}  // namespace

Expected<DriveSolution> optimize_drive(const DriveProblem& problem, const DriveOptions& options) {
  return optimize_drive(problem, options, [](const DriveProgress&) { return false; });
}

Expected<DriveSolution> optimize_drive(const DriveProblem& problem, const DriveOptions& options,
                                       FunctionRef<bool(const DriveProgress&)> watch) {
  FLYBALL_CHECK(drive_rules::check(problem));
  FLYBALL_CHECK(Checks(where)
                    .positive(options.tolerance, "the tolerance")
                    .within(options.max_iterations, 1, 100000, "the most iterations")
                    .positive(options.time_limit, "the time limit", "s")
                    .within(options.max_attempts, 1, 100, "the most attempts")
                    .positive(options.keep_limits_to, "what limits are kept to"));
  return Search(problem, options, watch).run();
}

}  // namespace flyball
