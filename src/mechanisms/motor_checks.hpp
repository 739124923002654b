#pragma once

#include <string_view>

#include <flyball/core/argument.hpp>
#include <flyball/mechanisms/motor.hpp>

namespace flyball::mechanisms {

/// A motor that can drive, behind a gearing. @param name  Of the gearing.
/// @errors ArgumentError::out_of_range (count), not_positive, not_finite.
[[nodiscard]] Expected<void> check_drive(const DcMotor& motor, double gearing,
                                         std::string_view where, std::string_view name = "gearing");

}  // namespace flyball::mechanisms
