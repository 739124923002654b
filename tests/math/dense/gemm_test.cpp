#include <functional>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "math/dense/gemm_kernel.hpp"
#include "math/extended/double_double.hpp"
#include "math/extended/twice_product.hpp"

namespace flyball::detail::gemm_test {
namespace {

using Eigen::MatrixXd;

MatrixXd normal(Random& random, int rows, int columns) {
  return MatrixXd::NullaryExpr(rows, columns, [&random] { return random.normal(); });
}

/// The kernels that this processor can run.
std::vector<std::function<void(const GemmTask&)>> variants() {
  std::vector<std::function<void(const GemmTask&)>> all{baseline::gemm_panels};
#ifdef FLYBALL_WIDE_VECTORS
  if (has_wide_vectors()) {
    all.emplace_back(wide::gemm_panels);
  }
  if (has_widest_vectors()) {
    all.emplace_back(widest::gemm_panels);
  }
#endif
  return all;
}

// Every remainder beside whole strips and tiles, both orientations of both factors, more depth than
// is packed at a time; what lies beside C stays.
TEST(Gemm, IsTheProduct) {
  Random random(1);
  for (int trial = 0; trial < 60; ++trial) {
    const int rows = 1 + (7 * trial) % 53;
    const int columns = 1 + (5 * trial) % 23;
    const int depth = trial % 10 == 0 ? 400 + trial : 1 + (11 * trial) % 37;
    const bool A_turned = trial % 2 == 1;
    const bool B_turned = trial % 3 == 1;
    const MatrixXd A = A_turned ? normal(random, depth, rows) : normal(random, rows, depth);
    const MatrixXd B = B_turned ? normal(random, columns, depth) : normal(random, depth, columns);
    const MatrixXd AB =
        (A_turned ? MatrixXd(A.transpose()) : A) * (B_turned ? MatrixXd(B.transpose()) : B);
    const MatrixXd before = normal(random, rows + 3, columns + 2);
    for (const auto& kernel : variants()) {
      for (const GemmKind kind : {GemmKind::assign, GemmKind::add, GemmKind::subtract}) {
        MatrixXd around = before;
        kernel({rows,
                columns,
                depth,
                {A.data(), A_turned ? depth : 1, A_turned ? 1 : rows},
                {B.data(), B_turned ? columns : 1, B_turned ? 1 : depth},
                &around(1, 1),
                rows + 3,
                kind,
                false});
        MatrixXd expected = before;
        auto C = expected.block(1, 1, rows, columns);
        C = kind == GemmKind::assign ? AB
            : kind == GemmKind::add  ? MatrixXd(C + AB)
                                     : MatrixXd(C - AB);
        EXPECT_LT((around - expected).norm(), 1e-13 * (1.0 + AB.norm())) << trial;
        around.block(1, 1, rows, columns) = C;
        EXPECT_EQ(around, expected) << trial;
      }
    }
  }
}

TEST(Gemm, LowerTriangle) {
  Random random(2);
  for (const int n : {5, 24, 61}) {
    const MatrixXd A = normal(random, n, n);
    for (const auto& kernel : variants()) {
      MatrixXd C = MatrixXd::Zero(n, n);
      kernel({n, n, n, {A.data(), 1, n}, {A.data(), n, 1}, C.data(), n, GemmKind::add, true});
      const MatrixXd lower = (C - A * A.transpose()).triangularView<Eigen::Lower>();
      EXPECT_LT(lower.norm(), 1e-13 * C.norm()) << n;
    }
  }
}

// Beside sums of two doubles term by term: to 30 digits of the sizes of a row and a column, of
// terms that cancel to their last digits.
TEST(TwiceProduct, IsTheProduct) {
  Random random(3);
  for (int trial = 0; trial < 40; ++trial) {
    const int rows = 1 + (7 * trial) % 41;
    const int columns = 1 + (5 * trial) % 19;
    const int depth = trial % 10 == 0 ? 300 + trial : 1 + (11 * trial) % 37;
    const double sign = trial % 2 == 0 ? 1.0 : -1.0;
    MatrixXd A = normal(random, rows, depth);
    A.row(trial % rows) *= 1e10;
    A.col(trial % depth).setZero();
    DoubleDoubleMatrix B(normal(random, depth, columns));
    if (trial % 3 == 0) {
      B.lo = 1e-17 * normal(random, depth, columns);
    }
    const DoubleDoubleMatrix C(-sign * A * B.hi);
    const DoubleDoubleMatrix expected = add_product(C, sign, DoubleDoubleMatrix(A), B);
    for (const bool lower : {false, true}) {
      DoubleDoubleMatrix found = C;
      add_product_twice({rows,
                         columns,
                         depth,
                         sign,
                         {A.data(), 1, rows},
                         {B.hi.data(), 1, depth},
                         trial % 3 == 0 ? B.lo.data() : nullptr,
                         found.hi.data(),
                         found.lo.data(),
                         rows,
                         lower});
      const MatrixXd apart = sum(found, -1.0, expected).rounded();
      for (int j = 0; j < columns; ++j) {
        for (int i = lower ? j : 0; i < rows; ++i) {
          EXPECT_LE(std::abs(apart(i, j)), 1e-30 * depth * A.row(i).norm() * B.hi.col(j).norm())
              << trial << ": " << i << ", " << j;
        }
      }
    }
  }
}

TEST(TwiceProduct, OfTransposedFactors) {
  Random random(4);
  const int n = 19;
  const MatrixXd A = normal(random, n, n);
  const MatrixXd B = normal(random, n, n);
  DoubleDoubleMatrix found = DoubleDoubleMatrix::zero(n, n);
  add_product_twice({n,
                     n,
                     n,
                     1.0,
                     {A.data(), n, 1},
                     {B.data(), n, 1},
                     nullptr,
                     found.hi.data(),
                     found.lo.data(),
                     n,
                     false});
  const DoubleDoubleMatrix expected =
      product(DoubleDoubleMatrix(A.transpose()), DoubleDoubleMatrix(B.transpose()));
  EXPECT_LT(sum(found, -1.0, expected).norm(), 1e-28 * expected.norm());
}

}  // namespace
}  // namespace flyball::detail::gemm_test
