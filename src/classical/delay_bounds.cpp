#include <algorithm>
#include <cmath>

#include "classical/delay_bounds.hpp"
#include "core/constants.hpp"
#include "math/dense/dense.hpp"
#include "systems/balance.hpp"

namespace flyball::classical::detail {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

/// (I - T)⁻¹V of matrices without negative entries; nothing where Neumann's series does not end: a
/// positive solution for a positive right side shows that it does.
std::optional<MatrixXd> neumann(const MatrixXd& T, const MatrixXd& V) {
  const Index n = T.rows();
  MatrixXd right(n, V.cols() + 1);
  right << V, VectorXd::Ones(n);
  const MatrixXd solved = flyball::detail::solve_linear(MatrixXd::Identity(n, n) - T, right);
  if (!solved.allFinite() || !(solved.col(V.cols()).minCoeff() >= 0.5)) {
    return std::nullopt;
  }
  return MatrixXd(solved.leftCols(V.cols()).cwiseMax(0.0));
}

}  // namespace

DelayBounds::DelayBounds(const DelaySystem& system) : f_(system.form()) {
  const Index n = f_.A.rows();
  MatrixXd in(n, f_.B1.cols() + f_.B2.cols());
  in << f_.B1, f_.B2;
  MatrixXd out(f_.C1.rows() + f_.C2.rows(), n);
  out << f_.C1, f_.C2;
  const VectorXd d = flyball::detail::scaling_of(f_.A, in, out).states;
  f_.A = d.cwiseInverse().asDiagonal() * f_.A * d.asDiagonal();
  f_.B1 = d.cwiseInverse().asDiagonal() * f_.B1;
  f_.B2 = d.cwiseInverse().asDiagonal() * f_.B2;
  f_.C1 = f_.C1 * d.asDiagonal();
  f_.C2 = f_.C2 * d.asDiagonal();
  size_of_A_ = f_.A.norm();
  slowest_ = infinity;
  if (n > 0) {
    consider(flyball::detail::eigenvalues_of(f_.A));
  }
  for (const double delay : f_.delays) {
    slowest_ = std::min(slowest_, 1.0 / delay);
    fastest_ = std::max(fastest_, 1.0 / delay);
  }
  if (fastest_ == 0.0) {
    slowest_ = fastest_ = 1.0;
  }
}

void DelayBounds::consider(const VectorXcd& poles) {
  for (const Complex& pole : poles) {
    const double size = std::abs(pole);
    if (size > 1e-9 * std::max(fastest_, size_of_A_)) {
      slowest_ = std::min(slowest_, size);
      fastest_ = std::max(fastest_, size);
    }
  }
}

DelayPoint DelayBounds::at(double frequency) const {
  const Index n = f_.A.rows();
  const Index k = f_.delays.size();
  const Index N = n + k;
  DelayPoint point;
  if (N == 0) {
    point.value = f_.D11.cast<Complex>();
    point.slope = MatrixXcd::Zero(f_.D11.rows(), f_.D11.cols());
    return point;
  }
  VectorXcd late(k);
  for (Index i = 0; i < k; ++i) {
    late(i) = std::polar(1.0, -frequency * f_.delays(i));
  }
  MatrixXcd delayed(N, k);  // [B₂; D₂₂]
  delayed << f_.B2.cast<Complex>(), f_.D22.cast<Complex>();
  MatrixXcd M = MatrixXcd::Zero(N, N);
  M.leftCols(n) << -f_.A.cast<Complex>(), -f_.C2.cast<Complex>();
  M.topLeftCorner(n, n).diagonal().array() += Complex(0.0, frequency);
  M.rightCols(k) = -delayed * late.asDiagonal();
  M.bottomRightCorner(k, k).diagonal().array() += 1.0;
  MatrixXcd c(f_.C1.rows(), N);
  c << f_.C1.cast<Complex>(), f_.D12.cast<Complex>() * late.asDiagonal();
  MatrixXcd b(N, f_.B1.cols());
  b << f_.B1.cast<Complex>(), f_.D21.cast<Complex>();

  const MatrixXcd X = flyball::detail::solve_complex(M, MatrixXcd::Identity(N, N));
  using flyball::detail::complex_product;
  const MatrixXcd Xb = complex_product(X, b);
  const MatrixXcd cX = complex_product(c, X);
  point.value = f_.D11.cast<Complex>() + complex_product(c, Xb);
  // G' = c'Xb - cX M'Xb
  const VectorXcd turning = late.cwiseProduct(f_.delays.cast<Complex>());
  MatrixXcd moved = delayed * (turning.asDiagonal() * Xb.bottomRows(k));
  moved.topRows(n) += Xb.topRows(n);
  point.slope = -complex_product(f_.D12.cast<Complex>() * turning.asDiagonal(), Xb.bottomRows(k)) -
                complex_product(cX, moved);
  point.inverse = X.cwiseAbs();
  point.from_inputs = Xb.cwiseAbs();
  point.to_outputs = cX.cwiseAbs();
  return point;
}

MatrixXd DelayBounds::bound(const DelayPoint& point, double radius) const {
  const Index n = f_.A.rows();
  const Index k = f_.delays.size();
  const Index N = n + k;
  if (N == 0) {
    return MatrixXd::Zero(f_.D11.rows(), f_.D11.cols());
  }
  VectorXd moved(k);
  for (Index i = 0; i < k; ++i) {
    moved(i) = std::expm1(f_.delays(i) * radius);
  }
  MatrixXd E = MatrixXd::Zero(N, N);
  E.topLeftCorner(n, n).diagonal().setConstant(radius);
  E.topRightCorner(n, k) = f_.B2.cwiseAbs() * moved.asDiagonal();
  E.bottomRightCorner(k, k) = f_.D22.cwiseAbs() * moved.asDiagonal();
  using flyball::detail::product;
  const auto solved = point.inverse.allFinite()
                          ? neumann(product(point.inverse, E), point.from_inputs)
                          : std::nullopt;
  if (!solved) {
    return MatrixXd::Constant(f_.D11.rows(), f_.D11.cols(), infinity);
  }
  return product(f_.D12.cwiseAbs() * moved.asDiagonal(), solved->bottomRows(k)) +
         product(point.to_outputs, product(E, *solved));
}

MatrixXd DelayBounds::beyond(double frequency) const {
  const MatrixXd none = MatrixXd::Constant(f_.D11.rows(), f_.D11.cols(), infinity);
  if (!(frequency > size_of_A_)) {
    return none;
  }
  // |C (jωI - A)⁻¹B| <= ‖C‖‖B‖/(ω - ‖A‖), row by row and column by column.
  const double r = std::isinf(frequency) ? 0.0 : 1.0 / (frequency - size_of_A_);
  const auto gain = [&](const MatrixXd& C, const MatrixXd& B, const MatrixXd& D) {
    return MatrixXd(D.cwiseAbs() + r * C.rowwise().norm() * B.colwise().norm());
  };
  const auto z = neumann(gain(f_.C2, f_.B2, f_.D22), gain(f_.C2, f_.B1, f_.D21));
  if (!z) {
    return none;
  }
  return gain(f_.C1, f_.B1, f_.D11) + flyball::detail::product(gain(f_.C1, f_.B2, f_.D12), *z);
}

double DelayBounds::largest_at_infinity() const {
  const Index k = f_.delays.size();
  const auto size = [&](const VectorXd& angles) {
    VectorXcd late(k);
    for (Index i = 0; i < k; ++i) {
      late(i) = std::polar(1.0, angles(i));
    }
    MatrixXcd M = -f_.D22.cast<Complex>() * late.asDiagonal();
    M.diagonal().array() += 1.0;
    MatrixXcd G = f_.D11.cast<Complex>();
    if (k > 0) {
      G += f_.D12.cast<Complex>() * late.asDiagonal() *
           flyball::detail::solve_complex(M, f_.D21.cast<Complex>());
    }
    return G.allFinite() ? flyball::detail::singular_values_of_complex(G)(0) : infinity;
  };
  double best = size(VectorXd::Zero(k));
  for (int start = 0; start < (k == 0 ? 0 : 8); ++start) {
    VectorXd angles(k);
    for (Index i = 0; i < k; ++i) {
      angles(i) = std::fmod(2.399963 * static_cast<double>(start * (i + 1) * (i + 2)), 6.2831853);
    }
    double here = size(angles);
    for (double step = 1.0; step > 1e-5; step *= 0.5) {
      constexpr int most_rounds = 20;  // along a ridge steps can go on for ever
      bool better = true;
      for (int round = 0; better && round < most_rounds; ++round) {
        better = false;
        for (Index i = 0; i < k; ++i) {
          for (const double sign : {1.0, -1.0}) {
            VectorXd other = angles;
            other(i) += sign * step;
            if (const double there = size(other); there > here * (1.0 + 1e-10)) {
              here = there;
              angles = other;
              better = std::isfinite(there);
            }
          }
        }
      }
    }
    best = std::max(best, here);
  }
  return best;
}

}  // namespace flyball::classical::detail
