#include <flyball/math/exponential/matrix_exponential.hpp>

#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <flyball/core/random.hpp>

#include "math/matrices_json.hpp"
#include "support/laws.hpp"
#include "support/oracle.hpp"

namespace flyball::matrix_exponential_test {
namespace {

using Eigen::MatrixXd;

MatrixXd random_matrix(Random& random, Eigen::Index n) {
  MatrixXd M(n, n);
  for (double& entry : M.reshaped()) {
    entry = random.normal();
  }
  return M;
}

double relative_error(const MatrixXd& got, const MatrixXd& wanted) {
  return (got - wanted).norm() / wanted.norm();
}

// exp of a nilpotent matrix is its series: I + A + A²/2.
TEST(MatrixExponential, NilpotentIsItsSeries) {
  MatrixXd A(3, 3);
  A << 0, 2, 5, 0, 0, 3, 0, 0, 0;
  MatrixXd wanted(3, 3);
  wanted << 1, 2, 5 + 0.5 * 2 * 3, 0, 1, 3, 0, 0, 1;
  EXPECT_LT(relative_error(expm(A).value(), wanted), 1e-15);
  EXPECT_LT(relative_error(expm(A.transpose()).value(), wanted.transpose()), 1e-15);
}

// [[-1, 1], [0, -2000]]: exp = [[e⁻¹, (e⁻¹ - e⁻²⁰⁰⁰)/1999], [0, e⁻²⁰⁰⁰]]. SciPy 1.10 answers NaN.
TEST(MatrixExponential, StiffTwoByTwo) {
  MatrixXd A(2, 2);
  A << -1, 1, 0, -2000;
  const MatrixXd E = expm(A).value();
  EXPECT_DOUBLE_EQ(E(0, 0), std::exp(-1.0));
  EXPECT_DOUBLE_EQ(E(0, 1), std::exp(-1.0) / 1999.0);
  EXPECT_EQ(E(1, 0), 0.0);
  EXPECT_EQ(E(1, 1), 0.0);
}

// Full stiff 2x2 V diag(-1, -2000) V⁻¹ with V = [[1, 1], [1, 2]]: V⁻¹ = [[2, -1], [-1, 1]].
TEST(MatrixExponential, StiffFullTwoByTwo) {
  MatrixXd A(2, 2);
  A << -2.0 + 2000.0, 1.0 - 2000.0, -2.0 + 4000.0, 1.0 - 4000.0;
  MatrixXd wanted(2, 2);
  wanted << 2, -1, 2, -1;
  wanted *= std::exp(-1.0);
  EXPECT_LT(relative_error(expm(A).value(), wanted), 1e-12);
}

// A rotation generator gives the rotation: exp([[0, -θ], [θ, 0]]).
TEST(MatrixExponential, SkewIsRotation) {
  for (const double theta : {1e-9, 0.3, 3.0, 1e3}) {
    MatrixXd A(2, 2);
    A << 0, -theta, theta, 0;
    MatrixXd wanted(2, 2);
    wanted << std::cos(theta), -std::sin(theta), std::sin(theta), std::cos(theta);
    EXPECT_LT(relative_error(expm(A).value(), wanted), 1e-15) << theta;
  }
}

// Golden numbers; see "about" in the file.
TEST(MatrixExponential, GoldenCases) {
  for (const auto& c : test::cases_of("expm.json")) {
    const MatrixXd wanted = test::matrix_from(c.at("expA"));
    const auto got = expm(test::matrix_from(c.at("A")));
    ASSERT_TRUE(got.has_value()) << c.at("name");
    const double limit = std::max(10.0 * c.at("peer_error").get<double>(), 1e-13);
    EXPECT_LE((*got - wanted).norm(), limit * wanted.norm())
        << c.at("name") << " error " << relative_error(*got, wanted);
  }
}

// exp(A) exp(-A) = I, exp(2A) = exp(A)², det exp(A) = e^(tr A), exp(Aᵀ) = exp(A)ᵀ.
TEST(MatrixExponential, Laws) {
  Random random(7);
  for (int k = 0; k < 500; ++k) {
    const auto n = static_cast<Eigen::Index>(1 + random.bits() % 8);
    const MatrixXd A = random_matrix(random, n) * std::pow(10.0, random.uniform(-6, 0.3));
    const MatrixXd E = expm(A).value();
    const MatrixXd inverse = expm(-A).value();
    const double scale = E.norm() * inverse.norm();
    EXPECT_LT((E * inverse - MatrixXd::Identity(n, n)).norm(), 1e-14 * scale);
    EXPECT_LT((expm(2.0 * A).value() - E * E).norm(), 3e-14 * scale * E.norm());
    EXPECT_NEAR(std::log(test::determinant(E)), A.trace(), 1e-12 * scale);
    EXPECT_LT((expm(A.transpose()).value() - E.transpose()).norm(), 1e-14 * scale * E.norm());
  }
}

// exp(D⁻¹ A D) = D⁻¹ exp(A) D entry by entry, for a bad scaling D that balancing has to undo.
TEST(MatrixExponential, BadScalingIsUndone) {
  Random random(11);
  for (int k = 0; k < 100; ++k) {
    const Eigen::Index n = 5;
    const MatrixXd A = random_matrix(random, n);
    Eigen::VectorXd d(n);
    for (double& entry : d) {
      entry = std::ldexp(1.0, static_cast<int>(random.bits() % 60) - 30);
    }
    const MatrixXd scaled = d.cwiseInverse().asDiagonal() * A * d.asDiagonal();
    const MatrixXd back = d.asDiagonal() * expm(scaled).value() * d.cwiseInverse().asDiagonal();
    EXPECT_LT(relative_error(back, expm(A).value()), 1e-13);
  }
}

// Sizes whose quotient is eliminated by panels, whole and not, rows swapped, against the series in
// 64 bits.
TEST(MatrixExponential, ManyStates) {
  Random random(7);
  for (const int n : {23, 24, 31, 50}) {
    for (const double norm : {0.01, 5.0, 60.0}) {
      MatrixXd A = MatrixXd::NullaryExpr(n, n, [&random] { return random.normal(); });
      A *= norm / A.norm();
      const test::LongMatrix expected = test::exponential(test::wide(A));
      const auto E = expm(A);
      ASSERT_TRUE(E) << n << ' ' << norm;
      EXPECT_LE((test::wide(*E) - expected).norm(), 1e-15L * (1.0 + norm) * expected.norm())
          << n << ' ' << norm;
    }
  }
}

TEST(MatrixExponential, RefusesMisuse) {
  EXPECT_TRUE(expm(MatrixXd::Zero(2, 3)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(expm(MatrixXd(0, 0)).error().is(ArgumentError::empty));
  MatrixXd A = MatrixXd::Identity(3, 3);
  A(1, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(expm(A).error().is(ArgumentError::not_finite));
}

TEST(MatrixExponential, OverflowIsAnErrorWithEvidence) {
  for (const Eigen::Index n : {1, 2, 3, 6}) {
    const MatrixXd A = 1000.0 * MatrixXd::Ones(n, n);
    const auto result = expm(A);
    ASSERT_FALSE(result.has_value());
    EXPECT_TRUE(result.error().is(MatrixExponentialError::overflow));
    ASSERT_EQ(result.error().evidence().size(), 1U);
    EXPECT_NEAR(result.error().evidence()[0].values.at(0), 1000.0 * static_cast<double>(n), 1e-6);
  }
}

// Very large norms with a finite answer: every entry stays finite.
TEST(MatrixExponential, HugeDecayUnderflowsToZero) {
  for (const double size : {1e4, 1e12, 1e30, 1e100, 1e300}) {
    MatrixXd A(3, 3);
    A << -2, 1, 0, 1, -2, 1, 0, 1, -2;  // eigenvalues -2, -2 ± √2: exp(size A) is zero
    EXPECT_LT(expm(size * A).value().norm(), 1e-300) << size;
  }
}

// exp(A) is answered or refused whatever A's finite entries: with entries near the largest double
// the number of squarings had overflowed.
TEST(MatrixExponential, HugeEntries) {
  constexpr double huge = 1.7e308;
  for (int n = 2; n <= 9; ++n) {
    // Nilpotent: exp(A) = I + A + A²/2 + …, of which one entry alone is left in the corner.
    Eigen::MatrixXd corner = Eigen::MatrixXd::Zero(n, n);
    corner(n - 1, 0) = huge;
    EXPECT_EQ(expm(corner).value(), corner + Eigen::MatrixXd::Identity(n, n)) << n;
    Eigen::MatrixXd chain = Eigen::MatrixXd::Zero(n, n);
    chain.diagonal(-1).setConstant(huge);
    EXPECT_EQ(expm(chain).has_value(), n == 2) << n;
    // All modes decay at once.
    const Eigen::MatrixXd decay =
        Eigen::MatrixXd::Constant(n, n, 1.0) - huge * Eigen::MatrixXd::Identity(n, n);
    EXPECT_LE(expm(decay).value().norm(), 1e-300) << n;
    const auto beyond = expm(Eigen::MatrixXd::Constant(n, n, huge));
    ASSERT_FALSE(beyond.has_value()) << n;
    EXPECT_TRUE(beyond.error().is(MatrixExponentialError::overflow));
  }
}

// Six steps of one and six of 1e-300 in a ring: units that balance them would lie 1e900 apart. What
// is not next to nothing is the series of the six, 1/k!.
TEST(MatrixExponential, BalanceStaysWithinDoubles) {
  constexpr int n = 12;
  MatrixXd ring = MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    ring((i + 1) % n, i) = i < n / 2 ? 1.0 : 1e-300;
  }
  MatrixXd wanted = MatrixXd::Identity(n, n);
  for (int j = 0; j <= n / 2; ++j) {
    for (int i = j + 1; i <= n / 2; ++i) {
      wanted(i, j) = wanted(i - 1, j) / (i - j);
    }
  }
  EXPECT_LE((expm(ring).value() - wanted).cwiseAbs().maxCoeff(), 4e-16);
}

// Slow modes beside fast ones keep their digits, coupled or not: squaring in doubles loses 1e-5 of
// the motor's and 7e-9 of the others.
TEST(MatrixExponential, StiffSystemsKeepTheirSlowModes) {
  const MatrixXd motor{{0.0, 1.0, 0.0}, {0.0, -0.1, 2.0}, {0.0, -0.5, -1e12}};
  EXPECT_NEAR(expm(0.5 * motor).value()(1, 1) / 0.95122942450071400, 1.0, 1e-12);
  const MatrixXd coupled{{-1e10, 0.0, 0.0}, {1e-12, -1.0, 1.0}, {1e-12, 0.0, -2.0}};
  const MatrixXd E = expm(coupled).value();
  EXPECT_NEAR(E(1, 1), std::exp(-1.0), 1e-16);
  EXPECT_NEAR(E(1, 2), std::exp(-1.0) - std::exp(-2.0), 1e-15);
  EXPECT_NEAR(E(2, 2), std::exp(-2.0), 1e-16);
}

// A chain whose end feeds back weakly: units that balance it make the chain's steps small, but not
// what the series would leave out there: the path through all of them, 1/(n - 1)!.
TEST(MatrixExponential, WeakFeedbackLeavesTheChain) {
  for (const int n : {3, 5, 8, 10, 16}) {
    for (const double feedback : {1e-6, 1e-12, 1e-20, 1e-40, 1e-80}) {
      MatrixXd A = MatrixXd::Zero(n, n);
      A.diagonal(-1).setOnes();
      A(0, n - 1) = feedback;
      // Once round the ring at most: feedback² is nothing.
      const MatrixXd wanted = MatrixXd::NullaryExpr(n, n, [&](Eigen::Index i, Eigen::Index j) {
        const auto steps = static_cast<double>(i - j);
        return (i >= j ? 1.0 / std::tgamma(steps + 1.0) : 0.0) +
               feedback / std::tgamma(n + steps + 1.0);
      });
      EXPECT_LE((expm(A).value() - wanted).cwiseAbs().maxCoeff(), 4e-16 + feedback * feedback)
          << n << " states, feedback " << feedback;
    }
  }
}

// A column of zeros leaves that of the identity to the last bit, and a stiff motor's position its
// digits for any number of squarings: SciPy 1.15 keeps 7e-15 of this one.
TEST(MatrixExponential, IntegratorBesideStiffModes) {
  Eigen::Matrix4d M = Eigen::Matrix4d::Zero();
  M.row(0) << 0.0, 1.0, 0.0, 0.0;
  M.row(1) << 0.0, -0.01, 5000.0, 0.0;
  M.row(2) << 0.0, -20.0, -50000.0, 1.0;
  const Eigen::MatrixXd E = expm(1e6 * M).value();
  EXPECT_EQ(E.col(0), Eigen::Vector4d::UnitX());
  EXPECT_NEAR(E(0, 1) / 0.4975124378109453, 1.0, 5e-14);
  EXPECT_NEAR(E(0, 2) / 0.04975124378109453, 1.0, 5e-14);
}

// exp(D A D⁻¹) = D exp(A) D⁻¹: units of states, by powers of two, round nothing.
TEST(MatrixExponential, InOtherUnitsOfStates) {
  Random random(21);
  for (int trial = 0; trial < 120; ++trial) {
    const Eigen::Index n = 2 + trial % 7;
    const MatrixXd A = random_matrix(random, n);
    // Neighbours up to 1e±100 apart, or all states up to 1e±250.
    Eigen::VectorXi d(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      d(i) = static_cast<int>(std::round(random.uniform(-430.0, 430.0)));
    }
    const MatrixXd there = MatrixXd::NullaryExpr(
        n, n, [&](Eigen::Index i, Eigen::Index j) { return std::ldexp(A(i, j), d(i) - d(j)); });
    const auto found = expm(there);
    ASSERT_TRUE(found.has_value());
    const MatrixXd back = MatrixXd::NullaryExpr(n, n, [&](Eigen::Index i, Eigen::Index j) {
      return std::ldexp((*found)(i, j), d(j) - d(i));
    });
    EXPECT_LT(relative_error(back, expm(A).value()), 1e-13) << there;
  }
  const MatrixXd A{{1.0, 1e170}, {1e-170, 2.0}};
  // mpmath: exp of [1 1; 1 2].
  EXPECT_NEAR(expm(A).value()(0, 0), 4.8489, 1e-3);
  EXPECT_LT(relative_error(expm(A).value().col(0).head(1),
                           expm(MatrixXd{{1.0, 1.0}, {1.0, 2.0}}).value().col(0).head(1)),
            1e-15);
}

}  // namespace
}  // namespace flyball::matrix_exponential_test
