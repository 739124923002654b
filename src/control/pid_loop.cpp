#include <cmath>
#include <numbers>

#include <flyball/control/pid_design.hpp>

#include "control/loop_motion.hpp"
#include "core/error_rows.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

using classical::TransferFunction;

}  // namespace

ErrorInfo error_info(PidDesignError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"no_rule", "the method has no rule for it", ErrorKind::no_answer},
      {"nothing_robust", "no gains keep the loop as robust", ErrorKind::no_answer},
      {"unlimited", "nothing limits the gains", ErrorKind::no_answer},
      {"phase_not_reached", "the controller cannot turn the phase as far", ErrorKind::no_answer},
      {"unstable_loop", "the loop is not stable", ErrorKind::no_answer},
      {"not_dominant", "another pole is slower", ErrorKind::no_answer},
  };
  return detail::info_of(code, "pid design", rows);
}

Expected<TransferFunction> pid_transfer(const PidGains& gains, double tau,
                                        std::optional<Time> period) {
  constexpr std::string_view where = "pid_transfer";
  FLYBALL_CHECK(Checks(where)
                    .finite(gains.kp, "kp")
                    .finite(gains.ki, "ki")
                    .finite(gains.kd, "kd")
                    .not_negative(tau, "the derivative's time constant", "s"));
  const auto& [kp, ki, kd] = gains;
  if (!period) {
    if (kd != 0.0 && tau == 0.0) {
      return refusal(ArgumentError::not_positive, where, "the derivative's time constant")
          .got("zero")
          .expected("positive: a derivative without a filter is no proper transfer function");
    }
    const double t = kd != 0.0 ? tau : 0.0;
    // ((kp τ + kd) s² + (kp + ki τ) s + ki)/(s (τ s + 1)); without an integral s is left out.
    if (ki == 0.0) {
      return TransferFunction::create(Eigen::Vector2d(kp * t + kd, kp), Eigen::Vector2d(t, 1.0));
    }
    return TransferFunction::create(Eigen::Vector3d(kp * t + kd, kp + ki * t, ki),
                                    Eigen::Vector3d(t, 1.0, 0.0));
  }
  FLYBALL_CHECK(check_positive(period->si(), where, "period", "s"));
  const double T = period->si();
  // kp + ki T z/(z - 1) + kd (z - 1)/((τ + T) z - τ).
  const double a = kd != 0.0 ? tau + T : 1.0;
  const double b = kd != 0.0 ? tau : 0.0;
  const bool filtered = kd != 0.0;
  if (ki == 0.0) {
    return filtered ? TransferFunction::create(Eigen::Vector2d(kp * a + kd, -kp * b - kd),
                                               Eigen::Vector2d(a, -b), period)
                    : TransferFunction::create(Eigen::VectorXd::Constant(1, kp),
                                               Eigen::VectorXd::Ones(1), period);
  }
  if (!filtered) {
    return TransferFunction::create(Eigen::Vector2d(kp + ki * T, -kp), Eigen::Vector2d(1.0, -1.0),
                                    period);
  }
  return TransferFunction::create(
      Eigen::Vector3d((kp + ki * T) * a + kd, -kp * (a + b) - ki * T * b - 2.0 * kd, kp * b + kd),
      Eigen::Vector3d(a, -a - b, b), period);
}

Expected<PidLoop> assess_pid(const TransferFunction& plant, const PidGains& gains, double tau) {
  constexpr std::string_view where = "assess_pid";
  FLYBALL_TRY_IN(where, const auto controller, pid_transfer(gains, tau, plant.period()));
  FLYBALL_TRY_IN(where, const auto loop, series(controller, plant));
  FLYBALL_TRY_IN(where, auto margins, classical::loop_margins(loop));
  PidLoop found{.gains = gains,
                .derivative_time_constant = gains.kd != 0.0 ? tau : 0.0,
                .controller = controller,
                .margins = std::move(margins)};
  const bool delayed = !plant.period() && plant.delay() > 0.0;
  std::optional<TransferFunction> closed;
  if (!delayed) {
    // Periods of delay are poles at z = 0.
    TransferFunction whole = loop;
    if (plant.delay() > 0.0) {
      const auto periods =
          static_cast<Eigen::Index>(std::lround(plant.delay() / plant.period()->si()));
      Eigen::VectorXd den = Eigen::VectorXd::Zero(loop.den().size() + periods);
      den.head(loop.den().size()) = loop.den();
      FLYBALL_TRY_IN(where, whole, TransferFunction::create(loop.num(), den, plant.period()));
    }
    FLYBALL_TRY_IN(where, closed, classical::unity_feedback(whole));
  }
  if (!found.margins.stable) {
    found.reference.final_value = std::numeric_limits<double>::quiet_NaN();
    return found;
  }
  if (closed) {
    FLYBALL_TRY_IN(where, found.reference, classical::step_metrics(*closed));
  } else if (const auto motion =
                 detail::loop_motion(plant, controller, detail::LoopStep::reference)) {
    found.reference = detail::reference_metrics(*motion);
  }
  if (const auto motion = detail::loop_motion(plant, controller, detail::LoopStep::load)) {
    found.load = detail::load_metrics(*motion);
  }
  return found;
}

}  // namespace flyball
