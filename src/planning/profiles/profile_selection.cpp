#include <flyball/planning/profiles/profile_selection.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>
#include <flyball/planning/profiles/parabolic_profile.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_select_profile = "select_profile";
constexpr std::array<const char*, 6> profile_names{"trapezoid", "s-curve", "exponential",
                                                   "parabolic", "stepper", "minimum-jerk"};

[[gnu::noinline]] void say(ProfileAdvice& advice, std::string_view reason) {
  advice.reasons.emplace_back(reason);
}

void advise_s_curve(ProfileAdvice& advice, double ramp, double distance) {
  advice.kind = ProfileKind::s_curve;
  advice.ramp_time = ramp;
  advice.limits.jerk = advice.limits.acceleration / ramp;
  advice.duration = SCurveProfile(advice.limits, {}, {distance}).total_time();
}

void say_cost(ProfileAdvice& advice) {
  if (advice.trapezoid_duration > 0.0) {
    say(advice, detail::format("It takes {:.3g} s; a trapezoid with these limits would take {:.3g} "
                               "s, but shakes or asks "
                               "for more than is there.",
                               advice.duration, advice.trapezoid_duration));
  }
}

/// The longest ramps that still reach the peak which the distance and the limits leave.
double longest_ramp(const MotionLimits& limits, double distance) {
  // Four ramps of t with the peak acceleration a: v = a t, d = 2 a t² = 2 v t.
  const double by_velocity = limits.velocity / limits.acceleration;
  const double by_distance = std::sqrt(distance / (2.0 * limits.acceleration));
  return std::min(by_velocity, by_distance);
}

Expected<void> check(const ProfileNeeds& needs) {
  const MotionLimits all = needs.limits.both_ways();
  FLYBALL_CHECK(Checks(in_select_profile)
                    .positive(all.velocity, "limits.velocity")
                    .positive(all.acceleration, "limits.acceleration")
                    .positive(all.deceleration, "limits.deceleration")
                    .positive(all.reverse_velocity, "limits.reverse_velocity")
                    .positive(std::abs(needs.distance), "distance")
                    .not_negative(needs.damping_ratio, "damping_ratio")
                    .not_negative(needs.patience, "patience", "s"));
  if (needs.damping_ratio > 1.0) {
    return refusal(ArgumentError::out_of_range, in_select_profile, "damping_ratio")
        .got(detail::format("{}", needs.damping_ratio))
        .expected("from 0 to 1");
  }
  if (needs.resonance) {
    FLYBALL_CHECK(Checks(in_select_profile).positive(*needs.resonance, "resonance", "Hz"));
  }
  if (needs.resonant_velocity) {
    FLYBALL_CHECK(
        Checks(in_select_profile).positive(*needs.resonant_velocity, "resonant_velocity"));
  }
  if (needs.motor) {
    FLYBALL_CHECK(Checks(in_select_profile)
                      .positive(needs.motor->kV, "motor.kV")
                      .positive(needs.motor->kA, "motor.kA")
                      .positive(needs.motor->voltage, "motor.voltage", "V"));
  }
  return {};
}

/// Whether the mode still rings when it should be over: it is down to a twentieth, 3/(ζω) s later.
bool rings(const ProfileNeeds& needs) {
  if (!needs.resonance) {
    return false;
  }
  const double decay = needs.damping_ratio * 2.0 * std::numbers::pi * *needs.resonance;
  return decay * needs.patience < 3.0;
}

}  // namespace

const char* to_string(ProfileKind kind) noexcept {
  return profile_names[static_cast<std::size_t>(kind)];
}

Expected<ProfileKind> parse_profile_kind(std::string_view name) {
  for (std::size_t i = 0; i < profile_names.size(); ++i) {
    if (name == profile_names[i]) {
      return static_cast<ProfileKind>(i);
    }
  }
  const std::vector<std::string_view> known(profile_names.begin(), profile_names.end());
  const std::string nearest = nearest_name(name, known);
  auto no = refusal(ArgumentError::unknown_name, "profile", "the kind")
                .got(detail::format("\"{}\"", name))
                .expected("trapezoid, s-curve, exponential, parabolic, stepper or minimum-jerk");
  return nearest.empty() ? std::move(no)
                         : std::move(no).hint(detail::format("did you mean \"{}\"?", nearest));
}

Expected<ProfileAdvice> select_profile(const ProfileNeeds& needs) {
  FLYBALL_CHECK(check(needs));
  ProfileAdvice advice;
  advice.limits = needs.limits;
  advice.limits.jerk = std::numeric_limits<double>::infinity();
  const double distance = std::abs(needs.distance);
  const TrapezoidProfile trapezoid(advice.limits, {}, {distance});
  advice.trapezoid_duration = trapezoid.total_time();
  advice.duration = advice.trapezoid_duration;
  const MotionLimits& limits = advice.limits;
  const double longest = longest_ramp(limits, distance);

  if (needs.delicate) {
    advise_s_curve(advice, longest, distance);
    say(advice,
        detail::format(
            "What is carried must not be jostled: ramps of {:.3g} s, as long as this way and these "
            "limits let them be, leave no constant acceleration between them (15.1.2).",
            longest));
    say_cost(advice);
    return advice;
  }
  if (rings(needs)) {
    const double period = 1.0 / *needs.resonance;
    const double at_full =
        std::min(limits.velocity, trapezoid.cruise_velocity()) / limits.acceleration;
    const double ramp = std::min(std::max(period, 0.05 * at_full), longest);
    advise_s_curve(advice, ramp, distance);
    say(advice,
        ramp < period
            ? detail::format("The mode at {:.3g} Hz rings on. Ramps of one of its periods would "
                             "leave nothing of it, but this way is too short for them: they last "
                             "{:.3g} s, and some of it stays.",
                             *needs.resonance, ramp)
            : detail::format("The mode at {:.3g} Hz rings on. Ramps of {:.3g} s, {}, leave "
                             "nothing of it (15.1.2: the S is tuned for the load).",
                             *needs.resonance, ramp,
                             ramp > period ? "the least of the book's five to fifteen percent"
                                           : "one of its periods"));
    if (needs.actuator == ActuatorKind::step_motor) {
      say(advice,
          "A parabola would suit a step motor's torque, but starts with a jump of the "
          "acceleration: "
          "choose an acceleration that the motor has at full speed.");
    }
    say_cost(advice);
    return advice;
  }
  if (needs.actuator == ActuatorKind::step_motor) {
    if (needs.resonant_velocity && *needs.resonant_velocity < limits.velocity) {
      // A fifth above it the torque is back.
      advice.kind = ProfileKind::stepper;
      advice.jump = std::min(1.2 * *needs.resonant_velocity, limits.velocity);
      advice.duration = StepperProfile(limits, advice.jump, {}, {distance}).total_time();
      say(advice,
          detail::format("The step motor resonates at {:.3g} {}/s: starting and stopping at {:.3g} "
                         "{}/s jumps over "
                         "it (15.1.4).",
                         *needs.resonant_velocity, needs.unit, advice.jump, needs.unit));
      return advice;
    }
    advice.kind = ProfileKind::parabolic;
    advice.duration = ParabolicProfile(limits, {}, {distance}).total_time();
    say(advice,
        "A step motor's torque falls with its speed: the parabola accelerates least where it is "
        "fastest (15.1.4).");
    say_cost(advice);
    return advice;
  }
  if (needs.motor) {
    const double peak = std::abs(trapezoid.cruise_velocity());
    const double there = needs.motor->most(peak);
    if (there < limits.acceleration) {
      advice.kind = ProfileKind::exponential;
      MotorMotionLimits motor = *needs.motor;
      motor.velocity = std::min(motor.velocity, limits.velocity);
      advice.duration = ExponentialProfile(motor, {}, {distance}).total_time();
      say(advice, detail::format(
                      "At {:.3g} {}/s the motor has {:.3g} {}/s² of acceleration left, not {:.3g}: "
                      "a profile "
                      "along its own torque-speed curve asks for what is there, and for all of it.",
                      peak, needs.unit, there, needs.unit, limits.acceleration));
      return advice;
    }
    say(advice, detail::format("The motor has these {:.3g} {}/s² at every speed of the move.",
                               limits.acceleration, needs.unit));
  }
  advice.kind = ProfileKind::trapezoid;
  say(advice,
      needs.resonance
          ? "The resonance is gone before it matters: full acceleration all the time is fastest."
          : "Nothing rings: full acceleration all the time is fastest, and a motor on a voltage "
            "follows jumps of acceleration by its feedforward (15.1.2).");
  std::rotate(advice.reasons.begin(), advice.reasons.end() - 1, advice.reasons.end());
  return advice;
}

}  // namespace flyball
