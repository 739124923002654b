#include <algorithm>
#include <cmath>

#include <flyball/core/random.hpp>

#include "core/constants.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/extended/extended_eigenvalues.hpp"
#include "math/riccati/riccati_robust.hpp"

namespace flyball::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// x = D z with powers of two D such that z's A, G and H have comparable rows, columns and
/// entries: minimises Σ A_ij² t_j/t_i + ½ Σ G_ij²/(t_i t_j) + ½ Σ H_ij² t_i t_j over t = D², which
/// is convex in log t, one coordinate after the other.
VectorXd balance(const ReducedRiccati& reduced) {
  const Index n = reduced.A.rows();
  MatrixXd A = reduced.A.cwiseAbs2();
  A.diagonal().setZero();
  const MatrixXd G = reduced.G.cwiseAbs2();
  const MatrixXd H = reduced.H.cwiseAbs2();
  VectorXd t = VectorXd::Ones(n);
  for (int sweep = 0; sweep < 30; ++sweep) {
    double change = 0.0;
    for (Index i = 0; i < n; ++i) {
      double up = 0.0;    // coefficient of t_i
      double down = 0.0;  // coefficient of 1/t_i
      for (Index j = 0; j < n; ++j) {
        if (j != i) {
          up += A(j, i) / t(j) + H(i, j) * t(j);
          down += A(i, j) * t(j) + G(i, j) / t(j);
        }
      }
      if (up + H(i, i) == 0.0 || down + G(i, i) == 0.0) {
        continue;
      }
      // d/d(log t) of up·t + down/t + ½H_ii t² + ½G_ii/t², increasing in log t; bisection.
      double low = -300.0;
      double high = 300.0;
      for (int k = 0; k < 16; ++k) {
        const double middle = 0.5 * (low + high);
        const double s = std::exp2(middle);
        const double slope = up * s - down / s + H(i, i) * s * s - G(i, i) / (s * s);
        (slope > 0.0 ? high : low) = middle;
      }
      const double updated = std::exp2(0.5 * (low + high));
      change = std::max(change, std::abs(std::log2(updated / t(i))));
      t(i) = updated;
    }
    if (change < 0.5) {
      break;
    }
  }
  return t.unaryExpr([](double value) { return std::exp2(std::round(0.5 * std::log2(value))); });
}

/// Inside the boundary by more than an equation whose closed loop lies on it can show: there X is
/// found to the square root of the precision, 1e-16.
bool is_stable(const Eigen::VectorXcd& poles, const MatrixXd& closed_loop, bool continuous) {
  return continuous ? poles.real().maxCoeff() < -1e-15 * closed_loop.norm()
                    : poles.cwiseAbs().maxCoeff() < 1.0 - 1e-14;
}

/// Whether it stays stable whatever the last digits of its entries are: where X cancels to more
/// than twice the working precision, the closed loop may hang on them.
bool survives_rounding(const MatrixXd& closed_loop, bool continuous) {
  constexpr int draws = 8;
  constexpr double step = epsilon;
  Random random(1);
  for (int draw = 0; draw < draws; ++draw) {
    const MatrixXd other = closed_loop.unaryExpr(
        [&](double x) { return x * (random.uniform() < 0.5 ? 1.0 - step : 1.0 + step); });
    if (!is_stable(eigenvalues_of(other), other, continuous)) {
      return false;
    }
  }
  return true;
}

Error hangs_on_digits(const RiccatiProblem& p, const MatrixXd& X) {
  return refusal(RiccatiError::no_convergence, p.continuous ? "care" : "dare", "A - BK")
      .got("stable or not by the last digits of its entries")
      .expected("stable")
      .hint(
          "the plant grows too much in a step, or hangs on its inputs by too little, for 16 "
          "digits: sample faster, or add an input")
      .with("size of X", X.norm());
}

Error out_of_work(const RiccatiProblem& p) {
  return refusal(RiccatiError::no_convergence, p.continuous ? "care" : "dare", "X")
      .got("not found within the work that is left for it")
      .hint("choose units in which the numbers are nearer to 1");
}

}  // namespace

std::optional<ReducedRiccati> reduce(const RiccatiProblem& p) {
  const Index n = p.A.rows();
  MatrixXd rhs(p.R.rows(), 2 * n);
  rhs << p.B.transpose(), p.N.transpose();
  double rcond = 0.0;
  const MatrixXd solved = solve_equilibrated(p.R, rhs, rcond);
  if (!(rcond > 4.0 * epsilon)) {
    return std::nullopt;
  }
  const MatrixXd BN = product(p.B, solved);
  ReducedRiccati reduced{p.A - BN.rightCols(n), symmetrized(BN.leftCols(n)),
                         symmetrized(p.Q - product(p.N, solved.rightCols(n)))};
  if (!reduced.A.allFinite() || !reduced.G.allFinite() || !reduced.H.allFinite()) {
    return std::nullopt;
  }
  return reduced;
}

VectorXd balance_riccati(const RiccatiProblem& p) {
  if (const auto reduced = reduce(p)) {
    return balance(*reduced);
  }
  // R is singular: the sizes of a shifted problem's G serve.
  const double weight = p.Q.cwiseAbs().maxCoeff();
  const MatrixXd shift = (weight > 0.0 ? weight : 1.0) * MatrixXd::Identity(p.A.rows(), p.A.rows());
  const RiccatiProblem regular = shifted(p, shift);
  if (const auto reduced = reduce(regular)) {
    return balance(ReducedRiccati{p.A, reduced->G, p.Q});
  }
  return VectorXd::Ones(p.A.rows());
}

RiccatiProblem shifted(const RiccatiProblem& p, const MatrixXd& X0) {
  const MatrixXd XA = product(X0, p.A);
  const MatrixXd XB = product(X0, p.B);
  return {p.A,
          p.B,
          symmetrized(p.Q + transposed_product(p.A, XA) - X0),
          symmetrized(p.R + transposed_product(p.B, XB)),
          p.N + transposed_product(p.A, XB),
          false};
}

MatrixXd solve_equilibrated(const MatrixXd& M, const MatrixXd& rhs, double& rcond) {
  VectorXd s = VectorXd::Ones(M.rows());
  for (int pass = 0; pass < 3; ++pass) {
    for (Index i = 0; i < M.rows(); ++i) {
      const double largest = (M.row(i).cwiseAbs().transpose().cwiseProduct(s)).maxCoeff() * s(i);
      if (largest > 0.0 && std::isfinite(largest)) {
        s(i) *= std::exp2(-std::round(0.5 * std::log2(largest)));
      }
    }
  }
  const MatrixXd scaled = s.asDiagonal() * M * s.asDiagonal();
  return s.asDiagonal() * solve_linear(scaled, s.asDiagonal() * rhs, &rcond);
}

Expected<RiccatiSolution> solve_riccati_robustly(const RiccatiProblem& problem) {
  const VectorXd d = balance_riccati(problem);
  const VectorXd inverse = d.cwiseInverse();
  const RiccatiProblem p{inverse.asDiagonal() * problem.A * d.asDiagonal(),
                         inverse.asDiagonal() * problem.B,
                         d.asDiagonal() * problem.Q * d.asDiagonal(),
                         problem.R,
                         d.asDiagonal() * problem.N,
                         problem.continuous,
                         problem.rate,
                         problem.work};
  if (auto why = unreached_at_sight(p)) {
    return tl::unexpected(*std::move(why));
  }
  const auto answer = solve_riccati_extended(p);
  if (!answer) {
    return tl::unexpected(p.work != nullptr && p.work->is_done() ? out_of_work(p)
                                                                 : diagnose_riccati(p));
  }
  RiccatiSolution solution;
  solution.X = answer->X;
  solution.K = answer->K;
  solution.poles = eigenvalues_of(answer->closed_loop);
  if (!solution.X.allFinite() || !solution.K.allFinite()) {
    return tl::unexpected(diagnose_riccati(p));
  }
  if (!is_stable(solution.poles, answer->closed_loop, p.continuous) ||
      (answer->cancels && !survives_rounding(answer->closed_loop, p.continuous))) {
    Error why = diagnose_riccati(p);
    if (why.is(RiccatiError::no_convergence)) {
      why = hangs_on_digits(p, answer->X);
    }
    return tl::unexpected(std::move(why));
  }
  const double size = answer->X.norm();
  solution.condition = size > 0.0 ? answer->gain * answer->scale / size : answer->gain;
  solution.iterations = answer->iterations;
  FLYBALL_CHECK(check_riccati(p, solution));
  solution.X = inverse.asDiagonal() * solution.X * inverse.asDiagonal();
  solution.K = solution.K * inverse.asDiagonal();
  FLYBALL_CHECK(check_riccati(problem, solution));
  if (auto poles = riccati_poles(problem.A, problem.B, solution.K)) {
    solution.poles = std::move(*poles);
    FLYBALL_CHECK(check_stable(problem, solution));
  }
  return solution;
}

Expected<void> check_riccati(const RiccatiProblem& p, RiccatiSolution& solution) {
  return judge_riccati(p, riccati_residual(p, solution.X, solution.K), solution);
}

Expected<void> judge_riccati(const RiccatiProblem& p, double residual, RiccatiSolution& solution) {
  solution.residual = std::max(solution.residual, residual);
  if (!(residual <= small_residual)) {
    return tl::unexpected(Error(RiccatiError::no_convergence)
                              .in(p.continuous ? "care" : "dare")
                              .about("X")
                              .got("lost to rounding: it leaves more of the equation")
                              .expected(format_number(small_residual) + " of its terms at most")
                              .hint("choose units in which the numbers are nearer to 1")
                              .with("residual", residual));
  }
  return {};
}

std::optional<Eigen::VectorXcd> riccati_poles(const MatrixRef& A, const MatrixRef& B,
                                              const MatrixRef& K) {
  if (A.rows() > most_states_in_twice) {
    return std::nullopt;
  }
  // In a unit in which the closed loop's entries are ordinary.
  const auto size = [](const MatrixRef& M) {
    const double largest = M.cwiseAbs().maxCoeff();
    return largest > 0.0 ? std::ilogb(largest) : -5000;
  };
  const int exponent = std::max(size(A), size(B) + size(K));
  const int unit = std::abs(exponent) > 200 && exponent > -5000 ? exponent : 0;
  const auto digits = [&](const MatrixRef& M, int power) {
    return DoubleDoubleMatrix(power == 0 ? MatrixXd(M) : times_power(M, power));
  };
  auto poles = balanced_extended_eigenvalues_of(
      add_product(digits(A, -unit), -1.0, digits(B, 0), digits(K, -unit)));
  return poles && unit != 0 ? times_power(*poles, unit) : poles;
}

bool are_stable(const Eigen::VectorXcd& poles, bool continuous) {
  return continuous ? (poles.real().array() < 0.0).all() : (poles.cwiseAbs().array() < 1.0).all();
}

Expected<void> check_stable(const RiccatiProblem& p, const RiccatiSolution& solution) {
  if (!are_stable(solution.poles, p.continuous)) {
    return tl::unexpected(hangs_on_digits(p, solution.X));
  }
  return {};
}

}  // namespace flyball::detail
