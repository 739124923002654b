#include <flyball/systems/system.hpp>

#include <cmath>
#include <complex>

#include <gtest/gtest.h>

namespace flyball {
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
}  // namespace flyball
