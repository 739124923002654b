#pragma once

#include <memory>
#include <vector>

#include <flyball/control/mpc/predictive_controller.hpp>
#include <flyball/math/expression/differentiate.hpp>
#include <flyball/math/expression/lane_tape.hpp>

#include "optimization/mpc/stage_qp_solver.hpp"

namespace flyball::detail {

/// A model's step over a period, with its Jacobian, at many points side by side.
struct StepTape {
  /// @param model  ẋ = f(x, u). @param period  s. Cost: linear in the recorded operations.
  StepTape(const ModelTape& model, double period);

  expression::LaneTape tape{};
  std::vector<expression::Entry>
      entries{};  ///< Of ∂F/∂(x, u), in the order of the outputs after F.
  std::vector<double> work{};
};

/// A predictive controller: its program, references and memory.
struct MpcCore::Parts {
  Parts(int states, int inputs, const MatrixRef& weight_Q, const MatrixRef& weight_R,
        const MpcSettings& limits, const optimization::detail::StageQpSizes& sizes);
  Parts(const Parts&) = default;

  /// Writes a stage's cost, and the last one's; [A B] of the input before, where there are rates.
  void fill_cost(int stages);
  void fill_plant(const MatrixRef& plant_A, const MatrixRef& plant_B);
  /// Limits, and what is known before the first period. @return false where the cost has no
  /// minimum.
  [[nodiscard]] bool finish();
  /// [A B] and b along the last trajectory. @return whether all is finite.
  [[nodiscard]] bool linearize() noexcept;
  /// The last solution becomes the trajectory, one period on where `moved`.
  void follow(bool moved) noexcept;
  /// The input before, within what limits it now.
  void hold(double* u) const noexcept;
  MpcStatus solve(const double* x) noexcept;
  MpcStatus iterate(const double* x) noexcept;

  Eigen::MatrixXd A{}, B{}, Q, R;
  MpcSettings settings;
  optimization::detail::StageQpSolver qp;
  int n, m;
  int rates;  // states that are the input before
  Eigen::VectorXd u_last{}, reference{}, input_reference{};
  double offset = 0.0;  // of the cost: what the references add
  // Of a model that is not linear:
  std::shared_ptr<const StepTape> model{};
  std::vector<double> work{};
  Eigen::MatrixXd x_bar{}, u_bar{};  // n x (N + 1), m x N
  bool has_trajectory = false;
  double change = 0.0;
  int iterations = 0;
};

}  // namespace flyball::detail
