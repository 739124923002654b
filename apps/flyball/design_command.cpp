#include <memory>
#include <string_view>

#include <flyball/core/quantity.hpp>
#include <flyball/study/project.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"
#include "design_options.hpp"

namespace flyball::app {

namespace {

constexpr const char* schema = "flyball.design/1";

struct Options {
  CommonOptions common;
  DesignOptions design;
  std::string project;
};

Expected<double> option_quantity(const std::string& text, Dimension dimension, const char* option,
                                 bool zero_allowed) {
  auto value = parse_quantity(text, dimension, option);
  if (value && !(*value > 0.0 || (zero_allowed && *value == 0.0))) {
    return tl::unexpected(Error(ArgumentError::not_positive)
                              .about(option)
                              .got(text)
                              .expected(zero_allowed ? "zero or greater" : "greater than zero"));
  }
  return value;
}

int run(const Options& options) {
  auto project = study::read_project(options.project);
  if (!project) {
    const std::string_view path = options.project;
    const bool log = path.ends_with(".json") || path.ends_with(".wpilog") || path.ends_with(".csv");
    Error error = std::move(project).error();
    if (log && error.is(study::ProjectError::syntax)) {
      constexpr const char* mend =
          "a log goes to `flyball tune`, a linear model to `flyball analyze`";
      return fail(std::move(error).hint(mend), options.common, schema);
    }
    return fail(error, options.common, schema);
  }
  if (project->plant_error) {
    return fail(*project->plant_error, options.common, schema);
  }
  if (auto applied = apply(options.design, project->job); !applied) {
    return fail(applied.error(), options.common, schema);
  }
  auto result = study::design(project->job);
  if (!result) {
    return fail(result.error(), options.common, schema);
  }
  return answer(*result, &report::write_design_report, options.common, true, schema);
}

}  // namespace

void add_design_options(CLI::App& command, DesignOptions& options) {
  command.add_option("--period", options.period, "Period of the control loop, such as 20ms")
      ->type_name("TIME");
  command
      .add_option("--delay", options.delay,
                  "Delay from sensing to acting, such as 15ms (from the log if absent)")
      ->type_name("TIME");
  command.add_option("--max-voltage", options.max_voltage, "Largest voltage, such as 12V")
      ->type_name("VOLTAGE");
  command.add_option("--seed", options.seed, "Seed of the simulation's noise")->type_name("N");
}

Expected<void> apply(const DesignOptions& options, study::DesignJob& job) {
  const auto set = [](const std::string& text, Dimension dimension, const char* option,
                      auto&& assign, bool zero_allowed = false) -> Expected<void> {
    if (text.empty()) {
      return {};
    }
    return option_quantity(text, dimension, option, zero_allowed).map(assign);
  };
  if (auto period = set(options.period, Dimension::time, "--period",
                        [&](double value) { job.controller.period = value; });
      !period) {
    return period;
  }
  if (auto delay = set(
          options.delay, Dimension::time, "--delay",
          [&](double value) { job.controller.delay = value; }, true);
      !delay) {
    return delay;
  }
  if (options.seed != 0) {
    job.seed = options.seed;
  }
  return set(options.max_voltage, Dimension::voltage, "--max-voltage",
             [&](double value) { job.controller.max_voltage = value; });
}

void add_design_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "design", "Design a controller from a project file: mass, gearing and motors, or gains");
  command->footer(
      "PROJECT.toml, for example:\n"
      "  [mechanism]\n"
      "  type = \"elevator\"\n"
      "  motor = \"NEO\"\n"
      "  motor_count = 2\n"
      "  gearing = 10.0            # motor turns per drum turn\n"
      "  mass = \"8 kg\"\n"
      "  drum_radius = \"1 in\"\n"
      "\n"
      "  [controller]\n"
      "  period = \"20 ms\"\n"
      "  state_tolerance = [\"2 cm\", \"0.4 m/s\"]   # leave out to have them chosen");
  auto options = std::make_shared<Options>();
  options->common.typed = invocation.typed;
  command->add_option("PROJECT", options->project, "The project file")->required();
  add_design_options(*command, options->design);
  add_common_options(*command, options->common,
                     "Write the report into this folder (flyball-report if absent)");
  command->callback([options, &invocation] { invocation.status = run(*options); });
}

}  // namespace flyball::app
