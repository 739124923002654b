#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "math/extended/extended_eigenvalues.hpp"

namespace flyball::extended_eigenvalues_test {
namespace {

using Complex = std::complex<double>;
using detail::DoubleDoubleMatrix;
using Eigen::Index;
using Eigen::MatrixXd;

Eigen::VectorXd sorted_real(const Eigen::VectorXcd& values) {
  Eigen::VectorXd real = values.real();
  std::sort(real.begin(), real.end());
  return real;
}

// The companion matrix of ∏(s - k), k = 1 … 15, whose coefficients doubles hold exactly: in doubles
// its eigenvalues are good to 1e-3.
TEST(ExtendedEigenvalues, OfWilkinsonsPolynomial) {
  constexpr Index n = 15;
  Eigen::VectorXd polynomial = Eigen::VectorXd::Zero(n + 1);
  polynomial(0) = 1.0;
  for (Index k = 1; k <= n; ++k) {
    for (Index i = k; i > 0; --i) {
      polynomial(i) -= static_cast<double>(k) * polynomial(i - 1);
    }
  }
  MatrixXd A = MatrixXd::Zero(n, n);
  A.diagonal(1).setOnes();
  A.row(n - 1) = -polynomial.tail(n).reverse().transpose();
  const auto values = detail::extended_eigenvalues_of(DoubleDoubleMatrix(A)).value();
  EXPECT_EQ(values.imag().cwiseAbs().maxCoeff(), 0.0);
  const Eigen::VectorXd found = sorted_real(values);
  for (Index k = 0; k < n; ++k) {
    EXPECT_NEAR(found(k), static_cast<double>(k + 1), 1e-11);
  }
}

// [α β; -β α] blocks and a chain of length two, turned by unit triangles of whole numbers, which
// rounds nothing: the low parts count, pairs are conjugates to the last bit.
TEST(ExtendedEigenvalues, PairsAndLowParts) {
  MatrixXd T = MatrixXd::Zero(6, 6);
  T.topLeftCorner(2, 2) << 1.0, 3.0, -3.0, 1.0;
  T.block(2, 2, 2, 2) << -2.0, 0.5, -0.5, -2.0;
  T.bottomRightCorner(2, 2) << 4.0, 1.0, 0.0, 4.0;
  Random random(5);
  const auto whole = [&] { return std::round(random.uniform(-3.0, 3.0)); };
  MatrixXd L = MatrixXd::NullaryExpr(6, 6, whole);
  L.triangularView<Eigen::StrictlyUpper>().setZero();
  L.diagonal().setOnes();
  MatrixXd inverse = MatrixXd::Identity(6, 6);
  L.triangularView<Eigen::UnitLower>().solveInPlace(inverse);
  DoubleDoubleMatrix M(L * T * inverse);
  const auto exact = detail::extended_eigenvalues_of(M).value();
  const auto nearest = [](const Eigen::VectorXcd& values, Complex to) {
    return (values.array() - to).abs().minCoeff();
  };
  EXPECT_LT(nearest(exact, Complex(1.0, 3.0)), 1e-15);
  EXPECT_LT(nearest(exact, Complex(-2.0, -0.5)), 1e-15);
  // The double eigenvalue is known to the root of 1e-31, where doubles know it to 1e-8.
  EXPECT_LT(nearest(exact, Complex(4.0)), 1e-13);
  for (Index k = 0; k < 6; ++k) {
    EXPECT_EQ(nearest(exact, std::conj(exact(k))), 0.0);
  }
  // Plus 1e-20 I, which only the low parts hold: the double eigenvalue splits by nothing of it.
  M.lo.diagonal().setConstant(1e-20);
  MatrixXd tiny{{1.0, 1.0}, {0.0, 1.0}};
  DoubleDoubleMatrix chain(tiny);
  chain.lo(1, 0) = 1e-20;
  const auto split = detail::extended_eigenvalues_of(chain).value();
  EXPECT_NEAR(std::abs(split(0) - split(1)), 2e-10, 1e-15);
  EXPECT_LT(nearest(detail::extended_eigenvalues_of(M).value(), Complex(1.0, 3.0)), 1e-15);
}

TEST(ExtendedEigenvalues, Edges) {
  EXPECT_EQ(detail::extended_eigenvalues_of(DoubleDoubleMatrix(MatrixXd(0, 0)))->size(), 0);
  EXPECT_EQ(detail::extended_eigenvalues_of(DoubleDoubleMatrix(MatrixXd::Zero(3, 3))).value(),
            Eigen::VectorXcd::Zero(3));
  EXPECT_FALSE(detail::extended_eigenvalues_of(
      DoubleDoubleMatrix(MatrixXd::Constant(2, 2, std::numeric_limits<double>::infinity()))));
  // Cyclic: a step without an exceptional shift changes nothing.
  const MatrixXd cycle{{0.0, 0.0, 1.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}};
  const auto roots = detail::extended_eigenvalues_of(DoubleDoubleMatrix(cycle)).value();
  for (const Complex& root : roots) {
    EXPECT_NEAR(std::abs(root * root * root - 1.0), 0.0, 1e-15);
  }
}

}  // namespace
}  // namespace flyball::extended_eigenvalues_test
