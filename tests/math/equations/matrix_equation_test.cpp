#include <flyball/math/equations/matrix_equation.hpp>

#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "math/matrices_json.hpp"
#include "support/laws.hpp"
#include "support/random_systems.hpp"

namespace flyball {
namespace {

using Eigen::MatrixXd;
using test::LongMatrix;
using test::scalar;
using test::wide;

// -2·2x + 4 = 0; x/4 - x + 3 = 0; 2x + 3x = 10; 6x - x + 10 = 0.
TEST(MatrixEquation, ScalarsInClosedForm) {
  EXPECT_EQ(lyapunov(scalar(-2), scalar(4)).value().X(0, 0), 1.0);
  EXPECT_EQ(discrete_lyapunov(scalar(0.5), scalar(3)).value().X(0, 0), 4.0);
  EXPECT_EQ(sylvester(scalar(2), scalar(3), scalar(10)).value().X(0, 0), 2.0);
  EXPECT_EQ(discrete_sylvester(scalar(2), scalar(3), scalar(10)).value().X(0, 0), -2.0);
}

// Golden numbers; see "about" in the file. All to the last bits.
TEST(MatrixEquation, GoldenCases) {
  for (const auto& c : test::cases_of("linear_equations.json")) {
    SCOPED_TRACE(c.at("name").get<std::string>());
    const std::string equation = c.at("equation");
    const MatrixXd A = test::matrix_from(c.at("A"));
    Expected<LinearMatrixSolution> s;
    if (equation == "lyapunov") {
      s = lyapunov(A, test::matrix_from(c.at("Q")));
    } else if (equation == "discrete_lyapunov") {
      s = discrete_lyapunov(A, test::matrix_from(c.at("Q")));
    } else {
      s = (equation == "sylvester" ? sylvester : discrete_sylvester)(
          A, test::matrix_from(c.at("B")), test::matrix_from(c.at("C")));
    }
    if (!c.contains("X")) {
      ASSERT_FALSE(s);
      EXPECT_TRUE(s.error().is(MatrixEquationError::no_unique_solution));
      EXPECT_EQ(s.error().evidence().size(), 2U);
      continue;
    }
    ASSERT_TRUE(s) << to_string(s.error());
    const MatrixXd X = test::matrix_from(c.at("X"));
    EXPECT_LE((s->X - X).norm(), 4e-16 * X.norm());
    EXPECT_LT(s->residual, 1e-15);
  }
}

// The defining equations of 10 000 systems, entry by entry: what is left of each, formed in 64
// bits, against the terms that made it. A refusal has two eigenvalues that cancel.
TEST(MatrixEquation, ResidualsOfRandomSystems) {
  test::RandomSystems systems(31, test::Plane::s);
  test::Refusals refusals;
  test::Law continuous("lyapunov");
  test::Law discrete("discrete_lyapunov");
  test::Law mixed("sylvester");
  test::Law product("discrete_sylvester");
  for (int trial = 0; trial < 10000; ++trial) {
    const test::RandomSystem s = systems.next();
    // The observability side: Q is a weight of the states.
    const MatrixXd given = s.A.transpose();
    const LongMatrix A = wide(given);
    const LongMatrix At = A.transpose();
    const LongMatrix Q = wide(s.Q);
    const MatrixXd B = test::random_matrix(systems.random(), 1 + trial % 5, 1 + trial % 5);
    const MatrixXd C = test::random_matrix(systems.random(), s.A.rows(), B.rows());
    const LongMatrix b = wide(B);
    const LongMatrix c = wide(C);
    const auto check = [&](test::Law& law, const Expected<LinearMatrixSolution>& solution,
                           auto&& rest, auto&& terms) {
      if (!solution) {
        EXPECT_TRUE(solution.error().is(MatrixEquationError::no_unique_solution)) << trial;
        if (s.kind != test::SystemClass::reference) {
          refusals.add(solution.error(), trial, s);
        }
        return;
      }
      const LongMatrix X = wide(solution->X);
      const LongMatrix size = terms(X.cwiseAbs().eval());
      const LongMatrix left = rest(X).cwiseAbs();
      if (s.kind == test::SystemClass::reference) {
        // Some of their entries are zero but for cancellation.
        law.holds(left.norm() / size.norm(), trial, s);
        return;
      }
      law.holds((left.array() / (size.array() > 0.0L).select(size.array(), 1.0L)).maxCoeff(), trial,
                s);
    };
    const LongMatrix a = A.cwiseAbs();
    check(
        continuous, lyapunov(given, s.Q),
        [&](const LongMatrix& X) -> LongMatrix { return A * X + X * At + Q; },
        [&](const LongMatrix& X) -> LongMatrix {
          return a * X + X * a.transpose() + Q.cwiseAbs();
        });
    check(
        discrete, discrete_lyapunov(given, s.Q),
        [&](const LongMatrix& X) -> LongMatrix { return A * X * At - X + Q; },
        [&](const LongMatrix& X) -> LongMatrix {
          return a * X * a.transpose() + X + Q.cwiseAbs();
        });
    check(
        mixed, sylvester(given, B, C),
        [&](const LongMatrix& X) -> LongMatrix { return A * X + X * b - c; },
        [&](const LongMatrix& X) -> LongMatrix { return a * X + X * b.cwiseAbs() + c.cwiseAbs(); });
    check(
        product, discrete_sylvester(given, B, C),
        [&](const LongMatrix& X) -> LongMatrix { return A * X * b - X + c; },
        [&](const LongMatrix& X) -> LongMatrix { return a * X * b.cwiseAbs() + X + c.cwiseAbs(); });
  }
  refusals.expect_at_most(0);
  // The worst of the reference cases, CAREX 2.7 with its eps at 0.001, has 9.9e-15.
  for (const test::Law* law : {&continuous, &discrete, &mixed, &product}) {
    law->expect_within(1e-15, 1e-14, 9000);
  }
}

// B = δI - A, whose eigenvalues differ from -A's by δ: (A X - X A) + δX = C. However small δ is,
// what is left of the equation is rounding beside its terms, and the condition tells of δ; where δ
// is lost in A's rounding, there is no answer. Sizes on both sides of the kernels' stack.
TEST(MatrixEquation, EigenvaluesThatNearlyCancel) {
  Random random(5);
  for (const int n : {2, 3, 6, 11, 19}) {
    const MatrixXd A = test::random_matrix(random, n, n);
    const MatrixXd C = test::random_matrix(random, n, n);
    for (const double gap : {1.0, 1e-3, 1e-6, 1e-8, 1e-10, 1e-12}) {
      const MatrixXd B = gap * MatrixXd::Identity(n, n) - A;
      const auto s = sylvester(A, B, C);
      ASSERT_TRUE(s) << n << ' ' << gap << ": " << to_string(s.error());
      const LongMatrix X = wide(s->X);
      const LongMatrix left = wide(A) * X + X * wide(B) - wide(C);
      const LongMatrix size = wide(A).cwiseAbs() * X.cwiseAbs() +
                              X.cwiseAbs() * wide(B).cwiseAbs() + wide(C).cwiseAbs();
      EXPECT_LE((left.array().abs() / size.array()).maxCoeff(), 1e-15L) << n << ' ' << gap;
      EXPECT_GE(s->condition, 0.1 / gap) << n << ' ' << gap;
    }
    const auto none = sylvester(A, -A, C);
    ASSERT_FALSE(none) << n;
    EXPECT_TRUE(none.error().is(MatrixEquationError::no_unique_solution));
  }
}

// Stable equations of the sizes that are eliminated by panels, whole and not: what is left of each
// entry is rounding beside its terms.
TEST(MatrixEquation, ManyStates) {
  Random random(6);
  for (const int n : {23, 24, 31, 50}) {
    MatrixXd A = test::random_matrix(random, n, n);
    A -= (A.norm() + 0.1) * MatrixXd::Identity(n, n);
    const MatrixXd B = test::random_matrix(random, n, 2);
    const MatrixXd Q = B * B.transpose();
    const LongMatrix a = wide(A);
    const LongMatrix X = wide(lyapunov(A, Q).value().X);
    const LongMatrix left = a * X + X * a.transpose() + wide(Q);
    const LongMatrix size =
        a.cwiseAbs() * X.cwiseAbs() + X.cwiseAbs() * a.cwiseAbs().transpose() + wide(Q).cwiseAbs();
    EXPECT_LE((left.array().abs() / size.array()).maxCoeff(), 1e-15L) << n;
    const MatrixXd F = A / (1.1 * A.norm());
    const LongMatrix f = wide(F);
    const LongMatrix Y = wide(discrete_lyapunov(F, Q).value().X);
    const LongMatrix rest = f * Y * f.transpose() - Y + wide(Q);
    const LongMatrix terms =
        f.cwiseAbs() * Y.cwiseAbs() * f.cwiseAbs().transpose() + Y.cwiseAbs() + wide(Q).cwiseAbs();
    EXPECT_LE((rest.array().abs() / terms.array()).maxCoeff(), 1e-15L) << n;
  }
}

TEST(MatrixEquation, Errors) {
  const MatrixXd I = MatrixXd::Identity(2, 2);
  EXPECT_TRUE(lyapunov(MatrixXd(2, 3), I).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(lyapunov(I, scalar(1)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(lyapunov(std::nan("") * I, I).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(sylvester(I, scalar(1), I).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(sylvester(I, MatrixXd(0, 0), I).error().is(ArgumentError::empty));
  EXPECT_TRUE(sylvester(I, -I, I).error().is(MatrixEquationError::no_unique_solution));
  EXPECT_TRUE(discrete_lyapunov(I, I).error().is(MatrixEquationError::no_unique_solution));
  EXPECT_TRUE(lyapunov(-1e-200 * I, 1e200 * I).error().is(MatrixEquationError::overflow));
  // Eigenvalues may be small as long as they do not cancel.
  EXPECT_NEAR(lyapunov(-1e-20 * I, I).value().X(0, 0), 5e19, 1e5);
}

}  // namespace
}  // namespace flyball
