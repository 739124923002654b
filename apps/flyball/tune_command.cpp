#include <memory>

#include <flyball/study/answer.hpp>
#include <flyball/study/project.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

constexpr const char* schema = "flyball.tune/1";

struct Options {
  CommonOptions common;
  std::string path;
  std::string project;
  std::vector<study::Override> given;
};

int run(const Options& options) {
  const auto job = study::tune_job(options.path, options.project, options.given);
  if (!job) {
    return fail(job.error(), options.common, schema);
  }
  auto result = study::tune(*job);
  if (!result) {
    return fail(result.error(), options.common, schema);
  }
  return tell(study::answer_of(*result), options.common, true);
}

}  // namespace

void add_tune_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "tune", "From a log to a proven controller: identify, design, simulate, report, C++");
  command->footer(
      "LOG is a SysId JSON, a WPILOG or a CSV with the four characterisation tests.\n"
      "PROJECT.toml may set [log], [controller], [estimator], [sensor], [battery], [profile], and\n"
      "the motor in [mechanism] so that current and battery sag are simulated.");
  auto options = std::make_shared<Options>();
  options->common.typed = invocation.typed;
  command->add_option("LOG", options->path, "The log")->required();
  command->add_option("PROJECT", options->project, "A project file (TOML)");
  add_field_options(*command, study::JobKind::tune, options->given);
  add_common_options(*command, options->common,
                     "Write the report into this folder (flyball-report if absent)");
  command->callback([options, &invocation] { invocation.status = run(*options); });
}

}  // namespace flyball::app
