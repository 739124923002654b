#include <flyball/classical/step_metrics.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <flyball/math/exponential/matrix_exponential.hpp>

#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball::classical {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// y(t) = final + C e^{At} x(0), walked along in steps, exact at their ends.
class Transient {
 public:
  Transient(const ContinuousSystem<>& system, const VectorXd& start, double final_value)
      : A_(system.A), C_(system.C), x_(start), final_(final_value) {}

  [[nodiscard]] double value() const { return final_ + (C_ * x_)(0); }
  [[nodiscard]] double time() const { return time_; }
  [[nodiscard]] const VectorXd& state() const { return x_; }

  /// @param propagator  e^{A step}.
  void advance(const MatrixXd& propagator, double step) {
    x_ = propagator * x_;
    time_ += step;
  }

  /// y and dy/dt a little after a state, by the exponential's series: ‖A h‖ is below one.
  [[nodiscard]] std::pair<double, double> after(const VectorXd& x, double h) const {
    VectorXd term = x;
    VectorXd sum = x;
    for (int k = 1; k <= 40; ++k) {
      term = (A_ * term * (h / k)).eval();
      sum += term;
      if (term.cwiseAbs().maxCoeff() <= 1e-18 * sum.cwiseAbs().maxCoeff()) {
        break;
      }
    }
    return {final_ + (C_ * sum)(0), (C_ * (A_ * sum))(0)};
  }

 private:
  const MatrixXd& A_;
  const MatrixXd& C_;
  VectorXd x_;
  double final_;
  double time_ = 0.0;
};

/// Where a function changes its sign in [0, h], by halving and secants.
template <class F>
double crossing(const F& f, double h) {
  double low = 0.0;
  double high = h;
  double at_low = f(low);
  double at_high = f(high);
  for (int i = 0; i < 200 && high - low > 1e-15 * h; ++i) {
    double middle = 0.5 * (low + high);
    if (i % 3 != 2 && at_high != at_low) {
      const double secant = low - at_low * (high - low) / (at_high - at_low);
      middle = secant > low && secant < high ? secant : middle;
    }
    const double value = f(middle);
    if (value == 0.0) {
      return middle;
    }
    ((value > 0.0) == (at_low > 0.0) ? low : high) = middle;
    ((value > 0.0) == (at_low > 0.0) ? at_low : at_high) = value;
  }
  return 0.5 * (low + high);
}

/// The metrics as points and crossings come in, of y in the final value's direction and unit.
class Judge {
 public:
  explicit Judge(double band) : band_(band) {}

  void point(double time, double y) {
    if (y > peak_) {
      peak_ = y;
      peak_time_ = time;
    }
    least_ = std::min(least_, y);
  }
  void reaches(double level, double time) {
    std::optional<double>& first = level == 0.1 ? ten_ : ninety_;
    first = first ? first : std::optional(time);
  }
  void outside_until(double time) { settled_ = time; }
  [[nodiscard]] bool waits_for(double level) const { return !(level == 0.1 ? ten_ : ninety_); }
  [[nodiscard]] double band() const { return band_; }

  [[nodiscard]] StepMetrics metrics(double final_value, double delay) const {
    StepMetrics m{.final_value = final_value};
    if (ten_ && ninety_) {
      m.rise_time = *ninety_ - *ten_;
    }
    m.settling_time = settled_ + (settled_ > 0.0 || delay > 0.0 ? delay : 0.0);
    const bool beyond = peak_ > 1.0 + 1e-12;
    m.overshoot = beyond ? peak_ - 1.0 : 0.0;
    m.undershoot = least_ < -1e-14 ? -least_ : 0.0;
    m.peak = beyond ? peak_ * final_value : final_value;
    if (beyond) {
      m.peak_time = peak_time_ + delay;
    }
    return m;
  }

 private:
  double band_;
  double peak_ = -std::numeric_limits<double>::infinity();
  double peak_time_ = 0.0;
  double least_ = 0.0;
  std::optional<double> ten_{};
  std::optional<double> ninety_{};
  double settled_ = 0.0;
};

StepMetrics sampled(const TransferFunction& transfer, double final_value, double band,
                    double slowest) {
  const ContinuousSystem<> s = transfer.to_state_space();
  const double T = transfer.period()->si();
  VectorXd x = VectorXd::Zero(s.A.rows());
  Judge judge(band);
  const double periods = std::log(1e-14) / std::log(std::clamp(slowest, 1e-16, 1.0 - 1e-7));
  const auto steps =
      static_cast<long>(std::min(2e6, 10.0 + 1.2 * periods + 2.0 * static_cast<double>(x.size())));
  for (long k = 0; k <= steps; ++k) {
    const double y = ((s.C * x)(0) + s.D(0, 0)) / final_value;
    const double t = static_cast<double>(k) * T;
    judge.point(t, y);
    for (const double level : {0.1, 0.9}) {
      if (y >= level) {
        judge.reaches(level, t);
      }
    }
    if (std::abs(y - 1.0) > band) {
      judge.outside_until(t + T);
    }
    x = (s.A * x + s.B).eval();
  }
  return judge.metrics(final_value, transfer.delay());
}

}  // namespace

Expected<StepMetrics> step_metrics(const TransferFunction& transfer, double band) {
  constexpr std::string_view where = "step_metrics";
  if (!(band > 0.0 && band < 1.0)) {
    return refusal(ArgumentError::out_of_range, where, "band")
        .got(format_number(band))
        .expected("a share between 0 and 1, such as 0.02");
  }
  FLYBALL_TRY(const auto poles, transfer.poles());
  const bool discrete = transfer.period().has_value();
  const bool stable = discrete ? is_stable_discrete(poles) : is_stable_continuous(poles);
  const double dc = transfer.dc_gain();
  if (!stable) {
    return StepMetrics{.final_value = std::isfinite(dc) ? nan : dc};
  }
  if (dc == 0.0) {
    return StepMetrics{};
  }
  if (discrete) {
    double slowest = 0.0;
    for (const Complex& pole : poles) {
      slowest = std::max(slowest, std::abs(pole));
    }
    return sampled(transfer, dc, band, slowest);
  }
  const ContinuousSystem<> s = transfer.to_state_space();
  const double delay = transfer.delay();
  Judge judge(band);
  if (s.A.rows() == 0) {
    judge.point(0.0, 1.0);
    judge.reaches(0.1, 0.0);
    judge.reaches(0.9, 0.0);
    return judge.metrics(dc, delay);
  }
  // x(0) = A⁻¹ B: the way from rest to the final state, from which y departs by C e^{At} x(0).
  const VectorXd start = flyball::detail::solve_linear(s.A, s.B);
  Transient way(s, start, dc);
  double slowest = std::numeric_limits<double>::infinity();
  for (const Complex& pole : poles) {
    slowest = std::min(slowest, -pole.real());
  }
  // Steps in which no mode that is still there turns by more than a tenth.
  std::vector<Complex> modes(poles.begin(), poles.end());
  const double end = 36.0 / slowest;
  const auto fastest_at = [&](double time) {
    double rate = 0.0;
    for (const Complex& pole : modes) {
      if (-pole.real() * time < 40.0 + 6.0 * static_cast<double>(modes.size())) {
        rate = std::max(rate, std::abs(pole));
      }
    }
    return rate;
  };
  double step = 0.0;
  MatrixXd propagator;
  long points = 0;
  judge.point(0.0, way.value() / dc);
  if (way.value() / dc >= 0.1) {
    judge.reaches(0.1, 0.0);
  }
  if (way.value() / dc >= 0.9) {
    judge.reaches(0.9, 0.0);
  }
  while (way.time() < end && points < 2'000'000) {
    const double rate = std::max(fastest_at(way.time()), slowest);
    const double wanted = std::min(0.1 / rate, 0.02 / slowest);
    if (!(wanted <= step && wanted > 0.5 * step)) {
      step = wanted;
      FLYBALL_TRY(propagator, expm(s.A * step));
    }
    const VectorXd from = way.state();
    const double begin = way.time();
    const double before = way.value() / dc;
    const double slope_before = way.after(from, 0.0).second / dc;
    way.advance(propagator, step);
    ++points;
    const double after = way.value() / dc;
    const double slope_after = way.after(way.state(), 0.0).second / dc;
    const auto y = [&](double h) { return way.after(from, h).first / dc; };
    // Parts between a top or bottom, in which y is monotone.
    std::vector<std::pair<double, double>> parts{{0.0, before}};
    if ((slope_before > 0.0) != (slope_after > 0.0)) {
      const double top = crossing([&](double h) { return way.after(from, h).second / dc; }, step);
      parts.emplace_back(top, y(top));
      judge.point(begin + top, parts.back().second);
    }
    parts.emplace_back(step, after);
    judge.point(begin + step, after);
    for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
      const auto [h0, y0] = parts[i];
      const auto [h1, y1] = parts[i + 1];
      const auto place = [&](double level) {
        return begin + h0 + crossing([&](double h) { return y(h0 + h) - level; }, h1 - h0);
      };
      for (const double level : {0.1, 0.9}) {
        if (judge.waits_for(level) && y0 < level && y1 >= level) {
          judge.reaches(level, place(level));
        }
      }
      for (const double level : {1.0 - band, 1.0 + band}) {
        if ((y0 - level) * (y1 - level) <= 0.0 && y0 != y1) {
          // Inwards or outwards; the last of them counts.
          judge.outside_until(std::abs(y1 - 1.0) > band ? begin + h1 : place(level));
        }
      }
      if (std::abs(y1 - 1.0) > band) {
        judge.outside_until(begin + h1);
      }
    }
  }
  return judge.metrics(dc, delay);
}

}  // namespace flyball::classical
