#include <flyball/study/answer.hpp>

#include "job_command.hpp"

namespace flyball::app {

namespace {

ExpectedAll<Answer> run_analyze(JobInput& input) {
  const auto model = study::read_model(input.path, input.given);
  if (!model) {
    return tl::unexpected(model.error());
  }
  return study::analyze(*model).map([](const auto& result) { return study::answer_of(result); });
}

}  // namespace

void add_analyze_command(CLI::App& program, Invocation& invocation) {
  add_job_command(
      program, invocation,
      {.name = "analyze",
       .schema = "flyball.analyze/2",
       .help = "Say what a linear system is like: poles, controllability, observability, gains",
       .footer = "MODEL is a project file of a mechanism (TOML, see flyball design --help), or "
                 "JSON with A "
                 "and\n"
                 "B, and perhaps C (the identity if absent), D (zero), domain (\"continuous\" or "
                 "\"discrete\"), T (s,\n"
                 "the sample period), and the names states, inputs and outputs:\n"
                 "  {\"A\": [[0, 1], [0, -2]], \"B\": [[0], [1]], \"states\": [\"position (m)\", "
                 "\"velocity "
                 "(m/s)\"]}",
       .job = study::JobKind::analyze,
       .file = "MODEL",
       .file_help = "The model; - is standard input",
       .report = "Write the report into this folder: pole map, step responses, their data",
       .reports_unasked = false,
       .run = &run_analyze});
}

}  // namespace flyball::app
