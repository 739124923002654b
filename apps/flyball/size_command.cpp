#include <flyball/study/project.hpp>
#include <flyball/study/size.hpp>

#include "job_command.hpp"

namespace flyball::app {

namespace {

ExpectedAll<Answer> run_size(JobInput& input) {
  const auto job = study::size_job(input.path, input.given);
  if (!job) {
    return tl::unexpected(job.error());
  }
  return ExpectedAll<study::SizeResult>(study::size(*job)).map([](const auto& result) {
    return study::answer_of(result);
  });
}

}  // namespace

void add_size_command(CLI::App& program, Invocation& invocation) {
  add_job_command(
      program, invocation,
      {.name = "size",
       .schema = "flyball.size/1",
       .help = "Find a mechanism's best gear ratio, by its fastest motions",
       .footer =
           "PROJECT.toml, for example:\n"
           "  [mechanism]\n"
           "  type = \"elevator\"\n"
           "  motor = \"NEO\"\n"
           "  motor_count = 2\n"
           "  mass = \"8 kg\"\n"
           "  drum_radius = \"1 in\"          # a gearing may be there, and is compared\n"
           "\n"
           "  [size]\n"
           "  end = \"1.2 m\"                 # from rest to rest\n"
           "  stator_limit = \"60 A\"\n"
           "  supply_limit = \"40 A\"\n"
           "\n"
           "Every number is of a simulated motion: full push, then full brake, with back-EMF,\n"
           "current limits, the battery's sag, friction, gravity and gears.",
       .job = study::JobKind::size,
       .file = "PROJECT",
       .file_help = "The project file",
       .report = "Write the report into this folder: pictures, the sweeps as CSV",
       .reports_unasked = false,
       .run = &run_size});
}

}  // namespace flyball::app
