#pragma once

#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/io/log.hpp>

namespace flyball::recording {

/// What is wrong with a drivetrain's log: sides that stand still, encoders against the voltage.
[[nodiscard]] std::vector<Diagnostic> diagnose_drive(const SysIdJson& log);

}  // namespace flyball::recording
