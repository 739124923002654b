#pragma once

#include <string>
#include <string_view>

#include <flyball/control/mechanism_controller.hpp>

namespace flyball::exports {

/// A mechanism's loop as one C++17 header without a dependency but the standard library: a class
/// with `reset`, and `update(measurement, r, r_next, battery_voltage)` which answers the volts for
/// the motor. noexcept, allocation-free, and the same arithmetic in the same order as
/// MechanismController::update, so that it gives the same bits where the compiler does not fuse
/// operations; what the design leaves out (friction, gravity, voltage compensation, a delay) is not
/// in it.
///
/// @param class_name  The class's name; what is not an identifier is made one ("4 bar" gives
///                    "_4_bar").
/// @param unit        Of the position, "m" or "rad"; empty for that of the kind.
/// @return The header's text, deterministic.
/// @errors Those of MechanismController::create.
/// Source: book, Theorems 7.7.1, 7.8.1 and 9.6.3; equation 6.23.
[[nodiscard]] Expected<std::string> generate_header(const MechanismControllerDesign& design,
                                                    std::string_view class_name,
                                                    std::string_view unit = {});

/// "ElevatorLoop": the usual name of the class for a mechanism.
[[nodiscard]] std::string header_class_name(mechanisms::MechanismKind kind);

}  // namespace flyball::exports
