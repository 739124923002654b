#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <flyball/control/pid_tuning.hpp>

#include "core/try.hpp"

namespace flyball {

namespace {

/// Gains from K_c, T_i and T_d as the form takes them.
PidGains parallel(double gain, double integral_time, double derivative_time, PidForm form) {
  const bool integral = form == PidForm::pi || form == PidForm::pid;
  const bool derivative = form == PidForm::pd || form == PidForm::pid;
  return {gain, integral ? gain / integral_time : 0.0, derivative ? gain * derivative_time : 0.0};
}

Expected<void> check_point(const UltimatePoint& point, std::string_view where) {
  return Checks(where)
      .positive(std::abs(point.gain), "the ultimate gain")
      .positive(point.period, "the ultimate period", "s");
}

Expected<void> check_curve(const ReactionCurve& curve, std::string_view where, bool needs_delay) {
  if (auto checked = Checks(where)
                         .positive(std::abs(curve.gain), "the curve's gain")
                         .positive(curve.time_constant, "the time constant", "s")
                         .not_negative(curve.delay, "the delay", "s");
      !checked || !needs_delay || curve.delay > 0.0) {
    return checked;
  }
  return refusal(ArgumentError::not_positive, where, "the delay")
      .got("zero")
      .expected("positive")
      .hint("without a delay any gain would do by this rule; use simc or pole placement");
}

Expected<void> check_shape_of_motion(const MatrixRef& A, const MatrixRef& B,
                                     std::string_view where) {
  if (A(0, 0) == 0.0 && A(0, 1) == 1.0 && B(0, 0) == 0.0 && B(1, 0) != 0.0) {
    return {};
  }
  return refusal(ArgumentError::malformed, where, "the plant")
      .got("of other states")
      .expected("[position, velocity] with the input on the velocity");
}

Expected<void> check_shape_of_loop(double natural_frequency, double damping,
                                   std::string_view where) {
  return Checks(where)
      .positive(natural_frequency, "natural_frequency", "rad/s")
      .positive(damping, "damping");
}

}  // namespace

Expected<PidGains> ziegler_nichols(const UltimatePoint& point, PidForm form) {
  return check_point(point, "ziegler_nichols").map([&] {
    const double K = point.gain;
    const double T = point.period;
    switch (form) {
      case PidForm::p:
        return parallel(0.5 * K, T, 0.0, form);
      case PidForm::pi:
        return parallel(0.45 * K, T / 1.2, 0.0, form);
      case PidForm::pd:
        return parallel(0.8 * K, T, T / 8.0, form);
      case PidForm::pid:
        break;
    }
    return parallel(0.6 * K, T / 2.0, T / 8.0, form);
  });
}

Expected<PidGains> tyreus_luyben(const UltimatePoint& point, PidForm form) {
  return check_point(point, "tyreus_luyben").map([&] {
    const bool derivative = form == PidForm::pd || form == PidForm::pid;
    return parallel(point.gain / (derivative ? 2.2 : 3.2), 2.2 * point.period, point.period / 6.3,
                    form);
  });
}

Expected<PidGains> ziegler_nichols(const ReactionCurve& curve, PidForm form) {
  return check_curve(curve, "ziegler_nichols", true).map([&] {
    const double theta = curve.delay;
    const double unit = curve.time_constant / (curve.gain * theta);
    switch (form) {
      case PidForm::p:
        return parallel(unit, 1.0, 0.0, form);
      case PidForm::pi:
        return parallel(0.9 * unit, theta / 0.3, 0.0, form);
      case PidForm::pd:
      case PidForm::pid:
        break;
    }
    return parallel(1.2 * unit, 2.0 * theta, 0.5 * theta, form);
  });
}

Expected<PidGains> cohen_coon(const ReactionCurve& curve, PidForm form) {
  return check_curve(curve, "cohen_coon", true).map([&] {
    const double theta = curve.delay;
    const double ratio = theta / curve.time_constant;
    const double unit = 1.0 / (curve.gain * ratio);
    switch (form) {
      case PidForm::p:
        return parallel(unit * (1.0 + ratio / 3.0), 1.0, 0.0, form);
      case PidForm::pi:
        return parallel(unit * (0.9 + ratio / 12.0),
                        theta * (30.0 + 3.0 * ratio) / (9.0 + 20.0 * ratio), 0.0, form);
      case PidForm::pd:
        return parallel(unit * (1.25 + ratio / 6.0), 1.0,
                        theta * (6.0 - 2.0 * ratio) / (22.0 + 3.0 * ratio), form);
      case PidForm::pid:
        break;
    }
    return parallel(unit * (4.0 / 3.0 + ratio / 4.0),
                    theta * (32.0 + 6.0 * ratio) / (13.0 + 8.0 * ratio),
                    theta * 4.0 / (11.0 + 2.0 * ratio), form);
  });
}

Expected<PidGains> simc(const ReactionCurve& curve, double closed_loop_time, PidForm form) {
  constexpr std::string_view where = "simc";
  return Checks(where)
      .also([&] { return check_curve(curve, where, false); })
      .not_negative(closed_loop_time, "closed_loop_time", "s")
      .positive(closed_loop_time + curve.delay, "closed_loop_time + delay", "s")
      .map([&] {
        const double tau = curve.time_constant;
        const double horizon = closed_loop_time + curve.delay;
        const double gain = tau / (curve.gain * horizon);
        const double integral_time = std::min(tau, 4.0 * horizon);
        const double derivative_time = 0.5 * curve.delay;
        if (form == PidForm::pid) {
          // (1 + 1/(T_i s))(1 + T_d s) in parallel form.
          const double sum = integral_time + derivative_time;
          return PidGains{gain * sum / integral_time, gain / integral_time, gain * derivative_time};
        }
        return parallel(gain, integral_time, derivative_time, form);
      });
}

Expected<PidGains> pd_by_poles(const ContinuousSystem<2, 1, 1>& plant, double natural_frequency,
                               double damping) {
  constexpr std::string_view where = "pd_by_poles";
  return Checks(where)
      .also([&] { return check_system(plant, where); })
      .also([&] { return check_shape_of_motion(plant.A, plant.B, where); })
      .also([&] { return check_shape_of_loop(natural_frequency, damping, where); })
      .map([&] {
        // s² - (a₂₂ - b kd) s - (a₂₁ - b kp) = s² + 2ζω s + ω².
        const double b = plant.B(1);
        return PidGains{(natural_frequency * natural_frequency + plant.A(1, 0)) / b, 0.0,
                        (2.0 * damping * natural_frequency + plant.A(1, 1)) / b};
      });
}

Expected<PidGains> pi_by_poles(const ContinuousSystem<1, 1, 1>& plant, double natural_frequency,
                               double damping) {
  constexpr std::string_view where = "pi_by_poles";
  FLYBALL_CHECK(check_system(plant, where));
  return Checks(where)
      .positive(std::abs(plant.B(0)), "the input's effect")
      .also([&] { return check_shape_of_loop(natural_frequency, damping, where); })
      .map([&] {
        // s² - (a - b kp) s + b ki = s² + 2ζω s + ω².
        return PidGains{(2.0 * damping * natural_frequency + plant.A(0, 0)) / plant.B(0),
                        natural_frequency * natural_frequency / plant.B(0), 0.0};
      });
}

Expected<PidGains> pd_by_lqr(const DiscreteSystem<2, 1, 1>& plant, const Weight& Q,
                             const Weight& R) {
  return lqr(plant, Q, R).map([](const LqrDesign<2, 1>& design) {
    return PidGains{design.K(0), 0.0, design.K(1)};
  });
}

}  // namespace flyball
