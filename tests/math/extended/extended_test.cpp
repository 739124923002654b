#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "math/extended/double_double.hpp"
#include "math/extended/exact_sum.hpp"
#include "math/extended/quad_double.hpp"
#include "math/extended/wide_matrix.hpp"

// The types against sums without rounding. The bounds are a few units in the last place that a sum
// of two (106 bits) or four doubles (212 bits) has: an error term or a product that is left out is
// 2^53 larger than they are.
namespace flyball::detail::extended_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using test::ExactSum;

/// The parts of an entry, largest first.
std::vector<double> parts(const DoubleDoubleMatrix& M, Index i, Index j) {
  return {M.hi(i, j), M.lo(i, j)};
}
std::vector<double> parts(const QuadDoubleMatrix& M, Index i, Index j) {
  return {M.part[0](i, j), M.part[1](i, j), M.part[2](i, j), M.part[3](i, j)};
}
std::vector<double> parts(const WideMatrix& M, Index i, Index j) {
  const WideNumber& x = M(i, j);
  return {std::ldexp(x.hi, static_cast<int>(x.exponent)),
          std::ldexp(x.lo, static_cast<int>(x.exponent))};
}

/// Random numbers of all their digits: each part is below half a unit in the last place of the one
/// before it.
MatrixXd below(const MatrixXd& part, Random& random) {
  return part.unaryExpr([&](double x) {
    return std::ldexp(x, -53) * (0.5 + 0.5 * random.uniform()) * (random.bits() % 2 == 0 ? 1 : -1);
  });
}
MatrixXd first(Index rows, Index columns, Random& random) {
  return MatrixXd::NullaryExpr(rows, columns, [&] {
    return std::ldexp(1.0 + random.uniform(), static_cast<int>(random.bits() % 9) - 4) *
           (random.bits() % 2 == 0 ? 1 : -1);
  });
}

template <class Matrix>
Matrix random_matrix(Index rows, Index columns, Random& random);
template <>
DoubleDoubleMatrix random_matrix(Index rows, Index columns, Random& random) {
  DoubleDoubleMatrix M(first(rows, columns, random));
  M.lo = below(M.hi, random);
  return M;
}
template <>
QuadDoubleMatrix random_matrix(Index rows, Index columns, Random& random) {
  QuadDoubleMatrix M(first(rows, columns, random));
  for (std::size_t k = 1; k < 4; ++k) {
    M.part[k] = below(M.part[k - 1], random);
  }
  return M;
}
template <>
WideMatrix random_matrix(Index rows, Index columns, Random& random) {
  const MatrixXd M = first(rows, columns, random);
  return sum(WideMatrix(M), 1.0, WideMatrix(below(M, random)));
}

template <class Matrix>
struct Extended : ::testing::Test {};
/// 2^-bound: what an operation may be wrong by, relative to the sizes of what it adds.
template <class Matrix>
constexpr int bound = 0;
template <>
constexpr int bound<DoubleDoubleMatrix> = 102;
template <>
constexpr int bound<QuadDoubleMatrix> = 205;
template <>
constexpr int bound<WideMatrix> = 102;

using Types = ::testing::Types<DoubleDoubleMatrix, QuadDoubleMatrix, WideMatrix>;
TYPED_TEST_SUITE(Extended, Types);

/// c0 + sign Σ a b - c, exactly, over |c0| + Σ |a b|.
template <class Matrix>
double error_of(const Matrix& C, const Matrix& C0, double sign, const Matrix& A, const Matrix& B,
                Index i, Index j) {
  ExactSum rest;
  double size = 0.0;
  for (const double c : parts(C, i, j)) {
    rest.add(-c);
  }
  for (const double c : parts(C0, i, j)) {
    rest.add(c);
    size += std::abs(c);
  }
  for (Index k = 0; k < B.rows(); ++k) {
    for (const double a : parts(A, i, k)) {
      for (const double b : parts(B, k, j)) {
        rest.add_product(sign * a, b);
        size += std::abs(a * b);
      }
    }
  }
  return std::abs(rest.value()) / size;
}

/// The parts of a result fall by all the digits of a double each, up to a bit.
template <class Matrix>
void expect_normal(const Matrix& M) {
  for (Index j = 0; j < M.cols(); ++j) {
    for (Index i = 0; i < M.rows(); ++i) {
      const std::vector<double> p = parts(M, i, j);
      for (std::size_t k = 1; k < p.size(); ++k) {
        ASSERT_LE(std::abs(p[k]), std::ldexp(std::abs(p[k - 1]), -52)) << k;
      }
    }
  }
}

TYPED_TEST(Extended, SumsOfProducts) {
  Random random(1);
  const double most = std::ldexp(1.0, -bound<TypeParam>);
  for (int run = 0; run < 200; ++run) {
    const Index n = 1 + static_cast<Index>(random.bits() % 7);
    const Index m = 1 + static_cast<Index>(random.bits() % 7);
    const Index p = 1 + static_cast<Index>(random.bits() % 7);
    const auto A = random_matrix<TypeParam>(n, m, random);
    const auto B = random_matrix<TypeParam>(m, p, random);
    const auto C0 = random_matrix<TypeParam>(n, p, random);
    const auto zero = TypeParam::zero(n, p);
    const TypeParam C = add_product(C0, -1.0, A, B);
    const TypeParam AB = product(A, B);
    expect_normal(AB);
    const double steps = static_cast<double>(m);
    for (Index j = 0; j < p; ++j) {
      for (Index i = 0; i < n; ++i) {
        ASSERT_LE(error_of(C, C0, -1.0, A, B, i, j), steps * most);
        ASSERT_LE(error_of(AB, zero, 1.0, A, B, i, j), steps * most);
      }
    }
  }
}

// Products that cancel to their last digit leave what the parts behind them hold.
TYPED_TEST(Extended, Cancellation) {
  Random random(2);
  for (int run = 0; run < 200; ++run) {
    const auto a = random_matrix<TypeParam>(1, 1, random);
    const auto b = random_matrix<TypeParam>(1, 1, random);
    const TypeParam ab = product(a, b);
    const TypeParam left = add_product(ab, -1.0, b, a);
    ASSERT_LE(left.norm(), std::ldexp(ab.norm(), -bound<TypeParam>));
    // (a + b) - b = a, and a + (-a) = 0.
    const TypeParam back = sum(sum(a, 1.0, b), -1.0, b);
    ASSERT_LE(sum(back, -1.0, a).norm(), std::ldexp(a.norm() + b.norm(), -bound<TypeParam>));
    ASSERT_EQ(sum(a, -1.0, a).norm(), 0.0);
  }
}

TYPED_TEST(Extended, SumsAndShapes) {
  Random random(3);
  const double most = std::ldexp(1.0, -bound<TypeParam>);
  const auto one = TypeParam::identity(1);
  for (int run = 0; run < 100; ++run) {
    const auto A = random_matrix<TypeParam>(3, 3, random);
    const auto B = random_matrix<TypeParam>(3, 3, random);
    const TypeParam difference = sum(A, -1.0, B);
    const TypeParam shifted = shifted_diagonal(A, 0.3);
    const TypeParam symmetric = symmetrized(A);
    const TypeParam both = beside(A, B);
    const TypeParam doubled = scaled(A, 4.0);
    expect_normal(difference);
    for (Index j = 0; j < 3; ++j) {
      for (Index i = 0; i < 3; ++i) {
        const auto check = [&](const TypeParam& result, const std::vector<double>& a, double f,
                               const std::vector<double>& b, double g) {
          ExactSum rest;
          double size = 0.0;
          for (const double part : parts(result, i, j)) {
            rest.add(-part);
          }
          for (const double part : a) {
            rest.add(f * part);
            size += std::abs(f * part);
          }
          for (const double part : b) {
            rest.add(g * part);
            size += std::abs(g * part);
          }
          EXPECT_LE(std::abs(rest.value()), most * size);
        };
        check(difference, parts(A, i, j), 1.0, parts(B, i, j), -1.0);
        check(shifted, parts(A, i, j), 1.0, {i == j ? 0.3 : 0.0}, 1.0);
        check(symmetric, parts(A, i, j), 0.5, parts(A, j, i), 0.5);
        check(doubled, parts(A, i, j), 4.0, {}, 1.0);
        EXPECT_EQ(parts(both, i, j), parts(A, i, j));
        EXPECT_EQ(parts(both, i, j + 3), parts(B, i, j));
        EXPECT_EQ(parts(both.left(3), i, j), parts(A, i, j));
        EXPECT_EQ(parts(both.right(3), i, j), parts(B, i, j));
        EXPECT_EQ(parts(A.transpose(), i, j), parts(A, j, i));
        ExactSum rounded;
        for (const double part : parts(A, i, j)) {
          rounded.add(part);
        }
        EXPECT_DOUBLE_EQ(A.rounded()(i, j), rounded.value());
      }
    }
  }
  EXPECT_TRUE(one.all_finite());
  TypeParam broken = scaled(one, std::nan(""));
  EXPECT_FALSE(broken.all_finite());
}

// The residual of every equation, without rounding, is of the size of the last digits; rows of
// different units and pivots that are not on the diagonal included.
TYPED_TEST(Extended, Solves) {
  Random random(4);
  for (int run = 0; run < 100; ++run) {
    const Index n = 1 + static_cast<Index>(random.bits() % 6);
    auto A = random_matrix<TypeParam>(n, n, random);
    const auto B = random_matrix<TypeParam>(n, 2, random);
    // One zero on the diagonal needs a pivot.
    if (n > 1) {
      A = add_product(A, -1.0, A.left(1), TypeParam(MatrixXd::Identity(1, n)));
      A = sum(A, 1.0, TypeParam(MatrixXd::Identity(n, n).rowwise().reverse()));
    }
    const auto X = solve(A, B);
    ASSERT_TRUE(X);
    for (Index j = 0; j < 2; ++j) {
      for (Index i = 0; i < n; ++i) {
        const double growth = 16.0 * static_cast<double>(n);
        ASSERT_LE(error_of(B, TypeParam::zero(n, 2), 1.0, A, *X, i, j),
                  growth * std::ldexp(1.0, -bound<TypeParam>))
            << "n = " << n << ", run " << run;
      }
    }
  }
  EXPECT_FALSE(solve(TypeParam::zero(2, 2), TypeParam::identity(2)));
  EXPECT_FALSE(solve(TypeParam(MatrixXd::Ones(2, 2)), TypeParam::identity(2)));
  EXPECT_FALSE(solve(TypeParam(MatrixXd::Constant(1, 1, std::nan(""))), TypeParam::identity(1)));
}

// Four thirds and its like: 1/3 to all digits, so that 3 (1/3) - 1 is below the last one.
TYPED_TEST(Extended, Reciprocals) {
  for (const double d : {3.0, 7.0, 1e10 + 1.0, 0.1}) {
    const auto D = TypeParam(MatrixXd::Constant(1, 1, d));
    const auto X = solve(D, TypeParam::identity(1)).value();
    EXPECT_LE(error_of(TypeParam::identity(1), TypeParam::zero(1, 1), 1.0, D, X, 0, 0),
              std::ldexp(1.0, -bound<TypeParam>));
    expect_normal(X);
  }
}

// (2^900)³ (2^-1000)³ = 2^-300 by way of numbers that are no doubles, sums beside them included.
// A chain in units 2^1500 apart, back and forth, has its product left; what hangs on nothing goes.
TEST(WideMatrix, BalancesWhatNoDoubleHolds) {
  MatrixXd M = MatrixXd::Zero(3, 3);
  M(0, 0) = 0.25;
  M(0, 1) = 2.0;
  M(1, 0) = -0.5;
  M(2, 0) = 3.0;
  const Eigen::Vector3i d(-750, 750, 4000);
  const MatrixXd level = balanced(WideMatrix(M).times_powers(d, -d, 0)).rounded();
  EXPECT_EQ(level(0, 0), 0.25);
  EXPECT_EQ(level(0, 1) * level(1, 0), -1.0);
  EXPECT_LE(std::abs(level(0, 1)), 2.0);
  EXPECT_LE(std::abs(level(1, 0)), 2.0);
  EXPECT_TRUE((level.row(2).array() == 0.0).all());
}

TEST(WideMatrix, KeepsEveryExponent) {
  const WideMatrix large(MatrixXd::Constant(1, 1, 0x1p900));
  const WideMatrix small(MatrixXd::Constant(1, 1, 0x1p-1000));
  const WideMatrix cube = product(large, product(large, large));
  EXPECT_EQ(cube.exponent(), 2700);
  EXPECT_EQ(cube.norm(), std::numeric_limits<double>::infinity());
  const WideMatrix back = product(product(cube, small), product(small, small));
  EXPECT_EQ(back.rounded()(0, 0), 0x1p-300);
  EXPECT_EQ(back.rounded(300)(0, 0), 1.0);
  const WideMatrix nothing = product(small, product(small, small));
  EXPECT_EQ(nothing.norm(), 0.0);
  EXPECT_EQ(sum(sum(nothing, 1.0, cube), -1.0, cube).exponent(), WideMatrix::zero(1, 1).exponent());
  EXPECT_EQ(share_of(nothing, cube), 0.0);
  EXPECT_EQ(share_of(product(small, cube), product(cube, small)), 1.0);
  EXPECT_EQ(share_of(scaled(nothing, -3.0), nothing), 3.0);
  EXPECT_TRUE(std::isnan(share_of(scaled(cube, std::nan("")), cube)));
  const Eigen::VectorXi row = Eigen::VectorXi::Constant(1, -2000);
  EXPECT_EQ(cube.times_powers(row, row, 1300).rounded()(0, 0), 1.0);
  EXPECT_EQ(scaled(large, -1.0).magnitudes().rounded()(0, 0), 0x1p900);
  const WideMatrix subnormal(MatrixXd::Constant(1, 1, 5e-324));
  EXPECT_EQ(subnormal.exponent(), -1074);
  EXPECT_EQ(subnormal.rounded()(0, 0), 5e-324);
}

}  // namespace
}  // namespace flyball::detail::extended_test
