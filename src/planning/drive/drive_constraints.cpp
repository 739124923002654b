#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "core/constants.hpp"
#include "planning/drive/drive_body.hpp"
#include "planning/drive/drive_rows.hpp"
#include "planning/drive/drive_rules.hpp"

namespace flyball::drive_transcription {

using drive_rules::Span;
using Eigen::Index;
using Eigen::Vector2d;
using Eigen::VectorXd;
using optimization::Expression;
using optimization::OptimalControlProblem;

namespace {

using Vector = optimization::ExpressionVector;

/// Writes one constraint at the stages that it spans.
class Writer {
 public:
  Writer(const DriveProblem& problem, const Layout& layout, std::size_t number,
         OptimalControlProblem& ocp)
      : problem_(problem),
        model_(problem.model),
        constraint_(problem.constraints[number]),
        layout_(layout),
        ocp_(ocp),
        number_(number),
        name_(drive_rules::name_of(problem, number)),
        span_(drive_rules::span_of(problem, constraint_)) {
    end_ = layout_.first[static_cast<std::size_t>(span_.to)];
    begin_ = span_.from == span_.to ? end_ : layout_.begin(static_cast<std::size_t>(span_.from));
  }

  void write() {
    const DriveConstraint& c = constraint_;
    switch (c.kind) {
      case DriveConstraintKind::stop_point:
        break;  // fixed
      case DriveConstraintKind::max_velocity:
        max_velocity();
        break;
      case DriveConstraintKind::max_acceleration:
        max_acceleration();
        break;
      case DriveConstraintKind::max_angular_velocity:
        within([&](const Vector& x,
                   const Vector& u) { return std::vector<Expression>{motion(x, u).omega}; },
               moving(), still());
        break;
      case DriveConstraintKind::point_at:
        point_at();
        break;
      case DriveConstraintKind::keep_in_lane:
        keep_in_lane();
        break;
      case DriveConstraintKind::keep_in_circle:
        keep_in_circle();
        break;
      case DriveConstraintKind::keep_in_rectangle:
        keep_in({Vector2d(c.x, c.y), Vector2d(c.x + c.width, c.y),
                 Vector2d(c.x + c.width, c.y + c.height), Vector2d(c.x, c.y + c.height)});
        break;
      case DriveConstraintKind::keep_in_polygon:
        keep_in(c.polygon);
        break;
      case DriveConstraintKind::keep_out_circle:
        keep_out({Vector2d(c.x, c.y)}, c.radius);
        break;
      case DriveConstraintKind::keep_out_polygon:
        keep_out(c.polygon, 0.0);
        break;
    }
  }

 private:
  /// Rows of g(x, u, what is taken off the limit) at stages a … b.
  template <class G>
  void rows(const G& g, const VectorXd& lower, const VectorXd& upper, int a, int b) {
    if (a > b) {
      return;
    }
    const auto place = static_cast<Index>(number_);
    ocp_.add_constraint(
        [&](const Vector& x, const Vector& u, const Vector& p, const Vector& d) {
          const Expression margin = d(3 + place);
          return g(x, u, layout_.elastic ? Expression(margin - p(place)) : margin);
        },
        lower, upper, a, b, name_);
  }
  template <class G>
  void rows(const G& g, const VectorXd& lower, const VectorXd& upper) {
    rows(g, lower, upper, begin_, end_);
  }
  [[nodiscard]] drive_body::Motion<Expression> motion(const Vector& x, const Vector& u) const {
    return drive_body::motion<Expression>(model_, x, u);
  }
  /// Where the robot stops its speed is zero already.
  [[nodiscard]] int moving() const {
    return begin_ + (drive_rules::stops_at(problem_, span_.from) ? 1 : 0);
  }
  [[nodiscard]] int still() const {
    return end_ - (drive_rules::stops_at(problem_, span_.to) ? 1 : 0);
  }

  /// A vector no longer than the limit; its entries zero where the limit is.
  template <class Entries>
  void within(const Entries& entries, int a, int b) {
    const double limit = constraint_.limit;
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
          VectorXd::Constant(1, -infinity), VectorXd::Zero(1), a, b);
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
  }

  void max_velocity() {
    if (model_.drivetrain == Drivetrain::differential) {
      within([](const Vector& x,
                const Vector&) { return std::vector<Expression>{(x(3) + x(4)) * 0.5}; },
             moving(), still());
    } else {
      within([](const Vector& x, const Vector&) { return std::vector<Expression>{x(3), x(4)}; },
             moving(), still());
    }
  }

  void max_acceleration() {
    const int first = layout_.begin(static_cast<std::size_t>(span_.from));
    const bool alone = begin_ == end_;
    within(
        [&](const Vector& x, const Vector& u) {
          const auto at = motion(x, u);
          return std::vector<Expression>{at.ax, at.ay};
        },
        alone ? first : begin_, alone ? std::min(first, layout_.stages() - 1) : end_ - 1);
  }

  void keep_in_lane() {
    const double tolerance = constraint_.tolerance;
    const drive_rules::Lane lane = drive_rules::lane_of(problem_, constraint_);
    const auto off_center = [&](const Vector& x) {
      return lane.left(0) * (x(0) - lane.start(0)) + lane.left(1) * (x(1) - lane.start(1));
    };
    if (tolerance > 1e-9 || layout_.elastic) {
      rows(
          [&](const Vector& x, const Vector&, const Expression& off) {
            const Expression y = off_center(x);
            return std::array<Expression, 2>{y + off - tolerance, off - y - tolerance};
          },
          VectorXd::Constant(2, -infinity), VectorXd::Zero(2));
    } else {
      rows([&](const Vector& x, const Vector&, const Expression&) { return off_center(x); },
           VectorXd::Zero(1), VectorXd::Zero(1));
    }
  }

  void keep_in_circle() {
    const DriveConstraint& c = constraint_;
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
        VectorXd::Constant(corner_count(), -infinity), VectorXd::Zero(corner_count()));
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

  void keep_in(const std::vector<Vector2d>& polygon) {
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
        VectorXd::Zero(edges * corner_count()));
  }

  /// All corners lie beyond a line between them and the obstacle, whose direction is an input; at
  /// the last stage, which has none, a line along an edge of the bumpers or through the middles.
  void keep_out(const std::vector<Vector2d>& points, double radius) {
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
    const int angle = layout_.angle(number_);
    rows([&](const Vector& x, const Vector& u,
             const Expression& off) { return beyond(x, cos(u(angle)), sin(u(angle)), off); },
         VectorXd::Zero(count), VectorXd::Constant(count, infinity), begin_, std::min(end_, N - 1));
    if (end_ < N) {
      return;
    }
    rows(
        [&](const Vector& x, const Vector&, const Expression& off) {
          // The best of the lines along the bumpers' edges and across the way between middles.
          const drive_rules::Disc disc = drive_rules::disc_of(constraint_);
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

  void point_at() {
    const DriveConstraint& c = constraint_;
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
         none, zero);
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
          VectorXd::Constant(2, -infinity), VectorXd::Zero(2));
    } else {
      rows([&](const Vector& x, const Vector&, const Expression&) { return seen(x)[1]; }, zero,
           zero);
    }
  }

  const DriveProblem& problem_;
  const DriveModel& model_;
  const DriveConstraint& constraint_;
  const Layout& layout_;
  OptimalControlProblem& ocp_;
  std::size_t number_ = 0;
  std::string name_{};
  Span span_{};
  int begin_ = 0, end_ = 0;
};

}  // namespace

void write_constraint(const DriveProblem& problem, const Layout& layout, std::size_t number,
                      OptimalControlProblem& ocp) {
  Writer(problem, layout, number, ocp).write();
}

}  // namespace flyball::drive_transcription
