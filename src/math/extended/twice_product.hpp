#pragma once

#include "math/dense/gemm_kernel.hpp"

/// Products of matrices of doubles, summed in twice the working precision.
namespace flyball::detail {

/// hi + lo += sign A (B + b), entry by entry a sum of two doubles. Of entries whose terms are far
/// smaller than ‖row of A‖ ‖column of B‖ digits beyond 2⁻¹⁰⁰ of that are lost.
struct TwiceTask {
  int rows;
  int columns;
  int depth;
  double sign;
  GemmFactor A;
  PanelFactor B;
  const double* B_low;  ///< b, which lies as B does; null where there is none.
  double* hi;
  double* lo;
  int step;    ///< Of hi's and lo's columns.
  bool lower;  ///< No more than the lower triangle must be right, and more may be written.
};
void add_product_twice(const TwiceTask& task);

/// From here on it is faster than a sum of two doubles term by term.
inline constexpr bool is_worth_twice(int rows, int columns, int depth) {
  return rows >= 8 && columns >= 4 && depth >= 8;
}

}  // namespace flyball::detail
