#include <flyball/mechanisms/double_jointed_arm.hpp>

#include "core/try.hpp"
#include "mechanisms/lagrangian/two_link_checks.hpp"

namespace flyball::mechanisms {

namespace {

constexpr std::string_view in_double_jointed_arm = "double_jointed_arm";

TwoLinkPart part_of(const JointParameters& joint) {
  return {joint.length.si(), joint.mass.si(), joint.center_of_mass.si(),
          joint.moment_of_inertia.si()};
}

Expected<JointDrive> drive_of(const JointParameters& joint, std::string_view gearing,
                              std::string_view motor) {
  const DcMotor& driven = joint.motor;
  return Checks(in_double_jointed_arm)
      .positive(joint.gearing, gearing)
      .positive(driven.R, motor, "Ω")
      .positive(driven.Kt, motor, "N m/A")
      .positive(driven.Kv, motor, "rad/s/V")
      .map([&] {
        const double gain = joint.gearing * driven.Kt / driven.R;
        return JointDrive{gain, gain * joint.gearing / driven.Kv};
      });
}

}  // namespace

ModelDescription DoubleJointedArm::description() const {
  return {.name = "double-jointed arm",
          .states = {{"shoulder", "rad", true},
                     {"elbow", "rad", true},
                     {"shoulder velocity", "rad/s"},
                     {"elbow velocity", "rad/s"}},
          .inputs = {{"shoulder voltage", "V"}, {"elbow voltage", "V"}},
          .outputs = {{"shoulder", "rad", true}, {"elbow", "rad", true}}};
}

Expected<DoubleJointedArm> double_jointed_arm(const DoubleJointedArmParameters& parameters) {
  FLYBALL_TRY(const TwoLink links,
              detail::checked_links(part_of(parameters.first), part_of(parameters.second),
                                    parameters.gravity, in_double_jointed_arm));
  FLYBALL_TRY(const JointDrive first, drive_of(parameters.first, "first.gearing", "first.motor"));
  FLYBALL_TRY(const JointDrive second,
              drive_of(parameters.second, "second.gearing", "second.motor"));
  return DoubleJointedArm{links, first, second};
}

}  // namespace flyball::mechanisms
