#pragma once

#include <exception>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <flyball/core/errors.hpp>
#include <flyball/report/terminal.hpp>
#include <flyball/study/project.hpp>

#include "lacks_memory.hpp"

/// What every command of the program shares: where text goes and how it ends.
namespace flyball::app {

/// 0 success; 1 well-formed input whose answer is no; 2 bad usage or malformed input.
enum ExitStatus : int { success = 0, no_answer = 1, bad_input = 2 };

[[nodiscard]] int exit_status(const Error& error);

/// Options that every command has.
struct CommonOptions {
  bool json = false;
  std::string out;
  std::string typed;  ///< The command line, for the report.
};

/// The command line for a report: "flyball" and what was typed, quoted for a shell where it must
/// be. A path from the root is cut to its last name: a report is handed on, and whose machine it
/// was made on concerns nobody.
[[nodiscard]] std::string typed_command(std::span<const char* const> arguments);

/// Adds --json and --out. @param report  What --out writes, for the help.
void add_common_options(CLI::App& command, CommonOptions& options, const std::string& report);

/// Adds the options of a job's fields, by its table. @param given  What is typed goes there.
void add_field_options(CLI::App& command, study::JobKind job, std::vector<study::Override>& given);

/// The same by the table of another kind of job.
void add_field_options(CLI::App& command, const std::vector<study::FieldInfo>& fields,
                       std::vector<study::Override>& given);

/// Colours when standard output is a terminal and NO_COLOR is not set; its width (else COLUMNS,
/// else 100); ASCII where the locale is not of UTF-8. Without a word of a locale only a terminal is
/// taken for one that knows no more.
[[nodiscard]] report::TerminalStyle terminal_style();

/// Prints a result on standard output.
void print(const std::string& text);

/// Tells what is wrong: words on standard error and, with --json, an object on standard output.
/// @return The exit status, of the first error.
int fail(const Errors& errors, const CommonOptions& options, const std::string& schema);

/// What a command's `run` answers, also where there is not enough memory for its input.
/// @return The exit status.
template <class Run>
int guarded(const Run& run, const CommonOptions& options, const std::string& schema,
            const std::string& input) {
  try {
    return run();
  } catch (const std::exception& problem) {
    if (!lacks_memory(problem)) {
      throw;
    }
    return fail(not_enough_memory(input), options, schema);
  }
}

/// Where a report goes: --out, or `flyball-report` unless --json was asked for.
[[nodiscard]] std::optional<std::string> report_folder(const CommonOptions& options,
                                                       bool by_default);

/// A wrong command line as an object on standard output, for who asked for --json; schema
/// "flyball.usage/1".
void print_usage_error(const std::string& text);

/// A line of words on standard error; control characters, which a terminal would obey, as '?'.
void say(const std::string& text);

/// An error's words on standard error.
void tell(const Error& error);

/// Words for a report that could not be written where nobody asked for it.
void warn(const std::string& text);

}  // namespace flyball::app
