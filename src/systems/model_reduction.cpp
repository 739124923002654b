#include <flyball/systems/model_reduction.hpp>

#include <cmath>
#include <string>
#include <vector>

#include <flyball/math/equations/matrix_equation.hpp>
#include <flyball/math/riccati/riccati.hpp>
#include <flyball/systems/gramian.hpp>
#include <flyball/systems/interconnection.hpp>
#include <flyball/systems/norms.hpp>
#include <flyball/systems/realization.hpp>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/riccati/riccati_work.hpp"
#include "systems/balance.hpp"
#include "systems/modes.hpp"
#include "systems/timed.hpp"

namespace flyball {

namespace {

using detail::bare;
using detail::product;
using detail::timed;
using Eigen::Index;
using Eigen::MatrixXd;
using Continuous = ContinuousSystem<>;
using Discrete = DiscreteSystem<>;

/// sign(A) by Newton's iteration, scaled; nothing where it does not end.
std::optional<MatrixXd> sign_of(MatrixXd S) {
  const Index n = S.rows();
  for (int k = 0; k < 100; ++k) {
    double rcond = 0.0;
    const MatrixXd inverse = detail::solve_linear(S, MatrixXd::Identity(n, n), &rcond);
    if (!inverse.allFinite() || !(rcond > 0.0)) {
      return std::nullopt;
    }
    const double scale = k < 40 ? std::sqrt(inverse.norm() / S.norm()) : 1.0;
    const MatrixXd next = 0.5 * (scale * S + inverse / scale);
    const double change = (next - S).norm();
    S = next;
    if (change <= 100.0 * static_cast<double>(n) * epsilon * S.norm()) {
      return S;
    }
  }
  return std::nullopt;
}

Expected<SpectralSplit<Continuous>> split(const Continuous& given, TimeDomain domain) {
  constexpr std::string_view where = "split_spectrum";
  FLYBALL_CHECK(check_system_or_gain(given, where));
  const Index n = given.A.rows();
  const Index m = given.B.cols();
  const Index p = given.C.rows();
  SpectralSplit<Continuous> found;
  found.stable = given;
  found.unstable = {MatrixXd(0, 0), MatrixXd(0, m), MatrixXd(p, 0), MatrixXd::Zero(p, m)};
  found.T = MatrixXd::Identity(n, n);
  if (n == 0) {
    return found;
  }
  const detail::JudgedEigenvalues judged = detail::judged_eigenvalues(given.A, domain);
  if (!judged.converged) {
    return refusal(SystemError::no_convergence, where, "the eigenvalues of A");
  }
  Index r = 0;
  for (Index k = 0; k < n; ++k) {
    const auto at = static_cast<std::size_t>(k);
    if (judged.verdicts[at] == Stability::marginal) {
      return refusal(SystemError::not_stable, where, "a pole")
          .got("on the border of stability")
          .expected("on one side of it")
          .hint("move it, or take an integrator out of the model")
          .with("pole", {judged.values(k).real(), judged.values(k).imag()});
    }
    r += judged.verdicts[at] == Stability::unstable ? 1 : 0;
  }
  if (r == 0) {
    return found;
  }
  const detail::SystemScaling scaling = detail::scaling_of(given.A, given.B, given.C);
  const Continuous s = detail::scaled_system(given, scaling);
  MatrixXd F = s.A;
  if (domain == TimeDomain::discrete) {
    // (A + I)⁻¹(A - I): the circle becomes the axis.
    const MatrixXd I = MatrixXd::Identity(n, n);
    F = detail::solve_linear(s.A + I, s.A - I);
  }
  const auto sign = F.allFinite() ? sign_of(F) : std::nullopt;
  if (!sign) {
    return refusal(SystemError::no_convergence, where, "the sign of A")
        .got("not found")
        .hint("a pole is close to the border of stability");
  }
  // The projector on the unstable modes; its range is their invariant subspace.
  const MatrixXd Q = detail::pivoted_qr(0.5 * (*sign + MatrixXd::Identity(n, n))).Q;
  const MatrixXd A = detail::transposed_product(Q, product(s.A, Q));
  const Index rest = n - r;
  const MatrixXd A_u = A.topLeftCorner(r, r);
  const MatrixXd A_s = A.bottomRightCorner(rest, rest);
  found.residual = A.bottomLeftCorner(rest, r).norm() / std::max(A.norm(), 1e-300);
  if (!(found.residual <= 1e-9)) {
    return refusal(SystemError::no_convergence, where, "the unstable modes")
        .got("not apart from the others")
        .with("coupling", found.residual);
  }
  // [A_u A_us; 0 A_s] [I X; 0 I] is [I X; 0 I] diag(A_u, A_s) with A_u X - X A_s = -A_us.
  MatrixXd X = MatrixXd::Zero(r, rest);
  if (rest > 0) {
    FLYBALL_TRY_IN(where, const auto solution, sylvester(A_u, -A_s, -A.topRightCorner(r, rest)));
    X = solution.X;
  }
  const MatrixXd V_u = Q.leftCols(r);
  const MatrixXd V_s = product(V_u, X) + Q.rightCols(rest);
  const MatrixXd B = detail::transposed_product(Q, s.B);
  const MatrixXd B_s = B.bottomRows(rest);
  found.stable = {A_s, B_s, product(s.C, V_s), given.D};
  found.unstable = {A_u, B.topRows(r) - product(X, B_s), product(s.C, V_u), MatrixXd::Zero(p, m)};
  found.T << scaling.states.asDiagonal() * V_s, scaling.states.asDiagonal() * V_u;
  return found;
}

/// The states after the first r at rest always: what they are is taken from the others.
Continuous residualized(const Continuous& s, Index r, TimeDomain domain) {
  const Index rest = s.A.rows() - r;
  MatrixXd A22 = s.A.bottomRightCorner(rest, rest);
  if (domain == TimeDomain::discrete) {
    A22.diagonal().array() -= 1.0;
  }
  MatrixXd right(rest, r + s.B.cols());
  right << s.A.bottomLeftCorner(rest, r), s.B.bottomRows(rest);
  const MatrixXd solved = detail::solve_linear(A22, right);
  const MatrixXd A12 = s.A.topRightCorner(r, rest);
  const MatrixXd C2 = s.C.rightCols(rest);
  return {s.A.topLeftCorner(r, r) - product(A12, solved.leftCols(r)),
          s.B.topRows(r) - product(A12, solved.rightCols(s.B.cols())),
          s.C.leftCols(r) - product(C2, solved.leftCols(r)),
          s.D - product(C2, solved.rightCols(s.B.cols()))};
}

Expected<HInfinityNorm> norm_of(const Continuous& s, TimeDomain domain) {
  return domain == TimeDomain::continuous ? h_infinity_norm(s)
                                          : h_infinity_norm(timed(s, Time(1.0)));
}

struct Smaller {
  Continuous system;
  Eigen::VectorXd hankel;
  double bound = 0.0;
  double error = 0.0;
};

/// @param order  Of the stable system's reduced one. @param added  What is counted besides.
Expected<Smaller> smaller(const Continuous& stable, Index order, Index added, TimeDomain domain,
                          ReductionMethod method) {
  constexpr std::string_view where = "reduce_model";
  Smaller found;
  const auto balanced = [&](Index r) -> Expected<BalancedRealization<Continuous>> {
    if (domain == TimeDomain::continuous) {
      return balanced_truncation(stable, r);
    }
    FLYBALL_TRY(auto d, balanced_truncation(timed(stable, Time(1.0)), r));
    return BalancedRealization<Continuous>{bare(d.system), d.hankel, d.T, d.T_inverse,
                                           d.error_bound};
  };
  const Index n = stable.A.rows();
  Index present = 0;
  if (n > 0) {
    FLYBALL_TRY_IN(where, found.hankel,
                   domain == TimeDomain::continuous
                       ? hankel_singular_values(stable)
                       : hankel_singular_values(timed(stable, Time(1.0))));
    const double floor = static_cast<double>(n) * epsilon * found.hankel(0);
    present = (found.hankel.array() > floor).count();
  } else {
    found.hankel = Eigen::VectorXd(0);
  }
  if (order < 0 || order > present) {
    return refusal(ArgumentError::out_of_range, where, "the order")
        .got(std::to_string(order + added))
        .expected(flyball::detail::format(
            "from {} to {}: the unstable states, and those that are reached and seen", added,
            present + added));
  }
  found.bound = 2.0 * found.hankel.tail(n - order).sum();
  if (method == ReductionMethod::matched && present > 0) {
    FLYBALL_TRY_IN(where, const auto all, balanced(present));
    found.system = residualized(all.system, order, domain);
  } else if (order == 0) {
    found.system = {MatrixXd(0, 0), MatrixXd(0, stable.B.cols()), MatrixXd(stable.C.rows(), 0),
                    stable.D};
  } else {
    FLYBALL_TRY_IN(where, const auto some, balanced(order));
    found.system = some.system;
  }
  Continuous negative = found.system;
  negative.C = -negative.C;
  negative.D = -negative.D;
  if (n > 0) {
    FLYBALL_TRY_IN(where, const auto difference, parallel(stable, negative));
    const auto norm = norm_of(difference, domain);
    if (!norm && !norm.error().is(SystemError::no_convergence)) {
      return tl::unexpected(norm.error());
    }
    // Of differences near rounding the search may not end: what it reached is told.
    found.error = norm ? norm->norm : 0.0;
    for (const Evidence& evidence : norm ? std::vector<Evidence>{} : norm.error().evidence()) {
      found.error = evidence.name == "gain reached" ? evidence.values.front() : found.error;
    }
  }
  return found;
}

/// G = N M⁻¹ with the factors [M; N] reduced.
Expected<ReducedModel<Continuous>> by_factors(const Continuous& s, Index order, TimeDomain domain) {
  constexpr std::string_view where = "reduce_model";
  FLYBALL_CHECK(check_system(s, where));
  const Index m = s.B.cols();
  const MatrixXd Q = detail::transposed_product(s.C, s.C);
  const MatrixXd N = detail::transposed_product(s.C, s.D);
  const MatrixXd R =
      detail::symmetrized(MatrixXd::Identity(m, m) + detail::transposed_product(s.D, s.D));
  auto work = detail::CarefulWork::of_a_second(s.A.rows());
  FLYBALL_TRY_IN(where, const auto X,
                 domain == TimeDomain::continuous ? detail::care_within(s.A, s.B, Q, R, N, work)
                                                  : detail::dare_within(s.A, s.B, Q, R, N, work));
  // M = W⁻¹ at infinity, WᵀW = R (+ BᵀXB): the factors are then inner, MᴴM + NᴴN = I.
  MatrixXd weight = R;
  if (domain == TimeDomain::discrete) {
    weight += detail::transposed_product(s.B, product(X.X, s.B));
  }
  const auto L = detail::cholesky_of(detail::symmetrized(weight));
  if (!L) {
    return refusal(SystemError::no_convergence, where, "the coprime factors").got("not found");
  }
  const MatrixXd W_inverse = detail::solve_linear(L->transpose(), MatrixXd::Identity(m, m));
  Continuous factors;
  factors.A = s.A - product(s.B, X.K);
  factors.B = product(s.B, W_inverse);
  factors.C.resize(m + s.C.rows(), s.A.rows());
  factors.C << -X.K, s.C - product(s.D, X.K);
  factors.D.resize(m + s.C.rows(), m);
  factors.D << W_inverse, product(s.D, W_inverse);
  FLYBALL_TRY(const auto reduced, smaller(factors, order, 0, domain, ReductionMethod::truncation));
  const auto& [A, B, C, D] = reduced.system;
  // N M⁻¹.
  const Index p = s.C.rows();
  const MatrixXd M_D = D.topRows(m);
  MatrixXd right(m, C.cols() + m);
  right << C.topRows(m), MatrixXd::Identity(m, m);
  const MatrixXd U = detail::solve_linear(M_D, right);
  const MatrixXd F = U.leftCols(C.cols());
  const MatrixXd M_inverse = U.rightCols(m);
  ReducedModel<Continuous> found;
  found.system = {A - product(B, F), product(B, M_inverse),
                  C.bottomRows(p) - product(D.bottomRows(p), F),
                  product(D.bottomRows(p), M_inverse)};
  found.hankel = reduced.hankel;
  found.error_bound = reduced.bound;
  found.error = reduced.error;
  return found;
}

Expected<ReducedModel<Continuous>> reduced(const Continuous& system, Index order, TimeDomain domain,
                                           ReductionMethod method) {
  if (method == ReductionMethod::coprime) {
    return by_factors(system, order, domain);
  }
  FLYBALL_TRY_IN("reduce_model", const auto parts, split(system, domain));
  ReducedModel<Continuous> found;
  found.unstable = parts.unstable.A.rows();
  FLYBALL_TRY(const auto less,
              smaller(parts.stable, order - found.unstable, found.unstable, domain, method));
  FLYBALL_TRY_IN("reduce_model", found.system, parallel(less.system, parts.unstable));
  found.hankel = less.hankel;
  found.error_bound = less.bound;
  found.error = less.error;
  return found;
}

}  // namespace

std::string_view to_string(ReductionMethod method) {
  constexpr std::string_view names[] = {"truncation", "matched", "coprime"};
  return names[static_cast<std::size_t>(method)];
}

Expected<SpectralSplit<Continuous>> split_spectrum(const Continuous& system) {
  return split(system, TimeDomain::continuous);
}

Expected<SpectralSplit<Discrete>> split_spectrum(const Discrete& system) {
  FLYBALL_CHECK(check_system_or_gain(system, "split_spectrum"));
  return split(bare(system), TimeDomain::discrete).map([&](const SpectralSplit<Continuous>& s) {
    return SpectralSplit<Discrete>{timed(s.stable, system.period), timed(s.unstable, system.period),
                                   s.T, s.residual};
  });
}

Expected<ReducedModel<Continuous>> reduce_model(const Continuous& system, Index order,
                                                ReductionMethod method) {
  return reduced(system, order, TimeDomain::continuous, method);
}

Expected<ReducedModel<Discrete>> reduce_model(const Discrete& system, Index order,
                                              ReductionMethod method) {
  FLYBALL_CHECK(check_system_or_gain(system, "reduce_model"));
  return reduced(bare(system), order, TimeDomain::discrete, method)
      .map([&](const ReducedModel<Continuous>& s) {
        return ReducedModel<Discrete>{timed(s.system, system.period), s.hankel, s.unstable,
                                      s.error_bound, s.error};
      });
}

}  // namespace flyball
