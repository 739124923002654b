#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/control/swing_up/campaign.hpp>
#include <flyball/control/swing_up/energy_shaping.hpp>

#include "support/allocation_count.hpp"

namespace flyball::swing_up_test {
namespace {

using namespace flyball::literals;
using Eigen::Vector2d;
using Eigen::Vector4d;

constexpr double pi = std::numbers::pi;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

mechanisms::Pendulum bob() {
  return mechanisms::pendulum({.mass = 1_kg, .length = 1_m}).value();
}
mechanisms::CartPole cart() {
  return mechanisms::cart_pole({.cart_mass = 5_kg, .pole_mass = 0.5_kg, .pole_length = 50_cm})
      .value();
}
mechanisms::Acrobot rods() {
  return mechanisms::acrobot({.first = mechanisms::uniform_rod(1_m, 1_kg),
                              .second = mechanisms::uniform_rod(1_m, 1_kg)})
      .value();
}

/// How many of seeded starts stand.
template <class M, class Design>
int standing(const M& model, const Design& design, int starts, bool has_cart,
             const SwingUpTrial& trial) {
  constexpr int N = M::states();
  int stand = 0;
  for (int k = 0; k < starts; ++k) {
    Random random(1 + static_cast<unsigned long long>(k));
    const SwingUpRun run =
        try_swing_up(model, design.controller, random_start<N>(random, has_cart), trial);
    stand += run.stands ? 1 : 0;
    EXPECT_FALSE(run.left_track);
    EXPECT_LE(run.largest_input, design.loop.u_max(0));
  }
  return stand;
}

// A sample of bench/swing_up: of 10 000 starts each, all of the pendulum's and of the cart-pole's
// stand.
TEST(SwingUp, Pendulum) {
  const auto design = design_swing_up(bob(), {.limit = 0.4 * bob().gravity}).value();
  EXPECT_EQ(standing(bob(), design, 100, false, {}), 100);
  // From hanging still, where no energy law has anything to go by.
  EXPECT_TRUE(try_swing_up(bob(), design.controller, Vector2d(0.0, 0.0), {}).stands);
  EXPECT_TRUE(try_swing_up(bob(), design.controller, Vector2d(pi, 0.0), {}).stands);
}

TEST(SwingUp, CartPole) {
  const auto design = design_swing_up(cart(), {.limit = 20.0, .track = 2.0}).value();
  EXPECT_EQ(standing(cart(), design, 60, true, {.track = 2.0}), 60);
  EXPECT_TRUE(
      try_swing_up(cart(), design.controller, Vector4d(0.0, 0.0, 0.0, 0.0), {.track = 2.0}).stands);
  EXPECT_LE(design.region.extent(0), 2.0);
}

TEST(SwingUp, Acrobot) {
  const auto design = design_swing_up(rods(), {.limit = 10.0}).value();
  EXPECT_GE(standing(rods(), design, 40, false, {}), 38);
  EXPECT_TRUE(try_swing_up(rods(), design.controller, Vector4d(pi, 0.0, 0.0, 0.0), {}).stands);
}

// At an end of the track, on its way out, it brakes with all it has.
TEST(SwingUp, CartBrakesBeforeTheEnd) {
  const auto design = design_swing_up(cart(), {.limit = 20.0, .track = 2.0}).value();
  auto controller = design.controller;
  EXPECT_EQ(controller.calculate(Vector4d(1.8, 0.3, 1.0, 0.0)), -20.0);
  EXPECT_EQ(controller.calculate(Vector4d(-1.8, 0.3, -1.0, 0.0)), 20.0);
  EXPECT_LT(std::abs(controller.calculate(Vector4d(0.0, 0.3, 0.1, 0.0))), 20.0);
}

TEST(Balance, HasHysteresis) {
  const auto design = design_swing_up(bob(), {.limit = 4.0}).value();
  Balance<2> balance(balance_design<2>(design.loop, design.region, 2.0).value());
  // Along an axis V is known: V = P₁₁ e².
  const double e = std::sqrt(design.region.level / design.region.P(0, 0));
  EXPECT_FALSE(balance.engage(Vector2d(pi + 1.01 * e, 0.0)));
  EXPECT_TRUE(balance.engage(Vector2d(pi + 0.99 * e, 0.0)));
  EXPECT_TRUE(balance.engage(Vector2d(pi + 1.4 * e, 0.0)));
  EXPECT_FALSE(balance.engage(Vector2d(pi + 1.42 * e, 0.0)));
  EXPECT_FALSE(balance.engage(Vector2d(pi + 1.4 * e, 0.0)));
  EXPECT_TRUE(balance.engage(Vector2d(-pi + 0.99 * e, 0.0)));  // a turn less
  balance.reset();
  EXPECT_FALSE(balance.engage(Vector2d(pi + 1.4 * e, 0.0)));
  EXPECT_NEAR(balance.value(Vector2d(pi + e, 0.0)), design.region.level,
              1e-12 * design.region.level);
}

/// Finite and within its limits whatever comes, without allocation.
template <class Design, class State>
void expect_bounded(const Design& design, const State& some) {
  auto controller = design.controller;
  const double limit = design.loop.u_max(0);
  const test::AllocationCounter allocations;
  double sum = controller.calculate(some);
  if (test::counts_allocations()) {
    EXPECT_EQ(allocations.count(), 0u);
  }
  static_assert(noexcept(controller.calculate(some)));
  EXPECT_LE(std::abs(sum), limit);
  for (const double bad : {nan, std::numeric_limits<double>::infinity(), 1e300, -1e99, 1e-320}) {
    for (Eigen::Index i = 0; i < some.size(); ++i) {
      State x = some;
      x(i) = bad;
      const double u = controller.calculate(x);
      EXPECT_TRUE(std::isfinite(u));
      EXPECT_LE(std::abs(u), limit);
      // And is none the worse for it.
      controller.reset();
      auto fresh = design.controller;
      EXPECT_EQ(controller.calculate(some), fresh.calculate(some));
    }
  }
}

TEST(SwingUp, IsBounded) {
  expect_bounded(design_swing_up(bob(), {.limit = 4.0}).value(), Vector2d(0.3, 1.0));
  expect_bounded(design_swing_up(cart(), {.limit = 20.0, .track = 2.0}).value(),
                 Vector4d(0.1, 0.3, -0.2, 1.0));
  expect_bounded(design_swing_up(rods(), {.limit = 10.0, .most_cells = 20'000}).value(),
                 Vector4d(0.1, 0.3, -0.2, 1.0));
}

TEST(SwingUp, Errors) {
  for (const double bad : {0.0, -1.0, nan}) {
    EXPECT_EQ(design_swing_up(bob(), {.limit = bad}).error().subject(), "limit");
    EXPECT_EQ(design_swing_up(cart(), {.limit = 20.0, .track = bad}).error().subject(), "track");
  }
  auto floating = bob();
  floating.gravity = 0.0;
  EXPECT_TRUE(design_swing_up(floating, {.limit = 1.0}).error().is(ArgumentError::not_positive));
  auto still = rods();
  still.links.first_moment = still.links.second_moment = 0.0;
  EXPECT_TRUE(design_swing_up(still, {.limit = 1.0}).error().is(ArgumentError::not_positive));
  const auto design = design_swing_up(bob(), {.limit = 4.0}).value();
  EXPECT_TRUE(
      balance_design<2>(design.loop, design.region, 0.5).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(balance_design<4>(design.loop, design.region).error().is(ArgumentError::wrong_shape));
  SaturatedLoop free = design.loop;
  free.u_max = Eigen::VectorXd();
  EXPECT_TRUE(balance_design<2>(free, design.region).error().is(ArgumentError::wrong_shape));
}

}  // namespace
}  // namespace flyball::swing_up_test
