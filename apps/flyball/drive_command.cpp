#include <flyball/study/drive.hpp>
#include <flyball/study/project.hpp>

#include "job_command.hpp"

namespace flyball::app {

namespace {

ExpectedAll<Answer> run_drive(JobInput& input) {
  const auto job = study::drive_job(input.path, input.given);
  if (!job) {
    return tl::unexpected(job.error());
  }
  return ExpectedAll<study::DriveResult>(study::drive(*job)).map([](const auto& result) {
    return study::answer_of(result);
  });
}

}  // namespace

void add_drive_command(CLI::App& program, Invocation& invocation) {
  add_job_command(
      program, invocation,
      {.name = "drive",
       .schema = "flyball.drive/1",
       .help = "Simulate a drivetrain that follows a trajectory, with disturbances",
       .footer =
           "PROJECT.toml, for example:\n"
           "  [drive]\n"
           "  type = \"differential\"          # or swerve, mecanum\n"
           "  motor = \"NEO\"                  # two a side\n"
           "  gearing = 8.45\n"
           "  wheel_radius = \"3 in\"\n"
           "  mass = \"54 kg\"\n"
           "  moment_of_inertia = \"6 kg m^2\"\n"
           "  trackwidth = \"0.6 m\"\n"
           "  waypoints = [\"1 m, 1 m, 0 deg\", \"3 m, 2 m, 45 deg\", \"5 m, 3 m, 0 deg\"]\n"
           "  # or trajectory = \"path.wpilib.json\"; settings = \"settings.json\" of PathPlanner\n"
           "\n"
           "  [disturbance]\n"
           "  left = \"20 cm\"                 # where it starts beside its path\n"
           "  latency = \"40 ms\"",
       .job = study::JobKind::drive,
       .file = "PROJECT",
       .file_help = "The project file",
       .report = "Write the report into this folder: pictures, animation, CSV and a WPILOG",
       .reports_unasked = false,
       .run = &run_drive});
}

}  // namespace flyball::app
