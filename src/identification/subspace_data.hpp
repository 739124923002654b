#pragma once

#include <Eigen/Core>

#include <flyball/identification/subspace.hpp>

/// A record's past and future, compressed; and what of a model the whole record tells.
namespace flyball::identification {

/// L of H = L Q with orthonormal rows Q, H the block Hankel matrix of [U_f; U_p; Y_p; Y_f]: s block
/// rows each, samples - 2s + 1 columns.
struct PastAndFuture {
  Eigen::MatrixXd L;  ///< Lower triangular, 2s(m + p).
  Eigen::Index columns = 0;
};
[[nodiscard]] PastAndFuture compress(const Eigen::MatrixXd& u, const Eigen::MatrixXd& y,
                                     Eigen::Index block_rows);

/// A record in units in which every signal is about 1.
struct ScaledSignals {
  Eigen::MatrixXd u;
  Eigen::MatrixXd y;
  Eigen::VectorXd u_unit;
  Eigen::VectorXd y_unit;
};

/// B, D and x0 that minimise the predictor's errors, weighed by W: linear in all of them.
///
/// ŷ = C x̂ + D u, x̂⁺ = Φ x̂ + (B - K D) u + K y with Φ = A - K C. The part of C x̂ that an input
/// makes through column b of B is zᵀ b with z⁺ = Φᵀ z + Cᵀ u: one state a pair of output and input.
/// @param noisy  The record has noise, beside which the normal equations lose nothing where they
/// are
///               well enough conditioned; else, and without noise, by QR.
/// @return  x0, B and D, column by column, those that are not fitted left out.
[[nodiscard]] Expected<Eigen::VectorXd> regress_inputs(const ScaledSignals& record,
                                                       const InnovationsModel& model,
                                                       const Eigen::MatrixXd& W,
                                                       const SubspaceOptions& options, bool noisy);

}  // namespace flyball::identification
