#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <flyball/planning/path/build_path.hpp>
#include <flyball/planning/trajectory/path_trajectory.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "solve/paths.hpp"

// Paths and their timing (15.2).
namespace flyball::solve {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// The curve that a problem tells.
Expected<Path> curve_of(const Problem& problem, std::string_view where) {
  const MatrixXd points = problem.matrix("points").transpose();
  const std::string_view curve = problem.choice("curve");
  const std::string_view said = problem.choice("spacing");
  const KnotSpacing spacing = said == "centripetal" ? KnotSpacing::centripetal
                              : said == "uniform"   ? KnotSpacing::uniform
                                                    : KnotSpacing::chord;
  const bool clamped = problem.has("start") || problem.has("end");
  if (clamped && curve != "cubic") {
    return refusal(ArgumentError::malformed, where, "start and end")
        .got("given with a curve that takes none")
        .expected("left out, or the curve \"cubic\"");
  }
  if (curve == "bezier") {
    return bezier_path(points);
  }
  if (curve == "b-spline") {
    return b_spline_path(points, problem.has("degree") ? problem.integer("degree") : 3);
  }
  if (!clamped) {
    return natural_cubic_path(points, spacing);
  }
  if (!problem.has("start") || !problem.has("end")) {
    return refusal(ArgumentError::malformed, where, problem.has("start") ? "end" : "start")
        .got("left out")
        .expected("derivatives at both ends, or at neither");
  }
  return clamped_cubic_path(points, problem.matrix("start"), problem.matrix("end"), spacing);
}

Outcome solve_spline(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const Path path, curve_of(problem, "spline"));
  std::vector<MatrixXd> coefficients;
  for (const PathPiece& piece : path.pieces()) {
    // By the path's parameter: t = (s - s_i)/span.
    MatrixXd c = piece.coefficients;
    double power = 1.0;
    for (Index k = 1; k < c.cols(); ++k) {
      power /= piece.span;
      c.col(k) *= power;
    }
    // Σ c_k spanᵏ as it is answered: beside large spans the powers leave the range of doubles.
    for (Index j = 0; j < c.rows(); ++j) {
      double back = 0.0;
      for (Index k = c.cols() - 1; k > 0; --k) {
        back = (back + c(j, k)) * piece.span;
      }
      const auto moves = piece.coefficients.row(j).tail(c.cols() - 1);
      constexpr double lost = 1e-12;
      if (!(std::abs(back - moves.sum()) <=
            lost * moves.cwiseAbs().sum() + std::numeric_limits<double>::min())) {
        return refusal(ArgumentError::out_of_range, "spline", "a coefficient")
            .got(detail::format("beyond the range of doubles, over a span of {:.4g}", piece.span))
            .expected("coordinates whose sizes are not so far apart")
            .hint("scale the larger coordinates, or space the knots uniformly");
      }
    }
    coefficients.push_back(std::move(c));
  }
  answer.add("breaks", path.breaks());
  answer.add("coefficients", coefficients);
  answer.add({{"length", path_length(path)}});
  if (!problem.has("at")) {
    return {};
  }
  const MatrixXd& at = problem.matrix("at");
  MatrixXd position(at.rows(), path.coordinates());
  MatrixXd first(at.rows(), path.coordinates());
  MatrixXd second(at.rows(), path.coordinates());
  std::vector<double> bend;
  for (Index i = 0; i < at.rows(); ++i) {
    const PathState state = path.at(at(i));
    position.row(i) = state.position.transpose();
    first.row(i) = state.first.transpose();
    second.row(i) = state.second.transpose();
    bend.push_back(path.coordinates() == 2 ? planar_curvature(state) : curvature(state));
  }
  answer.add("position", position);
  answer.add("first", first);
  answer.add("second", second);
  answer.add("curvature", bend);
  return {};
}

double limit(const Problem& problem, std::string_view name) {
  return problem.has(name) ? problem.number(name) : TravelLimits::none;
}

std::vector<PathConstraint> constraints_of(const Problem& problem) {
  std::vector<PathConstraint> all;
  if (problem.has("velocity") || problem.has("acceleration") || problem.has("jerk")) {
    CoordinateLimits limits;
    if (problem.has("velocity")) {
      limits.velocity = problem.matrix("velocity").col(0);
    }
    if (problem.has("acceleration")) {
      limits.acceleration = problem.matrix("acceleration").col(0);
    }
    if (problem.has("jerk")) {
      limits.jerk = problem.matrix("jerk").col(0);
    }
    all.push_back(std::move(limits));
  }
  const TravelLimits travel{.velocity = limit(problem, "travel_velocity"),
                            .acceleration = limit(problem, "travel_acceleration"),
                            .centripetal = limit(problem, "centripetal"),
                            .total_acceleration = limit(problem, "total_acceleration"),
                            .angular_velocity = limit(problem, "angular_velocity"),
                            .angular_acceleration = limit(problem, "angular_acceleration"),
                            .jerk = limit(problem, "travel_jerk")};
  for (const double one :
       {travel.velocity, travel.acceleration, travel.centripetal, travel.total_acceleration,
        travel.angular_velocity, travel.angular_acceleration, travel.jerk}) {
    if (!std::isinf(one)) {
      all.push_back(travel);
      break;
    }
  }
  if (problem.has("slow")) {
    const MatrixXd& slow = problem.matrix("slow");
    for (Index i = 0; i < slow.rows(); ++i) {
      all.push_back(StretchLimits{slow(i, 0), slow(i, 1), {.velocity = slow(i, 2)}, ""});
    }
  }
  return all;
}

Outcome solve_timing(const Problem& problem, JsonWriter& answer) {
  constexpr std::string_view where = "path-parameterization";
  FLYBALL_TRY(const Path path, curve_of(problem, where));
  const int count = problem.has("samples") ? problem.integer("samples") : 51;
  if (count < 2) {
    return refusal(ArgumentError::out_of_range, where, "samples")
        .got(std::to_string(count))
        .expected("2 or more");
  }
  FLYBALL_CHECK(check_size(3.0 * count * path.coordinates(), where, "samples"));
  TimingOptions options;
  const auto take = [&](double& option, std::string_view name) {
    option = problem.has(name) ? problem.number(name) : option;
  };
  take(options.start_velocity, "start_velocity");
  take(options.end_velocity, "end_velocity");
  take(options.tolerance, "tolerance");
  FLYBALL_TRY(const PathTrajectory motion, time_optimal(path, constraints_of(problem), options));

  const Index n = path.coordinates();
  std::vector<double> time;
  std::vector<double> parameter;
  MatrixXd position(count, n);
  MatrixXd velocity(count, n);
  MatrixXd acceleration(count, n);
  for (int i = 0; i < count; ++i) {
    const PathSample at = motion.sample(motion.total_time() * i / (count - 1));
    time.push_back(at.time);
    parameter.push_back(at.parameter);
    position.row(i) = at.position.transpose();
    velocity.row(i) = at.velocity.transpose();
    acceleration.row(i) = at.acceleration.transpose();
  }
  answer.add({{"total_time", motion.total_time()}});
  answer.add("time", time);
  answer.add("parameter", parameter);
  answer.add("position", position);
  answer.add("velocity", velocity);
  answer.add("acceleration", acceleration);
  if (problem.has("jerk") || problem.has("travel_jerk")) {
    MatrixXd jerk(count, n);
    for (int i = 0; i < count; ++i) {
      jerk.row(i) = motion.jerk(time[static_cast<std::size_t>(i)]).transpose();
    }
    answer.add("jerk", jerk);
  }
  const std::vector<BindingLimit> binding = motion.binding();
  MatrixXd stretches(static_cast<Index>(binding.size()), 5);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < binding.size(); ++i) {
    stretches.row(static_cast<Index>(i)) << binding[i].from, binding[i].to, binding[i].start,
        binding[i].end, binding[i].use;
    names.push_back(binding[i].limit);
  }
  answer.add("binding", names);
  answer.add("stretches", stretches);
  return {};
}

std::vector<Field> curve_fields() {
  return {matrix("points", "k", "n", "a waypoint or a control point a row"),
          or_first(choice("curve", "cubic bezier b-spline",
                          "through the waypoints, or by control points")),
          or_first(choice("spacing", "centripetal uniform chord",
                          "of a cubic's knots: √d, 1 or d for waypoints d apart")),
          optional(list("start", "n", "",
                        "of a cubic: dq/ds at the start; 0 second derivative if "
                        "left out")),
          optional(list("end", "n", "", "the same at the end")),
          optional(integer("degree", "of a B-spline, 1 to 20; 3 if left out"))};
}

}  // namespace

std::vector<Kind> path_kinds() {
  return {
      {"spline",
       "a curve of polynomial pieces in any number of coordinates (15.2)",
       curve_fields() + std::vector{optional(list("at", "a", "", "parameters at which to look"))},
       {list("breaks", "b", "", "the parameter where each piece begins, and the end"),
        matrices("coefficients", "n", "d", "of each piece by (s - s_i)^k, column k"),
        number("length", "", "of the curve"),
        optional(matrix("position", "a", "n", "q at the parameters")),
        optional(matrix("first", "a", "n", "dq/ds")),
        optional(matrix("second", "a", "n", "d²q/ds²")),
        optional(unbounded(list("curvature", "a", "",
                                "|d²q/dl²| by the length; in the plane positive to the left")))},
       R"({"points": [[0, 0], [1, 1], [3, 0]], "at": [0, 0.5, 1]})",
       &solve_spline},
      {"path-parameterization",
       "the fastest motion along a curve under limits that hold between samples, too, and which "
       "of them binds where (15.2)",
       curve_fields() +
           std::vector{
               optional(list("velocity", "n", "", "limit of each coordinate's velocity")),
               optional(list("acceleration", "n", "", "limit of each coordinate's acceleration")),
               optional(list("jerk", "n", "", "limit of each coordinate's jerk")),
               optional(number("travel_velocity", "m/s", "limit of |dp/dt|, p = (x, y)")),
               optional(number("travel_acceleration", "m/s^2", "limit along the path")),
               optional(number("travel_jerk", "m/s^3", "limit of |d²v/dt²| along the path")),
               optional(number("centripetal", "m/s^2", "limit across the path")),
               optional(number("total_acceleration", "m/s^2", "limit of |d²p/dt²|: a circle")),
               optional(number("angular_velocity", "rad/s",
                               "limit of the third coordinate's rate; of two coordinates the "
                               "turning rate of the way")),
               optional(number("angular_acceleration", "rad/s^2", "limit of the same")),
               optional(
                   matrix("slow", "z", "3",
                          "zones: from and to by the parameter, and the velocity limit there")),
               optional(number("start_velocity", "", "|dq/dt| at the start; 0 if left out")),
               optional(number("end_velocity", "", "|dq/dt| at the end; 0 if left out")),
               optional(number("tolerance", "",
                               "how far the time may be from the fastest, "
                               "relative and on the average; 0.0015 if left out")),
               optional(integer("samples", "how many instants to answer; 51 if left out"))},
       {number("total_time", "s", "of the motion"), list("time", "t", "s", "evenly from 0"),
        list("parameter", "t", "", "of the curve"), matrix("position", "t", "n", "q"),
        matrix("velocity", "t", "n", "dq/dt"), matrix("acceleration", "t", "n", "d²q/dt²"),
        optional(matrix("jerk", "t", "n", "d³q/dt³, where a jerk is limited")),
        texts("binding", "l", "the limit that holds each stretch back"),
        matrix("stretches", "l", "5",
               "from and to by the parameter, from and to in s, how much of the limit is used")},
       R"({"points": [[0, 0], [1, 1], [3, 0]], "velocity": [1, 1], "acceleration": [2, 2]})",
       &solve_timing},
  };
}

}  // namespace flyball::solve
