#include <algorithm>
#include <cmath>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "planning/drive/drive_body.hpp"
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
/// s a unit (m, m/s, rad) that a constraint gives way by: more than what any of them could win.
constexpr double elastic_price = 300.0;

using Vector = ExpressionVector;

/// Writes the constraints of a problem.
class Writer {
 public:
  Writer(const DriveProblem& problem, const Layout& layout, OptimalControlProblem& ocp)
      : problem_(problem), model_(problem.model), layout_(layout), ocp_(ocp) {}

  void dynamics() {
    const int n = layout_.n;
    // A stage is a step of 1 of what is scaled by its length. Between segments stands a stage of no
    // length in which the duration alone changes.
    ocp_.set_derivative(
        [&](const Vector& x, const Vector& u, const Vector& /*p*/, const Vector& d) {
          std::vector<Expression> slope = drive_body::derivative<Expression>(model_, x, u);
          for (Expression& e : slope) {
            e = x(n) * d(0) * e;
          }
          slope.push_back(u(layout_.change()));
          return slope;
        },
        static_cast<double>(layout_.stages()));
    ocp_.set_stage_cost([&](const Vector& x, const Vector& /*u*/, const Vector& /*p*/,
                            const Vector& d) { return x(n) * d(0); });
    if (layout_.elastic) {
      ocp_.set_terminal_cost([&](const Vector& /*x*/, const Vector& /*u*/, const Vector& p) {
        Expression sum = 0.0;
        for (Index i = 0; i < p.size(); ++i) {  // a place to pass is asked for before all else
          sum += (i < layout_.constraints ? elastic_price : 3.0 * elastic_price) * p(i);
        }
        return sum;
      });
    }
  }

  void wheels() {
    const int count = model_.wheel_count();
    const int N = layout_.stages();
    const VectorXd below = VectorXd::Constant(count, -infinity);
    const VectorXd one = VectorXd::Ones(count);
    if (model_.drivetrain == Drivetrain::swerve) {
      ocp_.add_constraint(
          [&](const Vector& /*x*/, const Vector& u) {
            Vector square(count);
            for (int i = 0; i < count; ++i) {
              square(i) = u(2 * i) * u(2 * i) + u(2 * i + 1) * u(2 * i + 1);
            }
            return square;
          },
          below, one, 0, N - 1, "wheel force");
    }
    const double v = model_.max_speed;
    if (model_.drivetrain == Drivetrain::swerve) {
      ocp_.add_constraint(
          [&](const Vector& x, const Vector& /*u*/, const Vector& /*p*/, const Vector& d) {
            Vector square(count);
            for (int i = 0; i < count; ++i) {
              const auto at = drive_body::wheel_velocity<Expression>(model_, x, i);
              square(i) = (at[0] * at[0] + at[1] * at[1]) * (1.0 / (v * v)) + d(1);
            }
            return square;
          },
          below, one, 0, N, "wheel speed");
    } else {
      for (const double sign : {1.0, -1.0}) {
        ocp_.add_constraint(
            [&](const Vector& x, const Vector& /*u*/, const Vector& /*p*/, const Vector& d) {
              Vector speed(count);
              for (int i = 0; i < count; ++i) {
                speed(i) =
                    drive_body::wheel_velocity<Expression>(model_, x, i)[0] * (sign / v) + d(1);
              }
              return speed;
            },
            below, one, 0, N, "wheel speed");
      }
    }
    if (model_.free_speed > 0.0) {
      // Force is held while the speed changes: at both ends of an interval.
      ocp_.add_constraint(
          [&](const Vector& x, const Vector& u, const Vector& /*p*/, const Vector& d) {
            const Vector end = end_of(x, u, d);
            Vector line(2 * count);
            for (int i = 0; i < count; ++i) {
              line(2 * i) = motor_line(x, u, i) + d(2);
              line(2 * i + 1) = motor_line(end, u, i) + d(2);
            }
            return line;
          },
          VectorXd::Constant(2 * count, -infinity), VectorXd::Zero(2 * count), 0, N - 1,
          "motor torque");
    }
    if (model_.drivetrain == Drivetrain::differential && model_.friction > 0.0) {
      // Grip along and across a side.
      const double F = model_.force() / model_.friction;
      const double across = 0.5 * model_.mass / model_.friction;
      ocp_.add_constraint(
          [&](const Vector& x, const Vector& u, const Vector& /*p*/, const Vector& d) {
            const Vector end = end_of(x, u, d);
            Vector grip(2 * count);
            for (int i = 0; i < count; ++i) {
              const auto total = [&](const Vector& at) {
                const Expression turn = (at(4) - at(3)) * (1.0 / model_.trackwidth);
                const Expression side = (at(3) + at(4)) * 0.5 * turn * across;
                return F * F * u(i) * u(i) + side * side + 2.0 * d(2);
              };
              grip(2 * i) = total(x);
              grip(2 * i + 1) = total(end);
            }
            return grip;
          },
          VectorXd::Constant(2 * count, -infinity), VectorXd::Ones(2 * count), 0, N - 1, "grip");
    }
  }

  void constraint(std::size_t number) {
    const DriveConstraint& c = problem_.constraints[number];
    const Span span = drive_rules::span_of(problem_, c);
    const int end = layout_.first[static_cast<std::size_t>(span.to)];
    const int begin =
        span.from == span.to ? end : layout_.begin(static_cast<std::size_t>(span.from));
    const int N = layout_.stages();
    const std::string name = drive_rules::name_of(problem_, number);
    const auto way = [&](const Vector& p, const Vector& d) {  // how much is taken off the limit
      Expression margin = d(3 + static_cast<Index>(number));
      return layout_.elastic ? margin - p(static_cast<Index>(number)) : margin;
    };
    const auto rows = [&](auto&& g, const VectorXd& lower, const VectorXd& upper, int a, int b) {
      if (a <= b) {
        ocp_.add_constraint([&](const Vector& x, const Vector& u, const Vector& p,
                                const Vector& d) { return g(x, u, way(p, d)); },
                            lower, upper, a, b, name);
      }
    };
    const auto motion = [&](const Vector& x, const Vector& u) {
      return drive_body::motion<Expression>(model_, x, u);
    };
    const VectorXd zero = VectorXd::Zero(1);
    const VectorXd none = VectorXd::Constant(1, -infinity);
    // A vector no longer than a limit; its entries zero where the limit is.
    const auto within = [&](auto&& entries, double limit, int a, int b) {
      if (limit > 1e-9 || layout_.elastic) {
        rows(
            [&](const Vector& x, const Vector& u, const Expression& off) {
              Expression square = 0.0;
              for (const Expression& e : entries(x, u)) {
                square += e * e;
              }
              if (layout_.elastic) {  // convex in both
                return Expression(sqrt(square + 1e-6) - 1e-3 - limit + off);
              }
              const Expression most = limit - off;
              const double unit = std::max(limit, 0.1);
              return Expression((square - most * most) * (1.0 / (unit * unit)));
            },
            none, zero, a, b);
        return;
      }
      const auto width =
          static_cast<Index>(entries(Vector::Constant(layout_.states(), Expression(0.0)),
                                     Vector::Constant(layout_.inputs(), Expression(0.0)))
                                 .size());
      // Both nodes of a waypoint on the way are one: what is equal there is said once.
      int from = a;
      for (int k = a; k <= b; ++k) {
        if (k == b || layout_.is_change(k + 1)) {
          rows([&](const Vector& x, const Vector& u, const Expression&) { return entries(x, u); },
               VectorXd::Zero(width), VectorXd::Zero(width), from, k);
          from = k + 2;
        }
      }
    };
    // Where the robot stops its speed is zero already.
    const int moving = begin + (drive_rules::stops_at(problem_, span.from) ? 1 : 0);
    const int still = end - (drive_rules::stops_at(problem_, span.to) ? 1 : 0);
    switch (c.kind) {
      case DriveConstraintKind::stop_point:
        break;  // fixed
      case DriveConstraintKind::max_velocity:
        if (model_.drivetrain == Drivetrain::differential) {
          within([&](const Vector& x,
                     const Vector&) { return std::vector<Expression>{(x(3) + x(4)) * 0.5}; },
                 c.limit, moving, still);
        } else {
          within(
              [&](const Vector& x, const Vector&) { return std::vector<Expression>{x(3), x(4)}; },
              c.limit, moving, still);
        }
        break;
      case DriveConstraintKind::max_acceleration:
        within(
            [&](const Vector& x, const Vector& u) {
              const auto at = motion(x, u);
              return std::vector<Expression>{at.ax, at.ay};
            },
            c.limit, begin == end ? layout_.begin(static_cast<std::size_t>(span.from)) : begin,
            begin == end ? std::min(layout_.begin(static_cast<std::size_t>(span.from)), N - 1)
                         : end - 1);
        break;
      case DriveConstraintKind::max_angular_velocity:
        within([&](const Vector& x,
                   const Vector& u) { return std::vector<Expression>{motion(x, u).omega}; },
               c.limit, moving, still);
        break;
      case DriveConstraintKind::point_at:
        point_at(c, rows, begin, end);
        break;
      case DriveConstraintKind::keep_in_lane: {
        const drive_rules::Lane lane = drive_rules::lane_of(problem_, c);
        const auto off_center = [&](const Vector& x) {
          return lane.left(0) * (x(0) - lane.start(0)) + lane.left(1) * (x(1) - lane.start(1));
        };
        if (c.tolerance > 1e-9 || layout_.elastic) {
          rows(
              [&](const Vector& x, const Vector&, const Expression& off) {
                const Expression y = off_center(x);
                return std::array<Expression, 2>{y + off - c.tolerance, off - y - c.tolerance};
              },
              VectorXd::Constant(2, -infinity), VectorXd::Zero(2), begin, end);
        } else {
          rows([&](const Vector& x, const Vector&, const Expression&) { return off_center(x); },
               zero, zero, begin, end);
        }
        break;
      }
      case DriveConstraintKind::keep_in_circle:
        rows(
            [&](const Vector& x, const Vector&, const Expression& off) {
              std::vector<Expression> out;
              const Expression most = c.radius - off;
              for (const auto& q : corners(x)) {
                const Expression a = q[0] - c.x;
                const Expression b = q[1] - c.y;
                out.push_back((a * a + b * b - most * most) / (c.radius * c.radius));
              }
              return out;
            },
            VectorXd::Constant(corner_count(), -infinity), VectorXd::Zero(corner_count()), begin,
            end);
        break;
      case DriveConstraintKind::keep_in_rectangle:
        keep_in({Vector2d(c.x, c.y), Vector2d(c.x + c.width, c.y),
                 Vector2d(c.x + c.width, c.y + c.height), Vector2d(c.x, c.y + c.height)},
                rows, begin, end);
        break;
      case DriveConstraintKind::keep_in_polygon:
        keep_in(c.polygon, rows, begin, end);
        break;
      case DriveConstraintKind::keep_out_circle:
        keep_out({Vector2d(c.x, c.y)}, c.radius, number, rows, begin, end);
        break;
      case DriveConstraintKind::keep_out_polygon:
        keep_out(c.polygon, 0.0, number, rows, begin, end);
        break;
    }
  }

  /// What waypoints fix, where it may give way.
  void elastic_waypoint(std::size_t i, double heading) {
    const DriveWaypoint& w = problem_.waypoints[i];
    const int k = layout_.first[i];
    const Index give = layout_.constraints + static_cast<Index>(i);
    const auto within = [&](int state, double value) {
      ocp_.add_constraint(
          [&](const Vector& x, const Vector& /*u*/, const Vector& p) {
            return std::array<Expression, 2>{x(state) - value - p(give),
                                             value - x(state) - p(give)};
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

 private:
  /// About where an interval ends.
  [[nodiscard]] Vector end_of(const Vector& x, const Vector& u, const Vector& d) const {
    const auto slope = drive_body::derivative<Expression>(model_, x, u);
    Vector end = x;
    for (std::size_t i = 0; i < slope.size(); ++i) {
      end(static_cast<Index>(i)) += x(layout_.duration()) * d(0) * slope[i];
    }
    return end;
  }

  /// How far a wheel's power is above its motor's line, over stall_force max_speed.
  [[nodiscard]] Expression motor_line(const Vector& x, const Vector& u, int wheel) const {
    const auto v = drive_body::wheel_velocity<Expression>(model_, x, wheel);
    const auto f = drive_body::wheel_force<Expression>(model_, u, wheel);
    const double F = model_.force() / model_.stall_force;
    const double unit = 1.0 / model_.max_speed;
    const double softness = 1e-3 * model_.max_speed;
    const Expression square = v[0] * v[0] + v[1] * v[1];
    const Expression speed = sqrt(square + softness * softness);
    return ((f[0] * v[0] + f[1] * v[1]) * F - speed + square * (1.0 / model_.free_speed)) * unit;
  }

  [[nodiscard]] Index corner_count() const {
    return static_cast<Index>(drive_rules::corners_of(model_).size());
  }
  /// The bumpers' corners in the field.
  [[nodiscard]] std::vector<std::array<Expression, 2>> corners(const Vector& x) const {
    const Expression cosine = cos(x(2));
    const Expression sine = sin(x(2));
    std::vector<std::array<Expression, 2>> out;
    for (const Vector2d& q : drive_rules::corners_of(model_)) {
      out.push_back({x(0) + cosine * q(0) - sine * q(1), x(1) + sine * q(0) + cosine * q(1)});
    }
    return out;
  }

  template <class Rows>
  void keep_in(const std::vector<Vector2d>& polygon, const Rows& rows, int begin, int end) {
    const auto edges = static_cast<Index>(polygon.size());
    rows(
        [&](const Vector& x, const Vector&, const Expression& off) {
          std::vector<Expression> out;
          for (const auto& q : corners(x)) {
            for (std::size_t i = 0; i < polygon.size(); ++i) {
              const Vector2d edge = polygon[(i + 1) % polygon.size()] - polygon[i];
              const Vector2d normal = Vector2d(edge(1), -edge(0)).normalized();
              out.push_back(normal(0) * (q[0] - polygon[i](0)) +
                            normal(1) * (q[1] - polygon[i](1)) + off);
            }
          }
          return out;
        },
        VectorXd::Constant(edges * corner_count(), -infinity),
        VectorXd::Zero(edges * corner_count()), begin, end);
  }

  /// All corners lie beyond a line between them and the obstacle, whose direction is an input; at
  /// the last stage, which has none, a line along an edge of the bumpers or through the middles.
  template <class Rows>
  void keep_out(const std::vector<Vector2d>& points, double radius, std::size_t number,
                const Rows& rows, int begin, int end) {
    const int N = layout_.stages();
    const Index count = static_cast<Index>(points.size()) * corner_count();
    const auto beyond = [&](const Vector& x, const Expression& nx, const Expression& ny,
                            const Expression& off) {
      std::vector<Expression> out;
      for (const auto& q : corners(x)) {
        for (const Vector2d& point : points) {
          out.push_back(nx * (q[0] - point(0)) + ny * (q[1] - point(1)) - radius - off);
        }
      }
      return out;
    };
    const int angle = layout_.angle(number);
    rows([&](const Vector& x, const Vector& u,
             const Expression& off) { return beyond(x, cos(u(angle)), sin(u(angle)), off); },
         VectorXd::Zero(count), VectorXd::Constant(count, infinity), begin, std::min(end, N - 1));
    if (end < N) {
      return;
    }
    rows(
        [&](const Vector& x, const Vector&, const Expression& off) {
          // The best of the lines along the bumpers' edges and across the way between middles.
          const drive_rules::Disc disc = drive_rules::disc_of(problem_.constraints[number]);
          std::vector<std::array<Expression, 2>> normals;
          const Expression a = x(0) - disc.center(0);
          const Expression b = x(1) - disc.center(1);
          const Expression length = sqrt(a * a + b * b + 1e-6);
          normals.push_back({a / length, b / length});
          const auto corner = corners(x);
          const std::vector<Vector2d> own = drive_rules::corners_of(model_);
          const Expression cosine = cos(x(2));
          const Expression sine = sin(x(2));
          for (std::size_t i = 0; i < own.size() && own.size() > 2; ++i) {
            const Vector2d edge = own[(i + 1) % own.size()] - own[i];
            const Vector2d normal = Vector2d(-edge(1), edge(0)).normalized();  // inwards
            normals.push_back(
                {cosine * normal(0) - sine * normal(1), sine * normal(0) + cosine * normal(1)});
          }
          Expression best = -1e3;
          for (const auto& normal : normals) {
            Expression least = 1e3;
            for (const Expression& e : beyond(x, normal[0], normal[1], off)) {
              least = min(least, e);
            }
            best = max(best, least);
          }
          return best;
        },
        VectorXd::Zero(1), VectorXd::Constant(1, infinity), N, N);
  }

  template <class Rows>
  void point_at(const DriveConstraint& c, const Rows& rows, int begin, int end) {
    const double sign = c.flip ? -1.0 : 1.0;
    const auto seen = [&](const Vector& x) {  // the target from the front, of length 1
      const Expression a = c.x - x(0);
      const Expression b = c.y - x(1);
      const Expression length = sqrt(a * a + b * b + 1e-9);
      const Expression cosine = cos(x(2));
      const Expression sine = sin(x(2));
      return std::array<Expression, 2>{sign * (cosine * a + sine * b) / length,
                                       sign * (cosine * b - sine * a) / length};
    };
    const double tolerance = std::min(c.tolerance, 3.1);
    const bool narrow = tolerance < 1.5;
    const VectorXd zero = VectorXd::Zero(1);
    const VectorXd none = VectorXd::Constant(1, -infinity);
    const double ahead = narrow ? 0.5 * std::cos(tolerance) : std::cos(tolerance);
    rows([&](const Vector& x, const Vector&,
             const Expression& off) { return ahead + 2.0 * off - seen(x)[0]; },
         none, zero, begin, end);
    if (!narrow) {
      return;
    }
    if (tolerance > 1e-9 || layout_.elastic) {
      const double most = std::sin(tolerance);
      rows(
          [&](const Vector& x, const Vector&, const Expression& off) {
            const Expression side = seen(x)[1];
            return std::array<Expression, 2>{side + off - most, off - side - most};
          },
          VectorXd::Constant(2, -infinity), VectorXd::Zero(2), begin, end);
    } else {
      rows([&](const Vector& x, const Vector&, const Expression&) { return seen(x)[1]; }, zero,
           zero, begin, end);
    }
  }

  const DriveProblem& problem_;
  const DriveModel& model_;
  const Layout& layout_;
  OptimalControlProblem& ocp_;
};

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
  Writer writer(problem, layout, ocp);
  writer.dynamics();
  writer.wheels();
  for (std::size_t i = 0; i < problem.constraints.size(); ++i) {
    writer.constraint(i);
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
      writer.elastic_waypoint(i, guess.headings[i]);
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
    if (layout.is_change(k)) {
      const auto s = static_cast<Index>(segment++);
      start.inputs(layout.change(), k) = guess.durations(s + 1) - guess.durations(s);
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
