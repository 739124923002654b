#include <flyball/math/matrix_equation.hpp>

#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "math/matrices_json.hpp"

namespace flyball {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd scalar(double value) {
  return MatrixXd::Constant(1, 1, value);
}

MatrixXd normal(Random& random, Index rows, Index columns) {
  return MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

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

// The defining equations over 10 000 random data each, unstable and badly scaled ones among them.
TEST(MatrixEquation, ResidualsOfRandomData) {
  Random random(31);
  for (int trial = 0; trial < 10000; ++trial) {
    const Index n = 1 + trial % 7;
    const Index m = 1 + (trial / 7) % 5;
    MatrixXd A = normal(random, n, n);
    MatrixXd B = normal(random, m, m);
    MatrixXd Q = normal(random, n, n);
    Q = (Q + Q.transpose()).eval();
    if (trial % 2 == 1) {
      Eigen::VectorXd d(n);
      for (double& entry : d) {
        entry = std::pow(10.0, random.uniform(-8.0, 8.0));
      }
      A = (d.cwiseInverse().asDiagonal() * A * d.asDiagonal()).eval();
    }
    const MatrixXd C = normal(random, n, m);
    const auto check = [&](const Expected<LinearMatrixSolution>& s, auto&& left, auto&& scale) {
      if (!s) {
        EXPECT_TRUE(s.error().is(MatrixEquationError::no_unique_solution)) << trial;
        return;
      }
      // Entrywise: what is left of each entry, against the terms that made it.
      const MatrixXd rest = left(s->X).cwiseAbs();
      const MatrixXd size = scale(s->X.cwiseAbs().eval());
      EXPECT_LE((rest - 1e-12 * (1.0 + s->condition) * size).maxCoeff(), 0.0) << trial;
    };
    const MatrixXd a = A.cwiseAbs();
    const MatrixXd b = B.cwiseAbs();
    check(
        lyapunov(A, Q),
        [&](const MatrixXd& X) -> MatrixXd { return A * X + X * A.transpose() + Q; },
        [&](const MatrixXd& X) -> MatrixXd { return a * X + X * a.transpose() + Q.cwiseAbs(); });
    check(
        discrete_lyapunov(A, Q),
        [&](const MatrixXd& X) -> MatrixXd { return A * X * A.transpose() - X + Q; },
        [&](const MatrixXd& X) -> MatrixXd { return a * X * a.transpose() + X + Q.cwiseAbs(); });
    check(
        sylvester(A, B, C), [&](const MatrixXd& X) -> MatrixXd { return A * X + X * B - C; },
        [&](const MatrixXd& X) -> MatrixXd { return a * X + X * b + C.cwiseAbs(); });
    check(
        discrete_sylvester(A, B, C),
        [&](const MatrixXd& X) -> MatrixXd { return A * X * B - X + C; },
        [&](const MatrixXd& X) -> MatrixXd { return a * X * b + X + C.cwiseAbs(); });
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
