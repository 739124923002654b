#include <cmath>
#include <limits>

#include "control/placement.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;

/// The next columns of Q and of T above and on the diagonal block.
struct Columns {
  Eigen::MatrixXd q;      ///< In coordinates of the complement.
  Eigen::MatrixXd above;  ///< T above the diagonal.
  Eigen::MatrixXd block;  ///< 1 x 1, or 2 x 2 with a conjugate pair.
  double departure = std::numeric_limits<double>::infinity();  ///< From normality, squared.
  double size = 1.0;  ///< Of the second of a pair, for a block [α βs; -β/s α], s a power of two.
};

/// An invariant vector z + iy (complement coordinates w, coordinates t of the columns before) for a
/// complex pole as two orthonormal real columns.
Columns real_pair(Eigen::VectorXcd w, Eigen::VectorXcd t, Complex pole) {
  // A turn of the complex vector makes its real and imaginary part orthogonal: Im Σ w² = 0.
  const Complex square = (w.array() * w.array()).sum();
  const Complex turn = std::polar(1.0, -0.5 * std::arg(square));
  w *= turn;
  t *= turn;
  const double a = w.real().norm();
  const double b = w.imag().norm();
  Columns columns;
  if (!(b > 1e-14 * a) || !(a > 0.0)) {
    return columns;
  }
  columns.q.resize(w.size(), 2);
  columns.q.col(0) = w.real() / a;
  columns.q.col(1) = w.imag() / b;
  columns.q.col(1) -= columns.q.col(0) * columns.q.col(0).dot(columns.q.col(1));
  columns.q.col(1).normalize();
  columns.above.resize(t.size(), 2);
  columns.above.col(0) = t.real() / a;
  columns.above.col(1) = t.imag() / b;
  const double alpha = pole.real();
  const double beta = pole.imag();
  columns.block.resize(2, 2);
  const double s = std::exp2(std::round(std::log2(a / b)));
  columns.block << alpha, beta * s, -beta / s, alpha;
  columns.size = s * (b / a);
  const double skew = beta * (a / b - b / a);
  columns.departure = columns.above.squaredNorm() + skew * skew;
  return columns;
}

Columns real_single(const Eigen::VectorXcd& w, const Eigen::VectorXcd& t, double pole) {
  Columns columns;
  Eigen::Index largest = 0;
  if (!(w.cwiseAbs().maxCoeff(&largest) > 0.0)) {
    return columns;
  }
  const Complex turn = std::conj(w(largest)) / std::abs(w(largest));
  const Eigen::VectorXd real = (w * turn).real();
  const double size = real.norm();
  columns.q = real / size;
  columns.above = (t * turn).real() / size;
  columns.block = Eigen::MatrixXd::Constant(1, 1, pole);
  columns.departure = columns.above.squaredNorm();
  return columns;
}

/// Among the vectors that may come next, one with little of T above the diagonal: the closed loop
/// stays close to normal, and the gain small.
Columns next_columns(const Eigen::MatrixXcd& space, Eigen::Index complement, Complex pole) {
  const Eigen::MatrixXcd outside = space.topRows(complement);
  const Eigen::MatrixXcd inside = space.bottomRows(space.rows() - complement);
  const bool two = pole.imag() != 0.0 && space.cols() > 1;
  const Eigen::MatrixXcd directions = leading_directions(outside, two ? 2 : 1);
  if (pole.imag() == 0.0) {
    return real_single(outside * directions.col(0), inside * directions.col(0), pole.real());
  }
  Columns best = real_pair(outside * directions.col(0), inside * directions.col(0), pole);
  if (two) {
    for (const Complex mix : {Complex(0.0, 1.0), Complex(0.0, -1.0), Complex(1.0), Complex(-1.0)}) {
      const Eigen::VectorXcd c = directions.col(0) + mix * directions.col(1);
      Columns candidate = real_pair(outside * c, inside * c, pole);
      if (candidate.departure < best.departure) {
        best = std::move(candidate);
      }
    }
  }
  return best;
}

}  // namespace

std::optional<PlacedLoop> place_triangular(const PlacementProblem& problem) {
  const Eigen::Index n = problem.A.rows();
  // The columns of an orthogonal Q from the left: A q - Q t - p q must lie in the range of B, [0 I]
  // of it vanish.
  Eigen::MatrixXd Q(n, n);
  Eigen::MatrixXd complement = Eigen::MatrixXd::Identity(n, n);
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(n, n);
  const Eigen::Index unreached = n - problem.rank;
  Eigen::VectorXd sizes = Eigen::VectorXd::Ones(n);
  for (Eigen::Index j = 0; j < n;) {
    const Complex pole = problem.poles(j);
    const Eigen::Index free = n - j;
    Eigen::MatrixXcd M(unreached, n);
    M.leftCols(free) = product(problem.A.bottomRows(unreached), complement).cast<Complex>() -
                       pole * complement.bottomRows(unreached).cast<Complex>();
    M.rightCols(j) = -Q.bottomLeftCorner(unreached, j).cast<Complex>();
    const Columns columns = next_columns(null_space_of(M), free, pole);
    if (!std::isfinite(columns.departure)) {
      return std::nullopt;
    }
    const Eigen::Index width = columns.block.rows();
    if (width > free) {
      return std::nullopt;
    }
    T.block(0, j, j, width) = columns.above;
    T.block(j, j, width, width) = columns.block;
    sizes(j + width - 1) = columns.size;
    // The complement's coordinates of the new columns, completed to an orthogonal matrix; its first
    // columns are the new ones up to sign, which the triangular factor has.
    const OrthogonalTriangular completed = full_qr(columns.q);
    Eigen::MatrixXd turned = product(complement, completed.Q);
    for (Eigen::Index k = 0; k < width; ++k) {
      if (completed.R(k, k) < 0.0) {
        turned.col(k) = -turned.col(k);
      }
    }
    Q.middleCols(j, width) = turned.leftCols(width);
    complement = turned.rightCols(free - width);
    j += width;
  }
  // In columns of these sizes the blocks of pairs have their poles to the last bit.
  const Eigen::MatrixXd blocks = T;
  T = sizes.cwiseInverse().asDiagonal() * T * sizes.asDiagonal();
  for (Eigen::Index j = 0; j < n; ++j) {
    const Eigen::Index width = problem.poles(j).imag() != 0.0 ? 2 : 1;
    T.block(j, j, width, width) = blocks.block(j, j, width, width);
    j += width - 1;
  }
  PlacedLoop loop{Q * sizes.asDiagonal(), T, 0.0};
  if (!loop.X.allFinite() || !loop.T.allFinite()) {
    return std::nullopt;
  }
  return loop;
}

}  // namespace flyball::detail
