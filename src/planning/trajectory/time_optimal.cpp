#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <flyball/core/argument.hpp>
#include <flyball/planning/path/edit_path.hpp>
#include <flyball/planning/trajectory/path_trajectory.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "planning/trajectory/cell_rows.hpp"
#include "planning/trajectory/motion_limit.hpp"
#include "planning/trajectory/timing.hpp"

namespace flyball {

namespace {

using detail::Bezier2;
using detail::CellRows;
using detail::TimingCell;
using detail::TimingPasses;
using detail::TimingRows;

constexpr std::string_view where = "time_optimal";
/// Intervals of a piece in the first pass.
constexpr int first_cells = 3;
/// Into how many one is cut at most, each time.
constexpr int most_parts = 8;
constexpr std::size_t most_cells = 200'000;

/// Whether a piece goes anywhere.
bool moves(const PathPiece& piece) {
  const Eigen::MatrixXd& c = piece.coefficients;
  return c.cols() > 1 && c.rightCols(c.cols() - 1).cwiseAbs().maxCoeff() > 0.0;
}

/// What a timing asks of a path's joints.
struct JointRules {
  bool accelerates = true;  ///< Whether an acceleration is limited; else velocities may jump.
  bool faces = false;       ///< Whether turning rates are those of the way, and may not jump.
};

/// How x goes on from one piece to the next: (|q'-|/|q'+|)²; at a corner, and where the curvature
/// of a way that is faced jumps, 0.
double join_of(const Path& path, std::size_t piece, std::size_t next, const JointRules& rules) {
  const PathState at_end = path.at(piece, 1.0);
  const PathState at_begin = path.at(next, 0.0);
  const PathVector& before = at_end.first;
  const PathVector& after = at_begin.first;
  const double v = before.norm();
  const double w = after.norm();
  if (!(v > 0.0) || !(w > 0.0)) {
    return 0.0;
  }
  if ((before / v - after / w).norm() > corner_angle) {
    return 0.0;
  }
  if (rules.faces) {
    constexpr double rounding = 1e-6;
    const double bend = planar_curvature(at_end);
    const double next_bend = planar_curvature(at_begin);
    if (std::abs(bend - next_bend) > rounding * (std::abs(bend) + std::abs(next_bend)) + 1e-9) {
      return 0.0;
    }
  }
  const double ratio = v / w;
  return std::abs(ratio - 1.0) < 1e-9 ? 1.0 : ratio * ratio;
}

/// The intervals of the first pass.
std::vector<TimingCell> coarse_cells(const Path& path, const std::vector<std::vector<double>>& cuts,
                                     const JointRules& rules) {
  std::vector<TimingCell> cells;
  cells.reserve(path.pieces().size() * first_cells);
  for (std::size_t i = 0; i < path.pieces().size(); ++i) {
    const PathPiece& piece = path.pieces()[i];
    if (!moves(piece)) {
      continue;
    }
    double from = 0.0;
    const std::size_t parts = cuts.empty() ? 1 : cuts[i].size() + 1;
    for (std::size_t k = 0; k < parts; ++k) {
      const double to = k + 1 < parts ? cuts[i][k] : 1.0;
      for (int m = 0; m < first_cells; ++m) {
        const double a = from + (to - from) * m / first_cells;
        const double b = m + 1 == first_cells ? to : from + (to - from) * (m + 1) / first_cells;
        cells.push_back({i, a, b, (b - a) * piece.span, 1.0});
      }
      from = to;
    }
    std::size_t next = i + 1;
    while (next < path.pieces().size() && !moves(path.pieces()[next])) {
      ++next;
    }
    if (next < path.pieces().size()) {
      const double join = join_of(path, i, next, rules);
      cells.back().join = join > 0.0 || rules.accelerates ? join : -1.0;
    }
  }
  return cells;
}

double total_time(const std::vector<TimingCell>& cells, const std::vector<Bezier2>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const double duration = detail::cell_duration(b[i], cells[i].width);
    sum += std::isfinite(duration) ? duration : 0.0;
  }
  return sum;
}

/// What each interval costs: its time times the share of the limits that it leaves. Where x is
/// smallest that share slows down the way to it and from it, too.
std::vector<double> losses(const std::vector<TimingCell>& cells, const std::vector<Bezier2>& b,
                           const CellRows& limits, const TimingRows& rows) {
  const std::size_t n = cells.size();
  std::vector<double> left(n);
  std::vector<double> time(n);
  std::vector<double> loss(n);
  for (std::size_t i = 0; i < n; ++i) {
    left[i] = limits.left(cells, i, b[i], rows);
    time[i] = detail::cell_duration(b[i], cells[i].width);
    loss[i] = left[i] * time[i];
  }
  for (std::size_t i = 1; i < n; ++i) {
    const double x = b[i][0];
    if (!(x < b[i - 1][0] && x <= b[i][2])) {
      continue;
    }
    double weight = 0.0;
    for (std::size_t k = i; k < n && b[k][2] >= b[k][0]; ++k) {
      weight += time[k] * x / b[k][2];
    }
    for (std::size_t k = i; k-- > 0 && b[k][0] >= b[k][2];) {
      weight += time[k] * x / b[k][0];
    }
    for (std::size_t k = i > 1 ? i - 2 : 0; k < std::min(n, i + 2); ++k) {
      const double share = k == i || k + 1 == i ? 2.0 : 1.0;
      loss[k] = std::max(loss[k], share * left[k] * weight);
    }
  }
  return loss;
}

/// The part of a parabola between two shares of its interval.
Bezier2 part_of(const Bezier2& b, double from, double to) {
  const auto blossom = [&](double s, double t) {
    return (1.0 - s) * (1.0 - t) * b[0] + (s + t - 2.0 * s * t) * b[1] + s * t * b[2];
  };
  return {blossom(from, from), blossom(from, to), blossom(to, to)};
}

/// Intervals cut into parts, and a motion on them.
void refine(std::vector<TimingCell>& cells, std::vector<Bezier2>& motion,
            const std::vector<int>& parts) {
  std::vector<TimingCell> finer;
  std::vector<Bezier2> on_finer;
  std::size_t count = 0;
  for (const int part : parts) {
    count += static_cast<std::size_t>(part);
  }
  finer.reserve(count);
  on_finer.reserve(motion.empty() ? 0 : count);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const TimingCell& cell = cells[i];
    const double share = 1.0 / parts[i];
    for (int m = 0; m < parts[i]; ++m) {
      TimingCell part = cell;
      part.from = cell.from + (cell.to - cell.from) * share * m;
      part.to = m + 1 == parts[i] ? cell.to : cell.from + (cell.to - cell.from) * share * (m + 1);
      part.width = cell.width * share;
      if (m + 1 < parts[i]) {
        part.join = 1.0;
        part.most = std::numeric_limits<double>::infinity();
      }
      finer.push_back(part);
      if (!motion.empty()) {
        on_finer.push_back(part_of(motion[i], share * m, share * (m + 1)));
      }
    }
  }
  cells = std::move(finer);
  motion = std::move(on_finer);
}

/// @errors ArgumentError::out_of_range where nothing limits the velocity.
Expected<void> check_limited(const Path& path, const std::vector<TimingCell>& cells,
                             const TimingRows& rows) {
  constexpr double unlimited = 1e200;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (!(rows.idle[i] < unlimited)) {
      const double span = path.pieces()[cells[i].piece].span;
      const double from = path.breaks()[cells[i].piece] + cells[i].from * span;
      return refusal(ArgumentError::out_of_range, where, "constraints")
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
        tolerance_(tolerance) {}

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
    for (int round = 0; round < most_refinements && cells.size() < most_cells; ++round) {
      if (round > 0 && !again && tolerance_ >= one_round) {
        break;
      }
      const std::vector<double> loss = losses(cells, passes.b, limits_, rows);
      const double time = total_time(cells, passes.b);
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
      slow = slow || time > far_too_slow * total_time(cells, passes.b);
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
      if (round < most_cuts && cells.size() < most_cells &&
          *std::max_element(off_.begin(), off_.end()) > far_off) {
        cut([&](std::size_t i) { return off_[i] > far_off ? std::sqrt(off_[i] / far_off) : 0.0; });
      }
    }
    return refusal(ArgumentError::out_of_range, where, "constraints")
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
  /// Each interval into one part and as many more as `more` says, up to `most_parts`.
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
    std::vector<Bezier2> motion;
    if (limits_.is_put_about()) {
      motion = passes.b;
    }
    refine(cells, motion, parts);
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
  return refusal(ArgumentError::out_of_range, where, name)
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

}  // namespace

Expected<PathTrajectory> time_optimal(const Path& path, std::span<const PathConstraint> constraints,
                                      const TimingOptions& options) {
  FLYBALL_CHECK(Checks(where)
                    .not_negative(options.start_velocity, "start velocity")
                    .not_negative(options.end_velocity, "end velocity")
                    .within(options.tolerance, 1e-6, 0.1, "tolerance"));
  if (constraints.empty()) {
    return refusal(ArgumentError::empty, where, "constraints").expected("one or more");
  }
  const std::vector<PathConstraint> bounded = with_reachable_velocity(path, constraints, options);
  FLYBALL_TRY(auto limits, detail::motion_limits(path, bounded, where));
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
  JointRules rules{.accelerates = false, .faces = path.coordinates() == 2 && faces(constraints)};
  for (const auto& limit : limits) {
    rules.accelerates = rules.accelerates || !limit->row_names.empty();
  }
  std::vector<TimingCell> cells_of_path = coarse_cells(path, cuts, rules);
  double first = end_rate(path, 0.0, options.start_velocity);
  double last = end_rate(path, path.parameter_end(), options.end_velocity);
  FLYBALL_CHECK(limit_places(path, limits, cells_of_path, first, options.start_velocity));
  if (!rules.accelerates) {  // the velocity jumps to its limit at once
    first = last = std::numeric_limits<double>::infinity();
  }
  const std::unique_ptr<CellRows> making =
      cubic ? detail::cubic_rows(path, std::get<CoordinateLimits>(bounded[0]))
            : detail::collocated_rows(path, std::move(limits));

  Timing timing(path, *making, std::move(cells_of_path), first, last, options.tolerance);
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
  spans.reserve(cells.size());
  double t = 0.0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Bezier2& b = passes.b[i];
    const TimingCell& cell = cells[i];
    const double duration = detail::cell_duration(b, cell.width);
    spans.push_back({t, duration, cell.from * path.pieces()[cell.piece].span, cell.width,
                     std::sqrt(b[0]), (b[1] - b[0]) / cell.width,
                     (b[0] - 2.0 * b[1] + b[2]) / (cell.width * cell.width), cell.piece,
                     1.0 / path.pieces()[cell.piece].span});
    t += duration;
    if (!std::isfinite(t)) {
      return refusal(ArgumentError::out_of_range, where, "constraints")
          .got("limits that let nothing move")
          .expected("limits that a motion can keep to")
          .with("parameter", path.breaks()[cell.piece] + spans.back().parameter);
    }
  }
  return PathTrajectory(path, std::move(spans),
                        std::vector<PathConstraint>(constraints.begin(), constraints.end()));
}

}  // namespace flyball
