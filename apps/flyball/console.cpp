#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <system_error>

#include <sys/ioctl.h>
#include <unistd.h>

#include <flyball/core/text.hpp>
#include <flyball/io/json_writer.hpp>

#include "console.hpp"
#include "progress_line.hpp"

namespace flyball::app {

int exit_status(const Error& error) {
  return error.kind() == ErrorKind::no_answer ? no_answer : bad_input;
}

namespace {

std::string quoted_for_shell(std::string_view word) {
  constexpr std::string_view plain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-./=:,+@%";
  if (!word.empty() && word.find_first_not_of(plain) == std::string_view::npos) {
    return std::string(word);
  }
  std::string quoted = "'";
  for (const char c : word) {
    quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return quoted + "'";
}

// Channels have names such as "/Arm/AppliedVolts", which are no paths.
bool takes_channel(std::string_view option) {
  const auto fields = study::fields_of(study::JobKind::identify);
  return std::any_of(fields.begin(), fields.end(), [&](const study::FieldInfo& field) {
    return field.option == option && field.value == "CHANNEL";
  });
}

}  // namespace

std::string typed_command(std::span<const char* const> arguments) {
  std::string typed = "flyball";
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    std::string_view value = arguments[i];
    std::string_view option = arguments[i - 1];
    std::string word;
    if (const std::size_t equals = value.find('=');
        value.starts_with("--") && equals != std::string_view::npos) {
      option = value.substr(0, equals);
      word = value.substr(0, equals + 1);
      value.remove_prefix(equals + 1);
    }
    if (value.starts_with('/') && !takes_channel(option)) {
      while (value.size() > 1 && value.back() == '/') {
        value.remove_suffix(1);
      }
      value.remove_prefix(value.rfind('/') + 1);
    }
    typed += ' ' + quoted_for_shell(word.append(value));
  }
  return typed;
}

void add_common_options(CLI::App& command, CommonOptions& options, const std::string& report) {
  command.add_flag("--json", options.json, "Answer one JSON object on one line (docs/schemas.md)");
  command.add_option("--out", options.out, report)
      ->type_name("DIR")
      ->check([](const std::string& folder) {
        return folder.empty() ? std::string("a folder's name is needed") : std::string();
      });
}

void add_field_options(CLI::App& command, study::JobKind job, std::vector<study::Override>& given) {
  add_field_options(command, study::fields_of(job), given);
}

void add_field_options(CLI::App& command, const std::vector<study::FieldInfo>& fields,
                       std::vector<study::Override>& given) {
  for (const study::FieldInfo& field : fields) {
    std::string help = field.help;
    if (field.value.empty()) {
      // --flag, or --flag=false against a file that says true.
      command
          .add_flag_function(
              field.option,
              [&given, option = field.option](std::int64_t count) {
                given.push_back({option, count > 0 ? "true" : "false"});
              },
              help)
          ->group("[" + field.section + "]");
      continue;
    }
    help += ", such as " + field.example;
    if (!field.absent.empty()) {
      help += " [" + field.absent + "]";
    }
    command
        .add_option_function<std::string>(
            field.option,
            [&given, option = field.option](const std::string& text) {
              given.push_back({option, text});
            },
            help)
        ->type_name(field.value)
        ->group("[" + field.section + "]");
  }
}

namespace {

/// A variable that is set to something, or nothing.
const char* environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr || *value == '\0' ? nullptr : value;
}

/// Whether what reads this file shows ASCII alone.
bool shows_ascii_alone(int file) {
  const char* locale = nullptr;
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    locale = locale == nullptr ? environment(name) : locale;
  }
  if (locale == nullptr) {
    return ::isatty(file) == 1;
  }
  std::string folded;
  for (const char c : std::string_view(locale)) {
    folded += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return folded.find("utf-8") == std::string::npos && folded.find("utf8") == std::string::npos;
}

std::size_t columns() {
  constexpr std::size_t narrowest = 40;
  constexpr std::size_t widest = 160;
  constexpr std::size_t ordinary = 100;
  std::size_t found = 0;
  if (const char* given = environment("COLUMNS")) {  // what is asked for goes before what is there
    found = std::strtoul(given, nullptr, 10);
  }
  winsize size{};
  if (found == 0 && ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0) {
    found = size.ws_col;
  }
  return found == 0 ? ordinary : std::clamp(found, narrowest, widest);
}

}  // namespace

report::TerminalStyle terminal_style() {
  return {.color = environment("NO_COLOR") == nullptr && ::isatty(STDOUT_FILENO) == 1,
          .width = columns(),
          .ascii = shows_ascii_alone(STDOUT_FILENO)};
}

void print_usage_error(const std::string& text) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", "flyball.usage/1");
    json.object("error", [&] {
      json.add("code", "usage");
      json.add("message", text);
    });
  });
  print(json.text());
}

void print(const std::string& text) {
  ProgressLine::end();
  std::fwrite(text.data(), 1, text.size(), stdout);
  if (text.empty() || text.back() != '\n') {
    std::fputc('\n', stdout);
  }
}

int fail(const Errors& errors, const CommonOptions& options, const std::string& schema) {
  if (options.json) {
    print(refusal_json(schema, errors));
  }
  for (const Diagnostic& diagnostic : errors.diagnostics()) {
    if (diagnostic.severity != Severity::info) {
      warn(diagnostic.message);
    }
  }
  for (const QuotedError& error : errors.all()) {
    std::string text = to_string(error);
    if (!error.excerpt.empty()) {
      // It shows the place, which a formula's error says in bytes, too.
      text = text.substr(0, text.rfind(" (offset = ")) + "\n" + error.excerpt;
    }
    say(text);
  }
  return exit_status(errors);
}

void say(const std::string& text) {
  ProgressLine::end();
  std::fflush(stdout);
  const std::string words = printable(text);
  std::fprintf(stderr, "flyball: %s\n",
               (shows_ascii_alone(STDERR_FILENO) ? ascii(words) : words).c_str());
}

void tell(const Error& error) {
  say(to_string(error));
}

std::optional<std::string> report_folder(const CommonOptions& options, bool by_default) {
  if (!options.out.empty()) {
    return options.out;
  }
  if (by_default && !options.json) {
    return "flyball-report";
  }
  return std::nullopt;
}

void warn(const std::string& text) {
  say("warning: " + text);
}

}  // namespace flyball::app
