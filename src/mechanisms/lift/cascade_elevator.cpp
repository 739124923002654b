#include <flyball/mechanisms/lift/cascade_elevator.hpp>

#include <flyball/mechanisms/lift/elevator_arm.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::mechanisms {

namespace {

constexpr std::string_view in_cascade_elevator = "cascade_elevator";

}  // namespace

ModelDescription CascadeElevator::description() const {
  return {.name = "elevator of stages",
          .states = {{"position", "m"}, {"velocity", "m/s"}},
          .inputs = {{"voltage", "V"}},
          .outputs = {{"position", "m"}},
          .parameters = {{"inertia", "kg", p_(0)},
                         {"weight", "N", p_(1)},
                         {"spring_force", "N", p_(2)},
                         {"spring_stiffness", "N/m", p_(3)}}};
}

Expected<Elevator> CascadeElevator::elevator() const {
  if (p_(3) > 0.0) {
    return refusal(ArgumentError::out_of_range, "CascadeElevator::elevator", "the counterbalance")
        .got(flyball::detail::format("a spring of {:.4g} N/m at the carriage", p_(3)))
        .expected("a constant force, whose elevator is the same at every height")
        .hint("linearize(model, x, u) gives the system about a height");
  }
  const double volts = shaft_.R * arm_ / (shaft_.gearing * shaft_.Kt);  // per newton
  return mechanisms::elevator(FeedforwardGains{.kS = volts * shaft_.friction / arm_,
                                               .kV = shaft_.gearing / (shaft_.Kv * arm_) +
                                                     volts * shaft_.damping / (arm_ * arm_),
                                               .kA = volts * p_(0),
                                               .kG = volts * (p_(1) - p_(2))})
      .map([&](Elevator made) {
        made.nominal_voltage = nominal_voltage_;
        return made;
      });
}

Expected<CascadeElevator> cascade_elevator(const CascadeElevatorParameters& parameters) {
  const auto& [drive, drum_radius, carriage, stages, spring] = parameters;
  FLYBALL_TRY(const detail::Shaft shaft,
              detail::checked_shaft(drive, in_cascade_elevator, "shaft", true));
  FLYBALL_CHECK(Checks(in_cascade_elevator)
                    .positive(drum_radius.si(), "drum_radius", "m")
                    .positive(carriage.si(), "carriage", "kg")
                    .not_negative(spring.force.si(), "the counterbalance's force", "N")
                    .not_negative(spring.stiffness, "the counterbalance's stiffness", "N/m"));
  const auto n = static_cast<double>(stages.size() + 1);
  double inertia = carriage.si();
  double weight = carriage.si() * standard_gravity;
  for (std::size_t k = 0; k < stages.size(); ++k) {
    FLYBALL_CHECK(check_not_negative(stages[k].si(), in_cascade_elevator,
                                     flyball::detail::format("the mass of stage {}", k + 1), "kg"));
    const double share = static_cast<double>(k + 1) / n;
    inertia += stages[k].si() * share * share;
    weight += stages[k].si() * standard_gravity * share;
  }
  double pulled = 1.0;
  if (spring.stage != Counterbalance::carriage) {
    if (spring.stage >= stages.size()) {
      return refusal(ArgumentError::out_of_range, in_cascade_elevator, "the counterbalance's stage")
          .got(std::to_string(spring.stage))
          .expected(flyball::detail::format(
              "below {}, the number of stages, or left out for the carriage", stages.size()));
    }
    pulled = static_cast<double>(spring.stage + 1) / n;
  }
  const double arm = n * drum_radius.si();
  inertia += shaft.inertia / (arm * arm);
  FLYBALL_CHECK(check_finite(inertia, in_cascade_elevator, "the inertia"));
  return CascadeElevator(shaft, arm, inertia, weight, spring.force.si() * pulled,
                         spring.stiffness * pulled * pulled, drive.motor.nominal_voltage);
}

ModelDescription ElevatorArm::description() const {
  return {.name = "arm on an elevator",
          .states = {{"height", "m"},
                     {"angle", "rad", true},
                     {"velocity", "m/s"},
                     {"angular velocity", "rad/s"}},
          .inputs = {{"elevator voltage", "V"}, {"arm voltage", "V"}},
          .outputs = {{"height", "m"}, {"angle", "rad", true}},
          .parameters = {{"elevator_inertia", "kg", p_(0)},
                         {"elevator_weight", "N", p_(1)},
                         {"spring_force", "N", p_(2)},
                         {"spring_stiffness", "N/m", p_(3)},
                         {"mass", "kg", p_(4)},
                         {"center_of_mass", "m", p_(5)},
                         {"moment_of_inertia", "kg·m²", p_(6)}}};
}

Expected<ElevatorArm> elevator_arm(const ElevatorArmParameters& parameters) {
  constexpr std::string_view here = "elevator_arm";
  const auto& [elevator, drive, moment_of_inertia, mass, center_of_mass] = parameters;
  FLYBALL_TRY(const CascadeElevator lift, cascade_elevator(elevator));
  FLYBALL_TRY(const detail::Shaft joint, detail::checked_shaft(drive, here, "joint", true));
  const double J = moment_of_inertia.si();
  const double m = mass.si();
  const double l = center_of_mass.si();
  FLYBALL_CHECK(Checks(here)
                    .positive(J, "moment_of_inertia", "kg m^2")
                    .not_negative(m, "mass", "kg")
                    .not_negative(l, "center_of_mass", "m"));
  if (J < m * l * l * (1.0 - 1e-9)) {
    return refusal(ArgumentError::out_of_range, here, "moment_of_inertia")
        .got(flyball::detail::format("{:.4g} kg m^2", J))
        .expected(flyball::detail::format(
            "at least mass times center_of_mass squared, {:.4g} kg m^2: it is "
            "taken about the joint",
            m * l * l));
  }
  return ElevatorArm(lift, joint, m, l, J + joint.inertia);
}

}  // namespace flyball::mechanisms
