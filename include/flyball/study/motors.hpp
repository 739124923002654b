#pragma once

#include <span>

#include <flyball/core/answer.hpp>
#include <flyball/mechanisms/motor.hpp>

namespace flyball::study {

/// Motors by datasheet and with what follows from it (equations 12.4 to 12.6): name, free speed,
/// stall torque, stall and free current, R, Kt, Kv, other names. A row's numbers are of all motors
/// of its gearbox. Schema "flyball.motors/1".
[[nodiscard]] Answer answer_of(std::span<const mechanisms::DcMotor> motors);

}  // namespace flyball::study
