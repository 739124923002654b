#pragma once

#include <array>

#include <flyball/control/lqr.hpp>
#include <flyball/control/mechanism_controller.hpp>
#include <flyball/mechanisms/arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/systems/discretize.hpp>

/// Loops of every mechanism, for the tests of what runs, simulates and writes them.
namespace flyball::test {

using mechanisms::MechanismKind;

template <int States>
DiscreteSystem<> sampled(const ContinuousSystem<States, 1, 1>& model) {
  const auto plant = discretize(model, Time(0.02)).value();
  return {plant.A, plant.B, plant.C, plant.D, plant.period};
}

/// A mechanism with its model, or without kA as the velocity servo of Theorem 14.3.2.
inline MechanismControllerDesign design_of(MechanismKind kind, bool kA_determined = true) {
  MechanismControllerDesign design;
  design.kind = kind;
  design.gains = kind == MechanismKind::flywheel
                     ? mechanisms::FeedforwardGains{.kS = 0.2, .kV = 0.02, .kA = 0.004}
                     : mechanisms::FeedforwardGains{
                           .kS = 0.15, .kV = 4.0, .kA = 0.3, .kG = 0.6, .angle_offset = 0.2};
  design.measurement_delay = Time(0.015);
  if (!kA_determined) {
    design.gains.kA = 0.0;
    const bool flywheel = kind == MechanismKind::flywheel;
    const auto number = [](double value) { return Eigen::MatrixXd::Constant(1, 1, value); };
    design.plant = {number(flywheel ? 0.0 : 1.0), number((flywheel ? 1.0 : 0.02) / design.gains.kV),
                    number(1.0), number(0.0), Time(0.02)};
    design.K = Eigen::MatrixXd::Constant(1, 1, flywheel ? 0.004 : 30.0);
    design.K_e = Eigen::MatrixXd::Constant(1, 1, 0.5);
    return design;
  }
  switch (kind) {
    case MechanismKind::flywheel:
    case MechanismKind::roller:
    case MechanismKind::swerve_drive:
      design.plant = sampled<1>(mechanisms::flywheel(design.gains).value());
      break;
    case MechanismKind::elevator:
      design.plant = sampled<2>(mechanisms::elevator(design.gains).value());
      break;
    case MechanismKind::arm:
    case MechanismKind::turret:
    case MechanismKind::swerve_steer:
      design.plant = sampled<2>(mechanisms::arm(design.gains).value());
      break;
  }
  const bool one = design.plant.A.rows() == 1;
  design.K = one ? lqr(design.plant, bryson({10.0}), bryson({12.0})).value().K
                 : lqr(design.plant, bryson({0.02, 0.4}), bryson({12.0})).value().K;
  design.K_e =
      one ? Eigen::MatrixXd::Constant(1, 1, 0.7) : Eigen::MatrixXd(Eigen::Vector2d(0.5, 3.0));
  return design;
}

/// The same with a regulator that predicts over a delay.
inline MechanismControllerDesign predicting(MechanismControllerDesign design, Time delay) {
  design.measurement_delay = delay;
  const auto model = [](const auto& of) { return ContinuousSystem<>{of.A, of.B, of.C, of.D}; };
  const bool flywheel = design.kind == MechanismKind::flywheel;
  if (design.gains.kA > 0.0) {
    design.predicts_with = flywheel ? model(mechanisms::flywheel(design.gains).value())
                                    : model(mechanisms::elevator(design.gains).value());
    return design;
  }
  // Without kA: the velocity is reached within a tenth of a period, or at once.
  const auto number = [](double value) { return Eigen::MatrixXd::Constant(1, 1, value); };
  const double rate = flywheel ? 500.0 : 1.0;
  design.predicts_with = {number(flywheel ? -rate : 0.0), number(rate / design.gains.kV),
                          number(1.0), number(0.0)};
  return design;
}

/// A mechanism, with or without kA.
struct Case {
  MechanismKind kind;
  bool kA_determined;
};
inline constexpr std::array cases{
    Case{MechanismKind::flywheel, true},  Case{MechanismKind::elevator, true},
    Case{MechanismKind::arm, true},       Case{MechanismKind::flywheel, false},
    Case{MechanismKind::elevator, false}, Case{MechanismKind::arm, false}};

}  // namespace flyball::test
