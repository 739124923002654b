#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "control/placement.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;

double scale_of(Complex pole) {
  return std::max(1.0, std::abs(pole));
}

/// Real and imaginary parts of the eigenvectors of A - B K in doubles; the identity where they are
/// dependent.
Eigen::MatrixXd real_basis(const Eigen::MatrixXd& closed) {
  const Eigensystem system = eigensystem_of(closed);
  const Eigen::Index n = closed.rows();
  Eigen::MatrixXd X(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    X.col(j) = system.vectors.col(j).real();
    if (system.values(j).imag() != 0.0 && j + 1 < n) {
      X.col(j + 1) = system.vectors.col(j).imag();
      ++j;
    }
  }
  return X;
}

}  // namespace

std::vector<std::size_t> matched(const Eigen::VectorXcd& wanted, const Eigen::VectorXcd& got) {
  struct Pair {
    double distance;
    std::size_t wanted, got;
  };
  std::vector<Pair> pairs;
  for (Eigen::Index i = 0; i < wanted.size(); ++i) {
    for (Eigen::Index j = 0; j < got.size(); ++j) {
      pairs.push_back({std::abs(wanted(i) - got(j)) / scale_of(wanted(i)),
                       static_cast<std::size_t>(i), static_cast<std::size_t>(j)});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.distance < b.distance; });
  constexpr auto none = static_cast<std::size_t>(-1);
  std::vector<std::size_t> match(static_cast<std::size_t>(wanted.size()), none);
  std::vector<bool> taken(static_cast<std::size_t>(got.size()), false);
  for (const Pair& pair : pairs) {
    if (match[pair.wanted] == none && !taken[pair.got]) {
      match[pair.wanted] = pair.got;
      taken[pair.got] = true;
    }
  }
  return match;
}

Reached reached_by(const MatrixRef& A, const MatrixRef& B, const MatrixRef& K,
                   const DoubleDoubleMatrix& X, const DoubleDoubleMatrix& inverse,
                   const StateUnits& units, const Eigen::VectorXcd& wanted) {
  const Eigen::Index n = wanted.size();
  Reached reached;
  // X⁻¹ (A - B K) X has the same poles and is nearly triangular: that takes away what doubles would
  // lose in A - B K.
  const DoubleDoubleMatrix driven = product(DoubleDoubleMatrix(K), X);
  const DoubleDoubleMatrix moved =
      add_product(product(DoubleDoubleMatrix(A), X), -1.0, DoubleDoubleMatrix(B), driven);
  const Eigen::MatrixXd similar = product(inverse, moved).rounded();
  if (!similar.allFinite()) {
    return reached;
  }
  Eigensystem system = eigensystem_of(similar);
  if (!system.values.allFinite()) {
    // The QR iteration can stall on what rounding leaves of a nilpotent matrix.
    const double rounding = 1e-3 * std::numeric_limits<double>::epsilon() * similar.norm();
    system = eigensystem_of((similar.array().abs() > rounding).select(similar, 0.0));
  }
  if (!system.values.allFinite()) {
    return reached;
  }
  const Eigen::MatrixXcd right = complex_product(X.rounded().cast<Complex>(), system.vectors);
  const Eigen::MatrixXcd left =
      complex_product(solve_complex(system.vectors, Eigen::MatrixXcd::Identity(n, n)),
                      inverse.rounded().cast<Complex>());
  // In the units that the plant came in, unit columns.
  Eigen::MatrixXcd given = units.given.asDiagonal() * right;
  const Eigen::VectorXd sizes = given.colwise().norm();
  given *= sizes.cwiseInverse().asDiagonal();
  const Eigen::MatrixXcd given_left =
      sizes.asDiagonal() * left * units.given.cwiseInverse().asDiagonal();
  reached.condition = norm2(given) * norm2(given_left);
  reached.condition = std::isfinite(reached.condition) ? reached.condition : infinite;
  const Eigen::VectorXd balanced_sizes = (units.balanced.asDiagonal() * right).colwise().norm();
  const Eigen::VectorXd balanced_left =
      (left * units.balanced.cwiseInverse().asDiagonal()).rowwise().norm();
  reached.poles.resize(n);
  reached.left.resize(n, n);
  reached.right.resize(n, n);
  reached.pole_error = 0.0;
  reached.misplaced = K.allFinite() ? 0.0 : infinite;
  const std::vector<std::size_t> order = matched(wanted, system.values);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<Eigen::Index>(order[static_cast<std::size_t>(i)]);
    reached.poles(i) = system.values(k);
    reached.left.row(i) = left.row(k);
    reached.right.col(i) = right.col(k);
    double sensitivity = std::min(given_left.row(k).norm(), balanced_left(k) * balanced_sizes(k));
    sensitivity = std::isfinite(sensitivity) ? std::max(1.0, sensitivity) : infinite;
    const double error = std::abs(reached.poles(i) - wanted(i));
    reached.pole_error = std::max(reached.pole_error, error);
    const double off = error / (scale_of(wanted(i)) * sensitivity);
    // No condition excuses an error of the plant's size.
    const bool lost = !(error <= std::max(scale_of(wanted(i)), A.norm()));
    reached.misplaced = std::max(reached.misplaced, lost ? infinite : off);
  }
  // Nor one that makes a loop unstable of which stable poles were asked, in continuous time or in
  // discrete: with one input and thirty states rounding K can.
  const auto beyond = [&](const auto& measure) {
    return measure(wanted).maxCoeff() < 0.0 && !(measure(reached.poles).maxCoeff() < 0.0);
  };
  if (n > 0 && (beyond([](const Eigen::VectorXcd& p) { return Eigen::VectorXd(p.real()); }) ||
                beyond([](const Eigen::VectorXcd& p) {
                  return Eigen::VectorXd(p.cwiseAbs().array() - 1.0);
                }))) {
    reached.misplaced = infinite;
  }
  return reached;
}

Reached reached_by(const MatrixRef& A, const MatrixRef& B, const MatrixRef& K,
                   const StateUnits& units, const Eigen::VectorXcd& wanted) {
  const Eigen::Index n = A.rows();
  DoubleDoubleMatrix X(real_basis(
      add_product(DoubleDoubleMatrix(A), -1.0, DoubleDoubleMatrix(B), DoubleDoubleMatrix(K))
          .rounded()));
  std::optional<DoubleDoubleMatrix> inverse;
  if (X.all_finite()) {
    inverse = solve(X, DoubleDoubleMatrix::identity(n));
  }
  if (!inverse || !inverse->all_finite()) {
    X = DoubleDoubleMatrix::identity(n);
    inverse = X;
  }
  return reached_by(A, B, K, X, *inverse, units, wanted);
}

}  // namespace flyball::detail
