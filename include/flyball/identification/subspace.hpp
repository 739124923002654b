#pragma once

#include <optional>

#include <Eigen/Core>

#include <flyball/identification/innovations_model.hpp>

namespace flyball::identification {

/// How the rows and columns of the projected future are weighed before its singular values are
/// looked at.
enum class SubspaceWeighting {
  cva,    ///< Canonical correlations of past and future (Larimore): the best for noisy data.
  moesp,  ///< As it is, the future inputs projected out (Verhaegen's PO-MOESP).
  n4sid,  ///< The oblique projection (Van Overschee and De Moor).
};

/// How to fit.
struct SubspaceOptions {
  std::optional<Eigen::Index> order{};  ///< n; else chosen by `most_order` and the criterion.
  Eigen::Index most_order = 0;          ///< Of those compared; 0: 10, or what the rows allow.
  Eigen::Index block_rows = 0;  ///< s, samples of past and of future; 0: from 10 to 30 by record
                                ///< and order.
  SubspaceWeighting weighting = SubspaceWeighting::cva;
  bool feedthrough = true;    ///< Whether D is estimated; else it is zero.
  bool stable = false;        ///< All poles outside the unit circle are reflected into it.
  bool initial_state = true;  ///< Whether x0 is estimated; else it is zero.
};

/// A fitted model in states, and what chose its order.
struct SubspaceFit {
  InnovationsModel model;
  Eigen::Index order = 0;
  Eigen::VectorXd singular_values;  ///< Of the weighted projection, decreasing; of cva the
                                    ///< canonical correlations.
  /// Of each order from 0 on: the largest squared canonical correlation left out, plus what its
  /// parameters cost (Bauer's SVC); of data without noise the singular value left out over the last
  /// one kept. The order from 1 on that makes it least is taken.
  Eigen::VectorXd criterion;
  Eigen::Index block_rows = 0;
  bool noise_determined = true;  ///< K is that of the residuals; else they are too small to tell,
                                 ///< and it is zero.
  /// Poles came out outside the unit circle and were reflected into it, as the record is predicted
  /// as well with them there (χ² within 12); unstable ones that it asks for stay.
  bool stabilized = false;
};

/// A model of several inputs and outputs from a record, without a search: the order from singular
/// values, the rest by linear least squares.
///
/// Past and future of the record are compressed into a triangular factor of a few hundred rows:
/// through the correlation matrix, which needs each product of samples once because block Hankel
/// matrices shift, or by QR where the data are too nearly dependent for that. A and C follow from
/// the observed states, K from the covariances of what they leave (a Riccati equation), and B, D
/// and x0 from a regression of the whole record on the predictor A - KC, which is stable.
///
/// Signals are scaled to one size first; means are kept: remove them from records of deviations.
/// @param u  samples x inputs. @param y  samples x outputs.
/// @errors ArgumentError for shapes, entries and options; IdentificationError::too_short, singular
/// (the inputs do not excite the model).
/// Cost: O(samples s (m + p)² + (s (m + p))³ + samples p n² m), allocates.
/// Source: Van Overschee and De Moor, "Subspace Identification for Linear Systems" (1996), chapters
/// 4 and 6; Verhaegen, Automatica 30 (1994); Larimore, IEEE Conf. Decision and Control (1990);
/// Bauer, Automatica 37 (2001) (order); Sima, Sima and Van Huffel, J. Computational Applied
/// Mathematics 170 (2004) (fast factor).
[[nodiscard]] Expected<SubspaceFit> fit_subspace(const MatrixRef& u, const MatrixRef& y,
                                                 Time period, const SubspaceOptions& options = {});

}  // namespace flyball::identification
