#include <flyball/systems/gramian.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <flyball/math/equations/matrix_equation.hpp>

#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/extended/wide_matrix.hpp"
#include "systems/balance.hpp"
#include "systems/gramian_factor.hpp"
#include "systems/modes.hpp"

namespace flyball {

namespace detail {

using Eigen::Index;
using Eigen::MatrixXd;

Expected<void> check_stable(const MatrixRef& A, TimeDomain domain, std::string_view where) {
  const JudgedEigenvalues judged = judged_eigenvalues(A, domain);
  if (!judged.converged) {
    return refusal(SystemError::no_convergence, where, "the eigenvalues of A");
  }
  for (Index k = 0; k < judged.values.size(); ++k) {
    if (judged.verdicts[static_cast<std::size_t>(k)] != Stability::stable) {
      return refusal(SystemError::not_stable, where, "A")
          .got(judged.verdicts[static_cast<std::size_t>(k)] == Stability::marginal
                   ? "marginally stable"
                   : "unstable")
          .expected(domain == TimeDomain::continuous
                        ? "stable: every pole left of the imaginary axis"
                        : "stable: every pole within the unit circle")
          .hint(
              "stabilise the system first, or remove a pole that is not reached or seen with "
              "minimal_realization")
          .with("pole", std::vector<double>{judged.values(k).real(), judged.values(k).imag()});
    }
  }
  return {};
}

Expected<MatrixXd> gramian_factor(const MatrixRef& A, const MatrixRef& B, TimeDomain domain,
                                  std::string_view where) {
  FLYBALL_CHECK(check_stable(A, domain, where));
  const Index n = A.rows();
  MatrixXd power = A;
  MatrixXd L = B;
  if (domain == TimeDomain::continuous) {
    // F = (pI - A)⁻¹(pI + A), G = √(2p) (pI - A)⁻¹B have the same Gramian; p in the middle of the
    // poles' sizes brings them all inside the circle.
    const Eigen::VectorXd sizes = eigenvalues_of(A).cwiseAbs();
    const double p = std::sqrt(sizes.minCoeff() * sizes.maxCoeff());
    MatrixXd shifted = -A;
    shifted.diagonal().array() += p;
    MatrixXd right(n, n + B.cols());
    right << A, std::sqrt(2.0 * p) * B;
    right.leftCols(n).diagonal().array() += p;
    const MatrixXd solved = solve_linear(shifted, right);
    power = solved.leftCols(n);
    L = solved.rightCols(B.cols());
  }
  constexpr int most_doublings = 60;
  for (int k = 0; k < most_doublings; ++k) {
    const MatrixXd next = product(power, L);
    if (!next.allFinite()) {
      break;
    }
    const bool last = next.norm() <= 1e-2 * std::numeric_limits<double>::epsilon() * L.norm();
    MatrixXd both(n, L.cols() + next.cols());
    both << L, next;
    if (both.cols() > n) {
      // L Lᵀ of fewer columns: Rᵀ R with R the triangle of bothᵀ.
      L = MatrixXd(triangle_of(both.transpose()).transpose());
    } else {
      L = std::move(both);
    }
    if (last) {
      MatrixXd square = MatrixXd::Zero(n, n);
      square.leftCols(L.cols()) = L;
      return square;
    }
    power = product(power, power);
  }
  return refusal(SystemError::no_convergence, where, "the Gramian")
      .hint("a pole is too close to the boundary of stability");
}

Expected<GramianFactors> gramian_factors(const ContinuousSystem<>& system, TimeDomain domain,
                                         std::string_view where) {
  const SystemScaling scaling = scaling_of(system.A, system.B, system.C);
  const auto [A, B, C, D] = scaled_system(system, scaling);
  FLYBALL_TRY(auto reach, gramian_factor(A, B, domain, where));
  FLYBALL_TRY(auto sight, gramian_factor(A.transpose(), C.transpose(), domain, where));
  return GramianFactors{scaling.states, std::move(reach), std::move(sight)};
}

}  // namespace detail

namespace {

using Eigen::MatrixXd;

/// Whether the equation still holds where entries of W are below the normal doubles, each known to
/// within the smallest of all.
bool holds_as_rounded(const MatrixRef& A, const MatrixRef& B, const MatrixRef& W,
                      TimeDomain domain) {
  using detail::WideMatrix;
  const auto equation = [&](const WideMatrix& a, const WideMatrix& b, const WideMatrix& w,
                            double sign) {
    const WideMatrix aw = product(a, w);
    const WideMatrix bb = product(b, b.transpose());
    return domain == TimeDomain::continuous ? sum(sum(aw, 1.0, aw.transpose()), 1.0, bb)
                                            : sum(add_product(bb, 1.0, aw, a.transpose()), sign, w);
  };
  const WideMatrix a{MatrixXd(A)};
  const WideMatrix b{MatrixXd(B)};
  const WideMatrix w{MatrixXd(W)};
  constexpr double largest_share = 1e-11;
  const WideMatrix known{
      MatrixXd(W.cwiseAbs().array() + std::numeric_limits<double>::denorm_min() / largest_share)};
  return share_of(equation(a, b, w, -1.0), equation(a.magnitudes(), b.magnitudes(), known, 1.0)) <=
         largest_share;
}

/// Units of the states, 2^states, and one of the inputs.
struct GramianUnits {
  Eigen::VectorXi states;
  int inputs = 0;
};

/// Those in which BBᵀ is a double: of the inputs, and of states that they hardly move.
GramianUnits units_of(const MatrixRef& A, const MatrixRef& B, TimeDomain domain) {
  constexpr int lowest = -400;
  const Eigen::Index n = A.rows();
  GramianUnits units{Eigen::VectorXi::Zero(n),
                     B.size() == 0 || B.isZero(0.0) ? 0 : std::ilogb(B.cwiseAbs().maxCoeff())};
  for (Eigen::Index i = 0; i < n; ++i) {
    if (B.cols() > 0 && !B.row(i).isZero(0.0)) {
      units.states(i) =
          std::min(0, std::ilogb(B.row(i).cwiseAbs().maxCoeff()) - units.inputs - lowest);
    }
  }
  // Where entries are far apart, W's largest entry is brought up, its smallest below the doubles no
  // sooner than they must: it is of the size of B²/A.
  constexpr int far = 100;
  const int of_A = A.isZero(0.0) ? 0 : std::ilogb(A.cwiseAbs().maxCoeff());
  if (!units.states.isZero() || std::abs(of_A) > far) {
    const int grows = domain == TimeDomain::continuous ? std::clamp(of_A, lowest, 500) : 0;
    units.inputs -= (grows - lowest) / 2;
  }
  if (!units.states.isZero()) {
    const MatrixXd there = detail::times_powers(A, -units.states, units.states, 0);
    if (!there.allFinite() || ((there.array() == 0.0) != (A.array() == 0.0)).any()) {
      units.states.setZero();
    }
  }
  return units;
}

Expected<Gramian> gramian_in(const GramianUnits& units, const MatrixRef& A, const MatrixRef& B,
                             TimeDomain domain) {
  const Eigen::VectorXi& d = units.states;
  const MatrixXd A_there = detail::times_powers(A, -d, d, 0);
  const MatrixXd B_there =
      detail::times_powers(B, -d, Eigen::VectorXi::Zero(B.cols()), -units.inputs);
  const MatrixXd BB = detail::product_transposed(B_there, B_there);
  FLYBALL_TRY(auto solution, domain == TimeDomain::continuous ? lyapunov(A_there, BB)
                                                              : discrete_lyapunov(A_there, BB));
  Gramian found;
  found.W = detail::times_powers(detail::symmetrized(solution.X), d, d, 2 * units.inputs);
  // Entries that are no normal doubles, there or here, may be what the equation rests on.
  constexpr double least = std::numeric_limits<double>::min();
  constexpr int far = 100;
  const bool is_far = std::abs(units.inputs) > far || (d.array().abs() > far).any();
  const bool rounds =
      is_far && (solution.X.array().abs() < least || found.W.array().abs() < least).any();
  if (!found.W.allFinite() || (rounds && !holds_as_rounded(A, B, found.W, domain))) {
    return refusal(MatrixEquationError::overflow, "the Gramian")
        .hint("measure states, inputs and outputs in units in which the entries are nearer to 1");
  }
  found.eigenvalues = detail::symmetric_eigensystem_of(found.W).values;
  found.is_energy = detail::judged_eigenvalues(A, domain).stability == Stability::stable;
  found.residual = solution.residual;
  found.condition = solution.condition;
  return found;
}

Expected<Gramian> gramian(const MatrixRef& A, const MatrixRef& B, TimeDomain domain) {
  const GramianUnits units = units_of(A, B, domain);
  auto found = gramian_in(units, A, B, domain);
  if (!found && (units.inputs != 0 || !units.states.isZero())) {
    auto as_given = gramian_in({Eigen::VectorXi::Zero(A.rows()), 0}, A, B, domain);
    if (as_given && holds_as_rounded(A, B, as_given->W, domain)) {
      return as_given;
    }
  }
  return found;
}

Expected<void> check_gramian(const MatrixRef& A, const MatrixRef& B, Eigen::Index rows,
                             Eigen::Index columns, std::string_view name, std::string_view meaning,
                             std::string_view where) {
  FLYBALL_CHECK(check_square(A, where, "A"));
  return Checks(where).shape(B, rows, columns, name, meaning).finite(A, "A").finite(B, name);
}

Expected<Eigen::VectorXd> hankel(const ContinuousSystem<>& system, TimeDomain domain) {
  return detail::gramian_factors(system, domain, "hankel_singular_values")
      .map([](const detail::GramianFactors& factors) {
        return detail::singular_values_of(
            detail::transposed_product(factors.observability, factors.controllability));
      });
}

}  // namespace

Expected<Gramian> controllability_gramian(const MatrixRef& A, const MatrixRef& B,
                                          TimeDomain domain) {
  FLYBALL_CHECK(
      check_gramian(A, B, A.rows(), B.cols(), "B", "states x inputs", "controllability_gramian"));
  return gramian(A, B, domain);
}

Expected<Gramian> observability_gramian(const MatrixRef& A, const MatrixRef& C, TimeDomain domain) {
  FLYBALL_CHECK(
      check_gramian(A, C, C.rows(), A.rows(), "C", "outputs x states", "observability_gramian"));
  return gramian(A.transpose(), C.transpose(), domain);
}

Expected<Eigen::VectorXd> hankel_singular_values(const ContinuousSystem<>& system) {
  FLYBALL_CHECK(check_system(system, "hankel_singular_values"));
  return hankel(system, TimeDomain::continuous);
}

Expected<Eigen::VectorXd> hankel_singular_values(const DiscreteSystem<>& system) {
  FLYBALL_CHECK(check_system(system, "hankel_singular_values"));
  return hankel({system.A, system.B, system.C, system.D}, TimeDomain::discrete);
}

}  // namespace flyball
