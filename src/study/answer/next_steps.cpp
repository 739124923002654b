// What a person does with an answer, in plain words.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <flyball/export/generated_loop.hpp>

#include "core/wording.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using identification::FeedforwardFit;
using identification::TestKind;
using text::number;
using text::seconds;

Section steps_section(std::vector<std::string> steps) {
  return {"next", "What to do next", {Steps{std::move(steps)}}};
}

/// The tests that a log lacks: "dynamic-forward and dynamic-reverse".
std::string missing_tests(const IdentifyResult& result) {
  std::vector<std::string> missing;
  for (const TestKind kind : {TestKind::quasistatic_forward, TestKind::quasistatic_reverse,
                              TestKind::dynamic_forward, TestKind::dynamic_reverse}) {
    const auto& runs = result.source.recording.runs;
    if (std::none_of(runs.begin(), runs.end(), [&](const auto& run) { return run.kind == kind; })) {
      missing.emplace_back(to_string(kind));
    }
  }
  return text::enumerate(missing);
}

/// What to look at in a fit, and what to record for a better one.
void add_fit_steps(std::vector<std::string>& steps, const IdentifyResult& result) {
  steps.emplace_back(
      "Look at the runs under Gains: the dashed simulated velocity should lie on the measured one, "
      "and what is left of it should look like noise. If it does not, the gains describe another "
      "mechanism than yours.");
  if (result.drive) {
    return;
  }
  if (const std::string missing = missing_tests(result); !missing.empty()) {
    steps.push_back(
        fmt::format("Record what is missing, {}, and put it into the log: the gains "
                    "become surer with all four tests.",
                    missing));
  }
  const FeedforwardFit& fit = *result.report.fit;
  if (!fit.kA.determined) {
    steps.emplace_back(
        "kA is not known. If you want it, record the dynamic tests with a higher step of voltage "
        "and a faster log; without it the controller is more careful than it could be.");
  }
}

void add_design_steps(std::vector<std::string>& steps, const DesignResult& result) {
  const PlantDescription& plant = result.job.plant;
  const ControllerOptions& controller = result.job.controller;
  const std::string period = seconds(controller.period);
  if (verdict_of(result).tone == Tone::bad) {
    steps.emplace_back(
        "Do not run this controller. Loosen the tolerances (--state-tolerance), or leave them out "
        "to have them chosen, and design again.");
    return;
  }
  const std::string unit = controlled_unit(plant);
  steps.push_back(fmt::format(
      "Bring the loop into the robot's program: {0}.hpp in this report's folder is the whole loop "
      "in C++, {0}.java in Java, the .py file in Python, to be called every {1}; or paste the "
      "constants above into the library that you use.",
      exports::loop_class_name(plant.kind), period));
  steps.push_back(fmt::format(
      "Before it may move, check by hand that a positive voltage moves the mechanism in its "
      "positive direction and that the sensor then counts up, in {}.",
      unit));
  steps.push_back(fmt::format(
      "First run with little: a limit of {} V, a small goal, and a hand on the disable button. "
      "Then raise the limit to {} V.",
      number(std::ceil(controller.max_voltage / 3.0)), number(controller.max_voltage)));
  const FastestMotion& motion = result.motion;
  steps.push_back(fmt::format(
      "Let the motion's profile ask for no more than {} {}/s and {} {}/s²: the voltage can follow "
      "that.",
      number(motion.max_velocity, 3), plant.unit, number(motion.max_acceleration, 3), plant.unit));
  if (result.feedback) {
    steps.push_back(fmt::format(
        "Record a move and compare: here the error was {} {} at most. Several times that says that "
        "the mechanism has changed or that the loop is later than the {} of delay that it was "
        "designed for; identify it again.",
        number(result.tracking_error_max, 2), unit, seconds(controller.delay.value_or(0.0))));
  }
  steps.emplace_back(
      "gains.toml in this report's folder is a project file: change what you want otherwise, such "
      "as state_tolerance, and run flyball design gains.toml.");
}

}  // namespace

Section next_steps(const IdentifyResult& result, const DesignResult* design, bool refused) {
  std::vector<std::string> steps;
  const bool fitted = result.drive ? result.drive->fit.has_value() : result.report.fit.has_value();
  if (!fitted) {
    return steps_section(
        {"Read the reason in the first line: it names what the log lacks.",
         "Look at the runs as they were recorded, under Data: does the mechanism move when there "
         "is a voltage, in the direction that the voltage asks for, and are the units right?",
         "Record the log again with what was missing, and run the same command."});
  }
  add_fit_steps(steps, result);
  if (design != nullptr) {
    add_design_steps(steps, *design);
  } else if (refused) {
    steps.emplace_back(
        "No controller could be designed: the first lines say why. Change what they name, in a "
        "project file or on the command line, and run the same command.");
  } else if (!result.drive) {
    steps.emplace_back(
        "Design the controller: flyball tune with the same log, or flyball design with gains.toml "
        "of this report's folder.");
  }
  return steps_section(std::move(steps));
}

Section next_steps(const DesignResult& result) {
  std::vector<std::string> steps;
  add_design_steps(steps, result);
  return steps_section(std::move(steps));
}

}  // namespace flyball::study
