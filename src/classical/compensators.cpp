#include <flyball/classical/compensators.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <flyball/math/search/roots.hpp>

#include "classical/whole_periods.hpp"
#include "core/constants.hpp"
#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXd;

double degrees(double radians) {
  return radians * 180.0 / pi;
}

/// (T s + 1)/(T' s + 1).
struct Section {
  double zero_time = 0.0;
  double pole_time = 0.0;

  [[nodiscard]] Complex at(Complex s) const {
    return (zero_time * s + 1.0) / (pole_time * s + 1.0);
  }
};

/// A point of the plane at which C is to have a value; of a discrete plant the point's w.
struct Target {
  Complex s;
  Complex value;
};

/// w = (2/T)(z - 1)/(z + 1) of z = e^{sT}; s itself of a continuous plant.
Complex in_plane(Complex s, const std::optional<Time>& period) {
  return period ? 2.0 / period->si() * std::tanh(0.5 * s * period->si()) : s;
}

Expected<void> check_frequency(double frequency, const TransferFunction& plant,
                               std::string_view where, std::string_view name) {
  FLYBALL_CHECK(check_positive(frequency, where, name, "rad/s"));
  if (plant.period() && frequency >= pi / plant.period()->si()) {
    return refusal(ArgumentError::out_of_range, where, name)
        .got(format_number(frequency) + " rad/s")
        .expected(flyball::detail::format("below the Nyquist frequency, {} rad/s",
                                          format_number(pi / plant.period()->si())));
  }
  return {};
}

Expected<Complex> inverse_of(Complex P, std::string_view where) {
  if (!(std::abs(P) > 0.0) || !std::isfinite(std::abs(P))) {
    return refusal(CompensatorError::gain_not_reached, where, "the plant there")
        .got(P == 0.0 ? "zero" : "infinite")
        .hint("choose another frequency");
  }
  return 1.0 / P;
}

Expected<Target> target_of(const TransferFunction& plant, const CrossoverGoal& goal,
                           std::string_view where) {
  FLYBALL_CHECK(check_frequency(goal.crossover, plant, where, "the crossover"));
  FLYBALL_CHECK(check_within(goal.phase_margin, 0.0, 180.0, where, "the phase margin", "deg"));
  FLYBALL_TRY(const Complex inverse, inverse_of(plant.response(goal.crossover), where));
  return Target{in_plane({0.0, goal.crossover}, plant.period()),
                std::polar(1.0, goal.phase_margin * pi / 180.0 - pi) * inverse};
}

Expected<Target> target_of(const TransferFunction& plant, const PoleGoal& goal,
                           std::string_view where) {
  FLYBALL_CHECK(Checks(where)
                    .positive(goal.natural_frequency, "the natural frequency", "rad/s")
                    .also([&]() -> Expected<void> {
                      if (goal.damping_ratio > 0.0 && goal.damping_ratio < 1.0) {
                        return {};
                      }
                      return refusal(ArgumentError::out_of_range, where, "the damping ratio")
                          .got(format_number(goal.damping_ratio))
                          .expected("between 0 and 1");
                    }));
  const double root = std::sqrt((1.0 - goal.damping_ratio) * (1.0 + goal.damping_ratio));
  FLYBALL_CHECK(
      check_frequency(goal.natural_frequency * root, plant, where, "the poles' frequency"));
  const Complex s(-goal.damping_ratio * goal.natural_frequency, goal.natural_frequency * root);
  FLYBALL_TRY(const Complex P, plant.at(plant.period() ? std::exp(s * plant.period()->si()) : s));
  FLYBALL_TRY(const Complex inverse, inverse_of(P, where));
  return Target{in_plane(s, plant.period()), -inverse};
}

Expected<Compensation> judged(const TransferFunction& plant, double gain,
                              const std::vector<Section>& sections, std::string_view where) {
  const auto& period = plant.period();
  FLYBALL_TRY(auto C,
              TransferFunction::create(VectorXd::Constant(1, gain), VectorXd::Ones(1), period));
  for (const Section& section : sections) {
    VectorXd num = Eigen::Vector2d(section.zero_time, 1.0);
    VectorXd den = Eigen::Vector2d(section.pole_time, 1.0);
    if (period) {
      const double half = 0.5 * period->si();
      for (VectorXd* p : {&num, &den}) {
        const double time = (*p)(0);
        *p = Eigen::Vector2d(half + time, half - time);
      }
    }
    FLYBALL_TRY(const auto factor, TransferFunction::create(num, den, period));
    FLYBALL_TRY(C, series(C, factor));
  }
  FLYBALL_TRY_IN(where, const auto L, series(C, plant));
  FLYBALL_TRY_IN(where, auto margins, loop_margins(L));
  if (!margins.stable) {
    return refusal(CompensatorError::unstable_loop, where, "the closed loop")
        .got(margins.unstable_poles == std::numeric_limits<int>::max()
                 ? std::string("unstable, of infinitely many poles right of the border")
                 : flyball::detail::format("unstable, of {} poles on or right of the border",
                                           margins.unstable_poles))
        .hint("what was asked for is met at that frequency alone: choose another")
        .with("unstable poles", static_cast<double>(margins.unstable_poles));
  }
  Compensation found{.compensator = C, .margins = std::move(margins), .poles = {}};
  if (period && plant.delay() > 0.0) {
    const auto late = detail::periods_in(plant.delay(), period);
    VectorXd den = VectorXd::Zero(L.den().size() + late);
    den.head(L.den().size()) = L.den();
    FLYBALL_TRY_IN(where, const auto whole, TransferFunction::create(L.num(), den, period));
    FLYBALL_TRY_IN(where, const auto closed, unity_feedback(whole));
    FLYBALL_TRY_IN(where, found.poles, closed.poles());
  } else if (plant.delay() == 0.0) {
    FLYBALL_TRY_IN(where, const auto closed, unity_feedback(L));
    FLYBALL_TRY_IN(where, found.poles, closed.poles());
  }
  return found;
}

/// With the gain open: zero and pole seen from the point under angles equally far from its
/// bisector, which needs the smallest ratio of the two. @param phase  rad, that it is to turn.
std::optional<Section> bisected(Complex s, double phase) {
  const double middle = 0.5 * std::arg(s);
  const double zero_angle = middle + 0.5 * phase;
  const double pole_angle = middle - 0.5 * phase;
  if (!(pole_angle > 1e-6) || !(zero_angle < pi - 1e-6)) {
    return std::nullopt;
  }
  const double zero = s.imag() / std::tan(zero_angle) - s.real();
  const double pole = s.imag() / std::tan(pole_angle) - s.real();
  if (!(zero > 0.0) || !(pole > 0.0)) {
    return std::nullopt;
  }
  return Section{1.0 / zero, 1.0 / pole};
}

/// (T s + 1)/(T' s + 1) = M: two real equations for the two times.
std::optional<Section> solved(Complex s, Complex M) {
  // s T - M s T' = M - 1.
  const Complex a = s;
  const Complex b = -M * s;
  const Complex c = M - 1.0;
  const double determinant = a.real() * b.imag() - a.imag() * b.real();
  if (std::abs(determinant) <= 1e-14 * std::norm(s) * std::abs(M)) {
    return std::nullopt;
  }
  return Section{(c.real() * b.imag() - c.imag() * b.real()) / determinant,
                 (a.real() * c.imag() - a.imag() * c.real()) / determinant};
}

Expected<void> check_gain(const std::optional<double>& gain, int stages, std::string_view where) {
  if (gain) {
    FLYBALL_CHECK(check_finite(*gain, where, "the gain"));
    if (*gain == 0.0) {
      return refusal(ArgumentError::not_positive, where, "the gain")
          .got("zero")
          .expected("different from zero");
    }
  }
  if (stages < 1 || stages > 4) {
    return refusal(ArgumentError::out_of_range, where, "the stages")
        .got(std::to_string(stages))
        .expected("from 1 to 4");
  }
  return {};
}

Refusal too_far(double phase, double most, std::optional<double> margin, std::string_view where) {
  auto error =
      refusal(CompensatorError::phase_not_reached, where, "the phase that it is to turn")
          .got(flyball::detail::format("{} deg", format_number(degrees(phase))))
          .expected(flyball::detail::format("between 0 and {} deg", format_number(degrees(most))))
          .hint(phase > 0.0 ? "more stages, a lower crossover or less margin"
                            : "there is more phase than wanted: a lag, or more margin")
          .with("phase", degrees(phase));
  return margin ? std::move(error).with("best phase margin", *margin - degrees(phase - most))
                : std::move(error);
}

/// @param margin  The wanted one, where it is one.
Expected<Compensation> lead(const TransferFunction& plant, const Target& target,
                            const std::optional<double>& gain, int stages,
                            std::optional<double> margin, std::string_view where) {
  FLYBALL_CHECK(check_gain(gain, stages, where));
  const double n = stages;
  // Of the sign that leaves less to turn, or of the gain's.
  Complex value = target.value;
  double sign = 1.0;
  if (gain ? *gain < 0.0 : value.real() < 0.0 && std::arg(-value) >= 0.0 && stages == 1) {
    sign = -1.0;
    value = -value;
  }
  const double phase = std::arg(value);
  const double most = n * (pi - std::arg(target.s));
  if (!(phase > 0.0) || !(phase < most * (1.0 - 1e-3))) {
    return too_far(phase, most, phase > 0.0 ? margin : std::nullopt, where);
  }
  std::optional<Section> section;
  double K = 0.0;
  if (gain) {
    K = std::abs(*gain);
    const Complex M = std::polar(std::pow(std::abs(value) / K, 1.0 / n), phase / n);
    section = solved(target.s, M);
    if (!section || !(section->zero_time > section->pole_time) || !(section->pole_time > 0.0)) {
      return refusal(CompensatorError::gain_not_reached, where, "the gain at rest")
          .got(format_number(*gain))
          .expected(flyball::detail::format(
              "smaller: a lead has more gain at the frequency than at rest, here {} in all",
              format_number(std::abs(value))))
          .hint("a higher crossover, or a lead-lag compensator")
          .with("gain there", std::abs(value));
    }
  } else {
    section = bisected(target.s, phase / n);
    if (!section) {
      return too_far(phase, most, margin, where);
    }
    K = std::abs(value) / std::pow(std::abs(section->at(target.s)), n);
  }
  return judged(plant, sign * K, std::vector<Section>(static_cast<std::size_t>(stages), *section),
                where);
}

}  // namespace

ErrorInfo error_info(CompensatorError code) {
  static constexpr flyball::detail::ErrorRow rows[] = {
      {"phase_not_reached", "the compensator cannot turn the phase so", ErrorKind::no_answer},
      {"gain_not_reached", "no pole and zero have these gains", ErrorKind::no_answer},
      {"unstable_loop", "the loop is not stable", ErrorKind::no_answer},
  };
  return flyball::detail::info_of(code, "compensator", rows);
}

Expected<double> gain_for_error_constant(const TransferFunction& plant, double constant) {
  constexpr std::string_view where = "gain_for_error_constant";
  FLYBALL_CHECK(check_positive(std::abs(constant), where, "the error constant"));
  // Integrators: roots of the denominator at s = 0 or z = 1, taken out one by one.
  VectorXd den = plant.den();
  VectorXd num = plant.num();
  const auto& period = plant.period();
  const auto vanishes = [&](const VectorXd& p) {
    return period ? std::abs(p.sum()) <= 1e-12 * p.cwiseAbs().sum() : p(p.size() - 1) == 0.0;
  };
  const auto divide = [&](VectorXd& p) {
    if (period) {  // by (z - 1)/T
      for (Index i = 1; i < p.size(); ++i) {
        p(i) += p(i - 1);
      }
      p = VectorXd(p.head(p.size() - 1) * period->si());
    } else {
      p = VectorXd(p.head(p.size() - 1));
    }
  };
  while (den.size() > 1 && vanishes(den)) {
    divide(den);
  }
  if (vanishes(num)) {
    return refusal(TransferError::at_a_pole, where, "the plant")
        .got("without gain at rest: it has a zero at the origin, or is zero")
        .expected("of some gain there");
  }
  const double rest = period ? num.sum() / den.sum() : num(num.size() - 1) / den(den.size() - 1);
  return constant / rest;
}

Expected<Compensation> lead_compensator(const TransferFunction& plant, const CrossoverGoal& goal) {
  constexpr std::string_view where = "lead_compensator";
  FLYBALL_TRY(const Target target, target_of(plant, goal, where));
  return lead(plant, target, goal.gain, goal.stages, goal.phase_margin, where);
}

Expected<Compensation> lead_compensator(const TransferFunction& plant, const PoleGoal& goal) {
  constexpr std::string_view where = "lead_compensator";
  FLYBALL_TRY(const Target target, target_of(plant, goal, where));
  return lead(plant, target, goal.gain, goal.stages, std::nullopt, where);
}

Expected<Compensation> lag_compensator(const TransferFunction& plant, const CrossoverGoal& goal) {
  constexpr std::string_view where = "lag_compensator";
  FLYBALL_TRY(const Target target, target_of(plant, goal, where));
  FLYBALL_CHECK(check_gain(goal.gain, 1, where));
  if (!goal.gain) {
    return refusal(ArgumentError::empty, where, "the gain at rest")
        .got("not given")
        .expected("what the error at rest asks for: it is what a lag is for");
  }
  const Complex M = target.value / *goal.gain;
  const double phase = std::arg(M);
  if (!(phase < 0.0) || !(phase > -0.5 * pi)) {
    return refusal(CompensatorError::phase_not_reached, where, "the phase that it is to turn")
        .got(flyball::detail::format("{} deg", format_number(degrees(phase))))
        .expected("between -90 and 0 deg")
        .hint(phase > 0.0 ? "a lower crossover, less margin, or a lead-lag compensator"
                          : "a higher crossover, or more margin")
        .with("phase", degrees(phase));
  }
  const auto section = solved(target.s, M);
  if (!section || !(section->pole_time > section->zero_time) || !(section->zero_time > 0.0)) {
    return refusal(CompensatorError::gain_not_reached, where, "the gain at rest")
        .got(format_number(*goal.gain))
        .expected(flyball::detail::format(
            "larger: a lag that turns {} deg has at most {} of it at the crossover, and {} is "
            "needed there",
            format_number(degrees(phase)), format_number(std::cos(phase)),
            format_number(std::abs(target.value))))
        .with("gain there", std::abs(target.value));
  }
  return judged(plant, *goal.gain, {*section}, where);
}

Expected<Compensation> lead_lag_compensator(const TransferFunction& plant,
                                            const CrossoverGoal& goal) {
  constexpr std::string_view where = "lead_lag_compensator";
  FLYBALL_TRY(const Target target, target_of(plant, goal, where));
  FLYBALL_CHECK(check_gain(goal.gain, 1, where));
  if (!goal.gain) {
    return refusal(ArgumentError::empty, where, "the gain at rest")
        .got("not given")
        .expected("what the error at rest asks for: it is what the lag is for");
  }
  const double w = target.s.imag();
  const Complex M = target.value / *goal.gain;
  const double phase = std::arg(M);
  const double tau = 10.0 / w;
  const auto lag = [&](double log_ratio) { return Section{tau, tau * std::exp(log_ratio)}; };
  const auto turned = [&](double log_ratio) {
    return phase - std::arg(lag(log_ratio).at(target.s));
  };
  constexpr double widest = 0.5 * pi * (1.0 - 1e-3);
  if (!(turned(0.0) > -0.1) || !(turned(0.0) < widest)) {
    return too_far(phase, widest, phase > 0.0 ? std::optional(goal.phase_margin) : std::nullopt,
                   where);
  }
  // The lead's gain at the crossover is tan(π/4 + φ/2); with the lag's, and K, it is to be |M| K.
  const auto excess = [&](double log_ratio) {
    const double lead_phase = std::min(turned(log_ratio), widest);
    return std::log(std::tan(0.25 * pi + 0.5 * lead_phase)) +
           std::log(std::abs(lag(log_ratio).at(target.s))) - std::log(std::abs(M));
  };
  constexpr double most = 14.0;  // A million.
  if (!(excess(most) < 0.0)) {
    return refusal(CompensatorError::gain_not_reached, where, "the gain at rest")
        .got(format_number(*goal.gain))
        .expected("less than a million times what a lead alone has")
        .with("gain there", std::abs(target.value));
  }
  if (!(excess(0.0) > 0.0)) {
    return refusal(CompensatorError::gain_not_reached, where, "the gain at rest")
        .got(format_number(*goal.gain))
        .expected("above " + format_number(std::abs(*goal.gain) * std::exp(-excess(0.0))) +
                  ", which a lead alone has")
        .hint("a lead compensator");
  }
  const auto root = find_root(excess, 0.0, most);
  if (!root || !(turned(root->x) > 0.0) || !(turned(root->x) < widest)) {
    return too_far(root ? turned(root->x) : phase, widest, std::nullopt, where);
  }
  const auto section = bisected(target.s, turned(root->x));
  if (!section) {
    return too_far(turned(root->x), widest, std::nullopt, where);
  }
  return judged(plant, *goal.gain, {*section, lag(root->x)}, where);
}

Expected<TransferFunction> notch_compensator(double frequency, double depth, double width,
                                             std::optional<Time> period) {
  constexpr std::string_view where = "notch_compensator";
  FLYBALL_CHECK(Checks(where)
                    .positive(frequency, "the frequency", "rad/s")
                    .within(depth, 0.0, 1.0, "the depth")
                    .positive(width, "the width"));
  if (!period) {
    return TransferFunction::create(
        Eigen::Vector3d(1.0, depth * width * frequency, frequency * frequency),
        Eigen::Vector3d(1.0, width * frequency, frequency * frequency));
  }
  FLYBALL_CHECK(check_positive(period->si(), where, "period", "s"));
  const double angle = frequency * period->si();
  if (angle >= pi) {
    return refusal(ArgumentError::out_of_range, where, "the frequency")
        .got(format_number(frequency) + " rad/s")
        .expected(flyball::detail::format("below the Nyquist frequency, {} rad/s",
                                          format_number(pi / period->si())));
  }
  // s/ω = (z - 1)/(z + 1)/t with t = tan(ωT/2): a = t², the middle ones by the widths.
  const double t = std::tan(0.5 * angle);
  const auto image = [&](double damping) {
    return VectorXd(
        Eigen::Vector3d(1.0 + damping * t + t * t, 2.0 * (t * t - 1.0), 1.0 - damping * t + t * t));
  };
  return TransferFunction::create(image(depth * width), image(width), period);
}

}  // namespace flyball::classical
