#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <flyball/control/pid_design.hpp>
#include <flyball/math/search/minimum.hpp>
#include <flyball/math/search/roots.hpp>

#include "control/pid_basis.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

using classical::TransferFunction;
using Complex = std::complex<double>;

double degrees(double radians) {
  return radians * 180.0 / pi;
}

/// A controller of gain one but for its shape, whose one parameter is a time: T_i of PI, T_d of PD
/// and PID.
class Shape {
 public:
  Shape(PidForm form, const LoopShapeGoal& goal, const std::optional<Time>& period)
      : form_(form), goal_(goal), period_(period) {}

  [[nodiscard]] PidGains gains(double time) const {
    switch (form_) {
      case PidForm::p:
        return {1.0, 0.0, 0.0};
      case PidForm::pi:
        return {1.0, 1.0 / time, 0.0};
      case PidForm::pd:
        return {1.0, 0.0, time};
      case PidForm::pid:
        break;
    }
    return {1.0, 1.0 / (goal_.time_ratio * time), time};
  }
  [[nodiscard]] double filter(double time) const {
    const bool derivative = form_ == PidForm::pd || form_ == PidForm::pid;
    return derivative && goal_.filter_ratio > 0.0 ? time / goal_.filter_ratio : 0.0;
  }
  [[nodiscard]] Complex at(double time) const {
    const auto [kp, ki, kd] = gains(time);
    const auto basis = detail::pid_basis(period_, filter(time), goal_.crossover);
    return kp + ki * basis.integral + kd * basis.derivative;
  }
  /// rad
  [[nodiscard]] double phase(double logarithm) const { return std::arg(at(std::exp(logarithm))); }

 private:
  PidForm form_;
  const LoopShapeGoal& goal_;
  const std::optional<Time>& period_;
};

std::string_view name(PidForm form) {
  constexpr std::string_view names[] = {"P", "PI", "PD", "PID"};
  return names[static_cast<std::size_t>(form)];
}

}  // namespace

Expected<PidLoop> tune_by_loop_shape(const TransferFunction& plant, PidForm form,
                                     const LoopShapeGoal& goal) {
  constexpr std::string_view where = "tune_by_loop_shape";
  FLYBALL_CHECK(Checks(where)
                    .positive(goal.crossover, "the crossover", "rad/s")
                    .within(goal.phase_margin, 0.0, 180.0, "the phase margin", "deg")
                    .positive(goal.time_ratio, "the time ratio")
                    .not_negative(goal.filter_ratio, "the filter ratio"));
  const bool derivative = form == PidForm::pd || form == PidForm::pid;
  if (!plant.period() && derivative) {
    FLYBALL_CHECK(check_positive(goal.filter_ratio, where, "the filter ratio"));
  }
  if (plant.period() && goal.crossover >= pi / plant.period()->si()) {
    return refusal(ArgumentError::out_of_range, where, "the crossover")
        .got(format_number(goal.crossover) + " rad/s")
        .expected(flyball::detail::format("below the Nyquist frequency, {} rad/s",
                                          format_number(pi / plant.period()->si())));
  }
  const Complex P = plant.response(goal.crossover);
  if (!(std::abs(P) > 0.0) || !std::isfinite(std::abs(P))) {
    return refusal(PidDesignError::no_rule, where, "the plant at the crossover")
        .got(P == 0.0 ? "zero" : "infinite")
        .hint("choose another crossover");
  }
  // C = e^{j(φ - π)}/P, of gains of either sign.
  const double wanted = goal.phase_margin * pi / 180.0;
  double turn = std::remainder(wanted - pi - std::arg(P), 2.0 * pi);
  double sign = 1.0;
  const Shape shape(form, goal, plant.period());
  // From all integral, or none, to where the phase is largest.
  const double unit = -std::log(goal.crossover);
  constexpr double wide = 20.0;
  // A derivative that is nearly none would have a filter of no size.
  double low = form == PidForm::pi   ? unit - wide
               : form == PidForm::pd ? unit - std::log(1000.0)
                                     : unit - std::log(100.0);
  double high = unit + wide;
  if (derivative) {
    double best = low;
    constexpr int parts = 400;
    for (int i = 0; i <= parts; ++i) {
      const double at = low + (high - low) * i / parts;
      best = shape.phase(at) > shape.phase(best) ? at : best;
    }
    const double step = (high - low) / parts;
    const auto top =
        find_minimum([&](double at) { return -shape.phase(at); }, best - step, best + step);
    high = top ? top->x : best;
  }
  const double least = form == PidForm::p ? 0.0 : shape.phase(low);
  const double most = form == PidForm::p ? 0.0 : shape.phase(high);
  const double opposite = std::remainder(turn + pi, 2.0 * pi);
  const auto off = [&](double phase) { return std::max({0.0, phase - most, least - phase}); };
  // What is met, or nearer.
  if (off(opposite) < off(turn)) {
    turn = opposite;
    sign = -1.0;
  }
  double time = std::exp(high);
  if (form == PidForm::p) {
    // Nothing turns the phase: more margin than wanted is taken.
    if (turn > 1e-12) {
      const double nearest = goal.phase_margin - degrees(turn);
      const double margin = std::abs(nearest) < 1e-9 ? 0.0 : nearest;
      return refusal(PidDesignError::phase_not_reached, where, "the phase margin")
          .got(flyball::detail::format("{} deg with P at this crossover", format_number(margin)))
          .expected(flyball::detail::format("at least {} deg", format_number(goal.phase_margin)))
          .hint("a lower crossover, or PD or PID")
          .with("phase margin", margin);
    }
  } else if (off(turn) > 1e-9) {
    const bool above = turn > most;
    const double best = goal.phase_margin - degrees(turn - (above ? most : least));
    return refusal(PidDesignError::phase_not_reached, where, "the phase margin")
        .got(flyball::detail::format("{} {} deg with {} at this crossover",
                                     above ? "at most" : "at least", format_number(best),
                                     name(form)))
        .expected(format_number(goal.phase_margin) + " deg")
        .hint(above ? form == PidForm::pi ? "a lower crossover, or PID"
                                          : "a lower crossover, or a larger filter ratio"
                    : "a higher crossover, or a form with an integral")
        .with("phase margin", best);
  } else {
    const auto root = find_root([&](double at) { return shape.phase(at) - turn; }, low, high);
    time = std::exp(root ? root->x : turn >= 0.5 * (least + most) ? high : low);
  }
  const double gain = sign / (std::abs(P) * std::abs(shape.at(time)));
  const auto [kp, ki, kd] = shape.gains(time);
  FLYBALL_TRY_IN(where, auto loop,
                 assess_pid(plant, {gain * kp, gain * ki, gain * kd}, shape.filter(time)));
  if (!loop.margins.stable) {
    return refusal(PidDesignError::unstable_loop, where, "the closed loop")
        .got(loop.margins.unstable_poles == std::numeric_limits<int>::max()
                 ? std::string("unstable, of infinitely many poles right of the border")
                 : flyball::detail::format("unstable, of {} poles on or right of the border",
                                           loop.margins.unstable_poles))
        .hint(
            "the loop crosses |L| = 1 elsewhere too, or the plant needs a higher crossover to be "
            "stabilised")
        .with("unstable poles", static_cast<double>(loop.margins.unstable_poles));
  }
  return loop;
}

}  // namespace flyball
