#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/classical/delay_poles.hpp>
#include <flyball/control/pid_design.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

using classical::TransferFunction;
using Complex = std::complex<double>;
using Eigen::Index;

/// 1, 1/s and s/(τ s + 1) at a point of the s plane, of a sampled controller at z = e^{sT}.
std::vector<Complex> terms_at(PidForm form, double tau, Complex s,
                              const std::optional<Time>& period) {
  Complex integral = 1.0 / s;
  Complex derivative = s / (tau * s + 1.0);
  if (period) {
    const double T = period->si();
    const Complex z = std::exp(s * T);
    integral = T * z / (z - 1.0);
    derivative = (z - 1.0) / ((tau + T) * z - tau);
  }
  std::vector<Complex> terms{1.0};
  if (form != PidForm::pd) {
    terms.push_back(integral);
  }
  if (form != PidForm::pi) {
    terms.push_back(derivative);
  }
  return terms;
}

/// P at a point of the s plane.
Expected<Complex> plant_at(const TransferFunction& plant, Complex s) {
  return plant.at(plant.period() ? std::exp(s * plant.period()->si()) : s);
}

}  // namespace

Expected<PidLoop> tune_by_poles(const TransferFunction& plant, PidForm form,
                                const DominantPoles& goal) {
  constexpr std::string_view where = "tune_by_poles";
  FLYBALL_CHECK(Checks(where)
                    .positive(goal.natural_frequency, "the natural frequency", "rad/s")
                    .positive(goal.damping_ratio, "the damping ratio")
                    .positive(goal.third_pole, "the third pole")
                    .not_negative(goal.filter_ratio, "the filter ratio"));
  if (goal.damping_ratio >= 1.0) {
    return refusal(ArgumentError::out_of_range, where, "the damping ratio")
        .got(format_number(goal.damping_ratio))
        .expected("below 1: the poles are a pair");
  }
  if (form == PidForm::p) {
    return refusal(PidDesignError::no_rule, where, "the form")
        .got("P, whose one gain places no pair of poles")
        .expected("PI, PD or PID")
        .hint("a root locus tells what P does");
  }
  const double w = goal.natural_frequency;
  if (plant.period() && w * std::sqrt(1.0 - goal.damping_ratio * goal.damping_ratio) >=
                            std::numbers::pi / plant.period()->si()) {
    return refusal(ArgumentError::out_of_range, where, "the poles' frequency")
        .got("above the Nyquist frequency")
        .expected(flyball::detail::format("below {} rad/s",
                                          format_number(std::numbers::pi / plant.period()->si())));
  }
  if (!plant.period() && form != PidForm::pi) {
    FLYBALL_CHECK(check_positive(goal.filter_ratio, where, "the filter ratio"));
  }
  // 1 + P C = 0 at the pair, and at a real pole of PID: as many equations as gains, linear in them
  // but for the filter's time, which follows the gains.
  std::vector<Complex> points{
      w * Complex(-goal.damping_ratio, std::sqrt(1.0 - goal.damping_ratio * goal.damping_ratio))};
  if (form == PidForm::pid) {
    points.emplace_back(-goal.third_pole * w);
  }
  const auto count = static_cast<Index>(form == PidForm::pid ? 3 : 2);
  Eigen::VectorXd right(count);
  for (std::size_t i = 0; i < points.size(); ++i) {
    FLYBALL_TRY_IN(where, const Complex P, plant_at(plant, points[i]));
    if (P == 0.0 || !std::isfinite(std::abs(P))) {
      return refusal(PidDesignError::no_rule, where, "the plant at the poles")
          .got(P == 0.0 ? "zero: no gain moves a pole there" : "infinite")
          .hint("choose other poles");
    }
    const Complex C = -1.0 / P;
    right(static_cast<Index>(2 * i)) = C.real();
    if (i == 0) {
      right(1) = C.imag();
    }
  }
  double tau = 0.0;
  PidGains gains{0.0, 0.0, 0.0};
  bool settled = false;
  for (int round = 0; round < 200 && !settled; ++round) {
    Eigen::MatrixXd M(count, count);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::vector<Complex> terms = terms_at(form, tau, points[i], plant.period());
      for (std::size_t k = 0; k < terms.size(); ++k) {
        M(static_cast<Index>(2 * i), static_cast<Index>(k)) = terms[k].real();
        if (i == 0) {
          M(1, static_cast<Index>(k)) = terms[k].imag();
        }
      }
    }
    double rcond = 0.0;
    const Eigen::VectorXd found = detail::solve_linear(M, right, &rcond);
    if (!(rcond > 1e-13) || !found.allFinite()) {
      break;
    }
    gains.kp = found(0);
    gains.ki = form != PidForm::pd ? found(1) : 0.0;
    gains.kd = form != PidForm::pi ? found(count - 1) : 0.0;
    const double next = form == PidForm::pi || goal.filter_ratio == 0.0
                            ? 0.0
                            : std::abs(gains.kd / gains.kp) / goal.filter_ratio;
    settled = std::abs(next - tau) <= 1e-13 * next;
    // Half the way where whole ones go to and fro.
    tau = settled ? tau : round < 20 ? next : 0.5 * (tau + next);
  }
  if (!settled) {
    return refusal(PidDesignError::no_rule, where, "a set of gains")
        .got("not found: the filter's time, a share of the derivative's, does not settle")
        .hint("a larger filter ratio, or other poles");
  }
  FLYBALL_TRY_IN(where, auto loop, assess_pid(plant, gains, tau));
  if (!loop.margins.stable) {
    return refusal(PidDesignError::unstable_loop, where, "the closed loop")
        .got(flyball::detail::format("unstable: {} poles lie right of those that were placed",
                                     loop.margins.unstable_poles))
        .hint("slower or better damped poles, or PID where it was PI or PD")
        .with("unstable poles", static_cast<double>(loop.margins.unstable_poles));
  }
  FLYBALL_TRY_IN(where, const auto open, series(loop.controller, plant));
  FLYBALL_TRY_IN(where, const auto late, classical::DelaySystem::create(open));
  FLYBALL_TRY_IN(where, const auto closed, classical::feedback(late));
  FLYBALL_TRY_IN(where, const auto poles, classical::rightmost_poles(closed));
  for (const Complex& pole : poles.poles) {
    const double rate =
        plant.period() ? std::log(std::abs(pole)) / plant.period()->si() : pole.real();
    if (rate > points[0].real() * (1.0 - 1e-6)) {
      return refusal(PidDesignError::not_dominant, where, "the poles")
          .got(flyball::detail::format("not dominant: one at {} {} {}j is slower", pole.real(),
                                       pole.imag() < 0.0 ? "-" : "+", std::abs(pole.imag())))
          .hint("slower poles, or PID where it was PI or PD")
          .with("pole", std::vector<double>{pole.real(), pole.imag()});
    }
  }
  return loop;
}

}  // namespace flyball
