#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include <Eigen/LU>

#include "core/format.hpp"
#include "planning/drive/drive_body.hpp"
#include "planning/drive/drive_guess.hpp"
#include "planning/drive/drive_rules.hpp"

namespace flyball::drive_guess {

using drive_rules::Disc;
using drive_transcription::Guess;
using drive_transcription::Layout;
using drive_way::Timing;
using drive_way::Way;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

namespace {

bool steers(const DriveProblem& problem) {
  return problem.model.drivetrain == Drivetrain::differential;
}

/// A point of the way at a time.
struct Spot {
  Vector2d point{};
  double heading = 0.0;
};

/// Looks up times that do not go back.
class Clock {
 public:
  Clock(const Way& way, const Timing& timing) : way_(way), timing_(timing) {}

  [[nodiscard]] Spot at(double t) const {
    const auto& times = timing_.times;
    const auto after = std::upper_bound(times.begin() + 1, times.end() - 1, t);
    const auto k = static_cast<std::size_t>(after - times.begin()) - 1;
    const double length = way_.arcs[k + 1] - way_.arcs[k];
    const double span = times[k + 1] - times[k];
    const double tau = std::clamp(t - times[k], 0.0, span);
    const double a = timing_.speeds[k];
    const double b = timing_.speeds[k + 1];
    double share = tau / span;
    if (a + b > 1e-6) {
      share = (a * tau + 0.5 * (b - a) / span * tau * tau) / length;
    }
    share = std::clamp(share, 0.0, 1.0);
    return {(1.0 - share) * way_.points[k] + share * way_.points[k + 1],
            (1.0 - share) * way_.headings[k] + share * way_.headings[k + 1]};
  }

 private:
  const Way& way_;
  const Timing& timing_;
};

/// Forces over `DriveModel::force()` that give an acceleration of the middle, in the field: the
/// least ones, at most nine tenths of what a wheel has.
class Pusher {
 public:
  explicit Pusher(const DriveModel& model) : model_(model) {
    if (model.drivetrain == Drivetrain::mecanum) {
      MatrixXd rows(3, 4);  // force and moment of each wheel's push
      for (Index i = 0; i < 4; ++i) {
        const auto row = drive_body::mecanum_row(model, static_cast<std::size_t>(i));
        rows.col(i) << row[0], row[1], row[2];
      }
      const Eigen::Matrix3d square = rows * rows.transpose() + 1e-9 * Eigen::Matrix3d::Identity();
      inverse_ = rows.transpose() * square.inverse();
    }
    for (const Vector2d& wheel : model.wheels) {
      moment_ += wheel.squaredNorm();
    }
  }

  [[nodiscard]] VectorXd forces(double heading, const Vector2d& acceleration, double alpha) const {
    const double F = model_.force();
    const Vector2d push = model_.mass / F * acceleration;
    const double moment = model_.moment_of_inertia / F * alpha;
    const double c = std::cos(heading);
    const double s = std::sin(heading);
    VectorXd u(drive_body::inputs(model_.drivetrain));
    switch (model_.drivetrain) {
      case Drivetrain::swerve:
        for (int i = 0; i < 4; ++i) {
          const Vector2d& r = model_.wheels[static_cast<std::size_t>(i)];
          const Vector2d across(-(s * r(0) + c * r(1)), c * r(0) - s * r(1));
          Vector2d f = 0.25 * push + moment / std::max(1e-6, moment_) * across;
          f *= std::min(1.0, most / std::max(1e-9, f.norm()));
          u.segment<2>(2 * i) = f;
        }
        return u;
      case Drivetrain::mecanum:
        u = inverse_ *
            Eigen::Vector3d(c * push(0) + s * push(1), c * push(1) - s * push(0), moment);
        break;
      case Drivetrain::differential: {
        const double along = 0.5 * (c * push(0) + s * push(1));
        const double turn = moment / model_.trackwidth;
        u << along - turn, along + turn;
        break;
      }
    }
    return u.cwiseMax(-most).cwiseMin(most);
  }

 private:
  static constexpr double most = 0.9;
  const DriveModel& model_;
  MatrixXd inverse_{};
  double moment_ = 0.0;
};

std::string name_of(const DriveProblem& problem, const Choice& choice) {
  std::string name;
  const auto add = [&](const std::string& part) {
    name += flyball::detail::format("{}{}", name.empty() ? "" : ", ", part);
  };
  for (std::size_t c = 0; c < choice.sides.size(); ++c) {
    if (choice.sides[c] != 0) {
      add(flyball::detail::format("{} of {}", choice.sides[c] > 0 ? "left" : "right",
                                  drive_rules::name_of(problem, c)));
    }
  }
  if (choice.as_typed) {
    add("turning as typed");
  }
  if (steers(problem)) {
    if (!choice.curved || name.empty()) {
      add(choice.curved ? "curved" : "turning where it stops");
    }
    if (choice.other_end) {
      add("the other end first");
    }
  }
  return name.empty() ? "straight" : name;
}

/// Whether headings as they are typed turn farther than they have to.
bool turns_differ(const DriveProblem& problem) {
  double before = 0.0;
  bool any = false;
  bool differ = false;
  for (const DriveWaypoint& w : problem.waypoints) {
    if (w.fix_heading) {
      differ = differ || (any && std::abs(w.heading - before) > std::numbers::pi);
      before = w.heading;
      any = true;
    }
  }
  return differ;
}

/// On which side of what stands in the straight way the shorter way is.
std::vector<int> shorter_sides(const DriveProblem& problem, std::vector<std::size_t>& in_the_way) {
  std::vector<int> sides(problem.constraints.size(), 0);
  for (std::size_t c = 0; c < problem.constraints.size(); ++c) {
    const DriveConstraint& obstacle = problem.constraints[c];
    if (!drive_rules::is_obstacle(obstacle)) {
      continue;
    }
    const Disc disc = drive_rules::disc_of(obstacle);
    for (std::size_t i = 0; i + 1 < problem.waypoints.size(); ++i) {
      const Vector2d a(problem.waypoints[i].x, problem.waypoints[i].y);
      const Vector2d b(problem.waypoints[i + 1].x, problem.waypoints[i + 1].y);
      if (!drive_way::applies(problem, obstacle, i) ||
          drive_way::nearest(disc.center, a, b).distance >= drive_way::berth(problem, obstacle)) {
        continue;
      }
      // Its middle lies to the right: the shorter way is to its left.
      const Vector2d along = b - a;
      const Vector2d to = disc.center - a;
      sides[c] = along(0) * to(1) - along(1) * to(0) <= 0.0 ? 1 : -1;
      in_the_way.push_back(c);
      break;
    }
  }
  return sides;
}

}  // namespace

std::vector<Choice> choices(const DriveProblem& problem, int most) {
  constexpr std::size_t most_sides = 4;  // obstacles whose both sides are looked at
  constexpr double patience = 4.0;       // s for a metre within what is to be kept out of
  std::vector<std::size_t> in_the_way;
  Choice first{.sides = shorter_sides(problem, in_the_way)};
  std::vector<Choice> all;
  const std::size_t bits = std::min(in_the_way.size(), most_sides);
  for (std::size_t mask = 0; mask < (std::size_t{1} << bits); ++mask) {
    Choice choice = first;
    for (std::size_t bit = 0; bit < bits; ++bit) {
      if ((mask >> bit & 1U) != 0) {
        choice.sides[in_the_way[bit]] *= -1;
      }
    }
    all.push_back(choice);
    if (steers(problem)) {
      for (const auto& [curved, other_end] :
           {std::pair{false, false}, std::pair{true, true}, std::pair{false, true}}) {
        all.push_back(choice);
        all.back().curved = curved;
        all.back().other_end = other_end;
      }
    } else if (turns_differ(problem)) {
      all.push_back(choice);
      all.back().as_typed = true;
    }
  }
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Way way = drive_way::way_of(problem, all[i]);
    const double duration = drive_way::time_way(problem, way).times.back();
    order.emplace_back(duration + patience * drive_way::intrusion(problem, way), i);
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Choice> likeliest;
  double before = -1.0;
  for (const auto& [cost, i] : order) {
    // Starts that take the same time to a microsecond are one.
    if (cost - before > 1e-6 && static_cast<int>(likeliest.size()) < most) {
      likeliest.push_back(all[i]);
    }
    before = cost;
  }
  return likeliest;
}

Guess guess(const DriveProblem& problem, const Choice& choice, std::vector<int>& intervals,
            int parts) {
  const DriveModel& model = problem.model;
  const std::size_t segments = problem.waypoints.size() - 1;
  const Way way = drive_way::way_of(problem, choice);
  const Timing timing = drive_way::time_way(problem, way);
  Guess result{.name = name_of(problem, choice)};
  VectorXd times(static_cast<Index>(segments + 1));
  for (std::size_t i = 0; i <= segments; ++i) {
    const DriveWaypoint& w = problem.waypoints[i];
    const std::size_t at = way.waypoints[i];
    times(static_cast<Index>(i)) = timing.times[at];
    const double turns = std::round((way.headings[at] - w.heading) / (2.0 * std::numbers::pi));
    result.headings.push_back(w.heading + 2.0 * std::numbers::pi * turns);
  }
  result.durations =
      (times.tail(static_cast<Index>(segments)) - times.head(static_cast<Index>(segments)))
          .cwiseMax(2e-3);
  if (intervals.empty()) {
    for (std::size_t i = 0; i < segments; ++i) {
      const int told = problem.waypoints[i].intervals;
      const double wanted =
          result.durations(static_cast<Index>(i)) / problem.target_interval / parts;
      // An even number: full ahead and full astern meet at a point of the mesh.
      intervals.push_back(told > 0 ? told
                                   : parts * 2 *
                                         std::clamp(static_cast<int>(std::ceil(0.5 * wanted)),
                                                    parts > 1 ? 2 : 4, 100));
    }
  }
  int N = 0;
  for (const int count : intervals) {
    N += count;
  }
  result.states = MatrixXd::Zero(drive_body::states(model.drivetrain), N + 1);
  result.inputs = MatrixXd::Zero(drive_body::inputs(model.drivetrain), N);
  const Clock clock(way, timing);
  const Pusher pusher(model);
  // How the middle moves at a moment, over a little time before and after it.
  const auto moves = [&](double t) {
    constexpr double dt = 1e-3;
    const Spot before = clock.at(t - dt);
    const Spot after = clock.at(t + dt);
    const double span = std::min(t + dt, times(times.size() - 1)) - std::max(t - dt, 0.0);
    return Eigen::Vector3d((after.point(0) - before.point(0)) / span,
                           (after.point(1) - before.point(1)) / span,
                           (after.heading - before.heading) / span);
  };
  int k = 0;
  for (std::size_t i = 0; i < segments; ++i) {
    const double h = result.durations(static_cast<Index>(i)) / intervals[i];
    const int last = i + 1 == segments ? intervals[i] : intervals[i] - 1;
    for (int j = 0; j <= last; ++j, ++k) {
      const double t = times(static_cast<Index>(i)) + h * j;
      const Spot here = clock.at(t);
      Eigen::Vector3d v = moves(t);
      const bool ends = j == 0 || j == intervals[i];
      if (ends && drive_rules::stops_at(problem, static_cast<int>(j == 0 ? i : i + 1))) {
        v.setZero();
      }
      result.states.col(k).head<3>() << here.point, here.heading;
      const Vector2d ahead(std::cos(here.heading), std::sin(here.heading));
      if (steers(problem)) {
        const double speed = v.head<2>().dot(ahead);
        result.states(3, k) = speed - 0.5 * model.trackwidth * v(2);
        result.states(4, k) = speed + 0.5 * model.trackwidth * v(2);
      } else {
        result.states.col(k).tail<3>() = v;
      }
    }
  }
  k = 0;
  for (std::size_t i = 0; i < segments; ++i) {
    const double h = result.durations(static_cast<Index>(i)) / intervals[i];
    for (int j = 0; j < intervals[i]; ++j, ++k) {
      const VectorXd change = (result.states.col(k + 1) - result.states.col(k)) / h;
      const double heading = 0.5 * (result.states(2, k) + result.states(2, k + 1));
      if (steers(problem)) {
        const Vector2d ahead(std::cos(heading), std::sin(heading));
        result.inputs.col(k) = pusher.forces(heading, 0.5 * (change(3) + change(4)) * ahead,
                                             (change(4) - change(3)) / model.trackwidth);
      } else {
        result.inputs.col(k) = pusher.forces(heading, change.segment<2>(3), change(5));
      }
    }
  }
  return result;
}

Guess finer(const DriveProblem& problem, const Layout& layout,
            const optimization::OptimalControlSolution& found, int parts,
            std::vector<int>& intervals) {
  const auto n = static_cast<Index>(layout.n);
  const std::size_t segments = layout.first.size() - 1;
  Guess guess;
  intervals.clear();
  int nodes = 1;
  for (std::size_t s = 0; s < segments; ++s) {
    intervals.push_back(parts * (layout.first[s + 1] - layout.begin(s)));
    nodes += intervals.back();
  }
  guess.states = MatrixXd(n, nodes);
  guess.inputs = MatrixXd(layout.m, nodes - 1);
  guess.durations = VectorXd(static_cast<Index>(segments));
  guess.angles = MatrixXd(static_cast<Index>(layout.obstacles.size()), nodes - 1);
  Index k = 0;
  for (std::size_t s = 0; s < segments; ++s) {
    const int begin = layout.begin(s);
    const double duration = found.states(layout.duration(), begin);
    guess.durations(static_cast<Index>(s)) = duration;
    const double h = duration / (layout.first[s + 1] - begin);
    for (int j = begin; j < layout.first[s + 1]; ++j) {
      VectorXd x = found.states.col(j).head(n);
      const VectorXd u = found.inputs.col(j).head(layout.m);
      const auto rate = [&](const VectorXd& at) {
        const auto slope = drive_body::derivative<double>(problem.model, at, u);
        return VectorXd(Eigen::Map<const VectorXd>(slope.data(), n));
      };
      for (int part = 0; part < parts; ++part) {
        guess.states.col(k) = x;
        guess.inputs.col(k) = u;
        guess.angles.col(k) = found.inputs.col(j).tail(guess.angles.rows());
        ++k;
        const double step = h / parts;  // by the midpoint
        x += step * rate(x + 0.5 * step * rate(x));
      }
    }
  }
  guess.states.col(k) = found.states.col(found.states.cols() - 1).head(n);
  return guess;
}

}  // namespace flyball::drive_guess
