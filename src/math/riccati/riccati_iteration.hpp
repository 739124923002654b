#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <type_traits>

#include "math/extended/wide_matrix.hpp"
#include "math/riccati/riccati_robust.hpp"

/// Doubling and Newton's method for the matrices of any precision: DoubleDoubleMatrix,
/// QuadDoubleMatrix, WideMatrix.
namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;

/// Relative Newton corrections from here on are rounding; those of an equation whose closed loop
/// has a mode on the boundary end near the square root of the precision, 1e-16.
inline constexpr double converged_step = 1e-18;

template <class Matrix>
struct Equation {
  Matrix A, B, Q, R, N;
  bool continuous = false;
};

/// How far the attempts came.
struct Progress {
  CarefulWork* work = nullptr;  ///< What is left of a budget, where there is one.
  int iterations = 0;           ///< Doubling steps plus Newton steps.
  bool converged = false;       ///< Doubling did, so that a solution seems to be there.
  int idle = 0;                 ///< Newton's corrections shrank no more, so often.

  /// Whether the budget has so many more products of n x n.
  template <class Matrix>
  [[nodiscard]] bool spend(double products, const Matrix& A) const {
    if (work == nullptr) {
      return true;
    }
    const auto n = static_cast<double>(A.rows());
    constexpr double four_times = 12.0;
    constexpr double with_exponents = 4.0;
    constexpr double cost = std::is_same_v<Matrix, WideMatrix> ? with_exponents
                            : Matrix::precision < 1e-40        ? four_times
                                                               : 1.0;
    return work->spend(cost * products * n * n * n);
  }
};

/// X = AᵀXA + C by squared Smith iterations; nothing where A's powers do not vanish.
template <class Matrix>
std::optional<Matrix> solve_stein(Matrix A, Matrix C, const Progress& progress) {
  Matrix X = std::move(C);
  for (int k = 0; k < 110 && progress.spend(3.0, A); ++k) {
    const auto moved = product(A.transpose(), product(X, A));
    X = sum(std::move(X), 1.0, moved);
    const double power = A.norm();
    if (!X.all_finite() || !std::isfinite(power)) {
      return std::nullopt;
    }
    if (power * power < 1e-4 * Matrix::precision) {
      return X;
    }
    A = product(A, A);
  }
  return std::nullopt;
}

/// The solution of the closed loop's Lyapunov equation, AᵀX + XA + C = 0 or AᵀXA - X + C = 0.
template <class Matrix>
std::optional<Matrix> solve_lyapunov(const Matrix& A, const Matrix& C, bool continuous,
                                     const Progress& progress) {
  if (!continuous) {
    return solve_stein(A, C, progress);
  }
  // With the Cayley transform A_d = (A - γI)⁻¹(A + γI) = I + 2γ (A - γI)⁻¹ it is
  // X = A_dᵀX A_d + 2γ (A - γI)⁻ᵀC(A - γI)⁻¹.
  const double norm = A.norm() / std::sqrt(static_cast<double>(A.rows()));
  if (!(norm > 0.0) || !std::isfinite(norm)) {
    return std::nullopt;
  }
  const double gamma = std::exp2(std::round(std::log2(norm)));
  const auto inverse = solve(shifted_diagonal(A, -gamma), Matrix::identity(A.rows()));
  if (!inverse) {
    return std::nullopt;
  }
  return solve_stein(shifted_diagonal(scaled(*inverse, 2.0 * gamma), 1.0),
                     scaled(product(inverse->transpose(), product(C, *inverse)), 2.0 * gamma),
                     progress);
}

/// K, the closed loop and F at X.
template <class Matrix>
struct Evaluation {
  Matrix K;
  Matrix closed_loop;
  Matrix F;
  double scale = 0.0;
};

template <class Matrix>
std::optional<Evaluation<Matrix>> evaluate(const Equation<Matrix>& e, const Matrix& X) {
  const Matrix XA = product(X, e.A);
  const Matrix XB = product(X, e.B);
  std::optional<Matrix> K;
  Matrix terms;
  double scale = 0.0;
  Matrix cross;  // the factor before K in F
  if (e.continuous) {
    cross = sum(XB, 1.0, e.N);
    K = solve(e.R, cross.transpose());
    terms = sum(XA, 1.0, XA.transpose());
    scale = 2.0 * XA.norm();
  } else {
    cross = add_product(e.N, 1.0, e.A.transpose(), XB);
    K = solve(symmetrized(add_product(e.R, 1.0, e.B.transpose(), XB)), cross.transpose());
    const Matrix AXA = product(e.A.transpose(), XA);
    terms = sum(AXA, -1.0, X);
    scale = AXA.norm() + X.norm();
  }
  if (!K || !K->all_finite()) {
    return std::nullopt;
  }
  Evaluation<Matrix> result;
  const Matrix feedback = product(cross, *K);
  result.F = symmetrized(sum(sum(std::move(terms), -1.0, feedback), 1.0, e.Q));
  result.scale = scale + feedback.norm() + e.Q.norm();
  result.closed_loop = add_product(e.A, -1.0, e.B, *K);
  result.K = std::move(*K);
  return result;
}

/// The equation without N and R.
template <class Matrix>
struct Reduced {
  Matrix A, G, H;
};

template <class Matrix>
std::optional<Reduced<Matrix>> reduce_extended(const Equation<Matrix>& e) {
  const Index n = e.A.rows();
  const auto solved = solve(e.R, beside(e.B.transpose(), e.N.transpose()));
  if (!solved) {
    return std::nullopt;
  }
  const Matrix Bt = solved->left(n);
  const Matrix Nt = solved->right(n);
  Reduced<Matrix> r{add_product(e.A, -1.0, e.B, Nt), symmetrized(product(e.B, Bt)),
                    symmetrized(add_product(e.Q, -1.0, e.N, Nt))};
  if (!r.A.all_finite() || !r.G.all_finite() || !r.H.all_finite()) {
    return std::nullopt;
  }
  return r;
}

/// The discrete equation in Y = X - X₀.
template <class Matrix>
Equation<Matrix> shift_discrete(const Equation<Matrix>& e, const Matrix& X0) {
  const Matrix XA = product(X0, e.A);
  const Matrix XB = product(X0, e.B);
  return {e.A,
          e.B,
          symmetrized(sum(add_product(e.Q, 1.0, e.A.transpose(), XA), -1.0, X0)),
          symmetrized(add_product(e.R, 1.0, e.B.transpose(), XB)),
          add_product(e.N, 1.0, e.A.transpose(), XB),
          false};
}

/// The continuous one, after its reduction: A - GX₀, G, H + AᵀX₀ + X₀A - X₀GX₀.
template <class Matrix>
Reduced<Matrix> shift_continuous(const Reduced<Matrix>& r, const Matrix& X0) {
  const Matrix XA = product(X0, r.A);
  const Matrix GX = product(r.G, X0);
  const Matrix H = sum(sum(r.H, 1.0, XA), 1.0, XA.transpose());
  return {sum(r.A, -1.0, GX), r.G, symmetrized(add_product(H, -1.0, X0, GX))};
}

/// The discrete equation X = H + AᵀX(I + GX)⁻¹A that a continuous one becomes by the Cayley
/// transform with γ (Chu, Fan and Lin 2005).
template <class Matrix>
std::optional<Reduced<Matrix>> cayley(const Reduced<Matrix>& r, double gamma) {
  const Index n = r.A.rows();
  const Matrix A = shifted_diagonal(r.A, -gamma);
  const auto inverse = solve(A, Matrix::identity(n));
  if (!inverse) {
    return std::nullopt;
  }
  const Matrix AG = product(*inverse, r.G);
  const auto W = solve(add_product(A.transpose(), 1.0, r.H, AG), Matrix::identity(n));
  if (!W) {
    return std::nullopt;
  }
  return Reduced<Matrix>{shifted_diagonal(scaled(W->transpose(), 2.0 * gamma), 1.0),
                         symmetrized(scaled(product(AG, *W), 2.0 * gamma)),
                         symmetrized(scaled(product(product(*W, r.H), *inverse), 2.0 * gamma))};
}

/// Structure-preserving doubling:
///   W = I + GH,  A ← A W⁻¹A,  G ← G + A W⁻¹G Aᵀ,  H ← H + AᵀH W⁻¹A.
template <class Matrix>
std::optional<Matrix> doubling(Reduced<Matrix> r, Progress& progress) {
  const Index n = r.A.rows();
  for (int k = 0; k < 90 && progress.spend(10.0, r.A); ++k) {
    ++progress.iterations;
    const auto solved = solve(shifted_diagonal(product(r.G, r.H), 1.0), beside(r.A, r.G));
    if (!solved) {
      return std::nullopt;
    }
    const Matrix WA = solved->left(n);
    const Matrix dH = symmetrized(product(r.A.transpose(), product(r.H, WA)));
    const double step = dH.norm();
    r.G = sum(std::move(r.G), 1.0,
              symmetrized(product(product(r.A, solved->right(n)), r.A.transpose())));
    r.A = product(r.A, WA);
    r.H = sum(std::move(r.H), 1.0, dH);
    if (!r.H.all_finite()) {
      return std::nullopt;
    }
    if (step <= 100.0 * Matrix::precision * r.H.norm() || !r.G.all_finite() || !r.A.all_finite()) {
      progress.converged = true;
      return r.H;  // without G and A the dual equation has no solution; X's may have been reached
    }
  }
  return r.H;
}

/// Newton's method (Hewer; Kleinman) from a stabilising X.
template <class Matrix>
std::optional<Matrix> newton(const Equation<Matrix>& e, Matrix X, Progress& progress) {
  double previous = std::numeric_limits<double>::infinity();
  // Corrections that are small and shrink no more are what this precision leaves of F.
  constexpr double small = 1e-6;
  // With few states all sixty cost little, and chance may bring one below the bar.
  constexpr int most_idle = 8;
  constexpr Eigen::Index few_states = 4;
  double least = small;
  int idle = 0;
  for (int k = 0; k < 60 && progress.spend(6.0, e.A); ++k) {
    ++progress.iterations;
    const auto here = evaluate(e, X);
    if (!here) {
      return std::nullopt;
    }
    const auto step = solve_lyapunov(here->closed_loop, here->F, e.continuous, progress);
    if (!step) {
      return std::nullopt;
    }
    X = symmetrized(sum(std::move(X), 1.0, *step));
    const double size = X.norm();
    const double relative = step->norm() == 0.0 ? 0.0 : step->norm() / size;
    if (!std::isfinite(relative)) {
      return std::nullopt;
    }
    if (relative < 100.0 * Matrix::precision ||
        (relative < converged_step && relative > 0.1 * previous)) {
      return X;
    }
    // Where X itself is zero but for rounding, relative corrections mean nothing.
    if (size <= 100.0 * Matrix::precision * e.Q.norm()) {
      return X;
    }
    previous = relative;
    const bool shrinks = relative < 0.7 * least;
    idle = shrinks || least == small ? 0 : idle + 1;
    least = shrinks ? relative : least;
    if (idle == most_idle && e.A.rows() > few_states) {
      ++progress.idle;
      return std::nullopt;
    }
  }
  if (!(previous < converged_step)) {
    return std::nullopt;
  }
  return X;
}

/// The solution with all of its digits, and rounded.
template <class Matrix>
struct RiccatiDigits {
  Matrix X;
  Matrix K;
  ExtendedRiccati rounded{};
};

template <class Matrix>
std::optional<RiccatiDigits<Matrix>> finish(const Equation<Matrix>& e, const Matrix& X,
                                            const Progress& progress) {
  const auto exact = evaluate(e, X);
  if (!exact) {
    return std::nullopt;
  }
  ExtendedRiccati answer;
  answer.X = X.rounded();
  answer.K = exact->K.rounded();
  answer.closed_loop = exact->closed_loop.rounded();
  const auto rounded = evaluate(e, Matrix(answer.X));
  const auto gain =
      solve_lyapunov(exact->closed_loop, Matrix::identity(e.A.rows()), e.continuous, progress);
  if (!rounded || !gain) {
    return std::nullopt;
  }
  answer.scale = rounded->scale;
  answer.gain = gain->norm();
  answer.iterations = progress.iterations;
  return RiccatiDigits<Matrix>{X, exact->K, std::move(answer)};
}

/// Different entries, so that no symmetry of the data survives the shift.
inline MatrixXd uneven_diagonal(Index n, double size) {
  MatrixXd D = MatrixXd::Zero(n, n);
  for (Index i = 0; i < n; ++i) {
    D(i, i) = size * (1.0 + 0.6180339887498949 * static_cast<double>(i % 7));
  }
  return D;
}

// A shift moves X by a known amount: it makes a singular R regular, and it takes doubling away
// from data on which it would reach another solution or break down.
inline constexpr double shifts[] = {0.0, 1.0, 30.0, -0.3, 1e-3, 1e3, -10.0};
inline constexpr double cayley_parameters[] = {1.0, 0.03, 30.0};

/// The first of so many shifts and Cayley parameters that leads to the solution. What is left of F
/// at X hardly depends on them: after `idle_attempts` whose corrections shrink no more the
/// precision is taken for not enough.
template <class Matrix>
std::optional<RiccatiDigits<Matrix>> solve_with(const Equation<Matrix>& e,
                                                std::span<const double> factors,
                                                std::span<const double> parts, Progress& progress,
                                                int idle_attempts = 2) {
  const Index n = e.A.rows();
  const int most_idle = progress.idle + idle_attempts;
  const auto reduced = reduce_extended(e);
  const auto attempt = [&](const Matrix& X0, const std::optional<Matrix>& Y) {
    const auto X = Y ? newton(e, sum(X0, 1.0, *Y), progress) : std::nullopt;
    return X ? finish(e, *X, progress) : std::nullopt;
  };
  if (!e.continuous) {
    const double unit = e.Q.norm() > 0.0 ? e.Q.norm() : 1.0;
    for (const double factor : factors) {
      const Matrix X0(uneven_diagonal(n, factor * unit));
      const auto r = factor == 0.0 ? reduced : reduce_extended(shift_discrete(e, X0));
      if (!r) {
        continue;
      }
      if (auto answer = attempt(X0, doubling(*r, progress))) {
        return answer;
      }
      if (progress.idle == most_idle) {
        break;
      }
    }
    return std::nullopt;
  }
  if (!reduced) {
    return std::nullopt;
  }
  const double G = reduced->G.norm();
  const double H = reduced->H.norm();
  const double unit = G > 0.0 && H > 0.0 ? std::sqrt(H / G) : 1.0;
  const double root = std::sqrt(static_cast<double>(n));
  const double base = (reduced->A.norm() + std::sqrt(G * H)) / root;
  for (const double factor : factors) {
    const Matrix X0(uneven_diagonal(n, factor * unit));
    const Reduced<Matrix> r = factor == 0.0 ? *reduced : shift_continuous(*reduced, X0);
    for (const double part : parts) {
      const double gamma = base > 0.0 ? std::exp2(std::round(std::log2(base * part))) : 1.0;
      const auto discrete = cayley(r, gamma);
      if (!discrete) {
        continue;
      }
      if (auto answer = attempt(X0, doubling(*discrete, progress))) {
        return answer;
      }
      if (progress.idle == most_idle) {
        return std::nullopt;
      }
    }
  }
  return std::nullopt;
}

}  // namespace flyball::detail
