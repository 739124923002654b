#include <flyball/control/pole_placement.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include <fmt/format.h>

#include "control/placement.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;
constexpr std::string_view where = "place";
constexpr double infinity = std::numeric_limits<double>::infinity();

double scale_of(Complex pole) {
  return std::max(1.0, std::abs(pole));
}

/// Real poles first, then pairs side by side with their conjugates made exact.
Expected<Eigen::VectorXcd> paired(const Eigen::VectorXcd& poles) {
  constexpr double conjugate = 1e-10;
  std::vector<Complex> upper;
  std::vector<Complex> lower;
  std::vector<Complex> sorted;
  for (Eigen::Index i = 0; i < poles.size(); ++i) {
    const Complex pole = poles(i);
    if (std::abs(pole.imag()) <= 1e-14 * std::abs(pole)) {
      sorted.emplace_back(pole.real(), 0.0);
    } else {
      (pole.imag() > 0.0 ? upper : lower).push_back(pole);
    }
  }
  for (const Complex pole : upper) {
    const auto partner = std::min_element(lower.begin(), lower.end(), [&](Complex a, Complex b) {
      return std::abs(a - std::conj(pole)) < std::abs(b - std::conj(pole));
    });
    if (partner == lower.end() ||
        std::abs(*partner - std::conj(pole)) > conjugate * scale_of(pole)) {
      return tl::unexpected(Error(PolePlacementError::not_conjugate)
                                .in(std::string(where))
                                .about("poles")
                                .hint("add the conjugate of each complex pole")
                                .with("pole", {pole.real(), pole.imag()}));
    }
    lower.erase(partner);
    sorted.push_back(pole);
    sorted.push_back(std::conj(pole));
  }
  if (!lower.empty()) {
    return tl::unexpected(Error(PolePlacementError::not_conjugate)
                              .in(std::string(where))
                              .about("poles")
                              .hint("add the conjugate of each complex pole")
                              .with("pole", {lower.front().real(), lower.front().imag()}));
  }
  return Eigen::VectorXcd(
      Eigen::Map<const Eigen::VectorXcd>(sorted.data(), static_cast<Eigen::Index>(sorted.size())));
}

/// The candidates in the order of what they are to match; nearest pairs are matched first.
std::vector<std::size_t> matched(const Eigen::VectorXcd& wanted, const Eigen::VectorXcd& got) {
  struct Pair {
    double distance;
    std::size_t wanted, got;
  };
  std::vector<Pair> pairs;
  for (Eigen::Index i = 0; i < wanted.size(); ++i) {
    for (Eigen::Index j = 0; j < got.size(); ++j) {
      pairs.push_back({std::abs(wanted(i) - got(j)) / scale_of(wanted(i)),
                       static_cast<std::size_t>(i), static_cast<std::size_t>(j)});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.distance < b.distance; });
  constexpr auto none = static_cast<std::size_t>(-1);
  std::vector<std::size_t> match(static_cast<std::size_t>(wanted.size()), none);
  std::vector<bool> taken(static_cast<std::size_t>(got.size()), false);
  for (const Pair& pair : pairs) {
    if (match[pair.wanted] == none && !taken[pair.got]) {
      match[pair.wanted] = pair.got;
      taken[pair.got] = true;
    }
  }
  return match;
}

/// The closed loop's eigenvalues in the order of the wanted poles, how sensitive each is, and the
/// condition of the eigenvectors.
struct Reached {
  Eigen::VectorXcd poles;
  Eigen::VectorXd sensitivity;  ///< 1/|yᴴx| for unit left and right eigenvectors.
  double condition = infinity;
  double pole_error = infinity;
  bool accepted = false;
};

Reached reached_by(const Eigen::MatrixXd& closed, const Eigen::VectorXcd& wanted) {
  const Eigen::Index n = wanted.size();
  Reached reached;
  const detail::Eigensystem system = detail::eigensystem_of(closed);
  if (!system.values.allFinite()) {
    return reached;
  }
  double rcond = 0.0;
  const Eigen::MatrixXcd left =
      detail::solve_complex(system.vectors, Eigen::MatrixXcd::Identity(n, n), &rcond);
  reached.condition = detail::norm2(system.vectors) * detail::norm2(left);
  reached.condition = std::isfinite(reached.condition) ? reached.condition : infinity;
  reached.poles.resize(n);
  reached.sensitivity.resize(n);
  reached.pole_error = 0.0;
  reached.accepted = true;
  const std::vector<std::size_t> order = matched(wanted, system.values);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<Eigen::Index>(order[static_cast<std::size_t>(i)]);
    reached.poles(i) = system.values(k);
    const double size = left.row(k).norm();
    reached.sensitivity(i) = std::isfinite(size) ? std::max(1.0, size) : infinity;
    const double error = std::abs(reached.poles(i) - wanted(i));
    reached.pole_error = std::max(reached.pole_error, error);
    reached.accepted =
        reached.accepted && error <= 1e-8 * scale_of(wanted(i)) * reached.sensitivity(i);
  }
  return reached;
}

/// How many times the most repeated pole is repeated.
Eigen::Index largest_multiplicity(const Eigen::VectorXcd& poles) {
  Eigen::Index largest = 0;
  for (const Complex& pole : poles) {
    largest = std::max<Eigen::Index>(largest, (poles.array() == pole).count());
  }
  return largest;
}

/// A gain, and the condition of the eigenvectors that it was made from (0: of none).
struct Gain {
  Eigen::MatrixXd K;
  double condition = 0.0;
};

/// K for a controllable pair.
std::optional<Gain> place_controllable(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                                       const Eigen::VectorXcd& poles) {
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  // Columns of one size: what an input's unit is must not decide the rank.
  Eigen::VectorXd unit = Eigen::VectorXd::Ones(m);
  for (Eigen::Index j = 0; j < m; ++j) {
    const double size = B.col(j).norm();
    unit(j) = size > 0.0 ? 1.0 / size : 1.0;
  }
  const detail::SingularValues parts = detail::svd_of(B * unit.asDiagonal());
  const double threshold =
      20.0 * static_cast<double>(n) * std::numeric_limits<double>::epsilon() * parts.values(0);
  Eigen::Index rank = 0;
  while (rank < parts.values.size() && parts.values(rank) > threshold) {
    ++rank;
  }
  detail::PlacementProblem problem;
  problem.A = A;
  problem.range = parts.U.leftCols(rank);
  problem.null_rows = parts.U.rightCols(n - rank).transpose();
  problem.poles = poles;
  if (rank == m) {
    problem.B_pinv =
        unit.asDiagonal() * detail::product_transposed(
                                parts.V * parts.values.cwiseInverse().asDiagonal(), problem.range);
  } else {
    // Of the gains that do the same, the smallest.
    problem.B_pinv = detail::product_transposed(
        detail::solve_least_squares(detail::transposed_product(problem.range, B),
                                    Eigen::MatrixXd::Identity(rank, rank)),
        problem.range);
  }

  const auto gain_of = [&](const detail::PlacedLoop& loop) {
    return detail::product(problem.B_pinv, A - loop.M);
  };
  const auto accepted = [&](const Eigen::MatrixXd& K) {
    return reached_by(A - detail::product(B, K), poles).accepted;
  };
  std::optional<Gain> chosen;
  // Eigenvectors this dependent say less than the triangular form keeps.
  constexpr double dependent = 1e6;
  if (rank > 1 && largest_multiplicity(poles) <= rank) {
    if (const auto loop = detail::place_eigenvectors(problem)) {
      chosen = Gain{gain_of(*loop), loop->condition};
      if (loop->condition < dependent && accepted(chosen->K)) {
        return chosen;
      }
    }
  }
  if (const auto loop = detail::place_triangular(problem)) {
    Eigen::MatrixXd triangular = gain_of(*loop);
    if (m == 1) {
      // K is unique: where the formula in twice the precision agrees, it has all the digits.
      if (auto exact = detail::ackermann(A, B, poles);
          exact && (*exact - triangular).norm() <= 1e-2 * triangular.norm()) {
        triangular = *exact;
      }
    }
    if (!chosen || accepted(triangular) || !accepted(chosen->K)) {
      chosen = Gain{std::move(triangular), 0.0};
    }
  }
  return chosen;
}

/// The answer to poles that leave out a mode which no input reaches.
Error uncontrollable_mode(const detail::ControllableStaircase& form, const Eigen::VectorXd& units,
                          Complex mode) {
  const Eigen::Index n = form.A.rows();
  const Eigen::Index rest = n - form.controllable;
  // The mode is a combination yᴴx of states on which no input acts: yᴴ A = λ yᴴ, yᴴ B = 0.
  const detail::Eigensystem left =
      detail::eigensystem_of(form.A.bottomRightCorner(rest, rest).transpose());
  Eigen::Index nearest = 0;
  (left.values.array() - mode).abs().minCoeff(&nearest);
  Eigen::VectorXd share =
      (form.Q.rightCols(rest).cast<Complex>() * left.vectors.col(nearest)).cwiseAbs();
  share = share.cwiseQuotient(units);
  share /= share.maxCoeff();
  std::string states;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (share(i) > 0.1) {
      states += fmt::format("{}{}", states.empty() ? "" : ", ", i);
    }
  }
  return Error(PolePlacementError::not_controllable)
      .in(std::string(where))
      .about("(A, B)")
      .hint("keep this mode among the poles, or give it an input")
      .with("mode", {mode.real(), mode.imag()})
      .with("states it lives in (counted from 0)", states);
}

/// The poles that are left for the controllable part once each mode that stays has taken its own;
/// the error if one finds none.
Expected<Eigen::VectorXcd> poles_to_move(const detail::ControllableStaircase& form,
                                         const Eigen::VectorXd& units,
                                         const Eigen::VectorXcd& wanted,
                                         std::vector<Complex>& staying) {
  const Eigen::Index n = form.A.rows();
  const Eigen::Index rest = n - form.controllable;
  const Eigen::MatrixXd A_u = form.A.bottomRightCorner(rest, rest);
  const detail::Eigensystem right = detail::eigensystem_of(A_u);
  const detail::Eigensystem left = detail::eigensystem_of(A_u.transpose());
  const std::vector<std::size_t> order = matched(right.values, wanted);
  std::vector<bool> stays(static_cast<std::size_t>(n), false);
  for (Eigen::Index i = 0; i < rest; ++i) {
    const Complex mode = right.values(i);
    const std::size_t match = order[static_cast<std::size_t>(i)];
    // The mode itself is known to rounding times its sensitivity.
    Eigen::Index same = 0;
    (left.values.array() - mode).abs().minCoeff(&same);
    const double along =
        std::abs((left.vectors.col(same).transpose() * right.vectors.col(i)).value());
    const double tolerance = std::min(1e-4, 1e-8 / std::max(along, 1e-16)) * scale_of(mode);
    if (!(std::abs(wanted(static_cast<Eigen::Index>(match)) - mode) <= tolerance)) {
      return tl::unexpected(uncontrollable_mode(form, units, mode));
    }
    stays[match] = true;
    staying.push_back(mode);
  }
  Eigen::VectorXcd moved(form.controllable);
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!stays[static_cast<std::size_t>(i)]) {
      moved(count++) = wanted(i);
    }
  }
  return moved;
}

/// The gain found with each state measured in its unit, for the plant in the units it came in.
Expected<PolePlacement<>> place_in_units(const MatrixRef& A, const MatrixRef& B,
                                         const Eigen::VectorXcd& wanted,
                                         const Eigen::VectorXcd& poles,
                                         const Eigen::VectorXd& units) {
  const Eigen::Index n = A.rows();
  const Eigen::MatrixXd A_used = units.cwiseInverse().asDiagonal() * A * units.asDiagonal();
  const Eigen::MatrixXd B_used = units.cwiseInverse().asDiagonal() * B;
  const detail::ControllableStaircase form = detail::controllable_staircase(A_used, B_used);
  const Eigen::Index n_c = form.controllable;
  PolePlacement<> placed;
  if (n_c == n) {
    if (auto found = place_controllable(A_used, B_used, wanted)) {
      placed.K = std::move(found->K);
      // Repeated poles leave it open which of their eigenvectors an eigenvalue routine finds.
      placed.condition = (units.array() == 1.0).all() ? found->condition : 0.0;
    }
  } else {
    auto moved = poles_to_move(form, units, wanted, placed.uncontrollable);
    if (!moved) {
      return tl::unexpected(std::move(moved).error());
    }
    placed.K = Eigen::MatrixXd::Zero(B.cols(), n);
    if (n_c > 0) {
      const auto found =
          place_controllable(form.A.topLeftCorner(n_c, n_c), form.B.topRows(n_c), *moved);
      placed.K =
          found ? detail::product_transposed(found->K, form.Q.leftCols(n_c)) : Eigen::MatrixXd();
    }
  }
  Reached reached;
  if (placed.K.size() > 0) {
    placed.K = (placed.K * units.cwiseInverse().asDiagonal()).eval();
    reached = reached_by(A - detail::product(B, placed.K), poles);
  }
  if (!reached.accepted || !placed.K.allFinite()) {
    return tl::unexpected(
        Error(PolePlacementError::not_reached)
            .in(std::string(where))
            .about("(A, B)")
            .hint("it is nearly uncontrollable: ask for poles nearer to those of A")
            .with("largest distance of a pole from its place", reached.pole_error)
            .with("condition of the eigenvectors", reached.condition));
  }
  placed.poles = reached.poles;
  placed.condition =
      placed.condition > 0.0 ? std::min(placed.condition, reached.condition) : reached.condition;
  placed.pole_error = reached.pole_error;
  return placed;
}

Expected<void> check_arguments(const MatrixRef& A, const MatrixRef& B,
                               const Eigen::VectorXcd& poles) {
  if (auto square = check_square(A, where, "A"); !square) {
    return square;
  }
  const Eigen::Index n = A.rows();
  if (B.cols() == 0) {
    return tl::unexpected(Error(ArgumentError::empty)
                              .in(std::string(where))
                              .about("B")
                              .got("without columns")
                              .expected("states x inputs with at least one input"));
  }
  if (auto shape = check_shape(B, n, B.cols(), where, "B", "states x inputs"); !shape) {
    return shape;
  }
  if (poles.size() != n) {
    return tl::unexpected(Error(ArgumentError::wrong_shape)
                              .in(std::string(where))
                              .about("poles")
                              .got(fmt::format("{} numbers", poles.size()))
                              .expected(fmt::format("one pole a state ({})", n)));
  }
  return check_all(check_finite(A, where, "A"), check_finite(B, where, "B"),
                   check_finite(Eigen::MatrixXd(poles.real()), where, "poles"),
                   check_finite(Eigen::MatrixXd(poles.imag()), where, "poles"));
}

}  // namespace

ErrorInfo error_info(PolePlacementError code) {
  constexpr std::string_view family = "pole_placement";
  switch (code) {
    case PolePlacementError::not_conjugate:
      return {family, "not_conjugate", "a complex pole is without its conjugate",
              ErrorKind::misuse};
    case PolePlacementError::not_controllable:
      return {family, "not_controllable", "a mode that no input reaches would have to move",
              ErrorKind::no_answer};
    case PolePlacementError::not_reached:
      return {family, "not_reached", "no gain was found that places the poles well enough",
              ErrorKind::no_answer};
  }
  return {family, "unknown", "unknown error", ErrorKind::defect};
}

Expected<PolePlacement<>> place(const MatrixRef& A, const MatrixRef& B,
                                const Eigen::VectorXcd& poles) {
  if (auto checked = check_arguments(A, B, poles); !checked) {
    return tl::unexpected(checked.error());
  }
  auto wanted = paired(poles);
  if (!wanted) {
    return tl::unexpected(wanted.error());
  }
  // Coarse units can hide a coupling, or cost digits: then all states are made of one size.
  constexpr double coarse = 1e4;
  const Eigen::VectorXd as_given = Eigen::VectorXd::Ones(A.rows());
  const Eigen::VectorXd balanced = detail::balance_of(A);
  const bool first = balanced.maxCoeff() > coarse * balanced.minCoeff();
  auto placed = place_in_units(A, B, *wanted, poles, first ? balanced : as_given);
  if (!placed && balanced != as_given) {
    if (auto again = place_in_units(A, B, *wanted, poles, first ? as_given : balanced)) {
      return again;
    }
  }
  return placed;
}

Expected<PolePlacement<>> place(const MatrixRef& A, const MatrixRef& B,
                                std::initializer_list<std::complex<double>> poles) {
  return place(A, B,
               Eigen::VectorXcd(Eigen::Map<const Eigen::VectorXcd>(
                   poles.begin(), static_cast<Eigen::Index>(poles.size()))));
}

}  // namespace flyball
