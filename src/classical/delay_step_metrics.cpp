// Step metrics of systems with dead time anywhere.
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>
#include <utility>

#include <flyball/classical/delay_poles.hpp>
#include <flyball/classical/step_metrics.hpp>
#include <flyball/systems/analysis.hpp>

#include "classical/delay_motion.hpp"
#include "classical/step_judge.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

namespace {

using detail::Judge;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double rounding = 1e-10;
constexpr double most_step_states = 200.0;

/// A polynomial by Legendre's coefficients, over [-1, 1].
struct Piece {
  VectorXd modes;
  [[nodiscard]] double operator()(double place) const { return detail::legendre_sum(modes, place); }
  /// Nothing of it is further from the mean: |P_k| ≤ 1.
  [[nodiscard]] double reach() const { return modes.tail(modes.size() - 1).lpNorm<1>(); }
};

/// Where a function changes its sign between two places, by halving.
template <class F>
double crossing(const F& f, double low, double high) {
  const bool rises = f(high) > f(low);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    ((f(middle) > 0.0) == rises ? high : low) = middle;
  }
  return 0.5 * (low + high);
}

/// Judges the outputs as they come.
class JudgedPieces : public detail::OutputPieces {
 public:
  JudgedPieces(Index output, double final_value, double band)
      : output_(output), final_value_(final_value), judge_(band, rounding) {}

  void add(double begin, double length, const MatrixXd& modes) override {
    const Piece y{modes.col(output_) / (final_value_ == 0.0 ? 1.0 : final_value_)};
    if (is_no_news(y, begin + length)) {
      return;
    }
    const Piece slope{detail::legendre_derivative(y.modes)};
    // A polynomial that is resolved turns between neighbours of these places once at most.
    constexpr int parts = 24;
    double from = -1.0;
    double slope_from = slope(from);
    for (int i = 1; i <= parts; ++i) {
      const double to = -1.0 + 2.0 * i / parts;
      const double slope_to = slope(to);
      if ((slope_from > 0.0) != (slope_to > 0.0)) {
        const double top = crossing(slope, from, to);
        monotone(y, from, top, begin, length);
        monotone(y, top, to, begin, length);
      } else {
        monotone(y, from, to, begin, length);
      }
      from = to;
      slope_from = slope_to;
    }
  }
  [[nodiscard]] const Judge& judge() const { return judge_; }

 private:
  /// Whether a piece sets no record, reaches no level and stays within the band or outside: most
  /// do.
  bool is_no_news(const Piece& y, double end) {
    const double low = y.modes(0) - y.reach();
    const double high = y.modes(0) + y.reach();
    if (!judge_.holds(low, high)) {
      return false;
    }
    if (final_value_ == 0.0) {
      return true;
    }
    if ((judge_.waits_for(0.1) && high >= 0.1) || (judge_.waits_for(0.9) && high >= 0.9)) {
      return false;
    }
    const double band = judge_.band();
    if (low > 1.0 + band || high < 1.0 - band) {
      judge_.outside_until(end);
      return true;
    }
    return low >= 1.0 - band && high <= 1.0 + band;
  }

  void monotone(const Piece& y, double from, double to, double begin, double length) {
    const auto time = [&](double place) { return begin + 0.5 * (place + 1.0) * length; };
    const double y0 = y(from);
    const double y1 = y(to);
    judge_.point(time(from), y0);
    judge_.point(time(to), y1);
    if (final_value_ == 0.0) {
      return;
    }
    const auto place_of = [&](double level) {
      return time(crossing([&](double place) { return y(place) - level; }, from, to));
    };
    for (const double level : {0.1, 0.9}) {
      if (judge_.waits_for(level) && std::max(y0, y1) >= level) {
        judge_.reaches(level, y0 >= level ? time(from) : place_of(level));
      }
    }
    const double band = judge_.band();
    if (std::abs(y0 - 1.0) > band && std::abs(y1 - 1.0) <= band) {
      judge_.outside_until(place_of(y0 > 1.0 ? 1.0 + band : 1.0 - band));
    } else if (std::abs(y1 - 1.0) > band) {
      judge_.outside_until(time(to));
    }
  }

  Index output_;
  double final_value_;
  Judge judge_;
};

/// What is left where the poles at zero are none of a transfer function.
struct WithoutOrigin {
  double rate = 0.0;   ///< Of the slowest other pole, s⁻¹.
  double value = 0.0;  ///< G(0)
};

/// The mean of G on a circle around zero, which is G(0) where nothing else is within; nothing where
/// there is a pole within: then ∮ G sᵏ⁻¹ ds does not vanish for all k.
std::optional<double> value_within(const DelaySystem& system, double radius, double noise,
                                   Index output, Index input) {
  using Complex = std::complex<double>;
  constexpr int points = 64;
  std::array<Complex, 9> moments{};
  double largest = 0.0;
  for (int i = 0; i < points; ++i) {
    const Complex place = std::polar(1.0, 2.0 * pi * (i + 0.5) / points);
    const auto G = system.at(radius * place);
    if (!G) {
      return std::nullopt;
    }
    Complex term = (*G)(output, input) / static_cast<double>(points);
    largest = std::max(largest, std::abs((*G)(output, input)));
    for (Complex& moment : moments) {
      moment += term;
      term *= place;
    }
  }
  const bool clean = std::all_of(moments.begin() + 1, moments.end(), [&](const Complex& moment) {
    return std::abs(moment) <= noise * largest;
  });
  return clean ? std::optional(moments[0].real()) : std::nullopt;
}

/// Of a hold, (1 - e^{-Ts})/s, whose integrator is emptied again, alone, in series and in loops.
std::optional<WithoutOrigin> without_origin(const DelaySystem& system, const DelayPoles& found,
                                            Index output, Index input) {
  const double late = system.has_delay() ? system.delays().sum() : 0.0;
  if (system.period() || !(late > 0.0) || !(found.high_frequency_abscissa < 0.0) ||
      found.poles.size() == 0) {
    return std::nullopt;
  }
  constexpr double at_zero = 1e-3;
  // The delays turn by a radian at most; the next pole may be nearer.
  double radius = 1.0 / late;
  std::optional<double> value;
  for (int tries = 0; tries < 12 && !value; ++tries, radius *= 0.25) {
    const auto count = static_cast<int>((found.poles.array().abs() <= at_zero * radius).count());
    if (count == 0 || found.unstable > count) {
      return std::nullopt;
    }
    // What cancels at a pole of order k leaves rounding (r τ)⁻ᵏ times as large.
    const double noise = 1e-14 * std::pow(1.0 / (radius * late), count);
    if (!(noise < 1e-8)) {
      return std::nullopt;
    }
    value = value_within(system, radius, noise, output, input);
    if (value) {
      break;
    }
  }
  if (!value) {
    return std::nullopt;
  }
  // The other poles of a loop need not be listed; e⁻³⁶ is far more than Padé is off.
  const auto rational = system.pade(5);
  const auto modes = rational ? analyze_modes(*rational) : tl::unexpected(rational.error());
  if (!modes) {
    return std::nullopt;
  }
  WithoutOrigin rest{HUGE_VAL, *value};
  for (const Mode& mode : modes->modes) {
    if (std::abs(mode.s) > at_zero * radius) {
      rest.rate = std::min(rest.rate, -mode.s.real());
    }
  }
  return rest.rate > 0.0 ? std::optional(rest) : std::nullopt;
}

/// The samples are the solution.
Expected<StepMetrics> of_samples(const DelaySystem& system, Index output, Index input, double end,
                                 double final_value, double band) {
  const double T = system.period()->si();
  const auto samples = static_cast<Index>(std::min(5e5, std::ceil(end / T) + 2.0));
  FLYBALL_TRY(const auto response, step_response(system, input, ResponseTimes{Time(T), samples}));
  Judge judge(band, rounding);
  for (Index k = 0; k < samples; ++k) {
    const double y = response.y(k, output) / (final_value == 0.0 ? 1.0 : final_value);
    judge.point(response.time(k), y);
    for (const double level : {0.1, 0.9}) {
      if (y >= level && judge.waits_for(level)) {
        judge.reaches(level, response.time(k));
      }
    }
    if (std::abs(y - 1.0) > band) {
      judge.outside_until(response.time(k) + T);
    }
  }
  if (final_value == 0.0) {
    return judge.of_zero(0.0);
  }
  StepMetrics metrics = judge.metrics(final_value, 0.0);
  if (static_cast<double>(samples) * T < end) {
    metrics.settling_time.reset();
  }
  return metrics;
}

}  // namespace

Expected<StepMetrics> step_metrics(const DelaySystem& system, Index output, Index input,
                                   double band) {
  constexpr std::string_view where = "step_metrics";
  FLYBALL_CHECK(Checks(where)
                    .within(static_cast<double>(output), 0.0,
                            static_cast<double>(system.outputs() - 1), "output")
                    .within(static_cast<double>(input), 0.0,
                            static_cast<double>(system.inputs() - 1), "input")
                    .within(static_cast<double>(system.states()), 0.0, most_step_states,
                            "the number of states"));
  if (!(band > 0.0 && band < 1.0)) {
    return refusal(ArgumentError::out_of_range, where, "band")
        .got(format_number(band))
        .expected("a share between 0 and 1, such as 0.02");
  }
  FLYBALL_TRY(const DelayPoles found, rightmost_poles(system));
  const auto held = without_origin(system, found, output, input);
  const double final_value = held ? held->value : system.dc_gain()(output, input);
  if (!found.stable && !held) {
    return StepMetrics{.final_value = std::isfinite(final_value)
                                          ? std::numeric_limits<double>::quiet_NaN()
                                          : final_value};
  }
  constexpr double time_constants = 36.0;  // e⁻³⁶ is rounding
  const double late = system.has_delay() ? system.delays().sum() : 0.0;
  if (system.period()) {
    const double slowest = found.poles.size() > 0 ? found.poles.cwiseAbs().maxCoeff() : 0.0;
    const double periods = time_constants / -std::log(std::clamp(slowest, 1e-16, 1.0 - 1e-7)) +
                           static_cast<double>(system.states());
    return of_samples(system, output, input, periods * system.period()->si() + late, final_value,
                      band);
  }
  double rate = -found.high_frequency_abscissa;
  for (const auto& pole : found.poles) {
    rate = std::min(rate, -pole.real());
  }
  if (held) {
    rate = held->rate;
  }
  const double moving = std::isfinite(rate) ? time_constants / rate : 0.0;
  const double end = 1.01 * (moving + late) + (moving + late == 0.0 ? 1.0 : 0.0);
  MatrixXd u = MatrixXd::Zero(2, system.inputs());
  u.col(input).setOnes();
  JudgedPieces pieces(output, final_value, band);
  FLYBALL_CHECK(detail::Motion(system, detail::Drive{u}, end, 2, &pieces)
                    .run(VectorXd::Zero(system.states())));
  return final_value == 0.0 ? pieces.judge().of_zero(0.0)
                            : pieces.judge().metrics(final_value, 0.0);
}

}  // namespace flyball::classical
