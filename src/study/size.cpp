#include <flyball/study/size.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/progress.hpp>
#include <flyball/math/search/minimum.hpp>

#include "core/constants.hpp"
#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"

namespace flyball::study {

namespace {

using mechanisms::MechanismKind;
using mechanisms::PowerBound;
using text::number;
using text::percent;

constexpr double within = 1.02;  ///< Of the least time: what is as good as the best.

/// Of the integrations of what is drawn or only compared.
constexpr double rough = 1e-6;

TravelJob roughly(TravelJob travel) {
  travel.accuracy = std::max(travel.accuracy, rough);
  return travel;
}

/// Gearings of the first look: all that gears are built for.
constexpr double lowest = 0.05;
constexpr double highest = 5000.0;

/// One motion of a job at a gearing.
Expected<SizeChoice> tried(const SizeJob& job, TravelJob travel, double gearing) {
  travel.load.gearing = gearing;
  FLYBALL_TRY(const Travel found, fastest_travel(travel));
  SizeChoice choice{.gearing = gearing, .travel = found};
  choice.holding_current =
      travel.speed ? 0.0 : travel.load.holding_current(travel.start, travel.end);
  choice.browns_out = found.least_rail < job.brownout_voltage;
  choice.overheats = travel.winding.is_known() && found.temperature > job.temperature_limit;
  return choice;
}

/// What was found of a gearing.
struct Best {
  SizeChoice choice{};
  bool is_good = false;
};

/// Looks for the gearing with the least time. @param travel  Its gearing does not count.
class GearingSearch {
 public:
  /// @param tolerance  Of the gearing, relative.
  GearingSearch(const SizeJob& job, const TravelJob& travel, double tolerance)
      : job_(job), travel_(travel), rough_(roughly(travel)), tolerance_(tolerance) {}

  /// @param low, high  Of the gearings. @param per_octave  How many of the first look.
  /// @errors Of the gearing that came closest, where none gets there.
  [[nodiscard]] Expected<Best> find(double low, double high, double per_octave) const {
    const int count = 2 + static_cast<int>(std::ceil(per_octave * std::log2(high / low)));
    std::vector<double> gearings;
    for (int i = 0; i < count; ++i) {
      gearings.push_back(low * std::pow(high / low, i / (count - 1.0)));
    }
    for (const bool good : {true, false}) {
      if (const auto best = among(gearings, good)) {
        return *best;
      }
    }
    return tl::unexpected(closest(gearings));
  }

  /// s, infinite where it is not allowed. @param good  Whether brownouts and heat are not.
  [[nodiscard]] double time(double gearing, bool good) const {
    return time_of(travel_, gearing, good);
  }
  [[nodiscard]] double time_of(const TravelJob& travel, double gearing, bool good) const {
    const auto choice = tried(job_, travel, gearing);
    return choice && (!good || choice->is_good()) ? choice->travel.time : infinity;
  }

  /// The end of the range about the best in which the time is within 2 %.
  [[nodiscard]] double edge(const Best& best, double limit) const {
    const double most = within * best.choice.travel.time;
    double inside = std::log(best.choice.gearing);
    double outside = std::log(limit);
    if (time(limit, best.is_good) <= most) {
      return limit;
    }
    for (int i = 0; i < 20; ++i) {
      const double middle = 0.5 * (inside + outside);
      (time(std::exp(middle), best.is_good) <= most ? inside : outside) = middle;
    }
    return std::exp(inside);
  }

 private:
  [[nodiscard]] std::optional<Best> among(const std::vector<double>& gearings, bool good) const {
    std::size_t least = gearings.size();
    double shortest = infinity;
    for (std::size_t i = 0; i < gearings.size(); ++i) {
      if (least_time(gearings[i]) > shortest) {
        continue;
      }
      if (const double t = time_of(rough_, gearings[i], good); t < shortest) {
        shortest = t;
        least = i;
      }
    }
    if (least == gearings.size()) {
      return std::nullopt;
    }
    double gearing = gearings[least];
    const double low = std::log(gearings[least > 0 ? least - 1 : 0]);
    const double high = std::log(gearings[std::min(least + 1, gearings.size() - 1)]);
    const auto of_log = [&](double x) {
      const double gear = std::exp(x);
      const double t = least_time(gear) > shortest ? infinity : time(gear, good);
      return std::isfinite(t) ? t : 1e9;  // where it does not get there it is no better anywhere
    };
    if (const auto found = find_minimum(of_log, low, high, {.absolute_tolerance = tolerance_});
        found && found->value < 1.00001 * shortest) {
      gearing = std::exp(found->x);
    }
    const auto choice = tried(job_, travel_, gearing);
    return choice ? std::optional(Best{*choice, good}) : std::nullopt;
  }

  /// s, below which no motion at a gearing is: the whole way at the motors' speed without load.
  [[nodiscard]] double least_time(double gearing) const {
    const mechanisms::GearedLoad& load = travel_.load;
    const mechanisms::Battery& battery = travel_.limits.battery;
    const double V = std::min(travel_.limits.voltage, battery.open_circuit_voltage);
    const double fastest = load.motor.Kv * V * load.radius / gearing;
    if (travel_.speed) {
      return std::abs(travel_.end) > fastest ? infinity : 0.0;
    }
    // What falls is faster than its motors, at times.
    const double falls = has_gravity(load.kind) ? 3.0 : 1.0;
    return std::abs(travel_.end - travel_.start) / (falls * fastest);
  }

  /// Why no gearing gets there: of the first that is held and set in motion, else of the last; of a
  /// speed that of the fastest.
  [[nodiscard]] Error closest(const std::vector<double>& gearings) const {
    std::optional<Error> error;
    double fastest = -infinity;
    for (const double gearing : gearings) {
      auto choice = tried(job_, travel_, gearing);
      if (choice) {
        continue;
      }
      const Error& found = choice.error();
      double speed = -infinity;
      for (const Evidence& evidence : found.evidence()) {
        speed = evidence.name == "top_speed" ? std::abs(evidence.values.front()) : speed;
      }
      if (!error || (travel_.speed ? speed > fastest : true)) {
        error = found;
        fastest = speed;
      }
      if (!travel_.speed && !found.is(TravelError::cannot_hold) &&
          !found.is(TravelError::cannot_start) && !found.is(TravelError::never_there)) {
        break;
      }
    }
    return *std::move(error);
  }

  const SizeJob& job_;
  const TravelJob& travel_;
  TravelJob rough_;
  double tolerance_;
};

double share_of(const Travel& travel, std::initializer_list<PowerBound> bounds) {
  double sum = 0.0;
  for (const PowerBound bound : bounds) {
    sum += travel.bound_time[static_cast<std::size_t>(bound)];
  }
  return travel.time > 0.0 ? sum / travel.time : 0.0;
}

/// What bounds the force of a motion most of the time, of those that a lower gearing tightens.
std::string force_bound(const Travel& travel) {
  PowerBound most = PowerBound::stator;
  for (const PowerBound bound : {PowerBound::supply, PowerBound::grip, PowerBound::battery}) {
    if (share_of(travel, {bound}) > share_of(travel, {most})) {
      most = bound;
    }
  }
  return share_of(travel, {most}) > 0.0 ? fmt::format(", held down by {}", to_string(most)) : "";
}

/// Why neither a lower nor a higher gearing is faster.
std::string reason_of(const SizeJob& job, const TravelJob& travel, const Best& best, double low,
                      double high) {
  const double G = best.choice.gearing;
  const double t = best.choice.travel.time;
  constexpr double step = 1.25;
  const auto slower = [&](double gearing) -> std::string {
    const bool lower = gearing < G;
    const auto other = tried(job, travel, gearing);
    const std::string which =
        fmt::format("{} ({})", lower ? "a lower one" : "a higher one", number(gearing, 3));
    if (!other) {
      return other.error().is(TravelError::cannot_hold) ? which + " would not hold the load"
             : other.error().is(TravelError::never_there) && !lower
                 ? which + " would not get to the speed"
                 : which + " would not get there";
    }
    if (best.is_good && other->browns_out) {
      return fmt::format("{} would brown out, at {} V", which, number(other->travel.least_rail, 3));
    }
    if (best.is_good && other->overheats) {
      return fmt::format("{} would overheat, to {} °C", which,
                         number(other->travel.temperature, 3));
    }
    const std::string more = percent(other->travel.time / t - 1.0, 2);
    return lower
               ? fmt::format("{} takes {} more for want of force{}", which, more,
                             force_bound(other->travel))
               : fmt::format(
                     "{} takes {} more for want of speed, {} of the time near the motors' "
                     "top speed",
                     which, more,
                     percent(share_of(other->travel, {PowerBound::voltage, PowerBound::rail}), 2));
  };
  if (G <= low * 1.0001 || G >= high * 0.9999) {
    return fmt::format("it is the {} that was looked at; {}",
                       G <= low * 1.0001 ? "lowest" : "highest",
                       slower(G <= low * 1.0001 ? G * step : G / step));
  }
  return slower(G / step) + "; " + slower(G * step);
}

SizePoint point_of(const SizeJob& job, const TravelJob& travel, double value, double gearing,
                   const std::optional<std::pair<double, double>>& around) {
  SizePoint point{.value = value};
  if (auto choice = tried(job, travel, gearing)) {
    point.at_gearing = *choice;
  } else {
    point.refusal = std::string(choice.error().code());
  }
  if (around) {
    if (const auto best =
            GearingSearch(job, travel, 2e-3).find(around->first, around->second, 1.5)) {
      point.at_best = best->choice;
    }
  }
  return point;
}

/// The time against the load or a limit, evenly in its logarithm.
template <class Change>
SizeSweep sweep(const SizeJob& job, SizeSweep of, double low, double high, double gearing,
                double best, const Change& change) {
  constexpr int count = 21;
  std::vector<double> values;
  for (int i = 0; i < count; ++i) {
    values.push_back(low * std::pow(high / low, i / (count - 1.0)));
  }
  for (const double value : values) {
    TravelJob travel = roughly(job.travel);
    change(travel, value);
    constexpr double reach = 6.0;
    of.points.push_back(
        point_of(job, travel, value, gearing, std::pair(best / reach, best * reach)));
  }
  return of;
}

std::vector<SizeSweep> sweeps_of(const SizeJob& job, double gearing, double best) {
  const mechanisms::GearedLoad& load = job.travel.load;
  const mechanisms::PowerLimits& limits = job.travel.limits;
  const bool turns = load.radius == 1.0 && mechanisms::position_unit(load.kind) == "rad";
  const double n = load.motor.count;
  std::vector<SizeSweep> all;
  tell_progress("varies the load");
  constexpr double reach = 4.0;
  const double inertia = load.inertia;
  all.push_back(
      sweep(job,
            {.name = "load",
             .title = turns ? "Moment of inertia" : "Mass",
             .unit = turns ? "kg·m²" : "kg",
             .here = inertia},
            inertia / reach, inertia * reach, gearing, best, [&](TravelJob& travel, double value) {
              // An arm that is heavier is heavier throughout: gravity and grip grow with
              // it.
              travel.load.inertia = value;
              travel.load.gravity =
                  (load.gravity + job.counterbalance) * value / inertia - job.counterbalance;
              travel.load.grip = load.grip * value / inertia;
            }));
  tell_progress("varies the current limits");
  const double least = 10.0;  // A, of one motor
  const double most = std::max(load.motor.stall_current / n, 2.0 * least);
  all.push_back(sweep(job,
                      {.name = "stator_limit",
                       .title = "Stator limit of a motor",
                       .unit = "A",
                       .here = limits.stator_current / n},
                      least, most, gearing, best, [&](TravelJob& travel, double value) {
                        travel.limits.stator_current = n * value;
                      }));
  all.push_back(sweep(job,
                      {.name = "supply_limit",
                       .title = "Supply limit of a motor",
                       .unit = "A",
                       .here = limits.supply_current / n},
                      least, most, gearing, best, [&](TravelJob& travel, double value) {
                        travel.limits.supply_current = n * value;
                      }));
  return all;
}

std::vector<SizeMotor> motors_of(const SizeJob& job) {
  const mechanisms::DcMotor& own = job.travel.load.motor;
  std::vector<SizeMotor> all;
  for (const mechanisms::MotorTableEntry& entry : mechanisms::motor_table()) {
    tell_progress("tries the motors of the table");
    TravelJob travel = roughly(job.travel);
    SizeMotor motor{.name = std::string(entry.name), .is_own = entry.name == own.name};
    travel.load.motor = mechanisms::motor(entry.name, own.count).value();
    travel.load.motor_friction = travel.load.motor.Kt * travel.load.motor.free_current;
    travel.limits.voltage = std::min(travel.limits.voltage, travel.load.motor.nominal_voltage);
    if (!motor.is_own) {
      travel.winding = {};  // of the job's motor
    } else {
      travel.load.motor_friction = job.travel.load.motor_friction;
      travel.limits.voltage = job.travel.limits.voltage;
    }
    if (auto best =
            GearingSearch(job, travel, 1e-3)
                .find(job.gearing_low.value_or(lowest), job.gearing_high.value_or(highest), 2.0)) {
      motor.choice = best->choice;
    } else {
      motor.refusal = std::string(best.error().info().summary);
    }
    all.push_back(std::move(motor));
  }
  const auto rank = [](const SizeMotor& motor) {
    return !motor.choice ? 1e9 : motor.choice->travel.time + (motor.choice->is_good() ? 0.0 : 1e6);
  };
  std::stable_sort(all.begin(), all.end(),
                   [&](const SizeMotor& a, const SizeMotor& b) { return rank(a) < rank(b); });
  return all;
}

Expected<void> check_job(const SizeJob& job) {
  FLYBALL_CHECK(Checks("size")
                    .not_negative(job.brownout_voltage, "brownout_voltage", "V")
                    .finite(job.temperature_limit, "temperature_limit"));
  const double low = job.gearing_low.value_or(lowest);
  const double high = job.gearing_high.value_or(highest);
  if (!(low > 0.0 && low < high && high < infinity)) {
    return refusal(ArgumentError::out_of_range, "size", "the range of gearings")
        .got(fmt::format("{} to {}", format_number(low), format_number(high)))
        .expected("from a lower to a higher one, both positive");
  }
  return {};
}

}  // namespace

Expected<SizeResult> size(const SizeJob& job) {
  FLYBALL_CHECK(check_job(job));
  SizeResult result{.job = job, .diagnostics = job.diagnostics};
  const TravelJob& travel = job.travel;
  if (job.gearing) {
    if (auto given = tried(job, travel, *job.gearing)) {
      result.given = *given;
      TravelJob at = travel;
      at.load.gearing = *job.gearing;
      FLYBALL_TRY(result.given_motion, record_travel(at));
    } else if (given.error().kind() == ErrorKind::misuse) {
      return tl::unexpected(std::move(given).error().in("size"));
    } else {
      result.given_refusal = to_string(Error(given.error()).in(""));
    }
  }
  tell_progress("looks for the best gearing");
  const double low = job.gearing_low.value_or(lowest);
  const double high = job.gearing_high.value_or(highest);
  const GearingSearch search(job, travel, 1e-5);
  auto best = search.find(low, high, 3.0);
  if (!best) {
    return tl::unexpected(std::move(best).error().in("size"));
  }
  result.best = best->choice;
  result.low = search.edge(*best, low);
  result.high = search.edge(*best, high);
  result.reason = reason_of(job, travel, *best, low, high);
  const double G = result.best.gearing;
  constexpr double reach = 5.0;
  const double from = job.gearing_low.value_or(std::min(G / reach, job.gearing.value_or(G)));
  const double to = job.gearing_high.value_or(std::max(G * reach, job.gearing.value_or(G)));
  constexpr int count = 61;
  for (int i = 0; i < count; ++i) {
    const double gearing = from * std::pow(to / from, i / (count - 1.0));
    result.gearings.push_back(point_of(job, travel, gearing, gearing, std::nullopt));
  }
  TravelJob at = travel;
  at.load.gearing = G;
  FLYBALL_TRY(result.motion, record_travel(at));
  result.sweeps = sweeps_of(job, result.given ? *job.gearing : G, G);
  if (job.compare_motors) {
    result.motors = motors_of(job);
  }
  if (result.best.browns_out) {
    warn(result.diagnostics, "browns_out",
         "every gearing that gets there browns out (the best falls to {:.3g} V): lower the supply "
         "limit, or take fewer motors",
         result.best.travel.least_rail);
  } else if (result.best.overheats) {
    warn(result.diagnostics, "overheats",
         "every gearing that gets there makes the windings warmer than they may be (the best "
         "{:.3g} °C): lower the stator limit, or add motors",
         result.best.travel.temperature);
  }
  return result;
}

}  // namespace flyball::study
