#include <flyball/planning/drive/optimize_drive.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "planning/drive/check_drive.hpp"
#include "planning/drive/drive_guess.hpp"
#include "planning/drive/drive_margins.hpp"
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

constexpr std::string_view in_optimize_drive = "drive trajectory";
constexpr int most_tightenings = 5;
constexpr int coarse = 40;    // instants of an interval that are looked at while solving
constexpr double bar = 1e-3;  // m, rad and shares of limits that a simulation may be off by

/// A start that led to a trajectory.
struct Attempt {
  Layout layout;
  OptimalControlSolver solver;
  std::vector<double> headings{};  ///< rad, of the waypoints.
  OptimalControlSolution found{};
};

class Search {
 public:
  using Watch = FunctionRef<bool(const DriveProgress&)>;

  Search(const DriveProblem& problem, const DriveOptions& options, Watch watch)
      : problem_(problem), options_(options), watch_(watch) {}

  Expected<DriveSolution> run() {
    const auto choices = drive_guess::choices(problem_, std::max(1, options_.max_attempts));
    choose_mesh(choices.front());
    std::optional<Attempt> best;
    std::optional<Attempt> nearest;
    std::size_t chosen = 0;
    double least = 0.0;
    for (std::size_t i = 0; i < choices.size() && !over(); ++i) {
      const Guess guess = drive_guess::guess(problem_, choices[i], coarse_mesh_);
      FLYBALL_TRY(Attempt attempt, attempt_of(guess, coarse_mesh_));
      for (const double barrier : {first_barrier, far_barrier}) {
        attempt.found = solve(attempt.solver, attempt.layout, guess.name, barrier);
        if (attempt.found.solved() || over()) {
          break;
        }
      }
      const DriveAttempt& told = result_.attempts.back();
      if (told.solved && (!best || told.duration < least - 1e-6)) {
        least = told.duration;
        result_.best = told.name;
        best = std::move(attempt);
        chosen = i;
      } else if (!nearest || attempt.found.infeasibility < nearest->found.infeasibility) {
        nearest = std::move(attempt);
      }
    }
    if (best && parts_ > 1) {
      to_full_mesh(*best, choices[chosen]);
    }
    if (best) {
      if (!tighten(*best)) {
        refine(*best);
      }
      judge();
      return finish();
    }
    if (over()) {
      result_.message = stopped_ ? "stopped" : "the time limit is over";
      if (nearest) {
        take(nearest->layout, nearest->found, coarse);
      }
      return finish();
    }
    return elastic(choices.front());
  }

 private:
  /// Of the barrier, where the start is a guess, and where it is a solution on a coarser mesh.
  /// Of both, about what the time weighs against the bounds: a larger one would first lead to the
  /// middle of them all, at several times the duration.
  static constexpr double first_barrier = 1e-4;
  static constexpr double finer_barrier = 1e-5;
  /// Where a start is far from any trajectory: by way of that middle.
  static constexpr double far_barrier = 0.1;
  /// What an interval of the coarse mesh, on which starts are compared, is cut into.
  static constexpr int usual_parts = 3;

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

  void note(const std::string& name, const Layout& layout, const OptimalControlSolution& found) {
    double duration = 0.0;  // without the price of forces
    for (std::size_t s = 0; s + 1 < layout.first.size(); ++s) {
      duration += found.states(layout.duration(), layout.begin(s));
    }
    result_.attempts.push_back({.name = name,
                                .solved = found.solved(),
                                .duration = duration,
                                .iterations = found.counts.iterations,
                                .seconds = found.seconds});
  }

  /// Starts are compared on a mesh with a third of the intervals, where these are free to choose.
  void choose_mesh(const drive_guess::Choice& choice) {
    std::vector<int> mesh;
    static_cast<void>(drive_guess::guess(problem_, choice, mesh, usual_parts));
    const bool divisible = std::all_of(mesh.begin(), mesh.end(), [](int n) {
      return n % usual_parts == 0 && n >= 4 * usual_parts;
    });
    parts_ = divisible ? usual_parts : 1;
    coarse_mesh_.clear();
    if (parts_ > 1) {
      for (const int n : mesh) {
        coarse_mesh_.push_back(n / parts_);
      }
    } else {
      static_cast<void>(drive_guess::guess(problem_, choice, coarse_mesh_));
    }
  }

  /// Solves on the full mesh, from the solution on the coarse one, or else from its start. Where
  /// neither is solved, that on the coarse mesh stays.
  void to_full_mesh(Attempt& best, const drive_guess::Choice& choice) {
    std::vector<int> mesh;
    const std::string name = result_.best;
    Guess guess = drive_guess::finer(problem_, best.layout, best.found, parts_, mesh);
    guess.headings = best.headings;
    for (const bool from_coarse : {true, false}) {
      if (!from_coarse) {
        guess = drive_guess::guess(problem_, choice, mesh);
      }
      auto attempt = attempt_of(guess, mesh);
      if (!attempt || over()) {
        return;
      }
      attempt->found = solve(attempt->solver, attempt->layout, name + ", full mesh",
                             from_coarse ? finer_barrier : first_barrier);
      if (attempt->found.solved()) {
        best = *std::move(attempt);
        return;
      }
    }
  }

  OptimalControlSolution solve(OptimalControlSolver& solver, const Layout& layout,
                               const std::string& name, double barrier) {
    SolverOptions options = solver_options();
    options.first_barrier = barrier;
    options.regularization_growth = 8.0;  // a swerve drive's takes a quarter of the time
    OptimalControlSolution found =
        solver.solve(options, [&](const optimization::Iteration& iteration) {
          stopped_ = stopped_ || watch_({.attempt = name,
                                         .iteration = iteration.number,
                                         .duration = iteration.cost,
                                         .infeasibility = iteration.infeasibility});
          return stopped_;
        });
    note(name, layout, found);
    return found;
  }

  drive_check::Excesses take(const Layout& layout, const OptimalControlSolution& found,
                             int instants) {
    drive_transcription::write_samples(problem_, layout, found, result_);
    drive_check::Excesses excesses;
    const DriveCheck check = drive_check::check(problem_, result_.samples, result_.waypoint_samples,
                                                instants, &excesses);
    result_.waypoint_error = check.waypoint_error;
    result_.heading_error = check.heading_error;
    result_.violations = check.violations;
    return excesses;
  }

  /// Draws limits that are exceeded between points tighter by as much, and solves again.
  /// @return whether they are kept then.
  bool tighten(Attempt& best) {
    Margins margins = drive_transcription::no_margins(best.layout);
    drive_check::Excesses excesses = take(best.layout, best.found, coarse);
    for (int round = 0; round < most_tightenings && !over(); ++round) {
      if (!drive_margins::tighten(problem_, best.layout, result_.samples, excesses,
                                  options_.keep_limits_to, margins)) {
        break;
      }
      if (!best.solver.set_data(drive_transcription::data_of(best.layout, margins))) {
        break;
      }
      OptimalControlSolution again = best.solver.resolve(solver_options());
      note(result_.best + ", limits drawn tighter", best.layout, again);
      if (!again.solved()) {
        break;
      }
      excesses = take(best.layout, again, coarse);
      best.found = std::move(again);
    }
    return worst() <= 2.0 * options_.keep_limits_to;
  }

  /// The same with intervals half as long, from the trajectory that was found.
  void refine(Attempt& best) {
    if (over()) {
      return;
    }
    std::vector<int> mesh;
    Guess guess = drive_guess::finer(problem_, best.layout, best.found, 2, mesh);
    guess.name = result_.best + ", intervals halved";
    guess.headings = best.headings;
    auto finer = attempt_of(guess, mesh);
    if (!finer) {
      return;
    }
    for (const double barrier : {finer_barrier, far_barrier}) {
      finer->found = solve(finer->solver, finer->layout, guess.name, barrier);
      if (finer->found.solved() || over()) {
        break;
      }
    }
    if (!finer->found.solved()) {
      return;
    }
    const DriveSolution before = result_;
    result_.best = guess.name;
    tighten(*finer);
    if (worst() < worst_of(before)) {
      best = *std::move(finer);
    } else {
      std::vector<DriveAttempt> attempts = std::move(result_.attempts);
      result_ = before;
      result_.attempts = std::move(attempts);
    }
  }

  /// The largest share of a limit, m of a waypoint and rad of a heading that it is off by.
  [[nodiscard]] static double worst_of(const DriveSolution& s) {
    const double share = s.violations.empty() ? 0.0 : s.violations.front().share;
    return std::max({share, s.waypoint_error, s.heading_error});
  }
  [[nodiscard]] double worst() const { return worst_of(result_); }

  /// Looks at what was found at a hundred instants of each interval: a success, or not.
  void judge() {
    const DriveCheck check = check_drive(problem_, result_.samples, result_.waypoint_samples);
    result_.waypoint_error = check.waypoint_error;
    result_.heading_error = check.heading_error;
    result_.violations = check.violations;
    result_.found = true;
    result_.solved = false;
    if (!(result_.waypoint_error <= bar)) {
      result_.message = flyball::detail::format("a simulation misses a waypoint by {} m",
                                                format_number(result_.waypoint_error, 3));
    } else if (!(result_.heading_error <= bar)) {
      result_.message = flyball::detail::format("a simulation misses a heading by {} rad",
                                                format_number(result_.heading_error, 3));
    } else if (!result_.violations.empty() && !(result_.violations.front().share <= bar)) {
      const DriveViolation& v = result_.violations.front();
      result_.message = flyball::detail::format(
          "the trajectory exceeds {} by {} {} {}, at {} s, between points of its mesh: shorter "
          "intervals keep it",
          v.name, format_number(v.amount, 3), v.unit, where_of(v), format_number(v.time, 4));
    } else {
      result_.solved = true;
    }
    for (std::size_t s = 0; s + 1 < result_.waypoint_times.size(); ++s) {
      if (result_.solved && result_.waypoint_times[s + 1] - result_.waypoint_times[s] >
                                0.999 * options_.longest_segment) {
        result_.message = flyball::detail::format(
            "the way from waypoint {} to {} takes the longest time that a segment may, {} s", s,
            s + 1, format_number(options_.longest_segment, 4));
      }
    }
    if (result_.solved && over()) {
      result_.message = stopped_ ? "stopped: not all starts were tried"
                                 : "the time limit is over: not all starts were tried";
    }
  }

  [[nodiscard]] std::string where_of(const DriveViolation& v) const {
    return v.segment + 1 < static_cast<int>(problem_.waypoints.size())
               ? flyball::detail::format("between waypoints {} and {}", v.segment, v.segment + 1)
               : flyball::detail::format("at waypoint {}", v.segment);
  }

  Expected<Attempt> attempt_of(const Guess& guess, const std::vector<int>& intervals) {
    Layout layout(problem_, intervals, false);
    layout.longest = options_.longest_segment;
    optimization::OptimalControlProblem ocp =
        drive_transcription::transcribe(problem_, layout, guess);
    const auto start = drive_transcription::start_of(problem_, layout, guess);
    ocp.set_start(start.states, start.inputs);
    FLYBALL_TRY_IN(in_optimize_drive, OptimalControlSolver solver, OptimalControlSolver::make(ocp));
    return Attempt{std::move(layout), std::move(solver), guess.headings};
  }

  /// What cannot be kept gives way, at a price, so that as little as possible does.
  Expected<DriveSolution> elastic(const drive_guess::Choice& choice) {
    const Guess guess = drive_guess::guess(problem_, choice, coarse_mesh_);
    Layout layout(problem_, coarse_mesh_, true);
    layout.longest = options_.longest_segment;
    FLYBALL_TRY_IN(
        in_optimize_drive, OptimalControlSolver solver,
        OptimalControlSolver::make(drive_transcription::transcribe(problem_, layout, guess)));
    const auto start = drive_transcription::start_of(problem_, layout, guess);
    FLYBALL_CHECK(solver.set_start(start.states, start.inputs));
    const OptimalControlSolution found = solve(solver, layout, "constraints give way", far_barrier);
    result_.elastic = true;
    result_.best = result_.attempts.back().name;
    take(layout, found, coarse);
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
      result_.elastic = false;
      from_elastic(layout, found, guess);
      judge();
    } else {
      const DriveViolation& v = result_.relaxed.front();
      result_.message = flyball::detail::format(
          "the constraints contradict each other: {} cannot be kept; the nearest trajectory "
          "exceeds it by {} {} {}, at {} s",
          v.name, format_number(v.amount, 3), v.unit, where_of(v), format_number(v.time, 4));
    }
    for (std::size_t i = 0; i + 1 < problem_.waypoints.size() && !result_.solved; ++i) {
      const double wanted = guess.durations(static_cast<Eigen::Index>(i));
      if (wanted > options_.longest_segment) {
        result_.message = flyball::detail::format(
            "the way from waypoint {} to {} takes about {} s within its limits, and a segment may "
            "take {} s (the longest segment); without more time, {}",
            i, i + 1, format_number(wanted, 3), format_number(options_.longest_segment, 4),
            result_.message);
        break;
      }
    }
    return finish();
  }

  /// Goes on from a trajectory that was found where constraints could give way and did not.
  void from_elastic(const Layout& layout, const OptimalControlSolution& found,
                    const Guess& elastic_guess) {
    std::vector<int> mesh;
    Guess guess = drive_guess::finer(problem_, layout, found, 1, mesh);
    guess.headings = elastic_guess.headings;
    auto attempt = attempt_of(guess, mesh);
    if (!attempt || over()) {
      return;
    }
    attempt->found = solve(attempt->solver, attempt->layout,
                           result_.best + ", from where none had to", finer_barrier);
    if (attempt->found.solved()) {
      result_.best = result_.attempts.back().name;
      if (!tighten(*attempt)) {
        refine(*attempt);
      }
    }
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
  int parts_ = 1;
  std::vector<int> coarse_mesh_{};  ///< Intervals of each segment.
};

}  // namespace

Expected<DriveSolution> optimize_drive(const DriveProblem& problem, const DriveOptions& options) {
  return optimize_drive(problem, options, [](const DriveProgress&) { return false; });
}

Expected<DriveSolution> optimize_drive(const DriveProblem& problem, const DriveOptions& options,
                                       FunctionRef<bool(const DriveProgress&)> watch) {
  FLYBALL_CHECK(drive_rules::check(problem));
  FLYBALL_CHECK(Checks(in_optimize_drive)
                    .positive(options.tolerance, "the tolerance")
                    .within(options.max_iterations, 1, 100000, "the most iterations")
                    .positive(options.time_limit, "the time limit", "s")
                    .positive(options.longest_segment, "the longest segment", "s")
                    .within(options.max_attempts, 1, 100, "the most attempts")
                    .positive(options.keep_limits_to, "what limits are kept to"));
  return Search(problem, options, watch).run();
}

}  // namespace flyball
