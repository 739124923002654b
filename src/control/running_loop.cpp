#include <flyball/control/running_loop.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <flyball/systems/discretize.hpp>
#include <flyball/systems/input_delay.hpp>
#include <flyball/systems/response.hpp>

#include "control/sampled_loop.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

// The plant's state when the input of now arrives, of [x; u_{k-1}; …]: x after the whole periods,
// then after the rest of one, in which u_{k-1} still acts.
Expected<Eigen::MatrixXd> predictor(const MatrixRef& A, const MatrixRef& B, Time period, Time delay,
                                    const Eigen::MatrixXd& delayed_A) {
  FLYBALL_TRY(const auto parts, discretize_delayed_input(A, B, period, delay));
  const Eigen::Index n = A.rows();
  Eigen::MatrixXd state = Eigen::MatrixXd::Identity(n, delayed_A.rows());
  for (int k = 0; k < parts.whole_periods; ++k) {
    state = detail::product(state, delayed_A);
  }
  const double rest = delay.si() - parts.whole_periods * period.si();
  if (!(rest > 0.0) || parts.B_1.isZero(0.0)) {
    return state;
  }
  FLYBALL_TRY(const auto fraction, discretize_zoh(A, B, Time(rest)));
  state = detail::product(fraction.A, state);
  state.middleCols(n, B.cols()) += fraction.B;
  return state;
}

Expected<void> check_regulator(const ContinuousSystem<>& plant, const DiscreteSystem<>& model,
                               const MatrixRef& K, const MatrixRef& K_e) {
  constexpr std::string_view where = "running_loop";
  FLYBALL_CHECK(check_system(plant, where));
  FLYBALL_CHECK(check_system(model, where));
  const Eigen::Index m = plant.B.cols();
  const Eigen::Index n = model.A.rows();
  FLYBALL_CHECK(
      Checks(where).shape(K, m, n, "K", "inputs x states").finite(K, "K").finite(K_e, "K_e"));
  if (K_e.size() == 0) {
    return check_shape(model.A, plant.A.rows(), plant.A.rows(), where, "the model's A",
                       "of the plant's states, which are fed back");
  }
  FLYBALL_CHECK(Checks(where)
                    .shape(model.B, n, m, "the model's B", "states x inputs")
                    .shape(model.C, plant.C.rows(), n, "the model's C", "outputs x states")
                    .shape(K_e, n, plant.C.rows(), "K_e", "states x outputs"));
  if (!plant.D.isZero(0.0) || !model.D.isZero(0.0)) {
    return refusal(ArgumentError::out_of_range, where, "D")
        .got("not zero")
        .expected("zero: a measurement that contains the input closes a second loop");
  }
  return {};
}

/// The states in sets of those that act on each other, there and back: by one such set after the
/// other A is block triangular. Cost: O(n³).
std::vector<std::vector<Eigen::Index>> loops_of(const MatrixRef& A) {
  const Eigen::Index n = A.rows();
  const auto reached = [&](Eigen::Index from, bool forwards) {
    std::vector<bool> found(static_cast<std::size_t>(n), false);
    std::vector<Eigen::Index> open{from};
    found[static_cast<std::size_t>(from)] = true;
    while (!open.empty()) {
      const Eigen::Index at = open.back();
      open.pop_back();
      for (Eigen::Index to = 0; to < n; ++to) {
        if (!found[static_cast<std::size_t>(to)] && (forwards ? A(to, at) : A(at, to)) != 0.0) {
          found[static_cast<std::size_t>(to)] = true;
          open.push_back(to);
        }
      }
    }
    return found;
  };
  std::vector<std::vector<Eigen::Index>> loops;
  std::vector<bool> placed(static_cast<std::size_t>(n), false);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (placed[static_cast<std::size_t>(i)]) {
      continue;
    }
    const std::vector<bool> after = reached(i, true);
    const std::vector<bool> before = reached(i, false);
    loops.emplace_back();
    for (Eigen::Index k = i; k < n; ++k) {
      const auto at = static_cast<std::size_t>(k);
      if (after[at] && before[at]) {
        placed[at] = true;
        loops.back().push_back(k);
      }
    }
  }
  return loops;
}

/// The eigenvalues of a loop that does not fall apart, those that are zero exactly so.
///
/// What a delay remembers is a chain of d states, an eigenvalue 0 of which rounding would make a
/// ring of radius eps^(1/d). W spans what the range of A leaves out: W'A = 0, and with Z its
/// orthogonal complement the other eigenvalues are those of Z'A Z, which may leave out more. What
/// rounding leaves of a zero grows tenfold in ten steps; poles of 1e-11 count as 0.
/// Source: Van Dooren, "The computation of Kronecker's canonical form of a singular pencil",
/// Linear Algebra and its Applications 27 (1979).
Eigen::VectorXcd poles_of_one(const MatrixRef& A) {
  const Eigen::VectorXd d = detail::balance_of(A);
  Eigen::MatrixXd M = d.cwiseInverse().asDiagonal() * A * d.asDiagonal();
  Eigen::VectorXcd poles = Eigen::VectorXcd::Zero(A.rows());
  while (M.rows() > 0) {
    const detail::OrthogonalTriangular qr = detail::pivoted_qr(M);
    const Eigen::VectorXd sizes = qr.R.diagonal().cwiseAbs();
    const double rounding = 1e-11 * sizes.maxCoeff();
    const Eigen::Index rank = (sizes.array() > rounding).count();
    if (rank == M.rows()) {
      break;
    }
    const Eigen::MatrixXd Z = qr.Q.leftCols(rank);
    // Moved: Eigen frees before it allocates when a matrix takes another size.
    M = Eigen::MatrixXd(detail::product(Z.transpose(), detail::product(M, Z)));
  }
  poles.head(M.rows()) = detail::eigenvalues_of(M);
  return poles;
}

/// Of a loop whose feedback is zero the plant's, the observer's and the delay's zeros, each exact.
Eigen::VectorXcd poles_of(const MatrixRef& A) {
  Eigen::VectorXcd poles(A.rows());
  Eigen::Index at = 0;
  for (const std::vector<Eigen::Index>& loop : loops_of(A)) {
    const auto size = static_cast<Eigen::Index>(loop.size());
    poles.segment(at, size) = size == 1 ? Eigen::VectorXcd::Constant(1, A(loop[0], loop[0]))
                                        : poles_of_one(A(loop, loop));
    at += size;
  }
  return poles;
}

}  // namespace

Expected<RunningLoop> running_loop(const ContinuousSystem<>& plant, const DiscreteSystem<>& model,
                                   const MatrixRef& K, const MatrixRef& K_e, Time delay) {
  FLYBALL_CHECK(check_regulator(plant, model, K, K_e));
  const bool observed = K_e.size() > 0;
  const PlantInputLoop opened =
      observed ? detail::observer_loop(plant.A, plant.B, plant.C, model, K, K_e, delay)
               : detail::feedback_loop(plant.A, plant.B, K, model.period, delay);
  FLYBALL_CHECK(detail::check_delay(opened, "running_loop"));
  FLYBALL_TRY(const auto sampled, detail::SampledLoop::create(opened));
  FLYBALL_TRY(const auto now,
              predictor(plant.A, plant.B, model.period, delay, sampled.delayed_A()));

  RunningLoop loop;
  loop.system.A = sampled.closed(1.0);
  const Eigen::Index n = loop.system.A.rows();
  const Eigen::Index m = plant.B.cols();
  loop.system.B = Eigen::MatrixXd::Zero(n, m);
  loop.system.B.topRows(sampled.delayed_states()) = sampled.delayed_B();
  if (observed) {
    loop.system.B.bottomRows(model.A.rows()) = model.B;
  }
  loop.system.C = Eigen::MatrixXd::Zero(plant.C.rows(), n);
  loop.system.C.leftCols(sampled.delayed_states()) = detail::product(plant.C, now);
  loop.system.D = Eigen::MatrixXd::Zero(plant.C.rows(), m);
  loop.system.period = model.period;
  loop.poles = poles_of(loop.system.A);
  std::stable_sort(loop.poles.begin(), loop.poles.end(),
                   [](const auto& a, const auto& b) { return std::abs(a) > std::abs(b); });
  const double radius = loop.poles.size() > 0 ? std::abs(loop.poles(0)) : 0.0;
  loop.time_constant = radius < 1.0 ? -model.period.si() / std::log(radius)
                                    : std::numeric_limits<double>::infinity();
  return loop;
}

Expected<LoopStep> step_of(const RunningLoop& loop, const MatrixRef& F) {
  constexpr std::string_view where = "step_of";
  const DiscreteSystem<>& system = loop.system;
  FLYBALL_CHECK(Checks(where).shape(F, system.B.cols(), 1, "F", "inputs x 1").finite(F, "F"));
  if (!std::isfinite(loop.time_constant)) {
    return refusal(ArgumentError::out_of_range, where, "the loop")
        .got("not stable")
        .expected("a stable one: a step of another has no end");
  }
  const Eigen::MatrixXd drive = detail::product(system.B, F);
  const Eigen::Index n = system.A.rows();
  const Eigen::MatrixXd I_A = Eigen::MatrixXd::Identity(n, n) - system.A;
  LoopStep step;
  step.final_value = system.C.row(0).dot(detail::solve_linear(I_A, drive).col(0));

  constexpr double most_samples = 20000.0;
  const double time_constants = -std::log(1e-9);
  const auto samples = static_cast<Eigen::Index>(
      std::min(time_constants * std::max(loop.time_constant / system.period.si(), 0.1) + 10.0,
               most_samples));
  FLYBALL_TRY(const auto response, step_response({system.A, drive, system.C.topRows(1),
                                                  Eigen::MatrixXd::Zero(1, 1), system.period},
                                                 0, ResponseTimes{system.period, samples + 1}));
  const Eigen::VectorXd y = response.y.col(0);
  const auto count = static_cast<std::size_t>(y.size());
  FLYBALL_TRY(step.metrics,
              response_metrics({response.time.data(), count}, {y.data(), count}, step.final_value));
  step.time.assign(response.time.data(), response.time.data() + count);
  step.values.assign(y.data(), y.data() + count);
  return step;
}

Expected<PredictingRegulator> predicting_regulator(const ContinuousSystem<>& plant, Time period,
                                                   const MatrixRef& K, const MatrixRef& K_e,
                                                   Time delay) {
  constexpr std::string_view where = "predicting_regulator";
  FLYBALL_TRY(auto model, discretize_with_input_delay(plant, period, delay));
  const Eigen::Index n = plant.A.rows();
  FLYBALL_CHECK(Checks(where)
                    .shape(K, plant.B.cols(), n, "K", "inputs x states")
                    .shape(K_e, n, plant.C.rows(), "K_e", "states x outputs"));
  FLYBALL_TRY(const auto later, predictor(plant.A, plant.B, period, delay, model.A));
  PredictingRegulator made{.model = std::move(model), .K = detail::product(K, later), .K_e = {}};
  made.K_e = Eigen::MatrixXd::Zero(made.model.A.rows(), K_e.cols());
  made.K_e.topRows(n) = K_e;
  return made;
}

}  // namespace flyball
