#include <flyball/systems/system.hpp>

#include <cmath>
#include <complex>

#include <gtest/gtest.h>

#include <flyball/systems/controllability.hpp>
#include <flyball/systems/response.hpp>

namespace flyball::system_test {
namespace {

// s² + 2 s + 5: -1 ± 2j.
TEST(System, Poles) {
  Eigen::Matrix2d A;
  A << 0.0, 1.0, -5.0, -2.0;
  const Eigen::VectorXcd found = poles(MatrixRef(A)).value();
  EXPECT_LT((found.array() - std::complex<double>(-1.0, 2.0)).abs().minCoeff(), 1e-14);
  EXPECT_LT((found.array() - std::complex<double>(-1.0, -2.0)).abs().minCoeff(), 1e-14);
}

TEST(System, Stability) {
  const auto continuous = [](double a) {
    return is_stable(ContinuousSystem<>{Eigen::MatrixXd::Constant(1, 1, a),
                                        Eigen::MatrixXd::Ones(1, 1), Eigen::MatrixXd::Ones(1, 1),
                                        Eigen::MatrixXd::Zero(1, 1)})
        .value();
  };
  EXPECT_TRUE(continuous(-0.1));
  EXPECT_FALSE(continuous(0.0));
  EXPECT_FALSE(continuous(0.1));
  const auto discrete = [](double a) {
    return is_stable(DiscreteSystem<>{Eigen::MatrixXd::Constant(1, 1, a),
                                      Eigen::MatrixXd::Ones(1, 1), Eigen::MatrixXd::Ones(1, 1),
                                      Eigen::MatrixXd::Zero(1, 1), Time(0.1)})
        .value();
  };
  EXPECT_TRUE(discrete(-0.99));
  EXPECT_FALSE(discrete(1.0));
  EXPECT_FALSE(discrete(-1.01));
}

// Section 6.8: dx/dt = v, dv/dt = a, by hand from e^{At} = I + At, for A² = 0.
TEST(System, DoubleIntegrator) {
  ContinuousSystem<2, 1, 1> cart;
  cart.A << 0.0, 1.0, 0.0, 0.0;
  cart.B << 0.0, 1.0;
  cart.C << 1.0, 0.0;
  cart.D << 0.0;
  EXPECT_TRUE(check_system(cart, "test").has_value());
  EXPECT_EQ(cart.derivative(Eigen::Vector2d(3.0, 2.0), Eigen::Vector<double, 1>(5.0)),
            Eigen::Vector2d(2.0, 5.0));
  EXPECT_TRUE(poles(cart).value().isZero(0.0));
  EXPECT_FALSE(is_stable(cart).value());
  const auto reach = analyze_controllability(cart.A, cart.B, TimeDomain::continuous).value();
  EXPECT_EQ(reach.rank, 2);
  const ResponseTimes times{Time(0.25), 9};
  const auto step =
      step_response(ContinuousSystem<>{cart.A, cart.B, cart.C, cart.D}, 0, times).value();
  const auto coast = initial_response(ContinuousSystem<>{cart.A, cart.B, cart.C, cart.D},
                                      Eigen::Vector2d(3.0, 2.0), times)
                         .value();
  for (Eigen::Index k = 0; k < 9; ++k) {
    const double t = 0.25 * static_cast<double>(k);
    EXPECT_NEAR(step.y(k, 0), 0.5 * t * t, 1e-15);
    EXPECT_NEAR(coast.y(k, 0), 3.0 + 2.0 * t, 1e-15);
  }
}

TEST(System, ChecksShapes) {
  const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(2, 2);
  const Eigen::MatrixXd B = Eigen::MatrixXd::Ones(2, 1);
  const Eigen::MatrixXd C = Eigen::MatrixXd::Ones(1, 2);
  const Eigen::MatrixXd D = Eigen::MatrixXd::Ones(1, 1);
  EXPECT_TRUE(check_system(A, B, C, D, "test").has_value());
  EXPECT_TRUE(check_system(B, B, C, D, "test").error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(check_system(A, C, C, D, "test").error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(check_system(A, B, B, D, "test").error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(check_system(A, B, C, A, "test").error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      check_system(Eigen::MatrixXd(0, 0), B, C, D, "test").error().is(ArgumentError::empty));
  Eigen::MatrixXd bad = D;
  bad(0, 0) = std::nan("");
  EXPECT_TRUE(check_system(A, B, C, bad, "test").error().is(ArgumentError::not_finite));
  EXPECT_TRUE(check_system(DiscreteSystem<>{A, B, C, D, Time(0.0)}, "test")
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(poles(MatrixRef(B)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(poles(MatrixRef(Eigen::MatrixXd::Constant(1, 1, std::nan(""))))
                  .error()
                  .is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::system_test
