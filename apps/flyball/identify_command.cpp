#include <memory>

#include <flyball/core/argument.hpp>
#include <flyball/study/answer.hpp>
#include <flyball/study/identify_logs.hpp>
#include <flyball/study/identify_model.hpp>

#include "identify_each.hpp"
#include "job_command.hpp"

namespace flyball::app {

namespace {

/// A model by formula, whose project file says what of it is looked for.
ExpectedAll<Answer> run_model(const JobInput& input, const study::Project& project) {
  if (!input.more.empty()) {
    return tl::unexpected(Errors(Error(ArgumentError::out_of_range)
                                     .in("identify")
                                     .about("the list of logs")
                                     .got("of more than one")
                                     .expected("one log of a model by formula")
                                     .hint("several runs stand in one log: where its time jumps a "
                                           "new one begins")));
  }
  return ExpectedAll<Log>(study::read_model_log(input.path, project))
      .and_then([&](const Log& read) { return study::identify_model(read, project); })
      .map([](const auto& result) { return study::answer_of(result); });
}

ExpectedAll<Answer> run_identify(JobInput& input) {
  if (!input.project.empty()) {
    const auto project = study::read_project_beside_log(input.project, input.given);
    if (!project) {
      return tl::unexpected(project.error());
    }
    if (project->model_job) {
      input.schema = "flyball.identify_model/1";
      return run_model(input, *project);
    }
  }
  const auto job = study::identify_job(input.path, input.project, input.given);
  if (!job) {
    return tl::unexpected(job.error());
  }
  if (!input.more.empty()) {
    input.schema = "flyball.identify_logs/1";
    study::IdentifyLogsJob logs{
        .logs = {input.path}, .selection = job->selection, .said = job->said};
    logs.logs.insert(logs.logs.end(), input.more.begin(), input.more.end());
    return study::identify_logs(logs).map(
        [](const auto& result) { return study::answer_of(result); });
  }
  return study::identify(*job).map([](const auto& result) { return study::answer_of(result); });
}

}  // namespace

void add_identify_command(CLI::App& program, Invocation& invocation) {
  const auto each = std::make_shared<EachOptions>();
  CLI::App* command = add_job_command(
      program, invocation,
      {.name = "identify",
       .schema = "flyball.identify/1",
       .help =
           "Identify kS, kV, kA and kG of a mechanism or a drivetrain, or any model's parameters, "
           "from a log",
       .footer =
           "LOG is a SysId JSON, a WPILOG or a CSV with the four characterisation tests "
           "(quasistatic\n"
           "and dynamic, forward and reverse). What the log does not say is detected and told.\n"
           "PROJECT.toml may say the rest in [log], and the kind of mechanism in [mechanism].\n"
           "Several logs of one mechanism are compared, and fitted together. A drivetrain's log "
           "has\n"
           "both sides; --also adds the log of its rotation tests.\n"
           "Of a FOLDER, and with --each, every log is identified by itself, a row a log: a table, "
           "a line\n"
           "of JSON each with --json, logs.csv and logs.jsonl with --out, where what is done stays "
           "done.\n"
           "Parts of --shard go together with flyball merge.\n"
           "With a [model] and a [fit] in PROJECT.toml, LOG is any recording of its inputs and "
           "outputs.",
       .job = study::JobKind::identify,
       .file = "LOG",
       .file_help = "The log, or a folder of logs",
       .report = "Write the report into this folder",
       .reports_unasked = false,
       .run = &run_identify,
       .several = true,
       .instead = [each](JobInput& input, const CommonOptions& common) -> std::optional<int> {
         return means_each(input, *each) ? std::optional(identify_each(input, *each, common))
                                         : std::nullopt;
       }},
      true);
  add_each_options(*command, each);
}

}  // namespace flyball::app
