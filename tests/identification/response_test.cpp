#include <cmath>
#include <numeric>
#include <vector>

#include <flyball/core/random.hpp>

#include "identification/response.hpp"

namespace response_test {
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
  return input;
}

/// kS, kV and τ of above, a constant force and a start.
SimulationVector at_velocity(double initial, double force = 0.0) {
  SimulationVector x{};
  x[parameter::static_friction] = kS;
  x[parameter::velocity_gain] = kV;
  x[parameter::log_time_constant] = std::log(tau);
  x[parameter::gravity_cosine] = force;
  x[parameter::headroom] = no_limit;
  x[parameter::initial_velocity] = initial;
  return x;
}

double velocity_at(const Response& response, double time) {
  std::size_t hint = 0;
  return response.velocity(response.place(time, hint));
}

double position_at(const Response& response, double time) {
  std::size_t hint = 0;
  return response.position(response.place(time, hint));
}

/// The position's derivatives by the columns.
std::vector<double> gradient_at(const RunInput& input, const SimulationVector& x,
                                const SimulationColumns& columns, double time) {
  Response response;
  response.simulate(input, x, columns);
  std::vector<double> gradient;
  with_width(columns.size(), [&](auto width) {
    gradient.assign(static_cast<std::size_t>(width()), 0.0);
    std::size_t hint = 0;
    response.add_gradient<width()>(response.place(time, hint), 1.0, gradient.data());
  });
  gradient.resize(columns.size());
  return gradient;
}

// v(t) = (V − kS)/kV (1 − e^(−t/τ)), p(t) = (V − kS)/kV (t − τ (1 − e^(−t/τ)))
TEST(Response, StepFromRestIsExponential) {
  const RunInput input = steady(3.0, 1.0, 0.02);
  Response response;
  response.simulate(input, at_velocity(0.0));
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
  response.simulate(input, at_velocity(v0));
  const double stop = tau * std::log(1.0 + v0 * kV / kS);
  EXPECT_NEAR(position_at(response, 0.9), v0 * tau - stop * kS / kV, 1e-12);
  EXPECT_EQ(velocity_at(response, 0.9), 0.0);
}

TEST(Response, SticksBelowBreakawayAndSlipsBackAboveIt) {
  const RunInput below = steady(0.39, 1.0, 0.05);
  const RunInput above = steady(-0.6, 1.0, 0.05);
  Response response;
  response.simulate(below, at_velocity(0.0));
  EXPECT_EQ(position_at(response, 1.0), 0.0);
  // Reverses: forward friction until rest, then backwards towards (V + kS)/kV = −0.1.
  response.simulate(above, at_velocity(0.5));
  EXPECT_NEAR(velocity_at(response, 1.0), -0.1, 1e-3);
}

TEST(Response, GravityActsLikeVoltage) {
  RunInput input = steady(3.0, 1.0, 0.02);
  input.forces[0].assign(input.time.size(), 1.0);
  Response with_gravity;
  with_gravity.simulate(input, at_velocity(0.0, 0.7));
  const RunInput lower = steady(2.3, 1.0, 0.02);
  Response without;
  without.simulate(lower, at_velocity(0.0));
  EXPECT_NEAR(velocity_at(with_gravity, 0.7), velocity_at(without, 0.7), 1e-13);
}

TEST(Response, StaysAtTheInitialVelocityBeforeItsStart) {
  const RunInput input = steady(3.0, 0.2, 0.02);
  Response response;
  response.simulate(input, at_velocity(0.8));
  EXPECT_NEAR(position_at(response, -0.05), -0.04, 1e-15);
}

// At the limit the speed grows by (headroom − kS)/kA until V − kV v = headroom, then on as without.
TEST(Response, TheCurrentLimitMakesAStraightRise) {
  const RunInput input = steady(6.0, 1.0, 0.02);
  SimulationVector x = at_velocity(0.0);
  const double headroom = 3.0;
  x[parameter::headroom] = headroom;
  Response response;
  response.simulate(input, x);
  const double slope = (headroom - kS) / (kV * tau);
  const double leaves = (6.0 - headroom) / kV / slope;
  EXPECT_NEAR(velocity_at(response, 0.1), 0.1 * slope, 1e-12);
  EXPECT_NEAR(position_at(response, 0.1), 0.005 * slope, 1e-12);
  const double v_end = (6.0 - kS) / kV;
  const double v_left = leaves * slope;
  EXPECT_NEAR(velocity_at(response, 0.8),
              v_end + (v_left - v_end) * std::exp(-(0.8 - leaves) / tau), 1e-12);
}

// Braking against the limit: it slows evenly, stops, and turns where the limit lets it.
TEST(Response, TheCurrentLimitHoldsWhenBraking) {
  const RunInput input = steady(-6.0, 1.0, 0.05);
  SimulationVector x = at_velocity(2.0);
  x[parameter::headroom] = 3.0;
  Response response;
  response.simulate(input, x);
  const double braking = (3.0 + kS) / (kV * tau);
  const double rest = 2.0 / braking;
  EXPECT_NEAR(position_at(response, rest), 0.5 * 2.0 * rest, 1e-3);
  EXPECT_NEAR(velocity_at(response, 0.2), -(0.2 - rest) * (3.0 - kS) / (kV * tau), 1e-12);
}

// At the first and the last row it is what it is beside them, and after the last it goes on.
TEST(Response, AtItsFirstAndLastRows) {
  const RunInput input = steady(3.0, 0.2, 0.02);
  Response response;
  response.simulate(input, at_velocity(0.8));
  EXPECT_EQ(position_at(response, 0.0), 0.0);
  EXPECT_EQ(velocity_at(response, 0.0), 0.8);
  const double last = input.time.back();
  // v(t) = v∞ + (0.8 − v∞) e^(−t/τ), v∞ = (3 − 0.4)/2
  const double velocity = 1.3 - 0.5 * std::exp(-last / tau);
  const double position = 1.3 * last - 0.5 * tau * (1.0 - std::exp(-last / tau));
  EXPECT_NEAR(velocity_at(response, last), velocity, 1e-12);
  EXPECT_NEAR(position_at(response, last), position, 1e-12);
  EXPECT_NEAR(position_at(response, last + 0.1), position + 0.1 * velocity, 1e-12);
}

// Central differences of the position, over random inputs that change direction.
TEST(Response, SensitivitiesAreDerivatives) {
  int limited = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    RunInput input = steady(0.0, 1.0, 0.011);
    for (auto& force : input.forces) {
      force.resize(input.time.size());
    }
    for (std::size_t i = 0; i < input.time.size(); ++i) {
      const double time = input.time[i];
      input.voltage[i] =
          4.0 * std::sin(6.0 * time + static_cast<double>(seed)) + random.normal(0.0, 0.1);
      input.forces[0][i] = std::cos(time);
      input.forces[1][i] = std::sin(time);
      input.forces[2][i] = 1.0;
      input.forces[3][i] = time - 0.5;
      input.forces[4][i] = std::sin(3.0 * time);
    }
    SimulationVector x = at_velocity(1.0, 0.4);
    x[parameter::static_friction] = random.uniform(0.05, 0.3);
    x[parameter::velocity_gain] = random.uniform(0.5, 2.0);
    x[parameter::log_time_constant] = std::log(random.uniform(0.02, 0.3));
    x[parameter::gravity_sine] = 0.2;
    x[parameter::bias] = 0.1;
    x[parameter::spring] = -0.3;
    x[parameter::drag] = 0.15;
    x[parameter::headroom] = seed % 2 == 0 ? no_limit : random.uniform(1.0, 3.0);
    SimulationColumns all(simulation_parameter_count);
    std::iota(all.begin(), all.end(), 0);
    const double time = random.uniform(0.2, 1.0);
    const std::vector<double> gradient = gradient_at(input, x, all, time);
    limited += gradient[parameter::headroom] != 0.0 ? 1 : 0;
    // Each width that is computed, and columns that leave some out.
    for (const SimulationColumns& columns :
         {SimulationColumns{0, 1, 2}, SimulationColumns{0, 1, 2, 5, 16},
          SimulationColumns{0, 1, 2, 3, 4, 6, 15},
          SimulationColumns{0, 1, 2, 5, 6, 7, 8, 15, 16}}) {
      const std::vector<double> some = gradient_at(input, x, columns, time);
      for (std::size_t k = 0; k < columns.size(); ++k) {
        EXPECT_NEAR(some[k], gradient[static_cast<std::size_t>(columns[k])], 1e-14)
            << "seed " << seed << " parameter " << columns[k];
      }
    }
    for (std::size_t j = 0; j < x.size(); ++j) {
      const double step = j == parameter::headroom ? 1e-5 : 1e-6;
      SimulationVector high = x;
      SimulationVector low = x;
      high[j] += step;
      low[j] -= step;
      Response shifted;
      shifted.simulate(input, high);
      const double above = position_at(shifted, time);
      shifted.simulate(input, low);
      const double below = position_at(shifted, time);
      EXPECT_NEAR(gradient[j], (above - below) / (2.0 * step), 3e-6)
          << "seed " << seed << " parameter " << j;
    }
  }
  EXPECT_GE(limited, 15);
}

}  // namespace
}  // namespace response_test
