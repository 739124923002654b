#include <flyball/systems/sampling.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/systems/discretize.hpp>

#include "systems/random_systems.hpp"

namespace flyball::sampling_test {
namespace {

constexpr double pi = std::numbers::pi;

// Figure 7.4: 1.5 Hz sampled at 2 Hz appears as 0.5 Hz. The footnote of 7.1.3: 200 Hz at 150 Hz
// appears as 50 Hz.
TEST(Sampling, BooksAliases) {
  EXPECT_NEAR(alias_frequency(1.5 * 2 * pi, Time(0.5)).value(), 0.5 * 2 * pi, 1e-14);
  EXPECT_NEAR(alias_frequency(200.0 * 2 * pi, Time(1.0 / 150.0)).value(), 50.0 * 2 * pi, 1e-11);
  EXPECT_NEAR(nyquist_frequency(Time(1.0 / 44100.0)).value() / (2 * pi), 22050.0, 1e-9);
  EXPECT_NEAR(sample_delay_phase_loss(10.0, Time(0.02)).value(), 0.1, 1e-16);
}

// Samples of cos(ωt) are those of its alias.
TEST(Sampling, AliasesAreIndistinguishable) {
  Random random(5);
  for (int trial = 0; trial < 1000; ++trial) {
    const double T = random.uniform(0.01, 1.0);
    const double w = random.uniform(0.0, 50.0) / T;
    const double alias = alias_frequency(w, Time(T)).value();
    EXPECT_LE(alias, nyquist_frequency(Time(T)).value() * (1 + 1e-15));
    for (int k = 0; k < 5; ++k) {
      EXPECT_NEAR(std::cos(alias * k * T), std::cos(w * k * T), 1e-11);
    }
  }
}

// Table 7.1.
TEST(Sampling, PoleMapping) {
  const Time T(0.1);
  EXPECT_EQ(discrete_pole(0.0, T).value(), 1.0);
  EXPECT_NEAR(std::abs(discrete_pole({0.0, 12.3}, T).value()), 1.0, 1e-15);
  EXPECT_EQ(std::abs(discrete_pole(-1e6, T).value()), 0.0);
  EXPECT_EQ(continuous_pole(0.0, T).value().real(), -INFINITY);
  const std::complex<double> s(-2.0, 5.0);
  EXPECT_LT(std::abs(continuous_pole(discrete_pole(s, T).value(), T).value() - s), 1e-13);
  EXPECT_NEAR(continuous_pole(-0.5, T).value().imag(), pi / 0.1, 1e-12);
}

// An oscillator at 10 rad/s: at T = π/10 both poles fall onto -1, and the sampled plant cannot be
// controlled.
TEST(Sampling, PathologicalPeriod) {
  ContinuousSystem<> plant;
  plant.A.resize(2, 2);
  plant.A << 0.0, 10.0, -10.0, 0.0;
  plant.B = Eigen::MatrixXd::Identity(2, 1);
  plant.C = Eigen::MatrixXd::Identity(1, 2);
  plant.D = Eigen::MatrixXd::Zero(1, 1);
  const auto bad = analyze_sampling(plant, Time(pi / 10.0)).value();
  EXPECT_TRUE(bad.aliases);
  EXPECT_TRUE(bad.loses_controllability);
  const auto held = discretize_zoh(plant.A, plant.B, Time(pi / 10.0)).value();
  Eigen::Matrix2d reach;
  reach << held.B, held.A * held.B;
  EXPECT_LT(std::abs(reach.determinant()), 1e-15);
  const auto good = analyze_sampling(plant, Time(0.05), 20.0).value();
  EXPECT_FALSE(good.aliases);
  EXPECT_FALSE(good.loses_controllability);
  EXPECT_NEAR(good.fastest_frequency, 10.0, 1e-14);
  EXPECT_NEAR(good.samples_per_radian, 2.0, 1e-14);
  EXPECT_EQ(good.sample_delay, 0.025);
  EXPECT_EQ(good.phase_loss, 0.5);
}

TEST(Sampling, Errors) {
  EXPECT_TRUE(nyquist_frequency(Time(0.0)).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(alias_frequency(NAN, Time(0.1)).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(sample_delay_phase_loss(-1.0, Time(0.1)).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(discrete_pole(NAN, Time(0.1)).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(continuous_pole(1.0, Time(-0.1)).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(analyze_sampling({}, Time(0.1)).error().is(ArgumentError::empty));
  Random random(2);
  const auto plant = test::random_system(random, 2, 1, 1);
  EXPECT_TRUE(analyze_sampling(plant, Time(0.0)).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(analyze_sampling(plant, Time(1.0), -1.0).error().is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::sampling_test
