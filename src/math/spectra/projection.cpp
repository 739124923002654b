#include <flyball/math/spectra/projection.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <flyball/math/spectra/fft.hpp>

#include "core/constants.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

Expected<void> check_record(const MatrixRef& x, Time period, std::string_view where) {
  if (x.size() == 0) {
    return refusal(ArgumentError::empty, where, "x").expected("samples x 1");
  }
  return Checks(where)
      .shape(x, x.rows(), 1, "x", "samples x 1")
      .finite(x, "x")
      .positive(period.si(), "period", "s");
}

/// Independent columns of length one: the smallest singular value of theirs.
bool independent(const MatrixRef& columns) {
  return columns.cols() <= columns.rows() && detail::singular_values_of(columns).minCoeff() > 1e-12;
}

/// ∫₀¹ e^{-pτ} dτ = (1 - e^{-p})/p and ∫₀¹ τ e^{-pτ} dτ = (1 - (1 + p) e^{-p})/p², by their series
/// where the quotients lose digits.
struct PulseMoments {
  Complex zeroth;
  Complex first;
};
PulseMoments moments(Complex p) {
  if (std::abs(p) < 0.5) {
    PulseMoments m{0.0, 0.0};
    Complex term = 1.0;  // (-p)^k/k!
    for (int k = 0; k < 18; ++k) {
      m.zeroth += term / (k + 1.0);
      m.first += term / (k + 2.0);
      term *= -p / (k + 1.0);
    }
    return m;
  }
  const Complex end = std::exp(-p);
  return {(1.0 - end) / p, (1.0 - (1.0 + p) * end) / (p * p)};
}

}  // namespace

Expected<Coordinates> coordinates(const MatrixRef& basis, const MatrixRef& v) {
  constexpr std::string_view where = "coordinates";
  if (basis.size() == 0) {
    return refusal(ArgumentError::empty, where, "basis").expected("vectors as columns");
  }
  FLYBALL_CHECK(Checks(where)
                    .finite(basis, "basis")
                    .shape(v, basis.rows(), 1, "v", "rows of the basis x 1")
                    .finite(v, "v"));
  MatrixXd directions = basis;
  for (Index i = 0; i < basis.cols(); ++i) {
    directions.col(i) /= basis.col(i).stableNorm();
  }
  if (!directions.allFinite() || !independent(directions)) {
    return refusal(ArgumentError::malformed, where, "basis")
        .got("dependent, or with a zero vector")
        .expected("of independent vectors");
  }
  Coordinates result;
  const MatrixXd gram = detail::transposed_product(directions, directions);
  result.orthogonal =
      (gram - MatrixXd::Identity(gram.rows(), gram.cols())).cwiseAbs().maxCoeff() < 1e-12;
  if (result.orthogonal) {
    result.along.resize(basis.cols());
    for (Index i = 0; i < basis.cols(); ++i) {
      // v·w/|w|: one rounding less than with the direction.
      result.along(i) = v.col(0).dot(basis.col(i)) / basis.col(i).stableNorm();
    }
  } else {
    result.along = detail::solve_least_squares(directions, v);
  }
  result.rest = (v - detail::product(directions, result.along)).norm();
  return result;
}

Expected<VectorXcd> laplace_transform(const MatrixRef& x, Time period, const VectorXcd& s,
                                      Interpolation between) {
  constexpr std::string_view where = "laplace_transform";
  FLYBALL_CHECK(check_record(x, period, where));
  FLYBALL_CHECK(Checks(where).finite(s.real(), "s").finite(s.imag(), "s"));
  const double T = period.si();
  const Index n = x.rows();
  const double end = static_cast<double>(n) * T;
  VectorXcd X(s.size());
  for (Index i = 0; i < s.size(); ++i) {
    if (s(i).real() * end < -700.0) {
      return refusal(ArgumentError::out_of_range, where, "s")
          .got(format_number(s(i).real()) + " 1/s in its real part")
          .expected("above " + format_number(-700.0 / end) +
                    " 1/s, so that e^(-st) does not overflow within the record");
    }
    const Complex p = s(i) * T;
    const Complex step = std::exp(-p);
    const PulseMoments m = moments(p);
    // Horner's rule from the end on, so that nothing grows; where e^{-st} grows, from the start.
    const auto sum = [&](auto&& segment, Index count) {
      Complex total = 0.0;
      if (p.real() >= 0.0) {
        for (Index k = count - 1; k >= 0; --k) {
          total = total * step + segment(k);
        }
        return total;
      }
      const Complex back = std::exp(p);
      for (Index k = 0; k < count; ++k) {
        total = total * back + segment(k);
      }
      return total * std::exp(-p * static_cast<double>(count - 1));
    };
    if (between == Interpolation::hold) {
      X(i) = T * m.zeroth * sum([&](Index k) { return Complex(x(k, 0)); }, n);
    } else {
      // x_k (1 - τ) + x_{k+1} τ
      const Complex left = m.zeroth - m.first;
      X(i) = n == 1
                 ? Complex(0.0)
                 : T * sum([&](Index k) { return x(k, 0) * left + x(k + 1, 0) * m.first; }, n - 1);
    }
  }
  return X;
}

Expected<AmplitudeSpectrum> amplitude_spectrum(const MatrixRef& x, Time period, Window window) {
  constexpr std::string_view where = "amplitude_spectrum";
  FLYBALL_CHECK(check_record(x, period, where));
  const Index n = x.rows();
  FLYBALL_TRY_IN(where, const VectorXd w, window_samples(window, n));
  const double sum = w.sum();
  const VectorXd windowed = x.col(0).cwiseProduct(w);
  FLYBALL_TRY_IN(where, VectorXcd X, real_fft(windowed));
  AmplitudeSpectrum spectrum;
  spectrum.frequency.resize(X.size());
  for (Index k = 0; k < X.size(); ++k) {
    const bool once = k == 0 || 2 * k == n;
    X(k) *= (once ? 1.0 : 2.0) / sum;
    spectrum.frequency(k) =
        2.0 * pi * static_cast<double>(k) / (static_cast<double>(n) * period.si());
  }
  spectrum.amplitude = std::move(X);
  spectrum.bandwidth = 2.0 * pi * w.squaredNorm() / (sum * sum * period.si());
  return spectrum;
}

Expected<Tones> fit_tones(const MatrixRef& x, Time period, const VectorXd& frequency) {
  constexpr std::string_view where = "fit_tones";
  FLYBALL_CHECK(check_record(x, period, where));
  const double T = period.si();
  const Index n = x.rows();
  const Index tones = frequency.size();
  FLYBALL_CHECK(check_finite(frequency, where, "frequency"));
  for (const double w : frequency) {
    if (!(w > 0.0 && w * T < pi)) {
      return refusal(ArgumentError::out_of_range, where, "frequency")
          .got(format_number(w) + " rad/s")
          .expected("above zero and below half the sample rate, " + format_number(pi / T) +
                    " rad/s");
    }
  }
  if (n < 2 * tones + 1) {
    return refusal(ArgumentError::malformed, where, "x")
        .got(std::to_string(n) + " samples")
        .expected("at least " + std::to_string(2 * tones + 1) +
                  ", two for each tone and one for the mean");
  }
  // Around the middle of the record, where a cosine is nearly orthogonal to its sine.
  const double middle = 0.5 * static_cast<double>(n - 1);
  MatrixXd columns(n, 2 * tones + 1);
  for (Index k = 0; k < n; ++k) {
    const double t = (static_cast<double>(k) - middle) * T;
    columns(k, 0) = 1.0;
    for (Index i = 0; i < tones; ++i) {
      columns(k, 1 + 2 * i) = std::cos(frequency(i) * t);
      columns(k, 2 + 2 * i) = std::sin(frequency(i) * t);
    }
  }
  MatrixXd directions = columns;
  for (Index i = 0; i < columns.cols(); ++i) {
    directions.col(i).normalize();
  }
  const MatrixXd gram = detail::transposed_product(directions, directions);
  if (!gram.allFinite() || detail::symmetric_eigensystem_of(gram).values.minCoeff() < 1e-13) {
    return refusal(ArgumentError::malformed, where, "x")
        .got("so short that the tones cannot be told apart")
        .expected("long enough for 1/length to be below their distance");
  }
  const VectorXd c = detail::solve_least_squares(columns, x);
  Tones result;
  result.mean = c(0);
  result.amplitude.resize(tones);
  for (Index i = 0; i < tones; ++i) {
    // c cos w(t - m) + d sin w(t - m) = Re((c - jd) e^{-jwm} e^{jwt})
    result.amplitude(i) =
        Complex(c(1 + 2 * i), -c(2 + 2 * i)) * std::polar(1.0, -frequency(i) * middle * T);
  }
  result.rest = (x - detail::product(columns, c)).norm() / std::sqrt(static_cast<double>(n));
  return result;
}

}  // namespace flyball
