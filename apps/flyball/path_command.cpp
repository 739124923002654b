#include <memory>
#include <string>
#include <vector>

#include <flyball/io/file.hpp>
#include <flyball/io/output_folder.hpp>
#include <flyball/study/path.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

constexpr const char* path_schema = "flyball.path/1";

struct PathOptions {
  CommonOptions common;
  std::vector<std::string> files;
  std::vector<study::Override> given;
};

int run_path(const PathOptions& options) {
  const auto job = study::path_job(options.files, options.given);
  if (!job) {
    return fail(job.error(), options.common, path_schema);
  }
  const std::string& out = options.common.out;
  const bool writes = !job->to.empty();
  if (!out.empty() && !writes) {
    if (const auto folder = OutputFolder::create(out); !folder) {
      return fail(folder.error(), options.common, path_schema);
    }
  }
  const auto result = study::plan_path(*job);
  if (!result) {
    return fail(result.error(), options.common, path_schema);
  }
  if (writes) {
    for (const Diagnostic& diagnostic : result->diagnostics) {
      if (diagnostic.severity != Severity::info) {
        warn(diagnostic.message);
      }
    }
    if (out.empty()) {
      print(result->written);
      return success;
    }
    if (const auto done = write_file_atomically(out, result->written); !done) {
      return fail(done.error(), options.common, path_schema);
    }
    if (result->trajectory.samples.empty()) {  // a project has no motion to be told of
      return success;
    }
    CommonOptions told = options.common;
    told.out.clear();
    return tell(study::answer_of(*result), told, false);
  }
  return tell(study::answer_of(*result), options.common, false);
}

}  // namespace

void add_path_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "path", "Time, show and translate paths of Choreo, PathPlanner and WPILib");
  command->footer(
      "FILE is a trajectory (Choreo's .traj, a .chor of 2024, WPILib's JSON, a table as CSV), a "
      "path\n"
      "(PathPlanner's .path), a routine (.auto), or a project file with [drive] and waypoints. "
      "Several\n"
      "are joined. A project file beside others is the robot whose wheels, motors and grip count.\n"
      "\n  flyball path Score.path --out report"
      "\n  flyball path robot.toml Score.path --acceleration 4m/s^2"
      "\n  flyball path Out.traj Back.traj --to wpilib --out auto.json"
      "\n  flyball path Score.path --mirror-sides --to pathplanner --out Score_left.path");
  auto options = std::make_shared<PathOptions>();
  options->common.typed = invocation.typed;
  command->add_option("FILE", options->files, "Files, in the order in which they are driven")
      ->required();
  add_field_options(*command, study::path_fields(), options->given);
  add_common_options(*command, options->common,
                     "Write the report into this folder: pictures, animation, CSV, WPILib's and "
                     "Choreo's file, C++; with --to the file that is written");
  command->callback([options, &invocation] {
    invocation.status =
        guarded([&] { return run_path(*options); }, options->common, path_schema, "the path");
  });
}

}  // namespace flyball::app
