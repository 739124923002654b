#include <flyball/study/answer.hpp>
#include <flyball/study/identify_logs.hpp>

#include "job_command.hpp"

namespace flyball::app {

namespace {

ExpectedAll<Answer> run(JobInput& input) {
  const auto job = study::identify_job(input.path, input.project, input.given);
  if (!job) {
    return tl::unexpected(job.error());
  }
  if (!input.more.empty()) {
    input.schema = "flyball.identify_logs/1";
    study::IdentifyLogsJob logs{.logs = {input.path}, .selection = job->selection};
    logs.logs.insert(logs.logs.end(), input.more.begin(), input.more.end());
    return study::identify_logs(logs).map(
        [](const auto& result) { return study::answer_of(result); });
  }
  return study::identify(*job).map([](const auto& result) { return study::answer_of(result); });
}

}  // namespace

void add_identify_command(CLI::App& program, Invocation& invocation) {
  add_job_command(
      program, invocation,
      {.name = "identify",
       .schema = "flyball.identify/1",
       .help = "Identify kS, kV, kA and kG of a mechanism from a log of it moving",
       .footer =
           "LOG is a SysId JSON, a WPILOG or a CSV with the four characterisation tests "
           "(quasistatic\n"
           "and dynamic, forward and reverse). What the log does not say is detected and told.\n"
           "PROJECT.toml may say the rest in [log], and the kind of mechanism in [mechanism].\n"
           "Several logs of one mechanism are compared, and fitted together.",
       .job = study::JobKind::identify,
       .file = "LOG",
       .file_help = "The log",
       .report = "Write the report into this folder",
       .reports_unasked = false,
       .run = &run,
       .several = true},
      true);
}

}  // namespace flyball::app
