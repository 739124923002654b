#include <algorithm>
#include <array>
#include <cmath>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "planning/drive/drive_body.hpp"
#include "planning/drive/drive_rows.hpp"
#include "planning/drive/drive_rules.hpp"
#include "planning/drive/drive_transcription.hpp"

namespace flyball::drive_transcription {

using drive_rules::Span;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;
using optimization::Expression;
using optimization::ExpressionVector;
using optimization::OptimalControlProblem;

namespace {

constexpr double shortest = 1e-4;  // s, of a segment

using Vector = ExpressionVector;

/// What a waypoint fixes, where it may give way.
void write_elastic_waypoint(const DriveProblem& problem, const Layout& layout, std::size_t i,
                            double heading, OptimalControlProblem& ocp) {
  const DriveWaypoint& w = problem.waypoints[i];
  const int k = layout.first[i];
  const Index give = layout.constraints + static_cast<Index>(i);
  const auto within = [&](int state, double value) {
    ocp.add_constraint(
        [&](const Vector& x, const Vector& /*u*/, const Vector& p) {
          return std::array<Expression, 2>{x(state) - value - p(give), value - x(state) - p(give)};
        },
        VectorXd::Constant(2, -infinity), VectorXd::Zero(2), k, k,
        flyball::detail::format("waypoint {}", i));
  };
  if (w.fix_translation) {
    within(0, w.x);
    within(1, w.y);
  }
  if (w.fix_heading) {
    within(2, heading);
  }
}

}  // namespace

Layout::Layout(const DriveProblem& problem, std::vector<int> intervals, bool gives_way)
    : n(drive_body::states(problem.model.drivetrain)),
      m(drive_body::inputs(problem.model.drivetrain)),
      elastic(gives_way),
      constraints(static_cast<int>(problem.constraints.size())) {
  first.push_back(0);
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    first.push_back(first.back() + intervals[i] + (i > 0 ? 1 : 0));
  }
  for (std::size_t i = 0; i < problem.constraints.size(); ++i) {
    if (drive_rules::is_obstacle(problem.constraints[i])) {
      obstacles.push_back(i);
    }
  }
}

bool Layout::is_change(int stage) const noexcept {
  return stage > 0 && stage < first.back() && std::binary_search(first.begin(), first.end(), stage);
}

int Layout::angle(std::size_t obstacle) const noexcept {
  const auto found = std::find(obstacles.begin(), obstacles.end(), obstacle);
  return m + 1 + static_cast<int>(found - obstacles.begin());
}

OptimalControlProblem transcribe(const DriveProblem& problem, const Layout& layout,
                                 const Guess& guess) {
  const int N = layout.stages();
  OptimalControlProblem ocp(layout.states(), layout.inputs(), N, layout.parameters(),
                            layout.data());
  write_dynamics(problem, layout, ocp);
  write_wheels(problem, layout, ocp);
  for (std::size_t i = 0; i < problem.constraints.size(); ++i) {
    write_constraint(problem, layout, i, ocp);
  }
  // Bounds: durations, forces, and angles where their obstacle is.
  VectorXd lower = VectorXd::Constant(layout.states(), -infinity);
  VectorXd upper = VectorXd::Constant(layout.states(), infinity);
  lower(layout.duration()) = shortest;
  // What gives way does so in a time that can be told from standing still.
  upper(layout.duration()) = layout.elastic
                                 ? std::min(layout.longest, 2.0 + 5.0 * guess.durations.maxCoeff())
                                 : layout.longest;
  ocp.bound_states(lower, upper);
  const double most = problem.model.drivetrain == Drivetrain::swerve ? 1.1 : 1.0;
  for (int k = 0; k < N; ++k) {
    const bool changes = layout.is_change(k);
    VectorXd low = VectorXd::Constant(layout.inputs(), changes ? 0.0 : -most);
    VectorXd high = VectorXd::Constant(layout.inputs(), changes ? 0.0 : most);
    low(layout.change()) = changes ? -layout.longest : 0.0;
    high(layout.change()) = changes ? layout.longest : 0.0;
    for (const std::size_t obstacle : layout.obstacles) {
      const Span span = drive_rules::span_of(problem, problem.constraints[obstacle]);
      const bool there = layout.first[static_cast<std::size_t>(span.from)] <= k &&
                         k <= layout.first[static_cast<std::size_t>(span.to)];
      low(layout.angle(obstacle)) = there ? -infinity : 0.0;
      high(layout.angle(obstacle)) = there ? infinity : 0.0;
    }
    ocp.bound_input(k, low, high);
  }
  for (std::size_t i = 0; i < problem.waypoints.size(); ++i) {
    const DriveWaypoint& w = problem.waypoints[i];
    VectorXd fixed = VectorXd::Constant(layout.states(), nan);
    if (!layout.elastic) {
      if (w.fix_translation) {
        fixed.head<2>() = Vector2d(w.x, w.y);
      }
      if (w.fix_heading) {
        fixed(2) = guess.headings[i];
      }
    } else {
      write_elastic_waypoint(problem, layout, i, guess.headings[i], ocp);
    }
    if (drive_rules::stops_at(problem, static_cast<int>(i))) {
      fixed.segment(3, layout.n - 3).setZero();
    }
    ocp.fix_state(layout.first[i], fixed);
  }
  if (layout.elastic) {
    ocp.bound_parameters(VectorXd::Zero(layout.parameters()),
                         VectorXd::Constant(layout.parameters(), infinity));
    ocp.set_parameter_start(VectorXd::Constant(layout.parameters(), 1.0));
  }
  ocp.set_data(data_of(layout, no_margins(layout)));
  return ocp;
}

Margins no_margins(const Layout& layout) {
  const int nodes = layout.stages() + 1;
  return {VectorXd::Zero(nodes), VectorXd::Zero(nodes), MatrixXd::Zero(layout.constraints, nodes)};
}

MatrixXd data_of(const Layout& layout, const Margins& margins) {
  const int N = layout.stages();
  MatrixXd data = MatrixXd::Zero(layout.data(), N + 1);
  for (std::size_t s = 0; s + 1 < layout.first.size(); ++s) {
    const int a = layout.begin(s);
    const int b = layout.first[s + 1];
    data.block(0, a, 1, b - a).setConstant(1.0 / (b - a));
  }
  data.row(1) = margins.wheel_speed.transpose();
  data.row(2) = margins.motor_line.transpose();
  data.bottomRows(layout.constraints) = margins.constraints;
  return data;
}

Start start_of(const DriveProblem& problem, const Layout& layout, const Guess& guess) {
  const int N = layout.stages();
  Start start{MatrixXd::Zero(layout.states(), N + 1), MatrixXd::Zero(layout.inputs(), N)};
  std::size_t segment = 0;
  for (int k = 0; k <= N; ++k) {
    start.states.col(k).head(layout.n) = guess.states.col(k - static_cast<int>(segment));
    start.states(layout.duration(), k) = guess.durations(static_cast<Index>(segment));
    if (k == N) {
      break;
    }
    const Index node = k - static_cast<Index>(segment);  // in the guess, which has no changes
    if (layout.is_change(k)) {
      const auto s = static_cast<Index>(segment++);
      start.inputs(layout.change(), k) = guess.durations(s + 1) - guess.durations(s);
    } else if (guess.inputs.cols() > 0) {
      start.inputs.col(k).head(layout.m) = guess.inputs.col(node);
    }
    if (guess.angles.cols() > 0) {
      start.inputs.col(k).tail(guess.angles.rows()) =
          guess.angles.col(std::min(node, guess.angles.cols() - 1));
      continue;
    }
    for (const std::size_t obstacle : layout.obstacles) {
      const Vector2d from = start.states.col(k).head<2>() -
                            drive_rules::disc_of(problem.constraints[obstacle]).center;
      const double angle = std::atan2(from(1), from(0));
      const Span span = drive_rules::span_of(problem, problem.constraints[obstacle]);
      if (layout.first[static_cast<std::size_t>(span.from)] <= k &&
          k <= layout.first[static_cast<std::size_t>(span.to)]) {
        start.inputs(layout.angle(obstacle), k) = angle;
      }
    }
  }
  return start;
}

void write_samples(const DriveProblem& problem, const Layout& layout,
                   const optimization::OptimalControlSolution& found, DriveSolution& solution) {
  const DriveModel& model = problem.model;
  const int N = layout.stages();
  const double F = model.force();
  solution.samples.clear();
  solution.waypoint_times.clear();
  solution.waypoint_samples.clear();
  double t = 0.0;
  const auto add = [&](int k, const VectorXd& u) {
    const VectorXd x = found.states.col(k);
    const auto at = drive_body::motion<double>(model, x, u);
    DriveSample sample{.time = t,
                       .x = x(0),
                       .y = x(1),
                       .heading = x(2),
                       .vx = at.vx,
                       .vy = at.vy,
                       .omega = at.omega,
                       .ax = at.ax,
                       .ay = at.ay,
                       .alpha = at.alpha};
    for (int i = 0; i < model.wheel_count(); ++i) {
      const auto f = drive_body::wheel_force<double>(model, u, i);
      sample.forces[static_cast<std::size_t>(i)] = F * Vector2d(f[0], f[1]);
    }
    if (model.drivetrain == Drivetrain::differential) {
      sample.left = x(3);
      sample.right = x(4);
    }
    solution.samples.push_back(sample);
  };
  for (std::size_t s = 0; s + 1 < layout.first.size(); ++s) {
    solution.waypoint_samples.push_back(static_cast<int>(solution.samples.size()));
    solution.waypoint_times.push_back(t);
    const int begin = layout.begin(s);
    const int end = layout.first[s + 1];
    for (int k = begin; k < end; ++k) {
      add(k, found.inputs.col(k).head(layout.m));
      t += found.states(layout.duration(), k) / (end - begin);
    }
  }
  solution.waypoint_samples.push_back(static_cast<int>(solution.samples.size()));
  solution.waypoint_times.push_back(t);
  solution.duration = t;
  add(N, VectorXd::Zero(layout.m));
}

}  // namespace flyball::drive_transcription
