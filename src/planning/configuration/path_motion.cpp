#include <flyball/planning/configuration/path_motion.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <flyball/core/argument.hpp>
#include <flyball/planning/profiles/synchronized_motion.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "planning/configuration/space_model.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_move_along = "move_along";

using States = std::vector<MotionState>;

/// A motion of as many axes as there are at run time: along a line from rest to rest, or from any
/// states, all arriving at once.
class Group {
 public:
  /// Along the line: one profile from 0 to 1 that keeps the limits of all axes.
  static Group along_line(const std::vector<MotionLimits>& limits, const std::vector<double>& start,
                          const std::vector<double>& goal) {
    constexpr double none = std::numeric_limits<double>::infinity();
    MotionLimits all{none, none, none, none, none};
    Group group;
    bool moves = false;
    for (std::size_t k = 0; k < limits.size(); ++k) {
      const double by = goal[k] - start[k];
      group.start_.push_back({start[k], 0.0, 0.0});
      group.by_.push_back(by);
      if (by == 0.0) {
        continue;
      }
      moves = true;
      const MotionLimits own = by > 0.0 ? limits[k].both_ways() : limits[k].mirrored();
      const double size = std::abs(by);
      all.velocity = std::min(all.velocity, own.velocity / size);
      all.acceleration = std::min(all.acceleration, own.acceleration / size);
      all.deceleration = std::min(all.deceleration, own.deceleration / size);
      all.jerk = std::min(all.jerk, own.jerk / size);
    }
    all.reverse_velocity = all.velocity;
    if (moves) {
      group.line_.emplace(all, MotionState{}, MotionState{1.0, 0.0, 0.0});
      group.total_ = group.line_->total_time();
    }
    return group;
  }

  /// From any states to rest; accelerations without a limit of jerk are ramped within a
  /// millisecond.
  static Group in_time(std::vector<MotionLimits> limits, const States& start, const States& goal) {
    constexpr double ramp = 1e-3;
    for (MotionLimits& one : limits) {
      one.jerk = std::min(one.jerk, one.acceleration / ramp);
    }
    Group group;
    group.axes_.resize(limits.size());
    AxisMotions motions{limits.data(), start.data(),       goal.data(),
                        nullptr,       group.axes_.data(), static_cast<int>(group.axes_.size())};
    group.total_ = detail::synchronize(motions, Synchronization::time, 0.0);
    return group;
  }

  [[nodiscard]] double total() const { return total_; }
  [[nodiscard]] States sample(double t) const {
    States all;
    for (const AxisMotion& axis : axes_) {
      all.push_back(axis.sample(t));
    }
    if (axes_.empty()) {
      const MotionState s = line_ ? line_->sample(t) : MotionState{};
      for (std::size_t k = 0; k < start_.size(); ++k) {
        all.push_back({start_[k].position + s.position * by_[k], s.velocity * by_[k],
                       s.acceleration * by_[k]});
      }
    }
    return all;
  }

 private:
  std::vector<AxisMotion> axes_{};
  std::optional<SCurveProfile> line_{};
  States start_{};
  std::vector<double> by_{};
  double total_ = 0.0;
};

/// A part of a motion: a group from a time on.
struct Part {
  Group group;
  double begin;
  double end;
};

/// Whether a group keeps all constraints from a time on, to its end.
bool keeps(const ConfigurationSpace& space, const Group& group,
           const std::vector<MotionLimits>& limits) {
  const detail::SpaceModel& model = space.model();
  std::vector<double> rates(model.exact.rate_count());
  std::array<double, detail::most_axes> q{};
  std::array<double, detail::most_axes> most{};
  constexpr int most_steps = 20'000;
  constexpr double least = 1e-6;  // s
  double t = 0.0;
  double step = 0.05;
  for (int i = 0; i < most_steps; ++i) {
    const States at = group.sample(t);
    // The farthest that each axis can go within the step.
    for (std::size_t k = 0; k < at.size(); ++k) {
      const MotionLimits all = limits[k].both_ways();
      const double a = std::max(all.acceleration, all.deceleration);
      q[k] = at[k].position;
      most[k] = std::abs(at[k].velocity) * step + 0.5 * a * step * step;
      const SpaceAxis& axis = model.axes[k];
      if (!axis.wraps && (q[k] < axis.low - 1e-9 || q[k] > axis.high + 1e-9)) {
        return false;
      }
    }
    const detail::InverseRates<double> inverse =
        detail::inverse_rates(model.exact, most.data(), rates.data());
    const double reach = std::min(
        1.0, rates.empty() ? 1.0 : detail::reach_of(model.exact.view(), q.data(), inverse));
    if (reach >= 1.0) {
      t += step;
      if (t >= group.total()) {
        return true;
      }
      step = std::min(2.0 * step, 0.1);
    } else {
      step *= reach > 0.0 ? std::max(0.9 * reach, 0.1) : 0.1;
      if (step < least) {
        return false;
      }
    }
  }
  return false;
}

Expected<void> check_options(const ConfigurationSpace& space,
                             std::span<const std::vector<double>> path,
                             const PathMotionOptions& options) {
  const std::size_t n = space.axes().size();
  if (options.limits.size() != n) {
    return refusal(ArgumentError::wrong_shape, in_move_along, "limits")
        .got(detail::format("{} entries", options.limits.size()))
        .expected(detail::format("one for each of the {} axes", n));
  }
  for (std::size_t k = 0; k < n; ++k) {
    const MotionLimits all = options.limits[k].both_ways();
    const std::string& name = space.axes()[k].name;
    FLYBALL_CHECK(Checks(in_move_along)
                      .positive(all.velocity, name + ": velocity")
                      .positive(all.acceleration, name + ": acceleration")
                      .positive(all.deceleration, name + ": deceleration")
                      .positive(all.reverse_velocity, name + ": reverse velocity"));
    if (!(all.jerk > 0.0)) {
      return refusal(ArgumentError::not_positive, in_move_along, name + ": jerk")
          .got(format_number(all.jerk))
          .expected("positive, or infinite");
    }
  }
  FLYBALL_CHECK(check_positive(options.period, in_move_along, "period", "s"));
  if (path.size() < 2) {
    return refusal(ArgumentError::empty, in_move_along, "path")
        .got(detail::format("{} waypoints", path.size()))
        .expected("two or more");
  }
  return {};
}

States at_rest(const std::vector<double>& q) {
  States all;
  for (const double x : q) {
    all.push_back({x, 0.0, 0.0});
  }
  return all;
}

/// Rest to rest along each line. In phase, so that the way is the line.
void go_along_lines(std::span<const std::vector<double>> path, const PathMotionOptions& options,
                    std::vector<Part>& parts, PathMotion& motion) {
  double begin = 0.0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    Group group = Group::along_line(options.limits, path[i], path[i + 1]);
    const double end = begin + group.total();
    parts.push_back({std::move(group), begin, end});
    motion.arrivals.push_back(end);
    begin = end;
  }
}

/// To each waypoint in turn; on to the next as soon as that is proven.
void go_in_sequence(const ConfigurationSpace& tight, std::span<const std::vector<double>> path,
                    const PathMotionOptions& options, std::vector<Part>& parts,
                    PathMotion& motion) {
  double begin = 0.0;
  std::size_t target = 1;
  Group now = Group::along_line(options.limits, path[0], path[1]);
  while (true) {
    const double total = now.total();
    if (target + 1 == path.size()) {
      parts.push_back({std::move(now), begin, begin + total});
      motion.arrivals.push_back(begin + total);
      return;
    }
    bool turned = false;
    for (double t = options.period; t < total; t += options.period) {
      const States at = now.sample(t);
      std::vector<double> q;
      std::vector<double> by;
      for (std::size_t k = 0; k < at.size(); ++k) {
        q.push_back(at[k].position);
        by.push_back(path[target + 1][k] - at[k].position);
      }
      if (!tight.check_move(q, by).free) {
        continue;
      }
      Group next = Group::in_time(options.limits, at, at_rest(path[target + 1]));
      if (keeps(tight, next, options.limits)) {
        parts.push_back({std::move(now), begin, begin + t});
        begin += t;
        motion.arrivals.push_back(begin);
        now = std::move(next);
        turned = true;
        break;
      }
    }
    if (!turned) {
      parts.push_back({std::move(now), begin, begin + total});
      begin += total;
      motion.arrivals.push_back(begin);
      now = Group::along_line(options.limits, path[target], path[target + 1]);
    }
    ++target;
  }
}

Expected<void> tabulate(const ConfigurationSpace& space, const std::vector<Part>& parts,
                        const PathMotionOptions& options, PathMotion& motion) {
  constexpr double most_rows = 1e6;
  if (!(motion.duration / options.period < most_rows)) {
    return refusal(ArgumentError::out_of_range, in_move_along, "the motion")
        .got(format_number(motion.duration) + " s long")
        .expected("at most a million periods long")
        .hint("raise the limits or the period");
  }
  const std::size_t n = space.axes().size();
  std::vector<double> time;
  std::vector<std::array<std::vector<double>, 3>> columns(n);
  std::size_t part = 0;
  motion.clearance = std::numeric_limits<double>::infinity();
  std::vector<double> q(n);
  const auto add = [&](double t) {
    while (part + 1 < parts.size() && t >= parts[part].end) {
      ++part;
    }
    const States at = parts[part].group.sample(t - parts[part].begin);
    time.push_back(t);
    for (std::size_t k = 0; k < n; ++k) {
      q[k] = at[k].position;
      columns[k][0].push_back(at[k].position);
      columns[k][1].push_back(at[k].velocity);
      columns[k][2].push_back(at[k].acceleration);
    }
    const double clearance = space.clearance(q);
    if (clearance < motion.clearance) {
      motion.clearance = clearance;
      motion.clearance_time = t;
    }
  };
  const auto rows = static_cast<long>(motion.duration / options.period * (1.0 - 1e-12));
  for (long i = 0; i <= rows; ++i) {
    add(static_cast<double>(i) * options.period);
  }
  if (motion.duration > 0.0) {
    add(motion.duration);
  }
  motion.table = TimeSeries(std::move(time));
  for (std::size_t k = 0; k < n; ++k) {
    const SpaceAxis& axis = space.axes()[k];
    const std::string name = axis.name.empty() ? "axis " + std::to_string(k + 1) : axis.name;
    const std::string unit = axis.unit.empty() ? "1" : axis.unit;
    FLYBALL_CHECK(motion.table.add(name, axis.unit, std::move(columns[k][0])));
    FLYBALL_CHECK(motion.table.add(name + " velocity", unit + "/s", std::move(columns[k][1])));
    FLYBALL_CHECK(motion.table.add(name + " acceleration", unit + "/s²", std::move(columns[k][2])));
  }
  return {};
}

}  // namespace

Expected<PathMotion> move_along(const ConfigurationSpace& space,
                                std::span<const std::vector<double>> path,
                                const PathMotionOptions& options) {
  FLYBALL_CHECK(check_options(space, path, options));
  const std::vector<double> none(space.axes().size(), 0.0);
  FLYBALL_TRY_IN(in_move_along, const ConfigurationSpace tight,
                 space.with_buffer(options.error.empty() ? none : options.error));
  for (std::size_t i = 0; i < path.size(); ++i) {
    FLYBALL_CHECK(tight.check(path[i], in_move_along, detail::format("waypoint {}", i + 1)));
  }
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    std::vector<double> by = path[i + 1];
    for (std::size_t k = 0; k < by.size(); ++k) {
      by[k] -= path[i][k];
    }
    const MoveCheck move = tight.check_move(path[i], by);
    if (!move.free) {
      return refusal(ConfigurationError::blocked_move, in_move_along,
                     detail::format("the move from waypoint {} to {}", i + 1, i + 2))
          .got("stopped by " + move.constraint + detail::format(" after {:.3g} of it", move.at))
          .expected("free with what tracking may be off")
          .hint("plan it in the space with_buffer, or track better");
    }
  }
  PathMotion motion;
  std::vector<Part> parts;
  if (options.traversal == Traversal::synchronized) {
    go_along_lines(path, options, parts, motion);
  } else {
    go_in_sequence(tight, path, options, parts, motion);
  }
  motion.duration = parts.back().end;
  FLYBALL_CHECK(tabulate(space, parts, options, motion));
  return motion;
}

}  // namespace flyball
