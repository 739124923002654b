#include <flyball/mechanisms/acrobot.hpp>

#include "mechanisms/lagrangian/two_link_checks.hpp"

namespace flyball::mechanisms {

namespace {

TwoLinkPart part_of(const AcrobotLink& link) {
  return {link.length.si(), link.mass.si(), link.center_of_mass.si(), link.moment_of_inertia.si()};
}

}  // namespace

ModelDescription Acrobot::description() const {
  return {.name = "acrobot",
          .states = {{"shoulder", "rad", true},
                     {"elbow", "rad", true},
                     {"shoulder velocity", "rad/s"},
                     {"elbow velocity", "rad/s"}},
          .inputs = {{"torque", "N m"}},
          .outputs = {{"shoulder", "rad", true}, {"elbow", "rad", true}}};
}

AcrobotLink uniform_rod(Length length, Mass mass) {
  return {.length = length,
          .mass = mass,
          .center_of_mass = Length(0.5 * length.si()),
          .moment_of_inertia = MomentOfInertia(mass.si() * length.si() * length.si() / 12.0)};
}

Expected<Acrobot> acrobot(const AcrobotParameters& parameters) {
  return detail::checked_links(part_of(parameters.first), part_of(parameters.second),
                               parameters.gravity, "acrobot")
      .map([](const TwoLink& links) { return Acrobot{links}; });
}

}  // namespace flyball::mechanisms
