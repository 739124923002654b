#include <flyball/math/spectra/welch.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <flyball/math/regression/least_squares.hpp>
#include <flyball/math/spectra/fft.hpp>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

struct Cut {
  Index length;
  Index step;
  Index stretches;
};

Expected<Cut> cut_of(Index samples, const WelchOptions& options, std::string_view where) {
  FLYBALL_CHECK(check_within(options.overlap, 0.0, 0.95, where, "overlap"));
  // k half overlapping stretches of length l take (k + 1) l/2.
  const Index length = options.length != 0
                           ? options.length
                           : std::max<Index>(1, static_cast<Index>(static_cast<double>(samples) /
                                                                   (8.0 - 7.0 * options.overlap)));
  if (length < 1 || length > samples) {
    return refusal(ArgumentError::out_of_range, where, "the length of a stretch")
        .got(std::to_string(length))
        .expected(detail::format("from 1 to the {} samples", samples));
  }
  const auto shared = static_cast<Index>(options.overlap * static_cast<double>(length));
  const Index step = std::max<Index>(1, length - shared);
  return Cut{length, step, 1 + (samples - length) / step};
}

/// Welch's count of independent stretches: neighbours share samples, and so their noise.
double independent(const VectorXd& window, const Cut& cut) {
  const auto k = static_cast<double>(cut.stretches);
  double shared = 0.0;
  for (Index lag = 1; lag < cut.stretches && lag * cut.step < cut.length; ++lag) {
    const Index both = cut.length - lag * cut.step;
    const double correlation = window.head(both).dot(window.tail(both)) / window.squaredNorm();
    shared += 2.0 * (1.0 - static_cast<double>(lag) / k) * correlation * correlation;
  }
  return k / (1.0 + shared);
}

}  // namespace

Expected<CrossSpectra> cross_spectra(const MatrixRef& signals, Time period,
                                     const WelchOptions& options) {
  constexpr std::string_view where = "cross_spectra";
  FLYBALL_CHECK(Checks(where).finite(signals, "the signals").positive(period.si(), "period", "s"));
  if (signals.size() == 0) {
    return refusal(ArgumentError::empty, where, "the record").expected("samples x signals");
  }
  FLYBALL_TRY(const Cut cut, cut_of(signals.rows(), options, where));
  FLYBALL_TRY(const VectorXd window, window_samples(options.window, cut.length));
  FLYBALL_TRY(RealFft plan, RealFft::create(cut.length));
  const Index bins = plan.bins();
  const Index count = signals.cols();

  // In units of each signal's size, so that no square leaves the doubles.
  const VectorXd size = signals.cwiseAbs().colwise().maxCoeff().transpose().unaryExpr(
      [](double largest) { return largest > 0.0 ? std::ldexp(1.0, std::ilogb(largest)) : 1.0; });
  MatrixXcd X(bins, count);
  std::vector<MatrixXcd> sum(static_cast<std::size_t>(bins), MatrixXcd::Zero(count, count));
  VectorXd stretch(cut.length);
  for (Index k = 0; k < cut.stretches; ++k) {
    for (Index i = 0; i < count; ++i) {
      stretch = signals.col(i).segment(k * cut.step, cut.length) / size(i);
      if (options.remove_mean) {
        stretch.array() -= stretch.mean();
      }
      stretch = stretch.cwiseProduct(window);
      plan.forward(stretch.data(), X.col(i).data());
    }
    for (Index f = 0; f < bins; ++f) {
      MatrixXcd& at = sum[static_cast<std::size_t>(f)];
      for (Index j = 0; j < count; ++j) {
        for (Index i = 0; i < count; ++i) {
          at(i, j) += X(f, i) * std::conj(X(f, j));
        }
      }
    }
  }
  CrossSpectra spectra;
  const double T = period.si();
  spectra.frequency = VectorXd::LinSpaced(bins, 0.0, static_cast<double>(bins - 1)) *
                      (2.0 * std::numbers::pi / (static_cast<double>(cut.length) * T));
  const double scale = T / (window.squaredNorm() * static_cast<double>(cut.stretches));
  for (Index f = 0; f < bins; ++f) {
    const bool alone = f == 0 || 2 * f == cut.length;
    spectra.density.push_back((alone ? 1.0 : 2.0) * scale * size.asDiagonal() *
                              sum[static_cast<std::size_t>(f)] * size.asDiagonal());
  }
  spectra.stretches = cut.stretches;
  spectra.averages = independent(window, cut);
  return spectra;
}

Expected<PowerSpectrum> welch(const MatrixRef& x, Time period, const WelchOptions& options) {
  FLYBALL_CHECK(check_shape(x, x.rows(), 1, "welch", "x", "samples"));
  FLYBALL_TRY(const CrossSpectra spectra, cross_spectra(x, period, options));
  PowerSpectrum power{spectra.frequency, VectorXd(spectra.frequency.size()), spectra.averages};
  for (Index f = 0; f < power.density.size(); ++f) {
    power.density(f) = spectra.density[static_cast<std::size_t>(f)](0, 0).real();
  }
  return power;
}

namespace {

/// F_{2, 2ν} has a closed form: the x with P(F <= x) = p is ν ((1 - p)^(-1/ν) - 1).
double f_quantile(double p, double nu) {
  return nu * std::expm1(-std::log1p(-p) / nu);
}

}  // namespace

Expected<FrequencyResponseEstimate> estimate_frequency_response(const MatrixRef& u,
                                                                const MatrixRef& y, Time period,
                                                                const WelchOptions& options,
                                                                ResponseEstimator estimator,
                                                                double confidence) {
  constexpr std::string_view where = "estimate_frequency_response";
  FLYBALL_CHECK(Checks(where).shape(y, u.rows(), y.cols(), "y", "samples x outputs"));
  if (!(confidence > 0.0 && confidence < 1.0)) {
    return refusal(ArgumentError::out_of_range, where, "confidence")
        .got(format_number(confidence))
        .expected("between 0 and 1");
  }
  const Index m = u.cols();
  const Index p = y.cols();
  if (estimator == ResponseEstimator::h2 && m != p) {
    return refusal(ArgumentError::wrong_shape, where, "y")
        .got(detail::format("of {} outputs", p))
        .expected(detail::format("of {}, one an input, for h2", m));
  }
  MatrixXd both(u.rows(), m + p);
  both << u, y;
  FLYBALL_TRY(const CrossSpectra spectra, cross_spectra(both, period, options));

  FrequencyResponseEstimate estimate;
  estimate.frequency = spectra.frequency;
  estimate.averages = spectra.averages;
  estimate.coherence = MatrixXd::Zero(spectra.frequency.size(), p);
  const double freedom = spectra.averages - static_cast<double>(m);
  // Power that is rounding beside that of the whole band is none.
  VectorXd power = VectorXd::Zero(m + p);
  for (const MatrixXcd& S : spectra.density) {
    power = power.cwiseMax(S.diagonal().real());
  }
  for (Index f = 0; f < spectra.frequency.size(); ++f) {
    const MatrixXcd& S = spectra.density[static_cast<std::size_t>(f)];
    MatrixXcd G = MatrixXcd::Constant(p, m, nan);
    MatrixXd radius = MatrixXd::Constant(p, m, infinity);
    // In units in which each input has power 1 here.
    const VectorXd unit = S.diagonal().real().cwiseSqrt();
    double rcond = 0.0;
    if ((unit.head(m).array().square() > 1e-26 * power.head(m).array()).all()) {
      const VectorXd each = unit.head(m).cwiseInverse();
      const MatrixXcd S_uu = each.asDiagonal() * S.topLeftCorner(m, m) * each.asDiagonal();
      const MatrixXcd inverse = detail::solve_complex(S_uu, MatrixXcd::Identity(m, m), &rcond);
      if (rcond > 1e-12) {
        const MatrixXcd first =
            S.bottomLeftCorner(p, m) * each.asDiagonal() * inverse * each.asDiagonal();
        G = first;
        bool found = true;
        if (estimator == ResponseEstimator::h2) {
          // S_yy = G S_uy.
          G = detail::solve_complex(S.topRightCorner(m, p).transpose(),
                                    S.bottomRightCorner(p, p).transpose(), &rcond)
                  .transpose();
          found = rcond > 1e-300 && G.allFinite();
        }
        for (Index i = 0; i < p; ++i) {
          const double explained = (first.row(i) * S.col(m + i).head(m))(0).real();
          const double whole = unit(m + i) * unit(m + i);
          const double coherence = whole > 0.0 ? std::clamp(explained / whole, 0.0, 1.0) : 0.0;
          estimate.coherence(f, i) = coherence;
          for (Index j = 0; found && freedom > 0.0 && j < m; ++j) {
            // Var G_ij = σ² [S_uu⁻¹]_jj / K, σ² from what is not explained.
            const double noise = whole * (1.0 - coherence) * spectra.averages / freedom;
            const double variance =
                noise * inverse(j, j).real() * each(j) * each(j) / spectra.averages;
            radius(i, j) = std::sqrt(f_quantile(confidence, freedom) * variance);
          }
        }
      }
    }
    estimate.response.push_back(std::move(G));
    estimate.radius.push_back(std::move(radius));
  }
  return estimate;
}

Expected<SineResponse> sine_response(const MatrixRef& u, const MatrixRef& y, double frequency,
                                     Time period) {
  constexpr std::string_view where = "sine_response";
  FLYBALL_CHECK(Checks(where)
                    .shape(u, u.rows(), 1, "u", "samples")
                    .shape(y, u.rows(), 1, "y", "samples of u")
                    .finite(u, "u")
                    .finite(y, "y")
                    .positive(period.si(), "period", "s")
                    .positive(frequency, "frequency", "rad/s"));
  const double angle = frequency * period.si();
  const double turns = angle * static_cast<double>(u.rows()) / (2.0 * std::numbers::pi);
  if (turns < 1.999 || angle > 0.95 * std::numbers::pi) {
    return refusal(ArgumentError::out_of_range, where, "frequency")
        .got(detail::format("{:.6g} rad/s, {:.3g} turns of {:.3g} samples", frequency, turns,
                            2.0 * std::numbers::pi / angle))
        .expected("such that the record has two turns of more than two samples each");
  }
  const Index n = u.rows();
  MatrixXd X(n, 4);
  for (Index k = 0; k < n; ++k) {
    const double at = angle * static_cast<double>(k);
    X.row(k) << std::cos(at), std::sin(at), 1.0,
        static_cast<double>(2 * k - n + 1) / static_cast<double>(n);
  }
  FLYBALL_TRY(const LeastSquares in, least_squares(X, u));
  FLYBALL_TRY(const LeastSquares out, least_squares(X, y));
  // a cos φ + b sin φ = Re[(a - ib) e^(iφ)].
  const std::complex<double> U(in.coefficients(0), -in.coefficients(1));
  const std::complex<double> Y(out.coefficients(0), -out.coefficients(1));
  if (!(std::abs(U) > 1e-12 * u.cwiseAbs().maxCoeff())) {
    return refusal(ArgumentError::malformed, where, "u")
        .got(detail::format("without a sine of {:.6g} rad/s", frequency))
        .expected("an excitation of that frequency");
  }
  SineResponse found;
  found.response = Y / U;
  const double squares = X.leftCols(2).col(0).squaredNorm() * std::norm(Y);
  found.coherence = squares > 0.0 ? squares / (squares + out.residual_squares) : 0.0;
  const double freedom = 0.5 * static_cast<double>(out.degrees_of_freedom);
  const double variance = out.covariance(0, 0) + out.covariance(1, 1);
  found.radius =
      freedom > 0.0 ? std::sqrt(f_quantile(0.95, freedom) * variance) / std::abs(U) : infinity;
  return found;
}

}  // namespace flyball
