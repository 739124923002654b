#include <memory>
#include <vector>

#include <flyball/io/output_folder.hpp>
#include <flyball/study/profile.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

constexpr const char* schema = "flyball.profile/1";

struct Options {
  CommonOptions common;
  std::vector<study::Override> given;
};

int run(const Options& options) {
  if (const std::string& out = options.common.out; !out.empty()) {
    if (const auto folder = OutputFolder::create(out); !folder) {
      return fail(folder.error(), options.common, schema);
    }
  }
  const auto job = study::profile_job(options.given);
  if (!job) {
    return fail(job.error(), options.common, schema);
  }
  const auto result = study::plan_profile(*job);
  if (!result) {
    return fail(result.error(), options.common, schema);
  }
  const int status = tell(study::answer_of(*result), options.common, false);
  if (status == success && options.common.out.empty() && !options.common.json) {
    print("\n--out DIR draws it, with its table as CSV and as C++\n");
  }
  return status;
}

}  // namespace

void add_profile_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "profile", "Plan a motion from state to state: its time, picture and table");
  command->footer(
      "Without --kind it is chosen by what is told of the motor and the load, and the answer says "
      "why.\n"
      "\n  flyball profile --to 1.2m --velocity 1.5m/s --acceleration 3m/s^2"
      "\n  flyball profile --to 90deg --angle --velocity 3rad/s --acceleration 10rad/s^2 "
      "--resonance "
      "4Hz"
      "\n  flyball profile --to 2m --kv 4.2 --ka 0.4 --kind exponential --out lift");
  auto options = std::make_shared<Options>();
  options->common.typed = invocation.typed;
  add_field_options(*command, study::profile_fields(), options->given);
  add_common_options(*command, options->common,
                     "Write the report into this folder: picture, CSV, C++ table");
  command->callback([options, &invocation] {
    invocation.status =
        guarded([&] { return run(*options); }, options->common, schema, "the profile");
  });
}

}  // namespace flyball::app
