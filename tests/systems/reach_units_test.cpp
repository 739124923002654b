#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/systems/controllability.hpp>
#include <flyball/systems/structure.hpp>

#include "support/oracle.hpp"
#include "systems/random_systems.hpp"

namespace flyball::reach_units_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A system whose verdicts are known.
struct Known {
  MatrixXd A, B, C;
  Index reached = 0;
  Index seen = 0;
  bool stabilizable = true;
  bool detectable = true;
};

/// Units of up to so many decades of time, each state, each input and output; not powers of two.
Known in_other_units(const Known& known, Random& random, double decades) {
  const auto unit = [&] { return std::pow(10.0, random.uniform(-decades, decades)); };
  const auto units = [&](Index count) {
    return VectorXd(VectorXd::NullaryExpr(count, [&] { return unit(); }));
  };
  const double time = unit();
  const VectorXd d = units(known.A.rows());
  Known other = known;
  other.A = MatrixXd::NullaryExpr(
      d.size(), d.size(), [&](Index i, Index j) { return known.A(i, j) * time * (d(j) / d(i)); });
  // Not the products of two units first: each of them fits, both may not.
  const VectorXd inputs = units(known.B.cols());
  const VectorXd outputs = units(known.C.rows());
  other.B = d.cwiseInverse().asDiagonal() * known.B * inputs.asDiagonal();
  other.C = outputs.asDiagonal() * known.C * d.asDiagonal();
  return other;
}

void expect_known(const Known& given, const std::string& what) {
  const auto reach = analyze_controllability(given.A, given.B, TimeDomain::continuous);
  const auto sight = analyze_observability(given.A, given.C, TimeDomain::continuous);
  ASSERT_TRUE(reach.has_value() && sight.has_value()) << what;
  const Index n = given.A.rows();
  EXPECT_EQ(reach->rank, given.reached) << what << describe(*reach);
  EXPECT_EQ(reach->controllable, given.reached == n) << what;
  EXPECT_EQ(reach->stabilizable, given.stabilizable) << what << describe(*reach);
  EXPECT_EQ(reach->hidden.cols(), n - reach->rank) << what;
  EXPECT_TRUE(reach->hidden.allFinite()) << what;
  EXPECT_EQ(sight->rank, given.seen) << what << describe(*sight);
  EXPECT_EQ(sight->observable, given.seen == n) << what;
  EXPECT_EQ(sight->detectable, given.detectable) << what << describe(*sight);
}

void expect_known_in_units(const Known& known, Random& random, double decades,
                           const std::string& what) {
  expect_known(known, what);
  expect_known(in_other_units(known, random, decades), what + " in other units");
}

/// [A₁ A₁₂; 0 A₂] with A₂ of `hidden` states that B does not reach, in turned axes; distinct modes
/// away from the axis, so that stabilisability is known.
void plant_hidden(Random& random, Index n, Index m, Index hidden, MatrixXd& A, MatrixXd& B,
                  bool& decays) {
  A = test::random_matrix(random, n, n);
  for (Index i = 0; i < n; ++i) {
    A(i, i) += (random.uniform() < 0.5 ? -1.0 : 1.0) * 3.0 * static_cast<double>(n);
  }
  A.bottomLeftCorner(hidden, n - hidden).setZero();
  B = test::random_matrix(random, n, m);
  B.bottomRows(hidden).setZero();
  decays =
      hidden == 0 || test::eigenvalues(A.bottomRightCorner(hidden, hidden)).real().maxCoeff() < 0.0;
  const MatrixXd Q = test::random_rotation(random, n);
  A = (Q * A * Q.transpose()).eval();
  B = (Q * B).eval();
}

// Time, states, inputs and outputs in units of 1e±95 each, entries of up to 1e±285: the verdicts
// are those of the construction.
TEST(ReachUnits, PlantedModes) {
  Random random(2101);
  for (int trial = 0; trial < 600; ++trial) {
    const Index n = 1 + trial % 10;
    const Index m = 1 + trial % 3;
    const Index hidden = trial % 2 == 0 ? 0 : trial / 2 % n;
    Known known;
    known.seen = n;
    known.reached = n - hidden;
    plant_hidden(random, n, m, hidden, known.A, known.B, known.stabilizable);
    known.C = test::random_matrix(random, m, n);
    expect_known_in_units(known, random, 95.0, "hidden from the inputs " + std::to_string(trial));

    Known dual{known.A.transpose(), known.C.transpose(), known.B.transpose(), n, n - hidden, true,
               known.stabilizable};
    expect_known_in_units(dual, random, 95.0, "hidden from the outputs " + std::to_string(trial));
  }
}

// Chains of integrators and companion matrices of stable poles: every state is reached from the end
// of the chain and seen at its beginning, though a change of 1e-16 would hide a mode of many.
TEST(ReachUnits, ChainsAndCompanions) {
  Random random(2102);
  for (const Index n : {1, 2, 3, 7, 12, 20, 33, 45, 50}) {
    Known chain;
    chain.A = MatrixXd::Zero(n, n);
    chain.A.diagonal(1).setOnes();
    chain.B = MatrixXd::Zero(n, 1);
    chain.B(n - 1, 0) = 1.0;
    chain.C = MatrixXd::Zero(1, n);
    chain.C(0, 0) = 1.0;
    chain.reached = chain.seen = n;
    expect_known(chain, "chain " + std::to_string(n));
    expect_known(in_other_units(chain, random, 90.0), "chain in units " + std::to_string(n));

    Known companion = chain;
    // ∏(s + k/n), whose coefficients span thirty decades.
    VectorXd polynomial = VectorXd::Zero(n + 1);
    polynomial(0) = 1.0;
    for (Index k = 1; k <= n; ++k) {
      for (Index i = k; i > 0; --i) {
        polynomial(i) += polynomial(i - 1) * static_cast<double>(k) / static_cast<double>(n);
      }
    }
    companion.A.row(n - 1) = -polynomial.tail(n).reverse().transpose();
    expect_known(companion, "companion " + std::to_string(n));
    expect_known(in_other_units(companion, random, 90.0),
                 "companion in units " + std::to_string(n));
    // The same with nothing but zeros below: the last state is driven by nothing.
    Known cut = companion;
    cut.B.setZero();
    cut.B(0, 0) = 1.0;
    cut.A.row(n - 1).setZero();
    cut.reached = 1;
    cut.stabilizable = n == 1;
    expect_known(in_other_units(cut, random, 90.0), "cut " + std::to_string(n));
  }
}

// diag(1, 2) τ with B = [1; 1], for every τ that a double holds; and one input of any size.
TEST(ReachUnits, EveryUnitOfTimeAndInput) {
  for (int exponent = -307; exponent <= 307; exponent += 2) {
    const double unit = std::pow(10.0, exponent);
    const MatrixXd A = VectorXd{{unit, 2.0 * unit}}.asDiagonal();
    const MatrixXd ones = MatrixXd::Ones(2, 1);
    for (const TimeDomain domain : {TimeDomain::continuous, TimeDomain::discrete}) {
      const auto reach = analyze_controllability(A, ones, domain).value();
      EXPECT_TRUE(reach.controllable) << exponent << describe(reach);
      EXPECT_EQ(reach.stabilizable, true) << exponent;
      EXPECT_TRUE(analyze_observability(A, ones.transpose(), domain)->observable) << exponent;
      EXPECT_EQ(analyze_modes(A, domain)->stability, domain == TimeDomain::discrete && unit < 0.5
                                                         ? Stability::stable
                                                         : Stability::unstable)
          << exponent;
    }
    const MatrixXd one = MatrixXd::Constant(1, 1, -1.0);
    EXPECT_TRUE(analyze_controllability(one, unit * one, TimeDomain::continuous)->controllable)
        << exponent;
    MatrixXd uneven = ones;
    uneven(0, 0) = unit;
    EXPECT_TRUE(analyze_controllability(VectorXd{{1.0, 2.0}}.asDiagonal().toDenseMatrix(), uneven,
                                        TimeDomain::continuous)
                    ->controllable)
        << exponent;
  }
}

// Two parts with modes 3, -2 and 2, -1 whose speeds are 100 decades apart, moved and shown by one
// input and output; and with one of the slow modes out of the input's reach.
TEST(ReachUnits, PartsOfUnlikeSpeeds) {
  MatrixXd A = MatrixXd::Zero(4, 4);
  A.topLeftCorner(2, 2) << 1e-50, 3e-50, 2e-50, 0.0;
  A.bottomRightCorner(2, 2) << 1e50, 2e50, 1e50, 0.0;
  const MatrixXd ones = MatrixXd::Ones(4, 1);
  EXPECT_TRUE(analyze_controllability(A, ones, TimeDomain::continuous)->controllable);
  const MatrixXd C{{1.0, 2.0, 1.0, 2.0}};
  EXPECT_TRUE(analyze_observability(A, C, TimeDomain::continuous)->observable);
  // [1 -1] [1 2; 3 0] = -2 [1 -1], and [1 -1] [1; 1] = 0.
  A.topLeftCorner(2, 2) << 1e-50, 2e-50, 3e-50, 0.0;
  const auto cut = analyze_controllability(A, ones, TimeDomain::continuous).value();
  EXPECT_FALSE(cut.controllable) << describe(cut);
}

// Any finite entries: an answer or a refusal, and never a crash.
TEST(ReachUnits, IsTotal) {
  const double palette[] = {0.0,      1.0,    -1.0,   2.220446049250313e-16,
                            5e-324,   1e-320, 1e-160, 1e20,
                            -1e154,   1e155,  1e-154, 1.7e308,
                            -1.7e308, 1e300};
  Random random(2103);
  int answered = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const auto entry = [&] {
      return random.uniform() < 0.5 ? 0.0
                                    : palette[static_cast<std::size_t>(random.uniform() * 13.999)];
    };
    const Index n = 1 + trial % 6;
    const Index m = 1 + trial % 2;
    ContinuousSystem<> system{MatrixXd::NullaryExpr(n, n, entry),
                              MatrixXd::NullaryExpr(n, m, entry),
                              MatrixXd::NullaryExpr(m, n, entry), MatrixXd::Zero(m, m)};
    const TimeDomain domain = trial % 3 == 0 ? TimeDomain::discrete : TimeDomain::continuous;
    const auto structure = analyze_structure(system, domain);
    if (!structure) {
      EXPECT_TRUE(structure.error().is(SystemError::no_convergence));
      continue;
    }
    ++answered;
    EXPECT_FALSE(describe(structure->controllability).empty());
    EXPECT_FALSE(describe(structure->observability).empty());
    EXPECT_FALSE(describe(structure->modes).empty());
    EXPECT_TRUE(structure->controllability.hidden.allFinite());
    EXPECT_TRUE(structure->observability.hidden.allFinite());
    EXPECT_FALSE(std::isnan(structure->controllability.matrix_condition));
    for (const ModeReach& mode : structure->controllability.modes) {
      EXPECT_TRUE(std::isfinite(mode.distance)) << trial;
    }
  }
  EXPECT_GT(answered, 2900);
}

// Columns of [C; CA] whose squares no double holds: σ_max/σ_min of diag(1, 1e160) and its like.
TEST(ReachUnits, ConditionsBeyondTheRootOfTheRange) {
  for (const double far : {1e20, 1e120, 1e155, 1e160, 1e300}) {
    const ContinuousSystem<> chain{MatrixXd{{0.0, far}, {0.0, 0.0}}, MatrixXd{{0.0}, {1.0}},
                                   MatrixXd::Identity(2, 2), MatrixXd::Zero(2, 1)};
    const auto found = analyze_structure(chain, TimeDomain::continuous).value();
    // [B AB] = [0 far; 1 0], and [C; CA] has the columns (1, 0, 0, 0) and (0, 1, far, 0).
    EXPECT_NEAR(found.controllability.matrix_condition / far, 1.0, 1e-12) << far;
    EXPECT_NEAR(found.observability.matrix_condition / far, 1.0, 1e-12) << far;
  }
  // What is not reached has no condition at any scale.
  const ContinuousSystem<> cut{MatrixXd{{0.0, 0.0}, {0.0, 1e160}}, MatrixXd{{0.0}, {1.0}},
                               MatrixXd::Identity(2, 2), MatrixXd::Zero(2, 1)};
  EXPECT_EQ(analyze_structure(cut, TimeDomain::continuous)->controllability.matrix_condition,
            INFINITY);
}

// ±1.7e308 in one row and column meet in sums; the modes ±1 of [0 1e308; 1e-308 0] are none of
// the entries.
TEST(ReachUnits, ModesOfExtremeEntries) {
  const MatrixXd A{{0.0, 1e308}, {1e-308, 0.0}};
  const auto modes = analyze_modes(A, TimeDomain::continuous).value();
  EXPECT_NEAR(modes.modes[0].pole.real(), 1.0, 1e-14);
  EXPECT_NEAR(modes.modes[1].pole.real(), -1.0, 1e-14);
  // 1e308 (-1 ± i): a double holds |s|, but not its square.
  const MatrixXd B{{-1e308, 1e308}, {-1e308, -1e308}};
  const auto fast = analyze_modes(B, TimeDomain::continuous).value();
  EXPECT_NEAR(fast.modes[0].damping_ratio, 1.0 / std::numbers::sqrt2, 1e-14);
  EXPECT_EQ(fast.stability, Stability::stable);
  const auto beyond = analyze_modes(MatrixXd::Constant(2, 2, 1.7e308), TimeDomain::continuous);
  ASSERT_FALSE(beyond.has_value());
  EXPECT_TRUE(beyond.error().is(SystemError::no_convergence));
}

}  // namespace
}  // namespace flyball::reach_units_test
