#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <flyball/core/argument.hpp>
#include <flyball/planning/trajectory/path_trajectory.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "planning/trajectory/cell_rows.hpp"
#include "planning/trajectory/jerk_timing.hpp"
#include "planning/trajectory/motion_limit.hpp"
#include "planning/trajectory/timing.hpp"
#include "planning/trajectory/timing_cells.hpp"

namespace flyball {

namespace {

using detail::Bezier2;
using detail::CellRows;
using detail::TimingCell;
using detail::TimingPasses;
using detail::TimingRows;

constexpr std::string_view in_time_optimal = "time_optimal";
/// Into how many one is cut at most, each time.
constexpr int most_parts = 8;
/// Intervals of a path in the end, at most, of `coarse` to begin with: what is left of the time
/// falls with the square of their number. Twice what any of 340 motions of the tests and benchmarks
/// takes; limits that no number of intervals uses up (of 1e-300 beside 1) would take all there are.
std::size_t most_intervals(std::size_t coarse, double tolerance) {
  return static_cast<std::size_t>((2'000.0 + 30.0 * static_cast<double>(coarse)) *
                                  std::sqrt(TimingOptions{}.tolerance / tolerance));
}

/// @errors ArgumentError::out_of_range where nothing limits the velocity.
Expected<void> check_limited(const Path& path, const std::vector<TimingCell>& cells,
                             const TimingRows& rows) {
  constexpr double unlimited = 1e200;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (!(rows.idle[i] < unlimited)) {
      const double span = path.pieces()[cells[i].piece].span;
      const double from = path.breaks()[cells[i].piece] + cells[i].from * span;
      return refusal(ArgumentError::out_of_range, in_time_optimal, "constraints")
          .got(detail::format("none on the velocity from parameter {:.4g} to {:.4g}", from,
                              from + cells[i].width))
          .expected("a limit of each motion of the path")
          .hint("limit the velocity of all that moves there");
    }
  }
  return {};
}

/// The programs of a path's intervals, solved, and the intervals cut.
class Timing {
 public:
  Timing(const Path& path, CellRows& limits, std::vector<TimingCell> coarse, double first,
         double last, double tolerance)
      : path_(path),
        limits_(limits),
        cells(std::move(coarse)),
        first_(first),
        last_(last),
        tolerance_(tolerance),
        most_cells_(most_intervals(cells.size(), std::min(tolerance, TimingOptions{}.tolerance))) {}

  /// @errors ArgumentError::out_of_range where nothing limits the velocity, or where limits that
  /// jump are not kept to.
  Expected<void> solve() {
    limits_.fill(cells, {}, rows);
    FLYBALL_CHECK(check_limited(path_, cells, rows));
    pass();
    if (!limits_.verify(cells, passes.b, rows, off_)) {
      pass();
      limits_.verify(cells, passes.b, rows, off_);
    }
    bool again = true;  // a cut was not as fine as asked for
    bool slow = false;
    for (int round = 0; round < most_refinements && cells.size() < most_cells_; ++round) {
      if (round > 0 && !again && tolerance_ >= one_round) {
        break;
      }
      std::vector<double> left(cells.size());
      for (std::size_t i = 0; i < cells.size(); ++i) {
        left[i] = limits_.left(cells, i, passes.b[i], rows);
      }
      const std::vector<double> loss = detail::losses(cells, passes.b, left);
      const double time = detail::total_duration(cells, passes.b);
      double sum = 0.0;
      for (const double one : loss) {
        sum += one;
      }
      const double allowed = (slow ? 1.0 : loss_of_gap) * tolerance_ * time;
      if (round > 0 && sum <= allowed) {
        break;
      }
      const double of_each = allowed / static_cast<double>(cells.size());
      again = cut([&](std::size_t i) { return std::sqrt(loss[i] / of_each); }) > 2 * most_parts;
      pass();
      // One cut makes the loss smaller by its square where limits are smooth, but only by itself
      // where the motion is from rest or to it along an interval that is far too long.
      slow = slow || time > far_too_slow * detail::total_duration(cells, passes.b);
      again = again || slow;
      if (tolerance_ < one_round) {
        limits_.verify(cells, passes.b, rows, off_);
      }
    }
    for (int round = 0; round < most_rounds; ++round) {
      if (round > 0) {
        pass();
      }
      if (limits_.verify(cells, passes.b, rows, off_)) {
        return {};
      }
      // Polynomials that are far off ask for shorter intervals, the others for some room.
      if (round < most_cuts && cells.size() < most_cells_ &&
          *std::max_element(off_.begin(), off_.end()) > far_off) {
        cut([&](std::size_t i) { return off_[i] > far_off ? std::sqrt(off_[i] / far_off) : 0.0; });
      }
    }
    return refusal(ArgumentError::out_of_range, in_time_optimal, "constraints")
        .got("limits that jump along the path")
        .expected("limits that a motion can keep to")
        .hint("smooth the path, or raise the limits");
  }

 private:
  static constexpr int most_rounds = 24;
  static constexpr int most_cuts = 4;
  static constexpr int most_refinements = 8;
  /// The sum of the losses before the last cut over how far the time is from the fastest after it,
  /// as 200 paths of two and of seven coordinates have it on the average.
  static constexpr double loss_of_gap = 3.5;
  /// The tolerance that one cut meets.
  static constexpr double one_round = 1e-3;
  /// The time before the first cut over that after it: more tells of long intervals.
  static constexpr double far_too_slow = 1.15;
  /// Of a limit.
  static constexpr double far_off = 0.02;

  void pass() {
    detail::pass_back(cells, rows, last_, passes);
    detail::pass_forward(cells, rows, first_, passes);
  }
  /// Each interval into one part and as many more as `more` says, up to `most_parts`, and of all no
  /// more than there may be: then each into a share of what it asks for.
  /// @return The most that it says.
  template <class More>
  double cut(const More& more) {
    double most = 0.0;
    std::vector<int> parts(cells.size());
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const double wanted = more(i);
      most = std::max(most, wanted);
      parts[i] = 1 + static_cast<int>(std::min<double>(most_parts - 1, wanted));
    }
    detail::share_out(parts, most_cells_);
    std::vector<Bezier2> motion;
    if (limits_.is_put_about()) {
      motion = passes.b;
    }
    detail::refine(cells, motion, parts);
    limits_.fill(cells, motion, rows);
    return most;
  }

  const Path& path_;
  CellRows& limits_;

 public:
  std::vector<TimingCell> cells;
  TimingRows rows;
  TimingPasses passes;

 private:
  double first_;
  double last_;
  double tolerance_;
  std::size_t most_cells_;
  std::vector<double> off_;
};

/// How far a coordinate goes back and forth, at most.
double travel_of(const Path& path, Eigen::Index j) {
  double sum = 0.0;
  for (const PathPiece& piece : path.pieces()) {  // |∫ q'| <= Σ |c_k| over t in [0, 1]
    const Eigen::MatrixXd& c = piece.coefficients;
    sum += c.row(j)
               .tail(c.cols() - 1)
               .cwiseAbs()
               .dot(Eigen::RowVectorXd::LinSpaced(c.cols() - 1, 1.0,
                                                  static_cast<double>(c.cols() - 1)));
  }
  return sum;
}

/// Where only accelerations are limited, the velocity that they reach over the path is a limit,
/// too, which never binds: v² = v_0² + 2 a · travel, times 1.0001.
std::vector<PathConstraint> with_reachable_velocity(const Path& path,
                                                    std::span<const PathConstraint> constraints,
                                                    const TimingOptions& options) {
  const double start = std::max(options.start_velocity, options.end_velocity);
  const auto reached = [&](double acceleration, double travel) {
    return 1.0001 * std::sqrt(start * start + 2.0 * acceleration * travel);
  };
  std::vector<PathConstraint> all(constraints.begin(), constraints.end());
  for (PathConstraint& constraint : all) {
    if (auto* of = std::get_if<CoordinateLimits>(&constraint);
        of != nullptr && of->acceleration.size() == path.coordinates()) {
      if (of->velocity.size() == 0) {
        of->velocity = Eigen::VectorXd::Constant(path.coordinates(), TravelLimits::none);
      }
      for (Eigen::Index j = 0; j < std::min(of->velocity.size(), of->acceleration.size()); ++j) {
        const double travel = travel_of(path, j);
        if (std::isinf(of->velocity(j)) && of->acceleration(j) > 0.0 && travel > 0.0) {
          of->velocity(j) = reached(of->acceleration(j), travel);
        }
      }
    } else if (auto* travel = std::get_if<TravelLimits>(&constraint);
               travel != nullptr && std::isinf(travel->velocity) && path.coordinates() >= 2) {
      const double acceleration = std::min(travel->acceleration, travel->total_acceleration);
      if (acceleration > 0.0) {
        travel->velocity = reached(acceleration, travel_of(path, 0) + travel_of(path, 1));
      }
    }
  }
  return all;
}

/// x at an end of the path for a velocity there.
double end_rate(const Path& path, double parameter, double velocity) {
  const double rate = velocity > 0.0 ? velocity / path.at(parameter).first.norm() : 0.0;
  return rate * rate;
}

Refusal end_refusal(std::string_view name, double wanted, double possible) {
  return refusal(ArgumentError::out_of_range, in_time_optimal, name)
      .got(format_number(wanted))
      .expected("at most " + format_number(possible) + " under the limits")
      .hint("lower it, or raise the limits");
}

/// Whether turning rates are those of the way, of a path of the plane.
bool faces(std::span<const PathConstraint> constraints) {
  return std::any_of(constraints.begin(), constraints.end(), [](const PathConstraint& constraint) {
    const auto* travel = std::get_if<TravelLimits>(&constraint);
    const auto* stretch = std::get_if<StretchLimits>(&constraint);
    return std::holds_alternative<DifferentialDriveLimits>(constraint) ||
           (travel != nullptr && std::isfinite(travel->angular_acceleration)) ||
           (stretch != nullptr && std::isfinite(stretch->limits.angular_acceleration));
  });
}

/// Whether the whole jerk of travel is limited, so that the curvature may not jump.
bool sways(std::span<const PathConstraint> constraints) {
  return std::any_of(constraints.begin(), constraints.end(), [](const PathConstraint& constraint) {
    const auto* travel = std::get_if<TravelLimits>(&constraint);
    const auto* stretch = std::get_if<StretchLimits>(&constraint);
    return (travel != nullptr && std::isfinite(travel->total_jerk)) ||
           (stretch != nullptr && std::isfinite(stretch->limits.total_jerk));
  });
}

/// Whether a coordinate's jerk is limited, so that no acceleration may jump.
bool bends(std::span<const PathConstraint> constraints) {
  return std::any_of(constraints.begin(), constraints.end(), [](const PathConstraint& constraint) {
    const auto* of = std::get_if<CoordinateLimits>(&constraint);
    return of != nullptr && (of->jerk.array() < TravelLimits::none).any();
  });
}

/// Caps of single places at the ends of intervals.
/// @errors ArgumentError::out_of_range for a start faster than that.
Expected<void> limit_places(const Path& path,
                            const std::vector<std::unique_ptr<detail::MotionLimit>>& limits,
                            std::vector<TimingCell>& cells, double first, double start_velocity) {
  for (const auto& limit : limits) {
    const std::optional<double> place = limit->place();
    if (!place) {
      continue;
    }
    std::vector<double> caps(limit->cap_names.size());
    const auto most = [&](const PathState& state) {
      limit->evaluate(state, *place, nullptr, caps.data());
      double largest = 0.0;
      for (const double cap : caps) {
        largest = std::max(largest, cap);
      }
      return largest > 0.0 ? 1.0 / largest : std::numeric_limits<double>::infinity();
    };
    constexpr double near = 1e-9;
    const double tolerance = near * path.parameter_end();
    if (*place <= tolerance && *place >= -tolerance) {
      const double possible = most(path.at(0, 0.0));
      if (first > possible * (1.0 + near)) {
        return end_refusal("start velocity", start_velocity,
                           start_velocity * std::sqrt(possible / first));
      }
    }
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const double span = path.pieces()[cells[i].piece].span;
      const double end = path.breaks()[cells[i].piece] + cells[i].to * span;
      if (std::abs(end - *place) <= tolerance) {
        cells[i].most = std::min(cells[i].most, most(path.at(cells[i].piece, cells[i].to)));
        if (i + 1 < cells.size() && cells[i].join > 0.0) {
          const double after = most(path.at(cells[i + 1].piece, cells[i + 1].from));
          cells[i].most = std::min(cells[i].most, after / cells[i].join);
        }
      }
    }
  }
  return {};
}

Expected<std::vector<PathTrajectory::Span>> spans_of(const Path& path,
                                                     const std::vector<TimingCell>& cells,
                                                     const std::vector<Bezier2>& motion) {
  std::vector<PathTrajectory::Span> spans;
  spans.reserve(cells.size());
  double t = 0.0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Bezier2& b = motion[i];
    const TimingCell& cell = cells[i];
    const double duration = detail::cell_duration(b, cell.width);
    spans.push_back({t, duration, cell.from * path.pieces()[cell.piece].span, cell.width,
                     std::sqrt(b[0]), (b[1] - b[0]) / cell.width,
                     (b[0] - 2.0 * b[1] + b[2]) / (cell.width * cell.width), 0.0, cell.piece,
                     1.0 / path.pieces()[cell.piece].span});
    t += duration;
    if (!std::isfinite(t)) {
      return refusal(ArgumentError::out_of_range, in_time_optimal, "constraints")
          .got("limits that let nothing move")
          .expected("limits that a motion can keep to")
          .with("parameter", path.breaks()[cell.piece] + spans.back().parameter);
    }
  }
  return spans;
}

}  // namespace

Expected<PathTrajectory> time_optimal(const Path& path, std::span<const PathConstraint> constraints,
                                      const TimingOptions& options) {
  FLYBALL_CHECK(Checks(in_time_optimal)
                    .not_negative(options.start_velocity, "start velocity")
                    .not_negative(options.end_velocity, "end velocity")
                    .within(options.tolerance, 1e-6, 0.1, "tolerance"));
  if (constraints.empty()) {
    return refusal(ArgumentError::empty, in_time_optimal, "constraints").expected("one or more");
  }
  const std::vector<PathConstraint> bounded = with_reachable_velocity(path, constraints, options);
  FLYBALL_TRY(auto limits, detail::motion_limits(path, bounded, in_time_optimal));
  bool cubic = bounded.size() == 1 && std::holds_alternative<CoordinateLimits>(bounded[0]);
  for (const PathPiece& piece : path.pieces()) {
    cubic = cubic && piece.coefficients.cols() <= 4;
  }
  std::vector<std::vector<double>> cuts;
  for (const auto& limit : limits) {
    std::vector<double> t;
    for (std::size_t i = 0; i < path.pieces().size(); ++i) {
      t.clear();
      limit->jumps(path, i, t);
      if (!t.empty()) {
        cuts.resize(path.pieces().size());
        cuts[i].insert(cuts[i].end(), t.begin(), t.end());
      }
    }
  }
  for (auto& at : cuts) {
    std::sort(at.begin(), at.end());
    double before = 0.0;
    std::erase_if(at, [&](double t) {
      const bool near = t - before < 1e-9 || t > 1.0 - 1e-9;
      before = near ? before : t;
      return near;
    });
  }
  detail::JointRules rules{
      .accelerates = false,
      .faces = (path.coordinates() == 2 && faces(constraints)) || sways(constraints)};
  bool jerks = false;
  for (const auto& limit : limits) {
    jerks = jerks || !limit->jerk_names.empty();
    rules.accelerates = rules.accelerates || !limit->row_names.empty() || jerks;
  }
  rules.bends = bends(constraints);
  std::vector<TimingCell> cells_of_path = detail::coarse_cells(path, cuts, rules);
  double first = end_rate(path, 0.0, options.start_velocity);
  double last = end_rate(path, path.parameter_end(), options.end_velocity);
  FLYBALL_CHECK(limit_places(path, limits, cells_of_path, first, options.start_velocity));
  if (!rules.accelerates) {  // the velocity jumps to its limit at once
    first = last = std::numeric_limits<double>::infinity();
  }
  const std::unique_ptr<CellRows> making =
      cubic ? detail::cubic_rows(path, std::get<CoordinateLimits>(bounded[0]))
            : detail::collocated_rows(path, std::move(limits));

  // Where jerks are limited it is what that motion begins with.
  Timing timing(path, *making, std::move(cells_of_path), first, last,
                jerks ? std::max(options.tolerance, TimingOptions{}.tolerance) : options.tolerance);
  FLYBALL_CHECK(timing.solve());
  const std::vector<TimingCell>& cells = timing.cells;
  const TimingPasses& passes = timing.passes;
  constexpr double rounding = 1.0 + 1e-9;
  if (rules.accelerates && first > passes.highest.front() * rounding) {
    return end_refusal("start velocity", options.start_velocity,
                       options.start_velocity * std::sqrt(passes.highest.front() / first));
  }
  if (rules.accelerates && last > passes.b.back()[2] * rounding) {
    return end_refusal("end velocity", options.end_velocity,
                       options.end_velocity * std::sqrt(passes.b.back()[2] / last));
  }

  std::vector<PathTrajectory::Span> spans;
  if (jerks) {
    FLYBALL_TRY(const auto held, detail::motion_limits(path, bounded, in_time_optimal));
    FLYBALL_TRY(spans, detail::jerk_limited(path, *making, held, cells, passes.b,
                                            {first, last, options.tolerance, !rules.bends}));
  } else {
    FLYBALL_TRY(spans, spans_of(path, cells, passes.b));
  }
  // Whose square is a double: s = s0 + v t + ½ a t².
  constexpr double longest = 1e150;
  const double t = spans.back().start + spans.back().duration;
  if (!(t <= longest)) {
    return refusal(ArgumentError::out_of_range, in_time_optimal, "the motion")
        .got(detail::format("one of {:.3g} s", t))
        .expected("one of at most 1e150 s")
        .hint("measure lengths in another unit");
  }
  return PathTrajectory(path, std::move(spans),
                        std::vector<PathConstraint>(constraints.begin(), constraints.end()));
}

}  // namespace flyball
