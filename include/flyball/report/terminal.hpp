#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include <flyball/mechanisms/motor.hpp>
#include <flyball/study/analyze.hpp>
#include <flyball/study/design.hpp>
#include <flyball/study/identify.hpp>
#include <flyball/study/tune.hpp>

namespace flyball::report {

/// How a terminal is written to.
struct TerminalStyle {
  bool color = false;       ///< ANSI colours; without them the text has no escape byte.
  std::size_t width = 100;  ///< Columns; tables and sentences are kept within it.
};

/// A result as text for a terminal: a verdict with its reasons, then facts and tables, warnings
/// most severe first. UTF-8; control characters that a log brought are shown as '?'.
///
/// Identification: what the log holds, delays and averaging found, gains with 95 % intervals beside
/// those of the one-step regression, the quality of the fit. A refused fit is told with its reason.
/// @param report_folder  Where the report was written; empty if nowhere.
[[nodiscard]] std::string to_terminal(const study::IdentifyResult& result,
                                      const TerminalStyle& style = {},
                                      std::string_view report_folder = {});
/// Design: plant, gains, poles, feedforward, margins, the robustness grid, the fastest trapezoid,
/// constants to paste.
[[nodiscard]] std::string to_terminal(const study::DesignResult& result,
                                      const TerminalStyle& style = {},
                                      std::string_view report_folder = {});
/// Both. If the fit or the design was refused, what there is and the reason.
[[nodiscard]] std::string to_terminal(const study::TuneResult& result,
                                      const TerminalStyle& style = {},
                                      std::string_view report_folder = {});

/// A linear system: what it is, its poles, what can be moved and seen, gains, what sampling makes
/// of it.
[[nodiscard]] std::string to_terminal(const study::ModelAnalysis& result,
                                      const TerminalStyle& style = {},
                                      std::string_view report_folder = {});

/// Motors by datasheet and with what follows from it (equations 12.4 to 12.6): name, free speed,
/// stall torque, stall and free current, R, Kt, Kv, other names. A row's numbers are of all motors
/// of its gearbox.
[[nodiscard]] std::string motors_to_terminal(std::span<const mechanisms::DcMotor> motors,
                                             const TerminalStyle& style = {});

}  // namespace flyball::report
