#pragma once

#include <flyball/control/lqr.hpp>

namespace flyball {

/// The weights of Σ xᵀQx + 2 xᵀNu + uᵀRu.
struct QuadraticCost {
  Eigen::MatrixXd Q;  ///< n x n
  Eigen::MatrixXd R;  ///< m x m
  Eigen::MatrixXd N;  ///< n x m
};

/// The cost of the outputs Σ yᵀQy + uᵀRu in terms of the states, with y = C x + D u (B.2):
/// CᵀQC, DᵀQD + R and CᵀQD.
/// @param C  p x n. @param D  p x m. @param Q  p x p, symmetric, 1/output².
/// @param R  m x m, symmetric, 1/input².
/// @errors ArgumentError for shapes, entries and asymmetry; the error of the weight's maker.
/// Source: book, Theorem B.2.1.
[[nodiscard]] Expected<QuadraticCost> output_cost(const MatrixRef& C, const MatrixRef& D,
                                                  const Weight& Q, const Weight& R);

/// The regulator for weights that are on the plant's outputs, outputs x outputs, instead of its
/// states. @errors As `output_cost` and `lqr`. Source: book, Theorem B.2.1.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<LqrDesign<States, Inputs>> output_lqr(
    const DiscreteSystem<States, Inputs, Outputs>& plant, const Weight& Q, const Weight& R) {
  if (auto checked = check_system(plant, "output_lqr"); !checked) {
    return tl::unexpected(checked.error());
  }
  return output_cost(plant.C, plant.D, Q, R).and_then([&](const QuadraticCost& cost) {
    return lqr(plant, cost.Q, cost.R, cost.N);
  });
}

}  // namespace flyball
