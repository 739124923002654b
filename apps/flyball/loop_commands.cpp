#include <memory>
#include <string>
#include <vector>

#include <flyball/io/output_folder.hpp>
#include <flyball/study/loop_study.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

constexpr const char* loop_schema = "flyball.loop/1";

/// A view's command.
struct LoopCommand {
  study::LoopView view;
  const char* help;
  const char* report;
};

constexpr LoopCommand loop_commands[] = {
    {study::LoopView::bode, "Bode plot and margins of transfer functions",
     "Write the report into this folder: Bode plot, its data"},
    {study::LoopView::nyquist, "Nyquist curves, the count of encirclements, margins",
     "Write the report into this folder: Nyquist curve, its data"},
    {study::LoopView::nichols, "Nichols plot and margins of transfer functions",
     "Write the report into this folder: Nichols plot, its data"},
    {study::LoopView::rlocus, "Root locus: stable gains, where branches meet and cross",
     "Write the report into this folder: root locus, its data"},
    {study::LoopView::step, "Step responses and what they are judged by",
     "Write the report into this folder: step response, its data"},
    {study::LoopView::impulse, "Impulse responses",
     "Write the report into this folder: impulse response, its data"},
    {study::LoopView::margins, "Every gain and phase crossing of a loop, and its margins",
     "Write the report into this folder: margins, Bode plot"},
    {study::LoopView::sisotool, "One page of a loop: root locus, Bode, Nyquist, closed-loop step",
     "Write the page into this folder"},
    {study::LoopView::pidtune, "PID gains of a plant: by robustness, crossover or rule, judged",
     "Write the report into this folder: Bode plot of the loop, its responses"},
};

struct LoopOptions {
  CommonOptions common;
  std::vector<std::string> expressions;
  std::vector<study::Override> given;
  study::LoopView view = study::LoopView::bode;
};

int run_loop(const LoopOptions& options) {
  if (const std::string& out = options.common.out; !out.empty()) {
    if (const auto folder = OutputFolder::create(out); !folder) {
      return fail(folder.error(), options.common, loop_schema);
    }
  }
  const auto answer = study::loop_job(options.view, options.expressions, options.given)
                          .and_then(&study::study_loops)
                          .map([](const auto& result) { return study::answer_of(result); });
  if (!answer) {
    return fail(answer.error(), options.common, loop_schema);
  }
  const int status = tell(*answer, options.common, false);
  if (status == success && options.common.out.empty() && !options.common.json) {
    print("\n--out DIR draws it: pictures, their data, and a page whose plots answer\n");
  }
  return status;
}

}  // namespace

void add_loop_commands(CLI::App& program, Invocation& invocation) {
  for (const LoopCommand& of : loop_commands) {
    CLI::App* command = program.add_subcommand(std::string(to_string(of.view)), of.help);
    command->footer(
        "EXPR is a transfer function in s, or in z with --period: numbers, + - * / ^, parentheses, "
        "exp(-T*s)\n"
        "for dead time, z^-1, coefficients such as [1 2]/[1 3 2]; or a JSON file with expr, or num "
        "and den,\n"
        "and dt, delay. Several dead times stand anywhere: exp(-s)/(s+1) + exp(-0.3*s), "
        "feedback(G, H).\n"
        "Several are shown in one picture. " +
        std::string(of.view == study::LoopView::pidtune
                        ? "EXPR is the plant; the gains are those of a PID controller before it."
                        : "The loop is 1/(1 + k C EXPR), negative feedback.") +
        "\n"
        "\n  flyball " +
        std::string(to_string(of.view)) + " \"2/(s^2+3*s+2)" +
        (of.view == study::LoopView::rlocus ? "\"" : "*exp(-0.1*s)\"") + " --out report");
    auto options = std::make_shared<LoopOptions>();
    options->view = of.view;
    options->common.typed = invocation.typed;
    command->add_option("EXPR", options->expressions, "Transfer functions, or JSON files of them");
    add_field_options(*command, study::loop_fields(of.view), options->given);
    add_common_options(*command, options->common, of.report);
    command->callback([options, &invocation] {
      invocation.status = guarded([&] { return run_loop(*options); }, options->common, loop_schema,
                                  "the transfer functions");
    });
  }
}

}  // namespace flyball::app
