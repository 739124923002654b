#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <flyball/study/design.hpp>

namespace flyball::app {

/// Options of the command line that override a project file.
struct DesignOptions {
  std::string period;
  std::string delay;
  std::string max_voltage;
  unsigned long long seed = 0;
};
void add_design_options(CLI::App& command, DesignOptions& options);

/// @errors ArgumentError, with the option in `where`.
[[nodiscard]] Expected<void> apply(const DesignOptions& options, study::DesignJob& job);

}  // namespace flyball::app
