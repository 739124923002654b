#include <flyball/study/experiment.hpp>
#include <flyball/study/project.hpp>

#include "job_command.hpp"

namespace flyball::app {

namespace {

ExpectedAll<Answer> run_experiment(JobInput& input) {
  const auto job = study::experiment_job(input.path, input.given);
  if (!job) {
    return tl::unexpected(job.error());
  }
  return ExpectedAll<study::ExperimentResult>(study::plan_experiment(*job))
      .map([](const auto& result) { return study::answer_of(result); });
}

}  // namespace

void add_experiment_command(CLI::App& program, Invocation& invocation) {
  add_job_command(
      program, invocation,
      {.name = "experiment",
       .schema = "flyball.experiment/1",
       .help = "Plan the tests whose log will tell a mechanism's gains best",
       .footer =
           "FILE is a project file (TOML) of a mechanism that was not tested yet, or a log whose\n"
           "gains are to become better known. Tests stay within the travel, the voltage and the\n"
           "time that are allowed; what they will tell is simulated.",
       .job = study::JobKind::experiment,
       .file = "FILE",
       .file_help = "The project file or the log",
       .report = "Write the report into this folder",
       .reports_unasked = false,
       .run = &run_experiment});
}

}  // namespace flyball::app
