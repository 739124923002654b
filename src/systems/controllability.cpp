#include <flyball/systems/controllability.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include <flyball/math/equations/matrix_equation.hpp>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/dense/pair_scaling.hpp"
#include "systems/mode_distance.hpp"
#include "systems/modes.hpp"
#include "systems/staircase.hpp"
#include "systems/sure_reach.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;
using detail::product;
using detail::transposed_product;
using Eigen::Index;
using Eigen::MatrixXd;

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

/// The pair in units in which its entries are near one, and the part of it to which paths lead.
struct ScaledPair {
  ScaledPair(const MatrixRef& A_given, const MatrixRef& B_given)
      : units(detail::pair_scaling_of(A_given, B_given)),
        A(detail::scaled_A(A_given, units)),
        B(detail::scaled_B(B_given, units)),
        on_paths(detail::states_on_paths(A_given, B_given)) {
    for (Index i = 0, k = 0; i < A.rows(); ++i) {
      if (k < static_cast<Index>(on_paths.size()) && on_paths[static_cast<std::size_t>(k)] == i) {
        ++k;
      } else {
        off_paths.push_back(i);
      }
    }
  }

  detail::PairScaling units;
  MatrixXd A;
  MatrixXd B;
  std::vector<Index> on_paths;
  std::vector<Index> off_paths;
};

/// The staircase of a part that is known to be reached: what rounding would call nothing counts.
detail::Staircase whole_staircase(const MatrixXd& A, const MatrixXd& B) {
  detail::Staircase stairs = detail::staircase_of(A, B, 0.0);
  if (stairs.rank < A.rows()) {
    stairs.stairs.push_back(A.rows() - stairs.rank);
    stairs.A = transposed_product(stairs.Q, product(A, stairs.Q));
    stairs.B = transposed_product(stairs.Q, B);
    stairs.rank = A.rows();
  }
  return stairs;
}

/// w'ᵀx' in the states' own units, of norm 1.
Eigen::VectorXd in_given_units(const Eigen::VectorXd& w, const Eigen::VectorXi& units) {
  int largest = std::numeric_limits<int>::min();
  for (Index i = 0; i < w.size(); ++i) {
    if (w(i) != 0.0) {
      largest = std::max(largest, std::ilogb(w(i)) - units(i));
    }
  }
  Eigen::VectorXd given = Eigen::VectorXd::Zero(w.size());
  for (Index i = 0; i < w.size(); ++i) {
    given(i) = w(i) == 0.0 ? 0.0 : std::ldexp(w(i), -units(i) - largest);
  }
  const double length = given.norm();
  return length > 0.0 ? Eigen::VectorXd(given / length) : given;
}

/// The singular values of a matrix whose rows are of sizes that doubles' squares do not hold: the
/// rows' sizes are kept apart until they are triangular, the largest first.
Eigen::VectorXd graded_singular_values(const MatrixXd& wide) {
  const Eigen::VectorXd sizes = wide.cwiseAbs().rowwise().maxCoeff();
  std::vector<Index> order(static_cast<std::size_t>(wide.rows()));
  std::iota(order.begin(), order.end(), Index{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](Index i, Index j) { return sizes(i) > sizes(j); });
  if (!(sizes.minCoeff() > 0.0)) {
    return Eigen::VectorXd::Unit(wide.rows(), 0) * sizes.maxCoeff();
  }
  MatrixXd tall(wide.cols(), wide.rows());
  Eigen::VectorXd sorted(wide.rows());
  for (Index k = 0; k < wide.rows(); ++k) {
    const Index i = order[static_cast<std::size_t>(k)];
    sorted(k) = sizes(i);
    tall.col(k) = wide.row(i).transpose() / sizes(i);
  }
  return detail::singular_values_of(detail::triangle_of(tall) * sorted.asDiagonal());
}

double condition_of(MatrixXd krylov_matrix) {
  const double largest = krylov_matrix.size() > 0 ? krylov_matrix.cwiseAbs().maxCoeff() : 0.0;
  if (!krylov_matrix.allFinite() || !(largest > 0.0)) {
    return infinity;
  }
  krylov_matrix /= largest;
  constexpr double graded = 1e-100;
  detail::SingularExtent extent = detail::singular_extent_of(krylov_matrix, epsilon);
  if (extent.smallest <= graded * extent.largest) {
    const Eigen::VectorXd sizes = graded_singular_values(krylov_matrix);
    extent = {sizes(0), sizes(sizes.size() - 1), 0};
  }
  return extent.smallest > 0.0 ? extent.largest / extent.smallest : infinity;
}

/// In the pair's units, with inputs in theirs: of the given states' units where that has an answer,
/// since units in which hundreds of states in a row move each other alike are far apart; then of
/// the pair's own, of an A of 2^time far from one only where the equation lets that size be taken
/// out.
Eigen::VectorXd gramian_eigenvalues(const MatrixRef& A_given, const ScaledPair& pair,
                                    TimeDomain domain) {
  constexpr int far = 200;
  const int exponent = pair.units.time;
  const bool near = std::abs(exponent) <= far;
  const auto solve = [&](const MatrixXd& A, const MatrixXd& B) {
    const MatrixXd BB = detail::product_transposed(B, B);
    return domain == TimeDomain::continuous ? lyapunov(A, BB) : discrete_lyapunov(A, BB);
  };
  const auto values_of = [](const MatrixXd& W) {
    return detail::symmetric_eigensystem_of(detail::symmetrized(W)).values;
  };
  const double unit = near ? std::ldexp(1.0, exponent) : 1.0;
  if (near) {
    const Eigen::VectorXi& x = pair.units.states;
    MatrixXd B = detail::times_powers(pair.B, x, Eigen::VectorXi::Zero(pair.B.cols()), exponent);
    const int of_B = B.isZero(0.0) ? 0 : std::ilogb(B.cwiseAbs().maxCoeff());
    B *= std::ldexp(1.0, -of_B);
    if (const auto given = solve(A_given, B)) {
      const MatrixXd W = detail::times_powers(given->X, -x, -x, 2 * of_B);
      return W.allFinite() ? values_of(W) : Eigen::VectorXd();
    }
  } else if (domain == TimeDomain::discrete) {
    return {};
  }
  const auto gramian = solve(unit * pair.A, unit * pair.B);
  if (!gramian) {
    return {};
  }
  const Eigen::VectorXd values = values_of(gramian->X);
  return near
             ? values
             : Eigen::VectorXd(values.unaryExpr([&](double x) { return std::ldexp(x, exponent); }));
}

Error no_eigenvalues(std::string_view where) {
  return Error(SystemError::no_convergence)
      .in(std::string(where))
      .about("the eigenvalues of A")
      .hint("scale its rows and columns to like magnitudes");
}

Expected<Verdict> analyze(const MatrixRef& A_given, const MatrixRef& B_given, TimeDomain domain,
                          std::string_view where) {
  const Index n = A_given.rows();
  const ScaledPair pair(A_given, B_given);
  const int exponent = pair.units.time;
  const MatrixXd A = pair.A(pair.on_paths, pair.on_paths);
  const MatrixXd B = pair.B(pair.on_paths, Eigen::all);

  Verdict verdict;
  ReachAnalysis& reach = verdict.reach;
  reach.order = n;
  reach.tolerance = 100.0 * epsilon * static_cast<double>(n);
  Eigen::VectorXcd all;
  const std::vector<Eigen::VectorXd> shares = participations(pair.A, all);
  if (!all.allFinite()) {
    return tl::unexpected(no_eigenvalues(where));
  }
  const auto share_of = [&](Complex lambda) {
    std::size_t nearest = 0;
    for (std::size_t k = 0; k < shares.size(); ++k) {
      if (std::abs(all(static_cast<Index>(k)) - lambda) <
          std::abs(all(static_cast<Index>(nearest)) - lambda)) {
        nearest = k;
      }
    }
    return shares[nearest];
  };
  const auto add_hidden = [&](const detail::JudgedEigenvalues& hidden, double distance) {
    for (Index k = 0; k < hidden.values.size(); ++k) {
      reach.modes.push_back({hidden.values(k), false, distance,
                             hidden.verdicts[static_cast<std::size_t>(k)],
                             share_of(hidden.of_A(k))});
    }
    verdict.hidden_decay = verdict.hidden_decay && hidden.stability == Stability::stable;
  };

  // Where no path leads nothing was turned or rounded.
  const detail::JudgedEigenvalues apart =
      detail::judged_eigenvalues(pair.A(pair.off_paths, pair.off_paths), domain, 0.0, exponent);
  if (!apart.converged) {
    return tl::unexpected(no_eigenvalues(where));
  }
  add_hidden(apart, 0.0);

  const double size = std::max(std::hypot(A.norm(), B.norm()), 1e-300);
  // The blocks have been turned out of A.
  const double blur = 10.0 * epsilon * static_cast<double>(n) * A.norm();
  detail::Staircase stairs = detail::staircase_of(A, B, reach.tolerance);
  bool sure = false;
  if (stairs.rank < A.rows()) {
    sure = detail::surely_reached(A_given(pair.on_paths, pair.on_paths),
                                  B_given(pair.on_paths, Eigen::all), reach.tolerance) ||
           detail::reached_at_every_speed(A, B);
    if (sure) {
      stairs = whole_staircase(A, B);
    }
  }
  const Index r = stairs.rank;
  const Index rest = A.rows() - r;
  const detail::JudgedEigenvalues hidden =
      detail::judged_eigenvalues(stairs.A.bottomRightCorner(rest, rest), domain, blur, exponent);
  const MatrixXd A_r = stairs.A.topLeftCorner(r, r);
  const MatrixXd B_r = stairs.B.topRows(r);
  const detail::JudgedEigenvalues seen = detail::judged_eigenvalues(A_r, domain, blur, exponent);
  if (!hidden.converged || !seen.converged) {
    return tl::unexpected(no_eigenvalues(where));
  }
  add_hidden(hidden, stairs.largest_rest);

  const detail::ModeDistance distances(A_r, B_r);
  std::vector<double> distance_of;
  std::vector<Complex> missed;
  for (Index k = 0; k < seen.values.size(); ++k) {
    const Complex lambda = seen.of_A(k);
    const bool conjugate = k > 0 && lambda == std::conj(seen.of_A(k - 1)) && lambda.imag() != 0.0;
    const double distance = conjugate ? distance_of.back()
                                      : distances.near(lambda, reach.tolerance * size).value / size;
    distance_of.push_back(distance);
    if (!(distance > reach.tolerance)) {
      missed.push_back(lambda);
    }
  }
  if (!missed.empty() && rest == 0) {
    sure = sure ||
           detail::surely_reached(A_given(pair.on_paths, pair.on_paths),
                                  B_given(pair.on_paths, Eigen::all), reach.tolerance) ||
           detail::reached_at_every_speed(A, B);
  }
  if (sure) {
    missed.clear();
  }
  for (Index k = 0; k < seen.values.size(); ++k) {
    const double distance = distance_of[static_cast<std::size_t>(k)];
    const Stability stability = seen.verdicts[static_cast<std::size_t>(k)];
    const bool reached = sure || distance > reach.tolerance;
    reach.modes.push_back({seen.values(k), reached, distance, stability, share_of(seen.of_A(k))});
    verdict.hidden_decay = verdict.hidden_decay && (reached || stability == Stability::stable);
  }
  std::stable_sort(reach.modes.begin(), reach.modes.end(),
                   [](const ModeReach& a, const ModeReach& b) {
                     return a.reached != b.reached ? !a.reached : a.distance < b.distance;
                   });
  reach.stairs = stairs.stairs;
  reach.rank = r - static_cast<Index>(missed.size());

  // Where no path leads, what the staircase left over, and the left vectors of modes that only
  // their own test found.
  MatrixXd directions(A.rows(), rest + static_cast<Index>(missed.size()));
  directions.leftCols(rest) = stairs.Q.rightCols(rest);
  for (std::size_t k = 0; k < missed.size(); ++k) {
    const Eigen::VectorXcd left = distances.at(missed[k]).left;
    const MatrixXd part = missed[k].imag() < 0.0 ? MatrixXd(left.imag()) : MatrixXd(left.real());
    directions.col(rest + static_cast<Index>(k)) = product(stairs.Q.leftCols(r), part);
  }
  reach.hidden = MatrixXd::Zero(n, n - reach.rank);
  const auto off = static_cast<Index>(pair.off_paths.size());
  for (Index k = 0; k < off; ++k) {
    reach.hidden(pair.off_paths[static_cast<std::size_t>(k)], k) = 1.0;
  }
  for (Index k = 0; k < directions.cols(); ++k) {
    Eigen::VectorXd w = Eigen::VectorXd::Zero(n);
    w(pair.on_paths) = directions.col(k);
    reach.hidden.col(off + k) = in_given_units(w, pair.units.states);
  }

  if (B.cols() > 0) {
    const double unit = pair.A.norm() > 0.0 ? pair.A.norm() : 1.0;
    reach.matrix_rank = detail::singular_extent_of(krylov_factor(pair.A / unit, pair.B),
                                                   static_cast<double>(n) * epsilon)
                            .rank;
  }
  reach.matrix_condition = condition_of(krylov_factor(A_given, B_given));
  reach.gramian_eigenvalues = gramian_eigenvalues(A_given, pair, domain);
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
