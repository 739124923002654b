#include <algorithm>
#include <memory>

#include <flyball/io/output_folder.hpp>

#include "answer.hpp"
#include "job_command.hpp"

namespace flyball::app {

namespace {

/// A project file among further logs is the project; of two the last stays a log, which it is not.
void take_project_out(JobInput& input) {
  const auto found = std::find_if(input.more.begin(), input.more.end(),
                                  [](const std::string& path) { return path.ends_with(".toml"); });
  if (found != input.more.end()) {
    input.project = *found;
    input.more.erase(found);
  }
}

}  // namespace

CLI::App* add_job_command(CLI::App& program, Invocation& invocation, const JobCommand& command,
                          bool project) {
  struct Options {
    CommonOptions common;
    JobInput input;
  };
  auto options = std::make_shared<Options>();
  options->common.typed = invocation.typed;
  CLI::App* added = program.add_subcommand(command.name, command.help);
  added->footer(command.footer);
  added->add_option(command.file, options->input.path, command.file_help)->required();
  if (command.several) {
    added->add_option("MORE", options->input.more,
                      "Further logs of the mechanism, and a project file (TOML)");
  } else if (project) {
    added->add_option("PROJECT", options->input.project, "A project file (TOML)");
  }
  add_field_options(*added, command.job, options->input.given);
  add_common_options(*added, options->common, command.report);
  added->callback([options, command, &invocation] {
    JobInput& input = options->input;
    input.schema = command.schema;
    take_project_out(input);
    const auto run = [&] {
      // Asked for first: a job is wasted on a folder that cannot be written.
      if (const std::string& out = options->common.out; !out.empty()) {
        if (const auto folder = OutputFolder::create(out); !folder) {
          return fail(folder.error(), options->common, input.schema);
        }
      }
      if (command.instead) {
        if (const auto status = command.instead(input, options->common)) {
          return *status;
        }
      }
      const auto answer = command.run(input);
      return answer ? tell(*answer, options->common, command.reports_unasked)
                    : fail(answer.error(), options->common, input.schema);
    };
    invocation.status = guarded(run, options->common, input.schema, input.path);
  });
  return added;
}

}  // namespace flyball::app
