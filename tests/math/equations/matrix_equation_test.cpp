#include <flyball/math/equations/matrix_equation.hpp>

#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "math/matrices_json.hpp"
#include "support/laws.hpp"
#include "support/random_systems.hpp"

namespace flyball::matrix_equation_test {
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
        if (s.kind != test::SystemClass::reference) {
          refusals.add(solution.error(), trial, s);
          return;
        }
        // Some have no solution or none to be told from none by sixteen digits; of others' A X Aᵀ
        // less than four digits are left of X's sixteen.
        EXPECT_TRUE(solution.error().is(MatrixEquationError::no_unique_solution) ||
                    solution.error().is(MatrixEquationError::not_accurate))
            << trial;
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

// Entries as far apart as doubles go: the right answers are of the Kronecker system in 200 digits.
TEST(MatrixEquation, EntriesFarApart) {
  for (const double s : {1e14, 1e15, 1e16, 1e20, 1e60, 1e120}) {
    // X = [-q/2, 3q/2; 3q/2, -3q/2 - ½ 10⁻¹² q] with q = 1/s.
    const double q = 1.0 / s;
    const MatrixXd A = (MatrixXd(2, 2) << 1.0, q, s, s).finished();
    const MatrixXd Q = (MatrixXd(2, 2) << q, -1.0, -1.0, 1e-12).finished();
    const auto solution = lyapunov(A, Q);
    ASSERT_TRUE(solution.has_value()) << s;
    const MatrixXd X = q * (MatrixXd(2, 2) << -0.5, 1.5, 1.5, -1.5 - 0.5e-12).finished();
    EXPECT_LE(((solution->X - X).array() / X.array()).abs().maxCoeff(), s < 1e16 ? 20.0 * q : 1e-15)
        << s;
    EXPECT_LE(solution->residual, 1e-15);
  }
  // No X of doubles satisfies it: A X Aᵀ cancels to less than the last digit of X.
  const auto none = discrete_lyapunov((MatrixXd(2, 2) << -1e20, 1e12, -1e6, 1e-20).finished(),
                                      (MatrixXd(2, 2) << 1e12, 1e-20, 1e-20, -1e6).finished());
  ASSERT_FALSE(none.has_value());
  EXPECT_TRUE(none.error().is(MatrixEquationError::not_accurate));
}

// Units are free: with time in s, states in d and Q in w, X is what it was in those units.
TEST(MatrixEquation, UnitsDoNotMatter) {
  Random random(17);
  for (int trial = 0; trial < 300; ++trial) {
    const int n = 1 + trial % 6;
    const MatrixXd A = test::random_matrix(random, n, n);
    const MatrixXd root = test::random_matrix(random, n, n);
    const MatrixXd Q = root * root.transpose();
    const auto power = [&](int most) {
      return static_cast<int>(std::lround(random.uniform(-most, most)));
    };
    const int time = power(300);
    const int weight = power(300);
    Eigen::VectorXi d(n);
    for (int i = 0; i < n; ++i) {
      d(i) = power(60);
    }
    const auto in_units = [&](const MatrixXd& M, int row, int column, int all) {
      MatrixXd scaled = M;
      for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
          scaled(i, j) = std::ldexp(M(i, j), row * d(i) + column * d(j) + all);
        }
      }
      return scaled;
    };
    const auto plain = lyapunov(A, Q);
    const auto other = lyapunov(in_units(A, 1, -1, time), in_units(Q, 1, 1, weight));
    ASSERT_TRUE(plain.has_value() && other.has_value()) << trial;
    const MatrixXd X = in_units(other->X, -1, -1, time - weight);
    EXPECT_LE((X - plain->X).norm(), 1e-14 * plain->condition * plain->X.norm()) << trial;
    EXPECT_LE(other->residual, 1e-14);
    const auto discrete = discrete_lyapunov(A, Q);
    const auto discrete_other = discrete_lyapunov(in_units(A, 1, -1, 0), in_units(Q, 1, 1, weight));
    ASSERT_TRUE(discrete.has_value() && discrete_other.has_value()) << trial;
    EXPECT_LE((in_units(discrete_other->X, -1, -1, -weight) - discrete->X).norm(),
              2e-14 * discrete->condition * discrete->X.norm());
  }
}

/// Terms below a thousandth of what their row and their column have elsewhere count as that.
LongMatrix terms_in_context(const LongMatrix& terms) {
  LongMatrix context = terms;
  for (int i = 0; i < terms.rows(); ++i) {
    long double row = 0.0L;
    for (int j = 0; j < terms.cols(); ++j) {
      const long double column = terms.col(j).maxCoeff();
      row = column > 0.0L ? std::max(row, terms(i, j) / column) : row;
    }
    for (int j = 0; j < terms.cols(); ++j) {
      context(i, j) = std::max(terms(i, j), 1e-3L * row * terms.col(j).maxCoeff());
    }
  }
  return context;
}

// Modes whose speeds differ by more than the normal doubles do, each with its own answer.
TEST(MatrixEquation, SpeedsFarApart) {
  const MatrixXd A = Eigen::Vector2d(1e10, 1e-310).asDiagonal();
  const MatrixXd Q = Eigen::Vector2d(1e-5, 1e-20).asDiagonal();
  const auto slow = lyapunov(A, Q).value();
  EXPECT_NEAR(slow.X(0, 0), -5e-16, 1e-31);
  EXPECT_NEAR(slow.X(1, 1) / (-0.5e-20 / 1e-310), 1.0, 1e-15);
  EXPECT_EQ(slow.X(1, 0), 0.0);
  const MatrixXd B = Eigen::Vector2d(1e20, 1e-300).asDiagonal();
  const MatrixXd R = (MatrixXd(2, 2) << 0.0, -1.7e308, -1.7e308, -1.0).finished();
  const auto far = lyapunov(B, R).value();
  EXPECT_NEAR(far.X(1, 1) / 5e299, 1.0, 1e-15);
  EXPECT_NEAR(far.X(0, 1) / 1.7e288, 1.0, 1e-15);
  EXPECT_EQ(far.X(0, 1), far.X(1, 0));
  // Less than any double is no answer.
  EXPECT_TRUE(
      discrete_lyapunov(scalar(1e300), scalar(3.0)).error().is(MatrixEquationError::not_accurate));
  // a x a = x - q where a² is beyond the doubles.
  EXPECT_NEAR(discrete_lyapunov(scalar(1e155), scalar(1e20)).value().X(0, 0) / -1e-290, 1.0, 1e-15);
  EXPECT_NEAR(
      discrete_sylvester(scalar(1e200), scalar(1e200), scalar(1e200)).value().X(0, 0) / -1e-200,
      1.0, 1e-15);
}

// What is answered is finite and satisfies its equation entry by entry, whatever the entries;
// formed in 64 bits and 15 of exponent.
TEST(MatrixEquation, AnyFiniteEntries) {
  constexpr double palette[] = {0.0,    0.0,   1.0,     -1.0,    2.2e-16, 5e-324,   1e-310, 1e20,
                                -1e-20, 1e154, -1e-154, 1.7e308, 3.0,     -1.7e308, 0.5};
  Random random(23);
  const auto any = [&](int rows, int columns) {
    return MatrixXd(MatrixXd::NullaryExpr(rows, columns, [&] {
      return palette[static_cast<std::size_t>(random.uniform() * std::size(palette))];
    }));
  };
  int answers = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const int n = 1 + trial % 4;
    const MatrixXd A = any(n, n);
    const MatrixXd half = any(n, n);
    const MatrixXd Q = half.triangularView<Eigen::Lower>().toDenseMatrix() +
                       half.triangularView<Eigen::StrictlyLower>().toDenseMatrix().transpose();
    const LongMatrix a = wide(A);
    const LongMatrix q = wide(Q);
    const auto check = [&](const Expected<LinearMatrixSolution>& solution, bool continuous) {
      if (!solution) {
        return;
      }
      ++answers;
      ASSERT_TRUE(solution->X.allFinite()) << trial;
      const LongMatrix X = wide(solution->X);
      const LongMatrix AX = a * X;
      const LongMatrix XA = X * a.transpose();
      const LongMatrix AXA = AX * a.transpose();
      const LongMatrix left = continuous ? LongMatrix(AX + XA + q) : LongMatrix(AXA - X + q);
      const LongMatrix magnitudes = a.cwiseAbs() * X.cwiseAbs();
      const LongMatrix terms =
          continuous
              ? LongMatrix(magnitudes + magnitudes.transpose() + q.cwiseAbs())
              : LongMatrix(magnitudes * a.cwiseAbs().transpose() + X.cwiseAbs() + q.cwiseAbs());
      // The smallest double in X is what X may be off.
      const LongMatrix tiny = LongMatrix::Constant(n, n, 5e-324L);
      const LongMatrix blur =
          continuous ? LongMatrix(a.cwiseAbs() * tiny + tiny * a.cwiseAbs().transpose())
                     : LongMatrix(a.cwiseAbs() * tiny * a.cwiseAbs().transpose() + tiny);
      const LongMatrix size = terms_in_context(terms);
      for (int k = 0; k < n * n; ++k) {
        EXPECT_LE(std::abs(left(k)), 1e-11L * size(k) + blur(k))
            << trial << (continuous ? " continuous" : " discrete");
      }
      EXPECT_LE(left.cwiseAbs().maxCoeff(), 1e-11L * terms.maxCoeff())
          << trial << (continuous ? " continuous" : " discrete");
    };
    check(lyapunov(A, Q), true);
    check(discrete_lyapunov(A, Q), false);
  }
  EXPECT_GT(answers, 1000);
}

// a² x - x = -q, a x b - x = c where the products of a and b have no double: x = -q/a², c/(a b).
TEST(MatrixEquation, DiscreteOfLargeEntries) {
  const auto x = discrete_lyapunov(scalar(1e155), scalar(1e20));
  ASSERT_TRUE(x.has_value());
  EXPECT_NEAR(x->X(0, 0) / -1e-290, 1.0, 1e-14);
  const auto y = discrete_sylvester(scalar(1e170), scalar(1e170), scalar(1e300));
  ASSERT_TRUE(y.has_value());
  EXPECT_NEAR(std::abs(y->X(0, 0)) / 1e-40, 1.0, 1e-14);
  // What is small beside what is large keeps the x of its own: diag(1e160, 1/2), ones as Q.
  MatrixXd A = MatrixXd::Zero(2, 2);
  A.diagonal() << 1e150, 0.5;
  const auto both = discrete_lyapunov(A, MatrixXd::Ones(2, 2));
  ASSERT_TRUE(both.has_value());
  EXPECT_NEAR(both->X(1, 1), 4.0 / 3.0, 1e-14);
  EXPECT_NEAR(both->X(0, 0) / -1e-300, 1.0, 1e-12);
  EXPECT_NEAR(both->X(0, 1) / (-1.0 / (0.5e150 - 1.0)), 1.0, 1e-12);
  // Eigenvalues whose product is one are told as they are, not in the units of the computation.
  const auto none = discrete_sylvester(scalar(1e170), scalar(1e-170), scalar(1.0));
  ASSERT_FALSE(none.has_value());
  EXPECT_TRUE(none.error().is(MatrixEquationError::no_unique_solution));
}

}  // namespace
}  // namespace flyball::matrix_equation_test
