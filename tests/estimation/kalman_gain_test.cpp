#include <flyball/estimation/kalman_gain.hpp>

#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/riccati/riccati.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

#include "support/laws.hpp"
#include "support/oracle.hpp"
#include "support/random_systems.hpp"

namespace flyball::kalman_gain_test {
namespace {

using test::random_matrix;

// A scalar random walk, A = C = 1, Q = q, R = r: P² - q P - q r = 0, so
// P = (q + sqrt(q² + 4 q r))/2 and K = P/(P + r). With q = 1, r = 2: P = 2, K = 1/2, P⁺ = 1.
TEST(KalmanGain, ScalarRandomWalk) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  const auto gain = kalman_gain(one, one, one, 2.0 * one).value();
  EXPECT_NEAR(gain.P_prior(0, 0), 2.0, 1e-14);
  EXPECT_NEAR(gain.K(0, 0), 0.5, 1e-15);
  EXPECT_NEAR(gain.L(0, 0), 0.5, 1e-15);
  EXPECT_NEAR(gain.P_posterior(0, 0), 1.0, 1e-14);
  EXPECT_NEAR(std::abs(gain.poles(0) - 0.5), 0.0, 1e-14);
}

// The book's elevator at 5 ms with the densities of Figure 6.3. SciPy 1.10.1, solve_discrete_are of
// the dual with the discretised covariances (the numbers are facts of the reference data).
TEST(KalmanGain, IsTheBooksElevators) {
  Eigen::Matrix2d A;
  A << 0.0, 1.0, 0.0, -164.20904979369794;
  const Eigen::Vector2d B(0.0, 21.457377744727182);
  const Eigen::RowVector2d C(1.0, 0.0);
  const Time period(0.005);
  const auto discrete = discretize_zoh(A, B, period).value();
  const auto Q = discretize(A, ProcessDensity{Eigen::Vector2d(0.0025, 1.0).asDiagonal()}, period);
  const auto R = discretize(MeasurementDensity{Eigen::MatrixXd::Constant(1, 1, 1e-8)}, period);
  Eigen::Matrix2d Q_gold;
  Q_gold << 1.2523533144658724e-05, 5.815620154546034e-06, 5.815620154546034e-06,
      0.0024554829652557965;
  EXPECT_LT((Q.value() - Q_gold).norm(), 1e-12 * Q_gold.norm());
  EXPECT_NEAR(R.value()(0, 0), 2e-6, 1e-20);

  const auto gain = kalman_gain(discrete.A, C, Q, R).value();
  EXPECT_NEAR(gain.K(0, 0), 0.8774731314610419, 1e-9 * 0.877);
  EXPECT_NEAR(gain.K(1, 0), 0.6715538384088243, 1e-9 * 0.671);
  Eigen::Matrix2d P;
  P << 1.432295041772075e-05, 1.0961740007177293e-05, 1.0961740007177293e-05, 0.0030431321371697665;
  EXPECT_LT((gain.P_prior - P).norm(), 1e-9 * P.norm());
}

// Random plants: P satisfies its equation, the gain forms agree, the estimator is stable, and the
// posterior is (I - K C) P.
TEST(KalmanGain, SatisfiesItsEquations) {
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Index n = 1 + trial % 5;
    const Eigen::Index p = 1 + trial % 2;
    const Eigen::MatrixXd A = random_matrix(random, n, n) * 0.7;
    const Eigen::MatrixXd C = random_matrix(random, p, n);
    const Eigen::MatrixXd G = random_matrix(random, n, n);
    const Eigen::MatrixXd H = random_matrix(random, p, p);
    const Eigen::MatrixXd Q = G * G.transpose();
    const Eigen::MatrixXd R = H * H.transpose() + 0.1 * Eigen::MatrixXd::Identity(p, p);
    const auto gain = kalman_gain(A, C, Q, R).value();
    const Eigen::MatrixXd& P = gain.P_prior;
    const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(n, n);
    const double size = P.norm() * (1.0 + A.norm() * A.norm());
    EXPECT_LT((A * gain.P_posterior * A.transpose() + Q - P).norm(), 1e-11 * size);
    EXPECT_LT((gain.P_posterior - (I - gain.K * C) * P).norm(), 1e-11 * size);
    EXPECT_LT((gain.L - A * gain.K).norm(), 1e-10 * (1.0 + gain.L.norm()));
    EXPECT_LT((gain.K * (C * P * C.transpose() + R) - P * C.transpose()).norm(), 1e-11 * size);
    EXPECT_LT(gain.poles.cwiseAbs().maxCoeff(), 1.0);
    const Eigen::VectorXcd expected = test::eigenvalues(A - gain.L * C);
    for (const auto& pole : expected) {
      EXPECT_LT((gain.poles.array() - pole).abs().minCoeff(), 1e-7);
    }
  }
}

// x₂ shows x₁ of the last sample to 1e-20, so x₁ is known but for what has come since: P₁₁ = q +
// a²p with p = qr/(q + r) = 1/2, P₂₂ = g²p, P₁₂ = a g p; K₁₁ = p/r.
TEST(KalmanGain, StatesOfFarUnits) {
  const double a = 0.5;
  const double g = -1e20;
  Eigen::Matrix2d A;
  A << a, 0.0, g, 0.0;
  const Eigen::Matrix2d I = Eigen::Matrix2d::Identity();
  const auto gain = kalman_gain(A, I, I, I).value();
  EXPECT_NEAR(gain.P_prior(0, 0), 1.125, 1e-14);
  EXPECT_NEAR(gain.P_prior(1, 1) / (0.5 * g * g), 1.0, 1e-14);
  EXPECT_NEAR(gain.P_prior(0, 1) / (0.5 * a * g), 1.0, 1e-14);
  EXPECT_NEAR(gain.K(0, 0), 0.5, 1e-14);
  EXPECT_NEAR(gain.K(1, 1), 1.0, 1e-14);
  EXPECT_NEAR(gain.P_posterior(1, 1), 1.0, 1e-12);
}

// Outputs that show everything without noise: K = C⁻¹, and A - LC = 0, also where an output is
// 1e-100 of a state.
TEST(KalmanGain, OutputsWithoutNoise) {
  Eigen::Matrix2d A;
  A << -1.9, 0.9, 0.0, -1.9;
  Eigen::Matrix2d C;
  C << 2.0, 1.0, 0.0, -1e-100;
  const auto gain = kalman_gain(A, C, Eigen::Matrix2d::Identity(), Eigen::Matrix2d::Zero());
  ASSERT_TRUE(gain.has_value()) << to_string(gain.error());
  EXPECT_NEAR(gain->K(0, 0), 0.5, 1e-14);
  EXPECT_NEAR(gain->K(0, 1) / 5e99, 1.0, 1e-14);
  EXPECT_NEAR(gain->K(1, 1) / -1e100, 1.0, 1e-14);
  EXPECT_LT(gain->poles.cwiseAbs().maxCoeff(), 1e-7);
}

TEST(KalmanGain, FixedIsDynamic) {
  const auto elevator = mechanisms::elevator({.kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.6}).value();
  const auto plant = discretize<2, 1, 1>(elevator, Time(0.02)).value();
  const auto Q = standard_deviations({0.01, 0.1});
  const auto R = standard_deviations({1e-3});
  const auto fixed = kalman_gain(plant, Q, R).value();
  const auto dynamic = kalman_gain(plant.A, plant.C, Q, R).value();
  EXPECT_EQ(Eigen::MatrixXd(fixed.K), dynamic.K);
  EXPECT_EQ(Eigen::MatrixXd(fixed.P_prior), dynamic.P_prior);
}

template <class... Arguments>
constexpr bool accepted = requires(Arguments... arguments) { kalman_gain(arguments...); };

TEST(KalmanGain, TakesOnlyDiscretePlants) {
  static_assert(accepted<DiscreteSystem<2, 1, 1>, Covariance, Covariance>);
  static_assert(!accepted<ContinuousSystem<2, 1, 1>, Covariance, Covariance>);
  static_assert(!accepted<mechanisms::Elevator, Covariance, Covariance>);
  SUCCEED();
}

TEST(KalmanGain, Errors) {
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(2, 2);
  const Eigen::MatrixXd C = Eigen::RowVector2d(1.0, 0.0);
  const Eigen::MatrixXd r = Eigen::MatrixXd::Ones(1, 1);
  EXPECT_TRUE(
      kalman_gain(Eigen::MatrixXd::Ones(2, 3), C, I, r).error().is(ArgumentError::wrong_shape));
  EXPECT_EQ(to_string(kalman_gain(I, C, I, I).error()),
            "kalman_gain: R is 2x2; it must be outputs x outputs (1x1)");
  EXPECT_TRUE(kalman_gain(I, C, r, r).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      kalman_gain(I, Eigen::MatrixXd::Ones(1, 3), I, r).error().is(ArgumentError::wrong_shape));
  Eigen::MatrixXd bad = I;
  bad(0, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(kalman_gain(bad, C, I, r).error().is(ArgumentError::not_finite));
  // The maker's own error comes through.
  EXPECT_EQ(kalman_gain(I, C, standard_deviations({-1.0, 1.0}), r).error().where(),
            "standard_deviations");
  // The second state is a random walk that nothing shows.
  const auto hidden = kalman_gain(I, C, I, r);
  ASSERT_FALSE(hidden.has_value());
  EXPECT_TRUE(hidden.error().is(KalmanGainError::not_detectable));
  EXPECT_EQ(to_string(hidden.error()),
            "kalman_gain: (A, C): a mode that is not stable is shown by no output; nothing "
            "corrects this mode; measure a state that it moves, or take it out of the model "
            "(eigenvalue = [1, 0], magnitude = 1)");
  // The same where the rounding of a dual equation would name another reason.
  const Eigen::MatrixXd far{{1e200, 0.0}, {0.0, 0.5}};
  EXPECT_TRUE(kalman_gain(far, Eigen::RowVector2d(0.0, 1.0), I, r)
                  .error()
                  .is(KalmanGainError::not_detectable));
  // A constant without process noise: the filter learns it for ever.
  const auto constant = kalman_gain(r, r, 0.0 * r, r);
  ASSERT_FALSE(constant.has_value());
  EXPECT_TRUE(constant.error().is(KalmanGainError::undriven_mode));
  EXPECT_FALSE(constant.error().evidence().empty());
  EXPECT_NE(to_string(constant.error()).find("process noise"), std::string::npos);
  // Two sensors of one state without noise say the same thing twice.
  const auto twice = kalman_gain(0.5 * I, Eigen::MatrixXd{{1.0, 0.0}, {1.0, 0.0}}, I, 0.0 * I);
  ASSERT_FALSE(twice.has_value());
  EXPECT_TRUE(twice.error().is(RiccatiError::singular));
  EXPECT_NE(to_string(twice.error()).find("C P Cᵀ + R"), std::string::npos);
}

// P⁺ = P - K C P would be negative: an R or Q with a negative variance is refused, one that has
// none along a direction is not, in any units.
TEST(KalmanGain, TakesOnlyCovariances) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  const auto negative = kalman_gain(0.5 * one, one, one, -0.1 * one);
  ASSERT_FALSE(negative.has_value());
  EXPECT_EQ(to_string(negative.error()),
            "kalman_gain: R is no covariance: along some direction its variance is negative; it "
            "must be positive semidefinite (that variance, of variances scaled to one = -1)");
  EXPECT_EQ(negative.error().kind(), ErrorKind::misuse);
  EXPECT_TRUE(kalman_gain(0.5 * one, one, -one, one).error().is(ArgumentError::not_positive));
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(2, 2);
  for (const double unit : {1e-90, 1e-6, 1.0, 1e9, 1e90}) {
    const auto with = [&](double covariance) {
      Eigen::MatrixXd S{{unit * unit, unit * covariance}, {unit * covariance, 1.0}};
      return check_covariance(S, "test", "S");
    };
    EXPECT_TRUE(with(0.999).has_value()) << unit;
    EXPECT_TRUE(with(-1.0).has_value()) << unit;
    EXPECT_FALSE(with(1.0 + 1e-9).has_value()) << unit;
    EXPECT_FALSE(with(-2.0).has_value()) << unit;
  }
  EXPECT_TRUE(check_covariance(Eigen::MatrixXd::Zero(3, 3), "test", "S").has_value());
  EXPECT_FALSE(check_covariance(Eigen::MatrixXd{{0.0, 1e-3}, {1e-3, 1.0}}, "test", "S"));
  EXPECT_FALSE(check_covariance(Eigen::MatrixXd{{-1e-3, 0.0}, {0.0, 1.0}}, "test", "S"));
  EXPECT_FALSE(check_covariance(Eigen::MatrixXd{{-1e-30, 0.0}, {0.0, 1.0}}, "test", "S"));
  EXPECT_FALSE(check_covariance(Eigen::MatrixXd{{1.0, 0.5}, {0.4, 1.0}}, "test", "S"));
  EXPECT_FALSE(kalman_gain(0.5 * I, I, I, Eigen::MatrixXd{{1.0, 2.0}, {2.0, 1.0}}));
}

/// 10 000 systems' duals are plants with a filter: Q and R semidefinite and definite.
struct FilterLaws {
  test::Law gain{"K (C P C' + R) = P C'"};
  test::Law predictor{"L = A K"};
  test::Law update{"P+ = (I - K C) P (I - K C)' + K R K'"};
  test::Law prediction{"P = A P+ A' + Q"};
  test::Law definite{"P, P+ and P - P+ are semidefinite"};
  test::Law poles{"poles of A (I - K C)"};

  void check(const test::RandomSystem& s, const KalmanGain<>& found, int trial) {
    using test::wide;
    // In plain units: x = diag(states)⁻¹ x', y = diag(inputs)⁻¹ y'.
    const test::RandomSystem p = test::plain(s);
    const Eigen::MatrixXd x = s.states.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd y = s.inputs.asDiagonal();
    const test::LongMatrix A = wide(p.A.transpose());
    const test::LongMatrix C = wide(p.B.transpose());
    const test::LongMatrix K = wide(x * found.K * y);
    const test::LongMatrix L = wide(x * found.L * y);
    const test::LongMatrix P = wide(x * found.P_prior * x);
    const test::LongMatrix after = wide(x * found.P_posterior * x);
    const test::LongMatrix R = wide(p.R);
    const test::LongMatrix I = test::LongMatrix::Identity(P.rows(), P.cols());
    const test::LongMatrix weight = C * P * C.transpose() + R;
    const long double epsilon = test::epsilon;
    gain.holds(
        (K * weight - P * C.transpose()).norm() /
            (epsilon * (K.norm() * (C.squaredNorm() * P.norm() + R.norm()) + P.norm() * C.norm())),
        trial, s);
    predictor.holds((L - A * K).norm() / (epsilon * A.norm() * K.norm()), trial, s);
    const test::LongMatrix keep = I - K * C;
    const long double kept = 1.0L + K.norm() * C.norm();
    update.holds((after - keep * P * keep.transpose() - K * R * K.transpose()).norm() /
                     (epsilon * (kept * kept * P.norm() + K.squaredNorm() * R.norm())),
                 trial, s);
    prediction.holds((A * after * A.transpose() + wide(p.Q) - P).norm() /
                         (epsilon * (A.squaredNorm() * after.norm() + P.norm() + p.Q.norm() +
                                     A.squaredNorm() * kept * P.norm())),
                     trial, s);
    const auto least = [](const test::LongMatrix& S) {
      return test::symmetric_eigenvalues(S.cast<double>())(0);
    };
    const auto size = static_cast<double>(epsilon * P.norm());
    definite.holds(-std::min({least(P), least(after), least(P - after)}) / size, trial, s);
    const Eigen::MatrixXd loop = (A * keep).cast<double>();
    poles.holds(
        std::max(test::eigenvalues(loop).cwiseAbs().maxCoeff(), found.poles.cwiseAbs().maxCoeff()) -
            1.0,
        trial, s);
  }
};

TEST(KalmanGainProperties, AreTheFilters) {
  test::RandomSystems systems(62, test::Plane::z);
  test::Refusals refusals;
  FilterLaws laws;
  for (int trial = 0; trial < 10000; ++trial) {
    const test::RandomSystem s = systems.next();
    const auto found = kalman_gain(s.A.transpose(), s.B.transpose(), s.Q, s.R);
    if (!found) {
      // Weights of the reference cases may be no covariances.
      if (s.kind == test::SystemClass::reference && found.error().is(ArgumentError::not_positive)) {
        continue;
      }
      refusals.add(found.error(), trial, s);
      continue;
    }
    ASSERT_TRUE(found->K.allFinite() && found->L.allFinite() && found->P_posterior.allFinite());
    EXPECT_EQ(found->P_prior, found->P_prior.transpose()) << trial;
    EXPECT_EQ(found->P_posterior, found->P_posterior.transpose()) << trial;
    laws.check(s, *found, trial);
  }
  refusals.expect_at_most(10);
  laws.gain.expect_within(2.0);
  laws.predictor.expect_within(2.0);
  laws.update.expect_within(2.0);
  laws.prediction.expect_within(2.0);
  laws.definite.expect_within(3.0);
  laws.poles.expect_within(0.0);
}

// x' = U x, U orthogonal, and units that are powers of two: K' = U K, P' = U P Uᵀ, to conditioning.
TEST(KalmanGainProperties, AxesAndUnitsChangeNothing) {
  test::RandomSystems systems(63, test::Plane::z);
  Random random(63);
  test::Law turned("turned");
  test::Law units("in other units");
  for (int trial = 0; trial < 1000; ++trial) {
    const test::RandomSystem s =
        systems.next(trial % 2 == 0 ? test::SystemClass::stable : test::SystemClass::unstable);
    const Eigen::Index n = s.A.rows();
    const auto plain = kalman_gain(s.A.transpose(), s.B.transpose(), s.Q, s.R).value();
    const double allowed = test::epsilon * std::max(1.0, plain.condition);
    const Eigen::MatrixXd U = test::random_rotation(random, n);
    const Eigen::MatrixXd Q = U * s.Q * U.transpose();
    const auto other = kalman_gain(U * s.A.transpose() * U.transpose(),
                                   s.B.transpose() * U.transpose(), 0.5 * (Q + Q.transpose()), s.R)
                           .value();
    turned.holds((U.transpose() * other.P_prior * U - plain.P_prior).norm() /
                     (allowed * plain.P_prior.norm()),
                 trial, s);
    turned.holds((U.transpose() * other.K - plain.K).norm() / (allowed * plain.K.norm()), trial, s);
    const Eigen::VectorXd d = test::random_units(random, n, 6.0);
    const Eigen::VectorXd d_inverse = d.cwiseInverse();
    const auto scaled = kalman_gain(d.asDiagonal() * s.A.transpose() * d_inverse.asDiagonal(),
                                    s.B.transpose() * d_inverse.asDiagonal(),
                                    d.asDiagonal() * s.Q * d.asDiagonal(), s.R)
                            .value();
    units.holds(
        (d_inverse.asDiagonal() * scaled.P_prior * d_inverse.asDiagonal() - plain.P_prior).norm() /
            (allowed * plain.P_prior.norm()),
        trial, s);
    units.holds((d_inverse.asDiagonal() * scaled.K - plain.K).norm() / (allowed * plain.K.norm()),
                trial, s);
  }
  turned.expect_within(10.0);
  units.expect_within(1.0);
}

// L = AK to the last digit that its size leaves.
TEST(KalmanGain, PredictorOfASubnormalPlant) {
  const Eigen::Matrix<double, 1, 1> A(5e-324);
  const auto gain = kalman_gain(A, Eigen::Matrix<double, 1, 1>(-0.0029),
                                Covariance(A * 0.0 + Eigen::Matrix<double, 1, 1>(0.88)),
                                Covariance(Eigen::Matrix<double, 1, 1>(1e-20)));
  ASSERT_TRUE(gain.has_value());
  EXPECT_EQ(gain->L(0, 0), A(0, 0) * gain->K(0, 0));
}

// P⁺ = P - KCP holds in the units that were given, too, or there is no answer. Here: outputs
// without noise of states 1e16 and rows of C 1e30 apart, whose K cannot be told in 31 digits.
TEST(KalmanGain, PosteriorInTheGivenUnits) {
  const Eigen::Matrix2d A = Eigen::Vector2d(1e-20, 0.0).asDiagonal();
  Eigen::MatrixXd C(2, 2);
  C << -1.2, -1.6e30, 43.9, -1.78e32;
  const Eigen::Matrix2d Q = Eigen::Vector2d(2.2, 1e-32).asDiagonal();
  const auto gain =
      kalman_gain(A, C, Covariance(Q), Covariance(Eigen::MatrixXd(Eigen::Matrix2d::Zero())));
  ASSERT_FALSE(gain.has_value());
  EXPECT_TRUE(gain.error().is(RiccatiError::no_convergence)) << to_string(gain.error());
}

// The poles of what is answered: A (I - K C) has the trace -1e-300 · 1e16 · 1.2.
TEST(KalmanGain, PolesBelowWhatItsUnitsHold) {
  const Eigen::MatrixXd A = (Eigen::MatrixXd(2, 2) << 1e-310, -1e-300, 0.0, 1e-310).finished();
  const Eigen::MatrixXd C =
      (Eigen::MatrixXd(2, 2) << 1.20343017578125, -1e-16, 0.0, 1e20).finished();
  const auto gain = kalman_gain(A, C, Eigen::Vector2d(0.0, 1e-100).asDiagonal().toDenseMatrix(),
                                Eigen::Vector2d(1e-308, 1.0).asDiagonal().toDenseMatrix())
                        .value();
  const double trace = 1e-300 * gain.K(1, 0) * C(0, 0);
  EXPECT_NEAR(gain.poles.real().sum() / trace, 1.0, 1e-12);
}

// Two sensors whose noises cancel measure the state without an error.
TEST(KalmanGain, NoVarianceIsNegative) {
  const auto scalar = [](double x) { return Eigen::MatrixXd::Constant(1, 1, x); };
  const Eigen::MatrixXd C = Eigen::Vector2d(37117.214155149355, 0.9540011137445932);
  const Eigen::MatrixXd R = (Eigen::MatrixXd(2, 2) << 6.102726447952239, -1.442954097304636,
                             -1.442954097304636, 0.3411780856779002)
                                .finished();
  const auto gain =
      kalman_gain(scalar(0.6028441777532183), C, scalar(0.00783534690284396), R).value();
  EXPECT_GE(gain.P_posterior(0, 0), 0.0);
  EXPECT_LE(gain.P_posterior(0, 0), 1e-20);
  // Whole numbers, whose R = v vᵀ is singular without rounding.
  Random random(5);
  const auto whole = [&](Eigen::Index rows, Eigen::Index columns) {
    return Eigen::MatrixXd(Eigen::MatrixXd::NullaryExpr(
        rows, columns, [&] { return std::floor(random.uniform(-3.0, 4.0)); }));
  };
  int answered = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const Eigen::Index n = 1 + trial % 4;
    const Eigen::Index p = 1 + trial % 3;
    const Eigen::MatrixXd A = 0.25 * whole(n, n);
    const Eigen::MatrixXd H = whole(p, n);
    const Eigen::MatrixXd v = whole(p, 1);
    const Eigen::MatrixXd G = whole(n, n);
    const auto perfect =
        kalman_gain(A, H, Covariance(G * G.transpose()), Covariance(v * v.transpose()));
    if (perfect) {
      ++answered;
      EXPECT_GE(perfect->P_posterior.diagonal().minCoeff(), 0.0) << trial;
    }
  }
  EXPECT_GT(answered, 300);
}

// The residual that is told is the larger of the dual equation's and of the filter's own, which
// random plants have either way round.
TEST(KalmanGain, TellsTheLargerResidual) {
  Random random(151);
  bool of_filter = false;
  bool of_dual = false;
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::MatrixXd A = random_matrix(random, 3, 3);
    const Eigen::MatrixXd C = random_matrix(random, 2, 3);
    const Eigen::MatrixXd Q = Eigen::MatrixXd::Identity(3, 3);
    const Eigen::MatrixXd R = Eigen::MatrixXd::Identity(2, 2);
    const auto dual = dare(A.transpose(), C.transpose(), Q, R);
    const auto gain = kalman_gain(A, C, Covariance(Q), Covariance(R));
    ASSERT_EQ(dual.has_value(), gain.has_value()) << trial;
    if (gain) {
      EXPECT_GE(gain->residual, dual->residual) << trial;
      of_filter = of_filter || gain->residual > dual->residual;
      of_dual = of_dual || gain->residual == dual->residual;
    }
  }
  EXPECT_TRUE(of_filter && of_dual) << of_filter << of_dual;
}

}  // namespace
}  // namespace flyball::kalman_gain_test
