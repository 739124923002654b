#include <flyball/planning/configuration/configuration_space.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "planning/configuration/scenes.hpp"

namespace flyball::configuration_space_test {
namespace {

using test::random_configuration;
constexpr double pi = std::numbers::pi;

/// Everything that a constraint may be made of, over an angle that wraps, one that does not and a
/// length.
ConfigurationSpace mixed_space(Random& random) {
  auto space = ConfigurationSpace::create(
                   {{.name = "lift", .unit = "m", .low = 0.0, .high = 1.2},
                    {.name = "turret", .unit = "rad", .low = -pi, .high = pi, .wraps = true},
                    {.name = "arm", .unit = "rad", .low = -2.0, .high = 2.0, .scale = 0.8}})
                   .value();
  const double x = random.uniform(0.2, 0.8);
  EXPECT_TRUE(space.forbid("wedge", Region::polygon(0, 2, {{x, -0.5}, {x + 0.3, 0.4}, {x, 0.2}})));
  EXPECT_TRUE(
      space.forbid("cable", Region::interval(1, 2.5, 3.4) & Region::interval(0, -1.0, 0.5)));
  EXPECT_TRUE(space.require(
      "cover", Region::half_space({1.0, 0.0, 0.4}, 1.5) | !Region::interval(1, -0.6, 0.5)));
  EXPECT_TRUE(space.forbid("post", Region::polygon(1, 2, {{2.9, 0.5}, {3.6, 0.9}, {3.0, 1.4}})));
  PlanarMechanism mechanism;
  mechanism.joints = {{.name = "lift", .coordinate = 0, .slides = true, .angle = pi / 2},
                      {.name = "turret", .coordinate = 1, .parent = 0, .x = 0.1, .angle = -0.7},
                      {.name = "arm", .coordinate = 2, .parent = 1, .x = 0.6, .y = 0.05}};
  mechanism.bodies = {{"beam", 1, {0.0, 0.0}, {0.6, 0.05}, 0.04},
                      {"claw", 2, {0.05, 0.02}, {0.4, 0.1}, 0.03},
                      {"counterweight", 1, {-0.3, 0.0}, {-0.3, 0.0}, 0.08},
                      {"mast", 0, {-0.8, 0.0}, {0.0, 0.0}, 0.02}};
  mechanism.obstacles = {
      PlanarObstacle::disc("ball", {0.7, 1.2}, 0.15),
      PlanarObstacle::box("bumper", {0.4, -0.2}, {0.9, random.uniform(0.0, 0.2)}),
      PlanarObstacle::polygon("hook", {{-0.9, 0.2}, {-0.5, 0.2}, {-0.5, 0.9}, {-0.7, 0.4}}),
      PlanarObstacle::half_plane("floor", {0.0, -0.4}, {0.1, 1.0}),
      PlanarObstacle::frame("frame", {{-1.2, -0.6}, {1.3, -0.6}, {1.1, 2.0}, {-1.2, 2.0}})};
  mechanism.obstacles[1].spares = {"mast"};
  mechanism.obstacles[2].spares = {"mast"};
  mechanism.obstacles[4].spares = {"mast"};
  mechanism.obstacles[3].spares = {"mast"};
  mechanism.apart = {{"claw", "mast"}, {"claw", "counterweight"}};
  mechanism.masses = {{1, {0.3, 0.0}, 2.0}, {2, {0.3, 0.0}, 3.0}};
  mechanism.holding = {{1, 28.0}, {0, 60.0}};
  EXPECT_TRUE(space.attach(mechanism));
  return space;
}

// A half-plane, a rectangle and their unions as section 16.1 has them: distances by hand.
TEST(ConfigurationSpace, MarginsOfRegionsAreDistances) {
  const ConfigurationSpace space = test::elevator_arm();
  EXPECT_TRUE(space.valid(std::vector{-1.0, 0.5}));
  EXPECT_FALSE(space.valid(std::vector{0.0, 1.9}));
  // On its edge and on its corner it is valid.
  EXPECT_TRUE(space.valid(std::vector{0.0, 2.0}));
  EXPECT_TRUE(space.valid(std::vector{-0.25 * pi, 0.5}));
  EXPECT_NEAR(space.clearance(std::vector{-1.0, 0.5}), 1.0 - 0.25 * pi, 1e-12);
  EXPECT_NEAR(space.clearance(std::vector{0.0, 1.9}), -0.1, 1e-12);
  const auto broken = space.broken(std::vector{0.0, 1.9});
  ASSERT_EQ(broken.size(), 1U);
  EXPECT_EQ(broken[0].name, "chassis");
  EXPECT_NEAR(broken[0].margin, -0.1, 1e-12);
  EXPECT_FALSE(space.valid(std::vector{0.0}));
  EXPECT_FALSE(space.valid(std::vector{0.0, std::nan("")}));
}

// Straight down the arm's tip is 0.9 + 0.7 + 0.4 m below the carriage.
TEST(ConfigurationSpace, MarginsOfContactsAreDistances) {
  PlanarMechanism mechanism;
  mechanism.joints = {{.name = "arm", .coordinate = 0}};
  mechanism.bodies = {{"arm", 0, {0.0, 0.0}, {1.0, 0.0}, 0.05}};
  mechanism.obstacles = {PlanarObstacle::disc("disc", {2.0, 0.0}, 0.5),
                         PlanarObstacle::box("box", {0.5, -1.0}, {0.8, -0.4}),
                         PlanarObstacle::half_plane("floor", {0.0, -1.2}, {0.0, 2.0}),
                         PlanarObstacle::frame("frame", {{-3, -3}, {1.5, -3}, {1.5, 3}, {-3, 3}})};
  mechanism.masses = {{0, {0.5, 0.0}, 2.0}};
  mechanism.holding = {{0, 12.0}};
  auto space =
      ConfigurationSpace::create({{.name = "arm", .unit = "rad", .low = -1.6, .high = 1.6}})
          .value();
  ASSERT_TRUE(space.attach(mechanism));
  const auto level = space.margins(std::vector{0.0});
  ASSERT_EQ(level.size(), 6U);
  EXPECT_EQ(level[0].name, "arm beyond its stops");
  EXPECT_EQ(level[1].name, "arm meets disc");
  EXPECT_NEAR(level[1].margin, 2.0 - 1.0 - 0.5 - 0.05, 1e-12);
  EXPECT_EQ(level[2].name, "arm meets box");
  EXPECT_NEAR(level[2].margin, 0.4 - 0.05, 1e-12);
  EXPECT_NEAR(level[3].margin, 1.2 - 0.05, 1e-12);
  EXPECT_EQ(level[4].name, "arm leaves frame");
  EXPECT_NEAR(level[4].margin, 0.5 - 0.05, 1e-12);
  EXPECT_EQ(level[5].name, "what arm has to hold");
  EXPECT_NEAR(level[5].margin, 12.0 - 2.0 * 9.80665 * 0.5, 1e-12);
  EXPECT_EQ(level[5].unit, "N·m");
  // At -45° the tip is at (0.707, -0.707): in the box, 0.093 from its right side, and its axis
  // enters at x = 0.5.
  const auto down = space.margins(std::vector{-0.25 * pi});
  EXPECT_LT(down[2].margin, -0.05 - 0.05);
  EXPECT_GT(down[2].margin, -0.05 - 0.15);
  const auto error = space.check(std::vector{-0.25 * pi}, "plan", "the goal");
  ASSERT_FALSE(error);
  EXPECT_TRUE(error.error().is(ConfigurationError::in_collision));
  EXPECT_EQ(to_string(error.error()).find("plan: the goal is in breach of arm meets box by 0.1"),
            0U)
      << to_string(error.error());
}

// What clearance promises holds for every configuration that near; so does what it denies.
TEST(ConfigurationSpace, ClearanceIsNeverMoreThanTrue) {
  Random random(5);
  int free = 0;
  int blocked = 0;
  for (int trial = 0; trial < 1500; ++trial) {
    Random scene(static_cast<std::uint64_t>(trial % 7));
    const ConfigurationSpace space =
        trial % 3 == 0 ? test::arm_space(3U + static_cast<std::uint32_t>(trial % 5))
                       : mixed_space(scene);
    for (int k = 0; k < 4; ++k) {
      const std::vector<double> q = random_configuration(space, random);
      const double clearance = space.clearance(q);
      EXPECT_EQ(space.valid(q), clearance >= -1e-11);
      EXPECT_EQ(space.broken(q).empty(), clearance >= -1e-11);
      if (std::abs(clearance) < 1e-4) {
        continue;  // What touches is valid.
      }
      (clearance > 0.0 ? free : blocked) += 1;
      for (int n = 0; n < 8; ++n) {
        std::vector<double> near = q;
        for (std::size_t i = 0; i < near.size(); ++i) {
          const double size = std::abs(clearance) * space.axes()[i].scale * (1.0 - 1e-6);
          near[i] +=
              n % 2 == 0 ? (random.uniform() < 0.5 ? size : -size) : random.uniform(-size, size);
        }
        ASSERT_EQ(space.valid(near), clearance > 0.0) << clearance;
      }
    }
  }
  EXPECT_GT(free, 1000);
  EXPECT_GT(blocked, 1000);
}

// A move that is free is valid at every sample; where it is stopped it is not valid soon after, or
// touches.
TEST(ConfigurationSpace, MovesAreJudgedAlongTheirWholeLength) {
  Random random(8);
  int free = 0;
  int stopped = 0;
  for (int trial = 0; trial < 600; ++trial) {
    Random scene(static_cast<std::uint64_t>(trial % 7));
    const ConfigurationSpace space =
        trial % 3 == 0 ? test::arm_space(3U + static_cast<std::uint32_t>(trial % 5))
                       : mixed_space(scene);
    const std::vector<double> from = random_configuration(space, random);
    if (!space.valid(from)) {
      continue;
    }
    const std::vector<double> by = space.difference(from, random_configuration(space, random));
    const MoveCheck move = space.check_move(from, by);
    (move.free ? free : stopped) += 1;
    const auto at = [&](double s) {
      std::vector<double> q = from;
      for (std::size_t i = 0; i < q.size(); ++i) {
        q[i] += s * by[i];
      }
      return q;
    };
    for (int k = 0; k <= 400; ++k) {
      ASSERT_TRUE(space.valid(at(move.at * (1.0 - 1e-9) * k / 400.0)));
    }
    if (!move.free) {
      EXPECT_FALSE(move.constraint.empty());
      const std::vector<double> stop = at(move.at);
      EXPECT_LT(space.clearance(stop), 1e-6) << move.constraint;
    }
  }
  EXPECT_GT(free, 30);
  EXPECT_GT(stopped, 100);
}

// Along the edge of what is forbidden, and through its corner, is free; a hair inside is not.
TEST(ConfigurationSpace, MovesMayRunAlongEdges) {
  const ConfigurationSpace space = test::elevator_arm();
  const auto free = [&](std::vector<double> from, std::vector<double> to) {
    return space.check_move(from, space.difference(from, to)).free;
  };
  EXPECT_TRUE(free({-0.25 * pi, 2.0}, {0.25 * pi, 2.0}));
  EXPECT_TRUE(free({-1.0, 0.5}, {-0.25 * pi, 2.0}));
  EXPECT_TRUE(free({0.25 * pi, 2.0}, {1.0, 0.5}));
  EXPECT_TRUE(free({-0.25 * pi, 0.0}, {-0.25 * pi, 5.0}));
  EXPECT_FALSE(free({-0.25 * pi - 0.1, 2.0 - 1e-9}, {0.25 * pi + 0.1, 2.0 - 1e-9}));
  const MoveCheck level = space.check_move(std::vector{-1.0, 0.5}, std::vector{2.0, 0.0});
  EXPECT_FALSE(level.free);
  EXPECT_EQ(level.constraint, "chassis");
  EXPECT_NEAR(level.at, (1.0 - 0.25 * pi) / 2.0, 1e-9);
}

// What is forbidden up to a stop is forbidden along it.
TEST(ConfigurationSpace, NoWayLeadsAlongAStop) {
  for (const bool polygon : {false, true}) {
    auto space = ConfigurationSpace::create({{.name = "x", .unit = "m", .low = -1.0, .high = 1.0},
                                             {.name = "y", .unit = "m", .low = 0.0, .high = 5.0}})
                     .value();
    test::must(space.forbid(
        "chassis", polygon
                       ? Region::polygon(0, 1, {{-0.5, 0.0}, {0.5, 0.0}, {0.5, 2.0}, {-0.5, 2.0}})
                       : Region::box({-0.5, 0.0}, {0.5, 2.0})));
    EXPECT_FALSE(space.valid(std::vector{0.0, 0.0}));
    EXPECT_TRUE(space.valid(std::vector{0.5, 0.0}));
    EXPECT_TRUE(space.valid(std::vector{0.0, 2.0}));
    const MoveCheck move = space.check_move(std::vector{-1.0, 0.0}, std::vector{2.0, 0.0});
    EXPECT_FALSE(move.free);
    EXPECT_NEAR(move.at, 0.25, 1e-9);
  }
}

// What wraps goes the short way, and is the same a turn on.
TEST(ConfigurationSpace, AnglesWrap) {
  Random random(2);
  const ConfigurationSpace space = mixed_space(random);
  for (int trial = 0; trial < 500; ++trial) {
    std::vector<double> q = random_configuration(space, random);
    const double clearance = space.clearance(q);
    q[1] += 2.0 * pi * (trial % 5 - 2);
    EXPECT_NEAR(space.clearance(q), clearance, 1e-12);
  }
  const auto by = space.difference(std::vector{0.0, 3.0, 0.0}, std::vector{0.0, -3.0, 0.0});
  EXPECT_NEAR(by[1], 2.0 * pi - 6.0, 1e-15);
  EXPECT_NEAR(space.length(std::vector{3.0, 4.0, 0.0}), 5.0, 1e-15);
}

// Valid with a buffer means valid for everything that near; and no buffer changes nothing.
TEST(ConfigurationSpace, BuffersHoldForAllThatIsNear) {
  Random random(12);
  int kept = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Random scene(static_cast<std::uint64_t>(trial % 7));
    const ConfigurationSpace space = mixed_space(scene);
    const std::vector<double> error{0.03, 0.05, 0.04};
    const ConfigurationSpace tight = space.with_buffer(error).value();
    const ConfigurationSpace same = space.with_buffer(std::vector{0.0, 0.0, 0.0}).value();
    for (int k = 0; k < 20; ++k) {
      const std::vector<double> q = random_configuration(space, random);
      EXPECT_EQ(same.clearance(q), space.clearance(q));
      if (!tight.valid(q)) {
        continue;
      }
      ++kept;
      for (int n = 0; n < 8; ++n) {
        std::vector<double> near = q;
        for (std::size_t i = 0; i < 3; ++i) {
          near[i] += n % 2 == 0 ? (random.uniform() < 0.5 ? error[i] : -error[i])
                                : random.uniform(-error[i], error[i]);
        }
        ASSERT_TRUE(space.valid(near));
      }
    }
  }
  EXPECT_GT(kept, 300);
  EXPECT_FALSE(test::elevator_arm().with_buffer(std::vector{0.0, 2.5}));
  EXPECT_FALSE(test::elevator_arm().with_buffer(std::vector{0.0, -0.1}));
  EXPECT_FALSE(test::elevator_arm().with_buffer(std::vector{0.1}));
}

TEST(ConfigurationSpace, WhatCannotBeASpaceIsRefused) {
  const SpaceAxis good{.name = "x", .unit = "m", .low = 0.0, .high = 1.0};
  EXPECT_TRUE(ConfigurationSpace::create({}).error().is(ArgumentError::empty));
  EXPECT_TRUE(ConfigurationSpace::create({good, good}).error().is(ArgumentError::ambiguous_name));
  SpaceAxis bad = good;
  bad.high = 0.0;
  EXPECT_EQ(to_string(ConfigurationSpace::create({bad}).error()),
            "configuration space: x is from 0 to 0; it must be a low stop below its high one");
  bad.high = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(ConfigurationSpace::create({bad}).error().is(ArgumentError::not_finite));
  SpaceAxis turret{.name = "turret", .unit = "rad", .low = -pi, .high = pi, .wraps = true};
  auto space = ConfigurationSpace::create({good, turret}).value();
  const auto refused = [&](const Region& region) { return !space.require("r", region); };
  EXPECT_TRUE(refused(Region::interval(2, 0.0, 1.0)));
  EXPECT_TRUE(refused(Region::interval(0, 1.0, 0.0)));
  EXPECT_TRUE(refused(Region::interval(0, std::nan(""), 1.0)));
  EXPECT_TRUE(refused(Region::half_space({1.0, 1.0}, 0.0)));
  EXPECT_TRUE(refused(Region::half_space({0.0, 0.0}, 0.0)));
  EXPECT_TRUE(refused(Region::half_space({1.0}, 0.0)));
  EXPECT_TRUE(refused(Region::polygon(0, 1, {{0, 0}, {1, 0}})));
  EXPECT_TRUE(refused(Region::polygon(0, 1, {{0, 0}, {1, 1}, {2, 2}})));
  EXPECT_TRUE(refused(Region::polygon(0, 1, {{0, 0}, {1, 1}, {1, 0}, {0, 1}})));
  EXPECT_TRUE(refused(Region::polygon(0, 0, {{0, 0}, {1, 0}, {1, 1}})));
  EXPECT_TRUE(refused(Region::box({0.0}, {1.0, 1.0})));
  EXPECT_FALSE(refused(Region::polygon(0, 1, {{0, 0}, {0, 1}, {1, 0}})));
  PlanarMechanism mechanism;
  EXPECT_FALSE(space.attach(mechanism));
  mechanism.joints = {{.name = "lift", .coordinate = 1, .slides = true}};
  EXPECT_FALSE(space.attach(mechanism));
  mechanism.joints = {{.name = "arm", .coordinate = 1, .parent = 0}};
  EXPECT_FALSE(space.attach(mechanism));
  mechanism.joints = {{.name = "arm", .coordinate = 1}};
  mechanism.bodies = {{"arm", 1, {0, 0}, {1, 0}, 0.1}};
  EXPECT_FALSE(space.attach(mechanism));
  mechanism.bodies[0].joint = 0;
  mechanism.holding = {{0, 0.0}};
  EXPECT_FALSE(space.attach(mechanism));
  mechanism.holding.clear();
  mechanism.apart = {{"arm", "leg"}};
  EXPECT_EQ(to_string(space.attach(mechanism).error()),
            "configuration space: apart is \"leg\"; it must be the name of a body");
  mechanism.apart.clear();
  // Beyond 1e9 single precision has no margins: of such a link each move was judged for nothing.
  mechanism.bodies[0].to = {1.7e308, 0.0};
  EXPECT_TRUE(space.attach(mechanism).error().is(ArgumentError::out_of_range));
  mechanism.bodies[0].to = {1.0, 0.0};
  mechanism.obstacles = {PlanarObstacle::disc("far", {0.0, -1e20}, 1.0)};
  EXPECT_TRUE(space.attach(mechanism).error().is(ArgumentError::out_of_range));
  mechanism.obstacles = {PlanarObstacle::disc("far", {0.0, -1e8}, 1.0)};
  EXPECT_TRUE(space.attach(mechanism));
  EXPECT_FALSE(space.attach(mechanism));
  bad = good;
  bad.high = 1e20;
  EXPECT_TRUE(ConfigurationSpace::create({bad}).error().is(ArgumentError::out_of_range));
}

// Regions all at once are those one by one; one that is none leaves the space as it was.
TEST(ConfigurationSpace, ManyRegionsAtOnce) {
  const auto space = [] {
    return ConfigurationSpace::create(
               {{.name = "x", .low = 0.0, .high = 4.0}, {.name = "y", .low = 0.0, .high = 4.0}})
        .value();
  };
  ConfigurationSpace together = space();
  ConfigurationSpace one_by_one = space();
  std::vector<ConfigurationSpace::NamedRegion> regions;
  Random random(5);
  for (int i = 0; i < 40; ++i) {
    const double x = random.uniform(0.0, 3.8);
    const double y = random.uniform(0.0, 3.8);
    regions.push_back({"post", Region::box({x, y}, {x + 0.2, y + 0.2}), true});
    ASSERT_TRUE(one_by_one.forbid("post", regions.back().region));
  }
  ASSERT_TRUE(together.constrain(regions));
  EXPECT_EQ(together.constraints(), one_by_one.constraints());
  for (int i = 0; i < 2000; ++i) {
    const std::vector<double> q{random.uniform(-0.1, 4.1), random.uniform(-0.1, 4.1)};
    EXPECT_EQ(together.valid(q), one_by_one.valid(q));
    EXPECT_EQ(together.clearance(q), one_by_one.clearance(q));
  }
  regions.push_back({"nowhere", Region::interval(7, 0.0, 1.0), true});
  EXPECT_FALSE(together.constrain(regions));
  EXPECT_EQ(together.constraints().size(), one_by_one.constraints().size());
}

}  // namespace
}  // namespace flyball::configuration_space_test
