#include <flyball/systems/controllability.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <flyball/math/matrix_equation.hpp>

#include "core/format.hpp"
#include "math/dense.hpp"
#include "systems/balance.hpp"
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

/// The smallest singular value of [A - λI, B] and the left vector that belongs to it.
struct Pencil {
  double smallest = 0.0;
  Eigen::VectorXcd left;
};

/// [Re -Im; Im Re] has the singular values of the complex pencil, each twice.
MatrixXd doubled_pencil(const MatrixXd& A, const MatrixXd& B, Complex lambda) {
  const Index n = A.rows();
  const Index m = B.cols();
  MatrixXd M = MatrixXd::Zero(2 * n, 2 * (n + m));
  M.block(0, 0, n, n) = A;
  M.block(0, 0, n, n).diagonal().array() -= lambda.real();
  M.block(0, n, n, m) = B;
  M.block(n, n + m, n, n + m) = M.block(0, 0, n, n + m);
  M.block(0, n + m, n, n).diagonal().setConstant(lambda.imag());
  M.block(n, 0, n, n).diagonal().setConstant(-lambda.imag());
  return M;
}

Pencil pencil_at(const MatrixXd& A, const MatrixXd& B, Complex lambda) {
  const Index n = A.rows();
  const Index m = B.cols();
  if (lambda.imag() == 0.0) {
    MatrixXd M(n, n + m);
    M << A, B;
    M.leftCols(n).diagonal().array() -= lambda.real();
    const detail::SingularValues svd = detail::svd_of(M);
    return {svd.values(n - 1), svd.U.col(n - 1).cast<Complex>()};
  }
  const detail::SingularValues svd = detail::svd_of(doubled_pencil(A, B, lambda));
  Pencil pencil{svd.values(2 * n - 1), Eigen::VectorXcd(n)};
  pencil.left.real() = svd.U.col(2 * n - 1).head(n);
  pencil.left.imag() = svd.U.col(2 * n - 1).tail(n);
  return pencil;
}

/// The distance of a mode: the smallest singular value near its computed eigenvalue, which rounding
/// has displaced: λ = uᴴAu is the best for the vector u that was found.
double distance_of(const MatrixXd& A, const MatrixXd& B, Complex lambda, double tolerance) {
  const Index n = A.rows();
  constexpr Index largest_for_vectors = 40;
  if (n > largest_for_vectors) {
    const MatrixXd R = detail::pivoted_qr(doubled_pencil(A, B, lambda).transpose()).R;
    return std::abs(R(2 * n - 1, 2 * n - 1));
  }
  Pencil pencil = pencil_at(A, B, lambda);
  constexpr double suspicious = 1e-5;
  for (int pass = 0; pass < 4; ++pass) {
    if (pencil.smallest <= tolerance || pencil.smallest > suspicious * A.norm()) {
      break;
    }
    const Eigen::VectorXcd& u = pencil.left;
    const Complex better = u.dot(A.cast<Complex>().lazyProduct(u));
    const Complex next = lambda.imag() == 0.0 ? Complex(better.real(), 0.0) : better;
    const Pencil tried = pencil_at(A, B, next);
    if (!(tried.smallest < 0.5 * pencil.smallest)) {
      break;
    }
    pencil = tried;
  }
  return pencil.smallest;
}

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
    return tl::unexpected(Error(SystemError::no_convergence)
                              .in(std::string(where))
                              .about("the eigenvalues of A")
                              .hint("scale its rows and columns to like magnitudes"));
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
    return tl::unexpected(
        Error(SystemError::no_convergence).in(std::string(where)).about("the eigenvalues of A"));
  }
  std::vector<Complex> missed;
  double last = 0.0;
  for (Index k = 0; k < seen.values.size(); ++k) {
    const Complex lambda = seen.values(k);
    const bool conjugate = k > 0 && lambda == std::conj(seen.values(k - 1)) && lambda.imag() != 0.0;
    const double distance =
        conjugate ? last : distance_of(A_r, B_r, lambda, reach.tolerance * size) / size;
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
    const Eigen::VectorXcd left = pencil_at(A_r, B_r, missed[k]).left;
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
    const Eigen::VectorXd sizes = detail::singular_values_of(krylov(A / unit, B));
    reach.matrix_rank = numerical_rank(sizes, static_cast<double>(n) * epsilon);
  }
  const MatrixXd raw = krylov(A_given, B_given);
  if (raw.cols() > 0 && raw.allFinite()) {
    const Eigen::VectorXd raw_sizes = detail::singular_values_of(raw);
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
  if (auto square = check_square(A, where, "A"); !square) {
    return square;
  }
  return check_all(check_shape(B, rows, columns, where, name, meaning), check_finite(A, where, "A"),
                   check_finite(B, where, name));
}

std::string name_of(Index k, std::span<const std::string> names) {
  const auto index = static_cast<std::size_t>(k);
  return index < names.size() ? names[index] : detail::format("x{}", k + 1);
}

/// "x1", "0.71 x1 - 0.71 x2".
std::string combination(const Eigen::VectorXd& w, std::span<const std::string> names) {
  const double largest = w.cwiseAbs().maxCoeff();
  std::vector<Index> parts;
  for (Index k = 0; k < w.size(); ++k) {
    if (std::abs(w(k)) > 1e-6 * largest) {
      parts.push_back(k);
    }
  }
  if (parts.size() == 1) {
    return name_of(parts.front(), names);
  }
  const double sign = w(parts.front()) < 0.0 ? -1.0 : 1.0;
  std::string text;
  for (const Index k : parts) {
    const double value = sign * w(k);
    text += text.empty() ? (value < 0.0 ? "-" : "") : (value < 0.0 ? " - " : " + ");
    text += format_number(std::abs(value), 3) + ' ' + name_of(k, names);
  }
  return text;
}

/// "mostly x1 and x2".
std::string owners(const Eigen::VectorXd& participation, std::span<const std::string> names) {
  std::string text;
  for (Index k = 0; k < participation.size(); ++k) {
    if (participation(k) >= 0.25) {
      text += (text.empty() ? "" : ", ") + name_of(k, names);
    }
  }
  return text.empty() ? "all states together" : text;
}

/// For words only: parts that are rounding beside the other eigenvalues are zero.
std::complex<double> without_rounding(std::complex<double> eigenvalue, double scale) {
  constexpr double rounding = 1e-12;
  const auto part = [&](double value) { return std::abs(value) < rounding * scale ? 0.0 : value; };
  return {part(eigenvalue.real()), part(eigenvalue.imag())};
}

struct Words {
  std::string_view verb;     ///< "no input moves"
  std::string_view reached;  ///< "reached by the inputs"
  std::string_view weak;     ///< "an input barely moves"
};

std::string describe(const ReachAnalysis& analysis, std::string_view headline, const Words& words,
                     std::span<const std::string> names) {
  std::string text = detail::format("{}: {} of {} states {}\n", headline, analysis.rank,
                                    analysis.order, words.reached);
  for (Index k = 0; k < analysis.hidden.cols(); ++k) {
    text += detail::format("{} {}\n", words.verb, combination(analysis.hidden.col(k), names));
  }
  double scale = 0.0;
  for (const ModeReach& mode : analysis.modes) {
    scale = std::max(scale, std::abs(mode.eigenvalue));
  }
  for (const ModeReach& mode : analysis.modes) {
    if (mode.eigenvalue.imag() < 0.0) {
      continue;
    }
    const std::string pole = detail::pole_text(without_rounding(mode.eigenvalue, scale));
    if (!mode.reached) {
      text += detail::format("{} the mode {} ({}; {})\n", words.verb, pole,
                             to_string(mode.stability), owners(mode.participation, names));
    } else {
      constexpr double weak = 1e-6;
      text += detail::format("{} {} ({}; {}): distance {} from being cut off\n",
                             mode.distance < weak ? words.weak : std::string_view("mode"), pole,
                             to_string(mode.stability), owners(mode.participation, names),
                             format_number(mode.distance, 2));
    }
  }
  return text;
}

}  // namespace

Expected<MatrixXd> controllability_matrix(const MatrixRef& A, const MatrixRef& B) {
  if (auto checked =
          check_pair(A, B, A.rows(), B.cols(), "B", "states x inputs", "controllability_matrix");
      !checked) {
    return tl::unexpected(std::move(checked).error());
  }
  return krylov(A, B);
}

Expected<MatrixXd> observability_matrix(const MatrixRef& A, const MatrixRef& C) {
  if (auto checked =
          check_pair(A, C, C.rows(), A.rows(), "C", "outputs x states", "observability_matrix");
      !checked) {
    return tl::unexpected(std::move(checked).error());
  }
  const MatrixXd columns = krylov(A.transpose(), C.transpose());
  return MatrixXd(columns.transpose());
}

Expected<ControllabilityAnalysis> analyze_controllability(const MatrixRef& A, const MatrixRef& B,
                                                          TimeDomain domain) {
  constexpr std::string_view where = "analyze_controllability";
  if (auto checked = check_pair(A, B, A.rows(), B.cols(), "B", "states x inputs", where);
      !checked) {
    return tl::unexpected(std::move(checked).error());
  }
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
  if (auto checked = check_pair(A, C, C.rows(), A.rows(), "C", "outputs x states", where);
      !checked) {
    return tl::unexpected(std::move(checked).error());
  }
  const MatrixXd A_transposed = A.transpose();
  const MatrixXd C_transposed = C.transpose();
  return analyze(A_transposed, C_transposed, domain, where).map([](Verdict&& verdict) {
    ObservabilityAnalysis analysis{std::move(verdict.reach)};
    analysis.observable = analysis.rank == analysis.order;
    analysis.detectable = verdict.hidden_decay;
    return analysis;
  });
}

std::string describe(const ControllabilityAnalysis& analysis, std::span<const std::string> states) {
  return describe(analysis,
                  analysis.controllable   ? "controllable"
                  : analysis.stabilizable ? "not controllable, but stabilizable"
                                          : "not controllable, nor stabilizable",
                  {"no input moves", "are reached by the inputs", "an input barely moves the mode"},
                  states);
}

std::string describe(const ObservabilityAnalysis& analysis, std::span<const std::string> states) {
  return describe(analysis,
                  analysis.observable   ? "observable"
                  : analysis.detectable ? "not observable, but detectable"
                                        : "not observable, nor detectable",
                  {"no output shows", "are seen by the outputs", "an output barely shows the mode"},
                  states);
}

}  // namespace flyball
