#include <flyball/classical/frequency_data.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/systems/response.hpp>

#include "classical/transfer_cases.hpp"

namespace flyball::classical::frequency_data_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using flyball::test::transfer;

VectorXd log_grid(double low, double high, Index points) {
  VectorXd w(points);
  for (Index k = 0; k < points; ++k) {
    w(k) = low * std::pow(high / low, static_cast<double>(k) / static_cast<double>(points - 1));
  }
  return w;
}

FrequencyData data_of(const TransferFunction& G, const VectorXd& w) {
  return FrequencyData::sampled(frequency_response(G).value(), w).value();
}

// A power of ω is exact, whatever the distance of the points; a lag to a thousandth at eight points
// a decade, and the error falls with the cube of the distance at least.
TEST(FrequencyData, Interpolates) {
  const auto power = data_of(transfer({5.0}, {1.0, 0.0, 0.0}), log_grid(0.01, 100.0, 3)).response();
  for (const double w : {0.02, 0.7, 33.0}) {
    EXPECT_NEAR(std::abs(power.at(w)(0, 0) - -5.0 / (w * w)), 0.0, 1e-12 * 5.0 / (w * w));
  }
  const TransferFunction lag = transfer({2.0}, {1.0, 1.0});
  double before = 1.0;
  for (const Index points : {17, 33, 65}) {
    const auto response = data_of(lag, log_grid(0.1, 10.0, points)).response();
    double worst = 0.0;
    for (const double w : log_grid(0.1, 10.0, 301)) {
      worst = std::max(worst, std::abs(response.at(w)(0, 0) / lag.response(w) - 1.0));
    }
    EXPECT_LE(worst, 1e-3);
    EXPECT_LE(worst, before / 4.0);
    before = worst;
  }
  // At a frequency it is the value, at -ω its conjugate, beyond the data nothing.
  const FrequencyData data = data_of(lag, log_grid(0.1, 10.0, 5));
  EXPECT_EQ(data.response().at(data.frequency()(2))(0, 0), data.values()(0, 2));
  EXPECT_EQ(data.response().at(-data.frequency()(2))(0, 0), std::conj(data.values()(0, 2)));
  EXPECT_TRUE(
      data.response().sample(VectorXd::Constant(1, 11.0)).error().is(ArgumentError::out_of_range));
  EXPECT_EQ(bode(data.response()).value().frequency, data.frequency());
}

TEST(FrequencyData, ArithmeticIsThatOfTheSystems) {
  const TransferFunction P = transfer({3.0}, {1.0, 2.0, 5.0});
  const TransferFunction C = transfer({2.0, 1.0}, {1.0, 0.0});
  const VectorXd w = log_grid(0.1, 50.0, 60);
  const FrequencyData p = data_of(P, w);
  const FrequencyData c = data_of(C, log_grid(0.05, 100.0, 400));
  const FrequencyData loop = series(p, c).value();
  const FrequencyData sum = parallel(p, c).value();
  const FrequencyData closed = feedback(p, c).value();
  const FrequencyData other = feedback(p, c, false).value();
  for (Index k = 0; k < w.size(); ++k) {
    const Complex a = P.response(w(k));
    const Complex b = C.response(w(k));
    EXPECT_LE(std::abs(loop.values()(0, k) - a * b), 1e-6 * std::abs(a * b));
    EXPECT_LE(std::abs(sum.values()(0, k) - a - b), 1e-6 * std::abs(b));
    EXPECT_LE(std::abs(closed.values()(0, k) - a / (1.0 + a * b)), 1e-5);
    EXPECT_LE(std::abs(other.values()(0, k) - a / (1.0 - a * b)), 1e-4);
  }
  EXPECT_TRUE(series(c, p).error().is(ArgumentError::out_of_range));
  const auto two = FrequencyData::create(w, MatrixXcd::Ones(4, w.size()), 2, 2).value();
  EXPECT_TRUE(series(p, two).error().is(ArgumentError::wrong_shape));
  EXPECT_EQ(series(two, two).value().values()(3, 7), Complex(2.0));
  const auto sampled = FrequencyData::create(w, MatrixXcd::Ones(1, w.size()), 1, 1, Time(0.01));
  EXPECT_TRUE(parallel(p, *sampled).error().is(TransferError::period_mismatch));
}

// Margins of the data are those of the system that it came from.
TEST(FrequencyData, Margins) {
  for (const auto& [L, unstable] : {std::pair{transfer({4.0}, {1.0, 3.0, 3.0, 1.0}), 0},
                                    {transfer({20.0}, {1.0, 3.0, 3.0, 1.0}), 0},
                                    {transfer({5.0}, {1.0, 1.0, 0.0}), 0},
                                    {transfer({3.0}, {1.0, -1.0}), 1},
                                    {transfer({1.0, 1.0}, {1.0, 0.0, 0.0}), 0},
                                    {transfer({2.0}, {1.0, 1.0}, 0.5), 0}}) {
    const LoopMargins exact = loop_margins(L).value();
    const LoopMargins got = loop_margins(data_of(L, log_grid(1e-3, 30.0, 300)), unstable).value();
    EXPECT_EQ(got.stable, exact.stable);
    EXPECT_EQ(got.unstable_poles, exact.unstable_poles);
    ASSERT_EQ(got.gain_crossings.size(), exact.gain_crossings.size());
    EXPECT_NEAR(*got.phase_margin, *exact.phase_margin, 1e-3);
    ASSERT_EQ(got.gain_margin.has_value(), exact.gain_margin.has_value());
    if (exact.gain_margin) {
      EXPECT_NEAR(*got.gain_margin / *exact.gain_margin, 1.0, 1e-4);
    }
    // What is approached beyond the data is not there.
    EXPECT_NEAR(got.sensitivity.value / exact.sensitivity.value, 1.0, 3e-3);
    EXPECT_NEAR(got.disk_margin, exact.disk_margin, 2e-3);
    if (std::isfinite(exact.delay_margin)) {
      EXPECT_NEAR(got.delay_margin, exact.delay_margin, 1e-4);
    }
  }
}

// From noise to margins: a lag of 0.2 s is excited, measured with Welch's spectra, and closed
// by 20.
TEST(FrequencyData, FromAMeasurement) {
  Random random(6);
  const double T = 0.01;
  const DiscreteSystem<> lag{MatrixXd::Constant(1, 1, 0.95), MatrixXd::Ones(1, 1),
                             MatrixXd::Constant(1, 1, 0.05), MatrixXd::Zero(1, 1), Time(T)};
  MatrixXd u(40'000, 1);
  for (double& entry : u.reshaped()) {
    entry = random.normal();
  }
  const MatrixXd y = forced_response(lag, u, VectorXd::Zero(1)).value().y;
  WelchOptions options;
  options.length = 1000;
  const auto estimate = estimate_frequency_response(u, y, Time(T), options).value();
  const FrequencyData data = FrequencyData::from_measurement(estimate, 0.9).value();
  EXPECT_GE(data.frequency().size(), 200);
  for (const double w : {2.0, 5.0, 20.0, 60.0}) {
    const Complex z = std::polar(1.0, w * T);
    EXPECT_LE(std::abs(data.response().at(w)(0, 0) / (0.05 / (z - 0.95)) - 1.0), 0.05) << w;
  }
  EXPECT_TRUE(FrequencyData::from_measurement(estimate, 1.1).error().is(ArgumentError::empty));
}

TEST(FrequencyData, Refuses) {
  const MatrixXcd values = MatrixXcd::Ones(1, 3);
  const auto refused = [&](double a, double b, double c) {
    return to_string(FrequencyData::create(Eigen::Vector3d(a, b, c), values).error());
  };
  EXPECT_EQ(refused(1.0, 3.0, 2.0),
            "frequency data: frequency 3 is 2 rad/s; it must be above 3 rad/s, the one before it; "
            "sort the frequencies, and the values with them");
  EXPECT_EQ(refused(1.0, 2.0, 2.0),
            "frequency data: frequency 3 is 2 rad/s for the second time; it must be above 2 rad/s, "
            "the one before it; average the values that were measured at one frequency");
  EXPECT_NE(refused(-1.0, 2.0, 3.0).find("not negative"), std::string::npos);
  EXPECT_TRUE(FrequencyData::create(Eigen::Vector3d(1.0, std::nan(""), 2.0), values)
                  .error()
                  .is(ArgumentError::not_finite));
  MatrixXcd bad = values;
  bad(0, 1) = Complex(1.0, std::nan(""));
  EXPECT_TRUE(FrequencyData::create(Eigen::Vector3d(1.0, 2.0, 3.0), bad)
                  .error()
                  .is(ArgumentError::not_finite));
  EXPECT_TRUE(FrequencyData::create(Eigen::Vector2d(1.0, 2.0), values)
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(FrequencyData::create(VectorXd(0), MatrixXcd(1, 0)).error().is(ArgumentError::empty));
  EXPECT_TRUE(FrequencyData::create(Eigen::Vector3d(1.0, 2.0, 400.0), values, 1, 1, Time(0.01))
                  .error()
                  .is(ArgumentError::out_of_range));
  const auto one = FrequencyData::create(VectorXd::Ones(1), MatrixXcd::Ones(1, 1)).value();
  EXPECT_TRUE(loop_margins(one).error().is(ArgumentError::empty));
}

}  // namespace
}  // namespace flyball::classical::frequency_data_test
