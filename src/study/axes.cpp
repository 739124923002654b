#include <flyball/study/axes.hpp>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>

#include "core/try.hpp"
#include "study/profile_parts.hpp"

namespace flyball::study {

namespace {

constexpr std::string_view in_axes = "profile";

/// An axis's limits and ends, with what its name is in errors.
Expected<AxisResult> axis_of(const ProfileJob& job) {
  AxisResult axis{.name = job.name, .unit = job.angle ? "rad" : "m"};
  axis.limits = {job.velocity, job.acceleration, job.deceleration, job.reverse_velocity};
  for (const auto& [value, name, unit] :
       {std::tuple(job.velocity, "velocity", "/s"), {job.acceleration, "acceleration", "/s^2"}}) {
    if (!(value > 0.0)) {
      return refusal(ArgumentError::empty, in_axes, fmt::format("{} of {}", name, job.name))
          .got("left out")
          .expected(fmt::format("a limit such as {} = \"2 {}{}\"", name, axis.unit, unit));
    }
  }
  axis.limits.jerk =
      axis.limits.acceleration / (job.ramp ? job.ramp->si() : default_ramp(axis.limits));
  axis.from = job.from;
  axis.to = job.to;
  if (job.continuous) {
    axis.to.position = nearest_turn(job.to.position, job.from.position);
  }
  const MotionLimits all = axis.limits.both_ways();
  constexpr double largest = 1e30;
  for (const auto& [value, name] : {std::pair(axis.from.position, "from"),
                                    {axis.to.position, "to"},
                                    {axis.from.velocity, "start_velocity"},
                                    {axis.to.velocity, "goal_velocity"},
                                    {axis.from.acceleration, "start_acceleration"},
                                    {axis.to.acceleration, "goal_acceleration"}}) {
    if (!(std::abs(value) <= largest)) {
      return refusal(ArgumentError::out_of_range, in_axes, fmt::format("{} of {}", name, job.name))
          .got(format_number(value))
          .expected("a size up to 1e30");
    }
  }
  for (const auto& [value, name] : {std::pair(all.velocity, "velocity"),
                                    {all.reverse_velocity, "reverse_velocity"},
                                    {all.acceleration, "acceleration"},
                                    {all.deceleration, "deceleration"},
                                    {all.jerk, "acceleration by ramp"}}) {
    if (!(value >= 1.0 / largest && value <= largest)) {
      return refusal(ArgumentError::out_of_range, in_axes, fmt::format("{} of {}", name, job.name))
          .got(format_number(value))
          .expected("a limit of 1e-30 to 1e30");
    }
  }
  axis.alone = SCurveProfile(axis.limits, axis.from, axis.to).total_time();
  return axis;
}

/// Adds the columns of one axis.
Expected<void> add_columns(TimeSeries& table, AxisResult& axis, const JerkMotion& motion) {
  std::vector<double> x;
  std::vector<double> v;
  std::vector<double> a;
  for (const double t : table.time()) {
    const MotionState at = t >= table.time().back() ? motion.goal() : motion.sample(t);
    x.push_back(at.position);
    v.push_back(at.velocity);
    a.push_back(at.acceleration);
    axis.peak_velocity = std::max(axis.peak_velocity, std::abs(at.velocity));
    axis.peak_acceleration = std::max(axis.peak_acceleration, std::abs(at.acceleration));
  }
  FLYBALL_CHECK(table.add(axis.name + " position", axis.unit, std::move(x)));
  FLYBALL_CHECK(table.add(axis.name + " velocity", axis.unit + "/s", std::move(v)));
  return table.add(axis.name + " acceleration", axis.unit + "/s²", std::move(a));
}

Expected<TimeSeries> table_of(std::vector<double> time, std::vector<AxisResult>& axes,
                              const std::vector<AxisMotion>& motions) {
  TimeSeries table(std::move(time));
  for (std::size_t i = 0; i < axes.size(); ++i) {
    FLYBALL_CHECK(add_columns(table, axes[i], motions[i]));
  }
  return table;
}

}  // namespace

Expected<AxesResult> plan_axes(const AxesJob& job) {
  AxesResult result{.job = job};
  if (job.axes.empty() || job.axes.size() > most_axes) {
    return refusal(ArgumentError::out_of_range, in_axes, "axes")
        .got(fmt::format("{}", job.axes.size()))
        .expected(fmt::format("1 to {}", most_axes));
  }
  FLYBALL_CHECK(Checks(in_axes)
                    .positive(job.period.si(), "period", "s")
                    .not_negative(job.least.si(), "least", "s"));
  std::set<std::string> names;
  std::vector<MotionLimits> limits;
  std::vector<MotionState> start;
  std::vector<MotionState> goal;
  for (const ProfileJob& one : job.axes) {
    if (!names.insert(one.name).second) {
      return refusal(ArgumentError::out_of_range, in_axes, "name")
          .got('"' + one.name + "\" twice")
          .expected("a name of its own for each axis");
    }
    FLYBALL_TRY(AxisResult axis, axis_of(one));
    limits.push_back(axis.limits);
    start.push_back(axis.from);
    goal.push_back(axis.to);
    result.axes.push_back(std::move(axis));
  }
  std::vector<AxisMotion> motions(job.axes.size());
  AxisMotions together{limits.data(), start.data(),   goal.data(),
                       nullptr,       motions.data(), static_cast<int>(motions.size())};
  const Synchronization how =
      job.synchronize == "phase" ? Synchronization::phase : Synchronization::time;
  result.duration = detail::synchronize(together, how, job.least.si());
  result.slowest = together.slowest;
  result.in_phase = together.in_phase;

  const double end = result.duration;
  const double period = job.period.si();
  constexpr double most_rows = 1e6;
  if (!(end / period * static_cast<double>(motions.size()) < most_rows)) {
    return refusal(ArgumentError::out_of_range, in_axes, "the motion")
        .got(fmt::format("{} s long, {:.3g} periods", format_number(end), end / period))
        .expected("at most a million periods of all axes together")
        .hint("raise the limits or --period");
  }
  std::vector<double> time;
  const auto rows = static_cast<long>(end / period * (1.0 - 1e-12));
  for (long k = 0; k <= rows; ++k) {
    time.push_back(static_cast<double>(k) * period);
  }
  time.push_back(end);
  std::vector<double> changes;
  for (std::size_t i = 0; i < motions.size(); ++i) {
    result.axes[i].changes = changes_of(motions[i]);
    result.axes[i].to = motions[i].goal();
    changes.insert(changes.end(), result.axes[i].changes.begin(), result.axes[i].changes.end());
  }
  FLYBALL_TRY(result.table, table_of(std::move(time), result.axes, motions));
  FLYBALL_TRY(result.curve, table_of(drawn_times(changes, end), result.axes, motions));
  return result;
}

}  // namespace flyball::study
