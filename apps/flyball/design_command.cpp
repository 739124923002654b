#include <memory>

#include <flyball/study/answer.hpp>
#include <flyball/study/simulate.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

constexpr const char* schema = "flyball.design/1";

struct Options {
  CommonOptions common;
  std::string project;
  std::vector<study::Override> given;
};

int run(const Options& options) {
  const auto project = study::read_project(options.project, options.given);
  if (!project) {
    return fail(project.error(), options.common, schema);
  }
  if (project->model_job) {
    const auto result = study::design_model(*project->model_job);
    return result ? tell(study::answer_of(*result), options.common, true)
                  : fail(result.error(), options.common, "flyball.design_model/1");
  }
  if (project->plant_error) {
    return fail(*project->plant_error, options.common, schema);
  }
  const auto result = study::design(project->job);
  if (!result) {
    return fail(result.error(), options.common, schema);
  }
  return tell(study::answer_of(*result), options.common, true);
}

}  // namespace

void add_design_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "design", "Design a controller from a project file: mass, gearing and motors, or gains");
  command->footer(
      "PROJECT.toml, for example:\n"
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
      "  state_tolerance = [\"2 cm\", \"0.4 m/s\"]   # leave out to have them chosen");
  auto options = std::make_shared<Options>();
  options->common.typed = invocation.typed;
  command->add_option("PROJECT", options->project, "The project file")->required();
  add_field_options(*command, study::JobKind::design, options->given);
  add_common_options(*command, options->common,
                     "Write the report into this folder (flyball-report if absent)");
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
  command->callback([options, &invocation] { invocation.status = run(*options); });
}

}  // namespace flyball::app
