#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "identification/vector_fitting.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"

namespace flyball::identification {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

using Complex = std::complex<double>;

/// 1/(s - p), or for a pair the sum and j times the difference of both: real coefficients.
MatrixXcd basis(const Points& points, const Poles& poles, bool feedthrough) {
  const Index N = count_of(poles);
  MatrixXcd Phi(points.frequency.size(), N + (feedthrough ? 1 : 0));
  for (Index k = 0; k < points.frequency.size(); ++k) {
    const Complex s(0.0, points.frequency(k));
    Index column = 0;
    for (const Pole& pole : poles) {
      const Complex a = 1.0 / (s - Complex(pole.real, pole.imaginary));
      if (pole.imaginary > 0.0) {
        const Complex b = 1.0 / (s - Complex(pole.real, -pole.imaginary));
        Phi(k, column++) = a + b;
        Phi(k, column++) = Complex(0.0, 1.0) * (a - b);
      } else {
        Phi(k, column++) = a;
      }
    }
    if (feedthrough) {
      Phi(k, column) = 1.0;
    }
  }
  return Phi;
}

/// Real and imaginary parts below each other, each row by its weight.
template <class Rows>
void stack(const Rows& rows, const VectorXd& weights, MatrixXd& out, Index column) {
  const Index K = rows.rows();
  out.block(0, column, K, rows.cols()) = weights.asDiagonal() * rows.real();
  out.block(K, column, K, rows.cols()) = weights.asDiagonal() * rows.imag();
}

Poles start(const Points& points, Index count) {
  double low = std::numeric_limits<double>::infinity();
  for (const double frequency : points.frequency) {
    low = frequency > 0.0 ? std::min(low, frequency) : low;
  }
  const double high = points.frequency.maxCoeff();
  Poles poles;
  const Index pairs = count / 2;
  for (Index i = 0; i < pairs; ++i) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(pairs);
    const double at = low * std::pow(high / low, share);
    poles.push_back({-0.01 * at, at});
  }
  if (count % 2 != 0) {
    poles.push_back({-std::sqrt(low * high), 0.0});
  }
  return poles;
}

/// Unstable poles reflected; those on the axis moved off it.
void stabilize(Poles& poles) {
  for (Pole& pole : poles) {
    pole.real = std::min(-std::abs(pole.real), -1e-9 * (std::abs(pole.imaginary) + 1e-6));
  }
}

/// The zeros of σ = d + Σ c_i φ_i.
Poles zeros(const Poles& poles, const VectorXd& c, double d) {
  const Index N = count_of(poles);
  MatrixXd A = MatrixXd::Zero(N, N);
  VectorXd b = VectorXd::Zero(N);
  Index at = 0;
  for (const Pole& pole : poles) {
    if (pole.imaginary > 0.0) {
      A.block(at, at, 2, 2) << pole.real, pole.imaginary, -pole.imaginary, pole.real;
      b(at) = 2.0;
      at += 2;
    } else {
      A(at, at) = pole.real;
      b(at++) = 1.0;
    }
  }
  const VectorXcd found = detail::eigenvalues_of(A - b * c.transpose() / d);
  Poles next;
  for (const Complex& value : found) {
    if (value.imag() >= 0.0) {
      next.push_back({value.real(), value.imag()});
    }
  }
  return next;
}

/// One step of vector fitting; empty where it has no answer.
Poles relocate(const Points& points, const Poles& poles, const FrequencyFitOptions& options) {
  const Index K = points.frequency.size();
  const MatrixXcd Phi = basis(points, poles, options.feedthrough);
  const Index N = count_of(poles);
  const MatrixXcd sigma = basis(points, poles, true);
  const Index own = Phi.cols();
  const Index entries = points.values.cols();
  MatrixXd all((N + 1) * entries + 1, N + 1);
  MatrixXd rows(2 * K, own + N + 1);
  double size = 0.0;
  Index used = 0;
  for (Index e = 0; e < entries; ++e) {
    const VectorXd w = points.weights.col(e);
    stack(Phi, w, rows, 0);
    stack(MatrixXcd(points.values.col(e).asDiagonal() * -sigma), w, rows, own);
    const MatrixXd R = detail::triangle_of(rows);
    const Index left = std::max<Index>(0, R.rows() - own);
    all.middleRows(used, left) = R.bottomRightCorner(left, N + 1);
    used += left;
    size += w.cwiseProduct(points.values.col(e).cwiseAbs()).squaredNorm();
  }
  // Σ Re σ = K keeps σ from vanishing.
  const double weight = std::sqrt(size) / static_cast<double>(K);
  all.row(used) = weight * sigma.real().colwise().sum();
  VectorXd right = VectorXd::Zero(used + 1);
  right(used) = weight * static_cast<double>(K);
  VectorXd unit = all.topRows(used + 1).colwise().norm();
  unit = unit.unaryExpr([](double norm) { return norm > 0.0 ? 1.0 / norm : 1.0; });
  VectorXd c = detail::solve_least_squares(all.topRows(used + 1) * unit.asDiagonal(), right);
  c = c.cwiseProduct(unit);
  if (!c.allFinite()) {
    return {};
  }
  const double d = std::abs(c(N)) > 1e-8 ? c(N) : std::copysign(1e-8, c(N));
  Poles next = zeros(poles, c.head(N), d);
  if (count_of(next) != N) {
    return {};
  }
  if (options.stable) {
    stabilize(next);
  }
  return next;
}

/// The best coefficients for given poles.
Residues residues(const Points& points, const Poles& poles, bool feedthrough) {
  const Index K = points.frequency.size();
  const MatrixXcd Phi = basis(points, poles, feedthrough);
  const Index entries = points.values.cols();
  Residues found{MatrixXd(Phi.cols(), entries), VectorXd(2 * K * entries)};
  MatrixXd rows(2 * K, Phi.cols() + 1);
  for (Index e = 0; e < entries; ++e) {
    const VectorXd w = points.weights.col(e);
    stack(Phi, w, rows, 0);
    stack(points.values.col(e), w, rows, Phi.cols());
    const MatrixXd X = rows.leftCols(Phi.cols());
    VectorXd unit = X.colwise().norm();
    unit = unit.unaryExpr([](double norm) { return norm > 0.0 ? 1.0 / norm : 1.0; });
    const VectorXd scaled =
        detail::solve_least_squares(X * unit.asDiagonal(), rows.col(Phi.cols()));
    found.coefficients.col(e) = unit.cwiseProduct(scaled);
    found.errors.segment(2 * K * e, 2 * K) = X * found.coefficients.col(e) - rows.col(Phi.cols());
  }
  return found;
}

/// Gauss and Newton on the poles alone, the residues following them.
void refine(const Points& points, Poles& poles, Residues& best,
            const FrequencyFitOptions& options) {
  double damping = 1e-3;
  for (int step = 0; step < 30; ++step) {
    std::vector<double*> parameters;
    Poles moved = poles;
    for (Pole& pole : moved) {
      parameters.push_back(&pole.real);
      if (pole.imaginary > 0.0) {
        parameters.push_back(&pole.imaginary);
      }
    }
    MatrixXd J(best.errors.size(), static_cast<Index>(parameters.size()));
    VectorXd scale(J.cols());
    for (Index i = 0; i < J.cols(); ++i) {
      double& parameter = *parameters[static_cast<std::size_t>(i)];
      const double before = parameter;
      const auto pole = std::find_if(moved.begin(), moved.end(), [&](const Pole& of) {
        return &of.real == &parameter || &of.imaginary == &parameter;
      });
      scale(i) = std::hypot(pole->real, pole->imaginary);
      const double change = 1e-6 * scale(i);
      parameter = before + change;
      J.col(i) = (residues(points, moved, options.feedthrough).errors - best.errors) * 1e6;
      parameter = before;
    }
    bool better = false;
    while (!better && damping < 1e8) {
      MatrixXd damped(J.rows() + J.cols(), J.cols());
      damped << J, MatrixXd((std::sqrt(damping) * J.colwise().norm()).asDiagonal());
      VectorXd right = VectorXd::Zero(damped.rows());
      right.head(J.rows()) = -best.errors;
      const VectorXd change = detail::solve_least_squares(damped, right);
      Poles candidate = moved;
      Index at = 0;
      bool proper = change.allFinite();
      for (Pole& pole : candidate) {
        const double size = scale(at);
        pole.real += size * change(at++);
        if (pole.imaginary > 0.0) {
          pole.imaginary += size * change(at++);
          proper = proper && pole.imaginary > 0.0;
        }
      }
      if (options.stable) {
        stabilize(candidate);
      }
      if (proper) {
        Residues found = residues(points, candidate, options.feedthrough);
        if (found.errors.squaredNorm() < best.errors.squaredNorm()) {
          better = true;
          const bool settled =
              found.errors.squaredNorm() > (1.0 - 1e-9) * best.errors.squaredNorm();
          poles = candidate;
          best = std::move(found);
          damping = std::max(0.1 * damping, 1e-12);
          if (settled) {
            return;
          }
          break;
        }
      }
      damping *= 10.0;
    }
    if (!better) {
      return;
    }
  }
}

}  // namespace

Index count_of(const Poles& poles) {
  Index count = 0;
  for (const Pole& pole : poles) {
    count += pole.imaginary > 0.0 ? 2 : 1;
  }
  return count;
}

VectorFit fit_vectors(const Points& points, const FrequencyFitOptions& options, double size) {
  Poles poles = start(points, options.poles);
  VectorFit best{poles, residues(points, poles, options.feedthrough)};
  double last = std::numeric_limits<double>::infinity();
  int worse = 0;
  while (best.iterations < options.most_iterations && worse < 5) {
    ++best.iterations;
    poles = relocate(points, poles, options);
    if (poles.empty()) {
      break;
    }
    Residues now = residues(points, poles, options.feedthrough);
    const double error = now.errors.norm();
    if (error < best.residues.errors.norm()) {
      best.residues = std::move(now);
      best.poles = poles;
    }
    worse = error < (1.0 - 1e-4) * last ? 0 : worse + 1;
    last = error;
    if (error <= 1e-14 * size) {
      break;
    }
  }
  if (best.residues.errors.norm() > 1e-13 * size) {
    refine(points, best.poles, best.residues, options);
  }
  return best;
}

}  // namespace flyball::identification
