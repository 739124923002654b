#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <flyball/math/integration/adaptive.hpp>
#include <flyball/planning/drive/optimize_drive.hpp>

#include "core/format.hpp"
#include "planning/drive/drive_body.hpp"
#include "planning/drive/drive_rules.hpp"

namespace flyball {

using drive_rules::Span;
using Eigen::Index;
using Eigen::Vector2d;
using Eigen::VectorXd;

namespace {

constexpr int instants = 8;  // of an interval
constexpr std::size_t most_violations = 10;

/// The worst of each thing.
class Worst {
 public:
  Worst(const std::vector<DriveSample>& samples, const std::vector<int>& waypoint_samples)
      : samples_(samples), waypoints_(waypoint_samples) {}

  void add(const std::string& name, std::string_view unit, double amount, double limit, double time,
           int constraint) {
    if (!(amount > 0.0)) {
      return;
    }
    DriveViolation& worst = of(name, constraint);
    if (amount > worst.amount) {
      worst.unit = unit;
      worst.amount = amount;
      worst.share = limit > 0.0 ? amount / limit : amount;
      worst.time = time;
      worst.segment = segment_at(time);
    }
  }
  [[nodiscard]] std::vector<DriveViolation> sorted() && {
    std::sort(found_.begin(), found_.end(),
              [](const DriveViolation& a, const DriveViolation& b) { return a.share > b.share; });
    if (found_.size() > most_violations) {
      found_.resize(most_violations);
    }
    return std::move(found_);
  }

 private:
  DriveViolation& of(const std::string& name, int constraint) {
    for (DriveViolation& v : found_) {
      if (v.name == name && v.constraint == constraint) {
        return v;
      }
    }
    found_.push_back({.name = name, .constraint = constraint});
    return found_.back();
  }
  [[nodiscard]] int segment_at(double time) const {
    int segment = 0;
    for (std::size_t i = 0; i < waypoints_.size(); ++i) {
      if (time >= samples_[static_cast<std::size_t>(waypoints_[i])].time) {
        segment = static_cast<int>(i);
      }
    }
    return segment;
  }

  const std::vector<DriveSample>& samples_;
  const std::vector<int>& waypoints_;
  std::vector<DriveViolation> found_;
};

VectorXd state_of(const DriveModel& model, const DriveSample& s) {
  VectorXd x(drive_body::states(model.drivetrain));
  if (model.drivetrain == Drivetrain::differential) {
    x << s.x, s.y, s.heading, s.left, s.right;
  } else {
    x << s.x, s.y, s.heading, s.vx, s.vy, s.omega;
  }
  return x;
}

VectorXd push_of(const DriveModel& model, const DriveSample& s) {
  VectorXd u(drive_body::inputs(model.drivetrain));
  for (int i = 0; i < model.wheel_count(); ++i) {
    const Vector2d f = s.forces[static_cast<std::size_t>(i)] / model.force();
    if (model.drivetrain == Drivetrain::swerve) {
      u.segment<2>(2 * i) = f;
    } else {
      u(i) = f(0);
    }
  }
  return u;
}

/// What the wheels do at an instant.
void check_wheels(const DriveModel& model, const VectorXd& x, const VectorXd& u, double t,
                  Worst& worst) {
  constexpr std::array<std::string_view, 4> corners{"front left", "front right", "back left",
                                                    "back right"};
  constexpr std::array<std::string_view, 2> sides{"left", "right"};
  for (int i = 0; i < model.wheel_count(); ++i) {
    const auto w = static_cast<std::size_t>(i);
    const std::string_view which =
        model.drivetrain == Drivetrain::differential ? sides[w % 2] : corners[w];
    const auto v = drive_body::wheel_velocity<double>(model, x, i);
    const auto f = drive_body::wheel_force<double>(model, u, i);
    const double speed = std::hypot(v[0], v[1]);
    const double force = std::hypot(f[0], f[1]) * model.force();
    worst.add(flyball::detail::format("speed of the {} wheel", which), "m/s",
              speed - model.max_speed, model.max_speed, t, -1);
    worst.add(flyball::detail::format("force of the {} wheel", which), "N", force - model.force(),
              model.force(), t, -1);
    if (model.free_speed > 0.0 && speed > 1e-3 * model.max_speed) {
      const double along = (f[0] * v[0] + f[1] * v[1]) / speed * model.force();
      const double most = model.stall_force * (1.0 - speed / model.free_speed);
      worst.add(flyball::detail::format("torque of the {} motor at its speed", which), "N",
                along - most, model.stall_force, t, -1);
    }
    if (model.drivetrain == Drivetrain::differential && model.friction > 0.0) {
      const auto at = drive_body::motion<double>(model, x, u);
      const double across = 0.25 * model.mass * (x(3) + x(4)) * at.omega;
      worst.add(flyball::detail::format("grip of the {} side", which), "N",
                std::hypot(force, across) - model.friction, model.friction, t, -1);
    }
  }
}

}  // namespace

DriveCheck check_drive(const DriveProblem& problem, const std::vector<DriveSample>& samples,
                       const std::vector<int>& waypoint_samples) {
  DriveCheck result;
  if (samples.size() < 2 || waypoint_samples.size() != problem.waypoints.size()) {
    return result;
  }
  const DriveModel& model = problem.model;
  Worst worst(samples, waypoint_samples);
  VectorXd x = state_of(model, samples.front());
  const auto check_waypoint = [&](std::size_t sample) {
    for (std::size_t i = 0; i < waypoint_samples.size(); ++i) {
      if (waypoint_samples[i] != static_cast<int>(sample)) {
        continue;
      }
      const DriveWaypoint& w = problem.waypoints[i];
      if (w.fix_translation) {
        const double off = std::hypot(x(0) - w.x, x(1) - w.y);
        result.waypoint_error = std::max(result.waypoint_error, off);
      }
      if (w.fix_heading) {
        const double off = std::abs(std::remainder(x(2) - w.heading, 2.0 * std::numbers::pi));
        result.heading_error = std::max(result.heading_error, off);
      }
    }
  };
  // Where in a constraint's span an instant lies: an interval, or a waypoint's sample alone.
  const auto check_constraints = [&](const VectorXd& u, std::size_t sample, bool at_sample,
                                     double t) {
    const auto k = static_cast<int>(sample);
    for (std::size_t c = 0; c < problem.constraints.size(); ++c) {
      const DriveConstraint& constraint = problem.constraints[c];
      const Span span = drive_rules::span_of(problem, constraint);
      const int a = waypoint_samples[static_cast<std::size_t>(span.from)];
      const int b = waypoint_samples[static_cast<std::size_t>(span.to)];
      const bool pushes = constraint.kind == DriveConstraintKind::max_acceleration;
      const bool spans = constraint.kind != DriveConstraintKind::stop_point || !constraint.to;
      const bool inside =
          at_sample ? a <= k && k <= b && (!pushes || a == b || k < b) : spans && a <= k && k < b;
      if (inside && (spans || k == a || k == b)) {
        const auto excess = drive_rules::excess(problem, constraint, x, u);
        worst.add(drive_rules::name_of(problem, c), drive_rules::unit_of(constraint.kind),
                  excess.amount, excess.limit, t, static_cast<int>(c));
      }
    }
  };
  const Index n = x.size();
  const IntegrationOptions options{.relative_tolerance = 1e-10, .absolute_tolerance = 1e-11};
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const bool last = k + 1 == samples.size();
    const VectorXd u = push_of(model, samples[k]);
    check_waypoint(k);
    check_constraints(u, k, true, samples[k].time);
    if (last) {
      check_wheels(model, x, u, samples[k].time, worst);
      break;
    }
    const double h = samples[k + 1].time - samples[k].time;
    const auto rate = [&](double, const VectorXd& at) -> VectorXd {
      const auto slope = drive_body::derivative<double>(model, at, u);
      return h * Eigen::Map<const VectorXd>(slope.data(), n);
    };
    const auto motion = integrate(rate, 0.0, x, 1.0, options);
    if (!motion) {
      result.waypoint_error = std::numeric_limits<double>::infinity();
      break;
    }
    for (int j = 0; j < instants; ++j) {
      const double share = static_cast<double>(j) / instants;
      x = motion->at(share);
      const double t = samples[k].time + share * h;
      check_wheels(model, x, u, t, worst);
      if (j > 0) {
        check_constraints(u, k, false, t);
      }
    }
    x = VectorXd(motion->final_state());
  }
  result.violations = std::move(worst).sorted();
  return result;
}

}  // namespace flyball
