#include <flyball/classical/frequency_data.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <flyball/math/search/minimum.hpp>
#include <flyball/math/search/roots.hpp>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

/// One entry over ln ω: ln G at the frequencies, unwrapped, and its slopes there.
class LogCurve {
 public:
  LogCurve(const VectorXd& frequency, const VectorXcd& values) : w_(frequency), G_(values) {
    const Index n = w_.size();
    log_.resize(n);
    slope_ = VectorXcd::Zero(n);
    for (Index k = 0; k < n; ++k) {
      log_(k) = G_(k) == 0.0 ? Complex(nan, nan) : std::log(G_(k));
      if (k > 0 && straight(k)) {
        continue;
      }
      if (k > 0) {
        log_(k).imag(log_(k - 1).imag() +
                     std::remainder(log_(k).imag() - log_(k - 1).imag(), 2.0 * pi));
      }
    }
    // That of the parabola through three neighbours, or what there is of them.
    for (Index k = 0; k < n; ++k) {
      const bool before = k > 0 && !straight(k);
      const bool after = k + 1 < n && !straight(k + 1);
      const Complex left = before ? secant(k) : Complex(0.0);
      const Complex right = after ? secant(k + 1) : Complex(0.0);
      if (before && after) {
        const double h_left = t(k) - t(k - 1);
        const double h_right = t(k + 1) - t(k);
        slope_(k) = (h_right * left + h_left * right) / (h_left + h_right);
      } else {
        slope_(k) = before ? left : right;
      }
    }
  }

  /// Whether ln G cannot be interpolated between a frequency and the one before it.
  [[nodiscard]] bool straight(Index k) const {
    return w_(k - 1) == 0.0 || G_(k) == 0.0 || G_(k - 1) == 0.0;
  }
  /// ln G in the interval that ends at k.
  [[nodiscard]] Complex log_at(Index k, double w) const {
    const double h = t(k) - t(k - 1);
    const double s = (std::log(w) - t(k - 1)) / h;
    const double r = 1.0 - s;
    return r * r * ((1.0 + 2.0 * s) * log_(k - 1) + s * h * slope_(k - 1)) +
           s * s * ((1.0 + 2.0 * r) * log_(k) - r * h * slope_(k));
  }
  [[nodiscard]] Complex at(double w) const {
    const Index n = w_.size();
    if (!(w >= w_(0) && w <= w_(n - 1))) {
      return {nan, nan};
    }
    const auto* found = std::lower_bound(w_.data(), w_.data() + n, w);
    const auto k = static_cast<Index>(found - w_.data());
    if (w_(k) == w) {
      return G_(k);
    }
    if (straight(k)) {
      const double share = (w - w_(k - 1)) / (w_(k) - w_(k - 1));
      return (1.0 - share) * G_(k - 1) + share * G_(k);
    }
    return std::exp(log_at(k, w));
  }

 private:
  [[nodiscard]] double t(Index k) const { return std::log(w_(k)); }
  [[nodiscard]] Complex secant(Index k) const {
    return (log_(k) - log_(k - 1)) / (t(k) - t(k - 1));
  }

  VectorXd w_;
  VectorXcd G_;
  VectorXcd log_;
  VectorXcd slope_;
};

class DataSource final : public FrequencyResponse::Source {
 public:
  explicit DataSource(const FrequencyData& data) : data_(data) {
    for (Index i = 0; i < data.values().rows(); ++i) {
      curves_.emplace_back(data.frequency(), data.values().row(i).transpose());
    }
  }

  [[nodiscard]] Index outputs() const override { return data_.outputs(); }
  [[nodiscard]] Index inputs() const override { return data_.inputs(); }
  [[nodiscard]] std::optional<Time> period() const override { return data_.period(); }
  void evaluate(const VectorXd& frequencies, Complex* values) const override {
    for (const double w : frequencies) {
      for (const LogCurve& curve : curves_) {
        // The response at -ω is the conjugate.
        *values++ = w < 0.0 ? std::conj(curve.at(-w)) : curve.at(w);
      }
    }
  }
  [[nodiscard]] MatrixXcd at_point(Complex /*s*/) const override {
    return MatrixXcd::Constant(outputs(), inputs(), Complex(nan, nan));
  }
  [[nodiscard]] VectorXd known_frequencies() const override { return data_.frequency(); }

 private:
  FrequencyData data_;
  std::vector<LogCurve> curves_;
};

Expected<void> check_frequencies(const VectorXd& w, const std::optional<Time>& period,
                                 std::string_view where) {
  for (Index k = 0; k < w.size(); ++k) {
    const bool twice = k > 0 && w(k) == w(k - 1);
    const bool falls = k > 0 ? w(k) <= w(k - 1) : w(k) < 0.0;
    if (falls) {
      return refusal(ArgumentError::out_of_range, where,
                     flyball::detail::format("frequency {}", k + 1))
          .got(twice ? flyball::detail::format("{} rad/s for the second time", w(k))
                     : flyball::detail::format("{} rad/s", w(k)))
          .expected(k > 0 ? flyball::detail::format("above {} rad/s, the one before it", w(k - 1))
                          : std::string("not negative"))
          .hint(twice   ? "average the values that were measured at one frequency"
                : k > 0 ? "sort the frequencies, and the values with them"
                        : "");
    }
  }
  if (period && w(w.size() - 1) > pi / period->si() * (1.0 + 1e-12)) {
    return refusal(ArgumentError::out_of_range, where, "the last frequency")
        .got(flyball::detail::format("{} rad/s", w(w.size() - 1)))
        .expected(flyball::detail::format("up to pi/T, {} rad/s", pi / period->si()));
  }
  return {};
}

Expected<void> check_periods(const FrequencyData& first, const FrequencyData& second,
                             std::string_view where) {
  const auto& a = first.period();
  const auto& b = second.period();
  if (a.has_value() == b.has_value() && (!a || std::abs(a->si() - b->si()) <= 1e-12 * a->si())) {
    return {};
  }
  const auto text = [](const std::optional<Time>& T) {
    return T ? flyball::detail::format("{} s", T->si()) : std::string("continuous");
  };
  return refusal(TransferError::period_mismatch, where, "the second's sample period")
      .got(text(b))
      .expected(text(a) + ", the first's");
}

/// combine(G₁, G₂) at the first's frequencies.
template <class Combine>
Expected<FrequencyData> combined(const FrequencyData& first, const FrequencyData& second,
                                 std::string_view where, const Combine& combine) {
  FLYBALL_CHECK(check_periods(first, second, where));
  FLYBALL_TRY_IN(where, const MatrixXcd others, second.response().sample(first.frequency()));
  MatrixXcd values;
  Index outputs = 0;
  Index inputs = 0;
  for (Index k = 0; k < first.frequency().size(); ++k) {
    const MatrixXcd a = first.values().col(k).reshaped(first.outputs(), first.inputs());
    const MatrixXcd b = others.col(k).reshaped(second.outputs(), second.inputs());
    FLYBALL_TRY(const MatrixXcd G, combine(a, b, first.frequency()(k)));
    if (k == 0) {
      outputs = G.rows();
      inputs = G.cols();
      values.resize(G.size(), first.frequency().size());
    }
    values.col(k) = G.reshaped();
  }
  return FrequencyData::create(first.frequency(), values, outputs, inputs, first.period());
}

Expected<void> check_fit(bool fits, const FrequencyData& first, const FrequencyData& second,
                         std::string_view where, std::string_view expected) {
  if (fits) {
    return {};
  }
  return refusal(ArgumentError::wrong_shape, where, "the second")
      .got(flyball::detail::format("{} x {}, the first is {} x {}", second.outputs(),
                                   second.inputs(), first.outputs(), first.inputs()))
      .expected(std::string(expected));
}

}  // namespace

Expected<FrequencyData> FrequencyData::create(const VectorXd& frequency, const MatrixXcd& values,
                                              Index outputs, Index inputs,
                                              std::optional<Time> period) {
  constexpr std::string_view where = "frequency data";
  if (frequency.size() == 0) {
    return refusal(ArgumentError::empty, where, "frequency").got("empty").expected("frequencies");
  }
  if (outputs < 1 || inputs < 1 || values.rows() != outputs * inputs ||
      values.cols() != frequency.size()) {
    return refusal(ArgumentError::wrong_shape, where, "values")
        .got(flyball::detail::format("{} x {}", values.rows(), values.cols()))
        .expected(flyball::detail::format("outputs·inputs x frequencies ({} x {})",
                                          outputs * inputs, frequency.size()));
  }
  FLYBALL_CHECK(Checks(where)
                    .finite(MatrixXd(frequency), "frequency")
                    .finite(MatrixXd(values.real()), "the real part of values")
                    .finite(MatrixXd(values.imag()), "the imaginary part of values"));
  if (period) {
    FLYBALL_CHECK(check_positive(period->si(), where, "period", "s"));
  }
  FLYBALL_CHECK(check_frequencies(frequency, period, where));
  FrequencyData data;
  data.frequency_ = frequency;
  data.values_ = values;
  data.outputs_ = outputs;
  data.inputs_ = inputs;
  data.period_ = period;
  return data;
}

Expected<FrequencyData> FrequencyData::from_measurement(const FrequencyResponseEstimate& estimate,
                                                        double least_coherence) {
  std::vector<Index> kept;
  for (Index k = 0; k < estimate.frequency.size(); ++k) {
    const MatrixXcd& G = estimate.response[static_cast<std::size_t>(k)];
    if (G.allFinite() && estimate.coherence.row(k).minCoeff() >= least_coherence) {
      kept.push_back(k);
    }
  }
  if (kept.empty()) {
    return refusal(ArgumentError::empty, "frequency data", "the measurement")
        .got("without a frequency of enough coherence")
        .expected(flyball::detail::format("one with {} at least", least_coherence))
        .hint("excite the system more, or ask for less coherence");
  }
  const MatrixXcd& any = estimate.response.front();
  VectorXd frequency(static_cast<Index>(kept.size()));
  MatrixXcd values(any.size(), frequency.size());
  for (Index k = 0; k < frequency.size(); ++k) {
    const Index from = kept[static_cast<std::size_t>(k)];
    frequency(k) = estimate.frequency(from);
    values.col(k) = estimate.response[static_cast<std::size_t>(from)].reshaped();
  }
  return create(frequency, values, any.rows(), any.cols());
}

Expected<FrequencyData> FrequencyData::sampled(const FrequencyResponse& response,
                                               const VectorXd& frequency) {
  FLYBALL_TRY(const MatrixXcd values, response.sample(frequency));
  return create(frequency, values, response.outputs(), response.inputs(), response.period());
}

FrequencyResponse FrequencyData::response() const {
  return FrequencyResponse(std::make_shared<DataSource>(*this));
}

Expected<FrequencyData> series(const FrequencyData& first, const FrequencyData& second) {
  constexpr std::string_view where = "series";
  FLYBALL_CHECK(check_fit(second.inputs() == first.outputs(), first, second, where,
                          "of as many inputs as the first has outputs"));
  return combined(first, second, where,
                  [](const MatrixXcd& a, const MatrixXcd& b, double) -> Expected<MatrixXcd> {
                    return flyball::detail::complex_product(b, a);
                  });
}

Expected<FrequencyData> parallel(const FrequencyData& first, const FrequencyData& second) {
  constexpr std::string_view where = "parallel";
  FLYBALL_CHECK(check_fit(second.inputs() == first.inputs() && second.outputs() == first.outputs(),
                          first, second, where, "of the first's shape"));
  return combined(first, second, where,
                  [](const MatrixXcd& a, const MatrixXcd& b, double) -> Expected<MatrixXcd> {
                    return MatrixXcd(a + b);
                  });
}

Expected<FrequencyData> feedback(const FrequencyData& forward, const FrequencyData& back,
                                 bool negative) {
  constexpr std::string_view where = "feedback";
  FLYBALL_CHECK(check_fit(back.inputs() == forward.outputs() && back.outputs() == forward.inputs(),
                          forward, back, where, "from the first's outputs to its inputs"));
  return combined(forward, back, where,
                  [&](const MatrixXcd& a, const MatrixXcd& b, double w) -> Expected<MatrixXcd> {
                    const MatrixXcd loop = flyball::detail::complex_product(a, b);
                    double rcond = 0.0;
                    const MatrixXcd left = MatrixXcd::Identity(loop.rows(), loop.cols()) +
                                           (negative ? 1.0 : -1.0) * loop;
                    MatrixXcd closed = flyball::detail::solve_complex(left, a, &rcond);
                    if (!(rcond > 1e-15)) {
                      return refusal(TransferError::at_a_pole, where, "I + G1 G2")
                          .got("singular")
                          .with("frequency", w);
                    }
                    return closed;
                  });
}

Expected<LoopMargins> loop_margins(const FrequencyData& loop, int open_loop_unstable) {
  constexpr std::string_view where = "margins";
  if (loop.values().rows() != 1) {
    return refusal(ArgumentError::wrong_shape, where, "the loop")
        .got(flyball::detail::format("{} x {}", loop.outputs(), loop.inputs()))
        .expected("of one input and one output");
  }
  if (open_loop_unstable < 0) {
    return refusal(ArgumentError::out_of_range, where, "open_loop_unstable")
        .got(std::to_string(open_loop_unstable))
        .expected("zero or more poles");
  }
  const VectorXd& w = loop.frequency();
  const Index n = w.size();
  if (n < 2 || (n < 3 && w(0) == 0.0)) {
    return refusal(ArgumentError::empty, where, "the data")
        .got("one frequency")
        .expected("two above zero at least");
  }
  const LogCurve curve(w, loop.values().row(0).transpose());
  LoopMargins margins;
  const auto gain = [&](double x) { return std::log(std::abs(curve.at(x))); };
  const auto lag = [&](double x) { return std::arg(-curve.at(x)); };
  constexpr int parts = 16;  // A cubic has two turning points: none is skipped that matters.
  const auto find = [&](const auto& f, double most, auto&& take) {
    for (Index k = 1; k < n; ++k) {
      const double low = std::max(w(k - 1), 1e-3 * w(k));
      double a = low;
      double f_a = f(a);
      for (int part = 1; part <= parts; ++part) {
        const double b =
            part == parts ? w(k) : low * std::pow(w(k) / low, double{1.0} * part / parts);
        const double f_b = f(b);
        if ((f_a > 0.0) != (f_b > 0.0) && std::abs(f_a - f_b) < most) {
          if (const auto root = find_root(f, a, b, f_a, f_b)) {
            take(root->x);
          }
        }
        a = b;
        f_a = f_b;
      }
    }
  };
  double further = infinity;
  find(gain, infinity, [&](double x) {
    double margin = std::remainder(180.0 + std::arg(curve.at(x)) * 180.0 / pi, 360.0);
    margin = margin == -180.0 ? 180.0 : margin;
    margins.gain_crossings.push_back({x, margin});
    further = std::min(further, (margin > 0.0 ? margin : margin + 360.0) * pi / 180.0 / x);
    if (!margins.phase_margin || std::abs(margin) < std::abs(*margins.phase_margin)) {
      margins.phase_margin = margin;
    }
  });
  find(lag, pi, [&](double x) {
    const double value = 1.0 / std::abs(curve.at(x));
    margins.phase_crossings.push_back({x, value});
    if (!margins.gain_margin ||
        std::abs(std::log(value)) < std::abs(std::log(*margins.gain_margin))) {
      margins.gain_margin = value;
    }
  });
  // What 1 + L turns on the data, from its asymptote on and to the real axis behind.
  const double first = w(0) > 0.0 ? w(0) : w(1);
  const Complex L_first = curve.at(first);
  const double slope = (gain(first * (1.0 + 1e-3 * (w(n - 1) / first - 1.0))) - gain(first)) /
                       std::log1p(1e-3 * (w(n - 1) / first - 1.0));
  const double integrators = -std::round(slope);
  const double angle = std::arg(L_first);
  const double low_phase = -0.5 * pi * integrators;
  const bool negative = std::cos(angle - low_phase) < 0.0;
  if (integrators == 0.0 && negative) {
    const double value = 1.0 / std::abs(w(0) > 0.0 ? L_first : loop.values()(0, 0));
    margins.phase_crossings.insert(margins.phase_crossings.begin(), {0.0, value});
    if (!margins.gain_margin ||
        std::abs(std::log(value)) < std::abs(std::log(*margins.gain_margin))) {
      margins.gain_margin = value;
    }
  }
  // At ω → 0, before the quarter turn of each integrator, L is real.
  const double start = negative ? -pi : 0.0;
  double turned = 0.0;
  if (std::abs(L_first) > 1.0) {
    const double unwrapped =
        start + low_phase + std::remainder(angle - start - low_phase, 2.0 * pi);
    // On the large arc 1 + L turns as L does, but for what 1 adds at its end.
    turned = unwrapped - start + std::arg((1.0 + L_first) / L_first);
  } else {
    turned = std::arg((1.0 + L_first) / (1.0 + (negative ? -1.0 : 1.0) * std::abs(L_first)));
  }
  Complex before = 1.0 + L_first;
  const auto consider = [&](double x, double& spread) {
    const Complex L = curve.at(x);
    const double S = 1.0 / std::abs(1.0 + L);
    if (S > margins.sensitivity.value) {
      margins.sensitivity = {S, x};
    }
    spread = std::max(spread, std::abs(1.0 - L) * S);
  };
  double spread = 0.0;
  for (Index k = w(0) > 0.0 ? 1 : 2; k < n; ++k) {
    for (int part = 1; part <= parts; ++part) {
      const double x =
          part == parts ? w(k) : w(k - 1) * std::pow(w(k) / w(k - 1), double{1.0} * part / parts);
      const Complex now = 1.0 + curve.at(x);
      turned += std::arg(now / before);
      before = now;
      consider(x, spread);
    }
  }
  consider(first, spread);
  const auto refine = [&](double around, auto&& size) {
    const auto top =
        find_minimum([&](double x) { return -size(curve.at(x)); }, std::max(first, 0.98 * around),
                     std::min(w(n - 1), 1.02 * around));
    return top ? Peak{-top->value, top->x} : Peak{};
  };
  const Peak top =
      refine(margins.sensitivity.frequency, [](Complex L) { return 1.0 / std::abs(1.0 + L); });
  if (top.value > margins.sensitivity.value) {
    margins.sensitivity = top;
  }
  turned -= std::arg(before);
  margins.unstable_poles =
      std::max(0, open_loop_unstable - static_cast<int>(std::lround(turned / pi)));
  margins.stable = margins.unstable_poles == 0;
  margins.delay_margin = margins.stable ? further : 0.0;
  margins.disk_margin = margins.stable && spread > 0.0 ? 2.0 / spread : 0.0;
  return margins;
}

}  // namespace flyball::classical
