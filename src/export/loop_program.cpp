#include <optional>

#include <fmt/format.h>

#include <flyball/control/delay_compensation.hpp>

#include "core/try.hpp"
#include "export/loop_program.hpp"

namespace flyball::exports {

using Eigen::Index;
using Eigen::MatrixXd;
using mechanisms::MechanismKind;

namespace {

/// Σ name[j] * of[j], in the order in which the library adds.
std::string dot(std::string_view name, std::string_view of, Index n) {
  std::string text;
  for (Index j = 0; j < n; ++j) {
    text += fmt::format("{}{}[{}] * {}[{}]", j == 0 ? "" : " + ", name, j, of, j);
  }
  return text;
}

/// The predictor that the controller has; none where the design does not predict.
Expected<std::optional<DelayPredictor<>>> predictor_of(const MechanismControllerDesign& design) {
  if (!design.predicts_with) {
    return std::nullopt;
  }
  FLYBALL_TRY(auto predictor, DelayPredictor<>::create(*design.predicts_with, design.plant.period,
                                                       design.measurement_delay));
  return predictor;
}

std::vector<LoopConstant> constants_of(const LoopProgram& program,
                                       const MechanismControllerDesign& design,
                                       const std::optional<DelayPredictor<>>& predictor,
                                       const MatrixXd& B_pinv) {
  using Shape = LoopConstant::Shape;
  std::vector<LoopConstant> constants;
  const auto number = [&](std::string name, double value, std::string comment) {
    constants.push_back(
        {std::move(name), Shape::number, MatrixXd::Constant(1, 1, value), std::move(comment)});
  };
  const auto vector = [&](std::string name, const MatrixXd& value, std::string comment) {
    constants.push_back({std::move(name), Shape::vector, value, std::move(comment)});
  };
  number("period", design.plant.period.si(), "s");
  if (program.moves_measurement || predictor) {
    number("measurement_delay", design.measurement_delay.si(), "s, age of a measurement");
  }
  number("max_voltage", design.max_voltage, "V");
  number("nominal_voltage", design.nominal_voltage, "V");
  if (program.friction) {
    number("kS", design.gains.kS, "V, static friction");
  }
  if (program.gravity) {
    number("kG", design.gains.kG,
           program.arm() ? "V, gravity with the arm horizontal" : "V, gravity");
    if (program.arm()) {
      number("angle_offset", design.gains.angle_offset,
             "rad, true angle from horizontal less the measured one");
    }
  }
  constants.push_back({"A", Shape::matrix, design.plant.A, "x(k+1) = A x(k) + B u(k), u in volts"});
  if (predictor) {
    const auto matrix = [&](std::string name, const MatrixXd& value, std::string comment) {
      constants.push_back({std::move(name), Shape::matrix, value, std::move(comment)});
    };
    matrix("A_late", predictor->A(), "a period of the measured state, which is late");
    vector("B_newer", predictor->B_0(), "unit of the state per V, that arrives within the period");
    vector("B_older", predictor->B_1(), "unit of the state per V, that acts until then");
    matrix("A_rest", predictor->A_rest(), "what the delay is longer than whole periods");
    vector("B_rest", predictor->B_rest(), "unit of the state per V");
  } else {
    vector("B", design.plant.B, "unit of the state per V");
  }
  vector("K", design.K.transpose(), "V per unit of the state");
  vector("kalman_gain", design.K_e, "unit of the state per " + program.measured_unit);
  vector("B_inverse", B_pinv.transpose(), "V per unit of the state");
  return constants;
}

}  // namespace

Expected<LoopProgram> loop_program(const MechanismControllerDesign& design, std::string_view unit) {
  FLYBALL_TRY(const auto controller, MechanismController<>::create(design));
  LoopProgram program{.kind = design.kind, .gains = design.gains};
  program.states = design.plant.A.rows();
  program.unit = unit.empty() ? mechanisms::position_unit(design.kind) : unit;
  const bool flywheel = program.flywheel();
  const std::string rate = program.unit + "/s";
  if (!flywheel) {
    program.state_names.push_back("position (" + program.unit + ")");
  }
  if (flywheel || program.states == 2) {
    program.state_names.push_back("velocity (" + rate + ")");
  }
  program.measured = flywheel ? "velocity" : "position";
  program.measured_unit = flywheel ? rate : program.unit;
  FLYBALL_TRY(const auto predictor, predictor_of(design));
  program.moves_measurement = design.measurement_delay.si() > 0.0 && !predictor;
  program.on_the_way = predictor ? predictor->on_the_way() : 0;
  program.gravity = design.feed_forward_gravity && has_gravity(design.kind);
  program.friction = design.feed_forward_friction;
  program.compensates = design.compensate_voltage;
  program.constants = constants_of(program, design, predictor, controller.B_pinv());

  program.rate = flywheel ? "((r_next[0] - r[0]) / period)" : "r[1]";
  program.speed = flywheel ? "[0]" : "[1]";
  for (Index i = 0; i < program.states; ++i) {
    const std::string row = fmt::format("A[{}]", i);
    if (predictor) {
      const auto times = [&](std::string_view matrix, std::string_view of) {
        return dot(fmt::format("{}[{}]", matrix, i), of, program.states);
      };
      program.prediction.push_back(
          fmt::format("{} + (B_newer[{}] * arriving_[0] + B_older[{}] * arriving_[1])",
                      times("A_late", "delayed_"), i, i));
      program.one_period.push_back(fmt::format("{} + B_newer[{}] * newer + B_older[{}] * older",
                                               times("A_late", "x_hat_"), i, i));
      program.rest.push_back(fmt::format("{} + B_rest[{}] * newer", times("A_rest", "x_hat_"), i));
    } else {
      program.prediction.push_back(
          fmt::format("{} + B[{}] * u_model_", dot(row, "x_hat_", program.states), i));
    }
    program.demand.push_back(fmt::format("r_next[{}] - ({})", i, dot(row, "r", program.states)));
    program.error.push_back(fmt::format("r[{0}] - x_hat_[{0}]", i));
  }
  program.inversion = dot("B_inverse", "demand", program.states);
  program.feedback = dot("K", "error", program.states);
  return program;
}

}  // namespace flyball::exports
