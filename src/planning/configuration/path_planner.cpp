#include <flyball/planning/configuration/path_planner.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "planning/configuration/corner_path.hpp"
#include "planning/configuration/decomposition.hpp"
#include "planning/configuration/known_moves.hpp"
#include "planning/configuration/path_search.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_plan = "plan";

constexpr std::array<const char*, 8> names{"automatic",   "straight", "corners", "grid",
                                           "rrt-connect", "rrt-star", "roadmap", "decomposition"};

}  // namespace

Expected<void> check(const PathSearch& search) {
  FLYBALL_CHECK(Checks(in_plan)
                    .positive(search.seconds, "seconds", "s")
                    .not_negative(search.clearance, "clearance"));
  const std::array<std::tuple<long, long, long, const char*>, 3> counts{
      {{search.work, 1, std::numeric_limits<long>::max(), "work"},
       {search.cells, 8, 4096, "cells"},
       {search.nodes, 2, 1'000'000, "nodes"}}};
  for (const auto& [value, low, high, name] : counts) {
    if (value < low || value > high) {
      return refusal(ArgumentError::out_of_range, in_plan, name)
          .got(detail::format("{}", value))
          .expected(high < std::numeric_limits<long>::max()
                        ? detail::format("from {} to {}", low, high)
                        : detail::format("at least {}", low));
    }
  }
  return {};
}

const char* to_string(PathMethod method) noexcept {
  const auto i = static_cast<std::size_t>(method);
  return i < names.size() ? names[i] : "unknown";
}

Expected<PathMethod> parse_path_method(std::string_view name) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (name == names[i]) {
      return static_cast<PathMethod>(i);
    }
  }
  std::string all;
  for (const char* one : names) {
    all += (all.empty() ? "" : ", ") + std::string(one);
  }
  return refusal(ArgumentError::unknown_name, in_plan, "method")
      .got('"' + std::string(name) + '"')
      .expected("one of " + all);
}

struct PathPlanner::State {
  explicit State(ConfigurationSpace of)
      : space(std::move(of)), judge(space.model()), a(space.dimension()), b(space.dimension()) {}

  ConfigurationSpace space;
  detail::Judge judge;
  detail::Tree a;
  detail::Tree b;
  detail::Roadmap roadmap{};
  detail::BoxTree boxes{judge};
  detail::KnownMoves known{};
};

PathPlanner::PathPlanner(ConfigurationSpace space)
    : state_(std::make_unique<State>(std::move(space))) {}
PathPlanner::PathPlanner(PathPlanner&&) noexcept = default;
PathPlanner& PathPlanner::operator=(PathPlanner&&) noexcept = default;
PathPlanner::~PathPlanner() = default;

const ConfigurationSpace& PathPlanner::space() const noexcept {
  return state_->space;
}

Expected<ConfigurationPath> PathPlanner::plan(std::span<const double> start,
                                              std::span<const double> goal,
                                              const PathSearch& search) {
  FLYBALL_CHECK(check(search));
  const ConfigurationSpace& space = state_->space;
  FLYBALL_CHECK(space.check(start, in_plan, "the start"));
  FLYBALL_CHECK(space.check(goal, in_plan, "the goal"));
  detail::Judge& judge = state_->judge;
  judge.use_wide(search.wide);
  judge.moves = 0;
  Random random(search.seed);
  detail::WorkBound bound(search.work, search.seconds);
  ConfigurationPath result;
  const auto done = [&](detail::ConfigurationPath path, PathMethod method) {
    detail::lift(space.model(), path);
    const bool is_random = method == PathMethod::rrt_connect || method == PathMethod::rrt_star ||
                           method == PathMethod::roadmap || method == PathMethod::decomposition;
    if (search.shorten && (is_random || method == PathMethod::grid)) {
      detail::shorten(judge, path, random, is_random ? 100 : 0, bound);
    }
    result.method = method;
    result.moves = judge.moves;
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      std::vector<double> by = path[i + 1];
      for (std::size_t k = 0; k < by.size(); ++k) {
        by[k] -= path[i][k];
      }
      result.length += space.length(by);
    }
    result.waypoints = std::move(path);
    return result;
  };
  // What another query may use is kept before detours are taken out.
  const auto learnt = [&](detail::ConfigurationPath path, PathMethod method) {
    if (search.method == PathMethod::automatic) {
      state_->known.learn(judge, path);
    }
    return done(std::move(path), method);
  };
  const PathMethod method = search.method;
  const bool any = method == PathMethod::automatic;
  const bool flat = space.dimension() == 2;
  const bool regions_only = space.mechanism() == nullptr;

  // What is straight needs no search, whichever is asked for.
  {
    const std::vector<double> by = space.difference(start, goal);
    detail::Configuration from{};
    detail::Configuration change{};
    for (std::size_t k = 0; k < by.size(); ++k) {
      from[k] = static_cast<float>(start[k]);
      change[k] = static_cast<float>(by[k]);
    }
    if ((any || method == PathMethod::straight || method == PathMethod::rrt_connect) &&
        (judge.free(from, change) || (regions_only && space.check_move(start, by).free))) {
      return done({{start.begin(), start.end()}, {goal.begin(), goal.end()}}, PathMethod::straight);
    }
    if (method == PathMethod::straight) {
      const MoveCheck move = space.check_move(start, by);
      return refusal(ConfigurationError::blocked_move, in_plan, "the straight move")
          .got("stopped by " + move.constraint + detail::format(" after {:.3g} of it", move.at))
          .expected("free")
          .hint("let another method look for a way around");
    }
  }
  if ((method == PathMethod::corners && !(flat && regions_only)) ||
      (method == PathMethod::grid && !(flat && !space.axes()[0].wraps && !space.axes()[1].wraps))) {
    return refusal(ArgumentError::out_of_range, in_plan, "method")
        .got(to_string(method))
        .expected(method == PathMethod::corners ? "for two axes without a mechanism"
                                                : "for two axes that do not wrap")
        .hint("automatic takes what is fit");
  }
  std::string tried;
  const auto note = [&](std::string what) { tried += (tried.empty() ? "" : ", ") + what; };
  if (method == PathMethod::corners || (any && flat && regions_only)) {
    bool complete = false;
    if (auto path = detail::corner_path(space, start.data(), goal.data(), bound, complete)) {
      return done(*std::move(path), PathMethod::corners);
    }
    if (complete) {
      return refusal(ConfigurationError::no_path, in_plan, "the goal")
          .got("cut off from the start: no way leads from corner to corner of what is forbidden")
          .expected("in reach of the start without breaking a constraint")
          .hint("move an end, or relax a constraint or the buffer");
    }
    note("ways from corner to corner");
  }
  if (method == PathMethod::grid) {
    if (auto path = detail::space_grid_path(judge, start.data(), goal.data(), search.cells,
                                            search.clearance, bound)) {
      return done(*std::move(path), PathMethod::grid);
    }
    note(detail::format("a grid of {} x {} cells that are free as a whole", search.cells,
                        search.cells));
  }
  if (method == PathMethod::roadmap) {
    // What it has when half of the time is over is searched.
    detail::WorkBound part(search.work / 2 + 1, 0.5 * search.seconds, bound);
    state_->roadmap.grow(judge, random, search.nodes, part);
    result.nodes = state_->roadmap.size();
    if (auto path = state_->roadmap.way(judge, start.data(), goal.data(), bound)) {
      return done(*std::move(path), PathMethod::roadmap);
    }
    note(detail::format("a roadmap of {} nodes", state_->roadmap.size()));
  }
  if (method == PathMethod::rrt_star) {
    state_->a.clear();
    auto path =
        detail::rrt_star(judge, state_->a, start.data(), goal.data(), random, search.nodes, bound);
    result.nodes = state_->a.size();
    if (path) {
      return done(*std::move(path), PathMethod::rrt_star);
    }
    note(detail::format("RRT* of {} nodes", state_->a.size()));
  }
  if (any) {
    if (auto path = state_->known.way(judge, start.data(), goal.data())) {
      result.nodes = state_->known.size();
      return done(*std::move(path), PathMethod::roadmap);
    }
  }
  const bool trees = any || method == PathMethod::rrt_connect;
  const auto grow = [&](long work) -> std::optional<detail::ConfigurationPath> {
    auto path = detail::rrt_connect(judge, state_->a, state_->b, start.data(), goal.data(), random,
                                    work, bound);
    result.nodes = state_->a.size() + state_->b.size();
    return path;
  };
  if (trees) {
    state_->a.clear();
    state_->b.clear();
    // Far more than almost all queries need; whatever is left may have no path.
    constexpr long first = 20'000;
    if (auto path = grow(any ? first : search.work)) {
      return learnt(*std::move(path), PathMethod::rrt_connect);
    }
  }
  detail::BoxAnswer boxes;
  if (any || method == PathMethod::decomposition) {
    constexpr long most_boxes = 3'000'000;
    detail::WorkBound part(search.work, any ? 0.6 * search.seconds : search.seconds, bound);
    detail::GrowAlong along;
    if (any) {
      along = [&](const detail::Channel& channel, long work) {
        return detail::rrt_connect(judge, state_->a, state_->b, start.data(), goal.data(), random,
                                   work, part, &channel);
      };
    }
    boxes = state_->boxes.connect(start.data(), goal.data(), most_boxes, part, along);
    if (boxes.path) {
      result.nodes = boxes.grown ? state_->a.size() + state_->b.size() : boxes.boxes;
      return learnt(*std::move(boxes.path),
                    boxes.grown ? PathMethod::rrt_connect : PathMethod::decomposition);
    }
    if (boxes.proven) {
      return refusal(ConfigurationError::no_path, in_plan, "the goal")
          .got(detail::format("cut off from the start: {} boxes prove it", boxes.boxes))
          .expected("in reach of the start without breaking a constraint")
          .hint("move an end, or relax a constraint or the buffer");
    }
    note(detail::format("{} boxes down to {:.2g} of the axes", boxes.boxes, boxes.finest));
  }
  if (trees) {
    if (any) {
      if (auto path = grow(search.work)) {
        return learnt(*std::move(path), PathMethod::rrt_connect);
      }
    }
    note(detail::format("random trees of {} and {} nodes", state_->a.size(), state_->b.size()));
  }
  return refusal(ConfigurationError::undecided, in_plan, "the way to the goal")
      .got(detail::format("neither found nor proven not to exist: {} moves were judged; tried {}",
                          judge.moves, tried))
      .expected("decided within the bounds")
      .hint(bound.late() ? "give it more seconds, or less narrow gaps"
                         : "give it more work, another seed, or less narrow gaps");
}

Expected<ConfigurationPath> plan_path(const ConfigurationSpace& space,
                                      std::span<const double> start, std::span<const double> goal,
                                      const PathSearch& search) {
  return PathPlanner(space).plan(start, goal, search);
}

}  // namespace flyball
