#include <flyball/study/answer.hpp>
#include <flyball/study/design_drive.hpp>
#include <flyball/study/design_holonomic.hpp>
#include <flyball/study/simulate.hpp>

#include "job_command.hpp"

namespace flyball::app {

namespace {

ExpectedAll<Answer> run_design(JobInput& input) {
  const auto project = study::read_project(input.path, input.given);
  if (!project) {
    return tl::unexpected(project.error());
  }
  if (project->model_job) {
    input.schema = "flyball.design_model/2";
    return study::design_model(*project->model_job).map([](const auto& result) {
      return study::answer_of(result);
    });
  }
  if (project->plant_error && !project->drive.type.empty()) {
    input.schema = "flyball.design_drive/1";
    const auto job = study::drive_design_job(input.path, input.given);
    if (!job) {
      return tl::unexpected(job.error());
    }
    if (job->robot.kind != study::DriveKind::differential) {
      input.schema = "flyball.design_holonomic/1";
      return ExpectedAll<study::HolonomicDesign>(study::design_holonomic(*job))
          .map([](const auto& result) { return study::answer_of(result); });
    }
    return ExpectedAll<study::FollowerDesign>(study::design_follower(*job))
        .map([](const auto& result) { return study::answer_of(result); });
  }
  if (project->plant_error) {
    return tl::unexpected(*project->plant_error);
  }
  return study::design(project->job).map([](const auto& result) {
    return study::answer_of(result);
  });
}

}  // namespace

void add_design_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = add_job_command(
      program, invocation,
      {.name = "design",
       .schema = "flyball.design/2",
       .help = "Design a controller or a drivetrain's follower from a project file",
       .footer = "PROJECT.toml, for example:\n"
                 "  [mechanism]\n"
                 "  type = \"elevator\"\n"
                 "  motor = \"NEO\"\n"
                 "  motor_count = 2\n"
                 "  gearing = 10.0            # motor turns per drum turn\n"
                 "  mass = \"8 kg\"\n"
                 "  drum_radius = \"1 in\"\n"
                 "\n"
                 "  [controller]\n"
                 "  period = \"20 ms\"\n"
                 "  state_tolerance = [\"2 cm\", \"0.4 m/s\"]   # leave out to have them chosen",
       .job = study::JobKind::design,
       .file = "PROJECT",
       .file_help = "The project file",
       .report = "Write the report into this folder (flyball-report if absent)",
       .reports_unasked = true,
       .run = &run_design});
  const auto tell = [&](const char* option, std::string (*text)(), const char* help) {
    command->add_flag_callback(
        option,
        [text] {
          print(text());
          throw CLI::Success();
        },
        help);
  };
  tell("--fields", &study::project_markdown, "Print all that a project file may say, and stop");
  tell("--schema", &study::project_schema, "Print its JSON Schema, and stop");
}

}  // namespace flyball::app
