#pragma once

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/systems/system.hpp>

namespace flyball::identification {

/// A discrete system with what is known of its noise:
///
///   x⁺ = A x + B u + K e,   y = C x + D u + e,   E[e eᵀ] = noise.
///
/// K is the gain of the steady Kalman predictor: with it `predict` whitens what the model leaves.
struct InnovationsModel {
  DiscreteSystem<> system;
  Eigen::MatrixXd K;      ///< n x p.
  Eigen::MatrixXd noise;  ///< p x p, covariance of e, a sample.
  Eigen::VectorXd x0;     ///< n, at the record's first sample.
};

/// y without the noise: the free run from x0.
/// @param u  samples x inputs. @return samples x outputs.
/// @errors ArgumentError for the model, shapes and entries; not_finite where it grows beyond
/// doubles. Cost: O(samples (n + m)(n + p)).
[[nodiscard]] Expected<Eigen::MatrixXd> simulate(const InnovationsModel& model, const MatrixRef& u);

/// ŷ_k from u up to k and y up to k - 1.
/// @param u, y  samples x inputs, samples x outputs. @errors As `simulate`.
[[nodiscard]] Expected<Eigen::MatrixXd> predict(const InnovationsModel& model, const MatrixRef& u,
                                                const MatrixRef& y);

/// 1 - ‖y - ŷ‖/‖y - mean‖ of each output: 1 is perfect, 0 no better than the mean.
/// @param y, y_hat  samples x outputs. @errors ArgumentError for shapes and entries.
[[nodiscard]] Expected<Eigen::VectorXd> fit_of(const MatrixRef& y, const MatrixRef& y_hat);

}  // namespace flyball::identification
