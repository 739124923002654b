#include <flyball/math/riccati/riccati.hpp>

#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "math/matrices_json.hpp"
#include "support/oracle.hpp"
#include "support/random_systems.hpp"

namespace flyball::riccati_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using test::random_matrix;
using test::scalar;

constexpr double epsilon = std::numeric_limits<double>::epsilon();

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

struct Equation {
  MatrixXd A, B, Q, R, N;
};

/// Stable and unstable systems of up to nine states with a joint weight [Q N; N' R] >= 0.
Equation random_equation(Random& random) {
  const auto n = static_cast<Index>(1 + random.bits() % 9);
  const auto m = static_cast<Index>(1 + random.bits() % static_cast<std::uint64_t>(n));
  Equation e{random_matrix(random, n, n), random_matrix(random, n, m), {}, {}, {}};
  e.A *= random.uniform(0.3, 1.6) / test::eigenvalues(e.A).cwiseAbs().maxCoeff();
  const MatrixXd C = random_matrix(random, n + m, n + m);
  const MatrixXd W = C.transpose() * C;
  e.Q = W.topLeftCorner(n, n);
  e.R = W.bottomRightCorner(m, m);
  e.N = random.bits() % 2 == 0 ? MatrixXd(W.topRightCorner(n, m)) : MatrixXd::Zero(n, m);
  return e;
}

/// F(X) relative to its terms, by another route than the solver's: Z = [I; -K],
/// Z'([A B]'X[A B] + [Q N; N' R])Z = X at the solution.
double relative_residual(const Equation& e, const RiccatiSolution& s) {
  const MatrixXd closed = e.A - e.B * s.K;
  const MatrixXd stage = e.Q - e.N * s.K - (e.N * s.K).transpose() + s.K.transpose() * e.R * s.K;
  const MatrixXd next = closed.transpose() * s.X * closed;
  return (next + stage - s.X).norm() / (next.norm() + stage.norm() + s.X.norm());
}

void expect_solved(const Equation& e, const RiccatiSolution& s, double tolerance) {
  EXPECT_LT(relative_residual(e, s), tolerance);
  EXPECT_EQ(s.X, s.X.transpose());
  EXPECT_LT(test::eigenvalues(e.A - e.B * s.K).cwiseAbs().maxCoeff(), 1.0);
  EXPECT_LT(s.poles.cwiseAbs().maxCoeff(), 1.0);
  const MatrixXd Rt = e.R + e.B.transpose() * s.X * e.B;
  const MatrixXd cross = e.B.transpose() * s.X * e.A + e.N.transpose();
  EXPECT_LT((Rt * s.K - cross).norm(), tolerance * (Rt.norm() * s.K.norm() + cross.norm()));
}

TEST(Riccati, RandomSystemsAreSolved) {
  Random random(1);
  for (int k = 0; k < 2000; ++k) {
    SCOPED_TRACE(k);
    const Equation e = random_equation(random);
    const auto s = dare(e.A, e.B, e.Q, e.R, e.N);
    ASSERT_TRUE(s.has_value()) << to_string(s.error());
    expect_solved(e, *s, 1e-12);
  }
}

// x = D z, u = E v: X_z = D X D and K_z = E⁻¹ K D, whatever the units.
TEST(Riccati, UnitsDoNotMatter) {
  Random random(2);
  for (int k = 0; k < 300; ++k) {
    SCOPED_TRACE(k);
    const Equation e = random_equation(random);
    const auto units = [&random](Index count) {
      Eigen::VectorXd d(count);
      for (double& entry : d) {
        entry = std::ldexp(1.0, static_cast<int>(random.bits() % 53) - 26);
      }
      return d;
    };
    const Eigen::VectorXd d = units(e.A.rows());
    const Eigen::VectorXd v = units(e.B.cols());
    const auto plain = dare(e.A, e.B, e.Q, e.R, e.N);
    const auto scaled = dare(
        d.cwiseInverse().asDiagonal() * e.A * d.asDiagonal(),
        d.cwiseInverse().asDiagonal() * e.B * v.asDiagonal(), d.asDiagonal() * e.Q * d.asDiagonal(),
        v.asDiagonal() * e.R * v.asDiagonal(), d.asDiagonal() * e.N * v.asDiagonal());
    ASSERT_TRUE(plain.has_value());
    ASSERT_TRUE(scaled.has_value()) << to_string(scaled.error());
    const MatrixXd X = d.cwiseInverse().asDiagonal() * scaled->X * d.cwiseInverse().asDiagonal();
    EXPECT_LT((X - plain->X).norm(), 1e-10 * plain->X.norm());
  }
}

// Units as users have them: everything times 1e8 or 1e-8. X scales with the cost.
TEST(Riccati, CostScalesX) {
  Random random(3);
  for (int k = 0; k < 200; ++k) {
    const Equation e = random_equation(random);
    const double c = k % 2 == 0 ? 1e8 : 1e-8;
    const auto plain = dare(e.A, e.B, e.Q, e.R, e.N);
    const auto scaled = dare(e.A, e.B, c * e.Q, c * e.R, c * e.N);
    ASSERT_TRUE(plain.has_value() && scaled.has_value());
    EXPECT_LT((scaled->X - c * plain->X).norm(), 1e-10 * scaled->X.norm());
    EXPECT_LT((scaled->K - plain->K).norm(), 1e-9 * (1.0 + plain->K.norm()));
  }
}

// A rank-deficient R is no obstacle where R + B'XB has an inverse.
TEST(Riccati, SingularR) {
  Random random(4);
  for (int k = 0; k < 300; ++k) {
    SCOPED_TRACE(k);
    Equation e = random_equation(random);
    e.Q += MatrixXd::Identity(e.Q.rows(), e.Q.rows());
    e.R(0, 0) = 0.0;
    e.R.row(0).setZero();
    e.R.col(0).setZero();
    e.N.setZero();
    const auto s = dare(e.A, e.B, e.Q, e.R);
    ASSERT_TRUE(s.has_value()) << to_string(s.error());
    expect_solved(e, *s, 1e-11);
  }
}

// Nearly unreachable modes and indefinite weights: an answer is right or it is not given.
TEST(Riccati, NeverWrong) {
  Random random(5);
  int solved = 0;
  for (int k = 0; k < 400; ++k) {
    SCOPED_TRACE(k);
    Equation e = random_equation(random);
    if (k % 2 == 0) {
      e.B.row(0) *= std::pow(10.0, random.uniform(-14.0, 0.0));
      e.A.row(0).tail(e.A.cols() - 1).setZero();
      e.N.setZero();
    } else {
      e.Q -= random.uniform(0.0, 2.0) * e.Q.trace() / static_cast<double>(e.Q.rows()) *
             MatrixXd::Identity(e.Q.rows(), e.Q.rows());
    }
    const auto s = dare(e.A, e.B, e.Q, e.R, e.N);
    if (s) {
      ++solved;
      expect_solved(e, *s, 1e-9);
    } else {
      EXPECT_EQ(s.error().kind(), ErrorKind::no_answer);
      EXPECT_FALSE(s.error().evidence().empty());
    }
  }
  EXPECT_GT(solved, 200);
}

template <int States, int Inputs>
void expect_fixed_is_dynamic() {
  Random random(6);
  for (int k = 0; k < 20; ++k) {
    const Eigen::Matrix<double, States, States> A = random_matrix(random, States, States);
    const Eigen::Matrix<double, States, Inputs> B = random_matrix(random, States, Inputs);
    const Eigen::Matrix<double, States, States> Q = A.transpose() * A;
    const Eigen::Matrix<double, Inputs, Inputs> R =
        Eigen::Matrix<double, Inputs, Inputs>::Identity();
    const Eigen::Matrix<double, States, Inputs> N = 0.1 * B;
    const auto fixed = dare(A, B, Q, R, N);
    const auto dynamic = dare(MatrixXd(A), MatrixXd(B), MatrixXd(Q), MatrixXd(R), MatrixXd(N));
    ASSERT_EQ(fixed.has_value(), dynamic.has_value());
    if (fixed) {
      EXPECT_EQ(MatrixXd(fixed->X), dynamic->X);
      EXPECT_EQ(MatrixXd(fixed->K), dynamic->K);
      EXPECT_EQ(fixed->residual, dynamic->residual);
      EXPECT_EQ(fixed->iterations, dynamic->iterations);
    }
  }
}

TEST(Riccati, FixedIsDynamic) {
  expect_fixed_is_dynamic<1, 1>();
  expect_fixed_is_dynamic<2, 1>();
  expect_fixed_is_dynamic<2, 2>();
  expect_fixed_is_dynamic<3, 1>();
  expect_fixed_is_dynamic<4, 2>();
  expect_fixed_is_dynamic<5, 2>();
  expect_fixed_is_dynamic<7, 3>();
  expect_fixed_is_dynamic<10, 3>();
}

// Blocks of larger matrices have gaps between their columns; more inputs than states are usual
// for an overactuated vehicle.
TEST(Riccati, BlocksAndManyInputs) {
  Random random(8);
  const MatrixXd big = random_matrix(random, 12, 12);
  const MatrixXd Q = MatrixXd::Identity(3, 3);
  const MatrixXd R = MatrixXd::Identity(5, 5);
  const auto blocks = dare(big.topLeftCorner(3, 3), big.block(4, 4, 3, 5), Q, R);
  const auto copies =
      dare(MatrixXd(big.topLeftCorner(3, 3)), MatrixXd(big.block(4, 4, 3, 5)), Q, R);
  ASSERT_TRUE(blocks.has_value() && copies.has_value());
  EXPECT_EQ(blocks->X, copies->X);
}

// Two states have a kernel of their own (the spectral factor in closed form). The same equation
// beside an independent third state takes the general one; the two must agree. Every third plant
// has a mode at the boundary, every fifth weighs nothing.
TEST(Riccati, TwoStatesAgreeWithTheGeneralKernel) {
  Random random(22);
  const auto normal = [&random](Index rows, Index columns) {
    return MatrixXd(MatrixXd::NullaryExpr(rows, columns, [&random] { return random.normal(); }));
  };
  int compared = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    SCOPED_TRACE(trial);
    const bool continuous = trial % 2 == 0;
    const Index m = 1 + trial % 4 / 2;
    MatrixXd A = normal(2, 2);
    if (trial % 3 == 0) {
      const Eigen::VectorXcd poles = test::eigenvalues(A);
      continuous ? void(A.diagonal().array() -= poles.real().maxCoeff())
                 : void(A /= poles.cwiseAbs().maxCoeff());
    }
    const MatrixXd B = normal(2, m);
    const MatrixXd C =
        trial % 5 == 0 && trial % 3 != 0 ? MatrixXd(MatrixXd::Zero(1, 2)) : normal(1, 2);
    const MatrixXd Q = C.transpose() * C;
    const MatrixXd N = 0.1 * C.transpose() * normal(1, m);
    const MatrixXd R = MatrixXd::Identity(m, m);
    MatrixXd wide_A = MatrixXd::Zero(3, 3);
    wide_A << A, MatrixXd::Zero(2, 1), MatrixXd::Zero(1, 2), continuous ? -0.5 : 0.5;
    MatrixXd wide_B = MatrixXd::Zero(3, m + 1);
    wide_B.topLeftCorner(2, m) = B;
    wide_B(2, m) = 1.0;
    MatrixXd wide_Q = MatrixXd::Identity(3, 3);
    wide_Q.topLeftCorner(2, 2) = Q;
    MatrixXd wide_N = MatrixXd::Zero(3, m + 1);
    wide_N.topLeftCorner(2, m) = N;
    const MatrixXd wide_R = MatrixXd::Identity(m + 1, m + 1);
    const auto two = continuous ? care(A, B, Q, R, N) : dare(A, B, Q, R, N);
    const auto three = continuous ? care(wide_A, wide_B, wide_Q, wide_R, wide_N)
                                  : dare(wide_A, wide_B, wide_Q, wide_R, wide_N);
    ASSERT_EQ(two.has_value(), three.has_value());
    if (!two) {
      continue;
    }
    ++compared;
    const MatrixXd expected = three->X.topLeftCorner(2, 2);
    // What the kernels vouch for: 250 n roundings, or, corrected, some times the condition.
    EXPECT_LE((two->X - expected).norm(),
              epsilon * std::max(750.0, 20.0 * two->condition) * expected.norm());
    EXPECT_LT(continuous ? two->poles.real().maxCoeff() : two->poles.cwiseAbs().maxCoeff() - 1.0,
              0.0);
  }
  EXPECT_GE(compared, 3960);
}

}  // namespace
}  // namespace flyball::riccati_test
