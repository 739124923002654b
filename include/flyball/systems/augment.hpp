#pragma once

#include <flyball/systems/system.hpp>

namespace flyball {

namespace detail {

constexpr int add_sizes(int a, int b) {
  return a == Eigen::Dynamic || b == Eigen::Dynamic ? Eigen::Dynamic : a + b;
}

}  // namespace detail

/// Augments a plant with one u_error state an input, for an observer that estimates the input which
/// disturbances seem to add: A_aug = [A B; 0 0], B_aug = [B; 0], C_aug = [C 0].
///
/// Augment before discretising; the controller is designed on the unaugmented plant.
/// @return A system of states + inputs states.
/// @errors ArgumentError for shapes and entries that are not finite.
/// Source: book, section 6.7.2, equations 6.11, 6.17, 6.35.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<ContinuousSystem<detail::add_sizes(States, Inputs), Inputs, Outputs>>
augment_input_error(const ContinuousSystem<States, Inputs, Outputs>& plant) {
  if (auto checked = check_system(plant, "augment_input_error"); !checked) {
    return tl::unexpected(checked.error());
  }
  const Eigen::Index n = plant.A.rows();
  const Eigen::Index m = plant.B.cols();
  ContinuousSystem<detail::add_sizes(States, Inputs), Inputs, Outputs> augmented;
  augmented.A.setZero(n + m, n + m);
  augmented.A.topLeftCorner(n, n) = plant.A;
  augmented.A.topRightCorner(n, m) = plant.B;
  augmented.B.setZero(n + m, m);
  augmented.B.topRows(n) = plant.B;
  augmented.C.setZero(plant.C.rows(), n + m);
  augmented.C.leftCols(n) = plant.C;
  augmented.D = plant.D;
  return augmented;
}

/// The controller's side of it: K_aug = [K I], used with r_aug = [r; 0] (6.12).
/// @param K  m x n, the gain designed on the unaugmented plant.
/// @return m x (n + m).
template <int Inputs, int States>
[[nodiscard]] Eigen::Matrix<double, Inputs, detail::add_sizes(States, Inputs)>
augment_gain_input_error(const Eigen::Matrix<double, Inputs, States>& K) {
  Eigen::Matrix<double, Inputs, detail::add_sizes(States, Inputs)> augmented;
  augmented.setZero(K.rows(), K.cols() + K.rows());
  augmented.leftCols(K.cols()) = K;
  augmented.rightCols(K.rows()).setIdentity();
  return augmented;
}

}  // namespace flyball
