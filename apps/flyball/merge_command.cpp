#include <memory>
#include <string>
#include <vector>

#include <flyball/io/output_folder.hpp>

#include "commands.hpp"
#include "identify_each.hpp"

namespace flyball::app {

namespace {

constexpr const char* merge_schema = "flyball.identify_each/1";

struct MergeOptions {
  CommonOptions common;
  std::vector<std::string> parts{};
};

int run_merge(const MergeOptions& options) {
  if (!options.common.out.empty()) {
    if (const auto folder = OutputFolder::create(options.common.out); !folder) {
      return fail(folder.error(), options.common, merge_schema);
    }
  }
  const auto rows = study::merge_log_rows(options.parts);
  return rows ? tell_rows(*rows, 0, options.common)
              : fail(rows.error(), options.common, merge_schema);
}

}  // namespace

void add_merge_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "merge", "Put together what flyball identify --shard answered in parts");
  command->footer(
      "PARTS are the --out folders of the parts, or files with the lines of their --json. What "
      "comes\n"
      "out is what one run over all logs gives, byte by byte; the exit status, too. A part that "
      "is\n"
      "missing, or of other logs or options, is refused.");
  auto options = std::make_shared<MergeOptions>();
  command->add_option("PARTS", options->parts, "Folders, or files of lines")->required();
  add_common_options(*command, options->common,
                     "Write the table, as logs.csv and logs.jsonl too, into this folder");
  command->callback([options, &invocation] {
    options->common.typed = invocation.typed;
    invocation.status = guarded([&] { return run_merge(*options); }, options->common, merge_schema,
                                options->parts.front());
  });
}

}  // namespace flyball::app
