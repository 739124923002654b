#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/quantity.hpp>
#include <flyball/core/text.hpp>
#include <flyball/core/version.hpp>
#include <flyball/mechanisms/motor.hpp>
#include <flyball/solve/kind.hpp>

#include "book/figures.hpp"
#include "manual.hpp"

namespace flyball::app {

namespace {

std::vector<const CLI::App*> commands_of(const CLI::App& program) {
  return program.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<const CLI::Option*> options_of(const CLI::App& command) {
  return command.get_options([](const CLI::Option*) { return true; });
}

/// "--out", "-h --help".
std::vector<std::string> flags_of(const CLI::Option& option) {
  std::vector<std::string> flags;
  for (const std::string& name : option.get_snames()) {
    flags.push_back("-" + name);
  }
  for (const std::string& name : option.get_lnames()) {
    flags.push_back("--" + name);
  }
  return flags;
}

/// What an argument of a command can be, where there is a list; without one it is a file.
std::vector<std::string> values_of(const CLI::App& program, const std::string& command) {
  std::vector<std::string> values;
  if (command == "motors") {
    for (const mechanisms::MotorTableEntry& motor : mechanisms::motor_table()) {
      values.emplace_back(motor.name);
    }
  } else if (command == "solve") {
    for (const solve::Kind& kind : solve::kinds()) {
      values.emplace_back(kind.name);
    }
  } else if (command == "book") {
    for (const book::FigureEntry& figure : book::figures()) {
      values.emplace_back(figure.id);
    }
  } else if (command == "help") {
    for (const CLI::App* other : commands_of(program)) {
      values.push_back(other->get_name());
    }
  } else if (command == "completion") {
    values = {"bash", "zsh", "fish"};
  } else if (command == "units") {
    for (int d = 0; !to_string(static_cast<Dimension>(d)).empty(); ++d) {
      values.emplace_back(to_string(static_cast<Dimension>(d)));
    }
  }
  return values;
}

std::string roff(std::string_view text) {
  std::string out;
  for (const char c : ascii(text)) {
    if (c == '-' || c == '\\') {
      out += c == '-' ? "\\-" : "\\e";
    } else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) {
      out += std::string("\\&") + c;
    } else {
      out += c;
    }
  }
  return out;
}

std::string shell_word(std::string_view word) {
  std::string out = "'";
  for (const char c : word) {
    out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return out + "'";
}

std::string bash(const CLI::App& program) {
  std::vector<std::string> names;
  std::string cases;
  for (const CLI::App* command : commands_of(program)) {
    names.push_back(command->get_name());
    std::vector<std::string> flags;
    for (const CLI::Option* option : options_of(*command)) {
      for (const std::string& flag : flags_of(*option)) {
        flags.push_back(flag);
      }
    }
    std::vector<std::string> values;
    for (const std::string& value : values_of(program, command->get_name())) {
      values.push_back(shell_word(value));
    }
    cases +=
        fmt::format("    {})\n      options={}\n      values=({}) ;;\n", command->get_name(),
                    shell_word(fmt::format("{}", fmt::join(flags, " "))), fmt::join(values, " "));
  }
  return fmt::format(R"sh(# Completion of flyball for bash: source this file, or put it into
# ~/.local/share/bash-completion/completions/flyball
_flyball() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} command=${{COMP_WORDS[1]}} options= value
  local -a values=()
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W {} -- "$word"))
    return
  fi
  case $command in
{}  esac
  case $word in
    -*) COMPREPLY=($(compgen -W "$options" -- "$word")) ;;
    *)
      for value in "${{values[@]}}"; do
        case $value in "$word"*) COMPREPLY+=("$(printf '%q' "$value")") ;; esac
      done ;;
  esac
}}
complete -o default -F _flyball flyball
)sh",
                     shell_word(fmt::format("{}", fmt::join(names, " "))), cases);
}

/// A text in brackets of _arguments, in which colons and brackets mean something.
std::string zsh_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    out += c == '[' || c == ']' || c == ':' ? std::string("\\") + c : std::string(1, c);
  }
  return out;
}

std::string zsh(const CLI::App& program) {
  std::string names;
  std::string cases;
  for (const CLI::App* command : commands_of(program)) {
    names += fmt::format(
        "    {}\n", shell_word(command->get_name() + ":" + zsh_text(command->get_description())));
    cases += fmt::format("    {})\n      _arguments \\\n", command->get_name());
    for (const CLI::Option* option : options_of(*command)) {
      for (const std::string& flag : flags_of(*option)) {
        const bool takes = option->get_type_size() != 0;
        cases += fmt::format(
            "        {} \\\n",
            shell_word(fmt::format("{}[{}]{}", flag, zsh_text(option->get_description()),
                                   takes ? ": :_files" : "")));
      }
    }
    std::vector<std::string> values;
    for (const std::string& value : values_of(program, command->get_name())) {
      std::string escaped;
      for (const char c : value) {
        escaped += c == ' ' || c == '(' || c == ')' ? std::string("\\") + c : std::string(1, c);
      }
      values.push_back(escaped);
    }
    cases +=
        fmt::format("        {} ;;\n",
                    shell_word(values.empty() ? "*: :_files"
                                              : fmt::format("*: :({})", fmt::join(values, " "))));
  }
  return fmt::format(R"sh(#compdef flyball
# Completion of flyball for zsh: a file _flyball in a folder of $fpath
_flyball() {{
  local -a commands=(
{}  )
  if (( CURRENT == 2 )); then
    _describe command commands
    return
  fi
  local command=${{words[2]}}
  shift words
  (( CURRENT-- ))
  case $command in
{}  esac
}}
compdef _flyball flyball
)sh",
                     names, cases);
}

std::string fish(const CLI::App& program) {
  std::string out = "# Completion of flyball for fish: ~/.config/fish/completions/flyball.fish\n";
  for (const CLI::App* command : commands_of(program)) {
    out += fmt::format("complete -c flyball -n __fish_use_subcommand -f -a {} -d {}\n",
                       command->get_name(), shell_word(command->get_description()));
    const std::string seen =
        fmt::format("-n '__fish_seen_subcommand_from {}'", command->get_name());
    for (const CLI::Option* option : options_of(*command)) {
      for (const std::string& name : option->get_lnames()) {
        out += fmt::format("complete -c flyball {} -l {}{} -d {}\n", seen, name,
                           option->get_type_size() != 0 ? " -r" : "",
                           shell_word(option->get_description()));
      }
    }
    for (const std::string& value : values_of(program, command->get_name())) {
      out += fmt::format("complete -c flyball {} -f -a {}\n", seen, shell_word(shell_word(value)));
    }
  }
  return out;
}

}  // namespace

std::string manual_page(const CLI::App& program) {
  std::string page = fmt::format(
      ".TH FLYBALL 1 \"\" \"flyball {}\"\n.SH NAME\nflyball \\- control engineering for robots\n"
      ".SH SYNOPSIS\n.B flyball\n.I COMMAND\n[\\fIOPTIONS\\fR]\n.SH DESCRIPTION\n.nf\n{}\n.fi\n"
      ".SH COMMANDS\n",
      version, roff(program.get_description()));
  for (const CLI::App* command : commands_of(program)) {
    page +=
        fmt::format(".SS {}\n{}.\n", roff(command->get_name()), roff(command->get_description()));
    for (const CLI::Option* option : options_of(*command)) {
      const std::vector<std::string> flags = flags_of(*option);
      const std::string name =
          flags.empty() ? option->get_name() : fmt::format("{}", fmt::join(flags, ", "));
      const std::string value =
          flags.empty() || option->get_type_size() == 0 ? "" : " " + option->get_type_name();
      page += fmt::format(".TP\n\\fB{}\\fR{}\n{}\n", roff(name), roff(value),
                          roff(option->get_description()));
    }
    if (const std::string footer = command->get_footer(); !footer.empty()) {
      page += fmt::format(".PP\n.nf\n{}\n.fi\n", roff(footer));
    }
  }
  page +=
      ".SH EXIT STATUS\n0 success; 1 the input is well formed but the answer is no; 2 bad usage or "
      "malformed input.\n.SH ENVIRONMENT\n.TP\n\\fBNO_COLOR\\fR\nNo colours if it is set.\n.TP\n"
      "\\fBCOLUMNS\\fR\nThe width of the output where the terminal does not tell it.\n";
  return page;
}

std::string completion(const CLI::App& program, const std::string& shell) {
  return shell == "bash" ? bash(program) : shell == "zsh" ? zsh(program) : fish(program);
}

}  // namespace flyball::app
