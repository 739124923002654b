#include <memory>
#include <string>

#include <flyball/io/output_folder.hpp>
#include <flyball/study/states.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

constexpr const char* states_schema = "flyball.states/1";

struct StatesOptions {
  CommonOptions common;
  std::string file;
  int depth = -1;
  int interrupts = -1;
};

int run_states(const StatesOptions& options) {
  if (const std::string& out = options.common.out; !out.empty()) {
    if (const auto folder = OutputFolder::create(out); !folder) {
      return fail(folder.error(), options.common, states_schema);
    }
  }
  auto job = study::read_states(options.file);
  if (!job) {
    return fail(job.error(), options.common, states_schema);
  }
  job->depth = options.depth >= 0 ? options.depth : job->depth;
  job->interrupts = options.interrupts >= 0 ? options.interrupts : job->interrupts;
  const auto result = study::validate_state_machine(*job);
  if (!result) {
    return fail(result.error(), options.common, states_schema);
  }
  return tell(study::answer_of(*result), options.common, false);
}

}  // namespace

void add_states_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "states", "Whether a state machine's events can lead its mechanisms where they must not be");
  command->footer(
      "MACHINE.toml, for example:\n"
      "  [[coordinate]]\n"
      "  name = \"height\"\n"
      "  low = \"0 m\"\n"
      "  high = \"1.2 m\"\n"
      "  [[coordinate]]\n"
      "  name = \"arm\"\n"
      "  kind = \"angle\"\n"
      "  low = \"-90 deg\"\n"
      "  high = \"90 deg\"\n"
      "  [[forbid]]\n"
      "  name = \"arm in the bumper\"\n"
      "  box = { height = [\"0 m\", \"0.3 m\"], arm = [\"-90 deg\", \"-20 deg\"] }\n"
      "  [[state]]\n"
      "  name = \"stowed\"\n"
      "  at = { height = \"0 m\", arm = \"80 deg\" }\n"
      "  [[state]]\n"
      "  name = \"floor\"\n"
      "  at = { height = \"0.4 m\", arm = \"-60 deg\" }\n"
      "  [[transition]]\n"
      "  from = \"stowed\"\n"
      "  event = \"collect\"\n"
      "  to = \"floor\"\n"
      "  order = [\"height\", \"arm\"]");
  auto options = std::make_shared<StatesOptions>();
  options->common.typed = invocation.typed;
  command->add_option("MACHINE", options->file, "The file of the machine (TOML)")->required();
  command
      ->add_option("--depth", options->depth,
                   "Events of the sequences that are explored (6, or the file's)")
      ->check(CLI::Range(1, 100));
  command
      ->add_option("--interrupts", options->interrupts,
                   "Places of each move at which the next event may come early (0, or the "
                   "file's)")
      ->check(CLI::Range(0, 20));
  add_common_options(*command, options->common, "Write the report into this folder");
  command->callback([options, &invocation] {
    invocation.status = guarded([&] { return run_states(*options); }, options->common,
                                states_schema, "the state machine");
  });
}

}  // namespace flyball::app
