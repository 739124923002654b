#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <flyball/core/argument.hpp>
#include <flyball/planning/configuration/path_planner.hpp>

#include "core/try.hpp"
#include "solve/configurations.hpp"

// Configuration spaces (chapter 16).
namespace flyball::solve {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

std::vector<double> entries(const Problem& problem, std::string_view name) {
  const MatrixXd& column = problem.matrix(name);
  return {column.data(), column.data() + column.size()};
}

/// The arm that the problem tells: an elevator if there is one coordinate more than links.
Expected<void> attach_arm(const Problem& problem, ConfigurationSpace& space,
                          std::string_view where) {
  if (!problem.has("links")) {
    return {};
  }
  const std::vector<double> links = entries(problem, "links");
  const int n = space.dimension();
  const int lifts = n - static_cast<int>(links.size());
  if (lifts != 0 && lifts != 1) {
    return refusal(ArgumentError::wrong_shape, where, "links")
        .got(std::to_string(links.size()))
        .expected("as many as coordinates, or one less if the first is an elevator's height");
  }
  PlanarMechanism arm;
  constexpr double quarter = 1.57079632679489661923;
  if (lifts == 1) {
    arm.joints.push_back({.name = "elevator", .coordinate = 0, .slides = true, .angle = quarter});
  }
  const double radius = problem.has("radius") ? problem.number("radius") : 0.0;
  for (std::size_t i = 0; i < links.size(); ++i) {
    const int joint = static_cast<int>(arm.joints.size());
    arm.joints.push_back({.name = "joint " + std::to_string(i + 1),
                          .coordinate = lifts + static_cast<int>(i),
                          .parent = joint - 1,
                          .x = i == 0 ? 0.0 : links[i - 1],
                          .angle = i == 0 && lifts == 1 ? -quarter : 0.0});
    arm.bodies.push_back({.name = "link " + std::to_string(i + 1),
                          .joint = joint,
                          .from = {0.0, 0.0},
                          .to = {links[i], 0.0},
                          .radius = radius});
  }
  if (problem.has("discs")) {
    const MatrixXd& discs = problem.matrix("discs");
    for (Index i = 0; i < discs.rows(); ++i) {
      arm.obstacles.push_back(PlanarObstacle::disc("disc " + std::to_string(i + 1),
                                                   {discs(i, 0), discs(i, 1)}, discs(i, 2)));
    }
  }
  if (problem.has("floor")) {
    arm.obstacles.push_back(
        PlanarObstacle::half_plane("floor", {0.0, problem.number("floor")}, {0.0, 1.0}));
  }
  return space.attach(arm);
}

Expected<ConfigurationSpace> space_of(const Problem& problem, std::string_view where) {
  const std::vector<double> low = entries(problem, "low");
  const std::vector<double> high = entries(problem, "high");
  std::vector<SpaceAxis> axes;
  for (std::size_t k = 0; k < low.size(); ++k) {
    SpaceAxis axis{.name = "axis " + std::to_string(k + 1), .low = low[k], .high = high[k]};
    axis.wraps = problem.has("wraps") && problem.matrix("wraps")(static_cast<Index>(k), 0) != 0.0;
    axes.push_back(std::move(axis));
  }
  FLYBALL_TRY(ConfigurationSpace space, ConfigurationSpace::create(std::move(axes)));
  if (problem.has("boxes")) {
    const MatrixXd& boxes = problem.matrix("boxes");
    const auto n = static_cast<Index>(low.size());
    if (boxes.cols() != 2 * n) {
      return refusal(ArgumentError::wrong_shape, where, "boxes")
          .got(std::to_string(boxes.cols()) + " columns")
          .expected("a low and a high bound for each coordinate, all low ones first");
    }
    for (Index i = 0; i < boxes.rows(); ++i) {
      std::vector<double> from;
      std::vector<double> to;
      for (Index k = 0; k < n; ++k) {
        from.push_back(boxes(i, k));
        to.push_back(boxes(i, n + k));
      }
      FLYBALL_CHECK(space.forbid("box " + std::to_string(i + 1), Region::box(from, to)));
    }
  }
  FLYBALL_CHECK(attach_arm(problem, space, where));
  if (problem.has("buffer")) {
    return space.with_buffer(entries(problem, "buffer"));
  }
  return space;
}

Outcome solve_validity(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const ConfigurationSpace space, space_of(problem, "configuration-validity"));
  const MatrixXd& q = problem.matrix("q");
  std::vector<double> valid;
  std::vector<double> clearance;
  std::vector<std::string> broken;
  for (Index i = 0; i < q.rows(); ++i) {
    std::vector<double> at;
    for (Index k = 0; k < q.cols(); ++k) {
      at.push_back(q(i, k));
    }
    valid.push_back(space.valid(at) ? 1.0 : 0.0);
    clearance.push_back(space.clearance(at));
    const std::vector<ConstraintState> all = space.broken(at);
    broken.push_back(all.empty() ? "" : all[0].name);
  }
  answer.add("valid", valid);
  answer.add("clearance", clearance);
  answer.add("broken", broken);
  return {};
}

Outcome solve_plan(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const ConfigurationSpace space, space_of(problem, "plan"));
  PathSearch search;
  search.seed =
      problem.has("seed") ? static_cast<std::uint64_t>(std::max(problem.number("seed"), 0.0)) : 1U;
  // The work alone decides, so that an answer depends neither on the clock nor on what else runs.
  constexpr long most_work = 1'000'000'000;
  search.work = problem.has("work") ? problem.integer("work") : 50'000;
  FLYBALL_CHECK(check_within(static_cast<double>(search.work), 1.0, static_cast<double>(most_work),
                             "plan", "work"));
  search.seconds =
      problem.has("seconds") ? problem.number("seconds") : std::numeric_limits<double>::max();
  FLYBALL_TRY(const ConfigurationPath path,
              plan_path(space, entries(problem, "start"), entries(problem, "goal"), search));
  MatrixXd waypoints(static_cast<Index>(path.waypoints.size()), space.dimension());
  for (Index i = 0; i < waypoints.rows(); ++i) {
    for (Index k = 0; k < waypoints.cols(); ++k) {
      waypoints(i, k) = path.waypoints[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)];
    }
  }
  answer.add("waypoints", waypoints);
  answer.add({{"length", path.length}, {"moves", static_cast<double>(path.moves)}});
  answer.add("method", std::string(to_string(path.method)));
  return {};
}

std::vector<Field> space_fields() {
  return {
      list("low", "n", "", "stops of each coordinate: m, rad"),
      list("high", "n", "", "the same"),
      optional(list("wraps", "n", "", "1: an angle without stops")),
      optional(matrix("boxes", "b", "c", "forbidden: low bounds of all coordinates, then high")),
      optional(list("links", "l", "m",
                    "of a planar arm, angles added up from level; with one coordinate more "
                    "than links the first is the height of an elevator under it")),
      optional(number("radius", "m", "of the links; 0 if left out")),
      optional(matrix("discs", "d", "3", "x, y and radius of what links must not touch", "m")),
      optional(number("floor", "m", "height below which no link may be")),
      optional(list("buffer", "n", "", "by how much each coordinate may be off"))};
}

}  // namespace

std::vector<Kind> configuration_kinds() {
  return {
      {"configuration-validity",
       "which configurations of a mechanism break no constraint, and how far from it they are",
       space_fields() + std::vector{matrix("q", "k", "n", "a configuration a row")},
       {list("valid", "k", "", "1 or 0"),
        unbounded(list("clearance", "k", "",
                       "how far all coordinates may move at once; negative: to be valid")),
        texts("broken", "k", "the constraint that is broken most, or empty")},
       R"({"low": [-2.356, 0], "high": [2.356, 5], "boxes": [[-0.785, 0, 0.785, 2]], "q": [[-1, 0.5], [0, 1.5]]})",
       &solve_validity},
      {"plan",
       "a path between two configurations, valid along its whole length",
       space_fields() +
           std::vector{list("start", "n", "", "a configuration"), list("goal", "n", "", "another"),
                       optional(integer("seed", "of random searches; 1 if left out")),
                       optional(integer("work",
                                        "of moves and boxes, when to give up; 50000 if left "
                                        "out, about a second")),
                       optional(number("seconds", "s",
                                       "when to give up besides; never if left out, and an answer "
                                       "then does not depend on the clock"))},
       {matrix("waypoints", "w", "n", "a waypoint a row, start and goal included"),
        number("length", "", "of the path"), number("moves", "", "judged"),
        text("method", "what found it")},
       R"({"low": [-2.356, 0], "high": [2.356, 5], "boxes": [[-0.785, 0, 0.785, 2]], "start": [-1, 0.5], "goal": [1, 0.5]})",
       &solve_plan},
  };
}

}  // namespace flyball::solve
