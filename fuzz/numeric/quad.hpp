#pragma once

#include <vector>

#include <nlohmann/json.hpp>

namespace flyball::fuzz {

/// 113 bits of mantissa and 15 of exponent: more than twice a double's precision, and no product
/// of a few doubles leaves its range.
__extension__ using Quad = __float128;

[[nodiscard]] inline Quad size_of(Quad x) {
  return x < 0 ? -x : x;
}

/// A small dense matrix, by rows.
class QuadMatrix {
 public:
  QuadMatrix(int rows, int columns)
      : rows_(rows), columns_(columns), entries_(static_cast<std::size_t>(rows * columns)) {}
  [[nodiscard]] static QuadMatrix identity(int n);

  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] int columns() const { return columns_; }
  Quad& operator()(int i, int j) { return entries_[static_cast<std::size_t>(i * columns_ + j)]; }
  Quad operator()(int i, int j) const {
    return entries_[static_cast<std::size_t>(i * columns_ + j)];
  }
  [[nodiscard]] std::vector<Quad>& entries() { return entries_; }
  [[nodiscard]] const std::vector<Quad>& entries() const { return entries_; }
  /// The largest magnitude.
  [[nodiscard]] Quad largest() const;

 private:
  int rows_;
  int columns_;
  std::vector<Quad> entries_;
};

[[nodiscard]] QuadMatrix operator*(const QuadMatrix& a, const QuadMatrix& b);
[[nodiscard]] QuadMatrix operator+(QuadMatrix a, const QuadMatrix& b);
[[nodiscard]] QuadMatrix operator-(QuadMatrix a, const QuadMatrix& b);
[[nodiscard]] QuadMatrix operator*(Quad a, QuadMatrix b);
[[nodiscard]] QuadMatrix transpose(const QuadMatrix& a);
[[nodiscard]] QuadMatrix magnitudes(QuadMatrix a);
/// The block of `rows` x `columns` at the top left, and one put there.
[[nodiscard]] QuadMatrix block(const QuadMatrix& a, int row, int column, int rows, int columns);
void put(QuadMatrix& into, int row, int column, const QuadMatrix& block);

/// e^a by scaling, Taylor and squaring.
[[nodiscard]] QuadMatrix exponential(const QuadMatrix& a);

/// An upper estimate of the smallest singular value, by inverse iteration.
[[nodiscard]] Quad smallest_singular_value(QuadMatrix a);

/// A number or a list of rows, as problems and answers write them.
[[nodiscard]] QuadMatrix quad_matrix(const nlohmann::json& value);

/// The value of an expression beside the sum of the magnitudes of its terms: what is left of an
/// equation, and what it is left of.
struct Balance {
  QuadMatrix value;
  QuadMatrix terms;

  /// A given matrix.
  explicit Balance(const QuadMatrix& given) : value(given), terms(magnitudes(given)) {}
  Balance(QuadMatrix v, QuadMatrix t) : value(std::move(v)), terms(std::move(t)) {}
  /// What is left, relative to the largest term.
  [[nodiscard]] double defect() const;
};

/// An answered matrix: it was rounded to doubles, of which the smallest are not dense.
[[nodiscard]] Balance answered(const QuadMatrix& given);

[[nodiscard]] Balance operator*(const Balance& a, const Balance& b);
[[nodiscard]] Balance operator+(const Balance& a, const Balance& b);
[[nodiscard]] Balance operator-(const Balance& a, const Balance& b);
[[nodiscard]] Balance transpose(const Balance& a);

}  // namespace flyball::fuzz
