#include <cmath>
#include <string>

#include <flyball/classical/filters/fir_design.hpp>

#include "core/try.hpp"

// Taps from polynomials through samples, and near them.
namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr Index most_taps = 100000;

Expected<void> check_fit(const SavitzkyGolay& fit, Time period, std::string_view where) {
  const auto out_of_range = [&](std::string_view name, Index got, Index low, Index high) {
    return refusal(ArgumentError::out_of_range, where, name)
        .got(std::to_string(got))
        .expected(std::to_string(low) + " to " + std::to_string(high));
  };
  if (fit.taps < 1 || fit.taps > most_taps) {
    return out_of_range("taps", fit.taps, 1, most_taps);
  }
  const Index highest = std::min<Index>(20, fit.taps - 1);
  if (fit.degree < 0 || fit.degree > highest) {
    return out_of_range("degree", fit.degree, 0, highest);
  }
  if (fit.derivative < 0 || fit.derivative > fit.degree) {
    return out_of_range("derivative", fit.derivative, 0, fit.degree);
  }
  return Checks(where).finite(fit.at, "at").positive(period.si(), "period", "s");
}

/// Orthonormal polynomials on the samples are made one from the other by t, and orthogonalised
/// twice; their derivatives at one place come along as further rows.
/// Source: Brubeck, Nakatsukasa and Trefethen, SIAM Review 63 (2021).
VectorXd fitted_taps(const SavitzkyGolay& fit, double T) {
  const Index n = fit.taps;
  const Index derivatives = fit.derivative + 1;
  const double middle = 0.5 * static_cast<double>(n - 1);
  const double unit = std::max(middle, 0.5);
  const VectorXd t =
      (VectorXd::LinSpaced(n, 0.0, static_cast<double>(n - 1)).array() - middle) / unit;
  const double place = (fit.at - middle) / unit;

  MatrixXd Q = MatrixXd::Zero(n + derivatives, fit.degree + 1);
  const auto normalize = [&](Index k) { Q.col(k) /= Q.col(k).head(n).norm(); };
  Q.col(0).head(n).setOnes();
  Q(n, 0) = 1.0;
  normalize(0);
  for (Index k = 1; k <= fit.degree; ++k) {
    Q.col(k).head(n) = t.cwiseProduct(Q.col(k - 1).head(n));
    for (Index d = 0; d < derivatives; ++d) {  // (t q)^(d) = t q^(d) + d q^(d-1)
      Q(n + d, k) =
          place * Q(n + d, k - 1) + (d > 0 ? static_cast<double>(d) * Q(n + d - 1, k - 1) : 0.0);
    }
    for (int again = 0; again < 2; ++again) {
      for (Index j = 0; j < k; ++j) {
        const double along = Q.col(j).head(n).dot(Q.col(k).head(n));
        Q.col(k) -= along * Q.col(j);
      }
    }
    normalize(k);
  }
  // Time runs against t: the newest sample is t's first.
  const double scale = std::pow(-1.0 / (unit * T), fit.derivative);
  VectorXd taps = VectorXd::Zero(n);
  for (Index k = 0; k <= fit.degree; ++k) {
    taps += (scale * Q(n + fit.derivative, k)) * Q.col(k).head(n);
  }
  return taps;
}

}  // namespace

Expected<VectorXd> finite_difference(const VectorXd& offsets, int derivative, Time period) {
  constexpr std::string_view where = "finite_difference";
  const Index n = offsets.size();
  if (n == 0) {
    return refusal(ArgumentError::empty, where, "offsets").expected("one at least");
  }
  FLYBALL_CHECK(Checks(where).finite(offsets, "offsets").positive(period.si(), "period", "s"));
  constexpr Index most = 1000;
  if (n > most) {
    return refusal(ArgumentError::out_of_range, where, "offsets")
        .got(std::to_string(n))
        .expected("at most " + std::to_string(most));
  }
  if (derivative < 0 || derivative >= n) {
    return refusal(ArgumentError::out_of_range, where, "derivative")
        .got(std::to_string(derivative))
        .expected("0 to " + std::to_string(n - 1) + ", below the number of samples");
  }
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < i; ++j) {
      if (offsets(i) == offsets(j)) {
        return refusal(ArgumentError::malformed, where, "offsets")
            .got("with " + format_number(offsets(i)) + " twice")
            .expected("all different");
      }
    }
  }
  // Fornberg's recurrence: c_m(j, d) is the weight of sample j for derivative d with m + 1 samples.
  MatrixXd c = MatrixXd::Zero(n, derivative + 1);
  c(0, 0) = 1.0;
  double before = 1.0;
  for (Index m = 1; m < n; ++m) {
    double product = 1.0;
    const Index highest = std::min<Index>(m, derivative);
    for (Index j = 0; j < m; ++j) {
      const double apart = offsets(m) - offsets(j);
      product *= apart;
      if (j == m - 1) {
        for (Index d = highest; d >= 0; --d) {
          const double lower = d > 0 ? static_cast<double>(d) * c(m - 1, d - 1) : 0.0;
          c(m, d) = before * (lower - offsets(m - 1) * c(m - 1, d)) / product;
        }
      }
      for (Index d = highest; d >= 0; --d) {
        const double lower = d > 0 ? static_cast<double>(d) * c(j, d - 1) : 0.0;
        c(j, d) = (offsets(m) * c(j, d) - lower) / apart;
      }
    }
    before = product;
  }
  return VectorXd(c.col(derivative) / std::pow(period.si(), derivative));
}

Expected<VectorXd> backward_difference(int derivative, Index samples, Time period) {
  if (samples < 1 || samples > 1000) {
    return refusal(ArgumentError::out_of_range, "backward_difference", "samples")
        .got(std::to_string(samples))
        .expected("above the derivative, and at most 1000");
  }
  VectorXd offsets(samples);
  for (Index i = 0; i < samples; ++i) {
    offsets(i) = -static_cast<double>(i);
  }
  return finite_difference(offsets, derivative, period);
}

Expected<VectorXd> savitzky_golay(const SavitzkyGolay& fit, Time period) {
  FLYBALL_CHECK(check_fit(fit, period, "savitzky_golay"));
  return fitted_taps(fit, period.si());
}

Expected<VectorXd> smooth(const MatrixRef& x, const SavitzkyGolay& fit, Time period) {
  constexpr std::string_view where = "smooth";
  FLYBALL_CHECK(check_fit(fit, period, where));
  FLYBALL_CHECK(Checks(where).shape(x, x.rows(), 1, "x", "samples x 1").finite(x, "x"));
  const Index n = fit.taps;
  if (n % 2 == 0) {
    return refusal(ArgumentError::out_of_range, where, "taps")
        .got(std::to_string(n))
        .expected("odd, so that a sample is in the middle");
  }
  if (x.rows() < n) {
    return refusal(ArgumentError::out_of_range, where, "x")
        .got(std::to_string(x.rows()) + " samples")
        .expected("as many as taps at least, " + std::to_string(n));
  }
  const Index half = n / 2;
  const auto taps_at = [&](Index back) {
    SavitzkyGolay moved = fit;
    moved.at = static_cast<double>(back);
    return fitted_taps(moved, period.si());
  };
  VectorXd y(x.rows());
  const VectorXd middle = taps_at(half).reverse();
  for (Index k = half; k + half < x.rows(); ++k) {
    y(k) = middle.dot(x.col(0).segment(k - half, n));
  }
  for (Index i = 0; i < half; ++i) {
    y(i) = taps_at(n - 1 - i).reverse().dot(x.col(0).head(n));
    y(x.rows() - 1 - i) = taps_at(i).reverse().dot(x.col(0).tail(n));
  }
  return y;
}

}  // namespace flyball::classical
