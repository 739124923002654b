#include <flyball/simulation/fastest_travel.hpp>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/math/integration/butcher_tableau.hpp>
#include <flyball/math/search/roots.hpp>

#include "core/constants.hpp"
#include "core/error_rows.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

using mechanisms::GearedLoad;
using mechanisms::MotorPoint;
using mechanisms::PowerBound;

constexpr std::string_view in_fastest_travel = "fastest_travel";

/// Position, velocity, °C above ambient, J taken, J returned, J of heat.
using State = Eigen::Matrix<double, 6, 1>;
enum : Eigen::Index { position, velocity, warmth, taken, returned, heat };

struct Row {
  double t = 0.0;
  State y = State::Zero();
};

/// How a phase of the motion ended.
enum class End { there, at_rest, never, too_long };

struct Phase {
  std::vector<Row> rows{};
  End end = End::there;
};

/// A mechanism that is pushed or braked as hard as may be.
class Motion {
 public:
  explicit Motion(const TravelJob& job) : job_(job), way_(job.end > job.start ? 1 : -1) {}

  [[nodiscard]] int way() const { return way_; }

  /// @param push  In the direction of the motion (1), or against it (-1).
  [[nodiscard]] MotorPoint point(const State& y, int push) const {
    const GearedLoad& load = job_.load;
    const double R = load.motor.R * (1.0 + job_.winding.copper * y(warmth));
    const double omega = load.ratio() * y(velocity);
    const int direction = push * way_;
    MotorPoint point = mechanisms::strongest_push(load.motor, job_.limits, omega, direction, R);
    if (const double most = load.slipping_current(way_, direction);
        std::abs(point.current) > most) {
      point = mechanisms::push_with(load.motor, job_.limits, omega, direction, R, direction * most);
      point.bound = PowerBound::grip;
    }
    return point;
  }

  [[nodiscard]] State derivative(const State& y, int push) const {
    const MotorPoint at = point(y, push);
    const double R = job_.load.motor.R * (1.0 + job_.winding.copper * y(warmth));
    const double losses = at.current * at.current * R;
    const double power = at.power();
    State dy;
    dy(position) = y(velocity);
    dy(velocity) = job_.load.acceleration(y(position), way_, at.current);
    const Winding& winding = job_.winding;
    dy(warmth) = winding.is_known()
                     ? (losses / job_.load.motor.count - y(warmth) / winding.thermal_resistance) /
                           winding.heat_capacity
                     : 0.0;
    dy(taken) = std::max(power, 0.0);
    dy(returned) = std::max(-power, 0.0);
    dy(heat) = losses;
    return dy;
  }

  /// One step. @param error  The embedded method's, in the states' units.
  [[nodiscard]] State step(const State& y, double h, int push, State* error = nullptr) const {
    constexpr const auto& tableau = tableaus::dormand_prince;
    std::array<State, 7> k;
    for (std::size_t i = 0; i < k.size(); ++i) {
      State stage = y;
      for (std::size_t j = 0; j < i; ++j) {
        stage += (h * tableau.A[i][j]) * k[j];
      }
      k[i] = derivative(stage, push);
    }
    State next = y;
    if (error != nullptr) {
      error->setZero();
    }
    for (std::size_t i = 0; i < k.size(); ++i) {
      next += (h * tableau.b[i]) * k[i];
      if (error != nullptr) {
        *error += (h * (tableau.b[i] - tableau.b_hat[i])) * k[i];
      }
    }
    return next;
  }

  /// How far it is to what ends a phase: negative before, zero there.
  [[nodiscard]] double past_end(const State& y) const {
    return way_ * ((job_.speed ? y(velocity) : y(position)) - job_.end);
  }

  /// Pushes until the end is reached, or brakes until it stands.
  [[nodiscard]] Phase run(Row from, int push) const {
    Phase phase{.rows = {from}};
    const auto passed = [&](const State& y) {
      return push > 0 ? past_end(y) : -way_ * y(velocity);
    };
    if (passed(from.y) >= 0.0) {
      return phase;
    }
    double h = first_step(from.y, push);
    constexpr int most_steps = 20'000;
    for (int i = 0; i < most_steps; ++i) {
      const Row& last = phase.rows.back();
      State error;
      const State next = step(last.y, h, push, &error);
      const double size = scaled(error, last.y, next);
      if (!(size <= 1.0) && h > 1e-14 * (1.0 + last.t)) {
        h *= std::isfinite(size) ? std::max(0.2, 0.9 * std::pow(size, -0.2)) : 0.2;
        continue;
      }
      if (push > 0 && way_ * next(velocity) <= 0.0 && way_ * last.y(velocity) >= 0.0 &&
          past_end(next) < 0.0 && !(job_.speed && next(velocity) != 0.0)) {
        phase.rows.push_back({last.t + h, next});
        phase.end = End::at_rest;
        return phase;
      }
      if (passed(next) >= 0.0) {
        const double part = crossing(last.y, h, push, passed);
        phase.rows.push_back({last.t + part, step(last.y, part, push)});
        return phase;
      }
      phase.rows.push_back({last.t + h, next});
      if (stalls(next, push)) {
        phase.end = End::never;
        return phase;
      }
      if (phase.rows.back().t > job_.longest) {
        phase.end = End::too_long;
        return phase;
      }
      h *= std::clamp(0.9 * std::pow(std::max(size, 1e-10), -0.2), 0.2, 5.0);
    }
    phase.end = End::too_long;
    return phase;
  }

  [[nodiscard]] State initial() const {
    State y = State::Zero();
    y(job_.speed ? velocity : position) = job_.start;
    return y;
  }

 private:
  [[nodiscard]] double scaled(const State& error, const State& y, const State& next) const {
    // Temperatures in K and energies in J to their own size, at least 1; the motion to its own.
    const double way = std::abs(job_.end - job_.start);
    const State floor{way, job_.speed ? way : 0.01, 1.0, 1.0, 1.0, 1.0};
    const State size = y.cwiseAbs().cwiseMax(next.cwiseAbs()).cwiseMax(floor);
    return error.cwiseAbs().cwiseQuotient(size).maxCoeff() / job_.accuracy;
  }
  [[nodiscard]] double first_step(const State& y, int push) const {
    const double a = std::abs(derivative(y, push)(velocity));
    const double way = std::abs(job_.end - job_.start);
    const double whole = job_.speed ? way / a : std::sqrt(2.0 * way / a);
    return a > 0.0 && std::isfinite(whole) ? std::min(1e-3 * whole, 0.1) : 1e-6;
  }
  /// Whether it will not get to its end at the rate at which it changes.
  [[nodiscard]] bool stalls(const State& y, int push) const {
    const double a = way_ * derivative(y, push)(velocity);
    if (push < 0) {
      return a >= 0.0;  // the brake does not slow it
    }
    return job_.speed && a * job_.longest < -1e-3 * past_end(y);
  }
  /// The part of a step at whose end a function crosses zero.
  template <class Passed>
  [[nodiscard]] double crossing(const State& y, double h, int push, const Passed& passed) const {
    const auto at = [&](double part) { return passed(step(y, part, push)); };
    const auto root =
        find_root(at, 0.0, h, {.absolute_tolerance = 1e-15, .relative_tolerance = 1e-15});
    return root ? root->x : h;
  }

  const TravelJob& job_;
  int way_;
};

/// A motion that was found: pushed, then braked.
struct Found {
  Phase push{}, brake{};
};

std::string_view unit_of(const TravelJob& job) {
  const bool turns = mechanisms::position_unit(job.load.kind) == "rad";
  return job.speed ? (turns ? "rad/s" : "m/s") : turns ? "rad" : "m";
}

Error never_there(const TravelJob& job, const Phase& phase) {
  const State& y = phase.rows.back().y;
  const std::string unit(unit_of(job));
  if (phase.end == End::too_long) {
    return refusal(TravelError::too_long, in_fastest_travel, "the motion")
        .got("at " + format_number(job.speed ? y(velocity) : y(position), 4) + " " + unit +
             " after " + format_number(job.longest, 4) + " s")
        .expected("to " + format_number(job.end, 4) + " " + unit)
        .hint("give it longer, more motors, a way that is shorter or a load that is less");
  }
  if (job.speed) {
    return refusal(TravelError::never_there, in_fastest_travel, "the speed")
        .got("at most " + format_number(y(velocity), 4) + " " + unit + " with this gearing")
        .expected(format_number(job.end, 4) + " " + unit)
        .hint("gear higher (fewer motor turns a turn), or raise the voltage")
        .with("top_speed", y(velocity));
  }
  return refusal(TravelError::never_there, in_fastest_travel, "the motion")
      .got("at rest at " + format_number(y(position), 4) + " " + unit +
           ", where gravity and friction are stronger than the motors")
      .expected("to " + format_number(job.end, 4) + " " + unit)
      .hint("gear lower, add motors or raise the current limits")
      .with("position", y(position));
}

Expected<void> check(const TravelJob& job) {
  FLYBALL_CHECK(mechanisms::check_load(job.load, in_fastest_travel));
  FLYBALL_CHECK(mechanisms::check_limits(job.limits, in_fastest_travel));
  FLYBALL_CHECK(Checks(in_fastest_travel)
                    .finite(job.start, "start")
                    .finite(job.end, "end")
                    .positive(job.longest, "the longest time", "s")
                    .within(job.accuracy, 1e-13, 1e-2, "accuracy")
                    .finite(job.winding.ambient, "the ambient temperature")
                    .not_negative(job.winding.copper, "the copper's coefficient", "1/K"));
  if (!(job.winding.heat_capacity > 0.0) || !(job.winding.thermal_resistance > 0.0)) {
    return refusal(ArgumentError::not_positive, in_fastest_travel, "the winding")
        .got(format_number(job.winding.heat_capacity) + " J/K and " +
             format_number(job.winding.thermal_resistance) + " K/W")
        .expected("positive");
  }
  if (job.start == job.end) {
    return refusal(ArgumentError::out_of_range, in_fastest_travel, "the end")
        .got("where it starts, at " + format_number(job.end) + " " + std::string(unit_of(job)))
        .expected("somewhere else");
  }
  if (job.speed &&
      (job.end == 0.0 || job.start * job.end < 0.0 || std::abs(job.end) < std::abs(job.start))) {
    return refusal(ArgumentError::out_of_range, in_fastest_travel, "the speed at the end")
        .got(format_number(job.end) + " from " + format_number(job.start))
        .expected("faster than at the start, in the same direction");
  }
  return {};
}

Expected<void> check_holds(const TravelJob& job) {
  const GearedLoad& load = job.load;
  if (job.speed) {
    return {};
  }
  const double weight = load.greatest_weight(job.start, job.end);
  const double held = load.holding_current(job.start, job.end);
  const double most =
      mechanisms::strongest_push(load.motor, job.limits, 0.0, 1, load.motor.R).current;
  if (weight > 0.0 && held >= most) {
    const std::string n =
        load.motor.count == 1 ? "one motor" : std::to_string(load.motor.count) + " motors";
    return refusal(TravelError::cannot_hold, in_fastest_travel, "the load")
        .got("held by " + format_number(held, 4) + " A of " + n + " together")
        .expected("below the " + format_number(most, 4) +
                  " A that the limits allow at a standstill")
        .hint("gear lower (more motor turns a turn), add motors, or raise the limits")
        .with("holding_current", held)
        .with("allowed_current", most);
  }
  return {};
}

Expected<Found> find(const TravelJob& job, const Motion& motion) {
  FLYBALL_CHECK(check(job));
  FLYBALL_CHECK(check_holds(job));
  const Row start{0.0, motion.initial()};
  const double a = motion.way() * motion.derivative(start.y, 1)(velocity);
  if (!(a > 0.0)) {
    const bool moves = job.speed && job.start != 0.0;
    return refusal(moves ? TravelError::never_there : TravelError::cannot_start, in_fastest_travel,
                   "the strongest push")
        .got("not enough to " + std::string(moves ? "gain speed" : "set off"))
        .expected("above friction and gravity at the start")
        .hint("gear lower, add motors or raise the limits")
        .with("acceleration", a);
  }
  Found found{.push = motion.run(start, 1)};
  const bool brakes = !job.speed && job.stops;
  if (found.push.end != End::there) {
    return tl::unexpected(never_there(job, found.push));
  }
  if (!brakes) {
    return found;
  }
  // The state at an instant of the push: a part of the step in which it lies.
  const std::vector<Row>& rows = found.push.rows;
  const auto pushed_until = [&](double t) {
    const auto next = std::upper_bound(rows.begin(), rows.end(), t,
                                       [](double time, const Row& row) { return time < row.t; });
    const Row& last = *std::prev(next == rows.begin() ? std::next(next) : next);
    return Row{t, t > last.t ? motion.step(last.y, t - last.t, 1) : last.y};
  };
  // Where it stops, past the end: rises with the instant at which it brakes.
  const auto past = [&](double t) {
    const Phase brake = motion.run(pushed_until(t), -1);
    return brake.end == End::there ? motion.past_end(brake.rows.back().y) : infinity;
  };
  const double last = rows.back().t;
  const auto root =
      find_root(past, 0.0, last, {.absolute_tolerance = 1e-15 * last, .relative_tolerance = 1e-14});
  if (!root) {
    return tl::unexpected(Error(root.error()).in(std::string(in_fastest_travel)));
  }
  const Row at = pushed_until(root->x);
  found.brake = motion.run(at, -1);
  const double off = motion.past_end(found.brake.rows.back().y);
  if (found.brake.end != End::there || !(std::abs(off) < 1e-6 * std::abs(job.end - job.start))) {
    return refusal(TravelError::cannot_stop, in_fastest_travel, "the strongest brake")
        .got("weaker than gravity within the limits")
        .expected("able to stop it before its end")
        .hint("gear lower, add motors or raise the stator limit");
  }
  auto& pushed = found.push.rows;
  while (pushed.size() > 1 && pushed.back().t >= at.t) {
    pushed.pop_back();
  }
  pushed.push_back(at);
  return found;
}

Travel summary_of(const TravelJob& job, const Motion& motion, const Found& found) {
  Travel travel;
  travel.least_rail = infinity;
  const auto take = [&](const std::vector<Row>& rows, int push) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const MotorPoint point = motion.point(rows[i].y, push);
      travel.top_speed = std::max(travel.top_speed, std::abs(rows[i].y(velocity)));
      travel.peak_current = std::max(travel.peak_current, std::abs(point.current));
      travel.peak_supply = std::max(travel.peak_supply, point.supply_current);
      travel.least_rail = std::min(travel.least_rail, point.rail);
      if (i > 0) {
        // Bounds change at kinks, where steps are short.
        travel.bound_time[static_cast<std::size_t>(point.bound)] += rows[i].t - rows[i - 1].t;
      }
    }
  };
  take(found.push.rows, 1);
  take(found.brake.rows, -1);
  const Row& last = found.brake.rows.empty() ? found.push.rows.back() : found.brake.rows.back();
  travel.time = last.t;
  travel.switching_time = found.push.rows.back().t;
  travel.energy = last.y(taken);
  travel.returned = last.y(returned);
  travel.heat = last.y(heat);
  travel.temperature = job.winding.ambient + last.y(warmth);
  return travel;
}

}  // namespace

ErrorInfo error_info(TravelError code) {
  static constexpr flyball::detail::ErrorRow rows[] = {
      {"cannot_hold", "the motors cannot hold the load within their limits", ErrorKind::no_answer},
      {"cannot_start", "the motors cannot set it in motion within their limits",
       ErrorKind::no_answer},
      {"never_there", "it comes to rest, or to its top speed, before its goal",
       ErrorKind::no_answer},
      {"cannot_stop", "the motors cannot stop it within their limits", ErrorKind::no_answer},
      {"too_long", "it is not there within the time that was allowed", ErrorKind::no_answer},
  };
  return flyball::detail::info_of(code, "travel", rows);
}

Expected<Travel> fastest_travel(const TravelJob& job) {
  const Motion motion(job);
  FLYBALL_TRY(const Found found, find(job, motion));
  return summary_of(job, motion, found);
}

Expected<TimeSeries> record_travel(const TravelJob& job, int rows) {
  FLYBALL_CHECK(check_within(rows, 2, 1e6, in_fastest_travel, "rows"));
  const Motion motion(job);
  FLYBALL_TRY(const Found found, find(job, motion));
  const double switching = found.push.rows.back().t;
  const double end = found.brake.rows.empty() ? switching : found.brake.rows.back().t;
  std::vector<double> time;
  std::array<std::vector<double>, 8> columns;
  const auto add = [&](double t, const State& y, int push) {
    const MotorPoint point = motion.point(y, push);
    time.push_back(t);
    const std::array<double, 8> row{y(position),
                                    y(velocity),
                                    point.voltage,
                                    point.current,
                                    point.supply_current,
                                    point.rail,
                                    job.winding.ambient + y(warmth),
                                    y(taken) - y(returned)};
    for (std::size_t c = 0; c < row.size(); ++c) {
      columns[c].push_back(row[c]);
    }
  };
  for (int i = 0; i < rows; ++i) {
    const double t = end * i / (rows - 1);
    const bool braking = t > switching && !found.brake.rows.empty();
    const std::vector<Row>& of = braking ? found.brake.rows : found.push.rows;
    const auto next = std::upper_bound(of.begin(), of.end(), t,
                                       [](double at, const Row& row) { return at < row.t; });
    const Row& last = *std::prev(next == of.begin() ? std::next(next) : next);
    const int push = braking ? -1 : 1;
    add(t, t > last.t ? motion.step(last.y, t - last.t, push) : last.y, push);
  }
  const bool turns = mechanisms::position_unit(job.load.kind) == "rad";
  const std::array<std::pair<const char*, const char*>, 8> names{
      {{"position", turns ? "rad" : "m"},
       {"velocity", turns ? "rad/s" : "m/s"},
       {"voltage", "V"},
       {"current", "A"},
       {"supply_current", "A"},
       {"rail", "V"},
       {"temperature", "°C"},
       {"energy", "J"}}};
  TimeSeries series(std::move(time));
  for (std::size_t c = 0; c < names.size(); ++c) {
    if (c != 6 || job.winding.is_known()) {
      FLYBALL_CHECK(series.add(names[c].first, names[c].second, std::move(columns[c])));
    }
  }
  return series;
}

}  // namespace flyball
