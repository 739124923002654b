#include <flyball/systems/realization.hpp>

#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include <flyball/systems/gramian.hpp>
#include <flyball/systems/norms.hpp>

#include "support/oracle.hpp"
#include "systems/random_systems.hpp"

namespace flyball::realization_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;

DiscreteSystem<> random_discrete(Random& random, Index n, Index m, Index p) {
  const auto s = test::random_system(random, n, m, p);
  const double radius = test::eigenvalues(s.A).cwiseAbs().maxCoeff();
  return {s.A * (random.uniform(0.3, 0.95) / radius), s.B, s.C, s.D, Time(0.02)};
}

/// Relative difference of two transfer matrices on a few points.
template <class First, class Second>
double difference(const First& first, const Second& second) {
  double largest = 0.0;
  for (const Complex s : {Complex(0.3, 0.9), Complex(0.0, 3.0), Complex(1.5, 0.2)}) {
    const auto expected = test::response(first, s);
    largest =
        std::max(largest, (test::response(second, s) - expected).norm() / (1.0 + expected.norm()));
  }
  return largest;
}

TEST(Realization, SimilarityTransform) {
  Random random(121);
  for (int trial = 0; trial < 1000; ++trial) {
    const Index n = 1 + trial % 5;
    const auto s = test::random_system(random, n, 1 + trial % 2, 1 + trial % 3);
    const MatrixXd T = test::random_scales(random, n, 8.0).asDiagonal() *
                       test::random_rotation(random, n) *
                       test::random_scales(random, n, 8.0).asDiagonal();
    const auto moved = similarity_transform(s, T);
    ASSERT_TRUE(moved.has_value()) << to_string(moved.error());
    EXPECT_LT((moved->C - s.C * T).norm(), 1e-12 * moved->C.norm() + 1e-300);
    // Row by row: T may hold 16 decades.
    const MatrixXd left = T * moved->A;
    const MatrixXd right = s.A * T;
    for (Index j = 0; j < n; ++j) {
      EXPECT_LT(
          (left.col(j) - right.col(j)).norm(),
          1e-9 * (T.cwiseAbs() * moved->A.col(j).cwiseAbs() + s.A.cwiseAbs() * T.col(j).cwiseAbs())
                     .norm());
    }
  }
  const auto s = test::random_system(random, 2, 1, 1);
  EXPECT_TRUE(
      similarity_transform(s, MatrixXd::Ones(2, 2)).error().is(SystemError::singular_transform));
  EXPECT_TRUE(
      similarity_transform(s, MatrixXd::Zero(2, 2)).error().is(SystemError::singular_transform));
  EXPECT_TRUE(
      similarity_transform(s, MatrixXd::Identity(3, 3)).error().is(ArgumentError::wrong_shape));
}

// (2s + 3)/(s² + 3s + 2) from its modal form, in both canonical forms.
TEST(Realization, CanonicalFormsInClosedForm) {
  ContinuousSystem<> modal{MatrixXd::Zero(2, 2), MatrixXd::Ones(2, 1), MatrixXd::Ones(1, 2),
                           MatrixXd::Zero(1, 1)};
  modal.A(0, 0) = -1.0;
  modal.A(1, 1) = -2.0;
  const auto controllable = controllable_canonical_form(modal).value();
  MatrixXd A(2, 2);
  A << 0.0, 1.0, -2.0, -3.0;
  EXPECT_LT((controllable.A - A).norm(), 1e-14);
  EXPECT_EQ(controllable.B, MatrixXd(Eigen::Vector2d(0.0, 1.0)));
  EXPECT_LT((controllable.C - Eigen::RowVector2d(3.0, 2.0)).norm(), 1e-14);
  const auto observable = observable_canonical_form(modal).value();
  EXPECT_LT((observable.A - A.transpose()).norm(), 1e-14);
  EXPECT_LT((observable.B - Eigen::Vector2d(3.0, 2.0)).norm(), 1e-14);
  EXPECT_EQ(observable.C, MatrixXd(Eigen::RowVector2d(0.0, 1.0)));
}

TEST(Realization, CanonicalFormsKeepTheTransfer) {
  Random random(122);
  for (int trial = 0; trial < 1000; ++trial) {
    const Index n = 1 + trial % 5;
    auto s = test::random_system(random, n, 1, 1 + trial % 2);
    const double rate = std::pow(10.0, random.uniform(-2.0, 2.0));
    s.A *= rate;
    const auto form = controllable_canonical_form(s);
    if (!form) {
      EXPECT_TRUE(form.error().is(SystemError::not_controllable));
      continue;
    }
    for (const Complex p : {Complex(0.3, 0.9), Complex(0.0, 3.0)}) {
      const auto expected = test::response(s, rate * p);
      EXPECT_LT((test::response(*form, rate * p) - expected).norm(), 1e-6 * (1.0 + expected.norm()))
          << trial;
    }
    const DiscreteSystem<> d{s.A.transpose(), s.C.transpose(), s.B.transpose(), s.D.transpose(),
                             Time(0.1)};
    const auto observable = observable_canonical_form(d);
    EXPECT_EQ(observable.value().A, MatrixXd(form->A.transpose()));
    EXPECT_EQ(observable->period.si(), 0.1);
  }
}

TEST(Realization, BalancedGramiansAreEqualAndDiagonal) {
  Random random(123);
  for (int trial = 0; trial < 1000; ++trial) {
    const Index n = 1 + trial % 6;
    const auto s = test::rescaled(test::random_stable_system(random, n, 1 + trial % 2, 2),
                                  test::random_scales(random, n, trial % 3 == 0 ? 6.0 : 0.0));
    const auto balanced = balanced_realization(s);
    ASSERT_TRUE(balanced.has_value()) << to_string(balanced.error());
    const MatrixXd sigma = balanced->hankel.asDiagonal();
    const double small = 1e-9 * balanced->hankel(0) *
                         std::max(1.0, 1e-3 * balanced->hankel(0) / balanced->hankel(n - 1));
    const auto& b = balanced->system;
    EXPECT_LT((controllability_gramian(b.A, b.B, TimeDomain::continuous)->W - sigma).norm(), small);
    EXPECT_LT((observability_gramian(b.A, b.C, TimeDomain::continuous)->W - sigma).norm(), small);
    EXPECT_LT((balanced->T_inverse * balanced->T - MatrixXd::Identity(n, n)).norm(), 1e-7);
    EXPECT_EQ(balanced->error_bound, 0.0);
    const auto d = random_discrete(random, n, 1, 1);
    const auto sampled = balanced_realization(d).value();
    EXPECT_LT(
        (controllability_gramian(sampled.system.A, sampled.system.B, TimeDomain::discrete)->W -
         MatrixXd(sampled.hankel.asDiagonal()))
            .norm(),
        1e-7 * sampled.hankel(0));
    EXPECT_LT(difference(d, sampled.system), 1e-7);
  }
}

// Glover and Enns: ‖G - G_r‖∞ <= 2 Σσ of what was left out, and at least its first σ.
TEST(Realization, TruncationKeepsItsBound) {
  Random random(124);
  for (int trial = 0; trial < 1000; ++trial) {
    const Index n = 2 + trial % 6;
    const auto s = test::random_stable_system(random, n, 1, 1, 0.5);
    const Index r = 1 + trial % (n - 1);
    const auto reduced = balanced_truncation(s, r).value();
    EXPECT_EQ(reduced.system.A.rows(), r);
    EXPECT_LT(test::eigenvalues(reduced.system.A).real().maxCoeff(), 1e-12);
    double error = 0.0;
    for (int k = 0; k < 40; ++k) {
      const Complex at(0.0, std::pow(10.0, -2.0 + 0.1 * k));
      error = std::max(
          error, std::abs(test::response(s, at)(0, 0) - test::response(reduced.system, at)(0, 0)));
    }
    EXPECT_LE(error, reduced.error_bound * (1.0 + 1e-9) + 1e-12);
    EXPECT_LT((reduced.T_inverse * reduced.T - MatrixXd::Identity(r, r)).norm(), 1e-7);
  }
}

// What was hidden is found, and the transfer function stays.
TEST(Realization, MinimalRealization) {
  Random random(125);
  for (int trial = 0; trial < 1000; ++trial) {
    const Index r = 1 + trial % 4;
    const Index u = trial % 3;
    const Index o = trial % 2;
    const Index n = r + u + o;
    // [A_ro 0 A_13; A_21 A_rō A_23; 0 0 A_u], B = [B_1; B_2; 0], C = [C_1 0 C_3].
    auto s = test::random_system(random, n, 1 + trial % 2, 1);
    s.A.block(0, r, r, o).setZero();
    s.A.bottomLeftCorner(u, r + o).setZero();
    s.B.bottomRows(u).setZero();
    s.C.middleCols(r, o).setZero();
    const MatrixXd Q = test::random_rotation(random, n);
    const ContinuousSystem<> hidden{Q * s.A * Q.transpose(), Q * s.B, s.C * Q.transpose(), s.D};
    const auto turned =
        test::rescaled(hidden, test::random_scales(random, n, trial % 5 == 0 ? 6.0 : 0.0));
    const auto found = minimal_realization(turned).value();
    ASSERT_EQ(found.system.A.rows(), r) << trial;
    EXPECT_EQ(found.unreached, u);
    EXPECT_EQ(found.unseen, o);
    EXPECT_LT(difference(hidden, found.system), 1e-6) << trial;
    if (u + o == 0) {
      EXPECT_EQ(found.system.A, turned.A);
    }
    const DiscreteSystem<> d{turned.A, turned.B, turned.C, turned.D, Time(0.1)};
    EXPECT_EQ(minimal_realization(d).value().system.A, found.system.A);
  }
}

TEST(Realization, EdgesAndErrors) {
  const MatrixXd one = MatrixXd::Ones(1, 1);
  const MatrixXd zero = MatrixXd::Zero(1, 1);
  const ContinuousSystem<> deaf{-one, zero, one, 2.0 * one};
  const auto gain = minimal_realization(deaf).value();
  EXPECT_EQ(gain.system.A.rows(), 0);
  EXPECT_EQ(gain.system.D(0, 0), 2.0);
  EXPECT_TRUE(controllable_canonical_form(deaf).error().is(SystemError::not_controllable));
  EXPECT_TRUE(observable_canonical_form(ContinuousSystem<>{-one, one, zero, zero})
                  .error()
                  .is(SystemError::not_observable));
  EXPECT_TRUE(balanced_realization(deaf).error().is(SystemError::not_controllable));
  EXPECT_TRUE(balanced_truncation(deaf, 1).error().is(ArgumentError::out_of_range));
  const ContinuousSystem<> integrator{zero, one, one, zero};
  EXPECT_TRUE(balanced_realization(integrator).error().is(SystemError::not_stable));
  EXPECT_TRUE(balanced_truncation(ContinuousSystem<>{-one, one, one, zero}, 2)
                  .error()
                  .is(ArgumentError::out_of_range));
  Random random(126);
  const auto wide = test::random_system(random, 2, 2, 2);
  EXPECT_TRUE(controllable_canonical_form(wide).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(observable_canonical_form(wide).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(minimal_realization(wide, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(minimal_realization(ContinuousSystem<>{}).error().is(ArgumentError::empty));
}

// dx/dt = -x + b u, y = c x: the Hankel singular value |bc|/2 and the transform √(b/c), with b, c
// whose squares are no doubles.
TEST(BalancedRealization, OfSignalsInFarUnits) {
  const auto scalar = [](double x) { return Eigen::MatrixXd::Constant(1, 1, x); };
  for (const auto& [b, c] :
       {std::pair{0x1p-600, 0x1p900}, {0x1p-900, 0x1p-101}, {0x1p1000, 0x1p-3}}) {
    const auto found =
        balanced_realization(ContinuousSystem<>{scalar(-1.0), scalar(b), scalar(c), scalar(0.0)});
    ASSERT_TRUE(found.has_value()) << b << ' ' << c << ' ' << to_string(found.error());
    EXPECT_NEAR(found->hankel(0) / (0.5 * b * c), 1.0, 1e-14);
    EXPECT_NEAR(found->T(0, 0) / std::sqrt(b) * std::sqrt(c), found->T(0, 0) > 0.0 ? 1.0 : -1.0,
                1e-14);
    EXPECT_NEAR(found->T(0, 0) * found->T_inverse(0, 0), 1.0, 1e-14);
  }
}

// A = 2.3e-308 in states that are 1e40 apart stays what it is.
TEST(BalancedRealization, OfASubnormalPlant) {
  const auto scalar = [](double x) { return Eigen::MatrixXd::Constant(1, 1, x); };
  const auto found = balanced_realization(
      DiscreteSystem<>{scalar(2.3e-308), scalar(1e100), scalar(1e20), scalar(0.0), Time(1.0)});
  ASSERT_TRUE(found.has_value()) << to_string(found.error());
  EXPECT_EQ(found->system.A(0, 0), 2.3e-308);
}

// T B' = B where the rows of T are 1e154 apart and B has no room for products: the last row says
// x₀ = -0.75e-154 x₂, which is not nothing.
TEST(Realization, SimilarityTransformOfLargeInputs) {
  Eigen::MatrixXd T(3, 3);
  T << -1e20, 1.0, -1.25, 1.0, 2.0, 0.0, 1e154, 1e-154, 0.75;
  Eigen::MatrixXd A = Eigen::Vector3d(2.0, 0.125, 2.0).asDiagonal();
  const Eigen::Vector3d B(-1.5, 1.7e308, 1.25);
  const ContinuousSystem<> plant{A, B, Eigen::MatrixXd::Zero(1, 3), Eigen::MatrixXd::Zero(1, 1)};
  const auto found = similarity_transform(plant, T);
  ASSERT_TRUE(found.has_value()) << to_string(found.error());
  const Eigen::VectorXd x = found->B.col(0);
  EXPECT_NEAR(x(1) / 0.85e308, 1.0, 1e-14);
  EXPECT_NEAR(x(2) / 0.68e308, 1.0, 1e-14);
  EXPECT_NEAR(x(0) / -0.51e154, 1.0, 1e-14);
}

// States in units 1e169 apart, whose couplings a unit for all of A would lose.
TEST(Realization, StatesFarApart) {
  const MatrixXd A{{-1.35614013671875, 1.0104980468749999e+169}, {-1.695556640625e-170, -1.0}};
  const ContinuousSystem<> system{A, MatrixXd{{-0.41131591796875}, {0.0}}, MatrixXd{{1.0, 1e169}},
                                  MatrixXd::Zero(1, 1)};
  const auto found = balanced_realization(system).value();
  EXPECT_NEAR(found.system.A.determinant(), A.determinant(), 1e-13);
  EXPECT_NEAR(found.system.A.trace(), A.trace(), 1e-13);
}

// A pole of 2.3e-308 keeps its digits on the way through units of 2^33.
TEST(Realization, APoleAtTheEndOfTheDoubles) {
  const DiscreteSystem<> system{MatrixXd::Constant(1, 1, 2.3e-308), MatrixXd{{-1e20, 0.0, 0.0}},
                                MatrixXd{{-1.02197265625}, {-1.326904296875}, {-0.077392578125}},
                                MatrixXd::Zero(3, 3), Time(1e6)};
  const auto found = balanced_realization(system).value();
  EXPECT_NEAR(found.system.A(0, 0) / 2.3e-308, 1.0, 1e-15);
}

}  // namespace
}  // namespace flyball::realization_test
