#include <algorithm>
#include <cmath>
#include <limits>

#include <flyball/control/margins.hpp>
#include <flyball/control/running_loop.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_robustness_grid = "robustness_grid";

Expected<void> check_factors(const std::vector<double>& factors, std::string_view name) {
  if (factors.empty()) {
    return refusal(ArgumentError::empty, in_robustness_grid, name)
        .got("empty")
        .expected("at least one factor");
  }
  for (std::size_t i = 0; i < factors.size(); ++i) {
    FLYBALL_CHECK(
        check_positive(factors[i], in_robustness_grid, detail::format("{} factor {}", name, i)));
  }
  return {};
}

}  // namespace

Expected<RobustnessGrid> robustness_grid(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C,
                                         const DiscreteSystem<>& model, const MatrixRef& K,
                                         const MatrixRef& K_e, Time delay,
                                         const RobustnessOptions& options) {
  FLYBALL_TRY_IN(in_robustness_grid, [[maybe_unused]] const auto nominal,
                 observer_regulator_loop(A, B, C, model, K, K_e, delay));
  FLYBALL_CHECK(check_factors(options.inertia, "inertia"));
  FLYBALL_CHECK(check_factors(options.gain, "gain"));
  FLYBALL_TRY(const auto B_pinv, pseudoinverse(model.B));
  const Eigen::Index n = model.A.rows();
  // A step of the first reference enters the input through F = K + B⁺ (I - A).
  const Eigen::MatrixXd F = K + B_pinv.X * (Eigen::MatrixXd::Identity(n, n) - model.A);

  RobustnessGrid grid;
  grid.all_stable = true;
  for (const double inertia : options.inertia) {
    for (const double gain : options.gain) {
      Eigen::MatrixXd true_A = A;
      Eigen::MatrixXd true_B = B * gain;
      true_A.bottomRows(1) /= inertia;
      true_B.bottomRows(1) /= inertia;
      const ContinuousSystem<> truth{true_A, true_B, C, Eigen::MatrixXd::Zero(C.rows(), 1)};
      FLYBALL_TRY_IN(in_robustness_grid, const auto loop,
                     running_loop(truth, model, K, K_e, delay));
      RobustnessCase result{.inertia = inertia, .gain = gain};
      result.spectral_radius = std::abs(loop.poles(0));
      result.stable = result.spectral_radius < 1.0;
      if (result.stable) {
        FLYBALL_TRY_IN(in_robustness_grid, const auto step, step_of(loop, F.leftCols(1)));
        result.overshoot = step.metrics.overshoot;
        result.steady_error = step.final_value - 1.0;
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
