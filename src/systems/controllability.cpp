#include <flyball/systems/controllability.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <flyball/math/equations/matrix_equation.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"
#include "systems/balance.hpp"
#include "systems/mode_distance.hpp"
#include "systems/modes.hpp"
#include "systems/staircase.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;
using detail::product;
using Eigen::Index;
using Eigen::MatrixXd;

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double infinity = std::numeric_limits<double>::infinity();

/// |v_i w_i| of each eigenvalue, independent of the states' units.
std::vector<Eigen::VectorXd> participations(const MatrixXd& A, Eigen::VectorXcd& values) {
  const Index n = A.rows();
  const detail::Eigensystem system = detail::eigensystem_of(A);
  values = system.values;
  std::vector<Eigen::VectorXd> shares;
  const Eigen::MatrixXcd rows =
      detail::solve_complex(system.vectors, Eigen::MatrixXcd::Identity(n, n));
  for (Index k = 0; k < n; ++k) {
    Eigen::VectorXd share =
        system.vectors.col(k).cwiseAbs().cwiseProduct(rows.row(k).transpose().cwiseAbs());
    if (!share.allFinite() || !(share.sum() > 0.0)) {
      share = system.vectors.col(k).cwiseAbs2();
    }
    shares.push_back(share / std::max(share.sum(), 1e-300));
  }
  return shares;
}

Index numerical_rank(const Eigen::VectorXd& singular_values, double tolerance) {
  Index rank = 0;
  for (Index k = 0; k < singular_values.size(); ++k) {
    rank += singular_values(k) > tolerance * singular_values(0) ? 1 : 0;
  }
  return rank;
}

MatrixXd krylov(const MatrixXd& A, const MatrixXd& B) {
  const Index n = A.rows();
  const Index m = B.cols();
  MatrixXd K(n, n * m);
  MatrixXd power = B;
  for (Index k = 0; k < n; ++k) {
    K.middleCols(k * m, m) = power;
    power = product(A, power);
  }
  return K;
}

/// A matrix of the singular values of `krylov(A, B)`. That of many inputs would take O(n³m); here
/// [K, AᵏK] is L of n columns each time that the number k of powers doubles.
MatrixXd krylov_factor(const MatrixXd& A, const MatrixXd& B) {
  const Index n = A.rows();
  constexpr Index few = 16;
  if (B.cols() <= few) {
    return krylov(A, B);
  }
  const auto joined = [n](const MatrixXd& left, const MatrixXd& right) {
    MatrixXd both(n, left.cols() + right.cols());
    both << left, right;
    return both.cols() > n ? MatrixXd(detail::triangle_of(both.transpose()).transpose()) : both;
  };
  MatrixXd L = B;
  MatrixXd power = A;
  Index bit = 1;
  while (2 * bit <= n) {
    bit *= 2;
  }
  for (bit /= 2; bit > 0; bit /= 2) {
    L = joined(L, product(power, L));
    power = product(power, power);
    if ((n & bit) != 0) {
      L = joined(B, product(A, L));
      power = product(A, power);
    }
  }
  return L;
}

struct Verdict {
  ReachAnalysis reach;
  bool hidden_decay = true;
};

Expected<Verdict> analyze(const MatrixRef& A_given, const MatrixRef& B_given, TimeDomain domain,
                          std::string_view where) {
  const Index n = A_given.rows();
  const detail::SystemScaling scaling = detail::scaling_of(A_given, B_given, MatrixXd::Zero(0, n));
  const MatrixXd A = detail::scaled_state_matrix(A_given, scaling);
  const MatrixXd B =
      scaling.inputs * MatrixXd(scaling.states.cwiseInverse().asDiagonal() * B_given);

  Verdict verdict;
  ReachAnalysis& reach = verdict.reach;
  reach.order = n;
  reach.tolerance = 100.0 * epsilon * static_cast<double>(n);
  const double size = std::max(std::hypot(A.norm(), B.norm()), 1e-300);

  const detail::Staircase stairs = detail::staircase_of(A, B, reach.tolerance);
  reach.stairs = stairs.stairs;
  reach.rank = stairs.rank;
  Eigen::VectorXcd all;
  const std::vector<Eigen::VectorXd> shares = participations(A, all);
  if (!all.allFinite()) {
    return refusal(SystemError::no_convergence, where, "the eigenvalues of A")
        .hint("scale its rows and columns to like magnitudes");
  }
  const auto share_of = [&](Complex lambda) {
    Index nearest = 0;
    (all.array() - lambda).abs().minCoeff(&nearest);
    return shares[static_cast<std::size_t>(nearest)];
  };

  const Index r = stairs.rank;
  const MatrixXd A_u = stairs.A.bottomRightCorner(n - r, n - r);
  // The blocks have been turned out of A.
  const double blur = 10.0 * epsilon * static_cast<double>(n) * A.norm();
  const detail::JudgedEigenvalues hidden = detail::judged_eigenvalues(A_u, domain, blur);
  for (Index k = 0; k < hidden.values.size(); ++k) {
    reach.modes.push_back({hidden.values(k), false, stairs.largest_rest,
                           hidden.verdicts[static_cast<std::size_t>(k)],
                           share_of(hidden.values(k))});
  }
  verdict.hidden_decay = n == r || hidden.stability == Stability::stable;

  const MatrixXd A_r = stairs.A.topLeftCorner(r, r);
  const MatrixXd B_r = stairs.B.topRows(r);
  const detail::JudgedEigenvalues seen = detail::judged_eigenvalues(A_r, domain, blur);
  if (!hidden.converged || !seen.converged) {
    return refusal(SystemError::no_convergence, where, "the eigenvalues of A");
  }
  const detail::ModeDistance distances(A_r, B_r);
  std::vector<Complex> missed;
  double last = 0.0;
  for (Index k = 0; k < seen.values.size(); ++k) {
    const Complex lambda = seen.values(k);
    const bool conjugate = k > 0 && lambda == std::conj(seen.values(k - 1)) && lambda.imag() != 0.0;
    const double distance =
        conjugate ? last : distances.near(lambda, reach.tolerance * size).value / size;
    last = distance;
    const Stability stability = seen.verdicts[static_cast<std::size_t>(k)];
    const bool reached = distance > reach.tolerance;
    reach.modes.push_back({lambda, reached, distance, stability, share_of(lambda)});
    if (!reached) {
      missed.push_back(lambda);
      --reach.rank;
      verdict.hidden_decay = verdict.hidden_decay && stability == Stability::stable;
    }
  }
  std::stable_sort(reach.modes.begin(), reach.modes.end(),
                   [](const ModeReach& a, const ModeReach& b) {
                     return a.reached != b.reached ? !a.reached : a.distance < b.distance;
                   });

  // What the staircase left over, and the left vectors of modes that only their own test found.
  MatrixXd directions(n, n - r + static_cast<Index>(missed.size()));
  directions.leftCols(n - r) = stairs.Q.rightCols(n - r);
  for (std::size_t k = 0; k < missed.size(); ++k) {
    const Eigen::VectorXcd left = distances.at(missed[k]).left;
    const MatrixXd part = missed[k].imag() < 0.0 ? MatrixXd(left.imag()) : MatrixXd(left.real());
    directions.col(n - r + static_cast<Index>(k)) = product(stairs.Q.leftCols(r), part);
  }
  reach.hidden = scaling.states.cwiseInverse().asDiagonal() * directions;
  for (Index k = 0; k < reach.hidden.cols(); ++k) {
    const double length = reach.hidden.col(k).norm();
    if (length > 0.0) {
      reach.hidden.col(k) /= length;
    }
  }

  const double unit = A.norm() > 0.0 ? A.norm() : 1.0;
  if (B.cols() > 0) {
    const Eigen::VectorXd sizes = detail::coarse_singular_values_of(krylov_factor(A / unit, B));
    reach.matrix_rank = numerical_rank(sizes, static_cast<double>(n) * epsilon);
  }
  const MatrixXd raw = krylov_factor(A_given, B_given);
  if (raw.cols() > 0 && raw.allFinite()) {
    const Eigen::VectorXd raw_sizes = detail::coarse_singular_values_of(raw);
    const double smallest = raw_sizes(raw_sizes.size() - 1);
    reach.matrix_condition = smallest > 0.0 ? raw_sizes(0) / smallest : infinity;
  } else {
    reach.matrix_condition = infinity;
  }
  const MatrixXd BB = detail::product_transposed(B, B);
  const auto gramian =
      domain == TimeDomain::continuous ? lyapunov(A, BB) : discrete_lyapunov(A, BB);
  if (gramian) {
    reach.gramian_eigenvalues =
        detail::symmetric_eigensystem_of(detail::symmetrized(gramian->X)).values;
  }
  return verdict;
}

Expected<void> check_pair(const MatrixRef& A, const MatrixRef& B, Index rows, Index columns,
                          std::string_view name, std::string_view meaning, std::string_view where) {
  FLYBALL_CHECK(check_square(A, where, "A"));
  return Checks(where).shape(B, rows, columns, name, meaning).finite(A, "A").finite(B, name);
}

}  // namespace

Expected<MatrixXd> controllability_matrix(const MatrixRef& A, const MatrixRef& B) {
  FLYBALL_CHECK(
      check_pair(A, B, A.rows(), B.cols(), "B", "states x inputs", "controllability_matrix"));
  return krylov(A, B);
}

Expected<MatrixXd> observability_matrix(const MatrixRef& A, const MatrixRef& C) {
  FLYBALL_CHECK(
      check_pair(A, C, C.rows(), A.rows(), "C", "outputs x states", "observability_matrix"));
  const MatrixXd columns = krylov(A.transpose(), C.transpose());
  return MatrixXd(columns.transpose());
}

Expected<ControllabilityAnalysis> analyze_controllability(const MatrixRef& A, const MatrixRef& B,
                                                          TimeDomain domain) {
  constexpr std::string_view where = "analyze_controllability";
  FLYBALL_CHECK(check_pair(A, B, A.rows(), B.cols(), "B", "states x inputs", where));
  return analyze(A, B, domain, where).map([](Verdict&& verdict) {
    ControllabilityAnalysis analysis{std::move(verdict.reach)};
    analysis.controllable = analysis.rank == analysis.order;
    analysis.stabilizable = verdict.hidden_decay;
    return analysis;
  });
}

Expected<ObservabilityAnalysis> analyze_observability(const MatrixRef& A, const MatrixRef& C,
                                                      TimeDomain domain) {
  constexpr std::string_view where = "analyze_observability";
  FLYBALL_CHECK(check_pair(A, C, C.rows(), A.rows(), "C", "outputs x states", where));
  const MatrixXd A_transposed = A.transpose();
  const MatrixXd C_transposed = C.transpose();
  return analyze(A_transposed, C_transposed, domain, where).map([](Verdict&& verdict) {
    ObservabilityAnalysis analysis{std::move(verdict.reach)};
    analysis.observable = analysis.rank == analysis.order;
    analysis.detectable = verdict.hidden_decay;
    return analysis;
  });
}

}  // namespace flyball
