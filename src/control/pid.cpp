#include <flyball/control/pid.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/core/argument.hpp>
#include <flyball/core/signal.hpp>

#include "core/try.hpp"

namespace flyball {

namespace {

/// Beyond this a term is cut, so that a sum of terms cannot be infinity less infinity.
double cut(double term) noexcept {
  const double below = term < largest_signal ? term : largest_signal;
  return below > -largest_signal ? below : -largest_signal;
}

Expected<void> check_limits(double low, double high, std::string_view name) {
  if (std::isnan(low) || std::isnan(high) || !(low < high)) {
    return refusal(ArgumentError::out_of_range, "Pid", std::string(name) + "_min")
        .got(format_number(low))
        .expected("below " + std::string(name) + "_max, which is " + format_number(high));
  }
  return {};
}

Expected<void> check_zone(double zone) {
  return zone > 0.0 ? Expected<void>{}
                    : refusal(ArgumentError::not_positive, "Pid", "integral_zone")
                          .got(format_number(zone))
                          .expected("positive, or infinity for none");
}

}  // namespace

Expected<Pid> Pid::create(const PidSettings& settings) {
  constexpr std::string_view where = "Pid";
  return Checks(where)
      .positive(settings.period, "period", "s")
      .finite(settings.gains.kp, "kp")
      .finite(settings.gains.ki, "ki")
      .finite(settings.gains.kd, "kd")
      .not_negative(settings.derivative_time_constant, "derivative_time_constant", "s")
      .not_negative(settings.tracking_time, "tracking_time", "s")
      .not_negative(settings.turn, "turn")
      .also([&] { return check_limits(settings.output_min, settings.output_max, "output"); })
      .also([&] { return check_limits(settings.integral_min, settings.integral_max, "integral"); })
      .also([&] { return check_zone(settings.integral_zone); })
      .map([&] { return Pid(settings); });
}

Pid::Pid(const PidSettings& settings) noexcept : settings_(settings) {
  update_tracking();
  output_ = std::clamp(0.0, settings_.output_min, settings_.output_max);
  integral_ = limited_integral(0.0);
}

void Pid::update_tracking() noexcept {
  const PidGains& gains = settings_.gains;
  double time = settings_.tracking_time;
  if (time == 0.0 && gains.ki != 0.0) {
    const double integral_time = std::abs(gains.kp / gains.ki);
    const double derivative_time = gains.kp != 0.0 ? std::abs(gains.kd / gains.kp) : 0.0;
    time = derivative_time > 0.0 ? std::sqrt(integral_time * derivative_time) : integral_time;
  }
  // Faster than one period would overshoot its own aim.
  tracking_gain_ = time > settings_.period ? settings_.period / time : 1.0;
}

double Pid::wrapped(double difference) const noexcept {
  return settings_.turn > 0.0 ? std::remainder(difference, settings_.turn) : difference;
}

double Pid::limited_integral(double value) const noexcept {
  return detail::limited(value, settings_.integral_min, settings_.integral_max);
}

double Pid::calculate(double measurement, double reference, double feedforward) noexcept {
  const PidGains& gains = settings_.gains;
  const double T = settings_.period;
  const double added = detail::signal_or_zero(feedforward);
  const bool known = is_signal(measurement) && is_signal(reference);
  double step = 0.0;
  double before_limits = integral_;
  if (known) {
    error_ = cut(wrapped(reference - measurement));
    const double differentiated = settings_.derivative_on_measurement ? -measurement : error_;
    const double change = has_before_ ? cut(wrapped(differentiated - before_)) : 0.0;
    const double tau = settings_.derivative_time_constant;
    rate_ = has_before_ ? cut((tau * rate_ + change) / (tau + T)) : 0.0;
    before_ = differentiated;
    has_before_ = true;
    derivative_ = cut(gains.kd * rate_);
    if (std::abs(error_) > settings_.integral_zone) {
      integral_ = limited_integral(0.0);
    } else {
      step = cut(cut(gains.ki * T) * error_);
    }
    before_limits = cut(gains.kp * error_) + derivative_ + integral_;
  } else {
    error_ = 0.0;
    derivative_ = 0.0;
    rate_ = 0.0;
    has_before_ = false;
  }
  before_limits += added;
  double wanted = before_limits + step;
  if (settings_.anti_windup == AntiWindup::clamping &&
      ((wanted > settings_.output_max && step > 0.0) ||
       (wanted < settings_.output_min && step < 0.0))) {
    // What is left of the way to the limit still counts.
    const double room = (step > 0.0 ? settings_.output_max : settings_.output_min) - before_limits;
    step = room * step > 0.0 ? room : 0.0;
    wanted = before_limits + step;
  }
  const double held = limited_integral(integral_ + step);
  wanted += held - (integral_ + step);
  integral_ = held;
  output_ = detail::limited(wanted, settings_.output_min, settings_.output_max);
  saturated_ = output_ != wanted;
  if (settings_.anti_windup == AntiWindup::back_calculation && gains.ki != 0.0 && known) {
    integral_ = limited_integral(integral_ + tracking_gain_ * (output_ - wanted));
  }
  return output_;
}

bool Pid::set_gains(const PidGains& gains) noexcept {
  if (!std::isfinite(gains.kp) || !std::isfinite(gains.ki) || !std::isfinite(gains.kd)) {
    return false;
  }
  if (gains.ki == 0.0) {
    integral_ = limited_integral(0.0);
  } else {
    const double change = cut(settings_.gains.kp * error_) - cut(gains.kp * error_) +
                          cut(settings_.gains.kd * rate_) - cut(gains.kd * rate_);
    integral_ = limited_integral(integral_ + change);
  }
  settings_.gains = gains;
  derivative_ = cut(gains.kd * rate_);
  update_tracking();
  return true;
}

void Pid::reset() noexcept {
  reset(0.0);
}

void Pid::reset(double integral) noexcept {
  integral_ = limited_integral(detail::signal_or_zero(integral));
  error_ = 0.0;
  before_ = 0.0;
  rate_ = 0.0;
  derivative_ = 0.0;
  has_before_ = false;
  saturated_ = false;
  output_ = std::clamp(0.0, settings_.output_min, settings_.output_max);
}

}  // namespace flyball
