#include <flyball/math/equations/matrix_equation.hpp>

#include <cmath>
#include <limits>
#include <optional>

#include "core/constants.hpp"
#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/equations/lyapunov_correction.hpp"
#include "math/equations/lyapunov_kernel.hpp"
#include "math/equations/sylvester_kernel.hpp"
#include "math/equations/sylvester_operator.hpp"
#include "math/equations/wide_sylvester.hpp"

namespace flyball {

namespace {

using detail::Domain;
using detail::SylvesterOperator;
using detail::times_powers;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// An answer that leaves more of an entry of the equation than this share of its terms is none.
constexpr double largest_backward_error = 1e-11;
/// And where the terms cancel so far in sums of products that X's last digits are all that is left
/// of them, the equation holds for no doubles.
constexpr double largest_residual = 1e-4;

/// As a product CᵀC is, whose entries are summed in different orders.
bool is_symmetric_but_for_rounding(const MatrixRef& Q) {
  for (Index j = 0; j < Q.cols(); ++j) {
    for (Index i = 0; i < j; ++i) {
      const double size = std::max(std::abs(Q(i, j)), std::sqrt(std::abs(Q(i, i) * Q(j, j))));
      if (!(std::abs(Q(i, j) - Q(j, i)) <= 16.0 * epsilon * size)) {
        return false;
      }
    }
  }
  return true;
}

/// A X + X B = F or A X B - X = F; without B: B = Aᵀ.
struct Problem {
  Domain domain;
  MatrixXd A;
  std::optional<MatrixXd> B;
  MatrixXd F;
  bool symmetric;       ///< X is to be so to the last bit.
  bool coarse = false;  ///< Its first digits are what is wanted: as a correction of another.
};

/// Neither huge nor tiny: the squares of such numbers are sums' terms without a loss. Nor is any
/// entry so small beside them that its products vanish.
bool is_ordinary(const MatrixRef& M) {
  const double largest = M.cwiseAbs().maxCoeff();
  return largest == 0.0 || (largest < 0x1p200 && largest > 0x1p-200 &&
                            (M.array() == 0.0 || M.array().abs() > 0x1p-400).all());
}

/// Whether entries are so far apart that an equation which holds in balanced units may not hold in
/// the given ones.
bool is_far_apart(const MatrixRef& M) {
  const auto sizes = M.array().abs();
  return (sizes > 0.0 && sizes < 0x1p-40 * sizes.maxCoeff()).any();
}

/// The power of two of a matrix's largest entry; 0 for a matrix of zeros.
int exponent_of(const MatrixRef& M) {
  const double largest = M.cwiseAbs().maxCoeff();
  return largest > 0.0 && std::isfinite(largest) ? std::ilogb(largest) : 0;
}

/// The exponents of the powers of two that balance M, whatever its size.
Eigen::VectorXi balance_exponents(const MatrixXd& M) {
  const VectorXd d = detail::balance_of(M * std::ldexp(0.5, -exponent_of(M)));
  return d.unaryExpr([](double value) { return std::ilogb(value); }).cast<int>();
}

/// An equation in units in which A, B and F are of ordinary size, by powers of two:
/// X = Da X' Db⁻¹ 2^unit, and time in another unit where it is continuous. Not `balanced`, Da and
/// Db are one.
class InOtherUnits {
 public:
  explicit InOtherUnits(const Problem& p, bool balanced = true)
      : a_(balanced ? balance_exponents(p.A) : Eigen::VectorXi(Eigen::VectorXi::Zero(p.A.rows()))),
        b_(!p.B       ? Eigen::VectorXi(-a_)
           : balanced ? balance_exponents(*p.B)
                      : Eigen::VectorXi(Eigen::VectorXi::Zero(p.B->rows()))),
        problem_{p.domain, times_powers(p.A, -a_, a_, 0), std::nullopt, {}, p.symmetric} {
    int time = exponent_of(problem_.A);
    if (p.B) {
      problem_.B = times_powers(*p.B, -b_, b_, 0);
      const int other = exponent_of(*problem_.B);
      time = problem_.A.isZero(0.0) || (!problem_.B->isZero(0.0) && other > time) ? other : time;
    }
    if (p.domain == Domain::discrete) {
      time = 0;
    } else {
      problem_.A = times_powers(p.A, -a_, a_, -time);
      if (p.B) {
        problem_.B = times_powers(*p.B, -b_, b_, -time);
      }
    }
    time_ = time;
    // The largest entry before the balance, then the one after it.
    unit_ = exponent_of(p.F) - time;
    unit_ += exponent_of(times_powers(p.F, -a_, b_, -unit_ - time));
    problem_.F = times_powers(p.F, -a_, b_, -unit_ - time);
  }

  /// Whether an entry of p has lost digits there.
  [[nodiscard]] bool loses(const Problem& p) const {
    const int time = p.domain == Domain::continuous ? time_ : 0;
    return times_powers(problem_.A, a_, -a_, time) != p.A ||
           times_powers(problem_.F, a_, -b_, unit_ + time) != p.F ||
           (p.B && times_powers(*problem_.B, b_, -b_, time) != *p.B);
  }

  [[nodiscard]] const Problem& problem() const noexcept { return problem_; }
  [[nodiscard]] MatrixXd back(const MatrixXd& X) const { return times_powers(X, a_, -b_, unit_); }
  [[nodiscard]] MatrixXd there(const MatrixXd& X) const { return times_powers(X, -a_, b_, -unit_); }

 private:
  Eigen::VectorXi a_;
  Eigen::VectorXi b_;
  int unit_ = 0;
  int time_ = 0;
  Problem problem_;
};

/// What the kernels make of it; false where they do not vouch for it.
bool solve_quickly(Domain domain, const MatrixRef& A, const MatrixRef* B, const MatrixXd& F,
                   bool symmetric, LinearMatrixSolution& solution) {
  if (A.outerStride() != A.rows() || (B != nullptr && B->outerStride() != B->rows())) {
    return false;
  }
  solution.X.resize(F.rows(), F.cols());
  detail::SylvesterAnswer answer{solution.X.data()};
  if (!detail::solve_sylvester_quickly(
          {static_cast<int>(F.rows()), static_cast<int>(F.cols()), domain == Domain::continuous,
           symmetric, A.data(), B == nullptr ? nullptr : B->data(), F.data()},
          answer) ||
      !solution.X.allFinite()) {
    return false;
  }
  solution.residual = answer.residual;
  solution.condition = answer.condition;
  return true;
}

/// X by the triangular factors, corrected until no entry of the equation leaves more than rounding
/// or nothing is gained any more.
void solve_by_factors(const SylvesterOperator& equation, const Problem& p,
                      LinearMatrixSolution& solution) {
  MatrixXd X = equation.solve(p.F);
  solution.residual = infinity;
  double previous = infinity;
  for (int pass = 0; pass < 12 && X.allFinite(); ++pass) {
    if (p.symmetric) {
      X = detail::symmetrized(X);
    }
    const double error = equation.backward_error(X, p.F).in_context;
    if (error < solution.residual) {
      solution.X = X;
      solution.residual = error;
    }
    const MatrixXd correction = equation.solve(equation.residual(X, p.F));
    const double step = correction.norm();
    const bool settled = step <= 1e-12 * X.norm() && error <= 16.0 * epsilon;
    if (!std::isfinite(step) || settled ||
        (!(step < 0.5 * previous) && !(error > 16.0 * epsilon))) {
      break;
    }
    X += correction;
    previous = step;
  }
  // ‖L⁻¹‖ from two matrices of signs, which no direction is orthogonal to.
  double gain = 0.0;
  for (const Index stride : {1, 3}) {
    MatrixXd signs(X.rows(), X.cols());
    for (Index k = 0; k < signs.size(); ++k) {
      signs(k) = (k * stride + k / 5) % 2 == 0 ? 1.0 : -1.0;
    }
    gain = std::max(gain, equation.solve(signs).norm() / signs.norm());
  }
  const double size = solution.X.norm();
  const double scale = solution.X.size() > 0 ? equation.terms(solution.X, p.F).norm() : 0.0;
  solution.condition = size > 0.0 ? std::max(1.0, gain * scale / size) : gain;
}

/// Whether X satisfies the equation by its largest entries, in the units of the caller.
bool holds(const InOtherUnits& units, const MatrixXd& X) {
  const Problem& p = units.problem();
  const MatrixXd B = p.B ? *p.B : MatrixXd(p.A.transpose());
  const MatrixXd there = units.there(X);
  const auto largest = [](const MatrixXd& M) {
    return M.allFinite() ? M.cwiseAbs().maxCoeff() : std::numeric_limits<double>::quiet_NaN();
  };
  const double left = largest(detail::sylvester_residual(p.domain, p.A, B, there, p.F));
  const double terms = largest(detail::sylvester_terms(p.domain, p.A, B, there, p.F));
  const MatrixXd XB = detail::product(there, B);
  const double products = p.domain == Domain::continuous
                              ? largest(detail::product(p.A, there)) + largest(XB)
                              : largest(detail::product(p.A, XB)) + largest(there);
  return units.back(there) == X && left <= largest_backward_error * terms &&
         left <= largest_residual * (products + largest(p.F));
}

Error too_far_apart(std::string_view where, double error) {
  return Error(MatrixEquationError::not_accurate)
      .in(std::string(where))
      .got("entries too far apart for sixteen digits")
      .with("backward error", error);
}

/// Of entries that no unit brings together; nothing where that takes more unknowns than are solved
/// so, or where they have no unique solution.
std::optional<Expected<LinearMatrixSolution>> solve_widely(const Problem& p,
                                                           std::string_view where) {
  const MatrixXd B = p.B ? *p.B : MatrixXd(p.A.transpose());
  auto solved = detail::solve_sylvester_wide(p.domain, p.A, B, p.F);
  // The share of an entry's error that is told from one of the equations' rank.
  if (!solved || !(solved->condition < 1e-3 / epsilon)) {
    return std::nullopt;
  }
  MatrixXd& X = solved->X;
  if (!X.allFinite()) {
    return refusal(MatrixEquationError::overflow, where);
  }
  if (p.symmetric) {
    X.triangularView<Eigen::StrictlyUpper>() = X.transpose();
  }
  const double error = detail::wide_backward_error(p.domain, p.A, B, X, p.F);
  if (!(error <= largest_backward_error)) {
    return tl::unexpected(too_far_apart(where, error));
  }
  return LinearMatrixSolution{std::move(X), error, solved->condition};
}

Expected<LinearMatrixSolution> solve_carefully(const Problem& given, std::string_view where) {
  const InOtherUnits units(given);
  const MatrixXd given_B = given.B ? *given.B : MatrixXd(given.A.transpose());
  const bool wide =
      !given.coarse && (units.loses(given) || detail::is_wide(given.A, given_B, given.F));
  if (wide) {
    if (auto answer = solve_widely(given, where)) {
      return std::move(*answer);
    }
  }
  const Problem& p = units.problem();
  const SylvesterOperator equation =
      p.B ? SylvesterOperator(p.domain, p.A, *p.B) : SylvesterOperator(p.domain, p.A);
  // Of two answers the better, as they stand in the units of the caller: there they may have lost
  // digits, or be infinite.
  LinearMatrixSolution best;
  detail::BackwardError error;
  bool overflows = false;
  const auto consider = [&](const LinearMatrixSolution& solution, const InOtherUnits& of) {
    const MatrixXd X = of.back(solution.X);
    if (!X.allFinite()) {
      overflows = overflows || solution.X.allFinite();
      return;
    }
    const detail::BackwardError its = equation.backward_error(units.there(X), p.F);
    if (its.strict < error.strict && (given.coarse || holds(InOtherUnits(given, false), X))) {
      best = {X, its.in_context, solution.condition};
      error = its;
    }
  };
  const auto by_factors = [&](const SylvesterOperator& of, const InOtherUnits& in) {
    LinearMatrixSolution solution;
    solve_by_factors(of, in.problem(), solution);
    if (solution.X.size() > 0) {
      consider(solution, in);
    }
  };
  const auto unique = equation.check(where);
  if (unique) {
    by_factors(equation, units);
  }
  if (unique && !(error.strict <= largest_backward_error) && !given.coarse) {
    const InOtherUnits own(given, false);
    const Problem& q = own.problem();
    const SylvesterOperator as_given =
        q.B ? SylvesterOperator(q.domain, q.A, *q.B) : SylvesterOperator(q.domain, q.A);
    if (as_given.check(where)) {
      by_factors(as_given, own);
    }
  }
  // Eigenvalues that cancel within the rounding of A's norm may be apart within that of its
  // entries.
  if (!(error.strict <= largest_backward_error)) {
    if (auto direct = detail::solve_kronecker(equation, p.F)) {
      if (!(direct->condition < (unique ? infinity : 1e-3 / epsilon))) {
        return tl::unexpected(equation.not_solved(where));
      }
      consider({p.symmetric ? detail::symmetrized(direct->X) : direct->X, 0.0, direct->condition},
               units);
    }
  }
  if (error.in_context <= largest_backward_error) {
    if (wide) {
      best.residual = detail::wide_backward_error(given.domain, given.A, given_B, best.X, given.F);
      if (!(best.residual <= largest_backward_error)) {
        return tl::unexpected(too_far_apart(where, best.residual));
      }
    }
    return best;
  }
  if (overflows) {
    return refusal(MatrixEquationError::overflow, where);
  }
  FLYBALL_CHECK(unique);
  if (!given.coarse && !wide) {
    if (auto answer = solve_widely(given, where)) {
      return std::move(*answer);
    }
  }
  return tl::unexpected(too_far_apart(where, error.in_context));
}

Expected<LinearMatrixSolution> solve_lyapunov(Domain domain, const MatrixRef& A, const MatrixRef& Q,
                                              std::string_view where, bool coarse = false) {
  FLYBALL_CHECK(Checks(where)
                    .square(A, "A")
                    .shape(Q, A.rows(), A.rows(), "Q", "states x states")
                    .finite(A, "A")
                    .finite(Q, "Q"));
  const bool symmetric = Q == Q.transpose();
  const MatrixXd F = -Q;
  if (!is_ordinary(A) || !is_ordinary(Q)) {
    return solve_carefully({domain, A, std::nullopt, F, symmetric, coarse}, where);
  }
  const bool far = !coarse && (is_far_apart(A) || is_far_apart(Q));
  const auto holds_as_given = [&](const MatrixXd& X) {
    return !far || holds(InOtherUnits({domain, A, std::nullopt, F, symmetric}, false), X);
  };
  LinearMatrixSolution solution;
  if (is_symmetric_but_for_rounding(Q) && A.outerStride() == A.rows() &&
      Q.outerStride() == Q.rows()) {
    solution.X.resize(A.rows(), A.rows());
    detail::LyapunovAnswer answer{solution.X.data()};
    if (detail::solve_stable_lyapunov(
            {static_cast<int>(A.rows()), domain == Domain::continuous, A.data(), Q.data()},
            answer) &&
        solution.X.allFinite() && holds_as_given(solution.X)) {
      solution.residual = answer.residual;
      solution.condition = answer.condition;
      return solution;
    }
  }
  if (solve_quickly(domain, A, nullptr, F, symmetric, solution) && holds_as_given(solution.X)) {
    return solution;
  }
  return solve_carefully({domain, A, std::nullopt, F, symmetric, coarse}, where);
}

Expected<LinearMatrixSolution> solve_sylvester(Domain domain, const MatrixRef& A,
                                               const MatrixRef& B, const MatrixRef& C,
                                               std::string_view where) {
  FLYBALL_CHECK(Checks(where)
                    .square(A, "A")
                    .square(B, "B")
                    .shape(C, A.rows(), B.rows(), "C", "rows of A x columns of B")
                    .finite(A, "A")
                    .finite(B, "B")
                    .finite(C, "C"));
  const double sign = domain == Domain::continuous ? 1.0 : -1.0;
  const MatrixXd F = sign * C;
  LinearMatrixSolution solution;
  if (is_ordinary(A) && is_ordinary(B) && is_ordinary(C) &&
      solve_quickly(domain, A, &B, F, false, solution) &&
      (!(is_far_apart(A) || is_far_apart(B) || is_far_apart(C)) ||
       holds(InOtherUnits({domain, A, B, F, false}, false), solution.X))) {
    return solution;
  }
  return solve_carefully({domain, A, B, F, false}, where);
}

}  // namespace

ErrorInfo error_info(MatrixEquationError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"no_unique_solution", "the equation has no unique solution", ErrorKind::no_answer},
      {"no_convergence", "the eigenvalues could not be computed", ErrorKind::no_answer},
      {"overflow", "the solution exceeds the largest double", ErrorKind::no_answer},
      {"not_accurate", "no solution was found that satisfies the equation", ErrorKind::no_answer},
  };
  return detail::info_of(code, "matrix_equation", rows);
}

Expected<LinearMatrixSolution> lyapunov(const MatrixRef& A, const MatrixRef& Q) {
  return solve_lyapunov(Domain::continuous, A, Q, "lyapunov");
}

Expected<LinearMatrixSolution> discrete_lyapunov(const MatrixRef& A, const MatrixRef& Q) {
  return solve_lyapunov(Domain::discrete, A, Q, "discrete_lyapunov");
}

namespace detail {

Expected<LinearMatrixSolution> discrete_lyapunov_correction(const MatrixRef& A,
                                                            const MatrixRef& Q) {
  return solve_lyapunov(Domain::discrete, A, Q, "discrete_lyapunov", true);
}

}  // namespace detail

Expected<LinearMatrixSolution> sylvester(const MatrixRef& A, const MatrixRef& B,
                                         const MatrixRef& C) {
  return solve_sylvester(Domain::continuous, A, B, C, "sylvester");
}

Expected<LinearMatrixSolution> discrete_sylvester(const MatrixRef& A, const MatrixRef& B,
                                                  const MatrixRef& C) {
  return solve_sylvester(Domain::discrete, A, B, C, "discrete_sylvester");
}

}  // namespace flyball
