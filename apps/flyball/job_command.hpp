#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <flyball/core/answer.hpp>
#include <flyball/core/errors.hpp>
#include <flyball/study/project.hpp>

#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

/// What was typed for a job.
struct JobInput {
  std::string path;
  std::vector<std::string> more;  ///< Further logs, of a command that takes several.
  std::string project;            ///< Of a command that takes one beside.
  std::vector<study::Override> given;
  std::string schema;  ///< Of a refusal; the job may name another.
};

/// A command that reads a file, runs a job and tells its answer.
struct JobCommand {
  const char* name;
  const char* schema;  ///< Of its answers (docs/schemas.md).
  const char* help;
  const char* footer;
  study::JobKind job;
  const char* file;  ///< What the help calls it.
  const char* file_help;
  const char* report;    ///< What --out writes.
  bool reports_unasked;  ///< Into flyball-report.
  ExpectedAll<Answer> (*run)(JobInput& input);
  bool several = false;  ///< Whether further files of the kind may follow.
  /// Does all in place of `run` where it returns an exit status.
  std::function<std::optional<int>(JobInput&, const CommonOptions&)> instead{};
};

/// Adds it with the options of its job, --json and --out.
/// @return For what only this command has. @param project  Whether a project file may stand beside.
CLI::App* add_job_command(CLI::App& program, Invocation& invocation, const JobCommand& command,
                          bool project = false);

}  // namespace flyball::app
