#include <flyball/optimization/problem/expression_matrix.hpp>

#include <limits>

namespace flyball::optimization {

using Eigen::Index;

namespace {

constexpr const char* outside = "a slice reaches beyond its matrix";
constexpr const char* unequal = "the shapes of two matrices do not fit";

/// What a problem refuses: its value is not a number.
Constraints refused() {
  return {{Expression(std::numeric_limits<double>::quiet_NaN()), true}};
}

}  // namespace

ExpressionMatrix ExpressionMatrix::faulty(const char* fault) {
  ExpressionMatrix result(1, 1);
  result(0) = std::numeric_limits<double>::quiet_NaN();
  result.fault_ = fault;
  return result;
}

template <class Function>
ExpressionMatrix ExpressionMatrix::entrywise(const ExpressionMatrix& a, const ExpressionMatrix& b,
                                             Function f) {
  if (a.fault_ != nullptr || b.fault_ != nullptr) {
    return faulty(a.fault_ != nullptr ? a.fault_ : b.fault_);
  }
  const bool wide_a = a.size() == 1 && b.size() != 1;
  const bool wide_b = b.size() == 1 && a.size() != 1;
  if (!wide_a && !wide_b && (a.rows_ != b.rows_ || a.columns_ != b.columns_)) {
    return faulty(unequal);
  }
  ExpressionMatrix result(wide_a ? b.rows_ : a.rows_, wide_a ? b.columns_ : a.columns_);
  for (Index i = 0; i < result.size(); ++i) {
    result(i) = f(a(wide_a ? 0 : i), b(wide_b ? 0 : i));
  }
  return result;
}

ExpressionMatrix ExpressionMatrix::block(Index row, Index column, Index rows, Index columns) const {
  if (fault_ != nullptr) {
    return *this;
  }
  if (row < 0 || column < 0 || rows < 0 || columns < 0 || row + rows > rows_ ||
      column + columns > columns_) {
    return faulty(outside);
  }
  ExpressionMatrix result(rows, columns);
  for (Index j = 0; j < columns; ++j) {
    for (Index i = 0; i < rows; ++i) {
      result(i, j) = (*this)(row + i, column + j);
    }
  }
  return result;
}

ExpressionMatrix ExpressionMatrix::segment(Index first, Index count) const {
  return columns_ == 1 ? block(first, 0, count, 1) : block(0, first, rows_ == 1 ? 1 : -1, count);
}

ExpressionMatrix ExpressionMatrix::transpose() const {
  ExpressionMatrix result(columns_, rows_);
  for (Index j = 0; j < columns_; ++j) {
    for (Index i = 0; i < rows_; ++i) {
      result(j, i) = (*this)(i, j);
    }
  }
  result.fault_ = fault_;
  return result;
}

Expression ExpressionMatrix::sum() const {
  Expression total = 0.0;
  for (const Expression& entry : entries_) {
    total += entry;
  }
  return total;
}

Eigen::MatrixXd ExpressionMatrix::value() const {
  Eigen::MatrixXd values(rows_, columns_);
  for (Index j = 0; j < columns_; ++j) {
    for (Index i = 0; i < rows_; ++i) {
      values(i, j) = (*this)(i, j).value();
    }
  }
  return values;
}

void ExpressionMatrix::set_value(const Eigen::Ref<const Eigen::MatrixXd>& values) noexcept {
  if (values.rows() == rows_ && values.cols() == columns_) {
    for (Index j = 0; j < columns_; ++j) {
      for (Index i = 0; i < rows_; ++i) {
        (*this)(i, j).set_value(values(i, j));
      }
    }
  }
}

void ExpressionMatrix::set_value(double value) noexcept {
  for (Expression& entry : entries_) {
    entry.set_value(value);
  }
}

ExpressionMatrix operator+(const ExpressionMatrix& a, const ExpressionMatrix& b) {
  return ExpressionMatrix::entrywise(
      a, b, [](const Expression& x, const Expression& y) { return x + y; });
}
ExpressionMatrix operator-(const ExpressionMatrix& a, const ExpressionMatrix& b) {
  return ExpressionMatrix::entrywise(
      a, b, [](const Expression& x, const Expression& y) { return x - y; });
}

ExpressionMatrix operator*(const ExpressionMatrix& a, const ExpressionMatrix& b) {
  if (a.size() == 1 || b.size() == 1) {
    return ExpressionMatrix::entrywise(
        a, b, [](const Expression& x, const Expression& y) { return x * y; });
  }
  if (a.fault_ != nullptr || b.fault_ != nullptr || a.columns_ != b.rows_) {
    return ExpressionMatrix::faulty(a.fault_ != nullptr   ? a.fault_
                                    : b.fault_ != nullptr ? b.fault_
                                                          : unequal);
  }
  ExpressionMatrix result(a.rows_, b.columns_);
  for (Index i = 0; i < a.rows_; ++i) {
    for (Index j = 0; j < b.columns_; ++j) {
      for (Index k = 0; k < a.columns_; ++k) {
        result(i, j) += a(i, k) * b(k, j);
      }
    }
  }
  return result;
}

ExpressionMatrix operator/(const ExpressionMatrix& a, const Expression& b) {
  return ExpressionMatrix::entrywise(
      a, b, [](const Expression& x, const Expression& y) { return x / y; });
}
ExpressionMatrix operator-(const ExpressionMatrix& a) {
  return Expression(0.0) - a;
}

namespace {

Constraints compare(const ExpressionMatrix& difference, bool equality) {
  if (difference.fault() != nullptr) {
    return refused();
  }
  Constraints constraints;
  constraints.reserve(static_cast<std::size_t>(difference.size()));
  for (Index i = 0; i < difference.size(); ++i) {
    constraints.push_back({difference(i), equality});
  }
  return constraints;
}

}  // namespace

Constraints operator==(const ExpressionMatrix& a, const ExpressionMatrix& b) {
  return compare(a - b, true);
}
Constraints operator<=(const ExpressionMatrix& a, const ExpressionMatrix& b) {
  return compare(b - a, false);
}
Constraints operator>=(const ExpressionMatrix& a, const ExpressionMatrix& b) {
  return compare(a - b, false);
}

}  // namespace flyball::optimization
