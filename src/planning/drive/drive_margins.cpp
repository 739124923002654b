#include <algorithm>
#include <limits>

#include "planning/drive/drive_body.hpp"
#include "planning/drive/drive_margins.hpp"
#include "planning/drive/drive_rules.hpp"

namespace flyball::drive_margins {

using drive_transcription::Layout;
using drive_transcription::Margins;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

bool is_area(DriveConstraintKind kind) {
  switch (kind) {
    case DriveConstraintKind::stop_point:
    case DriveConstraintKind::max_velocity:
    case DriveConstraintKind::max_acceleration:
    case DriveConstraintKind::max_angular_velocity:
      return false;
    default:
      return true;
  }
}

/// The most that a constraint may be drawn tighter by anywhere.
double most_of(const DriveConstraint& c) {
  switch (c.kind) {
    case DriveConstraintKind::max_velocity:
    case DriveConstraintKind::max_acceleration:
    case DriveConstraintKind::max_angular_velocity:
      return 0.5 * c.limit;
    case DriveConstraintKind::point_at:
    case DriveConstraintKind::keep_in_lane:
      return 0.5 * c.tolerance;
    case DriveConstraintKind::keep_in_circle:
      return 0.5 * c.radius;
    case DriveConstraintKind::keep_in_rectangle:
      return 0.25 * std::min(c.width, c.height);
    default:
      return std::numeric_limits<double>::infinity();
  }
}

/// How far a sample's pose is inside a constraint; of what is not, nothing.
double room_at(const DriveProblem& problem, const DriveConstraint& c, const DriveSample& s) {
  VectorXd x = VectorXd::Zero(drive_body::states(problem.model.drivetrain));
  x.head<3>() << s.x, s.y, s.heading;
  const VectorXd u = VectorXd::Zero(drive_body::inputs(problem.model.drivetrain));
  return std::max(0.0, -drive_rules::excess(problem, c, x, u).amount);
}

}  // namespace

bool tighten(const DriveProblem& problem, const Layout& layout,
             const std::vector<DriveSample>& samples, const drive_check::Excesses& excesses,
             double keep_to, Margins& margins) {
  constexpr double more = 1.1;
  bool any = false;
  const MatrixXd before = margins.constraints;
  const VectorXd speed_before = margins.wheel_speed;
  const VectorXd line_before = margins.motor_line;
  const auto raise = [&](double& margin, double old, double by) {
    margin = std::max(margin, old + by);
    any = true;
  };
  std::size_t segment = 0;
  for (Index k = 0; k < excesses.wheel_speed.size(); ++k) {
    while (k + static_cast<Index>(segment) >= layout.first[segment + 1]) {
      ++segment;
    }
    const Index a = k + static_cast<Index>(segment);
    for (Index node = a; node <= a + 1; ++node) {
      if (excesses.wheel_speed(k) > keep_to) {  // of squares, where wheels are steered
        raise(margins.wheel_speed(node), speed_before(node), 2.0 * more * excesses.wheel_speed(k));
      }
      if (excesses.motor_line(k) > keep_to) {
        raise(margins.motor_line(node), line_before(node), more * excesses.motor_line(k));
      }
      for (Index c = 0; c < layout.constraints; ++c) {
        if (excesses.shares(c, k) > keep_to) {
          raise(margins.constraints(c, node), before(c, node), more * excesses.constraints(c, k));
        }
      }
    }
  }
  if (!any) {
    return false;
  }
  for (Index c = 0; c < layout.constraints; ++c) {
    const DriveConstraint& of = problem.constraints[static_cast<std::size_t>(c)];
    margins.constraints.row(c) = margins.constraints.row(c).cwiseMin(most_of(of));
    for (std::size_t i = 0; i < problem.waypoints.size() && is_area(of.kind); ++i) {
      if (!problem.waypoints[i].fix_translation) {
        continue;
      }
      // The waypoint is two nodes on the way, and its sample is the first of the next segment.
      const Index first = layout.first[i];
      const Index last = layout.is_change(layout.first[i]) ? first + 1 : first;
      const Index sample = i + 1 == problem.waypoints.size()
                               ? static_cast<Index>(samples.size()) - 1
                               : layout.begin(i) - static_cast<Index>(i);
      const double room = room_at(problem, of, samples[static_cast<std::size_t>(sample)]);
      for (Index node = first; node <= last; ++node) {
        double& margin = margins.constraints(c, node);
        margin = std::min(margin, 0.9 * room);
      }
    }
  }
  margins.wheel_speed = margins.wheel_speed.cwiseMin(0.5);
  margins.motor_line = margins.motor_line.cwiseMin(0.3);
  return true;
}

}  // namespace flyball::drive_margins
