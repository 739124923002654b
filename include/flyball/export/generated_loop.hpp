#pragma once

#include <string>
#include <string_view>

#include <flyball/control/mechanism_controller.hpp>
#include <flyball/export/language.hpp>

namespace flyball::exports {

/// A mechanism's loop as source text, one header in C++, one class of the package frc.robot in
/// Java, one module in Python, without a dependency but the standard library: a class with `reset`,
/// and `update(measurement, r, r_next, battery_voltage)` which answers the volts for the motor. The
/// same arithmetic in the same order as MechanismController::update, so that it gives the same bits
/// where the compiler does not fuse operations, but for the cosine of an arm's gravity in Java,
/// whose library may round its last bit otherwise; what the design leaves out (friction, gravity,
/// voltage compensation, a delay) is not in it. `update` allocates nothing in C++ and Java, and is
/// noexcept in C++.
///
/// @param class_name  The class's name; what is not an identifier is made one ("4 bar" gives
///                    "_4_bar").
/// @param unit        Of the position, "m" or "rad"; empty for that of the kind.
/// @return The text, deterministic.
/// @errors Those of MechanismController::create.
/// Source: book, Theorems 7.7.1, 7.8.1 and 9.6.3; equation 6.23.
[[nodiscard]] Expected<std::string> generate_loop(const MechanismControllerDesign& design,
                                                  Language language, std::string_view class_name,
                                                  std::string_view unit = {});

/// "ElevatorLoop": the usual name of the class for a mechanism.
[[nodiscard]] std::string loop_class_name(mechanisms::MechanismKind kind);

/// "ElevatorLoop.hpp", "ElevatorLoop.java", "elevator_loop.py": what the file has to be called.
[[nodiscard]] std::string loop_file_name(Language language, std::string_view class_name);

}  // namespace flyball::exports
