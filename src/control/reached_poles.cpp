#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

#include "control/placement.hpp"
#include "core/constants.hpp"
#include "math/extended/extended_eigenvalues.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;

double scale_of(Complex pole) {
  return std::max(1.0, std::abs(pole));
}

/// What the errors of poles are relative to: each to itself; one at zero, which has no size, to the
/// largest of those that were asked for, or where all are zero to the plant's.
Eigen::VectorXd pole_scales(const Eigen::VectorXcd& wanted, const Eigen::MatrixXd& A) {
  const double largest = wanted.cwiseAbs().maxCoeff();
  const double plant = A.norm();
  const double of_zero = largest > 0.0 ? largest : plant > 0.0 ? plant : 1.0;
  return wanted.cwiseAbs().unaryExpr([&](double p) { return p > 0.0 ? p : of_zero; });
}

/// The eigenvalues of a matrix that is similar to A - B K, and how far each may be from A - B K's.
struct Spectrum {
  Eigen::VectorXcd values;
  Eigen::VectorXd uncertainty;
};

/// How far rounding of `unit` times a matrix of this norm moves eigenvalues of this condition; a
/// defective one has none, and moves by a root.
Eigen::VectorXd moved_by(double unit, double norm, const Eigen::VectorXd& condition) {
  const auto n = static_cast<double>(condition.size());
  const double most = norm * std::pow(unit * n, 1.0 / n);
  return condition.unaryExpr([&](double k) {
    const double moved = unit * n * norm * k;
    return moved < most ? moved : most;
  });
}

/// In doubles where they tell the poles to 1e-10 of their scales; else in twice their precision.
/// `terms`: the sizes that add up to `similar`.
Spectrum spectrum_of(const DoubleDoubleMatrix& similar, const Eigen::MatrixXd& terms,
                     const Eigensystem& system, const Eigen::MatrixXcd& rows,
                     const Eigen::VectorXd& formed, const Eigen::VectorXd& scales) {
  constexpr double enough = 1e-10;
  constexpr double extended_unit = 1e-31;
  const Eigen::MatrixXd rounded = similar.rounded();
  const Eigen::VectorXd d = balance_of(rounded);
  const double norm = (d.cwiseInverse().asDiagonal() * rounded * d.asDiagonal()).norm();
  const Eigen::VectorXd condition =
      (rows * d.asDiagonal())
          .rowwise()
          .norm()
          .cwiseProduct(
              (d.cwiseInverse().asDiagonal() * system.vectors).colwise().norm().transpose());
  Spectrum spectrum{system.values, moved_by(epsilon, norm, condition)};
  if (spectrum.uncertainty.maxCoeff() <= enough * scales.minCoeff()) {
    return spectrum;
  }
  DoubleDoubleMatrix balanced = similar;
  for (Eigen::MatrixXd* part : {&balanced.hi, &balanced.lo}) {
    *part = d.cwiseInverse().asDiagonal() * *part * d.asDiagonal();
  }
  const auto values = extended_eigenvalues_of(balanced);
  if (!values) {
    return spectrum;
  }
  const std::vector<std::size_t> order = matched(system.values, *values);
  const Eigen::VectorXd bounds = moved_by(extended_unit, norm, condition);
  const double formed_norm = (d.cwiseInverse().asDiagonal() * terms * d.asDiagonal()).norm();
  const auto n = static_cast<double>(condition.size());
  const double most =
      norm > 0.0 ? norm * std::pow(extended_unit * n * std::max(1.0, formed_norm / norm), 1.0 / n)
                 : 0.0;
  for (Eigen::Index k = 0; k < system.values.size(); ++k) {
    spectrum.values(k) = (*values)(static_cast<Eigen::Index>(order[static_cast<std::size_t>(k)]));
    const double from_forming = extended_unit * formed(k);
    spectrum.uncertainty(k) = bounds(k) + (from_forming < most ? from_forming : most);
  }
  return spectrum;
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
      const double distance = std::abs(wanted(i) - got(j)) / scale_of(wanted(i));
      pairs.push_back({std::isnan(distance) ? infinite : distance, static_cast<std::size_t>(i),
                       static_cast<std::size_t>(j)});
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

namespace {

/// What is reached, with the largest uncertainty of a pole relative to its scale.
struct Judged {
  Reached reached;
  double uncertainty = infinite;
};

Judged judged_in(const MatrixRef& A, const MatrixRef& B, const MatrixRef& K,
                 const DoubleDoubleMatrix& X, const DoubleDoubleMatrix& inverse,
                 const StateUnits& units, const Eigen::VectorXcd& wanted) {
  const Eigen::Index n = wanted.size();
  Judged judged;
  Reached& reached = judged.reached;
  // X⁻¹ (A - B K) X has the same poles and is nearly triangular: that takes away what doubles would
  // lose in A - B K.
  const DoubleDoubleMatrix driven = product(DoubleDoubleMatrix(K), X);
  const DoubleDoubleMatrix moved =
      add_product(product(DoubleDoubleMatrix(A), X), -1.0, DoubleDoubleMatrix(B), driven);
  const DoubleDoubleMatrix exact = product(inverse, moved);
  const Eigen::MatrixXd similar = exact.rounded();
  if (!similar.allFinite() || !exact.all_finite()) {
    return judged;
  }
  Eigensystem system = eigensystem_of(similar);
  if (!system.values.allFinite()) {
    // The QR iteration can stall on what rounding leaves of a nilpotent matrix.
    const double rounding = 1e-3 * epsilon * similar.norm();
    system = eigensystem_of((similar.array().abs() > rounding).select(similar, 0.0));
  }
  if (!system.values.allFinite()) {
    return judged;
  }
  const Eigen::MatrixXcd rows = solve_complex(system.vectors, Eigen::MatrixXcd::Identity(n, n));
  const Eigen::MatrixXcd right = complex_product(X.rounded().cast<Complex>(), system.vectors);
  const Eigen::MatrixXcd left = complex_product(rows, inverse.rounded().cast<Complex>());
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
  // Of each pole, |yᴴ|(|A||x| + |B||Kx|) + |yᴴB||K||x|: what rounding makes of A - B K here.
  const Eigen::MatrixXd x = right.cwiseAbs();
  const Eigen::MatrixXd fed = complex_product(K.cast<Complex>(), right).cwiseAbs();
  const Eigen::MatrixXd y = left.cwiseAbs();
  const Eigen::MatrixXd y_B = complex_product(left, B.cast<Complex>()).cwiseAbs();
  const Eigen::MatrixXd terms = product(A.cwiseAbs(), x) + product(B.cwiseAbs(), fed);
  // The inverse is off by its digits times |X⁻¹||X|: of dependent vectors it is no inverse.
  const Eigen::MatrixXd X_size = X.rounded().cwiseAbs();
  const Eigen::MatrixXd inverse_size = inverse.rounded().cwiseAbs();
  const double growth = std::max(
      1.0, product(inverse_size, X_size).rowwise().sum().maxCoeff() / static_cast<double>(n));
  const Eigen::VectorXd formed =
      growth * (y.transpose().cwiseProduct(terms).colwise().sum().transpose() +
                y_B.transpose().cwiseProduct(product(K.cwiseAbs(), x)).colwise().sum().transpose());
  const Eigen::VectorXd scales = pole_scales(
      wanted, units.balanced.asDiagonal() * A * units.balanced.cwiseInverse().asDiagonal());
  const Spectrum spectrum = spectrum_of(
      exact,
      growth * product(inverse_size, product(A.cwiseAbs(), X_size) +
                                         product(B.cwiseAbs(), product(K.cwiseAbs(), X_size))),
      system, rows, formed, scales);
  reached.wanted = wanted;
  reached.poles.resize(n);
  reached.left.resize(n, n);
  reached.right.resize(n, n);
  reached.pole_error = 0.0;
  judged.uncertainty = 0.0;
  reached.misplaced = K.allFinite() ? 0.0 : infinite;
  const std::vector<std::size_t> order = matched(wanted, spectrum.values);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<Eigen::Index>(order[static_cast<std::size_t>(i)]);
    reached.poles(i) = spectrum.values(k);
    reached.left.row(i) = left.row(k);
    reached.right.col(i) = right.col(k);
    double sensitivity = std::min(given_left.row(k).norm(), balanced_left(k) * balanced_sizes(k));
    sensitivity = std::isfinite(sensitivity) ? std::max(1.0, sensitivity) : infinite;
    const double error = std::abs(reached.poles(i) - wanted(i));
    judged.uncertainty = std::max(judged.uncertainty, spectrum.uncertainty(k) / scales(i));
    const double relative = (error + spectrum.uncertainty(k)) / scales(i);
    if (!(relative <= reached.pole_error)) {
      reached.pole_error = std::isnan(relative) ? infinite : relative;
      reached.worst = i;
    }
    reached.misplaced = std::max(reached.misplaced, error / (scale_of(wanted(i)) * sensitivity));
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
  return judged;
}

}  // namespace

Reached reached_by(const MatrixRef& A, const MatrixRef& B, const MatrixRef& K,
                   const DoubleDoubleMatrix& X, const DoubleDoubleMatrix& inverse,
                   const StateUnits& units, const Eigen::VectorXcd& wanted) {
  Judged judged = judged_in(A, B, K, X, inverse, units, wanted);
  constexpr double certain = 1e-10;
  if (judged.uncertainty > certain) {
    // Of vectors that are nearly dependent even 31 digits of X⁻¹ (A - B K) X are another matrix's.
    const auto plain = DoubleDoubleMatrix::identity(wanted.size());
    Judged direct = judged_in(A, B, K, plain, plain, units, wanted);
    if (direct.uncertainty < judged.uncertainty) {
      judged = std::move(direct);
    }
  }
  return std::move(judged.reached);
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
