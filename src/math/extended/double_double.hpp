#pragma once

#include <optional>

#include <Eigen/Core>

/// Matrices of unevaluated sums hi + lo, about 31 digits. Where a residual is the small difference
/// of large products, forming it here makes Newton's method an iterative refinement; and equations
/// whose data is too badly conditioned for doubles are solved here altogether.
/// Source: Dekker, Numerische Mathematik 18 (1971); Ogita, Rump and Oishi, SIAM J. Sci. Comput. 26
/// (2005).
namespace flyball::detail {

struct DoubleDoubleMatrix {
  static constexpr double precision = 1e-30;

  Eigen::MatrixXd hi;
  Eigen::MatrixXd lo;

  DoubleDoubleMatrix() = default;
  explicit DoubleDoubleMatrix(Eigen::MatrixXd value)
      : hi(std::move(value)), lo(Eigen::MatrixXd::Zero(hi.rows(), hi.cols())) {}

  [[nodiscard]] static DoubleDoubleMatrix zero(Eigen::Index rows, Eigen::Index columns) {
    return DoubleDoubleMatrix(Eigen::MatrixXd::Zero(rows, columns));
  }
  [[nodiscard]] static DoubleDoubleMatrix identity(Eigen::Index size) {
    return DoubleDoubleMatrix(Eigen::MatrixXd::Identity(size, size));
  }
  [[nodiscard]] Eigen::Index rows() const { return hi.rows(); }
  [[nodiscard]] Eigen::Index cols() const { return hi.cols(); }
  [[nodiscard]] Eigen::MatrixXd rounded() const { return hi + lo; }
  [[nodiscard]] double norm() const { return hi.norm(); }
  [[nodiscard]] bool all_finite() const { return hi.allFinite() && lo.allFinite(); }
  [[nodiscard]] DoubleDoubleMatrix transpose() const { return {hi.transpose(), lo.transpose()}; }
  [[nodiscard]] DoubleDoubleMatrix block(Eigen::Index i, Eigen::Index j, Eigen::Index rows,
                                         Eigen::Index columns) const {
    return {hi.block(i, j, rows, columns), lo.block(i, j, rows, columns)};
  }
  [[nodiscard]] DoubleDoubleMatrix left(Eigen::Index columns) const {
    return block(0, 0, rows(), columns);
  }
  [[nodiscard]] DoubleDoubleMatrix right(Eigen::Index columns) const {
    return block(0, cols() - columns, rows(), columns);
  }

 private:
  DoubleDoubleMatrix(Eigen::MatrixXd high, Eigen::MatrixXd low)
      : hi(std::move(high)), lo(std::move(low)) {}
};

/// C + sign·A B.
[[nodiscard]] DoubleDoubleMatrix add_product(DoubleDoubleMatrix C, double sign,
                                             const DoubleDoubleMatrix& A,
                                             const DoubleDoubleMatrix& B);

/// A B.
[[nodiscard]] DoubleDoubleMatrix product(const DoubleDoubleMatrix& A, const DoubleDoubleMatrix& B);

/// A + sign·B.
[[nodiscard]] DoubleDoubleMatrix sum(DoubleDoubleMatrix A, double sign,
                                     const DoubleDoubleMatrix& B);

/// A + scalar·I.
[[nodiscard]] DoubleDoubleMatrix shifted_diagonal(DoubleDoubleMatrix A, double scalar);

/// f A for a power of two f.
[[nodiscard]] DoubleDoubleMatrix scaled(DoubleDoubleMatrix A, double f);

/// (A + Aᵀ)/2.
[[nodiscard]] DoubleDoubleMatrix symmetrized(const DoubleDoubleMatrix& A);

/// The columns of A, then those of B.
[[nodiscard]] DoubleDoubleMatrix beside(const DoubleDoubleMatrix& A, const DoubleDoubleMatrix& B);

/// A⁻¹ B by LU with row pivoting after an equilibration of the rows; nothing where a pivot
/// vanishes.
[[nodiscard]] std::optional<DoubleDoubleMatrix> solve(DoubleDoubleMatrix A, DoubleDoubleMatrix B);

}  // namespace flyball::detail
