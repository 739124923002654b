#include <memory>

#include <fmt/format.h>

#include <flyball/core/version.hpp>

#include "commands.hpp"
#include "console.hpp"
#include "manual.hpp"

namespace flyball::app {

void add_help_commands(CLI::App& program, Invocation& invocation) {
  // `help NAME` has become `NAME --help` before it comes here.
  CLI::App* help = program.add_subcommand("help", "Explain a command, or list them all");
  help->add_option("COMMAND", "What to explain");

  CLI::App* version_command = program.add_subcommand("version", "Say which version this is");
  version_command->callback([&invocation] {
    print("flyball " + std::string(version));
    invocation.status = success;
  });

  auto shell = std::make_shared<std::string>();
  CLI::App* complete =
      program.add_subcommand("completion", "Write a shell's completion of commands and options");
  complete->add_option("SHELL", *shell, "bash, zsh or fish")
      ->required()
      ->check([](const std::string& given) {
        return given == "bash" || given == "zsh" || given == "fish"
                   ? std::string()
                   : fmt::format("\"{}\" is not a shell that is known: bash, zsh or fish", given);
      });
  complete->footer(
      "  flyball completion bash > ~/.local/share/bash-completion/completions/flyball");
  complete->callback([&program, &invocation, shell] {
    print(completion(program, *shell));
    invocation.status = success;
  });

  CLI::App* manual = program.add_subcommand("manual", "Write the manual page, for man");
  manual->footer("  flyball manual | man -l -");
  manual->callback([&program, &invocation] {
    print(manual_page(program));
    invocation.status = success;
  });
}

}  // namespace flyball::app
