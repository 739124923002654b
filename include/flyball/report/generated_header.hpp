#pragma once

#include <string>
#include <string_view>

#include <flyball/study/design.hpp>

namespace flyball::report {

/// The designed loop as one C++17 header without a dependency but the standard library: a class
/// with `reset`, and `update(measurement, r, r_next, battery_voltage)` which answers the volts for
/// the motor. noexcept, allocation-free, and the same arithmetic in the same order as
/// Lqg::step with the feedforward of simulation/closed_loop.hpp, so it gives the same inputs.
///
/// @param design      As `study::design` answered; one input, one or two states.
/// @param class_name  The class's name; what is not an identifier is made one ("4 bar" gives
///                    "_4_bar").
/// @return The header's text, deterministic.
/// Source: book, Theorems 7.7.1, 7.8.1 and 9.6.3; equation 6.23.
[[nodiscard]] std::string generate_header(const study::DesignResult& design,
                                          std::string_view class_name);

/// "ElevatorLoop": the class that a report's header holds.
[[nodiscard]] std::string header_class_name(const study::DesignResult& design);

}  // namespace flyball::report
