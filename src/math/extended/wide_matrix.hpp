#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

/// Matrices of 31 digits whose entries have exponents of their own, with the operations of
/// DoubleDoubleMatrix: products of a few doubles neither overflow nor vanish. For data near the
/// ends of the doubles' range, and for holding an answer against its equations there. Some ten
/// times slower.
/// Source: Dekker, Numerische Mathematik 18 (1971).
namespace flyball::detail {

/// (hi + lo) 2^exponent with 1 <= |hi| < 2, or zero; not a number where hi is not finite.
struct WideNumber {
  double hi = 0.0;
  double lo = 0.0;
  long exponent = 0;
};

class WideMatrix {
 public:
  static constexpr double precision = 1e-30;

  WideMatrix() = default;
  explicit WideMatrix(const Eigen::MatrixXd& value);

  [[nodiscard]] static WideMatrix zero(Eigen::Index rows, Eigen::Index columns);
  [[nodiscard]] static WideMatrix identity(Eigen::Index size);

  [[nodiscard]] Eigen::Index rows() const { return rows_; }
  [[nodiscard]] Eigen::Index cols() const { return columns_; }
  WideNumber& operator()(Eigen::Index i, Eigen::Index j) {
    return entries_[static_cast<std::size_t>(i + j * rows_)];
  }
  const WideNumber& operator()(Eigen::Index i, Eigen::Index j) const {
    return entries_[static_cast<std::size_t>(i + j * rows_)];
  }

  /// M_ij 2^exponent as doubles: infinite, subnormal or zero where they are.
  [[nodiscard]] Eigen::MatrixXd rounded(long exponent = 0) const;
  /// The Frobenius norm; infinite or zero where that is no double.
  [[nodiscard]] double norm() const;
  [[nodiscard]] bool all_finite() const;
  [[nodiscard]] WideMatrix transpose() const;
  [[nodiscard]] WideMatrix columns_from(Eigen::Index first, Eigen::Index count) const;
  [[nodiscard]] WideMatrix left(Eigen::Index columns) const;
  [[nodiscard]] WideMatrix right(Eigen::Index columns) const;
  [[nodiscard]] WideMatrix magnitudes() const;
  /// M_ij 2^(row_i + column_j + all).
  [[nodiscard]] WideMatrix times_powers(const Eigen::VectorXi& row, const Eigen::VectorXi& column,
                                        long all) const;
  /// The power of two of the largest entry; far below every double's where all are zero.
  [[nodiscard]] long exponent() const;

 private:
  WideMatrix(Eigen::Index rows, Eigen::Index columns)
      : rows_(rows), columns_(columns), entries_(static_cast<std::size_t>(rows * columns)) {}

  Eigen::Index rows_ = 0;
  Eigen::Index columns_ = 0;
  std::vector<WideNumber> entries_;
};

[[nodiscard]] WideMatrix add_product(WideMatrix C, double sign, const WideMatrix& A,
                                     const WideMatrix& B);
[[nodiscard]] WideMatrix product(const WideMatrix& A, const WideMatrix& B);
[[nodiscard]] WideMatrix sum(WideMatrix A, double sign, const WideMatrix& B);
[[nodiscard]] WideMatrix shifted_diagonal(WideMatrix A, double scalar);
[[nodiscard]] WideMatrix scaled(WideMatrix A, double f);
[[nodiscard]] WideMatrix symmetrized(const WideMatrix& A);
[[nodiscard]] WideMatrix beside(const WideMatrix& A, const WideMatrix& B);
[[nodiscard]] std::optional<WideMatrix> solve(WideMatrix A, WideMatrix B);
/// D⁻¹MD, with the powers of two D for which the largest entries beside the diagonal of each row
/// and its column are alike; entries that move no eigenvalue, the other of both being empty, are
/// zero. Source: Osborne, "On pre-conditioning of matrices", J. ACM 7 (1960), in the maximum norm.
[[nodiscard]] WideMatrix balanced(WideMatrix M);

/// The largest of what is left of an equation beside the largest of its terms: 0 where nothing is
/// left, not a number where one is not finite.
[[nodiscard]] double share_of(const WideMatrix& left, const WideMatrix& terms);

}  // namespace flyball::detail
