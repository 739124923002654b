#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/math/riccati/riccati.hpp>

#include "math/matrices_json.hpp"
#include "support/random_systems.hpp"

namespace flyball::care_test {
namespace {

using Eigen::MatrixXd;
using test::scalar;

constexpr double epsilon = std::numeric_limits<double>::epsilon();

// 2ax - b²x²/r + q = 0 with a = b = q = r = 1: x = 1 + √2, k = x, pole -√2.
TEST(Care, ScalarClosedForm) {
  const auto s = care(scalar(1), scalar(1), scalar(1), scalar(1)).value();
  EXPECT_NEAR(s.X(0, 0), 1.0 + std::sqrt(2.0), 1e-15);
  EXPECT_NEAR(s.K(0, 0), 1.0 + std::sqrt(2.0), 1e-15);
  EXPECT_NEAR(s.poles(0).real(), -std::sqrt(2.0), 1e-15);
}

// The double integrator with Q = diag(1, 2), R = 1: X = [2 1; 1 2], K = [1 2], both poles at -1.
TEST(Care, DoubleIntegrator) {
  MatrixXd A(2, 2);
  A << 0, 1, 0, 0;
  MatrixXd B(2, 1);
  B << 0, 1;
  const MatrixXd Q = Eigen::Vector2d(1.0, 2.0).asDiagonal();
  const auto s = care(A, B, Q, scalar(1)).value();
  EXPECT_NEAR(s.X(0, 0), 2.0, 1e-14);
  EXPECT_NEAR(s.K(0, 0), 1.0, 1e-14);
  EXPECT_NEAR(s.K(0, 1), 2.0, 1e-14);
}

// Q = 0 mirrors unstable poles: a = 3 gives x = 6, pole -3. A cross term moves a: with n = 1,
// 2(a - n)x - x² + q - n² = 0; a = 1, q = 5: x = 2.
TEST(Care, MirrorsAndCrossTerm) {
  const auto mirrored = care(scalar(3), scalar(1), scalar(0), scalar(1)).value();
  EXPECT_NEAR(mirrored.X(0, 0), 6.0, 1e-14);
  EXPECT_NEAR(mirrored.poles(0).real(), -3.0, 1e-14);
  const auto cross = care(scalar(1), scalar(1), scalar(5), scalar(1), scalar(1)).value();
  EXPECT_NEAR(cross.X(0, 0), 2.0, 1e-14);
  EXPECT_NEAR(cross.K(0, 0), 3.0, 1e-14);
}

// An indefinite R has a stabilising solution here (an H∞ problem): 2ax - (b₁² - b₂²/γ²)x² + q = 0.
TEST(Care, IndefiniteR) {
  MatrixXd B(1, 2);
  B << 1, 0.5;
  const MatrixXd R = Eigen::Vector2d(1.0, -4.0).asDiagonal();
  const double g = 1.0 - 0.25 / 4.0;
  const auto s = care(scalar(-1), B, scalar(1), R).value();
  EXPECT_NEAR(s.X(0, 0), (-1.0 + std::sqrt(1.0 + g)) / g, 1e-15);
}

// Golden numbers; see "about" in the file.
TEST(Care, GoldenCases) {
  for (const auto& c : test::cases_of("riccati_care.json")) {
    SCOPED_TRACE(c.at("name").get<std::string>());
    const MatrixXd A = test::matrix_from(c.at("A"));
    const MatrixXd B = test::matrix_from(c.at("B"));
    const MatrixXd N =
        c.contains("N") ? test::matrix_from(c.at("N")) : MatrixXd::Zero(B.rows(), B.cols());
    const auto s = care(A, B, test::matrix_from(c.at("Q")), test::matrix_from(c.at("R")), N);
    if (c.at("expect") == "marginal") {
      continue;
    }
    ASSERT_TRUE(s.has_value()) << to_string(s.error());
    const MatrixXd X = test::matrix_from(c.at("X"));
    const double cond = c.at("cond").is_null() ? 10.0 : c.at("cond").get<double>();
    EXPECT_LE((s->X - X).norm() / X.norm(),
              10.0 * static_cast<double>(A.rows()) * std::max(1.0, cond) * epsilon);
    EXPECT_LT(s->poles.real().maxCoeff(), 0.0);
    EXPECT_EQ(s->X, s->X.transpose());
  }
}

// Turned benchmarks, plants that grow a thousandfold a step or hang on their inputs by 1e-3 to
// 1e-10: twice the working precision is not enough for them. See "about" in the file.
TEST(Care, HardGoldenCasesOfBothKinds) {
  for (const auto& c : test::cases_of("riccati_hard.json")) {
    SCOPED_TRACE(c.at("name").get<std::string>());
    const bool continuous = c.at("kind") == "care";
    const MatrixXd A = test::matrix_from(c.at("A"));
    const MatrixXd B = test::matrix_from(c.at("B"));
    const MatrixXd Q = test::matrix_from(c.at("Q"));
    const MatrixXd R = test::matrix_from(c.at("R"));
    const MatrixXd N =
        c.contains("N") ? test::matrix_from(c.at("N")) : MatrixXd::Zero(B.rows(), B.cols());
    const auto s = continuous ? care(A, B, Q, R, N) : dare(A, B, Q, R, N);
    if (!c.contains("X")) {
      // Whether A - BK is stable hangs on the last digits of its entries.
      ASSERT_FALSE(s);
      EXPECT_TRUE(s.error().is(RiccatiError::no_convergence)) << to_string(s.error());
      EXPECT_FALSE(s.error().evidence().empty());
      continue;
    }
    ASSERT_TRUE(s.has_value()) << to_string(s.error());
    const MatrixXd X = test::matrix_from(c.at("X"));
    EXPECT_LE((s->X - X).norm(), epsilon * X.norm());
    EXPECT_LT(continuous ? s->poles.real().maxCoeff() : s->poles.cwiseAbs().maxCoeff() - 1.0, 0.0);
  }
}

TEST(Care, SaysWhyThereIsNone) {
  MatrixXd A(2, 2);
  A << 1.2, 0, 0, -0.9;
  MatrixXd B(2, 1);
  B << 0, 1;
  const MatrixXd I = MatrixXd::Identity(2, 2);
  const auto unreachable = care(A, B, I, scalar(1));
  ASSERT_FALSE(unreachable);
  EXPECT_TRUE(unreachable.error().is(RiccatiError::not_stabilizable));
  EXPECT_NEAR(unreachable.error().evidence().at(0).values.at(0), 1.2, 1e-12);
  EXPECT_EQ(unreachable.error().where(), "care");

  // An oscillator that no weight sees stays on the imaginary axis.
  MatrixXd oscillator(2, 2);
  oscillator << 0, 2, -2, 0;
  const auto unseen = care(oscillator, B, MatrixXd::Zero(2, 2), scalar(1));
  ASSERT_FALSE(unseen);
  EXPECT_TRUE(unseen.error().is(RiccatiError::no_stabilizing_solution))
      << to_string(unseen.error());
  EXPECT_NEAR(std::abs(unseen.error().evidence().at(0).values.at(1)), 2.0, 1e-6);

  const auto singular = care(A, MatrixXd::Ones(2, 1), I, scalar(0));
  ASSERT_FALSE(singular);
  EXPECT_TRUE(singular.error().is(RiccatiError::singular));
}

// A mode that hangs on its input by 1e-10 to 1e-16 is reached all the same: X grows by the fourth
// power of each of the two couplings.
TEST(Care, AModeThatHangsOnItsInputByLittleIsReached) {
  double before = 0.0;
  for (const double c : {1e-5, 1e-6, 1e-7, 1e-8}) {
    const MatrixXd A = (MatrixXd(3, 3) << 0.1, c, 0.0, 0.0, -1.0, c, 0.0, 0.0, -1.0).finished();
    const MatrixXd B = (MatrixXd(3, 1) << 0.0, 0.0, 1.0).finished();
    const auto solution = care(A, B, MatrixXd::Identity(3, 3), MatrixXd::Identity(1, 1));
    ASSERT_TRUE(solution) << c;
    EXPECT_LT(solution->poles.real().maxCoeff(), 0.0);
    if (before > 0.0) {
      EXPECT_NEAR(solution->X(0, 0) / before, 1e4, 1.0);
    }
    before = solution->X(0, 0);
  }
}

TEST(Care, RefusesMisuse) {
  const MatrixXd A = MatrixXd::Identity(2, 2);
  const MatrixXd B = MatrixXd::Ones(2, 1);
  const MatrixXd Q = MatrixXd::Identity(2, 2);
  const MatrixXd R = scalar(1);
  MatrixXd asymmetric = Q;
  asymmetric(0, 1) = 0.5;
  EXPECT_TRUE(care(MatrixXd::Ones(2, 3), B, Q, R).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(care(MatrixXd(0, 0), B, Q, R).error().is(ArgumentError::empty));
  EXPECT_TRUE(care(A, B, asymmetric, R).error().is(ArgumentError::not_symmetric));
  EXPECT_TRUE(care(std::nan("") * A, B, Q, R).error().is(ArgumentError::not_finite));
  EXPECT_EQ(care(MatrixXd::Ones(2, 3), B, Q, R).error().where(), "care");
}

}  // namespace
}  // namespace flyball::care_test
