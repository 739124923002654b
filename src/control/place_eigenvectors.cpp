#include <cmath>
#include <limits>
#include <vector>

#include <flyball/core/random.hpp>

#include "control/placement.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;

/// Eigenvectors of unit length, conjugate pairs side by side, and the inverse of their matrix.
struct Eigenvectors {
  Eigen::MatrixXcd X;
  Eigen::MatrixXcd inverse;

  [[nodiscard]] double condition() const { return X.norm() * inverse.norm(); }

  [[nodiscard]] bool invert() {
    double rcond = 0.0;
    inverse = solve_complex(X, Eigen::MatrixXcd::Identity(X.rows(), X.cols()), &rcond);
    return rcond > 1e-15 && inverse.allFinite();
  }

  /// Puts x at column j; false where that would make the columns dependent.
  bool replace(Eigen::Index j, const Eigen::VectorXcd& x) {
    const Eigen::VectorXcd along = inverse * x;
    if (!(std::abs(along(j)) > 1e-14)) {
      return false;
    }
    const Eigen::RowVectorXcd row = inverse.row(j) / along(j);
    inverse.noalias() -= along * row;
    inverse.row(j) = row;
    X.col(j) = x;
    return true;
  }
};

/// The eigenvector spaces S_j = {x : [0 I] (A - p_j I) x = 0}, orthonormal bases.
std::vector<Eigen::MatrixXcd> allowed_spaces(const PlacementProblem& problem) {
  const Eigen::Index n = problem.A.rows();
  std::vector<Eigen::MatrixXcd> spaces;
  for (Eigen::Index j = 0; j < n; ++j) {
    if (j > 0 && problem.poles(j) == problem.poles(j - 1)) {
      spaces.push_back(spaces.back());
    } else if (j > 0 && problem.poles(j) == std::conj(problem.poles(j - 1)) &&
               problem.poles(j).imag() != 0.0) {
      spaces.push_back(spaces.back().conjugate());
    } else if (problem.poles(j).imag() == 0.0) {
      spaces.emplace_back(
          UnreachedRows<double>(problem, problem.poles(j).real()).null_space().cast<Complex>());
    } else {
      spaces.push_back(UnreachedRows<Complex>(problem, problem.poles(j)).null_space());
    }
  }
  return spaces;
}

/// Each vector as far as its space allows from the span of those before it.
Eigen::MatrixXcd greedy_start(const PlacementProblem& problem,
                              const std::vector<Eigen::MatrixXcd>& spaces) {
  const Eigen::Index n = problem.A.rows();
  Eigen::MatrixXcd X = Eigen::MatrixXcd::Zero(n, n);
  Eigen::MatrixXcd span(n, 0);
  const auto extend = [&](Eigen::VectorXcd v) {
    for (int pass = 0; pass < 2; ++pass) {
      v -= span * (span.adjoint() * v);
    }
    if (v.norm() > 1e-12) {
      span.conservativeResize(Eigen::NoChange, span.cols() + 1);
      span.col(span.cols() - 1) = v.normalized();
    }
  };
  for (Eigen::Index j = 0; j < n; ++j) {
    const Eigen::MatrixXcd& S = spaces[static_cast<std::size_t>(j)];
    const Eigen::MatrixXcd outside = S - complex_product(span, complex_product(span.adjoint(), S));
    const bool pair = problem.poles(j).imag() != 0.0;
    const bool two = pair && S.cols() > 1;
    const Eigen::MatrixXcd directions = leading_directions(outside, two ? 2 : 1);
    Eigen::VectorXcd x = S * directions.col(0);
    if (two) {
      x = (x + Complex(0.0, 1.0) * (S * directions.col(1))) * std::sqrt(0.5);
    }
    X.col(j) = x;
    extend(x);
    if (pair) {
      X.col(++j) = x.conjugate();
      extend(X.col(j));
    }
  }
  return X;
}

Eigen::MatrixXcd random_start(const PlacementProblem& problem,
                              const std::vector<Eigen::MatrixXcd>& spaces, Random& random) {
  const Eigen::Index n = problem.A.rows();
  Eigen::MatrixXcd X(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const Eigen::MatrixXcd& S = spaces[static_cast<std::size_t>(j)];
    const bool pair = problem.poles(j).imag() != 0.0;
    Eigen::VectorXcd c(S.cols());
    for (Eigen::Index i = 0; i < c.size(); ++i) {
      c(i) = Complex(random.normal(), pair ? random.normal() : 0.0);
    }
    X.col(j) = (S * c).normalized();
    if (pair) {
      X.col(j + 1) = X.col(j).conjugate();
      ++j;
    }
  }
  return X;
}

/// The c of unit length with the largest | |pᴴc|² - |qᴴc|² |: an eigenvector of ppᴴ - qqᴴ.
Eigen::VectorXcd widest(const Eigen::VectorXcd& p, const Eigen::VectorXcd& q) {
  const double P = p.squaredNorm();
  const double Q = q.squaredNorm();
  if (P < 1e-280 || Q <= 1e-28 * P) {
    return P > 0.0 ? p.normalized() : q.normalized();
  }
  // In the basis e_1 = p/‖p‖, e_2 of span{p, q}: q = a e_1 + b e_2.
  const Eigen::VectorXcd e1 = p.normalized();
  const Complex a = e1.dot(q);
  Eigen::VectorXcd e2 = q - a * e1;
  const double b = e2.norm();
  if (b <= 1e-14 * std::sqrt(Q)) {
    return e1;
  }
  e2 /= b;
  const double trace = P - Q;
  const double root = std::sqrt(trace * trace + 4.0 * P * b * b);
  const double value = 0.5 * (trace >= 0.0 ? trace + root : trace - root);
  const Complex first = a * b;
  const double second = P - std::norm(a) - value;
  if (std::norm(first) + second * second < 1e-28 * value * value) {
    return trace >= 0.0 ? e1 : e2;
  }
  return (first * e1 + second * e2).normalized();
}

/// One sweep: each eigenvector (and its conjugate with it) to where the volume is largest.
void sweep(const PlacementProblem& problem, const std::vector<Eigen::MatrixXcd>& spaces,
           Eigenvectors& eigenvectors) {
  const Eigen::Index n = problem.A.rows();
  for (Eigen::Index j = 0; j < n; ++j) {
    const Eigen::MatrixXcd& S = spaces[static_cast<std::size_t>(j)];
    const Eigen::VectorXcd p = (eigenvectors.inverse.row(j) * S).adjoint();
    if (problem.poles(j).imag() == 0.0) {
      // The volume is |y x| with y the row of the inverse, orthogonal to all other eigenvectors.
      if (p.norm() > 0.0) {
        eigenvectors.replace(j, (S * p.normalized()).normalized());
      }
      continue;
    }
    const Eigen::VectorXcd q = (eigenvectors.inverse.row(j + 1) * S).adjoint();
    const Eigen::VectorXcd x = (S * widest(p, q)).normalized();
    const Eigenvectors before = eigenvectors;
    if (!eigenvectors.replace(j, x) || !eigenvectors.replace(j + 1, x.conjugate())) {
      eigenvectors = before;
    }
    ++j;
  }
}

/// In real arithmetic: [Re x, Im x] carries [α β; -β α].
PlacedLoop real_loop(const Eigen::MatrixXcd& X, const Eigen::VectorXcd& poles) {
  const Eigen::Index n = X.rows();
  PlacedLoop loop{Eigen::MatrixXd(n, n), Eigen::MatrixXd::Zero(n, n), 0.0};
  for (Eigen::Index j = 0; j < n; ++j) {
    const double alpha = poles(j).real();
    const double beta = poles(j).imag();
    loop.T(j, j) = alpha;
    if (beta == 0.0) {
      // A real space has a real basis up to one common phase.
      Eigen::Index largest = 0;
      X.col(j).cwiseAbs().maxCoeff(&largest);
      const Complex phase = X(largest, j) / std::abs(X(largest, j));
      loop.X.col(j) = (X.col(j) * std::conj(phase)).real();
      continue;
    }
    loop.X.col(j) = X.col(j).real();
    loop.X.col(j + 1) = X.col(j).imag();
    loop.T(j, j + 1) = beta;
    loop.T(j + 1, j) = -beta;
    loop.T(j + 1, j + 1) = alpha;
    ++j;
  }
  return loop;
}

}  // namespace

std::optional<PlacedLoop> place_eigenvectors(const PlacementProblem& problem) {
  constexpr int sweeps = 60;
  constexpr int fresh = 8;  // Sweeps until the inverse is made anew: rounding adds up.
  constexpr double worthwhile = 1e-3;
  const std::vector<Eigen::MatrixXcd> spaces = allowed_spaces(problem);
  Random random(1);
  const int starts = problem.A.rows() <= 30 ? 3 : 2;
  double best = std::numeric_limits<double>::infinity();
  Eigen::MatrixXcd best_X;
  for (int start = 0; start < starts; ++start) {
    Eigenvectors eigenvectors{
        start == 0 ? greedy_start(problem, spaces) : random_start(problem, spaces, random), {}};
    if (!eigenvectors.invert()) {
      continue;
    }
    double condition = eigenvectors.condition();
    Eigen::MatrixXcd kept = eigenvectors.X;
    for (int i = 0; i < sweeps; ++i) {
      sweep(problem, spaces, eigenvectors);
      if (i % fresh == fresh - 1 && !eigenvectors.invert()) {
        break;
      }
      const double now = eigenvectors.condition();
      const bool better = now < condition;
      const bool improves = now < condition * (1.0 - worthwhile);
      if (better) {
        condition = now;
        kept = eigenvectors.X;
      }
      if (!improves && i > 2) {
        break;
      }
    }
    if (condition < best) {
      best = condition;
      best_X = kept;
    }
  }
  if (best_X.size() == 0) {
    return std::nullopt;
  }
  PlacedLoop loop = real_loop(best_X, problem.poles);
  loop.condition =
      norm2(best_X) *
      norm2(solve_complex(best_X, Eigen::MatrixXcd::Identity(best_X.rows(), best_X.cols())));
  if (!loop.X.allFinite() || !std::isfinite(loop.condition)) {
    return std::nullopt;
  }
  return loop;
}

}  // namespace flyball::detail
