#include <memory>

#include <flyball/report/write_report.hpp>
#include <flyball/study/project.hpp>
#include <flyball/study/schema.hpp>
#include <flyball/study/tune.hpp>

#include "commands.hpp"
#include "console.hpp"
#include "design_options.hpp"

namespace flyball::app {

namespace {

constexpr const char* schema = "flyball.tune/1";

struct Options {
  CommonOptions common;
  LogOptions log;
  DesignOptions design;
  std::string path;
  std::string project;
};

// The error that a tuning ended with, if it did.
const Error* refusal_of(const study::TuneResult& result) {
  if (!result.identification.report.fit) {
    return &result.identification.report.fit.error();
  }
  return result.design && !*result.design ? &result.design->error() : nullptr;
}

int run(const Options& options) {
  study::TuneJob job;
  job.identification.log = options.path;
  auto selection = selection_of(options.log);
  if (!selection) {
    return fail(selection.error(), options.common, schema);
  }
  job.identification.selection = *selection;
  if (!options.project.empty()) {
    auto project = study::read_project(options.project);
    if (!project) {
      return fail(project.error(), options.common, schema);
    }
    job.design = project->job;
    if (!job.identification.selection.mechanism) {
      job.identification.selection.mechanism = project->mechanism;
    }
  }
  if (auto applied = apply(options.design, job.design); !applied) {
    return fail(applied.error(), options.common, schema);
  }
  auto result = study::tune(job);
  if (!result) {
    return fail(result.error(), options.common, schema);
  }
  std::string written;
  if (const auto folder = report_folder(options.common, true)) {
    if (auto report = report::write_tune_report(*result, *folder)) {
      written = *folder;
    } else if (!options.common.out.empty()) {
      return fail(report.error(), options.common, schema);
    } else {
      warn("no report: " + to_string(report.error()));
    }
  }
  print(options.common.json ? study::to_json(*result)
                            : report::to_terminal(*result, terminal_style(), written));
  if (const Error* refusal = refusal_of(*result)) {
    tell(*refusal);
    return exit_status(*refusal);
  }
  return success;
}

}  // namespace

void add_tune_command(CLI::App& program, int& status) {
  CLI::App* command = program.add_subcommand(
      "tune", "From a log to a proven controller: identify, design, simulate, report, C++");
  command->footer(
      "LOG is a SysId JSON, a WPILOG or a CSV with the four characterisation tests.\n"
      "PROJECT.toml may set [controller], [estimator], [sensor], [battery], [profile], and the\n"
      "motor in [mechanism] so that current and battery sag are simulated.");
  auto options = std::make_shared<Options>();
  command->add_option("LOG", options->path, "The log")->required();
  command->add_option("PROJECT", options->project, "A project file (TOML)");
  add_log_options(*command, options->log);
  add_design_options(*command, options->design);
  add_common_options(*command, options->common,
                     "Write the report into this folder (flyball-report if absent)");
  command->callback([options, &status] { status = run(*options); });
}

}  // namespace flyball::app
