#include <flyball/systems/realization.hpp>

#include <cmath>
#include <complex>
#include <string>

#include "core/constants.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/extended/double_double.hpp"
#include "math/extended/wide_matrix.hpp"
#include "systems/balance.hpp"
#include "systems/gramian_factor.hpp"
#include "systems/staircase.hpp"
#include "systems/timed.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;
using detail::bare;
using detail::product;
using detail::timed;
using detail::WideMatrix;
using Eigen::Index;
using Eigen::MatrixXd;
using Continuous = ContinuousSystem<>;
using Discrete = DiscreteSystem<>;

Expected<Continuous> transform(const Continuous& system, const MatrixRef& T) {
  constexpr std::string_view where = "similarity_transform";
  const Index n = system.A.rows();
  FLYBALL_CHECK(Checks(where).shape(T, n, n, "T", "states x states").finite(T, "T"));
  // Rows and columns of T are units, old and new; they do not make it singular.
  Eigen::VectorXd rows(n);
  Eigen::VectorXd columns(n);
  MatrixXd unit = T;
  for (Index i = 0; i < n; ++i) {
    const double size = unit.row(i).cwiseAbs().maxCoeff();
    rows(i) = size > 0.0 ? std::exp2(std::round(std::log2(size))) : 1.0;
    unit.row(i) /= rows(i);
  }
  for (Index j = 0; j < n; ++j) {
    const double size = unit.col(j).cwiseAbs().maxCoeff();
    columns(j) = size > 0.0 ? std::exp2(std::round(std::log2(size))) : 1.0;
    unit.col(j) /= columns(j);
  }
  MatrixXd right(n, n + system.B.cols());
  // A T itself may be nothing or too much where A' is neither.
  right << product(rows.cwiseInverse().asDiagonal() * system.A * rows.asDiagonal(), unit),
      rows.cwiseInverse().asDiagonal() * system.B;
  double rcond = 0.0;
  (void)detail::solve_linear(unit, right.leftCols(0), &rcond);
  // In twice the precision: what is left of each row's equations is little beside the row's terms.
  const auto fine =
      detail::solve(detail::DoubleDoubleMatrix(unit), detail::DoubleDoubleMatrix(right));
  MatrixXd solved =
      fine ? MatrixXd(columns.cwiseInverse().asDiagonal() * fine->rounded()) : MatrixXd();
  if (fine) {
    solved.leftCols(n) *= columns.asDiagonal();
  }
  if (!(rcond > 10.0 * epsilon) || !fine) {
    return refusal(SystemError::singular_transform, where, "T")
        .got("singular")
        .expected("invertible")
        .with("reciprocal condition", rcond);
  }
  // T A' = A T and T B' = B by their largest entries, in the units that were given.
  const WideMatrix T_wide(T);
  const WideMatrix AT = product(WideMatrix(system.A), T_wide);
  const auto hold = [&] {
    const auto holds = [&](const MatrixXd& made, const WideMatrix& wanted) {
      const WideMatrix M(made);
      return share_of(sum(product(T_wide, M), -1.0, wanted),
                      product(T_wide.magnitudes(), M.magnitudes())) <= 1e-10;
    };
    return holds(solved.leftCols(n), AT) &&
           holds(solved.rightCols(system.B.cols()), WideMatrix(system.B));
  };
  if (!hold()) {
    const auto wide = detail::solve(T_wide, beside(AT, WideMatrix(system.B)));
    solved = wide ? wide->rounded() : solved;
    if (!hold()) {
      return refusal(SystemError::singular_transform, where, "T")
          .got("of entries too far apart for sixteen digits")
          .with("reciprocal condition", rcond);
    }
  }
  const MatrixXd A = solved.leftCols(n);
  const MatrixXd B = solved.rightCols(system.B.cols());
  return Continuous{A, B, product(system.C, T), system.D};
}

/// For a single input. @param failure  What to say if the form does not exist.
Expected<Continuous> companion(const Continuous& given, SystemError failure,
                               std::string_view where) {
  const Index n = given.A.rows();
  if (given.B.cols() != 1) {
    const bool dual = failure == SystemError::not_observable;
    return refusal(ArgumentError::wrong_shape, where, dual ? "C" : "B")
        .got("of " + std::to_string(given.B.cols()) + (dual ? " rows" : " columns"))
        .expected(dual ? "one row: the form is of a single output"
                       : "one column: the form is of a single input");
  }
  const detail::SystemScaling scaling = detail::scaling_of(given.A, given.B, given.C);
  auto [A_balanced, B, C, D] = detail::scaled_system(given, scaling);
  // Time in the unit of the fastest mode keeps the powers of A within range.
  const double rate =
      A_balanced.norm() > 0.0 ? std::exp2(std::round(std::log2(A_balanced.norm()))) : 1.0;
  MatrixXd A = A_balanced / rate;
  const double size_B = B.norm() > 0.0 ? B.norm() : 1.0;

  // x'₁ = qᵀx with qᵀAᵏB = 0 for k < n - 1 and 1 for the last; the others are its derivatives.
  MatrixXd K(n, n);
  K.col(0) = B / size_B;
  for (Index k = 1; k < n; ++k) {
    K.col(k) = product(A, K.col(k - 1));
  }
  // Each state in the unit in which what reaches it is near one: units make nothing unreached.
  for (Index i = 0; i < n; ++i) {
    const double size = K.row(i).cwiseAbs().maxCoeff();
    const double unit = size > 0.0 && std::isfinite(size) ? std::ldexp(1.0, std::ilogb(size)) : 1.0;
    K.row(i) /= unit;
    A.row(i) /= unit;
    A.col(i) *= unit;
    C.col(i) *= unit;
  }
  double rcond = 0.0;
  const MatrixXd q =
      detail::solve_linear(K.transpose(), MatrixXd::Identity(n, n).col(n - 1), &rcond);
  if (!(rcond > 10.0 * epsilon) || !q.allFinite()) {
    return refusal(failure, where, "the system")
        .hint("it has no companion form in double precision; see minimal_realization")
        .with("reciprocal condition", rcond);
  }
  MatrixXd rows(n, n);
  rows.row(0) = q.transpose();
  for (Index k = 1; k < n; ++k) {
    rows.row(k) = product(rows.row(k - 1), A);
  }
  const MatrixXd numerators = detail::solve_linear(rows.transpose(), C.transpose()).transpose();

  // Π(s - λ), from the eigenvalues.
  Eigen::VectorXcd polynomial = Eigen::VectorXcd::Zero(n + 1);
  polynomial(0) = 1.0;
  Index degree = 0;
  for (const Complex& lambda : detail::eigenvalues_of(A)) {
    ++degree;
    for (Index k = degree; k > 0; --k) {
      polynomial(k) = polynomial(k - 1) - lambda * polynomial(k);
    }
    polynomial(0) *= -lambda;
  }
  Continuous form{MatrixXd::Zero(n, n), MatrixXd::Zero(n, 1), numerators, given.D};
  for (Index k = 0; k < n; ++k) {
    if (k > 0) {
      form.A(k - 1, k) = 1.0;
    }
    const double unit = std::pow(rate, static_cast<double>(n - k));
    form.A(n - 1, k) = -polynomial(k).real() * unit;
    // Σ c_k s^k in the fast unit of time; the gain of B with it.
    form.C.col(k) *= size_B * unit / rate;
  }
  form.B(n - 1, 0) = 1.0;
  FLYBALL_CHECK(check_system(form, where));
  return form;
}

Continuous dual(const Continuous& s) {
  return {s.A.transpose(), s.C.transpose(), s.B.transpose(), s.D.transpose()};
}

template <class System>
Expected<BalancedRealization<Continuous>> truncate(const System& given, TimeDomain domain,
                                                   Index order, bool all, std::string_view where) {
  FLYBALL_CHECK(check_system(given, where));
  // Inputs and outputs in units in which their squares are doubles: T = T' 2^((b - c)/2).
  const int b = detail::unit_of(given.B);
  int c = detail::unit_of(given.C);
  c += (b - c) % 2;
  const Continuous system{given.A, detail::times_power(given.B, -b),
                          detail::times_power(given.C, -c), given.D};
  const Index n = system.A.rows();
  FLYBALL_TRY(auto factors, detail::gramian_factors(system, domain, where));
  const detail::SingularValues svd =
      detail::svd_of(detail::transposed_product(factors.observability, factors.controllability));
  const double floor = static_cast<double>(n) * epsilon * svd.values(0);
  const Index present = (svd.values.array() > floor).count();
  if (all && present < n) {
    return refusal(SystemError::not_controllable, where, "a state")
        .got("not reached or not seen")
        .expected("reached and seen: only such states can be balanced")
        .hint("leave it out with balanced_truncation or minimal_realization")
        .with("states that are both", static_cast<double>(present))
        .with("smallest Hankel singular value", svd.values(n - 1));
  }
  if (!all && (order < 1 || order > present)) {
    return refusal(ArgumentError::out_of_range, where, "order")
        .got(std::to_string(order))
        .expected("from 1 to " + std::to_string(present) +
                  ", the number of states that are reached and seen");
  }
  const Index r = all ? n : order;
  // x = L_c V σ^{-1/2} x', x' = σ^{-1/2} Uᵀ L_oᵀ x.
  const Eigen::VectorXd root = svd.values.head(r).cwiseSqrt().cwiseInverse();
  BalancedRealization<Continuous> found;
  // In the states' units D first: products of entries in others' may be no doubles.
  const Eigen::VectorXd D = factors.states;
  const Eigen::VectorXd D_inverse = D.cwiseInverse();
  found.T = product(factors.controllability, svd.V.leftCols(r)) * root.asDiagonal();
  found.T_inverse =
      root.asDiagonal() * product(svd.U.leftCols(r).transpose(), factors.observability.transpose());
  if (r == n) {
    // The smallest states' rows of T⁻¹ are sums that cancel: to the last digit.
    const auto inverse =
        detail::solve(detail::DoubleDoubleMatrix(found.T), detail::DoubleDoubleMatrix::identity(n));
    if (inverse && inverse->all_finite()) {
      found.T_inverse = inverse->rounded();
    }
  }
  found.hankel = detail::times_power(svd.values, b + c);
  found.error_bound = 2.0 * found.hankel.tail(n - r).sum();
  // By exponents: what stands between D⁻¹A and D⁻¹AD need be no double.
  const Eigen::VectorXi d =
      D.unaryExpr([](double x) { return static_cast<double>(std::ilogb(x)); }).template cast<int>();
  const MatrixXd A = detail::times_powers(system.A, -d, d, 0);
  const int a = detail::unit_of(A);
  found.system = {
      detail::times_power(product(found.T_inverse, product(detail::times_power(A, -a), found.T)),
                          a),
      detail::times_power(product(found.T_inverse, MatrixXd(D_inverse.asDiagonal() * system.B)),
                          (b + c) / 2),
      detail::times_power(product(MatrixXd(system.C * D.asDiagonal()), found.T), (b + c) / 2),
      system.D};
  found.T = D.asDiagonal() * found.T;
  found.T_inverse = found.T_inverse * D_inverse.asDiagonal();
  found.T = detail::times_power(found.T, (b - c) / 2);
  found.T_inverse = detail::times_power(found.T_inverse, (c - b) / 2);
  const double left =
      r < n ? 0.0
            : (product(found.T_inverse, found.T) - MatrixXd::Identity(r, r)).cwiseAbs().maxCoeff() /
                  product(found.T_inverse.cwiseAbs(), found.T.cwiseAbs()).maxCoeff();
  if (!found.system.A.allFinite() || !found.system.B.allFinite() || !found.system.C.allFinite() ||
      !found.hankel.allFinite() || !(left <= 1e-11)) {
    return refusal(SystemError::no_convergence, where, "the transform")
        .got("beyond the range of doubles")
        .hint("measure inputs, outputs and states in units in which the entries are near one");
  }
  return found;
}

Expected<BalancedRealization<Discrete>> timed_realization(
    Expected<BalancedRealization<Continuous>> found, Time period) {
  return std::move(found).map([&](BalancedRealization<Continuous>&& s) {
    return BalancedRealization<Discrete>{timed(s.system, period), std::move(s.hankel),
                                         std::move(s.T), std::move(s.T_inverse), s.error_bound};
  });
}

Expected<MinimalRealization<Continuous>> minimal(const Continuous& system, double tolerance) {
  constexpr std::string_view where = "minimal_realization";
  FLYBALL_CHECK(check_not_negative(tolerance, where, "tolerance"));
  if (tolerance >= 1.0) {
    return refusal(ArgumentError::out_of_range, where, "tolerance")
        .got(format_number(tolerance))
        .expected("below 1");
  }
  const Index n = system.A.rows();
  const double small = tolerance > 0.0 ? tolerance : 100.0 * epsilon * static_cast<double>(n);
  const detail::SystemScaling scaling = detail::scaling_of(system.A, system.B, system.C);
  const auto [A, B, C, D] = detail::scaled_system(system, scaling);

  const detail::ReachedPart reach = detail::reached_part_of(A, B, small, {A.norm(), B.norm()});
  const Index r = reach.A.rows();
  const MatrixXd C_r = product(C, reach.V);
  const detail::ReachedPart sight =
      detail::reached_part_of(reach.A.transpose(), C_r.transpose(), small, {A.norm(), C.norm()});
  const Index k = sight.A.rows();

  MinimalRealization<Continuous> found;
  found.unreached = n - r;
  found.unseen = r - k;
  if (k == n) {
    found.system = system;
    found.T = MatrixXd::Identity(n, n);
    return found;
  }
  found.system.A = sight.A.transpose();
  found.system.B = detail::transposed_product(sight.V, reach.B);
  found.system.C = sight.B.transpose();
  found.system.D = system.D;
  found.T = scaling.states.asDiagonal() * product(reach.V, sight.V);
  return found;
}

}  // namespace

Expected<Continuous> similarity_transform(const Continuous& system, const MatrixRef& T) {
  FLYBALL_CHECK(check_system(system, "similarity_transform"));
  return transform(system, T);
}
Expected<Discrete> similarity_transform(const Discrete& system, const MatrixRef& T) {
  FLYBALL_CHECK(check_system(system, "similarity_transform"));
  return transform(bare(system), T).map([&](const Continuous& s) {
    return timed(s, system.period);
  });
}

Expected<Continuous> controllable_canonical_form(const Continuous& system) {
  constexpr std::string_view where = "controllable_canonical_form";
  FLYBALL_CHECK(check_system(system, where));
  return companion(system, SystemError::not_controllable, where);
}
Expected<Discrete> controllable_canonical_form(const Discrete& system) {
  constexpr std::string_view where = "controllable_canonical_form";
  FLYBALL_CHECK(check_system(system, where));
  return companion(bare(system), SystemError::not_controllable, where)
      .map([&](const Continuous& s) { return timed(s, system.period); });
}

Expected<Continuous> observable_canonical_form(const Continuous& system) {
  constexpr std::string_view where = "observable_canonical_form";
  FLYBALL_CHECK(check_system(system, where));
  if (system.C.rows() == 0) {
    return refusal(SystemError::not_observable, where);
  }
  return companion(dual(system), SystemError::not_observable, where).map(dual);
}
Expected<Discrete> observable_canonical_form(const Discrete& system) {
  FLYBALL_CHECK(check_system(system, "observable_canonical_form"));
  return observable_canonical_form(bare(system)).map([&](const Continuous& s) {
    return timed(s, system.period);
  });
}

Expected<BalancedRealization<Continuous>> balanced_realization(const Continuous& system) {
  return truncate(system, TimeDomain::continuous, 0, true, "balanced_realization");
}
Expected<BalancedRealization<Discrete>> balanced_realization(const Discrete& system) {
  return timed_realization(truncate(system, TimeDomain::discrete, 0, true, "balanced_realization"),
                           system.period);
}

Expected<BalancedRealization<Continuous>> balanced_truncation(const Continuous& system,
                                                              Index order) {
  return truncate(system, TimeDomain::continuous, order, false, "balanced_truncation");
}
Expected<BalancedRealization<Discrete>> balanced_truncation(const Discrete& system, Index order) {
  return timed_realization(
      truncate(system, TimeDomain::discrete, order, false, "balanced_truncation"), system.period);
}

Expected<MinimalRealization<Continuous>> minimal_realization(const Continuous& system,
                                                             double tolerance) {
  FLYBALL_CHECK(check_system_or_gain(system, "minimal_realization"));
  if (system.A.size() == 0) {
    return MinimalRealization<Continuous>{.system = system, .T = MatrixXd(0, 0)};
  }
  return minimal(system, tolerance);
}
Expected<MinimalRealization<Discrete>> minimal_realization(const Discrete& system,
                                                           double tolerance) {
  FLYBALL_CHECK(check_system_or_gain(system, "minimal_realization"));
  if (system.A.size() == 0) {
    return MinimalRealization<Discrete>{.system = system, .T = MatrixXd(0, 0)};
  }
  return minimal(bare(system), tolerance).map([&](MinimalRealization<Continuous>&& s) {
    return MinimalRealization<Discrete>{timed(s.system, system.period), s.unreached, s.unseen,
                                        std::move(s.T)};
  });
}

}  // namespace flyball
