#include <memory>

#include <flyball/study/motor_curves.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

struct MotorCurvesOptions {
  CommonOptions common;
  study::MotorCurvesJob job{};
  double voltage = 0.0;
};

constexpr const char* motor_curves_schema = "flyball.motor-curves/1";

int run_motor_curves(const MotorCurvesOptions& options) {
  const auto result = study::fit_motor_curves(options.job);
  if (!result) {
    return fail(result.error(), options.common, motor_curves_schema);
  }
  return tell(study::answer_of(*result), options.common, false);
}

}  // namespace

void add_motor_curves_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "motor-curves", "Find a motor's constants in what a dynamometer measured");
  auto options = std::make_shared<MotorCurvesOptions>();
  command
      ->add_option("FILE", options->job.paths,
                   "CSV of speed, torque and current, or of a locked rotor's time, voltage, torque "
                   "and current")
      ->required();
  command->add_option("--motor", options->job.motor,
                      "The motor of the table to compare with; else by the file's name");
  CLI::Option* voltage = command->add_option("--voltage", options->voltage,
                                             "At which a curve was measured, V, if it is not told");
  command->add_flag("--json", options->common.json, "Answer one JSON object on one line");
  command->callback([options, voltage, &invocation] {
    if (voltage->count() > 0) {
      options->job.voltage = options->voltage;
    }
    invocation.status = guarded([&] { return run_motor_curves(*options); }, options->common,
                                motor_curves_schema, options->job.paths.front());
  });
}

}  // namespace flyball::app
