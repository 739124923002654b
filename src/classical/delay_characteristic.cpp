#include <algorithm>
#include <cmath>

#include "classical/delay_characteristic.hpp"
#include "core/constants.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/spectral_blocks.hpp"
#include "systems/balance.hpp"

namespace flyball::classical::detail {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;
using flyball::detail::eigenvalues_of;
using flyball::detail::product;

namespace {

/// Of functions at the p + 1 points (1 - cos πj/p)/2 of [0, 1].
MatrixXd chebyshev_derivative(Index p) {
  const auto node = [&](Index j) {
    return 0.5 * (1.0 - std::cos(pi * static_cast<double>(j) / static_cast<double>(p)));
  };
  MatrixXd D = MatrixXd::Zero(p + 1, p + 1);
  for (Index i = 0; i <= p; ++i) {
    const double ci = i == 0 || i == p ? 2.0 : 1.0;
    for (Index j = 0; j <= p; ++j) {
      if (i != j) {
        const double cj = j == 0 || j == p ? 2.0 : 1.0;
        D(i, j) = ci / cj * ((i + j) % 2 == 0 ? 1.0 : -1.0) / (node(i) - node(j));
        D(i, i) -= D(i, j);
      }
    }
  }
  return D;
}

}  // namespace

double radius_of(const MatrixXd& M) {
  return M.size() > 0 ? eigenvalues_of(M).cwiseAbs().maxCoeff() : 0.0;
}

Characteristic::Characteristic(const DelayForm& form) : delays_(form.delays), D_(form.D22) {
  const auto scaling = flyball::detail::scaling_of(form.A, form.B2, form.C2).states;
  const VectorXd inverse = scaling.cwiseInverse();
  A_ = inverse.asDiagonal() * form.A * scaling.asDiagonal();
  B_ = inverse.asDiagonal() * form.B2;
  C_ = form.C2 * scaling.asDiagonal();
  open_ = flyball::detail::eigenvalues_by_parts_of(A_);
}

VectorXcd Characteristic::late(Complex s) const {
  VectorXcd factors(delays_.size());
  for (Index i = 0; i < factors.size(); ++i) {
    factors(i) = std::exp(-s * delays_(i));
  }
  return factors;
}

MatrixXcd Characteristic::at(Complex s) const {
  const Index n = states();
  const Index k = delays_.size();
  const VectorXcd factors = late(s);
  MatrixXcd M(n + k, n + k);
  M.topLeftCorner(n, n) = -A_.cast<Complex>();
  M.topLeftCorner(n, n).diagonal().array() += s;
  M.topRightCorner(n, k) = -B_.cast<Complex>() * factors.asDiagonal();
  M.bottomLeftCorner(k, n) = -C_.cast<Complex>();
  M.bottomRightCorner(k, k) = -D_.cast<Complex>() * factors.asDiagonal();
  M.bottomRightCorner(k, k).diagonal().array() += 1.0;
  return M;
}

MatrixXcd Characteristic::slope(Complex s) const {
  const Index n = states();
  const Index k = delays_.size();
  const VectorXcd factors = late(s).cwiseProduct(delays_.cast<Complex>());
  MatrixXcd M = MatrixXcd::Zero(n + k, n + k);
  M.topLeftCorner(n, n).setIdentity();
  M.topRightCorner(n, k) = B_.cast<Complex>() * factors.asDiagonal();
  M.bottomRightCorner(k, k) = D_.cast<Complex>() * factors.asDiagonal();
  return M;
}

MatrixXcd Characteristic::around(Complex s) const {
  const Index n = states();
  if (n == 0) {
    return D_.cast<Complex>();
  }
  MatrixXcd shifted = -A_.cast<Complex>();
  shifted.diagonal().array() += s;
  return flyball::detail::complex_product(
             C_.cast<Complex>(), flyball::detail::solve_complex(shifted, B_.cast<Complex>())) +
         D_.cast<Complex>();
}

double Characteristic::gain(double frequency) const {
  const MatrixXd size = around({0.0, frequency}).cwiseAbs();
  return size.allFinite() ? radius_of(size) : infinity;
}

MatrixXd Characteristic::discretised(const std::vector<Index>& points) const {
  const Index n = states();
  const Index k = delays_.size();
  Index size = n;
  std::vector<Index> first;
  for (const Index p : points) {
    first.push_back(size);
    size += p;
  }
  MatrixXd w = MatrixXd::Zero(k, size);
  for (Index i = 0; i < k; ++i) {
    const auto at = static_cast<std::size_t>(i);
    w(i, first[at] + points[at] - 1) = 1.0;
  }
  MatrixXd z = product(D_, w);
  z.leftCols(n) += C_;
  MatrixXd M = MatrixXd::Zero(size, size);
  M.topRows(n) = product(B_, w);
  M.topLeftCorner(n, n) += A_;
  for (Index i = 0; i < k; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Index p = points[at];
    const MatrixXd D = chebyshev_derivative(p) / delays_(i);
    M.block(first[at], first[at], p, p) -= D.bottomRightCorner(p, p);
    M.middleRows(first[at], p) -= D.col(0).tail(p) * z.row(i);
  }
  return M;
}

double largest_radius(const MatrixXd& D) {
  const Index k = D.rows();
  const auto radius = [&](const VectorXd& angles) {
    VectorXcd turned(k);
    for (Index i = 0; i < k; ++i) {
      turned(i) = std::polar(1.0, angles(i));
    }
    return flyball::detail::eigenvalues_of_complex(D.cast<Complex>() * turned.asDiagonal())
        .cwiseAbs()
        .maxCoeff();
  };
  double best = 0.0;
  const int starts = k == 1 ? 1 : 12;
  constexpr int most_each = 400;  // of all angles a radius is a bound from below
  for (int start = 0; start < starts; ++start) {
    int looked = 0;
    VectorXd angles(k);
    for (Index i = 0; i < k; ++i) {
      // Spread evenly enough, the same each time.
      angles(i) =
          std::fmod(2.399963 * static_cast<double>((start + 1) * (i + 1) * (i + 2)), 2.0 * pi) *
          (start == 0 ? 0.0 : 1.0);
    }
    double here = radius(angles);
    for (double step = 1.0; step > 1e-6; step *= 0.5) {
      for (bool better = true; better && looked < most_each;) {
        better = false;
        for (Index i = 0; i < k; ++i, ++looked) {
          for (const double sign : {1.0, -1.0}) {
            VectorXd moved = angles;
            moved(i) += sign * step;
            const double there = radius(moved);
            if (there > here * (1.0 + 1e-12)) {
              here = there;
              angles = moved;
              better = true;
            }
          }
        }
      }
    }
    best = std::max(best, here);
  }
  return best;
}

double jump_abscissa(const MatrixXd& D, const VectorXd& delays) {
  const auto radius = [&](double c) {
    return radius_of(D.cwiseAbs() * (-c * delays).array().exp().matrix().asDiagonal());
  };
  if (radius_of(D.cwiseAbs()) == 0.0) {
    return -infinity;
  }
  const double unit = 1.0 / delays.maxCoeff();
  double low = -unit;
  double high = unit;
  while (radius(low) < 1.0 && low > -1e6 * unit) {
    low *= 2.0;
  }
  while (radius(high) > 1.0 && high < 1e6 * unit) {
    high *= 2.0;
  }
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (radius(middle) > 1.0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace flyball::classical::detail
