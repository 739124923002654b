#pragma once

#include <concepts>
#include <vector>

#include <Eigen/Core>

#include <flyball/optimization/problem/expression.hpp>

namespace flyball::optimization {

/// A matrix of expressions: decision variables, and what is computed of them. Copies and slices
/// refer to the same variables.
///
/// ```
/// ExpressionMatrix X = problem.decision_variable(2, N + 1);
/// problem.subject_to(X.col(0) == Eigen::Vector2d(0.0, 0.0));
/// problem.subject_to(-1.0 <= X.row(1));
/// ```
///
/// Places outside of a matrix and shapes that do not fit are remembered: they give a matrix whose
/// `fault()` says what was wrong, as does everything computed of it, and `Problem` refuses it.
class ExpressionMatrix {
 public:
  using Index = Eigen::Index;

  ExpressionMatrix() = default;
  /// Zeros.
  ExpressionMatrix(Index rows, Index columns)
      : rows_(rows), columns_(columns), entries_(static_cast<std::size_t>(rows * columns)) {}
  /// 1 x 1.
  // NOLINTNEXTLINE(google-explicit-constructor): a number or an expression is a matrix of one.
  ExpressionMatrix(const Expression& entry) : rows_(1), columns_(1), entries_{entry} {}
  ExpressionMatrix(double entry) : ExpressionMatrix(Expression(entry)) {}  // NOLINT
  /// Of numbers or expressions.
  template <class Derived>
  // NOLINTNEXTLINE(google-explicit-constructor): as above.
  ExpressionMatrix(const Eigen::MatrixBase<Derived>& M) : ExpressionMatrix(M.rows(), M.cols()) {
    for (Index j = 0; j < columns_; ++j) {
      for (Index i = 0; i < rows_; ++i) {
        (*this)(i, j) = Expression(M(i, j));
      }
    }
  }

  [[nodiscard]] Index rows() const noexcept { return rows_; }
  [[nodiscard]] Index cols() const noexcept { return columns_; }
  [[nodiscard]] Index size() const noexcept { return rows_ * columns_; }
  /// What was wrong with it, or nullptr.
  [[nodiscard]] const char* fault() const noexcept { return fault_; }

  /// An entry; it must be there.
  [[nodiscard]] Expression& operator()(Index row, Index column) {
    return entries_[static_cast<std::size_t>(column * rows_ + row)];
  }
  [[nodiscard]] const Expression& operator()(Index row, Index column) const {
    return entries_[static_cast<std::size_t>(column * rows_ + row)];
  }
  /// An entry of a vector, or column by column.
  [[nodiscard]] Expression& operator()(Index i) { return entries_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] const Expression& operator()(Index i) const {
    return entries_[static_cast<std::size_t>(i)];
  }

  [[nodiscard]] ExpressionMatrix block(Index row, Index column, Index rows, Index columns) const;
  /// Row i, 1 x columns.
  [[nodiscard]] ExpressionMatrix row(Index i) const { return block(i, 0, 1, columns_); }
  /// Column j, rows x 1.
  [[nodiscard]] ExpressionMatrix col(Index j) const { return block(0, j, rows_, 1); }
  /// Entries first … first + count - 1 of a row or column.
  [[nodiscard]] ExpressionMatrix segment(Index first, Index count) const;
  [[nodiscard]] ExpressionMatrix transpose() const;
  /// The sum of all entries.
  [[nodiscard]] Expression sum() const;

  /// The values of all entries now. @see Expression::value
  [[nodiscard]] Eigen::MatrixXd value() const;
  [[nodiscard]] double value(Index row, Index column) const { return (*this)(row, column).value(); }
  [[nodiscard]] double value(Index i) const { return (*this)(i).value(); }
  /// Starts of variables, or values of parameters. A matrix of another shape is ignored.
  void set_value(const Eigen::Ref<const Eigen::MatrixXd>& values) noexcept;
  void set_value(double value) noexcept;

  friend ExpressionMatrix operator+(const ExpressionMatrix& a, const ExpressionMatrix& b);
  friend ExpressionMatrix operator-(const ExpressionMatrix& a, const ExpressionMatrix& b);
  /// The matrix product, or a scalar times a matrix.
  friend ExpressionMatrix operator*(const ExpressionMatrix& a, const ExpressionMatrix& b);
  friend ExpressionMatrix operator/(const ExpressionMatrix& a, const Expression& b);
  friend ExpressionMatrix operator-(const ExpressionMatrix& a);
  /// Entry by entry; a scalar stands for as many as the other side has.
  friend Constraints operator==(const ExpressionMatrix& a, const ExpressionMatrix& b);
  friend Constraints operator<=(const ExpressionMatrix& a, const ExpressionMatrix& b);
  friend Constraints operator>=(const ExpressionMatrix& a, const ExpressionMatrix& b);

 private:
  [[nodiscard]] static ExpressionMatrix faulty(const char* fault);
  /// Entry by entry, scalars widened.
  template <class Function>
  [[nodiscard]] static ExpressionMatrix entrywise(const ExpressionMatrix& a,
                                                  const ExpressionMatrix& b, Function f);

  Index rows_ = 0;
  Index columns_ = 0;
  std::vector<Expression> entries_{};
  const char* fault_ = nullptr;
};

}  // namespace flyball::optimization
