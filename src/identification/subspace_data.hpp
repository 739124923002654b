#pragma once

#include <Eigen/Core>

#include <flyball/identification/subspace.hpp>

#include "identification/record_kernel.hpp"

/// A record's past and future, compressed; and what of a model the whole record tells.
namespace flyball::identification {

/// A record in units in which every signal is about 1.
struct ScaledSignals {
  Eigen::MatrixXd w;  ///< [u y], and rows of zeros for the kernels.
  Eigen::Index inputs;
  Eigen::VectorXd unit;  ///< Of each column.

  [[nodiscard]] Eigen::Index outputs() const { return w.cols() - inputs; }
  [[nodiscard]] Eigen::Index samples() const { return w.rows() - detail::record_margin; }
  [[nodiscard]] auto u() const { return w.topLeftCorner(samples(), inputs); }
  [[nodiscard]] auto y() const { return w.topRightCorner(samples(), outputs()); }
  [[nodiscard]] detail::RecordView view() const {
    return {w.data(), static_cast<int>(w.rows()), static_cast<int>(w.cols()),
            static_cast<int>(samples())};
  }
};
[[nodiscard]] ScaledSignals scaled(const MatrixRef& u, const MatrixRef& y);

/// L of H = L Q with orthonormal rows Q, H the block Hankel matrix of [U_f; U_p; Y_p; Y_f]: s block
/// rows each, samples - 2s + 1 columns.
struct PastAndFuture {
  Eigen::MatrixXd L;  ///< Lower triangular, 2s(m + p).
  Eigen::Index columns = 0;
  /// Of data with noise, for which products lose nothing: Y_f Y_fᵀ without what U_f tells, its
  /// lower triangle; else empty.
  Eigen::MatrixXd future;
};
[[nodiscard]] PastAndFuture compress(const ScaledSignals& record, Eigen::Index block_rows);

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

/// Σ (y - ŷ)(y - ŷ)ᵀ one sample ahead, the model in the record's units.
[[nodiscard]] Eigen::MatrixXd prediction_squares(const ScaledSignals& record,
                                                 const InnovationsModel& model);

}  // namespace flyball::identification
