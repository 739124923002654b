#include <algorithm>
#include <cmath>
#include <limits>

#include <flyball/control/margins.hpp>
#include <flyball/systems/response.hpp>

#include "control/sampled_loop.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

constexpr std::string_view where = "robustness_grid";

// Overshoot and steady error of the step response to the first reference, which enters the input
// through F = K + B⁺(I - A), and the observer through the input.
Expected<void> judge_step(const detail::SampledLoop& loop, const Eigen::MatrixXd& C,
                          const DiscreteSystem<>& model, double feedforward,
                          RobustnessCase& result) {
  const Eigen::MatrixXd M = loop.closed(1.0);
  Eigen::MatrixXd drive = Eigen::MatrixXd::Zero(M.rows(), 1);
  drive.topRows(loop.delayed_states()) = loop.delayed_B() * feedforward;
  drive.bottomRows(model.A.rows()) = model.B * feedforward;
  Eigen::MatrixXd output = Eigen::MatrixXd::Zero(1, M.rows());
  output.leftCols(loop.plant_states()) = C.row(0);

  const Eigen::MatrixXd I_M = Eigen::MatrixXd::Identity(M.rows(), M.cols()) - M;
  const double final_value = output.row(0).dot(detail::solve_linear(I_M, drive).col(0));

  // Until what is left of the transient is below 1e-9, within reason.
  constexpr double most_samples = 20000.0;
  const double decay = std::log(std::clamp(result.spectral_radius, 1e-3, 1.0 - 1e-12));
  const auto steps =
      static_cast<Eigen::Index>(std::min(std::log(1e-9) / decay + 10.0, most_samples));
  FLYBALL_TRY(const auto response,
              step_response({M, drive, output, Eigen::MatrixXd::Zero(1, 1), model.period}, 0,
                            ResponseTimes{model.period, steps + 1}));
  result.overshoot = std::max(0.0, (response.y / final_value).maxCoeff() - 1.0);
  result.steady_error = final_value - 1.0;
  return {};
}

Expected<void> check_factors(const std::vector<double>& factors, std::string_view name) {
  if (factors.empty()) {
    return refusal(ArgumentError::empty, where, name).got("empty").expected("at least one factor");
  }
  for (std::size_t i = 0; i < factors.size(); ++i) {
    FLYBALL_CHECK(check_positive(factors[i], where, detail::format("{} factor {}", name, i)));
  }
  return {};
}

}  // namespace

Expected<RobustnessGrid> robustness_grid(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C,
                                         const DiscreteSystem<>& model, const MatrixRef& K,
                                         const MatrixRef& K_e, Time delay,
                                         const RobustnessOptions& options) {
  FLYBALL_TRY_IN(where, [[maybe_unused]] const auto nominal,
                 observer_regulator_loop(A, B, C, model, K, K_e, delay));
  FLYBALL_CHECK(check_factors(options.inertia, "inertia"));
  FLYBALL_CHECK(check_factors(options.gain, "gain"));
  FLYBALL_TRY(const auto B_pinv, pseudoinverse(model.B));
  const Eigen::Index n = model.A.rows();
  const Eigen::MatrixXd F = K + B_pinv.X * (Eigen::MatrixXd::Identity(n, n) - model.A);

  RobustnessGrid grid;
  grid.all_stable = true;
  for (const double inertia : options.inertia) {
    for (const double gain : options.gain) {
      Eigen::MatrixXd true_A = A;
      Eigen::MatrixXd true_B = B * gain;
      true_A.bottomRows(1) /= inertia;
      true_B.bottomRows(1) /= inertia;
      FLYBALL_TRY(auto loop, observer_regulator_loop(true_A, true_B, C, model, K, K_e, delay));
      FLYBALL_TRY(auto sampled, detail::SampledLoop::create(loop));
      RobustnessCase result{.inertia = inertia, .gain = gain};
      result.spectral_radius = detail::spectral_radius(sampled.closed(1.0));
      result.stable = result.spectral_radius < 1.0;
      if (result.stable) {
        FLYBALL_CHECK(judge_step(sampled, C, model, F(0, 0), result));
      } else {
        result.overshoot = std::numeric_limits<double>::infinity();
        result.steady_error = std::numeric_limits<double>::infinity();
      }
      grid.all_stable = grid.all_stable && result.stable;
      grid.worst_overshoot = std::max(grid.worst_overshoot, result.overshoot);
      grid.cases.push_back(result);
    }
  }
  return grid;
}

}  // namespace flyball
