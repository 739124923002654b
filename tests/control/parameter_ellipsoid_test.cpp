#include <flyball/control/parameter_ellipsoid.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace flyball::parameter_ellipsoid_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// dx/dt = p x + g u, u = -K x each T: e^{pT} - K g (e^{pT} - 1)/p.
UncertainLoop first_order(double K, const ParameterSet& set) {
  const MatrixXd one = MatrixXd::Ones(1, 1);
  LinearPlantFamily family{
      .A = MatrixXd::Zero(1, 1), .B = one, .A_p = {one}, .B_p = {}, .E = {}, .E_p = {}};
  const auto loop = state_feedback_loop(MatrixXd::Zero(1, 1), one, MatrixXd::Constant(1, 1, K),
                                        Time(0.5), Time(0.0));
  return {family, loop->C, loop->period, loop->A_c, loop->B_c, loop->C_c, loop->D_c, set};
}

MatrixXd covariance_of(double p, double gain, double correlation) {
  MatrixXd covariance = MatrixXd::Zero(3, 3);
  covariance(0, 0) = p * p;
  covariance(1, 1) = gain * gain;
  covariance(0, 1) = covariance(1, 0) = correlation * p * gain;
  return covariance;
}

// χ² of two degrees at 95 % is -2 ln 0.05. The ellipsoid's extent in each parameter is √χ² standard
// errors, and a point on its surface is √χ² of them away.
TEST(ParameterEllipsoid, IsTheJointConfidenceSet) {
  const std::vector<double> estimate{0.3, 1.0, 0.0};
  const auto set = parameter_ellipsoid(estimate, estimate, covariance_of(0.1, 0.2, 0.7)).value();
  EXPECT_EQ(set.round, 2);
  ASSERT_EQ(set.axes.cols(), 2);
  const double chi = -2.0 * std::log(0.05);
  EXPECT_NEAR(set.axes.row(0).norm(), std::sqrt(chi) * 0.1, 1e-7);
  EXPECT_GE(set.axes.row(0).norm(), std::sqrt(chi) * 0.1);
  EXPECT_NEAR(set.axes.row(1).norm(), std::sqrt(chi) * 0.2, 1e-7);
  EXPECT_TRUE((set.axes * set.axes.transpose()).isApprox(chi * covariance_of(0.1, 0.2, 0.7), 1e-8));
  // A parameter with an interval keeps it, behind the ellipsoid's.
  const auto mixed =
      parameter_ellipsoid({0.3, 0.9, 0.0}, {0.3, 1.1, 0.0}, covariance_of(0.1, 0.0, 0.0)).value();
  EXPECT_EQ(mixed.round, 1);
  ASSERT_EQ(mixed.axes.cols(), 2);
  EXPECT_NEAR(mixed.axes(0, 0) * mixed.axes(0, 0), 3.841458820694124 * 0.01, 1e-7);
  EXPECT_NEAR(mixed.axes(1, 1), 0.1, 1e-12);
  EXPECT_EQ(parameter_ellipsoid({1.0, 0.0}, {2.0, 0.0}, MatrixXd::Zero(2, 2)).value().round, 0);
}

// Stable iff K g < p (e^{pT} + 1)/(e^{pT} - 1) and K g > p: of the ellipsoid those are two numbers
// that its points can be asked for. The box about it is broken by a corner where a correlation
// keeps the ellipsoid away from it.
TEST(ParameterEllipsoid, LeavesOutTheCornersOfTheBox) {
  const std::vector<double> estimate{0.0, 1.0, 0.0};
  const double p = 0.5;
  const double g = 0.15;
  const double K = 1.7;
  for (const double correlation : {0.9, -0.9}) {
    const auto set =
        parameter_ellipsoid(estimate, estimate, covariance_of(p, g, correlation)).value();
    bool stable = true;
    for (int k = 0; k < 3600; ++k) {
      const double turn = k * std::acos(-1.0) / 1800.0;
      const VectorXd x = set.centre + set.axes * Eigen::Vector2d(std::cos(turn), std::sin(turn));
      const double held = std::abs(x(0)) < 1e-9 ? 0.5 : std::expm1(0.5 * x(0)) / x(0);
      stable = stable && std::abs(std::exp(0.5 * x(0)) - K * x(1) * held) < 1.0;
    }
    const auto verdict = certify_loop(first_order(K, set)).value().verdict;
    EXPECT_EQ(verdict, stable ? LoopVerdict::stable : LoopVerdict::unstable) << correlation;
    EXPECT_EQ(stable, correlation > 0.0);
  }
  const double reach = std::sqrt(-2.0 * std::log(0.05));
  const auto box =
      parameter_box({-reach * p, 1.0 - reach * g, 0.0}, {reach * p, 1.0 + reach * g, 0.0});
  EXPECT_EQ(certify_loop(first_order(K, box.value())).value().verdict, LoopVerdict::unstable);
}

TEST(ParameterEllipsoid, RefusesWhatIsNoCovariance) {
  const std::vector<double> estimate{0.3, 1.0, 0.0};
  const auto error = [&](const MatrixXd& covariance, double probability = 0.95) {
    const auto set = parameter_ellipsoid(estimate, estimate, covariance, probability);
    return set ? std::string("a set") : to_string(set.error());
  };
  EXPECT_NE(error(covariance_of(0.1, 0.2, 1.1)).find("positive semidefinite"), std::string::npos);
  EXPECT_EQ(error(covariance_of(0.1, 0.2, 1.0)), "a set");
  EXPECT_NE(error(-covariance_of(0.1, 0.2, 0.0)).find("variance 0 is -0.01"), std::string::npos);
  EXPECT_NE(error(MatrixXd::Zero(2, 2)).find("3x3"), std::string::npos);
  MatrixXd lopsided = covariance_of(0.1, 0.2, 0.3);
  lopsided(0, 1) = 0.0;
  EXPECT_NE(error(lopsided).find("covariance"), std::string::npos);
  EXPECT_NE(error(covariance_of(0.1, std::nan(""), 0.0)).find("covariance"), std::string::npos);
  EXPECT_NE(error(covariance_of(0.1, 0.2, 0.0), 1.0).find("between 0 and 1"), std::string::npos);
  EXPECT_EQ(
      to_string(parameter_ellipsoid({0.0, 0.9, 0.0}, {0.0, 1.1, 0.0}, covariance_of(0.1, 0.2, 0.0))
                    .error()),
      "parameter_ellipsoid: parameter 1 is 0.9 to 1.1 beside a variance; it must be its "
      "estimate, as low and as high");
}

}  // namespace
}  // namespace flyball::parameter_ellipsoid_test
