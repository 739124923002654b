#include <flyball/study/optimize.hpp>
#include <flyball/study/project.hpp>

#include "job_command.hpp"

namespace flyball::app {

namespace {

ExpectedAll<Answer> run_optimize(JobInput& input) {
  const auto job = study::optimize_job(input.path, input.given);
  if (!job) {
    return tl::unexpected(job.error());
  }
  return ExpectedAll<study::OptimizeResult>(study::optimize(*job)).map([](const auto& result) {
    return study::answer_of(result);
  });
}

}  // namespace

void add_optimize_command(CLI::App& program, Invocation& invocation) {
  add_job_command(
      program, invocation,
      {.name = "optimize",
       .schema = "flyball.optimize/1",
       .help = "Find the fastest trajectory of a drivetrain through waypoints",
       .footer = "FILE is a project, for example:\n"
                 "  [drive]\n"
                 "  type = \"swerve\"                # or differential, mecanum\n"
                 "  motor = \"Kraken X60\"\n"
                 "  gearing = 6.75\n"
                 "  wheel_radius = \"2 in\"\n"
                 "  mass = \"54 kg\"\n"
                 "  moment_of_inertia = \"6 kg m^2\"\n"
                 "  trackwidth = \"0.6 m\"\n"
                 "  stator_limit = \"80 A\"\n"
                 "\n"
                 "  [optimize]\n"
                 "  waypoints = [\"1 m, 1 m, 0 deg\", \"3 m, 2 m\", \"5 m, 1 m, 90 deg\"]\n"
                 "  keep_out = [\"3 m, 1 m, 0.4 m\"]  # x, y, radius, or the corners of a polygon\n"
                 "\n"
                 "or a trajectory of Choreo (.traj), whose samples are found anew, or a project of "
                 "Choreo\n"
                 "(.chor) with all its trajectories. With --out the trajectories are written, too.",
       .job = study::JobKind::optimize,
       .file = "FILE",
       .file_help = "A project file (TOML), or Choreo's .traj or .chor",
       .report = "Write the report into this folder: pictures, animation, CSV and .traj files",
       .reports_unasked = false,
       .run = &run_optimize});
}

}  // namespace flyball::app
