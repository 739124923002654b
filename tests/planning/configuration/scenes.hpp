#pragma once

#include <array>
#include <cstdint>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include <flyball/core/random.hpp>
#include <flyball/planning/configuration/configuration_space.hpp>

namespace flyball::test {

/// Scenes are right; a mistake in one ends the program.
inline void must(const Expected<void>& result) {
  if (!result) {
    throw std::logic_error(to_string(result.error()));
  }
}

/// Figures 16.2 to 16.4: angle of an arm and height of its elevator; pointing down, the arm needs
/// 2 m.
inline ConfigurationSpace elevator_arm() {
  constexpr double pi = std::numbers::pi;
  auto space = ConfigurationSpace::create(
                   {{.name = "arm angle", .unit = "rad", .low = -0.75 * pi, .high = 0.75 * pi},
                    {.name = "elevator height", .unit = "m", .low = 0.0, .high = 5.0}})
                   .value();
  must(space.forbid("chassis", Region::box({-0.25 * pi, -1.0}, {0.25 * pi, 2.0})));
  return space;
}

/// An elevator of 1.5 m at x = 0 with three links of 0.9, 0.7 and 0.4 m among twelve discs of
/// 0.17 m. @param seed  3: the scene of the table; others: more of its kind. @param points  Whether
/// a link is six points, at l k/6, or the segment that they stand for.
inline PlanarMechanism arm_among_discs(std::uint32_t seed, bool points) {
  PlanarMechanism mechanism;
  mechanism.joints = {
      {.name = "elevator", .coordinate = 0, .slides = true, .angle = 0.5 * std::numbers::pi},
      {.name = "shoulder", .coordinate = 1, .parent = 0, .angle = -0.5 * std::numbers::pi},
      {.name = "elbow", .coordinate = 2, .parent = 1, .x = 0.9},
      {.name = "wrist", .coordinate = 3, .parent = 2, .x = 0.7}};
  const std::array<double, 3> lengths{0.9, 0.7, 0.4};
  const std::array<std::string, 3> names{"upper arm", "forearm", "hand"};
  for (int i = 0; i < 3; ++i) {
    const double l = lengths[static_cast<std::size_t>(i)];
    for (int k = 1; points && k <= 6; ++k) {
      mechanism.bodies.push_back({.name = names[static_cast<std::size_t>(i)],
                                  .joint = i + 1,
                                  .from = {l * k / 6.0, 0.0},
                                  .to = {l * k / 6.0, 0.0}});
    }
    if (!points) {
      mechanism.bodies.push_back({.name = names[static_cast<std::size_t>(i)],
                                  .joint = i + 1,
                                  .from = {0.0, 0.0},
                                  .to = {l, 0.0}});
    }
  }
  std::uint32_t s = seed;
  const auto next = [&] {
    s = 1664525U * s + 1013904223U;
    return static_cast<double>(s >> 8) / 16777216.0;
  };
  for (int i = 0; i < 12; ++i) {
    const double x = 0.5 + 1.6 * next();
    const double y = -0.2 + 2.2 * next();
    mechanism.obstacles.push_back(
        PlanarObstacle::disc("disc " + std::to_string(i + 1), {x, y}, 0.17));
  }
  mechanism.obstacles.push_back(PlanarObstacle::half_plane("floor", {0.0, -0.2}, {0.0, 1.0}));
  return mechanism;
}

/// The space of such an arm.
inline ConfigurationSpace arm_space(std::uint32_t seed, bool points = false) {
  const auto turn = [](std::string name) {
    return SpaceAxis{.name = std::move(name), .unit = "rad", .low = -2.6, .high = 2.6};
  };
  auto space = ConfigurationSpace::create({{.name = "height", .unit = "m", .low = 0.0, .high = 1.5},
                                           turn("shoulder"),
                                           turn("elbow"),
                                           turn("wrist")})
                   .value();
  must(space.attach(arm_among_discs(seed, points)));
  return space;
}

inline std::vector<double> random_configuration(const ConfigurationSpace& space, Random& random) {
  std::vector<double> q;
  for (const SpaceAxis& axis : space.axes()) {
    q.push_back(random.uniform(axis.low, axis.high));
  }
  return q;
}

/// One that breaks no constraint.
inline std::vector<double> valid_configuration(const ConfigurationSpace& space, Random& random) {
  std::vector<double> q;
  do {
    q = random_configuration(space, random);
  } while (!space.valid(q));
  return q;
}

}  // namespace flyball::test
