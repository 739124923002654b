#include <flyball/study/simulate.hpp>

#include "job_command.hpp"

namespace flyball::app {

namespace {

ExpectedAll<Answer> run_simulate(JobInput& input) {
  return study::read_project(input.path, input.given)
      .and_then(&study::simulate)
      .map([](const auto& result) { return study::answer_of(result); });
}

}  // namespace

void add_simulate_command(CLI::App& program, Invocation& invocation) {
  add_job_command(
      program, invocation,
      {.name = "simulate",
       .schema = "flyball.simulate/1",
       .help = "Simulate a project: a model by formula or a mechanism, open or closed loop",
       .footer = "PROJECT.toml, for example:\n"
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
                 "  input = { u = \"0.2*sin(3*t)\" }   # or closed_loop = true: LQR about [point]",
       .job = study::JobKind::simulate,
       .file = "PROJECT",
       .file_help = "The project file",
       .report = "Write the report into this folder: pictures, the record as CSV",
       .reports_unasked = false,
       .run = &run_simulate});
}

}  // namespace flyball::app
