#include <memory>

#include <flyball/study/answer.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

constexpr const char* schema = "flyball.analyze/1";

struct Options {
  CommonOptions common;
  std::string model;
  std::vector<study::Override> given;
};

int run(const Options& options) {
  const auto model = study::read_model(options.model, options.given);
  if (!model) {
    return fail(model.error(), options.common, schema);
  }
  const auto analysis = study::analyze(*model);
  if (!analysis) {
    return fail(analysis.error(), options.common, schema);
  }
  return tell(study::answer_of(*analysis), options.common, false);
}

}  // namespace

void add_analyze_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "analyze", "Say what a linear system is like: poles, controllability, observability, gains");
  command->footer(
      "MODEL is a project file of a mechanism (TOML, see flyball design --help), or JSON with A "
      "and\n"
      "B, and perhaps C (the identity if absent), D (zero), domain (\"continuous\" or "
      "\"discrete\"), T (s,\n"
      "the sample period), and the names states, inputs and outputs:\n"
      "  {\"A\": [[0, 1], [0, -2]], \"B\": [[0], [1]], \"states\": [\"position (m)\", \"velocity "
      "(m/s)\"]}");
  auto options = std::make_shared<Options>();
  options->common.typed = invocation.typed;
  command->add_option("MODEL", options->model, "The model; - is standard input")->required();
  add_field_options(*command, study::JobKind::analyze, options->given);
  add_common_options(*command, options->common,
                     "Write the report into this folder: pole map, step responses, their data");
  command->callback([options, &invocation] { invocation.status = run(*options); });
}

}  // namespace flyball::app
