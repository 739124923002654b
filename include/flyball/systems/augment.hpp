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

/// Augments a plant with the integral of each output's error, dx_I/dt = r - y:
/// A_aug = [A 0; -C 0], B_aug = [B; -D], C_aug = [C 0]; for integral action by state feedback.
///
/// The reference enters through [0; I], which `augment_integral_reference` has as further inputs.
/// Augment before discretising.
/// @return A system of states + outputs states.
/// @errors ArgumentError for shapes and entries.
/// Source: book, section 6.7.1 (plant augmentation, 6.6.1).
[[nodiscard]] Expected<ContinuousSystem<>> augment_integral(const ContinuousSystem<>& plant);

/// The same with the inputs [u; r], for simulating the loop: B_aug = [B 0; -D I].
[[nodiscard]] Expected<ContinuousSystem<>> augment_integral_reference(
    const ContinuousSystem<>& plant);

/// The controller's side (6.6.2): u = [K K_I] ([r; 0] - [x; x_I]).
/// @param K  m x n. @param K_I  m x p. @return m x (n + p).
/// @errors ArgumentError for shapes and entries. Source: book, section 6.7.1.
[[nodiscard]] Expected<Eigen::MatrixXd> augment_gain(const MatrixRef& K, const MatrixRef& K_I);

/// Augments a plant with constants that no input moves, for an observer that estimates them:
/// A_aug = [A B_bias; 0 0], B_aug = [B; 0], C_aug = [C C_bias].
///
/// An input's error is B_bias = a column of B; a sensor's offset is C_bias = a column of I.
/// @param B_bias  n x k: how the constants act on the states. @param C_bias  p x k: on the outputs.
/// @return A system of n + k states; a discrete one keeps them by I instead of 0.
/// @errors ArgumentError for shapes and entries.
/// Source: book, sections 6.6.3 (observer augmentation) and 6.7.2 with its B_error.
[[nodiscard]] Expected<ContinuousSystem<>> augment_bias(const ContinuousSystem<>& plant,
                                                        const MatrixRef& B_bias,
                                                        const MatrixRef& C_bias);
[[nodiscard]] Expected<DiscreteSystem<>> augment_bias(const DiscreteSystem<>& plant,
                                                      const MatrixRef& B_bias,
                                                      const MatrixRef& C_bias);

/// Appends outputs: C_aug = [C; C_more], D_aug = [D; D_more]. With C_more = -K and D_more = 0 they
/// are the inputs of the feedback u = -Kx; with rows of I, states.
/// @param C_more  k x n. @param D_more  k x m.
/// @errors ArgumentError for shapes and entries. Source: book, section 6.6.4.
[[nodiscard]] Expected<ContinuousSystem<>> augment_output(const ContinuousSystem<>& plant,
                                                          const MatrixRef& C_more,
                                                          const MatrixRef& D_more);
[[nodiscard]] Expected<DiscreteSystem<>> augment_output(const DiscreteSystem<>& plant,
                                                        const MatrixRef& C_more,
                                                        const MatrixRef& D_more);

}  // namespace flyball
