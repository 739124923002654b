#include <flyball/systems/controllability.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include "math/matrices_json.hpp"
#include "support/oracle.hpp"
#include "systems/random_systems.hpp"

namespace flyball::controllability_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// A = [A_1 A_12; 0 A_2], B = [B_1; 0], turned: exactly `hidden` modes that no input reaches.
struct Hidden {
  MatrixXd A;
  MatrixXd B;
  MatrixXd A_hidden;
  MatrixXd functional;  ///< Columns w of wᵀx that no input moves.
};
Hidden with_hidden_modes(Random& random, Index n, Index m, Index hidden) {
  MatrixXd A = test::random_matrix(random, n, n);
  A.bottomLeftCorner(hidden, n - hidden).setZero();
  MatrixXd B = test::random_matrix(random, n, m);
  B.bottomRows(hidden).setZero();
  const MatrixXd Q = test::random_rotation(random, n);
  return {Q * A * Q.transpose(), Q * B, A.bottomRightCorner(hidden, hidden), Q.rightCols(hidden)};
}

TEST(Controllability, TruthTables) {
  int seen = 0;
  for (const auto& c : test::cases_of("truth_tables.json")) {
    ++seen;
    const MatrixXd A = test::matrix_from(c["A"]);
    const MatrixXd B = test::matrix_from(c["B"]);
    const MatrixXd C = test::matrix_from(c["C"]);
    const TimeDomain domain = c["kind"] == "ct" ? TimeDomain::continuous : TimeDomain::discrete;
    const auto reach = analyze_controllability(A, B, domain).value();
    const auto sight = analyze_observability(A, C, domain).value();
    EXPECT_EQ(reach.controllable, c["controllable"] == 1) << c["name"] << describe(reach);
    EXPECT_EQ(reach.stabilizable, c["stabilizable"] == 1) << c["name"] << describe(reach);
    EXPECT_EQ(sight.observable, c["observable"] == 1) << c["name"] << describe(sight);
    EXPECT_EQ(sight.detectable, c["detectable"] == 1) << c["name"] << describe(sight);
  }
  EXPECT_EQ(seen, 14);
}

// The same in other axes and other units.
TEST(Controllability, TruthDoesNotDependOnCoordinates) {
  Random random(101);
  for (const auto& c : test::cases_of("truth_tables.json")) {
    const MatrixXd A = test::matrix_from(c["A"]);
    const MatrixXd B = test::matrix_from(c["B"]);
    const MatrixXd C = test::matrix_from(c["C"]);
    const Index n = A.rows();
    const TimeDomain domain = c["kind"] == "ct" ? TimeDomain::continuous : TimeDomain::discrete;
    for (int trial = 0; trial < 20; ++trial) {
      const Eigen::VectorXd d = test::random_scales(random, n, 8.0);
      const MatrixXd Q =
          trial % 2 == 0 ? test::random_rotation(random, n) : MatrixXd(MatrixXd::Identity(n, n));
      const MatrixXd A_new = d.cwiseInverse().asDiagonal() * Q * A * Q.transpose() * d.asDiagonal();
      const MatrixXd B_new = 1e6 * d.cwiseInverse().asDiagonal() * Q * B;
      const MatrixXd C_new = 1e-6 * C * Q.transpose() * d.asDiagonal();
      const auto reach = analyze_controllability(A_new, B_new, domain).value();
      const auto sight = analyze_observability(A_new, C_new, domain).value();
      EXPECT_EQ(reach.controllable, c["controllable"] == 1)
          << c["name"] << trial << describe(reach);
      EXPECT_EQ(reach.stabilizable, c["stabilizable"] == 1)
          << c["name"] << trial << describe(reach);
      EXPECT_EQ(sight.observable, c["observable"] == 1) << c["name"] << trial << describe(sight);
      EXPECT_EQ(sight.detectable, c["detectable"] == 1) << c["name"] << trial << describe(sight);
    }
  }
}

TEST(Controllability, RandomSystemsAreControllable) {
  Random random(102);
  for (int trial = 0; trial < 1000; ++trial) {
    const Index n = 1 + trial % 8;
    const auto plant = test::rescaled(test::random_system(random, n, 1 + trial % 2, 1),
                                      test::random_scales(random, n, 8.0));
    const auto reach = analyze_controllability(plant.A, plant.B, TimeDomain::continuous).value();
    EXPECT_TRUE(reach.controllable) << describe(reach);
    EXPECT_TRUE(reach.stabilizable);
    EXPECT_EQ(reach.rank, n);
    EXPECT_EQ(reach.hidden.cols(), 0);
    for (const ModeReach& mode : reach.modes) {
      EXPECT_TRUE(mode.reached);
      EXPECT_NEAR(mode.participation.sum(), 1.0, 1e-9);
    }
    EXPECT_TRUE(analyze_observability(plant.A, plant.C, TimeDomain::continuous).value().observable);
  }
}

// Rank of the staircase, PBH of each mode and the hidden directions agree with what was hidden.
TEST(Controllability, FindsWhatWasHidden) {
  Random random(103);
  for (int trial = 0; trial < 1000; ++trial) {
    const Index n = 2 + trial % 7;
    const Index hidden = 1 + trial % (n - 1);
    const auto built = with_hidden_modes(random, n, 1 + trial % 2, hidden);
    const Eigen::VectorXd d = test::random_scales(random, n, trial % 2 == 0 ? 0.0 : 6.0);
    const MatrixXd A = d.cwiseInverse().asDiagonal() * built.A * d.asDiagonal();
    const MatrixXd B = d.cwiseInverse().asDiagonal() * built.B;
    const auto reach = analyze_controllability(A, B, TimeDomain::continuous).value();
    ASSERT_EQ(reach.rank, n - hidden) << trial << describe(reach);
    EXPECT_FALSE(reach.controllable);
    EXPECT_EQ(reach.stabilizable, test::eigenvalues(built.A_hidden).real().maxCoeff() < 0.0);
    const Eigen::VectorXcd expected = test::eigenvalues(built.A_hidden);
    for (Index k = 0; k < hidden; ++k) {
      const ModeReach& mode = reach.modes[static_cast<std::size_t>(k)];
      EXPECT_FALSE(mode.reached);
      EXPECT_LT((expected.array() - mode.eigenvalue).abs().minCoeff(), 1e-6);
    }
    // wᵀB = 0 and wᵀAᵏB = 0.
    const MatrixXd span = d.cwiseInverse().asDiagonal() * reach.hidden;
    (void)span;
    const MatrixXd w = (d.cwiseInverse().asDiagonal() * reach.hidden).eval();
    const MatrixXd unit = w * w.colwise().norm().cwiseInverse().asDiagonal();
    EXPECT_LT((built.B.transpose() * unit).norm(), 1e-9 * built.B.norm());
    EXPECT_LT((unit - built.functional * (built.functional.transpose() * unit)).norm(), 1e-9);
    // The dual system hides the same from its outputs.
    const auto sight =
        analyze_observability(A.transpose(), B.transpose(), TimeDomain::continuous).value();
    EXPECT_EQ(sight.rank, reach.rank);
    EXPECT_EQ(sight.detectable, reach.stabilizable);
  }
}

// B = [1; ε]: [A - λI, B] of the mode that ε reaches has the smallest singular value ≈ ε.
TEST(Controllability, DistanceSaysHowWeakly) {
  MatrixXd A = MatrixXd::Zero(2, 2);
  A(0, 0) = -1.0;
  A(1, 1) = 1.0;
  A(0, 1) = A(1, 0) = 1e-1;
  for (const double weak : {1e-2, 1e-5, 1e-8, 1e-11}) {
    MatrixXd T(2, 2);
    T << std::cos(0.3), -std::sin(0.3), std::sin(0.3), std::cos(0.3);
    MatrixXd D = MatrixXd::Zero(2, 2);
    D(0, 0) = -1.0;
    D(1, 1) = 1.0;
    const auto reach =
        analyze_controllability(T * D * T.transpose(), T * Eigen::Vector2d(1.0, weak),
                                TimeDomain::continuous)
            .value();
    EXPECT_TRUE(reach.controllable);
    EXPECT_NEAR(reach.modes.front().eigenvalue.real(), 1.0, 1e-12);
    EXPECT_GT(reach.modes.front().distance, 0.1 * weak);
    EXPECT_LT(reach.modes.front().distance, 2.0 * weak);
    EXPECT_GT(reach.modes.back().distance, 0.1);
  }
}

// The book's matrices (6.37), (6.41) for the double integrator, and the answer in words.
TEST(Controllability, WordsAndMatrices) {
  Eigen::Matrix2d A;
  A << 0.0, 1.0, 0.0, 0.0;
  Eigen::Matrix2d swap;
  swap << 0.0, 1.0, 1.0, 0.0;
  EXPECT_EQ(controllability_matrix(A, Eigen::Vector2d(0.0, 1.0)).value(), swap);
  EXPECT_EQ(observability_matrix(A, Eigen::RowVector2d(1.0, 0.0)).value(),
            MatrixXd(Eigen::Matrix2d::Identity()));
  const auto good =
      analyze_controllability(A, Eigen::Vector2d(0.0, 1.0), TimeDomain::continuous).value();
  EXPECT_EQ(good.matrix_rank, 2);
  EXPECT_NEAR(good.matrix_condition, 1.0, 1e-15);
  EXPECT_EQ(good.stairs, (std::vector<Index>{1, 1}));
  EXPECT_EQ(describe(good).substr(0, 57),
            "controllable: 2 of 2 states are reached by the inputs\nmod");
  const std::vector<std::string> names{"position", "velocity"};
  const auto bad =
      analyze_controllability(A, Eigen::Vector2d(1.0, 0.0), TimeDomain::continuous).value();
  EXPECT_NE(describe(bad, names).find("no input moves velocity\n"), std::string::npos)
      << describe(bad, names);
  EXPECT_NE(describe(bad, names).find("not controllable, nor stabilizable: 1 of 2"),
            std::string::npos);
  const auto blind =
      analyze_observability(A, Eigen::RowVector2d(0.0, 1.0), TimeDomain::continuous).value();
  EXPECT_FALSE(blind.observable);
  EXPECT_NE(describe(blind, names).find("no output shows position\n"), std::string::npos)
      << describe(blind, names);
  // Two like motors on one input: their difference moves by itself.
  const auto twins = analyze_controllability(-MatrixXd::Identity(2, 2), Eigen::Vector2d(1.0, 1.0),
                                             TimeDomain::continuous)
                         .value();
  EXPECT_TRUE(twins.stabilizable);
  EXPECT_NE(describe(twins).find("no input moves 0.707 x1 - 0.707 x2\n"), std::string::npos)
      << describe(twins);
  // Gramian of a stable pair: W = 1/2 1 1ᵀ, in balanced units of rank one.
  ASSERT_EQ(twins.gramian_eigenvalues.size(), 2);
  EXPECT_NEAR(twins.gramian_eigenvalues(0), 0.0, 1e-15);
}

TEST(Controllability, Edges) {
  const MatrixXd zero = MatrixXd::Zero(1, 1);
  const MatrixXd one = MatrixXd::Ones(1, 1);
  EXPECT_TRUE(analyze_controllability(zero, one, TimeDomain::continuous).value().controllable);
  const auto still = analyze_controllability(-one, zero, TimeDomain::continuous).value();
  EXPECT_FALSE(still.controllable);
  EXPECT_TRUE(still.stabilizable);
  EXPECT_EQ(still.matrix_condition, INFINITY);
  EXPECT_EQ(still.rank, 0);
  EXPECT_FALSE(analyze_controllability(zero, zero, TimeDomain::continuous).value().stabilizable);
  EXPECT_TRUE(analyze_controllability(zero, zero, TimeDomain::discrete).value().stabilizable);
  EXPECT_TRUE(analyze_controllability(1e-30 * one, 1e-30 * one, TimeDomain::continuous)
                  .value()
                  .controllable);
  const auto none = analyze_controllability(one, MatrixXd(1, 0), TimeDomain::continuous);
  ASSERT_TRUE(none.has_value());
  EXPECT_FALSE(none->controllable);
}

// A PI controller before a plant of three lags: the plant's last state acts on nothing and the
// controller's hangs on the input alone, so that neither has a unit of its own. det [B AB …] is
// not zero: no zero of (s + 2)/(s + c) is a pole of 8000/((s + 0.1)(s + 20)²).
TEST(Controllability, EndsOfChainsDoNotRunAway) {
  for (const double c : {0.0, 1e-3}) {
    for (const double gain : {8.0, 8000.0}) {
      MatrixXd A(4, 4);
      A << -c, 0.0, 0.0, 0.0, 0.0, -0.1, 1.0, 0.0, 0.0, 0.0, -20.0, 1.0, gain * (2.0 - c), 0.0, 0.0,
          -20.0;
      const MatrixXd B = Eigen::Vector4d(1.0, 0.0, 0.0, gain);
      const auto reach = analyze_controllability(A, B, TimeDomain::continuous).value();
      EXPECT_TRUE(reach.controllable) << describe(reach);
      double sum = 0.0;
      for (const ModeReach& mode : reach.modes) {
        sum += mode.eigenvalue.real();
      }
      EXPECT_NEAR(sum, -40.1 - c, 1e-10);
      const MatrixXd C = B.transpose();
      EXPECT_TRUE(analyze_observability(A.transpose(), C, TimeDomain::continuous)->observable);
    }
  }
}

/// Of integers, by elimination modulo a prime that no minor of theirs reaches.
Eigen::Index exact_rank(Eigen::Matrix<long long, Eigen::Dynamic, Eigen::Dynamic> M) {
  constexpr long long prime = 1'000'000'007;
  const auto inverse = [](long long x) {
    long long power = 1;
    for (long long e = prime - 2; e > 0; e /= 2) {
      power = e % 2 == 1 ? power * x % prime : power;
      x = x * x % prime;
    }
    return power;
  };
  M = M.unaryExpr([](long long x) { return ((x % prime) + prime) % prime; });
  Eigen::Index rank = 0;
  for (Eigen::Index j = 0; j < M.cols() && rank < M.rows(); ++j) {
    Eigen::Index pivot = rank;
    while (pivot < M.rows() && M(pivot, j) == 0) {
      ++pivot;
    }
    if (pivot == M.rows()) {
      continue;
    }
    M.row(pivot).swap(M.row(rank));
    const long long factor = inverse(M(rank, j));
    for (Eigen::Index i = rank + 1; i < M.rows(); ++i) {
      const long long share = M(i, j) * factor % prime;
      for (Eigen::Index k = j; k < M.cols(); ++k) {
        M(i, k) = ((M(i, k) - share * M(rank, k)) % prime + prime) % prime;
      }
    }
    ++rank;
  }
  return rank;
}

// Parts that do not know of each other, inputs that move nothing, several that move the same.
TEST(Controllability, RanksOfWholeNumbers) {
  Random random(29);
  const auto entry = [&](double zeros) {
    return random.uniform() < zeros ? 0.0 : std::floor(random.uniform(-2.0, 4.0));
  };
  for (int trial = 0; trial < 2000; ++trial) {
    const Eigen::Index n = 2 + trial % 4;
    const Eigen::Index m = 1 + trial % 3;
    const bool apart = trial % 2 == 0;
    MatrixXd A = MatrixXd::NullaryExpr(n, n, [&] { return entry(0.3); });
    MatrixXd B = MatrixXd::NullaryExpr(n, m, [&] { return entry(0.2); });
    for (Eigen::Index i = 0; apart && i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) {
        A(i, j) = (i < 2) == (j < 2) ? A(i, j) : 0.0;
      }
    }
    for (Eigen::Index j = 0; j < m; ++j) {
      if (random.uniform() < 0.3) {
        B.col(j).setZero();
      }
    }
    const Eigen::Index rank = exact_rank(controllability_matrix(A, B).value().cast<long long>());
    const auto reach = analyze_controllability(A, B, TimeDomain::continuous);
    const auto sight = analyze_observability(A.transpose(), B.transpose(), TimeDomain::discrete);
    ASSERT_TRUE(reach && sight) << trial;
    EXPECT_EQ(reach->rank, rank) << A << "\n" << B;
    EXPECT_EQ(sight->rank, rank) << A << "\n" << B;
  }
}

TEST(Controllability, Errors) {
  const MatrixXd I = MatrixXd::Identity(2, 2);
  EXPECT_TRUE(analyze_controllability(I, MatrixXd::Ones(3, 1), TimeDomain::continuous)
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(analyze_observability(I, MatrixXd::Ones(1, 3), TimeDomain::continuous)
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(analyze_controllability(MatrixXd(), MatrixXd(), TimeDomain::continuous)
                  .error()
                  .is(ArgumentError::empty));
  EXPECT_TRUE(analyze_controllability(NAN * I, MatrixXd::Ones(2, 1), TimeDomain::continuous)
                  .error()
                  .is(ArgumentError::not_finite));
  EXPECT_TRUE(
      controllability_matrix(I, MatrixXd::Ones(3, 1)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(observability_matrix(I, NAN * I).error().is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::controllability_test
