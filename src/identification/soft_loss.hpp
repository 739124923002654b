#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "identification/output_error.hpp"

/// The soft-L1 loss and the sums of a run's Jacobian; shared by the minimisation and the variance
/// of its answer.
namespace flyball::identification {

inline constexpr double soft_limit = 1.5;  // δ: residuals beyond 1.5 σ count linearly

inline double square(double value) {
  return value * value;
}

inline double loss(double z) {
  return 2.0 * square(soft_limit) * (std::sqrt(1.0 + square(z / soft_limit)) - 1.0);
}

/// ρ'(z)/(2z): the weight of iterated least squares. ρ''(z)/2 is its cube.
inline double weight(double z) {
  return 1.0 / std::sqrt(1.0 + square(z / soft_limit));
}

/// 1/scale, and 0 for a channel that is switched off.
inline double inverse(double scale) {
  return scale > 0.0 ? 1.0 / scale : 0.0;
}

/// Adds the lower triangle of a run's symmetric matrix, by the columns of its Jacobian, to the
/// matrix of all parameters.
inline void scatter(Eigen::MatrixXd& all, const Eigen::MatrixXd& lower,
                    const std::vector<Eigen::Index>& columns) {
  const auto count = static_cast<Eigen::Index>(columns.size());
  for (Eigen::Index a = 0; a < count; ++a) {
    for (Eigen::Index b = 0; b < count; ++b) {
      const Eigen::Index row = columns[static_cast<std::size_t>(a)];
      const Eigen::Index column = columns[static_cast<std::size_t>(b)];
      if (row >= 0 && column >= 0) {
        all(row, column) += lower(std::max(a, b), std::min(a, b));
      }
    }
  }
}

/// Adds Σ weight j jᵀ over the rows j of a Jacobian to the lower triangle of `sum`.
/// @param weights  Of its rows.
inline void add_squares(Eigen::MatrixXd& sum, const ResidualBlock::Jacobian& jacobian,
                        const Eigen::VectorXd& weights) {
  // The sensors' own columns are six.
  with_width(static_cast<std::size_t>(jacobian.cols()) - 6, [&](auto width) {
    constexpr int count = width() + 6;
    using Column = Eigen::Matrix<double, count, 1>;
    Eigen::Matrix<double, count, count> square = Eigen::Matrix<double, count, count>::Zero();
    for (Eigen::Index row = 0; row < jacobian.rows(); ++row) {
      const Eigen::Map<const Column> j(jacobian.data() + row * count);
      const Column weighed = weights[row] * j;
      for (int k = 0; k < count; ++k) {
        // From an even row on, so that pairs of them are added at once.
        for (int i = k & ~1; i < count; ++i) {
          square(i, k) += weighed[k] * j[i];
        }
      }
    }
    sum += square;
  });
}

}  // namespace flyball::identification
