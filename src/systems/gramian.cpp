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

Expected<Gramian> gramian(const MatrixRef& A, const MatrixRef& B, TimeDomain domain) {
  // In a unit of the inputs, and of states that they hardly move, in which BBᵀ is a double.
  constexpr int lowest = -400;
  const Eigen::Index n = A.rows();
  const int unit = B.size() == 0 || B.isZero(0.0) ? 0 : std::ilogb(B.cwiseAbs().maxCoeff());
  Eigen::VectorXi d = Eigen::VectorXi::Zero(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (B.cols() > 0 && !B.row(i).isZero(0.0)) {
      d(i) = std::min(0, std::ilogb(B.row(i).cwiseAbs().maxCoeff()) - unit - lowest);
    }
  }
  MatrixXd A_there = A;
  if (!d.isZero()) {
    A_there = detail::times_powers(A, -d, d, 0);
    if (!A_there.allFinite() || ((A_there.array() == 0.0) != (A.array() == 0.0)).any()) {
      d.setZero();
      A_there = A;
    }
  }
  const MatrixXd B_there = detail::times_powers(B, -d, Eigen::VectorXi::Zero(B.cols()), -unit);
  const MatrixXd BB = detail::product_transposed(B_there, B_there);
  FLYBALL_TRY(auto solution, domain == TimeDomain::continuous ? lyapunov(A_there, BB)
                                                              : discrete_lyapunov(A_there, BB));
  Gramian found;
  found.W = detail::times_powers(detail::symmetrized(solution.X), d, d, 2 * unit);
  if (!found.W.allFinite()) {
    return refusal(MatrixEquationError::overflow, "the Gramian")
        .hint("measure states, inputs and outputs in units in which the entries are nearer to 1");
  }
  found.eigenvalues = detail::symmetric_eigensystem_of(found.W).values;
  found.is_energy = detail::judged_eigenvalues(A, domain).stability == Stability::stable;
  found.residual = solution.residual;
  found.condition = solution.condition;
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
