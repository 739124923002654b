#include <algorithm>
#include <cmath>
#include <utility>

#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/riccati/riccati_robust.hpp"

namespace flyball::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXi;

/// The units in which the entries that are not zero have the least sum of squared logarithms
/// (Curtis and Reid, J. Inst. Maths Applics 10 (1972)).
RiccatiUnits best_units(const RiccatiProblem& p) {
  const Index n = p.A.rows();
  const Index m = p.B.cols();
  const Index weight = n + m;
  const Index rate = weight + 1;
  const Index unknowns = p.continuous ? n + m + 2 : n + m + 1;
  MatrixXd normal = MatrixXd::Zero(unknowns, unknowns);
  MatrixXd rhs = MatrixXd::Zero(unknowns, 1);
  struct Term {
    Index unknown;
    double factor;
  };
  const auto add = [&](double entry, std::initializer_list<Term> terms) {
    if (entry == 0.0 || !std::isfinite(entry)) {  // A sum may have left the doubles.
      return;
    }
    const double size = std::log2(std::abs(entry));
    for (const Term& a : terms) {
      if (a.unknown >= unknowns) {
        continue;
      }
      rhs(a.unknown, 0) -= a.factor * size;
      for (const Term& b : terms) {
        if (b.unknown < unknowns) {
          normal(a.unknown, b.unknown) += a.factor * b.factor;
        }
      }
    }
  };
  for (Index j = 0; j < n; ++j) {
    for (Index i = 0; i < n; ++i) {
      add(p.A(i, j), {{j, 1.0}, {i, -1.0}, {rate, -1.0}});
      add(p.Q(i, j), {{i, 1.0}, {j, 1.0}, {weight, -1.0}, {rate, -1.0}});
    }
  }
  for (Index j = 0; j < m; ++j) {
    for (Index i = 0; i < n; ++i) {
      add(p.B(i, j), {{n + j, 1.0}, {i, -1.0}});
      add(p.N(i, j), {{i, 1.0}, {n + j, 1.0}, {weight, -1.0}});
    }
    for (Index i = 0; i < m; ++i) {
      add(p.R(i, j), {{n + i, 1.0}, {n + j, 1.0}, {weight, -1.0}, {rate, 1.0}});
    }
  }
  const MatrixXd best = solve_least_squares(normal, rhs);
  const auto rounded = [&](Index first, Index count) -> VectorXi {
    return best.col(0).segment(first, count).array().round().cast<int>();
  };
  return {rounded(0, n), rounded(n, m), rounded(weight, 1)(0),
          p.continuous ? rounded(rate, 1)(0) : 0};
}

/// The power of two of the largest entry.
int exponent(const MatrixXd& M) {
  const double largest = M.cwiseAbs().maxCoeff();
  return largest > 0.0 && std::isfinite(largest) ? std::ilogb(largest) : -2000;
}

/// K = (R + B'X B)⁻¹(B'X A + N') of discrete time, R⁻¹(B'X + N') of continuous, each factor by its
/// largest entry's power of two, so that no product leaves the range of doubles.
MatrixXd gain_of(const RiccatiProblem& given, const MatrixXd& X) {
  const int a = given.continuous ? 0 : exponent(given.A);
  const int b = exponent(given.B);
  const int x = exponent(X);
  const MatrixXd B = times_power(given.B, -b);
  MatrixXd G = product(B.transpose(), times_power(X, -x));
  const MatrixXd weight = given.continuous ? MatrixXd(0.0 * given.R) : product(G, B);
  if (!given.continuous) {
    G = product(G, times_power(given.A, -a));
  }
  const int g = given.N.isZero(0.0) ? a + b + x : std::max(a + b + x, exponent(given.N));
  G = times_power(G, a + b + x - g) + times_power(given.N.transpose(), -g);
  const int r = given.continuous ? exponent(given.R) : std::max(exponent(given.R), 2 * b + x);
  const MatrixXd M = times_power(given.R, -r) + times_power(weight, 2 * b + x - r);
  return times_power(solve_linear(M, G), g - r);
}

/// The answer of doubles in those units, which may have lost what is small there.
Expected<RiccatiSolution> solve_in_doubles(const RiccatiProblem& given, const RiccatiUnits& units) {
  const VectorXi& x = units.states;
  const VectorXi& u = units.inputs;
  const RiccatiProblem p{times_powers(given.A, -x, x, -units.rate),
                         times_powers(given.B, -x, u, 0),
                         times_powers(given.Q, x, x, -units.weight - units.rate),
                         times_powers(given.R, u, u, -units.weight + units.rate),
                         times_powers(given.N, x, u, -units.weight),
                         given.continuous,
                         units.rate,
                         given.work};
  const char* const where = p.continuous ? "care" : "dare";
  if (!p.A.allFinite() || !p.B.allFinite() || !p.Q.allFinite() || !p.R.allFinite() ||
      !p.N.allFinite()) {
    return tl::unexpected(
        Error(RiccatiError::no_convergence)
            .in(where)
            .about("A, B, Q and R")
            .got("entries too far apart for doubles")
            .hint("choose units in which the numbers are nearer to 1, and leave out what is zero"));
  }
  FLYBALL_TRY(auto solution, solve_riccati_robustly(p));
  const MatrixXd X = times_powers(solution.X, -x, -x, units.weight);
  MatrixXd K = times_powers(solution.K, u, -x, units.rate);
  if (X.allFinite() && (K.array() == 0.0).any()) {
    // Below the smallest double in those units, and perhaps not in these.
    const MatrixXd direct = gain_of(given, X);
    K = (K.array() == 0.0 && direct.array().isFinite()).select(direct, K);
  }
  solution.X = X;
  solution.K = K;
  return solution;
}

Error beyond_doubles(const RiccatiSolution& solution, const char* where) {
  return Error(RiccatiError::overflow)
      .in(where)
      .about(!solution.X.allFinite()   ? "X"
             : !solution.K.allFinite() ? "K"
                                       : "A - BK")
      .hint(
          "choose units in which the numbers are nearer to 1: weights may be multiplied by any "
          "number");
}

/// Whether X and K, as they are answered, leave little of their equations in the units that were
/// given and in those of the entries, and A - BK is stable; its poles, and the larger residual.
Expected<void> vouch(const RiccatiProblem& given, const RiccatiUnits& units,
                     RiccatiSolution& solution) {
  const char* const where = given.continuous ? "care" : "dare";
  if (!solution.X.allFinite() || !solution.K.allFinite()) {
    return tl::unexpected(beyond_doubles(solution, where));
  }
  const RiccatiUnits none{VectorXi::Zero(given.A.rows()), VectorXi::Zero(given.B.cols()), 0, 0};
  FLYBALL_CHECK(judge_riccati(given, wide_riccati_residual(given, units, solution), solution));
  FLYBALL_CHECK(judge_riccati(given, wide_riccati_residual(given, none, solution), solution));
  solution.poles = wide_riccati_poles(given, units, solution.K);
  if (!solution.poles.allFinite()) {
    return tl::unexpected(beyond_doubles(solution, where));
  }
  return check_stable(given, solution);
}

}  // namespace

Expected<RiccatiSolution> solve_riccati_in_other_units(const RiccatiProblem& given) {
  const RiccatiUnits units = best_units(given);
  auto solution = solve_in_doubles(given, units);
  if (!solution && !solution.error().is(RiccatiError::no_convergence)) {
    return solution;
  }
  if (solution) {
    const Expected<void> vouched = vouch(given, units, *solution);
    if (vouched) {
      return solution;
    }
    solution = tl::unexpected(vouched.error());
  }
  auto wide = solve_riccati_wide(given, units);
  if (!wide) {
    return solution;
  }
  FLYBALL_CHECK(vouch(given, units, *wide));
  return std::move(*wide);
}

}  // namespace flyball::detail
