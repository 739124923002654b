#include <flyball/math/probability/density.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/probability/distributions.hpp>
#include <flyball/math/probability/gaussian_vector.hpp>

namespace flyball::density_test {
namespace {

// Uniform on [a, b]: mean (a + b)/2, variance (b - a)²/12. Exponential of rate 2: 1/2, 1/4.
TEST(Density, MomentsOfUniformExponentialAndNormal) {
  const auto uniform = [](double x) { return x >= 1.0 && x <= 4.0 ? 1.0 / 3.0 : 0.0; };
  const auto of_uniform = moments(uniform, {1.0, 4.0}).value();
  EXPECT_NEAR(of_uniform.mean, 2.5, 1e-12);
  EXPECT_NEAR(of_uniform.variance, 0.75, 1e-12);
  const auto exponential = [](double x) { return 2.0 * std::exp(-2.0 * x); };
  const auto of_exponential = moments(exponential, {.low = 0.0}).value();
  EXPECT_NEAR(of_exponential.mean, 0.5, 1e-11);
  EXPECT_NEAR(of_exponential.variance, 0.25, 1e-11);
  const auto normal = [](double x) { return normal_pdf(x, 1.0, 2.0); };
  const auto of_normal = moments(normal).value();
  EXPECT_NEAR(of_normal.mean, 1.0, 1e-10);
  EXPECT_NEAR(of_normal.variance, 4.0, 1e-9);
  // Section 9.3.1: the area under p over a range is the probability of the range; and E[x - x̄] = 0.
  EXPECT_NEAR(probability(normal, 2.0, 2.5).value(), normal_cdf(0.75) - normal_cdf(0.5), 1e-13);
  EXPECT_NEAR(expectation([](double x) { return x - 1.0; }, normal).value(), 0.0, 1e-10);
  // E[eˣ] of N(μ, σ²) is exp(μ + σ²/2).
  EXPECT_NEAR(expectation([](double x) { return std::exp(x); }, normal, {-40.0, 60.0}).value(),
              std::exp(3.0), 1e-8);
}

// p(x, y) of N([1, -1], [1, 0.6; 0.6, 2]): E[x | y] = 1 + 0.3 (y + 1), var(x | y) = 1 - 0.18, the
// marginal of x is N(1, 1), and Bayes's rule p(x, y) = p(x | y) p(y) (sections 9.3.4 to 9.3.12).
TEST(Density, JointMarginalAndConditional) {
  const Eigen::Matrix2d covariance{{1.0, 0.6}, {0.6, 2.0}};
  const auto gaussian = GaussianVector::create(Eigen::Vector2d(1.0, -1.0), covariance).value();
  const auto p = [&](double x, double y) {
    return std::exp(gaussian.log_density(Eigen::Vector2d(x, y)).value());
  };
  const Support of_x{-8.0, 10.0};
  const Support of_y{-13.0, 11.0};
  EXPECT_NEAR(marginal(p, 0.5, of_y).value(), normal_pdf(0.5, 1.0, 1.0), 1e-11);
  const auto given = conditional_moments(p, 0.5, of_x).value();
  EXPECT_NEAR(given.mean, 1.45, 1e-10);
  EXPECT_NEAR(given.variance, 0.82, 1e-10);
  const double of_y_alone = normal_pdf(0.5, -1.0, std::sqrt(2.0));
  EXPECT_NEAR(p(0.2, 0.5), normal_pdf(0.2, given.mean, std::sqrt(given.variance)) * of_y_alone,
              1e-12);
  const auto entry = [](double x, double y) {
    return normal_pdf(x, 1.0, 1.0) * normal_pdf(y, 1.0 + 0.6 * (x - 1.0) - 2.0, std::sqrt(1.64));
  };
  const auto joint = joint_moments(entry, of_x, of_y).value();
  EXPECT_NEAR(joint.mean(0), 1.0, 1e-9);
  EXPECT_NEAR(joint.mean(1), -1.0, 1e-9);
  EXPECT_NEAR((joint.covariance - covariance).norm(), 0.0, 1e-8);
  EXPECT_NEAR(joint.correlation, 0.6 / std::sqrt(2.0), 1e-8);
}

// Independent: E[xy] = E[x] E[y], cov = 0 (section 9.3.7).
TEST(Density, IndependentVariablesAreUncorrelated) {
  const auto p = [](double x, double y) {
    return normal_pdf(x, 2.0, 0.5) * (y >= 0.0 && y <= 2.0 ? 0.5 : 0.0);
  };
  const Support of_x{-3.0, 7.0};
  const Support of_y{0.0, 2.0};
  const auto xy = expectation([](double x, double y) { return x * y; }, p, of_x, of_y);
  EXPECT_NEAR(xy.value(), 2.0, 1e-10);
  EXPECT_NEAR(joint_moments(p, of_x, of_y)->correlation, 0.0, 1e-9);
}

TEST(Density, Refusals) {
  const auto half = [](double x) { return 0.5 * normal_pdf(x); };
  const auto refused = moments(half);
  ASSERT_FALSE(refused);
  EXPECT_EQ(
      to_string(refused.error()),
      "moments: the total probability is 0.5; it must be 1; give ends within which the density "
      "lies");
  EXPECT_TRUE(
      probability([](double x) { return x; }, -1.0, 2.0).error().is(ArgumentError::out_of_range));
  EXPECT_FALSE(expectation([](double x) { return x; }, half));
  const auto flat = [](double x, double y) { return y > 0.0 && x > 0.0 ? 1.0 : 0.0; };
  EXPECT_FALSE(conditional_moments(flat, -1.0, {0.0, 1.0}));
  EXPECT_FALSE(joint_moments(flat, {0.0, 2.0}, {0.0, 1.0}));
}

// Means 2, 3; deviations (-1, 0, 1), (1, -2, 1) about them: Σ = [2 0; 0 6]/2. The third entry is
// the first times -2, far from zero.
TEST(SampleMoments, ByHand) {
  Eigen::MatrixXd samples(3, 3);
  samples << 1.0, 2.0, 3.0, 4.0, 1.0, 4.0, 1e9 - 2.0, 1e9 - 4.0, 1e9 - 6.0;
  const auto data = sample_moments(samples).value();
  EXPECT_EQ(data.mean, Eigen::Vector3d(2.0, 3.0, 1e9 - 4.0));
  Eigen::Matrix3d expected;
  expected << 1.0, 0.0, -2.0, 0.0, 3.0, 0.0, -2.0, 0.0, 4.0;
  EXPECT_NEAR((data.covariance - expected).norm(), 0.0, 1e-14);
  EXPECT_EQ(data.correlation(0, 2), -1.0);
  EXPECT_EQ(data.correlation(0, 1), 0.0);
  EXPECT_TRUE(sample_moments(samples.leftCols(1)).error().is(ArgumentError::empty));
  samples(1, 1) = std::nan("");
  EXPECT_TRUE(sample_moments(samples).error().is(ArgumentError::not_finite));
  EXPECT_FALSE(correlation(Eigen::Matrix2d{{-1.0, 0.0}, {0.0, 1.0}}));
  const auto constant = correlation(Eigen::Matrix2d{{0.0, 0.0}, {0.0, 1.0}}).value();
  EXPECT_EQ(constant, (Eigen::Matrix2d{{0.0, 0.0}, {0.0, 1.0}}));
}

// Definition 9.3.1: the normalised sum of n independent uniform variables has the density of Irwin
// and Hall; its distance from the normal density goes down as 1/n (its skewness is zero, its excess
// kurtosis -6/5n), and the largest difference of the densities is 0.15/√(2π)/n to first order.
TEST(CentralLimitTheorem, SumsOfUniformVariablesTendToTheNormalDensity) {
  const auto irwin_hall = [](double x, int n) {
    double sum = 0.0;
    double sign_over_factorials = n;  // (-1)ᵏ n / (k! (n - k)!) with n! taken along
    double factorial = 1.0;
    for (int k = 2; k <= n; ++k) {
      factorial *= k;
    }
    sign_over_factorials /= factorial;
    double binomial = 1.0;
    for (int k = 0; k <= static_cast<int>(x); ++k) {
      sum += (k % 2 == 0 ? 1.0 : -1.0) * binomial * std::pow(x - k, n - 1);
      binomial *= static_cast<double>(n - k) / (k + 1);
    }
    return sign_over_factorials * sum;
  };
  double before = 1.0;
  for (const int n : {1, 2, 4, 8}) {
    const double sigma = std::sqrt(n / 12.0);
    const auto p = [&](double x) { return x > 0.0 && x < n ? irwin_hall(x, n) : 0.0; };
    const auto sum = moments(p, {0.0, static_cast<double>(n)}).value();
    EXPECT_NEAR(sum.mean, n / 2.0, 1e-9);
    EXPECT_NEAR(sum.variance, n / 12.0, 1e-9);
    double worst = 0.0;
    for (double z = -4.0; z <= 4.0; z += 0.01) {
      worst = std::max(worst, std::abs(sigma * p(n / 2.0 + sigma * z) - normal_pdf(z)));
    }
    EXPECT_LT(worst, 0.65 * before) << n;
    if (n >= 4) {
      EXPECT_NEAR(worst * n * std::sqrt(2.0 * M_PI), 0.15, 0.02) << n;
    }
    before = worst;
  }
}

// The same by drawing: of the means of 48 exponential variables, 95 % lie within 1.96/√48.
TEST(CentralLimitTheorem, MeansOfExponentialSamplesAreNearlyNormal) {
  Random random(20);
  constexpr int trials = 20000;
  constexpr int terms = 48;
  int within = 0;
  for (int i = 0; i < trials; ++i) {
    double sum = 0.0;
    for (int k = 0; k < terms; ++k) {
      sum -= std::log(1.0 - random.uniform());
    }
    within += std::abs(sum / terms - 1.0) <= normal_quantile(0.975) / std::sqrt(terms) ? 1 : 0;
  }
  // The skewness 2/√48 makes it 0.951; four standard deviations of the count are 0.006.
  EXPECT_NEAR(static_cast<double>(within) / trials, 0.951, 0.006);
}

}  // namespace
}  // namespace flyball::density_test
