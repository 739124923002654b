#include <memory>

#include <flyball/study/motors.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

struct MotorsOptions {
  CommonOptions common;
  std::string name;
};

constexpr const char* motors_schema = "flyball.motors/1";

int run_motors(const MotorsOptions& options) {
  std::vector<mechanisms::DcMotor> motors;
  if (options.name.empty()) {
    for (const mechanisms::MotorTableEntry& entry : mechanisms::motor_table()) {
      motors.push_back(mechanisms::motor(entry.name).value());
    }
  } else if (auto motor = mechanisms::motor(options.name)) {
    motors.push_back(*std::move(motor));
  } else {
    for (const std::string_view name : mechanisms::motors_like(options.name)) {
      motors.push_back(mechanisms::motor(name).value());
    }
    if (motors.empty()) {
      return fail(motor.error(), options.common, motors_schema);
    }
  }
  return tell(study::answer_of(motors), options.common, false);
}

}  // namespace

void add_motors_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command =
      program.add_subcommand("motors", "List the motors by their datasheet numbers");
  auto options = std::make_shared<MotorsOptions>();
  command->add_option("NAME", options->name,
                      "A motor, or a part of several names (kraken); case, spaces and punctuation "
                      "do not matter (krakenX60foc)");
  command->add_flag("--json", options->common.json, "Answer one JSON object on one line");
  command->callback([options, &invocation] {
    invocation.status =
        guarded([&] { return run_motors(*options); }, options->common, motors_schema, "the motors");
  });
}

}  // namespace flyball::app
