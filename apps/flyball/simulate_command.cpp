#include <memory>

#include <flyball/study/simulate.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

constexpr const char* schema = "flyball.simulate/1";

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
  const auto result = study::simulate(*project);
  if (!result) {
    return fail(result.error(), options.common, schema);
  }
  return tell(study::answer_of(*result), options.common, false);
}

}  // namespace

void add_simulate_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "simulate", "Simulate a project: a model by formula or a mechanism, open or closed loop");
  command->footer(
      "PROJECT.toml, for example:\n"
      "  [model]\n"
      "  name = \"pendulum\"\n"
      "  states = { theta = \"rad\", omega = \"rad/s\" }\n"
      "  inputs = { u = \"N m\" }\n"
      "  parameters = { g = \"9.81 m/s^2\", l = \"0.5 m\", m = \"2 kg\" }\n"
      "\n"
      "  [model.derivative]\n"
      "  theta = \"omega\"\n"
      "  omega = \"-g/l*sin(theta) + u/(m*l^2)\"\n"
      "\n"
      "  [simulation]\n"
      "  duration = \"5 s\"\n"
      "  initial = { theta = \"10 deg\" }\n"
      "  input = { u = \"0.2*sin(3*t)\" }   # or closed_loop = true: LQR about [point]");
  auto options = std::make_shared<Options>();
  options->common.typed = invocation.typed;
  command->add_option("PROJECT", options->project, "The project file")->required();
  add_field_options(*command, study::JobKind::simulate, options->given);
  add_common_options(*command, options->common,
                     "Write the report into this folder: pictures, the record as CSV");
  command->callback([options, &invocation] { invocation.status = run(*options); });
}

}  // namespace flyball::app
