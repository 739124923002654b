#include <memory>
#include <string>

#include <flyball/io/output_folder.hpp>
#include <flyball/study/plan.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"
#include "ompl_search.hpp"

namespace flyball::app {

namespace {

constexpr const char* plan_schema = "flyball.plan/1";

struct PlanOptions {
  CommonOptions common;
  std::string path;
  study::PlanOverrides given;
};

int run_plan(const PlanOptions& options) {
  if (const std::string& out = options.common.out; !out.empty()) {
    if (const auto folder = OutputFolder::create(out); !folder) {
      return fail(folder.error(), options.common, plan_schema);
    }
  }
  const auto job = study::plan_job(options.path, options.given);
  if (!job) {
    return fail(job.error(), options.common, plan_schema);
  }
  const auto result = study::plan(*job, plan_by_ompl);
  if (!result) {
    return fail(result.error(), options.common, plan_schema);
  }
  const int status = tell(study::answer_of(*result), options.common, false);
  if (status == success && options.common.out.empty() && !options.common.json) {
    print("\n--out DIR draws it, with the motion as CSV and as C++\n");
  }
  return status;
}

}  // namespace

void add_plan_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "plan", "Find a way through a mechanism's configuration space, and time it");
  command->footer(
      "SPACE.toml, for example:\n"
      "  [[axis]]\n"
      "  name = \"arm\"\n"
      "  low = \"-135 deg\"\n"
      "  high = \"135 deg\"\n"
      "  velocity = \"3 rad/s\"           # of all axes: the path is timed, too\n"
      "  acceleration = \"10 rad/s^2\"\n"
      "  error = \"2 deg\"                # by how much it may be off its reference\n"
      "\n"
      "  [[axis]]\n"
      "  name = \"elevator\"\n"
      "  kind = \"length\"\n"
      "  low = \"0 m\"\n"
      "  high = \"5 m\"\n"
      "\n"
      "  [[region]]                     # or [[joint]], [[body]], [[obstacle]]: what must not "
      "touch\n"
      "  name = \"chassis\"\n"
      "  box = { arm = [\"-45 deg\", \"45 deg\"], elevator = [\"0 m\", \"2 m\"] }\n"
      "\n"
      "  [plan]\n"
      "  start = [\"-1 rad\", \"0.5 m\"]\n"
      "  goal = [\"1 rad\", \"0.5 m\"]\n"
      "\n"
      "Every move is free along its whole length. A goal that cannot be reached is told as "
      "proven,\n"
      "or as undecided with what was tried (exit status 1).");
  auto options = std::make_shared<PlanOptions>();
  options->common.typed = invocation.typed;
  command->add_option("SPACE", options->path, "The file of the space")->required();
  command
      ->add_option("--start", options->given.start,
                   "Where it is, a value an axis: \"-1 rad, 0.5 m\"")
      ->type_name("PLACE");
  command->add_option("--goal", options->given.goal, "Where it is to be")->type_name("PLACE");
  command
      ->add_option("--method", options->given.method,
                   "automatic, straight, corners, grid, rrt-connect, rrt-star, roadmap, "
                   "decomposition, or ompl where it is built with it")
      ->type_name("METHOD");
  command
      ->add_option("--traversal", options->given.traversal,
                   "synchronized: along the lines; sequential: on to the next waypoint as soon as "
                   "that is safe")
      ->type_name("HOW");
  command->add_option("--seed", options->given.seed, "Of random searches; 1 if left out")
      ->type_name("N");
  command->add_option("--seconds", options->given.seconds, "When to give up; 10 s if left out")
      ->type_name("TIME");
  add_common_options(*command, options->common,
                     "Write the report into this folder: pictures, CSV, C++");
  command->callback([options, &invocation] {
    invocation.status =
        guarded([&] { return run_plan(*options); }, options->common, plan_schema, options->path);
  });
}

}  // namespace flyball::app
