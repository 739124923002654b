#include <algorithm>
#include <cmath>

#include "classical/delay_pole_count.hpp"
#include "core/constants.hpp"
#include "math/dense/dense.hpp"

namespace flyball::classical::detail {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Complex = std::complex<double>;

namespace {

double larger_part(Complex z) {
  return std::max(std::abs(z.real()), std::abs(z.imag()));
}

/// arg det M, by elimination.
double angle_of(MatrixXcd M) {
  const Index n = M.rows();
  Complex turned = 1.0;
  for (Index k = 0; k < n; ++k) {
    Index pivot = k;
    for (Index i = k + 1; i < n; ++i) {
      pivot = larger_part(M(i, k)) > larger_part(M(pivot, k)) ? i : pivot;
    }
    if (pivot != k) {
      M.row(pivot).swap(M.row(k));
      turned = -turned;
    }
    turned *= M(k, k) / larger_part(M(k, k));
    turned /= larger_part(turned);
    for (Index i = k + 1; i < n; ++i) {
      if (M(i, k) != 0.0) {
        const Complex factor = M(i, k) / M(k, k);
        M.row(i).tail(n - k - 1) -= factor * M.row(k).tail(n - k - 1);
      }
    }
  }
  return std::arg(turned);
}

}  // namespace

PoleCountWork::PoleCountWork(const Characteristic& f) {
  const auto size = static_cast<double>(f.states() + f.delays().size());
  left = static_cast<long>(std::min(400'000.0, 4e8 / (size * size * (size + 30.0) + 1.0)));
}

std::optional<int> count_right_of(const Characteristic& f, double line, double highest,
                                  PoleCountWork& work) {
  double top = 2.0 * highest;
  for (const Complex& pole : f.open_poles()) {
    top = std::max(top, 4.0 * std::abs(pole));
  }
  const auto loop_gain = [&](Complex s) {
    const MatrixXd size = (f.around(s) * f.late(s).asDiagonal()).cwiseAbs();
    return size.allFinite() ? radius_of(size) : infinity;
  };
  const double jumps =
      radius_of(f.jumps().cwiseAbs() * (-line * f.delays()).array().exp().matrix().asDiagonal());
  for (int i = 0; i < 60 && loop_gain({line, top}) > jumps + 0.7 * (1.0 - jumps); ++i) {
    top *= 2.0;
  }
  const auto angle = [&](double w) { return angle_of(f.at({line, w})); };
  double turned = 0.0;
  double w = 0.0;
  double before = angle(0.0);
  const double shortest = 1e-9 * top;
  const double longest = 0.5 / f.delays().maxCoeff();
  double step = 1e-3 * longest;
  while (w < top) {
    const double end = std::min(top, w + step);
    const double after = angle(end);
    const double change = std::remainder(after - before, 2.0 * pi);
    // That a half of it turns by half as much shows that no turn is missed.
    if (!(std::abs(change) <= 0.4)) {
      if (end - w <= 1e-12 * top + 1e-300) {
        return std::nullopt;
      }
      step = std::max(0.4 * (end - w), 1e-13 * top);
    } else {
      turned += change;
      w = end;
      before = after;
      step = std::min(std::abs(change) < 0.15 ? 1.6 * step : step, std::max(longest, shortest));
    }
    if (--work.left < 0) {
      return std::nullopt;
    }
  }
  double arc = 0.0;
  for (const Complex& pole : f.open_poles()) {
    arc += std::arg(Complex(line, top) - pole);
  }
  const Complex end(line, top);
  const MatrixXcd loop = f.around(end) * f.late(end).asDiagonal();
  for (const Complex& value : flyball::detail::eigenvalues_of_complex(loop)) {
    if (!(std::abs(value) < 1.0)) {
      return std::nullopt;
    }
    arc += std::arg(1.0 - value);
  }
  const double count = (arc - turned) / pi;
  if (!(std::abs(count - std::round(count)) <= 0.05)) {
    return std::nullopt;
  }
  return static_cast<int>(std::lround(count));
}

}  // namespace flyball::classical::detail
