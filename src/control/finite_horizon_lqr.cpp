#include <flyball/control/finite_horizon_lqr.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/math/riccati/riccati.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

using detail::product;
using detail::symmetrized;
using detail::transposed_product;

/// The checked weights: N has its size, all are symmetric to the last bit.
struct Weights {
  Eigen::MatrixXd Q, R, N, S;
};

Expected<Weights> check_weights(const QuadraticCost& cost, const Weight& terminal, Eigen::Index n,
                                Eigen::Index m, std::string_view where) {
  if (!terminal.get()) {
    return tl::unexpected(terminal.get().error());
  }
  const Eigen::MatrixXd& S = *terminal.get();
  const Eigen::MatrixXd N =
      cost.N.size() == 0 ? Eigen::MatrixXd(Eigen::MatrixXd::Zero(n, m)) : cost.N;
  FLYBALL_CHECK(Checks(where)
                    .shape(cost.Q, n, n, "Q", "states x states")
                    .shape(cost.R, m, m, "R", "inputs x inputs")
                    .shape(N, n, m, "N", "states x inputs")
                    .shape(S, n, n, "the terminal weight", "states x states")
                    .finite(cost.Q, "Q")
                    .finite(cost.R, "R")
                    .finite(N, "N")
                    .finite(S, "the terminal weight")
                    .symmetric(cost.Q, "Q")
                    .symmetric(cost.R, "R")
                    .symmetric(S, "the terminal weight"));
  return Weights{symmetrized(cost.Q), symmetrized(cost.R), N, symmetrized(S)};
}

Expected<void> check_plant(const MatrixRef& A, const MatrixRef& B, std::string_view where) {
  FLYBALL_CHECK(check_square(A, where, "A"));
  return Checks(where)
      .shape(B, A.rows(), B.cols(), "B", "states x inputs")
      .finite(A, "A")
      .finite(B, "B");
}

/// What is kept a step and what it takes beside, as numbers, bounds memory and time.
Expected<void> check_steps(std::size_t steps, Eigen::Index n, Eigen::Index m,
                           std::string_view where) {
  constexpr double most_numbers = 1e7;
  constexpr double beside = 64.0;
  const double a_step = static_cast<double>(n * n + n * m) + beside;
  if (steps >= 1 && static_cast<double>(steps) * a_step <= most_numbers) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, where, "steps")
      .got(detail::format("{}", steps))
      .expected(detail::format("from 1 to {:.0f}", std::floor(most_numbers / a_step)));
}

Refusal not_definite(std::string_view where, std::string_view what, std::size_t step) {
  return refusal(RiccatiError::singular, where, what)
      .got("not positive definite")
      .hint("R must penalise every input")
      .with("step", static_cast<double>(step));
}

/// K and S one step earlier.
struct Earlier {
  Eigen::MatrixXd K, S;
};
std::optional<Earlier> step_back(const MatrixRef& A, const MatrixRef& B, const Weights& weights,
                                 const Eigen::MatrixXd& S) {
  const Eigen::MatrixXd S_B = product(S, B);
  const Eigen::MatrixXd inner = symmetrized(weights.R + transposed_product(B, S_B));
  if (!inner.allFinite() || !detail::cholesky_of(inner)) {
    return std::nullopt;
  }
  Earlier earlier;
  earlier.K = detail::solve_symmetric(inner, transposed_product(S_B, A) + weights.N.transpose());
  const Eigen::MatrixXd closed = A - product(B, earlier.K);
  const Eigen::MatrixXd N_K = product(weights.N, earlier.K);
  earlier.S = symmetrized(transposed_product(closed, product(S, closed)) +
                          transposed_product(earlier.K, product(weights.R, earlier.K)) - N_K -
                          N_K.transpose() + weights.Q);
  return earlier;
}

Expected<FiniteHorizonLqr> recursion(const auto& plant_at, std::size_t steps,
                                     const Weights& weights, std::string_view where) {
  FiniteHorizonLqr design;
  design.K.resize(steps);
  design.S.resize(steps + 1);
  design.S[steps] = weights.S;
  for (std::size_t k = steps; k-- > 0;) {
    const auto& [A, B] = plant_at(k);
    auto earlier = step_back(A, B, weights, design.S[k + 1]);
    if (!earlier) {
      return not_definite(where, "R + B'SB", k);
    }
    design.K[k] = std::move(earlier->K);
    design.S[k] = std::move(earlier->S);
  }
  return design;
}

/// S(t - h) = γ + αᵀS(t)(I + βS(t))⁻¹α.
struct Flow {
  Eigen::MatrixXd alpha, beta, gamma;
};

/// Whether S stays finite on the way that β describes: the eigenvalues of βS, real because β is
/// positive semidefinite and growing with time, must not have come to -1.
bool bounded(const Eigen::MatrixXd& beta, const Eigen::MatrixXd& S) {
  const Eigen::Index n = S.rows();
  const double rounding = 1e-12 * S.norm();
  if (detail::cholesky_of(S + rounding * Eigen::MatrixXd::Identity(n, n)) || S.norm() == 0.0) {
    return true;
  }
  return detail::eigenvalues_of(product(beta, S)).real().minCoeff() > -1.0;
}

/// The flow over half of the Hamiltonian's time constant or less, doubled to h.
Expected<std::optional<Flow>> flow_over(const Eigen::MatrixXd& A, const Eigen::MatrixXd& G,
                                        const Eigen::MatrixXd& Q, double h) {
  const Eigen::Index n = A.rows();
  Eigen::MatrixXd H(2 * n, 2 * n);
  H << A, -G, -Q, -A.transpose();
  const double whole = detail::norm1(H) * h;
  if (!std::isfinite(whole)) {
    return refusal(RiccatiError::overflow, "continuous_finite_horizon_lqr", "the Hamiltonian")
        .got("beyond the range of a double")
        .hint("choose units in which the numbers are nearer to 1");
  }
  int doublings = 0;
  for (double size = whole; size > 0.5; size *= 0.5) {
    ++doublings;
  }
  FLYBALL_TRY(const auto exponential, expm(H * std::ldexp(-h, -doublings)));
  const Eigen::MatrixXd inverse =
      detail::solve_linear(exponential.topLeftCorner(n, n), Eigen::MatrixXd::Identity(n, n));
  Flow flow{inverse, symmetrized(product(inverse, exponential.topRightCorner(n, n))),
            symmetrized(product(exponential.bottomLeftCorner(n, n), inverse))};
  for (int i = 0; i < doublings; ++i) {
    double rcond = 0.0;
    Eigen::MatrixXd both(n, 2 * n);
    both << flow.alpha, product(flow.beta, flow.alpha.transpose());
    const Eigen::MatrixXd solved = detail::solve_linear(
        Eigen::MatrixXd::Identity(n, n) + product(flow.beta, flow.gamma), both, &rcond);
    if (!(rcond > 1e-15) || !solved.allFinite() || !bounded(flow.beta, flow.gamma)) {
      return std::optional<Flow>{};
    }
    const Eigen::MatrixXd alpha = product(flow.alpha, solved.leftCols(n));
    const Eigen::MatrixXd beta = symmetrized(flow.beta + product(flow.alpha, solved.rightCols(n)));
    const Eigen::MatrixXd gamma = symmetrized(
        flow.gamma + transposed_product(flow.alpha, product(flow.gamma, solved.leftCols(n))));
    flow = {alpha, beta, gamma};
  }
  return std::optional<Flow>(std::move(flow));
}

}  // namespace

Expected<FiniteHorizonLqr> finite_horizon_lqr(const MatrixRef& A, const MatrixRef& B,
                                              const QuadraticCost& cost, const Weight& S_N,
                                              int steps) {
  constexpr std::string_view where = "finite_horizon_lqr";
  FLYBALL_CHECK(check_plant(A, B, where));
  const auto count = static_cast<std::size_t>(std::max(steps, 0));
  FLYBALL_CHECK(check_steps(count, A.rows(), B.cols(), where));
  const DiscretizedMatrices plant{A, B};
  return check_weights(cost, S_N, A.rows(), B.cols(), where).and_then([&](const Weights& weights) {
    return recursion([&](std::size_t) -> const DiscretizedMatrices& { return plant; }, count,
                     weights, where);
  });
}

Expected<FiniteHorizonLqr> finite_horizon_lqr(std::span<const DiscretizedMatrices> plants,
                                              const QuadraticCost& cost, const Weight& S_N) {
  constexpr std::string_view where = "finite_horizon_lqr";
  if (plants.empty()) {
    return refusal(ArgumentError::empty, where, "plants").got("empty").expected("one plant a step");
  }
  const Eigen::Index n = plants.front().A.rows();
  const Eigen::Index m = plants.front().B.cols();
  FLYBALL_CHECK(check_steps(plants.size(), n, m, where));
  for (const DiscretizedMatrices& plant : plants) {
    FLYBALL_CHECK(check_plant(plant.A, plant.B, where));
    FLYBALL_CHECK(Checks(where)
                      .shape(plant.A, n, n, "A", "that of the first step")
                      .shape(plant.B, n, m, "B", "that of the first step"));
  }
  return check_weights(cost, S_N, n, m, where).and_then([&](const Weights& weights) {
    return recursion([&](std::size_t k) -> const DiscretizedMatrices& { return plants[k]; },
                     plants.size(), weights, where);
  });
}

Expected<FiniteHorizonLqr> continuous_finite_horizon_lqr(const MatrixRef& A, const MatrixRef& B,
                                                         const QuadraticCost& cost,
                                                         const Weight& S_T, Time horizon,
                                                         int steps) {
  constexpr std::string_view where = "continuous_finite_horizon_lqr";
  FLYBALL_CHECK(check_plant(A, B, where));
  const Eigen::Index n = A.rows();
  const auto count = static_cast<std::size_t>(std::max(steps, 0));
  FLYBALL_CHECK(Checks(where).positive(horizon.si(), "horizon", "s").also([&] {
    return check_steps(count, n, B.cols(), where);
  }));
  FLYBALL_TRY(auto weights, check_weights(cost, S_T, n, B.cols(), where));
  if (!detail::cholesky_of(weights.R)) {
    return not_definite(where, "R", count);
  }
  // The cross weight is a change of the input's origin: A - BR⁻¹Nᵀ, Q - NR⁻¹Nᵀ.
  const Eigen::MatrixXd R_B = detail::solve_symmetric(weights.R, B.transpose());
  const Eigen::MatrixXd R_N = detail::solve_symmetric(weights.R, weights.N.transpose());
  Eigen::MatrixXd G = symmetrized(product(B, R_B));
  Eigen::MatrixXd Q = symmetrized(weights.Q - product(weights.N, R_N));
  // S of the size that makes both off-diagonal blocks of the Hamiltonian alike.
  const double sizes = std::sqrt(Q.norm() / G.norm());
  const double unit = std::isfinite(sizes) && sizes > 0.0 ? sizes : 1.0;
  G *= unit;
  Q /= unit;
  FLYBALL_TRY_IN(where, const auto flow,
                 flow_over(A - product(B, R_N), G, Q, horizon.si() / static_cast<double>(count)));
  const auto unbounded = [&](std::size_t step) {
    return refusal(RiccatiError::singular, where, "S")
        .got("without bound within the horizon")
        .hint(
            "the cost has no minimum over so long a time: Q and the terminal weight must not "
            "reward states")
        .with("step", static_cast<double>(step));
  };
  if (!flow) {
    return unbounded(count);
  }
  const Flow& map = *flow;
  FiniteHorizonLqr design;
  design.K.resize(count + 1);
  design.S.resize(count + 1);
  Eigen::MatrixXd S = weights.S / unit;
  for (std::size_t k = count + 1; k-- > 0;) {
    if (k < count) {
      double rcond = 0.0;
      const bool finite = bounded(map.beta, S);
      const Eigen::MatrixXd solved = detail::solve_linear(
          Eigen::MatrixXd::Identity(n, n) + product(map.beta, S), map.alpha, &rcond);
      S = symmetrized(map.gamma + transposed_product(map.alpha, product(S, solved)));
      if (!finite || !(rcond > 1e-15) || !S.allFinite()) {
        return unbounded(k);
      }
    }
    design.S[k] = S * unit;
    design.K[k] = product(R_B, design.S[k]) + R_N;
  }
  return design;
}

}  // namespace flyball
