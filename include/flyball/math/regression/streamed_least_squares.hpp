#pragma once

#include <flyball/math/regression/least_squares.hpp>

namespace flyball {

/// Least squares over rows that come one after the other and are not kept: memory O(p²), whatever
/// their number. Two of them that have seen different rows can be merged, in any order.
///
/// The rows are folded by Householder reflections into the triangular factor of [X 1 y]; no normal
/// equations are formed, so no digits are lost beside `least_squares`.
class StreamedLeastSquares {
 public:
  /// @param coefficients  p, from 1 to 10 000. @errors ArgumentError::out_of_range.
  [[nodiscard]] static Expected<StreamedLeastSquares> create(Eigen::Index coefficients);

  /// One more row. @param x  p numbers, one after the other. @param y  What x β should be.
  /// @param weight  Not negative, as 1/variance. @return  Whether it was taken: an entry that is
  /// not a number of at most `largest_signal` leaves everything as it was.
  /// Cost: O(p²) on average, does not allocate.
  bool add(const double* x, double y, double weight = 1.0) noexcept;

  /// Many rows. @param X  n x p. @param y  n.
  /// @errors ArgumentError for shapes; not_finite, after which none of them was taken.
  [[nodiscard]] Expected<void> add(const MatrixRef& X, const MatrixRef& y);

  /// As if the other's rows had come here. @errors ArgumentError::wrong_shape.
  [[nodiscard]] Expected<void> merge(const StreamedLeastSquares& other);

  /// What the rows so far say, with classical errors.
  /// @param confidence, tolerance  As in LeastSquaresOptions. @errors ArgumentError::out_of_range,
  /// empty where no row has come. Cost: O(p³), allocates.
  [[nodiscard]] Expected<Regression> solve(double confidence = 0.95, double tolerance = 0.0) const;

  /// R, upper triangular, of the columns [X 1 y]: RᵀR = [X 1 y]ᵀ[X 1 y].
  [[nodiscard]] Eigen::MatrixXd factor() const;
  [[nodiscard]] Eigen::Index rows() const noexcept { return rows_; }

 private:
  explicit StreamedLeastSquares(Eigen::Index coefficients);
  void fold(Eigen::MatrixXd& R, Eigen::MatrixXd& block, Eigen::Index used) const noexcept;

  Eigen::MatrixXd R_;      ///< Upper triangular, of the columns [X 1 y].
  Eigen::MatrixXd block_;  ///< Rows that are not in R yet.
  Eigen::Index waiting_ = 0;
  Eigen::Index rows_ = 0;
  double weight_ = 0.0;  ///< Σ w.
  double mean_ = 0.0;    ///< Of y.
  double square_ = 0.0;  ///< Σ w (y - mean)².
};

}  // namespace flyball
