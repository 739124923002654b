#include <flyball/study/answer.hpp>

#include "job_command.hpp"

namespace flyball::app {

namespace {

ExpectedAll<Answer> run_tune(JobInput& input) {
  const auto job = study::tune_job(input.path, input.project, input.given);
  if (!job) {
    return tl::unexpected(job.error());
  }
  return study::tune(*job).map([](const auto& result) { return study::answer_of(result); });
}

}  // namespace

void add_tune_command(CLI::App& program, Invocation& invocation) {
  add_job_command(
      program, invocation,
      {.name = "tune",
       .schema = "flyball.tune/2",
       .help = "From a log to a proven controller: identify, design, simulate, report, C++",
       .footer = "LOG is a SysId JSON, a WPILOG or a CSV with the four characterisation tests.\n"
                 "PROJECT.toml may set [log], [controller], [estimator], [sensor], [battery], "
                 "[profile], and\n"
                 "the motor in [mechanism] so that current and battery sag are simulated.",
       .job = study::JobKind::tune,
       .file = "LOG",
       .file_help = "The log",
       .report = "Write the report into this folder (flyball-report if absent)",
       .reports_unasked = true,
       .run = &run_tune},
      true);
}

}  // namespace flyball::app
