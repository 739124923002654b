#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace flyball::app {

/// One call of the program.
struct Invocation {
  std::string typed;  ///< The command line, see typed_command.
  int status = 0;     ///< The exit status that the command left.
};

/// Adds a command to the program. When it was called it leaves its exit status.
void add_identify_command(CLI::App& program, Invocation& invocation);
void add_merge_command(CLI::App& program, Invocation& invocation);
void add_estimate_command(CLI::App& program, Invocation& invocation);
void add_experiment_command(CLI::App& program, Invocation& invocation);
void add_design_command(CLI::App& program, Invocation& invocation);
void add_drive_command(CLI::App& program, Invocation& invocation);
void add_optimize_command(CLI::App& program, Invocation& invocation);
void add_size_command(CLI::App& program, Invocation& invocation);
void add_simulate_command(CLI::App& program, Invocation& invocation);
void add_tune_command(CLI::App& program, Invocation& invocation);
void add_motor_curves_command(CLI::App& program, Invocation& invocation);
void add_localize_command(CLI::App& program, Invocation& invocation);
void add_motors_command(CLI::App& program, Invocation& invocation);
void add_book_command(CLI::App& program, Invocation& invocation);
/// bode, nyquist, nichols, rlocus, step, impulse, margins, sisotool and pidtune.
void add_loop_commands(CLI::App& program, Invocation& invocation);
void add_path_command(CLI::App& program, Invocation& invocation);
void add_states_command(CLI::App& program, Invocation& invocation);
void add_plan_command(CLI::App& program, Invocation& invocation);
void add_profile_command(CLI::App& program, Invocation& invocation);
void add_analyze_command(CLI::App& program, Invocation& invocation);
void add_units_command(CLI::App& program, Invocation& invocation);
/// help, version, completion and manual, which speak of all the others.
void add_help_commands(CLI::App& program, Invocation& invocation);
void add_solve_command(CLI::App& program, Invocation& invocation);

}  // namespace flyball::app
