#include <flyball/study/profile.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/planning/profiles/minimum_jerk_profile.hpp>
#include <flyball/planning/profiles/parabolic_profile.hpp>

#include "core/try.hpp"
#include "study/profile_parts.hpp"

namespace flyball::study {

namespace {

constexpr std::string_view in_profile = "profile";

Expected<std::optional<MotorMotionLimits>> motor_of(const ProfileJob& job) {
  if (!job.kV) {
    if (job.kA) {
      return refusal(ArgumentError::empty, in_profile, "kV")
          .got("left out")
          .expected("given with kA");
    }
    return std::optional<MotorMotionLimits>{};
  }
  if (!job.kA) {
    return refusal(ArgumentError::empty, in_profile, "kA")
        .got("left out")
        .expected("given with kV");
  }
  MotorMotionLimits motor{
      .kV = *job.kV, .kA = *job.kA, .voltage = job.voltage.si(), .kS = job.kS, .kG = job.kG};
  FLYBALL_CHECK(Checks(in_profile)
                    .positive(motor.kV, "kV")
                    .positive(motor.kA, "kA")
                    .positive(motor.voltage, "voltage", "V")
                    .not_negative(motor.kS, "kS", "V")
                    .finite(motor.kG, "kG"));
  if (job.current) {
    if (!job.resistance) {
      return refusal(ArgumentError::empty, in_profile, "resistance")
          .got("left out")
          .expected("given with current");
    }
    motor.current_voltage = job.current->si() * job.resistance->si();
  }
  if (job.velocity > 0.0) {
    motor.velocity = job.velocity;
  }
  const double held = std::abs(motor.kG) + motor.kS;
  const double most = std::min(motor.voltage, motor.current_voltage);
  if (held >= most) {
    return refusal(ArgumentError::out_of_range, in_profile, "friction and gravity")
        .got(fmt::format("{} V together", format_number(held)))
        .expected(fmt::format("below the {} V that the motor has at rest", format_number(most)))
        .hint("add motors, gear lower or counterbalance");
  }
  return std::optional(motor);
}

/// Limits as given; what is left out is the motor's.
Expected<MotionLimits> limits_of(const ProfileJob& job,
                                 const std::optional<MotorMotionLimits>& motor) {
  MotionLimits limits{job.velocity, job.acceleration, job.deceleration, job.reverse_velocity};
  if (motor) {
    // Half of the top speed leaves half of the acceleration.
    const double top = (motor->voltage - motor->kS - std::abs(motor->kG)) / motor->kV;
    limits.velocity = limits.velocity > 0.0 ? limits.velocity : 0.5 * top;
    if (!(limits.acceleration > 0.0)) {
      limits.acceleration = std::max(motor->most(limits.velocity), 1e-3 * motor->most(0.0));
    }
  }
  for (const auto& [value, name, unit] : {std::tuple(limits.velocity, "velocity", "/s"),
                                          {limits.acceleration, "acceleration", "/s²"}}) {
    if (!(value > 0.0)) {
      return refusal(ArgumentError::empty, in_profile, name)
          .got("left out")
          .expected(fmt::format("a limit such as --{} \"2 {}{}\", or a motor by --kv and --ka",
                                name, job.angle ? "rad" : "m", unit));
    }
  }
  return limits;
}

/// Each period, then the end.
template <MotionProfile Profile>
Expected<void> tabulate(const Profile& profile, ProfileResult& result) {
  const double end = profile.total_time();
  const double period = result.job.period.si();
  constexpr double most_rows = 1e6;
  if (!(end / period < most_rows)) {
    return refusal(ArgumentError::out_of_range, in_profile, "the profile")
        .got(fmt::format("{} s long, {:.3g} periods", format_number(end), end / period))
        .expected("at most a million periods long")
        .hint("raise the limits or --period");
  }
  result.duration = end;
  const auto series = [&](std::vector<double> time) -> Expected<TimeSeries> {
    std::vector<double> x;
    std::vector<double> v;
    std::vector<double> a;
    for (const double t : time) {
      const MotionState at = profile.sample(t);
      x.push_back(at.position);
      v.push_back(at.velocity);
      a.push_back(at.acceleration);
      result.peak_velocity = std::max(result.peak_velocity, std::abs(at.velocity));
      result.peak_acceleration = std::max(result.peak_acceleration, std::abs(at.acceleration));
    }
    TimeSeries table(std::move(time));
    FLYBALL_CHECK(table.add("position", result.unit, std::move(x)));
    FLYBALL_CHECK(table.add("velocity", result.unit + "/s", std::move(v)));
    FLYBALL_CHECK(table.add("acceleration", result.unit + "/s²", std::move(a)));
    return table;
  };
  std::vector<double> time;
  const auto rows = static_cast<long>(end / period * (1.0 - 1e-12));
  for (long k = 0; k <= rows; ++k) {
    time.push_back(static_cast<double>(k) * period);
  }
  time.push_back(end);
  FLYBALL_TRY(result.table, series(std::move(time)));
  result.changes = changes_of(profile);
  FLYBALL_TRY(result.curve, series(drawn_times(result.changes, end)));
  return {};
}

Expected<void> plan(ProfileResult& result, const std::optional<MotorMotionLimits>& motor,
                    double jump) {
  const MotionState& from = result.job.from;
  const MotionState& to = result.job.to;
  const MotionLimits& limits = result.limits;
  const std::optional<double>& rate = result.job.to_velocity;
  switch (result.kind) {
    case ProfileKind::s_curve:
      return tabulate(rate ? SCurveProfile::to_velocity(limits, from, *rate, to.acceleration)
                           : SCurveProfile(limits, from, to),
                      result);
    case ProfileKind::exponential:
      return tabulate(rate ? ExponentialProfile::to_velocity(*motor, from, *rate)
                           : ExponentialProfile(*motor, from, to),
                      result);
    case ProfileKind::parabolic:
      return tabulate(rate ? ParabolicProfile::to_velocity(limits, from, *rate)
                           : ParabolicProfile(limits, from, to),
                      result);
    case ProfileKind::stepper:
      return tabulate(rate ? StepperProfile::to_velocity(limits, jump, from, *rate)
                           : StepperProfile(limits, jump, from, to),
                      result);
    case ProfileKind::minimum_jerk: {
      const MinimumJerkProfile profile(limits, from, to);
      if (!profile.keeps_limits()) {
        return refusal(ArgumentError::out_of_range, in_profile, "a fifth-degree polynomial")
            .got("beyond the limits at every duration")
            .expected("ends within the limits")
            .hint("s-curve goes between all states");
      }
      return tabulate(profile, result);
    }
    case ProfileKind::trapezoid:
      break;
  }
  return tabulate(rate ? TrapezoidProfile::to_velocity(limits, from, *rate)
                       : TrapezoidProfile(limits, from, to),
                  result);
}

/// What a kind of profile does not take, and would pass over.
Expected<void> check_options(const ProfileJob& job, ProfileKind kind) {
  const bool states = kind == ProfileKind::s_curve || kind == ProfileKind::minimum_jerk;
  const bool brakes = kind == ProfileKind::trapezoid || kind == ProfileKind::s_curve ||
                      kind == ProfileKind::minimum_jerk;
  const struct {
    bool given;
    bool taken;
    const char* name;
    const char* hint;
  } options[] = {
      {job.from.acceleration != 0.0, states, "start_acceleration", "s-curve begins with one"},
      {job.to.acceleration != 0.0, states, "goal_acceleration", "s-curve ends with one"},
      {job.ramp.has_value(), states, "ramp", "s-curve has a ramp"},
      {job.to_velocity.has_value(), kind != ProfileKind::minimum_jerk, "to_velocity",
       "the other kinds change a velocity"},
      {job.jump > 0.0, kind == ProfileKind::stepper, "jump", "stepper jumps"},
      {job.acceleration > 0.0, kind != ProfileKind::exponential || job.kind.empty(), "acceleration",
       "only the motor limits it; trapezoid and s-curve keep both"},
      {job.deceleration > 0.0, brakes, "deceleration", "trapezoid and s-curve brake by their own"}};
  for (const auto& option : options) {
    if (option.given && !option.taken) {
      return refusal(ArgumentError::out_of_range, in_profile, option.name)
          .got(fmt::format("given for {}", to_string(kind)))
          .expected("left out: that kind of profile has none")
          .hint(option.hint);
    }
  }
  return {};
}

/// That it ends with the velocity that was asked for: limits stand before goals.
Expected<void> check_goal_velocity(const ProfileResult& result) {
  const double wanted = result.job.to_velocity.value_or(result.job.to.velocity);
  const double end = result.table.find("velocity")->back();
  const double size = std::max(std::abs(wanted), result.peak_velocity);
  if (std::abs(end - wanted) <= 1e-6 * size) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, in_profile,
                 result.job.to_velocity ? "to_velocity" : "goal_velocity")
      .got(fmt::format("{} {}/s, which is not reached: it would arrive with {}",
                       format_number(wanted), result.unit, format_number(end, 4)))
      .expected("within the limits of the velocity, and reached on the way there")
      .hint("raise --velocity, or lower --goal-velocity");
}

}  // namespace

Expected<ProfileResult> plan_profile(const ProfileJob& job) {
  ProfileResult result{.job = job, .unit = job.angle ? "rad" : "m"};
  if (job.to_velocity && (job.to.position != 0.0 || job.to.velocity != 0.0 || job.continuous)) {
    return refusal(ArgumentError::ambiguous_name, in_profile, "to_velocity")
        .got("given with a position, a goal's velocity or continuous")
        .expected("alone: it says how fast it is to be, wherever that is");
  }
  FLYBALL_TRY(const std::optional<MotorMotionLimits> motor, motor_of(job));
  FLYBALL_TRY(result.limits, limits_of(job, motor));
  const MotionState& from = job.from;
  if (job.continuous) {
    result.job.to.position = nearest_turn(job.to.position, from.position);
  }
  const MotionState& to = result.job.to;
  constexpr double largest = 1e30;
  for (const auto& [value, name] : {std::pair(from.position, "from"),
                                    {to.position, "to"},
                                    {from.velocity, "start_velocity"},
                                    {to.velocity, "goal_velocity"},
                                    {job.to_velocity.value_or(0.0), "to_velocity"},
                                    {from.acceleration, "start_acceleration"},
                                    {to.acceleration, "goal_acceleration"},
                                    {result.limits.velocity, "velocity"},
                                    {result.limits.acceleration, "acceleration"}}) {
    if (!(std::abs(value) <= largest)) {
      return refusal(ArgumentError::out_of_range, in_profile, name)
          .got(format_number(value))
          .expected("a size up to 1e30");
    }
  }
  FLYBALL_CHECK(Checks(in_profile).positive(job.period.si(), "period", "s"));

  double jump = job.jump;
  if (job.kind.empty() && motor && !(job.velocity > 0.0) && !(job.acceleration > 0.0)) {
    result.kind = ProfileKind::exponential;
    result.reasons.emplace_back(
        "Only the motor limits it: along its torque-speed curve nothing is faster.");
  } else if (job.kind.empty()) {
    ProfileNeeds needs{
        .limits = result.limits,
        .distance = to.position - from.position,
        .unit = result.unit,
        .actuator = job.step_motor ? ActuatorKind::step_motor : ActuatorKind::dc_motor,
        .motor = motor,
        .delicate = job.delicate};
    if (job.resonance) {
      needs.resonance = job.resonance->si();
    }
    if (job.to_velocity) {
      const double change = *job.to_velocity - from.velocity;
      needs.distance =
          0.5 * (*job.to_velocity + from.velocity) * std::abs(change) / result.limits.acceleration;
    }
    if (needs.distance == 0.0) {
      needs.distance = result.limits.velocity * result.limits.velocity / result.limits.acceleration;
    }
    FLYBALL_TRY(const ProfileAdvice advice, select_profile(needs));
    result.kind = advice.kind;
    result.reasons = advice.reasons;
    result.limits.jerk = advice.limits.jerk;
    jump = std::max(jump, advice.jump);
    const bool smooth = job.ramp || job.from.acceleration != 0.0 || job.to.acceleration != 0.0;
    if (smooth && result.kind == ProfileKind::trapezoid) {
      result.kind = ProfileKind::s_curve;
      result.reasons = {
          "A ramp, or an acceleration at an end, was asked for: an S-curve has them."};
    }
  } else {
    FLYBALL_TRY(result.kind, parse_profile_kind(job.kind));
  }
  if (result.kind == ProfileKind::exponential && !motor) {
    return refusal(ArgumentError::empty, in_profile, "the motor")
        .got("left out")
        .expected("--kv and --ka of an exponential profile");
  }
  FLYBALL_CHECK(check_options(job, result.kind));
  if (job.ramp) {
    result.limits.jerk = result.limits.acceleration / job.ramp->si();
  } else if (result.kind == ProfileKind::s_curve && !std::isfinite(result.limits.jerk)) {
    result.limits.jerk = result.limits.acceleration / default_ramp(result.limits);
  }
  FLYBALL_CHECK(plan(result, motor, jump));
  FLYBALL_CHECK(check_goal_velocity(result));
  result.other_duration =
      job.to_velocity
          ? TrapezoidProfile::to_velocity(result.limits, from, *job.to_velocity).total_time()
          : TrapezoidProfile(result.limits, from, to).total_time();
  if (job.to_velocity) {
    result.job.to.position = result.table.find("position")->back();
    result.job.to.velocity = *job.to_velocity;
  }
  return result;
}

}  // namespace flyball::study
