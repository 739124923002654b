#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <flyball/math/integration/adaptive.hpp>
#include <flyball/planning/drive/optimize_drive.hpp>

#include "core/format.hpp"
#include "planning/drive/check_drive.hpp"
#include "planning/drive/drive_body.hpp"
#include "planning/drive/drive_rules.hpp"

namespace flyball {

using drive_rules::Span;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

namespace {

constexpr int instants_of_an_interval = 100;
constexpr std::size_t most_violations = 10;

/// What a wheel may exceed.
enum class WheelLimit : std::uint8_t { speed, force, torque, grip, power };
constexpr std::size_t wheel_limits = 5;

/// The worst of each thing: constraints by their place, then the wheels' limits.
class Worst {
 public:
  Worst(const DriveProblem& problem, const std::vector<DriveSample>& samples,
        const std::vector<int>& waypoint_samples)
      : problem_(problem),
        samples_(samples),
        waypoints_(waypoint_samples),
        found_(problem.constraints.size() + 4 * wheel_limits) {}

  void add_constraint(std::size_t number, double amount, double limit, double time) {
    add(number, amount, limit, time);
  }
  void add_wheel(WheelLimit kind, std::size_t wheel, double amount, double limit, double time) {
    add(problem_.constraints.size() + static_cast<std::size_t>(kind) * 4 + wheel, amount, limit,
        time);
  }
  [[nodiscard]] std::vector<DriveViolation> sorted() const {
    std::vector<DriveViolation> sorted;
    for (std::size_t i = 0; i < found_.size(); ++i) {
      if (found_[i].amount > 0.0) {
        sorted.push_back(named(i));
      }
    }
    std::sort(sorted.begin(), sorted.end(),
              [](const DriveViolation& a, const DriveViolation& b) { return a.share > b.share; });
    if (sorted.size() > most_violations) {
      sorted.resize(most_violations);
    }
    return sorted;
  }

 private:
  struct Found {
    double amount = 0.0, share = 0.0, time = 0.0;
  };

  void add(std::size_t place, double amount, double limit, double time) {
    Found& worst = found_[place];
    if (amount > worst.amount) {
      worst = {amount, limit > 0.0 ? amount / limit : amount, time};
    }
  }
  [[nodiscard]] DriveViolation named(std::size_t place) const {
    constexpr std::array<std::string_view, 4> corners{"front left", "front right", "back left",
                                                      "back right"};
    constexpr std::array<std::string_view, 2> sides{"left", "right"};
    const Found& worst = found_[place];
    DriveViolation v{.segment = segment_at(worst.time),
                     .time = worst.time,
                     .amount = worst.amount,
                     .share = worst.share};
    const std::size_t constraints = problem_.constraints.size();
    if (place < constraints) {
      v.name = drive_rules::name_of(problem_, place);
      v.unit = drive_rules::unit_of(problem_.constraints[place].kind);
      v.constraint = static_cast<int>(place);
      return v;
    }
    const std::size_t wheel = (place - constraints) % 4;
    const std::string_view which =
        problem_.model.drivetrain == Drivetrain::differential ? sides[wheel % 2] : corners[wheel];
    v.unit = "N";
    switch (static_cast<WheelLimit>((place - constraints) / 4)) {
      case WheelLimit::speed:
        v.name = flyball::detail::format("speed of the {} wheel", which);
        v.unit = "m/s";
        break;
      case WheelLimit::force:
        v.name = flyball::detail::format("force of the {} wheel", which);
        break;
      case WheelLimit::torque:
        v.name = flyball::detail::format("torque of the {} motor at its speed", which);
        break;
      case WheelLimit::grip:
        v.name = flyball::detail::format("grip of the {} side", which);
        break;
      case WheelLimit::power:
        v.name = flyball::detail::format("supply current of the {} motor", which);
        v.unit = "W";
        break;
    }
    return v;
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

  const DriveProblem& problem_;
  const std::vector<DriveSample>& samples_;
  const std::vector<int>& waypoints_;
  std::vector<Found> found_;
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

/// What the wheels exceed at an instant, as shares of limits.
struct WheelShares {
  double speed = 0.0, line = 0.0;
};
WheelShares check_wheels(const DriveModel& model, const VectorXd& x, const VectorXd& u, double t,
                         Worst& worst) {
  WheelShares shares;
  for (int i = 0; i < model.wheel_count(); ++i) {
    const auto w = static_cast<std::size_t>(i);
    const auto v = drive_body::wheel_velocity<double>(model, x, i);
    const auto f = drive_body::wheel_force<double>(model, u, i);
    const double speed = std::hypot(v[0], v[1]);
    const double force = std::hypot(f[0], f[1]) * model.force();
    worst.add_wheel(WheelLimit::speed, w, speed - model.max_speed, model.max_speed, t);
    shares.speed = std::max(shares.speed, speed / model.max_speed - 1.0);
    worst.add_wheel(WheelLimit::force, w, force - model.force(), model.force(), t);
    if (model.free_speed > 0.0 && speed > 1e-3 * model.max_speed) {
      const double along = (f[0] * v[0] + f[1] * v[1]) / speed * model.force();
      const double most = model.stall_force * (1.0 - speed / model.free_speed);
      worst.add_wheel(WheelLimit::torque, w, along - most, model.stall_force, t);
      shares.line = std::max(shares.line, (along - most) / model.stall_force);
    }
    if (model.supply_power > 0.0) {
      const double drawn =
          (f[0] * v[0] + f[1] * v[1]) * model.force() + model.copper_loss * force * force;
      const double beyond = drawn - model.supply_power;
      worst.add_wheel(WheelLimit::power, w, beyond, model.supply_power, t);
      shares.line = std::max(shares.line, beyond / model.supply_power);
    }
    if (model.drivetrain == Drivetrain::differential && model.friction > 0.0) {
      const auto at = drive_body::motion<double>(model, x, u);
      const double across = 0.25 * model.mass * (x(3) + x(4)) * at.omega;
      const double beyond = std::hypot(force, across) - model.friction;
      worst.add_wheel(WheelLimit::grip, w, beyond, model.friction, t);
      shares.line = std::max(shares.line, beyond / model.friction);
    }
  }
  return shares;
}

}  // namespace

DriveCheck check_drive(const DriveProblem& problem, const std::vector<DriveSample>& samples,
                       const std::vector<int>& waypoint_samples) {
  return drive_check::check(problem, samples, waypoint_samples, instants_of_an_interval, nullptr);
}

DriveCheck drive_check::check(const DriveProblem& problem, const std::vector<DriveSample>& samples,
                              const std::vector<int>& waypoint_samples, int instants,
                              Excesses* excesses) {
  DriveCheck result;
  if (samples.size() < 2 || waypoint_samples.size() != problem.waypoints.size()) {
    return result;
  }
  const DriveModel& model = problem.model;
  Worst worst(problem, samples, waypoint_samples);
  const auto intervals = static_cast<Index>(samples.size()) - 1;
  const auto constraints = static_cast<Index>(problem.constraints.size());
  Excesses unwanted;
  Excesses& found = excesses != nullptr ? *excesses : unwanted;
  found.constraints = MatrixXd::Zero(constraints, intervals);
  found.shares = MatrixXd::Zero(constraints, intervals);
  found.wheel_speed = VectorXd::Zero(intervals);
  found.motor_line = VectorXd::Zero(intervals);
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
                                     bool at_end, double t) {
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
      if (inside && (spans || k == a || k == b) && (pushes || !at_end)) {
        const auto excess = drive_rules::excess(problem, constraint, x, u);
        worst.add_constraint(c, excess.amount, excess.limit, t);
        const auto row = static_cast<Index>(c);
        if (!at_sample && excess.amount > found.constraints(row, k)) {
          found.constraints(row, k) = excess.amount;
          found.shares(row, k) = excess.limit > 0.0 ? excess.amount / excess.limit : excess.amount;
        }
      }
    }
  };
  const Index n = x.size();
  const IntegrationOptions options{.relative_tolerance = 1e-10, .absolute_tolerance = 1e-11};
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const bool last = k + 1 == samples.size();
    const VectorXd u = push_of(model, samples[k]);
    check_waypoint(k);
    check_constraints(u, k, true, false, samples[k].time);
    if (last) {
      static_cast<void>(check_wheels(model, x, u, samples[k].time, worst));
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
    for (int j = 0; j <= instants; ++j) {  // at its end, too, where its force still pushes
      const double share = static_cast<double>(j) / instants;
      x = motion->at(share);
      const double t = samples[k].time + share * h;
      const WheelShares shares = check_wheels(model, x, u, t, worst);
      const auto at = static_cast<Index>(k);
      found.wheel_speed(at) = std::max(found.wheel_speed(at), shares.speed);
      found.motor_line(at) = std::max(found.motor_line(at), shares.line);
      if (j > 0) {
        check_constraints(u, k, false, j == instants, t);
      }
    }
    x = VectorXd(motion->final_state());
  }
  result.violations = worst.sorted();
  return result;
}

}  // namespace flyball
