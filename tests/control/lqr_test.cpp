#include <flyball/control/lqr.hpp>

#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include <flyball/control/continuous_lqr.hpp>
#include <flyball/core/random.hpp>
#include <flyball/math/riccati/riccati.hpp>
#include <flyball/mechanisms/arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/systems/discretize.hpp>

#include "support/laws.hpp"
#include "support/oracle.hpp"
#include "support/random_systems.hpp"

namespace flyball::lqr_test {
namespace {

using namespace flyball::literals;
using test::random_matrix;

TEST(Bryson, IsOneOverTheSquares) {
  const Eigen::MatrixXd Q = bryson({0.02, 0.4}).value();
  EXPECT_DOUBLE_EQ(Q(0, 0), 2500.0);
  EXPECT_DOUBLE_EQ(Q(1, 1), 6.25);
  EXPECT_EQ(Q(0, 1), 0.0);
  EXPECT_DOUBLE_EQ(bryson({2.0}, 3.0).value()(0, 0), 0.75);
}

// Section 7.7.4: an infinite tolerance does not care.
TEST(Bryson, InfinityDoesNotMatter) {
  const Eigen::MatrixXd Q = bryson({20.0, std::numeric_limits<double>::infinity()}).value();
  EXPECT_DOUBLE_EQ(Q(0, 0), 0.0025);
  EXPECT_EQ(Q(1, 1), 0.0);
}

TEST(Bryson, RefusesAndNamesTheEntry) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto zero = bryson({0.02, 0.0});
  EXPECT_TRUE(zero.error().is(ArgumentError::not_positive));
  EXPECT_EQ(zero.error().subject(), "tolerance 1");
  EXPECT_TRUE(bryson({-1.0}).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(
      bryson({-std::numeric_limits<double>::infinity()}).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(bryson({nan}).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(bryson({1e-200}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(bryson({}).error().is(ArgumentError::empty));
  EXPECT_TRUE(bryson({1.0}, 0.0).error().is(ArgumentError::not_positive));
}

// Scalar A = B = Q = R = 1: S² - S - 1 = 0, S the golden ratio φ, K = S/(1 + S) = 1/φ.
TEST(Lqr, GoldenRatio) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  const auto design = lqr(one, one, one, one).value();
  const double phi = 0.5 * (1.0 + std::sqrt(5.0));
  EXPECT_NEAR(design.S(0, 0), phi, 1e-14);
  EXPECT_NEAR(design.K(0, 0), 1.0 / phi, 1e-15);
  EXPECT_NEAR(design.poles(0).real(), 1.0 - 1.0 / phi, 1e-15);
}

// The book's elevator of Figures 2.3 and 6.3 (2 CIM, 6.803886 kg, r 0.02762679089 m, G 10, 5 ms),
// through the whole chain. SciPy 1.10.1: K = [[234.03740840771752, 5.603383728032011]].
TEST(Lqr, IsTheBooksElevators) {
  const auto elevator = mechanisms::elevator({.motor = mechanisms::cim(2),
                                              .gearing = 10.0,
                                              .mass = Mass(6.803886),
                                              .drum_radius = Length(0.02762679089)})
                            .value();
  const auto plant = discretize(elevator, 5_ms).value();
  const auto design = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value();
  EXPECT_NEAR(design.K(0, 0), 234.03740840771752, 1e-9 * 234.0);
  EXPECT_NEAR(design.K(0, 1), 5.603383728032011, 1e-9 * 5.6);
  EXPECT_NEAR(design.S(0, 0), 28320.65435149754, 1e-9 * 28320.0);
  EXPECT_NEAR(design.S(0, 1), 65.58743201607322, 1e-9 * 65.0);
  EXPECT_NEAR(design.S(1, 1), 6.6257289495992495, 1e-9 * 6.6);
}

// Section 7.7.2 and Figure 7.7 print K_p = 234.041, K_d = 5.603, from A and B rounded to three
// decimals; SciPy 1.10.1: K = [[234.0407372831871, 5.603455384583144]].
TEST(Lqr, IsTheBooksCostToGo) {
  Eigen::Matrix2d A;
  A << 0.0, 1.0, 0.0, -164.209;
  const Eigen::Vector2d B(0.0, 21.457);
  const auto discrete = discretize_zoh(A, B, Time(0.005)).value();
  const auto design = lqr(discrete.A, discrete.B, bryson({0.02, 0.4}), bryson({12.0})).value();
  EXPECT_NEAR(design.K(0, 0), 234.0407372831871, 1e-9 * 234.0);
  EXPECT_NEAR(design.K(0, 1), 5.603455384583144, 1e-9 * 5.6);
  EXPECT_NEAR(design.S(0, 0), 28320.687485847408, 1e-9 * 28320.0);
  EXPECT_NEAR(std::round(design.K(0, 0) * 1e3), 234041.0, 0.0);
  EXPECT_NEAR(std::round(design.K(0, 1) * 1e3), 5603.0, 0.0);
}

// The models of Figures 6.5 and 6.9, discretised (facts of the reference data).
TEST(Lqr, BooksFlywheelAndArmModels) {
  const auto flywheel = mechanisms::flywheel({.motor = mechanisms::vex_775pro(),
                                              .gearing = 2.0 / 3.0,
                                              .moment_of_inertia = MomentOfInertia(0.00032)})
                            .value();
  const auto spinning = discretize(flywheel, 5_ms).value();
  EXPECT_NEAR(spinning.A(0, 0), 0.9975024630976951, 1e-14);
  EXPECT_NEAR(spinning.B(0, 0), 0.6155494833981923, 1e-13);
  // The scalar DARE: b² S² + (r - a² r - q b²) S - q r = 0.
  const double a = spinning.A(0, 0);
  const double b = spinning.B(0, 0);
  const double q = 1.0 / (9.42 * 9.42);
  const double r = 1.0 / 144.0;
  const double half = 0.5 * (r - a * a * r - q * b * b) / (b * b);
  const double S = -half + std::sqrt(half * half + q * r / (b * b));
  const auto design = lqr(spinning, bryson({9.42}), bryson({12.0})).value();
  EXPECT_NEAR(design.K(0, 0), a * b * S / (r + b * b * S), 1e-12);

  const double l = 1.2192;
  const double m = 2.2675;
  const auto arm = mechanisms::arm({.motor = mechanisms::cim(),
                                    .gearing = 0.5,
                                    .moment_of_inertia = MomentOfInertia(m * l * l / 3.0),
                                    .mass = Mass(m),
                                    .center_of_mass = Length(0.5 * l)})
                       .value();
  const auto swinging = discretize(arm, 5_ms).value();
  EXPECT_NEAR(swinging.A(0, 1), 0.004999988140718234, 1e-15);
  EXPECT_NEAR(swinging.A(1, 1), 0.9999952562910442, 1e-15);
  EXPECT_NEAR(swinging.B(0, 0), 1.1218569984881636e-06, 1e-17);
  EXPECT_NEAR(swinging.B(1, 0), 0.00044874244461049834, 1e-16);
}

// Appendix B.1 with the cross term; SciPy 1.10.1, solve_discrete_are with s=N.
TEST(Lqr, CrossTerm) {
  Eigen::Matrix2d A;
  A << 1.0, 0.1, 0.0, 0.95;
  const Eigen::Vector2d B(0.005, 0.1);
  const Eigen::Matrix2d Q = Eigen::Vector2d(1.0, 2.0).asDiagonal();
  const Eigen::MatrixXd R = Eigen::MatrixXd::Constant(1, 1, 0.5);
  const Eigen::Vector2d N(0.1, 0.2);
  const auto design = lqr(A, B, Q, R, N).value();
  EXPECT_NEAR(design.K(0, 0), 1.2901008244447014, 1e-9 * 1.29);
  EXPECT_NEAR(design.K(0, 1), 1.9861537781532024, 1e-9 * 1.98);
  EXPECT_NEAR(design.S(0, 0), 18.31317435680366, 1e-9 * 18.3);
  EXPECT_NEAR(design.S(1, 1), 9.453799853232274, 1e-9 * 9.4);
}

// Completing the square turns N into A - B R⁻¹ Nᵀ and Q - N R⁻¹ Nᵀ, with K less R⁻¹ Nᵀ.
TEST(Lqr, CrossTermIsAChangeOfVariables) {
  Random random(8);
  for (int trial = 0; trial < 30; ++trial) {
    const Eigen::Index n = 2 + trial % 4;
    const Eigen::Index m = 1 + trial % 2;
    const Eigen::MatrixXd A = random_matrix(random, n, n) * 0.6;
    const Eigen::MatrixXd B = random_matrix(random, n, m);
    const Eigen::MatrixXd G = random_matrix(random, n + m, n + m);
    const Eigen::MatrixXd W = G * G.transpose() + 0.1 * Eigen::MatrixXd::Identity(n + m, n + m);
    const Eigen::MatrixXd Q = W.topLeftCorner(n, n);
    const Eigen::MatrixXd R = W.bottomRightCorner(m, m);
    const Eigen::MatrixXd N = W.topRightCorner(n, m);
    const Eigen::MatrixXd shift = test::solve(R, N.transpose());
    const Eigen::MatrixXd Q_shifted = Q - N * shift;
    const auto with = lqr(A, B, Q, R, N).value();
    const auto without = lqr(Eigen::MatrixXd(A - B * shift), B,
                             Eigen::MatrixXd(0.5 * (Q_shifted + Q_shifted.transpose())), R)
                             .value();
    EXPECT_LT((with.K - without.K - shift).norm(), 1e-9 * (1.0 + with.K.norm()));
    EXPECT_LT((with.S - without.S).norm(), 1e-9 * with.S.norm());
  }
}

// xᵀ S x is the cost that the closed loop runs up, and no other stabilising gain has less.
TEST(Lqr, CostToGo) {
  Random random(17);
  const Eigen::MatrixXd A = random_matrix(random, 3, 3) * 0.7;
  const Eigen::MatrixXd B = random_matrix(random, 3, 2);
  const Eigen::MatrixXd Q = Eigen::MatrixXd::Identity(3, 3);
  const Eigen::MatrixXd R = Eigen::MatrixXd::Identity(2, 2);
  const auto design = lqr(A, B, Q, R).value();
  const Eigen::VectorXd x0 = random_matrix(random, 3, 1);
  const auto cost = [&](const Eigen::MatrixXd& K) {
    Eigen::VectorXd x = x0;
    double sum = 0.0;
    for (int k = 0; k < 3000; ++k) {
      const Eigen::VectorXd u = -K * x;
      sum += x.dot(Q * x) + u.dot(R * u);
      x = (A * x + B * u).eval();
    }
    return sum;
  };
  const double best = x0.dot(design.S * x0);
  EXPECT_NEAR(cost(design.K), best, 1e-10 * best);
  for (int trial = 0; trial < 20; ++trial) {
    EXPECT_GT(cost(design.K + 0.01 * random_matrix(random, 2, 3)), best);
  }
}

TEST(Lqr, FixedIsDynamic) {
  const auto elevator = mechanisms::elevator({.kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.6}).value();
  const auto plant = discretize(elevator, 20_ms).value();
  const auto fixed = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value();
  const auto dynamic = lqr(plant.A, plant.B, bryson({0.02, 0.4}), bryson({12.0})).value();
  static_assert(decltype(fixed.K)::RowsAtCompileTime == 1);
  static_assert(decltype(fixed.K)::ColsAtCompileTime == 2);
  EXPECT_EQ(Eigen::MatrixXd(fixed.K), dynamic.K);
  EXPECT_EQ(Eigen::MatrixXd(fixed.S), dynamic.S);
  const Eigen::Vector2d N(0.0, 0.0);
  EXPECT_LT((lqr(plant, bryson({0.02, 0.4}), bryson({12.0}), N).value().K - fixed.K).norm(),
            1e-10 * fixed.K.norm());
}

template <class... Arguments>
constexpr bool accepted = requires(Arguments... arguments) { lqr(arguments...); };

TEST(Lqr, TakesOnlyDiscretePlants) {
  static_assert(accepted<DiscreteSystem<2, 1, 1>, Weight, Weight>);
  static_assert(!accepted<ContinuousSystem<2, 1, 1>, Weight, Weight>);
  static_assert(!accepted<mechanisms::Elevator, Weight, Weight>);
  static_assert(!accepted<mechanisms::Elevator, Expected<Eigen::MatrixXd>, Eigen::Matrix2d>);
  SUCCEED();
}

TEST(Lqr, Errors) {
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(2, 2);
  const Eigen::MatrixXd B = Eigen::Vector2d(0.0, 1.0);
  const Eigen::MatrixXd r = Eigen::MatrixXd::Ones(1, 1);
  EXPECT_EQ(to_string(lqr(I, B, I, I).error()), "lqr: R is 2x2; it must be inputs x inputs (1x1)");
  EXPECT_EQ(to_string(lqr(I, B, r, r).error()), "lqr: Q is 1x1; it must be states x states (2x2)");
  EXPECT_TRUE(lqr(I, Eigen::MatrixXd::Ones(3, 1), I, r).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(lqr(Eigen::MatrixXd::Ones(2, 3), B, I, r).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(lqr(Eigen::MatrixXd(0, 0), B, I, r).error().is(ArgumentError::empty));
  EXPECT_EQ(to_string(lqr(I, B, I, r, Eigen::RowVector2d(0.0, 0.0)).error()),
            "lqr: N is 1x2; it must be states x inputs (2x1)");
  Eigen::MatrixXd skew = I;
  skew(1, 0) = 0.5;
  const auto asymmetric = lqr(I, B, skew, r);
  EXPECT_TRUE(asymmetric.error().is(ArgumentError::not_symmetric));
  EXPECT_EQ(asymmetric.error().where(), "lqr");
  Eigen::MatrixXd bad = I;
  bad(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(lqr(bad, B, I, r).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(lqr(I, B, bad, r).error().is(ArgumentError::not_finite));
  EXPECT_EQ(lqr(I, B, bryson({0.0, 1.0}), r).error().where(), "bryson");
  EXPECT_EQ(lqr(I, B, I, bryson({-1.0})).error().where(), "bryson");
}

// x₁ grows by 1.1 a step and no input reaches it.
TEST(Lqr, SaysWhichModeNothingReaches) {
  const Eigen::Matrix2d A = Eigen::Vector2d(1.1, 0.5).asDiagonal();
  const Eigen::Vector2d B(0.0, 1.0);
  const auto design = lqr(A, B, Eigen::Matrix2d::Identity(), Eigen::MatrixXd::Ones(1, 1));
  ASSERT_FALSE(design.has_value());
  EXPECT_TRUE(design.error().is(RiccatiError::not_stabilizable));
  EXPECT_EQ(design.error().where(), "lqr");
  EXPECT_EQ(design.error().kind(), ErrorKind::no_answer);
  ASSERT_FALSE(design.error().evidence().empty());
  EXPECT_NEAR(design.error().evidence().front().values.front(), 1.1, 1e-9);
}

// (R + BᵀSB) K = BᵀSA + Nᵀ, or R K = BᵀS + Nᵀ for a continuous plant, entry by entry against the
// terms; A - BK is stable, and its eigenvalues are the poles.
TEST(Lqr, GainIsItsFormula) {
  for (const test::Plane plane : {test::Plane::s, test::Plane::z}) {
    const bool continuous = plane == test::Plane::s;
    test::RandomSystems systems(61, plane);
    test::Refusals refusals;
    test::Law gain("gain");
    test::Law poles("pole");
    test::Law sum("sum of the poles");
    for (int trial = 0; trial < 10000; ++trial) {
      const test::RandomSystem s = systems.next();
      const auto design =
          continuous ? continuous_lqr(s.A, s.B, s.Q, s.R, s.N) : lqr(s.A, s.B, s.Q, s.R, s.N);
      if (!design) {
        refusals.add(design.error(), trial, s);
        continue;
      }
      const test::LongMatrix B = test::wide(s.B).transpose();
      const test::LongMatrix S = test::wide(design->S);
      const test::LongMatrix K = test::wide(design->K);
      const test::LongMatrix R = test::wide(s.R);
      const auto sides = [&](const auto& of) {
        const test::LongMatrix BS = of(B) * of(S);
        const test::LongMatrix weight =
            continuous ? of(R) : test::LongMatrix(of(R) + BS * of(test::wide(s.B)));
        const test::LongMatrix right =
            (continuous ? BS : test::LongMatrix(BS * of(test::wide(s.A)))) +
            of(test::wide(s.N).transpose());
        return std::pair(test::LongMatrix(weight * of(K)), right);
      };
      const auto [left, right] = sides([](const auto& M) { return test::LongMatrix(M); });
      const auto [a, b] = sides([](const auto& M) { return test::LongMatrix(M.cwiseAbs()); });
      const test::LongMatrix size = (a + b).cwiseMax(1e-300L);
      gain.holds((left - right).cwiseAbs().cwiseQuotient(size).maxCoeff(), trial, s);
      const test::RandomSystem p = test::plain(s);
      const Eigen::MatrixXd K_plain =
          s.inputs.asDiagonal() * design->K * s.states.cwiseInverse().asDiagonal();
      const Eigen::MatrixXd loop =
          (test::wide(p.A) - test::wide(p.B) * test::wide(K_plain)).cast<double>();
      const Eigen::VectorXcd found = test::eigenvalues(loop);
      const auto worst = [&](const Eigen::VectorXcd& values) {
        return continuous ? values.real().maxCoeff() : values.cwiseAbs().maxCoeff() - 1.0;
      };
      poles.holds(std::max(worst(found), worst(design->poles)), trial, s);
      sum.holds(std::abs(design->poles.sum() - loop.trace()) /
                    (loop.norm() + p.A.norm() + (p.A - loop).norm()),
                trial, s);
    }
    refusals.expect_at_most(50);
    gain.expect_within(1e-13);
    poles.expect_within(0.0);
    sum.expect_within(1e-11);
  }
}

}  // namespace
}  // namespace flyball::lqr_test
