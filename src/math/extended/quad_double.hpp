#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

/// Matrices of unevaluated sums of four doubles, about 60 digits, with the operations of
/// DoubleDoubleMatrix: for the few equations whose terms cancel to more than its 31 digits. Some
/// twenty times slower.
/// Source: Hida, Li and Bailey, "Algorithms for quad-double precision floating point arithmetic",
/// 15th IEEE Symposium on Computer Arithmetic (2001).
namespace flyball::detail {

struct QuadDoubleMatrix {
  static constexpr double precision = 1e-60;
  using Parts = std::array<Eigen::MatrixXd, 4>;

  Parts part;  ///< Of falling size.

  QuadDoubleMatrix() = default;
  explicit QuadDoubleMatrix(const Eigen::MatrixXd& value) : part{value, 0.0 * value, {}, {}} {
    part[1].setZero();
    part[2] = part[3] = part[1];
  }

  [[nodiscard]] static QuadDoubleMatrix zero(Eigen::Index rows, Eigen::Index columns) {
    return QuadDoubleMatrix(Eigen::MatrixXd::Zero(rows, columns));
  }
  [[nodiscard]] static QuadDoubleMatrix identity(Eigen::Index size) {
    return QuadDoubleMatrix(Eigen::MatrixXd::Identity(size, size));
  }
  [[nodiscard]] Eigen::Index rows() const { return part[0].rows(); }
  [[nodiscard]] Eigen::Index cols() const { return part[0].cols(); }
  [[nodiscard]] Eigen::MatrixXd rounded() const { return part[0] + (part[1] + part[2]); }
  [[nodiscard]] double norm() const { return part[0].norm(); }
  [[nodiscard]] bool all_finite() const { return part[0].allFinite() && part[3].allFinite(); }
  [[nodiscard]] QuadDoubleMatrix transpose() const;
  [[nodiscard]] QuadDoubleMatrix left(Eigen::Index columns) const;
  [[nodiscard]] QuadDoubleMatrix right(Eigen::Index columns) const;
};

[[nodiscard]] QuadDoubleMatrix add_product(QuadDoubleMatrix C, double sign,
                                           const QuadDoubleMatrix& A, const QuadDoubleMatrix& B);
[[nodiscard]] QuadDoubleMatrix product(const QuadDoubleMatrix& A, const QuadDoubleMatrix& B);
[[nodiscard]] QuadDoubleMatrix sum(QuadDoubleMatrix A, double sign, const QuadDoubleMatrix& B);
[[nodiscard]] QuadDoubleMatrix shifted_diagonal(QuadDoubleMatrix A, double scalar);
[[nodiscard]] QuadDoubleMatrix scaled(QuadDoubleMatrix A, double f);
[[nodiscard]] QuadDoubleMatrix symmetrized(const QuadDoubleMatrix& A);
[[nodiscard]] QuadDoubleMatrix beside(const QuadDoubleMatrix& A, const QuadDoubleMatrix& B);
[[nodiscard]] std::optional<QuadDoubleMatrix> solve(QuadDoubleMatrix A, QuadDoubleMatrix B);

}  // namespace flyball::detail
