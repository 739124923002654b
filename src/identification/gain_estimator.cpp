#include <flyball/identification/gain_estimator.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/core/argument.hpp>
#include <flyball/core/signal.hpp>

#include "core/try.hpp"

namespace flyball::identification {

namespace {

/// Filtered and squared twice it is still a double.
constexpr double largest_sample = 1e60;

/// Of a normal distribution; what is estimated from few samples is not found anyway.
constexpr double normal_975 = 1.959963984540054;

}  // namespace

Expected<GainEstimator> GainEstimator::create(const GainEstimatorSettings& settings) {
  constexpr std::string_view where = "GainEstimator";
  FLYBALL_CHECK(
      Checks(where)
          .within(settings.period, 1e-6, 10.0, "period", "s")
          .within(settings.top_speed, 1e-9, 1e9, "top_speed")
          .within(settings.max_voltage, 1e-3, 1e6, "max_voltage", "V")
          .within(settings.filter_time, settings.period, 1e4, "filter_time", "s")
          .within(settings.velocity_delay, 0.0, 60.0 * settings.period, "velocity_delay", "s")
          .within(settings.rest_share, 0.0, 1.0, "rest_share")
          .positive(settings.relative_tolerance, "relative_tolerance")
          .positive(settings.voltage_tolerance, "voltage_tolerance", "V"));
  if (!(settings.memory >= 10.0 * settings.period)) {
    return refusal(ArgumentError::out_of_range, where, "memory")
        .got(format_number(settings.memory) + " s")
        .expected("ten periods or longer");
  }
  const double forgetting =
      std::isinf(settings.memory) ? 1.0 : std::exp(-settings.period / settings.memory);
  // As far off as a gain can be: the whole voltage against friction, at top speed, or for an
  // acceleration to it within ten seconds. The noise they are beside is a thousandth of it.
  const double V = 1e3 * settings.max_voltage;
  Regression::Vector deviation;
  deviation << V, V / settings.top_speed, 10.0 * V / settings.top_speed, V, V;
  return Regression::create(Regression::Vector::Zero(), deviation / settings.max_voltage,
                            forgetting)
      .map([&](const Regression& regression) { return GainEstimator(settings, regression); });
}

GainEstimator::GainEstimator(const GainEstimatorSettings& settings,
                             const Regression& regression) noexcept
    : settings_(settings),
      regression_(regression),
      decay_(std::exp(-settings.period / settings.filter_time)),
      ratio_(settings.period / settings.filter_time) {}

void GainEstimator::hold(Filtered& filtered, double value) const noexcept {
  filtered.twice +=
      (1.0 - decay_) * (value - filtered.twice) + ratio_ * decay_ * (filtered.once - value);
  filtered.once += (1.0 - decay_) * (value - filtered.once);
}

void GainEstimator::line(Filtered& filtered, double from, double to) const noexcept {
  // The ramp from 0 to 1 in T: once 1 - (1 - a)τ/T, twice 1 + a - 2(1 - a)τ/T, with a = e^(-T/τ).
  const double share = (1.0 - decay_) / ratio_;
  hold(filtered, from);
  filtered.once += (to - from) * (1.0 - share);
  filtered.twice += (to - from) * (1.0 + decay_ - 2.0 * share);
}

void GainEstimator::restart() noexcept {
  moving_ = 0;
  voltage_filter_ = sign_filter_ = velocity_filter_ = one_filter_ = cosine_filter_ =
      sine_filter_ = {};
}

double GainEstimator::delayed_voltage() const noexcept {
  const double periods = settings_.velocity_delay / settings_.period;
  const auto whole = static_cast<std::size_t>(periods);
  const double part = periods - static_cast<double>(whole);
  const auto ago = [&](std::size_t samples) {
    return voltages_[(newest_ + voltages_.size() - samples) % voltages_.size()];
  };
  return (1.0 - part) * ago(whole) + part * ago(whole + 1);
}

bool GainEstimator::update(double voltage, double velocity, double position) noexcept {
  const bool arm = settings_.mechanism == mechanisms::MechanismKind::arm;
  const bool usable = std::abs(voltage) <= largest_sample && std::abs(velocity) <= largest_sample &&
                      (!arm || std::abs(position) <= largest_sample);
  // What was held until now moved the mechanism to where it is.
  const double held = delayed_voltage();
  newest_ = (newest_ + 1) % voltages_.size();
  voltages_[newest_] = std::abs(voltage) <= largest_sample ? voltage : 0.0;
  const double slowest = settings_.rest_share * settings_.top_speed;
  if (!usable || std::abs(velocity) <= slowest) {
    restart();
    return false;
  }
  bool used = false;
  if (moving_ > 0) {
    hold(voltage_filter_, held);
    hold(sign_filter_, velocity_ + velocity < 0.0 ? -1.0 : 1.0);
    line(velocity_filter_, velocity_, velocity);
    hold(one_filter_, 1.0);
    if (arm) {
      line(cosine_filter_, std::cos(position_), std::cos(position));
      line(sine_filter_, std::sin(position_), std::sin(position));
    }
    const double acceleration = ((velocity_filter_.once - velocity_filter_.twice) -
                                 start_velocity_ * (one_filter_.once - one_filter_.twice)) /
                                settings_.filter_time;
    const bool elevator = settings_.mechanism == mechanisms::MechanismKind::elevator;
    Regression::Vector x;
    x << sign_filter_.twice, velocity_filter_.twice, acceleration,
        elevator ? one_filter_.twice : cosine_filter_.twice, sine_filter_.twice;
    used = regression_.update(x, voltage_filter_.twice);
  } else {
    start_velocity_ = velocity;
  }
  ++moving_;
  velocity_ = velocity;
  position_ = position;
  return used;
}

mechanisms::FeedforwardGains GainEstimator::gains() const noexcept {
  const Regression::Vector& k = regression_.coefficients();
  const bool arm = settings_.mechanism == mechanisms::MechanismKind::arm;
  // kG cos(θ + offset) = kG cos(offset) cos θ - kG sin(offset) sin θ.
  return {k(0), k(1), k(2), arm ? std::hypot(k(3), k(4)) : k(3),
          arm ? std::atan2(-k(4), k(3)) : 0.0};
}

mechanisms::FeedforwardGains GainEstimator::half_widths() const noexcept {
  // White noise through F stays correlated for 4τ: so many samples count as one.
  const double together = std::max(4.0 / ratio_, 1.0);
  const Regression::Matrix P = regression_.covariance();
  const double variance = together * regression_.variance();
  const double few = regression_.samples() > 5.0 + together ? 1.0 : 1e50;
  const auto width = [&](double covariance) {
    return detail::cut(few * normal_975 * std::sqrt(std::max(variance * covariance, 0.0)) +
                       (few > 1.0 ? few : 0.0));
  };
  mechanisms::FeedforwardGains widths{width(P(0, 0)), width(P(1, 1)), width(P(2, 2)), 0.0, 0.0};
  if (settings_.mechanism == mechanisms::MechanismKind::elevator) {
    widths.kG = width(P(3, 3));
  } else if (settings_.mechanism == mechanisms::MechanismKind::arm) {
    const Regression::Vector& k = regression_.coefficients();
    const double kG = std::hypot(k(3), k(4));
    const double c = kG > 0.0 ? k(3) / kG : 1.0;
    const double s = kG > 0.0 ? k(4) / kG : 0.0;
    widths.kG = width(c * c * P(3, 3) + 2.0 * c * s * P(3, 4) + s * s * P(4, 4));
    const double across = width(s * s * P(3, 3) - 2.0 * c * s * P(3, 4) + c * c * P(4, 4));
    widths.angle_offset = kG > 0.0 ? detail::cut(across / kG) : largest_signal;
  }
  return widths;
}

std::array<double, 4> GainEstimator::shares() const noexcept {
  const mechanisms::FeedforwardGains k = gains();
  const mechanisms::FeedforwardGains width = half_widths();
  const double relative = settings_.relative_tolerance;
  const auto voltage_share = [&](double half, double gain) {
    return half / std::max(settings_.voltage_tolerance, relative * std::abs(gain));
  };
  // A gain of a motor that is not positive is not found.
  const auto share = [&](double half, double gain) {
    return gain > 0.0 && relative * gain > 0.0 ? std::min(half / (relative * gain), largest_signal)
                                               : largest_signal;
  };
  const bool gravity = has_gravity(settings_.mechanism);
  return {voltage_share(width.kS, k.kS), share(width.kV, k.kV), share(width.kA, k.kA),
          gravity ? voltage_share(width.kG, k.kG) : 0.0};
}

GainEstimator::Found GainEstimator::found() const noexcept {
  const std::array<double, 4> share = shares();
  return {share[0] <= 1.0, share[1] <= 1.0, share[2] <= 1.0, share[3] <= 1.0};
}

double GainEstimator::progress() const noexcept {
  const std::array<double, 4> share = shares();
  return std::min(*std::max_element(share.begin(), share.end()), largest_signal);
}

double GainEstimator::residual_deviation() const noexcept {
  return std::sqrt(regression_.variance());
}

}  // namespace flyball::identification
