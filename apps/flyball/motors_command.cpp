#include <memory>

#include <flyball/io/json_writer.hpp>
#include <flyball/mechanisms/motor.hpp>
#include <flyball/report/terminal.hpp>

#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

struct Options {
  CommonOptions common;
  std::string name;
};

constexpr const char* schema = "flyball.motors/1";

void write(JsonWriter& json, const mechanisms::DcMotor& motor) {
  json.object([&] {
    json.add("name", motor.name);
    json.add("nominal_voltage", motor.nominal_voltage);
    json.add("stall_torque", motor.stall_torque);
    json.add("stall_current", motor.stall_current);
    json.add("free_current", motor.free_current);
    json.add("free_speed", motor.free_speed);
    json.add("R", motor.R);
    json.add("Kt", motor.Kt);
    json.add("Kv", motor.Kv);
  });
}

int run(const Options& options) {
  std::vector<mechanisms::DcMotor> motors;
  if (options.name.empty()) {
    for (const mechanisms::MotorTableEntry& entry : mechanisms::motor_table()) {
      motors.push_back(mechanisms::motor(entry.name).value());
    }
  } else {
    auto motor = mechanisms::motor(options.name);
    if (!motor) {
      return fail(motor.error(), options.common, schema);
    }
    motors.push_back(*std::move(motor));
  }
  if (options.common.json) {
    JsonWriter json;
    json.object([&] {
      json.add("schema", schema);
      json.list("motors", motors, [&](const auto& motor) { write(json, motor); });
    });
    print(json.text());
    return success;
  }
  print(report::motors_to_terminal(motors, terminal_style()));
  return success;
}

}  // namespace

void add_motors_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command =
      program.add_subcommand("motors", "List the motors by their datasheet numbers");
  auto options = std::make_shared<Options>();
  command->add_option("NAME", options->name,
                      "One motor; case, spaces and punctuation do not matter (krakenX60foc)");
  command->add_flag("--json", options->common.json, "Answer one JSON object on one line");
  command->callback([options, &invocation] { invocation.status = run(*options); });
}

}  // namespace flyball::app
