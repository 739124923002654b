#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/text.hpp>
#include <flyball/core/version.hpp>
#include <flyball/study/loop_study.hpp>

#include "commands.hpp"
#include "console.hpp"
#include "help_text.hpp"
#include "progress_line.hpp"
#include "session.hpp"

namespace {

// CLI11 answers a mistyped command with "a subcommand is required"; this names the nearest one.
std::string unknown_command(const CLI::App& program, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') {
    return {};
  }
  std::vector<std::string_view> names;
  for (const CLI::App* command : program.get_subcommands({})) {
    names.push_back(command->get_name());
  }
  const std::string_view wanted = argv[1];
  if (std::find(names.begin(), names.end(), wanted) != names.end()) {
    return {};
  }
  std::error_code ignored;
  if (std::filesystem::is_regular_file(wanted, ignored)) {
    return fmt::format("\"{}\" is a file, not a command; try \"flyball {} {}\"", wanted,
                       wanted.ends_with(".toml") ? "design" : "tune", wanted);
  }
  const std::string nearest = flyball::nearest_name(wanted, names);
  return fmt::format("\"{}\" is not a command; {}", wanted,
                     nearest.empty() ? fmt::format("commands are {}", fmt::join(names, ", "))
                                     : fmt::format("did you mean \"{}\"?", nearest));
}

/// Help as wide as what shows it, and in the signs that it shows.
std::string for_terminal(const std::string& help) {
  const auto style = flyball::app::terminal_style();
  return flyball::app::folded_help(style.ascii ? flyball::ascii(help) : help, style.width);
}

int run(int argc, char** argv) {
  CLI::App program{
      "Flyball takes a mechanism from its first log, or from its drawing, to a controller that "
      "has\n"
      "been proven before it touches the robot.\n"
      "\n"
      "  flyball tune arm.json                      a log of an arm, to gains, report and C++\n"
      "  flyball tune lift.wpilog --mechanism elevator --period 20ms --out report/\n"
      "  flyball identify shooter.json --json       only the gains, for other programs\n"
      "  flyball identify season/ --out season-gains    each log of a folder, by itself\n"
      "  flyball merge part1 part2 --out whole      the parts of several machines\n"
      "  flyball design elevator.toml               no robot yet: mass, gearing and motors\n"
      "  flyball estimate swing.csv pendulum.toml   states from a log, by filter and smoother\n"
      "  flyball simulate pendulum.toml             a mechanism, or a model by formula\n"
      "  flyball experiment elevator.toml           which tests tell the gains best\n"
      "  flyball size elevator.toml                 the best gear ratio, by simulated motions\n"
      "  flyball drive robot.toml                   a drivetrain that follows a trajectory\n"
      "  flyball optimize robot.toml                its fastest trajectory; or Choreo's .traj\n"
      "  flyball motors krakenX60                   what the motor table knows\n"
      "  flyball motor-curves cim.csv               a motor's constants from a dynamometer\n"
      "  flyball units velocity                     the units that quantities are read in\n"
      "  flyball localize Robot1/                   a drive among landmarks, to path and map\n"
      "  flyball analyze elevator.toml              poles, what can be moved and seen, gains\n"
      "  flyball bode \"2/(s^2+3*s+2)*exp(-0.1*s)\"   margins and curves of a loop; sisotool: all "
      "of it\n"
      "  flyball pidtune \"exp(-s)/(s+1)\" --form pi  PID gains of a plant, and their loop\n"
      "  flyball path Score.path                    a path of a planning tool, timed and shown\n"
      "  flyball states machine.toml                can events lead mechanisms astray?\n"
      "  flyball profile --to 2m --kv 4 --ka 0.4    a motion from state to state, and its table\n"
      "  flyball plan space.toml                    a way through a configuration space, and its "
      "motion\n"
      "  flyball solve dare < problems.jsonl        any kernel, from any language\n"
      "  flyball book 6.3                           a figure of the book, from this library\n"
      "\n"
      "Results go to standard output, errors to standard error. Exit status: 0 success, 1 the "
      "input\n"
      "is well formed but the answer is no (a log without motion), 2 bad usage or malformed input.",
      "flyball"};
  program.set_version_flag("--version", "flyball " + std::string(flyball::version));
  program.require_subcommand(1);

  flyball::app::Invocation invocation{
      .typed = flyball::app::typed_command({argv, static_cast<std::size_t>(argc)})};
  flyball::app::add_identify_command(program, invocation);
  flyball::app::add_merge_command(program, invocation);
  flyball::app::add_design_command(program, invocation);
  flyball::app::add_simulate_command(program, invocation);
  flyball::app::add_size_command(program, invocation);
  flyball::app::add_drive_command(program, invocation);
  flyball::app::add_optimize_command(program, invocation);
  flyball::app::add_tune_command(program, invocation);
  flyball::app::add_estimate_command(program, invocation);
  flyball::app::add_experiment_command(program, invocation);
  flyball::app::add_motors_command(program, invocation);
  flyball::app::add_motor_curves_command(program, invocation);
  flyball::app::add_localize_command(program, invocation);
  flyball::app::add_book_command(program, invocation);
  flyball::app::add_analyze_command(program, invocation);
  flyball::app::add_loop_commands(program, invocation);
  flyball::app::add_path_command(program, invocation);
  flyball::app::add_states_command(program, invocation);
  flyball::app::add_profile_command(program, invocation);
  flyball::app::add_plan_command(program, invocation);
  flyball::app::add_solve_command(program, invocation);
  flyball::app::add_units_command(program, invocation);
  flyball::app::add_help_commands(program, invocation);

  const auto refuse = [&](const std::string& text) {
    for (int i = 1; i < argc; ++i) {
      if (std::string_view(argv[i]) == "--json") {
        flyball::app::print_usage_error(text);
        break;
      }
    }
    flyball::app::say(text);
    return flyball::app::bad_input;
  };
  if (const std::string unknown = unknown_command(program, argc, argv); !unknown.empty()) {
    return refuse(flyball::shortened(unknown));
  }
  const flyball::app::ProgressLine progress;
  try {
    program.parse(argc, argv);
  } catch (const CLI::Success& answer) {
    std::ostringstream words;
    const int status = program.exit(answer, words, words);
    if (!words.str().empty()) {  // what `--schema` prints is printed
      flyball::app::print(for_terminal(words.str()));
    }
    return status;
  } catch (const CLI::ParseError& problem) {
    if (argc < 2) {  // as git does: who does not know a command is told them all
      std::fputs(for_terminal(program.help()).c_str(), stderr);
      return flyball::app::bad_input;
    }
    const auto commands = program.get_subcommands();
    const std::string command = commands.empty() ? "" : commands.front()->get_name();
    return refuse(fmt::format("{}{}{}\n`flyball{}{} --help` tells what it takes.", command,
                              command.empty() ? "" : ": ", flyball::shortened(problem.what()),
                              command.empty() ? "" : " ", command));
  }
  return invocation.status;
}

/// Memory may not have come back: the last words take none.
int give_up_for_memory() noexcept {
  try {
    flyball::app::tell(flyball::not_enough_memory("this"));
  } catch (...) {
    std::fputs("flyball: not enough memory for this\n", stderr);
  }
  return flyball::app::bad_input;
}

/// `flyball help NAME` is `flyball NAME --help`.
std::vector<char*> with_help_last(int argc, char** argv) {
  std::vector<char*> arguments(argv, argv + argc);
  static std::string flag = "--help";
  if (argc >= 2 && std::string_view(argv[1]) == "help") {
    arguments.erase(arguments.begin() + 1);
    arguments.push_back(flag.data());
  }
  arguments.push_back(nullptr);
  return arguments;
}

/// "-(s + 2)/(s + 1)" and "-2/s", which begin as an option does.
bool is_negative_expression(std::string_view text) {
  constexpr std::string_view begins = "([.0123456789sz";
  return text.size() > 2 && text[0] == '-' && begins.find(text[1]) != std::string_view::npos &&
         text.find_first_of("()[]*/^") != std::string_view::npos;
}

/// CLI11 takes "[1]/[1 2]" for a list of its own, and "-(s + 2)" for an option; behind a blank each
/// is the text that it was.
void keep_coefficients(std::vector<char*>& arguments, std::vector<std::string>& texts) {
  const std::string_view command = arguments.size() > 2 ? arguments[1] : "";
  const auto& views = flyball::study::loop_views;
  if (std::none_of(views.begin(), views.end(),
                   [&](auto view) { return to_string(view) == command; })) {
    return;
  }
  texts.reserve(arguments.size());
  for (char*& argument : arguments) {
    const std::string_view text = argument == nullptr ? "" : argument;
    if ((text.starts_with('[') && text.ends_with(']')) || is_negative_expression(text)) {
      texts.push_back(" " + std::string(text));
      argument = texts.back().data();
    }
  }
}

int guarded_run(int argc, char** argv) {
  try {
    flyball::app::begin_session();
    std::vector<char*> arguments = with_help_last(argc, argv);
    std::vector<std::string> texts;
    keep_coefficients(arguments, texts);
    return run(static_cast<int>(arguments.size()) - 1, arguments.data());
  } catch (const std::exception& defect) {
    if (flyball::app::lacks_memory(defect)) {
      return give_up_for_memory();
    }
    flyball::app::say(std::string("a defect of Flyball: ") + defect.what());
  } catch (...) {
    flyball::app::say("a defect of Flyball");
  }
  return flyball::app::bad_input;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return flyball::app::end_session(guarded_run(argc, argv));
  } catch (const std::bad_alloc&) {
    return give_up_for_memory();
  }
}
