#include <flyball/study/design_exports.hpp>

namespace flyball::study {

exports::MechanismConstants constants_of(const DesignResult& design) {
  const PlantDescription& plant = design.job.plant;
  return {.kind = plant.kind,
          .unit = plant.unit,
          .gains = design.paste,
          .on_board = design.paste_on_board,
          .period = design.job.controller.period,
          .delay = design.job.controller.delay.value_or(0.0),
          .nominal_voltage = plant.nominal_voltage,
          .gearing = plant.gearing,
          .angle_offset = plant.gains.angle_offset,
          .kA_determined = plant.kA_determined,
          .kA_upper_bound = plant.kA_upper_bound,
          .kA_reason = plant.kA_reason,
          .no_feedback = design.no_feedback};
}

}  // namespace flyball::study
