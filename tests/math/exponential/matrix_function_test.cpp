#include <flyball/math/exponential/matrix_function.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/exponential/matrix_exponential.hpp>

#include "math/matrices_json.hpp"

namespace flyball::matrix_function_test {
namespace {

constexpr double pi = std::numbers::pi;

Eigen::MatrixXd normal(Random& random, Eigen::Index n) {
  return Eigen::MatrixXd::NullaryExpr(n, n, [&] { return random.normal(); });
}

// [[a, b], [0, d]]^p has (a^p - d^p)/(a - d) b above its diagonal.
TEST(MatrixPower, TriangularInClosedForm) {
  Eigen::Matrix2d M;
  M << 0.9, 0.3, 0.0, 0.2;
  for (const double p : {0.5, 0.25, 2.5, 7.3}) {
    Eigen::Matrix2d expected;
    expected << std::pow(0.9, p), 0.3 * (std::pow(0.9, p) - std::pow(0.2, p)) / 0.7, 0.0,
        std::pow(0.2, p);
    EXPECT_LT((powm(M, p).value() - expected).norm(), 1e-14) << p;
  }
}

// A Jordan block: [[a, 1], [0, a]]^p = [[a^p, p a^{p-1}], [0, a^p]]; it has no eigenvector basis,
// where the book's diagonalisation gives up.
TEST(MatrixPower, DefectiveMatrix) {
  Eigen::Matrix2d M;
  M << 0.64, 1.0, 0.0, 0.64;
  const Eigen::MatrixXd root = powm(M, 0.5).value();
  EXPECT_NEAR(root(0, 0), 0.8, 1e-14);
  EXPECT_NEAR(root(0, 1), 0.5 / 0.8, 1e-13);
  EXPECT_NEAR(root(1, 0), 0.0, 1e-15);
}

// A rotation by θ to the power p is the rotation by pθ (complex poles).
TEST(MatrixPower, Rotation) {
  const double angle = 2.0;
  Eigen::Matrix2d M;
  M << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  const Eigen::MatrixXd third = powm(M, 1.0 / 3.0).value();
  EXPECT_NEAR(third(0, 0), std::cos(angle / 3.0), 1e-14);
  EXPECT_NEAR(third(1, 0), std::sin(angle / 3.0), 1e-14);
}

// M^p M^q = M^{p+q}, and whole powers are products.
TEST(MatrixPower, AddsExponents) {
  Random random(6);
  for (int trial = 0; trial < 30; ++trial) {
    const Eigen::Index n = 1 + trial % 5;
    const Eigen::MatrixXd G = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return random.normal(); });
    // Eigenvalues to the right of the imaginary axis have every principal power.
    const Eigen::MatrixXd M = G * 0.2 + Eigen::MatrixXd::Identity(n, n);
    const double p = random.uniform(0.0, 2.0);
    const double q = random.uniform(0.0, 2.0);
    const Eigen::MatrixXd sum = powm(M, p + q).value();
    EXPECT_LT((powm(M, p).value() * powm(M, q).value() - sum).norm(), 1e-12 * (1.0 + sum.norm()));
    EXPECT_LT((powm(M, 3.0).value() - M * M * M).norm(), 1e-13 * (M * M * M).norm());
    EXPECT_EQ(powm(M, 0.0).value(), Eigen::MatrixXd::Identity(n, n));
  }
}

// A simple eigenvalue zero (a deadbeat pole) is no obstacle; a defective one is.
TEST(MatrixPower, ZeroEigenvalues) {
  const Eigen::Matrix2d simple = Eigen::Vector2d(0.25, 0.0).asDiagonal();
  const Eigen::MatrixXd root = powm(simple, 0.5).value();
  EXPECT_NEAR(root(0, 0), 0.5, 1e-15);
  EXPECT_EQ(root(1, 1), 0.0);
  Eigen::Matrix2d nilpotent;
  nilpotent << 0.0, 1.0, 0.0, 0.0;
  EXPECT_TRUE(powm(nilpotent, 0.5).error().is(MatrixFunctionError::no_real_power));
  EXPECT_TRUE(powm(nilpotent, 2.0).value().isZero(0.0));
  EXPECT_TRUE(powm(Eigen::Matrix2d::Zero(), 0.5).value().isZero(0.0));
}

TEST(MatrixPower, NamesTheNegativeEigenvalue) {
  const Eigen::Matrix2d M = Eigen::Vector2d(0.5, -0.3).asDiagonal();
  const auto power = powm(M, 1.5);
  ASSERT_FALSE(power.has_value());
  EXPECT_TRUE(power.error().is(MatrixFunctionError::no_real_power));
  EXPECT_EQ(power.error().kind(), ErrorKind::no_answer);
  EXPECT_NEAR(power.error().evidence().front().values.front(), -0.3, 1e-15);
  EXPECT_NEAR(powm(M, 3.0).value()(1, 1), -0.027, 1e-17);
}

// A^-p is the inverse of A^p, exactly so for a diagonal.
TEST(MatrixPower, NegativePowers) {
  const Eigen::Matrix2d M = Eigen::Vector2d(4.0, 0.25).asDiagonal();
  EXPECT_NEAR(powm(M, -0.5).value()(0, 0), 0.5, 1e-16);
  EXPECT_NEAR(powm(M, -2.0).value()(1, 1), 16.0, 1e-14);
  const Eigen::Matrix2d singular = Eigen::Vector2d(1.0, 0.0).asDiagonal();
  EXPECT_TRUE(powm(singular, -1.0).error().is(MatrixFunctionError::singular));
  EXPECT_TRUE(powm(singular, -0.5).error().is(MatrixFunctionError::singular));
}

// Small entries that are rounding themselves pull the balanced units apart; what rounding is in
// those is not lost of the large entries, or there is no answer. The closed form without them: a
// triangle's logarithm by Parlett's recurrence.
TEST(MatrixFunctions, RoundingErrorsAmongTheEntries) {
  Eigen::Matrix3d A;
  A << 2.0, 2.0, 1.0, -1e-20, 0.28125, 0.96875, 1e-20, 2.2e-16, 0.5;
  const Eigen::MatrixXd L = logm(A).value();
  const double l0 = std::log(2.0);
  const double l1 = std::log(0.28125);
  const double l2 = std::log(0.5);
  const double l01 = 2.0 * (l0 - l1) / (2.0 - 0.28125);
  const double l12 = 0.96875 * (l1 - l2) / (0.28125 - 0.5);
  const double l02 = ((l0 - l2) + l01 * 0.96875 - 2.0 * l12) / (2.0 - 0.5);
  const Eigen::Matrix3d wanted =
      (Eigen::Matrix3d() << l0, l01, l02, 0.0, l1, l12, 0.0, 0.0, l2).finished();
  EXPECT_LE((L - wanted).cwiseAbs().maxCoeff(), 1e-14);

  const Eigen::Vector4d column(0.084808349609375, -0.993408203125, 0.7135009765625, -5e-17);
  const Eigen::RowVector4d row(4.4e-16, -2e-16, 1.0, 1.9267578125);
  const Eigen::MatrixXd rank_one = column * row;
  EXPECT_TRUE(powm(rank_one, 0.5).error().is(MatrixFunctionError::not_accurate));
  // 1e20 beside eigenvalues of one: the root of the small ones is not nothing.
  Eigen::Matrix3d B;
  B << 0.62, 100.0, 6.4e10, 0.016, 1e20, 2.2e-7, -1e-11, 1e-9, 1.2;
  const Eigen::MatrixXd root = powm(B, 0.5).value();
  const Eigen::MatrixXd back = root * root;
  for (const int i : {0, 2}) {
    for (const int j : {0, 2}) {
      EXPECT_NEAR(back(i, j) / B(i, j), 1.0, 1e-13) << i << j;
    }
  }
  EXPECT_NEAR(root(1, 1), 1e10, 1e-4);
}

TEST(MatrixPower, Errors) {
  const Eigen::Matrix2d A = Eigen::Matrix2d::Identity();
  EXPECT_TRUE(powm(A, 1e10).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(powm(A, std::nan("")).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(powm(Eigen::MatrixXd(0, 0), 1.0).error().is(ArgumentError::empty));
  EXPECT_TRUE(powm(1e200 * A, 2.0).error().is(MatrixFunctionError::overflow));
}

// Golden numbers; see "about" in the file.
TEST(MatrixFunctions, GoldenCases) {
  for (const auto& c : test::cases_of("matrix_functions.json")) {
    SCOPED_TRACE(c.at("name").get<std::string>());
    const Eigen::MatrixXd A = test::matrix_from(c.at("A"));
    if (c.contains("log")) {
      const Eigen::MatrixXd X = test::matrix_from(c.at("log"));
      EXPECT_LE((logm(A).value() - X).norm(), 1e-14 * X.norm());
    } else {
      EXPECT_FALSE(logm(A));
      EXPECT_FALSE(powm(A, 0.5));
    }
    for (const auto& power : c.value("powers", nlohmann::json::array())) {
      const Eigen::MatrixXd X = test::matrix_from(power.at("X"));
      EXPECT_LE((powm(A, power.at("power")).value() - X).norm(), 1e-14 * X.norm());
    }
  }
}

// exp(log A) = A for 3000 matrices without negative eigenvalues, badly scaled ones among them.
TEST(MatrixLogarithm, IsTheInverseOfTheExponential) {
  Random random(11);
  for (int trial = 0; trial < 3000; ++trial) {
    const Eigen::Index n = 1 + trial % 8;
    // Eigenvalues of G/‖G‖ lie in the unit disk, so that its exponential's logarithm is principal.
    const Eigen::MatrixXd G = normal(random, n);
    Eigen::MatrixXd X = G * (random.uniform(0.0, 3.0) / G.norm());
    Eigen::VectorXd d = Eigen::VectorXd::Ones(n);
    if (trial % 3 == 0) {
      d = Eigen::VectorXd::NullaryExpr(
          n, [&] { return std::exp2(std::round(random.uniform(-25.0, 25.0))); });
    }
    X = d.asDiagonal() * X * d.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd A = expm(X).value();
    const auto L = logm(A);
    ASSERT_TRUE(L) << to_string(L.error());
    const Eigen::MatrixXd difference = d.cwiseInverse().asDiagonal() * (*L - X) * d.asDiagonal();
    EXPECT_LT(difference.norm(), 2e-12) << trial << " n = " << n;
  }
}

// So many states that triangles are halved.
TEST(MatrixLogarithm, OfManyStates) {
  Random random(12);
  for (const Eigen::Index n : {41, 90, 131}) {
    const Eigen::MatrixXd G = normal(random, n);
    const Eigen::MatrixXd X = G * (4.0 / G.norm());
    const Eigen::MatrixXd A = expm(X).value();
    const auto L = logm(A);
    ASSERT_TRUE(L) << to_string(L.error());
    EXPECT_LT((*L - X).norm(), 1e-12 * X.norm()) << n;
    const auto root = powm(A, 0.5);
    ASSERT_TRUE(root) << to_string(root.error());
    EXPECT_LT((*root - expm(0.5 * X).value()).norm(), 1e-12 * root->norm()) << n;
  }
}

TEST(MatrixLogarithm, ClosedForms) {
  Eigen::Matrix2d rotation;
  const double angle = 3.1;
  rotation << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  const Eigen::MatrixXd L = logm(rotation).value();
  EXPECT_NEAR(L(1, 0), angle, 1e-13);
  EXPECT_NEAR(L(0, 1), -angle, 1e-13);
  EXPECT_NEAR(L(0, 0), 0.0, 1e-14);

  Eigen::Matrix3d jordan;
  jordan << 2.0, 1.0, 0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 2.0;
  const Eigen::MatrixXd J = logm(jordan).value();
  EXPECT_NEAR(J(0, 0), std::log(2.0), 1e-16);
  EXPECT_NEAR(J(0, 1), 0.5, 1e-16);
  EXPECT_NEAR(J(0, 2), -0.125, 1e-15);

  // Near the identity to full relative accuracy: log(1 + x) = x - x²/2.
  const Eigen::Matrix2d near = Eigen::Vector2d(1.0 + 1e-10, 1.0).asDiagonal();
  EXPECT_NEAR(logm(near).value()(0, 0) / std::log1p(near(0, 0) - 1.0), 1.0, 1e-15);
  // Eigenvalues 600 decades apart.
  const Eigen::Matrix2d wide = Eigen::Vector2d(1e300, 1e-300).asDiagonal();
  EXPECT_NEAR(logm(wide).value()(1, 1), -300.0 * std::log(10.0), 1e-12);
}

// A small turn is no zero beside a one: log(εJ) = log(ε) I + π/2 J, J = [0 -1; 1 0].
TEST(MatrixLogarithm, OfASmallTurnBesideAOne) {
  Eigen::Matrix3d A = Eigen::Vector3d(1.0, 0.0, 0.0).asDiagonal();
  A(2, 1) = 1e-17;
  A(1, 2) = -1e-17;
  Eigen::Matrix3d expected = Eigen::Vector3d(0.0, std::log(1e-17), std::log(1e-17)).asDiagonal();
  expected(2, 1) = std::acos(0.0);
  expected(1, 2) = -std::acos(0.0);
  const auto L = logm(A);
  ASSERT_TRUE(L) << to_string(L.error());
  EXPECT_LE((*L - expected).norm(), 1e-15 * expected.norm());
}

TEST(MatrixLogarithm, SaysWhenThereIsNone) {
  const Eigen::Matrix2d negative = Eigen::Vector2d(1.0, -2.0).asDiagonal();
  const auto L = logm(negative);
  ASSERT_FALSE(L);
  EXPECT_TRUE(L.error().is(MatrixFunctionError::no_real_logarithm));
  EXPECT_EQ(L.error().evidence().front().values.front(), -2.0);
  EXPECT_TRUE(logm(Eigen::Matrix2d::Zero()).error().is(MatrixFunctionError::no_real_logarithm));
  EXPECT_TRUE(
      logm(-Eigen::Matrix2d::Identity()).error().is(MatrixFunctionError::no_real_logarithm));
  EXPECT_TRUE(logm(Eigen::MatrixXd(2, 3)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(logm(Eigen::MatrixXd(0, 0)).error().is(ArgumentError::empty));
  const Eigen::Matrix2d bad = Eigen::Matrix2d::Constant(std::nan(""));
  EXPECT_TRUE(logm(bad).error().is(ArgumentError::not_finite));
}

// A^p = exp(p log A).
TEST(MatrixPower, IsTheExponentialOfTheLogarithm) {
  Random random(12);
  for (int trial = 0; trial < 500; ++trial) {
    const Eigen::Index n = 1 + trial % 6;
    const Eigen::MatrixXd G = normal(random, n);
    const Eigen::MatrixXd X = G * (random.uniform(0.1, 0.9 * pi) / G.norm());
    const double p = random.uniform(-3.0, 3.0);
    const Eigen::MatrixXd expected = expm(p * X).value();
    const Eigen::MatrixXd got = powm(expm(X).value(), p).value();
    EXPECT_LT((got - expected).norm(), 1e-11 * expected.norm()) << trial << " p = " << p;
  }
}

// A triangular matrix has its eigenvalues as written: none of them is zero for being small.
TEST(MatrixPower, SmallEigenvaluesOfATriangle) {
  for (const double small : {1e-9, 1e-17, 1e-30, 1e-100, 1e-300}) {
    const Eigen::Matrix2d D = Eigen::Vector2d(1.0 / small, small).asDiagonal();
    for (const double p : {0.1, -0.5, 0.7, -1.0}) {
      const Eigen::MatrixXd X = powm(D, p).value();
      EXPECT_NEAR(X(0, 0) / std::pow(1.0 / small, p), 1.0, 1e-14) << small << ", " << p;
      EXPECT_NEAR(X(1, 1) / std::pow(small, p), 1.0, 1e-14) << small << ", " << p;
    }
    // [1 1; 0 s]^p has (1 - s^p)/(1 - s) in its corner.
    const Eigen::Matrix2d T{{1.0, 1.0}, {0.0, small}};
    const Eigen::MatrixXd X = powm(T, 0.1).value();
    EXPECT_NEAR(X(1, 1) / std::pow(small, 0.1), 1.0, 1e-14) << small;
    EXPECT_NEAR(X(0, 1), (1.0 - std::pow(small, 0.1)) / (1.0 - small), 1e-14) << small;
    const Eigen::MatrixXd transposed = powm(T.transpose(), 0.1).value();
    EXPECT_EQ(transposed, X.transpose());
  }
}

// log(s A) = log A + log s for any s; subnormal entries have a logarithm as others do.
TEST(MatrixLogarithm, OfAnySize) {
  const Eigen::Matrix2d A{{3.0, 1.0}, {1.0, 2.0}};
  const Eigen::MatrixXd L = logm(A).value();
  for (const int unit : {-1074, -1050, -600, 300, 1020}) {
    Eigen::MatrixXd expected = L;
    expected.diagonal().array() += unit * std::log(2.0);
    const Eigen::MatrixXd scaled = A * std::ldexp(1.0, unit / 2) * std::ldexp(1.0, unit - unit / 2);
    EXPECT_LE((logm(scaled).value() - expected).norm(), 1e-15 * expected.norm()) << unit;
  }
  const Eigen::Matrix2d negative{{3.0, 7.0}, {3.0, 5.0}};
  const auto none = logm(negative * 5e-324);
  ASSERT_FALSE(none.has_value());
  EXPECT_TRUE(none.error().is(MatrixFunctionError::no_real_logarithm));
}

// f(D A D⁻¹) = D f(A) D⁻¹: units of states, by powers of two, round nothing.
TEST(MatrixFunction, InOtherUnitsOfStates) {
  Random random(22);
  const auto in_units = [](const Eigen::MatrixXd& M, const Eigen::VectorXi& d, int sign) {
    return Eigen::MatrixXd(Eigen::MatrixXd::NullaryExpr(
        M.rows(), M.cols(),
        [&](Eigen::Index i, Eigen::Index j) { return std::ldexp(M(i, j), sign * (d(i) - d(j))); }));
  };
  const auto expect_same = [&](const Expected<Eigen::MatrixXd>& found, const Eigen::VectorXi& d,
                               const Eigen::MatrixXd& wanted) {
    ASSERT_TRUE(found.has_value());
    EXPECT_LE((in_units(*found, d, -1) - wanted).norm(), 1e-12 * wanted.norm());
  };
  for (int trial = 0; trial < 60; ++trial) {
    const Eigen::Index n = 2 + trial % 4;
    const Eigen::MatrixXd A = 0.3 * normal(random, n) + 2.0 * Eigen::MatrixXd::Identity(n, n);
    Eigen::VectorXi d(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      d(i) = static_cast<int>(std::round(random.uniform(-430.0, 430.0)));
    }
    const Eigen::MatrixXd there = in_units(A, d, 1);
    expect_same(logm(there), d, logm(A).value());
    for (const double p : {0.3, -0.5, 3.0, -2.0}) {
      expect_same(powm(there, p), d, powm(A, p).value());
    }
  }
  // Cubes of a defective block, 3a²b of which is a subnormal, and A⁻¹ of entries near the largest.
  const auto cube = powm(Eigen::Matrix2d{{1e-155, 0.25}, {0.0, 1e-155}}, 3.0).value();
  EXPECT_NEAR(cube(0, 1) / 7.5e-311, 1.0, 1e-11);
  EXPECT_NEAR(powm(Eigen::Matrix2d{{1.0, 1.7e308}, {0.0, 2.0}}, -1.0).value()(0, 1) / -0.85e308,
              1.0, 1e-15);
  // Exactly: the root of [3 1; 1 2] is [a b; b a - b], of which 2ab - b² = 1, a² + b² = 3.
  const Eigen::MatrixXd root = powm(Eigen::Matrix2d{{3.0, 1e170}, {1e-170, 2.0}}, 0.5).value();
  const double a = root(0, 0);
  const double b = root(0, 1) / 1e170;
  EXPECT_NEAR(a * a + b * b, 3.0, 1e-14);
  EXPECT_NEAR(2.0 * a * b - b * b, 1.0, 1e-14);
  EXPECT_NEAR(root(1, 1), a - b, 1e-14);
  EXPECT_NEAR(root(1, 0) * 1e170, b, 1e-14);
}

}  // namespace
}  // namespace flyball::matrix_function_test
