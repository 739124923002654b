#include <flyball/control/pole_placement.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <flyball/core/random.hpp>
#include <flyball/systems/controllability.hpp>

#include "control/placement.hpp"
#include "control/placement_units.hpp"
#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;
constexpr std::string_view in_place = "place";

/// Real poles first, then pairs side by side with their conjugates made exact.
/// @param time  The poles are in units of 2^time; messages are not.
Expected<Eigen::VectorXcd> paired(const Eigen::VectorXcd& poles, int time) {
  constexpr double conjugate = 1e-10;
  const auto given = [&](Complex pole) {
    return std::vector<double>{std::ldexp(pole.real(), time), std::ldexp(pole.imag(), time)};
  };
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
        std::abs(*partner - std::conj(pole)) > conjugate * std::max(1.0, std::abs(pole))) {
      return refusal(PolePlacementError::not_conjugate, in_place, "poles")
          .hint("add the conjugate of each complex pole")
          .with("pole", given(pole));
    }
    lower.erase(partner);
    sorted.push_back(pole);
    sorted.push_back(std::conj(pole));
  }
  if (!lower.empty()) {
    return refusal(PolePlacementError::not_conjugate, in_place, "poles")
        .hint("add the conjugate of each complex pole")
        .with("pole", given(lower.front()));
  }
  return Eigen::VectorXcd(
      Eigen::Map<const Eigen::VectorXcd>(sorted.data(), static_cast<Eigen::Index>(sorted.size())));
}

/// How many times the most repeated pole is repeated.
Eigen::Index largest_multiplicity(const Eigen::VectorXcd& poles) {
  Eigen::Index largest = 0;
  for (const Complex& pole : poles) {
    largest = std::max<Eigen::Index>(largest, (poles.array() == pole).count());
  }
  return largest;
}

/// The plant with each state measured in its unit.
struct Scaled {
  Eigen::MatrixXd A;
  Eigen::MatrixXd B;
  detail::StateUnits units;
};

/// A gain in those units, and where it puts the poles.
struct PoleCandidate {
  Eigen::MatrixXd K;
  detail::Reached reached;
  bool determined = true;  ///< By the plant's digits.
};

/// The pair to be placed in the coordinates of its staircase, A = Q problem.A Qᵀ.
struct Part {
  Eigen::MatrixXd A;
  Eigen::MatrixXd B;
  Eigen::MatrixXd Q;
  detail::PlacementProblem problem;
};

/// The whole plant where all of it is controllable; else the part that is, as its own plant.
Part controllable_part(const Scaled& plant, const detail::ControllableStaircase& form,
                       const Eigen::VectorXcd& poles) {
  const Eigen::Index n_c = form.controllable;
  Part part;
  part.problem = {form.A.topLeftCorner(n_c, n_c), form.rank, form.first, poles};
  if (n_c == plant.A.rows()) {
    part.A = plant.A;
    part.B = plant.B;
    part.Q = form.Q;
  } else {
    part.A = part.problem.A;
    part.B = form.B.topRows(n_c);
    part.Q = Eigen::MatrixXd::Identity(n_c, n_c);
  }
  return part;
}

/// False if rounding of the plant's entries would make another gain. One coupled to a mode by 1e-10
/// changes by 1e-5; where the coupling itself is rounding, nothing of it remains.
bool is_determined(const Part& part, const detail::PlacedLoop& loop, const Eigen::MatrixXd& K) {
  constexpr double suspicious = 1e8;
  constexpr double other = 0.1;
  const Eigen::Index n = part.A.rows();
  const Eigen::MatrixXd driven = part.B.colwise().norm().asDiagonal() * K;
  if (driven.norm() <= suspicious * (part.A.norm() + part.problem.poles.cwiseAbs().maxCoeff())) {
    return true;
  }
  Random random(1);
  const double step = static_cast<double>(n) * std::numeric_limits<double>::epsilon();
  const auto rounded = [&](double x) {
    return x * (random.uniform() < 0.5 ? 1.0 - step : 1.0 + step);
  };
  const auto moved = detail::exact_gain(part.problem, loop, part.Q, part.A.unaryExpr(rounded),
                                        part.B.unaryExpr(rounded));
  return moved && (part.B.colwise().norm().asDiagonal() * (moved->K.rounded() - K)).norm() <=
                      other * driven.norm();
}

std::optional<PoleCandidate> candidate_of(const Scaled& plant, const Part& part,
                                          const detail::ControllableStaircase& form,
                                          const Eigen::VectorXcd& wanted,
                                          const std::optional<detail::PlacedLoop>& loop) {
  if (!loop) {
    return std::nullopt;
  }
  auto exact = detail::exact_gain(part.problem, *loop, part.Q, part.A, part.B);
  if (!exact) {
    return std::nullopt;
  }
  Eigen::MatrixXd K = exact->K.rounded();
  const bool determined = is_determined(part, *loop, K);
  if (form.controllable < plant.A.rows()) {
    K = detail::product_transposed(K, form.Q.leftCols(form.controllable));
    auto reached = detail::reached_by(plant.A, plant.B, K, plant.units, wanted);
    return PoleCandidate{std::move(K), std::move(reached), determined};
  }
  const auto reached_with = [&](const Eigen::MatrixXd& gain) {
    return detail::reached_by(plant.A, plant.B, gain, exact->X, exact->inverse, plant.units,
                              wanted);
  };
  detail::Reached reached = reached_with(K);
  // The bar is 1e-8; what is near it another judge of the poles may see above it.
  constexpr double near_bar = 1e-9;
  if ((reached.misplaced > near_bar || !reached.accepted()) && determined && form.rank > 1) {
    if (auto together = detail::rounded_together(plant.B, exact->K, reached)) {
      detail::Reached now = reached_with(*together);
      if (now.accepted() == reached.accepted() ? now.misplaced < reached.misplaced
                                               : now.accepted()) {
        K = std::move(*together);
        reached = std::move(now);
      }
    }
  }
  // Repeated poles leave it open which of their eigenvectors an eigenvalue routine finds.
  if (loop->condition > 0.0 && (plant.units.given.array() == 1.0).all()) {
    reached.condition = std::min(reached.condition, loop->condition);
  }
  return PoleCandidate{std::move(K), std::move(reached), determined};
}

/// The gain of the method that serves these poles best.
std::optional<PoleCandidate> best_candidate(const Scaled& plant, const Part& part,
                                            const detail::ControllableStaircase& form,
                                            const Eigen::VectorXcd& wanted) {
  const Eigen::VectorXcd& poles = part.problem.poles;
  if (poles.size() == 0) {
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(plant.B.cols(), plant.A.rows());
    auto reached = detail::reached_by(plant.A, plant.B, K, plant.units, wanted);
    return PoleCandidate{std::move(K), std::move(reached)};
  }
  // Eigenvectors this dependent say less than the triangular form keeps.
  constexpr double dependent = 1e6;
  std::optional<PoleCandidate> chosen;
  if (form.rank > 1 && largest_multiplicity(poles) <= form.rank) {
    const auto loop = detail::place_eigenvectors(part.problem);
    chosen = candidate_of(plant, part, form, wanted, loop);
    if (chosen && chosen->reached.accepted() && loop->condition < dependent) {
      return chosen;
    }
  }
  auto other = candidate_of(plant, part, form, wanted, detail::place_triangular(part.problem));
  const bool better =
      !chosen || (other && other->reached.accepted() &&
                  (!chosen->reached.accepted() || other->K.norm() < chosen->K.norm()));
  return better ? other : chosen;
}

bool surely_controllable(const MatrixRef& A, const MatrixRef& B) {
  const auto reach = analyze_controllability(A, B, TimeDomain::continuous);
  return reach && reach->controllable;
}

/// @param plant  Size of A. @param time  The poles are in units of 2^time; messages are not.
Error not_reached(const detail::Reached& reached, double plant, int time) {
  const auto given = [&](Complex pole) {
    return std::vector<double>{std::ldexp(pole.real(), time), std::ldexp(pole.imag(), time)};
  };
  // One that is far off to its own size alone, since the last digits of the gain move it.
  constexpr double little = 1e-6;
  const bool any = reached.poles.size() > 0;
  const double size = any ? std::abs(reached.wanted(reached.worst)) : 0.0;
  const double beside = any ? std::max(plant, reached.wanted.cwiseAbs().maxCoeff()) : 0.0;
  const bool nothing = size > 0.0 && size < little * beside && reached.misplaced <= 1e-8;
  Error error =
      Error(PolePlacementError::not_reached)
          .in(std::string(in_place))
          .about("(A, B)")
          .hint(nothing ? "beside the plant and the other poles this one is nothing: ask for 0 if "
                          "that is meant, or for one nearer to the others"
                        : "it is nearly uncontrollable, or these poles are nearly one: ask for "
                          "poles nearer to those of A, or further apart")
          .with("largest relative distance of a pole from its place", reached.pole_error)
          .with("condition of the eigenvectors", reached.condition);
  if (any) {
    error = Error(std::move(error)
                      .with("pole", given(reached.wanted(reached.worst)))
                      .with("reached", given(reached.poles(reached.worst))));
  }
  return error;
}

/// The gain found with each state measured in its unit, for the plant in the units it came in.
Expected<PolePlacement<>> place_in_units(const MatrixRef& A, const MatrixRef& B,
                                         const Eigen::VectorXcd& wanted,
                                         const Eigen::VectorXcd& poles,
                                         const Eigen::VectorXd& units,
                                         const Eigen::VectorXd& balanced, int time) {
  const Scaled plant{units.cwiseInverse().asDiagonal() * A * units.asDiagonal(),
                     units.cwiseInverse().asDiagonal() * B,
                     {units, units.cwiseQuotient(balanced)}};
  const detail::ControllableStaircase form = detail::controllable_staircase(plant.A, plant.B);
  PolePlacement<> placed;
  FLYBALL_TRY_IN(in_place, const auto moved,
                 detail::poles_to_move(form, {units, time}, wanted, placed.uncontrollable));
  const Part part = controllable_part(plant, form, moved);
  const std::optional<PoleCandidate> found = best_candidate(plant, part, form, poles);
  // Rounding of the plant would make another gain: because a mode hangs on it alone, or because so
  // many poles are one.
  if (found && !found->determined && !surely_controllable(plant.A, plant.B)) {
    return tl::unexpected(
        detail::weakest_mode(plant.A, plant.B, {units, time}, wanted).in(std::string(in_place)));
  }
  if (!found || !found->reached.accepted()) {
    return tl::unexpected(
        not_reached(found ? found->reached : detail::Reached{}, plant.A.norm(), time));
  }
  placed.K = found->K * units.cwiseInverse().asDiagonal();
  placed.poles = found->reached.poles;
  placed.condition = found->reached.condition;
  placed.pole_error = found->reached.pole_error;
  return placed;
}

/// Units in which the rows of [A B] are as large as the columns of A; an input made this small does
/// not decide which of them the largest column is in.
Eigen::VectorXd units_with_inputs(const MatrixRef& A, const MatrixRef& B,
                                  const Eigen::VectorXd& balanced) {
  const Eigen::Index n = A.rows();
  Eigen::MatrixXd both = Eigen::MatrixXd::Zero(n + B.cols(), n + B.cols());
  both.topLeftCorner(n, n) = balanced.cwiseInverse().asDiagonal() * A * balanced.asDiagonal();
  both.topRightCorner(n, B.cols()) = balanced.cwiseInverse().asDiagonal() * B;
  const double size = 1e-3 * both.leftCols(n).norm();
  for (Eigen::Index j = n; j < both.cols(); ++j) {
    const double length = both.col(j).norm();
    both.col(j) *= length > 0.0 ? size / length : 0.0;
  }
  return detail::balance_of(both).head(n).cwiseProduct(balanced);
}

/// Entries and poles are near one, in units of 2^time per second.
Expected<PolePlacement<>> place_near_one(const MatrixRef& A, const MatrixRef& B,
                                         const Eigen::VectorXcd& poles, int time) {
  FLYBALL_TRY(auto wanted, paired(poles, time));
  // Coarse units can hide a coupling, or cost digits: then all states are made of one size. What
  // only inputs scale shows in units that balance them too.
  constexpr double coarse = 1e4;
  const Eigen::VectorXd as_given = Eigen::VectorXd::Ones(A.rows());
  const Eigen::VectorXd balanced = detail::balance_of(A);
  const bool first = balanced.maxCoeff() > coarse * balanced.minCoeff();
  auto placed = place_in_units(A, B, wanted, poles, first ? balanced : as_given, balanced, time);
  if (!placed) {
    for (const Eigen::VectorXd& units :
         {first ? as_given : balanced, units_with_inputs(A, B, balanced)}) {
      if (units != (first ? balanced : as_given)) {
        if (auto again = place_in_units(A, B, wanted, poles, units, balanced, time)) {
          return again;
        }
      }
    }
  }
  return placed;
}

Expected<void> check_arguments(const MatrixRef& A, const MatrixRef& B,
                               const Eigen::VectorXcd& poles) {
  FLYBALL_CHECK(check_square(A, in_place, "A"));
  const Eigen::Index n = A.rows();
  if (B.cols() == 0) {
    return refusal(ArgumentError::empty, in_place, "B")
        .got("without columns")
        .expected("states x inputs with at least one input");
  }
  FLYBALL_CHECK(check_shape(B, n, B.cols(), in_place, "B", "states x inputs"));
  if (poles.size() != n) {
    return refusal(ArgumentError::wrong_shape, in_place, "poles")
        .got(detail::format("{} numbers", poles.size()))
        .expected(detail::format("one pole a state ({})", n));
  }
  return Checks(in_place)
      .finite(A, "A")
      .finite(B, "B")
      .finite(Eigen::MatrixXd(poles.real()), "poles")
      .finite(Eigen::MatrixXd(poles.imag()), "poles");
}

}  // namespace

ErrorInfo error_info(PolePlacementError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"not_conjugate", "a complex pole is without its conjugate", ErrorKind::misuse},
      {"not_controllable", "a mode that no input reaches would have to move", ErrorKind::no_answer},
      {"not_reached", "no gain was found that places the poles well enough", ErrorKind::no_answer},
      {"not_observable", "a mode that no output shows would have to move", ErrorKind::no_answer},
  };
  return detail::info_of(code, "pole_placement", rows);
}

Expected<PolePlacement<>> place(const MatrixRef& A, const MatrixRef& B,
                                const Eigen::VectorXcd& poles) {
  FLYBALL_CHECK(check_arguments(A, B, poles));
  const detail::PairScaling units = detail::placement_units(A, B, poles);
  if (units.time == 0 && units.states.isZero() && units.inputs.isZero()) {
    return place_near_one(A, B, poles, 0);
  }
  FLYBALL_TRY(auto placed, place_near_one(detail::scaled_A(A, units), detail::scaled_B(B, units),
                                          detail::in_units_of(poles, -units.time), units.time));
  placed.poles = detail::in_units_of(placed.poles, units.time);
  bool held = placed.poles.allFinite();
  for (Eigen::Index j = 0; j < placed.K.cols(); ++j) {
    for (Eigen::Index i = 0; i < placed.K.rows(); ++i) {
      const int exponent = units.inputs(i) + units.time - units.states(j);
      const double entry = std::ldexp(placed.K(i, j), exponent);
      held = held && std::ldexp(entry, -exponent) == placed.K(i, j);
      placed.K(i, j) = entry;
    }
  }
  if (!held) {
    return tl::unexpected(Error(PolePlacementError::not_reached)
                              .in(std::string(in_place))
                              .about("K")
                              .got("beyond the range of doubles")
                              .hint("measure states and inputs in other units"));
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
