#pragma once

#include <flyball/core/answer.hpp>

#include "console.hpp"

namespace flyball::app {

/// Writes an answer's report, prints the answer and tells why it is no, if it is.
///
/// A folder that --out names must be written, or nothing is printed but the error; a report that
/// nobody asked for only gives a warning.
/// @param by_default  Whether a report is written without --out, too.
/// @return The exit status.
int tell(const Answer& answer, const CommonOptions& options, bool by_default);

}  // namespace flyball::app
