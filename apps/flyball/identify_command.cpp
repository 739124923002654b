#include <memory>

#include <flyball/study/answer.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

constexpr const char* schema = "flyball.identify/1";

struct Options {
  CommonOptions common;
  std::string path;
  std::vector<study::Override> given;
};

int run(const Options& options) {
  const auto job = study::identify_job(options.path, options.given);
  if (!job) {
    return fail(job.error(), options.common, schema);
  }
  const auto result = study::identify(*job);
  if (!result) {
    return fail(result.error(), options.common, schema);
  }
  return tell(study::answer_of(*result), options.common, false);
}

}  // namespace

void add_identify_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "identify", "Identify kS, kV, kA and kG of a mechanism from a log of it moving");
  command->footer(
      "LOG is a SysId JSON, a WPILOG or a CSV with the four characterisation tests (quasistatic\n"
      "and dynamic, forward and reverse). What the log does not say is detected and told.");
  auto options = std::make_shared<Options>();
  options->common.typed = invocation.typed;
  command->add_option("LOG", options->path, "The log")->required();
  add_field_options(*command, study::JobKind::identify, options->given);
  add_common_options(*command, options->common, "Write the report into this folder");
  command->callback([options, &invocation] { invocation.status = run(*options); });
}

}  // namespace flyball::app
