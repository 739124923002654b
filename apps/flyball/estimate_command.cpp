#include <flyball/study/estimate.hpp>
#include <flyball/study/identify_model.hpp>

#include "job_command.hpp"

namespace flyball::app {

namespace {

ExpectedAll<Answer> run_estimate(JobInput& input) {
  return study::read_project_beside_log(input.project, input.given)
      .and_then([&](const study::Project& project) {
        return ExpectedAll<Log>(study::read_model_log(input.path, project))
            .and_then([&](const Log& log) { return study::estimate(log, project); });
      })
      .map([](const auto& result) { return study::answer_of(result); });
}

}  // namespace

void add_estimate_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = add_job_command(
      program, invocation,
      {.name = "estimate",
       .schema = "flyball.estimate/1",
       .help = "Estimate a model's states from a log, by a Kalman filter and a smoother",
       .footer =
           "LOG is a recording (CSV, WPILOG) of the model's inputs and outputs, PROJECT a file\n"
           "with its formulas in [model] and the noises in [estimate]. Readings may be missing,\n"
           "and each output may have times of its own. The residuals say whether the noises can\n"
           "be right; --tune-noise finds them by maximum likelihood.",
       .job = study::JobKind::estimate,
       .file = "LOG",
       .file_help = "The log",
       .report = "Write a report with pictures, and the estimates as CSV and WPILOG, into this "
                 "folder",
       .reports_unasked = false,
       .run = &run_estimate},
      true);
  command->get_option("PROJECT")->required();
}

}  // namespace flyball::app
