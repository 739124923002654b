#include <flyball/math/riccati.hpp>

#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <flyball/core/random.hpp>

#include "math/matrices_json.hpp"

namespace flyball {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double epsilon = std::numeric_limits<double>::epsilon();

MatrixXd scalar(double value) {
  return MatrixXd::Constant(1, 1, value);
}

// a²x - x - a²b²x²/(r + b²x) + q = 0 with a = 2, b = q = r = 1:
// 3x + 1 = 4x²/(1 + x)  <=>  x² - 4x - 1 = 0, so x = 2 + √5, k = 2x/(1 + x) = (1 + √5)/2 and the
// pole is 2 - k = (3 - √5)/2.
TEST(Riccati, ScalarClosedForm) {
  const auto s = dare(scalar(2), scalar(1), scalar(1), scalar(1)).value();
  EXPECT_NEAR(s.X(0, 0), 2.0 + std::sqrt(5.0), 1e-14);
  EXPECT_NEAR(s.K(0, 0), 0.5 + 0.5 * std::sqrt(5.0), 1e-15);
  EXPECT_NEAR(s.poles(0).real(), 1.5 - 0.5 * std::sqrt(5.0), 1e-15);
  EXPECT_LT(s.residual, 1e-15);
}

// Q = 0 and a = 2: the smallest solution is x = 0, the stabilising one solves 3 = 4x/(1 + x),
// x = 3, with the pole at 1/2, the mirror image of 2.
TEST(Riccati, StabilisingSolutionIsNotTheSmallest) {
  const auto s = dare(scalar(2), scalar(1), scalar(0), scalar(1)).value();
  EXPECT_NEAR(s.X(0, 0), 3.0, 1e-14);
  EXPECT_NEAR(s.poles(0).real(), 0.5, 1e-14);
}

// R = 0, a = b = q = 1: x = 1, deadbeat. R = -1/2: 1 = x²/(x - 1/2) has no real root; R = -1/4,
// x² - x + 1/4 = 0: x = 1/2, k = 2, pole -1: on the circle, refused.
TEST(Riccati, SingularAndIndefiniteR) {
  const auto deadbeat = dare(scalar(1), scalar(1), scalar(1), scalar(0)).value();
  EXPECT_NEAR(deadbeat.X(0, 0), 1.0, 1e-14);
  EXPECT_NEAR(deadbeat.K(0, 0), 1.0, 1e-14);
  EXPECT_FALSE(dare(scalar(1), scalar(1), scalar(1), scalar(-0.5)).has_value());
  EXPECT_TRUE(dare(scalar(1), scalar(1), scalar(1), scalar(-0.25))
                  .error()
                  .is(RiccatiError::no_stabilizing_solution));
}

// Golden numbers; see "about" in the file.
TEST(Riccati, GoldenCases) {
  for (const auto& c : test::cases_of("riccati_dare.json")) {
    SCOPED_TRACE(c.at("name").get<std::string>());
    const MatrixXd A = test::matrix_from(c.at("A"));
    const MatrixXd B = test::matrix_from(c.at("B"));
    const MatrixXd N =
        c.contains("N") ? test::matrix_from(c.at("N")) : MatrixXd::Zero(B.rows(), B.cols());
    const auto s = dare(A, B, test::matrix_from(c.at("Q")), test::matrix_from(c.at("R")), N);
    if (c.at("expect") == "reject") {
      ASSERT_FALSE(s.has_value());
      EXPECT_EQ(s.error().kind(), ErrorKind::misuse);
      continue;
    }
    if (c.at("expect") == "none") {
      ASSERT_FALSE(s.has_value());
      EXPECT_EQ(s.error().kind(), ErrorKind::no_answer);
      EXPECT_FALSE(s.error().evidence().empty());
      continue;
    }
    ASSERT_TRUE(s.has_value()) << to_string(s.error());
    const MatrixXd X = test::matrix_from(c.at("X"));
    const double cond = c.at("cond").is_null() ? 10.0 : c.at("cond").get<double>();
    const double error = (s->X - X).norm() / X.norm();
    EXPECT_LE(error, 20.0 * static_cast<double>(A.rows()) * std::max(1.0, cond) * epsilon);
    EXPECT_LT(s->poles.cwiseAbs().maxCoeff(), 1.0);
    EXPECT_EQ(s->X, s->X.transpose());
  }
}

// x₊ = diag(1.2, 0.9) x with an input on the second state only.
TEST(Riccati, NamesTheUnreachableMode) {
  MatrixXd A(2, 2);
  A << 1.2, 0, 0, 0.9;
  MatrixXd B(2, 1);
  B << 0, 1;
  const auto s = dare(A, B, MatrixXd::Identity(2, 2), scalar(1));
  ASSERT_FALSE(s.has_value());
  EXPECT_TRUE(s.error().is(RiccatiError::not_stabilizable));
  EXPECT_NEAR(s.error().evidence().at(0).values.at(0), 1.2, 1e-12);
}

// Mode 1 weighs nothing in Q: the smallest X leaves it on the circle, no X moves it inside.
TEST(Riccati, NamesTheModeOnTheUnitCircle) {
  MatrixXd A(2, 2);
  A << 1, 0, 0, 0.5;
  const MatrixXd B = MatrixXd::Ones(2, 1);
  MatrixXd Q(2, 2);
  Q << 0, 0, 0, 1;
  const auto s = dare(A, B, Q, scalar(1));
  ASSERT_FALSE(s.has_value());
  EXPECT_TRUE(s.error().is(RiccatiError::no_stabilizing_solution));
  EXPECT_NEAR(s.error().evidence().at(0).values.at(0), 1.0, 1e-6);
}

// Two inputs that do the same and cost nothing: R + BᵀXB is singular for every X.
TEST(Riccati, SingularForEveryX) {
  const auto s = dare(scalar(1.5), MatrixXd::Ones(1, 2), scalar(1), MatrixXd::Zero(2, 2));
  ASSERT_FALSE(s.has_value());
  EXPECT_TRUE(s.error().is(RiccatiError::singular)) << to_string(s.error());
}

TEST(Riccati, RefusesMisuse) {
  const MatrixXd A = MatrixXd::Identity(2, 2);
  const MatrixXd B = MatrixXd::Ones(2, 1);
  const MatrixXd Q = MatrixXd::Identity(2, 2);
  const MatrixXd R = scalar(1);
  MatrixXd bad = Q;
  bad(0, 1) = 0.5;
  EXPECT_TRUE(dare(MatrixXd::Ones(2, 3), B, Q, R).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(dare(MatrixXd(0, 0), B, Q, R).error().is(ArgumentError::empty));
  EXPECT_TRUE(dare(A, MatrixXd(2, 0), Q, MatrixXd(0, 0)).error().is(ArgumentError::empty));
  EXPECT_TRUE(dare(A, MatrixXd::Ones(3, 1), Q, R).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(dare(A, B, scalar(1), R).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(dare(A, B, Q, Q).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(dare(A, B, Q, R, B.transpose()).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(dare(A, B, bad, R).error().is(ArgumentError::not_symmetric));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(dare(nan * A, B, Q, R).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(dare(A, infinity * B, Q, R).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(dare(A, B, nan * Q, R).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(dare(A, B, Q, nan * R).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(dare(A, B, Q, R, nan * B).error().is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball
