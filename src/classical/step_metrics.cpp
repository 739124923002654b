#include <flyball/classical/step_metrics.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/systems/system_error.hpp>

#include "classical/polynomial.hpp"
#include "classical/step_judge.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball::classical {

namespace {

using detail::Judge;

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

/// What poles of like size add to a step response: C e^{At} x(0), exact at the ends of steps.
class ResponsePart {
 public:
  /// @param transfer  Strictly proper and stable. @param fastest, slowest  |p| and -Re p.
  ResponsePart(const TransferFunction& transfer, double fastest, double slowest)
      : system_(transfer.to_state_space()),
        // From rest to the final state: A⁻¹B is what is still missing, turned round.
        x_(flyball::detail::solve_linear(system_.A, system_.B)),
        fastest_(fastest),
        slowest_(slowest) {}

  [[nodiscard]] double value() const { return system_.C.row(0).dot(x_); }
  [[nodiscard]] const VectorXd& state() const { return x_; }
  [[nodiscard]] double fastest() const { return fastest_; }
  /// Whether it is rounding of what it began with.
  [[nodiscard]] bool is_over(double time) const {
    return slowest_ * time > 40.0 + 6.0 * static_cast<double>(x_.size());
  }
  [[nodiscard]] Expected<void> set_step(double step) {
    FLYBALL_TRY(propagator_, expm(system_.A * step));
    return {};
  }
  void advance() {
    next_.noalias() = propagator_ * x_;
    x_.swap(next_);
  }
  void end() { x_.setZero(); }

  /// y and dy/dt a little after a state, by the exponential's series.
  [[nodiscard]] std::pair<double, double> after(const VectorXd& x, double h) const {
    term_ = x;
    sum_ = x;
    for (int k = 1; k <= 60; ++k) {
      next_.noalias() = system_.A * term_;
      next_ *= h / k;
      term_.swap(next_);
      sum_ += term_;
      if (term_.cwiseAbs().maxCoeff() <= 1e-18 * sum_.cwiseAbs().maxCoeff()) {
        break;
      }
    }
    next_.noalias() = system_.A * sum_;
    return {system_.C.row(0).dot(sum_), system_.C.row(0).dot(next_)};
  }

 private:
  ContinuousSystem<> system_;
  VectorXd x_;
  MatrixXd propagator_{};
  mutable VectorXd term_{};  ///< Scratch, as the two below.
  mutable VectorXd sum_{};
  mutable VectorXd next_{};
  double fastest_;
  double slowest_;
};

/// The strictly proper part of G as a sum of parts whose poles are of like size, so that fast ones
/// can be left out once they are over and slow ones are not lost beside them.
Expected<std::vector<ResponsePart>> parts_of(const TransferFunction& transfer,
                                             const Eigen::VectorXcd& poles) {
  using detail::Polynomial;
  constexpr double apart = 10.0;
  std::vector<Complex> sorted(poles.begin(), poles.end());
  std::sort(sorted.begin(), sorted.end(),
            [](const Complex& a, const Complex& b) { return std::abs(a) < std::abs(b); });
  std::vector<std::vector<Complex>> groups;
  for (const Complex& pole : sorted) {
    if (groups.empty() || std::abs(pole) > apart * std::abs(groups.back().back())) {
      groups.emplace_back();
    }
    groups.back().push_back(pole);
  }
  std::vector<Polynomial> dens;
  for (const auto& group : groups) {
    FLYBALL_TRY(const auto of_group,
                TransferFunction::from_zeros(Eigen::VectorXcd(0),
                                             Eigen::Map<const Eigen::VectorXcd>(
                                                 group.data(), static_cast<Index>(group.size())),
                                             1.0));
    dens.push_back(detail::polynomial(of_group.den()));
  }
  // Σ N_g Π_{h≠g} D_h = R: the unknown coefficients of all N_g, in 31 digits.
  const Index n = poles.size();
  VectorXd scaled = VectorXd::Zero(n + 1);
  scaled.tail(transfer.num().size()) = transfer.num();
  const Polynomial den = detail::polynomial(transfer.den());
  Polynomial rest = detail::polynomial(scaled);
  const double feedthrough = scaled(0) / transfer.den()(0);
  rest = detail::plus(rest, -1.0,
                      detail::times(detail::polynomial(VectorXd::Constant(1, feedthrough)), den));
  Polynomial matrix = Polynomial::zero(n, n);
  Polynomial right = Polynomial::zero(n, 1);
  right.hi = rest.hi.bottomRows(n) / transfer.den()(0);
  right.lo = rest.lo.bottomRows(n) / transfer.den()(0);
  Index column = 0;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    Polynomial others = detail::polynomial(VectorXd::Ones(1));
    for (std::size_t h = 0; h < groups.size(); ++h) {
      others = h == g ? others : detail::times(others, dens[h]);
    }
    for (std::size_t k = 0; k < groups[g].size(); ++k, ++column) {
      // s^{size - 1 - k} of N_g.
      const auto power = static_cast<Index>(groups[g].size() - 1 - k);
      const Index first = n - power - others.rows();
      matrix.hi.block(first, column, others.rows(), 1) = others.hi;
      matrix.lo.block(first, column, others.rows(), 1) = others.lo;
    }
  }
  const auto found = flyball::detail::solve(std::move(matrix), std::move(right));
  if (!found || !found->all_finite()) {
    return refusal(SystemError::no_convergence, "step_metrics", "the partial fractions")
        .got("not found")
        .hint("choose a unit of time in which the poles are nearer to 1");
  }
  const VectorXd nums = found->rounded();
  std::vector<ResponsePart> parts;
  column = 0;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto size = static_cast<Index>(groups[g].size());
    double slowest = std::numeric_limits<double>::infinity();
    for (const Complex& pole : groups[g]) {
      slowest = std::min(slowest, -pole.real());
    }
    FLYBALL_TRY(const auto of_group,
                TransferFunction::create(nums.segment(column, size), VectorXd(dens[g].rounded())));
    parts.emplace_back(of_group, std::abs(groups[g].back()), slowest);
    column += size;
  }
  return parts;
}

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

StepMetrics sampled(const TransferFunction& transfer, double final_value, double band,
                    double slowest) {
  const double unit = final_value == 0.0 ? 1.0 : final_value;
  const ContinuousSystem<> s = transfer.to_state_space();
  const double T = transfer.period()->si();
  VectorXd x = VectorXd::Zero(s.A.rows());
  Judge judge(band);
  const double periods = std::log(1e-14) / std::log(std::clamp(slowest, 1e-16, 1.0 - 1e-7));
  const auto steps =
      static_cast<long>(std::min(5e5, 10.0 + 1.2 * periods + 2.0 * static_cast<double>(x.size())));
  for (long k = 0; k <= steps; ++k) {
    const double y = (s.C.row(0).dot(x) + s.D(0, 0)) / unit;
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
  return final_value == 0.0 ? judge.of_zero(transfer.delay())
                            : judge.metrics(final_value, transfer.delay());
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
  FLYBALL_TRY(const bool stable, transfer.is_stable());
  const double dc = transfer.dc_gain();
  if (!stable || !std::isfinite(dc)) {
    return StepMetrics{.final_value = std::isfinite(dc) ? nan : dc};
  }
  if (transfer.is_zero()) {
    return StepMetrics{.peak = 0.0};
  }
  if (discrete) {
    double slowest = 0.0;
    for (const Complex& pole : poles) {
      slowest = std::max(slowest, std::abs(pole));
    }
    return sampled(transfer, dc, band, slowest);
  }
  const double delay = transfer.delay();
  Judge judge(band);
  if (transfer.order() == 0) {
    judge.point(0.0, 1.0);
    judge.reaches(0.1, 0.0);
    judge.reaches(0.9, 0.0);
    return judge.metrics(dc, delay);
  }
  FLYBALL_TRY(auto parts, parts_of(transfer, poles));
  double slowest = std::numeric_limits<double>::infinity();
  for (const Complex& pole : poles) {
    slowest = std::min(slowest, -pole.real());
  }
  const double end = 36.0 / slowest;
  // In units of the final value, or as it is where that is zero.
  const double unit = dc == 0.0 ? 1.0 : dc;
  const double rest = dc == 0.0 ? 0.0 : 1.0;
  const auto whole = [&] { return dc == 0.0 ? judge.of_zero(delay) : judge.metrics(dc, delay); };
  const auto now = [&] {
    double y = rest;
    for (const ResponsePart& part : parts) {
      y += part.value() / unit;
    }
    return y;
  };
  double before = now();
  judge.point(0.0, before);
  for (const double level : {0.1, 0.9}) {
    if (before >= level) {
      judge.reaches(level, 0.0);
    }
  }
  // Steps in which no part that is still there turns by more than a tenth.
  double step = 0.0;
  double time = 0.0;
  std::vector<bool> over(parts.size(), false);
  std::vector<VectorXd> from(parts.size());
  constexpr long most_points = 500'000;
  for (long point = 0; time < end; ++point) {
    if (point == most_points) {
      // What has stayed in the band for twelve of the slowest time constants does not leave it.
      StepMetrics metrics = whole();
      if (metrics.settling_time && slowest * (time - (*metrics.settling_time - delay)) < 12.0) {
        metrics.settling_time.reset();
      }
      return metrics;
    }
    double rate = slowest;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (!over[i] && parts[i].is_over(time)) {
        over[i] = true;
        parts[i].end();
        step = 0.0;
      }
      rate = over[i] ? rate : std::max(rate, parts[i].fastest());
    }
    if (step == 0.0) {
      step = std::min(0.1 / rate, 0.02 / slowest);
      for (std::size_t i = 0; i < parts.size(); ++i) {
        if (!over[i]) {
          FLYBALL_CHECK(parts[i].set_step(step));
        }
      }
    }
    for (std::size_t i = 0; i < parts.size(); ++i) {
      from[i] = parts[i].state();
    }
    const auto at = [&](double h) {
      std::pair<double, double> y{rest, 0.0};
      for (std::size_t i = 0; i < parts.size(); ++i) {
        if (!over[i]) {
          const auto [value, slope] = parts[i].after(from[i], h);
          y.first += value / unit;
          y.second += slope / unit;
        }
      }
      return y;
    };
    const double slope_before = at(0.0).second;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (!over[i]) {
        parts[i].advance();
      }
    }
    const double after = now();
    const double slope_after = at(step).second;
    // Pieces between a top or bottom, in which y is monotone.
    std::array<std::pair<double, double>, 3> pieces{{{0.0, before}}};
    std::size_t last = 0;
    if ((slope_before > 0.0) != (slope_after > 0.0)) {
      const double top = crossing([&](double h) { return at(h).second; }, step);
      pieces[++last] = {top, at(top).first};
      judge.point(time + top, pieces[last].second);
    }
    pieces[++last] = {step, after};
    judge.point(time + step, after);
    for (std::size_t i = 0; i < last; ++i) {
      if (dc == 0.0) {
        break;  // Nothing rises to it, and no band is a share of it.
      }
      const auto [h0, y0] = pieces[i];
      const auto [h1, y1] = pieces[i + 1];
      const auto place = [&](double level) {
        return time + h0 + crossing([&](double h) { return at(h0 + h).first - level; }, h1 - h0);
      };
      for (const double level : {0.1, 0.9}) {
        if (judge.waits_for(level) && y0 < level && y1 >= level) {
          judge.reaches(level, place(level));
        }
      }
      for (const double level : {1.0 - band, 1.0 + band}) {
        if ((y0 - level) * (y1 - level) <= 0.0 && y0 != y1) {
          // Inwards or outwards; the last of them counts.
          judge.outside_until(std::abs(y1 - 1.0) > band ? time + h1 : place(level));
        }
      }
      if (std::abs(y1 - 1.0) > band) {
        judge.outside_until(time + h1);
      }
    }
    before = after;
    time += step;
  }
  return whole();
}

}  // namespace flyball::classical
