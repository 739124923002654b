#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <flyball/core/argument.hpp>
#include <flyball/io/output_folder.hpp>
#include <flyball/study/axes.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

constexpr const char* profile_schema = "flyball.profile/1";
constexpr const char* axes_schema = "flyball.axes/1";

struct ProfileOptions {
  CommonOptions common;
  std::string path;
  std::string synchronize;
  std::string least;
  std::vector<study::Override> given;
};

int finish(int status, const ProfileOptions& options) {
  if (status == success && options.common.out.empty() && !options.common.json) {
    print("\n--out DIR draws it, with its table as CSV and as C++\n");
  }
  return status;
}

/// Of a file, or why the command line fits none.
ExpectedAll<study::AxesJob> axes_job(const ProfileOptions& options) {
  std::vector<study::Override> of_all;
  for (const study::Override& option : options.given) {
    if (option.option != "--period") {
      return tl::unexpected(Error(ArgumentError::malformed)
                                .about(option.option)
                                .got("given with " + options.path)
                                .expected("in the file, of one of its axes"));
    }
    of_all.push_back(option);
  }
  if (!options.synchronize.empty()) {
    of_all.push_back({"--synchronize", options.synchronize});
  }
  if (!options.least.empty()) {
    of_all.push_back({"--least", options.least});
  }
  return study::axes_job(options.path, of_all);
}

int run_axes(const ProfileOptions& options) {
  const auto job = axes_job(options);
  if (!job) {
    return fail(job.error(), options.common, axes_schema);
  }
  const auto result = study::plan_axes(*job);
  if (!result) {
    return fail(result.error(), options.common, axes_schema);
  }
  return finish(tell(study::answer_of(*result), options.common, false), options);
}

int run_profile(const ProfileOptions& options) {
  if (const std::string& out = options.common.out; !out.empty()) {
    if (const auto folder = OutputFolder::create(out); !folder) {
      return fail(folder.error(), options.common, profile_schema);
    }
  }
  if (!options.path.empty()) {
    return run_axes(options);
  }
  for (const auto& [name, value] :
       {std::pair("--synchronize", &options.synchronize), {"--least", &options.least}}) {
    if (!value->empty()) {
      return fail(Error(ArgumentError::malformed)
                      .about(name)
                      .got("given without a file")
                      .expected("a file of several axes: flyball profile AXES.toml"),
                  options.common, profile_schema);
    }
  }
  const auto job = study::profile_job(options.given);
  if (!job) {
    return fail(job.error(), options.common, profile_schema);
  }
  const auto result = study::plan_profile(*job);
  if (!result) {
    return fail(result.error(), options.common, profile_schema);
  }
  return finish(tell(study::answer_of(*result), options.common, false), options);
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
      "\n  flyball profile --to 2m --kv 4.2 --ka 0.4 --kind exponential --out lift"
      "\n"
      "\nSeveral axes that arrive at once (or, with --synchronize phase, move along a straight "
      "line) stand\nin a file, each with the keys that are options here:"
      "\n"
      "\n  [[axis]]"
      "\n  name = \"lift\""
      "\n  to = \"1.2 m\""
      "\n  velocity = \"1.5 m/s\""
      "\n  acceleration = \"3 m/s^2\""
      "\n"
      "\n  [[axis]]"
      "\n  name = \"arm\""
      "\n  angle = true"
      "\n  from = \"-20 deg\""
      "\n  to = \"90 deg\""
      "\n  velocity = \"3 rad/s\""
      "\n  acceleration = \"10 rad/s^2\""
      "\n"
      "\n  [profile]"
      "\n  synchronize = \"time\"");
  auto options = std::make_shared<ProfileOptions>();
  options->common.typed = invocation.typed;
  command->add_option("AXES", options->path, "A file of several axes, in place of the options");
  add_field_options(*command, study::profile_fields(), options->given);
  command
      ->add_option("--synchronize", options->synchronize,
                   "Of AXES. time: they arrive at once; phase: they move along a straight line")
      ->type_name("HOW");
  command->add_option("--least", options->least, "Of AXES: they take at least so long")
      ->type_name("TIME");
  add_common_options(*command, options->common,
                     "Write the report into this folder: picture, CSV, C++ table");
  command->callback([options, &invocation] {
    invocation.status = guarded([&] { return run_profile(*options); }, options->common,
                                profile_schema, "the profile");
  });
}

}  // namespace flyball::app
