#include <flyball/mechanisms/pendulum.hpp>

namespace flyball::mechanisms {

ModelDescription Pendulum::description() const {
  return {.name = "pendulum",
          .states = {{"angle", "rad", true}, {"angular velocity", "rad/s"}},
          .inputs = {{"torque", "N·m"}},
          .outputs = {{"angle", "rad", true}},
          .parameters = {{"mass", "kg", mass},
                         {"length", "m", length},
                         {"damping", "N·m·s/rad", damping},
                         {"gravity", "m/s²", gravity}}};
}

Expected<Pendulum> pendulum(const PendulumParameters& parameters) {
  const auto& [mass, length, damping, gravity] = parameters;
  return Checks("pendulum")
      .positive(mass.si(), "mass", "kg")
      .positive(length.si(), "length", "m")
      .not_negative(damping, "damping", "N·m·s/rad")
      .not_negative(gravity, "gravity", "m/s²")
      .map([&] { return Pendulum{mass.si(), length.si(), damping, gravity}; });
}

}  // namespace flyball::mechanisms
