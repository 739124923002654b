#pragma once

#include <CLI/CLI.hpp>

namespace flyball::app {

/// Adds a command to the program. When it was called it leaves its exit status.
void add_identify_command(CLI::App& program, int& status);
void add_design_command(CLI::App& program, int& status);
void add_tune_command(CLI::App& program, int& status);
void add_motors_command(CLI::App& program, int& status);
void add_book_command(CLI::App& program, int& status);

}  // namespace flyball::app
