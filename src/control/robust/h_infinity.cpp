#include <flyball/control/robust/h_infinity.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include <flyball/math/riccati/riccati.hpp>
#include <flyball/systems/conversion.hpp>
#include <flyball/systems/norms.hpp>

#include "control/robust/synthesis.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/riccati/riccati_work.hpp"

namespace flyball {

namespace {

using detail::CarefulWork;
using detail::NormalizedPlant;
using detail::Partition;
using detail::product;
using detail::product_transposed;
using detail::solve_linear;
using detail::transposed_product;
using Eigen::Index;
using Eigen::MatrixXd;
using Continuous = ContinuousSystem<>;
using Discrete = DiscreteSystem<>;

double largest_singular_value(const MatrixXd& M) {
  return M.size() == 0 ? 0.0 : detail::singular_values_of(M)(0);
}

/// @param Q, A  What S is of the size of, where it would be zero.
bool is_semidefinite(const MatrixXd& S, const MatrixXd& Q, const MatrixXd& A) {
  const Eigen::VectorXd values = detail::symmetric_eigensystem_of(S).values;
  return values(0) >=
         -1e-8 * std::max(values(values.size() - 1), 0.0) - 1e-10 * Q.norm() / A.norm();
}

/// Whether the Hamiltonian matrix of a Riccati equation has eigenvalues on the imaginary axis, by
/// rounding: it then has no stabilising solution, which `care` would be slow to be sure of.
bool meets_the_axis(const MatrixXd& A, const MatrixXd& B, const MatrixXd& Q, const MatrixXd& R,
                    const MatrixXd& N) {
  const Index n = A.rows();
  double rcond = 0.0;
  MatrixXd right(R.rows(), 2 * n);
  right << N.transpose(), B.transpose();
  const MatrixXd K = solve_linear(R, right, &rcond);
  if (!(rcond > 1e-15)) {
    return true;
  }
  MatrixXd H(2 * n, 2 * n);
  H.topLeftCorner(n, n) = A - product(B, K.leftCols(n));
  H.topRightCorner(n, n) = -product(B, K.rightCols(n));
  H.bottomLeftCorner(n, n) = product(N, K.leftCols(n)) - Q;
  H.bottomRightCorner(n, n) = -H.topLeftCorner(n, n).transpose();
  const Eigen::VectorXcd values = detail::eigenvalues_of(H);
  const double size = values.cwiseAbs().maxCoeff();
  return !((values.real().array().abs() > 1e-13 * size).all() &&
           (values.real().array() < 0.0).count() == n);
}

/// The Riccati equations of one level.
struct Level {
  double gamma = 0.0;
  MatrixXd X, Y;
  MatrixXd F;  ///< [F₁; F₂]: the worst disturbance and the best control.
  MatrixXd L;  ///< [L₁ L₂], its dual.
};

/// Nothing where no controller stays under γ. Disturbances are in units of γ, so that the weight
/// of Glover and Doyle's equation (3.1) is near one.
/// @param work  What is left for equations that doubles do not solve.
std::optional<Level> level(const Partition& P, double gamma, CarefulWork& work) {
  const Index m1 = P.B1.cols();
  const Index m2 = P.B2.cols();
  const Index p1 = P.C1.rows();
  const Index p2 = P.C2.rows();
  Level at;
  at.gamma = gamma;
  MatrixXd D(p1, m1 + m2);
  D << P.D11 / gamma, P.D12;
  MatrixXd B(P.n, m1 + m2);
  B << P.B1 / gamma, P.B2;
  MatrixXd R = transposed_product(D, D);
  R.topLeftCorner(m1, m1).diagonal().array() -= 1.0;
  const MatrixXd Q = transposed_product(P.C1, P.C1);
  const MatrixXd N = transposed_product(P.C1, D);
  R = detail::symmetrized(R);
  if (meets_the_axis(P.A, B, Q, R, N)) {
    return std::nullopt;
  }
  const auto X = detail::care_within(P.A, B, Q, R, N, work);
  if (!X || !is_semidefinite(X->X, Q, P.A)) {
    return std::nullopt;
  }
  MatrixXd E(p1 + p2, m1);
  E << P.D11 / gamma, P.D21;
  MatrixXd C(p1 + p2, P.n);
  C << P.C1 / gamma, P.C2;
  MatrixXd S = product_transposed(E, E);
  S.topLeftCorner(p1, p1).diagonal().array() -= 1.0;
  const MatrixXd V = product_transposed(P.B1, P.B1);
  const MatrixXd M = product_transposed(P.B1, E);
  S = detail::symmetrized(S);
  if (meets_the_axis(P.A.transpose(), C.transpose(), V, S, M)) {
    return std::nullopt;
  }
  const auto Y = detail::care_within(P.A.transpose(), C.transpose(), V, S, M, work);
  if (!Y || !is_semidefinite(Y->X, V, P.A)) {
    return std::nullopt;
  }
  at.X = X->X;
  at.Y = Y->X;
  const Eigen::VectorXcd coupling = detail::eigenvalues_of(product(at.X, at.Y));
  if (!(coupling.cwiseAbs().maxCoeff() < gamma * gamma)) {
    return std::nullopt;
  }
  at.F = -X->K;
  at.F.topRows(m1) /= gamma;
  at.L = -Y->K.transpose();
  at.L.leftCols(p1) /= gamma;
  return at;
}

/// No level below is reached by any controller, whatever it knows.
double floor_of(const Partition& P) {
  const Index m2 = P.B2.cols();
  const Index p2 = P.C2.rows();
  return std::max(largest_singular_value(P.D11.topRows(P.C1.rows() - m2)),
                  largest_singular_value(P.D11.leftCols(P.B1.cols() - p2)));
}

/// The central controller. Glover and Doyle, theorem 1 with Φ = 0.
std::optional<Continuous> central(const Partition& P, const Level& at) {
  const Index m2 = P.B2.cols();
  const Index p2 = P.C2.rows();
  const Index m1 = P.B1.cols();
  const Index p1 = P.C1.rows();
  const double square = at.gamma * at.gamma;
  const MatrixXd D1111 = P.D11.topLeftCorner(p1 - m2, m1 - p2);
  const MatrixXd D1112 = P.D11.topRightCorner(p1 - m2, p2);
  const MatrixXd D1121 = P.D11.bottomLeftCorner(m2, m1 - p2);
  const MatrixXd D1122 = P.D11.bottomRightCorner(m2, p2);
  const MatrixXd above =
      square * MatrixXd::Identity(p1 - m2, p1 - m2) - product_transposed(D1111, D1111);
  MatrixXd D = -D1122;
  if (p1 > m2 && m1 > p2) {
    D -= product(D1121, transposed_product(D1111, solve_linear(above, D1112)));
  }
  const MatrixXd F12 = at.F.middleRows(m1 - p2, p2);
  const MatrixXd F2 = at.F.bottomRows(m2);
  const MatrixXd L12 = at.L.middleCols(p1 - m2, m2);
  const MatrixXd L2 = at.L.rightCols(p2);
  const MatrixXd coupling = MatrixXd::Identity(P.n, P.n) - product(at.Y, at.X) / square;
  double rcond = 0.0;
  MatrixXd turned(P.n, m2 + p2);
  turned << P.B2 + L12, L2;
  turned = solve_linear(coupling, turned, &rcond);
  if (!(rcond > 1e-15) || !turned.allFinite()) {
    return std::nullopt;
  }
  const MatrixXd Z_B2 = turned.leftCols(m2);
  const MatrixXd C = P.C2 + F12;
  MatrixXd B(P.n, m1 + m2);
  B << P.B1, P.B2;
  // D̂₁₂ and D̂₂₁ cancel but for their product with themselves: B̂₁ = -Z L₂ + Z(B₂ + L₁₂) D̂₁₁.
  Continuous K;
  K.D = D;
  K.B = product(Z_B2, D) - turned.rightCols(p2);
  K.C = F2 - product(D, C);
  K.A = P.A + product(B, at.F) - product(K.B, C);
  return K;
}

struct Verified {
  Continuous controller;
  Continuous closed_loop;
  HInfinityNorm norm;
};

/// The level's controller of the plant as given, if its loop is stable.
std::optional<Verified> verified(const Partition& given, const NormalizedPlant& plant,
                                 const Level& at, std::string_view where) {
  const auto inner = central(plant.P, at);
  if (!inner) {
    return std::nullopt;
  }
  auto controller = detail::denormalized(plant, *inner, where);
  if (!controller) {
    return std::nullopt;
  }
  auto closed_loop = detail::closed(given, *controller, where);
  if (!closed_loop) {
    return std::nullopt;
  }
  const auto norm = h_infinity_norm(*closed_loop);
  if (!norm) {
    return std::nullopt;
  }
  return Verified{*std::move(controller), *std::move(closed_loop), *norm};
}

/// No controller stays under `low`, one does under that of `high`.
struct Bracket {
  double low = 0.0;
  std::optional<Level> high;
};

/// Of a search for the least level, a second's; of more than 24 states in proportion.
CarefulWork search_work(const Partition& P) {
  const double size = std::max(1.0, static_cast<double>(P.n) / 24.0);
  return {2e8 * size * size * size};
}

Refusal out_of_work(std::string_view where, std::string got) {
  return refusal(SynthesisError::not_verified, where, "the least level")
      .got(std::move(got))
      .hint(
          "its Riccati equations need more digits than there is work for: measure time and signals "
          "in units in which the plant's entries are near one");
}

Expected<Bracket> least_level(const Partition& P, double tolerance, CarefulWork& work,
                              std::string_view where) {
  Bracket found;
  found.low = floor_of(P);
  constexpr double most = 1e15;
  double trial = std::max(1.0, 2.0 * found.low);
  while (!(found.high = level(P, trial, work))) {
    if (work.is_done()) {
      return out_of_work(where, "not found: it is above " + format_number(found.low));
    }
    found.low = trial;
    trial *= 10.0;
    if (trial > most) {
      return refusal(SynthesisError::not_verified, where, "the Riccati equations")
          .got("without a solution up to the level " + format_number(most))
          .hint(
              "check that the plant and weights are in units near one, and that no pole or zero "
              "is near the border of stability");
    }
  }
  // Down by tens where one was already enough.
  while (found.low == 0.0 && found.high->gamma > 1e-12) {
    const double next = 0.1 * found.high->gamma;
    if (auto lower = level(P, next, work)) {
      found.high = std::move(lower);
    } else if (work.is_done()) {
      return out_of_work(where, "not found: it is below " + format_number(found.high->gamma));
    } else {
      found.low = next;
    }
  }
  const double fine = std::max(1e-10, 1e-2 * tolerance);
  for (int i = 0; i < 100 && found.high->gamma > found.low * (1.0 + fine) && found.low > 0.0; ++i) {
    // Where the floor is near zero, by its logarithm.
    const double middle = found.high->gamma > 4.0 * found.low
                              ? std::sqrt(found.high->gamma * found.low)
                              : 0.5 * (found.high->gamma + found.low);
    if (auto lower = level(P, middle, work)) {
      found.high = std::move(lower);
    } else if (!work.is_done()) {
      found.low = middle;
    } else if (found.high->gamma <= found.low * (1.0 + tolerance)) {
      break;  // as near as was asked for
    } else {
      return out_of_work(where, "between " + format_number(found.low) + " and " +
                                    format_number(found.high->gamma));
    }
  }
  return found;
}

Expected<RobustDesign<Continuous>> synthesize(const Continuous& system, Index measurements,
                                              Index controls, const HInfinityOptions& options,
                                              bool discrete, std::string_view where) {
  FLYBALL_CHECK(check_system(system, where));
  FLYBALL_CHECK(detail::check_generalized(system, measurements, controls, where));
  FLYBALL_CHECK(Checks(where)
                    .not_negative(options.gamma, "gamma")
                    .within(options.tolerance, 1e-9, 1.0, "tolerance"));
  const Partition given = detail::partition(system, measurements, controls);
  FLYBALL_TRY(const auto plant, detail::normalized(given, where));
  FLYBALL_CHECK(detail::check_assumptions(plant, discrete, where));
  Bracket bracket;
  double gamma = options.gamma;
  std::optional<Level> at;
  CarefulWork search = search_work(plant.P);
  CarefulWork last = search_work(plant.P);  // of the levels that are designed for
  if (gamma > 0.0) {
    at = gamma > floor_of(plant.P) ? level(plant.P, gamma, last) : std::nullopt;
    if (!at) {
      FLYBALL_TRY(const auto least, least_level(plant.P, 1e-3, search, where));
      return refusal(SynthesisError::level_not_reached, where, "gamma")
          .got(format_number(gamma))
          .expected("at least " + format_number(least.high->gamma))
          .with("least level", least.high->gamma);
    }
  } else {
    FLYBALL_TRY(bracket, least_level(plant.P, options.tolerance, search, where));
    gamma = bracket.high->gamma * (1.0 + 0.9 * options.tolerance);
    at = level(plant.P, gamma, last);
  }
  std::optional<Verified> best;
  if (options.gamma > 0.0) {
    best = verified(given, plant, *at, where);
    if (best && !(best->norm.norm <= gamma * (1.0 + 1e-6))) {
      best.reset();
    }
  } else {
    // Rounding may ask for more distance from the least level.
    for (const double further : {1.0, 2.0, 5.0, 10.0, 30.0, 100.0}) {
      auto found = at ? verified(given, plant, *at, where) : std::nullopt;
      if (found && (!best || found->norm.norm < best->norm.norm)) {
        best = std::move(found);
      }
      if (best && best->norm.norm <= bracket.high->gamma * (1.0 + options.tolerance)) {
        break;
      }
      at = level(plant.P, bracket.high->gamma * (1.0 + 2.0 * further * options.tolerance), last);
    }
    if (best && !(best->norm.norm <= 2.0 * bracket.high->gamma)) {
      best.reset();
    }
  }
  if (!best) {
    return refusal(SynthesisError::not_verified, where, "the controller")
        .got("not what it should be: its closed loop is unstable or above the level, by rounding")
        .hint(
            "ask for a higher gamma, or measure time and signals in units in which the plant's "
            "entries are near one");
  }
  RobustDesign<Continuous> design;
  design.controller = std::move(best->controller);
  design.closed_loop = std::move(best->closed_loop);
  design.poles = detail::eigenvalues_of(design.closed_loop.A);
  design.gamma = best->norm.norm;
  design.frequency = best->norm.frequency;
  design.least_low = bracket.low;
  design.least_high =
      options.gamma > 0.0 ? design.gamma : std::min(bracket.high->gamma, design.gamma);
  return design;
}

}  // namespace

Expected<RobustDesign<Continuous>> h_infinity_synthesis(const GeneralizedPlant<Continuous>& plant,
                                                        const HInfinityOptions& options) {
  return synthesize(plant.system, plant.measurements, plant.controls, options, false,
                    "h_infinity_synthesis");
}

Expected<RobustDesign<Discrete>> h_infinity_synthesis(const GeneralizedPlant<Discrete>& plant,
                                                      const HInfinityOptions& options) {
  constexpr std::string_view where = "h_infinity_synthesis";
  FLYBALL_CHECK(check_system(plant.system, where));
  FLYBALL_CHECK(detail::check_generalized(detail::bare(plant.system), plant.measurements,
                                          plant.controls, where));
  // With T = 2, s = (z - 1)/(z + 1).
  constexpr double unit = 2.0;
  FLYBALL_TRY_IN(where, const auto mapped,
                 convert_to_continuous(detail::timed(detail::bare(plant.system), Time(unit)),
                                       ConversionMethod::tustin));
  FLYBALL_TRY(const auto design,
              synthesize(mapped, plant.measurements, plant.controls, options, true, where));
  FLYBALL_TRY_IN(where, const auto controller,
                 convert_to_discrete(design.controller, Time(unit), ConversionMethod::tustin));
  RobustDesign<Discrete> found;
  found.controller = detail::timed(detail::bare(controller), plant.system.period);
  FLYBALL_TRY_IN(where, found.closed_loop, lower_fractional(plant, found.controller));
  found.poles = detail::eigenvalues_of(found.closed_loop.A);
  const auto norm = h_infinity_norm(found.closed_loop);
  if (!norm || !(norm->norm <= design.gamma * (1.0 + 1e-6))) {
    return refusal(SynthesisError::not_verified, where, "the controller")
        .got("not what it should be after the bilinear transform")
        .hint("ask for a higher gamma");
  }
  found.gamma = norm->norm;
  found.frequency = norm->frequency;
  found.least_low = design.least_low;
  found.least_high = std::min(design.least_high, found.gamma);
  return found;
}

Expected<RobustDesign<Continuous>> mixed_sensitivity(const Continuous& plant,
                                                     const SensitivityWeights<Continuous>& weights,
                                                     const HInfinityOptions& options) {
  FLYBALL_TRY(const auto P, mixed_sensitivity_plant(plant, weights));
  return synthesize(P.system, P.measurements, P.controls, options, false, "mixed_sensitivity");
}

Expected<RobustDesign<Discrete>> mixed_sensitivity(const Discrete& plant,
                                                   const SensitivityWeights<Discrete>& weights,
                                                   const HInfinityOptions& options) {
  FLYBALL_TRY(const auto P, mixed_sensitivity_plant(plant, weights));
  return h_infinity_synthesis(P, options);
}

Expected<RobustDesign<Continuous>> h2_synthesis(const GeneralizedPlant<Continuous>& plant) {
  constexpr std::string_view where = "h2_synthesis";
  FLYBALL_CHECK(check_system(plant.system, where));
  FLYBALL_CHECK(detail::check_generalized(plant.system, plant.measurements, plant.controls, where));
  const Partition given = detail::partition(plant.system, plant.measurements, plant.controls);
  if (!given.D11.isZero(0.0)) {
    return refusal(SynthesisError::direct_disturbance, where, "D11")
        .got("not zero")
        .expected("zero: white noise through it has infinite power")
        .with("norm of D11", given.D11.norm());
  }
  FLYBALL_TRY(const auto N, detail::normalized(given, where));
  FLYBALL_CHECK(detail::check_assumptions(N, false, where));
  const Partition& P = N.P;
  const Index m2 = P.B2.cols();
  const Index p2 = P.C2.rows();
  auto work = CarefulWork::of_a_second(P.n);
  FLYBALL_TRY_IN(
      where, const auto X,
      detail::care_within(P.A, P.B2, transposed_product(P.C1, P.C1), MatrixXd::Identity(m2, m2),
                          transposed_product(P.C1, P.D12), work));
  FLYBALL_TRY_IN(
      where, const auto Y,
      detail::care_within(P.A.transpose(), P.C2.transpose(), product_transposed(P.B1, P.B1),
                          MatrixXd::Identity(p2, p2), product_transposed(P.B1, P.D21), work));
  const MatrixXd L = Y.K.transpose();
  // dx̂/dt = A x̂ + B₂u + L (y - C₂x̂), u = -K x̂.
  const Continuous inner{P.A - product(P.B2, X.K) - product(L, P.C2), L, -X.K,
                         MatrixXd::Zero(m2, p2)};
  RobustDesign<Continuous> design;
  FLYBALL_TRY(design.controller, detail::denormalized(N, inner, where));
  FLYBALL_TRY(design.closed_loop, detail::closed(given, design.controller, where));
  design.closed_loop.D.setZero();
  design.poles = detail::eigenvalues_of(design.closed_loop.A);
  const auto norm = h2_norm(design.closed_loop);
  if (!norm) {
    return refusal(SynthesisError::not_verified, where, "the closed loop")
        .got("not stable, by rounding")
        .hint("measure time and signals in units in which the plant's entries are near one");
  }
  design.gamma = *norm;
  design.least_low = design.gamma;
  design.least_high = design.gamma;
  return design;
}

}  // namespace flyball
