#include <cmath>

#include <flyball/core/random.hpp>

#include "identification/response.hpp"

namespace {

using namespace flyball::identification;
using flyball::Random;

constexpr double kS = 0.4;
constexpr double kV = 2.0;
constexpr double tau = 0.15;

RunInput steady(double voltage, double duration, double step) {
  RunInput input;
  for (double time = 0.0; time < duration + step / 2.0; time += step) {
    input.time.push_back(time);
  }
  input.voltage.assign(input.time.size(), voltage);
  input.gravity_cosine.assign(input.time.size(), 0.0);
  input.gravity_sine.assign(input.time.size(), 0.0);
  return input;
}

double velocity_at(const Response& response, double time) {
  std::size_t hint = 0;
  return response.at(time, false, hint).velocity;
}

double position_at(const Response& response, double time) {
  std::size_t hint = 0;
  return response.at(time, false, hint).position;
}

// v(t) = (V − kS)/kV (1 − e^(−t/τ)), p(t) = (V − kS)/kV (t − τ (1 − e^(−t/τ)))
TEST(Response, StepFromRestIsExponential) {
  const RunInput input = steady(3.0, 1.0, 0.02);
  Response response;
  response.simulate(input, {kS, kV, std::log(tau), 0.0, 0.0, 0.0}, false);
  for (const double time : {0.1, 0.38, 0.9}) {
    const double rise = 1.0 - std::exp(-time / tau);
    EXPECT_NEAR(velocity_at(response, time), 1.3 * rise, 1e-12);
    EXPECT_NEAR(position_at(response, time), 1.3 * (time - tau * rise), 1e-12);
  }
}

// From v₀ without voltage: v = (v₀ + kS/kV) e^(−t/τ) − kS/kV until t₀ = τ ln(1 + v₀ kV/kS), then
// rest at p = v₀ τ − t₀ kS/kV.
TEST(Response, CoastsToRestWithinAStepAndSticks) {
  const RunInput input = steady(0.0, 1.0, 0.1);
  Response response;
  const double v0 = 1.1;
  response.simulate(input, {kS, kV, std::log(tau), 0.0, 0.0, v0}, false);
  const double stop = tau * std::log(1.0 + v0 * kV / kS);
  EXPECT_NEAR(position_at(response, 0.9), v0 * tau - stop * kS / kV, 1e-12);
  EXPECT_EQ(velocity_at(response, 0.9), 0.0);
}

TEST(Response, SticksBelowBreakawayAndSlipsBackAboveIt) {
  const RunInput below = steady(0.39, 1.0, 0.05);
  const RunInput above = steady(-0.6, 1.0, 0.05);
  Response response;
  response.simulate(below, {kS, kV, std::log(tau), 0.0, 0.0, 0.0}, false);
  EXPECT_EQ(position_at(response, 1.0), 0.0);
  // Reverses: forward friction until rest, then backwards towards (V + kS)/kV = −0.1.
  response.simulate(above, {kS, kV, std::log(tau), 0.0, 0.0, 0.5}, false);
  EXPECT_NEAR(velocity_at(response, 1.0), -0.1, 1e-3);
}

TEST(Response, GravityActsLikeVoltage) {
  RunInput input = steady(3.0, 1.0, 0.02);
  input.gravity_cosine.assign(input.time.size(), 1.0);
  Response with_gravity;
  with_gravity.simulate(input, {kS, kV, std::log(tau), 0.7, 0.0, 0.0}, false);
  const RunInput lower = steady(2.3, 1.0, 0.02);
  Response without;
  without.simulate(lower, {kS, kV, std::log(tau), 0.0, 0.0, 0.0}, false);
  EXPECT_NEAR(velocity_at(with_gravity, 0.7), velocity_at(without, 0.7), 1e-13);
}

TEST(Response, StaysAtTheInitialVelocityBeforeItsStart) {
  const RunInput input = steady(3.0, 0.2, 0.02);
  Response response;
  response.simulate(input, {kS, kV, std::log(tau), 0.0, 0.0, 0.8}, false);
  EXPECT_NEAR(position_at(response, -0.05), -0.04, 1e-15);
}

// Central differences of the position, over random inputs that change direction.
TEST(Response, SensitivitiesAreDerivatives) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    RunInput input = steady(0.0, 1.0, 0.011);
    for (std::size_t i = 0; i < input.time.size(); ++i) {
      input.voltage[i] =
          4.0 * std::sin(6.0 * input.time[i] + static_cast<double>(seed)) + random.normal(0.0, 0.1);
      input.gravity_cosine[i] = std::cos(input.time[i]);
      input.gravity_sine[i] = std::sin(input.time[i]);
    }
    const SimulationVector x{random.uniform(0.05, 0.3),
                             random.uniform(0.5, 2.0),
                             std::log(random.uniform(0.02, 0.3)),
                             0.4,
                             0.2,
                             1.0};
    Response response;
    response.simulate(input, x, true);
    std::size_t hint = 0;
    const double time = random.uniform(0.2, 1.0);
    const SimulationGradient gradient = response.at(time, true, hint).position_gradient;
    for (std::size_t j = 0; j < x.size(); ++j) {
      const double step = 1e-6;
      SimulationVector high = x;
      SimulationVector low = x;
      high[j] += step;
      low[j] -= step;
      Response shifted;
      shifted.simulate(input, high, false);
      const double above = position_at(shifted, time);
      shifted.simulate(input, low, false);
      const double below = position_at(shifted, time);
      EXPECT_NEAR(gradient[static_cast<Eigen::Index>(j)], (above - below) / (2.0 * step), 2e-6)
          << "seed " << seed << " parameter " << j;
    }
  }
}

}  // namespace
