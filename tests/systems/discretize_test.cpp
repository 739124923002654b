#include <flyball/systems/discretize.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/math/integration/adaptive.hpp>
#include <flyball/math/integration/quadrature.hpp>

namespace flyball::discretize_test {
namespace {

// Double integrator: A_d = [1 T; 0 1], B_d = [T²/2; T]; A has no inverse.
TEST(Discretize, DoubleIntegrator) {
  ContinuousSystem<2, 1, 1> system;
  system.A << 0.0, 1.0, 0.0, 0.0;
  system.B << 0.0, 1.0;
  system.C << 1.0, 0.0;
  system.D << 0.25;
  const double T = 0.02;
  const auto discrete = discretize(system, Time(T)).value();
  EXPECT_NEAR(discrete.A(0, 1), T, 1e-17);
  EXPECT_NEAR(discrete.B(0), 0.5 * T * T, 1e-18);
  EXPECT_NEAR(discrete.B(1), T, 1e-17);
  EXPECT_EQ(discrete.C, system.C);
  EXPECT_EQ(discrete.D, system.D);
  EXPECT_EQ(discrete.period.si(), T);
}

// The book's elevator (Tables 7.2 and 7.3; SciPy 1.10.1).
TEST(Discretize, BooksElevator) {
  Eigen::Matrix2d A;
  A << 0.0, 1.0, 0.0, -164.20904979369794;
  const Eigen::Vector2d B(0.0, 21.457377744727182);
  const auto fine = discretize_zoh(A, B, Time(0.005)).value();
  EXPECT_NEAR(fine.A(0, 1), 0.003410460424794879, 1e-16);
  EXPECT_NEAR(fine.A(1, 1), 0.43997153428542146, 1e-15);
  EXPECT_NEAR(fine.B(0), 0.00020770689038283711, 1e-17);
  EXPECT_NEAR(fine.B(1), 0.07317953761826645, 1e-15);
  const auto coarse = discretize_zoh(A, B, Time(0.1)).value();
  EXPECT_NEAR(coarse.A(0, 1), 0.0060897978971460095, 1e-16);
  EXPECT_NEAR(coarse.A(1, 1), 7.387399396604512e-08, 1e-20);
  EXPECT_NEAR(coarse.B(1), 0.13067109386810719, 1e-15);
}

// The steps of D.1, each as an identity: d/dt e^{At} = A e^{At} = e^{At} A; B_d is the integral of
// e^{Av} over a period, A⁻¹(e^{AT} - I)B where A has an inverse; and x(T) = A_d x + B_d u is what
// integrating dx/dt = A x + B u gives.
TEST(Discretize, TheBooksDerivation) {
  Random random(111);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Index n = 1 + trial % 4;
    const Eigen::MatrixXd A = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return random.normal(); });
    const Eigen::MatrixXd B = Eigen::MatrixXd::NullaryExpr(n, 1, [&] { return random.normal(); });
    const Eigen::VectorXd x0 = Eigen::VectorXd::NullaryExpr(n, [&] { return random.normal(); });
    const double T = random.uniform(0.05, 1.0);
    const double u = random.normal();
    const auto discrete = discretize_zoh(A, B, Time(T)).value();
    const auto entry = [&](double t, Eigen::Index i, Eigen::Index j) {
      return expm(A * t).value()(i, j);
    };
    const Eigen::MatrixXd slope = A * discrete.A;
    EXPECT_LT((slope - discrete.A * A).norm(), 1e-13 * (1.0 + slope.norm()));
    Eigen::MatrixXd integral(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) {
        // e^{A(T + h)} by Richardson's differences of the entry.
        const double h = 1e-3;
        const double d1 = (entry(T + h, i, j) - entry(T - h, i, j)) / (2.0 * h);
        const double d2 = (entry(T + 2.0 * h, i, j) - entry(T - 2.0 * h, i, j)) / (4.0 * h);
        EXPECT_NEAR((4.0 * d1 - d2) / 3.0, slope(i, j), 1e-9 * (1.0 + slope.norm()));
        integral(i, j) = quadrature([&](double v) { return entry(v, i, j); }, 0.0, T)->value;
      }
    }
    EXPECT_LT((integral * B - discrete.B).norm(), 1e-12 * (1.0 + discrete.B.norm()));
    const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(n, n);
    EXPECT_LT((A * discrete.B - (discrete.A - I) * B).norm(), 1e-13 * (1.0 + slope.norm()));
    const auto path =
        integrate([&](double, const Eigen::VectorXd& x) { return Eigen::VectorXd(A * x + B * u); },
                  0.0, x0, T, {.relative_tolerance = 1e-12, .absolute_tolerance = 1e-12})
            .value();
    EXPECT_LT((discrete.A * x0 + discrete.B * u - path.final_state()).norm(),
              1e-10 * (1.0 + x0.norm()));
  }
}

// Two periods are one of twice the length: A(2T) = A(T)², B(2T) = A(T) B(T) + B(T), whatever the
// scale of B; and Q_d(2T) = A Q_d Aᵀ + Q_d.
TEST(Discretize, PeriodsAddUp) {
  Random random(31);
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Index n = 1 + trial % 4;
    const Eigen::MatrixXd A = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return random.normal(); });
    const Eigen::MatrixXd B = std::pow(10.0, trial % 13 - 6) *
                              Eigen::MatrixXd::NullaryExpr(n, 2, [&] { return random.normal(); });
    const Eigen::MatrixXd G = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return random.normal(); });
    const ProcessDensity density{G * G.transpose()};
    const double T = random.uniform(0.01, 1.0);
    const auto once = discretize_zoh(A, B, Time(T)).value();
    const auto twice = discretize_zoh(A, B, Time(2.0 * T)).value();
    EXPECT_LT((once.A * once.A - twice.A).norm(), 1e-13 * (1.0 + twice.A.norm()) * once.A.norm());
    EXPECT_LT((once.A * once.B + once.B - twice.B).norm(),
              1e-13 * once.A.norm() * twice.B.norm() + 1e-13 * once.B.norm());
    const Eigen::MatrixXd Q = discretize(A, density, Time(T)).value();
    const Eigen::MatrixXd Q2 = discretize(A, density, Time(2.0 * T)).value();
    EXPECT_LT((once.A * Q * once.A.transpose() + Q - Q2).norm(), 1e-12 * Q2.norm());
    EXPECT_EQ(Q, Q.transpose());
  }
}

// A Q_d + Q_d Aᵀ = A_d Q A_dᵀ - Q, what (7.8) gives by parts; also for ‖A‖T of 1e4, where one Van
// Loan exponential has nothing left.
TEST(Discretize, NoiseOfAStiffPlant) {
  for (const double rate : {1.0, 200.0, 1e5, 1e6}) {
    Eigen::Matrix2d A;
    A << -1.0, 1.0, 0.0, -rate;
    Eigen::Matrix2d Q;
    Q << 2.0, 0.3, 0.3, 1.0;
    const Time period(0.1);
    const Eigen::MatrixXd Q_d = discretize(A, ProcessDensity{Q}, period).value();
    const Eigen::MatrixXd A_d = expm(A * 0.1).value();
    EXPECT_LT((A * Q_d + Q_d * A.transpose() - (A_d * Q * A_d.transpose() - Q)).norm(),
              1e-12 * A.norm() * Q_d.norm());
    // The fast state is in its steady state: Q/(2 rate), once rate T is large.
    if (rate > 100.0) {
      EXPECT_NEAR(Q_d(1, 1), 0.5 / rate, 1e-12 / rate);
    }
  }
}

// Scalar: Q (1 - e^{-2aT})/(2a).
TEST(Discretize, ScalarNoise) {
  const double a = 3.0;
  const double T = 0.2;
  const auto Q = discretize(Eigen::MatrixXd::Constant(1, 1, -a),
                            ProcessDensity{Eigen::MatrixXd::Constant(1, 1, 4.0)}, Time(T))
                     .value();
  EXPECT_NEAR(Q(0, 0), -4.0 * std::expm1(-2.0 * a * T) / (2.0 * a), 1e-15);
  EXPECT_DOUBLE_EQ(
      discretize(MeasurementDensity{Eigen::MatrixXd::Constant(1, 1, 1e-8)}, Time(0.005))
          .value()(0, 0),
      2e-6);
}

// ∫₀ᵀ e^{2at} dt is 1/(2|a|) here, but |a| T has no double.
TEST(Discretize, NoiseOverAPeriodTooLong) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  const auto refused = discretize(-1e300 * one, ProcessDensity{one}, Time(1e10));
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(ArgumentError::not_finite));
}

TEST(Discretize, Errors) {
  const Eigen::Matrix2d I = Eigen::Matrix2d::Identity();
  const Eigen::Vector2d B(0.0, 1.0);
  EXPECT_TRUE(discretize_zoh(I, B, Time(0.0)).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(discretize_zoh(I, B, Time(std::nan(""))).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(discretize_zoh(B, B, Time(0.1)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      discretize_zoh(I, Eigen::Vector3d::Ones(), Time(0.1)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(discretize_zoh(Eigen::MatrixXd(0, 0), B, Time(0.1)).error().is(ArgumentError::empty));
  EXPECT_TRUE(discretize_zoh(I * 1e6, B, Time(1.0)).error().is(MatrixExponentialError::overflow));
  EXPECT_TRUE(discretize(I, ProcessDensity{Eigen::MatrixXd::Ones(1, 1)}, Time(0.1))
                  .error()
                  .is(ArgumentError::wrong_shape));
  Eigen::Matrix2d skew = I;
  skew(0, 1) = 0.5;
  EXPECT_TRUE(
      discretize(I, ProcessDensity{skew}, Time(0.1)).error().is(ArgumentError::not_symmetric));
  EXPECT_TRUE(
      discretize(MeasurementDensity{skew}, Time(0.1)).error().is(ArgumentError::not_symmetric));
  EXPECT_TRUE(
      discretize(MeasurementDensity{I}, Time(-1.0)).error().is(ArgumentError::not_positive));
}

}  // namespace
}  // namespace flyball::discretize_test
