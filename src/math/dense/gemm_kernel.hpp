#pragma once

#include "math/dense/instruction_set.hpp"
#include "math/dense/panel_kernel.hpp"

/// Products of matrices of some ten to some hundred rows: A in packed strips, so that neither its
/// stride nor its orientation costs anything, and tiles of C in registers.
/// Source: Goto, van de Geijn, "Anatomy of high-performance matrix multiplication", ACM
/// Transactions on Mathematical Software 34 (2008).
namespace flyball::detail {

/// A(i, k) stands at A.at[i row_step + k depth_step].
struct GemmFactor {
  const double* at;
  int row_step;
  int depth_step;
};

/// What becomes of C: it is A B, or A B is added or subtracted.
enum class GemmKind { assign, add, subtract };

struct GemmTask {
  int rows;
  int columns;
  int depth;
  GemmFactor A;
  PanelFactor B;
  double* C;
  int C_step;
  GemmKind kind;
  bool lower;  ///< No more than C's lower triangle must be right, and more may be written.
};

FLYBALL_KERNEL(void gemm_panels(const GemmTask& task))
namespace widest {
void gemm_panels(const GemmTask& task);
}

/// The one for this processor.
void gemm(const GemmTask& task);

/// Whether packing pays, beside a product of whole vectors in place.
[[nodiscard]] inline bool is_worth_packing(long rows, long columns, long depth) {
#ifdef FLYBALL_WIDE_VECTORS
  const long least = has_widest_vectors() ? 24 : 160;
#else
  const long least = 160;
#endif
  return rows >= least && depth >= least && columns >= 8;
}

}  // namespace flyball::detail
