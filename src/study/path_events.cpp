// What files have happen along their paths, and what they were generated from.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/text.hpp>

#include "core/diagnose.hpp"
#include "study/path_route.hpp"

namespace flyball::study {

namespace {

/// m of the way at each sample.
std::vector<double> way_lengths(const RobotTrajectory& trajectory) {
  std::vector<double> lengths{0.0};
  for (std::size_t i = 1; i < trajectory.samples.size(); ++i) {
    lengths.push_back(lengths.back() + (trajectory.samples[i].pose.translation() -
                                        trajectory.samples[i - 1].pose.translation())
                                           .norm());
  }
  return lengths;
}

/// As Choreo has commands: without what another tool's file had besides, waits as expressions.
/// @return  Whether Choreo knows its type.
bool as_choreo(AutoCommand& command) {
  constexpr std::array<std::string_view, 6> known{"named",    "wait", "sequential",
                                                  "parallel", "race", "deadline"};
  command.origin = {};
  if (command.type == "wait") {
    command.wait = {command.wait.value, fmt::format("{} s", command.wait.value), {}};
  }
  return std::find(known.begin(), known.end(), command.type) != known.end() &&
         std::all_of(command.commands.begin(), command.commands.end(), as_choreo);
}

void take_event(LoadedMotion& motion, const ChoreoEvent& event, std::optional<double> time) {
  if (time) {
    motion.events.push_back({event.name, *time, {}, event.command});
  } else {
    warn(motion.trajectory.diagnostics, "event_without_time",
         "of the event \"{}\" the file says no time: it is left out",
         cut(printable(event.name), 40));
  }
}

}  // namespace

double time_at_share(const RobotTrajectory& from, const RobotTrajectory& to, double time) {
  const std::vector<double> before = way_lengths(from);
  const std::vector<double> after = way_lengths(to);
  const auto& samples = from.samples;
  const auto next = std::upper_bound(samples.begin() + 1, samples.end() - 1, time,
                                     [](double t, const MotionSample& s) { return t < s.time; });
  const auto i = static_cast<std::size_t>(next - samples.begin());
  const double within =
      std::clamp((time - samples[i - 1].time) / (samples[i].time - samples[i - 1].time), 0.0, 1.0);
  const double length = before[i - 1] + within * (before[i] - before[i - 1]);
  const double wanted = before.back() > 0.0 ? length / before.back() * after.back() : 0.0;
  const auto reached = std::lower_bound(after.begin() + 1, after.end() - 1, wanted);
  const auto k = static_cast<std::size_t>(reached - after.begin());
  const double gap = after[k] - after[k - 1];
  const double share = gap > 0.0 ? std::clamp((wanted - after[k - 1]) / gap, 0.0, 1.0) : 0.0;
  return to.samples[k - 1].time + share * (to.samples[k].time - to.samples[k - 1].time);
}

void take_choreo(LoadedMotion& motion, const ChoreoTrajectory& file) {
  const std::vector<double>& reached = file.trajectory.waypoints;
  const double start = file.trajectory.samples.empty() ? 0.0 : file.trajectory.samples.front().time;
  for (const ChoreoEvent& event : file.events) {
    std::optional<double> time = event.time();
    if (!time && event.target && *event.target >= 0 &&
        static_cast<std::size_t>(*event.target) < reached.size()) {
      time = reached[static_cast<std::size_t>(*event.target)] + event.offset.value;
    }
    take_event(motion, event, time ? std::optional(*time - start) : time);
  }
  if (!file.is_2024 && reached.size() == file.params.waypoints.size()) {
    motion.plan = ChoreoPlan{file.params, reached};
    for (double& time : motion.plan->times) {
      time -= start;
    }
  }
}

void take_choreo(LoadedMotion& motion, const ChoreoPath2024& path) {
  const double start = path.trajectory.empty() ? 0.0 : path.trajectory.front().time;
  for (const ChoreoEvent& event : path.events) {
    std::optional<double> time = event.time();
    if (!time && event.target && *event.target >= 0 &&
        static_cast<std::size_t>(*event.target) < path.trajectory_waypoints.size()) {
      const auto& reached = path.trajectory_waypoints[static_cast<std::size_t>(*event.target)].time;
      time = reached ? std::optional(*reached + event.offset.value) : std::nullopt;
    }
    take_event(motion, event, time ? std::optional(*time - start) : time);
  }
}

ChoreoTrajectory choreo_trajectory(const PathResult& result, const std::string& name,
                                   std::vector<Diagnostic>& left_out) {
  const bool differential =
      result.robot ? result.robot->kind == DriveKind::differential : result.job.differential;
  constexpr double usual = 0.6;  // m
  ChoreoTrajectory file = to_choreo_trajectory(
      result.trajectory, name,
      differential ? std::optional(ChoreoSides{result.robot ? result.robot->trackwidth : usual})
                   : std::nullopt);
  if (result.plan) {
    file.params = result.plan->params;
    file.trajectory.waypoints = result.plan->times;
    // Headings that are not wrapped go on from the samples' first.
    if (!file.params.waypoints.empty()) {
      const double turns =
          file.trajectory.samples.front().heading - file.params.waypoints.front().heading.value;
      const double whole = turns - std::remainder(turns, 2.0 * std::numbers::pi);
      if (std::abs(whole) > 1.0) {
        for (ChoreoSample& sample : file.trajectory.samples) {
          sample.heading -= whole;
        }
      }
    }
  }
  const std::vector<double>& reached = file.trajectory.waypoints;
  std::size_t lasting = 0;
  std::size_t commands = 0;
  for (const PathEvent& event : result.events) {
    // Its time counts from the last waypoint before it.
    const auto after = std::upper_bound(reached.begin(), reached.end(), event.time);
    const auto target = after == reached.begin() ? 0 : after - reached.begin() - 1;
    ChoreoEvent written{.name = event.name};
    written.target = static_cast<int>(target);
    written.target_timestamp = reached[static_cast<std::size_t>(target)];
    const double offset = event.time - *written.target_timestamp;
    written.offset = {offset, fmt::format("{} s", offset), {}};
    written.command = event.command;
    if (written.command && !as_choreo(*written.command)) {
      written.command.reset();
      ++commands;
    }
    lasting += event.end ? 1 : 0;
    file.events.push_back(std::move(written));
  }
  if (lasting > 0) {
    warn(left_out, "events_shortened",
         "{} of the events {} for a time; a Choreo trajectory holds when they begin", lasting,
         lasting == 1 ? "lasts" : "last");
  }
  if (commands > 0) {
    warn(left_out, "commands_left_out",
         "{} of the events' commands {} of a type that Choreo does not have: the events stay "
         "without",
         commands, commands == 1 ? "is" : "are");
  }
  return file;
}

}  // namespace flyball::study
