#include <algorithm>
#include <cmath>
#include <complex>

#include "control/placement.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;

/// The columns of a triangle R, and y, in coordinates that turn with them.
struct Lattice {
  Eigen::MatrixXd R;
  Eigen::VectorXd y;
  Eigen::MatrixXd U;  ///< Whole numbers: R is the first basis times U.
};

/// Shorter columns that span the same lattice. Source: Lenstra, Lenstra and Lovász, Mathematische
/// Annalen 261 (1982).
void shorten(Lattice& lattice) {
  constexpr double lovasz = 0.75;
  Eigen::MatrixXd& R = lattice.R;
  const Index count = R.cols();
  const Index most = 200 * count * count;
  Index k = 1;
  for (Index step = 0; step < most && k < count; ++step) {
    for (Index i = k - 1; i >= 0; --i) {
      const double times = std::round(R(i, k) / R(i, i));
      if (times != 0.0) {
        R.col(k).head(i + 1) -= times * R.col(i).head(i + 1);
        lattice.U.col(k) -= times * lattice.U.col(i);
      }
    }
    const double below = std::hypot(R(k - 1, k), R(k, k));
    if (below * below >= lovasz * R(k - 1, k - 1) * R(k - 1, k - 1)) {
      ++k;
      continue;
    }
    R.col(k - 1).swap(R.col(k));
    lattice.U.col(k - 1).swap(lattice.U.col(k));
    // Below the diagonal stands now what a rotation of the two rows takes away.
    const double c = R(k - 1, k - 1) / below;
    const double s = R(k, k - 1) / below;
    Eigen::Matrix2d turn;
    turn << c, s, -s, c;
    R.middleRows(k - 1, 2) = (turn * R.middleRows(k - 1, 2)).eval();
    R(k, k - 1) = 0.0;
    lattice.y.segment(k - 1, 2) = (turn * lattice.y.segment(k - 1, 2)).eval();
    k = std::max<Index>(k - 1, 1);
  }
}

/// Whole numbers z with R z near y, by back substitution. Source: Babai, Combinatorica 6 (1986).
Eigen::VectorXd nearest(const Lattice& lattice) {
  Eigen::VectorXd z = Eigen::VectorXd::Zero(lattice.R.cols());
  for (Index i = z.size() - 1; i >= 0; --i) {
    z(i) = std::round(
        (lattice.y(i) - lattice.R.row(i).tail(z.size() - i - 1) * z.tail(z.size() - i - 1)) /
        lattice.R(i, i));
  }
  return lattice.U * z;
}

}  // namespace

std::optional<Eigen::MatrixXd> rounded_together(const MatrixRef& B, const DoubleDoubleMatrix& K,
                                                const Reached& reached) {
  constexpr Index largest = 40;
  constexpr double on_diagonal = 1e-9;
  constexpr double off_diagonal = 1e-5;
  constexpr double of_step = 1e-5;
  const Index n = K.cols();
  const Index m = K.rows();
  const Index count = n * m;
  if (count > largest || reached.left.size() == 0 || !reached.left.allFinite()) {
    return std::nullopt;
  }
  const Eigen::MatrixXd start = K.rounded();
  const Eigen::MatrixXd rest = (start - K.hi) - K.lo;
  // A pole far below one may move by less.
  const Eigen::VectorXd sizes = reached.wanted.cwiseAbs().unaryExpr(
      [](double p) { return p > 0.0 ? std::min(1.0, p) : 1.0; });
  // The eigenvalues move by y_jᴴ B δK x_j: that must be small, and between two eigenvectors what
  // its square makes of it. In units of what is allowed:
  Eigen::MatrixXd allowed(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      const double apart = std::abs(reached.poles(i) - reached.poles(j));
      const double size = std::sqrt(sizes(i) * sizes(j));
      allowed(i, j) = size * std::max(on_diagonal, off_diagonal * std::min(1.0, apart)) *
                      reached.left.row(i).norm() * reached.right.col(j).norm();
    }
  }
  const Eigen::MatrixXcd pushed = complex_product(reached.left, B.cast<Complex>());
  const auto effect_of = [&](const Eigen::MatrixXcd& moved) {
    Eigen::VectorXd effect(2 * n * n);
    for (Index j = 0; j < n; ++j) {
      effect.segment(2 * n * j, n) = moved.col(j).real().cwiseQuotient(allowed.col(j));
      effect.segment(2 * n * j + n, n) = moved.col(j).imag().cwiseQuotient(allowed.col(j));
    }
    return effect;
  };
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(2 * n * n + count, count);
  Eigen::MatrixXd unit(m, n);
  for (Index k = 0; k < n; ++k) {
    for (Index i = 0; i < m; ++i) {
      int exponent = 0;
      std::frexp(std::max(std::abs(start(i, k)), 1e-6 * start.row(i).cwiseAbs().maxCoeff()),
                 &exponent);
      unit(i, k) = std::ldexp(1.0, exponent - 53);
      basis.col(k * m + i).head(2 * n * n) =
          effect_of(unit(i, k) * pushed.col(i) * reached.right.row(k));
      basis(2 * n * n + k * m + i, k * m + i) = of_step;
    }
  }
  Eigen::VectorXd target = Eigen::VectorXd::Zero(basis.rows());
  target.head(2 * n * n) =
      -effect_of(complex_product(complex_product(pushed, rest.cast<Complex>()), reached.right));
  if (!basis.allFinite() || !target.allFinite()) {
    return std::nullopt;
  }
  const OrthogonalTriangular triangle = full_qr(basis);
  Lattice lattice{triangle.R.topRows(count), (triangle.Q.transpose() * target).head(count),
                  Eigen::MatrixXd::Identity(count, count)};
  shorten(lattice);
  const Eigen::VectorXd z = nearest(lattice);
  return start + (unit.reshaped().cwiseProduct(z)).reshaped(m, n);
}

}  // namespace flyball::detail
